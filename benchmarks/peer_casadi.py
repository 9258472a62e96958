"""CasADi and IPOPT: the third-order problem as one nonlinear program, as a second opinion on the optimum."""

from __future__ import annotations

import time

import numpy as np
from scipy.interpolate import BPoly

import splinefeed as sf
from benchmarks import cases
from benchmarks.sampled import Profile, Sampled, grid

#: At each end so many cells of the grid become so many that widen from it, as q grows there with s^(4/3).
WIDE, ENDS = 4, 40
ITERATIONS = 300


def plan(path: sf.Path, limits: tuple[float, float, float], nodes: int) -> Profile | None:
    """Least time over q and a = q'/2 at the nodes, a linear between them, constant jerk in time in the end cells.

    None where IPOPT finds none in ITERATIONS.
    """
    import casadi

    feed, acceleration, jerk = limits
    length = feed**2 / acceleration  # so that feed and acceleration become 1
    g = Sampled.of(path, _graded(path, nodes))
    s, r1, r2, r3 = g.s / length, g.r1, g.r2 * length, g.r3 * length**2
    most = jerk * feed / acceleration**2
    h = np.diff(s)
    v0, a0 = _ours(path, limits, g.s)
    start = time.process_time()
    q, a = casadi.SX.sym("q", nodes - 2), casadi.SX.sym("a", nodes - 2)
    rows, low, high = [], [], []

    def hold(row: object, least: float, greatest: float, count: int) -> None:
        rows.append(row)
        low.extend([least] * count)
        high.extend([greatest] * count)

    slope = (a[1:] - a[:-1]) / h[1:-1]
    hold(q[1:] - q[:-1] - h[1:-1] * (a[1:] + a[:-1]), 0.0, 0.0, nodes - 3)
    times = []
    for end, cell, sign in ((0, h[0], 1.0), (nodes - 3, h[-1], -1.0)):
        # s = j t^3/6, v = j t^2/2, a = j t: so t = 3 s/v, q = 1.5 s a, j = a v/(3 s)
        hold(q[end] - sign * 1.5 * cell * a[end], 0.0, 0.0, 1)
        times.append(3.0 * cell / casadi.sqrt(q[end]))
    for axis in range(r1.shape[1]):
        inner = slice(1, -1)
        hold(r1[inner, axis] * a + r2[inner, axis] * q, -1.0, 1.0, nodes - 2)
        for k in (0, 1):  # the jerk at both ends of each cell, with the cell's slope
            at = slice(1 + k, nodes - 2 + k)
            qk, ak = q[k : nodes - 3 + k], a[k : nodes - 3 + k]
            inside = r1[at, axis] * slope + 3.0 * r2[at, axis] * ak + r3[at, axis] * qk
            hold(casadi.sqrt(qk) * inside, -most, most, nodes - 3)
        for end, cell, place in ((0, h[0], 0), (nodes - 3, h[-1], -1)):
            hold(a[end] * casadi.sqrt(q[end]) / (3.0 * cell) * r1[place, axis], -most, most, 1)
    duration = casadi.sum1(2.0 * h[1:-1] / (casadi.sqrt(q[1:]) + casadi.sqrt(q[:-1]))) + times[0] + times[1]
    problem = {"x": casadi.vertcat(q, a), "f": duration, "g": casadi.vertcat(*rows)}
    quiet = {
        "show_eval_warnings": False,
        "ipopt.print_level": 0,
        "print_time": False,
        "ipopt.sb": "yes",
        "ipopt.max_iter": ITERATIONS,
        "ipopt.tol": 1e-9,
    }
    solver = casadi.nlpsol("planner", "ipopt", problem, quiet)
    guess = np.concatenate([(v0[1:-1] / feed) ** 2, a0[1:-1] / acceleration])
    n = nodes - 2
    found = solver(x0=guess, lbg=low, ubg=high, lbx=[1e-10] * n + [-np.inf] * n, ubx=[1.0] * n + [np.inf] * n)
    spent = time.process_time() - start
    if not solver.stats()["success"]:
        return None
    x = np.array(found["x"]).ravel()
    q_all = feed**2 * np.concatenate([[0.0], x[:n], [0.0]])
    a_all = acceleration * np.concatenate([[0.0], x[n:], [0.0]])
    law = _in_time(g.s, q_all, a_all)
    return Profile(law.x[-1], law, spent)


def _graded(path: sf.Path, nodes: int) -> np.ndarray:
    """The common grid, its first and last cells replaced by ones that widen with the cube of their number."""
    even = grid(path, nodes - 2 * (ENDS - WIDE))
    widening = (np.arange(ENDS + 1) / ENDS) ** 3
    first, last = even[WIDE], path.length - even[-1 - WIDE]
    return np.concatenate([first * widening, even[WIDE + 1 : -1 - WIDE], path.length - last * widening[::-1]])


def _in_time(s: np.ndarray, q: np.ndarray, a: np.ndarray) -> BPoly:
    """s(t) as quintics through s, v and a at the nodes."""
    h = np.diff(s)[1:-1]
    slope = np.diff(a)[1:-1] / h
    x, w = np.polynomial.legendre.leggauss(8)
    inside = 0.5 * h[:, None] * (x + 1.0)
    squares = q[1:-2, None] + 2.0 * a[1:-2, None] * inside + slope[:, None] * inside**2
    cells = 0.5 * h * ((1.0 / np.sqrt(squares)) @ w)
    v = np.sqrt(q)
    ends = 3.0 * (s[1] - s[0]) / v[1], 3.0 * (s[-1] - s[-2]) / v[-2]
    t = np.concatenate([[0.0], np.cumsum(np.concatenate([[ends[0]], cells, [ends[1]]]))])
    return BPoly.from_derivatives(t, np.column_stack([s, v, a]))


def _ours(path: sf.Path, limits: tuple[float, float, float], s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    feed, acceleration, jerk = limits
    asked = sf.Limits(feed=feed, axis_velocity=feed, axis_acceleration=acceleration, axis_jerk=jerk)
    law = sf.plan(path, asked, strategy="time-optimal", period=cases.PERIOD)
    t = np.linspace(0.0, law.duration, 20 * len(s))
    return np.interp(s, law(t), law.feed(t)), np.interp(s, law(t), law.acceleration(t))

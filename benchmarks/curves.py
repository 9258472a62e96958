"""Curves beside the two that everyone publishes: what `time-optimal` reaches on each, and `look-ahead` against it."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import splinefeed as sf
from benchmarks.cases import PERIOD, axis_limits
from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.paths.smoothing import smoothed

#: Seconds by IPOPT (third order, no convexity, 1500 nodes) or COPP (1000 nodes), whichever is faster, slowed as a whole
#: until their setpoints hold the limits: `peer_casadi.py`, `peer_copp.py`.
REFERENCE = {
    ("trident", "A"): 4.3464,
    ("trident", "B"): 2.4828,
    ("trident", "C"): 11.6763,
    ("star", "A"): 2.7918,
    ("star", "B"): 1.6592,
    ("star", "C"): 6.8354,
    ("heart", "A"): 2.5989,
    ("heart", "B"): 1.5496,
    ("heart", "C"): 6.0684,
    ("figure eight", "A"): 4.2153,
    ("figure eight", "B"): 2.5305,
    ("figure eight", "C"): 7.9349,
    ("airfoil 0025", "A"): 0.7851,
    ("airfoil 0025", "B"): 0.4563,
    ("airfoil 0025", "C"): 2.2587,
}
#: A plan may take this many times the reference.
ALLOWED = 1.005


def clamped(points: object, size: float, degree: int = 3, weights: object = None) -> sf.Path:
    """A B-spline with even knots, clamped, its control points scaled to `size` mm in their longest direction."""
    points = np.asarray(points, dtype=float)
    inner = np.linspace(0.0, 1.0, len(points) - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    return sf.Path([sf.NurbsCurve(degree, knots, points * (size / np.max(np.ptp(points, axis=0))), weights)])


def mirrored(
    half: list[tuple[float, float]], middle: tuple[tuple[float, float], ...] = ()
) -> list[tuple[float, float]]:
    """The points, those on the axis, and the points once more on its other side."""
    return [*half, *middle, *((-x, y) for x, y in reversed(half))]


def around(count: int, turn: float, *radii: float) -> np.ndarray:
    """Points around the origin with these radii in turn."""
    k = np.arange(count)
    radius, angle = np.array(radii)[k % len(radii)], 0.5 * np.pi + turn * k
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def trident() -> sf.Path:
    """Three tips of a rational cubic."""
    half = [(0.0, 0.0), (1, 4), (0.2, 7), (-2, 6), (-4, 5), (-3.5, 10), (-3, 12), (-2.6, 9), (-1, 7.5), (-0.4, 9)]
    weights = np.ones(2 * len(half) + 1)
    weights[[5, 6, 10, 14, 15]] = 3.0
    return clamped(mirrored(half, ((0, 14),)), 60.0, 3, weights)


def star() -> sf.Path:
    """Five tips of a rational cubic."""
    points = around(11, 0.2 * np.pi, 25.0, 9.0)
    return clamped(points, float(np.max(np.ptp(points, axis=0))), 3, [4.0, 1.0] * 5 + [4.0])


def heart() -> sf.Path:
    """A cubic with a double control point."""
    return clamped(mirrored([(0.0, 0.0), (-3, 4), (-7, 7), (-6, 11), (-2, 12), (0, 8.5)]), 50.0)


def leaf() -> sf.Path:
    """A maple leaf, say: a cubic of nineteen control points."""
    half = [(0.0, 0.0), (0.5, 2), (3, 3), (5, 2), (4, 4), (7, 6), (4, 6.5), (4.5, 9), (2.5, 8)]
    return clamped(mirrored(half, ((0, 14),)), 80.0)


def quintic_in_space() -> sf.Path:
    """A random walk in space, degree 5."""
    steps = np.random.default_rng(18).normal(size=(25, 3))
    return clamped(np.cumsum(steps, axis=0), 80.0, 5)


def five_axes() -> sf.Path:
    """A quintic of three linear axes, mm, and two rotary ones, rad."""
    t = np.linspace(0.0, 1.0, 24)
    columns = [100 * t, 30 * np.sin(7 * t), 10 * np.cos(11 * t), 0.6 * np.sin(5 * t + 1), 1.5 * np.cos(4 * t)]
    points = np.column_stack(columns)
    knots = np.concatenate([np.zeros(5), np.linspace(0.0, 1.0, 20), np.ones(5)])
    return sf.Path([sf.NurbsCurve(5, knots, points)], axes=("x", "y", "z", "a", "c"))


def quadratic() -> sf.Path:
    """A star of degree 2, whose curvature jumps at each of its 19 knots."""
    return clamped(around(21, 0.1 * np.pi, 40.0, 18.0), 80.0, 2)


def slot() -> sf.Path:
    """Two lines and four quarters of circles."""
    bezier, h = sf.NurbsCurve.bezier, np.sqrt(0.5)
    half = np.array([[0, 0], [8, 0], [8, 8], [8, 16], [0, 16]])
    right, left = half + np.array([40, 0]), np.array([0, 16]) - half
    arcs = [bezier(each[k : k + 3], [1, h, 1]) for each in (right, left) for k in (0, 2)]
    return sf.Path([bezier([[0, 0], [40, 0]]), *arcs[:2], bezier([[40, 16], [0, 16]]), *arcs[2:]])


def short_lines() -> sf.Path:
    """159 lines as a CAM program writes them, smoothed by 0.02 mm."""
    t = np.linspace(0.0, 2.0 * np.pi, 160)
    points = np.column_stack([40 * np.cos(t) + 6 * np.cos(5 * t), 30 * np.sin(t) + 6 * np.sin(4 * t)])
    return smoothed(sf.Path.polyline(np.round(points, 3)), 0.02)


CURVES: dict[str, Callable[[], sf.Path]] = {
    "trident": trident,
    "star": star,
    "heart": heart,
    "figure eight": lambda: sf.shapes.figure_eight(80.0),
    "airfoil 0025": lambda: sf.shapes.naca("0025", chord=15.5),
    "leaf": leaf,
    "ellipse": lambda: sf.shapes.ellipse(30.0, 8.0),
    "quintic in space": quintic_in_space,
    "five axes": five_axes,
    "quadratic star": quadratic,
    "slot": slot,
    "short lines, smoothed": short_lines,
}


def measure() -> Report:
    """Seconds of motion and of computing, and the bound on the grid."""
    rows = []
    shares = []
    for name, shape in CURVES.items():
        path = shape()
        for setting in "ABC":
            limits = axis_limits(setting)
            taken, laws = {}, {}
            for strategy in ("time-optimal", "look-ahead"):
                sf.plan(path, limits, strategy=strategy, period=PERIOD)
                start = time.process_time()
                laws[strategy] = law = sf.plan(
                    path, limits, strategy=strategy, period=PERIOD, bound=strategy == "time-optimal"
                )
                taken[strategy] = time.process_time() - start
                verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
                if not verdict.ok:
                    raise AssertionError((name, setting, strategy, verdict.problems))
                shares.append(max(each.share for each in verdict.limits.values()))
            best, ahead = (law.duration for law in laws.values())
            bound, other = float(laws["time-optimal"].settings["lower_bound_s"]), REFERENCE.get((name, setting))
            over = None if other is None else 100.0 * (best / other - 1.0)
            behind = 100.0 * (ahead / best - 1.0)
            rows.append((name, setting, bound, best, other, over, taken["time-optimal"], ahead, behind))
    columns = (
        Column("curve"),
        Column("limits"),
        Column("bound, s", ".3f"),
        Column("`time-optimal`, s", ".3f"),
        Column("other planners, s", ".3f"),
        Column("over them, %", ".2f"),
        Column("computing, s", ".2f"),
        Column("`look-ahead`, s", ".3f"),
        Column("over `time-optimal`, %", ".1f"),
    )
    notes = (
        "Limits (feed = axis velocity, axis acceleration, axis jerk; of rotary axes in rad): A 60, 500, 20000; "
        "B 100, 2000, 50000; C 60, 50, 2000. Bound: no motion within the limits is faster. Other planners: the "
        "faster of IPOPT and COPP, slowed until their setpoints hold the limits, measured once; on the other "
        "curves they were not measured, or know nothing of jumps. Computing: processor time of a warm plan. "
        "Every motion here was held against `sf.check`.",
    )
    known = [row[5] for row in rows if row[5] is not None]
    behind = sorted(row[8] for row in rows)
    headline = Headline(
        f"`time-optimal` on {len({name for name, _ in REFERENCE})} other curves, against IPOPT and COPP",
        f"{min(known):.2f} to {max(known):.2f} %; worst share of a limit {max(shares):.9f}",
        f"at most {100.0 * (ALLOWED - 1.0):.1f} % over, 1",
        max(known) <= 100.0 * (ALLOWED - 1.0) and max(shares) <= 1.0 + 1e-6,
    )
    loss = Headline(
        f"`look-ahead` against `time-optimal`, {len(rows)} cases",
        f"median {behind[len(behind) // 2]:.1f} %, worst {behind[-1]:.1f} % longer",
        "12 %",
        behind[-1] <= 12.0,
    )
    caption = f"{len(CURVES)} other curves under three sets of limits, 1 ms, rest to rest."
    return Report((Table(caption, columns, tuple(rows), notes),), (headline, loss))

"""A lower bound of the time of every motion within the limits: the best multipliers, by an interior point.

The multipliers of `dual.py` that bound the time best are those of a convex problem: q at the places of the integral,
rows tested with splines, sum of w_i B_i (row)_i <= 0, and one pace p for 1 / sqrt(q) (Boyd and Vandenberghe, *Convex
Optimization*, section 11.7). Z <= 1 is what it costs that the limit of jerk is not convex: it is the bound of motions
that may exceed this limit where they spend |j| / J of time a millimetre. So the next ones are found as if q were at
least a share of that of the plan, with jerk under chords of 1 / sqrt(q), which are linear rows; `Dual.by_place` then
says what they bound the time by without that. What is left to rounding is the integral: the difference that halved
cells make to it is taken off.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import lapack

from splinefeed.planner.conditions import Conditions
from splinefeed.planner.constants import SAME
from splinefeed.planner.dual import REACHING, Dual
from splinefeed.planner.solve import FAR, NEAR, RIDGES, STEPS, Problem, Solution
from splinefeed.planner.spline import DEGREE
from splinefeed.records import Array, IntArray

#: While the bound is below this share of the time it is looked for again, so many times in all: on cells half as long,
#: first everywhere and then three times where jerk binds, and under better chords, as long as that is worth this share.
CLOSE, TIMES, HALVED, WORTH = 0.995, 9, 3, 1e-4
#: Chords begin at this share of q of the plan; the next one is so much lower where the bound falls short of what
#: multipliers promise, by this share of the time, and so much higher elsewhere, up to the last.
SHARE, LOWER, LITTLE, HIGHER, MOST = 0.6, 0.8, 1e-7, 1.1, 0.97
#: Jerk binds where its multipliers sum up to more than this, or where those under chords are not 0.
NEARLY = 0.9
#: A multiplier that begins below this, and those whose splines overlap it, too, stays 0: its row does not bind there.
BINDING = 1e-3


def lower_bound(
    conditions: Conditions, problem: Problem, solution: Solution, low: float, high: float, gap: float
) -> float:
    """Find a lower bound of the time from a solution.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    problem : Problem
        Between the ends.
    solution : Solution
        Of it.
    low, high : float
        The ends, mm.
    gap : float
        Share of the best that multipliers on its cells can give, within which it is.

    Returns
    -------
    float
        s.
    """
    inner, ends = problem.spline.nodes, problem.ends
    ramp = 0.5 ** np.arange(1.0, DEGREE + 1.0)  # cells on a ramp, as many as splines overlap
    up, down = low + (inner[0] - low) * ramp, high - (high - inner[-1]) * ramp
    nodes = np.unique(np.concatenate([[low], up, inner, down, [high]]))
    states, found = tuple((end.q, end.slope) for end in ends), 0.0
    scale = solution.time / (high - low)
    at, x = _first(problem, solution, scale)

    def planned(places: Array) -> Array:
        """q of the solution, (n,)."""
        q = problem.spline.at(solution.c, np.clip(places, inner[0], inner[-1]))[0]
        for end, away in zip(ends, (places - low, high - places), strict=True):
            if end.rest:
                q *= np.minimum(away / end.ramp, 1.0) ** (4.0 / 3.0)
        return np.asarray(np.maximum(q, SAME * np.max(q)))

    least: Callable[[Array], Array] | None = None
    share = np.full(len(nodes) - 1, SHARE)  # of q of the solution that `least` is, in each cell
    for k in range(TIMES):
        dual, close = (Dual(conditions, nodes, states, scale, parts, least) for parts in (1, 2))
        q, here = planned(dual.x).reshape(dual.top.shape), dual.spline.greville()
        begin = np.array([np.interp(here, at, each) for each in x.T]).reshape(-1, len(here)).T
        at, x = here, _best(dual, q, _with_chords(dual, begin), gap)
        (bound, short), (closer, _) = dual.by_place(x), close.by_place(x)
        before, found = found, float(np.fmax(found, closer - abs(closer - bound)))
        time = float(np.sum(dual.weight / np.sqrt(q)))
        if found > CLOSE * time or (k > HALVED and found - before < WORTH * time):
            break
        jerk, under = x[:, : dual.jerks], x[:, dual.jerks + dual.linears :]
        full = (np.sum(jerk, axis=1) > NEARLY) | np.any(under > BINDING, axis=1)
        tight = np.any(dual.near(full[:, None]), axis=1)
        if least is not None:
            higher = np.where(tight, np.minimum(HIGHER * share, MOST), share)
            share = np.where(short > LITTLE * time, LOWER * share, higher)
        if k <= HALVED:
            halved = tight if k else np.ones_like(tight)
            nodes = np.sort(np.append(nodes, 0.5 * (nodes[1:] + nodes[:-1])[halved]))
            share = np.repeat(share, 1 + halved)
        middle, parts_of_q = 0.5 * (nodes[1:] + nodes[:-1]), share

        def least(places: Array, middle: Array = middle, share: Array = parts_of_q) -> Array:
            """q that motions hardly fall below where jerk binds, (n,)."""
            return np.asarray(np.interp(places, middle, share) * planned(places))

    return found


def _with_chords(dual: Dual, x: Array) -> Array:
    """Multipliers to begin with: half of those of jerk, too, under chords, where they sum up to much."""
    under = x[:, dual.jerks + dual.linears :]
    if dual.fields == dual.jerks + dual.linears:
        return x
    jerk = x[:, : dual.jerks]
    total = np.sum(jerk, axis=1, keepdims=True)
    seed = np.where(total > 0.5, 0.5 * jerk / np.maximum(total, 1.0), 0.0)
    under = np.maximum(under, seed) if under.size else seed
    return np.concatenate([x[:, : dual.jerks + dual.linears], under], axis=1)


def _first(problem: Problem, solution: Solution, scale: float) -> tuple[Array, Array]:
    """Arc lengths (n,), mm, and multipliers (n, f): those of a solution, less weight, as means over its splines."""
    total = _total(problem, problem.weight)
    known, columns = total > 0.0, []
    for side in (2, 3, 0, 1):  # jerk up and down, then linear rows high and low
        z, unit = solution.z[problem.parts[side]], 1.0 if side > 1 else scale
        smooth = z[: problem.rows.jerks if side > 1 else problem.rows.smooth]
        columns += [_total(problem, each)[known] / (unit * total[known]) for each in smooth]
    at = problem.spline.greville()[known]
    return at, np.array(columns).reshape(-1, len(at)).T


def _total(problem: Problem, each: Array) -> Array:
    """What each place (n,) gives to the splines that reach it, (m,)."""
    total = np.bincount(problem.gather.ravel(), (problem.basis[0] * each).ravel(), problem.spline.size)
    return np.asarray(total, dtype=np.float64)


def _best(dual: Dual, q: Array, x: Array, gap: float) -> Array:
    """Multipliers (n, f) whose bound is nearly the best, from q (m, g) at the places and multipliers to begin with.

    They are those of the least sum of p (n,) under tested rows C(q) + y = fixed, and + p for jerk, under
    R(1 / sqrt(q)) + w = p and q + t = top, with slacks y, w, t, multipliers x, u = 1 - Z, v, and their products at mu.
    A step solves for dx: dq, dy, dw and dv follow from it.
    """
    f, weight, top = dual.fields, dual.weight, dual.top
    free = x > BINDING
    for _ in range(DEGREE):
        free[1:] |= free[:-1]
        free[:-1] |= free[1:]
    free &= ~dual.held
    number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    (one, other, at), (coupled, _, at_node) = _pairs(dual.near(number)), _pairs(number[:, : dual.jerks])
    at = np.concatenate([at, at_node], axis=1)
    of_jerk = (np.arange(f) < dual.jerks).astype(np.float64)
    q = (1.0 - NEAR) * np.minimum(q, top)
    x = np.where(free, np.maximum(x, FAR / f), 0.0)
    x[:, : dual.jerks] *= np.minimum(1.0, (1.0 - FAR) / np.maximum(np.sum(x[:, : dual.jerks], axis=1), FAR))[:, None]
    u = 1.0 - np.sum(x[:, : dual.jerks], axis=1)
    count = int(np.sum(free)) + len(x) + q.size
    mu = FAR * float(np.sum(weight / np.sqrt(q))) / count
    v, w = mu / (weight * (top - q)), mu / u
    C, R = dual.tested(q)
    y = np.maximum(dual.fixed + (R + w)[:, None] * of_jerk - C, mu / np.where(free, x, 1.0))[free]
    best = np.zeros_like(x)
    most = dual.bound(best, *dual.at(best))
    for _ in range(STEPS if np.any(free) else 0):
        r, t, z = q**-0.5, top - q, x[free]
        left, P = dual.at(x)
        found = dual.bound(x, left, P)
        best, most = (x, found) if found > most else (best, most)
        if np.sum(z * y) + np.sum(u * w) + np.sum(weight * v * t) < gap * most:
            break
        r3 = r * r * r
        stiff = 0.75 * left * r3 * r * r + v / t
        rest = 0.5 * left * r3 - P - mu / (weight * t)
        pull = dual.pull.copy()
        pull.reshape(len(q), REACHING, f, -1)[:, :, : dual.jerks] += 0.5 * (dual.value * r3[:, None])[:, :, None]
        C, R = dual.tested(q)
        push = dual.spread(np.einsum("mkg,mg->mk", pull, weight * rest / stiff)) + C - dual.fixed
        push -= np.outer(mu / u + R, of_jerk)
        scaled = (pull * np.sqrt(weight / stiff)[:, None]).reshape(-1, q.shape[1])
        by_pair = np.einsum("pg,pg->p", scaled.take(one, axis=0), scaled.take(other, axis=0))
        dz = _solved(np.concatenate([by_pair, np.repeat(w / u, dual.jerks)[coupled]]), at, y / z, push[free] + mu / z)
        if dz is None:
            break
        dx = np.zeros_like(x)
        dx[free] = dz
        du = -np.sum(dx[:, : dual.jerks], axis=1)
        dq = (rest - np.einsum("mkg,mk->mg", pull, dual.near(dx))) / stiff
        dy, dw = mu / z - y - y / z * dz, mu / u - w - w / u * du
        dv = (mu / weight - v * t + v * dq) / t
        along, along_x = _longest(-dy / y, -dw / w, dq / t, -dq / q), _longest(-dz / z, -du / u, -dv / v)
        q, y, w = q + along * dq, y + along * dy, w + along * dw
        x, v = x + along_x * dx, v + along_x * dv
        u = 1.0 - np.sum(x[:, : dual.jerks], axis=1)
        mu = (
            max(FAR, 1.0 - min(along, along_x))
            * float(np.sum(x[free] * y) + np.sum(u * w) + np.sum(weight * v * (top - q)))
            / count
        )
    return best


def _pairs(number: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Places (p,), row by row, and numbers (2, p) of pairs of numbers in each row of (m, k), increasing; -1 is none."""
    row, column = np.nonzero(number >= 0)
    behind = np.cumsum(np.bincount(row, minlength=len(number)))[row]
    sizes = behind - np.arange(len(row))  # with itself and those behind it in its row
    one = np.repeat(np.arange(len(row)), sizes)
    other = one + np.arange(len(one)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    place, given = row * number.shape[1] + column, number[row, column]
    return place[one], place[other], np.stack([given[one], given[other]])


def _longest(*shares: Array) -> float:
    """The longest step, at most 1, that leaves NEAR: shares are of what is left."""
    return min(1.0, (1.0 - NEAR) / max(*(float(np.max(each)) for each in shares), 1e-300))


def _solved(pairs: Array, at: IntArray, diagonal: Array, push: Array) -> Array | None:
    """The step under a band matrix of pairs (p,) at (2, p), added up, and a diagonal; None if rounding spoils it."""
    n, width = len(push), int(np.max(at[1] - at[0])) + 1
    band = np.bincount((at[1] - at[0]) * n + at[0], pairs, width * n).reshape(width, n)
    diagonal = band[0] + diagonal
    for more in RIDGES:
        band[0] = diagonal * (1.0 + more)
        _, step, info = lapack.dpbsv(band, push, lower=1)
        if info == 0:
            return np.asarray(step)
    return None

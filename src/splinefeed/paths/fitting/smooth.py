"""One smooth curve near points between two corners: knots where they are needed, the fewest of them, then fairing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.differential import curvatures
from splinefeed.errors import CurveError
from splinefeed.paths.fitting.grid import MAX_SPANS, ROUNDS, SplineSpace, graded, halved, in_spans, space_over, span_of
from splinefeed.records import Array

#: Knots are inserted until the error is this share of the tolerance: what is left over makes the curve fair.
KNOT_SHARE = 0.5
#: Fairing brings the error near this share of the tolerance, span by span.
FAIR_SHARE = 0.7
#: Strengths of fairing while knots are inserted, the next where more knots no longer help. The first keeps a curve from
#: swinging out between few points; the last only makes spans without points definite. Their bias is squared away.
STRENGTHS = (1e-3, 1e-6)
#: The change of log lambda that ends the rounds of fairing, and the strength of the first.
SETTLED, FIRST_STRENGTH = 0.2, 1e-4
#: Most strength, relative to the width of a span.
MOST_STRENGTH = 1e6
#: Spans over which the strength of fairing is evened out.
FAIR_WIDTH = 9
#: The arc length of a fit serves as parameter once the fit is this near, in tolerances.
NEAR = 20.0
#: An arc longer than this many chords bends by more than half a turn between two points: no usable length.
MOST_ARC = 0.5 * np.pi
#: More points than this are fitted by so many of them first, to this share of the tolerance, and those that are then
#: too far off are added, so many times; from a guess, a foot point is found in so many steps.
MANY, MANY_SHARE, MANY_ROUNDS, NEAR_STEPS = 20_000, 0.9, 4, 8
#: More spans than this many a point cannot help.
SPANS_PER_POINT = 4

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
#: The share of the tolerance that least squares may use in the end: what is left over makes the curve fair.
FEW_SHARE = 0.8
#: What spreads the knots is evened out over so many spans, and nowhere below this share of its mean.
DENSITY_WIDTH, LEAST_DENSITY = 3, 0.1
#: How many more spans than the fewest are tried, where the curvature would turn back more often than it need.
MORE = (1.0, 1.25, 1.6, 2.0, 2.5)
#: Renewals of arc length in each round, which settles by a factor of about ten each time, rounds of fairing, and trials
#: of fewer knots; less where very many are fitted at once, which is what noise above the tolerance comes to: the time
#: stays in step with the points.
WORK, MANY_WORK = (3, 20, len(MORE)), (1, 6, 1)
#: Places a span at which curvature is sampled, and the share of its range below which a turn is none.
PLACES, SWING = 6, 0.01


def smooth_curve(
    points: Array, tolerance: float, degree: int, periodic: bool = False, brief: bool = False
) -> NurbsCurve:
    """One curve on [0, 1] near distinct points (n, axes); through both ends exactly, unless periodic.

    Parameters begin as summed chords. Without guarantee: the caller measures the remaining distance. `brief`, as for
    very many points, it takes fewer rounds to be fair.
    """
    if len(points) == 2:
        return NurbsCurve.bezier(np.linspace(points[0], points[1], degree + 1))
    u = _shares(_chords(points, periodic))[: len(points)]
    spans = 1 if not periodic else 2 ** int(np.ceil(np.log2(degree + 1)))
    grid = np.linspace(0.0, 1.0, spans + 1)
    brief = brief or len(points) > (1 + MANY_ROUNDS) * MANY
    renewals, fairings, trials = MANY_WORK if brief else WORK
    strengths = list(STRENGTHS)
    for _ in range(ROUNDS):
        space = space_over(degree, grid, periodic)
        u, curve, errors = _by_arc_length(space, u, points, tolerance, strengths[0], renewals)
        wide = span_of(grid, u[errors > KNOT_SHARE * tolerance])
        if not len(wide):
            break
        finer = graded(halved(grid, np.unique(wide)), periodic)
        if len(finer) <= min(MAX_SPANS, 64 + SPANS_PER_POINT * len(points)):
            grid = finer
        elif len(strengths) > 1:
            del strengths[0]
        else:
            break
    curve = _faired(space, u, points, curve, tolerance, fairings)
    most = swings(curve)
    fewest = fewer_spans(space, u, points, curve, tolerance, strengths[0])
    for fewer, parameters in islice(fewest, trials):
        found, errors = solved(fewer, parameters, points, strengths[0])
        if errors.max() > FEW_SHARE * tolerance:
            continue
        found = _faired(fewer, parameters, points, found, tolerance, fairings)
        if swings(found) <= most:
            return found
    return curve


def smooth_curve_of_many(
    points: Array, tolerance: float, degree: int, periodic: bool = False, brief: bool = False
) -> NurbsCurve:
    """As `smooth_curve`, from MANY of the points if there are more, and those that are then too far off."""
    count = len(points)
    if count <= MANY:
        return smooth_curve(points, tolerance, degree, periodic, brief)
    chosen = np.zeros(count, dtype=bool)
    chosen[np.linspace(0, count - 1, MANY).astype(np.int64)] = True
    for _ in range(MANY_ROUNDS):
        at = np.flatnonzero(chosen)
        curve = smooth_curve(points[at], MANY_SHARE * tolerance, degree, periodic)
        few = points[at]
        u = foot_points(curve, _shares(_chords(few, periodic))[: len(few)], few, periodic, NEAR_STEPS)[0]
        errors = foot_points(curve, np.interp(np.arange(count), at, np.maximum.accumulate(u)), points, periodic)[1]
        far = np.flatnonzero(errors > tolerance)
        if not len(far):
            return curve
        if len(far) > MANY:
            break  # noise above the tolerance: no few of the points tell where the others lie
        chosen[far[np.argsort(-errors[far], kind="stable")[:MANY]]] = True
    return smooth_curve(points, tolerance, degree, periodic)


def _chords(points: Array, periodic: bool) -> Array:
    """Lengths of the chords between neighbours, with the one back to the first point if periodic."""
    line = np.concatenate([points, points[:1]]) if periodic else points
    return np.asarray(np.linalg.norm(np.diff(line, axis=0), axis=1))


def _shares(lengths: Array) -> Array:
    """What lengths (n,) sum up to, as shares (n + 1,) of all, from 0 to 1."""
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.asarray(s / s[-1])


def _spline(curve: NurbsCurve) -> Any:
    """A fitted curve as SciPy has it: of few points it is evaluated in the tenth of the time, without tables."""
    from scipy.interpolate import BSpline

    return BSpline.construct_fast(curve.knots, curve.control_points, curve.degree)


def foot_points(
    curve: NurbsCurve, u: Array, points: Array, periodic: bool = False, steps: int = 3
) -> tuple[Array, Array]:
    """Parameters (n,) of foot points near u (n,) on one curve, and distances (n,), mm, of points (n, axes) from these.

    Never more than at u.    u <- u - (C - Q).C' / (C'.C' + (C - Q).C'')     (The NURBS Book, 2nd ed., eq. 6.3)
    """
    low, high = curve.domain
    spline = _spline(curve)
    best, where = np.full(len(u), np.inf), u
    for step in range(steps + 1):
        off = spline(u) - points
        distance = np.linalg.norm(off, axis=1)
        where = np.where(distance < best, u, where)
        best = np.minimum(best, distance)
        if step == steps:
            break
        first, second = spline(u, 1), spline(u, 2)
        slope = np.sum(off * first, axis=1)
        speed = np.sum(first**2, axis=1)
        bend = speed + np.sum(off * second, axis=1)
        bend = np.where(bend > 0.25 * speed, bend, speed)  # far off, a Gauss-Newton step still goes downhill
        u = u - np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0.0)
        u = u - np.floor(u) if periodic else np.clip(u, low, high)
    return where, best


def _by_arc_length(
    space: SplineSpace, u: Array, points: Array, tolerance: float, strength: float, renewals: int
) -> tuple[Array, NurbsCurve, Array]:
    """Parameters, fit and errors, with the fit's own arc length for them: C''' then tells how curvature changes.

    A chord is shorter than its arc by (kappa h)^2 / 24 of it: where points are few, that alone makes a curve uneven.
    """
    curve, errors = solved(space, u, points, strength)
    chords = _chords(points, space.periodic)
    for _ in range(renewals):
        spline = _spline(curve)
        if np.max(np.linalg.norm(spline(u) - points, axis=1)) > NEAR * tolerance:
            break
        ends = np.append(u, 1.0) if space.periodic else u
        speed = np.linalg.norm(spline(in_spans(ends, _NODES), 1), axis=-1)
        arcs = 0.5 * (speed @ _WEIGHTS) * np.diff(ends)
        if np.any(arcs > MOST_ARC * chords + tolerance):
            break
        renewed = _shares(arcs)[: len(u)]
        other, other_errors = solved(space, renewed, points, strength)
        if other_errors.max() > max(KNOT_SHARE * tolerance, 1.5 * errors.max()):
            break
        u, curve, errors = renewed, other, other_errors
    return u, curve, errors


def _faired(
    space: SplineSpace, u: Array, points: Array, curve: NurbsCurve, tolerance: float, fairings: int
) -> NurbsCurve:
    """The fairest curve of this space within the tolerance: lambda grows wherever the error leaves room."""
    from scipy.ndimage import maximum_filter1d, uniform_filter1d

    mode = "wrap" if space.periodic else "nearest"
    fitted = space.near(u, points)
    span = span_of(space.grid, u)
    top = np.log(space.even(MOST_STRENGTH))
    strength = uniform_filter1d(np.log(space.even(FIRST_STRENGTH)), FAIR_WIDTH, mode=mode)
    for _ in range(fairings if space.degree > 1 else 0):
        try:
            fairer = fitted(np.exp(strength))
        except CurveError:
            break  # lambda outweighs the points by more digits than there are
        errors = foot_points(fairer, u, points, space.periodic)[1]
        if errors.max() <= tolerance:
            curve = fairer
        local = np.zeros(len(strength))
        np.maximum.at(local, span, errors)
        local = np.maximum(maximum_filter1d(local, FAIR_WIDTH, mode=mode), 1e-3 * tolerance)
        # the error grows about as the root of lambda; a step is bounded, and evened out over neighbours
        wanted = np.minimum(strength + np.clip(2.0 * np.log(FAIR_SHARE * tolerance / local), -4.0, 2.0), top)
        before, strength = strength, uniform_filter1d(wanted, FAIR_WIDTH, mode=mode)
        if np.max(np.abs(strength - before)) < SETTLED:
            break
    return curve


def solved(space: SplineSpace, u: Array, points: Array, strength: float) -> tuple[NurbsCurve, Array]:
    """Least squares at given parameters, hardly faired, and the distance of each point."""
    curve = space.near(u, points)(space.even(strength), sharpen=True)
    return curve, foot_points(curve, u, points, space.periodic)[1]


def fewer_spans(
    space: SplineSpace, u: Array, points: Array, curve: NurbsCurve, tolerance: float, strength: float
) -> Iterator[tuple[SplineSpace, Array]]:
    """Spaces with fewer spans than `space`, the fewest that were found to hold the tolerance first, and parameters.

    Knots stand where the integral of |C^(p + 1)|^(1 / (p + 1)) grows alike, which spreads the error evenly (de Boor,
    "A Practical Guide to Splines", chapter XII, NEWKNOT); doubling and halving find how many are enough.
    """
    share = np.concatenate([[0.0], np.cumsum(_density(curve, space.grid) * np.diff(space.grid))])
    least = 2 ** math.ceil(math.log2(space.degree + 1)) if space.periodic else 1
    most = len(space.grid) - 1

    def of(spans: int) -> SplineSpace:
        grid = np.interp(np.linspace(0.0, share[-1], spans + 1), share, space.grid)
        grid[0], grid[-1] = 0.0, 1.0
        return space_over(space.degree, grid, space.periodic)

    low, high, trial = least - 1, most, least
    while low < trial < high:
        fewer = of(trial)
        try:
            found, errors = solved(fewer, u, points, strength)
            enough = bool(errors.max() <= FEW_SHARE * tolerance)
        except CurveError:
            enough = False
        if enough:
            # feet in place of places between noisy neighbours: a curve need not follow these along itself
            u = foot_points(found, u, points, space.periodic)[0]
            high = trial
        else:
            low = trial
        trial = (low + high) // 2 if high < most else 2 * low
    for more in MORE:
        if (spans := math.ceil(more * high)) < most:
            yield of(spans), u


def _density(curve: NurbsCurve, grid: Array) -> Array:
    """|C^(p + 1)|^(1 / (p + 1)) (spans,) of a curve over `grid`, from the steps of C^(p), evened out a little."""
    from scipy.ndimage import uniform_filter1d

    p = curve.degree
    slopes = _spline(curve)(0.5 * (grid[1:] + grid[:-1]), p)
    steps = np.linalg.norm(np.diff(slopes, axis=0), axis=1)
    rate = np.zeros(len(grid) - 1)
    if len(steps):
        width = 0.5 * (grid[2:] - grid[:-2])
        rate[:-1] += 0.5 * steps / width
        rate[1:] += 0.5 * steps / width
    density = uniform_filter1d(rate ** (1.0 / (p + 1)), DENSITY_WIDTH, mode="nearest")
    return np.asarray(np.maximum(density, LEAST_DENSITY * float(np.mean(density)) + 1e-300))


def swings(curve: NurbsCurve) -> int:
    """How often the curvature turns back by more than SWING of its range; 0 below degree 3, where it jumps."""
    if curve.degree < 3 or curve.axes == 1:
        return 0
    values = curvatures(curve.derivatives(in_spans(curve.breaks, np.linspace(-1.0, 1.0, PLACES)).ravel(), 2))
    values = values[np.isfinite(values)]
    if not len(values):
        return 0
    least = SWING * float(np.ptp(values))
    count, low, high, rising = 0, float(values[0]), float(values[0]), 0
    for value in values.tolist():
        low, high = min(low, value), max(high, value)
        if rising >= 0 and value < high - least:
            count, rising, low = count + (rising > 0), -1, value
        elif rising <= 0 and value > low + least:
            count, rising, high = count + (rising < 0), 1, value
    return count

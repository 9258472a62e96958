"""One smooth curve near points between two corners: knots where they are needed, then fairing."""

from __future__ import annotations

from itertools import islice

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.fitting.distance import foot_points
from splinefeed.geometry.fitting.fewest import FEW_SHARE, MORE, fewer_spans, solved, swings
from splinefeed.geometry.fitting.grid import MAX_SPANS, ROUNDS, graded, halved, in_spans, span_of
from splinefeed.geometry.fitting.spline_space import SplineSpace
from splinefeed.records import Array

#: Knots are inserted until the error is this share of the tolerance: what is left over makes the curve fair.
KNOT_SHARE = 0.5
#: Fairing brings the error near this share of the tolerance, span by span.
FAIR_SHARE = 0.7
#: Strengths of fairing while knots are inserted, the next where more knots no longer help. The first keeps a curve from
#: swinging out between few points; the last only makes spans without points definite. Their bias is squared away.
STRENGTHS = (1e-3, 1e-6)
#: Rounds of fairing at most, the change of log lambda that ends them, and the strength of the first.
FAIRINGS = 20
SETTLED = 0.2
FIRST_STRENGTH = 1e-4
#: Most strength, relative to the width of a span.
MOST_STRENGTH = 1e6
#: Spans over which the strength of fairing is evened out.
FAIR_WIDTH = 9
#: The arc length of a fit serves as parameter once the fit is this near, in tolerances.
NEAR = 20.0
#: Arc length and fit are renewed in turn this often; it settles by a factor of about ten each time.
RENEWALS = 3
#: An arc longer than this many chords bends by more than half a turn between two points: no usable length.
MOST_ARC = 0.5 * np.pi
#: More points than this are fitted by so many of them first, to this share of the tolerance, and those that are then
#: too far off are added, so many times; from a guess, a foot point is found in so many steps.
MANY, MANY_SHARE, MANY_ROUNDS, NEAR_STEPS = 20_000, 0.9, 4, 8
#: Where still more are fitted at once, which is what noise above the tolerance comes to: rounds of fairing, renewals of
#: arc length in each round, and trials of fewer knots, so that the time stays in step with the points.
MANY_FAIRINGS, MANY_RENEWALS, MANY_TRIALS = 6, 1, 1
#: More spans than this many a point cannot help.
SPANS_PER_POINT = 4

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


def smooth_curve(points: Array, tolerance: float, degree: int, power: float, periodic: bool = False) -> NurbsCurve:
    """One curve on [0, 1] near distinct points (n, axes); through both ends exactly, unless periodic.

    Parameters begin as |chord|^power, summed. Without guarantee: the caller measures the remaining distance.
    """
    if len(points) == 2:
        return NurbsCurve.bezier(np.linspace(points[0], points[1], degree + 1))
    line = np.concatenate([points, points[:1]]) if periodic else points
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1) ** power
    u = np.minimum(np.concatenate([[0.0], np.cumsum(steps)]) / np.sum(steps), 1.0)[: len(points)]
    if not periodic:
        u[-1] = 1.0
    spans = 1 if not periodic else 2 ** int(np.ceil(np.log2(degree + 1)))
    grid = np.linspace(0.0, 1.0, spans + 1)
    many = len(points) > (1 + MANY_ROUNDS) * MANY
    renewals, fairings, trials = (
        (MANY_RENEWALS, MANY_FAIRINGS, MANY_TRIALS) if many else (RENEWALS, FAIRINGS, len(MORE))
    )
    strengths = list(STRENGTHS)
    for _ in range(ROUNDS):
        space = SplineSpace.of(degree, grid, periodic)
        curve, errors = solved(space, u, points, strengths[0])
        u, curve, errors = _by_arc_length(space, u, points, curve, errors, tolerance, strengths[0], renewals)
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
    if degree > 1:
        curve = _faired(space, u, points, curve, tolerance, fairings)
    most = swings(curve)
    fewest = fewer_spans(space, u, points, curve, tolerance, strengths[0])
    for fewer, parameters in islice(fewest, trials):
        found, errors = solved(fewer, parameters, points, strengths[0])
        if errors.max() > FEW_SHARE * tolerance:
            continue
        if degree > 1:
            found = _faired(fewer, parameters, points, found, tolerance, fairings)
        if swings(found) <= most:
            return found
    return curve


def smooth_curve_of_many(
    points: Array, tolerance: float, degree: int, power: float, periodic: bool = False
) -> NurbsCurve:
    """As `smooth_curve`, from MANY of the points if there are more, and those that are then too far off."""
    count = len(points)
    if count <= MANY:
        return smooth_curve(points, tolerance, degree, power, periodic)
    chosen = np.zeros(count, dtype=bool)
    chosen[np.linspace(0, count - 1, MANY).astype(np.int64)] = True
    for _ in range(MANY_ROUNDS):
        at = np.flatnonzero(chosen)
        curve = smooth_curve(points[at], MANY_SHARE * tolerance, degree, power, periodic)
        few = points[at]
        steps = np.linalg.norm(np.diff(few, axis=0), axis=1) ** power
        guess = np.concatenate([[0.0], np.cumsum(steps)])
        rest = np.linalg.norm(few[0] - few[-1]) ** power if periodic else 0.0
        u = foot_points(curve, guess / (guess[-1] + rest), few, periodic, NEAR_STEPS)[0]
        errors = foot_points(curve, np.interp(np.arange(count), at, np.maximum.accumulate(u)), points, periodic)[1]
        far = np.flatnonzero(errors > tolerance)
        if not len(far):
            return curve
        if len(far) > MANY:
            break  # noise above the tolerance: no few of the points tell where the others lie
        chosen[far[np.argsort(-errors[far], kind="stable")[:MANY]]] = True
    return smooth_curve(points, tolerance, degree, power, periodic)


def _by_arc_length(
    space: SplineSpace,
    u: Array,
    points: Array,
    curve: NurbsCurve,
    errors: Array,
    tolerance: float,
    strength: float,
    renewals: int,
) -> tuple[Array, NurbsCurve, Array]:
    """The fit with its own arc length as parameter, which makes C''' a measure of how curvature changes.

    A chord is shorter than its arc by (kappa h)^2 / 24 of it: where points are few, that alone makes a curve uneven.
    """
    line = np.concatenate([points, points[:1]]) if space.periodic else points
    chords = np.linalg.norm(np.diff(line, axis=0), axis=1)
    for _ in range(renewals):
        if np.max(np.linalg.norm(curve(u) - points, axis=1)) > NEAR * tolerance:
            break
        ends = np.append(u, 1.0) if space.periodic else u
        speed = np.linalg.norm(curve.derivatives(in_spans(ends, _NODES), 1)[..., 1, :], axis=-1)
        arcs = 0.5 * (speed @ _WEIGHTS) * np.diff(ends)
        if np.any(arcs > MOST_ARC * chords + tolerance):
            break
        s = np.concatenate([[0.0], np.cumsum(arcs)])
        renewed = (s / s[-1])[: len(u)]
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
    normal = space.normal(u, points)
    span = span_of(space.grid, u)
    top = np.log(space.even(MOST_STRENGTH))
    strength = uniform_filter1d(np.log(space.even(FIRST_STRENGTH)), FAIR_WIDTH, mode=mode)
    for _ in range(fairings):
        try:
            fairer = space.fitted(normal, np.exp(strength))
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

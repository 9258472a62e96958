"""The `time-optimal` strategy: least time under all limits at once, axis jerk included."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.cells import Cells, cells_between, located, sample
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.feed.square import AxisLimits, SquareProblem, feed_squared_bound
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.records import LAW_COEFFICIENTS, Array, Limits, TimeLaw

STRATEGY = "time-optimal"
#: Cells of the first grid: so many for each arc-length piece of the path, within these bounds, ...
CELLS_PER_PIECE, FEWEST_CELLS, MOST_CELLS = 4, 1000, 200_000
#: ... but no more than so many for each period of the motion: what is shorter than a tick is not seen.
CELLS_PER_PERIOD = 3.0
#: Refinements of the grid, and the share of cells that each cuts in two.
REFINEMENTS, REFINED_SHARE = 3, 0.3
#: Duality gap relative to the time at which the optimiser ends; loose on grids that will be refined.
GAP, COARSE_GAP = 1e-5, 1e-3
BOUND_GAP = 1e-5
#: Rounds in which limits are tightened where the law goes over them between the places the optimiser looks at.
REPAIRS = 5
#: What is over a limit by no more than this is left to the last stretch of the whole law, which it makes half as much
#: longer.
HAIR = 1e-4
#: The ramp at rest is this share of the length in which acceleration would build up.
RAMP_SHARE = 0.02
#: Places in every piece of the law where it is held against the limits.
CHECKED = np.linspace(0.0, 1.0, 7)
#: The rise of a peak between them is taken this much larger, as a parabola is not the whole truth.
PEAK_MARGIN = 2.0
#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
#: Rounds of slowing a stretch down until the third differences of its setpoints keep the axis jerk.
SLOWINGS = 20


@dataclass(frozen=True, eq=False)
class StretchPlan:
    """Motion over one stretch: instants (m + 1,), s, and coefficients (m, 6) of s; lower bound of its time, s."""

    times: Array
    coefficients: Array
    lower_bound: float

    @property
    def duration(self) -> float:
        """s."""
        return float(self.times[-1])


def plan_time_optimal(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Least time under feed, chord error, centripetal, tangential and axis limits, at rest at the ends and at stops.

    Each stretch between stops is solved on its own, stretched in time to a whole number of periods. settings of the
    law hold `lower_bound_s`: the time of the relaxation without jerk limits, which no plan can be faster than.
    Raises LimitsError for limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk
    without a period; PlanError for end feeds that are not 0.
    """
    axes = AxisLimits(
        *(limits.of_axes(name, path.axes) for name in ("axis_velocity", "axis_acceleration", "axis_jerk"))
    )
    _check(path, limits, axes, period)
    marks = [0.0, *path.stops, path.length]
    plans = [_stretch(path, low, high, limits, axes, period) for low, high in pairwise(marks)]
    breaks, coefficients = [np.zeros(1)], []
    tick = 0
    start = 0.0
    for plan in plans:
        factor = 1.0
        if period is not None:
            ticks = _ticks(path, plan, axes, period)
            tick += ticks
            factor = ticks * period / plan.duration
        times = start + plan.times[1:] * factor
        if period is not None:
            times[-1] = tick * period
        breaks.append(times)
        coefficients.append(plan.coefficients / factor ** np.arange(LAW_COEFFICIENTS))
        start = float(times[-1])
    return TimeLaw(
        breaks=np.concatenate(breaks),
        coefficients=np.concatenate(coefficients),
        strategy=STRATEGY,
        period=period,
        settings={"lower_bound_s": float(sum(plan.lower_bound for plan in plans))},
    )


def _ticks(path: Path, plan: StretchPlan, axes: AxisLimits, period: float) -> int:
    """Periods that the stretch lasts: as few as hold it and keep the third differences of its setpoints in the jerk."""
    ticks = max(math.ceil(plan.duration / period * (1.0 - 1e-12) - 1e-9), 1)
    if not np.any(np.isfinite(axes.jerk)):
        return ticks
    for _ in range(SLOWINGS):
        t = np.arange(ticks + 1) * (plan.duration / ticks)
        piece = np.clip(np.searchsorted(plan.times, t, side="right") - 1, 0, len(plan.coefficients) - 1)
        s = _polynomial(plan.coefficients[piece], t - plan.times[piece], 0)
        # at rest before and after
        points = path(np.concatenate([s[:1], s[:1], s[:1], s, s[-1:], s[-1:], s[-1:]]))
        seen = np.abs(np.diff(points, n=3, axis=0)) / period**3
        floor = 8.0 * np.finfo(np.float64).eps * np.max(np.abs(points), axis=0) / period**3
        ratio = float(np.max((seen - floor) / axes.jerk))
        if ratio <= 1.0:
            return ticks
        ticks = max(math.ceil(ticks * ratio ** (1.0 / 3.0)), ticks + 1)
    return ticks


def _check(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> None:
    """Raise for what this strategy cannot do."""
    if limits.start_feed or limits.end_feed:
        raise PlanError(f"the {STRATEGY} strategy begins and ends at rest; leave start_feed and end_feed at 0")
    finite = [limits.acceleration, limits.jerk, *axes.acceleration, *axes.jerk]
    if not np.any(np.isfinite(finite)):
        raise LimitsError(
            f"the {STRATEGY} strategy needs a limit on acceleration or jerk, of the path or of its axes; none is given"
        )
    if period is None and np.any(np.isfinite(axes.jerk)):
        jumps = [c for c in path.corners if not c.stop]
        if jumps:
            raise LimitsError(
                f"the curvature jumps at s = {jumps[0].s:.6g} mm, where axis jerk is infinite at any feed; "
                "give the servo period, over which a drive sees it"
            )


def _stretch(
    path: Path, low: float, high: float, limits: Limits, axes: AxisLimits, period: float | None
) -> StretchPlan:
    """Plan one stretch from rest to rest."""
    straight = _straight(path, low, high, limits, axes)
    if straight is not None:
        return straight
    cells, ends = _first_cells(path, low, high, limits, axes, period)
    bare = SquareProblem(cells, ends, limits, axes, period, relaxed=True)
    slow = np.full(cells.count + 2, 1e-3 * bare.least_bound)
    while bare.room(slow) <= 0.0:
        slow *= 0.1
        if slow[0] < 1e-200:
            raise PlanError(f"the limits allow no motion between s = {low:.6g} and {high:.6g} mm")
    c, relaxed_time, gap = bare.solve(slow, tolerance=BOUND_GAP)
    problem = SquareProblem(cells, ends, limits, axes, period)
    c, _, _ = problem.solve(_fitting(problem, c), tolerance=COARSE_GAP)
    for refinement in range(REFINEMENTS):
        cells, ends, guess = _refined(problem, c)
        problem = SquareProblem(cells, ends, limits, axes, period)
        last = refinement == REFINEMENTS - 1
        c, _, _ = problem.solve(_fitting(problem, guess), tolerance=GAP if last else COARSE_GAP)
    scale = np.ones(cells.count)
    for _ in range(REPAIRS):
        times, coefficients = _pieces(problem, c, low, high)
        over = _excess(problem, times, coefficients, limits, axes, period)
        if np.max(over) <= 1.0 + HAIR:
            break
        scale = scale / np.maximum(over, 1.0) ** 1.02
        problem = SquareProblem(cells, ends, limits, axes, period, scale)
        c, _, _ = problem.solve(_fitting(problem, c), tolerance=GAP)
    times, coefficients = _pieces(problem, c, low, high)
    over = _excess(problem, times, coefficients, limits, axes, period)
    factor = math.sqrt(max(float(np.max(over)), 1.0)) * (1.0 + 1e-12)
    return StretchPlan(times * factor, coefficients / factor ** np.arange(LAW_COEFFICIENTS), relaxed_time - gap)


def _straight(path: Path, low: float, high: float, limits: Limits, axes: AxisLimits) -> StretchPlan | None:
    """The exact seven-phase profile of a straight stretch, whose axes' limits are limits along the path; else None."""
    curve, u, _ = sample(path, low, high, 3)
    if len(curve) == 0:
        return None
    d = by_arc_length(path.evaluate(curve, u, 2 + 1), path.linear)
    length = high - low
    feeds = curve_feeds(path, limits)[curve]
    if np.ptp(feeds) > 0.0:
        return None
    if np.max(np.abs(d[:, 2])) * length > STRAIGHT or np.max(np.ptp(d[:, 1], axis=0)) > STRAIGHT:
        return None
    with np.errstate(divide="ignore"):
        steepest = 1.0 / np.max(np.abs(d[:, 1]), axis=0)
    acceleration = min(limits.acceleration, float(np.min(axes.acceleration * steepest)))
    deceleration = min(float(limits.deceleration or np.inf), float(np.min(axes.acceleration * steepest)))
    jerk = min(limits.jerk, limits.deceleration_jerk or np.inf, float(np.min(axes.jerk * steepest)))
    if not math.isfinite(acceleration + deceleration + jerk):
        return None
    feed = min(float(np.min(feeds)), float(np.min(axes.velocity * steepest)))
    along = Limits(feed=feed, acceleration=acceleration, deceleration=deceleration, jerk=jerk)
    law = SevenPhase.solve(length, along).law()
    coefficients = law.coefficients.copy()
    coefficients[:, 0] += low
    # without jerk: a trapezoid, or a triangle where there is no room for the feed
    top = min(feed, math.sqrt(2.0 * length * acceleration * deceleration / (acceleration + deceleration)))
    rising = top * top / (2.0 * acceleration) + top * top / (2.0 * deceleration)
    bound = top / acceleration + top / deceleration + (length - rising) / top
    return StretchPlan(law.breaks.copy(), coefficients, bound)


def _fitting(problem: SquareProblem, c: Array) -> Array:
    """c slowed down as little as it takes to have room to every limit."""
    for _ in range(400):
        if problem.room(c) > 0.0:
            return c
        c = c * 0.85
    raise PlanError(
        f"no feed was found that keeps the limits between s = {problem.cells.s[0]:.6g} and {problem.cells.s[-1]:.6g} mm"
    )


def _first_cells(
    path: Path, low: float, high: float, limits: Limits, axes: AxisLimits, period: float | None
) -> tuple[Cells, tuple[float, float]]:
    """A first grid, dense where the feed must be low, and the lengths of the ramps at both ends, mm."""
    curve, u, s = sample(path, low, high, 9)
    length = high - low
    tip = np.minimum(0.25, 1e-6 * 1.25 ** np.arange(56))
    extra = np.concatenate([low + length * tip, high - length * tip[::-1]])
    extra_curve, extra_u = path.locate(extra)
    s = np.concatenate([s, extra])
    order = np.argsort(s, kind="stable")
    s, curve, u = s[order], np.concatenate([curve, extra_curve])[order], np.concatenate([u, extra_u])[order]
    d = by_arc_length(path.evaluate(curve, u, 3), path.linear)
    with np.errstate(divide="ignore", invalid="ignore"):
        top = feed_squared_bound(d[:, 1], d[:, 2], curve_feeds(path, limits)[curve], limits, axes, period, path.linear)
        top = np.minimum(top, np.nanmin(axes.acceleration / np.abs(d[:, 2]), axis=1))
        top = np.minimum(top, np.nanmin(axes.jerk / np.abs(d[:, 3]), axis=1) ** (2.0 / 3.0))
        push = np.minimum(np.nanmin(axes.acceleration / np.abs(d[:, 1]), axis=1), limits.acceleration)
        twist = np.minimum(np.nanmin(axes.jerk / np.abs(d[:, 1]), axis=1), limits.jerk)
        kappa = np.linalg.norm(d[:, 2, : path.linear], axis=1)
        third = np.linalg.norm(d[:, 3, : path.linear], axis=1)
    ends = tuple(
        _ramp_length(float(top[i]), float(push[i]), float(twist[i]), float(kappa[i]), float(third[i]), length)
        for i in (0, -1)
    )
    rest = np.minimum(s - low, high - s)
    push_top, twist_top = float(np.min(push)), float(np.min(twist))
    grow = np.full(len(s), np.inf)
    if math.isfinite(push_top):
        grow = np.minimum(grow, 2.0 * push_top * np.maximum(rest, min(ends)))
    if math.isfinite(twist_top):
        grow = np.minimum(grow, (4.5 * twist_top * np.maximum(rest, min(ends)) ** 2) ** (2.0 / 3.0))
    feed = np.sqrt(np.minimum(top, grow))
    duration = float(np.sum(np.diff(s) / np.minimum(feed[1:], feed[:-1])))
    count = min(max(CELLS_PER_PIECE * (len(curve) // 9), FEWEST_CELLS), MOST_CELLS)
    if period is not None:
        count = min(count, max(int(CELLS_PER_PERIOD * duration / period), 24))
    s = np.concatenate([[low], s, [high]])
    density = 1.0 / np.concatenate([feed[:1], feed, feed[-1:]])
    return cells_between(path, low + ends[0], high - ends[1], s, density, count), (ends[0], ends[1])


def _ramp_length(top: float, push: float, twist: float, kappa: float, third: float, length: float) -> float:
    """Length of the ramp of constant jerk at rest, mm: short beside what building up a and v, and turning, take."""
    sizes = [1e-3 * length]
    if math.isfinite(twist):
        sizes.append(RAMP_SHARE * top**0.75 / math.sqrt(twist) / 6.0)
        if math.isfinite(push):
            sizes.append(RAMP_SHARE * push**3 / (6.0 * twist**2))
    else:
        sizes.append(1e-9 * length)
    if kappa > 0.0:
        sizes.append(2e-3 / kappa)
    if third > 0.0:
        sizes.append(0.05 / math.sqrt(third))
    return min(sizes)


def _refined(problem: SquareProblem, c: Array) -> tuple[Cells, tuple[float, float], Array]:
    """The cells with those halved where the tangential jerk changes most, and c carried over."""
    cells = problem.cells
    q, _, second = problem.at(c, 0.5)
    feed = np.sqrt(q)
    change = np.abs(np.diff(0.5 * feed * second))
    weight = np.zeros(cells.count)
    weight[:-1] += change
    weight[1:] += change
    weight *= cells.length / feed
    finer = cells.halved(weight >= np.quantile(weight, 1.0 - REFINED_SHARE))
    s = finer.s
    middles = 0.5 * (np.concatenate([s[:1], s]) + np.concatenate([s, s[-1:]]))
    return finer, problem.ends, np.interp(middles, cells.s, problem.nodes(c))


def _pieces(problem: SquareProblem, c: Array, low: float, high: float) -> tuple[Array, Array]:
    """The stretch as quartics in t: instants (m + 1,) from 0, and coefficients (m, 6).

    v is the cubic in t with the feed and acceleration of q at both nodes, and a cell lasts what this v needs for its
    length:  h = T (v_0 + v_1)/2 + T^2 (a_0 - a_1)/12. The ends are the ramps s = j t^3 / 6.
    """
    v = np.sqrt(problem.nodes(c))
    slope = np.append(problem.at(c, 0.0)[1], problem.at(c, 1.0)[1][-1])
    a = 0.5 * slope
    v0, v1, a0, a1 = v[:-1], v[1:], a[:-1], a[1:]
    h = problem.cells.length
    half, bend = 0.5 * (v0 + v1), (a0 - a1) / 12.0
    # the smaller root of bend T^2 + half T - h = 0, in the form that does not cancel
    t = 2.0 * h / (half + np.sqrt(half * half + 4.0 * bend * h))
    dv, da = v1 - v0 - a0 * t, a1 - a0
    n = len(h)
    coefficients = np.zeros((n + 2, LAW_COEFFICIENTS))
    coefficients[1:-1, 0] = problem.cells.s[:-1]
    coefficients[1:-1, 1] = v0
    coefficients[1:-1, 2] = 0.5 * a0
    coefficients[1:-1, 3] = (3.0 * dv - da * t) / (3.0 * t * t)
    coefficients[1:-1, 4] = (da * t - 2.0 * dv) / (4.0 * t**3)
    first, last = (3.0 * end / feed for end, feed in zip(problem.ends, (v[0], v[-1]), strict=True))
    coefficients[0, 0] = low
    coefficients[0, 3] = problem.ends[0] / first**3
    # s = high - end (1 - t / last)^3
    coefficients[-1, :4] = problem.ends[1] * np.array([0.0, 3.0 / last, -3.0 / last**2, 1.0 / last**3])
    coefficients[-1, 0] = problem.cells.s[-1]
    return np.concatenate([[0.0], np.cumsum(np.concatenate([[first], t, [last]]))]), coefficients


def _excess(
    problem: SquareProblem, times: Array, coefficients: Array, limits: Limits, axes: AxisLimits, period: float | None
) -> Array:
    """By how much each cell's q must come down for the law as it is to keep every limit, (n,); 1 is just kept."""
    cells = problem.cells
    path = cells.path
    ratios = np.zeros((len(CHECKED), cells.count + 2))
    durations = np.diff(times)
    feeds = curve_feeds(path, limits)
    for row, place in enumerate(CHECKED):
        s, v, a, j = (_polynomial(coefficients, place * durations, k) for k in range(4))
        if place == 0.0:
            curve, u = cells.curve, cells.u0
        elif place == 1.0:
            curve, u = cells.curve, cells.u1
        else:
            curve, u = cells.curve, located(path, cells.curve, np.clip(s[1:-1], cells.s[:-1], cells.s[1:]))
        curve = np.concatenate([cells.curve[:1], curve, cells.curve[-1:]])
        end_u = located(path, curve[[0, -1]], s[[0, -1]])
        u = np.concatenate([end_u[:1], u, end_u[1:]])
        d = by_arc_length(path.evaluate(curve, u, 3, side="left" if place == 1.0 else "right"), path.linear)
        ratios[row] = np.nan_to_num(_ratios(d, v, a, j, feeds[curve], limits, axes, period, path.linear))
    worst = np.max(ratios, axis=0)
    # between the places looked at a share may peak: a parabola through three of them tells how high
    below, here, above = ratios[:-2], ratios[1:-1], ratios[2:]
    bend = 2.0 * here - below - above
    peaked = (here >= below) & (here >= above) & (bend > 0.0)
    rise = np.where(peaked, (above - below) ** 2 / (8.0 * np.where(peaked, bend, 1.0)), 0.0)
    worst = np.maximum(worst, np.max(here + PEAK_MARGIN * rise, axis=0))
    over: Array = worst[1:-1]
    over[0] = max(over[0], worst[0])
    over[-1] = max(over[-1], worst[-1])
    return over


def _polynomial(coefficients: Array, t: Array, order: int) -> Array:
    """The order-th derivative of every piece at its own t, (m,)."""
    value = np.zeros(len(t))
    for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
        value = value * t + coefficients[:, k] * math.perm(k, order)
    return value


def _ratios(
    d: Array,
    v: Array,
    a: Array,
    j: Array,
    feed: Array,
    limits: Limits,
    axes: AxisLimits,
    period: float | None,
    linear: int,
) -> Array:
    """Largest share of any limit, put as a factor on q: velocity squared, acceleration, jerk to the power 2/3, (n,)."""
    r1, r2, r3 = d[:, 1], d[:, 2], d[:, 3]
    q = v * v
    acceleration = r1 * a[:, None] + r2 * q[:, None]
    jerk = r1 * j[:, None] + 3.0 * r2 * (v * a)[:, None] + r3 * (q * v)[:, None]
    worst: Array = q / feed_squared_bound(r1, r2, feed, limits, axes, period, linear)
    worst = np.maximum(worst, np.max(np.abs(acceleration) / axes.acceleration, axis=1))
    worst = np.maximum(worst, np.max(np.abs(jerk) / axes.jerk, axis=1) ** (2.0 / 3.0))
    worst = np.maximum(worst, np.maximum(a / limits.acceleration, -a / float(limits.deceleration or np.inf)))
    tangential = min(limits.jerk, limits.deceleration_jerk or np.inf)
    worst = np.maximum(worst, (np.abs(j) / tangential) ** (2.0 / 3.0))
    return worst

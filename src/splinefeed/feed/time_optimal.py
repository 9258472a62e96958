"""The `time-optimal` strategy: least time under all limits at once, axis jerk included."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.audit import tick_excess
from splinefeed.feed.bounds import AxisLimits, deceleration, deceleration_jerk
from splinefeed.feed.cells import sample
from splinefeed.feed.corners import Corners, check_turns, find_corners, worth
from splinefeed.feed.law_pieces import Pieces
from splinefeed.feed.look_ahead import plan_look_ahead
from splinefeed.feed.moving import finished
from splinefeed.feed.seven_phase import SevenPhase, plan_seven_phase
from splinefeed.feed.square import Setting
from splinefeed.feed.steady import steady
from splinefeed.feed.stretches import check_duration, curve_feeds, lasting
from splinefeed.feed.ticks import held_at_ticks
from splinefeed.feed.window import MOST_BOUNDS, solve
from splinefeed.feed.windows import joints, solve_long
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.records import Array, Limits, TimeLaw

STRATEGY = "time-optimal"
#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
#: A solution that must be made this many times longer at last is held against the slow plan that always goes; a plan
#: that lasts this many times its lower bound, against that of `look-ahead`.
POOR = 1.2
#: A stretch below this share of the path has no room for cells above the rounding of s.
UNRESOLVED = 1e-11
#: Where the optimiser found nothing, no stretch may last longer than so many periods and MOST_BOUNDS times the lower
#: bound: looking at every tick, once, would take minutes.
MOST_TICKS = 1e7
#: Rounds of slowing a stretch down until the differences of its setpoints keep their limits.
SLOWINGS = 20


@dataclass(frozen=True, eq=False)
class StretchPlan:
    """Motion over one stretch and a lower bound of its time, s; `slow` if it is no optimum but what always goes.

    moving  whether an end is in motion: it must not be stretched in time;  late  s by which it then ends after a tick
    """

    pieces: Pieces
    lower_bound: float
    slow: bool = False
    moving: bool = False
    late: float = 0.0


def plan_time_optimal(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Least time under feed, chord error, centripetal, tangential and axis limits, at rest at the stops.

    The path begins at start_feed and ends at end_feed, without acceleration along the path where that is not 0. Each
    stretch between stops is solved on its own, stretched in time to a whole number of periods; one with an end in
    motion gets a lower top feed instead, and where that cannot be its last period is a short one. settings of the
    law hold `lower_bound_s`: the time of the relaxation without jerk limits, which no plan can be faster than. Where
    the optimiser finds nothing for a stretch, or a whole that lasts more than POOR times the bound, and `look-ahead` is
    faster, the motion is that one's; notes say so.
    Raises LimitsError for limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk
    without a period; PlanError for end feeds that the path is too short for, and where the linear axes stand
    still while a limited rotary one turns on, or nearly, so that the rounding of arc length is over its limits.
    """
    axes = AxisLimits.of(limits, path.axes)
    _check(path, limits, axes, period)
    corners = find_corners(path, limits, axes, period)
    check_turns(path, corners.marks, axes)
    setting = Setting(limits, axes, period, corners.passed, corners.feed, corners.sharp, corners.narrow)
    spans = list(pairwise(corners.marks.tolist()))
    feeds = [
        (limits.start_feed if k == 0 else 0.0, limits.end_feed if k == len(spans) - 1 else 0.0)
        for k in range(len(spans))
    ]
    plans = [_stretch(path, low, high, ends, setting) for (low, high), ends in zip(spans, feeds, strict=True)]
    bound = _bound(plans, corners, limits, axes)
    seconds = sum(plan.pieces.duration for plan in plans)
    if any(plan.slow for plan in plans) or seconds > POOR * bound > 0.0:
        swifter = _looked_ahead(path, limits, period, seconds, bound)
        if swifter is not None:
            return swifter
    _check_durations(plans, corners.marks, period)
    breaks, coefficients = [np.zeros(1)], []
    tick = 0
    start = late = 0.0
    for plan in plans:
        factor = 1.0
        if period is not None and not plan.moving:
            ticks = _ticks(path, plan.pieces, setting)
            tick += ticks
            factor = ticks * period / plan.pieces.duration
        pieces = plan.pieces.stretched(factor)
        times = start + pieces.times[1:]
        if period is not None:
            if plan.moving:
                tick += round((plan.pieces.duration - plan.late) / period)
            late += plan.late
            times[-1] = tick * period + late
        breaks.append(times)
        coefficients.append(pieces.coefficients)
        start = float(times[-1])
    instants, polynomials = lasting(np.concatenate(breaks), np.concatenate(coefficients))
    law = TimeLaw(
        breaks=instants,
        coefficients=polynomials,
        strategy=STRATEGY,
        period=period,
        settings={"lower_bound_s": bound},
        notes=_notes(plans, corners.marks, period),
    )
    return held_at_ticks(law, path, limits)


def _bound(plans: list[StretchPlan], corners: Corners, limits: Limits, axes: AxisLimits) -> float:
    """Lower bound of the whole time, s; a rest that nobody asked for costs at most the way up to next to nothing."""
    push = min(limits.acceleration, float(np.min(axes.acceleration)))
    saved = 2.0 * corners.rests * worth(limits, axes) / push
    return max(float(sum(plan.lower_bound for plan in plans)) - saved, 0.0)


def _looked_ahead(path: Path, limits: Limits, period: float | None, seconds: float, bound: float) -> TimeLaw | None:
    """The whole motion by `look-ahead`, if it takes less than so many seconds: where the optimiser found no better."""
    try:
        law = plan_look_ahead(path, limits, period)
    except (LimitsError, PlanError):
        return None
    note = "planned by look-ahead, as the optimiser found no better; the lower bound is the optimiser's"
    law = replace(law, strategy=STRATEGY, settings={"lower_bound_s": bound}, notes=(*law.notes, note))
    return law if law.duration < seconds else None


def _notes(plans: list[StretchPlan], marks: Array, period: float | None) -> tuple[str, ...]:
    """A sentence on the stretches that are slower than they could be, and on each that does not end on a tick."""
    notes = []
    for k, plan in enumerate(plans):
        if plan.late > 0.0:
            reason = "its end feeds leave no top feed to lower"
            place = f"the stop at {marks[k + 1]:g} mm falls {plan.late:.6g} s after a tick"
            if k == len(plans) - 1:
                place = f"the last period is a short one, {plan.late:.6g} s of {period:g} s"
            notes.append(f"{place}: {reason}")
    slow = [k for k, plan in enumerate(plans) if plan.slow]
    if not slow:
        return tuple(notes)
    k = slow[0]
    return (
        *notes,
        f"{len(slow)} stretch(es) are planned at one slow feed, as the optimiser found no better: the first from "
        f"{marks[k]:.6g} to {marks[k + 1]:.6g} mm",
    )


def _ticks(path: Path, pieces: Pieces, setting: Setting) -> int:
    """Periods that the stretch lasts: as few as hold it and keep what its setpoints show within the limits."""
    period = float(setting.period or 0.0)
    ticks = max(math.ceil(pieces.duration / period * (1.0 - 1e-12) - 1e-9), 1)
    for _ in range(SLOWINGS):
        stretched = pieces.stretched(ticks * period / pieces.duration)
        over = float(np.max(tick_excess(path, stretched, setting, 0.0, (True, True))))
        if over <= 1.0:
            return ticks
        ticks = max(math.ceil(ticks * math.sqrt(over)), ticks + 1)
    return ticks


def _check(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> None:
    """Raise for what this strategy cannot do."""
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


def _check_durations(plans: list[StretchPlan], marks: Array, period: float | None) -> None:
    """Raise PlanError for a stretch that the limits make last for ever."""
    for k, plan in enumerate(plans):
        longest = math.inf
        if plan.slow and period is not None:
            longest = max(MOST_TICKS * period, MOST_BOUNDS * plan.lower_bound)
        check_duration(plan.pieces.duration, marks[k], marks[k + 1], longest)


def _stretch(path: Path, low: float, high: float, feeds: tuple[float, float], setting: Setting) -> StretchPlan:
    """Plan one stretch with these feeds at its ends, mm/s, 0 for rest."""
    straight = _straight(path, low, high, feeds, setting)
    if straight is not None:
        return straight
    if max(feeds) > 0.0:
        found = solve(path, low, high, feeds, setting)
        pieces, whole = finished(path, found, setting)
        late = 0.0 if whole or setting.period is None else pieces.duration % setting.period
        return StretchPlan(pieces, found.lower_bound, moving=True, late=late)
    if high - low < UNRESOLVED * path.length:
        return StretchPlan(steady(path, low, high, setting), 0.0)
    try:
        at, half = joints(path, low, high, setting)
        long = solve_long(path, low, high, setting, at, half) if len(at) else None
        if long is not None and long.over <= POOR:
            return StretchPlan(long.pieces.stretched(math.sqrt(long.over) * (1.0 + 1e-12)), long.lower_bound)
        found = solve(path, low, high, feeds, setting)
    except PlanError:
        return StretchPlan(steady(path, low, high, setting), 0.0, slow=True)
    factor = math.sqrt(max(float(np.max(found.over)), 1.0)) * (1.0 + 1e-12)
    plan = StretchPlan(found.pieces.stretched(factor), found.lower_bound)
    if factor > POOR or np.any(found.pieces.coarse):
        slow = steady(path, low, high, setting)
        if np.any(found.pieces.coarse) or slow.duration < plan.pieces.duration:
            return StretchPlan(slow, found.lower_bound, slow=True)
    return plan


def _straight(path: Path, low: float, high: float, feeds: tuple[float, float], setting: Setting) -> StretchPlan | None:
    """The exact seven-phase profile of a straight stretch, whose axes' limits are limits along the path; else None."""
    limits, axes = setting.limits, setting.axes
    curve, u, _ = sample(path, low, high, 3)
    if len(curve) == 0:
        return None
    d = by_arc_length(path.evaluate(curve, u, 2 + 1), path.linear)
    # a rotary axis without limits may turn as it likes
    counts = np.isfinite(axes.velocity) | np.isfinite(axes.acceleration) | np.isfinite(axes.jerk)
    counts[: path.linear] = True
    moves = np.any(d[:, 1] != 0.0, axis=0)
    d = np.where(counts, d, 0.0)
    length = high - low
    tops = curve_feeds(path, limits)[curve]
    if np.ptp(tops) > 0.0 or not np.all(np.isfinite(d)):
        return None
    # one axis alone goes straight, whatever rounding makes of its r'' where it hardly moves on
    alone = np.count_nonzero(np.any(d[:, 1:] != 0.0, axis=(0, 1))) == 1
    if (not alone and np.max(np.abs(d[:, 2])) * length > STRAIGHT) or np.max(np.ptp(d[:, 1], axis=0)) > STRAIGHT:
        return None
    with np.errstate(divide="ignore"):
        steepest = 1.0 / np.max(np.abs(d[:, 1]), axis=0)
    push, twist = float(np.min(axes.acceleration * steepest)), float(np.min(axes.jerk * steepest))
    up, down = min(limits.acceleration, push), min(deceleration(limits), push)
    jerk, falling = min(limits.jerk, twist), min(deceleration_jerk(limits), twist)
    if not np.any(np.isfinite([up, down, jerk, falling])):
        turning = [axis for axis, turns in zip(path.axes, moves, strict=True) if turns]
        raise LimitsError(
            f"from {low:.6g} to {high:.6g} mm only {' '.join(turning)} moves, and nothing limits its acceleration or "
            f"jerk: give axis_acceleration.{turning[0]}, or an acceleration of the path"
        )
    if not math.isfinite(up + down + jerk + falling):
        return None
    feed = min(float(np.min(tops)), float(np.min(axes.velocity * steepest)))
    along = Limits(feed=feed, acceleration=up, deceleration=down, jerk=jerk, deceleration_jerk=falling)
    start, end = feeds
    moving = max(feeds) > 0.0
    late = 0.0
    if max(feeds) > feed:
        return None
    if moving:
        law = plan_seven_phase(_Straight(length), replace(along, start_feed=start, end_feed=end), setting.period)
        late = law.duration % setting.period if law.notes and setting.period is not None else 0.0
    else:
        law = SevenPhase.solve(length, along).law()
    coefficients: Array = law.coefficients.copy()
    coefficients[:, 0] += low
    # without jerk: a trapezoid, or a triangle where there is no room for the feed
    room = 2.0 * length + start * start / up + end * end / down
    top = max(min(feed, math.sqrt(room * up * down / (up + down))), start, end)
    rising = (top * top - start * start) / (2.0 * up) + (top * top - end * end) / (2.0 * down)
    bound = (top - start) / up + (top - end) / down + (length - rising) / top
    pieces = Pieces(law.breaks.copy(), coefficients, np.zeros(0, dtype=bool), 0)
    return StretchPlan(pieces, bound, moving=moving, late=late)


@dataclass(frozen=True)
class _Straight:
    """A straight stretch of this length, mm, as `plan_seven_phase` takes it."""

    length: float
    stops: tuple[float, ...] = ()

"""The seven-phase feed profile of one stretch, and of a path that rests at its stops."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.paths.path import Path
from splinefeed.planner import profiles
from splinefeed.planner.constants import ALMOST, SAME
from splinefeed.planner.profiles import ROUNDING
from splinefeed.planner.shared import with_dwells
from splinefeed.records import Array, Limits, TimeLaw

STRATEGY = "seven-phase"
#: The limits that it needs, as `profiles.solve` takes them.
ALONG = ("feed", "acceleration", "deceleration", "jerk", "deceleration_jerk")
#: Halvings that find a rise of feed to its last digit, be it 2^-150 of the whole one.
HALVINGS = 200


def plan_seven_phase(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Plan one seven-phase profile a stretch between stops, at rest at each stop, each ending on a tick if it can.

    Parameters
    ----------
    path : Path
        Of the motion.
    limits : Limits
        Only those along the path are obeyed: feed (on each stretch the least that the path asks for there),
        acceleration, deceleration and their jerks. It knows nothing of the axes, of curvature or of chord error;
        `check` tells what those see.
    period : float or None
        Servo period, s.

    Returns
    -------
    TimeLaw
        The law.

    Raises
    ------
    PlanError
        Where the first or last stretch has no room.
    LimitsError
        For a period longer than the motion.
    """
    marks = _apart(np.array([0.0, *path.stops, path.length]))
    _, *along, start_feed, end_feed = _along(limits)
    feeds, most = _feeds(path, limits, marks)
    length, start, end = np.diff(marks), np.zeros(len(feeds)), np.zeros(len(feeds))
    start[0], end[-1] = start_feed, end_feed
    notes, slowed = [], np.flatnonzero(feeds < most)
    if len(slowed):
        low, high = marks[slowed[0] : slowed[0] + 2].tolist()
        notes.append(
            f"{len(slowed)} stretch(es) run at the least feed of their curves throughout, as this strategy makes one "
            f"profile a stretch: the first from {low:g} to {high:g} mm at {feeds[slowed[0]]:g} mm/s"
        )
    for k in (0, len(feeds) - 1):
        if period is not None and max(start[k], end[k]) > 0.0:
            feeds[k] = _on_a_tick(length[[k]], feeds[k], [*along, start[k], end[k]], period)
    found = profiles.solve_in_row(length, feeds, *along, start, end)
    total = float(np.sum(found.duration))
    if math.isnan(total):
        failed, last = int(np.argmax(np.isnan(found.duration))), len(feeds) - 1
        low, high = marks[failed : failed + 2].tolist()
        what = f"the stretch from {low:g} to {high:g} mm" if last else f"a path of {high:g} mm"
        ends = start_feed if failed == 0 else None, end_feed if failed == last else None
        raise _no_room(what, high - low, *ends, limits)
    if period is not None and period * (1.0 - SAME) > total:
        raise LimitsError(
            f"period is {period:g} s, longer than the whole motion of {total:.6g} s; "
            f"choose a period of at most {_outward(total * (1.0 + ROUNDING), ROUND_FLOOR)} s"
        )
    breaks, coefficients = profiles.lay_out(found, marks, period)
    late = 0.0 if period is None else breaks[-1] - math.floor(breaks[-1] / period + ALMOST) * period
    if period is not None and late > ALMOST * period:
        reason = "its end feeds leave no top feed to lower"
        notes.append(f"the last period is short, {late:.6g} s of {period:g} s: {reason}")
    law = TimeLaw(breaks=breaks, coefficients=coefficients, strategy=STRATEGY, period=period, notes=tuple(notes))
    return with_dwells(law, path.dwells, path.length)


def _on_a_tick(length: Array, feed: float, limits: Sequence[float], period: float) -> float:
    """The feed, mm/s, up to which a stretch with an end in motion lasts whole periods; as it is if there is none."""

    def seconds(feed: float) -> float:
        return float(profiles.solve_in_row(length, feed, *limits).duration[0])

    fastest, least = seconds(feed), max(limits[-2:])
    wanted = float(profiles.whole_periods(np.array(fastest), period)) * period
    if not period <= fastest < wanted <= seconds(least):
        return feed
    return least + _largest(lambda more: seconds(least + more) >= wanted, feed - least)


def _feeds(path: Path, limits: Limits, marks: Array) -> tuple[Array, Array]:
    """Least and greatest feed, mm/s, of the curves between neighbouring marks (m + 1,), (m,)."""
    feeds, near = path.feeds_within(limits.feed), SAME * path.length
    first = np.searchsorted(path.curve_starts[:-1], marks[:-1] + near, side="right") - 1
    last = np.searchsorted(path.curve_starts[:-1], marks[1:] - near, side="left") - 1
    ends = np.stack([first, np.maximum(first, last) + 1], axis=1).ravel()
    feeds = np.append(feeds, feeds[-1])
    return np.minimum.reduceat(feeds, ends)[::2], np.maximum.reduceat(feeds, ends)[::2]


def _along(limits: Limits) -> list[float]:
    """The limits that `profiles.solve` takes; LimitsError where one is missing."""
    found = [float(getattr(limits, name)) for name in (*ALONG, "start_feed", "end_feed")]
    if math.inf in found:
        raise LimitsError(f"the {STRATEGY} strategy needs a limit on {ALONG[found.index(math.inf)]}; none is given")
    return found


def _no_room(what: str, length: float, start_feed: float | None, end_feed: float | None, limits: Limits) -> PlanError:
    """The error for a stretch that is too short for its change of feed: the length, and each feed, that would do.

    length mm; start_feed, end_feed mm/s, None at a stop, where the tool stops whatever the limits say.
    """
    start, end = start_feed or 0.0, end_feed or 0.0
    _, acceleration, deceleration, jerk, deceleration_jerk, _, _ = _along(limits)
    down = start > end
    steepest = (deceleration, deceleration_jerk) if down else (acceleration, jerk)
    slow, fast = min(start, end), max(start, end)

    def way(low: float, rise: float) -> float:
        return (low + 0.5 * rise) * float(profiles.ramp(rise, *steepest)[0])  # eq. (21)

    least = way(slow, fast - slow) * (1.0 - 0.5 * ROUNDING)  # what `solve` allows for
    # Raising the slow end: its length grows with the rise, then may fall again (a full stop can be shorter than a
    # brake to a third), but at the full rise it is still too long: so from the first rise that does not fit, none does.
    higher = fast - _largest(lambda rise: way(fast - rise, rise) <= length, fast - slow)
    lower = slow + _largest(lambda rise: way(slow, rise) <= length, fast - slow)
    at_most = f"of at most {_outward(lower, ROUND_FLOOR, slow)} mm/s"
    at_least = f"of at least {_outward(higher, ROUND_CEILING, fast)} mm/s"
    begin, finish = (at_most, at_least) if down else (at_least, at_most)
    mends = ((start_feed, f"a start_feed {begin}"), (end_feed, f"an end_feed {finish}"))
    return PlanError(
        f"{what} is too short to {'slow down' if down else 'speed up'} from {start:g} to {end:g} mm/s: "
        f"that takes at least {_outward(least, ROUND_CEILING)} mm; "
        f"choose {' or '.join(mend for feed, mend in mends if feed is not None)}"
    )


def _largest(fits: Callable[[float], bool], high: float) -> float:
    """The largest x in [0, high] that fits, where everything below a point fits and nothing above it."""
    low = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _outward(value: float, rounding: str, bound: float | None = None) -> str:
    """Six digits, rounded to the side that still holds; more where six would pass `bound`, and at last the bound."""
    for digits in (6, 9, 12):
        rounded = float(Context(prec=digits, rounding=rounding).create_decimal(Decimal(value)))
        if bound is None or (rounded <= bound if rounding == ROUND_CEILING else rounded >= bound):
            return f"{rounded:.{digits}g}"
    return repr(bound)


def _apart(marks: Array) -> Array:
    """The marks (m,), mm, without those that rounding puts beside another; both ends stay."""
    same, inner = SAME * marks[-1], marks[1:-1]
    return np.concatenate([marks[:1], inner[(np.diff(marks[:-1]) > same) & (marks[-1] - inner > same)], marks[-1:]])

"""The `look-ahead` strategy: close to the least time under all limits, window by window, at a bounded cost a block."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.look_ahead_periods import in_periods
from splinefeed.feed.look_ahead_window import LEAST_TICKS, STRATEGY, Part, Window, asked_for, limit_row, row_feeds
from splinefeed.feed.stretches import check_duration, lasting
from splinefeed.feed.ticks import held_at_ticks
from splinefeed.geometry.path import Path
from splinefeed.kernels.look_ahead_path import FEED, OF_AXES, PERIOD
from splinefeed.kernels.look_ahead_profiles import held
from splinefeed.records import LAW_COEFFICIENTS, Array, Limits, TimeLaw

#: Shares of all limits that motion with a moving end leaves unused, until slowing it down stays within them.
RESERVES = (0.0, 1e-3, 1e-2, 5e-2, 0.2)


def plan_look_ahead(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Close to the least time under all limits, window by window, at rest at stops and where nobody says else.

    The path begins at start_feed and ends at end_feed, without acceleration along the path where that is not 0.
    Each stretch between stops lasts whole periods: it is stretched in time, or slowed down between ends in motion.
    Raises LimitsError for limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk
    without a period; PlanError for feeds at the ends that the path is too short for, and where the linear axes stand
    still while a limited rotary one turns on, or nearly, so that the rounding of arc length is over its limits.
    """
    limit = limit_row(limits, path.axes, period)
    if period is None and np.any(np.isfinite(limit[OF_AXES + 2 * len(path.axes) :])):
        jumps = [corner for corner in path.corners if not corner.stop]
        if jumps:
            raise LimitsError(
                f"the curvature jumps at s = {jumps[0].s:.6g} mm, where axis jerk is infinite at any feed; "
                "give the servo period, over which a drive sees it"
            )
    feeds, marks = row_feeds(path, limits, limit)
    breaks, coefficients = [np.zeros(1)], []
    tick = 0
    start = late = 0.0
    notes = []
    asked = asked_for(path, marks)
    for (low, high), known in zip(pairwise(marks.tolist()), asked[:-1] & asked[1:], strict=True):
        ends = (limits.start_feed if low == 0.0 else 0.0, limits.end_feed if high == path.length else 0.0)
        part, whole = _stretch(path, feeds, limit, low, high, ends)
        seconds = float(np.sum(part.spans))
        check_duration(seconds, low, high)
        factor = 1.0
        if period is not None and max(ends) == 0.0:
            ticks = max(math.ceil(seconds / period * (1.0 - 1e-12) - 1e-9), 1 if known else LEAST_TICKS)
            factor = ticks * period / seconds
        elif period is not None:
            ticks = round(seconds / period) if whole else math.floor(seconds / period)
            if not whole:
                late += seconds - ticks * period
                notes.append(_note(high, path.length, seconds - ticks * period, period))
        times = start + np.cumsum(part.spans) * factor
        if period is not None:
            tick += ticks
            times[-1] = tick * period + late
        local = part.coefficients.copy()
        local[:, 0] = part.starts
        breaks.append(times)
        coefficients.append(local / factor ** np.arange(LAW_COEFFICIENTS))
        start = float(times[-1])
    instants, pieces = lasting(np.concatenate(breaks), np.concatenate(coefficients))
    law = TimeLaw(breaks=instants, coefficients=pieces, strategy=STRATEGY, period=period, notes=tuple(notes))
    return held_at_ticks(law, path, limits)


def _stretch(
    path: Path, feeds: Array, limit: Array, low: float, high: float, ends: tuple[float, float]
) -> tuple[Part, bool]:
    """Plan [low, high], mm, with these feeds at its ends, mm/s, 0 for rest; and whether it lasts whole periods.

    From rest to rest it need not: a stretch of the whole time does that.
    """
    period = float(limit[PERIOD])
    part: Part | None = None
    for reserve in RESERVES if max(ends) > 0.0 and period > 0.0 else (0.0,):
        allowed = _with_reserve(limit, reserve, max(ends))
        window = Window(allowed, path.shape)
        window.begin(low, ends[0])
        parts = []
        try:
            while window.low < high:
                parts.append(window.advance(path.table, feeds, high, ends[1]))
        except PlanError:
            if part is None:
                raise
            break  # nothing could be left unused
        found = Part(
            np.concatenate([each.starts for each in parts]),
            np.concatenate([each.spans for each in parts]),
            np.concatenate([each.coefficients for each in parts]),
        )
        part = found if part is None else part
        if max(ends) == 0.0 or period == 0.0:
            return part, False
        slower = in_periods(found, high, (ends[0] > 0.0, ends[1] > 0.0), period)
        if slower is None:
            continue
        nodes = np.append(slower.starts, high)
        if held(path.table, feeds, path.shape, limit, len(slower), nodes, slower.spans, slower.coefficients) <= 1.0:
            return slower, True
    assert part is not None
    return part, False


def _with_reserve(limit: Array, reserve: float, feed: float) -> Array:
    """The limits as `limit_row` has them, lower by this share; those of velocity leave the feed at an end, mm/s."""
    allowed = limit * (1.0 - reserve)
    allowed[FEED] = max(allowed[FEED], min(limit[FEED], feed))
    allowed[PERIOD] = limit[PERIOD]
    return allowed


def _note(high: float, length: float, late: float, period: float) -> str:
    """What is said of a stretch with a moving end that could not be made to last whole periods."""
    place = f"the stop at {high:g} mm falls {late:.6g} s after a tick"
    if high == length:
        place = f"the last period is a short one, {late:.6g} s of {period:g} s"
    return f"{place}: its end feeds leave nothing to slow down"

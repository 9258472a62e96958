"""The `look-ahead` strategy: close to the least time under all limits, window by window, at a bounded cost a block."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.look_ahead_window import Part, Window, limit_row
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.path import Path
from splinefeed.kernels.look_ahead import OF_AXES
from splinefeed.kernels.pieces import START
from splinefeed.records import LAW_COEFFICIENTS, Array, Limits, TimeLaw

STRATEGY = "look-ahead"


def plan_look_ahead(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Close to the least time under all limits, at rest at the ends and at stops, planned window by window.

    Raises LimitsError for limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk
    without a period; PlanError for end feeds that are not 0.
    """
    limit = limit_row(limits, path.axes, period)
    check_limits(limits, limit, len(path.axes))
    if limits.start_feed or limits.end_feed:
        raise PlanError(f"the {STRATEGY} strategy begins and ends at rest; leave start_feed and end_feed at 0")
    if period is None and np.any(np.isfinite(limit[OF_AXES + 2 * len(path.axes) :])):
        jumps = [corner for corner in path.corners if not corner.stop]
        if jumps:
            raise LimitsError(
                f"the curvature jumps at s = {jumps[0].s:.6g} mm, where axis jerk is infinite at any feed; "
                "give the servo period, over which a drive sees it"
            )
    feeds = np.repeat(curve_feeds(path, limits), path.curve_rows[:, 1] - path.curve_rows[:, 0] + 1)
    window = Window(limit, path.shape)
    breaks, coefficients = [np.zeros(1)], []
    tick = 0
    start = 0.0
    for low, high in pairwise([0.0, *path.stops, path.length]):
        parts = _stretch(window, path.table, feeds, low, high)
        times = np.cumsum(np.concatenate([part.spans for part in parts]))
        local = np.concatenate([part.coefficients for part in parts])
        local[:, 0] = np.concatenate([part.starts for part in parts])
        factor = 1.0
        if period is not None:
            ticks = max(math.ceil(times[-1] / period * (1.0 - 1e-12) - 1e-9), 1)
            tick += ticks
            factor = ticks * period / times[-1]
        times = start + times * factor
        if period is not None:
            times[-1] = tick * period
        breaks.append(times)
        coefficients.append(local / factor ** np.arange(LAW_COEFFICIENTS))
        start = float(times[-1])
    return TimeLaw(
        breaks=np.concatenate(breaks), coefficients=np.concatenate(coefficients), strategy=STRATEGY, period=period
    )


def check_limits(limits: Limits, limit: Array, axes: int) -> None:
    """Raise LimitsError for limits that leave both acceleration and jerk free."""
    if not np.any(np.isfinite([*limit[1:4], *limit[OF_AXES + axes :]])):
        raise LimitsError(
            f"the {STRATEGY} strategy needs a limit on acceleration or jerk, of the path or of its axes; none is given"
        )


def _stretch(window: Window, table: Array, feeds: Array, low: float, high: float) -> list[Part]:
    """Plan [low, high], mm, from rest to rest, window by window."""
    parts: list[Part] = []
    window.begin(low)
    while window.low < high:
        first = max(int(np.searchsorted(table[:, START], window.low, side="right")) - 1, 0)
        chosen = slice(first, first + window.rows + 1)
        parts.append(window.advance(table[chosen], feeds[chosen], high))
    return parts

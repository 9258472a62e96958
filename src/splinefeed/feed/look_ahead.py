"""The `look-ahead` strategy: close to the least time under all limits, window by window, at a bounded cost a block."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.path import Path
from splinefeed.kernels import look_ahead as kernels
from splinefeed.kernels import look_ahead_window as windows
from splinefeed.kernels.pieces import START, Shape
from splinefeed.records import AXIS_LIMITS, LAW_COEFFICIENTS, Array, Limits, TimeLaw

STRATEGY = "look-ahead"
#: Cells of a window; what leaves it is final.
WINDOW = 1200
#: Least part of a window's pieces that is kept back and planned again with what follows.
KEPT_BACK = 0.5
#: Rows of the path that a window may have: where arc length is finely cut, cells span several.
MOST_ROWS = 4 * WINDOW


@dataclass(frozen=True, eq=False)
class Part:
    """Pieces of the motion: where each begins, mm (m,), how long it lasts, s (m,), and its coefficients (m, 6).

    Coefficients count s from the start of the piece.
    """

    starts: Array
    spans: Array
    coefficients: Array

    def cut(self, first: int, last: int) -> Part:
        """The pieces first ... last - 1."""
        return Part(self.starts[first:last], self.spans[first:last], self.coefficients[first:last])

    @property
    def duration(self) -> float:
        """s."""
        return float(np.sum(self.spans))


def plan_look_ahead(path: Path, limits: Limits, period: float | None) -> TimeLaw:
    """Close to the least time under all limits, at rest at the ends and at stops, planned window by window.

    Raises LimitsError for limits that leave acceleration and jerk free, and for curvature jumps under an axis jerk
    without a period; PlanError for end feeds that are not 0.
    """
    limit = limit_row(limits, path.axes, period)
    _check(path, limits, limit, period)
    feeds = np.repeat(curve_feeds(path, limits), path.curve_rows[:, 1] - path.curve_rows[:, 0] + 1)
    breaks, coefficients = [np.zeros(1)], []
    tick = 0
    start = 0.0
    for low, high in pairwise([0.0, *path.stops, path.length]):
        parts = plan_stretch(path.table, feeds, path.shape, low, high, limit)
        spans = np.concatenate([part.spans for part in parts])
        local = np.concatenate([part.coefficients for part in parts])
        local[:, 0] = np.concatenate([part.starts for part in parts])
        times = np.cumsum(spans)
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


def limit_row(limits: Limits, axes: tuple[str, ...], period: float | None) -> Array:
    """The limits as `kernels.look_ahead` wants them, (7 + 3 axes,)."""
    other = limits.deceleration, limits.deceleration_jerk, limits.centripetal, limits.chord_error
    deceleration, deceleration_jerk, centripetal, chord = (math.inf if value is None else value for value in other)
    head = [limits.feed, limits.acceleration, deceleration, min(limits.jerk, deceleration_jerk), centripetal, chord]
    return np.concatenate([[*head, period or 0.0], *(limits.of_axes(name, axes) for name in AXIS_LIMITS)])


def plan_stretch(table: Array, feeds: Array, shape: Shape, low: float, high: float, limit: Array) -> list[Part]:
    """Plan [low, high], mm, of the rows of a path from rest to rest, window by window; feeds (rows,) mm/s."""
    parts: list[Part] = []
    room = 2 * WINDOW
    ahead: Part | None = None  # the rest of the last plan, which ends at rest
    state, rest = np.zeros(2), np.ones(2)
    while low < high:
        first = max(int(np.searchsorted(table[:, START], low, side="right")) - 1, 0)
        last = int(np.searchsorted(table[first:, START], high, side="left")) + first
        rows = table[first : min(last, first + MOST_ROWS)]
        end = high if last <= first + MOST_ROWS else float(table[first + MOST_ROWS, START])
        tops = feeds[first : first + len(rows)]
        end = windows.window_end(rows, tops, shape, low, end, rest, limit, WINDOW)
        nodes, spans, law = np.empty(room), np.empty(room), np.empty((room, LAW_COEFFICIENTS))
        report = np.zeros(4)
        count = windows.plan_window(rows, tops, shape, low, end, state, rest, limit, nodes, spans, law, report)
        if count <= 0:
            if ahead is None:
                raise PlanError(f"no feed was found that keeps the limits between s = {low:.6g} and {end:.6g} mm")
            parts.append(ahead)
            low = float(low_after(ahead))
            state, rest, ahead = np.zeros(2), np.ones(2), None
            continue
        part = Part(nodes[:count].copy(), spans[:count].copy(), law[:count].copy())
        if end >= high:
            parts.append(part)
            break
        kept = int(count * (1.0 - KEPT_BACK))
        parts.append(part.cut(0, kept))
        ahead = part.cut(kept, count)
        low = float(nodes[kept])
        state = np.array([law[kept, 1], 2.0 * law[kept, 2]])
        rest = np.array([0.0, 1.0])
    return parts


def low_after(part: Part) -> float:
    """Arc length at the end of a part, mm."""
    t, c = float(part.spans[-1]), part.coefficients[-1]
    return float(part.starts[-1] + sum(c[k] * t**k for k in range(1, LAW_COEFFICIENTS)))


def _check(path: Path, limits: Limits, limit: Array, period: float | None) -> None:
    """Raise for what this strategy cannot do."""
    if limits.start_feed or limits.end_feed:
        raise PlanError(f"the {STRATEGY} strategy begins and ends at rest; leave start_feed and end_feed at 0")
    axes = len(path.axes)
    jerks = limit[kernels.OF_AXES + 2 * axes :]
    if not np.any(np.isfinite([*limit[1:4], *limit[kernels.OF_AXES + axes :]])):
        raise LimitsError(
            f"the {STRATEGY} strategy needs a limit on acceleration or jerk, of the path or of its axes; none is given"
        )
    if period is None and np.any(np.isfinite(jerks)):
        jumps = [c for c in path.corners if not c.stop]
        if jumps:
            raise LimitsError(
                f"the curvature jumps at s = {jumps[0].s:.6g} mm, where axis jerk is infinite at any feed; "
                "give the servo period, over which a drive sees it"
            )

"""The window that looks ahead: plans to rest at its end, gives away the first half for good, and moves on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.kernels import look_ahead_window as kernels
from splinefeed.kernels.pieces import START, Shape
from splinefeed.records import AXIS_LIMITS, LAW_COEFFICIENTS, Array, Limits

#: Cells of a window, if nobody says else.
WINDOW = 600
#: Fewest cells of a window: with fewer, motion stops and goes.
LEAST_WINDOW = 32
#: Rows of the path that a window may have for each of its cells: where arc length is finely cut, cells span several.
ROWS_PER_CELL = 2
#: Where no new plan is found and fewer pieces of the last one are left than this, the motion comes to rest.
FEWEST_AHEAD = 8
#: A new plan may take this much longer than the last one to where that would rest, as cells are not the same.
SLOWER = 1.02
#: Part of the planned pieces that becomes final when more of the path is to come.
FINAL = 0.5


@dataclass(frozen=True, eq=False)
class Part:
    """Consecutive pieces of the motion.

    starts (m,)           arc length at which each begins, mm
    spans (m,)            how long each lasts, s
    coefficients (m, 6)   of the arc length from there, mm/s^k, by the time since then
    """

    starts: Array
    spans: Array
    coefficients: Array

    def __len__(self) -> int:
        return len(self.spans)

    def cut(self, first: int, last: int) -> Part:
        """The pieces first ... last - 1."""
        return Part(self.starts[first:last], self.spans[first:last], self.coefficients[first:last])


class Window:
    """Where the motion is, and what is planned beyond it, which ends at rest.

    low  arc length up to which the motion is final, mm
    """

    def __init__(self, limit: Array, shape: Shape, cells: int = WINDOW) -> None:
        self.limit, self.shape, self.cells = limit, shape, cells
        self.rows = ROWS_PER_CELL * cells
        self.begin(0.0)

    def begin(self, low: float, feed: float = 0.0) -> None:
        """Stand at arc length `low`, mm, or move there at a steady feed, mm/s."""
        self.low = low
        self._state = np.array([[feed, 0.0], [0.0, 0.0]])
        self._ahead: Part | None = None
        self._high = low

    def move(self, by: float) -> None:
        """Count arc length from elsewhere: everything is `by` mm further."""
        self.low += by
        self._high += by
        if self._ahead is not None:
            self._ahead = Part(self._ahead.starts + by, self._ahead.spans, self._ahead.coefficients)

    def advance(self, table: Array, feeds: Array, stop: float, end_feed: float = 0.0) -> Part:
        """Plan on, over rows (n, width) from the one that holds `low` and feeds (n,), mm/s; returns what is now final.

        stop: where the motion rests, or ends at `end_feed`, mm/s; infinite if that is not within the rows, of which
        there must be `self.rows` then. Raises PlanError where nothing is found.
        """
        rest = np.array([float(self._state[0, 0] == 0.0), 1.0])
        rows = table[: self.rows]
        end = stop
        if len(table) > self.rows and table[self.rows, START] < stop:
            end = float(table[self.rows, START])
        elif not stop < math.inf:
            end = float(table[-1, START])
        tops = feeds[: len(rows)]
        end = kernels.window_end(rows, tops, self.shape, self.low, end, rest, self.limit, self.cells)
        state = self._state.copy()
        if end >= stop and end_feed > 0.0:
            rest[1] = 0.0
            state[1, 0] = end_feed
        room = 2 * self.cells + 16
        nodes, spans, law = np.empty(room), np.empty(room), np.empty((room, LAW_COEFFICIENTS))
        report = np.zeros(4)
        count = kernels.plan_window(
            rows, tops, self.shape, self.low, end, state, rest, self.limit, nodes, spans, law, report
        )
        if count <= 0:
            return self._as_planned(end)
        part = Part(nodes[:count], spans[:count], law[:count])
        if self._ahead is not None and end > self._high:
            # a plan that only passes where the last one would already rest is none
            passing = float(np.sum(part.spans[nodes[1 : count + 1] <= self._high]))
            if passing > SLOWER * float(np.sum(self._ahead.spans)):
                return self._as_planned(end)
        if end >= stop:
            self.begin(stop)
            return part
        final = max(int(FINAL * count), 1)
        self._state[0] = law[final, 1], 2.0 * law[final, 2]
        self.low, self._high, self._ahead = float(nodes[final]), end, part.cut(final, count)
        return part.cut(0, final)

    def _as_planned(self, end: float) -> Part:
        """More of what was planned before, where a new plan was not found: its half, or the last of it, to rest."""
        part = self._ahead
        if part is None:
            raise PlanError(f"no feed was found that keeps the limits between s = {self.low:.6g} and {end:.6g} mm")
        if len(part) < FEWEST_AHEAD:
            self.begin(self._high)
            return part
        final = len(part) // 2
        self._state[0] = part.coefficients[final, 1], 2.0 * part.coefficients[final, 2]
        self.low, self._ahead = float(part.starts[final]), part.cut(final, len(part))
        return part.cut(0, final)


def limit_row(limits: Limits, axes: tuple[str, ...], period: float | None) -> Array:
    """The limits as `kernels.look_ahead` wants them, (7 + 3 axes,)."""
    other = limits.deceleration, limits.deceleration_jerk, limits.centripetal, limits.chord_error
    deceleration, deceleration_jerk, centripetal, chord = (math.inf if value is None else value for value in other)
    head = [limits.feed, limits.acceleration, deceleration, min(limits.jerk, deceleration_jerk), centripetal, chord]
    return np.concatenate([[*head, period or 0.0], *(limits.of_axes(name, axes) for name in AXIS_LIMITS)])

"""The window that looks ahead: plans to rest at its end, gives away the first half for good, and moves on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.bounds import AxisLimits, deceleration, deceleration_jerk
from splinefeed.feed.corners import SAME, apart, check_turns, passed_corners, worth
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.path import Path
from splinefeed.kernels import look_ahead_samples as samples
from splinefeed.kernels import look_ahead_window as kernels
from splinefeed.kernels.look_ahead_path import AT_CORNER, ON_ROW, PERIOD
from splinefeed.kernels.pieces import START, Shape
from splinefeed.records import AXIS_LIMITS, LAW_COEFFICIENTS, Array, BoolArray, Limits
from splinefeed.records.arrays import read_only

STRATEGY = "look-ahead"
#: Periods that motion lasts at least from or to a rest that nobody asked for: in one, a part of the path seems skipped.
LEAST_TICKS = 3
#: Setpoints are placed to about a tenth of this, mm.
TOLD_APART = 1e-8
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
#: Part of the planned pieces that becomes final when more of the path is to come, and of their way at least.
FINAL, LEAST_WAY = 0.5, 1e-3
#: A plan from rest that had to be stretched by more than this is held against those over shorter windows, ...
POOR = 1.05
#: ... of this share of the cells, one after the other.
SHORTER = 0.25


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

    low   arc length up to which the motion is final, mm
    work  cells that were solved for, times Newton steps, so far: what planning costs
    """

    def __init__(self, limit: Array, shape: Shape, cells: int = WINDOW) -> None:
        self.limit, self.shape, self.cells = limit, shape, cells
        self.rows = ROWS_PER_CELL * cells
        self.work = 0.0
        self.begin(0.0)

    def begin(self, low: float, feed: float = 0.0) -> None:
        """Stand at arc length `low`, mm, or move there at a steady feed, mm/s."""
        self.low = low
        self._state = np.array([[feed, 0.0], [0.0, 0.0]])
        self._ahead: Part | None = None
        self._high = low

    @property
    def needed(self) -> float:
        """Arc length from which on rows are needed, mm: what lies just behind the motion counts for it too."""
        return self.low - (kernels.REACH + 1.0) * float(self.limit[PERIOD] * self._state[0, 0])

    def move(self, by: float) -> None:
        """Count arc length from elsewhere: everything is `by` mm further."""
        self.low += by
        self._high += by
        if self._ahead is not None:
            self._ahead = Part(self._ahead.starts + by, self._ahead.spans, self._ahead.coefficients)

    def rows_ahead(self, table: Array) -> int:
        """How many rows of the table (n, width) are not behind the motion."""
        return len(table) - row_at(table, self.low)

    def advance(self, table: Array, feeds: Array, stop: float, end_feed: float = 0.0) -> Part:
        """Plan on over rows (n, width) and feeds (n, 2), see `row_feeds`; returns what is now final.

        stop: where the motion rests, or ends at `end_feed`, mm/s; infinite if that is not within the rows, of which
        there must be more than `self.rows` ahead then. Raises PlanError where nothing is found.
        """
        ahead = row_at(table, self.low) + self.rows
        chosen = slice(row_at(table, self.needed), ahead)
        # read-only, as a path's own table is: to the compiler an array that may be written to is another type
        rows, tops = read_only(np.ascontiguousarray(table[chosen])), np.ascontiguousarray(feeds[chosen])
        limit = min(stop, float(table[ahead, START]) if ahead < len(table) else stop)
        if not limit < math.inf:
            limit = float(table[-1, START])
        cells = self.cells
        part, end, share = self._planned(rows, tops, limit, stop, end_feed, cells)
        standing = self._state[0, 0] == 0.0
        while standing and not share <= POOR * POOR and not (end >= stop and end_feed > 0.0):
            cells = int(SHORTER * cells)
            if cells < LEAST_WINDOW:
                break
            other, nearer, its_share = self._planned(rows, tops, limit, stop, 0.0, cells)
            if other is None:
                continue
            pace = (end - self.low) / float(np.sum(part.spans)) if part is not None else 0.0
            if (nearer - self.low) / float(np.sum(other.spans)) > pace:
                part, end, share = other, nearer, its_share
        if part is None:
            return self._as_planned(end)
        if self._ahead is not None and end > self._high:
            # a plan that only passes where the last one would already rest is none
            passing = float(np.sum(part.spans[np.append(part.starts[1:], end) <= self._high]))
            if passing > SLOWER * float(np.sum(self._ahead.spans)):
                return self._as_planned(end)
        if end >= stop:
            self.begin(stop)
            return part
        # a plan may begin with pieces that last no time, as the feed is all but the highest: they are no way ahead
        final = max(int(FINAL * len(part)), int(np.searchsorted(part.starts, self.low + LEAST_WAY * (end - self.low))))
        final = min(max(final, 1), len(part) - 1)
        self._move_on(part, final, end)
        return part.cut(0, final)

    def _planned(
        self, rows: Array, tops: Array, limit: float, stop: float, end_feed: float, cells: int
    ) -> tuple[Part | None, float, float]:
        """A plan over about so many cells, up to where, mm, and by what share it was over a limit before a stretch."""
        rest = np.array([float(self._state[0, 0] == 0.0), 1.0])
        state = self._state.copy()
        end = kernels.window_end(rows, tops, self.shape, self.low, limit, rest, self.limit, cells)
        if end >= stop and end_feed > 0.0:
            rest[1] = 0.0
            state[1, 0] = end_feed
        room = 2 * cells + 16
        nodes, spans, law = np.empty(room), np.empty(room), np.empty((room, LAW_COEFFICIENTS))
        report = np.zeros(4)
        count = kernels.plan_window(
            rows, tops, self.shape, self.low, end, state, rest, self.limit, nodes, spans, law, report
        )
        self.work += report[2]
        if count <= 0:
            return None, end, math.inf
        return Part(nodes[:count], spans[:count], law[:count]), end, float(report[0])

    def _as_planned(self, end: float) -> Part:
        """More of what was planned before, where a new plan was not found: its half, or the last of it, to rest."""
        part = self._ahead
        if part is None:
            feed = f" from {self._state[0, 0]:g} mm/s" if self._state[0, 0] > 0.0 else ""
            raise PlanError(
                f"no feed was found that keeps the limits between s = {self.low:.6g} and {end:.6g} mm{feed}; ask for "
                "slower feeds at the ends, or for looser limits"
            )
        if len(part) < FEWEST_AHEAD:
            self.begin(self._high)
            return part
        final = len(part) // 2
        self._move_on(part, final, self._high)
        return part.cut(0, final)

    def _move_on(self, part: Part, final: int, high: float) -> None:
        """Make the first pieces of a part final; it rests at `high`, mm."""
        self._state[0] = part.coefficients[final, 1], 2.0 * part.coefficients[final, 2]
        self.low, self._high, self._ahead = float(part.starts[final]), high, part.cut(final, len(part))


def row_at(table: Array, s: float) -> int:
    """Row of a table (n, width) that holds arc length s, mm; the first one if it is before it."""
    return max(int(np.searchsorted(table[:, START], s, side="right")) - 1, 0)


def _slow_turns(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> Array:
    """Arc lengths (k,), mm, of turns of the tangent, no stops, that a chord error leaves next to no feed at."""
    if limits.chord_error is None or period is None:
        return np.zeros(0)
    corners = path.corners
    # a step d across a turn leaves it by at most d angle/4
    slow = 4.0 * limits.chord_error < worth(limits, axes) * period * corners.angle
    return np.asarray(corners.s[slow & ~corners.stop])


def asked_for(path: Path, marks: Array) -> BoolArray:
    """Whether the path says that the tool rests at marks (m,), mm, as `row_feeds` has them: at an end or a stop.

    Of stops that are nearer to each other than setpoints are placed to, none counts: nobody can tell which one it is.
    """
    asked = np.sort(np.array([0.0, *path.stops, path.length]))
    after = np.minimum(np.searchsorted(asked, marks), len(asked) - 1)
    gap = np.minimum(np.abs(asked[after] - marks), np.abs(asked[np.maximum(after - 1, 0)] - marks))
    found: BoolArray = gap <= SAME * path.length
    apart_enough = np.diff(marks) > TOLD_APART
    found[1:] &= apart_enough
    found[:-1] &= apart_enough
    return found


def _snapped(marks: Array, starts: Array, length: float) -> Array:
    """Marks (m,) that lie where a row starts, but for rounding, put there exactly: no sliver of a row is left.

    The last one stays at the end of the path, however little of it the last row is.
    """
    after = np.minimum(np.searchsorted(starts, marks), len(starts) - 1)
    for row in (after, np.maximum(after - 1, 0)):
        near = (np.abs(starts[row] - marks) <= SAME * length) & (marks < length)
        marks = np.where(near, starts[row], marks)
    return marks


def limit_row(limits: Limits, axes: tuple[str, ...], period: float | None) -> Array:
    """The limits as `kernels.look_ahead_path` wants them, (8 + 3 axes,).

    Raises LimitsError for limits that leave both acceleration and jerk free.
    """
    centripetal, chord = (math.inf if v is None else v for v in (limits.centripetal, limits.chord_error))
    head = [limits.feed, limits.acceleration, deceleration(limits), limits.jerk, deceleration_jerk(limits)]
    of_axes = [limits.of_axes(name, axes) for name in AXIS_LIMITS]
    if not np.any(np.isfinite(np.concatenate([head[1:], *of_axes[1:]]))):
        raise LimitsError(
            f"the {STRATEGY} strategy needs a limit on acceleration or jerk, of the path or of its axes; none is given"
        )
    return np.concatenate([[*head, centripetal, chord, period or 0.0], *of_axes])


def row_feeds(path: Path, limits: Limits, limit: Array) -> tuple[Array, Array]:
    """Largest feed on each row of a path and at the corner where it begins, (rows, 2), mm/s, and where the tool rests.

    The second is infinite where no corner is passed. The tool rests at both ends, at stops, and where a bend is so
    sharp that the feed there is next to nothing: arc lengths (m,), mm.
    Raises PlanError where the linear axes stand still while a limited rotary one turns on.
    """
    axes = AxisLimits.of(limits, path.axes)
    period = float(limit[PERIOD]) or None
    feeds = np.full((len(path.table), 2), math.inf)
    feeds[:, ON_ROW] = np.repeat(curve_feeds(path, limits), path.curve_rows[:, 1] - path.curve_rows[:, 0] + 1)
    passed, slow = passed_corners(path, limits, axes, period)
    for s, feed in zip(passed, slow, strict=True):
        feeds[int(np.argmin(np.abs(path.table[:, START] - s))), AT_CORNER] = feed
    bends = np.empty((len(path.table), 2))
    count = samples.sharp_bends(path.table, path.shape, worth(limits, axes) ** 2, limit, bends)
    in_motion = set(passed.tolist())
    asked = np.array([0.0, *(s for s in path.stops if s not in in_motion), path.length])
    bent = bends[np.argsort(bends[:count, 1], kind="stable"), 0]
    marks = apart(path.length, asked, np.concatenate([bent, _slow_turns(path, limits, axes, period)]))
    check_turns(path, marks, axes)
    return feeds, _snapped(marks, path.table[:, START], path.length)

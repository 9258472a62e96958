"""Look-ahead on a path without end: curves go in as they come, finished motion comes out, memory stays the same."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.feed.bounds import AxisLimits
from splinefeed.feed.corners import passed_corners
from splinefeed.feed.look_ahead_window import (
    LEAST_TICKS,
    LEAST_WINDOW,
    STRATEGY,
    WINDOW,
    Part,
    Window,
    asked_for,
    limit_row,
    row_at,
    row_feeds,
)
from splinefeed.feed.planning import strategy_for
from splinefeed.feed.soft_limits import check_travel
from splinefeed.geometry.corners import STOP_ANGLE
from splinefeed.geometry.differential import unit_tangents
from splinefeed.geometry.path import Path
from splinefeed.kernels import pieces
from splinefeed.kernels.look_ahead_path import AT_CORNER
from splinefeed.kernels.pieces import START, Shape
from splinefeed.records import LAW_COEFFICIENTS, Array, IntArray, Limits, TimeLaw, positive

#: A wait for the next tick below this, in periods, is rounding.
ON_TICK = 1e-9
#: Rests nearer to the last one than this share of how far away they are, are the same.
NEXT_TO = 1e-12


@dataclass(frozen=True, eq=False)
class Block:
    """Motion that is final.

    curve   index, among all that came, of the curve that it begins on
    offset  arc length from the start of that curve, mm
    tick    whole periods since the start, at which or behind which it begins; before the first block the tool stands
    phase   how much later than that, s, less than a period: kept apart, as after hours their sum is rounded
    law     from there: arc length from 0, time from 0
    """

    curve: int
    offset: float
    tick: int
    phase: float
    law: TimeLaw

    @property
    def time(self) -> float:
        """When it begins, s since the start."""
        return self.tick * float(self.law.period or 0.0) + self.phase


class LookAhead:
    """Plans a path that need not end: `push` curves, get motion; `finish` comes to rest at the end of what came.

    limits, period  as for `plan`; the period, s, is needed, as stops fall on ticks: the tool waits there for the next.
                    Motion begins at start_feed and, when finished, ends at end_feed: not on a tick then
    axes            names of the axes of all that comes
    window          cells that are looked ahead over, of about one arc-length piece, or one build-up of acceleration

    The last plan always ends at rest within the window and keeps every limit. Its first half becomes final and the rest
    is planned again with what follows; where that fails, the last plan still stands. So motion that came out can always
    be followed by a stop within the limits, and a window costs the same wherever it is.
    Raises LimitsError for limits that leave acceleration and jerk free or name other axes, InputError for a window that
    is too small.
    """

    def __init__(self, limits: Limits, period: float, axes: Sequence[str], window: int = WINDOW) -> None:
        self.limits, self.axes, self.period = limits, tuple(axes), positive(period, "period")
        if int(window) < LEAST_WINDOW:
            raise InputError(f"a window of {window} cells; it must have at least {LEAST_WINDOW}")
        strategy_for(limits, STRATEGY)
        limit = limit_row(limits, self.axes, self.period)
        self._limit, self._cells = limit, int(window)
        self._window: Window | None = None
        self._waiting: list[tuple[Array, IntArray, Array]] = []  # rows, their curves and feeds, not yet in the table
        self._rows = 0  # of table and of what is waiting
        self._table = np.zeros((0, 0))
        self._owner = np.zeros(0, dtype=np.int64)
        self._feeds = np.zeros((0, 2))
        self._shape: Shape = (1, len(self.axes), 1, 0)
        self._curves = 0  # that came
        self._curve_start = np.zeros(0)  # where they start, from curve _first_curve on, in the table's arc length
        self._first_curve = 0
        self._end = 0.0  # arc length of the table's end
        self._stops: list[float] = []  # where the tool rests, ahead of the motion
        self._chosen: set[float] = set()  # those of them, and the last one, that nobody asked for
        self._corner = math.inf  # feed at the corner where the next path begins, if it is passed
        self._dwells: dict[float, float] = {}
        self._last: Path | None = None
        self._tick = 0  # the last one at which motion is final
        self._elapsed = 0.0  # since then, s

    @property
    def time(self) -> float:
        """Up to when motion has come out, s."""
        return self._tick * self.period + self._elapsed

    @property
    def rows(self) -> int:
        """Rows of curves that are held in memory."""
        return self._rows

    @property
    def work(self) -> float:
        """Cells that were solved for, times Newton steps, so far: what planning costs."""
        return 0.0 if self._window is None else self._window.work

    def push(self, path: Path) -> list[Block]:
        """Take more of the path, which goes on where the last one ended; returns the motion that is final by now.

        Raises CurveError for other axes or a gap, LimitsError where the path leaves the travel of an axis.
        """
        if path.axes != self.axes:
            raise CurveError(f"the path has axes {path.axes}; the motion has {self.axes}")
        check_travel(path, self.limits)
        self._join(path)
        self._take(path)
        return list(self._drain(whole=False))

    def finish(self) -> list[Block]:
        """Come to rest at the end of what came; the rest of the motion."""
        if self._last is not None:
            wait = sum(marker.dwell for marker in self._last.markers if marker.before == len(self._last.curves))
            self._dwells[self._end] = wait
        return list(self._drain(whole=True))

    def _join(self, path: Path) -> None:
        """Rest between two paths if the tangent jumps there, or a marker says so."""
        markers = [marker for marker in path.markers if marker.before == 0]
        if self._last is not None:
            before, after = self._last.curves[-1], path.curves[0]
            end, start = np.array(before.domain[1]), np.array(after.domain[0])
            gap = float(np.max(np.abs(before(end) - after(start))))
            if gap > max(path.tolerance, self._last.tolerance):
                raise CurveError(f"gap of {gap:.6g} between curve {self._curves - 1} and curve {self._curves}")
            linear = path.linear
            turn = unit_tangents(before, end, linear, "left") - unit_tangents(after, start, linear)
            markers += [m for m in self._last.markers if m.before == len(self._last.curves)]
            asked = any(marker.stop for marker in markers)
            self._corner = math.inf
            if asked or float(np.linalg.norm(turn)) > STOP_ANGLE:
                self._corner = math.inf if asked else self._passed(path)
                if self._corner == math.inf:
                    self._rest(self._end)
        wait = sum(marker.dwell for marker in markers)
        if wait > 0.0:
            self._dwells[self._end] = self._dwells.get(self._end, 0.0) + wait
        self._last = path

    def _passed(self, path: Path) -> float:
        """Feed at which the corner between the last path and this one is passed, mm/s, infinite if it is a stop."""
        if self.limits.axis_velocity_step is None or self._last is None:
            return math.inf
        both = Path(
            [self._last.curves[-1], path.curves[0]], self.axes, tolerance=max(path.tolerance, self._last.tolerance)
        )
        at, feed = passed_corners(both, self.limits, AxisLimits.of(self.limits, self.axes), self.period)
        near = np.abs(at - both.curve_starts[1]) <= NEXT_TO * both.length
        return float(feed[near][0]) if np.any(near) else math.inf

    def _rest(self, s: float) -> None:
        """Rest at arc length s, mm, unless that is where the last rest or the beginning is."""
        last = self._stops[-1] if self._stops else (self._window.low if self._window is not None else 0.0)
        if s - last > NEXT_TO * max(s, 1.0) and s > 0.0:
            self._stops.append(s)

    def _take(self, path: Path) -> None:
        """Put the rows of a path behind those that wait."""
        degree, axes, linear, rational = path.shape
        wanted = (max(degree, self._shape[0]), axes, linear, max(rational, self._shape[3]))
        if wanted != self._shape or self._window is None:
            if len(self._table):
                self._table = widened(self._table, self._shape, wanted)
            self._waiting = [(widened(t, self._shape, wanted), o, f) for t, o, f in self._waiting]
            self._shape = wanted
            if self._window is None:
                self._window = Window(self._limit, wanted, self._cells)
                self._window.begin(0.0, self.limits.start_feed)
                self._table = np.zeros((0, path.table.shape[1] if wanted == path.shape else 0))
            self._window.shape = wanted
        table = widened(path.table, path.shape, wanted)
        table[:, START] += self._end
        counts = path.curve_rows[:, 1] - path.curve_rows[:, 0] + 1
        owner = np.repeat(np.arange(self._curves, self._curves + len(path.curves)), counts)
        feeds, marks = row_feeds(path, self.limits, self._limit)
        feeds[0, AT_CORNER] = self._corner
        self._waiting.append((table, owner, feeds))
        self._rows += len(table)
        self._curve_start = np.concatenate([self._curve_start, path.curve_starts[:-1] + self._end])
        for s in marks[1:-1]:
            self._rest(s + self._end)
        self._chosen.update((marks[~asked_for(path, marks)] + self._end).tolist())
        for s, wait in path.dwells:
            if 0.0 < s < path.length:
                self._dwells[s + self._end] = wait
        self._curves += len(path.curves)
        self._end += path.length

    def _drain(self, *, whole: bool) -> Iterator[Block]:
        """Plan on while there is enough ahead, or with `whole` to the end."""
        window = self._window
        if window is None:
            return
        if self.time == 0.0 and window.low in self._dwells:
            self._tick = math.ceil(self._dwells.pop(window.low) / self.period - ON_TICK)
        while window.low < self._end:
            # a plan begins when its whole window is there, so that it does not matter how the path was cut
            known = whole or bool(self._stops)
            if not known and self._rows <= window.rows:
                break
            self._gather()
            if not known and window.rows_ahead(self._table) <= window.rows:
                break
            stop = self._stops[0] if self._stops else (self._end if whole else math.inf)
            begin = window.low
            part = window.advance(self._table, self._feeds, stop, 0.0 if self._stops else self.limits.end_feed)
            rests = window.low >= stop
            yield self._block(part, begin, rests)
            if rests and self._stops:
                self._stops.pop(0)
            self._forget(window)

    def _gather(self) -> None:
        """Put what waits behind the table."""
        if self._waiting:
            tables = [self._table, *(rows for rows, _, _ in self._waiting)]
            self._table = np.ascontiguousarray(np.concatenate([table for table in tables if len(table)]))
            self._owner = np.concatenate([self._owner, *(owner for _, owner, _ in self._waiting)])
            self._feeds = np.concatenate([self._feeds, *(feeds for _, _, feeds in self._waiting)])
            self._waiting = []

    def _block(self, part: Part, begin: float, rests: bool) -> Block:
        """The part as a block; at rest the tool waits for the next tick, and for what the path asks."""
        spans = part.spans
        coefficients = part.coefficients.copy()
        at_rest = rests and coefficients[0, 1] == 0.0 and (bool(self._stops) or self.limits.end_feed == 0.0)
        if at_rest and not self._chosen.isdisjoint((begin, self._window.low if self._window is not None else begin)):
            slower = max(LEAST_TICKS * self.period / float(np.sum(spans)), 1.0)
            spans = spans * slower
            coefficients /= slower ** np.arange(LAW_COEFFICIENTS)
        coefficients[:, 0] = part.starts - begin
        curve = int(self._owner[row_at(self._table, begin)])
        tick, phase = self._tick, self._elapsed
        self._elapsed += float(np.sum(spans))
        if rests and (self._stops or self.limits.end_feed == 0.0):
            assert self._window is not None
            passed = math.ceil(self._elapsed / self.period - ON_TICK)
            wait = self._dwells.pop(self._window.low, 0.0)
            passed += math.ceil(wait / self.period - ON_TICK)
            still = passed * self.period - self._elapsed
            if still > ON_TICK * self.period:
                spans = np.append(spans, still)
                coefficients = np.vstack([coefficients, np.zeros(LAW_COEFFICIENTS)])
                coefficients[-1, 0] = self._window.low - begin
            self._tick, self._elapsed = self._tick + passed, 0.0
        else:
            passed = math.floor(self._elapsed / self.period)
            self._tick, self._elapsed = self._tick + passed, max(self._elapsed - passed * self.period, 0.0)
        breaks = np.concatenate([[0.0], np.cumsum(spans)])
        law = TimeLaw(breaks=breaks, coefficients=coefficients, strategy=STRATEGY, period=self.period)
        offset = begin - float(self._curve_start[curve - self._first_curve])
        return Block(curve, offset, tick, phase, law)

    def _forget(self, window: Window) -> None:
        """Drop the rows behind the motion, and count arc length from the first that is left."""
        first = row_at(self._table, window.needed)
        if first == 0:
            return
        origin = float(self._table[first, START])
        curve = int(self._owner[first])
        self._table = self._table[first:].copy()
        self._table[:, START] -= origin
        self._owner, self._feeds = self._owner[first:].copy(), self._feeds[first:].copy()
        self._curve_start = self._curve_start[curve - self._first_curve :] - origin
        self._first_curve = curve
        self._stops = [s - origin for s in self._stops]
        self._chosen = {s - origin for s in self._chosen if s >= window.low}
        self._dwells = {s - origin: wait for s, wait in self._dwells.items()}
        self._end -= origin
        self._rows -= first
        for rows, _, _ in self._waiting:
            rows[:, START] -= origin
        window.move(-origin)


def widened(table: Array, shape: Shape, wanted: Shape) -> Array:
    """A copy of rows (n, width) in a shape of the same axes, of a degree at least as high and at least as rational."""
    if shape == wanted:
        return table.copy()
    out = np.zeros((len(table), pieces.width(wanted)))
    axes = shape[1]
    first = pieces.ORIGIN + axes
    out[:, :first] = table[:, :first]
    given = table[:, first:].reshape(len(table), axes + shape[3], shape[0] + 1)
    room = out[:, first:].reshape(len(table), axes + wanted[3], wanted[0] + 1)
    room[:, : axes + shape[3], : shape[0] + 1] = given
    if wanted[3] and not shape[3]:
        room[:, axes, 0] = 1.0
    return out


def look_ahead(paths: Iterable[Path], limits: Limits, period: float, *, window: int = WINDOW) -> Iterator[Block]:
    """Blocks of motion over paths that follow each other without end: `LookAhead` as a generator."""
    planner: LookAhead | None = None
    for path in paths:
        if planner is None:
            planner = LookAhead(limits, period, path.axes, window)
        yield from planner.push(path)
    if planner is not None:
        yield from planner.finish()

"""Look-ahead on a path without end: curves go in as they come, committed motion is given, memory stays the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.kinematics.with_joints import Joints
from splinefeed.paths.parts import cut, joined
from splinefeed.paths.path import Path
from splinefeed.planner.conditions import Conditions
from splinefeed.planner.constants import ALMOST, SAME
from splinefeed.planner.law import MotionPieces
from splinefeed.planner.law import joined as together
from splinefeed.planner.receding import JOINS, RecedingHorizon
from splinefeed.planner.strategies import LOOK_AHEAD, MODES, check_limits, conditions_of
from splinefeed.records import LAW_COEFFICIENTS, REST, Limits, State, TimeLaw, positive

#: Cells of a window, and the fewest that it may have.
WINDOW, LEAST_WINDOW = MODES[LOOK_AHEAD].cells, 20
#: A window that was not full is looked for again when so many times as many curves are known.
AGAIN = 2
#: Share of a window that was not waited for that stays open: its end is nearer.
EARLY = 0.5


@dataclass(frozen=True, eq=False)
class MotionBlock:
    """A block of committed motion: it no longer changes.

    Parameters
    ----------
    curve : int
        Index, among all that came, of the curve that it begins on.
    offset : float
        Arc length from the start of that curve, mm.
    tick : int
        Whole periods since the start, at which or behind which it begins; before the first block the tool stands.
    phase : float
        How much later than that, s, less than a period: kept apart, as after hours their sum is rounded.
    law : TimeLaw
        From there: arc length from 0, time from 0.
    limits : Limits
        That it keeps.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> ahead = sf.planner.LookAhead(limits, 1e-3, path.axes)
    >>> first = [*ahead.push(path), *ahead.finish()][0]
    >>> first.curve, first.offset, first.tick
    (0, 0.0, 0)
    """

    curve: int
    offset: float
    tick: int
    phase: float
    law: TimeLaw
    limits: Limits

    @property
    def time(self) -> float:
        """When it begins, s since the start."""
        return self.tick * float(self.law.period or 0.0) + self.phase


class LookAhead:
    """Plan a path that need not end: `push` curves, get motion; `finish` comes to rest at the end of it all.

    Parameters
    ----------
    limits : Limits
        As for `plan`. Motion begins at start_feed and, when finished, ends at end_feed: not on a tick then.
    period : float
        Servo period, s: stops fall on ticks, and the tool waits there for the next.
    axes : sequence of str
        Names of the axes of all that comes.
    window : int, optional
        Cells that are looked ahead over.
    start : State, optional
        Where on the first path it begins, and how; None begins at its start with start_feed.
    joints : Joints, optional
        That move the axes and have limits of their own, which name them as further axes.

    Raises
    ------
    LimitsError
        For limits that leave acceleration and jerk free or name other axes.
    InputError
        For a window that is too small.

    Notes
    -----
    The last plan always ends at rest within the window and keeps every limit. Its first half becomes final and the rest
    is planned again with what follows; where that fails, the last plan still stands. So committed motion can always
    be followed by a stop within the limits, and a window costs the same wherever it is.

    From wherever it is the motion goes on without a stop under other limits (`change_limits`), along another path
    (`reroute`), or comes to rest as soon as it can (`hold`). A feedrate override is `live`'s.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> ahead = sf.planner.LookAhead(limits, 1e-3, path.axes)
    >>> blocks = [*ahead.push(path), *ahead.finish()]
    >>> print(f"{sum(block.law.length for block in blocks):.3f} of {path.length:.3f} mm")
    62.832 of 62.832 mm
    """

    def __init__(
        self,
        limits: Limits,
        period: float,
        axes: Sequence[str],
        window: int = WINDOW,
        *,
        start: State | None = None,
        joints: Joints | None = None,
    ) -> None:
        self.axes, self.period = tuple(axes), positive(period, "period")
        self.limits, self.joints = limits, joints
        self._start = start
        start = State(limits.start_feed) if start is None else start
        if int(window) < LEAST_WINDOW:
            raise InputError(f"a window of {window} cells; it must have at least {LEAST_WINDOW}")
        check_limits(limits, self._limited, LOOK_AHEAD)
        self._mode = replace(MODES[LOOK_AHEAD], cells=int(window))
        self._horizon = RecedingHorizon(start.s, State(start.feed, start.acceleration))
        self._path: Path | None = None  # what is known and not yet behind
        self._waiting: list[Path] = []  # what came since
        self._curves = 0  # that came
        self._first_curve = 0  # of _path, among all that came
        #: What must be known ahead before a window is looked for again: length, about, mm, or so many curves.
        self._looked, self._looked_curves = 0.0, 0
        self._tick = 0  # the last one at which motion is final
        self._elapsed = 0.0  # since then, s
        self._begun = False

    @property
    def time(self) -> float:
        """Up to when motion is committed, s."""
        return self._tick * self.period + self._elapsed

    @property
    def rows(self) -> int:
        """Curves that are held in memory."""
        return sum(len(path.curves) for path in self._parts)

    @property
    def work(self) -> float:
        """Cells that were planned so far: what planning costs."""
        return float(self._horizon.work)

    def push(self, path: Path) -> list[MotionBlock]:
        """Take more of the path, which goes on where the last one ended.

        Parameters
        ----------
        path : Path
            Of the same axes.

        Returns
        -------
        list of MotionBlock
            The motion that is final by now.

        Raises
        ------
        CurveError
            For other axes, a gap, or wanted times.
        LimitsError
            Where the path leaves the travel of an axis.
        """
        self.take(path)
        return list(self.blocks())

    def take(self, path: Path) -> None:
        """Take more of the path, as `push` does, and plan nothing yet: `blocks` does.

        Parameters
        ----------
        path : Path
            Of the same axes.

        Raises
        ------
        CurveError
            For other axes, a gap, or wanted times.
        LimitsError
            Where the path leaves the travel of an axis.
        """
        if path.axes != self.axes:
            raise CurveError(f"the path has axes {path.axes}; the motion has {self.axes}")
        path.check_travel(self.limits.travel_of(self._limited))
        if path.times is not None:
            raise CurveError(
                "times: a motion that is planned as its path comes has no wanted times; plan it as a whole"
            )
        if self._parts:
            last = self._parts[-1]
            gap = float(np.max(np.abs(last.ends[-1, 1] - path.ends[0, 0])))
            if gap > max(path.tolerance, last.tolerance):
                raise CurveError(f"gap of {gap:.6g} between curve {self._curves - 1} and curve {self._curves}")
        self._curves += len(path.curves)
        self._waiting.append(path)

    def finish(self) -> list[MotionBlock]:
        """Come to rest at the end of what came; the rest of the motion."""
        return list(self.blocks(whole=True))

    @property
    def stop(self) -> MotionBlock | None:
        """The motion to rest that the last plan has behind committed motion; None where committed motion is at a stop.

        It keeps the limits and is what the machine does when no other block comes in time.
        """
        horizon = self._horizon
        if horizon.left is None or self._path is None:
            return None
        curve, offset = self._place(self._path, horizon.low)
        law = self._law(horizon.left, horizon.low)
        return MotionBlock(curve, offset, self._tick, self._elapsed, law, horizon.limits or self.limits)

    def change_limits(self, limits: Limits) -> list[MotionBlock]:
        """Plan by other limits from where committed motion ends, or from the first place on where they can be kept.

        Parameters
        ----------
        limits : Limits
            The new ones.

        Returns
        -------
        list of MotionBlock
            The motion up to there, which slows down within the limits of before: `MotionBlock.limits` tells which a
            block keeps.

        Raises
        ------
        LimitsError
            For limits that leave acceleration and jerk free, or whose travel the path leaves.
        """
        check_limits(limits, self._limited, LOOK_AHEAD)
        for path in self._parts:
            path.check_travel(limits.travel_of(self._limited))
        before, self.limits, self._looked = self.limits, limits, 0.0
        known = self._known()
        if known is None:
            return []
        settings = [self._conditions(known, each) for each in (before, limits)]
        begin = self._horizon.low
        pieces = self._horizon.change(settings[0], settings[1], self._mode, self._stop_ahead(known, settings[0]))
        return [] if pieces is None else [self._block(known, pieces, begin, dict(known.dwells), before)]

    def reroute(self) -> int:
        """Forget all of the path that the last plan does not need; how many curves are left, of all that came.

        What is pushed next goes on at the end of the last of these: the motion does not stop before it is there.
        """
        path = self._known()
        if path is None:
            return 0
        horizon = self._horizon
        end = horizon.low if horizon.left is None else horizon.end
        starts = path.curve_starts[:-1] + SAME * path.length
        count = max(int(np.searchsorted(starts, end)), 1)
        self._path = cut(path, 0, count)
        self._curves, self._looked = self._first_curve + count, 0.0
        return self._curves

    def hold(self) -> list[MotionBlock]:
        """A feed hold: come to rest on the shortest way that the limits allow; `push` and `finish` go on from there."""
        path = self._known()
        if path is None or self._horizon.state.feed == 0.0:
            return []
        conditions, begin = self._conditions(path, self.limits), self._horizon.low
        pieces = self._horizon.hold(conditions, self._mode, self._stop_ahead(path, conditions))
        self._looked = 0.0
        return [self._block(path, pieces, begin, dict(path.dwells))]

    @property
    def _limited(self) -> tuple[str, ...]:
        """All that limits may name: axes and joints."""
        return self.axes if self.joints is None else (*self.axes, *self.joints.names)

    def _conditions(self, path: Path, limits: Limits) -> Conditions:
        """What the motion along a path is planned under."""
        return conditions_of(path if self.joints is None else self.joints.along(path), limits, self.period)

    def _stop_ahead(self, path: Path, conditions: Conditions) -> float:
        """Where the motion next rests, or what is known of the path ends, mm."""
        ahead = conditions.rests[conditions.rests > self._horizon.low]
        return float(ahead[0]) if len(ahead) else path.length

    @property
    def _parts(self) -> list[Path]:
        """What is not yet behind: the path that is known, and what came since."""
        return ([] if self._path is None else [self._path]) + self._waiting

    def _known(self) -> Path | None:
        """All that is not yet behind as one path."""
        if self._parts:
            self._path = joined(self._parts)
        self._waiting = []
        return self._path

    def blocks(self, *, whole: bool = False, early: bool = False) -> Iterator[MotionBlock]:
        """Plan on while there is enough ahead.

        Parameters
        ----------
        whole : bool, optional
            Whether to plan to the end.
        early : bool, optional
            Whether to make one block at most, also where a window is not full: for motion that cannot wait for more
            path.

        Yields
        ------
        MotionBlock
            Each as soon as it is final.
        """
        ahead = sum(path.length for path in self._waiting) if not whole else 0.0
        if self._path is not None:
            ahead += self._path.length - self._horizon.low
        if not (whole or early) and ahead < self._looked and self.rows < self._looked_curves:
            return
        path = self._known()
        if path is None:
            return
        conditions = self._conditions(path, self.limits)
        if not self._begun and self._start is None:
            self._horizon.state = State(conditions.speed_at(0.0, self.limits.start_feed))
        stops = conditions.rests
        waits = dict(path.dwells)
        if not self._begun and 0.0 in waits:
            self._tick += math.ceil(waits.pop(0.0) / self.period - ALMOST)
        horizon = self._horizon
        horizon.lines = None
        same = SAME * path.length
        while horizon.low < path.length - same:
            stop = stops[np.searchsorted(stops, horizon.low + same, side="right") :]
            high = float(stop[0]) if len(stop) else path.length
            last = whole or len(stop) > 0
            begin = horizon.low
            end = State(conditions.speed_at(high, self.limits.end_feed)) if whole and not len(stop) else REST
            marks = np.append(begin, stop) if len(stop) or not whole or end.feed > 0.0 else np.array([begin, high])
            pieces = horizon.straight(conditions, marks)
            if pieces is None:
                near = horizon.reach(conditions, self._mode, high)
                if not last and near == high and not early:
                    self._looked = (path.length - horizon.low) * max(JOINS, (1.0 - self._mode.open) / horizon.ahead)
                    self._looked_curves = AGAIN * len(path.curves)  # length alone tells little behind a long line
                    break
                mode = replace(self._mode, open=EARLY) if early else self._mode
                pieces = horizon.advance(conditions, mode, near, end, ends_here=last and near == high)
            self._begun, self._looked = True, 0.0
            yield self._block(path, pieces, begin, waits)
            if early:
                break
        self._forget(path)

    def _block(
        self, path: Path, pieces: MotionPieces, begin: float, waits: dict[float, float], limits: Limits | None = None
    ) -> MotionBlock:
        """Pieces as a block; at rest the tool waits for the next tick, and for what the path asks."""
        curve, offset = self._place(path, begin)
        tick, phase = self._tick, self._elapsed
        self._elapsed += pieces.duration
        passed = math.floor(self._elapsed / self.period)
        if self._horizon.state.feed == 0.0:
            same = SAME * path.length
            wait = sum(seconds for s, seconds in waits.items() if abs(s - self._horizon.low) <= same)
            passed = math.ceil(self._elapsed / self.period - ALMOST) + math.ceil(wait / self.period - ALMOST)
            still = passed * self.period - self._elapsed
            if still > ALMOST * self.period:
                rest = np.eye(1, LAW_COEFFICIENTS) * self._horizon.low
                pieces = together([pieces, MotionPieces(np.array([still]), rest)])
            self._elapsed = 0.0
        else:
            self._elapsed = max(self._elapsed - passed * self.period, 0.0)
        self._tick += passed
        kept = limits or self._horizon.limits or self.limits
        return MotionBlock(curve, offset, tick, phase, self._law(pieces, begin), kept)

    def _law(self, pieces: MotionPieces, begin: float) -> TimeLaw:
        """Pieces as a law from where they begin, mm."""
        coefficients = pieces.coefficients.copy()
        coefficients[:, 0] -= begin
        breaks = np.concatenate([[0.0], np.cumsum(pieces.spans)])
        return TimeLaw(breaks=breaks, coefficients=coefficients, strategy=LOOK_AHEAD, period=self.period)

    def _place(self, path: Path, s: float) -> tuple[int, float]:
        """Number of the curve, among all that came, at a place of what is known, and how far behind its start, mm."""
        curve = int(np.clip(np.searchsorted(path.curve_starts, s, side="right") - 1, 0, len(path.curves) - 1))
        return self._first_curve + curve, s - float(path.curve_starts[curve])

    def _forget(self, path: Path) -> None:
        """Drop the curves behind the motion, and count arc length from the first that is left."""
        behind = int(np.searchsorted(path.curve_starts, self._horizon.low, side="right")) - 2  # and keep one of them
        if behind <= 0:
            return
        origin = float(path.curve_starts[behind])
        self._path = cut(path, behind, len(path.curves))
        self._first_curve += behind
        self._horizon.move(origin)

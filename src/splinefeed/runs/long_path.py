"""A path that comes in parts, as setpoints in chunks, checked: memory and the cost of a tick never grow."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.checks.check import TickBlocks
from splinefeed.errors import InputError
from splinefeed.paths.gaps import open_joints
from splinefeed.paths.parts import cut, joined
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.planner.constants import ALMOST
from splinefeed.planner.strategies import LOOK_AHEAD
from splinefeed.planner.stream import LookAhead, MotionBlock
from splinefeed.records import LAW_COEFFICIENTS, Array, Limits, Setpoints, TimeLaw
from splinefeed.runs.fold import CHUNK, Chunk, with_neighbours

if TYPE_CHECKING:
    from splinefeed.paths.smoothing import Smoother

#: Curves of one part of a path that is there as a whole.
PART = 2048
#: The method that `Setpoints` name.
METHOD = "arc-length"


@dataclass(eq=False)
class _PathPart:
    """A part of the path not left yet.

    Parameters
    ----------
    path : Path
        The part.
    curve : int
        Its first curve among all.
    start : float
        Arc length of the tip before it, mm.
    length : float
        That of the path, which counts rotary axes, too, mm.
    """

    path: Path
    curve: int
    start: float
    length: float


def stream_setpoints(
    paths: Path | Iterable[Path], limits: Limits, *, period: float, chunk: int = CHUNK
) -> Iterator[Setpoints]:
    """Compute where every axis must be at each tick k T along a path that comes in parts, planned window by window.

    Parameters
    ----------
    paths : Path or iterable of Path
        Parts that follow each other, of the same axes; each is taken when the motion comes near it, and dropped when it
        is behind. A Path is cut into parts.
    limits : Limits
        That the motion keeps.
    period : float
        Servo period T, s.
    chunk : int, optional
        Ticks of each record but the last.

    Returns
    -------
    iterator of Setpoints
        Positions (n, axes), mm, rotary axes rad; `curve` and `s` count from the start of the first part.

    Raises
    ------
    InputError
        For no parts, and for a chunk that is no whole number of ticks; and what `LookAhead` raises.

    Notes
    -----
    The motion is that of the `look-ahead` strategy and keeps all limits; each setpoint is where the law puts it
    (`arc-length`).

    References
    ----------
    .. [1] docs/scale.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> line = sf.Path.polyline([[0, 0], [30, 0]])
    >>> limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    >>> first = next(sf.runs.stream_setpoints(line, limits, period=1e-3, chunk=100))
    >>> first.position.shape
    (100, 2)
    """
    if isinstance(chunk, bool) or int(chunk) != chunk or chunk < 1:
        raise InputError(f"chunk is {chunk!r}; expected a whole number of ticks from 1 up")
    parts = paths if isinstance(paths, Iterable) else parts_of(paths)
    return TickBlocks(int(chunk)).cut(_Walk(limits, period).pieces(parts))


def parts_of(path: Path, size: int = PART) -> Iterator[Path]:
    """Cut a path into parts, with their feeds and markers, made on demand.

    Parameters
    ----------
    path : Path
        To be cut.
    size : int, optional
        Curves of a part at the most.

    Yields
    ------
    Path
        Each part.
    """
    count = len(path.curves)
    return (cut(path, first, min(first + size, count)) for first in range(0, count, size))


def in_line(paths: Iterable[Path]) -> Iterator[Path]:
    """Parts, each beginning exactly where the last one ends, moved there if its tolerance allows that."""
    last: Path | None = None
    for path in paths:
        if last is not None:
            ends = np.array([last.ends[-1], path.ends[0]])
            gap = float(np.linalg.norm(ends[1, 0] - ends[0, 1]))
            if open_joints(ends)[0] and gap <= max(path.tolerance, last.tolerance):
                path = path.beginning_at(ends[0, 1])
        last = path
        yield path


class _Walk:
    """Plan parts as they come, and make the setpoints of each block of motion.

    Parameters
    ----------
    limits : Limits
        Of the motion.
    period : float
        Servo period, s.
    measured : bool, optional
        Whether `chunk` gives what setpoints lie on, too; parts and blocks stay until then.
    """

    def __init__(self, limits: Limits, period: float, *, measured: bool = False) -> None:
        self.limits, self.period, self.measured = limits, period, measured
        self.parts: list[_PathPart] = []  # not left yet
        self.blocks: deque[tuple[MotionBlock, float]] = deque()  # with the length at which each begins, mm
        self.tick = 0
        self.settings: dict[str, Any] = {}
        self._joined: tuple[int, int, Path] | None = None

    def pieces(self, paths: Iterable[Path]) -> Iterator[Setpoints]:
        """Setpoints, block by block; the last one is the end of the path."""
        planner: LookAhead | None = None
        end, length, curves = 0.0, 0.0, 0
        for path in in_line(paths):
            if planner is None:
                planner = LookAhead(self.limits, self.period, path.axes)
                self.settings = {"limits": planner.limits.as_dict(), "strategy": LOOK_AHEAD, "path": path.name}
                self.settings |= {"period": planner.period, "method": METHOD}
            self.parts.append(_PathPart(path, curves, end, length))
            end, length, curves = end + path.tip_end, length + path.length, curves + len(path.curves)
            for block in planner.push(path):
                yield from self._block(block)
        if planner is None:
            raise InputError("a path is needed; no part came")
        for block in planner.finish():
            yield from self._block(block)
        part = self.parts[-1]
        final = self._made(part, np.array([part.path.length]), np.zeros(1))
        final = replace(final, feed=np.full(1, self.limits.end_feed))
        late = abs(planner.time - float(final.t[0])) > ALMOST * self.period  # in motion the last period is short
        yield replace(final, t=np.full(1, planner.time)) if late else final

    def _block(self, block: MotionBlock) -> Iterator[Setpoints]:
        parts = [each for each in self.parts if block.curve < each.curve + len(each.path.curves)]
        first, law = parts[0], block.law
        gone = self.tick - block.tick
        count = math.ceil((block.phase + law.duration) / self.period - ALMOST) - gone  # those at its end come later
        tau = np.clip((gone + np.arange(max(count, 0))) * self.period - block.phase, 0.0, law.duration)
        begin = float(first.path.curve_starts[block.curve - first.curve]) + block.offset
        if self.measured:
            self.blocks.append((block, first.length + begin))
        else:
            self.parts = parts
        s, rate = begin + law(tau), np.maximum(law.feed(tau), 0.0)
        done, passed = 0, 0.0
        for part in parts:  # a block may run over several parts
            s -= passed
            passed = part.path.length
            until = len(s) if part is parts[-1] else int(np.searchsorted(s, passed))
            if until > done:
                yield self._made(part, s[done:until], rate[done:until])
            done = max(done, until)

    def _made(self, part: _PathPart, s: Array, rate: Array) -> Setpoints:
        """Setpoints at lengths s (n,), mm, from the start of a part, that grow by `rate` (n,), mm/s."""
        path, first = part.path, self.tick
        s = np.clip(s, 0.0, path.length)
        tip, feed, *_ = path.of_tip(s, rate, np.zeros(len(s)), np.zeros(len(s)))
        curve, u = path.locate(s)
        self.tick += len(s)
        return Setpoints(
            t=np.arange(first, self.tick, dtype=np.float64) * self.period,
            curve=curve + part.curve,
            u=u,
            s=tip + part.start,
            feed=feed,
            position=path.evaluate(curve, u)[:, 0],
            axes=path.axes,
            period=self.period,
            method=METHOD,
            settings=self.settings,
        )

    def chunk(self, around: Setpoints, first: int, own: Setpoints) -> Chunk:
        """Setpoints on the parts and blocks that they lie on; what is behind them is forgotten."""
        period = own.period
        ticks = np.rint(around.t / period)  # the last tick of a motion may be early: it has its own time
        while len(self.blocks) > 1 and self.blocks[1][0].time <= around.t[0]:
            self.blocks.popleft()
        origin, begin = self.blocks[0]
        while len(self.parts) > 1 and self.parts[1].curve <= min(int(around.curve[0]), origin.curve):
            self.parts.pop(0)
        last = next((k for k, p in enumerate(self.parts) if p.curve > around.curve[-1]), len(self.parts))
        path, start = self._path(self.parts[:last]), self.parts[0]
        t = np.where(np.abs(ticks * period - around.t) < ALMOST * period, ticks * period, around.t)
        t = t - origin.tick * period - origin.phase
        law = self._law(float(np.max(t)), begin - start.length)
        local = replace(around, t=np.maximum(t, 0.0), curve=around.curve - start.curve, s=around.s - start.start)
        return Chunk(own, local, first, path, law)

    def _path(self, parts: list[_PathPart]) -> Path:
        key = parts[0].curve, parts[-1].curve
        if self._joined is None or self._joined[:2] != key:
            self._joined = (*key, joined([each.path for each in parts]))
        return self._joined[2]

    def _law(self, end: float, begin: float) -> TimeLaw:
        """The law of all blocks that begin before a time, s, from the first block's on; `begin` where that is, mm."""
        origin, length = self.blocks[0]
        starts: list[Array] = []
        pieces: list[Array] = []
        stop, waiting = 0.0, ALMOST * self.period
        for block, at in self.blocks:
            since = (block.tick - origin.tick) * self.period + block.phase - origin.phase
            if since > end:
                break
            if starts and since > stop + waiting:  # it waits there
                starts.append(np.array([stop]))
                pieces.append(_standing(at - length + begin))
            moved = block.law.coefficients.copy()
            moved[:, 0] += at - length + begin
            starts.append(since + block.law.breaks[:-1])
            pieces.append(moved)
            stop, reached = since + block.law.duration, at - length + begin + block.law.length
        if end > stop + waiting:  # it waits for the next tick
            starts.append(np.array([stop]))
            pieces.append(_standing(reached))
            stop = end
        times = np.append(np.concatenate(starts), stop)
        keep = np.diff(times) > 0.0
        return TimeLaw(
            breaks=np.append(times[:-1][keep], stop),
            coefficients=np.concatenate(pieces)[keep],
            strategy=LOOK_AHEAD,
            period=self.period,
        )


def _standing(s: float) -> Array:
    """A piece of a law that stands at s."""
    piece = np.zeros((1, LAW_COEFFICIENTS))
    piece[0, 0] = s
    return piece


def windows(paths: Iterable[Path], limits: Limits, period: float) -> Iterator[Chunk]:
    """Plan the motion along parts of a path, window by window.

    Parameters
    ----------
    paths : iterable of Path
        That follow each other.
    limits : Limits
        Of the motion.
    period : float
        Of the servo, s.

    Yields
    ------
    Chunk
        Setpoints, with what they are measured by.
    """
    walk = _Walk(limits, period, measured=True)
    for around, first, own in with_neighbours(TickBlocks(CHUNK).cut(walk.pieces(paths))):
        yield walk.chunk(around, first, own)


class PartReader:
    """A file that is read part by part, each smoothed as it comes, and how far that is.

    Parameters
    ----------
    source : PathParts
        The file.
    how : mapping of str to object
        `smooth`, the tolerance, mm, or PROGRAM, without which the path stays; `corners`; `corner_angle`, degrees.
    on_part : callable
        Called with each part of the path before it is planned.

    Attributes
    ----------
    read : int
        Moves or points so far.
    """

    def __init__(self, source: PathParts, how: Mapping[str, Any], on_part: Callable[[Path], None]) -> None:
        self.source, self.read = source, 0
        self._on_part = on_part
        self._smoother: Smoother | None = None
        if how.get("smooth") is not None:
            from splinefeed.paths.smoothing import Smoother  # SciPy's splines, 24 MB: only where lines are smoothed
            from splinefeed.runs.settings import arguments

            self._smoother = Smoother(axes=source.axes, **arguments(how, bool(source.tolerance)))

    @property
    def findings(self) -> list[str]:
        """What is to be said of the file, and of the smoothing by now."""
        return [*self.source.findings, *([] if self._smoother is None else [self._smoother.summary])]

    def __iter__(self) -> Iterator[Path]:
        for path in in_line(self._parts()):
            self._on_part(path)
            yield path

    def _parts(self) -> Iterator[Path]:
        for part in self.source:
            self.read += len(part.curves)
            yield from [part] if self._smoother is None else self._smoother.push(part)
        if self._smoother is not None:
            yield from self._smoother.finish()

"""A path that comes in parts, as setpoints in chunks, checked: memory and the cost of a tick never grow."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.analysis.check import Blocks, Check
from splinefeed.errors import InputError
from splinefeed.feed.modes import LOOK_AHEAD
from splinefeed.feed.numbers import ALMOST
from splinefeed.feed.stream import Block, LookAhead
from splinefeed.formats.path_parts import PathParts
from splinefeed.geometry.joints import open_joints
from splinefeed.geometry.parts import cut
from splinefeed.geometry.path import Path
from splinefeed.pipeline.run import CHUNK
from splinefeed.records import Array, Limits, Setpoints, Verdict

if TYPE_CHECKING:
    from splinefeed.geometry.smoothing import Smoother

#: Curves of one part of a path that is there as a whole.
PART = 2048
#: The method that `Setpoints` name.
METHOD = "arc-length"
#: Is called with how many moves of the file are read by now, and how many setpoints are made.
Progress = Callable[[int, int], None]


@dataclass(eq=False)
class _Part:
    """A part of the path not left yet: its first curve among all, the tip's arc length there, mm."""

    path: Path
    curve: int
    start: float


def stream_setpoints(
    paths: Path | Iterable[Path], limits: Limits, *, period: float, chunk: int = CHUNK
) -> Iterator[Setpoints]:
    """Where every axis must be at each tick k T along a path that comes in parts, planned window by window.

    paths   parts that follow each other, of the same axes; each is taken when the motion comes near it, and
            dropped when it is behind. A Path is cut into parts.
    period  servo period T, s; chunk  ticks of each record but the last

    The motion is that of the `look-ahead` strategy and keeps all limits; each setpoint is where the law puts it
    (`arc-length`). `curve` and `s` count from the start of the first part. Raises what `LookAhead` raises, and
    InputError for no parts.
    Positions (n, axes), mm, rotary axes rad. Source: docs/scale.md.
    Example: `next(sf.live.stream_setpoints(path, limits, period=1e-3, chunk=100)).position`
    """
    if isinstance(chunk, bool) or int(chunk) != chunk or chunk < 1:
        raise InputError(f"chunk is {chunk!r}; expected a whole number of ticks from 1 up")
    parts = parts_of(paths) if isinstance(paths, Path) else paths
    return Blocks(int(chunk)).cut(_Walk(limits, period).pieces(parts))


def parts_of(path: Path, size: int = PART) -> Iterator[Path]:
    """A path as parts of at most `size` curves, with their feeds and markers, made on demand."""
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
    """Plans parts as they come, and makes the setpoints of each block of motion."""

    def __init__(self, limits: Limits, period: float) -> None:
        self.limits, self.period = limits, period
        self.parts: deque[_Part] = deque()
        self.tick = 0
        self.settings: dict[str, Any] = {}

    def pieces(self, paths: Iterable[Path]) -> Iterator[Setpoints]:
        """Setpoints, block by block; the last one is the end of the path."""
        planner: LookAhead | None = None
        end, curves = 0.0, 0
        for path in in_line(paths):
            if planner is None:
                planner = LookAhead(self.limits, self.period, path.axes)
                self.settings = {"limits": planner.limits.as_dict(), "strategy": LOOK_AHEAD, "path": path.name}
                self.settings |= {"period": planner.period, "method": METHOD}
            self.parts.append(_Part(path, curves, end))
            end, curves = end + path.tip_end, curves + len(path.curves)
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

    def _block(self, block: Block) -> Iterator[Setpoints]:
        while block.curve >= self.parts[0].curve + len(self.parts[0].path.curves):
            self.parts.popleft()
        first, law = self.parts[0], block.law
        gone = self.tick - block.tick
        count = math.ceil((block.phase + law.duration) / self.period - ALMOST) - gone  # those at its end come later
        tau = np.clip((gone + np.arange(max(count, 0))) * self.period - block.phase, 0.0, law.duration)
        begin = float(first.path.curve_starts[block.curve - first.curve]) + block.offset
        s, rate = begin + law(tau), np.maximum(law.feed(tau), 0.0)
        done, passed = 0, 0.0
        for part in self.parts:  # a block may run over several parts
            s -= passed
            passed = part.path.length
            until = len(s) if part is self.parts[-1] else int(np.searchsorted(s, passed))
            if until > done:
                yield self._made(part, s[done:until], rate[done:until])
            done = max(done, until)

    def _made(self, part: _Part, s: Array, rate: Array) -> Setpoints:
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


class WindowedRun:
    """A run along a path that comes in parts, made once: `setpoints`, and after them its `verdict` and `numbers`.

    how       `smooth`, the tolerance, mm, or PROGRAM; without it the path stays; `corners`; `corner_angle`, degrees
    settings  how the setpoints are made
    """

    def __init__(
        self, source: PathParts, limits: Limits, period: float, how: Mapping[str, Any], on_progress: Progress
    ) -> None:
        self.source, self.limits, self.period, self.name = source, limits, period, source.name
        self.settings = {"limits": limits.as_dict(), "period": period, "strategy": LOOK_AHEAD, "method": METHOD}
        self._on_progress = on_progress
        self._read, self._ticks, self._top = 0, 0, 0.0
        self._smoother: Smoother | None = None
        if how.get("smooth") is not None:
            from splinefeed.geometry.smoothing import Smoother  # SciPy's splines, 24 MB: only where lines are smoothed
            from splinefeed.pipeline.settings import arguments

            self._smoother = Smoother(axes=source.axes, **arguments(how, bool(source.tolerance)))
        self._check = Check(limits)

    def setpoints(self) -> Iterator[Setpoints]:
        """All setpoints, in chunks, each checked before it is yielded; iterate once."""
        for chunk in stream_setpoints(self._paths(), self.limits, period=self.period):
            self._check.see(chunk)
            self._ticks += len(chunk)
            self._top = max(self._top, float(chunk.feed.max()))
            self._on_progress(min(self._read, self.source.count), self._ticks)
            yield chunk
        self.verdict: Verdict = self._check.verdict()

    def numbers(self) -> dict[str, Any]:
        """The numbers of `run` that do not need the whole path."""
        page = self.verdict.as_dict()
        found = [*self.source.findings, *([] if self._smoother is None else [self._smoother.summary])]
        said = {"lower_bound_s": None, "strategy": LOOK_AHEAD, "method": METHOD, "feed_max_mm_s": self._top}
        return {**page, **said, "notes": [*found, *page["notes"]]}

    def _paths(self) -> Iterator[Path]:
        """Parts of the path to drive along, as they are read or smoothed, each of which the check has first."""
        for path in in_line(self._parts()):
            self._check.part(path)
            yield path

    def _parts(self) -> Iterator[Path]:
        for part in self.source:
            self._read += len(part.curves)
            self._on_progress(min(self._read, self.source.count), self._ticks)
            yield from [part] if self._smoother is None else self._smoother.push(part)
        if self._smoother is not None:
            yield from self._smoother.finish()

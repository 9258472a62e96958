"""A path that comes in parts, as setpoints that come in chunks: memory and the cost of a tick never grow."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.feed.modes import LOOK_AHEAD
from splinefeed.feed.numbers import ALMOST
from splinefeed.feed.stream import WINDOW, Block, LookAhead
from splinefeed.geometry.joints import open_joints
from splinefeed.geometry.parts import cut
from splinefeed.geometry.path import Path
from splinefeed.pipeline.meter import MOST_IN_COLUMN
from splinefeed.records import Array, Limits, Setpoints

#: Curves of one part of a path that is there as a whole.
PART = 2048
#: The method that `Setpoints` name.
METHOD = "arc-length"


@dataclass(eq=False)
class _Part:
    """A part of the path that the motion has not left yet: its first curve among all, and where it starts, mm."""

    path: Path
    curve: int
    start: float


def stream_setpoints(
    paths: Path | Iterable[Path], limits: Limits, *, period: float, chunk: int = MOST_IN_COLUMN, window: int = WINDOW
) -> Iterator[Setpoints]:
    """Where every axis must be at each tick k T along a path that comes in parts, planned window by window.

    paths   parts that follow each other, of the same axes; each is taken when the motion comes near it, and
            dropped when it is behind. A Path is cut into parts.
    period  servo period T, s; chunk  ticks of each record but the last; window  as for `LookAhead`

    The motion is that of the `look-ahead` strategy and keeps all limits; each setpoint is where the law puts it
    (`arc-length`). `curve` and `s` count from the start of the first part. Raises what `LookAhead` raises, and
    InputError for no parts.
    Positions (n, axes), mm, rotary axes rad. Source: docs/scale.md.
    Example: `next(sf.live.stream_setpoints(path, limits, period=1e-3, chunk=100)).position`
    """
    if isinstance(chunk, bool) or int(chunk) != chunk or chunk < 1:
        raise InputError(f"chunk is {chunk!r}; expected a whole number of ticks from 1 up")
    return _collected(
        _Walk(limits, period, window).pieces(parts_of(paths) if isinstance(paths, Path) else paths), int(chunk)
    )


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

    def __init__(self, limits: Limits, period: float, window: int) -> None:
        self.limits, self.period, self.window = limits, period, window
        self.parts: deque[_Part] = deque()
        self.tick = 0
        self.settings: dict[str, Any] = {}

    def pieces(self, paths: Iterable[Path]) -> Iterator[Setpoints]:
        """Setpoints, block by block; the last one is the end of the path."""
        planner: LookAhead | None = None
        end = 0.0
        for path in in_line(paths):
            if planner is None:
                planner = LookAhead(self.limits, self.period, path.axes, self.window)
                self.settings = {
                    "limits": planner.limits.as_dict(),
                    "strategy": LOOK_AHEAD,
                    "path": path.name,
                    "period": planner.period,
                    "method": METHOD,
                }
            last = self.parts[-1] if self.parts else None
            self.parts.append(_Part(path, 0 if last is None else last.curve + len(last.path.curves), end))
            end += path.length
            for block in planner.push(path):
                yield from self._block(block)
        if planner is None:
            raise InputError("a path is needed; no part came")
        for block in planner.finish():
            yield from self._block(block)
        last = self.parts[-1]
        final = self._made(last, np.array([last.path.length]), np.full(1, self.limits.end_feed))
        late = abs(planner.time - float(final.t[0])) > ALMOST * self.period  # in motion: the last period is a short one
        yield replace(final, t=np.full(1, planner.time)) if late else final

    def _block(self, block: Block) -> Iterator[Setpoints]:
        """Setpoints of the ticks in a block, those at its end left to what follows."""
        while block.curve >= self.parts[0].curve + len(self.parts[0].path.curves):
            self.parts.popleft()
        first = self.parts[0]
        begin = float(first.path.curve_starts[block.curve - first.curve]) + block.offset
        law = block.law
        gone = self.tick - block.tick
        count = math.ceil((block.phase + law.duration) / self.period - ALMOST) - gone
        tau = np.clip((gone + np.arange(max(count, 0))) * self.period - block.phase, 0.0, law.duration)
        s, feed = begin + law(tau), np.maximum(law.feed(tau), 0.0)
        done, passed = 0, 0.0
        for part in self.parts:  # a block may run over several parts
            s -= passed
            passed = part.path.length
            until = len(s) if part is self.parts[-1] else int(np.searchsorted(s, part.path.length))
            if until > done:
                yield self._made(part, s[done:until], feed[done:until])
            done = max(done, until)
            if done == len(s):
                return

    def _made(self, part: _Part, s: Array, feed: Array) -> Setpoints:
        """Setpoints at arc lengths s (n,), mm, from the start of a part."""
        path = part.path
        s = np.clip(s, 0.0, path.length)
        curve, u = path.locate(s)
        t = np.arange(self.tick, self.tick + len(s), dtype=np.float64) * self.period
        self.tick += len(s)
        return Setpoints(
            t=t,
            curve=curve + part.curve,
            u=u,
            s=s + part.start,
            feed=feed,
            position=path.evaluate(curve, u)[:, 0],
            axes=path.axes,
            period=self.period,
            method=METHOD,
            settings=self.settings,
        )


def _collected(pieces: Iterator[Setpoints], chunk: int) -> Iterator[Setpoints]:
    """The same setpoints in records of `chunk` ticks."""
    held: list[Setpoints] = []
    count = 0
    for piece in pieces:
        held.append(piece)
        count += len(piece)
        if count < chunk:
            continue
        whole = Setpoints.joined(held)
        full = count // chunk * chunk
        for start in range(0, full, chunk):
            yield whole.part(start, start + chunk)
        held, count = ([whole.part(full, count)] if count > full else []), count - full
    if held:
        yield Setpoints.joined(held)

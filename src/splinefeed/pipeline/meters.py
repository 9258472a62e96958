"""The meters of a run: each measures one thing in one pass over the chunks of a motion; see `fold`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.analysis.check import Check
from splinefeed.analysis.measures import AxisMotion, LimitUse, Ripple, TipMotion, chord_errors, feed_ripple, limit_use
from splinefeed.analysis.thinning import Kept
from splinefeed.formats.setpoints import Writer
from splinefeed.machine.machine import Machine
from splinefeed.pipeline.fold import Chunk
from splinefeed.pipeline.follow import Servo
from splinefeed.records import IntArray, Limits, Setpoints, Verdict

#: What the axes do at a tick.
MOTION = ("velocity", "acceleration", "jerk")


class UseMeter:
    """What the axes do and how much of each limit that uses, at the ticks that figures need: all, or every peak.

    rows     what keeps these ticks
    kept     the setpoints there; motion, use, tip  what axes and tip do there; use counts over all ticks
    column   ticks of which they have the least and the greatest of each quantity
    """

    kept: Setpoints
    motion: AxisMotion
    use: LimitUse
    tip: TipMotion
    column: int

    def __init__(self, limits: Limits, rows: Kept) -> None:
        self._limits, self._rows = limits, rows
        self._names: tuple[str, ...] = ()
        self._bound: IntArray = np.zeros(0, dtype=np.int64)
        self._last: Setpoints

    def start(self, chunk: Chunk) -> None:
        """Nothing is known before the first chunk."""

    def feed(self, chunk: Chunk) -> None:
        """Measure the ticks of a chunk, and keep those that figures need."""
        inner, own, around = chunk.inner, chunk.own, chunk.around
        motion, use = limit_use(around, chunk.path, chunk.law, self._limits)
        counts = np.bincount(use.binding[inner] + 1, minlength=len(use.names) + 1)
        self._bound = self._bound + counts if self._names else counts
        self._names, self._last = use.names, own
        columns = own.columns | {name: getattr(motion, name)[inner] for name in MOTION}
        columns |= {"share": use.share[inner], "top": use.top[inner]}
        t, law = around.t[inner], chunk.law
        tip = chunk.path.tip_path.of_tip(law(t), law.feed(t), law.acceleration(t), law.jerk(t))
        columns |= {"along": np.column_stack(tip[2:])}
        peaked = [own.feed, *tip[2:], columns["top"]]
        self._rows.see(columns, peaked + [each for name in ("position", "share", *MOTION) for each in columns[name].T])

    def finish(self) -> None:
        """Make records of what is kept."""
        of, self.column = self._rows.take, self._rows.block
        along = of("along")
        said: dict[str, Any] = {name: of(name) for name in self._last.columns}
        self.kept = replace(self._last, **said)
        self.motion = AxisMotion(self.kept.t, *map(of, MOTION))
        self.tip = TipMotion(self.kept.t, *along.T)
        self.use = LimitUse(self._names, self.kept.t, self.kept.s, of("share"), of("top"), self._bound)


class RippleMeter:
    """The feed of the setpoints against the planned one; see `feed_ripple`.

    top   highest feed of the motion, mm/s; without it the highest so far counts
    """

    ripple: Ripple

    def __init__(self, rows: Kept, top: float | None = None) -> None:
        self._rows, self._top, self._known = rows, top or 0.0, top is not None
        self._squares, self._steps, self._floor = 0.0, 0, 0.0

    def start(self, chunk: Chunk) -> None:
        """Nothing is known before the first chunk."""

    def feed(self, chunk: Chunk) -> None:
        """Measure the steps that begin at ticks of a chunk."""
        own, around, inner = chunk.own, chunk.around, chunk.inner
        if not self._known:
            self._top = max(self._top, float(np.max(chunk.law.feed(around.t[inner]))))
        path = chunk.path.tip_path
        ripple = feed_ripple(around, path, chunk.law, top=self._top)
        begin, end = around.t[inner][[0, -1]]
        here = (ripple.t >= begin) & (ripple.t <= end)
        if here.any():
            relative = ripple.relative[here]
            self._squares, self._steps = self._squares + float(np.sum(relative**2)), self._steps + len(relative)
            self._floor = max(self._floor, ripple.floor)
            self._rows.see({"t": ripple.t[here] + (own.t[0] - begin), "relative": relative}, [relative])

    def finish(self) -> None:
        """Make a record of what is kept."""
        rms = math.sqrt(self._squares / self._steps) if self._steps else 0.0
        self.ripple = Ripple(self._rows.take("t"), self._rows.take("relative"), self._floor, rms)


class ChordMeter:
    """The largest distance of the path from the line between setpoints, mm; of joints the check knows that of the tip.

    Nothing is measured on a path in joints.
    """

    def __init__(self) -> None:
        self.largest = 0.0

    def start(self, chunk: Chunk) -> None:
        """Nothing is known before the first chunk."""

    def feed(self, chunk: Chunk) -> None:
        """Measure the steps that begin at ticks of a chunk."""
        path = chunk.path.tip_path
        if path is chunk.path:
            self.largest = max(self.largest, float(np.max(chord_errors(chunk.around, path)[chunk.inner], initial=0.0)))

    def finish(self) -> None:
        """Nothing is left to do."""


class CheckMeter:
    """The verdict of the check, which reads the setpoints alone."""

    verdict: Verdict

    def __init__(self, check: Check) -> None:
        self._check = check

    def start(self, chunk: Chunk) -> None:
        """The parts of the path are given to the check by whoever reads them."""

    def feed(self, chunk: Chunk) -> None:
        """Check the ticks of a chunk."""
        self._check.see(chunk.own)

    def finish(self) -> None:
        """Make the verdict."""
        self.verdict = self._check.verdict()


class ServoMeter:
    """What a machine does that follows the setpoints; `writer` gets all of it."""

    servo: Servo

    def __init__(self, machine: Machine, rows: Kept, writer: Writer | None = None) -> None:
        self._machine, self._rows, self._writer = machine, rows, writer

    def start(self, chunk: Chunk) -> None:
        """Let the machine wait at the first setpoint."""
        self.servo = Servo(self._machine, chunk.own, chunk.path.tip_path, law=chunk.law, keep=self._rows)

    def feed(self, chunk: Chunk) -> None:
        """Let it follow the ticks of a chunk."""
        inner = chunk.around.part(chunk.first, chunk.inner.stop)
        self.servo.go_on(chunk.path.tip_path, chunk.law)
        response = self.servo.follow(chunk.own, inner)
        if self._writer is not None:
            self._writer.feed(response)

    def finish(self) -> None:
        """End the file of the response."""
        if self._writer is not None:
            self._writer.finish()


class FileMeter:
    """Writes the setpoints to a file as they come.

    said   settings that the file says beside those of the setpoints, of which it is given
    """

    def __init__(self, writer: Writer, said: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda own: {}) -> None:
        self._writer, self._said = writer, said
        self._settings: dict[str, Any] = {}

    def start(self, chunk: Chunk) -> None:
        """Know what the file says of its setpoints."""
        own = chunk.own.settings
        self._settings = {**own, **self._said(own)}

    def feed(self, chunk: Chunk) -> None:
        """Write the ticks of a chunk."""
        self._writer.feed(replace(chunk.own, settings=self._settings))

    def finish(self) -> None:
        """Put the file in its place."""
        self._writer.finish()

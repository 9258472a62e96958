"""The meters of a run: each measures one thing in one pass over the chunks of a motion; see `fold`."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import compress
from typing import Any

import numpy as np

from splinefeed.analysis.bands import Band
from splinefeed.analysis.measures import AxisMotion, LimitUse, TipMotion, maximum_velocity
from splinefeed.analysis.thinning import Kept
from splinefeed.checks.by_tick import ByTick
from splinefeed.checks.check import Check
from splinefeed.checks.law import LawMotion, LawTicks, OnPath
from splinefeed.checks.path_limits import EVALUATORS
from splinefeed.formats.setpoints import Writer
from splinefeed.limit_table import PLACES
from splinefeed.machine.machine import Machine
from splinefeed.records import Array, IntArray, Setpoints, Verdict
from splinefeed.runs.fold import Chunk, Meter
from splinefeed.runs.following import Servo

#: What the axes do at a tick.
MOTION = ("velocity", "acceleration", "jerk")


class CheckMeter(Meter):
    """Check a motion, and measure what it does at the ticks that figures need: all, or every peak.

    The check reads the setpoints alone; whoever reads a path in parts gives the check its parts.

    Parameters
    ----------
    check : Check
        Of the motion.
    rows : Kept
        What keeps these ticks.

    Attributes
    ----------
    verdict : Verdict
        Of the check.
    kept : Setpoints
        The setpoints there.
    motion, use, tip : AxisMotion, LimitUse, TipMotion
        What axes and tip do there; use counts over all ticks.
    bands : dict of str to Band
        Of each quantity over time where ticks are left out: `tip` (s, feed, acceleration, jerk along the path), `feed`,
        `top`, and by axis or limit `position`, `velocity`, `acceleration`, `jerk`, `share`.
    """

    verdict: Verdict
    kept: Setpoints
    motion: AxisMotion
    use: LimitUse
    tip: TipMotion
    bands: dict[str, Band]

    def __init__(self, check: Check, rows: Kept) -> None:
        self._check, self._rows = check, rows
        self._seen = check.by_tick = ByTick()
        self._waiting: deque[tuple[Chunk, LawTicks, Array]] = deque()  # for what the check says of the last ticks
        self._done = 0
        self._bound: IntArray = np.zeros(1, dtype=np.int64)
        self._last: Setpoints

    def feed(self, chunk: Chunk) -> None:
        """Check the ticks of a chunk."""
        law = LawMotion(chunk.law, self._check.bounds(chunk.path.tip_path))
        on = law.places_of(chunk.around)
        self._waiting.append((chunk, law.at_ticks(chunk.around, on), self._top(chunk, on)))
        self._check.see(chunk.own)
        self._keep()

    def _top(self, chunk: Chunk, on: OnPath) -> Array:
        """The maximum-velocity curve at the ticks of a chunk, (n,), mm/s."""
        path, limits, chord = chunk.path, self._check.limits, on.at.curvature
        if limits.chord_error is not None and not path.carries_tip:
            left = path.between_ticks(path.derivatives(path.tip_path.lengths_of(chunk.around)))[0]
            chord = chord if left is None else left
        slow = {name: EVALUATORS[name](on.at) for name in limits.given(PLACES)}
        feed, (first, second, _) = self._check.bounds(path.tip_path).row_feeds[on.row], on.axes
        top = maximum_velocity(first.T, second.T, slow, chord, path.axes, limits, feed, chunk.own.period, on.tip[:2])
        return top[chunk.inner]

    def _keep(self) -> None:
        """Keep what is known for good of ticks that figures need."""
        while self._waiting and self._done + len(self._waiting[0][0].own) <= self._seen.final:
            chunk, law, top = self._waiting.popleft()
            self._last, names = chunk.own, self._seen.names
            self._done += len(self._last)
            share, motion = self._seen.take(law, chunk.inner)
            use = LimitUse(names, self._last.t, self._last.s, share, top, self._bound)
            counts = np.bincount(use.binding + 1, minlength=len(names) + 1)
            self._bound = self._bound + counts
            columns = self._last.columns | dict(zip(MOTION, motion, strict=True)) | {"share": share, "top": top}
            tip = _of_tip(chunk, chunk.around.t[chunk.inner])
            columns |= {"along": tip[:, 2:]}
            quantities = {"tip": tip, **{name: columns[name] for name in ("feed", "top", "position", "share", *MOTION)}}
            self._rows.see(columns, quantities, {} if self._rows.whole else {"tip": _between(chunk, tip)})

    def finish(self) -> None:
        """Make the verdict, and records of what is kept."""
        self.verdict = self._check.verdict()
        self._keep()
        of, self.bands = self._rows.take, self._rows.bands()
        along = of("along")
        said: dict[str, Any] = {name: of(name) for name in self._last.columns}
        self.kept = replace(self._last, **said)
        self.motion = AxisMotion(self.kept.t, *map(of, MOTION))
        self.tip = TipMotion(self.kept.t, *along.T)
        given = [name in self.verdict.limits for name in self._seen.names]  # a feed may turn out to be given nowhere
        names, bound = tuple(compress(self._seen.names, given)), self._bound[[True, *given]]
        if (band := self.bands.get("share")) is not None:
            self.bands["share"] = replace(band, low=band.low[:, given], high=band.high[:, given])
        self.use = LimitUse(names, self.kept.t, self.kept.s, of("share")[:, given], of("top"), bound)


def _of_tip(chunk: Chunk, t: Array) -> Array:
    """Arc length from the motion's start, feed, acceleration and jerk of the tip at times of a chunk's law, (n, 4)."""
    law = chunk.law
    s, *rates = chunk.path.tip_path.of_tip(law(t), law.feed(t), law.acceleration(t), law.jerk(t))
    return np.column_stack([s + (chunk.own.s[0] - chunk.around.s[chunk.first]), *rates])


def _between(chunk: Chunk, tip: Array) -> tuple[Array, Array]:
    """The least and the greatest of `tip` from each tick to the next: on both sides of each break of the law, too."""
    t, end = chunk.around.t[chunk.inner], chunk.around.t[chunk.inner.stop : chunk.inner.stop + 1]
    breaks = chunk.law.breaks[slice(*np.searchsorted(chunk.law.breaks, np.append(t, end)[[0, -1]]))]
    if not len(breaks):
        return tip, tip
    tick = np.searchsorted(t, breaks, "right") - 1
    sides = [_of_tip(chunk, each) for each in (breaks, np.nextafter(breaks, 0.0))]
    low, high = tip.copy(), tip.copy()
    for side in sides:
        np.fmin.at(low, tick, side)
        np.fmax.at(high, tick, side)
    return low, high


class ServoMeter(Meter):
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


class FileMeter(Meter):
    """Write the setpoints to a file as they come.

    Parameters
    ----------
    writer : Writer
        The file.
    said : callable
        Of the settings of the setpoints, those that the file has beside them.
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

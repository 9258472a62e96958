"""A motion measured chunk by chunk: its worst values, its counts, and the ticks of a figure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.analysis.measures import AxisMotion, LimitUse, Ripple, axis_motion, chord_errors, feed_ripple, limit_use
from splinefeed.analysis.thinning import Kept
from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, IntArray, Limits, Response, Setpoints, TimeLaw

#: Motions of at most so many ticks are one chunk, and every tick is kept.
LONG = 1_000_000
#: Of a longer one: stretches of time of which the least and the greatest of every quantity are kept, and most ticks of
#: one stretch and of one chunk.
COLUMNS, MOST_IN_COLUMN = 1200, 65_536
#: Ticks on both sides of a chunk that its measures may use: what a third difference needs.
NEIGHBOURS = 2
#: Columns of setpoints, of what the axes do, and of a response.
SAID = ("t", "curve", "u", "s", "feed", "position")
MOTION = ("velocity", "acceleration", "jerk")
ANSWER = ("t", "command", "position", "measured", "output", "saturated", "contour_error")


def column_of(ticks: int) -> int:
    """Ticks in one column of a motion of so many: one where all are kept."""
    return 1 if ticks <= LONG else min(-(-ticks // COLUMNS), MOST_IN_COLUMN)


def chunk_of(ticks: int) -> int:
    """Ticks in one chunk: all of them, or whole columns that fit in memory."""
    column = column_of(ticks)
    return max(ticks, 1) if column == 1 else MOST_IN_COLUMN // column * column


class Meter:
    """Measures a motion of so many ticks chunk by chunk, in constant memory plus the ticks that a figure needs."""

    def __init__(self, path: Path | JointPath, limits: Limits, law: TimeLaw, ticks: int) -> None:
        self.path, self.limits, self.law = path, limits, law
        self.tip = path.tool if isinstance(path, JointPath) else path
        self.ticks, self.chord = 0, 0.0
        self._rows, self._ripples = (Kept(column_of(ticks)) for _ in range(2))
        self._names: tuple[str, ...] = ()
        self._bound: IntArray = np.zeros(0, dtype=np.int64)
        self._squares, self._steps, self._floor, self._top = 0.0, 0, 0.0, 0.0
        self._first: Setpoints | None = None
        self._answer: Response | None = None

    def see(self, block: Setpoints, first: int, setpoints: Setpoints, response: Response | None) -> None:
        """The next chunk, from `first` on in a block with its neighbours, and the machine's response to it."""
        path, law, t, own = self.path, self.law, setpoints.t, slice(first, first + len(setpoints))
        if self._first is None:
            self._first, self._top = setpoints, _top_feed(law, setpoints.period)
        motion = axis_motion(block, path, law)
        use = limit_use(motion, block, path, law, self.limits)
        self._names = use.names
        counts = np.bincount(use.binding[own] + 1, minlength=len(use.names) + 1)
        self._bound = counts if not len(self._bound) else self._bound + counts
        if not isinstance(path, JointPath):
            self.chord = max(self.chord, float(np.max(chord_errors(block, path)[own], initial=0.0)))
        self._see_ripple(feed_ripple(block, self.tip, law, top=self._top), t)
        rows = {name: getattr(setpoints, name) for name in SAID}
        rows |= {name: getattr(motion, name)[own] for name in MOTION}
        rows |= {"share": use.share[own], "top": use.top[own]}
        peaked = [setpoints.feed, law.acceleration(t), law.jerk(t), rows["top"]]
        peaked += [each for name in ("position", "share", *MOTION) for each in rows[name].T]
        if response is not None:
            self._answer, count = response, len(t) - len(response)
            answer = {name: getattr(response, name) for name in ANSWER if getattr(response, name) is not None}
            answer = {name: np.concatenate([a, np.full((count, *a.shape[1:]), np.nan)]) for name, a in answer.items()}
            rows |= {f"response {name}": values for name, values in answer.items()}
            peaked += [*(answer["command"] - answer["position"]).T, *answer["saturated"].T]
            peaked += [answer["contour_error"]] if "contour_error" in answer else []
        self._rows.see(rows, peaked)
        self.ticks += len(setpoints)

    def _see_ripple(self, ripple: Ripple, t: Array) -> None:
        own = (ripple.t >= t[0]) & (ripple.t <= t[-1])
        if own.any():
            relative = ripple.relative[own]
            self._squares += float(np.sum(relative**2))
            self._steps += len(relative)
            self._floor = max(self._floor, ripple.floor)
            self._ripples.see({"t": ripple.t[own], "relative": relative}, [relative])

    @property
    def setpoints(self) -> Setpoints:
        """The ticks that are kept."""
        assert self._first is not None
        columns: dict[str, Any] = {name: self._rows.column(name) for name in SAID}
        return replace(self._first, **columns)

    @property
    def motion(self) -> AxisMotion:
        """The axis motion at them."""
        return AxisMotion(*map(self._rows.column, ("t", *MOTION)))

    @property
    def use(self) -> LimitUse:
        """The limits at them, and what binds over all ticks."""
        t, s, share, top = map(self._rows.column, ("t", "s", "share", "top"))
        return LimitUse(self._names, t, s, share, top, self._bound)

    @property
    def ripple(self) -> Ripple:
        """The ripple at its peaks, and over all steps."""
        rms = float(np.sqrt(self._squares / self._steps)) if self._steps else 0.0
        return Ripple(self._ripples.column("t"), self._ripples.column("relative"), self._floor, rms)

    @property
    def response(self) -> Response:
        """The machine's response at the kept ticks, as far as it went."""
        assert self._answer is not None
        columns: dict[str, Any] = {name: self._rows.column(f"response {name}") for name in ANSWER}
        done = np.isfinite(columns["t"])
        return replace(self._answer, **{name: values[done] for name, values in columns.items() if len(values)})


def _top_feed(law: TimeLaw, period: float) -> float:
    ticks = int(law.duration / period) + 1
    starts = range(0, ticks, MOST_IN_COLUMN)
    return max(float(np.max(law.feed(np.arange(k, min(k + MOST_IN_COLUMN, ticks)) * period))) for k in starts)


def with_neighbours(chunks: Iterable[Setpoints]) -> Iterator[tuple[Setpoints, int, Setpoints]]:
    """Each chunk with the ticks before and behind it, where it begins in that, and by itself."""
    before: list[Setpoints] = []
    held: Setpoints | None = None
    for chunk in chunks:
        if held is not None:
            yield Setpoints.joined([*before, held, chunk.part(0, NEIGHBOURS)]), sum(map(len, before)), held
            before = [held.part(max(len(held) - NEIGHBOURS, 0), len(held))]
        held = chunk
    if held is None:
        raise InputError("there are no setpoints to measure")
    yield Setpoints.joined([*before, held]), sum(map(len, before)), held

"""A motion measured chunk by chunk: its worst values, its counts, and the ticks of a figure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.analysis.binding import LimitUse, limit_use
from splinefeed.analysis.motion import AxisMotion, axis_motion
from splinefeed.analysis.ripple import Ripple, chord_errors, feed_ripple
from splinefeed.analysis.thinning import Thread, extremes
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
    """Measures a motion chunk by chunk, in constant memory plus the ticks that a figure needs.

    column  ticks in one column of a figure, of which the least and the greatest of every quantity are kept; 1: all
    """

    def __init__(self, path: Path | JointPath, limits: Limits, law: TimeLaw, column: int) -> None:
        self.path, self.limits, self.law, self.column = path, limits, law, column
        self.tip = path.tool if isinstance(path, JointPath) else path
        self.ticks, self.chord = 0, 0.0
        self._shown = slice(min(self.tip.linear, 3))
        self._thread: Thread | None = None
        self._kept: dict[str, list[Array]] = {}
        self._rows: dict[str, Array] = {}
        self._peaked: list[Array] = []  # quantities of the chunk that was seen last, (n,) each
        self._names: tuple[str, ...] = ()
        self._bound: IntArray = np.zeros(0, dtype=np.int64)
        self._squares, self._steps, self._floor, self._top = 0.0, 0, 0.0, 0.0
        self._first: Setpoints | None = None
        self._answer: Response | None = None

    def see(self, block: Setpoints, own: slice, setpoints: Setpoints) -> None:
        """The next chunk `setpoints`, which is `own` of `block`, where its neighbours are too."""
        path, law, t = self.path, self.law, setpoints.t
        if self._first is None:
            self._first, self._top = setpoints, _top_feed(law, setpoints.period)
        motion = axis_motion(block, path, law)
        use = limit_use(motion, block, path, law, self.limits)
        self._names = use.names
        counts = np.bincount(use.binding[own] + 1, minlength=len(use.names) + 1)
        self._bound = counts if not len(self._bound) else self._bound + counts
        place = setpoints.position
        if isinstance(path, JointPath):
            place = self.tip.evaluate(setpoints.curve, setpoints.u, 0)[:, 0]
        else:
            self.chord = max(self.chord, float(np.max(chord_errors(block, path)[own], initial=0.0)))
        self._see_place(place[:, self._shown])
        self._see_ripple(feed_ripple(block, self.tip, law, top=self._top), setpoints)
        self._rows = {name: getattr(setpoints, name) for name in SAID}
        self._rows |= {name: getattr(motion, name)[own] for name in MOTION}
        self._rows |= {"share": use.share[own], "top": use.top[own]}
        self._peaked = [setpoints.feed, law.acceleration(t), law.jerk(t), self._rows["top"]]
        for name in ("position", "share", *MOTION):
            self._peaked += list(self._rows[name].T)
        self.ticks += len(setpoints)

    def see_response(self, response: Response) -> None:
        """The machine's response to the last chunk, as far as it went."""
        self._answer = response
        n, count = len(response), len(self._rows["t"])
        if not n:
            return
        rows = {f"response {name}": getattr(response, name) for name in ANSWER}
        self._rows |= {name: values for name, values in rows.items() if values is not None}
        quantities = [*response.tracking_error.T, *response.saturated.T]
        quantities += [] if response.contour_error is None else [response.contour_error]
        self._peaked += [np.pad(values, (0, count - n), mode="edge") for values in quantities]

    def keep(self) -> None:
        """Keep the ticks of the chunk that was seen last at which anything is least or greatest in its column."""
        kept = np.arange(len(self._rows["t"]))
        if self.column > 1:
            columns = -(-len(kept) // self.column)
            kept = np.unique(np.concatenate([extremes(values, columns) for values in self._peaked]))
        for name, values in self._rows.items():
            self._kept.setdefault(name, []).append(values[kept[kept < len(values)]])

    def _see_place(self, place: Array) -> None:
        if self._thread is None:
            low, high = (each[self._shown] for each in self.tip.bounding_box()) if self.column > 1 else _box(place)
            self._thread = Thread(low, high)
        self._thread.see(place)

    def _see_ripple(self, ripple: Ripple, setpoints: Setpoints) -> None:
        own = (ripple.t >= setpoints.t[0]) & (ripple.t <= setpoints.t[-1])
        t, relative = ripple.t[own], ripple.relative[own]
        if not len(t):
            return
        self._squares += float(np.sum(relative**2))
        self._steps += len(t)
        self._floor = max(self._floor, ripple.floor)
        kept = extremes(relative, -(-len(setpoints) // self.column))
        self._kept.setdefault("ripple t", []).append(t[kept])
        self._kept.setdefault("ripple", []).append(relative[kept])

    def _all(self, name: str) -> Array:
        return np.concatenate(self._kept[name]) if name in self._kept else np.zeros(0)

    @property
    def line(self) -> Array:
        """Where the path runs, for a picture, (m, d), a row of NaN where it is broken."""
        return np.zeros((0, 0)) if self._thread is None else self._thread.line

    @property
    def setpoints(self) -> Setpoints:
        """The ticks that are kept."""
        assert self._first is not None
        columns: dict[str, Any] = {name: self._all(name) for name in SAID}
        return replace(self._first, **columns)

    @property
    def motion(self) -> AxisMotion:
        """The axis motion at them."""
        return AxisMotion(self._all("t"), *(self._all(name) for name in MOTION))

    @property
    def use(self) -> LimitUse:
        """The limits at them, and what binds over all ticks."""
        return LimitUse(
            self._names, self._all("t"), self._all("s"), self._all("share"), self._all("top"), counts=self._bound
        )

    @property
    def ripple(self) -> Ripple:
        """The ripple at its peaks, and over all steps."""
        rms = float(np.sqrt(self._squares / self._steps)) if self._steps else 0.0
        return Ripple(self._all("ripple t"), self._all("ripple"), self._floor, rms)

    @property
    def response(self) -> Response:
        """The machine's response at the kept ticks, as far as it went."""
        assert self._answer is not None
        columns: dict[str, Any] = {
            name: self._all(f"response {name}") for name in ANSWER if f"response {name}" in self._kept
        }
        return replace(self._answer, **columns)


def _box(place: Array) -> tuple[Array, Array]:
    """Least and greatest of places (n, d), which are all there are."""
    return place.min(axis=0), place.max(axis=0)


def _top_feed(law: TimeLaw, period: float) -> float:
    """Highest feed at any tick, mm/s."""
    ticks = int(law.duration / period) + 1
    starts = range(0, ticks, MOST_IN_COLUMN)
    return max(float(np.max(law.feed(np.arange(k, min(k + MOST_IN_COLUMN, ticks)) * period))) for k in starts)


def with_neighbours(chunks: Iterable[Setpoints]) -> Iterator[tuple[Setpoints, slice, Setpoints]]:
    """Each chunk with the ticks before and behind it, where it is in that, and by itself."""
    before: Setpoints | None = None
    held: Setpoints | None = None
    for chunk in chunks:
        if held is not None:
            yield _beside(before, held, chunk)
            before = held.part(max(len(held) - NEIGHBOURS, 0), len(held))
        held = chunk
    if held is None:
        raise InputError("there are no setpoints to measure")
    yield _beside(before, held, None)


def _beside(before: Setpoints | None, chunk: Setpoints, behind: Setpoints | None) -> tuple[Setpoints, slice, Setpoints]:
    parts = [
        each for each in (before, chunk, None if behind is None else behind.part(0, NEIGHBOURS)) if each is not None
    ]
    first = 0 if before is None else len(before)
    return Setpoints.joined(parts), slice(first, first + len(chunk)), chunk

"""What a motion that is seen chunk by chunk leaves behind: its worst values, its counts, and the ticks of a figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.analysis.binding import LimitUse, limit_use
from splinefeed.analysis.motion import AxisMotion, axis_motion
from splinefeed.analysis.ripple import Ripple, chord_errors, feed_ripple
from splinefeed.analysis.thinning import Thread, extremes
from splinefeed.geometry.path import Path
from splinefeed.records import Array, Limits, Response, Setpoints, TimeLaw

#: Columns of setpoints, of what the axes do, and of a response.
SAID = ("t", "curve", "u", "s", "feed", "position")
MOTION = ("velocity", "acceleration", "jerk")
ANSWER = ("t", "command", "position", "measured", "output", "saturated", "contour_error")


@dataclass(frozen=True, eq=False)
class CountedUse(LimitUse):
    """The use of limits at the ticks that are kept; `bound_by` is counted over all of them."""

    bound_by: Mapping[str, float]

    def time_bound_by(self) -> dict[str, float]:
        """Part of the time in which each limit binds, over all ticks."""
        return dict(self.bound_by)


@dataclass(frozen=True, eq=False)
class CountedRipple(Ripple):
    """The ripple of the steps that are kept, the largest among them; `of_all` is the root mean square of all."""

    of_all: float

    @property
    def rms(self) -> float:
        """Root mean square over all steps."""
        return self.of_all


class Meter:
    """Sees a motion chunk by chunk, in memory that does not grow but for the ticks that a figure needs.

    column  ticks in one column of a figure, of which the least and the greatest of every quantity are kept
    top     highest feed of the motion, mm/s
    """

    def __init__(self, path: Path, limits: Limits, law: TimeLaw, column: int, top: float) -> None:
        self.path, self.limits, self.law, self.column, self.top = path, limits, law, column, top
        self.ticks, self.chord, self.off_law = 0, 0.0, 0.0
        low, high = path.bounding_box()
        self._shown = slice(min(path.linear, 3))
        self.thread = Thread(low[self._shown], high[self._shown])
        self._kept: dict[str, list[Array]] = {}
        self._rows: dict[str, Array] = {}
        self._peaked: list[Array] = []  # quantities of the chunk that was seen last, (n,) each
        self._names: tuple[str, ...] = ()
        self._bound = np.zeros(0, dtype=np.int64)
        self._squares, self._steps, self._floor = 0.0, 0, 0.0
        self._first: Setpoints | None = None
        self._answer: Response | None = None

    def see(self, block: Setpoints, own: slice, points: Setpoints) -> None:
        """The next chunk `points`, which is `own` of `block`, where its neighbours are too."""
        path, law, t = self.path, self.law, points.t
        self._first = self._first or points
        motion = axis_motion(block, path, law)
        use = limit_use(motion, block, path, law, self.limits)
        self._names = use.names
        counts = np.bincount(use.binding[own] + 1, minlength=len(use.names) + 1)
        self._bound = counts if not len(self._bound) else self._bound + counts
        self.chord = max(self.chord, float(np.max(chord_errors(block, path)[own], initial=0.0)))
        self._see_ripple(feed_ripple(block, path, law, top=self.top), points)
        self.thread.see(points.position[:, self._shown])
        self._rows = {name: getattr(points, name) for name in SAID}
        self._rows |= {name: getattr(motion, name)[own] for name in MOTION}
        self._rows |= {"share": use.share[own], "top": use.top[own]}
        self._peaked = [points.feed, law.acceleration(t), law.jerk(t), self._rows["top"]]
        for name in ("position", "share", *MOTION):
            self._peaked += list(self._rows[name].T)
        self.ticks += len(points)

    def see_response(self, response: Response, points: Setpoints) -> None:
        """What a machine did with the chunk that was seen last."""
        n, path = len(response), self.path
        if not n:
            return
        self._answer = response
        rows = {f"response {name}": getattr(response, name) for name in ANSWER}
        self._rows |= {name: values for name, values in rows.items() if values is not None}
        quantities = [*response.tracking_error.T, *response.saturated.T]
        quantities += [] if response.contour_error is None else [response.contour_error]
        self._peaked += [np.pad(values, (0, len(points) - n), mode="edge") for values in quantities]
        wanted = path(np.clip(self.law(points.t), 0.0, path.length))[:, : path.linear]
        away = np.linalg.norm(points.position[:, : path.linear] - wanted, axis=1)
        self.off_law = max(self.off_law, float(np.max(away)))

    def keep(self) -> None:
        """Keep the ticks of the chunk that was seen last at which anything is least or greatest in its column."""
        count = len(self._rows["t"])
        columns = -(-count // self.column)
        kept = np.unique(np.concatenate([extremes(values, columns) for values in self._peaked])).astype(np.int64)
        for name, values in self._rows.items():
            self._kept.setdefault(name, []).append(values[kept[kept < len(values)]])

    def _see_ripple(self, ripple: Ripple, points: Setpoints) -> None:
        own = (ripple.t >= points.t[0]) & (ripple.t <= points.t[-1])
        t, relative = ripple.t[own], ripple.relative[own]
        if not len(t):
            return
        self._squares += float(np.dot(relative, relative))
        self._steps += len(t)
        self._floor = max(self._floor, ripple.floor)
        kept = extremes(relative, -(-len(points) // self.column))
        self._kept.setdefault("ripple t", []).append(t[kept])
        self._kept.setdefault("ripple", []).append(relative[kept])

    def _all(self, name: str) -> Array:
        return np.concatenate(self._kept[name]) if name in self._kept else np.zeros(0)

    @property
    def points(self) -> Setpoints:
        """The ticks that are kept."""
        assert self._first is not None
        columns: dict[str, Any] = {name: self._all(name) for name in SAID}
        return replace(self._first, **columns)

    @property
    def motion(self) -> AxisMotion:
        """What the axes do at them."""
        return AxisMotion(self._all("t"), *(self._all(name) for name in MOTION))

    @property
    def use(self) -> CountedUse:
        """The limits at them, and what binds over all ticks."""
        parts = self._bound / max(self.ticks, 1)
        bound = {name: float(part) for name, part in zip(self._names, parts[1:], strict=True) if part > 0.0}
        bound["none"] = float(parts[0])
        return CountedUse(
            self._names, self._all("t"), self._all("s"), self._all("share"), self._all("top"), bound_by=bound
        )

    @property
    def ripple(self) -> CountedRipple:
        """The ripple at its peaks, and over all steps."""
        rms = float(np.sqrt(self._squares / self._steps)) if self._steps else 0.0
        return CountedRipple(self._all("ripple t"), self._all("ripple"), self._floor, of_all=rms)

    @property
    def response(self) -> Response:
        """What the machine did at the ticks that are kept, as far as it came."""
        assert self._answer is not None
        columns: dict[str, Any] = {
            name: self._all(f"response {name}") for name in ANSWER if f"response {name}" in self._kept
        }
        return replace(self._answer, **columns)

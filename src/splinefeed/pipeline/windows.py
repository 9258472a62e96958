"""From a file to checked setpoints, window by window in constant memory: read, smooth, plan, interpolate, check."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from splinefeed.analysis.check_parts import CheckInParts
from splinefeed.errors import InputError
from splinefeed.feed.modes import LOOK_AHEAD
from splinefeed.formats.path_parts import PathParts
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing_stream import Smoother
from splinefeed.pipeline.long_path import METHOD, continuing, stream_setpoints
from splinefeed.pipeline.smooth import arguments
from splinefeed.records import Limits, Setpoints, Verdict

#: Is called with how many moves of the file are read by now, and how many setpoints are made.
Progress = Callable[[int, int], None]


@dataclass(eq=False)
class WindowedRun:
    """A run along a path that comes in parts, made once: `setpoints`, and after them its `verdict`.

    how       `smooth`, the tolerance, mm, or PROGRAM; without it the path stays; `corners`; `corner_angle`, degrees
    said      the settings stored with the setpoints, in addition to `settings` and the name of the path
    """

    source: PathParts
    limits: Limits
    period: float
    how: Mapping[str, Any] = field(default_factory=dict)
    said: Mapping[str, Any] = field(default_factory=dict)
    on_progress: Progress | None = None

    def __post_init__(self) -> None:
        self._read = 0
        self._ticks = 0
        self._top = 0.0
        self._smoother: Smoother | None = None
        if self.how.get("smooth") is not None:
            self._smoother = Smoother(axes=self.source.axes, **arguments(self.how, bool(self.source.tolerance)))
        self._check = CheckInParts(self.limits)
        self._verdict: Verdict | None = None

    def setpoints(self) -> Iterator[Setpoints]:
        """All setpoints, in chunks, each checked before it is yielded; iterate once."""
        for chunk in stream_setpoints(self._paths(), self.limits, period=self.period):
            self._check.see(chunk)
            self._ticks += len(chunk)
            self._top = max(self._top, float(chunk.feed.max()))
            self._say()
            yield replace(chunk, settings={**chunk.settings, **self.said})
        self._verdict = self._check.verdict()

    @property
    def name(self) -> str:
        """Name of the path."""
        return self.source.name

    @property
    def settings(self) -> dict[str, Any]:
        """How the setpoints are made."""
        flat = {"limits": self.limits.as_dict(), "period": self.period}
        return {**flat, "strategy": LOOK_AHEAD, "method": METHOD}

    @property
    def verdict(self) -> Verdict:
        """The verdict on all setpoints; InputError before the last of them."""
        if self._verdict is None:
            raise InputError("no verdict yet: read all setpoints first")
        return self._verdict

    def numbers(self) -> dict[str, Any]:
        """The numbers of `run` that do not need the whole path."""
        verdict = self.verdict
        page = verdict.as_dict()
        found = [*self.source.findings, *([] if self._smoother is None else [self._smoother.summary])]
        return {
            **page,
            "lower_bound_s": None,
            "strategy": LOOK_AHEAD,
            "method": METHOD,
            "feed_max_mm_s": self._top,
            "notes": [*found, *page["notes"]],
        }

    def _say(self) -> None:
        if self.on_progress is not None:
            self.on_progress(min(self._read, self.source.count), self._ticks)

    def _paths(self) -> Iterator[Path]:
        """Parts of the path to drive along, each of which the check has first."""
        last: Path | None = None
        for path in self._parts():
            last = path if last is None else continuing(path, last)
            self._check.part(last)
            yield last

    def _parts(self) -> Iterator[Path]:
        """Parts of the path as they are read, or smoothed."""
        for part in self.source:
            self._read += len(part.curves)
            self._say()
            yield from [part] if self._smoother is None else self._smoother.push(part)
        if self._smoother is not None:
            yield from self._smoother.finish()

"""From a file to checked setpoints, window by window in constant memory: read, smooth, plan, interpolate, check."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from splinefeed.analysis.check import Check
from splinefeed.feed.modes import LOOK_AHEAD
from splinefeed.formats.path_parts import PathParts
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing_stream import Smoother
from splinefeed.pipeline.long_path import METHOD, in_line, stream_setpoints
from splinefeed.pipeline.smooth import arguments
from splinefeed.records import Limits, Setpoints, Verdict

#: Is called with how many moves of the file are read by now, and how many setpoints are made.
Progress = Callable[[int, int], None]


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
        smoothed = how.get("smooth") is not None
        said = arguments(how, bool(source.tolerance)) if smoothed else {}
        self._smoother = Smoother(axes=source.axes, **said) if smoothed else None
        self._check = Check(limits)

    def setpoints(self) -> Iterator[Setpoints]:
        """All setpoints, in chunks, each checked before it is yielded; iterate once."""
        for chunk in stream_setpoints(self._paths(), self.limits, period=self.period):
            self._check.see(chunk)
            self._ticks += len(chunk)
            self._top = max(self._top, float(chunk.feed.max()))
            self._say()
            yield chunk
        self.verdict: Verdict = self._check.verdict()

    def numbers(self) -> dict[str, Any]:
        """The numbers of `run` that do not need the whole path."""
        page = self.verdict.as_dict()
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
        self._on_progress(min(self._read, self.source.count), self._ticks)

    def _paths(self) -> Iterator[Path]:
        """Parts of the path to drive along, each of which the check has first."""
        for path in in_line(self._parts()):
            self._check.part(path)
            yield path

    def _parts(self) -> Iterator[Path]:
        """Parts of the path as they are read, or smoothed."""
        for part in self.source:
            self._read += len(part.curves)
            self._say()
            yield from [part] if self._smoother is None else self._smoother.push(part)
        if self._smoother is not None:
            yield from self._smoother.finish()

"""Setpoints to a running controller: a look-ahead buffer, override, hold and stop; one small file a sink."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

_HOMES = {
    "Block": "feed.stream",
    "LawCourse": "feed.course",
    "LookAhead": "feed.stream",
    "Override": "feed.override",
    "Ticks": "feed.override",
    "stream_setpoints": "pipeline.long_path",
    "with_reserve": "feed.reserve",
}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed.feed.course import LawCourse as LawCourse
    from splinefeed.feed.override import Override as Override
    from splinefeed.feed.override import Ticks as Ticks
    from splinefeed.feed.reserve import with_reserve as with_reserve
    from splinefeed.feed.stream import Block as Block
    from splinefeed.feed.stream import LookAhead as LookAhead
    from splinefeed.pipeline.long_path import stream_setpoints as stream_setpoints
else:
    __getattr__, __dir__ = lazily(__name__, _HOMES)

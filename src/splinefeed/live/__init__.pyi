"""Setpoints to a running controller: a look-ahead buffer, override, hold and stop; one small file a sink."""

from splinefeed.feed.course import LawCourse as LawCourse
from splinefeed.feed.override import Override as Override
from splinefeed.feed.override import Ticks as Ticks
from splinefeed.feed.reserve import with_reserve as with_reserve
from splinefeed.feed.stream import Block as Block
from splinefeed.feed.stream import LookAhead as LookAhead
from splinefeed.pipeline.long_path import stream_setpoints as stream_setpoints

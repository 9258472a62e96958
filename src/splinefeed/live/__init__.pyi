"""Setpoints to a running controller: a look-ahead buffer, override, hold and stop; one small file a sink."""

from splinefeed.planner.override.override import Override as Override
from splinefeed.planner.override.override import OverrideTicks as OverrideTicks
from splinefeed.planner.override.reserve import with_reserve as with_reserve
from splinefeed.planner.override.source import LawSource as LawSource
from splinefeed.planner.stream import LookAhead as LookAhead
from splinefeed.planner.stream import MotionBlock as MotionBlock
from splinefeed.runs.long_path import stream_setpoints as stream_setpoints

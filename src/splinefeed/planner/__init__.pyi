"""From a path and limits to a time law sigma(t): how far by when."""

from .horizon import State as State
from .override.override import Override as Override
from .override.override import OverrideTicks as OverrideTicks
from .override.reserve import with_reserve as with_reserve
from .override.source import LawSource as LawSource
from .stream import LookAhead as LookAhead
from .stream import MotionBlock as MotionBlock

"""The parameter at each servo tick: one function a published method, one shared loop, one registry."""

from .interpolator import Interpolator as Interpolator
from .registry import methods as methods
from .registry import register as register

"""The chain as one call: read, plan, interpolate, measure; what the command line and other front ends share."""

from .comparison import MethodResult as MethodResult
from .comparison import MethodTrace as MethodTrace
from .comparison import compare as compare
from .following import follow as follow
from .long_path import stream_setpoints as stream_setpoints
from .tuning import AxisTuning as AxisTuning
from .tuning import PathTuning as PathTuning
from .tuning import tune as tune
from .tuning import tune_on_path as tune_on_path

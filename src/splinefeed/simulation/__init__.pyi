"""The servo loop over setpoints, and the rules that tune it."""

from splinefeed.runs.tuning import AxisTuning as AxisTuning
from splinefeed.runs.tuning import PathTuning as PathTuning
from splinefeed.runs.tuning import tune_on_path as tune_on_path
from splinefeed.simulation.linear import Bound as Bound
from splinefeed.simulation.linear import Margins as Margins
from splinefeed.simulation.linear import margins as margins
from splinefeed.simulation.tuning import Tuning as Tuning
from splinefeed.simulation.tuning import UltimatePoint as UltimatePoint

"""The servo loop over setpoints, and the rules that tune it."""

from .linear import Bound as Bound
from .linear import Margins as Margins
from .linear import margins as margins
from .tuning import Tuning as Tuning
from .tuning import UltimatePoint as UltimatePoint

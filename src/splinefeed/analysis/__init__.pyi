"""Numbers from records and paths: use of limits, ripple, drift, chord and contour error, spectra."""

from .following import Contour as Contour
from .measures import AxisMotion as AxisMotion
from .measures import LimitUse as LimitUse
from .measures import Ripple as Ripple
from .measures import feed_ripple as feed_ripple

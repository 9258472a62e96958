"""Numbers from records and paths: the verdict on every limit, ripple, drift, chord and contour error, spectra."""

from splinefeed.analysis.binding import LimitUse as LimitUse
from splinefeed.analysis.contour import Contour as Contour
from splinefeed.analysis.motion import AxisMotion as AxisMotion
from splinefeed.analysis.ripple import Ripple as Ripple
from splinefeed.analysis.ripple import feed_ripple as feed_ripple

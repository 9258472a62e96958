"""Numbers from records and paths: the verdict on every limit, ripple, drift, chord and contour error, spectra."""

from splinefeed.analysis.following import Contour as Contour
from splinefeed.analysis.measures import AxisMotion as AxisMotion
from splinefeed.analysis.measures import LimitUse as LimitUse
from splinefeed.analysis.measures import Ripple as Ripple
from splinefeed.analysis.measures import feed_ripple as feed_ripple

"""Immutable NURBS curves and the paths made of them, without a clock."""

from splinefeed.geometry.fitting.points import Fit as Fit
from splinefeed.geometry.smoothing import Smoother as Smoother
from splinefeed.geometry.smoothing import smooth_stream as smooth_stream

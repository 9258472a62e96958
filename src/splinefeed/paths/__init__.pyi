"""Immutable NURBS curves and the paths made of them, without a clock."""

from splinefeed.paths.fitting.points import Fit as Fit
from splinefeed.paths.smoothing import Smoother as Smoother
from splinefeed.paths.smoothing import smooth_stream as smooth_stream

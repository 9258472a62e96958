"""Paths: curves joined end to end with axes, feeds and markers, without a clock."""

from . import shapes as shapes
from .each_curve import Marker as Marker
from .fitting import fit as fit
from .fitting.points import Fit as Fit
from .jobs import Job as Job
from .jobs import job as job
from .path_parts import PathParts as PathParts
from .smoothing import Smoother as Smoother
from .smoothing import smooth_stream as smooth_stream
from .tangent_axis import tangential as tangential
from .track import Track as Track

"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from . import analysis as analysis
from . import errors as errors
from . import formats as formats
from . import interpolation as interpolation
from . import kinematics as kinematics
from . import machine as machine
from . import paths as paths
from . import planner as planner
from . import programs as programs
from . import records as records
from . import robots as robots
from . import runs as runs
from . import simulation as simulation
from .checks.check import check as check
from .curves.curve import NurbsCurve as NurbsCurve
from .errors import SplinefeedError as SplinefeedError
from .formats.registry import read as read
from .formats.registry import write as write
from .formats.setpoints import load as load
from .formats.setpoints import save as save
from .interpolation.interpolator import interpolate as interpolate
from .machine.machine import Machine as Machine
from .paths import shapes as shapes
from .paths.path import Path as Path
from .paths.smoothing_proven import smooth as smooth
from .paths.tool_path import ToolPath as ToolPath
from .planner.planning import plan as plan
from .programs.cycle_time import cycle_time as cycle_time
from .records import Limits as Limits
from .records import Response as Response
from .records import Setpoints as Setpoints
from .records import TimeLaw as TimeLaw
from .records import Verdict as Verdict
from .reports import plot as plot
from .reports.folder import report as report
from .robots.arm import robot as robot
from .runs.result import Run as Run
from .runs.run import run as run
from .sweeps.sweeping import sweep as sweep

__version__: str

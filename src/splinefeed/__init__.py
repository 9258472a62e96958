"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

__version__ = "0.1.0"

#: Where each public name lives; the rooms among them have public names of their own.
_HOMES = {
    "Combination": "records.drives",
    "CycleTime": "pipeline.cycle_time",
    "Interpolator": "interpolation.interpolator",
    "JointPath": "kinematics.joint_path",
    "Kinematics": "kinematics.chains",
    "LimitResult": "records.verdict",
    "Limits": "records.limits",
    "Machine": "machine.machine",
    "Marker": "geometry.path",
    "MethodResult": "pipeline.compare",
    "MethodTrace": "pipeline.compare",
    "NurbsCurve": "geometry.curve",
    "Path": "geometry.path",
    "Response": "records.response",
    "Run": "pipeline.run",
    "Setpoints": "records.setpoints",
    "SplinefeedError": "errors",
    "State": "feed.window",
    "TimeLaw": "records.law",
    "ToolPath": "geometry.tool_path",
    "Torque": "records.drives",
    "Verdict": "records.verdict",
    "analysis": "analysis",
    "check": "analysis.check",
    "compare": "pipeline.compare",
    "cycle_time": "pipeline.cycle_time",
    "errors": "errors",
    "fit": "geometry.fitting",
    "follow": "pipeline.follow",
    "formats": "formats",
    "geometry": "geometry",
    "interpolate": "interpolation.interpolator",
    "live": "live",
    "load": "formats.setpoints",
    "machine": "machine",
    "methods": "interpolation.registry",
    "plan": "feed.planning",
    "plot": "report.plot",
    "read": "formats.registry",
    "register": "interpolation.registry",
    "run": "pipeline.run",
    "save": "formats.setpoints",
    "shapes": "geometry.shapes",
    "simulation": "simulation",
    "sweep": "sweeps.sweeping",
    "tangential": "geometry.tangential",
    "tune": "pipeline.tuning",
    "write": "formats.registry",
}

#: Names that were here: each has one home now. They warn, for one release.
_MOVED = {
    "LookAhead": "splinefeed.live.LookAhead",
    "Smoother": "splinefeed.geometry.Smoother",
    "Table": "splinefeed.Machine",
    "feed_ripple": "splinefeed.analysis.feed_ripple",
    "read_parts": "splinefeed.formats.read_parts",
    "smooth_stream": "splinefeed.geometry.smooth_stream",
    "stream_setpoints": "splinefeed.live.stream_setpoints",
    "tune_on_path": "splinefeed.simulation.tune_on_path",
}

__all__ = ["__version__", *_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed import analysis as analysis
    from splinefeed import errors as errors
    from splinefeed import formats as formats
    from splinefeed import geometry as geometry
    from splinefeed import live as live
    from splinefeed import machine as machine
    from splinefeed import simulation as simulation
    from splinefeed.analysis.check import check as check
    from splinefeed.errors import SplinefeedError as SplinefeedError
    from splinefeed.feed.planning import plan as plan
    from splinefeed.feed.window import State as State
    from splinefeed.formats.registry import read as read
    from splinefeed.formats.registry import write as write
    from splinefeed.formats.setpoints import load as load
    from splinefeed.formats.setpoints import save as save
    from splinefeed.geometry import shapes as shapes
    from splinefeed.geometry.curve import NurbsCurve as NurbsCurve
    from splinefeed.geometry.fitting import fit as fit
    from splinefeed.geometry.path import Marker as Marker
    from splinefeed.geometry.path import Path as Path
    from splinefeed.geometry.tangential import tangential as tangential
    from splinefeed.geometry.tool_path import ToolPath as ToolPath
    from splinefeed.interpolation.interpolator import Interpolator as Interpolator
    from splinefeed.interpolation.interpolator import interpolate as interpolate
    from splinefeed.interpolation.registry import methods as methods
    from splinefeed.interpolation.registry import register as register
    from splinefeed.kinematics.chains import Kinematics as Kinematics
    from splinefeed.kinematics.joint_path import JointPath as JointPath
    from splinefeed.machine.machine import Machine as Machine
    from splinefeed.pipeline.compare import MethodResult as MethodResult
    from splinefeed.pipeline.compare import MethodTrace as MethodTrace
    from splinefeed.pipeline.compare import compare as compare
    from splinefeed.pipeline.cycle_time import CycleTime as CycleTime
    from splinefeed.pipeline.cycle_time import cycle_time as cycle_time
    from splinefeed.pipeline.follow import follow as follow
    from splinefeed.pipeline.run import Run as Run
    from splinefeed.pipeline.run import run as run
    from splinefeed.pipeline.tuning import tune as tune
    from splinefeed.records.drives import Combination as Combination
    from splinefeed.records.drives import Torque as Torque
    from splinefeed.records.law import TimeLaw as TimeLaw
    from splinefeed.records.limits import Limits as Limits
    from splinefeed.records.response import Response as Response
    from splinefeed.records.setpoints import Setpoints as Setpoints
    from splinefeed.records.verdict import LimitResult as LimitResult
    from splinefeed.records.verdict import Verdict as Verdict
    from splinefeed.report import plot as plot
    from splinefeed.sweeps.sweeping import sweep as sweep
else:  # a checker of types knows the names above and no others
    __getattr__, __dir__ = lazily(__name__, _HOMES, _MOVED)

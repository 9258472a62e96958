"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from splinefeed.analysis.check import check as check
    from splinefeed.analysis.ripple import feed_ripple as feed_ripple
    from splinefeed.errors import SplinefeedError as SplinefeedError
    from splinefeed.feed.planning import plan as plan
    from splinefeed.feed.stream import LookAhead as LookAhead
    from splinefeed.feed.window import State as State
    from splinefeed.formats.path_parts import read_parts as read_parts
    from splinefeed.formats.registry import read as read
    from splinefeed.formats.registry import write as write
    from splinefeed.formats.setpoints import load as load
    from splinefeed.formats.setpoints import save as save
    from splinefeed.geometry import shapes as shapes
    from splinefeed.geometry.curve import NurbsCurve as NurbsCurve
    from splinefeed.geometry.fitting import fit as fit
    from splinefeed.geometry.path import Marker as Marker
    from splinefeed.geometry.path import Path as Path
    from splinefeed.geometry.smoothing_stream import Smoother as Smoother
    from splinefeed.geometry.smoothing_stream import smooth_stream as smooth_stream
    from splinefeed.geometry.tangential import tangential as tangential
    from splinefeed.geometry.tool_path import ToolPath as ToolPath
    from splinefeed.interpolation.interpolator import Interpolator as Interpolator
    from splinefeed.interpolation.interpolator import interpolate as interpolate
    from splinefeed.interpolation.registry import methods as methods
    from splinefeed.interpolation.registry import register as register
    from splinefeed.kinematics import JointPath as JointPath
    from splinefeed.kinematics import Kinematics as Kinematics
    from splinefeed.machine.table import Machine as Machine
    from splinefeed.pipeline.compare import compare as compare
    from splinefeed.pipeline.follow import follow as follow
    from splinefeed.pipeline.long_path import stream_setpoints as stream_setpoints
    from splinefeed.pipeline.run import run as run
    from splinefeed.pipeline.tuning import tune as tune
    from splinefeed.pipeline.tuning import tune_on_path as tune_on_path
    from splinefeed.records import Combination as Combination
    from splinefeed.records import Limits as Limits
    from splinefeed.records import Response as Response
    from splinefeed.records import Setpoints as Setpoints
    from splinefeed.records import TimeLaw as TimeLaw
    from splinefeed.records import Torque as Torque
    from splinefeed.records import Verdict as Verdict
    from splinefeed.report import plot as plot
    from splinefeed.sweeps.sweeping import sweep as sweep

from splinefeed import errors as errors

__version__ = "0.1.0"

#: Where each public name lives; it is imported at its first use, so that `import splinefeed` stays fast.
_PUBLIC = {
    "Combination": "records",
    "JointPath": "kinematics.joint_path",
    "Kinematics": "kinematics.chains",
    "Interpolator": "interpolation.interpolator",
    "Limits": "records",
    "LookAhead": "feed.stream",
    "Machine": "machine.table",
    "Marker": "geometry.path",
    "NurbsCurve": "geometry.curve",
    "Path": "geometry.path",
    "Setpoints": "records",
    "Smoother": "geometry.smoothing_stream",
    "SplinefeedError": "errors",
    "State": "feed.window",
    "Response": "records",
    "TimeLaw": "records",
    "Torque": "records",
    "ToolPath": "geometry.tool_path",
    "Verdict": "records",
    "check": "analysis.check",
    "compare": "pipeline.compare",
    "feed_ripple": "analysis.ripple",
    "fit": "geometry.fitting",
    "follow": "pipeline.follow",
    "interpolate": "interpolation.interpolator",
    "load": "formats.setpoints",
    "methods": "interpolation.registry",
    "plan": "feed.planning",
    "plot": "report",
    "read": "formats.registry",
    "read_parts": "formats.path_parts",
    "register": "interpolation.registry",
    "run": "pipeline.run",
    "save": "formats.setpoints",
    "shapes": "geometry",
    "smooth_stream": "geometry.smoothing_stream",
    "stream_setpoints": "pipeline.long_path",
    "sweep": "sweeps.sweeping",
    "tangential": "geometry.tangential",
    "tune": "pipeline.tuning",
    "tune_on_path": "pipeline.tuning",
    "write": "formats.registry",
}

__all__ = ["__version__", *_PUBLIC]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name == "Table":
        warnings.warn("splinefeed.Table is now called splinefeed.Machine", DeprecationWarning, stacklevel=2)
        name = "Machine"
    if name not in _PUBLIC:
        raise AttributeError(f"module 'splinefeed' has no attribute {name!r}")
    room = f"splinefeed.{_PUBLIC[name]}"
    value = import_module(f"{room}.{name}") if name in ("plot", "shapes") else getattr(import_module(room), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

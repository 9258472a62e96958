"""From a NURBS curve and a machine's limits to where every axis must be at each servo tick."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any

import lazy_loader

__version__ = "0.1.0"

# what is public, and where it lives, stands in __init__.pyi
_find, __dir__, _public = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_public]  # pyright: ignore[reportUnsupportedDunderAll]

#: Names that moved into their rooms, which the next release has there alone.
_MOVED = {
    **dict.fromkeys(("Interpolator", "methods", "register"), "interpolation"),
    **dict.fromkeys(("JointPath", "Kinematics"), "kinematics"),
    **dict.fromkeys(("Marker", "fit", "tangential"), "paths"),
    **dict.fromkeys(("State",), "planner"),
    **dict.fromkeys(("CycleTime",), "programs"),
    **dict.fromkeys(
        ("Approach", "Combination", "LimitResult", "Torque", "TorqueRate", "VelocityByPosition"), "records"
    ),
    **dict.fromkeys(("MethodResult", "MethodTrace", "compare", "follow", "tune"), "runs"),
}


def __getattr__(name: str) -> Any:
    if name not in _MOVED:
        return _find(name)
    room = _MOVED[name]
    words = f"sf.{name} is sf.{room}.{name}; the next release has it there alone"
    warnings.warn(words, DeprecationWarning, stacklevel=2)
    return getattr(import_module(f"{__name__}.{room}"), name)

"""A path smoothed by the user's settings, with the proof among its findings; a tool path with its tool axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing import PROGRAM
from splinefeed.geometry.smoothing_proven import proven
from splinefeed.geometry.smoothing_tool import proven_tool
from splinefeed.geometry.tool_path import ToolPath


def smooth(path: Path, how: Mapping[str, Any]) -> Path:
    """The path smoothed by these settings; its findings state the proof.

    how  `smooth`, the tolerance, mm, or PROGRAM; without it the path stays; `corners`, `corner_angle`, degrees, and
         `angle_tolerance`, of the tool axis or of rotary axes, rad

    Raises InputError where a program has no tolerance, and CurveError if the path exceeds it, which is not known to
    happen.
    """
    if how.get("smooth") is None:
        return path
    said = arguments(how, path.tolerances is not None and bool(path.tolerances.any()))
    if isinstance(path, ToolPath):
        return proven_tool(path, **said)[0]
    return proven(path, **said).path


def arguments(how: Mapping[str, Any], says_tolerance: bool) -> dict[str, Any]:
    """Settings as arguments of what smooths; says_tolerance: whether the program does (G64 P)."""
    said: dict[str, Any] = {"tolerance": how["smooth"]}
    if how["smooth"] == PROGRAM:
        if not says_tolerance:
            raise InputError("--smooth program: the program has no tolerance (G64 P); give one: --smooth 0.01mm")
        said["corners"] = "round"
    said |= {"corners": how["corners"]} if "corners" in how else {}
    if "corner_angle" in how:
        said["corner_angle"] = math.radians(how["corner_angle"])
    if "angle_tolerance" in how:
        said["angular_tolerance"] = how["angle_tolerance"]
    return said

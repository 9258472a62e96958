"""DXF drawings out (R2000, mm): arcs and lines where a curve is exactly one, SPLINE entities for all others."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.losses import losses, three_axes
from splinefeed.geometry.arcs import as_circle
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path

if TYPE_CHECKING:
    from ezdxf.document import Drawing

#: Longest name of a layer, and what may not stand in one.
_LONGEST_NAME = 255
_NOT_IN_NAMES = re.compile(r'[<>/\\":;?*|=`\x00-\x1f]')
_MILLIMETRES = 4


def write(paths: Sequence[Path], target: str | os.PathLike[str]) -> list[str]:
    """Write `paths`, each on a layer of its name, to the drawing `target`; coordinates keep every digit.

    Returns what DXF has no place for: rotary axes, feeds, markers.
    """
    from ezdxf.filemanagement import new

    document = new("R2000")
    document.units = _MILLIMETRES
    document.header["$MEASUREMENT"] = 1
    for path in paths:
        layer = _NOT_IN_NAMES.sub("_", path.name)[:_LONGEST_NAME].strip() or "0"
        if layer not in document.layers:
            document.layers.add(layer)
        for curve in path.curves:
            _add(document, curve, path, {"layer": layer})
    with atomic_write(target) as temporary, temporary.open("w", encoding="utf-8", newline="\r\n") as stream:
        document.write(stream)
    return losses(paths, "DXF")


def _add(document: Drawing, curve: NurbsCurve, path: Path, attributes: dict[str, Any]) -> None:
    space = document.modelspace()
    points = three_axes(curve.control_points, path)
    flat = bool(np.all(points[:, 2] == points[0, 2]))
    if curve.degree == 1 and not curve.rational and curve.clamped:
        if len(points) == 2:
            space.add_line(points[0], points[1], attributes)
        elif flat:
            polyline = space.add_lwpolyline(points[:, :2], format="xy", dxfattribs=attributes)
            polyline.dxf.elevation = float(points[0, 2])
        else:
            space.add_polyline3d(points, dxfattribs=attributes)
        return
    circle = as_circle(curve) if flat and curve.axes in (2, 3) else None
    if circle is not None:
        center, radius, start, sweep = circle
        middle = (*center, float(points[0, 2]))
        if abs(sweep) >= 2.0 * math.pi and start == 0.0 and sweep > 0.0:
            space.add_circle(middle, radius, attributes)
            return
        if 0.0 < sweep < 2.0 * math.pi:
            space.add_arc(middle, radius, math.degrees(start), math.degrees(start + sweep), dxfattribs=attributes)
            return
    spline = space.add_spline(degree=curve.degree, dxfattribs=attributes)
    spline.control_points = points
    spline.knots = curve.knots
    if curve.weights is not None:
        spline.weights = curve.weights
    if curve.closed:
        spline.dxf.flags = spline.dxf.flags | 1

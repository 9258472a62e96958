"""DXF drawings, text or binary, read by ezdxf: every curve exactly, blocks inserted, in mm; see docs/formats.md.

Written (R2000, mm) are arcs and lines where a curve is exactly one, SPLINE entities for all others.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from ezdxf.filemanagement import new

from splinefeed import units as known_units
from splinefeed.curves.arcs import as_circle
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.formats.drawing import Drawing, losses, three_axes
from splinefeed.formats.dxf_entities import EntityReader, dashed_type
from splinefeed.formats.dxf_tags import BINARY_MARK, read_sections
from splinefeed.paths.contents import Contents
from splinefeed.paths.path import Path

#: What the number in $INSUNITS means.
INSERT_UNITS = {"1": "in", "2": "ft", "4": "mm", "5": "cm", "6": "m", "9": "mil", "13": "um"}
#: Longest name of a layer, and what may not stand in one.
_LONGEST_NAME = 255
_NOT_IN_NAMES = re.compile(r'[<>/\\":;?*|=`\x00-\x1f]')
_MILLIMETRES = 4
#: Decimals of the places of entities; binary files and exponents have all that a float has.
_DECIMALS = re.compile(rb"^ *(?:10|11|20|21)\r?\n *[-+]?[0-9]*\.([0-9]+(?:[eE][-+0-9]+)?)", re.MULTILINE)
#: The group code of comments, which may stand before the first section.
_COMMENT = b"999"


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format.

    That is the mark of a binary file, or a section after comments at most.
    """
    if head.startswith(BINARY_MARK):
        return True
    lines = iter(head.removeprefix(b"\xef\xbb\xbf").splitlines())
    for line in lines:
        code = line.strip()
        if code == _COMMENT:
            next(lines, None)
        elif code:
            return code == b"0" and next(filter(None, map(bytes.strip, lines)), b"") == b"SECTION"
    return False


def from_file(
    file: str | os.PathLike[str],
    *,
    tolerance: float | str | None = None,
    layer: str | Sequence[str] | None = None,
    units: str | None = None,
    hidden: bool = False,
    repair: bool = False,
) -> Contents:
    """Read the paths in a drawing.

    Parameters
    ----------
    file : path
        The file.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm. By default ends join that are as far apart as the last
        decimal of the file's numbers allows.
    layer : str or sequence of str, optional
        Reads these layers only, shown or not: a list, or names between commas.
    units : str, optional
        Overrules those of the header.
    hidden : bool, optional
        Whether what the drawing does not show is read, too: layers off or frozen, invisible, paper space.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.

    Returns
    -------
    Contents
        Paths in the order of the file, mm, and its units.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    drawing = Drawing(file, tolerance, repair, layer, hidden)
    content = drawing.file.read_bytes()
    header, entities, fault = read_sections(content)
    if "ENTITIES" not in entities:
        raise InputError("has no section ENTITIES; is the file complete, and is it a drawing?")
    if fault:
        drawing.fault(fault, "")
    name = _unit(header, drawing) if units is None else units
    scale = known_units.parse(f"1{name}", "length")
    drawing.written(max(map(len, _DECIMALS.findall(content)), default=0), scale)
    reader = EntityReader(drawing)
    reader.read_blocks(entities.get("BLOCKS", []))
    layers = [reader.understood(entity) for entity in entities.get("TABLES", []) if entity.kind == "LAYER"]
    for each in layers:
        state = "frozen" if each.is_frozen() else "off" if each.is_off() else ""
        reader.states[each.dxf.get("name", "").casefold()] = state
        reader.line_types[each.dxf.get("name", "").casefold()] = each.dxf.get("linetype", "").casefold()
    reader.dashed = {dashed_type(each) for each in entities.get("TABLES", [])} - {""}
    reader.read(entities["ENTITIES"], None if scale == 1.0 else (np.diag([scale] * 3), np.zeros(3)))
    drawing.check_layers([*(each.dxf.get("name", "") for each in layers), *reader.seen_layers], "layer")
    return drawing.contents(name)


def _unit(header: Mapping[str, object], drawing: Drawing) -> str:
    number, measurement = (str(header.get(name, "")).strip() for name in ("$INSUNITS", "$MEASUREMENT"))
    if number in ("", "0"):
        hint = " ($MEASUREMENT says inch: if so, give units in)" if measurement == "0" else ""
        drawing.findings.append(f"the drawing has no units; read as mm{hint}")
    elif number not in INSERT_UNITS:
        raise InputError(f"$INSUNITS is {number[:40]}, not a unit of workpieces; give units")
    return INSERT_UNITS.get(number, "mm")


# --- out --------------------------------------------------------------------------------------------------------------


def write(paths: Sequence[Path], target: str | os.PathLike[str]) -> list[str]:
    """Write paths to a drawing, each on a layer of its name; coordinates keep every digit.

    Parameters
    ----------
    paths : sequence of Path
        Contours, mm.
    target : path
        The file.

    Returns
    -------
    list of str
        What DXF has no place for: rotary axes, feeds, markers.
    """
    document = new("R2000")
    document.units = _MILLIMETRES
    document.header["$MEASUREMENT"] = 1
    for path in paths:
        layer = _NOT_IN_NAMES.sub("_", path.name)[:_LONGEST_NAME].strip() or "0"
        if layer not in document.layers:
            document.layers.add(layer)
        for curve in path.curves:
            _add(document.modelspace(), curve, path, {"layer": layer})
    with atomic_write(target) as temporary, temporary.open("w", encoding="utf-8", newline="\r\n") as stream:
        document.write(stream)
    return losses(paths, "DXF")


def _add(space: Any, curve: NurbsCurve, path: Path, attributes: dict[str, str]) -> None:
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
    center, radius, start, sweep = circle or ((0.0, 0.0), 0.0, 0.0, 0.0)
    middle = (*center, float(points[0, 2]))
    if sweep >= 2.0 * math.pi and start == 0.0:
        space.add_circle(middle, radius, attributes)
        return
    if 0.0 < sweep < 2.0 * math.pi:
        space.add_arc(middle, radius, math.degrees(start), math.degrees(start + sweep), dxfattribs=attributes)
        return
    spline = space.add_spline(degree=curve.degree, dxfattribs=attributes)
    spline.control_points = points
    spline.knots = curve.knots
    spline.weights = () if curve.weights is None else curve.weights
    spline.dxf.flags |= int(curve.closed)

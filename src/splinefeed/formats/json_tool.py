"""Tool paths as JSON: a curve of the tool tip, and the tool axis over the same parameters.

A curve is an object with `degree`, `knots` and `tool_tip` (rows of x, y, z), `weights` if it is rational, and one of

    second_point_on_tool_axis   rows of x, y, z: the tool axis runs from the tip to it
    tool_axis_vectors           rows of a vector from the tip to the spindle, of any length
    rotary_angles               rows of the rotary joints of a machine, deg

which has the degree, knots and weights of the tip unless `axis_degree`, `axis_knots` and `axis_weights` stand there.
None of the three is an upright tool. What a program says of a curve stands beside it, as `json_program` has it. Several
curves stand in a list under "curves". `rotary_axes` names the joints of the angles, such as ["a", "c"] (those of the
machine, in order, if it is left out), `tool_length` is that of the tool, in place of the machine's. `unit` or `units`
(mm, cm, m, in), `name`; `source`, `notes`, `tool_axis` are for people; `limits` is not read: limits of a machine are
said where it is chosen.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats import json_program
from splinefeed.formats.json_values import anything, listed, names, number, numbers, or_none, points, text, unit, whole
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.geometry.tool_path import ANGLES, POINTS, VECTORS, ToolPath, beside
from splinefeed.records import ROTARY_AXES

#: The keys of each kind of tool axis.
KINDS = {"second_point_on_tool_axis": POINTS, "tool_axis_vectors": VECTORS, "rotary_angles": ANGLES}
_NEEDED = ("degree", "knots", "tool_tip")
_SHARED = {
    "name": text,
    **dict.fromkeys(("unit", "units"), or_none(unit)),
    **dict.fromkeys(("source", "notes", "tool_axis", "limits"), anything),
    "rotary_axes": names,
    "tool_length": or_none(number),
}
_CURVE = {
    **dict.fromkeys(("degree", "axis_degree"), whole),
    **dict.fromkeys(("knots", "axis_knots"), numbers),
    **dict.fromkeys(("weights", "axis_weights"), or_none(numbers)),
    **dict.fromkeys(("tool_tip", *KINDS), points),
    **json_program.KEYS,
}


def holds(document: dict[str, Any]) -> bool:
    """Whether a document is a tool path."""
    listed = document.get("curves")
    first = listed[0] if isinstance(listed, list) and listed else document
    return isinstance(first, dict) and "tool_tip" in first


def from_document(document: dict[str, Any], source: str | os.PathLike[str], tolerance: float) -> list[Path]:
    """The tool path in a document of the file `source`; FormatError names what is wrong and its place."""
    shared, items = listed(document, f"{source}", _SHARED, _CURVE, _NEEDED)
    findings = []
    scale = shared.get("units", shared.get("unit"))
    if scale is None:
        findings.append("no units are given; read as mm")
        scale = 1.0
    if "limits" in document:
        findings.append("limits in the file are not read; give those of the machine")
    rotary = shared.get("rotary_axes", [])
    if any(axis not in ROTARY_AXES for axis in rotary):
        raise FormatError(f"{source}: rotary_axes: expected a list of {', '.join(ROTARY_AXES)}")
    made = [_curve(item, place, scale) for place, item in items]
    kinds = {kind for _, _, kind in made}
    if len(kinds) > 1:
        raise FormatError(f"{source}: curves: not all give their tool axis alike; choose one of {', '.join(KINDS)}")
    length = shared.get("tool_length")
    said: dict[str, Any] = {
        "name": shared.get("name") or pathlib.Path(source).stem,
        "findings": tuple(findings),
        "tolerance": tolerance,
        **json_program.path_arguments([(item, scale) for _, item in items], source),
        "rotary": rotary,
        "tool_length": None if length is None else scale * length,
    }
    kind = kinds.pop()
    if kind is not None:
        said |= {"axis": [axis for _, axis, _ in made], "kind": kind}
    return [ToolPath([tip for tip, _, _ in made], **said)]


def _curve(item: dict[str, Any], place: str, scale: float) -> tuple[NurbsCurve, NurbsCurve | None, str | None]:
    """Tip, tool axis and its kind of one curve."""
    given = [key for key in KINDS if key in item]
    if len(given) > 1:
        raise FormatError(f"{place}: {given[0]} and {given[1]} are both given; leave one of them out")
    tip = _nurbs(item, "tool_tip", place, scale)
    if not given:
        return tip, None, None
    kind = KINDS[given[0]]
    factor = scale if kind == POINTS else np.pi / 180.0 if kind == ANGLES else 1.0
    own = {**item, **{key: item.get(f"axis_{key}", item.get(key)) for key in ("degree", "knots", "weights")}}
    return tip, _nurbs(own, given[0], place, factor), kind


def _nurbs(item: dict[str, Any], key: str, place: str, factor: float) -> NurbsCurve:
    rows = factor * item[key]
    # a tool axis may stay where it is, which no curve may: it is checked as one that does not
    still = key != "tool_tip" and bool(np.all(rows == rows[0]))
    moved = rows + np.arange(len(rows))[:, None] if still else rows
    try:
        curve = NurbsCurve(item["degree"], item["knots"], moved, item.get("weights"))
        return beside(curve, rows) if still else curve
    except CurveError as error:
        raise FormatError(f"{place}: {key}: {error}") from None


def to_document(path: ToolPath) -> dict[str, Any]:
    """What a file of this tool path holds; it reads back as the same path."""
    key = next(key for key, kind in KINDS.items() if kind == path.kind)
    factor = 180.0 / np.pi if path.kind == ANGLES else 1.0
    axes: Sequence[NurbsCurve | None] = path.tool_axis or [None] * len(path.curves)
    curves = []
    for i, (tip, axis) in enumerate(zip(path.curves, axes, strict=True)):
        one: dict[str, Any] = {**json_program.written(path, i), "degree": tip.degree, "knots": tip.knots.tolist()}
        if tip.weights is not None:
            one["weights"] = tip.weights.tolist()
        one["tool_tip"] = tip.control_points.tolist()
        if axis is not None:
            one[key] = (factor * axis.control_points).tolist()
            one |= {"axis_degree": axis.degree, "axis_knots": axis.knots.tolist()}
            one["axis_weights"] = None if axis.weights is None else axis.weights.tolist()
        curves.append(one)
    shared: dict[str, Any] = {"name": path.name, "units": "mm"}
    shared |= {"rotary_axes": list(path.rotary)} if path.rotary else {}
    shared |= {} if path.tool_length is None else {"tool_length": path.tool_length}
    return {**shared, **curves[0]} if len(curves) == 1 else {**shared, "curves": curves}

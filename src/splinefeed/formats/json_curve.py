"""NURBS curves as JSON: one curve, or a list under "curves"; strict, so that a slip of the pen is not cut into metal.

A curve is an object with `degree`, `knots`, `control_points` and, if rational, `weights`; `name`, `units` (mm, cm, m,
in) and `axes` may stand in it or above the list. Rotary axes are in degrees. `source`, `notes` and `ground_truth` are
for people and not read. Feeds, tolerances and markers of a program stand beside the curves, as `json_program` says.
"""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from splinefeed import units
from splinefeed.errors import CurveError, FormatError
from splinefeed.formats import json_program, json_tool
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.json_values import anything, listed, names, numbers, or_none, parse, points, text, unit, whole
from splinefeed.formats.metadata import to_degrees, to_radians
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.formats.source import head_text
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import DEFAULT_AXES, JOIN_TOLERANCE, Path
from splinefeed.geometry.tool_path import ToolPath
from splinefeed.records import ROTARY_AXES

_SHARED = {
    "name": text,
    "units": or_none(unit),
    "axes": names,
    **dict.fromkeys(("source", "notes", "ground_truth"), anything),
}
_NEEDED = ("degree", "knots", "control_points")


_CURVE = {
    "degree": whole,
    "knots": numbers,
    "control_points": points,
    "weights": or_none(numbers),
    **_SHARED,
    **json_program.KEYS,
}


class _Entry(NamedTuple):
    name: str
    curve: NurbsCurve
    axes: tuple[str, ...]
    said: dict[str, Any]
    scale: float | None


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format."""
    return head_text(head).lstrip()[:1] in ("{", "[")


def from_text(text: str, source: str | os.PathLike[str], *, tolerance: float | str = JOIN_TOLERANCE) -> list[Path]:
    """The paths in `text` of the file `source`; curves whose ends meet within `tolerance`, mm, make one path."""
    allowed = units.parse(tolerance, "length")
    document = parse(text, source)
    if isinstance(document, list):
        document = {"curves": document}
    if not isinstance(document, dict):
        raise FormatError(f'{source}: is a {type(document).__name__}; expected an object with "degree" or "curves"')
    if json_tool.holds(document):
        return json_tool.from_document(document, source, allowed)
    shared, items = listed(document, f"{source}", _SHARED, _CURVE, _NEEDED)
    entries = [_entry(item, shared, place) for place, item in items]
    silent = any(entry.scale is None for entry in entries)
    findings = ("no units are given; read as mm",) if silent else ()
    return _joined(entries, shared.get("name") or pathlib.Path(source).stem, findings, allowed, source)


def write(paths: Sequence[Path], target: str | os.PathLike[str]) -> list[str]:
    """Write the curves of `paths` to the file `target`; coordinates of linear axes come back bit for bit."""
    with atomic_write(target) as temporary:
        temporary.write_text(to_text(paths), encoding="utf-8")
    return []


def to_text(paths: Sequence[Path]) -> str:
    """The text of a file with the curves of `paths`."""
    if len(paths) == 1 and isinstance(paths[0], ToolPath):
        return json.dumps(json_tool.to_document(paths[0]), allow_nan=False) + "\n"
    several = len(paths) > 1
    curves = [
        {
            **({"name": path.name, "axes": path.axes} if several else {}),
            "degree": curve.degree,
            "knots": curve.knots.tolist(),
            **({} if curve.weights is None else {"weights": curve.weights.tolist()}),
            "control_points": to_degrees(curve.control_points, path.axes).tolist(),
            **json_program.written(path, i),
        }
        for path in paths
        for i, curve in enumerate(path.curves)
    ]
    shared = {"units": "mm"} if several else {"name": paths[0].name, "units": "mm", "axes": paths[0].axes}
    document = {**shared, **curves[0]} if len(curves) == 1 else {**shared, "curves": curves}
    return json.dumps(document, allow_nan=False) + "\n"


def _entry(said: dict[str, Any], shared: dict[str, Any], place: str) -> _Entry:
    """One curve; what it does not say itself is `shared` by all."""
    axes = _axes(said.get("axes", shared.get("axes")), said["control_points"].shape[1], f"{place}: axes")
    scale = said.get("units", shared.get("units"))
    net = to_radians(said["control_points"], axes)
    net[:, [axis not in ROTARY_AXES for axis in axes]] *= scale or 1.0
    if np.max(np.abs(net)) > MAX_COORDINATE:
        row = int(np.argmax(np.max(np.abs(net), axis=1)))
        raise FormatError(f"{place}: control_points[{row}]: is beyond {MAX_COORDINATE:g} mm; check the units")
    try:
        curve = NurbsCurve(said["degree"], said["knots"], net, said.get("weights"))
    except CurveError as error:
        raise FormatError(f"{place}: {error}") from None
    return _Entry(said.get("name", ""), curve, axes, said, scale)


def _axes(axes: list[str] | None, count: int, place: str) -> tuple[str, ...]:
    if axes is None:
        axes = list(DEFAULT_AXES[:count])
    if len(axes) != count:
        raise FormatError(f"{place}: has {len(axes)} names for control points of {count} columns; give one for each")
    return tuple(axes)


def _joined(
    entries: list[_Entry], name: str, findings: tuple[str, ...], tolerance: float, source: str | os.PathLike[str]
) -> list[Path]:
    """Paths of neighbouring curves whose ends meet; a lone path has the file's `name`, others their first curve's."""
    groups: list[list[_Entry]] = []
    for entry in entries:
        before = groups[-1][-1] if groups else None
        if before is not None and before.axes == entry.axes and _gap(before.curve, entry.curve) <= tolerance:
            groups[-1].append(entry)
        else:
            groups.append([entry])
    titles = [name] if len(groups) == 1 else [group[0].name or f"{name}#{i}" for i, group in enumerate(groups, start=1)]
    return [
        Path(
            [entry.curve for entry in group],
            group[0].axes,
            name=title,
            findings=findings,
            tolerance=tolerance,
            **json_program.path_arguments([(entry.said, entry.scale or 1.0) for entry in group], source),
        )
        for group, title in zip(groups, titles, strict=True)
    ]


def _gap(before: NurbsCurve, after: NurbsCurve) -> float:
    return float(np.linalg.norm(after(after.domain[0]) - before(before.domain[1])))

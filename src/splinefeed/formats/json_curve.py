"""NURBS curves as JSON: one curve, or a list under "curves"; strict, so that a slip of the pen is not cut into metal.

A curve is an object with `degree`, `knots`, `control_points` and, if rational, `weights`; `name`, `units` (mm, cm, m,
in) and `axes` may stand in it or above the list. Rotary axes are in degrees. `source`, `notes` and `ground_truth` are
for people and not read. What geomdl and verb write is read too; see `json_dialects`. Feeds, tolerances and markers of a
program stand beside the curves, as `json_program` says.
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
from splinefeed.formats import json_dialects, json_program, json_tool
from splinefeed.formats import json_values as values
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.metadata import to_degrees, to_radians
from splinefeed.formats.sizes import MAX_COORDINATE, MAX_CURVES, MAX_POINTS
from splinefeed.formats.source import head_text
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import DEFAULT_AXES, JOIN_TOLERANCE, Path
from splinefeed.geometry.tool_path import ToolPath
from splinefeed.records import ROTARY_AXES

_FOR_PEOPLE = {"source", "notes", "ground_truth"}
_SHARED = {"name", "units", "axes"}
_CURVE = {"degree", "knots", "control_points", "weights"}


class _Entry(NamedTuple):
    name: str
    curve: NurbsCurve
    axes: tuple[str, ...]
    said: json_program.Said = json_program.Said()


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format."""
    return head_text(head).lstrip()[:1] in ("{", "[")


def from_text(text: str, source: str | os.PathLike[str], *, tolerance: float | str = JOIN_TOLERANCE) -> list[Path]:
    """The paths in `text` of the file `source`; curves whose ends meet within `tolerance`, mm, make one path."""
    allowed = units.parse(tolerance, "length")
    document = _parse(text, source)
    if json_tool.holds(document):
        return json_tool.from_document(document, source, allowed)
    findings: list[str] = []
    translated = json_dialects.items(document, source, findings)
    if translated is not None:
        listed, places = translated
        document = {}
    elif "curves" in document:
        values.check_keys(document, {"curves"} | _SHARED | _FOR_PEOPLE, source)
        listed = document["curves"]
        if not isinstance(listed, list) or not listed:
            raise FormatError(f"{source}: curves: is not a list of curves")
        places = [f"{source}: curves[{i}]" for i in range(len(listed))]
    else:
        listed, places = [document], [f"{source}"]
    if len(listed) > MAX_CURVES:
        raise FormatError(f"{source}: curves: has {len(listed)} entries; at most {MAX_CURVES} can be read")
    _check_size(listed, source)
    entries = [_entry(item, document, place, findings) for item, place in zip(listed, places, strict=True)]
    return _joined(
        entries, values.name(document, source) or pathlib.Path(source).stem, tuple(findings), allowed, source
    )


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


def _parse(text: str, source: str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON object in `text`, refusing what Python's reader lets through: NaN, infinities, and a key said twice."""

    def refuse_constant(token: str) -> None:
        raise FormatError(f"{source}: {token} is not a number that a curve can have")

    def refuse_twice(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        unique = dict(pairs)
        if len(unique) < len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for key in keys if keys.count(key) > 1)
            raise FormatError(f"{source}: key {values.shown(twice)} appears twice in one object; leave one of them out")
        return unique

    try:
        document = json.loads(text, parse_constant=refuse_constant, object_pairs_hook=refuse_twice)
    except FormatError:
        raise
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise FormatError(f"{source}: {place}: {error.msg}; is the file complete, and is it JSON?") from None
    except RecursionError:
        raise FormatError(f"{source}: is nested too deeply to be a curve") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise FormatError(f"{source}: {str(error).split(';')[0]}") from None
    if isinstance(document, list):
        document = {"curves": document}
    if not isinstance(document, dict):
        raise FormatError(f'{source}: is a {type(document).__name__}; expected an object with "degree" or "curves"')
    return document


def _check_size(listed: list[Any], source: str | os.PathLike[str]) -> None:
    count = 0
    for item in listed:
        points = item.get("control_points") if isinstance(item, dict) else None
        count += len(points) if isinstance(points, list) else 0
    if count > MAX_POINTS:
        raise FormatError(f"{source}: control_points: there are {count}; at most {MAX_POINTS} can be read")


def _entry(item: object, document: dict[str, Any], place: str, findings: list[str]) -> _Entry:
    """One curve; what it does not say itself stands in the `document` above it."""
    if not isinstance(item, dict):
        raise FormatError(f"{place}: is not an object with the keys of a curve")
    values.check_keys(item, _CURVE | _SHARED | _FOR_PEOPLE | json_program.KEYS, place)
    for key in ("degree", "knots", "control_points"):
        if key not in item:
            raise FormatError(f"{place}: {key} is missing; a curve needs degree, knots and control_points")
    degree = values.degree(item, f"{place}: ")
    points = values.points(item["control_points"], f"{place}: control_points")
    axes = _axes(item.get("axes", document.get("axes")), points.shape[1], f"{place}: axes")
    points = to_radians(points, axes)
    linear = [axis not in ROTARY_AXES for axis in axes]
    scale = values.scale(item.get("units", document.get("units")), f"{place}: units", findings)
    points[:, linear] *= scale
    if np.max(np.abs(points)) > MAX_COORDINATE:
        row = int(np.argmax(np.max(np.abs(points), axis=1)))
        raise FormatError(f"{place}: control_points[{row}]: is beyond {MAX_COORDINATE:g} mm; check the units")
    weights = None if item.get("weights") is None else values.numbers(item["weights"], f"{place}: weights")
    name = values.name(item, place)
    try:
        curve = NurbsCurve(degree, values.numbers(item["knots"], f"{place}: knots"), points, weights)
    except CurveError as error:
        raise FormatError(f"{place}: {error}") from None
    return _Entry(name, curve, axes, json_program.read(item, place, scale))


def _axes(axes: object, count: int, place: str) -> tuple[str, ...]:
    if axes is None and count <= len(DEFAULT_AXES):
        return DEFAULT_AXES[:count]
    if axes is None:
        raise FormatError(f"{place}: missing; control points of {count} columns need a name for each")
    if not isinstance(axes, list) or not all(isinstance(axis, str) for axis in axes):
        raise FormatError(f"{place}: is not a list of names")
    if len(axes) != count:
        raise FormatError(f"{place}: has {len(axes)} names for control points of {count} columns")
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
    names = [name] if len(groups) == 1 else [group[0].name or f"{name}#{i}" for i, group in enumerate(groups, start=1)]
    return [
        Path(
            [entry.curve for entry in group],
            group[0].axes,
            name=title,
            findings=findings,
            tolerance=tolerance,
            **json_program.path_arguments([entry.said for entry in group], source),
        )
        for group, title in zip(groups, names, strict=True)
    ]


def _gap(before: NurbsCurve, after: NurbsCurve) -> float:
    return float(np.linalg.norm(after(after.domain[0]) - before(before.domain[1])))

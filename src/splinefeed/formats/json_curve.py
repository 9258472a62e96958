"""NURBS curves and tool paths as JSON: one, or a list under "curves"; strict, so that no slip of the pen becomes metal.

A curve is an object with `degree`, `knots`, `control_points` and, if rational, `weights`; `name`, `units` (mm, cm, m,
in) and `axes` may stand in it or above the list. Rotary axes are in degrees. A curve of a tool path has `tool_tip` in
place of the control points, and one of KINDS (docs/how-to/five-axis.md), whose curve has the degree, knots and weights
of the tip unless `axis_degree`, `axis_knots` and `axis_weights` stand there; without any the tool is upright. `source`,
`notes`, `ground_truth` and `tool_axis` are for people and not read; `limits` are those of the machine.

What a program says stands in the curve: `feed` (units a second, or "rapid"), `tolerance` (units; 0 is exact, "free"
sets no bound), `before` and, behind the last curve, `after`: lists of markers {"text": "M3 S12000", "dwell": s,
"stop": true}.
"""

from __future__ import annotations

import json
import math
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from splinefeed import units
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, FormatError, InputError
from splinefeed.files import json_values as values
from splinefeed.files.atomic import write_text
from splinefeed.files.metadata import to_degrees, to_radians
from splinefeed.files.sizes import MAX_COORDINATE
from splinefeed.files.source import head_text
from splinefeed.paths.each_curve import Marker, default_axes
from splinefeed.paths.path import JOIN_TOLERANCE, Path
from splinefeed.paths.tool_path import ANGLES, POINTS, VECTORS, ToolPath, beside
from splinefeed.records import ROTARY_AXES, Array

#: The keys of each kind of tool axis.
KINDS = {"second_point_on_tool_axis": POINTS, "tool_axis_vectors": VECTORS, "rotary_angles": ANGLES}
#: Most markers at one place.
MAX_MARKERS = 1000
_RAPID, _FREE = "rapid", "free"
_NO_UNITS = "no units are given; read as mm"


#: What the motion of an arm says, and no curve.
MOTIONS = {"waypoints", "along"}


def _bound(unbounded: str, least: str, holds: Callable[[float], bool]) -> values.Check:
    def check(value: Any, place: str) -> float:
        if value is None or value == unbounded:
            return math.inf
        if not (holds(values.number(value, place)) and value < 1e30):
            raise FormatError(f'{place}: expected a number, {least}, or "{unbounded}"')
        return float(value)

    return check


def _marker(item: Any, place: str) -> Marker:
    said = values.fields(item, place, {"text": values.text, "dwell": values.number, "stop": values.truth})
    if "\n" in said.get("text", ""):
        raise FormatError(f"{place}: text: must be one line")
    try:
        return Marker(0, said.get("text", ""), float(said.get("dwell", 0.0)), said.get("stop", True))
    except InputError as error:
        raise FormatError(f"{place}: {error}") from None


_NURBS = {"degree": values.whole, "knots": values.numbers, "weights": values.or_none(values.numbers)}
_PROGRAM: dict[str, values.Check] = {
    "feed": _bound(_RAPID, "greater than 0", lambda value: value > 0.0),
    "tolerance": _bound(_FREE, "0 or more", lambda value: value >= 0.0),
    **dict.fromkeys(("before", "after"), values.each(_marker, "markers", MAX_MARKERS)),
}
_SHARED = {
    "name": values.text,
    "units": values.or_none(values.unit),
    "axes": values.names,
    **dict.fromkeys(("source", "notes", "ground_truth"), values.anything),
}
_CURVE = {**_NURBS, "control_points": values.points, **_SHARED, **_PROGRAM}
_SHARED_BY_TIPS = {
    "name": values.text,
    **dict.fromkeys(("unit", "units"), values.or_none(values.unit)),
    **dict.fromkeys(("source", "notes", "tool_axis", "limits"), values.anything),
    "rotary_axes": values.names,
    "tool_length": values.or_none(values.number),
}
_TIP = {
    **_NURBS,
    **{f"axis_{key}": check for key, check in _NURBS.items()},
    **dict.fromkeys(("tool_tip", *KINDS), values.points),
    **_PROGRAM,
}


class _Entry(NamedTuple):
    name: str
    curve: NurbsCurve
    axes: tuple[str, ...]
    said: dict[str, Any]
    scale: float | None


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format."""
    return head_text(head).lstrip()[:1] in ("{", "[")


def from_text(text: str, source: str | os.PathLike[str], *, tolerance: float | str = JOIN_TOLERANCE) -> list[Path]:
    """Read the paths in the text of a file of JSON curves.

    Parameters
    ----------
    text : str
        Of the file.
    source : path
        The file, for messages.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm.

    Returns
    -------
    list of Path
        mm, rotary axes rad.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    allowed = units.parse(tolerance, "length")
    document = values.parse(text, source)
    if isinstance(document, list):
        document = {"curves": document}
    if not isinstance(document, dict):
        raise FormatError(f'{source}: is a {type(document).__name__}; expected an object with "degree" or "curves"')
    curves = document.get("curves")
    first = curves[0] if isinstance(curves, list) and curves else document
    read = _tool_path if isinstance(first, dict) and "tool_tip" in first else _paths
    return read(document, source, allowed)


def _paths(document: dict[str, Any], source: str | os.PathLike[str], tolerance: float) -> list[Path]:
    """Paths of neighbouring curves whose ends meet; a lone path has the file's name, others their first curve's."""
    if document.keys() & MOTIONS:
        raise FormatError(
            f"{source}: is a motion of an arm, which its URDF belongs to: splinefeed run {os.path.basename(source)} "
            "--robot ROBOT.urdf; in the studio drop the URDF first"
        )
    shared, items = values.listed(document, f"{source}", _SHARED, _CURVE, ("degree", "knots", "control_points"))
    entries = [_entry(item, shared, place) for place, item in items]
    findings = [_NO_UNITS] if any(entry.scale is None for entry in entries) else []
    groups: list[list[_Entry]] = []
    for entry in entries:
        before = groups[-1][-1] if groups else None
        gap = math.inf
        if before is not None and before.axes == entry.axes:
            gap = float(np.linalg.norm(entry.curve.ends[0] - before.curve.ends[1]))
        if gap <= tolerance:
            groups[-1].append(entry)
        else:
            groups.append([entry])
    name = shared.get("name") or pathlib.Path(source).stem
    titles = [name] if len(groups) == 1 else [group[0].name or f"{name}#{i}" for i, group in enumerate(groups, start=1)]
    return [
        Path(
            [entry.curve for entry in group],
            group[0].axes,
            name=title,
            findings=findings,
            tolerance=tolerance,
            **_program([(entry.said, entry.scale or 1.0) for entry in group], source),
        )
        for group, title in zip(groups, titles, strict=True)
    ]


def _entry(said: dict[str, Any], shared: dict[str, Any], place: str) -> _Entry:
    """One curve; what it does not say itself is `shared` by all."""
    count = said["control_points"].shape[1]
    axes = tuple(said.get("axes", shared.get("axes", default_axes(count))))
    if len(axes) != count:
        raise FormatError(
            f"{place}: axes: has {len(axes)} names for control points of {count} columns; give one for each"
        )
    scale = said.get("units", shared.get("units"))
    net = to_radians(said["control_points"], axes)
    net[:, [axis not in ROTARY_AXES for axis in axes]] *= scale or 1.0
    return _Entry(said.get("name", ""), _nurbs(said, "control_points", net, place), axes, said, scale)


def _nurbs(said: Mapping[str, Any], key: str, rows: Array, place: str) -> NurbsCurve:
    """The curve through `rows` (n, axes), mm and rad, of the `key` at a place."""
    far = np.max(np.abs(rows), axis=1) > MAX_COORDINATE
    if np.any(far) and KINDS.get(key) != VECTORS:
        raise FormatError(f"{place}: {key}[{np.argmax(far)}]: is beyond {MAX_COORDINATE:g} mm; check the units")
    # a tool axis may stay where it is, which no curve may: it is checked as one that does not
    still = key in KINDS and bool(np.all(rows == rows[0]))
    moved = rows + np.arange(len(rows))[:, None] if still else rows
    try:
        curve = NurbsCurve(said["degree"], said["knots"], moved, said.get("weights"))
        return beside(curve, rows) if still else curve
    except CurveError as error:
        raise FormatError(f"{place}: {f'{key}: ' * (key != 'control_points')}{error}") from None


def _tool_path(document: dict[str, Any], source: str | os.PathLike[str], tolerance: float) -> list[Path]:
    shared, items = values.listed(document, f"{source}", _SHARED_BY_TIPS, _TIP, ("degree", "knots", "tool_tip"))
    scale = shared.get("units", shared.get("unit"))
    findings = [_NO_UNITS] if scale is None else []
    findings += ["limits in the file are not read; give those of the machine"] if "limits" in shared else []
    scale = scale or 1.0
    rotary = shared.get("rotary_axes", [])
    if any(axis not in ROTARY_AXES for axis in rotary):
        raise FormatError(f"{source}: rotary_axes: expected a list of {', '.join(ROTARY_AXES)}")
    tips, tool_axes, keys = [], [], set()
    for place, item in items:
        given = [key for key in KINDS if key in item]
        if len(given) > 1:
            raise FormatError(f"{place}: {given[0]} and {given[1]} are both given; leave one of them out")
        keys.add("".join(given))
        tips.append(_nurbs(item, "tool_tip", scale * item["tool_tip"], place))
        for key in given:
            factor = {POINTS: scale, VECTORS: 1.0, ANGLES: np.pi / 180.0}[KINDS[key]]
            own = {name: item.get(f"axis_{name}", item.get(name)) for name in _NURBS}
            tool_axes.append(_nurbs(own, key, factor * item[key], place))
    if len(keys) > 1:
        raise FormatError(f"{source}: curves: not all give their tool axis alike; choose one of {', '.join(KINDS)}")
    length = shared.get("tool_length")
    path = ToolPath(
        tips,
        tool_axes or None,
        kind=KINDS.get(keys.pop(), POINTS),
        rotary=rotary,
        tool_length=None if length is None else scale * length,
        name=shared.get("name") or pathlib.Path(source).stem,
        findings=findings,
        tolerance=tolerance,
        **_program([(item, scale) for _, item in items], source),
    )
    return [path]


def _program(curves: Sequence[tuple[Mapping[str, Any], float]], source: object) -> dict[str, Any]:
    """`feeds`, `tolerances` and `markers` of a `Path` of curves, each its checked keys and mm of one unit."""
    arguments: dict[str, Any] = {}
    for key, name in (("feed", "feeds"), ("tolerance", "tolerances")):
        missing = [i for i, (said, _) in enumerate(curves) if key not in said]
        if not missing:
            arguments[name] = [scale * said[key] for said, scale in curves]
        elif len(missing) < len(curves):
            raise FormatError(
                f"{source}: curve {missing[0]} of a path has no {key}, but others have; give all of them one"
            )
    arguments["markers"] = [
        replace(marker, before=place)
        for i, (said, _) in enumerate(curves)
        for key, place in (("before", i), ("after", i + 1))
        for marker in said.get(key, ())
    ]
    return arguments


# --- out --------------------------------------------------------------------------------------------------------------


def write(paths: Sequence[Path], target: str | os.PathLike[str]) -> list[str]:
    """Write curves to a file; coordinates of linear axes come back bit for bit.

    Parameters
    ----------
    paths : sequence of Path
        Contours, mm.
    target : path
        The file.

    Returns
    -------
    list of str
        Empty: the format holds all of a path.
    """
    write_text(target, to_text(paths))
    return []


def to_text(paths: Sequence[Path]) -> str:
    """Return the text of a file with the curves of `paths`."""
    first, several = paths[0], len(paths) > 1
    tool: Any = first if first.needs_machine else None
    shared: dict[str, Any] = {"units": "mm"} if several else {"name": first.name, "units": "mm"}
    if several or tool is None:
        shared |= {} if several else {"axes": first.axes}
        curves = [
            {**({"name": path.name, "axes": path.axes} if several else {}), **_written(path, i)}
            for path in paths
            for i in range(len(path.curves))
        ]
    else:
        shared |= {"rotary_axes": tool.rotary} if tool.rotary else {}
        shared |= {} if tool.tool_length is None else {"tool_length": tool.tool_length}
        curves = [_written_tip(tool, i) for i in range(len(first.curves))]
    document = {**shared, **curves[0]} if len(curves) == 1 else {**shared, "curves": curves}
    return json.dumps(document, allow_nan=False) + "\n"


def _written(path: Path, i: int, key: str = "control_points") -> dict[str, Any]:
    """What a file says of curve `i` of `path`."""
    said = {**_shape(path.curves[i]), key: to_degrees(path.curves[i].control_points, path.axes).tolist()}
    for name, said_of, unbounded in (("feed", path.feeds, _RAPID), ("tolerance", path.tolerances, _FREE)):
        if said_of is not None:
            said[name] = float(said_of[i]) if math.isfinite(said_of[i]) else unbounded
    places = {"before": i, "after": len(path.curves)} if i == len(path.curves) - 1 else {"before": i}
    for name, place in places.items():
        markers = [
            {"text": marker.text, "dwell": marker.dwell, "stop": marker.stop}
            for marker in path.markers
            if marker.before == place
        ]
        said |= {name: markers} if markers else {}
    return said


def _written_tip(path: ToolPath, i: int) -> dict[str, Any]:
    said = _written(path, i, "tool_tip")
    if path.tool_axis is not None:
        axis = path.tool_axis[i]
        rows = np.rad2deg(axis.control_points) if path.kind == ANGLES else axis.control_points
        said |= {next(key for key, kind in KINDS.items() if kind == path.kind): rows.tolist()}
        said |= {f"axis_{name}": value for name, value in {"weights": None, **_shape(axis)}.items()}
    return said


def _shape(curve: NurbsCurve) -> dict[str, Any]:
    weights = {} if curve.weights is None else {"weights": curve.weights.tolist()}
    return {"degree": curve.degree, "knots": curve.knots.tolist(), **weights}

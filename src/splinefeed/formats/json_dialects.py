"""Curves as other libraries write them in JSON, in the words of our own schema: geomdl's export and verb's data.

geomdl: {"shape": {"type": "curve", "count", "data": [{"degree", "knotvector", "control_points": {"points",
"weights"}}]}}.
verb: {"degree", "knots", "controlPoints"}, alone, in a list, or in a list under "curves". Points of four numbers are
weighted, (w x, w y, w z, w), as verb keeps them; beside `weights` they are plain. Neither says units or axes.
"""

from __future__ import annotations

import os
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats.json_values import check_keys

#: What geomdl says of a curve beside its shape; none of it changes a point, and `reversed` is refused where it is true.
_GEOMDL = {"type", "rational", "dimension", "degree", "knotvector", "control_points", "delta", "name", "id", "reversed"}
_VERB = {"degree", "knots", "controlPoints", "weights", "name", "units"}


def items(
    document: dict[str, Any], source: str | os.PathLike[str], findings: list[str]
) -> tuple[list[Any], list[str]] | None:
    """The curves of `document` as objects of our schema, and the place of each; None if it is of no other library."""
    if "shape" in document:
        return _of_geomdl(document, f"{source}")
    several = document.get("curves")
    listed = several if isinstance(several, list) else [document]
    if not any(isinstance(item, dict) and "controlPoints" in item for item in listed):
        return None
    places = [f"{source}: curves[{i}]" for i in range(len(listed))] if listed is several else [f"{source}"]
    return [_of_verb(item, place, findings) for item, place in zip(listed, places, strict=True)], places


def _of_geomdl(document: dict[str, Any], place: str) -> tuple[list[Any], list[str]]:
    shape = document["shape"]
    if not isinstance(shape, dict) or not isinstance(shape.get("data"), list) or not shape["data"]:
        raise FormatError(f"{place}: shape: is no export of geomdl, with type, count and data")
    check_keys(document, {"shape"}, place)
    check_keys(shape, {"type", "count", "data"}, f"{place}: shape")
    if shape.get("type") != "curve":
        raise FormatError(f"{place}: shape.type: is {shape.get('type')!r:.40}; a curve is needed")
    data = shape["data"]
    if shape.get("count", len(data)) != len(data):
        raise FormatError(f"{place}: shape.count: says {shape['count']!r:.40}, but data has {len(data)}")
    places = [f"{place}: shape.data[{i}]" for i in range(len(data))]
    return [_geomdl_curve(item, at) for item, at in zip(data, places, strict=True)], places


def _geomdl_curve(item: object, place: str) -> dict[str, Any]:
    if not isinstance(item, dict):
        raise FormatError(f"{place}: is not an object with the keys of a curve")
    check_keys(item, _GEOMDL, place)
    for key in ("degree", "knotvector", "control_points"):
        if key not in item:
            raise FormatError(f"{place}: {key} is missing; a curve needs degree, knotvector and control_points")
    if item.get("type", "spline") != "spline":
        raise FormatError(f"{place}: type: is {item['type']!r:.40}; a spline is needed")
    if item.get("reversed"):
        raise FormatError(f"{place}: reversed: is true, as for the trim of a surface; a curve in space is needed")
    net = item["control_points"]
    if not isinstance(net, dict) or "points" not in net:
        raise FormatError(f"{place}: control_points: has no points")
    check_keys(net, {"points", "weights"}, f"{place}: control_points")
    points, weights = net["points"], net.get("weights")
    if item.get("rational") is True and weights is None:
        raise FormatError(f"{place}: control_points: has no weights, but the curve is rational")
    width = len(points[0]) if isinstance(points, list) and points and isinstance(points[0], list) else None
    if "dimension" in item and width is not None and item["dimension"] != width:
        raise FormatError(f"{place}: dimension: says {item['dimension']!r:.40}, but points have {width} numbers")
    name = {"name": item["name"]} if item.get("name") else {}
    return {"degree": item["degree"], "knots": item["knotvector"], "control_points": points, "weights": weights} | name


def _of_verb(item: object, place: str, findings: list[str]) -> dict[str, Any]:
    if not isinstance(item, dict) or "controlPoints" not in item:
        raise FormatError(f"{place}: controlPoints is missing; a curve needs degree, knots and controlPoints")
    check_keys(item, _VERB, place)
    points, weights = item["controlPoints"], item.get("weights")
    plain = {key: item[key] for key in ("degree", "knots", "name", "units") if key in item}
    width = len(points[0]) if isinstance(points, list) and points and isinstance(points[0], list) else 0
    if width == 4 and weights is not None:
        raise FormatError(f"{place}: controlPoints: have weights of their own beside weights; leave one of them out")
    if width == 4:
        points, weights = _unweighted(points, f"{place}: controlPoints")
    elif width == 3 and weights is None:
        finding = "controlPoints have three numbers and no weights; read as x, y, z"
        if finding not in findings:
            findings.append(finding)
    return {**plain, "control_points": points, "weights": weights}


def _unweighted(points: list[Any], place: str) -> tuple[list[list[float]], list[float]]:
    """Points (x, y, z) and weights of points (w x, w y, w z, w)."""
    plain, weights = [], []
    for i, point in enumerate(points):
        if not isinstance(point, list) or len(point) != 4:
            raise FormatError(f"{place}[{i}]: expected 4 numbers as in the first point")
        if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in point):
            raise FormatError(f"{place}[{i}]: holds something other than numbers")
        try:
            plain.append([value / point[3] for value in point[:3]])
        except (ZeroDivisionError, OverflowError):
            raise FormatError(f"{place}[{i}]: has the weight {point[3]!r:.40}; it must be greater than 0") from None
        weights.append(point[3])
    return plain, weights

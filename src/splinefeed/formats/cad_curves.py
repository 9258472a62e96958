"""Curves of the descriptions that `cad_worker` gives of what stands in CAD files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.geometry.arcs import arc
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.editing import clamped, split, unbroken
from splinefeed.records import Array

#: An end of an edge this near to an end of its curve, mm, is that end: edges are cut by points that are rounded.
SAME_END = 1e-7
#: Arcs shorter than this, mm, have no length.
SHORTEST = 1e-9
#: A cut this near to a knot, relative to the domain, is at the knot.
SAME_KNOT = 1e-12


def curves_of(said: dict[str, Any]) -> list[NurbsCurve]:
    """The curve that the worker describes, in mm; none if it has no length, its pieces where it may jump at knots.

    Lines are of degree 1, arcs of circles and ellipses as `arcs.arc` makes them, arcs of hyperbolas one rational and
    arcs of parabolas one polynomial span of degree 2, B-splines keep degree, knots, points and weights.
    Raises CurveError for what cannot be a curve.
    """
    made = {"line": _line, "arc": _arc, "hyperbola": _hyperbola, "parabola": _parabola}.get(said["type"])
    curves = _nurbs(said) if made is None else [curve for curve in (made(said),) if curve is not None]
    for curve in curves:
        if not np.all(np.abs(curve.control_points) <= MAX_COORDINATE):
            raise CurveError(f"a control point is beyond {MAX_COORDINATE:g} mm; check the units")
    return [curve.reversed() for curve in reversed(curves)] if said["reversed"] else curves


def _line(said: dict[str, Any]) -> NurbsCurve | None:
    begin, end = said["points"]
    return None if begin == end else NurbsCurve.bezier([begin, end])


def _vectors(said: dict[str, Any]) -> tuple[Array, Array, Array]:
    center, x, y = (np.array(said[name], dtype=np.float64) for name in ("center", "x", "y"))
    if not np.all(np.abs([center, x, y]) <= MAX_COORDINATE):
        raise CurveError(f"a conic reaches beyond {MAX_COORDINATE:g} mm; check the units")
    return center, x, y


def _arc(said: dict[str, Any]) -> NurbsCurve | None:
    center, x, y = _vectors(said)
    start, sweep = said["first"], said["last"] - said["first"]
    if abs(sweep) > 2.0 * math.pi:
        sweep = math.copysign(2.0 * math.pi, sweep)
    if abs(sweep) * float(np.max(np.abs([x, y]))) <= SHORTEST:
        return None
    return arc(center, x, y, start, sweep)


def _hyperbola(said: dict[str, Any]) -> NurbsCurve | None:
    """center + x cosh t + y sinh t: weights 1, cosh(half the width), 1 (The NURBS Book, 2nd ed., section 7.4)."""
    center, x, y = _vectors(said)
    first, last = said["first"], said["last"]
    if first == last or max(abs(first), abs(last)) > 50.0:
        return None
    middle, weight = 0.5 * (first + last), math.cosh(0.5 * (last - first))
    ends = [center + math.cosh(t) * x + math.sinh(t) * y for t in (first, last)]
    shoulder = center + (math.cosh(middle) * x + math.sinh(middle) * y) / weight
    return NurbsCurve.bezier([ends[0], shoulder, ends[1]], [1.0, weight, 1.0])


def _parabola(said: dict[str, Any]) -> NurbsCurve | None:
    """center + t^2 x + t y."""
    center, x, y = _vectors(said)
    a, b = said["first"], said["last"]
    if a == b:
        return None
    return NurbsCurve.bezier([center + u * v * x + 0.5 * (u + v) * y for u, v in ((a, a), (a, b), (b, b))])


def _nurbs(said: dict[str, Any]) -> list[NurbsCurve]:
    points = np.array(said["points"], dtype=np.float64)
    if np.all(points == points[0]):
        return []
    # the first and the last knot touch no point of the domain; OCCT moves them where it made a closed curve periodic
    knots = np.array([said["knots"][1], *said["knots"][1:-1], said["knots"][-2]])
    weights = None if said["weights"] is None else np.array(said["weights"], dtype=np.float64)
    found = []
    for part in unbroken(said["degree"], knots, points, weights):
        if np.any(part[1] != part[1][0]):
            curve = _trimmed(NurbsCurve(said["degree"], *part), said["first"], said["last"])
            found += [] if curve is None else [curve]
    return found


def _trimmed(curve: NurbsCurve, begin: float, end: float) -> NurbsCurve | None:
    """The part of `curve` from `begin` to `end`; None if there is none."""
    low, high = curve.domain
    if begin <= low and high <= end:
        return curve if curve.clamped else clamped(curve)
    first, last = (_at_knot(curve, float(np.clip(u, low, high))) for u in (begin, end))
    if not first < last:
        return None
    places = curve(np.array([low, first, last, high]))
    if np.linalg.norm(places[1] - places[0]) <= SAME_END and _short(curve, low, first):
        first = low
    if np.linalg.norm(places[3] - places[2]) <= SAME_END and _short(curve, last, high):
        last = high
    cuts = [cut for cut in (first, last) if low < cut < high]
    if cuts:
        return split(curve, *cuts)[int(first > low)]
    return curve if curve.clamped else clamped(curve)


def _at_knot(curve: NurbsCurve, u: float) -> float:
    nearest = float(curve.breaks[np.argmin(np.abs(curve.breaks - u))])
    return nearest if abs(nearest - u) <= SAME_KNOT * (curve.domain[1] - curve.domain[0]) else u


def _short(curve: NurbsCurve, low: float, high: float) -> bool:
    """Whether the stretch from low to high is a point: near ends of a closed curve may be a whole turn apart."""
    places = curve(np.linspace(low, high, 9))
    return bool(np.max(np.linalg.norm(places - places[0], axis=1)) <= SAME_END)

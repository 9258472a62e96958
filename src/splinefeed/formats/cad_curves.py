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

#: An end of an edge this near to an end of its curve, mm, is that end: edges are cut by points that are rounded.
SAME_END = 1e-7
#: Arcs shorter than this, mm, have no length.
SHORTEST = 1e-9
#: A cut this near to a knot, relative to the domain, is at the knot.
SAME_KNOT = 1e-12


def curves_of(said: dict[str, Any]) -> list[NurbsCurve]:
    """The curve that the worker describes, in mm; none if it has no length, its pieces where it may jump at knots.

    Arcs of circles and ellipses are as `arcs.arc` makes them, B-splines keep degree, knots, points and weights.
    Raises CurveError for what cannot be a curve.
    """
    curves = _arc(said) if said["type"] == "arc" else _nurbs(said)
    for curve in curves:
        _check_near(curve.control_points)
    return [curve.reversed() for curve in reversed(curves)] if said["reversed"] else curves


def _check_near(places: Any) -> None:
    if not np.all(np.abs(places) <= MAX_COORDINATE):
        raise CurveError(f"a control point is beyond {MAX_COORDINATE:g} mm; check the units")


def _arc(said: dict[str, Any]) -> list[NurbsCurve]:
    center, x, y = (np.array(said[name], dtype=np.float64) for name in ("center", "x", "y"))
    _check_near([center, x, y])
    sweep = float(np.clip(said["last"] - said["first"], -2.0 * math.pi, 2.0 * math.pi))
    if abs(sweep) * float(np.max(np.abs([x, y]))) <= SHORTEST:
        return []
    return [arc(center, x, y, said["first"], sweep)]


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

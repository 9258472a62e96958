"""SPLINE entities of DXF: NURBS as they are, and splines that are given by points to run through alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.formats.dxf_tags import Entity, Faults
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.geometry.arcs import polyline
from splinefeed.geometry.curve import MAX_DEGREE, NurbsCurve
from splinefeed.geometry.editing import unbroken
from splinefeed.records import Array

#: Knots closer than this share of the whole range are one: CAD writes them apart by rounding.
SAME_KNOT = 1e-12
#: A spline that says it is closed may end this far, in its own size, from where it begins before that is a finding.
CLOSED_SLACK = 1e-9


def curves(reader: Faults, entity: Entity, spline: Any) -> list[NurbsCurve]:
    """The curves of a SPLINE or HELIX, `spline`, as ezdxf loads it."""
    control, fit = (np.array(each.values).reshape(-1, 3) for each in (spline.control_points, spline.fit_points))
    knots, weights = np.array(spline.knots), np.array(spline.weights)
    for name, values in (("control point", control), ("fit point", fit), ("knot", knots), ("weight", weights)):
        if not np.isfinite(values).all():
            raise reader.error(entity, f"has a {name} that is not finite")
    if len(control):
        made = _nurbs(reader, entity, spline.dxf.degree, knots, control, weights)
    else:
        made = _through(reader, entity, spline, fit)
    if spline.closed and made and np.linalg.norm(made[0].ends[0] - made[-1].ends[1]) > CLOSED_SLACK * made[0].size:
        reader.notes["open"] += 1
    return made


def _nurbs(
    reader: Faults, entity: Entity, degree: int, knots: Array, control: Array, weights: Array
) -> list[NurbsCurve]:
    if not len(knots) and 1 <= degree < len(control):
        reader.faulty(entity, "has no knots")
        knots = np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, len(control) - degree + 1), np.ones(degree)])
    if 1 <= degree < len(control) and len(knots) == len(control) + degree - 1:
        reader.faulty(entity, "has no first and last knot, which Rhino leaves out")
        knots = np.concatenate([knots[:1], knots, knots[-1:]])
    if len(knots) > 1:
        knots = _without_rounding(reader, knots)
    if len(weights) and len(weights) != len(control):
        raise CurveError(f"{len(weights)} weights (group 41) for {len(control)} control points; expected one each")
    if not len(weights) and _plainly_right(degree, knots, control):
        for array in (knots, control):
            array.setflags(write=False)
        start, end = knots[1] == knots[degree] < knots[degree + 1], knots[-degree - 2] < knots[-degree - 1] == knots[-2]
        return [NurbsCurve.trusted(degree, knots, control, clamped=bool(start and end))]
    parts = unbroken(degree, knots, control, weights if len(weights) else None)
    if len(parts) > 1:
        reader.notes["broken"] += 1
        parts = [part for part in parts if np.any(part[1] != part[1][0])]
    return [NurbsCurve(degree, *part) for part in parts]


def _plainly_right(degree: int, knots: Array, control: Array) -> bool:
    """Whether `NurbsCurve` takes a polynomial curve, by fewer questions than its own; if not, it decides."""
    count = len(control)
    if not (1 <= degree <= MAX_DEGREE and degree < count and len(knots) == count + degree + 1):
        return False
    steps = knots[1:] - knots[:-1]
    return bool(
        np.abs(knots).max() < 1.0 / SAME_KNOT
        and steps.min() >= 0.0
        # equal ones were made equal before, so that a step that is not 0 is wide enough
        and (steps[degree:-degree].max() > 0.0)
        and (knots[degree + 1 : -1] > knots[1 : -degree - 1]).all()
        and knots[-1] - knots[0] > 0.01 * np.abs(knots).max()
        and np.abs(control).max() <= MAX_COORDINATE
        and (control != control[0]).any()
        and np.abs(control - control[0]).max() > 1.0 / MAX_COORDINATE
    )


def _without_rounding(reader: Faults, knots: Array) -> Array:
    """Knots that differ by no more than rounding made equal."""
    steps = np.abs(knots[1:] - knots[:-1])
    small = (steps != 0.0) & (steps <= SAME_KNOT * abs(knots[-1] - knots[0]))
    if not small.any():
        return knots
    reader.notes["knots"] += int(small.sum())
    even = knots.copy()
    for i in np.flatnonzero(small) + 1:
        even[i] = even[i - 1]
    return even


def _through(reader: Faults, entity: Entity, spline: Any, fit: Array) -> list[NurbsCurve]:
    """The cubic through fit points by chord length, with the tangents given or natural ends; periodic if closed."""
    from scipy.interpolate import make_interp_spline

    if len(fit):
        fit = np.concatenate([fit[:1], fit[1:][np.any(fit[1:] != fit[:-1], axis=1)]])
    if len(fit) < 2:
        raise reader.error(entity, "has no control points and no two different fit points")
    reader.notes["fit"] += 1
    if spline.dxf.flags & (spline.CLOSED | spline.PERIODIC) and len(fit) > 2:
        around = fit if np.array_equal(fit[0], fit[-1]) else np.concatenate([fit, fit[:1]])
        made = make_interp_spline(_chords(around), around, k=3, bc_type="periodic")
        return [NurbsCurve(3, made.t, made.c).with_clamped_ends()]
    tangents = [spline.dxf.get(name) for name in ("start_tangent", "end_tangent")]
    if len(fit) == 2 and tangents == [None, None]:
        return [polyline(fit)]
    ends = [[(2, np.zeros(3))] if each is None else [(1, np.array(each.normalize().xyz))] for each in tangents]
    made = make_interp_spline(_chords(fit), fit, k=3, bc_type=(ends[0], ends[1]))
    return [NurbsCurve(3, made.t, made.c)]


def _chords(points: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])

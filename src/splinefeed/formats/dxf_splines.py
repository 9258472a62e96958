"""SPLINE entities of DXF: NURBS as they are, and splines that are given by points to run through alone."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.formats.dxf_tags import Entity
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.geometry.arcs import moved, polyline
from splinefeed.geometry.curve import MAX_DEGREE, NurbsCurve
from splinefeed.geometry.editing import unbroken
from splinefeed.records import Array

if TYPE_CHECKING:
    from splinefeed.formats.dxf_entities import EntityReader

#: Knots closer than this share of the whole range are one: CAD writes them apart by rounding.
SAME_KNOT = 1e-12
#: A spline that says it is closed may end this far, in its own size, from where it begins before that is a finding.
CLOSED_SLACK = 1e-9
_CLOSED, _PERIODIC = 1, 2
_NO_POINTS = np.empty((0, 3))


def curves(reader: EntityReader, entity: Entity, matrix: Array, offset: Array) -> list[NurbsCurve]:
    """The curves of a SPLINE or HELIX, placed by `matrix` and `offset`."""
    columns: dict[int, list[str | float]] = defaultdict(list)
    tags = reader.tags
    high = entity.high
    if entity.kind == "HELIX":  # what follows its spline describes the helix in its own words
        high = next((i for i in range(entity.low, high) if tags.codes[i] == 100 and tags.text(i) == "AcDbHelix"), high)
    for code, value in zip(tags.codes[entity.low : high], tags.values[entity.low : high], strict=True):
        columns[code].append(value)
    flags, degree = (int(_single(reader, entity, columns, code, default)) for code, default in ((70, 0.0), (71, 3.0)))
    control, fit = (_points(reader, entity, columns, code, what) for code, what in ((10, "control"), (11, "fit")))
    knots, weights = (np.array(reader.numbers(entity, code, columns[code])) for code in (40, 41))
    for code, count, what in ((72, len(knots), "knots"), (73, len(control), "control points"), (74, len(fit), "fit")):
        said = _single(reader, entity, columns, code, float(count))
        if said != count and not (what == "fit" and len(control)):
            _faulty(reader, entity, f"says {said:g} {what}, but {count} follow")
    try:
        if not len(control):
            made = _through(reader, entity, columns, fit, closed=bool(flags & (_CLOSED | _PERIODIC)))
        else:
            made = _nurbs(reader, entity, degree, knots, control, weights)
    except CurveError as error:
        raise tags.error(entity.low - 1, f"{entity.kind}: {error}") from None
    if flags & _CLOSED and made and np.linalg.norm(made[0].ends[0] - made[-1].ends[1]) > CLOSED_SLACK * made[0].size:
        reader.notes["open"] += 1
    return [moved(curve, matrix, offset) for curve in made]


def _nurbs(
    reader: EntityReader, entity: Entity, degree: int, knots: Array, control: Array, weights: Array
) -> list[NurbsCurve]:
    if not len(knots) and 1 <= degree < len(control):
        _faulty(reader, entity, "has no knots")
        knots = np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, len(control) - degree + 1), np.ones(degree)])
    if 1 <= degree < len(control) and len(knots) == len(control) + degree - 1:
        _faulty(reader, entity, "has no first and last knot, which Rhino leaves out")
        knots = np.concatenate([knots[:1], knots, knots[-1:]])
    if len(knots) > 1:
        knots = _without_rounding(reader, knots)
    if len(weights) and len(weights) != len(control):
        raise CurveError(f"{len(weights)} weights (group 41) for {len(control)} control points; one each is needed")
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
    """Whether `NurbsCurve` takes a polynomial curve, told by fewer questions than it asks; if not, it decides."""
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


def _without_rounding(reader: EntityReader, knots: Array) -> Array:
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


def _through(
    reader: EntityReader, entity: Entity, columns: dict[int, list[str | float]], fit: Array, closed: bool
) -> list[NurbsCurve]:
    """The cubic through fit points by chord length, with the tangents given or natural ends; periodic if closed."""
    from scipy.interpolate import make_interp_spline

    if len(fit):
        fit = np.concatenate([fit[:1], fit[1:][np.any(fit[1:] != fit[:-1], axis=1)]])
    if len(fit) < 2:
        raise reader.tags.error(entity.low - 1, f"{entity.kind}: has no control points and no two different fit points")
    reader.notes["fit"] += 1
    tangents = [_points(reader, entity, columns, code, "tangent") for code in (12, 13)]
    if closed and len(fit) > 2:
        around = fit if np.array_equal(fit[0], fit[-1]) else np.concatenate([fit, fit[:1]])
        u = _chords(around)
        spline = make_interp_spline(u, around, k=3, bc_type="periodic")
        return [NurbsCurve(3, spline.t, spline.c).with_clamped_ends()]
    if len(fit) == 2 and not any(len(tangent) for tangent in tangents):
        return [polyline(fit)]
    u = _chords(fit)
    ends = [
        [(1, tangent[0] / np.linalg.norm(tangent[0]))] if len(tangent) and np.any(tangent[0]) else [(2, np.zeros(3))]
        for tangent in tangents
    ]
    spline = make_interp_spline(u, fit, k=3, bc_type=(ends[0], ends[1]))
    return [NurbsCurve(3, spline.t, spline.c)]


def _chords(points: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _points(reader: EntityReader, entity: Entity, columns: dict[int, list[str | float]], code: int, what: str) -> Array:
    """Points (n, 3) from three group codes; z may be left out of all."""
    if code not in columns and code + 10 not in columns:
        return _NO_POINTS
    x, y, z = (reader.numbers(entity, each, columns[each]) for each in (code, code + 10, code + 20))
    if len(x) != len(y) or (z and len(z) != len(x)):
        raise reader.tags.error(
            entity.low - 1, f"{entity.kind}: {what} points have {len(x)} x, {len(y)} y and {len(z)} z"
        )
    return np.array([x, y, z or [0.0] * len(x)]).T.copy()


def _single(
    reader: EntityReader, entity: Entity, columns: dict[int, list[str | float]], code: int, default: float
) -> float:
    return reader.finite(entity, code, columns[code][0]) if columns[code] else default


def _faulty(reader: EntityReader, entity: Entity, text: str) -> None:
    """An error, or when repairing a finding."""
    if not reader.repair:
        raise reader.tags.error(entity.low - 1, f"{entity.kind}: {text}")
    reader.drawing.findings.append(f"{reader.tags.place(entity.low - 1)}: {entity.kind} {text}; read as it is")

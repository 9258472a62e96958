"""Curves of STEP and IGES that OCCT would take for others without a word: mended in its model, or said to be wrong.

Its shapes hold no inner knot of a multiplicity above the degree p. Where the control points that meet there are one
point, the same curve has the knot p times; where they are not, the curve jumps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import accumulate, groupby
from typing import Any

#: Resolution below which an IGES file's word for it is not believed, units of the file: what ten digits are worth.
LEAST_RESOLUTION = 1e-6
_SPLIT_IT = "which OCCT cannot hold; let the CAD system split it there"


def mend_step(model: Any) -> list[str]:
    """Mend the B-splines of a STEP model; why those that jump cannot be.

    None is closed for OCCT from here on: it makes such curves periodic and drops the last weight. Their points stay.
    """
    from OCP.StepData import StepData_LFalse

    faults = []
    for number in range(1, model.NbEntities() + 1):
        curve = model.Value(number)
        if not type(curve).__name__.startswith("StepGeom_BSplineCurveWithKnots"):
            continue
        rational = hasattr(curve, "WeightsData")
        knots = curve.BSplineCurveWithKnots() if rational else curve
        parts = [curve, knots, curve.RationalBSplineCurve()] if rational else [curve]  # each holds the points again
        for part in parts:
            part.SetClosedCurve(StepData_LFalse)
        times = [knots.KnotMultiplicitiesValue(i) for i in range(1, knots.NbKnotMultiplicities() + 1)]
        joints = list(_joints(curve.Degree(), times))
        if not joints:
            continue
        poles = [curve.ControlPointsListValue(i) for i in range(1, curve.NbControlPointsList() + 1)]
        weights = [curve.WeightsDataValue(i) for i in range(1, curve.NbWeightsData() + 1)] if rational else []
        places = [[pole.CoordinatesValue(i) for i in range(1, pole.NbCoordinates() + 1)] for pole in poles]
        fits = len(poles) == sum(times) - curve.Degree() - 1 and len(weights) in (0, len(poles))
        why = "has a number of control points or weights that does not fit its knots" if not fits else ""
        for i, before, after in reversed(joints):
            why = why or _apart([places[before], places[after]], 0.0, weights[before : after + 1 : after - before])
            if why:
                faults.append(f"entity {number}: a B-spline has an inner knot {times[i]} times and {why}, {_SPLIT_IT}")
                break
            times[i] = curve.Degree()
            del poles[before + 1 : after + 1], weights[before + 1 : after + 1]
        else:
            for part in parts:
                part.SetControlPointsList(_array(curve.ControlPointsList(), poles))
            knots.SetKnotMultiplicities(_array(knots.KnotMultiplicities(), times))
            if rational:
                parts[-1].SetWeightsData(_array(curve.WeightsData(), weights))
    return faults


def check_iges(model: Any) -> list[str]:
    """Which arcs (100) do not end on the circle that they begin on, and which B-splines (126) jump.

    OCCT moves both. The error that a file allows itself is the resolution in its section G.
    """
    allowed = max(model.GlobalSection().Resolution(), LEAST_RESOLUTION)
    faults = []
    for number in range(1, model.NbEntities() + 1):
        curve = model.Entity(number)
        kind, label = type(curve).__name__, f"entity D{model.DNum(curve)}"
        if kind == "IGESGeom_CircularArc":
            begin, end = (curve.Center().Distance(point) for point in (curve.StartPoint(), curve.EndPoint()))
            if not (begin > 0.0 and abs(end - begin) <= allowed):
                faults.append(
                    f"{label}: an arc begins with radius {begin:.9g} and ends with {end:.9g}; "
                    f"{abs(end - begin):.3g} apart, and {allowed:.3g} is the resolution of the file"
                )
        elif kind == "IGESGeom_BSplineCurve":
            degree = curve.Degree()
            knots = [curve.Knot(i) for i in range(-degree, curve.NbKnots() - degree)]
            times = [len(list(run)) for _, run in groupby(knots)]
            for i, before, after in _joints(degree, times):
                met = range(before, after + 1)
                places = [[*(curve.Pole(k).Coord(axis) for axis in (1, 2, 3))] for k in met]
                why = _apart(places, allowed, [curve.Weight(k) for k in met])
                if why:
                    faults.append(f"{label}: a B-spline has an inner knot {times[i]} times and {why}, {_SPLIT_IT}")
    return faults


def _joints(degree: int, times: Sequence[int]) -> Iterator[tuple[int, int, int]]:
    """Each inner knot of multiplicity above the degree p: its place in `times`, and the control points that meet there.

    The curve ends on the one before the first of the equal knots and goes on from the one before the last p + 1.
    """
    for i, end in enumerate(accumulate(times)):
        if 0 < i < len(times) - 1 and times[i] > degree:
            yield i, end - times[i] - 1, end - degree - 1


def _apart(places: Sequence[Sequence[float]], allowed: float, weights: Sequence[float]) -> str:
    """Why a curve does not go on at the first of `places` where it ended; empty if it does."""
    gap = max(math.dist(places[0], place) for place in places[1:])
    if not gap <= allowed:
        return f"jumps there by {gap:.3g}"
    return "changes its weight there" if len(set(weights)) > 1 else ""


def _array(like: Any, values: Sequence[Any]) -> Any:
    """An array of OCCT of the same type as `like`, whose name differs between versions."""
    made = type(like)(1, len(values))
    for i, value in enumerate(values, start=1):
        made.SetValue(i, value)
    return made

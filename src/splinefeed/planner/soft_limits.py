"""Soft limits: whether a path stays within the travel of every axis, and where it leaves it."""

from __future__ import annotations

import numpy as np

from splinefeed.curves.differential import extremes
from splinefeed.errors import LimitsError
from splinefeed.paths.path import Path
from splinefeed.planner.constants import KEPT
from splinefeed.records import ROTARY_AXES, Limits, unit_along, unit_of_axis

#: How the message begins that says each value in its own unit.
GOES = "the path goes to"


def check_travel(path: Path, limits: Limits) -> None:
    """Raise LimitsError where `path` leaves the travel of an axis: which, how far, and at what place on the path.

    The box of a curve's control points may show that it stays inside; else its own extremes count.
    """
    travel = limits.travel_of(path.axes)
    if not travel:
        return
    columns = [path.axes.index(axis) for axis in travel]
    ends = np.array(list(travel.values()))
    middle, half = ends.mean(axis=1), 0.5 * np.ptp(ends, axis=1) * (1.0 + KEPT)
    for index, curve in enumerate(path.curves):
        if np.all(np.abs(curve.control_points[:, columns] - middle) <= half):
            continue
        u = extremes(curve)
        points = curve(u)[:, columns]
        low, high = points.min(axis=0), points.max(axis=0)
        outside = (low < middle - half) | (high > middle + half)
        if not np.any(outside):
            continue
        k = int(np.argmax(outside))
        upwards = bool(high[k] - middle[k] >= middle[k] - low[k])
        position = float(high[k] if upwards else low[k])
        furthest = u[np.argmax(points[:, k] if upwards else -points[:, k])]
        s = float(path.tip_length(path.arc_length(index, furthest)))
        axis = path.axes[columns[k]]
        unit, factor = unit_of_axis(axis), np.degrees(1.0) if axis in ROTARY_AXES else 1.0
        side = "most" if upwards else "least"
        raise LimitsError(
            f"{GOES} {axis} = {factor * position:.6g} {unit} at s = {s:.6g} {unit_along(path.axes)} (curve {index}); "
            f"its travel allows at {side} {factor * ends[k, int(upwards)]:.6g} {unit}; "
            "move the path or widen the travel"
        )

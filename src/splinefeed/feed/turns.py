"""Rotary axes that turn on where the linear ones stand still: no law s(t) can hold their limits there."""

from __future__ import annotations

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.geometry.path import Path
from splinefeed.kernels.pieces import START, point, turns
from splinefeed.records import Array, Limits

#: The linear axes stand still at a speed below this share of the size of their curve; a rotary one turns above that.
STANDING, TURNING = 1e-6, 1e-6
#: A piece of the path below this share of its length is not told from a place.
SAME = 1e-12


def check_turns(path: Path, marks: Array, limits: Limits) -> None:
    """Raise PlanError where the linear axes stand still while a limited rotary axis turns on.

    They stand at a rest (m,), mm, where C' = 0, and on a row of the path that is not told from a place on it.
    """
    rotary = np.zeros(len(path.axes), dtype=bool)
    for name in ("axis_velocity", "axis_acceleration", "axis_jerk"):
        rotary |= np.isfinite(limits.of_axes(name, path.axes))
    rotary[: path.linear] = False
    if not np.any(rotary):
        return
    for s in marks.tolist():
        curve, u = path.locate(np.array([s]))
        here = path.curves[int(curve[0])]
        d = path.evaluate(curve, u, 1)[0, 1]
        moved = float(np.linalg.norm(np.ptp(here.control_points[:, : path.linear], axis=0)))
        size = moved / (here.domain[1] - here.domain[0])
        if moved > 0.0 and np.linalg.norm(d[: path.linear]) <= STANDING * size and np.linalg.norm(d[rotary]) > TURNING:
            axis = path.axes[int(np.argmax(np.where(rotary, np.abs(d), 0.0)))]
            raise PlanError(
                f"at s = {s:.6g} mm the linear axes stand still while {axis} turns on; its limits cannot be held by a "
                "motion along the path: smooth or split it there, or leave the limits of that axis out"
            )
    ends = np.empty((2, len(path.axes)))
    for row in np.flatnonzero(np.diff(np.append(path.table[:, START], path.length)) <= SAME * path.length).tolist():
        if turns(path.table, row, path.shape):
            continue
        point(path.table, row, path.shape, -1.0, ends[0])
        point(path.table, row, path.shape, 1.0, ends[1])
        turned = np.where(rotary, np.abs(ends[1] - ends[0]), 0.0)
        if np.max(turned) > TURNING:
            raise PlanError(
                f"at s = {path.table[row, START]:.6g} mm the linear axes stand still while "
                f"{path.axes[int(np.argmax(turned))]} turns on; its limits cannot be held by a motion along the path: "
                "split it there, let the linear axes stand exactly, or leave the limits of that axis out"
            )

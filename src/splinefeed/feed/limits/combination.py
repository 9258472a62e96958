"""Linear combinations of axes: the motors of a gantry, the motion along a tool axis."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits import axis_acceleration, axis_jerk, axis_velocity
from splinefeed.feed.limits.rows import Places, Row
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """What the limits of an axis are, of w . r in place of r; jumps of the axes count as if none took from another."""
    for name, each in (limits.combinations or {}).items():
        w = each.on(at.axes)
        r = at.d[:, 1:] @ w
        if np.isfinite(each.velocity):
            yield axis_velocity.row(f"combinations.{name}.velocity", r[:, 0], each.velocity)
        if np.isfinite(each.acceleration):
            yield axis_acceleration.row(f"combinations.{name}.acceleration", r[:, 0], r[:, 1], each.acceleration)
        if np.isfinite(each.jerk):
            up, down = np.maximum(w, 0.0), np.maximum(-w, 0.0)
            turn, bend = (np.stack([up @ j[0] + down @ j[1], up @ j[1] + down @ j[0]]) for j in (at.turn, at.bend))
            yield axis_jerk.row(f"combinations.{name}.jerk", at, r, turn, bend, each.jerk)

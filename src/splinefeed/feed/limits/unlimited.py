"""Where only axes without limits of acceleration and jerk move: the least of the other axes' limits along the path."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Jerk, Linear, Places, Row
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|q'/2| <= A and |sqrt(q) q''/2| <= J, of a rotary axis alone in degrees: a feed there cannot change at once."""
    if np.isfinite(limits.acceleration) or np.isfinite(limits.jerk):
        return
    acceleration, jerk = (limits.of_axes(name, at.axes) for name in ("axis_acceleration", "axis_jerk"))
    limited = np.isfinite(acceleration) | np.isfinite(jerk)
    free = np.all(at.d[:, 1, limited] == 0.0, axis=1)
    if np.any(free):
        none, half = np.zeros(len(at.s)), np.where(free, 0.5, 0.0)
        if np.any(np.isfinite(acceleration)):
            yield Linear("axis_acceleration", none, half / np.min(acceleration))
        if np.any(np.isfinite(jerk)):
            yield Jerk("axis_jerk", none, none, half / np.min(jerk))

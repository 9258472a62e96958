"""The acceleration of each axis."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Linear, Places, Row
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|r' q'/2 + r'' q| <= A."""
    for k, limit in enumerate(limits.of_axes("axis_acceleration", at.axes)):
        if np.isfinite(limit):
            yield Linear(f"axis_acceleration.{at.axes[k]}", at.d[:, 2, k] / limit, 0.5 * at.d[:, 1, k] / limit)

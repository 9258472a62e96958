"""The acceleration of each axis."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Linear, Places, Row
from splinefeed.records import Array, Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """The limit of each axis, see `row`."""
    for k, limit in enumerate(limits.of_axes("axis_acceleration", at.axes)):
        if np.isfinite(limit):
            yield row(f"axis_acceleration.{at.axes[k]}", at.d[:, 1, k], at.d[:, 2, k], limit)


def row(name: str, r1: Array, r2: Array, limit: float) -> Row:
    """|r' q'/2 + r'' q| <= A."""
    return Linear(name, r2 / limit, 0.5 * r1 / limit)

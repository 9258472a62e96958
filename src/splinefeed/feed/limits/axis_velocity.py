"""The velocity of each axis."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Array, Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """The limit of each axis, see `row`."""
    for k, limit in enumerate(limits.of_axes("axis_velocity", at.axes)):
        if np.isfinite(limit):
            yield row(f"axis_velocity.{at.axes[k]}", at.d[:, 1, k], limit)


def row(name: str, r1: Array, limit: float) -> Row:
    """|r'| sqrt(q) <= V:  q <= (V / r')^2."""
    with np.errstate(divide="ignore"):
        return Top(name, (limit / r1) ** 2)

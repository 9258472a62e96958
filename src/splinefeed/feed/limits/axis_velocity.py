"""The velocity of each axis."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|r'| sqrt(q) <= V:  q <= (V / r')^2."""
    with np.errstate(divide="ignore"):
        for k, limit in enumerate(limits.of_axes("axis_velocity", at.axes)):
            if np.isfinite(limit):
                yield Top(f"axis_velocity.{at.axes[k]}", (limit / at.d[:, 1, k]) ** 2)

"""The step of velocity at corners that are passed in motion."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """feed |r' behind - r' before| <= the step of each axis: q <= corner^2."""
    if np.any(np.isfinite(at.corner)):
        yield Top("axis_velocity_step", at.corner**2)

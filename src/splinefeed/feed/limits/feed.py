"""The feed along the path: that of the limits, and the lower one that the path asks for."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """q <= feed^2."""
    yield Top("feed", np.minimum(limits.feed, at.feed) ** 2)

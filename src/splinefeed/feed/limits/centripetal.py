"""The centripetal acceleration."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """kappa q <= limit."""
    if limits.centripetal is not None:
        with np.errstate(divide="ignore"):
            yield Top("centripetal", limits.centripetal / at.curvature)

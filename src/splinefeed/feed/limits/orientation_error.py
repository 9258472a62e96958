"""The orientation error: how far the tool axis is off that of the path between two setpoints."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.chord_error import within_reach
from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """(v T)^2 kappa / 8 <= delta, kappa as `JointPath.between_ticks` tells it, wherever within v T."""
    if limits.orientation_error is None or at.period is None or at.axis_chord is None:
        return
    with np.errstate(divide="ignore"):
        step = np.sqrt(8.0 * limits.orientation_error / at.axis_chord)
    yield Top("orientation_error", ((step if at.alone else within_reach(at.s, step)) / at.period) ** 2)

"""Acceleration and deceleration along the path."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Linear, Places, Row
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """-deceleration <= q'/2 <= acceleration."""
    up = limits.acceleration
    down = np.inf if limits.deceleration is None else limits.deceleration
    unit = min(up, down)
    if np.isfinite(unit):
        still, half = np.zeros(len(at.s)), np.full(len(at.s), 0.5 / unit)
        yield Linear("acceleration", still, half, -down / unit, up / unit)

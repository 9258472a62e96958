"""Jerk along the path, while speeding up and while slowing down."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Jerk, Places, Row
from splinefeed.records import Limits


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|sqrt(q) q''/2| <= J, the lower of both limits where it is not known whether the motion speeds up."""
    up = limits.jerk
    down = np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk
    if np.isfinite(min(up, down)):
        limit = np.where(at.rising > 0, up, np.where(at.rising < 0, down, min(up, down)))
        none = np.zeros(len(at.s))
        yield Jerk("jerk", none, none, 0.5 / limit)

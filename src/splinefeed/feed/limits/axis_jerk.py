"""The jerk of each axis, and what jumps of tangent and curvature take of it."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Jerk, Places, Row
from splinefeed.records import Array, Limits

#: By how much jerk gives way beside a jump of the acceleration, in units of the jump over the period.
PEAK = 0.75 * 24.0 / 23.0


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """The limit of each axis, see `row`."""
    for k, limit in enumerate(limits.of_axes("axis_jerk", at.axes)):
        if np.isfinite(limit):
            yield row(f"axis_jerk.{at.axes[k]}", at, at.d[:, 1:, k], at.turn[:, k], at.bend[:, k], limit)


def row(name: str, at: Places, r: Array, turn: Array, bend: Array, limit: float) -> Row:
    """|r' q''/2 + 3/2 r'' q' + r''' q| <= J / sqrt(q), less what the third difference over T sees of a jump.

    A jump D2 of r'' makes the acceleration jump by D2 q, which the third difference of setpoints spreads over three
    periods by the quadratic B-spline K, as D2 q K(t), of peak 3/4 / T. Jerk that gives way by PEAK D2 q / T for one
    period before and behind the jump makes room for it: PEAK times the integral of K over these two periods is at least
    T K at any instant, and equal to it in the middle, 23/24 PEAK = 3/4. A jump D1 of r' makes the velocity jump by
    D1 sqrt(q), which the third difference shows with a peak of D1 sqrt(q) / T^2.

    r (n, 3)  r', r'', r''';  turn, bend (2, n)  jumps of r' and r'' up and down within reach
    """
    period = at.period or np.inf
    taken = zip(turn / (limit * period**2), PEAK * bend / (limit * period), strict=True)
    return Jerk(name, r[:, 2] / limit, 1.5 * r[:, 1] / limit, 0.5 * r[:, 0] / limit, *taken)

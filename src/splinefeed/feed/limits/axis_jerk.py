"""The jerk of each axis, and what jumps of tangent and curvature take of it."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Jerk, Places, Row
from splinefeed.records import Limits

#: By how much jerk gives way beside a jump of the acceleration, in units of the jump over the period.
PEAK = 0.75 * 24.0 / 23.0


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """|r' q''/2 + 3/2 r'' q' + r''' q| <= J / sqrt(q), less what the third difference over T sees of a jump.

    A jump D2 of r'' makes the acceleration jump by D2 q, which the third difference of setpoints spreads over three
    periods by the quadratic B-spline K, as D2 q K(t), of peak 3/4 / T. Jerk that gives way by PEAK D2 q / T for one
    period before and behind the jump makes room for it: PEAK times the integral of K over these two periods is at least
    T K at any instant, and equal to it in the middle, 23/24 PEAK = 3/4. A jump D1 of r' makes the velocity jump by
    D1 sqrt(q), which the third difference shows with a peak of D1 sqrt(q) / T^2.
    """
    r1, r2, r3 = (at.d[:, k] for k in (1, 2, 3))
    for k, limit in enumerate(limits.of_axes("axis_jerk", at.axes)):
        if np.isfinite(limit):
            up = down = None
            if at.period is not None and (np.any(at.bend[:, k]) or np.any(at.turn[:, k])):
                share = PEAK / (limit * at.period)
                up, down = (
                    np.stack([turn / (limit * at.period**2), share * bend])
                    for turn, bend in ((at.turn[0, k], at.bend[0, k]), (at.turn[1, k], at.bend[1, k]))
                )
            name = f"axis_jerk.{at.axes[k]}"
            yield Jerk(name, r3[:, k] / limit, 1.5 * r2[:, k] / limit, 0.5 * r1[:, k] / limit, up, down)

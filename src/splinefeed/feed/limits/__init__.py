"""Every limit as rows on y = (q, q', q''), q = feed^2: one file a limit; a new one is a file and a line in LIMITS.

With r(s) the path by arc length, feed = sqrt(q), s'' = q'/2 and s''' = sqrt(q) q''/2:

    velocity of an axis      r' sqrt(q)
    acceleration             r' q'/2 + r'' q
    jerk                     sqrt(q) (r' q''/2 + 3/2 r'' q' + r''' q)
    torque of a joint        a q'/2 + b q + c
"""

from __future__ import annotations

from splinefeed.feed.limits import (
    axis_acceleration,
    axis_jerk,
    axis_velocity,
    centripetal,
    chord_error,
    combination,
    corner,
    feed,
    orientation_error,
    tangential_acceleration,
    tangential_jerk,
    torque,
    unlimited,
)
from splinefeed.feed.limits.rows import Places, Row, Rows, stacked
from splinefeed.records import Limits

#: What gives the rows of each limit; the order is that of reports.
LIMITS = (
    feed.rows,
    corner.rows,
    axis_velocity.rows,
    centripetal.rows,
    chord_error.rows,
    orientation_error.rows,
    tangential_acceleration.rows,
    axis_acceleration.rows,
    tangential_jerk.rows,
    axis_jerk.rows,
    combination.rows,
    torque.rows,
    unlimited.rows,
)


def rows_at(places: Places, limits: Limits) -> Rows:
    """The rows of all limits at places."""
    return stacked([row for rows in LIMITS for row in rows(places, limits)], len(places.s))


__all__ = ["LIMITS", "Places", "Row", "Rows", "rows_at"]

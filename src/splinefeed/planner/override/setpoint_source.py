"""Setpoints without their path as what an override runs: the cubic B-spline that has the rows as its control points.

Its second derivative goes straight from one second difference of the rows, over T^2, to the next, and its third one is
their third difference over T^3 (The NURBS Book, eq. 3.8): so at 100 % it asks for no more than the rows do. An
interpolating spline asks for up to three times their jerk. What it costs: the axes pass a row at

    (q_{k-1} + 4 q_k + q_{k+1}) / 6 = q_k + T^2 q'' / 6

A / 6 T^2 beside it: 0.08 um at 500 mm/s^2 and 1 ms. The first row and the last are met, one period later than they say.
"""

from __future__ import annotations

import numpy as np

from splinefeed.errors import InputError, LimitsError
from splinefeed.limit_table import PATH, PLACES, TICKS
from splinefeed.planner.override.source import NO_SUMS, with_sums
from splinefeed.records import Array, IntArray, Limits, Setpoints, check_finite

#: Largest step at the ends, in steps of the fastest: more is a motion that does not rest there.
RESTS = 0.1


class SetpointSource:
    """The rows of setpoints by plan time, s.

    Parameters
    ----------
    rows : Setpoints
        What runs; at rest at both ends.
    linear : int
        How many of the axes, which come first, make up the feed.

    Raises
    ------
    InputError
        For fewer than two rows.
    LimitsError
        For rows that begin or end in motion.
    """

    def __init__(self, rows: Setpoints, linear: int) -> None:
        if len(rows) < 2:
            raise InputError("streaming needs at least two setpoints")
        check_finite(rows.position, "Setpoints.position")
        self.axes, self.period, self.linear = rows.axes, rows.period, linear
        self.duration = (len(rows) + 1) * rows.period
        self.begin, self.moving = 0.0, False
        self._q = rows.position
        steps = np.max(np.abs(np.diff(self._q, axis=0)), axis=1)
        if max(steps[0], steps[-1]) > RESTS * float(np.max(steps)):
            raise LimitsError("the setpoints begin or end in motion; a motion with feed hold begins and ends at rest")

    @property
    def beside(self) -> float:
        """How far beside a row the axes pass it at most, mm or rad: the largest second difference by 6."""
        return float(np.max(np.abs(np.diff(self._q, 2, axis=0)), initial=0.0)) / 6.0

    def _pieces(self, piece: IntArray) -> tuple[Array, Array, Array, Array]:
        """Coefficients c_0 ... c_3 of x = tau / T - k in pieces k (n,), each (n, axes), mm or rad."""
        last = len(self._q) - 1
        a, b, c, d = (self._q[np.clip(piece + k, 0, last)] for k in (-2, -1, 0, 1))
        return (a + 4.0 * b + c) / 6.0, 0.5 * (c - a), 0.5 * (a - 2.0 * b + c), (d - a + 3.0 * (b - c)) / 6.0

    def demands(self, first: int, count: int, sums: Array = NO_SUMS) -> Array:
        """As `MotionSource` says; along the path q'' is bounded by that of all linear axes, and q''' is left out."""
        T = self.period
        piece = np.arange(first, first + count)
        c1, c2, c3 = (with_sums(each, sums) for each in self._pieces(piece)[1:])
        # |q'| is largest at an end, or where q'' = 0
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = np.nan_to_num(np.clip(-c2 / (3.0 * c3), 0.0, 1.0))
        velocity = [(c1 + x * (2.0 * c2 + x * 3.0 * c3)) / T for x in (0.0, bend, 1.0)]
        acceleration = [(2.0 * c2 + x * 6.0 * c3) / T**2 for x in (0.0, 1.0)]
        cells = np.zeros((count, 4, c1.shape[1] + 1))
        for order, each in enumerate((velocity, acceleration, [6.0 * c3 / T**3])):
            most = np.max(np.abs(each), axis=0)
            cells[:, order, :-1] = most
            cells[:, order, -1] = np.linalg.norm(most[:, : self.linear], axis=1) if order == 1 else 0.0
        # the feed is that at the ends of a piece: between them it is beyond both by at most q''' T^2 / 8
        ends = [np.linalg.norm(velocity[k][:, : self.linear], axis=1) for k in (0, 2)]
        cells[:, 0, -1] = np.maximum(*ends)
        return cells

    def bend_share(self, limits: Limits) -> float:
        """0, or LimitsError for limits that only a path can hold: along it, on its bends, and between it and chords."""
        given = {name: most for bounds in (PATH, PLACES, TICKS) for name, most in limits.given(bounds).items()}
        for name in [each for each in given if each != "feed"]:
            raise LimitsError(
                f"{name} cannot be held for setpoints without their path; give limits of the axes, such as "
                "axis_acceleration and axis_jerk, or a machine"
            )
        return 0.0

    def positions(self, tau: Array) -> Array:
        """Interpolate positions between rows.

        Parameters
        ----------
        tau : (n,) array
            Plan times, s.

        Returns
        -------
        (n, axes) array
            mm or rad.
        """
        place = np.asarray(tau) / self.period
        piece = np.clip(np.floor(place), 0, len(self._q)).astype(np.int64)
        c0, c1, c2, c3 = self._pieces(piece)
        x = (place - piece)[:, None]
        return c0 + x * (c1 + x * (c2 + x * c3))

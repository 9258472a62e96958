"""What the steps of several methods share: du/dt at a parameter, the first steps, and the pull onto the arc length.

Every method is one function, compiled by Numba:

    step(u, rate, law, period, table, cursor, shape, corrections, tolerance, memory) -> next u

    u, rate      (4,)  the last four parameters and du/dt there, newest first: u[0] = u_k, u[1] = u_{k-1}, ...
    law          (5,)  NEXT_S, FEED, HALF_FEED, NEXT_FEED, ACCELERATION: see below
    period             time from tick k to tick k+1, s
    table, cursor, shape   the curve: handed on to the kernels, never looked into
    corrections, tolerance the user's settings of a predictor-corrector
    memory       (12,) the method's own, all zero at the start of every curve
"""

from __future__ import annotations

import math

from splinefeed.kernels.arc_length import parameter_in_row
from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, START, Shape, speed, walk_to
from splinefeed.records import Array, IntArray

#: Places in `law`: s at tick k+1, mm; feed at tick k, half-way and at k+1, mm/s; acceleration at tick k, mm/s^2.
NEXT_S, FEED, HALF_FEED, NEXT_FEED, ACCELERATION = 0, 1, 2, 3, 4
#: A law that ends nearer to the end of the path than this share of its length ends there: the rounding of its pieces.
AT_END = 64.0 * 2.0**-52


@hot_kernel
def rate_in_row(t: float, feed: float, table: Array, row: int, shape: Shape) -> float:
    """du/dt = V / |C'(u)| at feed V, mm/s, at t of one row: the f of eq. (23) and (24). At rest it is 0."""
    if feed == 0.0:
        return 0.0
    size = speed(table, row, shape, t)
    return feed / size if size > 0.0 else math.inf


@hot_kernel
def rate_at(u: float, feed: float, table: Array, cursor: IntArray, shape: Shape) -> float:
    """du/dt at parameter u: `rate_in_row` in the row that holds it."""
    row = walk_to(table, cursor, u)
    return rate_in_row((u - table[row, MIDDLE]) * table[row, SCALE], feed, table, row, shape)


@hot_kernel
def step_length(law: Array, period: float) -> float:
    """The law's way from tick k to k+1, mm, by Simpson's rule on the feed: exact on pieces of constant jerk."""
    return period / 6.0 * (law[FEED] + 4.0 * law[HALF_FEED] + law[NEXT_FEED])


@hot_kernel
def row_at_length(table: Array, s: float, cursor: IntArray) -> int:
    """The row that holds arc length s, mm, sought from cursor[0] on within cursor[1:3], and left there."""
    row = cursor[0]
    while row < cursor[2] and s >= table[row + 1, START]:
        row += 1
    while row > cursor[1] and s < table[row, START]:
        row -= 1
    cursor[0] = row
    return row


@hot_kernel
def anchored(u: float, s: float, table: Array, cursor: IntArray) -> float:
    """The parameter whose arc length is s, mm: Newton on S(u) = s from the guess u. Leaves its row in cursor[0]."""
    row = row_at_length(table, s, cursor)
    guess = (u - table[row, MIDDLE]) * table[row, SCALE]
    return table[row, MIDDLE] + parameter_in_row(table, row, s, guess) / table[row, SCALE]


@kernel
def placed(u: float, s: float, table: Array, cursor: IntArray) -> float:
    """`anchored` as a call of its own, for what happens once a curve: copies everywhere would take long to compile."""
    return anchored(u, s, table, cursor)


@hot_kernel
def milne_simpson(
    u: Array,
    rate: Array,
    law: Array,
    period: float,
    table: Array,
    cursor: IntArray,
    shape: Shape,
    corrections: int,
    tolerance: float,
) -> float:
    """Milne's predictor and `corrections` passes of Simpson's corrector, eq. (23) and (24); with corrected signs.

    u_{k+1} = u_{k-3} + (4 T / 3) (2 f_k - f_{k-1} + 2 f_{k-2})
    u_{k+1} = u_{k-1} + (T / 3) (f_{k+1} + 4 f_k + f_{k-1})

    Passes end early when one moves u by no more than `tolerance`. Source: S. Alimohammadi, B. Motakef Imani, Modares
    Mechanical Engineering 15(13), 2015, p. 158-162, whose print of both equations has slips in signs and factors.
    """
    after = u[3] + 4.0 * period / 3.0 * (2.0 * rate[0] - rate[1] + 2.0 * rate[2])  # eq. (23)
    for _ in range(corrections):
        before = after
        next_rate = rate_at(before, law[NEXT_FEED], table, cursor, shape)
        after = u[1] + period / 3.0 * (next_rate + 4.0 * rate[0] + rate[1])  # eq. (24)
        if abs(after - before) <= tolerance:
            break
    return after


@kernel
def runge_kutta(
    u: Array, rate: Array, law: Array, period: float, table: Array, cursor: IntArray, shape: Shape
) -> float:
    """One classical Runge-Kutta step of order 4 for du/dt = V(t) / |C'(u)|; it also starts the multistep methods.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., table 1.2.
    """
    k1 = rate[0]
    k2 = rate_at(u[0] + 0.5 * period * k1, law[HALF_FEED], table, cursor, shape)
    k3 = rate_at(u[0] + 0.5 * period * k2, law[HALF_FEED], table, cursor, shape)
    k4 = rate_at(u[0] + period * k3, law[NEXT_FEED], table, cursor, shape)
    return u[0] + period / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

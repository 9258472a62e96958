"""What the look-ahead asks of the path at one place: derivatives by arc length, and the feed that limits leave."""

from __future__ import annotations

import math

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import DEGREES, START, Shape, derivatives, measured, way_to_rest
from splinefeed.records import Array

#: Places of `limit`: feed, acceleration and deceleration along the path, jerk while speeding up and while slowing down,
#: centripetal acceleration, chord error, period (0: none); then velocity, acceleration and jerk of each axis. Infinite
#: where there is none.
FEED, SPEED_UP, SLOW_DOWN, JERK_UP, JERK_DOWN, CENTRIPETAL, CHORD, PERIOD, OF_AXES = 0, 1, 2, 3, 4, 5, 6, 7, 8
#: Columns of `feeds` (rows, 2): largest feed on a row, and at the corner where it begins if that is passed, mm/s.
ON_ROW, AT_CORNER = 0, 1
#: A place is told from one with C' = 0 by half this many roundings of arc length: fewer than whoever checks may take.
INDISTINCT = 24.0
#: Rounding of arc length, relative to how far away it is counted from.
ROUNDING = 4.0 * 2.0**-52


@kernel
def along(table: Array, row: int, shape: Shape, t: float, rounding: float, work: Array, out: Array) -> float:
    """r', r'', r''' by arc length at t of one row, into out (3, axes); returns |r''| over the linear axes, 1/mm.

    u_s = 1/c, u_ss = -(C'.C'')/c^4, u_sss = 4 (C'.C'')^2/c^7 - (C''.C'' + C'.C''')/c^5, c = |C'|. work (4, axes).
    Where C' = 0 within the rounding of arc length, mm, out is 0 and -1 is returned.
    """
    derivatives(table, row, shape, t, 3, work)
    begin, end = measured(table, row, shape)
    square = 0.0
    product = 0.0
    second = 0.0
    third = 0.0
    twist = 0.0
    for k in range(begin, end):
        square += work[1, k] * work[1, k]
        twist += work[3, k] * work[3, k]
        product += work[1, k] * work[2, k]
        second += work[2, k] * work[2, k]
        third += work[1, k] * work[3, k]
    if begin > 0:
        square *= DEGREES * DEGREES
        product *= DEGREES * DEGREES
        second *= DEGREES * DEGREES
        third *= DEGREES * DEGREES
        twist *= DEGREES * DEGREES
    c = math.sqrt(square)
    if not way_to_rest(c, math.sqrt(second), math.sqrt(twist)) > 0.5 * INDISTINCT * rounding:
        out[:] = 0.0
        return -1.0
    third += second
    us = 1.0 / c
    uss = -product / (square * square)
    usss = 4.0 * product * product / (square * square * square * c) - third / (square * square * c)
    bend = 0.0
    for k in range(shape[1]):
        out[0, k] = work[1, k] * us
        out[1, k] = work[2, k] * us * us + work[1, k] * uss
        out[2, k] = work[3, k] * us * us * us + 3.0 * work[2, k] * us * uss + work[1, k] * usss
        if k < abs(shape[2]):
            bend += out[1, k] * out[1, k]
    return math.sqrt(bend)


@kernel
def doubt(table: Array, row: int, shape: Shape, rounding: float, work: Array) -> float:
    """The rounding of arc length, mm, relative to how far away C' = 0 is, at the place whose derivatives work has.

    Twice that way is |C'|^2 / |C''| for a cusp, where r', r'', r''' go with its powers -1/2, -3/2, -5/2.
    """
    square = 0.0
    second = 0.0
    third = 0.0
    begin, end = measured(table, row, shape)
    for k in range(begin, end):
        square += work[1, k] * work[1, k]
        second += work[2, k] * work[2, k]
        third += work[3, k] * work[3, k]
    way = way_to_rest(math.sqrt(square), math.sqrt(second), math.sqrt(third)) * (DEGREES if begin > 0 else 1.0)
    return 0.5 * rounding / way if way > 0.5 * INDISTINCT * rounding else 0.0


@kernel
def row_end(table: Array, row: int) -> float:
    """Arc length at which a row ends, mm."""
    return float(table[row + 1, START]) if row + 1 < table.shape[0] else arc_length(table, row, 1.0)


@kernel
def place(table: Array, row: int, last: int, s: float) -> tuple[int, float]:
    """Row, walking on from `row` to `last` at most, and t in it, at arc length s, mm."""
    while row < last and s >= table[row + 1, START]:
        row += 1
    while row > 0 and s < table[row, START]:
        row -= 1
    return row, in_row(table, row, s)


@kernel
def in_row(table: Array, row: int, s: float) -> float:
    """t of one row at arc length s, mm, or at the end of the row that is nearer to it."""
    whole = row_end(table, row) - table[row, START]
    ahead = min(max(s - table[row, START], 0.0), whole)
    if whole <= 0.0:
        return 0.0
    return parameter_in_row(table, row, table[row, START] + ahead, 2.0 * ahead / whole - 1.0)


@kernel
def still_top(d: Array, kappa: float, limit: Array) -> float:
    """Largest q that feed, axis velocity and centripetal acceleration allow at derivatives d (3, axes), mm^2/s^2."""
    axes = d.shape[1]
    top = limit[FEED] * limit[FEED]
    for k in range(axes):
        velocity = limit[OF_AXES + k]
        slope = abs(d[0, k])
        if velocity < slope * math.sqrt(top):
            top = (velocity / slope) ** 2
    if kappa * top > limit[CENTRIPETAL]:
        top = limit[CENTRIPETAL] / kappa
    return top


@kernel
def chord_top(kappa: float, limit: Array) -> float:
    """Largest q at which a step of the period on a curve of curvature <= kappa stays within the chord error.

    A step of length v T leaves its chord by at most delta if v^2 T^2 <= 4 (2 delta/kappa - delta^2), delta <= 1/kappa;
    and by no more than half its length, however the curve bends.
    """
    if not (limit[CHORD] < math.inf and limit[PERIOD] > 0.0) or kappa <= 0.0:
        return math.inf
    delta = limit[CHORD]
    room = 2.0 * delta / kappa - delta * delta if delta * kappa < 1.0 else delta * delta
    return 4.0 * room / (limit[PERIOD] * limit[PERIOD])


@kernel
def turn_top(d: Array, limit: Array) -> float:
    """Largest q that axis acceleration and jerk leave to a steady feed: |r''| q <= A, |r'''| q^(3/2) <= J."""
    axes = d.shape[1]
    top = math.inf
    for k in range(axes):
        bend = abs(d[1, k])
        if bend > 0.0:
            top = min(top, limit[OF_AXES + axes + k] / bend)
        twist = abs(d[2, k])
        most = limit[OF_AXES + 2 * axes + k]
        if twist > 0.0 and most < math.inf:
            top = min(top, (most / twist) ** (2.0 / 3.0))
    return top


@kernel
def steady_top(d: Array, kappa: float, limit: Array) -> float:
    """Largest q at a steady feed under all limits, where derivatives d (3, axes) and curvature kappa are known."""
    top = min(still_top(d, kappa, limit), turn_top(d, limit), chord_top(kappa, limit))
    return top if top >= 0.0 else math.inf


@kernel
def push_twist(d: Array, limit: Array) -> tuple[float, float]:
    """Largest tangential acceleration and jerk that the limits leave on a straight course along d[0]."""
    axes = d.shape[1]
    push = min(limit[SPEED_UP], limit[SLOW_DOWN])
    twist = min(limit[JERK_UP], limit[JERK_DOWN])
    for k in range(axes):
        slope = abs(d[0, k])
        if slope > 0.0:
            push = min(push, limit[OF_AXES + axes + k] / slope)
            twist = min(twist, limit[OF_AXES + 2 * axes + k] / slope)
    return push, twist

"""The arithmetic on one row of a table of pieces, for what goes from tick to tick; see `kernels.layout`."""

from __future__ import annotations

import math

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.layout import ARC as ARC
from splinefeed.kernels.layout import ARC_TERMS as ARC_TERMS
from splinefeed.kernels.layout import DEGREES as DEGREES
from splinefeed.kernels.layout import HIGH as HIGH
from splinefeed.kernels.layout import LOW as LOW
from splinefeed.kernels.layout import MIDDLE as MIDDLE
from splinefeed.kernels.layout import ORIGIN as ORIGIN
from splinefeed.kernels.layout import SCALE as SCALE
from splinefeed.kernels.layout import START as START
from splinefeed.kernels.layout import Shape as Shape
from splinefeed.kernels.layout import width as width
from splinefeed.records import Array, IntArray


@kernel
def turns(table: Array, row: int, shape: Shape) -> bool:
    """Whether no linear axis moves on one row. There A is 0 exactly: it is taken about one of its own points."""
    degree, axes, linear, _ = shape
    for a in range(abs(linear)):
        at = ORIGIN + axes + a * (degree + 1)
        for k in range(degree + 1):
            if table[row, at + k] != 0.0:
                return False
    return True


@kernel
def measured(table: Array, row: int, shape: Shape) -> tuple[int, int]:
    """First axis that makes the arc length of one row, and the one behind the last: behind all axes if it turns."""
    linear = abs(shape[2])
    if shape[2] <= 0 and turns(table, row, shape):
        return linear, shape[1]
    return 0, linear


@kernel
def find_row(table: Array, first: int, last: int, column: int, value: float) -> int:
    """Row in [first, last] whose `column` (LOW or START, increasing) is the last one <= value; by bisection."""
    low = first
    high = last
    while low < high:
        middle = (low + high + 1) // 2
        if table[middle, column] <= value:
            low = middle
        else:
            high = middle - 1
    return low


@hot_kernel
def walk_to(table: Array, cursor: IntArray, u: float) -> int:
    """Row that holds parameter u, walking from cursor[0] within [cursor[1], cursor[2]]; leaves the row in cursor[0]."""
    row = cursor[0]
    while row < cursor[2] and u >= table[row, HIGH]:
        row += 1
    while row > cursor[1] and u < table[row, LOW]:
        row -= 1
    cursor[0] = row
    return row


@hot_kernel
def point(table: Array, row: int, shape: Shape, t: float, out: Array) -> None:
    """Point of the curve at t of one row: C = origin + A(t) / w(t), into out (axes,). Eq. (1)."""
    degree, axes, _, rational = shape
    base = ORIGIN + axes
    inverse = 1.0
    if rational:
        at = base + axes * (degree + 1)
        weight = table[row, at + degree]
        for k in range(degree - 1, -1, -1):
            weight = weight * t + table[row, at + k]
        inverse = 1.0 / weight
    for a in range(axes):
        at = base + a * (degree + 1)
        value = table[row, at + degree]
        for k in range(degree - 1, -1, -1):
            value = value * t + table[row, at + k]
        out[a] = table[row, ORIGIN + a] + value * inverse


@hot_kernel
def speed(table: Array, row: int, shape: Shape, t: float) -> float:
    """|C'(u)| over the measured axes at t of one row, mm per unit of u: C' = (A' - w' A / w) / w."""
    degree, axes, linear, rational = shape
    base = ORIGIN + axes
    inverse = 1.0
    ratio = 0.0
    if rational:
        at = base + axes * (degree + 1)
        weight = table[row, at + degree]
        slope = 0.0
        for k in range(degree - 1, -1, -1):
            slope = slope * t + weight
            weight = weight * t + table[row, at + k]
        inverse = 1.0 / weight
        ratio = slope * inverse
    begin = 0
    end = linear
    if linear <= 0:
        begin, end = measured(table, row, shape)
    total = 0.0
    for a in range(begin, end):
        at = base + a * (degree + 1)
        value = table[row, at + degree]
        slope = 0.0
        for k in range(degree - 1, -1, -1):
            slope = slope * t + value
            value = value * t + table[row, at + k]
        slope = (slope - ratio * value) * inverse
        total += slope * slope
    if linear <= 0 and end == axes:
        total *= DEGREES * DEGREES
    return math.sqrt(total) * table[row, SCALE]


@hot_kernel
def first_two(table: Array, row: int, shape: Shape, t: float) -> tuple[float, float]:
    """C'.C' and C'.C'' over the measured axes at t of one row: what the second Taylor term of eq. (3) needs."""
    degree, axes, linear, rational = shape
    base = ORIGIN + axes
    scale = table[row, SCALE]
    inverse = 1.0
    w1 = 0.0
    w2 = 0.0
    if rational:
        at = base + axes * (degree + 1)
        w0 = table[row, at + degree]
        for k in range(degree - 1, -1, -1):
            w2 = w2 * t + w1
            w1 = w1 * t + w0
            w0 = w0 * t + table[row, at + k]
        inverse = 1.0 / w0
    begin = 0
    end = linear
    if linear <= 0:
        begin, end = measured(table, row, shape)
    square = 0.0
    product = 0.0
    for a in range(begin, end):
        at = base + a * (degree + 1)
        c0 = table[row, at + degree]
        c1 = 0.0
        c2 = 0.0
        for k in range(degree - 1, -1, -1):
            c2 = c2 * t + c1
            c1 = c1 * t + c0
            c0 = c0 * t + table[row, at + k]
        c0 = c0 * inverse
        c1 = (c1 - w1 * c0) * inverse
        c2 = 2.0 * (c2 - w1 * c1 - w2 * c0) * inverse
        square += c1 * c1
        product += c1 * c2
    if linear <= 0 and end == axes:
        square *= DEGREES * DEGREES
        product *= DEGREES * DEGREES
    return square * scale * scale, product * scale * scale * scale


@kernel
def derivatives(table: Array, row: int, shape: Shape, t: float, order: int, out: Array) -> None:
    """Point and derivatives by u to `order` <= 3 at t of one row, into out (order + 1, axes).

    C^(k) = (A^(k) - sum_{i=1..k} C(k, i) w^(i) C^(k-i)) / w      (The NURBS Book, 2nd ed., eq. 4.8)
    """
    degree, axes, _, rational = shape
    base = ORIGIN + axes
    scale = table[row, SCALE]
    w0 = 1.0
    w1 = 0.0
    w2 = 0.0
    w3 = 0.0
    if rational:
        at = base + axes * (degree + 1)
        w0 = table[row, at + degree]
        for k in range(degree - 1, -1, -1):
            w3 = w3 * t + w2
            w2 = w2 * t + w1
            w1 = w1 * t + w0
            w0 = w0 * t + table[row, at + k]
        w2 *= 2.0
        w3 *= 6.0
    inverse = 1.0 / w0
    for a in range(axes):
        at = base + a * (degree + 1)
        c0 = table[row, at + degree]
        c1 = 0.0
        c2 = 0.0
        c3 = 0.0
        for k in range(degree - 1, -1, -1):
            c3 = c3 * t + c2
            c2 = c2 * t + c1
            c1 = c1 * t + c0
            c0 = c0 * t + table[row, at + k]
        c2 *= 2.0
        c3 *= 6.0
        if rational:
            c0 = c0 * inverse
            c1 = (c1 - w1 * c0) * inverse
            c2 = (c2 - 2.0 * w1 * c1 - w2 * c0) * inverse
            c3 = (c3 - 3.0 * w1 * c2 - 3.0 * w2 * c1 - w3 * c0) * inverse
        out[0, a] = table[row, ORIGIN + a] + c0
        if order >= 1:
            out[1, a] = c1 * scale
        if order >= 2:
            out[2, a] = c2 * scale * scale
        if order >= 3:
            out[3, a] = c3 * scale * scale * scale


@hot_kernel
def secant(table: Array, row: int, t: float, ahead: int, t_ahead: float, shape: Shape) -> tuple[float, float, float]:
    """D.D, D.C' and C'.C' over the measured axes: D from t of `row` to t_ahead of `ahead`, C' (by u) at the latter.

    The axes are those that make the arc length of `ahead`; units are mm and mm per unit of u.
    """
    degree, axes, linear, rational = shape
    base = ORIGIN + axes
    scale = table[ahead, SCALE]
    inverse = 1.0
    inverse_ahead = 1.0
    ratio = 0.0
    if rational:
        at = base + axes * (degree + 1)
        weight = table[row, at + degree]
        weight_ahead = table[ahead, at + degree]
        slope = 0.0
        for k in range(degree - 1, -1, -1):
            weight = weight * t + table[row, at + k]
            slope = slope * t_ahead + weight_ahead
            weight_ahead = weight_ahead * t_ahead + table[ahead, at + k]
        inverse = 1.0 / weight
        inverse_ahead = 1.0 / weight_ahead
        ratio = slope * inverse_ahead
    begin = 0
    end = linear
    if linear <= 0:
        begin, end = measured(table, ahead, shape)
    chord = 0.0
    product = 0.0
    square = 0.0
    for a in range(begin, end):
        at = base + a * (degree + 1)
        value = table[row, at + degree]
        value_ahead = table[ahead, at + degree]
        slope = 0.0
        for k in range(degree - 1, -1, -1):
            value = value * t + table[row, at + k]
            slope = slope * t_ahead + value_ahead
            value_ahead = value_ahead * t_ahead + table[ahead, at + k]
        slope = (slope - ratio * value_ahead) * inverse_ahead * scale
        across = table[ahead, ORIGIN + a] - table[row, ORIGIN + a] + (value_ahead * inverse_ahead - value * inverse)
        chord += across * across
        product += across * slope
        square += slope * slope
    if linear <= 0 and end == axes:
        chord *= DEGREES * DEGREES
        product *= DEGREES * DEGREES
        square *= DEGREES * DEGREES
    return chord, product, square

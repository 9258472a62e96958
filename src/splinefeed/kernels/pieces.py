"""The arithmetic on one row of a table of pieces, for what goes from tick to tick; see `kernels.layout`."""

from __future__ import annotations

import math

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.layout import ARC, ARC_TERMS, ORIGIN, SCALE, START, Shape
from splinefeed.records import Array, IntArray

#: Newton steps of one inversion, bisections among them; steps or bracket shrink at each.
MAX_STEPS = 80
#: A Newton step longer than this share of the one before gives way to a bisection.
SHRINKING = 0.75
#: A Newton step in t, which runs over [-1, 1], after which the next one would be below rounding.
SMALL_STEP = 1e-9


@hot_kernel
def walk_to(table: Array, cursor: IntArray, column: int, value: float) -> int:
    """Row that holds a parameter, by the column LOW, or an arc length, by START: leaves it in cursor[0].

    Walks on from cursor[0], within [cursor[1], cursor[2]].
    """
    row = cursor[0]
    while row < cursor[2] and value >= table[row + 1, column]:
        row += 1
    while row > cursor[1] and value < table[row, column]:
        row -= 1
    cursor[0] = row
    return row


@hot_kernel
def value_and_slope(table: Array, row: int, at: int, degree: int, t: float) -> tuple[float, float]:
    """The polynomial whose coefficients begin at column `at` of one row, and its slope, at t."""
    value = table[row, at + degree]
    slope = 0.0
    for k in range(degree - 1, -1, -1):
        slope = slope * t + value
        value = value * t + table[row, at + k]
    return value, slope


@hot_kernel
def weight_at(table: Array, row: int, shape: Shape, t: float) -> tuple[float, float]:
    """1 / w and w' / w at t of one row; 1 and 0 where the table has no weights."""
    degree, axes, _, rational = shape
    inverse = 1.0
    slope = 0.0
    if rational:
        weight, slope = value_and_slope(table, row, ORIGIN + axes + axes * (degree + 1), degree, t)
        inverse = 1.0 / weight
        slope = slope * inverse
    return inverse, slope


@hot_kernel
def point(table: Array, row: int, shape: Shape, t: float, out: Array) -> None:
    """Point of the curve at t of one row: C = origin + A(t) / w(t), into out (axes,). Eq. (1)."""
    degree, axes, _, _ = shape
    inverse, _ = weight_at(table, row, shape, t)
    for a in range(axes):
        value, _ = value_and_slope(table, row, ORIGIN + axes + a * (degree + 1), degree, t)
        out[a] = table[row, ORIGIN + a] + value * inverse


@hot_kernel
def speed(table: Array, row: int, shape: Shape, t: float) -> float:
    """|C'(u)| over the measured axes at t of one row, mm per unit of u: C' = (A' - w' A / w) / w."""
    degree, axes, measured, _ = shape
    inverse, ratio = weight_at(table, row, shape, t)
    total = 0.0
    for a in range(measured):
        value, slope = value_and_slope(table, row, ORIGIN + axes + a * (degree + 1), degree, t)
        slope = (slope - ratio * value) * inverse
        total += slope * slope
    return math.sqrt(total) * table[row, SCALE]


@hot_kernel
def secant(table: Array, row: int, t: float, ahead: int, t_ahead: float, shape: Shape) -> tuple[float, float, float]:
    """D.D, D.C' and C'.C' over the measured axes: D from t of `row` to t_ahead of `ahead`, C' (by u) at the latter.

    Units are mm and mm per unit of u.
    """
    degree, axes, measured, _ = shape
    inverse, _ = weight_at(table, row, shape, t)
    inverse_ahead, ratio = weight_at(table, ahead, shape, t_ahead)
    chord = 0.0
    product = 0.0
    square = 0.0
    for a in range(measured):
        at = ORIGIN + axes + a * (degree + 1)
        value, _ = value_and_slope(table, row, at, degree, t)
        value_ahead, slope = value_and_slope(table, ahead, at, degree, t_ahead)
        slope = (slope - ratio * value_ahead) * inverse_ahead * table[ahead, SCALE]
        across = table[ahead, ORIGIN + a] - table[row, ORIGIN + a] + (value_ahead * inverse_ahead - value * inverse)
        chord += across * across
        product += across * slope
        square += slope * slope
    return chord, product, square


@kernel
def fitted_speed(table: Array, row: int, t: float) -> tuple[float, float, float]:
    """dS/dt at t of one row, from its polynomial, with its first and second derivative; mm."""
    value = 0.0
    slope = 0.0
    bend = 0.0
    for k in range(ARC_TERMS - 1, 0, -1):
        bend = bend * t + slope
        slope = slope * t + value
        value = value * t + k * table[row, ARC + k]
    return value, slope, 2.0 * bend


@hot_kernel
def arc_length(table: Array, row: int, t: float) -> float:
    """S at t of one row, mm: START + sum_k arc_k t^k, even and odd terms apart so that they run side by side."""
    x = t * t
    even = table[row, ARC + 10]
    odd = table[row, ARC + 9]
    for k in range(4):
        even = even * x + table[row, ARC + 8 - 2 * k]
        odd = odd * x + table[row, ARC + 7 - 2 * k]
    return table[row, START] + ((even * x + table[row, ARC]) + t * odd)


@hot_kernel
def parameter_in_row(table: Array, row: int, s: float, guess: float) -> float:
    """t in [-1, 1] of one row with S(t) = s, by Newton's method kept inside a bracket; from `guess`, in t.

    t <- t - (S(t) - s) / S'(t). Ends when a step is so small that the next one, which is of the order of its square,
    would be below rounding.
    """
    wanted = s - table[row, START]
    low = -1.0
    high = 1.0
    t = min(max(guess, low), high)
    step = math.inf
    for _ in range(MAX_STEPS):
        value, slope = value_and_slope(table, row, ARC, ARC_TERMS - 1, t)
        rest = value - wanted
        if rest > 0.0:
            high = t
        elif rest < 0.0:
            low = t
        else:
            return t
        after = min(max(t - rest / slope, -1.0), 1.0) if slope > 0.0 else 2.0
        # steps must shrink: from an end where S' is small Newton goes to the other end, and from there back
        if low <= after <= high and abs(after - t) <= SHRINKING * step:
            step = abs(after - t)
        else:
            after = 0.5 * (low + high)
            step = high - low
        t = after
        if step < SMALL_STEP or high - low < 4e-16:
            break
    return t

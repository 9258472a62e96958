"""The chord from one place of a curve to another: what interpolators that mend their step by its chord ask for."""

from __future__ import annotations

from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import DEGREES, ORIGIN, SCALE, Shape, measured
from splinefeed.records import Array


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

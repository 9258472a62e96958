"""Erkorkmaz and Altintas's feed-correction polynomial: u as a polynomial of s, no step at all."""

from __future__ import annotations

from splinefeed.interpolation.stepping import NEXT_S, Curve, row_at_length
from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE, START
from splinefeed.kernels.pieces import arc_length, fitted_speed
from splinefeed.records import Array

#: Coefficients of a polynomial of degree 7.
TERMS = 8
#: Places inside a piece, evenly spread over its parameter, at which the two free coefficients are fitted.
SAMPLES = 15
#: Places in `memory` behind the coefficients: the row that they belong to, plus 1, and its length, mm.
FITTED, LENGTH = TERMS, TERMS + 1


@kernel
def fit_feed_correction(table: Array, row: int, out: Array) -> float:
    """Coefficients of t(x) = sum_k c_k x^k, x = (s - START) / L in [0, 1], of one row into out (8,); returns L, mm.

    Value, slope and second derivative are those of the inverse of S at both ends, dt/dx = L / S' and d2t/dx2 =
    -L^2 S'' / S'^3: a quintic q. What is left, x^3 (1 - x)^3 (a + b x), goes by least squares through the places
    t_i, x_i = (S(t_i) - START) / L. Where S' = 0 at an end the numbers are not finite.
    """
    low = (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]
    high = (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]
    length = arc_length(table, row, high) - table[row, START]
    speed, bend, _ = fitted_speed(table, row, low)
    slope_low = length / speed
    bend_low = -slope_low * slope_low * bend / speed
    speed, bend, _ = fitted_speed(table, row, high)
    slope_high = length / speed
    bend_high = -slope_high * slope_high * bend / speed

    # the quintic with these six values
    rise = high - low - slope_low - 0.5 * bend_low
    turn = slope_high - slope_low - bend_low
    curl = bend_high - bend_low
    out[0] = low
    out[1] = slope_low
    out[2] = 0.5 * bend_low
    out[3] = 10.0 * rise - 4.0 * turn + 0.5 * curl
    out[4] = -15.0 * rise + 7.0 * turn - curl
    out[5] = 6.0 * rise - 3.0 * turn + 0.5 * curl

    # normal equations of a and b
    plain, mixed, steep, rest, rest_steep = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(SAMPLES):
        t = low + (high - low) * (i + 1) / (SAMPLES + 1)
        x = (arc_length(table, row, t) - table[row, START]) / length
        quintic = out[5]
        for k in range(4, -1, -1):
            quintic = quintic * x + out[k]
        bump = (x * (1.0 - x)) ** 3
        plain += bump * bump
        mixed += bump * bump * x
        steep += bump * bump * x * x
        rest += bump * (t - quintic)
        rest_steep += bump * x * (t - quintic)
    below = plain * steep - mixed * mixed
    a = (rest * steep - rest_steep * mixed) / below
    b = (rest_steep * plain - rest * mixed) / below
    out[3] += a
    out[4] += b - 3.0 * a
    out[5] += 3.0 * (a - b)
    out[6] = 3.0 * b - a
    out[7] = -b
    return length


@hot_kernel
def step(
    u: Array, rate: Array, law: Array, period: float, curve: Curve, corrections: int, tolerance: float, memory: Array
) -> float:
    """u_{k+1} = p(l(t_{k+1})), p of degree 7, with value, slope and bend of the inverse of S at both ends of a piece.

    The published method fits one polynomial a spline segment and splits those that are too far off; here it is one a
    piece of the arc-length table, when a tick first meets it.
    Source: K. Erkorkmaz, Y. Altintas, "Quintic spline interpolation with minimal feed fluctuation", ASME Journal of
    Manufacturing Science and Engineering 127(2), 2005, p. 339-349, doi 10.1115/1.1830493 (the
    journal's page was seen, the DOI itself was not).
    """
    table, cursor, _ = curve
    s = law[NEXT_S]
    row = row_at_length(table, s, cursor)
    if memory[FITTED] != row + 1.0:
        memory[LENGTH] = fit_feed_correction(table, row, memory[:TERMS])
        memory[FITTED] = row + 1.0
    x = (s - table[row, START]) / memory[LENGTH]
    t = memory[TERMS - 1]
    for k in range(TERMS - 2, -1, -1):
        t = t * x + memory[k]
    return table[row, MIDDLE] + t / table[row, SCALE]

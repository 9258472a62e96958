"""Arc length as a table of polynomials: read in a few nanoseconds, and inverted by Newton steps."""

from __future__ import annotations

import math

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.kernels.layout import ARC, ARC_TERMS, START
from splinefeed.records import Array

#: Newton steps of one inversion, bisections among them; steps or bracket shrink at each.
MAX_STEPS = 80
#: A Newton step longer than this share of the one before gives way to a bisection.
SHRINKING = 0.75
#: A Newton step in t, which runs over [-1, 1], after which the next one would be below rounding.
SMALL_STEP = 1e-9


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

    t <- t - (S(t) - s) / S'(t);  S and S' from one even-odd Horner scheme. Ends when a step is so small that the
    next one, which is of the order of its square, would be below rounding.
    """
    wanted = s - table[row, START]
    low = -1.0
    high = 1.0
    t = min(max(guess, low), high)
    step = math.inf
    for _ in range(MAX_STEPS):
        x = t * t
        even = table[row, ARC + 10]
        odd = table[row, ARC + 9]
        even_slope = 0.0
        odd_slope = 0.0
        for k in range(4):
            even_slope = even_slope * x + even
            odd_slope = odd_slope * x + odd
            even = even * x + table[row, ARC + 8 - 2 * k]
            odd = odd * x + table[row, ARC + 7 - 2 * k]
        even_slope = even_slope * x + even
        even = even * x + table[row, ARC]
        rest = (even - wanted) + t * odd
        slope = 2.0 * t * even_slope + (odd + 2.0 * x * odd_slope)
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

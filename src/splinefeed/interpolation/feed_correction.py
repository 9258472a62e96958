"""Erkorkmaz and Altintas's feed-correction polynomial: u as a polynomial of s, no step at all."""

from __future__ import annotations

from splinefeed.interpolation.stepping import NEXT_S
from splinefeed.kernels.feed_correction import TERMS, fit_feed_correction
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, START, Shape
from splinefeed.records import Array, IntArray

#: Places in `memory` behind the coefficients: the row that they belong to, plus 1, and its length, mm.
FITTED, LENGTH = TERMS, TERMS + 1


@hot_kernel
def step(
    u: Array,
    rate: Array,
    law: Array,
    period: float,
    table: Array,
    cursor: IntArray,
    shape: Shape,
    corrections: int,
    tolerance: float,
    memory: Array,
) -> float:
    """u_{k+1} = p(l(t_{k+1})), p of degree 7, with value, slope and bend of the inverse of S at both ends of a piece.

    Its error is that of the fit, whatever the period. The published method fits one polynomial a spline segment and
    splits those that are too far off; here it is one a piece of the arc-length table, when a tick first meets it.
    Source: K. Erkorkmaz, Y. Altintas, "Quintic spline interpolation with minimal feed fluctuation", ASME Journal of
    Manufacturing Science and Engineering 127(2), 2005, p. 339-349, doi 10.1115/1.1830493 (the
    journal's page was seen, the DOI itself was not).
    """
    s = law[NEXT_S]
    row = cursor[0]
    while row < cursor[2] and s >= table[row + 1, START]:
        row += 1
    while row > cursor[1] and s < table[row, START]:
        row -= 1
    cursor[0] = row
    if memory[FITTED] != row + 1.0:
        memory[LENGTH] = fit_feed_correction(table, row, memory[:TERMS])
        memory[FITTED] = row + 1.0
    x = (s - table[row, START]) / memory[LENGTH]
    t = memory[TERMS - 1]
    for k in range(TERMS - 2, -1, -1):
        t = t * x + memory[k]
    return table[row, MIDDLE] + t / table[row, SCALE]

"""Milne-Simpson pulled onto the arc length at every tick: the default."""

from __future__ import annotations

from splinefeed.interpolation.stepping import NEXT_S, anchored, milne_simpson
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import Shape
from splinefeed.records import Array, IntArray


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
    """Eq. (23) and (24), then Newton steps on S(u) = l(t_{k+1}) from there: drift and ripple go to rounding.

    The history that the next step reads is that of the anchored points. Source: `stepping.milne_simpson`; the
    correction by the arc length is this project's.
    """
    guess = milne_simpson(u, rate, law, period, table, cursor, shape, corrections, tolerance)
    return anchored(guess, law[NEXT_S], table, cursor)

"""The paper's interpolator: Milne's predictor and Simpson's corrector, as eq. (23) and (24) have them."""

from __future__ import annotations

from splinefeed.interpolation.stepping import milne_simpson
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
    """Eq. (23), then eq. (24) `corrections` times or until it moves u by no more than `tolerance`.

    Nothing damps its second root at -1, so every kick stays as a ripple that changes sign at each tick: faithful to
    the paper, and not what a machine should run; see docs/math/milne-simpson.md. Source: `stepping.milne_simpson`.
    """
    return milne_simpson(u, rate, law, period, table, cursor, shape, corrections, tolerance)

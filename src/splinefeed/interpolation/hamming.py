"""Hamming's predictor-corrector: Milne's predictor with a corrector whose other roots die out."""

from __future__ import annotations

from splinefeed.interpolation.stepping import NEXT_FEED, rate_at
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
    """Predict by Milne, correct `corrections` times by Hamming.

    u_{k+1} = u_{k-3} + (4 T / 3) (2 f_k - f_{k-1} + 2 f_{k-2})
    u_{k+1} = (9 u_k - u_{k-2} + 3 T (f_{k+1} + 2 f_k - f_{k-1})) / 8

    His modifier, which takes the estimated error off and raises the order to 5, is left out, so that this method and
    `milne-simpson` differ in their corrector alone. Source: R. W. Hamming, "Stable predictor-corrector methods for
    ordinary differential equations", Journal of the ACM 6(1), 1959, doi 10.1145/320954.320958.
    """
    after = u[3] + 4.0 * period / 3.0 * (2.0 * rate[0] - rate[1] + 2.0 * rate[2])
    for _ in range(corrections):
        before = after
        next_rate = rate_at(before, law[NEXT_FEED], table, cursor, shape)
        after = 0.125 * (9.0 * u[0] - u[2] + 3.0 * period * (next_rate + 2.0 * rate[0] - rate[1]))
        if abs(after - before) <= tolerance:
            break
    return after

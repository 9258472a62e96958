"""Adams-Bashforth-Moulton predictor-corrector of order 4."""

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
    """Predict and correct `corrections` times.

    u_{k+1} = u_k + (T / 24) (55 f_k - 59 f_{k-1} + 37 f_{k-2} - 9 f_{k-3})
    u_{k+1} = u_k + (T / 24) (9 f_{k+1} + 19 f_k - 5 f_{k-1} + f_{k-2})

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., eq. III.1.5 and III.1.9.
    """
    after = u[0] + period / 24.0 * (55.0 * rate[0] - 59.0 * rate[1] + 37.0 * rate[2] - 9.0 * rate[3])
    for _ in range(corrections):
        before = after
        next_rate = rate_at(before, law[NEXT_FEED], table, cursor, shape)
        after = u[0] + period / 24.0 * (9.0 * next_rate + 19.0 * rate[0] - 5.0 * rate[1] + rate[2])
        if abs(after - before) <= tolerance:
            break
    return after

"""Classical Runge-Kutta interpolator of order 4."""

from __future__ import annotations

from splinefeed.interpolation.stepping import runge_kutta
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
    """u_{k+1} = u_k + (T / 6) (k_1 + 2 k_2 + 2 k_3 + k_4), with the feed taken at half a period.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., table 1.2.
    """
    return runge_kutta(u, rate, law, period, table, cursor, shape)

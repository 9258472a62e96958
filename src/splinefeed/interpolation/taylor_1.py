"""First-order Taylor interpolator: the simplest there is, and the yardstick for the others."""

from __future__ import annotations

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
    """u_{k+1} = u_k + T V_k / |C'(u_k)|: eq. (2) cut after its first term.

    Source: M. Shpitalni, Y. Koren, C. C. Lo, "Realtime curve interpolators", Computer-Aided Design 26(11), 1994,
    doi 10.1016/0010-4485(94)90097-3.
    """
    return u[0] + period * rate[0]

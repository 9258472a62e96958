"""Second-order Taylor interpolator: what many controllers with NURBS blocks run; the paper's baseline."""

from __future__ import annotations

import math

from splinefeed.interpolation.stepping import ACCELERATION, FEED
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, Shape, first_two, walk_to
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
    """u_{k+1} = u_k + V T / |C'| + (T^2 / 2) (A / |C'| - V^2 (C' . C'') / |C'|^4): eq. (3), corrected.

    The print lacks the norm in the first term and has a sum before the bracket. The term with A, missing in older
    papers, belongs there whenever the feed changes: R. T. Farouki, Y.-F. Tsai, "Exact Taylor series coefficients for
    variable-feedrate CNC curve interpolators", Computer-Aided Design 33(2), 2001, doi 10.1016/S0010-4485(00)00085-3.
    """
    row = walk_to(table, cursor, u[0])
    square, product = first_two(table, row, shape, (u[0] - table[row, MIDDLE]) * table[row, SCALE])
    if square == 0.0:  # C' = 0: no series in T exists; at rest the curve is left by the shared loop's fallback
        return math.nan
    feed = law[FEED]
    bend = law[ACCELERATION] / math.sqrt(square) - feed * feed * product / (square * square)
    return u[0] + period * rate[0] + 0.5 * period * period * bend  # eq. (3)

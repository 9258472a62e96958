"""Third-order Taylor interpolator: one more term than the paper's baseline."""

from __future__ import annotations

from splinefeed.interpolation.stepping import ACCELERATION, FEED, NEXT_FEED
from splinefeed.kernels.arc_length import fitted_speed
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, Shape, walk_to
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
    """u_{k+1} = u_k + T u' + T^2 u'' / 2 + T^3 u''' / 6 with g = |C'|, V, A and J the feed and its derivatives.

    u' = V / g,  u'' = A / g - V^2 g' / g^3,  u''' = J / g - 3 A V g' / g^3 - V^3 g'' / g^4 + 3 V^3 g'^2 / g^5

    J is 2 (V_{k+1} - V_k - A T) / T^2, exact where the jerk is constant, of order T elsewhere: the order of the method
    stays 3. g and its derivatives by u are those of the arc-length table. Source: R. T. Farouki, Y.-F. Tsai, "Exact
    Taylor series coefficients for variable-feedrate CNC curve interpolators", Computer-Aided Design 33(2), 2001, doi
    10.1016/S0010-4485(00)00085-3.
    """
    row = walk_to(table, cursor, u[0])
    scale = table[row, SCALE]
    speed, slope, bend = fitted_speed(table, row, (u[0] - table[row, MIDDLE]) * scale)
    inverse = 1.0 / (speed * scale)  # not finite where C' = 0: the shared loop then falls back on the arc length
    slope *= scale * scale
    bend *= scale * scale * scale
    feed = law[FEED]
    acceleration = law[ACCELERATION]
    jerk = 2.0 * (law[NEXT_FEED] - feed - acceleration * period) / (period * period)
    ahead = feed * inverse
    second = inverse * (acceleration - ahead * ahead * slope)
    third = inverse * (
        jerk
        - 3.0 * acceleration * ahead * inverse * slope
        + ahead * ahead * ahead * (3.0 * slope * slope * inverse - bend)
    )
    return u[0] + period * (rate[0] + period * (0.5 * second + period / 6.0 * third))

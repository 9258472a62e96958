"""Second-order Runge-Kutta with parameter compensation: a predictor, and a corrector of the chord."""

from __future__ import annotations

import math

from splinefeed.interpolation.stepping import NEXT_FEED, rate_at, step_length
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, Shape, secant, walk_to
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
    """Predict by Runge-Kutta 2, then move u, `corrections` times, so that the chord of the step is V T.

    u_{k+1} = u_k + (T / 2) (f(u_k) + f(u_k + T f(u_k)))
    u_{k+1} = u_{k+1} + (-D.C' + sqrt((D.C')^2 - C'.C' (D.D - (V T)^2))) / C'.C'

    D = C(u_{k+1}) - C(u_k), C' at u_{k+1}: the place where the tangent there cuts the circle of radius V T about the
    last point; V T is the law's way from tick to tick. As the chord is shorter than its arc, the tool runs ahead by
    kappa^2 (V T)^3 / 24 each tick: order 2. The compensation is that of S.-S. Yeh, P.-L. Hsu, "The speed-controlled
    interpolator for machining parametric curves", Computer-Aided Design 31(5), 1999, p. 349-357. Source: K. Erwinski,
    A. Wawrzak, M. Paprocki, "Real-time jerk limited feedrate profiling and interpolation for linear motor multiaxis
    machines using NURBS toolpaths", IEEE Transactions on Industrial Informatics 18(11), 2022, p. 7560-7571, doi
    10.1109/TII.2022.3147806.
    """
    wanted = step_length(law, period)
    now = walk_to(table, cursor, u[0])
    t = (u[0] - table[now, MIDDLE]) * table[now, SCALE]
    after = u[0] + 0.5 * period * (rate[0] + rate_at(u[0] + period * rate[0], law[NEXT_FEED], table, cursor, shape))
    for _ in range(corrections):
        row = walk_to(table, cursor, after)
        chord, product, square = secant(table, now, t, row, (after - table[row, MIDDLE]) * table[row, SCALE], shape)
        inside = product * product - square * (chord - wanted * wanted)
        if not inside >= 0.0 or square == 0.0:
            break  # the tangent misses the circle, or there is none: nothing to compensate by
        moved = (math.sqrt(inside) - product) / square
        after += moved
        if abs(moved) <= tolerance:
            break
    return after

"""Newton's method on S(u) = l(t), with no memory beyond the last point."""

from __future__ import annotations

from splinefeed.interpolation import stepping
from splinefeed.interpolation.stepping import NEXT_S
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
    """u_{k+1} solves S(u) = l(t_{k+1}); Newton starts from one Euler step, S is a piecewise polynomial of degree 10.

    Source: the idea of an arc-length table is B. Guenter, R. Parent, "Computing the arc length of parametric curves",
    IEEE Computer Graphics and Applications 10(3), 1990, doi 10.1109/38.55155; the table is `kernels.arc_length`.
    """
    return stepping.anchored(u[0] + period * rate[0], law[NEXT_S], table, cursor)

"""Tsai and Cheng's predictor-corrector: the parameter is corrected until the chord of the step is that of the feed."""

from __future__ import annotations

import math

from splinefeed.interpolation.stepping import rate_at, step_length
from splinefeed.kernels.jit import hot_kernel
from splinefeed.kernels.pieces import MIDDLE, SCALE, Shape, secant, walk_to
from splinefeed.records import Array, IntArray

#: Chord over wanted length up to which 2 - r stands for 1 / r in the corrector.
FAR_OFF = 1.5


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
    """Predict by differences, then compensate the parameter `corrections` times by the feed that its chord has.

    u_{k+1} = 3 u_k - 3 u_{k-1} + u_{k-2}
    u_{k+1} = u_{k+1} + (1 - r) (u_{k+1} - u_k),  r = |C(u_{k+1}) - C(u_k)| / (V T)

    r = V_i / V is the feed of the last pass over the feed wanted, V T the law's way from tick to tick. A prediction
    that is not ahead is replaced by u_k + V T / |C'(u_k)|, and a step more than half too long is divided by r. As the
    chord is shorter than its arc, the tool runs ahead by kappa^2 (V T)^3 / 24 each tick: order 2. This is a reading
    of the published scheme: the paper's own predictor has settings that are not used here.
    Source: M.-C. Tsai, C.-W. Cheng, "A real-time predictor-corrector interpolator for CNC machining", ASME Journal of
    Manufacturing Science and Engineering 125(3), 2003, p. 449-460, doi 10.1115/1.1578670 (the
    journal's page was seen, the DOI itself was not).
    """
    wanted = step_length(law, period)
    if wanted <= 0.0:
        return u[0]
    now = walk_to(table, cursor, u[0])
    t = (u[0] - table[now, MIDDLE]) * table[now, SCALE]
    ahead = 2.0 * (u[0] - u[1]) - (u[1] - u[2])
    if ahead <= 0.0:
        ahead = rate_at(u[0], wanted, table, cursor, shape)
    for _ in range(corrections):
        row = walk_to(table, cursor, u[0] + ahead)
        t_ahead = (u[0] + ahead - table[row, MIDDLE]) * table[row, SCALE]
        chord, _, _ = secant(table, now, t, row, t_ahead, shape)
        ratio = math.sqrt(chord) / wanted
        before = ahead
        ahead = before * (2.0 - ratio) if ratio <= FAR_OFF else before / ratio
        if abs(ahead - before) <= tolerance:
            break
    return u[0] + ahead

"""The law of a look-ahead window: quintic pieces in time, and how far each must slow down to keep every limit."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead import CENTRIPETAL, FEED, JERK, OF_AXES, PLACES, SLOW_DOWN, SPEED_UP
from splinefeed.records import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS_PLACES = np.ascontiguousarray(0.5 * (_NODES + 1.0))
GAUSS_WEIGHTS = np.ascontiguousarray(0.5 * _WEIGHTS)
#: Newton steps from a share of a piece's length to its time: pieces are short and smooth.
STEPS = 6
#: The rise of a peak between places is taken this much larger, as a parabola is not the whole truth.
PEAK_MARGIN = 2.0


@kernel
def lay_law(n: int, nodes: Array, c: Array, ends: Array, spans: Array, law: Array) -> bool:
    """The motion of c (n + 2,) as n + 2 quintic pieces in t: durations spans, s, and coefficients law (n + 2, 6).

    A piece has s, feed and acceleration of the spline at both nodes, and lasts the integral of ds / sqrt(q). The first
    and the last one, of length ends (2,), leave and reach rest on s = j t^3 / 6; they last 0 s where there is none.
    law[:, 0] counts from the start of the piece. False where c is no motion.
    """
    law[:] = 0.0
    for i in range(n):
        h = nodes[i + 1] - nodes[i]
        before = nodes[i] - nodes[i - 1] if i > 0 else 0.0
        after = nodes[i + 2] - nodes[i + 1] if i + 1 < n else 0.0
        b0 = (h * c[i] + before * c[i + 1]) / (before + h)
        b1 = c[i + 1]
        b2 = (after * c[i + 1] + h * c[i + 2]) / (h + after)
        a0 = (c[i + 1] - c[i]) / (before + h)
        a1 = (c[i + 2] - c[i + 1]) / (h + after)
        t = 0.0
        for g in range(GAUSS_PLACES.shape[0]):
            f = GAUSS_PLACES[g]
            t += GAUSS_WEIGHTS[g] / math.sqrt((1.0 - f) ** 2 * b0 + 2.0 * f * (1.0 - f) * b1 + f * f * b2)
        t *= h
        if not (b0 > 0.0 and b2 > 0.0 and 0.0 < t < math.inf):
            return False
        v0 = math.sqrt(b0)
        v1 = math.sqrt(b2)
        gap = h - (v0 + 0.5 * a0 * t) * t
        rise = (v1 - v0 - a0 * t) * t
        bend = 0.5 * (a1 - a0) * t * t
        spans[i + 1] = t
        law[i + 1, 1] = v0
        law[i + 1, 2] = 0.5 * a0
        law[i + 1, 3] = (10.0 * gap - 4.0 * rise + bend) / (t * t * t)
        law[i + 1, 4] = (-15.0 * gap + 7.0 * rise - 2.0 * bend) / (t * t * t * t)
        law[i + 1, 5] = (6.0 * gap - 3.0 * rise + bend) / (t * t * t * t * t)
    spans[0] = 0.0
    spans[n + 1] = 0.0
    if ends[0] > 0.0:
        t = 3.0 * ends[0] / math.sqrt(c[0])
        spans[0] = t
        law[0, 3] = ends[0] / (t * t * t)
    if ends[1] > 0.0:
        v = math.sqrt(c[n + 1])
        t = 3.0 * ends[1] / v
        spans[n + 1] = t
        law[n + 1, 1] = v
        law[n + 1, 2] = -v / t
        law[n + 1, 3] = v / (3.0 * t * t)
    return True


@kernel
def hold_law(
    n: int, nodes: Array, ends: Array, spans: Array, law: Array, d: Array, bend: Array, bound: Array, node_top: Array,
    calm: Array, limit: Array, over: Array,
) -> float:  # fmt: skip
    """By how much q of each piece must come down for its law to keep every limit, over (n + 2,); returns the most.

    Velocity counts squared, jerk to the power 2/3: what a factor on q makes of them. Looked at are PLACES of every
    piece, where d (n + 2, 5, 3, axes) and bend (n + 2, 5) say what the path is like, and peaks between them as a
    parabola through three of them estimates. bound (n + 2,), node_top (n + 1,): bounds of q in pieces and at nodes.
    """
    axes = d.shape[3]
    kinds = 6 + 3 * axes
    count = PLACES.shape[0]
    use = np.empty((count, kinds))
    worst = 0.0
    for i in range(n + 2):
        over[i] = 0.0
        span = spans[i]
        if span <= 0.0:
            continue
        h = ends[0] if i == 0 else (ends[1] if i == n + 1 else nodes[i] - nodes[i - 1])
        soft = calm[min(max(i - 1, 0), n - 1), 0]
        quiet = calm[min(max(i - 1, 0), n - 1), 1]
        for j in range(count):
            f = PLACES[j]
            tau = f * span
            if i == 0:
                tau = span * f ** (1.0 / 3.0)
            elif i == n + 1:
                tau = span * (1.0 - (1.0 - f) ** (1.0 / 3.0))
            elif 0 < j < count - 1:
                for _ in range(STEPS):
                    s = (((law[i, 5] * tau + law[i, 4]) * tau + law[i, 3]) * tau + law[i, 2]) * tau + law[i, 1]
                    slope = 5.0 * law[i, 5] * tau + 4.0 * law[i, 4]
                    slope = ((slope * tau + 3.0 * law[i, 3]) * tau + 2.0 * law[i, 2]) * tau + law[i, 1]
                    if not slope > 0.0:
                        break
                    step = (s * tau - f * h) / slope
                    tau = min(max(tau - step, 0.0), span)
                    if abs(step) < 1e-7 * span:
                        break
            v = 5.0 * law[i, 5] * tau + 4.0 * law[i, 4]
            v = ((v * tau + 3.0 * law[i, 3]) * tau + 2.0 * law[i, 2]) * tau + law[i, 1]
            a = ((20.0 * law[i, 5] * tau + 12.0 * law[i, 4]) * tau + 6.0 * law[i, 3]) * tau + 2.0 * law[i, 2]
            b = (60.0 * law[i, 5] * tau + 24.0 * law[i, 4]) * tau + 6.0 * law[i, 3]
            if 0 < i <= n and not v > 0.0:
                over[i] = math.inf
            q = v * v
            use[j, 0] = q / (limit[FEED] * limit[FEED])
            use[j, 1] = a / limit[SPEED_UP]
            use[j, 2] = -a / limit[SLOW_DOWN]
            use[j, 3] = (abs(b) / limit[JERK]) ** (2.0 / 3.0)
            use[j, 4] = q * bend[i, j] / limit[CENTRIPETAL]
            use[j, 5] = q / bound[i]
            for k in range(axes):
                at = OF_AXES + k
                use[j, 6 + 3 * k] = q * d[i, j, 0, k] * d[i, j, 0, k] / (limit[at] * limit[at])
                use[j, 7 + 3 * k] = abs(d[i, j, 0, k] * a + d[i, j, 1, k] * q) / (limit[at + axes] * soft)
                jerk = abs(d[i, j, 0, k] * b + 3.0 * d[i, j, 1, k] * v * a + d[i, j, 2, k] * q * v)
                use[j, 8 + 3 * k] = (jerk / (limit[at + 2 * axes] * quiet)) ** (2.0 / 3.0)
        if 0 < i <= n:
            over[i] = max(over[i], law[i, 1] * law[i, 1] / node_top[i - 1])
        for k in range(kinds):
            for j in range(count):
                here = use[j, k]
                if not here <= math.inf:
                    over[i] = math.inf
                    continue
                if 0 < j < count - 1 and here > 0.5:
                    left = PLACES[j] - PLACES[j - 1]
                    right = PLACES[j + 1] - PLACES[j]
                    before = (here - use[j - 1, k]) / left
                    after = (use[j + 1, k] - here) / right
                    curve = (after - before) / (left + right)
                    if curve < 0.0:
                        slope = before + curve * left
                        top = -0.5 * slope / curve
                        if -left < top < right:
                            here -= PEAK_MARGIN * slope * slope / (4.0 * curve)
                over[i] = max(over[i], here)
        worst = max(worst, over[i])
    return worst

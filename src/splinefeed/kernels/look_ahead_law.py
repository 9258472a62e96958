"""The law of a look-ahead window: quintic pieces in time, and how far each must slow down to keep every limit."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_cells import PLACES
from splinefeed.kernels.look_ahead_path import CENTRIPETAL, FEED, JERK_DOWN, JERK_UP, OF_AXES, SLOW_DOWN, SPEED_UP
from splinefeed.records import Array, IntArray

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS_PLACES = np.ascontiguousarray(0.5 * (_NODES + 1.0))
GAUSS_WEIGHTS = np.ascontiguousarray(0.5 * _WEIGHTS)
#: Newton steps from a place on a piece to its time, which bisect where they would leave it; a share of the piece's
#: time below which the next one would be rounding.
STEPS, SMALL_STEP = 60, 1e-7
#: The rise of a peak between places is taken this much larger, as a parabola is not the whole truth.
PEAK_MARGIN = 2.0
#: Intervals of ramps below this share of the arc length are at one place, but for rounding.
UNSURE = 1e-12
#: Between two places whose feeds differ by more than this factor, the motion is looked at INNER times more.
UNLIKE, INNER = 2.0, 3
#: An acceleration along the path below this share of the largest nearby has no sign of its own.
NO_SIGN = 1e-9


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
        spans[i + 1] = t
        join(h, t, math.sqrt(b0), a0, math.sqrt(b2), a1, law[i + 1])
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
def join(h: float, t: float, v0: float, a0: float, v1: float, a1: float, law: Array) -> None:
    """The quintic (6,) over h mm in t s from feed v0 and acceleration a0 to v1 and a1."""
    gap = h - (v0 + 0.5 * a0 * t) * t
    rise = (v1 - v0 - a0 * t) * t
    bend = 0.5 * (a1 - a0) * t * t
    law[0] = 0.0
    law[1] = v0
    law[2] = 0.5 * a0
    law[3] = (10.0 * gap - 4.0 * rise + bend) / (t * t * t)
    law[4] = (-15.0 * gap + 7.0 * rise - 2.0 * bend) / (t * t * t * t)
    law[5] = (6.0 * gap - 3.0 * rise + bend) / (t * t * t * t * t)


@kernel
def instant(law: Array, span: float, s: float, guess: float) -> float:
    """When, in [0, span], s, a piece (6,) is s mm on; by Newton's method kept inside a bracket."""
    low = 0.0
    high = span
    tau = guess
    for _ in range(STEPS):
        rest = ((((law[5] * tau + law[4]) * tau + law[3]) * tau + law[2]) * tau + law[1]) * tau - s
        slope = ((5.0 * law[5] * tau + 4.0 * law[4]) * tau + 3.0 * law[3]) * tau + 2.0 * law[2]
        slope = slope * tau + law[1]
        if rest > 0.0:
            high = tau
        else:
            low = tau
        after = tau - rest / slope if slope > 0.0 else -1.0
        if not low <= after <= high:
            after = 0.5 * (low + high)
        step = abs(after - tau)
        tau = after
        if step <= SMALL_STEP * span:
            break
    return tau


@kernel
def state_at(p: Array, tau: float, motion: Array) -> None:
    """Feed, acceleration and jerk (3,) of a piece (6,) at an instant of it, s."""
    v = ((5.0 * p[5] * tau + 4.0 * p[4]) * tau + 3.0 * p[3]) * tau + 2.0 * p[2]
    motion[0] = v * tau + p[1]
    motion[1] = ((20.0 * p[5] * tau + 12.0 * p[4]) * tau + 6.0 * p[3]) * tau + 2.0 * p[2]
    motion[2] = (60.0 * p[5] * tau + 24.0 * p[4]) * tau + 6.0 * p[3]


@kernel
def share_of(
    motion: Array, d: Array, bend: float, x: float, bound: float, calm: Array, rising: bool, falling: bool,
    limit: Array, use: Array,
) -> None:  # fmt: skip
    """Shares of the limits that a motion (3,) uses at a place, use (6 + 3 axes,), put as factors on q: see `hold_law`.

    d (3, axes): derivatives of r by arc length; x: how wrong they may be; rising, falling: which limits of jerk hold.
    """
    axes = d.shape[1]
    v, a, b = motion[0], motion[1], motion[2]
    q = v * v
    use[0] = q / (limit[FEED] * limit[FEED])
    use[1] = a / limit[SPEED_UP]
    use[2] = -a / limit[SLOW_DOWN]
    twist = min(limit[JERK_UP] if rising or not falling else math.inf, limit[JERK_DOWN] if falling else math.inf)
    use[3] = (abs(b) / twist) ** (2.0 / 3.0)
    use[4] = q * bend / limit[CENTRIPETAL]
    use[5] = q / bound
    for k in range(axes):
        at = OF_AXES + k
        velocity = abs(d[0, k]) * v * (1.0 + 0.5 * x)
        part1, part2 = d[0, k] * a, d[1, k] * q
        push = abs(part1 + part2) + x * (0.5 * abs(part1) + 1.5 * abs(part2))
        part1, part2, part3 = d[0, k] * b, 3.0 * d[1, k] * v * a, d[2, k] * q * v
        jerk = abs(part1 + part2 + part3)
        jerk += x * (0.5 * abs(part1) + 1.5 * abs(part2) + 2.5 * abs(part3))
        use[6 + 3 * k] = (velocity / limit[at]) ** 2
        use[7 + 3 * k] = push / (limit[at + axes] * calm[0])
        use[8 + 3 * k] = (jerk / (limit[at + 2 * axes] * calm[1])) ** (2.0 / 3.0)


@kernel
def hold_law(
    m: int, edges: Array, owner: IntArray, starts: Array, spans: Array, law: Array, d: Array, bend: Array,
    unsure: Array, bound: Array, edge_top: Array, calm: Array, limit: Array, over: Array,
) -> float:  # fmt: skip
    """By how much q of each piece must come down for its law to keep every limit, over (pieces,); returns the most.

    Velocity counts squared, jerk to the power 2/3: what a factor on q makes of them. Looked at are PLACES of every
    interval between edges (m + 1,), mm, each of which lies in the piece owner (m,) of the law, where d (m, 5, 3, axes)
    and bend (m, 5) say what the path is like; and peaks between them as a parabola through three of them estimates.
    Between two places with unlike feeds INNER instants are looked at, too. A motion that turns back is infinitely over.
    Derivatives are taken as wrong as `unsure` (m, 5) says, see `doubt`: next to C' = 0 large ones cancel.
    starts, spans (pieces,): where pieces begin, mm, and how long they last, s; bound, edge_top (m,): bounds of q in
    intervals and at their starts; calm (m, 2): shares of acceleration and jerk that jumps leave.
    """
    axes = d.shape[3]
    kinds = 6 + 3 * axes
    count = PLACES.shape[0]
    use = np.empty((count, kinds))
    motion = np.empty((count, 3))
    instants = np.empty(count)
    inner = np.empty(3)
    between = np.empty(kinds)
    here_d = np.empty((3, axes))
    for i in range(spans.shape[0]):
        over[i] = 0.0
    worst = 0.0
    for i in range(m):
        piece = owner[i]
        span = spans[piece]
        if span <= 0.0:
            continue
        p = law[piece]
        first = edges[i] - starts[piece]
        h = edges[i + 1] - edges[i]
        whole = ((((p[5] * span + p[4]) * span + p[3]) * span + p[2]) * span + p[1]) * span
        fastest = 0.0
        tau = 0.0
        for j in range(count):
            s = first + PLACES[j] * h
            if s <= 0.0:
                tau = 0.0
            elif s >= whole * (1.0 - 1e-15):
                tau = span
            else:
                tau = instant(p, span, s, min(max(s / whole * span, tau), span))
            instants[j] = tau
            state_at(p, tau, motion[j])
            fastest = max(fastest, abs(motion[j, 1]))
            if not motion[j, 0] > 0.0 and 0.0 < tau < span:
                over[piece] = math.inf
        if h < UNSURE * edges[m] and (piece == owner[0] or piece == owner[m - 1]):
            # next to rest, places of the path are not told apart: the fastest motion is held against all of them
            far = count - 1 if piece == owner[0] else 0
            for j in range(count):
                motion[j] = motion[far]
        for j in range(count):
            # between a place where the feed grows and one where it falls both limits hold
            rising, falling = False, False
            for near in range(max(j - 1, 0), min(j + 2, count)):
                rising = rising or motion[near, 1] > NO_SIGN * fastest
                falling = falling or motion[near, 1] < -NO_SIGN * fastest
            share_of(motion[j], d[i, j], bend[i, j], unsure[i, j], bound[i], calm[i], rising, falling, limit, use[j])
        most = motion[0, 0] * motion[0, 0] / edge_top[i]
        for k in range(kinds):
            for j in range(count):
                here = use[j, k]
                if not here <= math.inf:
                    most = math.inf
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
                most = max(most, here)
        for j in range(count - 1):
            # where the feed changes much, most of the time is spent next to one of the places, and the rest is unseen
            if max(motion[j, 0], motion[j + 1, 0]) <= UNLIKE * min(motion[j, 0], motion[j + 1, 0]):
                continue
            for n in range(INNER):
                tau = instants[j] + (n + 1.0) / (INNER + 1.0) * (instants[j + 1] - instants[j])
                state_at(p, tau, inner)
                if inner[0] < -SMALL_STEP * max(motion[j, 0], motion[j + 1, 0]):
                    most = math.inf
                way = ((((p[5] * tau + p[4]) * tau + p[3]) * tau + p[2]) * tau + p[1]) * tau - first - PLACES[j] * h
                f = min(max(way / ((PLACES[j + 1] - PLACES[j]) * h), 0.0), 1.0)
                for row in range(3):
                    for k in range(axes):
                        here_d[row, k] = (1.0 - f) * d[i, j, row, k] + f * d[i, j + 1, row, k]
                share_of(
                    inner, here_d, (1.0 - f) * bend[i, j] + f * bend[i, j + 1], max(unsure[i, j], unsure[i, j + 1]),
                    bound[i], calm[i], inner[1] > 0.0, inner[1] < 0.0, limit, between,
                )  # fmt: skip
                for k in range(kinds):
                    if not between[k] <= math.inf:
                        most = math.inf
                    most = max(most, between[k])
        over[piece] = max(over[piece], most)
        worst = max(worst, over[piece])
    return worst

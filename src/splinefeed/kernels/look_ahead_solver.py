"""The interior point of a look-ahead window: short travel time within rows of limits, in few banded Newton steps."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.barrier import solve_banded
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_rows import uses
from splinefeed.records import Array

#: Share of the way to a limit that a step may go.
TO_THE_BOUNDARY = 0.95


@kernel
def least_time(
    c: Array, h: Array, ends: Array, ties: Array, linear: Array, offset: Array, jerk: Array, root: Array,
    tolerance: float, most_steps: int, dual: Array, warm: bool, report: Array,
) -> int:  # fmt: skip
    """Coefficients c (n + 2,) of short travel time with every row within +-1, by at most `most_steps` Newton steps.

    minimise sum_i h_i/2 sum_p 1/sqrt(q) + 3 ends/sqrt(q)   subject to   1 - x^2 = slack > 0   for every row x

    A primal-dual interior point from a start that may be over the limits (Nocedal & Wright, Numerical Optimization,
    2nd ed., section 19.3), each pair of limits being one constraint. Of the jerk rows' curvature only what keeps the
    Newton matrix positive is taken; it has five diagonals. A state that is given at an end stays as c has it.
    dual (n, K + M) is kept for a warm start. report gets time, duality gap relative to it, and the largest use.
    Returns the steps taken.
    """
    n, count = linear.shape[0], linear.shape[1]
    total = count + jerk.shape[1]
    each = jerk.shape[1] // 2
    first = 1 if ties[0] >= 0.0 else 2
    last = n if ties[1] >= 0.0 else n - 1
    x = np.empty((n, total))
    slack = np.empty((n, total))
    gradient = np.empty((n, total, 3))
    change = np.empty((n, total))
    feeds = np.empty((n, 2))
    band = np.empty((n + 2, 3))
    right = np.empty(n + 2)
    residual = np.empty(n + 2)
    after = np.empty(n + 2)
    most = uses(c, linear, offset, jerk, root, feeds, x)
    report[2] = most
    if not most < math.inf:
        return 0
    time = 0.0
    for i in range(n):
        time += 0.5 * h[i] * (1.0 / feeds[i, 0] + 1.0 / feeds[i, 1])
    time0 = time
    barrier = 0.05 * time / (n * total)
    for i in range(n):
        for k in range(total):
            slack[i, k] = max(1.0 - x[i, k] * x[i, k], 0.05)
            if not warm:
                dual[i, k] = barrier / slack[i, k]
    steps = 0
    forward = 1.0
    both = 1.0
    for step in range(most_steps):
        steps = step + 1
        band[:] = 0.0
        right[:] = 0.0
        residual[:] = 0.0
        time = 0.0
        gap = 0.0
        for i in range(n):
            for k in range(total):
                gap += dual[i, k] * slack[i, k]
        stride = min(forward, both)
        share = 0.1 if stride > 0.7 else (0.3 if stride > 0.3 else 0.9)
        if most > 1.0:
            share = max(share, 0.5)
        barrier = max(gap, 0.3 * tolerance * time0) / (n * total) * share
        for i in range(n):
            b00 = b01 = b02 = b11 = b12 = b22 = 0.0
            f0 = f1 = f2 = 0.0
            g0 = g1 = g2 = 0.0
            for p in range(2):
                r0, r1, r2 = root[i, p, 0], root[i, p, 1], root[i, p, 2]
                feed = feeds[i, p]
                here = 0.5 * h[i] / feed
                time += here
                power = 0.5 * here / (feed * feed)
                f0 += power * r0
                f1 += power * r1
                f2 += power * r2
                power *= 1.5 / (feed * feed)
                b00 += power * r0 * r0
                b01 += power * r0 * r1
                b02 += power * r0 * r2
                b11 += power * r1 * r1
                b12 += power * r1 * r2
                b22 += power * r2 * r2
            g0, g1, g2 = f0, f1, f2
            for k in range(total):
                if k < count:
                    x0, x1, x2 = linear[i, k, 0], linear[i, k, 1], linear[i, k, 2]
                else:
                    m = k - count
                    p = 0 if m < each else 1
                    feed = feeds[i, p]
                    half = 0.5 * x[i, k] / (feed * feed)
                    x0 = feed * jerk[i, m, 0] + half * root[i, p, 0]
                    x1 = feed * jerk[i, m, 1] + half * root[i, p, 1]
                    x2 = feed * jerk[i, m, 2] + half * root[i, p, 2]
                use = x[i, k]
                y = slack[i, k]
                inverse = 1.0 / y
                z = dual[i, k]
                short = 1.0 - use * use - y
                gradient[i, k, 0] = x0
                gradient[i, k, 1] = x1
                gradient[i, k, 2] = x2
                weight = 2.0 * z * (1.0 + 2.0 * use * use * inverse)
                b00 += weight * x0 * x0
                b01 += weight * x0 * x1
                b02 += weight * x0 * x2
                b11 += weight * x1 * x1
                b12 += weight * x1 * x2
                b22 += weight * x2 * x2
                push = -2.0 * use * (barrier - z * short) * inverse
                f0 += push * x0
                f1 += push * x1
                f2 += push * x2
                pull = -2.0 * use * z
                g0 += pull * x0
                g1 += pull * x1
                g2 += pull * x2
            band[i, 0] += b00
            band[i, 1] += b01
            band[i, 2] += b02
            band[i + 1, 0] += b11
            band[i + 1, 1] += b12
            band[i + 2, 0] += b22
            right[i] += f0
            right[i + 1] += f1
            right[i + 2] += f2
            residual[i] += g0
            residual[i + 1] += g1
            residual[i + 2] += g2
        for e in range(2):
            if ties[e] >= 0.0:
                at = 1 if e == 0 else n
                q = ties[e] * c[at]
                here = 3.0 * ends[e] / math.sqrt(q)
                time += here
                right[at] += 0.5 * here / c[at]
                residual[at] += 0.5 * here / c[at]
                band[at, 0] += 0.75 * here / (c[at] * c[at])
        wrong = 0.0
        for i in range(first, last + 1):
            wrong += abs(residual[i] * c[i])
            band[i, 0] *= 1.0 + 1e-13
        report[0] = time
        report[1] = gap / time
        if most <= 1.0 and gap <= tolerance * time and wrong <= 3.0 * gap:
            break
        for i in range(first):
            right[i] = 0.0
        for i in range(last + 1, n + 2):
            right[i] = 0.0
        if not solve_banded(band, right, first, last):
            break
        forward = 1.0
        for i in range(first, last + 1):
            if right[i] < -0.9 * c[i]:
                forward = min(forward, -0.9 * c[i] / right[i])
        both = 1.0
        for i in range(n):
            d0, d1, d2 = right[i], right[i + 1], right[i + 2]
            for k in range(total):
                turn = gradient[i, k, 0] * d0 + gradient[i, k, 1] * d1 + gradient[i, k, 2] * d2
                use = x[i, k]
                y = slack[i, k]
                grow = 1.0 - use * use - y - 2.0 * use * turn
                if grow < 0.0:
                    forward = min(forward, -TO_THE_BOUNDARY * y / grow)
                rise = barrier / y - dual[i, k] * (1.0 + grow / y)
                change[i, k] = rise
                gradient[i, k, 0] = grow
                if rise < 0.0:
                    both = min(both, -TO_THE_BOUNDARY * dual[i, k] / rise)
        inside = most < 1.0  # who has come within the limits stays there
        for _ in range(30):
            for i in range(n + 2):
                after[i] = c[i] + forward * right[i]
            if ties[0] >= 0.0:
                after[0] = ties[0] * after[1]
            if ties[1] >= 0.0:
                after[n + 1] = ties[1] * after[n]
            most = uses(after, linear, offset, jerk, root, feeds, x)
            if most < 1.0 or (most < math.inf and not inside):
                break
            forward *= 0.5
        for i in range(n + 2):
            c[i] = after[i]
        for i in range(n):
            for k in range(total):
                dual[i, k] += both * change[i, k]
                true = 1.0 - x[i, k] * x[i, k]
                y = slack[i, k] + forward * gradient[i, k, 0]
                # a true slack that has room is taken as it is; one that has not keeps its own
                slack[i, k] = true if true > 0.1 * slack[i, k] else max(y, 0.05 * slack[i, k])
        report[2] = most
    return steps

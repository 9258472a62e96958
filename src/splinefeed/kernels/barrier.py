"""A primal-dual interior point for feed^2 along a path: convex time, linear limits, axis jerk, in banded arithmetic."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array

#: Each step goes this far towards the nearest limit at most.
TO_THE_BOUNDARY = 0.995
#: A slack may shrink to this share in one step; the true slack, not its linear forecast, is looked at.
SHRINK = 0.005
#: The barrier falls by this factor when the point is near the central path.
BARRIER = 0.2
#: Halvings of a step that would cross a limit.
MAX_HALVINGS = 40


@kernel
def slacks(
    c: Array,
    linear: Array,
    bound: Array,
    jerk: Array,
    root: Array,
    jump: Array,
    slack: Array,
    gradient: Array,
    want: bool,
) -> float:
    """Room to every limit at c, and its gradient rows; returns the least room.

    linear (n, K, 3), bound (n, K):  slack = bound - linear . (c_i, c_i+1, c_i+2)
    jerk, root (n, M, 3):            slack = 1 -+ sqrt(root . c) (jerk . c) - jump (root . c), twice M of them
    jump (n, M, 2):                  what jumps of the curvature take of that, for either sign
    slack (n, K + 2 M), gradient (n, K + 2 M, 3) of what is subtracted.
    """
    least = math.inf
    n, count = bound.shape
    for i in range(n):
        c0, c1, c2 = c[i], c[i + 1], c[i + 2]
        for k in range(count):
            value = bound[i, k] - (linear[i, k, 0] * c0 + linear[i, k, 1] * c1 + linear[i, k, 2] * c2)
            slack[i, k] = value
            least = min(least, value)
            if want:
                gradient[i, k, 0] = linear[i, k, 0]
                gradient[i, k, 1] = linear[i, k, 1]
                gradient[i, k, 2] = linear[i, k, 2]
        for m in range(jerk.shape[1]):
            q = root[i, m, 0] * c0 + root[i, m, 1] * c1 + root[i, m, 2] * c2
            if not q > 0.0:
                return -1.0
            rate = jerk[i, m, 0] * c0 + jerk[i, m, 1] * c1 + jerk[i, m, 2] * c2
            feed = math.sqrt(q)
            at = count + 2 * m
            up, down = jump[i, m, 0], jump[i, m, 1]
            slack[i, at] = 1.0 - feed * rate - up * q
            slack[i, at + 1] = 1.0 + feed * rate - down * q
            least = min(least, slack[i, at], slack[i, at + 1])
            if want:
                half = 0.5 * rate / feed
                for a in range(3):
                    slope = feed * jerk[i, m, a] + half * root[i, m, a]
                    gradient[i, at, a] = slope + up * root[i, m, a]
                    gradient[i, at + 1, a] = down * root[i, m, a] - slope
    return least


@kernel
def travel_time(c: Array, rows: Array, weights: Array, ends: Array) -> float:
    """Time = sum_i sum_g weights / sqrt(rows . c) plus the two end cells, ends (2, 3): 3 length / sqrt(q) there.

    rows (n, G, 3), weights (n, G): Gauss quadrature of ds / sqrt(q). ends[e] = (length of the end cell or 0, q / c of
    its inner end, index of that c). Infinite where q is not positive.
    """
    total = 0.0
    for i in range(weights.shape[0]):
        for g in range(weights.shape[1]):
            q = rows[i, g, 0] * c[i] + rows[i, g, 1] * c[i + 1] + rows[i, g, 2] * c[i + 2]
            if not q > 0.0:
                return math.inf
            total += weights[i, g] / math.sqrt(q)
    for e in range(2):
        if ends[e, 0] > 0.0:
            total += 3.0 * ends[e, 0] / math.sqrt(ends[e, 1] * c[int(ends[e, 2])])
    return total


@kernel
def solve_banded(band: Array, right: Array, first: int, last: int) -> bool:
    """Solve a symmetric positive pentadiagonal system in place for unknowns first ... last; False if not positive.

    band (n, 3): diagonal, first and second superdiagonal of row i; L D L^T without pivoting (Golub & Van Loan,
    Matrix Computations, 4th ed., section 4.3.6).
    """
    for i in range(first, last + 1):
        d = band[i, 0]
        if i - 1 >= first:
            d -= band[i - 1, 1] * band[i - 1, 1] * band[i - 1, 0]
        if i - 2 >= first:
            d -= band[i - 2, 2] * band[i - 2, 2] * band[i - 2, 0]
        if not d > 0.0:
            return False
        e = band[i, 1]
        if i - 1 >= first:
            e -= band[i - 1, 1] * band[i - 1, 2] * band[i - 1, 0]
        band[i, 0] = d
        band[i, 1] = e / d if i < last else 0.0
        band[i, 2] = band[i, 2] / d if i + 1 < last else 0.0
    for i in range(first, last + 1):
        if i - 1 >= first:
            right[i] -= band[i - 1, 1] * right[i - 1]
        if i - 2 >= first:
            right[i] -= band[i - 2, 2] * right[i - 2]
    for i in range(last, first - 1, -1):
        right[i] /= band[i, 0]
        if i < last:
            right[i] -= band[i, 1] * right[i + 1]
        if i + 1 < last:
            right[i] -= band[i, 2] * right[i + 2]
    return True


@kernel
def least_time(
    c: Array,
    linear: Array,
    bound: Array,
    jerk: Array,
    root: Array,
    jump: Array,
    rows: Array,
    weights: Array,
    ends: Array,
    first: int,
    last: int,
    tolerance: float,
    max_steps: int,
    dual: Array,
    warm: bool,
    report: Array,
) -> int:
    """Least travel time over the coefficients c (n + 2,) under all limits; c must keep them all with room at the start.

    minimise sum w / sqrt(q)  subject to  linear . c <= bound,  |sqrt(q) (jerk . c)| + jump q <= 1

    A primal-dual interior point (Nocedal & Wright, Numerical Optimization, 2nd ed., chapter 19) whose Newton matrix is
    pentadiagonal, as c_i meets its two neighbours only. The curvature of the jerk limits is left out of that matrix,
    which keeps it positive; their values and slopes are exact, so what it converges to keeps the true limits.
    Unknowns are c[first ... last]. dual (n, K + 2 M) is kept for a warm start.
    report gets time, duality gap and dual residual, relative to the time. Returns the steps taken, negative if the
    start does not keep the limits.
    """
    n, count = bound.shape
    total = count + 2 * jerk.shape[1]
    slack = np.empty((n, total))
    trial = np.empty((n, total))
    gradient = np.empty((n, total, 3))
    band = np.empty((n + 2, 3))
    right = np.empty(n + 2)
    after = np.empty(n + 2)
    if not slacks(c, linear, bound, jerk, root, jump, slack, gradient, True) > 0.0:
        return -1
    time = travel_time(c, rows, weights, ends)
    if not warm:
        barrier = 0.1 * time / (n * total)
        for i in range(n):
            for k in range(total):
                dual[i, k] = barrier / slack[i, k]
    steps = 0
    for step in range(max_steps):
        steps = step
        gap = 0.0
        for i in range(n):
            for k in range(total):
                gap += dual[i, k] * slack[i, k]
        # gradient of time and of the limits' multipliers: the dual residual
        band[:] = 0.0
        right[:] = 0.0
        for i in range(n):
            for g in range(weights.shape[1]):
                r0, r1, r2 = rows[i, g, 0], rows[i, g, 1], rows[i, g, 2]
                q = r0 * c[i] + r1 * c[i + 1] + r2 * c[i + 2]
                power = weights[i, g] / (q * math.sqrt(q))
                right[i] += 0.5 * power * r0
                right[i + 1] += 0.5 * power * r1
                right[i + 2] += 0.5 * power * r2
                power *= 0.75 / q
                band[i, 0] += power * r0 * r0
                band[i, 1] += power * r0 * r1
                band[i, 2] += power * r0 * r2
                band[i + 1, 0] += power * r1 * r1
                band[i + 1, 1] += power * r1 * r2
                band[i + 2, 0] += power * r2 * r2
        for e in range(2):
            if ends[e, 0] > 0.0:
                at = int(ends[e, 2])
                q = ends[e, 1] * c[at]
                power = 3.0 * ends[e, 0] / (q * math.sqrt(q)) * ends[e, 1]
                right[at] += 0.5 * power
                band[at, 0] += 0.75 * power / q * ends[e, 1]
        for i in range(n + 2):
            after[i] = right[i]
        for i in range(n):
            s0 = 0.0
            s1 = 0.0
            s2 = 0.0
            for k in range(total):
                s0 += dual[i, k] * gradient[i, k, 0]
                s1 += dual[i, k] * gradient[i, k, 1]
                s2 += dual[i, k] * gradient[i, k, 2]
            after[i] -= s0
            after[i + 1] -= s1
            after[i + 2] -= s2
        residual = 0.0
        for i in range(first, last + 1):
            residual += abs(after[i] * c[i])
        report[0] = time
        report[1] = gap / time
        report[2] = residual / time
        if gap <= tolerance * time and residual <= 10.0 * tolerance * time:
            break
        barrier = gap / (n * total)
        if residual < 10.0 * gap:
            barrier *= BARRIER
        for i in range(n):
            for k in range(total):
                g0, g1, g2 = gradient[i, k, 0], gradient[i, k, 1], gradient[i, k, 2]
                push = barrier / slack[i, k]
                weight = dual[i, k] / slack[i, k]
                right[i] -= push * g0
                right[i + 1] -= push * g1
                right[i + 2] -= push * g2
                band[i, 0] += weight * g0 * g0
                band[i, 1] += weight * g0 * g1
                band[i, 2] += weight * g0 * g2
                band[i + 1, 0] += weight * g1 * g1
                band[i + 1, 1] += weight * g1 * g2
                band[i + 2, 0] += weight * g2 * g2
        for i in range(first):
            right[i] = 0.0
        for i in range(last + 1, n + 2):
            right[i] = 0.0
        for i in range(n + 2):
            band[i, 0] *= 1.0 + 1e-13  # rounding must not make it indefinite
        if not solve_banded(band, right, first, last):
            break
        # how far until a limit or a multiplier would be crossed
        primal = 1.0
        both = 1.0
        for i in range(n):
            for k in range(total):
                change = -(
                    gradient[i, k, 0] * right[i] + gradient[i, k, 1] * right[i + 1] + gradient[i, k, 2] * right[i + 2]
                )
                if change < 0.0:
                    primal = min(primal, -TO_THE_BOUNDARY * slack[i, k] / change)
                dual_change = (barrier - dual[i, k] * (slack[i, k] + change)) / slack[i, k]
                trial[i, k] = dual_change
                if dual_change < 0.0:
                    both = min(both, -TO_THE_BOUNDARY * dual[i, k] / dual_change)
        for i in range(n):
            for k in range(total):
                dual[i, k] += both * trial[i, k]
        for _ in range(MAX_HALVINGS):
            for i in range(n + 2):
                after[i] = c[i] + primal * right[i]
            fits = slacks(after, linear, bound, jerk, root, jump, trial, gradient, False) > 0.0
            if fits:
                for i in range(n):
                    for k in range(total):
                        if trial[i, k] < SHRINK * slack[i, k]:
                            fits = False
            if fits and travel_time(after, rows, weights, ends) < math.inf:
                break
            primal *= 0.7
        else:
            break
        for i in range(n + 2):
            c[i] = after[i]
        slacks(c, linear, bound, jerk, root, jump, slack, gradient, True)
        time = travel_time(c, rows, weights, ends)
    return steps

"""Arithmetic of the look-ahead window: its cells, limits as rows, least time by a short interior point, and its law.

q = feed^2 is a quadratic spline on cells of the path, q' continuous, one coefficient a cell and one at each end:

    q_i = (h_i c_i + h_(i-1) c_(i+1)) / (h_(i-1) + h_i)      q_i' = 2 (c_(i+1) - c_i) / (h_(i-1) + h_i)

at the node before cell i. An axis has velocity r' sqrt(q), acceleration r' q'/2 + r'' q and jerk
sqrt(q) (r' q''/2 + 3/2 r'' q' + r''' q), with r(s) the path by arc length.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import START, Shape, derivatives
from splinefeed.records import Array

#: Places of `limit`: feed, tangential acceleration, deceleration and jerk, centripetal, chord error, period (0: none);
#: then velocity, acceleration and jerk of each axis. Infinite where there is none.
FEED, SPEED_UP, SLOW_DOWN, JERK, CENTRIPETAL, CHORD, PERIOD, OF_AXES = 0, 1, 2, 3, 4, 5, 6, 7

#: Fractions of a cell at which its law is looked at. At the two Gauss points, the second and the fourth, limits are
#: asked for as rows; they give the time too.
PLACES = np.array([0.0, 0.5 - math.sqrt(1.0 / 12.0), 0.5, 0.5 + math.sqrt(1.0 / 12.0), 1.0])
#: Share of the way to a limit that a step may go.
TO_THE_BOUNDARY = 0.95


@kernel
def along(table: Array, row: int, shape: Shape, t: float, work: Array, out: Array) -> float:
    """r', r'', r''' by arc length at t of one row, into out (3, axes); returns |r''| over the linear axes, 1/mm.

    u_s = 1/c, u_ss = -(C'.C'')/c^4, u_sss = 4 (C'.C'')^2/c^7 - (C''.C'' + C'.C''')/c^5, c = |C'|. work (4, axes).
    """
    derivatives(table, row, shape, t, 3, work)
    square = 0.0
    product = 0.0
    third = 0.0
    for k in range(shape[2]):
        square += work[1, k] * work[1, k]
        product += work[1, k] * work[2, k]
        third += work[2, k] * work[2, k] + work[1, k] * work[3, k]
    c = math.sqrt(square)
    us = 1.0 / c
    uss = -product / (square * square)
    usss = 4.0 * product * product / (square * square * square * c) - third / (square * square * c)
    bend = 0.0
    for k in range(shape[1]):
        out[0, k] = work[1, k] * us
        out[1, k] = work[2, k] * us * us + work[1, k] * uss
        out[2, k] = work[3, k] * us * us * us + 3.0 * work[2, k] * us * uss + work[1, k] * usss
        if k < shape[2]:
            bend += out[1, k] * out[1, k]
    return math.sqrt(bend)


@kernel
def place(table: Array, row: int, last: int, s: float) -> tuple[int, float]:
    """Row, walking on from `row` to `last` at most, and t in it, at arc length s, mm."""
    while row < last and s >= table[row + 1, START]:
        row += 1
    while row > 0 and s < table[row, START]:
        row -= 1
    end = table[row + 1, START] if row + 1 < table.shape[0] else arc_length(table, row, 1.0)
    whole = end - table[row, START]
    ahead = min(max(s - table[row, START], 0.0), whole)
    if whole <= 0.0:
        return row, 0.0
    return row, parameter_in_row(table, row, table[row, START] + ahead, 2.0 * ahead / whole - 1.0)


@kernel
def still_top(d: Array, kappa: float, limit: Array) -> float:
    """Largest q that feed, axis velocity and centripetal acceleration allow at derivatives d (3, axes), mm^2/s^2."""
    axes = d.shape[1]
    top = limit[FEED] * limit[FEED]
    for k in range(axes):
        velocity = limit[OF_AXES + k]
        slope = abs(d[0, k])
        if velocity < slope * math.sqrt(top):
            top = (velocity / slope) ** 2
    if kappa * top > limit[CENTRIPETAL]:
        top = limit[CENTRIPETAL] / kappa
    return top


@kernel
def chord_top(kappa: float, limit: Array) -> float:
    """Largest q at which a step of the period on a curve of curvature <= kappa stays within the chord error.

    A step of length v T leaves its chord by at most delta if v^2 T^2 <= 4 (2 delta/kappa - delta^2), delta <= 1/kappa.
    """
    if not (limit[CHORD] < math.inf and limit[PERIOD] > 0.0) or kappa <= 0.0:
        return math.inf
    delta = min(limit[CHORD], 1.0 / kappa)
    return 4.0 * (2.0 * delta / kappa - delta * delta) / (limit[PERIOD] * limit[PERIOD])


@kernel
def turn_top(d: Array, limit: Array) -> float:
    """Largest q that axis acceleration and jerk leave to a steady feed: |r''| q <= A, |r'''| q^(3/2) <= J."""
    axes = d.shape[1]
    top = math.inf
    for k in range(axes):
        bend = abs(d[1, k])
        if bend * top > limit[OF_AXES + axes + k]:
            top = limit[OF_AXES + axes + k] / bend
        twist = abs(d[2, k])
        most = limit[OF_AXES + 2 * axes + k]
        if twist > 0.0 and most < math.inf:
            top = min(top, (most / twist) ** (2.0 / 3.0))
    return top


@kernel
def push_twist(d: Array, limit: Array) -> tuple[float, float]:
    """Largest tangential acceleration and jerk that the limits leave on a straight course along d[0]."""
    axes = d.shape[1]
    push = min(limit[SPEED_UP], limit[SLOW_DOWN])
    twist = limit[JERK]
    for k in range(axes):
        slope = abs(d[0, k])
        if slope > 0.0:
            push = min(push, limit[OF_AXES + axes + k] / slope)
            twist = min(twist, limit[OF_AXES + 2 * axes + k] / slope)
    return push, twist


@kernel
def fill_rows(
    n: int, h: Array, ties: Array, d: Array, top: Array, node_top: Array, scale: Array, calm: Array, limit: Array,
    linear: Array, offset: Array, jerk: Array, root: Array,
) -> None:  # fmt: skip
    """Write the limits of every cell as rows on (c_i, c_(i+1), c_(i+2)), each limit being |row| <= 1.

    h (n,) mm; ties (2,): c_0 = ties[0] c_1 and c_(n+1) = ties[1] c_n at ends that rest, negative where the state is
    given; d (n, 5, 3, axes) derivatives at PLACES; top (n, 2), node_top (n + 1,) bounds of q at Gauss places and nodes;
    scale (n,) part of every limit that a cell may use, put as a factor on q; calm (n, 2) part of the axes' limits of
    acceleration and jerk;
    linear (n, K, 3) with offset (K,), jerk (n, M, 3) to be multiplied by sqrt(root . c), root (n, 2, 3).
    """
    axes = d.shape[3]
    b = np.empty((3, 3))
    value = np.empty(3)
    slope = np.empty(3)
    second = np.empty(3)
    offset[:] = 0.0
    for i in range(n):
        before = h[i - 1] if i > 0 else 0.0
        after = h[i + 1] if i + 1 < n else 0.0
        left = before / (before + h[i])
        right = h[i] / (h[i] + after)
        b[0, 0], b[0, 1], b[0, 2] = 1.0 - left, left, 0.0
        b[1, 0], b[1, 1], b[1, 2] = 0.0, 1.0, 0.0
        b[2, 0], b[2, 1], b[2, 2] = 0.0, 1.0 - right, right
        if i == 0 and ties[0] >= 0.0:
            for a in range(3):
                b[a, 1] += ties[0] * b[a, 0]
                b[a, 0] = 0.0
        if i == n - 1 and ties[1] >= 0.0:
            for a in range(3):
                b[a, 1] += ties[1] * b[a, 2]
                b[a, 2] = 0.0
        push = scale[i] * calm[i, 0]
        twist = scale[i] * math.sqrt(scale[i]) * calm[i, 1]
        for a in range(3):
            second[a] = 2.0 * (b[0, a] - 2.0 * b[1, a] + b[2, a]) / (h[i] * h[i])
        k = 0
        m = 0
        end = i == n - 1 and ties[1] >= 0.0 and node_top[n] < node_top[i]
        for a in range(3):
            linear[i, k, a] = b[2 if end else 0, a] / (node_top[n if end else i] * scale[i])
        k += 1
        for p in range(2):
            f = PLACES[2 * p + 1]
            for a in range(3):
                value[a] = (1.0 - f) ** 2 * b[0, a] + 2.0 * f * (1.0 - f) * b[1, a] + f * f * b[2, a]
                slope[a] = 2.0 * ((1.0 - f) * (b[1, a] - b[0, a]) + f * (b[2, a] - b[1, a])) / h[i]
                root[i, p, a] = value[a]
                linear[i, k, a] = value[a] / (top[i, p] * scale[i])
            k += 1
            if limit[SPEED_UP] < math.inf or limit[SLOW_DOWN] < math.inf:
                up = min(limit[SPEED_UP], 1e3 * limit[SLOW_DOWN])
                down = min(limit[SLOW_DOWN], 1e3 * limit[SPEED_UP])
                for a in range(3):
                    linear[i, k, a] = slope[a] / ((up + down) * scale[i])
                offset[k] = -(up - down) / (up + down)
                k += 1
            if limit[JERK] < math.inf:
                for a in range(3):
                    jerk[i, m, a] = 0.5 * second[a] / (limit[JERK] * scale[i] * math.sqrt(scale[i]))
                m += 1
            for axis in range(axes):
                d1, d2, d3 = d[i, 2 * p + 1, 0, axis], d[i, 2 * p + 1, 1, axis], d[i, 2 * p + 1, 2, axis]
                if limit[OF_AXES + axes + axis] < math.inf:
                    most = limit[OF_AXES + axes + axis] * push
                    for a in range(3):
                        linear[i, k, a] = (0.5 * d1 * slope[a] + d2 * value[a]) / most
                    k += 1
                if limit[OF_AXES + 2 * axes + axis] < math.inf:
                    most = limit[OF_AXES + 2 * axes + axis] * twist
                    for a in range(3):
                        jerk[i, m, a] = (0.5 * d1 * second[a] + 1.5 * d2 * slope[a] + d3 * value[a]) / most
                    m += 1


@kernel
def uses(c: Array, linear: Array, offset: Array, jerk: Array, root: Array, feeds: Array, x: Array) -> float:
    """How much of each limit c uses, into x (n, K + M), and feeds (n, 2) at the Gauss places; returns the most."""
    n, count = linear.shape[0], linear.shape[1]
    each = jerk.shape[1] // 2
    most = 0.0
    for i in range(n):
        c0, c1, c2 = c[i], c[i + 1], c[i + 2]
        for p in range(2):
            q = root[i, p, 0] * c0 + root[i, p, 1] * c1 + root[i, p, 2] * c2
            if not q > 0.0:
                return math.inf
            feeds[i, p] = math.sqrt(q)
        for k in range(count):
            x[i, k] = linear[i, k, 0] * c0 + linear[i, k, 1] * c1 + linear[i, k, 2] * c2 + offset[k]
            most = max(most, abs(x[i, k]))
        for m in range(2 * each):
            rate = jerk[i, m, 0] * c0 + jerk[i, m, 1] * c1 + jerk[i, m, 2] * c2
            x[i, count + m] = (feeds[i, 0] if m < each else feeds[i, 1]) * rate
            most = max(most, abs(x[i, count + m]))
    return most


@kernel
def _solve(band: Array, right: Array, first: int, last: int) -> bool:
    """Solve a symmetric positive pentadiagonal system in place for unknowns first ... last; False if not positive.

    band (n, 3): diagonal and two superdiagonals; L D L^T without pivoting (Golub & Van Loan, Matrix Computations,
    4th ed., section 4.3.6).
    """
    e1 = 0.0  # L[i, i-1] D[i-1] of the row before, and what the one before that leaves
    for i in range(first, last + 1):
        d = band[i, 0]
        e = band[i, 1]
        if i > first:
            d -= band[i - 1, 1] * band[i - 1, 1] * band[i - 1, 0]
            e -= band[i - 1, 1] * band[i - 1, 2] * band[i - 1, 0]
            right[i] -= band[i - 1, 1] * right[i - 1]
        if i > first + 1:
            d -= band[i - 2, 2] * band[i - 2, 2] * band[i - 2, 0]
            right[i] -= band[i - 2, 2] * right[i - 2]
        if not d > 0.0:
            return False
        band[i, 0] = d
        band[i, 1] = e / d if i < last else e1
        band[i, 2] = band[i, 2] / d if i + 1 < last else 0.0
    for i in range(last, first - 1, -1):
        right[i] /= band[i, 0]
        if i < last:
            right[i] -= band[i, 1] * right[i + 1]
        if i + 1 < last:
            right[i] -= band[i, 2] * right[i + 2]
    return True


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
        if not _solve(band, right, first, last):
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
        for _ in range(30):
            for i in range(n + 2):
                after[i] = c[i] + forward * right[i]
            if ties[0] >= 0.0:
                after[0] = ties[0] * after[1]
            if ties[1] >= 0.0:
                after[n + 1] = ties[1] * after[n]
            most = uses(after, linear, offset, jerk, root, feeds, x)
            if most < math.inf:
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

"""The limits of a look-ahead window as rows on the coefficients of its q, and a first guess of them.

q = feed^2 is a quadratic spline on cells of the path, q' continuous, one coefficient a cell and one at each end:

    q_i = (h_i c_i + h_(i-1) c_(i+1)) / (h_(i-1) + h_i)      q_i' = 2 (c_(i+1) - c_i) / (h_(i-1) + h_i)

at the node before cell i. An axis has velocity r' sqrt(q), acceleration r' q'/2 + r'' q and jerk
sqrt(q) (r' q''/2 + 3/2 r'' q' + r''' q), with r(s) the path by arc length.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_cells import PLACES
from splinefeed.kernels.look_ahead_path import JERK_DOWN, JERK_UP, OF_AXES, SLOW_DOWN, SPEED_UP, push_twist, turn_top
from splinefeed.records import Array

#: Where acceleration along the path must have one sign it is at least this share of what it may be, or of the feed
#: squared that a cell may gain.
ONE_WAY = 1e-4
#: Where a cell uses more of its limits than ENOUGH, q is lowered to what uses PULL of them, in so many rounds; first
#: what is higher in it than UNEVEN times the lowest.
ENOUGH, PULL, MOST_PULLS, UNEVEN = 0.9, 0.7, 400, 1.3


@kernel
def fill_rows(
    n: int, h: Array, ties: Array, d: Array, top: Array, node_top: Array, scale: Array, calm: Array,
    steepest: Array, sign: Array, limit: Array, linear: Array, offset: Array, jerk: Array, root: Array,
) -> None:  # fmt: skip
    """Write the limits of every cell as rows on (c_i, c_(i+1), c_(i+2)), each limit being |row| <= 1.

    h (n,) mm; ties (2,): c_0 = ties[0] c_1 and c_(n+1) = ties[1] c_n at ends that rest, negative where the state is
    given; d (n, 5, 3, axes) derivatives at PLACES; top (n, 2), node_top (n + 1,) bounds of q at Gauss places and nodes;
    scale (n,) part of every limit that a cell may use, put as a factor on q; calm (n, 2) part of the axes' limits of
    acceleration and jerk; steepest (n,) tangential jerk, mm/s^3, and sign (n,): 1
    where acceleration along the path must stay positive for it, -1 negative, 0 either;
    linear (n, K, 3) with offset (n, K), jerk (n, M, 3) to be multiplied by sqrt(root . c), root (n, 2, 3).
    """
    axes = d.shape[3]
    b = np.empty((3, 3))
    value = np.empty(3)
    slope = np.empty(3)
    second = np.empty(3)
    offset[:] = 0.0
    tangential = min(limit[SPEED_UP], limit[SLOW_DOWN]) < math.inf or limit[JERK_UP] != limit[JERK_DOWN]
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
            if tangential:
                # beside a limit that is 1000 times looser, or where there is none, any that is never met will do
                up = min(limit[SPEED_UP], 1e3 * limit[SLOW_DOWN], 1e3 * top[i, p] / h[i])
                down = min(limit[SLOW_DOWN], 1e3 * limit[SPEED_UP], 1e3 * top[i, p] / h[i])
                if sign[i] > 0.0:
                    down = -ONE_WAY * min(up, top[i, p] / h[i])
                elif sign[i] < 0.0:
                    up = -ONE_WAY * min(down, top[i, p] / h[i])
                for a in range(3):
                    at_node = 2.0 * (b[p + 1, a] - b[p, a]) / h[i]
                    linear[i, k, a] = (at_node if sign[i] != 0.0 else slope[a]) / ((up + down) * scale[i])
                offset[i, k] = -(up - down) / (up + down)
                k += 1
            if min(limit[JERK_UP], limit[JERK_DOWN]) < math.inf:
                for a in range(3):
                    jerk[i, m, a] = 0.5 * second[a] / (steepest[i] * scale[i] * math.sqrt(scale[i]))
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
            x[i, k] = linear[i, k, 0] * c0 + linear[i, k, 1] * c1 + linear[i, k, 2] * c2 + offset[i, k]
            most = max(most, abs(x[i, k]))
        for m in range(2 * each):
            rate = jerk[i, m, 0] * c0 + jerk[i, m, 1] * c1 + jerk[i, m, 2] * c2
            x[i, count + m] = (feeds[i, 0] if m < each else feeds[i, 1]) * rate
            most = max(most, abs(x[i, count + m]))
    return most


@kernel
def guess(n: int, nodes: Array, d: Array, top: Array, node_top: Array, limit: Array, ends: Array, c: Array) -> None:
    """A first c (n + 2,) of about the right size: what caps allow, joined at half the acceleration there is.

    d (n, 5, 3, axes) derivatives of the cells at PLACES. Where an end does not rest, its c is there.
    """
    for i in range(n):
        q = min(node_top[i], node_top[i + 1])
        for p in range(2):
            q = min(q, top[i, p], 0.5 * turn_top(d[i, 2 * p + 1], limit))
        if i == 0 and ends[0] <= 0.0:
            q = min(q, c[1])
        if i == n - 1 and ends[1] <= 0.0:
            q = min(q, c[n])
        c[i + 1] = q
    for direction in range(2):
        valley = 0 if direction == 0 else n - 1
        low = math.sqrt(c[valley + 1])
        for k in range(n - 1):
            i = k + 1 if direction == 0 else n - 2 - k
            push, twist = push_twist(d[i, 2], limit)
            j = i - 1 if direction == 0 else i + 1
            apart = 0.5 * abs(nodes[i + 1] + nodes[i] - nodes[j + 1] - nodes[j])
            most = c[j + 1] + push * apart
            if twist < math.inf:
                # from the valley before it, acceleration builds up at a quarter of the jerk
                apart = 0.5 * abs(nodes[i + 1] + nodes[i] - nodes[valley + 1] - nodes[valley])
                build = 0.25 * twist
                dt = 1.0 / (low / apart + (build / (6.0 * apart)) ** (1.0 / 3.0))
                most = min(most, (low + 0.5 * build * dt * dt) ** 2)
                distance = nodes[i] - nodes[0] + ends[0] if direction == 0 else nodes[n] - nodes[i + 1] + ends[1]
                if distance > 0.0 and ends[direction] > 0.0:
                    most = min(most, (2.0 * twist * distance * distance) ** (2.0 / 3.0))
            if c[i + 1] <= most:
                valley = i
                low = math.sqrt(c[i + 1])
            else:
                c[i + 1] = most


@kernel
def pull_in(c: Array, ties: Array, linear: Array, offset: Array, jerk: Array, root: Array) -> bool:
    """Lower c (n + 2,) where rows use more than ENOUGH of what there is, until none does, in MOST_PULLS rounds.

    First what is higher than its neighbours comes down, then a cell as a whole: so from a place where the limits leave
    next to nothing c grows as fast as they let it. A state that is given at an end stays as c has it. Returns whether c
    is within all rows.
    """
    n, count = linear.shape[0], linear.shape[1]
    each = jerk.shape[1] // 2
    feeds = np.empty((n, 2))
    x = np.empty((n, count + jerk.shape[1]))
    after = np.empty(n + 2)
    first = 1 if ties[0] >= 0.0 else 2
    last = n if ties[1] >= 0.0 else n - 1
    for _ in range(MOST_PULLS):
        worst = uses(c, linear, offset, jerk, root, feeds, x)
        if not worst < math.inf:
            return False
        after[:] = c
        done = True
        for i in range(n):
            most = 0.0
            for k in range(count):
                room = 1.0 - offset[i, k] if x[i, k] > offset[i, k] else 1.0 + offset[i, k]
                if room > 0.0:
                    most = max(most, abs(x[i, k] - offset[i, k]) / room)
            for m in range(2 * each):
                most = max(most, abs(x[i, count + m]) ** (2.0 / 3.0))
            if most <= ENOUGH:
                continue
            done = False
            begin, end = max(i, first), min(i + 2, last)
            if begin > end:
                return False
            low = np.min(c[begin : end + 1])
            flat = np.max(c[begin : end + 1]) <= UNEVEN * low
            for j in range(begin, end + 1):
                wanted = PULL / most * c[j]
                after[j] = min(after[j], wanted if flat else max(wanted, low))
        if done:
            return worst < 1.0
        for j in range(first, last + 1):
            c[j] = after[j]
        if ties[0] >= 0.0:
            c[0] = ties[0] * c[1]
        if ties[1] >= 0.0:
            c[n + 1] = ties[1] * c[n]
    return False

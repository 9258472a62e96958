"""Cells of a look-ahead window: where they lie, the path's derivatives in them, and what bounds the feed there."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead import (
    CHORD,
    OF_AXES,
    PERIOD,
    PLACES,
    along,
    chord_top,
    place,
    push_twist,
    still_top,
    turn_top,
)
from splinefeed.kernels.pieces import START, Shape, find_row
from splinefeed.records import Array

#: A cell lasts no longer than this many times that in which jerk builds up acceleration, ...
BUILDS = 2.5
#: ... is no longer than this many pieces of arc length, ...
PIECES = 3.0
#: ... and no shorter than this share of what lasts so long.
LEAST_SHARE = 0.012
#: A cell turns by no more than this, rad.
TURN = 0.28
#: From one cell to the next the length grows by this share of the distance at most.
GROWTH = 0.6
#: The ramp at rest is this share of the length in which acceleration builds up.
RAMP_SHARE = 0.3
#: Derivatives that differ by less than this across a row's end, relative, do not jump.
NO_JUMP = 1e-7
#: A row shorter than this share of its neighbours over which r''' changes by that share has nodes at its ends.
SHORT, ABRUPT = 0.3, 0.1
#: A jump of velocity or acceleration may use this much of the limits that a drive sees; the smooth motion the rest.
JUMP_SHARE = 0.5


@kernel
def jump_top(sum1: float, sum2: float, axis: int, axes: int, limit: Array) -> float:
    """Largest q at jumps sum1 of r' and sum2 of r'' of one axis, by the share of its limits that they may use."""
    top = math.inf
    period = limit[PERIOD]
    a = JUMP_SHARE * limit[OF_AXES + axes + axis]
    j = JUMP_SHARE * limit[OF_AXES + 2 * axes + axis]
    if period > 0.0 and sum1 > 0.0:
        top = min(top, (min(0.5 * j * period, a) * period / sum1) ** 2)
    if period > 0.0 and sum2 > 0.0:
        top = min(top, j * period / (0.75 * sum2) * (0.5 if sum1 > 0.0 else 1.0))
    return top


@kernel
def lay_cells(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, rest: Array, widest: Array, limit: Array,
    nodes: Array, ends: Array, jumps: Array, samples: Array,
) -> int:  # fmt: skip
    """Cut [low, high], mm, into cells of about even time; how many, or -1 if `nodes` has no room.

    feeds (rows,): largest feed on each row of the table, mm/s;
    rest (2,): 1 where an end is at rest, whose ramp, ends (2,) mm, is cut off; widest (2,): longest cell at an end that
    is not, mm; nodes (n + 1,) arc lengths of the cells;
    jumps (rows + 1, 1 + 2 axes): arc length of what jumps between rows and by how much r', r'' do, ended by infinity;
    samples (rows, 8): room for what rows are like.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    first = find_row(table, 0, last_row, START, low)
    work = np.empty((4, axes))
    d = np.empty((3, axes))
    before = np.empty((3, axes))
    first_third = np.empty(axes)
    row = first
    count = 0
    found = 0
    for row in range(first, last_row + 1):
        if row > first and table[row, START] >= high:
            break
        begin = max(table[row, START], low)
        finish = min(table[row + 1, START] if row < last_row else arc_length(table, row, 1.0), high)
        top = feeds[row] * feeds[row]
        push = math.inf
        twist = math.inf
        # r''' bends at knots of degree 4 and more, which any end of a row may be
        slow = math.inf
        jumped = 1.0 if shape[0] >= 4 or (row > first and feeds[row] != feeds[row - 1]) else 0.0
        bend = 0.0
        change = 0.0
        for j in range(3):
            kappa = along(table, row, shape, j - 1.0, work, d)
            bend = max(bend, kappa)
            if j == 0 and row > first:
                size1 = 0.0
                size2 = 0.0
                size3 = 0.0
                for k in range(axes):
                    size1 = max(size1, abs(d[0, k]), abs(before[0, k]))
                    size2 = max(size2, abs(d[1, k]), abs(before[1, k]))
                    size3 = max(size3, abs(d[2, k]), abs(before[2, k]))
                gap1 = 0.0
                gap2 = 0.0
                for k in range(axes):
                    step1 = abs(d[0, k] - before[0, k])
                    step2 = abs(d[1, k] - before[1, k])
                    gap1 = max(gap1, step1 / size1)
                    if size2 > 0.0:
                        gap2 = max(gap2, step2 / size2)
                    if size3 > 0.0 and abs(d[2, k] - before[2, k]) > 1e-3 * size3:
                        jumped = 1.0
                if gap1 > NO_JUMP or gap2 > 10.0 * NO_JUMP:
                    jumped = 1.0
                    jumps[found, 0] = begin
                    for k in range(axes):
                        jumps[found, 1 + k] = abs(d[0, k] - before[0, k]) if gap1 > NO_JUMP else 0.0
                        jumps[found, 1 + axes + k] = abs(d[1, k] - before[1, k]) if gap2 > 10.0 * NO_JUMP else 0.0
                        slow = min(slow, jump_top(jumps[found, 1 + k], jumps[found, 1 + axes + k], k, axes, limit))
                    found += 1
            if j == 0:
                first_third[:] = d[2]
            if j == 2:
                before[:] = d
                largest = 0.0
                for k in range(axes):
                    largest = max(largest, abs(d[2, k]), abs(first_third[k]))
                    change = max(change, abs(d[2, k] - first_third[k]))
                change = change / largest if largest > 0.0 else 0.0
            here = min(still_top(d, kappa, limit), turn_top(d, limit), chord_top(kappa, limit))
            if here >= 0.0:
                top = min(top, here)
            a, b = push_twist(d, limit)
            push = min(push, a)
            twist = min(twist, b)
        samples[count, 0] = begin
        samples[count, 1] = top
        samples[count, 2] = push
        samples[count, 3] = twist
        samples[count, 4] = jumped
        samples[count, 5] = bend
        samples[count, 6] = change
        samples[count, 7] = slow
        count += 1
    jumps[found, 0] = math.inf
    # a short row over which r''' changes, as between two knots that are close, is nearly a jump
    for i in range(1, count - 1):
        if samples[i, 6] > ABRUPT:
            width = samples[i + 1, 0] - samples[i, 0]
            beside = samples[i, 0] - samples[i - 1, 0]
            if i + 2 < count:
                beside = max(beside, samples[i + 2, 0] - samples[i + 1, 0])
            if width < SHORT * beside:
                samples[i, 4] = 1.0
                samples[i + 1, 4] = 1.0
    for e in range(2):
        ends[e] = 0.0
        if rest[e] > 0.0:
            at = 0 if e == 0 else count - 1
            along(table, first + at, shape, -1.0 if e == 0 else 1.0, work, d)
            ends[e] = _ramp(samples[at, 1], samples[at, 2], samples[at, 3], d, shape[2], high - low)
    # the feed that there is room for, by acceleration alone
    speed = np.empty(count)
    q = 0.0 if rest[0] > 0.0 else math.inf
    for i in range(count):
        finish = samples[i + 1, 0] if i + 1 < count else high
        q = min(samples[i, 1], min(q, samples[i, 7]) + 2.0 * samples[i, 2] * (finish - samples[i, 0]))
        speed[i] = q
    q = 0.0 if rest[1] > 0.0 else math.inf
    for i in range(count - 1, -1, -1):
        finish = samples[i + 1, 0] if i + 1 < count else high
        q = min(samples[i, 1], q + 2.0 * samples[i, 2] * (finish - samples[i, 0]))
        speed[i] = math.sqrt(min(speed[i], q))
        q = min(q, samples[i, 7])
    size = np.empty(count)  # of the cells that each row wants
    for i in range(count):
        finish = samples[i + 1, 0] if i + 1 < count else high
        push, twist, v = samples[i, 2], samples[i, 3], speed[i]
        build = v / push if push > 0.0 else math.inf
        if twist < math.inf:
            build = min(push / twist, math.sqrt(v / twist))
        span = BUILDS * max(build, limit[PERIOD])
        size[i] = min(v * span, PIECES * (finish - samples[i, 0]))
        if samples[i, 5] * size[i] > TURN:
            size[i] = TURN / samples[i, 5]
        size[i] = max(size[i], LEAST_SHARE * v * span)
    edge = np.empty(count + 1)  # and how long they may be at its ends
    edge[0] = ends[0] if rest[0] > 0.0 else min(size[0], widest[0])
    edge[count] = ends[1] if rest[1] > 0.0 else min(size[count - 1], widest[1])
    for i in range(1, count):
        edge[i] = min(size[i - 1], size[i])
        if samples[i, 7] < math.inf:  # what is within two periods of a jump keeps to smaller limits
            edge[i] = min(
                edge[i], 2.0 * limit[PERIOD] * math.sqrt(min(samples[i, 7], samples[i, 1], samples[i - 1, 1]))
            )
    for i in range(count):
        finish = samples[i + 1, 0] if i + 1 < count else high
        edge[i + 1] = min(edge[i + 1], edge[i] + GROWTH * (finish - samples[i, 0]))
    for i in range(count - 1, -1, -1):
        finish = samples[i + 1, 0] if i + 1 < count else high
        edge[i] = min(edge[i], edge[i + 1] + GROWTH * (finish - samples[i, 0]))
    n = 0
    start = low + ends[0]
    stop = high - ends[1]
    nodes[0] = start
    i = 0
    s = start
    while True:
        # the end of this run: the next jump, or the end
        last = i
        while last + 1 < count and samples[last + 1, 4] == 0.0:
            last += 1
        until = samples[last + 1, 0] if last + 1 < count else stop
        if until <= start or (until - s) < 1e-3 * edge[last + 1 if last + 1 < count else count]:
            if last + 1 >= count:
                if n > 0 and s < stop:
                    nodes[n] = stop
                break
            i = last + 1
            continue
        if until > stop - 1e-3 * edge[count]:
            until = stop
        at = i
        while s < until:
            while at + 1 < count and s >= samples[at + 1, 0]:
                at += 1
            finish = samples[at + 1, 0] if at + 1 < count else high
            step = min(size[at], edge[at] + GROWTH * max(s - samples[at, 0], 0.0))
            step = min(step, edge[at + 1] + GROWTH * max(finish - s, 0.0)) / (1.0 + 0.5 * GROWTH)
            step = max(step, 1e-13 * high)
            if until - s <= 1.4 * step:
                s = until
            elif until - s <= 2.0 * step:  # the last two are alike
                s += 0.5 * (until - s)
            else:
                s += step
            n += 1
            if n + 1 >= nodes.shape[0]:
                return -1
            nodes[n] = s
        if until >= stop or last + 1 >= count:
            break
        i = last + 1
    return n


@kernel
def _ramp(top: float, push: float, twist: float, d: Array, linear: int, length: float) -> float:
    """Length of the ramp of constant jerk at rest, mm: short beside what building up a and v, and turning, take."""
    size = 1e-2 * length
    if twist < math.inf:
        size = min(size, 0.1 * RAMP_SHARE * top**0.75 / math.sqrt(twist))
        if push < math.inf:
            size = min(size, RAMP_SHARE * push**3 / (6.0 * twist * twist))
    else:
        size = 1e-6 * length
    bend = 0.0
    turn = 0.0
    for k in range(linear):
        bend += d[1, k] * d[1, k]
        turn += d[2, k] * d[2, k]
    if bend > 0.0:
        size = min(size, 2e-2 / math.sqrt(bend))
    if turn > 0.0:
        size = min(size, 0.1 / turn**0.25)
    return size


@kernel
def at_cells(
    table: Array, feeds: Array, shape: Shape, n: int, nodes: Array, ends: Array, limit: Array,
    d: Array, bend: Array, top: Array, most: Array,
) -> None:  # fmt: skip
    """Derivatives d (n + 2, 5, 3, axes) and curvature bend (n + 2, 5) at PLACES of every piece, one-sided at its ends.

    The first and the last piece are the ramps, of length ends (2,), 0 where there is none; top (n, 2) gets the bound of
    q at the Gauss places of the cells between them, most (n + 2,) the bound by the feed of each piece's row.
    """
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, nodes[0] - ends[0])
    work = np.empty((4, shape[1]))
    for i in range(n + 2):
        low = nodes[0] - ends[0] if i == 0 else nodes[i - 1]
        high = nodes[n] + ends[1] if i == n + 1 else nodes[i]
        for p in range(PLACES.shape[0]):
            row, t = place(table, row, last_row, low if p == 0 else low + PLACES[p] * (high - low))
            if p == PLACES.shape[0] - 1:
                row, t = place(table, row, last_row, high)
                if row > 0 and high <= table[row, START] and low < high:
                    row -= 1
                    t = 1.0
            bend[i, p] = along(table, row, shape, t, work, d[i, p])
            if p == 2:
                most[i] = feeds[row] * feeds[row]
            if 0 < i <= n and (p == 1 or p == 3):
                top[i - 1, p // 2] = min(still_top(d[i, p], bend[i, p], limit), feeds[row] * feeds[row])


@kernel
def hold_chords(n: int, nodes: Array, bend: Array, limit: Array, top: Array, bound: Array) -> None:
    """Lower bound (n + 2,) and top (n, 2), bounds of q, to the chord error: by the largest curvature within a step.

    bend (n + 2, 5): curvatures of the pieces, the first and the last being the ramps.
    """
    most = np.empty(n + 2)
    for i in range(n + 2):
        most[i] = np.max(bend[i])
    if not limit[CHORD] < math.inf:
        return
    for i in range(n):
        reach = limit[PERIOD] * math.sqrt(max(top[i, 0], top[i, 1]))
        kappa = most[i + 1]
        j = i - 1
        while j >= -1 and nodes[j + 1] > nodes[i] - reach:
            kappa = max(kappa, most[j + 1])
            j -= 1
        j = i + 1
        while j <= n and nodes[j] < nodes[i + 1] + reach:
            kappa = max(kappa, most[j + 1])
            j += 1
        chord = chord_top(kappa, limit)
        bound[i + 1] = min(bound[i + 1], chord)
        top[i, 0] = min(top[i, 0], chord)
        top[i, 1] = min(top[i, 1], chord)
    bound[0] = min(bound[0], chord_top(max(most[0], most[1]), limit))
    bound[n + 1] = min(bound[n + 1], chord_top(max(most[n], most[n + 1]), limit))


@kernel
def hold_jumps(
    n: int, nodes: Array, jumps: Array, limit: Array, top: Array, node_top: Array, calm: Array, axes: int
) -> None:
    """Bounds of q at nodes where r' or r'' jumps, and the share of the limits that is left to the motion about them.

    A jump D1 of r' is seen as an acceleration D1 v/T and a jerk of at most D1 v/T^2, a jump D2 of r'' as a jerk of at
    most 3/4 D2 q/T: the peaks of the B-splines that differences over the period T are means with. What lies within two
    periods of a jump is counted with it.
    """
    period = limit[PERIOD]
    calm[:] = 1.0
    if period <= 0.0:
        return
    total = 0
    while jumps[total, 0] < math.inf:
        total += 1
    i = 0
    for g in range(total):
        s = jumps[g, 0]
        while i < n and nodes[i] < s:
            i += 1
        if i <= 0 or i >= n or nodes[i] != s:
            continue
        q = min(top[i, 0], top[i, 1], top[i - 1, 0], top[i - 1, 1], node_top[i])
        most = q
        for _ in range(3):
            reach = 2.0 * period * math.sqrt(most)
            left = g
            while left > 0 and jumps[left - 1, 0] > s - reach:
                left -= 1
            right = g
            while right + 1 < total and jumps[right + 1, 0] < s + reach:
                right += 1
            bound = q
            for k in range(axes):
                sum1 = 0.0
                sum2 = 0.0
                for j in range(left, right + 1):
                    sum1 += jumps[j, 1 + k]
                    sum2 += jumps[j, 1 + axes + k]
                bound = min(bound, jump_top(sum1, sum2, k, axes, limit))
            most = bound
        node_top[i] = min(node_top[i], most)
        share1 = 0.0
        share = 0.0
        for k in range(axes):
            a = limit[OF_AXES + axes + k]
            j3 = limit[OF_AXES + 2 * axes + k]
            sum1 = 0.0
            sum2 = 0.0
            for j in range(left, right + 1):
                sum1 += jumps[j, 1 + k]
                sum2 += jumps[j, 1 + axes + k]
            feed = math.sqrt(most)
            share1 = max(share1, sum1 * feed / (a * period))
            share = max(share, (sum1 * feed / period + 0.75 * sum2 * most) / (j3 * period))
        if max(share, share1) < 1e-9:
            continue
        reach = 2.0 * period * math.sqrt(min(q, 4.0 * most))
        j = i
        while j < n and nodes[j] <= s + reach:
            calm[j, 0] = min(calm[j, 0], 1.0 - share1)
            calm[j, 1] = min(calm[j, 1], 1.0 - share)
            j += 1
        j = i - 1
        while j >= 0 and nodes[j + 1] >= s - reach:
            calm[j, 0] = min(calm[j, 0], 1.0 - share1)
            calm[j, 1] = min(calm[j, 1], 1.0 - share)
            j -= 1


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

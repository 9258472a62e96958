"""What the rows of a look-ahead window are like: how fast they can be passed, what jumps between them, sharp bends."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import SLOW_PLACES, arc_length, fitted_speed, slow_places
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_bounds import BESIDE, CAP, JUMPS, TURNED, jump_top, turn_cap
from splinefeed.kernels.look_ahead_path import (
    AT_CORNER,
    CHORD,
    FEED,
    ON_ROW,
    PERIOD,
    ROUNDING,
    along,
    place,
    push_twist,
    row_end,
    steady_top,
)
from splinefeed.kernels.pieces import START, Shape, find_row, speed
from splinefeed.records import Array

#: Columns of samples: where a part of a row begins, mm; largest q, tangential acceleration and jerk in it; whether it
#: begins with a jump; greatest |r''| and |r'''|; how much r''' changes over it; largest q at the jump where it begins.
BEGIN, TOP, PUSH, TWIST, JUMPED, BEND, TWISTED, CHANGE, SLOW, COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
#: A row is halved until |C'| changes by no more than this factor over a part, ...
UNEVEN = 4.0
#: ... into this many parts at most, none below this share of the arc length up to there.
MOST_PARTS, FINEST = 64, 1e-12
#: Derivatives that differ by less than this across a row's end, relative, do not jump.
NO_JUMP = 1e-7
#: Places of a row among which the slowest is looked for, and halvings of the interval about it.
BEND_PLACES, BEND_STEPS, GOLDEN = 9, 40, 0.5 * (math.sqrt(5.0) - 1.0)
#: A row is searched for a sharp bend where q at a sample of it is below this many times that of one.
NEARLY = 100.0
#: A q that is lower by less than this share is the same: on a circle, all places are alike.
FLAT = 1e-6


@kernel
def sample_room(rows: int) -> int:
    """How many samples so many rows may have."""
    return 2 * rows + 4 * MOST_PARTS


@kernel
def _note(sample: Array, d: Array, kappa: float, linear: int, limit: Array) -> None:
    """Take what the limits say at one place into a sample."""
    if kappa < 0.0:
        return
    sample[TOP] = min(sample[TOP], steady_top(d, kappa, limit))
    push, twist = push_twist(d, limit)
    sample[PUSH] = min(sample[PUSH], push)
    sample[TWIST] = min(sample[TWIST], twist)
    sample[BEND] = max(sample[BEND], kappa)
    turn = 0.0
    for k in range(linear):
        turn += d[2, k] * d[2, k]
    sample[TWISTED] = max(sample[TWISTED], math.sqrt(turn))


@kernel
def _jumps(before: Array, d: Array, begin: float, linear: int, kappa: float, limit: Array, jump: Array) -> int:
    """What jumps between derivatives (3, axes): 0 nothing, 1 r''' only, 2 more, and then by how much, into `jump`.

    kappa: the greatest curvature beside it, 1/mm. A turn of the tangent that a chord error may feel counts as more.
    """
    axes = d.shape[1]
    turned = 0.0
    for k in range(linear):
        turned += (d[0, k] - before[0, k]) ** 2
    turned = math.sqrt(turned)
    size1 = 0.0
    size2 = 0.0
    size3 = 0.0
    for k in range(axes):
        size1 = max(size1, abs(d[0, k]), abs(before[0, k]))
        size2 = max(size2, abs(d[1, k]), abs(before[1, k]))
        size3 = max(size3, abs(d[2, k]), abs(before[2, k]))
    gap1 = 0.0
    gap2 = 0.0
    found = 0
    for k in range(axes):
        if size1 > 0.0:
            gap1 = max(gap1, abs(d[0, k] - before[0, k]) / size1)
        if size2 > 0.0:
            gap2 = max(gap2, abs(d[1, k] - before[1, k]) / size2)
        if size3 > 0.0 and abs(d[2, k] - before[2, k]) > 1e-3 * size3:
            found = 1
    felt = turn_cap(turned, kappa, limit) < 4.0 * limit[FEED] * limit[FEED]
    if not (felt or gap1 > NO_JUMP or gap2 > 10.0 * NO_JUMP):
        return found
    jump[0] = begin
    jump[CAP] = math.inf
    jump[TURNED] = turned if felt else 0.0
    jump[BESIDE] = kappa
    for k in range(axes):
        jump[JUMPS + k] = abs(d[0, k] - before[0, k]) if gap1 > NO_JUMP else 0.0
        jump[JUMPS + axes + k] = abs(d[1, k] - before[1, k]) if gap2 > 10.0 * NO_JUMP else 0.0
    return 2


@kernel
def sample_rows(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, reach: float, limit: Array, samples: Array,
    jumps: Array,
) -> tuple[int, int]:  # fmt: skip
    """What [low, high], mm, is like, part by part, into samples (room, COLUMNS), and its jumps; how many of both.

    jumps (rows + 1, 2 + 2 axes): arc length, largest q there if it is a corner that is passed, and by how much r', r''
    jump otherwise; those up to `reach` mm before `low` count too. Parts are rows, halved where |C'| varies much: next
    to C' = 0 they get ever shorter, as the derivatives by arc length explode there.
    """
    axes = shape[1]
    linear = abs(shape[2])
    rounding = ROUNDING * high
    last_row = table.shape[0] - 1
    first = find_row(table, 0, last_row, START, low)
    back = first
    while reach > 0.0 and back > 0 and table[back, START] > low - reach:
        back -= 1
    spare = samples.shape[0] - (last_row - first + 2)
    work = np.empty((4, axes))
    d = np.empty((3, axes))
    before = np.zeros((3, axes))
    behind = 0.0
    third = np.empty(axes)
    ends = np.empty(MOST_PARTS + 1)
    count = 0
    found = 0
    for row in range(back, last_row + 1):
        if row > first and table[row, START] >= high:
            break
        begin = table[row, START]
        t0 = -1.0
        kappa = along(table, row, shape, t0, rounding, work, d)
        jumped = 1.0 if shape[0] >= 4 or (row > first and feeds[row, ON_ROW] != feeds[row - 1, ON_ROW]) else 0.0
        slow = math.inf
        if row > back:
            kind = _jumps(before, d, begin, linear, max(behind, kappa, 0.0), limit, jumps[found])
            if feeds[row, AT_CORNER] < math.inf:
                jumps[found, 0] = begin
                jumps[found, CAP] = feeds[row, AT_CORNER] * feeds[row, AT_CORNER]
                jumps[found, TURNED:] = 0.0
                kind = 2
            if kind > 0:
                jumped = 1.0
            if kind > 1:
                slow = min(jumps[found, CAP], turn_cap(jumps[found, TURNED], jumps[found, BESIDE], limit))
                for k in range(axes):
                    slow = min(slow, jump_top(jumps[found, JUMPS + k], jumps[found, JUMPS + axes + k], k, axes, limit))
                found += 1
        if row < first:
            behind = along(table, row, shape, 1.0, rounding, work, before)
            continue
        finish = 1.0
        if begin < low:
            _, t0 = place(table, row, row, low)
            kappa = along(table, row, shape, t0, rounding, work, d)
        if row_end(table, row) > high:
            _, finish = place(table, row, row, high)
        parts = 1
        waiting = 1
        ends[0] = finish
        s0 = max(begin, low)
        while waiting > 0:
            t1 = ends[waiting - 1]
            middle = 0.5 * (t0 + t1)
            s1 = arc_length(table, row, t1)
            if parts < MOST_PARTS and spare > 0 and waiting < MOST_PARTS and s1 - s0 > FINEST * high:
                v0 = fitted_speed(table, row, t0)[0]
                v1 = fitted_speed(table, row, middle)[0]
                v2 = fitted_speed(table, row, t1)[0]
                if max(v0, v1, v2) > UNEVEN * min(v0, v1, v2) and t0 < middle < t1:
                    ends[waiting] = middle
                    waiting += 1
                    parts += 1
                    spare -= 1
                    continue
            sample = samples[count]
            sample[BEGIN] = s0
            sample[TOP] = feeds[row, ON_ROW] * feeds[row, ON_ROW]
            sample[PUSH] = math.inf
            sample[TWIST] = math.inf
            sample[JUMPED] = jumped
            sample[BEND] = 0.0
            sample[TWISTED] = 0.0
            sample[SLOW] = slow if s0 > low else math.inf
            _note(sample, d, kappa, linear, limit)
            third[:] = d[2]
            kappa = along(table, row, shape, middle, rounding, work, d)
            _note(sample, d, kappa, linear, limit)
            kappa = along(table, row, shape, t1, rounding, work, d)
            _note(sample, d, kappa, linear, limit)
            largest = 0.0
            change = 0.0
            for k in range(axes):
                largest = max(largest, abs(d[2, k]), abs(third[k]))
                change = max(change, abs(d[2, k] - third[k]))
            sample[CHANGE] = change / largest if largest > 0.0 else 0.0
            count += 1
            waiting -= 1
            jumped = 0.0
            slow = math.inf
            t0 = t1
            s0 = s1
        before[:] = d
        behind = kappa
    return count, found


@kernel
def bend_behind(table: Array, shape: Shape, low: float, feed: float, limit: Array) -> float:
    """Greatest curvature, 1/mm, within a step of the period before `low`, mm, where the feed is `feed`, mm/s."""
    bend = 0.0
    if not (limit[CHORD] < math.inf and feed > 0.0):
        return bend
    work = np.empty((4, shape[1]))
    d = np.empty((3, shape[1]))
    row = find_row(table, 0, table.shape[0] - 1, START, low)
    for j in range(BEND_PLACES):
        s = max(low - j / (BEND_PLACES - 1.0) * limit[PERIOD] * feed, table[0, START])
        row, t = place(table, row, table.shape[0] - 1, s)
        bend = max(bend, along(table, row, shape, t, 0.0, work, d))
    return bend


@kernel
def _steady(table: Array, row: int, shape: Shape, t: float, limit: Array, work: Array, d: Array) -> float:
    """`steady_top` at t of one row, 0 where C' = 0."""
    kappa = along(table, row, shape, t, ROUNDING * table[row, START], work, d)
    return steady_top(d, kappa, limit) if kappa >= 0.0 else 0.0


@kernel
def _narrowed(
    table: Array, row: int, shape: Shape, limit: Array, by_speed: bool, low: float, high: float, work: Array, d: Array
) -> float:
    """Place in [low, high], in t of one row, where `_steady`, or |C'|, is least, by golden section."""
    for _ in range(BEND_STEPS):
        a = high - GOLDEN * (high - low)
        b = low + GOLDEN * (high - low)
        if by_speed:
            nearer = speed(table, row, shape, a) <= speed(table, row, shape, b)
        else:
            nearer = _steady(table, row, shape, a, limit, work, d) <= _steady(table, row, shape, b, limit, work, d)
        if nearer:
            high = b
        else:
            low = a
    return 0.5 * (low + high)


@kernel
def sharp_bends(table: Array, shape: Shape, soon: float, limit: Array, out: Array) -> int:
    """Arc lengths, mm, of bends so sharp that q there is at most `soon`, mm^2/s^2, into out[:, 0] (room, 2); how many.

    They are where |C'| is least, or where q is least among samples of a row that come near to it; |C'| goes into
    out[:, 1], as of those that are next to each other the one where it is least is the bend.
    """
    work = np.empty((4, shape[1]))
    d = np.empty((3, shape[1]))
    slowest = np.empty(SLOW_PLACES)
    rows = table.shape[0]
    least = np.full(rows + 1, math.inf)  # the last one stands for what is before the first row, too
    at = np.zeros(rows)
    step = 2.0 / (BEND_PLACES - 1.0)
    for row in range(rows):
        ahead = fitted_speed(table, row, -1.0)[0]
        behind = fitted_speed(table, row, 1.0)[0]
        middle = fitted_speed(table, row, 0.0)[0]
        near = max(ahead, behind, middle) > UNEVEN * min(ahead, behind, middle)
        for j in range(3):
            near = near or _steady(table, row, shape, j - 1.0, limit, work, d) < NEARLY * soon
        if not near:
            continue
        for way in range(2):
            lowest = math.inf
            for j in range(BEND_PLACES):
                t = j * step - 1.0
                value = speed(table, row, shape, t) if way == 0 else _steady(table, row, shape, t, limit, work, d)
                if value < lowest:
                    lowest, middle = value, t
            low, high = max(middle - step, -1.0), min(middle + step, 1.0)
            t = _narrowed(table, row, shape, limit, way == 0, low, high, work, d)
            for place_at in (t, middle):
                q = _steady(table, row, shape, place_at, limit, work, d)
                if q < least[row]:
                    least[row], at[row] = q, place_at
        for j in range(slow_places(table, row, slowest)):
            q = _steady(table, row, shape, slowest[j], limit, work, d)
            if q < least[row]:
                least[row], at[row] = q, slowest[j]
    count = 0
    for row in range(rows):
        # where q falls on beyond the end of a row, the bend is there
        falling = (at[row] == -1.0 and least[row - 1] < (1.0 - FLAT) * least[row]) or (
            at[row] == 1.0 and least[row + 1] < (1.0 - FLAT) * least[row]
        )
        if least[row] <= soon and not falling and count < out.shape[0]:
            out[count, 0] = arc_length(table, row, at[row])
            out[count, 1] = speed(table, row, shape, at[row])
            count += 1
    return count

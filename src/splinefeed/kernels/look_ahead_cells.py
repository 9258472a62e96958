"""Cells of a look-ahead window: where they lie, and the path's derivatives in them."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import fitted_speed
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_path import (
    CENTRIPETAL,
    CHORD,
    OF_AXES,
    ON_ROW,
    PERIOD,
    ROUNDING,
    along,
    doubt,
    in_row,
    place,
    still_top,
)
from splinefeed.kernels.look_ahead_samples import BEGIN, BEND, CHANGE, JUMPED, PUSH, SLOW, TOP, TWIST, TWISTED
from splinefeed.kernels.pieces import START, Shape, find_row
from splinefeed.records import Array, IntArray

#: Fractions of a cell at which its law is looked at. At the two Gauss points, the second and the fourth, limits are
#: asked for as rows; they give the time too.
PLACES = np.array([0.0, 0.5 - math.sqrt(1.0 / 12.0), 0.5, 0.5 + math.sqrt(1.0 / 12.0), 1.0])
#: A cell lasts no longer than this many times that in which jerk builds up acceleration, ...
BUILDS = 2.5
#: ... is no longer than this many parts of rows, ...
PARTS = 3.0
#: ... and no shorter than this share of what lasts so long, nor than this share of the part.
LEAST_SHARE, LEAST_OF_PART = 0.012, 1.0 / 256.0
#: A cell turns by no more than this, rad.
TURN = 0.28
#: From one cell to the next the length grows by this share of the distance at most.
GROWTH = 0.6
#: The ramp at rest is this share of the length in which acceleration builds up.
RAMP_SHARE = 0.3
#: A short part, of this share of its neighbours, over which r''' changes by that share, has nodes at its ends.
SHORT, ABRUPT = 0.3, 0.1
#: No cell is shorter than this share of the arc length.
SHORTEST = 1e-13
#: The intervals of a ramp at rest that its law is looked at in: each this share of the next, down to this share of s.
GRADES, GRADE, FINEST_GRADE = 24, 0.2, 1e-15
#: Where a law is looked at, |C'| changes over an interval by this factor at most; a change beyond MOST_UNEVEN is within
#: the rounding of arc length. So many cuts are made for it at most.
EVEN, MOST_UNEVEN, MOST_SPLITS = 1.3, 64.0, 4096
#: An interval is halved where r''' in its middle is off what the other places let expect by more than this share of the
#: largest in it, and of what a limit allows; so many times, and so many of them, at most.
UNEXPECTED, MOST_HALVINGS, MOST_HALVED = 0.05, 5, 4096
#: No interval is halved that is shorter than this share of the arc length: its places are within its rounding.
HALVED_FROM = 1e-9


@kernel
def lay_cells(
    count: int, samples: Array, low: float, high: float, rest: Array, widest: Array, limit: Array, nodes: Array,
    ends: Array,
) -> int:  # fmt: skip
    """Cut [low, high], mm, into cells of about even time; how many, or -1 if `nodes` has no room.

    samples (count, COLUMNS) by `sample_rows`; rest (2,): 1 where an end is at rest, whose ramp, ends (2,) mm, is cut
    off; widest (2,): longest cell at an end that is not, mm; nodes (n + 1,) arc lengths of the cells.
    """
    # a short part over which r''' changes, as between two knots that are close, is nearly a jump
    for i in range(1, count - 1):
        if samples[i, CHANGE] > ABRUPT:
            width = samples[i + 1, BEGIN] - samples[i, BEGIN]
            beside = samples[i, BEGIN] - samples[i - 1, BEGIN]
            if i + 2 < count:
                beside = max(beside, samples[i + 2, BEGIN] - samples[i + 1, BEGIN])
            if width < SHORT * beside:
                samples[i, JUMPED] = 1.0
                samples[i + 1, JUMPED] = 1.0
    for e in range(2):
        ends[e] = _ramp(count, samples, low, high, e) if rest[e] > 0.0 else 0.0
    # the feed that there is room for, by acceleration alone
    speed = np.empty(count)
    q = 0.0 if rest[0] > 0.0 else math.inf
    for i in range(count):
        finish = samples[i + 1, BEGIN] if i + 1 < count else high
        q = min(samples[i, TOP], min(q, samples[i, SLOW]) + 2.0 * samples[i, PUSH] * (finish - samples[i, BEGIN]))
        speed[i] = q
    q = 0.0 if rest[1] > 0.0 else math.inf
    for i in range(count - 1, -1, -1):
        finish = samples[i + 1, BEGIN] if i + 1 < count else high
        q = min(samples[i, TOP], q + 2.0 * samples[i, PUSH] * (finish - samples[i, BEGIN]))
        speed[i] = math.sqrt(min(speed[i], q))
        q = min(q, samples[i, SLOW])
    size = np.empty(count)  # of the cells that each part wants
    for i in range(count):
        width = (samples[i + 1, BEGIN] if i + 1 < count else high) - samples[i, BEGIN]
        push, twist, v = samples[i, PUSH], samples[i, TWIST], speed[i]
        build = v / push if push > 0.0 else math.inf
        if twist < math.inf:
            build = min(push / twist, math.sqrt(v / twist))
        span = BUILDS * max(build, limit[PERIOD])
        size[i] = min(v * span, PARTS * width)
        if samples[i, BEND] * size[i] > TURN:
            size[i] = TURN / samples[i, BEND]
        size[i] = max(size[i], LEAST_SHARE * v * span, LEAST_OF_PART * width)
    edge = np.empty(count + 1)  # and how long they may be at its ends
    edge[0] = ends[0] if rest[0] > 0.0 else min(size[0], widest[0])
    edge[count] = ends[1] if rest[1] > 0.0 else min(size[count - 1], widest[1])
    for i in range(1, count):
        edge[i] = min(size[i - 1], size[i])
        if samples[i, SLOW] < math.inf:  # what is within two periods of a jump keeps to smaller limits
            near = math.sqrt(min(samples[i, SLOW], samples[i, TOP], samples[i - 1, TOP]))
            edge[i] = min(edge[i], 2.0 * limit[PERIOD] * near if limit[PERIOD] > 0.0 else math.inf)
    for i in range(count):
        finish = samples[i + 1, BEGIN] if i + 1 < count else high
        edge[i + 1] = min(edge[i + 1], edge[i] + GROWTH * (finish - samples[i, BEGIN]))
    for i in range(count - 1, -1, -1):
        finish = samples[i + 1, BEGIN] if i + 1 < count else high
        edge[i] = min(edge[i], edge[i + 1] + GROWTH * (finish - samples[i, BEGIN]))
    n = 0
    start = low + ends[0]
    stop = high - ends[1]
    nodes[0] = start
    i = 0
    s = start
    while True:
        # the end of this run: the next jump, or the end
        last = i
        while last + 1 < count and samples[last + 1, JUMPED] == 0.0:
            last += 1
        until = samples[last + 1, BEGIN] if last + 1 < count else stop
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
            while at + 1 < count and s >= samples[at + 1, BEGIN]:
                at += 1
            finish = samples[at + 1, BEGIN] if at + 1 < count else high
            step = min(size[at], edge[at] + GROWTH * max(s - samples[at, BEGIN], 0.0))
            step = min(step, edge[at + 1] + GROWTH * max(finish - s, 0.0)) / (1.0 + 0.5 * GROWTH)
            step = max(step, SHORTEST * high)
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
def _ramp(count: int, samples: Array, low: float, high: float, end: int) -> float:
    """Length of the ramp of constant jerk at rest, mm: short beside what building up a and v, and turning, take.

    It may run over parts that are shorter, as next to C' = 0, as long as it is short enough for each of them. Without
    a limit of jerk nothing says how short that is, and it runs over no jump that is to be slow.
    """
    found = 0.0
    twist = 0.0
    for k in range(count):
        i = k if end == 0 else count - 1 - k
        if twist == math.inf and samples[i if end == 0 else i + 1, SLOW] < math.inf and found >= SHORTEST * high:
            break
        outer = high - samples[i, BEGIN]
        if end == 0:
            outer = (samples[i + 1, BEGIN] if i + 1 < count else high) - low
        push, twist = samples[i, PUSH], samples[i, TWIST]
        size = (1e-2 if twist < math.inf else 1e-6) * (high - low)
        if twist < math.inf:
            size = min(size, 0.1 * RAMP_SHARE * samples[i, TOP] ** 0.75 / math.sqrt(twist))
            if push < math.inf:
                size = min(size, RAMP_SHARE * push**3 / (6.0 * twist * twist))
        if samples[i, BEND] > 0.0:
            size = min(size, 2e-2 / samples[i, BEND])
        if samples[i, TWISTED] > 0.0:
            size = min(size, 0.1 / math.sqrt(samples[i, TWISTED]))
        found = max(found, min(size, outer))
        if size <= outer:
            break
    return found


@kernel
def at_places(
    table: Array, feeds: Array, shape: Shape, m: int, edges: Array, rounding: float, d: Array, bend: Array,
    unsure: Array, most: Array,
) -> None:  # fmt: skip
    """Derivatives d (m, places, 3, axes) and curvature bend (m, places) at PLACES of intervals, one-sided at ends.

    unsure (m, places): see `doubt`; edges (m + 1,) mm, with this rounding; most (m,) gets the bound of q by the feed of
    the row in the middle of each interval.
    """
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, edges[0])
    work = np.empty((4, shape[1]))
    for i in range(m):
        low = edges[i]
        high = edges[i + 1]
        for p in range(PLACES.shape[0]):
            row, t = place(table, row, last_row, low if p == 0 else low + PLACES[p] * (high - low))
            if p == PLACES.shape[0] - 1:
                row, t = place(table, row, last_row, high)
                if row > 0 and high <= table[row, START] and low < high:
                    row -= 1
                    t = 1.0
            bend[i, p] = max(along(table, row, shape, t, rounding, work, d[i, p]), 0.0)
            unsure[i, p] = doubt(table, row, shape, rounding, work)
            if p == 2:
                most[i] = feeds[row, ON_ROW] * feeds[row, ON_ROW]


@kernel
def _unexpected(d: Array, h: float, top: float, bend: float, limit: Array) -> bool:
    """Whether places of an interval, d (places, 3, axes), h mm long, do not tell what r''' is between them.

    What counts is what limits can feel of it up to a q of `top`; bend: the greatest curvature there, 1/mm.
    """
    axes = d.shape[2]
    for k in range(axes):
        largest = 0.0
        for j in range(PLACES.shape[0]):
            largest = max(largest, abs(d[j, 2, k]))
        # the cubic through the other four, in the middle
        off = abs(d[2, 2, k] + 0.25 * (d[0, 2, k] + d[4, 2, k]) - 0.75 * (d[1, 2, k] + d[3, 2, k]))
        if not off > UNEXPECTED * largest:
            continue
        felt = off * top * math.sqrt(top) / limit[OF_AXES + 2 * axes + k]
        felt = max(felt, off * h * top / limit[OF_AXES + axes + k])
        felt = max(felt, off * h * h * math.sqrt(top) / limit[OF_AXES + k])
        if min(limit[CENTRIPETAL], limit[CHORD]) < math.inf:
            felt = max(felt, off * h / bend if bend > 0.0 else 0.0)
        if felt > UNEXPECTED:
            return True
    return False


@kernel
def look_at(
    table: Array, feeds: Array, shape: Shape, m: int, fine: Array, owner: IntArray, limit: Array
) -> tuple[int, Array, Array, Array, Array]:
    """`at_places` of the intervals (m,) of `refine`, which are halved until it tells what they are like.

    Returns how many intervals there are then, d, bend, unsure and the bound of q; `fine` and `owner` become theirs.
    """
    places = PLACES.shape[0]
    rounding = ROUNDING * fine[m]
    d, bend, unsure, bound = _room(m, shape[1])
    at_places(table, feeds, shape, m, fine, rounding, d, bend, unsure, bound)
    most = min(m + MOST_HALVED, owner.shape[0] - 1)
    seen = np.zeros(m, dtype=np.bool_)
    for _ in range(MOST_HALVINGS):
        halved = np.zeros(m, dtype=np.bool_)
        count = m
        for i in range(m):
            h = fine[i + 1] - fine[i]
            if seen[i] or count >= most or not h > HALVED_FROM * fine[m]:
                continue
            top = bound[i]
            for j in range(places):
                top = min(top, still_top(d[i, j], bend[i, j], limit))
            if top < math.inf and _unexpected(d[i], h, top, np.max(bend[i]), limit):
                halved[i] = True
                count += 1
        if count == m:
            break
        d2, bend2, unsure2, bound2 = _room(count, shape[1])
        seen = np.ones(count, dtype=np.bool_)
        k = count
        fine[k] = fine[m]
        for i in range(m - 1, -1, -1):
            begin, whose = fine[i], owner[i]
            if halved[i]:
                k -= 2
                fine[k + 1] = begin + 0.5 * (fine[k + 2] - begin)
                fine[k] = begin
                owner[k] = whose
                owner[k + 1] = whose
                seen[k] = False
                seen[k + 1] = False
                at_places(
                    table, feeds, shape, 2, fine[k : k + 3], rounding, d2[k : k + 2], bend2[k : k + 2],
                    unsure2[k : k + 2], bound2[k : k + 2],
                )  # fmt: skip
            else:
                k -= 1
                fine[k] = begin
                owner[k] = whose
                d2[k], bend2[k], unsure2[k], bound2[k] = d[i], bend[i], unsure[i], bound[i]
        d, bend, unsure, bound = d2, bend2, unsure2, bound2
        m = count
    return m, d, bend, unsure, bound


@kernel
def _room(m: int, axes: int) -> tuple[Array, Array, Array, Array]:
    """Arrays for `at_places` of m intervals."""
    places = PLACES.shape[0]
    return np.empty((m, places, 3, axes)), np.empty((m, places)), np.empty((m, places)), np.empty(m)


@kernel
def refined_room(m: int, count: int) -> int:
    """How many edges `refine` and `look_at` may make of m pieces and `count` parts."""
    return m + count + 2 * GRADES + MOST_SPLITS + MOST_HALVED + 1


@kernel
def refine(table: Array, m: int, edges: Array, count: int, samples: Array, fine: Array, owner: IntArray) -> int:
    """Edges (m + 1,) of pieces and the ends of all parts of rows between them, into fine (k + 1,); returns k.

    owner (k,) gets the piece that each of the finer intervals lies in. Pieces without length are left out; the first
    and the last one, which may be ramps at rest, are cut ever finer towards it; and what |C'| changes over by more than
    EVEN is cut until it does not, as derivatives by arc length go with powers of it.
    """
    near = ROUNDING * edges[m]  # what is nearer to an edge is at it
    cuts = np.empty(m + count + 2 * GRADES + 1)
    k = 0
    at = 0
    spare = MOST_SPLITS
    row = find_row(table, 0, table.shape[0] - 1, START, edges[0])
    fine[0] = edges[0]
    for i in range(m):
        length = edges[i + 1] - edges[i]
        if not length > 0.0:
            continue
        before = k
        found = 0
        while at < count and samples[at, BEGIN] <= edges[i] + near:
            at += 1
        while at < count and samples[at, BEGIN] < edges[i + 1] - near:
            cuts[found] = samples[at, BEGIN]
            found += 1
            at += 1
        if i == 0 or i == m - 1:
            for _ in range(GRADES):
                length *= GRADE
                if not length > FINEST_GRADE * edges[m]:
                    break
                cuts[found] = edges[i] + length if i == 0 else edges[i + 1] - length
                found += 1
            cuts[:found] = np.sort(cuts[:found])
        cuts[found] = edges[i + 1]
        for j in range(found + 1):
            row, t = place(table, row, table.shape[0] - 1, 0.5 * (fine[k] + cuts[j]))
            added = _even(table, row, t, fine[k], cuts[j], fine[k + 1 : k + 1 + spare])
            k += added + 1
            spare -= added
            fine[k] = cuts[j]
        owner[before:k] = i
    return k


@kernel
def _even(table: Array, row: int, t: float, low: float, high: float, cuts: Array) -> int:
    """Where to cut [low, high], mm, of one row, t in its middle, so that |C'| is about even: into `cuts`; how many.

    |C'|^2 grows about as the distance from C' = 0 does.
    """
    ends = np.empty(3)
    ends[0] = fitted_speed(table, row, in_row(table, row, low))[0]
    ends[1] = fitted_speed(table, row, t)[0]
    ends[2] = fitted_speed(table, row, in_row(table, row, high))[0]
    count = 0
    valley = ends[1] * EVEN < min(ends[0], ends[2])
    for half in range(2 if valley else 1):
        begin = low if half == 0 else 0.5 * (low + high)
        finish = high if half == 1 or not valley else 0.5 * (low + high)
        first, last = ends[half], ends[half + 1 if valley else 2]
        top = max(first, last)
        first, last = max(first, top / MOST_UNEVEN), max(last, top / MOST_UNEVEN)
        if half == 1 and count < cuts.shape[0]:
            cuts[count] = begin
            count += 1
        if not (first > 0.0 and last > 0.0):
            continue
        parts = math.ceil(abs(math.log(last / first)) / math.log(EVEN))
        for j in range(1, parts):
            here = first * (last / first) ** (j / parts)
            s = begin + (finish - begin) * (here * here - first * first) / (last * last - first * first)
            if begin < s < finish and count < cuts.shape[0] and (count == 0 or s > cuts[count - 1]):
                cuts[count] = s
                count += 1
    return count

"""The nearest point of a curve or a path, or of a stretch of it: search in a tree of cells, Newton inside them."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import SMALL_STEP
from splinefeed.kernels.cells import BEND, ROUNDING, ROW, SPEED, T_HIGH, T_LOW, box_bound, cell_bound
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, ORIGIN, SCALE, Shape
from splinefeed.records import Array, IntArray

#: Bisections of a cell before minima are looked for without proof that there is one at most.
MAX_BISECTIONS = 4
#: Newton steps inside one interval; a step that does not halve the one before is a bisection.
MAX_STEPS = 60
#: Nodes that wait during a search: one a level of the tree, and a few.
MAX_WAITING = 72


@kernel
def squared_distance(table: Array, row: int, shape: Shape, t: float, query: Array) -> tuple[float, float, float, float]:
    """|C - Q|^2, (C - Q).C', its derivative C'.C' + (C - Q).C'', and C'.C', by t of one row; mm^2.

    C - Q is taken as (origin - Q) + A / w, so that a part far from zero loses nothing.
    """
    degree, axes, _, rational = shape
    base = ORIGIN + axes
    inverse = 1.0
    w1 = 0.0
    w2 = 0.0
    if rational:
        at = base + axes * (degree + 1)
        w0 = table[row, at + degree]
        for k in range(degree - 1, -1, -1):
            w2 = w2 * t + w1
            w1 = w1 * t + w0
            w0 = w0 * t + table[row, at + k]
        inverse = 1.0 / w0
    square = 0.0
    slope = 0.0
    along = 0.0
    velocity = 0.0
    for a in range(abs(shape[2])):
        at = base + a * (degree + 1)
        c0 = table[row, at + degree]
        c1 = 0.0
        c2 = 0.0
        for k in range(degree - 1, -1, -1):
            c2 = c2 * t + c1
            c1 = c1 * t + c0
            c0 = c0 * t + table[row, at + k]
        c0 = c0 * inverse
        c1 = (c1 - w1 * c0) * inverse
        c2 = 2.0 * (c2 - w1 * c1 - w2 * c0) * inverse
        apart = (table[row, ORIGIN + a] - query[a]) + c0
        square += apart * apart
        slope += apart * c1
        along += apart * c2
        velocity += c1 * c1
    return square, slope, velocity + along, velocity


@kernel
def descend(
    table: Array,
    row: int,
    shape: Shape,
    query: Array,
    low: float,
    high: float,
    start: float,
    best: float,
    at: float,
    own: bool,
) -> tuple[float, float, bool]:
    """The better of (best, at) and a minimum of |C - Q|^2 over t in [low, high]: Newton's method on its slope.

    t <- t - (C - Q).C' / (C'.C' + (C - Q).C''), kept between a falling and a rising place; from `start`.
    The last step is so small that the parabola tells the minimum to rounding. About it the distance is flat: if the
    best place is this cell's `own`, the root of the slope is the better one of two as near.
    """
    left = low
    right = high
    left_seen = False
    right_seen = False
    t = start
    longest = high - low
    for _ in range(MAX_STEPS):
        square, slope, bend, _ = squared_distance(table, row, shape, t, query)
        if square < best:
            best = square
            at = t
            own = True
        if slope > 0.0:
            if t <= left:
                break
            right = t
            right_seen = True
        elif slope < 0.0:
            if t >= right:
                break
            left = t
            left_seen = True
        else:
            break
        after = t - slope / bend if bend > 0.0 else (low - 1.0 if slope > 0.0 else high + 1.0)
        if abs(after - t) < SMALL_STEP and low <= after <= high:
            square = max(square - slope * slope / bend, 0.0)
            if square < best or (own and square <= best * (1.0 + 4.0 * ROUNDING)):
                best = min(best, square)
                at = after
                own = True
            break
        if (after <= left and left_seen) or (after >= right and right_seen) or abs(after - t) > longest:
            after = 0.5 * (left + right)
        after = min(max(after, left), right)
        if after == t:
            break
        longest = 0.5 * abs(after - t)
        t = after
    return best, at, own


@kernel
def search_cell(
    table: Array,
    shape: Shape,
    cells: Array,
    index: int,
    low: float,
    high: float,
    query: Array,
    start: float,
    best: float,
    at: float,
    room: Array,
) -> tuple[float, float]:
    """The better of (best, at) and the least |C - Q|^2, mm^2, over [low, high] in one cell, with its t; `start` first.

    With D = |C - Q|^2 / 2 and arc length s: dD/ds = (C - Q).T and d2D/ds2 = 1 + (C - Q).kN. Within h of a place of
    distance d the last term is at most b = (d + h) k, k the greatest curvature. So there
        |C - Q| >= d - h  and  |C - Q|^2 >= d^2 - 2 |dD/ds| h - max(b - 1, 0) h^2   (nothing better: left out),
        b < 1:  D is convex, it has one minimum;  |dD/ds| > h (1 + b):  D falls towards one end.
    An interval of which none is true is bisected; room holds those that wait. After MAX_BISECTIONS what
    is left is so short that dD/dt is a cubic to all purposes: from an end at which D falls inwards Newton's method
    comes to the minimum next to it, and a cubic has no others.
    """
    row = int(cells[index, ROW])
    speed = cells[index, SPEED]
    curvature = cells[index, BEND]
    low_of = room[0]
    high_of = room[1]
    low_of[0] = low
    high_of[0] = high
    shortest = (high_of[0] - low_of[0]) * 0.5**MAX_BISECTIONS
    place = min(max(start, low_of[0]), high_of[0])
    own = False
    waiting = 1
    while waiting > 0:
        waiting -= 1
        low = low_of[waiting]
        high = high_of[waiting]
        square, slope, bend, velocity = squared_distance(table, row, shape, place, query)
        if square < best:
            best = square
            at = place
            own = True
        h = max(high - place, place - low) * speed
        d = math.sqrt(square)
        b = (d + h) * curvature
        fall = abs(slope) / math.sqrt(velocity) if velocity > 0.0 else 0.0
        hopeless = d > h and (d - h) * (d - h) >= best
        hopeless = hopeless or square - 2.0 * fall * h - max(b - 1.0, 0.0) * h * h >= best
        passes = 0 if hopeless else 1
        proven = b < 1.0 or fall > h * (1.0 + b)
        first = place
        if passes > 0 and proven:
            # D falls from here against its slope, to its only minimum or to the end
            if slope > 0.0:
                high = place
                first = max(place - slope / bend, low) if bend > 0.0 else low
            elif slope < 0.0:
                low = place
                first = min(place - slope / bend, high) if bend > 0.0 else high
            else:
                passes = 0  # here it is
        elif passes > 0 and high - low > 1.5 * shortest:
            # the half towards which D falls is taken first: it sits on top
            middle = 0.5 * (low + high)
            lower = waiting + 1 if slope > 0.0 else waiting
            upper = waiting if slope > 0.0 else waiting + 1
            low_of[lower] = low
            high_of[lower] = middle
            low_of[upper] = middle
            high_of[upper] = high
            waiting += 2
            passes = 0
        elif passes > 0:
            passes = 2
        for k in range(passes):
            if not proven:
                end = low if k == 0 else high
                square, slope, bend, _ = squared_distance(table, row, shape, end, query)
                if square < best:
                    best = square
                    at = end
                    own = True
                if (k == 0 and slope >= 0.0) or (k == 1 and slope <= 0.0):
                    continue
                first = min(max(end - slope / bend, low), high) if bend > 0.0 else 0.5 * (low + high)
            best, at, own = descend(table, row, shape, query, low, high, first, best, at, own)
        if waiting > 0:
            place = 0.5 * (low_of[waiting - 1] + high_of[waiting - 1])
    return best, at


@kernel
def search_room() -> Array:
    """Where a search keeps what waits: both ends of intervals, then nodes, their bounds, and the leaves below them."""
    return np.empty((5, MAX_WAITING))


@kernel
def search(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    first: int,
    last: int,
    low: float,
    high: float,
    query: Array,
    found: int,
    t: float,
    best: float,
    known: int,
    room: Array,
) -> tuple[int, float, float]:
    """Cell, t and |C - Q|^2, mm^2: the better of (found, t, best) and the nearest point of the cells first ... last.

    low, high  t at which the stretch begins on the first cell and ends on the last; known  a cell to pass over, or -1.
    From the smallest part of the tree that holds the cells downwards, nearer boxes first.
    """
    linear = abs(shape[2])
    leaves = boxes.shape[0] // 2
    nodes = room[2]
    bounds = room[3]
    below = room[4]
    a = leaves + first
    b = leaves + last
    span = 1
    while a != b:
        a //= 2
        b //= 2
        span *= 2
    nodes[0] = a
    bounds[0] = 0.0
    below[0] = span
    waiting = 1
    while waiting > 0:
        waiting -= 1
        if bounds[waiting] >= best:
            continue
        node = int(nodes[waiting])
        span = int(below[waiting])
        begin = node * span - leaves
        if begin > last or begin + span <= first:
            continue
        if span == 1:
            if begin != known and cell_bound(cells, begin, linear, query) < best:
                before = best
                left = low if begin == first else cells[begin, T_LOW]
                right = high if begin == last else cells[begin, T_HIGH]
                start = 0.5 * (left + right)
                best, t = search_cell(table, shape, cells, begin, left, right, query, start, best, t, room)
                if best < before:
                    found = begin
            continue
        left = box_bound(boxes, 2 * node, linear, query)
        right = box_bound(boxes, 2 * node + 1, linear, query)
        # the nearer box goes on top
        near = waiting + 1 if left <= right else waiting
        far = waiting if left <= right else waiting + 1
        nodes[near] = 2 * node
        bounds[near] = left
        nodes[far] = 2 * node + 1
        bounds[far] = right
        below[waiting] = span // 2
        below[waiting + 1] = span // 2
        waiting += 2
    return found, t, best


@kernel
def nearest_points(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    queries: Array,
    rows: IntArray,
    parameters: Array,
    distances: Array,
) -> None:
    """Row, u and distance, mm, of the nearest point to every query (n, linear or more): the global one.

    The place of the last answer is looked at first, so that queries in order along the curve find a bound at once.
    """
    room = search_room()
    end = cells.shape[0] - 1
    last = 0
    t = 0.0
    for i in range(queries.shape[0]):
        query = queries[i]
        low = cells[last, T_LOW]
        high = cells[last, T_HIGH]
        best, t = search_cell(table, shape, cells, last, low, high, query, t, math.inf, t, room)
        last, t, best = search(
            table, shape, cells, boxes, 0, end, cells[0, T_LOW], cells[end, T_HIGH], query, last, t, best, last, room
        )
        row = int(cells[last, ROW])
        rows[i] = row
        distances[i] = math.sqrt(best)
        u = table[row, MIDDLE] + t / table[row, SCALE]
        parameters[i] = min(max(u, table[row, LOW]), table[row, HIGH])
        if t == (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]:
            parameters[i] = table[row, HIGH]  # an end is met exactly
        elif t == (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]:
            parameters[i] = table[row, LOW]

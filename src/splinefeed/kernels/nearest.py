"""The nearest point of a curve or a path: cells of little turn in a tree of boxes, bounds that hold, Newton inside.

A cell is a part of one row of an arc-length table (see `kernels.pieces`) over which the tangent turns little.
Row of the cells (cells, 6 + 2 linear):

    ROW, T_LOW, T_HIGH   which part of which row
    REACH                no point of the cell is further than this from the chord between its ends, mm
    SPEED                greatest |dC/dt|, mm
    BEND                 greatest curvature, 1/mm
    ENDS + a             first end, one per linear axis, then the last end

Boxes (2 leaves, 2 linear) are a binary heap: node i holds nodes 2 i and 2 i + 1, node leaves + i holds cell i; least
coordinates, then greatest. Only the linear axes of the shape count for distances; a row on which none of them moves is
one cell, a point.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import SLOW_PLACES, SMALL_STEP, arc_length, slow_places
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, ORIGIN, SCALE, Shape, derivatives, point, turns
from splinefeed.records import Array, IntArray

ROW, T_LOW, T_HIGH, REACH, SPEED, BEND, ENDS = 0, 1, 2, 3, 4, 5, 6

#: Length of a cell times its greatest curvature: its tangent turns by no more, rad.
CELL_TURN = 0.6
#: A cell shorter than this, relative to the whole length, is not cut: a cusp is closed in on no further ...
NO_LENGTH = 1e-14
#: ... nor by more bisections than this.
MAX_HALVINGS = 50
#: Places in a row or a cell at which speed and curvature are looked at, and what is allowed for between them.
SAMPLES = 9
MARGIN = 1.2
#: Bisections of a cell before minima are looked for without proof that there is one at most.
MAX_BISECTIONS = 4
#: Newton steps inside one interval; a step that does not halve the one before is a bisection.
MAX_STEPS = 60
#: Nodes that wait during a search: one a level of the tree, and a few.
MAX_WAITING = 72
#: Rounding of a length or a coordinate, relative, as bounds allow for it.
ROUNDING = 1e-15


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
def speed_and_bend(
    table: Array, row: int, shape: Shape, low: float, high: float, slow: Array, slow_count: int, work: Array
) -> tuple[float, float]:
    """Greatest |dC/dt|, mm, and curvature, 1/mm, from low to high in t: of samples and the slow places, with MARGIN.

    Curvature peaks where the curve is slow, and is infinite where C' = 0; slow (slow_count,) in t, work (3, axes).
    """
    linear = abs(shape[2])
    speed = 0.0
    bend = 0.0
    for i in range(SAMPLES + slow_count):
        t = low + (high - low) * i / (SAMPLES - 1) if i < SAMPLES else slow[i - SAMPLES]
        if t < low or t > high:
            continue
        derivatives(table, row, shape, t, 2, work)
        square = 0.0
        product = 0.0
        for a in range(linear):
            square += work[1, a] * work[1, a]
            product += work[1, a] * work[2, a]
        if square == 0.0:
            bend = math.inf
            continue
        across = 0.0
        for a in range(linear):
            part = work[2, a] - product / square * work[1, a]
            across += part * part
        speed = max(speed, math.sqrt(square) / table[row, SCALE])
        bend = max(bend, math.sqrt(across) / square)
    return MARGIN * speed, MARGIN * bend


@kernel
def make_cells(table: Array, shape: Shape, cells: Array) -> int:
    """Bisect every row of an arc-length table until it turns by CELL_TURN; fill `cells`, return how many are needed.

    All points of an arc of length l between two ends c apart lie in the ellipsoid with the ends as foci, and so no
    further than sqrt(l^2 - c^2) / 2 from the chord. If `cells` has too few rows it is filled as far as it goes.
    """
    linear = abs(shape[2])
    count = 0
    work = np.empty((3, shape[1]))
    first = np.empty(shape[1])
    last = np.empty(shape[1])
    slow = np.empty(SLOW_PLACES)
    low_of = np.empty(MAX_HALVINGS + 2)
    high_of = np.empty(MAX_HALVINGS + 2)
    total = arc_length(table, table.shape[0] - 1, 1.0)
    for row in range(table.shape[0]):
        # not quite -1 and 1, if the middle of the row had to be rounded
        low_of[0] = (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]
        high_of[0] = (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]
        shortest = (high_of[0] - low_of[0]) * 0.5**MAX_HALVINGS
        slow_count = slow_places(table, row, slow)
        waiting = 1
        while waiting > 0:
            waiting -= 1
            low = low_of[waiting]
            high = high_of[waiting]
            length = 0.0
            speed = 0.0
            bend = 0.0
            if shape[2] > 0 or not turns(table, row, shape):
                length = arc_length(table, row, high) - arc_length(table, row, low)
                speed, bend = speed_and_bend(table, row, shape, low, high, slow, slow_count, work)
            if bend * length > CELL_TURN and length > NO_LENGTH * total and high - low > 1.5 * shortest:
                # the second half waits below the first, so that cells come out in order
                low_of[waiting] = 0.5 * (low + high)
                high_of[waiting] = high
                low_of[waiting + 1] = low
                high_of[waiting + 1] = 0.5 * (low + high)
                waiting += 2
                continue
            if count < cells.shape[0]:
                point(table, row, shape, low, first)
                point(table, row, shape, high, last)
                chord = 0.0
                away = 0.0
                for a in range(linear):
                    chord += (last[a] - first[a]) ** 2
                    away = max(away, abs(first[a]), abs(last[a]))
                    cells[count, ENDS + a] = first[a]
                    cells[count, ENDS + linear + a] = last[a]
                length += ROUNDING * total
                bulge = max(length * length - chord, 0.0) + 8.0 * ROUNDING * length * length
                cells[count, ROW] = row
                cells[count, T_LOW] = low
                cells[count, T_HIGH] = high
                cells[count, REACH] = 0.5 * math.sqrt(bulge) + ROUNDING * away
                cells[count, SPEED] = speed
                cells[count, BEND] = bend
            count += 1
    return count


@kernel
def make_boxes(cells: Array, linear: int, boxes: Array) -> None:
    """Fill the tree of boxes, (2 leaves, 2 linear), leaves a power of two and not less than the number of cells.

    Along axis a the ellipsoid of `make_cells` reaches sqrt(d_a^2 + l^2 - c^2) / 2 from its middle, d the chord.
    """
    leaves = boxes.shape[0] // 2
    for a in range(linear):
        for i in range(leaves):
            boxes[leaves + i, a] = math.inf
            boxes[leaves + i, linear + a] = -math.inf
        for i in range(cells.shape[0]):
            low = cells[i, ENDS + a]
            high = cells[i, ENDS + linear + a]
            middle = 0.5 * (low + high)
            half = math.sqrt(0.25 * (high - low) ** 2 + cells[i, REACH] ** 2) + ROUNDING * abs(middle)
            boxes[leaves + i, a] = middle - half
            boxes[leaves + i, linear + a] = middle + half
        for i in range(leaves - 1, 0, -1):
            boxes[i, a] = min(boxes[2 * i, a], boxes[2 * i + 1, a])
            boxes[i, linear + a] = max(boxes[2 * i, linear + a], boxes[2 * i + 1, linear + a])


@kernel
def box_bound(boxes: Array, node: int, linear: int, query: Array) -> float:
    """Squared distance from a point to a box, mm^2; infinite for a box of nothing."""
    total = 0.0
    for a in range(linear):
        outside = max(boxes[node, a] - query[a], query[a] - boxes[node, linear + a], 0.0)
        total += outside * outside
    return total


@kernel
def cell_bound(cells: Array, index: int, linear: int, query: Array) -> float:
    """Squared distance, mm^2, that no point of a cell falls below: to the chord, less REACH."""
    chord = 0.0
    along = 0.0
    for a in range(linear):
        side = cells[index, ENDS + linear + a] - cells[index, ENDS + a]
        chord += side * side
        along += side * (query[a] - cells[index, ENDS + a])
    share = min(max(along / chord, 0.0), 1.0) if chord > 0.0 else 0.0
    square = 0.0
    for a in range(linear):
        side = cells[index, ENDS + linear + a] - cells[index, ENDS + a]
        apart = query[a] - cells[index, ENDS + a] - share * side
        square += apart * apart
    distance = math.sqrt(square) - cells[index, REACH]
    return distance * distance if distance > 0.0 else 0.0


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
    query: Array,
    start: float,
    low_of: Array,
    high_of: Array,
    best: float,
    at: float,
) -> tuple[float, float]:
    """The better of (best, at) and the least |C - Q|^2, mm^2, over one cell, with its t; looks at `start` first.

    With D = |C - Q|^2 / 2 and arc length s: dD/ds = (C - Q).T and d2D/ds2 = 1 + (C - Q).kN. Within h of a place of
    distance d the last term is at most b = (d + h) k, k the greatest curvature. So there
        |C - Q| >= d - h  and  |C - Q|^2 >= d^2 - 2 |dD/ds| h - max(b - 1, 0) h^2   (nothing better: left out),
        b < 1:  D is convex, it has one minimum;  |dD/ds| > h (1 + b):  D falls towards one end.
    An interval of which none is true is bisected; low_of and high_of hold those that wait. After MAX_BISECTIONS what
    is left is so short that dD/dt is a cubic to all purposes: from an end at which D falls inwards Newton's method
    comes to the minimum next to it, and a cubic has no others.
    """
    row = int(cells[index, ROW])
    speed = cells[index, SPEED]
    curvature = cells[index, BEND]
    low_of[0] = cells[index, T_LOW]
    high_of[0] = cells[index, T_HIGH]
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
    linear = abs(shape[2])
    leaves = boxes.shape[0] // 2
    low_of = np.empty(MAX_BISECTIONS + 2)
    high_of = np.empty(MAX_BISECTIONS + 2)
    nodes = np.empty(MAX_WAITING, dtype=np.int64)
    bounds = np.empty(MAX_WAITING)
    last = 0
    t = 0.0
    for i in range(queries.shape[0]):
        query = queries[i]
        best = math.inf
        found = last
        nodes[0] = 1
        bounds[0] = 0.0
        nodes[1] = leaves + last
        bounds[1] = 0.0
        waiting = 2
        while waiting > 0:
            waiting -= 1
            if bounds[waiting] >= best:
                continue
            node = nodes[waiting]
            if node >= leaves:
                index = node - leaves
                first = best == math.inf
                if first or (index != last and cell_bound(cells, index, linear, query) < best):
                    before = best
                    start = t if first else 0.5 * (cells[index, T_LOW] + cells[index, T_HIGH])
                    best, t = search_cell(table, shape, cells, index, query, start, low_of, high_of, best, t)
                    if best < before:
                        found = index
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
            waiting += 2
        last = found
        row = int(cells[found, ROW])
        rows[i] = row
        distances[i] = math.sqrt(best)
        u = table[row, MIDDLE] + t / table[row, SCALE]
        parameters[i] = min(max(u, table[row, LOW]), table[row, HIGH])
        if t == (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]:
            parameters[i] = table[row, HIGH]  # an end is met exactly
        elif t == (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]:
            parameters[i] = table[row, LOW]

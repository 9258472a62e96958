"""A curve or a path as cells of little turn in a tree of boxes, with bounds of the distance that hold.

A cell is a part of one row of an arc-length table (see `kernels.layout`) over which the tangent turns little.
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

from splinefeed.kernels.arc_length import SLOW_PLACES, arc_length, slow_places
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, SCALE, Shape, derivatives, point, turns
from splinefeed.records import Array

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
#: Rounding of a length or a coordinate, relative, as bounds allow for it.
ROUNDING = 1e-15


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
def find_cell(cells: Array, row: int, t: float) -> int:
    """The cell that holds t of one row, by bisection: cells are in the order of the table."""
    low = 0
    high = cells.shape[0] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if cells[middle, ROW] < row or (cells[middle, ROW] == row and cells[middle, T_LOW] <= t):
            low = middle
        else:
            high = middle - 1
    return low

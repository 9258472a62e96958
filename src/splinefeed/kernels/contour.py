"""Nearest point of a stretch of a path, on which side of it a position is, and the arc length of what was found.

The search itself, of a stretch as of a whole path, is that of `kernels.nearest`.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.cells import ROW as CELL_ROW
from splinefeed.kernels.cells import T_HIGH, T_LOW, find_cell
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.nearest import search, search_room, squared_distance
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, SCALE, START, Shape, derivatives, find_row, turns
from splinefeed.records import Array

#: Half-width of the window about the commanded arc length, in units of the distance from the commanded point.
REACH = 4.0
#: ... and at least this, relative to the length of the path.
LEAST_WINDOW = 1e-9
#: Doublings of a window: from the least one to any path.
MOST_DOUBLINGS = 40
#: A nearest point this close to the edge of its window, relative, or to the end of the path, lies on it.
ON_EDGE = 1e-9
#: A derivative this much shorter than the next ones over a row is none.
VANISHING = 1e-12

#: Columns of what a search found: distance, mm; row; t, exactly -1 or 1 at the ends of the row.
DISTANCE, ROW, PLACE = 0, 1, 2


@kernel
def _offset(s: float, hint: float, length: float, closed: bool) -> float:
    """s - hint, mm, on a closed path the shorter way round."""
    offset = s - hint
    if closed:
        if offset > 0.5 * length:
            offset -= length
        elif offset < -0.5 * length:
            offset += length
    return offset


@kernel
def _reach(table: Array, shape: Shape, hint: float, half: float, way: int) -> float:
    """How far from arc length `hint` the window reaches, mm, one way: `half`, not counting rows that only turn."""
    if shape[2] > 0:
        return half
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, hint)
    s = hint
    left = half
    while 0 <= row <= last_row:
        end = table[row, START] if way < 0 else arc_length(table, row, 1.0)
        if not turns(table, row, shape):
            if abs(end - s) >= left:
                break
            left -= abs(end - s)
        s = end
        row += way
    return abs(s - hint) + left


@kernel
def _search_stretch(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    start: float,
    end: float,
    exact: bool,
    query: Array,
    found: int,
    t: float,
    best: float,
    room: Array,
) -> tuple[int, float, float]:
    """`search` of the cells that hold arc lengths start ... end, mm; with `exact` of no more than that stretch."""
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, start)
    low = parameter_in_row(table, row, start, 0.0)
    first = find_cell(cells, row, low)
    row = find_row(table, row, last_row, START, end)
    high = parameter_in_row(table, row, end, 0.0)
    last = max(find_cell(cells, row, high), first)
    if not exact:
        low = cells[first, T_LOW]
        high = cells[last, T_HIGH]
    return search(table, shape, cells, boxes, first, last, low, high, query, found, t, best, -1, room)


@kernel
def nearest_in_window(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    closed: bool,
    window: float,
    position: Array,
    s_hint: Array,
    out: Array,
) -> None:
    """Nearest point near arc length s_hint (n,), mm, to every position (n, linear), mm, into out (n, 3).

    The window is [s_hint - h, s_hint + h] with h = max(window, REACH |position - r(s_hint)|), doubled until its
    nearest point is not one of its own ends, unless that is an end of the path; on a closed path it runs over the seam.
    It ends as the whole path. Stretches on which only rotary axes move are points and do not count for h.
    """
    room = search_room()
    last_row = table.shape[0] - 1
    last_cell = cells.shape[0] - 1
    length = arc_length(table, last_row, 1.0)
    for i in range(position.shape[0]):
        q = position[i]
        hint = min(max(s_hint[i], 0.0), length)
        row = find_row(table, 0, last_row, START, hint)
        whole = arc_length(table, row, 1.0) - table[row, START]
        guess = 2.0 * (hint - table[row, START]) / whole - 1.0 if whole > 0.0 else 0.0
        hint_t = parameter_in_row(table, row, hint, guess)
        hint_cell = find_cell(cells, row, hint_t)
        hint_square, _, _, _ = squared_distance(table, row, shape, hint_t, q)
        found, t, best = hint_cell, hint_t, hint_square
        half = max(window, REACH * math.sqrt(hint_square), LEAST_WINDOW * length)
        for _ in range(MOST_DOUBLINGS):
            if best == 0.0:
                break
            back = _reach(table, shape, hint, half, -1)
            forth = _reach(table, shape, hint, half, 1)
            if (closed and back + forth >= length) or (not closed and back >= hint and forth >= length - hint):
                low, high = cells[0, T_LOW], cells[last_cell, T_HIGH]
                found, t, best = search(
                    table, shape, cells, boxes, 0, last_cell, low, high, q, hint_cell, hint_t, hint_square, -1, room
                )
                break
            settled = False
            # whole cells first: if their nearest point lies in the window, it is the window's; else only the window
            for exact in (False, True):
                found, t, best = _search_stretch(
                    table, shape, cells, boxes, max(hint - back, 0.0), min(hint + forth, length), exact, q,
                    hint_cell, hint_t, hint_square, room,
                )  # fmt: skip
                if closed and hint - back < 0.0:
                    start = hint - back + length
                    found, t, best = _search_stretch(
                        table, shape, cells, boxes, start, length, exact, q, found, t, best, room
                    )
                elif closed and hint + forth > length:
                    end = hint + forth - length
                    found, t, best = _search_stretch(
                        table, shape, cells, boxes, 0.0, end, exact, q, found, t, best, room
                    )
                s = arc_length(table, int(cells[found, CELL_ROW]), t)
                inside = -back * (1.0 - ON_EDGE) < _offset(s, hint, length, closed) < forth * (1.0 - ON_EDGE)
                at_end = not closed and (s <= ON_EDGE * half or s >= length - ON_EDGE * half)
                if inside or (at_end and exact):
                    settled = True
                    break
            if settled:
                break
            half *= 2.0
        row = int(cells[found, CELL_ROW])
        out[i, DISTANCE] = math.sqrt(best)
        out[i, ROW] = row
        out[i, PLACE] = t
        if t <= (table[row, LOW] - table[row, MIDDLE]) * table[row, SCALE]:
            out[i, PLACE] = -1.0
        elif t >= (table[row, HIGH] - table[row, MIDDLE]) * table[row, SCALE]:
            out[i, PLACE] = 1.0


@kernel
def arc_lengths(table: Array, found: Array, out: Array) -> None:
    """Arc length, mm, of what a search found (n, 3), into out (n,)."""
    for i in range(found.shape[0]):
        out[i] = arc_length(table, int(found[i, ROW]), found[i, PLACE])


@kernel
def _direction(table: Array, row: int, shape: Shape, t: float, before: bool, at: Array) -> tuple[float, float]:
    """Unit tangent of a planar row at t; where C' = 0 its limit from the side `before` t or behind it."""
    derivatives(table, row, shape, t, 3, at)
    scale = table[row, SCALE]
    sizes = (
        math.hypot(at[1, 0], at[1, 1]) / scale,
        math.hypot(at[2, 0], at[2, 1]) / (scale * scale),
        math.hypot(at[3, 0], at[3, 1]) / (scale * scale * scale),
    )
    order = 1
    # a derivative that is below the rounding of the next ones counts as none
    if sizes[0] <= VANISHING * max(sizes[1], sizes[2]):
        order = 2 if sizes[1] > VANISHING * sizes[2] else 3
    norm = math.hypot(at[order, 0], at[order, 1])
    if norm == 0.0:
        return 0.0, 0.0
    sign = -1.0 if before and order == 2 else 1.0
    return sign * at[order, 0] / norm, sign * at[order, 1] / norm


@kernel
def sides(table: Array, shape: Shape, closed: bool, position: Array, found: Array, out: Array) -> None:
    """+1 for a position (n, 2) left of the path at the point found for it (n, 3), -1 for right of it, into out (n,).

    Left of the sum of the unit tangents before and behind the point: at a corner that is right for every position
    whose nearest point the corner is. Where the path turns straight back the tangent before it decides.
    """
    at = np.empty((4, shape[1]))
    point = np.empty(2)
    last_row = table.shape[0] - 1
    for i in range(found.shape[0]):
        row = int(found[i, ROW])
        t = found[i, PLACE]
        before_row = row
        before = t
        behind_row = row
        behind = t
        if t <= -1.0 and (row > 0 or closed):
            before_row = row - 1 if row > 0 else last_row
            before = 1.0
        elif t >= 1.0 and (row < last_row or closed):
            behind_row = row + 1 if row < last_row else 0
            behind = -1.0
        x0, y0 = _direction(table, before_row, shape, before, True, at)
        x1, y1 = _direction(table, behind_row, shape, behind, False, at)
        point[0] = position[i, 0] - at[0, 0]
        point[1] = position[i, 1] - at[0, 1]
        x = x0 + x1
        y = y0 + y1
        if math.hypot(x, y) <= 1e-9:
            x = x0
            y = y0
        out[i] = 1.0 if x * point[1] - y * point[0] >= 0.0 else -1.0

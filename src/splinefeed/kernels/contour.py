"""Nearest point of a stretch of a path: bounds of its arc-length pieces, and the search within a window.

The nearest point of the whole path is the matter of `kernels.nearest`.

Everything is said in the parameter t in [-1, 1] of one row of a path's table (`kernels.pieces`). With q the position
and r(t) = C(t) - q over the linear axes, the square of the distance and its derivatives are

    f = r.r / 2,   f' = r.r',   f'' = r'.r' + r.r'',   f''' = 3 r'.r'' + r.r'''

and |f'''| <= 3 v a + (|r(m)| + h v) b =: M on [m - h, m + h] with v, a, b the largest |C'|, |C''|, |C'''| of the row.
So one evaluation at the middle m bounds f from below by its second-order polynomial less M h^3 / 6, and tells an
interval on which f is convex (f''(m) > M h), concave or monotone from one that must be halved. Cusps need nothing of
their own: no bound divides by |C'|.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.nearest import squared_distance
from splinefeed.kernels.pieces import SCALE, START, Shape, derivatives, find_row, turns
from splinefeed.records import Array

#: Chebyshev-Lobatto points at which the derivatives of a row are looked at.
SAMPLES = 33
#: A polynomial of degree 12 is nowhere larger than 1 / cos(12 pi / 64) = 1.21 times its largest value at these points
#: (Ehlich and Zeller, Math. Z. 86, 1964); the rest of the margin is for rational pieces, which are no polynomials.
SAMPLE_MARGIN = 1.5
#: The search may be this far off, relative to the largest coordinate: a few roundings.
TOLERANCE = 4e-15
#: An interval of t no wider than this either side, still undecided, is settled by one descent.
LEAST_HALF = 2.0**-10
#: Intervals of one row looked at for one position; only a position from which a whole arc is equally far needs many.
MOST_INTERVALS = 1024
#: Intervals that wait, one a halving.
STACK = 64
#: Steps of one descent, the first ones by Newton's method; should they not do, bisection does.
NEWTON_STEPS = 30
MOST_STEPS = 90
#: A step in t after which the next, of the order of its square, is below rounding, and the same of a bisection.
SMALL_STEP = 1e-8
LEAST_STEP = 1e-16
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

#: Columns of what a search found.
DISTANCE, ROW, PLACE = 0, 1, 2
#: ROW of a position whose window is the whole path.
WHOLE = -1.0


def bounds_width(linear: int) -> int:
    """Columns of the bounds of a row: least and greatest coordinates over the linear axes, then v, a, b."""
    return 2 * linear + 3


@kernel
def fill_bounds(table: Array, shape: Shape, bounds: Array) -> None:
    """Box and largest |C'|, |C''|, |C'''| by t of every row, into bounds (rows, 2 linear + 3), mm.

    On a row |C(t) - chord(t)| <= (1 - t^2) max|C''| / 2: the box of its ends, wider by that, holds the row.
    """
    linear = abs(shape[2])
    at = np.empty((4, shape[1]))
    for row in range(table.shape[0]):
        scale = table[row, SCALE]
        for a in range(linear):
            bounds[row, a] = np.inf
            bounds[row, linear + a] = -np.inf
        for k in range(3):
            bounds[row, 2 * linear + k] = 0.0
        for i in range(SAMPLES):
            derivatives(table, row, shape, math.cos(math.pi * i / (SAMPLES - 1)), 3, at)
            factor = SAMPLE_MARGIN
            for k in range(1, 4):
                factor /= scale
                total = 0.0
                for a in range(linear):
                    total += at[k, a] * at[k, a]
                bounds[row, 2 * linear + k - 1] = max(bounds[row, 2 * linear + k - 1], factor * math.sqrt(total))
            if i == 0 or i == SAMPLES - 1:
                for a in range(linear):
                    bounds[row, a] = min(bounds[row, a], at[0, a])
                    bounds[row, linear + a] = max(bounds[row, linear + a], at[0, a])
        for a in range(linear):
            bounds[row, a] -= 0.5 * bounds[row, 2 * linear + 1]
            bounds[row, linear + a] += 0.5 * bounds[row, 2 * linear + 1]


@kernel
def _box_distance(box: Array, linear: int, q: Array) -> float:
    """Distance of q from a box (least, then greatest coordinates), 0 inside, mm."""
    total = 0.0
    for a in range(linear):
        out = max(box[a] - q[a], q[a] - box[linear + a], 0.0)
        total += out * out
    return math.sqrt(total)


@kernel
def _descend(table: Array, row: int, shape: Shape, q: Array, low: float, high: float, t: float) -> float:
    """t in [low, high] where f' = 0, or the end that f falls to, by Newton's method kept inside a bracket."""
    low_known = False
    high_known = False
    for k in range(MOST_STEPS):
        _, slope, bend, _ = squared_distance(table, row, shape, t, q)
        if slope > 0.0:
            high = t
            high_known = True
        elif slope < 0.0:
            low = t
            low_known = True
        else:
            break
        after = t - slope / bend if bend > 0.0 else (low - 1.0 if slope > 0.0 else high + 1.0)
        small = SMALL_STEP
        if k >= NEWTON_STEPS or (after < low and low_known) or (after > high and high_known):
            after = 0.5 * (low + high)
            small = LEAST_STEP
        after = min(max(after, low), high)
        step = abs(after - t)
        t = after
        if step < small:
            break
    return t


@kernel
def _try(table: Array, row: int, shape: Shape, q: Array, t: float, best: Array) -> None:
    """Take the point at t of one row for the best if it is nearer."""
    square, _, _, _ = squared_distance(table, row, shape, t, q)
    distance = math.sqrt(square)
    if distance < best[DISTANCE]:
        best[DISTANCE] = distance
        best[ROW] = row
        best[PLACE] = t


@kernel
def search_row(
    table: Array,
    row: int,
    shape: Shape,
    bounds: Array,
    q: Array,
    low: float,
    high: float,
    tolerance: float,
    best: Array,
    stack: Array,
) -> None:
    """Improve `best` by the nearest point of one row with t in [low, high]; branch and bound, see the module.

    tolerance  mm: what cannot be nearer than the best by more than this is left alone. stack (STACK, 2) is room.
    """
    linear = abs(shape[2])
    v = bounds[row, 2 * linear]
    a = bounds[row, 2 * linear + 1]
    b = bounds[row, 2 * linear + 2]
    stack[0, 0] = low
    stack[0, 1] = high
    stacked = 1
    for _ in range(MOST_INTERVALS):
        if stacked == 0:
            break
        stacked -= 1
        low = stack[stacked, 0]
        high = stack[stacked, 1]
        middle = 0.5 * (low + high)
        half = 0.5 * (high - low)
        square, slope, bend, _ = squared_distance(table, row, shape, middle, q)
        distance = math.sqrt(square)
        if distance < best[DISTANCE]:
            best[DISTANCE] = distance
            best[ROW] = row
            best[PLACE] = middle
        third = (3.0 * v * a + (distance + half * v) * b) * half
        least = 0.5 * square - third * half * half / 6.0
        if bend > 0.0 and abs(slope) < bend * half:
            least -= 0.5 * slope * slope / bend
        else:
            least += (0.5 * bend * half - abs(slope)) * half
        wanted = best[DISTANCE] - tolerance if best[DISTANCE] > tolerance else best[DISTANCE]
        if least >= 0.5 * wanted * wanted:
            continue
        if abs(slope) > half * (abs(bend) + 0.5 * third):
            _try(table, row, shape, q, low if slope > 0.0 else high, best)
        elif bend > third or half <= LEAST_HALF:
            start = best[PLACE] if best[ROW] == row and low <= best[PLACE] <= high else middle
            _try(table, row, shape, q, _descend(table, row, shape, q, low, high, start), best)
        elif bend < -third:
            _try(table, row, shape, q, low, best)
            _try(table, row, shape, q, high, best)
        else:
            # the half that f falls towards is looked at first
            near = 1 if slope > 0.0 else 0
            stack[stacked + near, 0] = low
            stack[stacked + near, 1] = middle
            stack[stacked + 1 - near, 0] = middle
            stack[stacked + 1 - near, 1] = high
            stacked += 2


@kernel
def _search_stretch(
    table: Array,
    shape: Shape,
    bounds: Array,
    start: float,
    end: float,
    exact: bool,
    q: Array,
    tolerance: float,
    best: Array,
    stack: Array,
) -> None:
    """Improve `best` by the rows that hold arc lengths start ... end, mm; with `exact` by no more than that stretch."""
    last_row = table.shape[0] - 1
    first = find_row(table, 0, last_row, START, start)
    last = find_row(table, first, last_row, START, end)
    low = parameter_in_row(table, first, start, 0.0) if exact else -1.0
    high = parameter_in_row(table, last, end, 0.0) if exact else 1.0
    if first == last:
        search_row(table, first, shape, bounds, q, low, high, tolerance, best, stack)
        return
    search_row(table, first, shape, bounds, q, low, 1.0, tolerance, best, stack)
    search_row(table, last, shape, bounds, q, -1.0, high, tolerance, best, stack)
    for row in range(first + 1, last):
        if _box_distance(bounds[row], abs(shape[2]), q) < best[DISTANCE]:
            search_row(table, row, shape, bounds, q, -1.0, 1.0, tolerance, best, stack)


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
def nearest_in_window(
    table: Array,
    shape: Shape,
    bounds: Array,
    tolerance: float,
    closed: bool,
    window: float,
    position: Array,
    s_hint: Array,
    out: Array,
) -> None:
    """Nearest point near arc length s_hint (n,), mm, to every position (n, linear), mm, into out (n, 3).

    The window is [s_hint - h, s_hint + h] with h = max(window, REACH |position - r(s_hint)|), doubled until its
    nearest point is not one of its own ends, unless that is an end of the path; on a closed path it runs over the seam.
    Where it has grown to the whole path, the search is left to others: ROW is WHOLE. Stretches on which only rotary
    axes move are points and do not count for h.
    """
    stack = np.empty((STACK, 2))
    best = np.empty(3)
    at_hint = np.empty(3)
    last_row = table.shape[0] - 1
    length = arc_length(table, last_row, 1.0)
    for i in range(position.shape[0]):
        q = position[i]
        hint = min(max(s_hint[i], 0.0), length)
        row = find_row(table, 0, last_row, START, hint)
        whole = arc_length(table, row, 1.0) - table[row, START]
        guess = 2.0 * (hint - table[row, START]) / whole - 1.0 if whole > 0.0 else 0.0
        best[DISTANCE] = np.inf
        _try(table, row, shape, q, parameter_in_row(table, row, hint, guess), best)
        for k in range(3):
            at_hint[k] = best[k]
        half = max(window, REACH * best[DISTANCE], LEAST_WINDOW * length)
        for _ in range(MOST_DOUBLINGS):
            if best[DISTANCE] == 0.0:
                break
            back = _reach(table, shape, hint, half, -1)
            forth = _reach(table, shape, hint, half, 1)
            if (closed and back + forth >= length) or (not closed and back >= hint and forth >= length - hint):
                best[ROW] = WHOLE
                break
            settled = False
            # whole rows first: if their nearest point lies in the window, it is the window's; else only the window
            for exact in (False, True):
                for k in range(3):
                    best[k] = at_hint[k]
                start = max(hint - back, 0.0)
                end = min(hint + forth, length)
                _search_stretch(table, shape, bounds, start, end, exact, q, tolerance, best, stack)
                if closed and hint - back < 0.0:
                    start = hint - back + length
                    _search_stretch(table, shape, bounds, start, length, exact, q, tolerance, best, stack)
                elif closed and hint + forth > length:
                    end = hint + forth - length
                    _search_stretch(table, shape, bounds, 0.0, end, exact, q, tolerance, best, stack)
                s = arc_length(table, int(best[ROW]), best[PLACE])
                inside = -back * (1.0 - ON_EDGE) < _offset(s, hint, length, closed) < forth * (1.0 - ON_EDGE)
                at_end = not closed and (s <= ON_EDGE * half or s >= length - ON_EDGE * half)
                if inside or (at_end and exact):
                    settled = True
                    break
            if settled:
                break
            half *= 2.0
        out[i] = best


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

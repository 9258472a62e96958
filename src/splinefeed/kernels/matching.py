"""Runs of short lines: two of them traversed side by side, forwards only, and points that stand for others."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array, BoolArray, IntArray

#: How a node was reached: from the opposite edge of its cell or from the one beside it.
ACROSS, BESIDE = 1, 2


@kernel
def apart(p: Array, i: int, x: float, q: Array, j: int, y: float, linear: int) -> float:
    """Square of the distance of p at chord i, share x, from q at chord j, share y: over the linear or other axes.

    The larger of the two. p, q (n + 1, axes) are in tolerances.
    """
    along = 0.0
    turned = 0.0
    for a in range(p.shape[1]):
        step = p[i, a] + x * (p[i + 1, a] - p[i, a]) - q[j, a] - y * (q[j + 1, a] - q[j, a])
        if a < linear:
            along += step * step
        else:
            turned += step * step
    return max(along, turned)


@kernel
def nearest_share(p: Array, k: int, q: Array, j: int, linear: int) -> float:
    """Share of chord j of q at which it is nearest to the point p[k], by the larger of both distances.

    Each is a parabola in the share: the least of the larger one lies at the foot of either or where they cross.
    """
    best = math.inf
    at = 0.0
    c = np.zeros((2, 3))  # constant, linear, quadratic
    for a in range(q.shape[1]):
        step = q[j + 1, a] - q[j, a]
        off = q[j, a] - p[k, a]
        which = 0 if a < linear else 1
        c[which, 0] += off * off
        c[which, 1] += 2.0 * off * step
        c[which, 2] += step * step
    constant, slope, square = c[0, 0] - c[1, 0], c[0, 1] - c[1, 1], c[0, 2] - c[1, 2]
    root = math.sqrt(max(slope * slope - 4.0 * square * constant, 0.0))
    total = -0.5 * (slope + math.copysign(root, slope))
    for above, below in ((-0.5 * c[0, 1], c[0, 2]), (-0.5 * c[1, 1], c[1, 2]), (total, square), (constant, total)):
        share = min(max(above / below, 0.0), 1.0) if below != 0.0 else 0.0
        largest = max(c[0, 0] + share * (c[0, 1] + share * c[0, 2]), c[1, 0] + share * (c[1, 1] + share * c[1, 2]))
        if largest < best:
            best = largest
            at = share
    return at


@kernel
def node(
    p: Array,
    k: int,
    q: Array,
    j: int,
    across: float,
    earlier: float,
    beside: float,
    end: bool,
    limit: float,
    linear: int,
) -> tuple[float, float, int]:
    """The node of p[k] beside chord j of q: largest distance on the way there, its share, and ACROSS, BESIDE or 0.

    It is reached from the opposite edge of its cell, where that is `across` at the share `earlier`, or from the one
    beside it, where that is `beside`; the distance is infinite beyond `limit`. end  the lines end here.
    """
    if across == math.inf and beside == math.inf:
        return math.inf, 0.0, 0
    share = 1.0 if end else nearest_share(p, k, q, j, linear)
    value = max(beside, apart(p, k - 1, 1.0, q, j, share, linear))
    way = BESIDE
    later = max(share, earlier)
    other = max(across, apart(p, k - 1, 1.0, q, j, later, linear))
    if other < value:
        value, share, way = other, later, ACROSS
    if value > limit:
        return math.inf, share, 0
    return value, share, way


@kernel
def side_by_side(
    p: Array, q: Array, linear: int, limit: float, lows: IntArray, starts: IntArray, places: Array, ways: IntArray
) -> int:
    """Traverse chords of two paths, forwards only, so that they stay near each other.

    Parameters
    ----------
    p, q : (points, axes) array
        Ends of the chords, in tolerances.
    linear : int
        How many of the first axes are linear.
    limit : float
        The square of the largest distance that counts.
    lows, starts : (chords of p + 1,) array of int
        First chord of q in each column, and its first row in places.
    places : (rows, 2) array
        The shares of the nodes on both edges.
    ways : (rows, 2) array of int
        ACROSS or BESIDE, or 0 where none is within the limit.

    Returns
    -------
    int
        The rows that are used, 0 if the end is not reached, or minus the rows that were there if they are too few.

    Notes
    -----
    A cell is a chord of p beside a chord of q; on its right and on its upper edge one node is kept: the place where the
    largest distance on the way there, as far as it is looked for, is least.
    """
    columns, chords = p.shape[0] - 1, q.shape[0] - 1
    left_value = np.full(chords + 1, np.inf)  # of the nodes on the line between the last column and this one
    left_share = np.zeros(chords + 1)
    left_value[0] = apart(p, 0, 0.0, q, 0, 0.0, linear)
    low = 0
    high = 1  # behind the last chord of q that the last column reached
    used = 0
    for i in range(columns):
        lows[i] = low
        starts[i] = used
        below_value = np.inf
        below_share = 0.0
        next_low = -1
        next_high = 0
        j = low
        while j < chords and (j < high or below_value < np.inf):
            if used >= places.shape[0]:
                return -places.shape[0]
            left = left_value[j] if j < high else np.inf
            share = left_share[j]
            end = i == columns - 1 and j == chords - 1
            left_value[j], left_share[j], way = node(p, i + 1, q, j, left, share, below_value, end, limit, linear)
            below_value, below_share, up = node(q, j + 1, p, i, below_value, below_share, left, end, limit, linear)
            places[used, 0], places[used, 1] = left_share[j], below_share
            ways[used, 0], ways[used, 1] = way, up
            used += 1
            if way != 0:
                if next_low < 0:
                    next_low = j
                next_high = j + 1
            j += 1
        if i == columns - 1:
            starts[columns] = used
            return used if j == chords and ways[used - 1, 0] != 0 else 0
        if next_low < 0:
            return 0
        low = next_low
        high = next_high
    return 0


@kernel
def traced(lows: IntArray, starts: IntArray, places: Array, ways: IntArray, out: Array) -> int:
    """The way back from the end of `side_by_side`: places on both lines, chord and share in one number, from behind.

    out (places, 2); returns how many there are, at most one a column and one a chord, and one.
    """
    i = starts.shape[0] - 2
    row = starts[i + 1] - 1
    edge = 0
    count = 0
    j = lows[i] + row - starts[i]
    while count < out.shape[0]:
        if edge == 0:
            out[count, 0], out[count, 1] = i + 1.0, j + places[row, 0]
        else:
            out[count, 0], out[count, 1] = i + places[row, 1], j + 1.0
        count += 1
        if (ways[row, edge] == ACROSS) == (edge == 0):  # from the left
            if i == 0:
                break
            i -= 1
            row = starts[i] + j - lows[i]
            edge = 0
        else:
            if j == 0:
                break
            j -= 1
            row -= 1
            edge = 1
    return count


@kernel
def thin(points: Array, held: BoolArray, linear: int, near: Array, turned: float, kept: BoolArray) -> int:
    """Mark the points that stay; the others stand near the last one that stayed.

    Parameters
    ----------
    points : (n, axes) array
        mm, rotary axes rad.
    held : (n,) array of bool
        Points that stay whatever is near; the others make room for them.
    linear : int
        How many of the first axes are linear.
    near : (n,) array
        Within which distance, mm.
    turned : float
        And within which angle over the axes behind the linear ones, rad.
    kept : (n,) array of bool
        Out: which stay.

    Returns
    -------
    int
        How many stay. A way out and back to the same place keeps the first point that is elsewhere, so that no line
        loses its length.
    """
    count = 0
    last = 0
    elsewhere = -1  # the first point behind the last one that stayed and not at its place
    for i in range(points.shape[0]):
        square = 0.0
        angle = 0.0
        for a in range(points.shape[1]):
            step = points[i, a] - points[last, a]
            if a < linear:
                square += step * step
            else:
                angle += step * step
        close = i > 0 and square <= near[i] * near[i] and angle <= turned * turned
        kept[i] = held[i] or not close
        if held[i] and close:
            if not held[last]:
                kept[last] = False
                count -= 1
            elif square == 0.0 and elsewhere > 0:
                kept[elsewhere] = True
                count += 1
        if kept[i]:
            count += 1
            last = i
            elsewhere = -1
        elif square > 0.0 and elsewhere < 0:
            elsewhere = i
    return count

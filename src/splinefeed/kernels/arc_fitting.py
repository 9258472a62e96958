"""The arc length of a curve, fitted by polynomials: made once a curve, read by `kernels.arc_length`."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, fitted_speed, slow_places
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import ARC, ARC_TERMS, HIGH, LOW, MIDDLE, SCALE, START, Shape, speed
from splinefeed.kernels.span_rows import fill_row, keeps_digits, widen
from splinefeed.records import Array, IntArray

#: Chebyshev nodes a piece; the first ARC_TERMS - 1 coefficients are kept, the others must have died out.
NODES = 16
#: Largest Chebyshev coefficient that may be dropped, relative to the largest speed on the piece.
TAIL = 1e-14
#: ... or, as an arc length, relative to that of the whole curve: below the rounding of s nothing is gained.
NEGLIGIBLE = 2e-16
#: How much a misfit of the speed at one place counts, against a coefficient: values carry more rounding than they.
END_SHARE = 0.1
#: Bisections of a knot span; a cusp inside a span is closed in on until it is NEGLIGIBLE, well before this.
MAX_DEPTH = 60


def _chebyshev_matrices() -> tuple[Array, Array, Array]:
    """Nodes (16,), values -> Chebyshev coefficients (16, 16), coefficients -> power form of the integral (11, 10)."""
    angles = (np.arange(NODES) + 0.5) * math.pi / NODES
    nodes = np.cos(angles)
    transform = 2.0 / NODES * np.cos(np.outer(np.arange(NODES), angles))
    transform[0] *= 0.5
    integral = np.zeros((ARC_TERMS, ARC_TERMS - 1))
    for k in range(ARC_TERMS - 1):
        unit = np.zeros(k + 1)
        unit[k] = 1.0
        antiderivative = np.polynomial.chebyshev.chebint(unit, lbnd=-1.0)
        integral[: k + 2, k] = np.polynomial.chebyshev.cheb2poly(antiderivative)
    return nodes, transform, integral


CHEBYSHEV_NODES, CHEBYSHEV_TRANSFORM, CHEBYSHEV_INTEGRAL = _chebyshev_matrices()


@kernel
def rough_length(table: Array, first: int, last: int, shape: Shape) -> float:
    """Sum over rows [first, last] of 16-point Chebyshev (Fejer) estimates of the length, good to a few digits; mm."""
    total = 0.0
    for row in range(first, last + 1):
        for i in range(NODES):
            weight = math.sin((i + 0.5) * math.pi / NODES) * math.pi / NODES
            total += weight * speed(table, row, shape, CHEBYSHEV_NODES[i]) / table[row, SCALE]
    return total


@kernel
def fit_speed(one: Array, shape: Shape, total: float, values: Array, coefficients: Array, slow: Array) -> bool:
    """Fit |C'| on one row (1, width) by a polynomial of degree 9 and write its integral; whether it is good enough.

    A line of degree 1 is exact. total  a rough length of the curve, mm; values, coefficients (NODES or more,) and slow
    (SLOW_PLACES or more,) are room.
    """
    half = 0.5 * (one[0, HIGH] - one[0, LOW])
    if shape[0] == 1 and shape[3] == 0:
        for k in range(2, ARC_TERMS):
            one[0, ARC + k] = 0.0
        one[0, ARC + 1] = speed(one, 0, shape, 0.0) * half
        one[0, ARC] = one[0, ARC + 1]
        return True
    top = 0.0
    for i in range(NODES):
        values[i] = speed(one, 0, shape, CHEBYSHEV_NODES[i])
        top = max(top, values[i])
    tail = 0.0
    for k in range(NODES):
        total_k = 0.0
        for i in range(NODES):
            total_k += CHEBYSHEV_TRANSFORM[k, i] * values[i]
        coefficients[k] = total_k
        if k >= ARC_TERMS - 1:
            tail = max(tail, abs(total_k))
    for k in range(ARC_TERMS):
        total_k = 0.0
        for i in range(ARC_TERMS - 1):
            total_k += CHEBYSHEV_INTEGRAL[k, i] * coefficients[i]
        one[0, ARC + k] = total_k * half
    if not (tail <= TAIL * top or tail * half <= NEGLIGIBLE * total):
        return False
    # a cusp between an end and its node, or two cusps between two nodes, are not seen by the nodes: all lie on
    # one smooth line, which falls below zero where the speed turns back up
    for i in range(slow_places(one, 0, slow)):
        misfit = abs(speed(one, 0, shape, slow[i]) - fitted_speed(one, 0, slow[i])[0] / half)
        tail = max(tail, END_SHARE * misfit)
    return tail <= TAIL * top or tail * half <= NEGLIGIBLE * total


@kernel
def arc_room(width: int) -> Array:
    """Where `arc_pieces` makes a row and keeps the halves that wait."""
    return np.empty((7, width + MAX_DEPTH + 2))


@kernel
def arc_pieces(
    knots: Array,
    points: Array,
    weights: Array,
    shape: Shape,
    total: float,
    table: Array,
    filled: int,
    wide: Shape,
    room: Array,
) -> int:
    """Bisect the knot spans of a curve until |C'| is a polynomial of degree 9 on each row; return the rows needed.

    points (n, axes), weights (n,) or none; total a rough length of the curve, mm. The first `filled` rows of `table`
    are there and count; it is in the shape `wide`. If it has too few rows it is filled as far as it goes. START is
    counted from the start of the curve. room  by `arc_room`.
    """
    one = room[:1]
    scratch, low_of, high_of, depth_of = room[0], room[1], room[2], room[3]
    values, coefficients, slow = room[4], room[5], room[6]
    start = 0.0
    lost = 0.0
    for span in range(shape[0], points.shape[0]):
        low_of[0] = knots[span]
        high_of[0] = knots[span + 1]
        depth_of[0] = 0
        stacked = 1 if knots[span] < knots[span + 1] else 0
        while stacked > 0:
            stacked -= 1
            low = low_of[stacked]
            high = high_of[stacked]
            depth = depth_of[stacked]
            fill_row(scratch, knots, points, weights, span, low, high, shape)
            middle = 0.5 * (low + high)
            fine = fit_speed(one, shape, total, values, coefficients, slow)
            fine = fine and keeps_digits(scratch, shape, (high - low) / (knots[span + 1] - knots[span]))
            if not fine and depth < MAX_DEPTH and low < middle < high:
                # the right half is stacked first, so that pieces come out in order
                low_of[stacked] = middle
                high_of[stacked] = high
                depth_of[stacked] = depth + 1
                low_of[stacked + 1] = low
                high_of[stacked + 1] = middle
                depth_of[stacked + 1] = depth + 1
                stacked += 2
                continue
            if filled < table.shape[0]:
                scratch[START] = start
                # t at the ends is not quite -1 and 1 if the middle had to be rounded
                scratch[ARC] -= arc_length(one, 0, (low - scratch[MIDDLE]) * scratch[SCALE]) - start
                length = arc_length(one, 0, (high - scratch[MIDDLE]) * scratch[SCALE]) - start
                widen(scratch, shape, table, filled, wide)
                # Kahan: the sum of thousands of pieces keeps its last digit
                length -= lost
                after = start + length
                lost = (after - start) - length
                start = after
            filled += 1
    return filled


@kernel
def fill_curves(
    degrees: IntArray,
    rational: IntArray,
    knot_starts: IntArray,
    knots: Array,
    point_starts: IntArray,
    points: Array,
    weights: Array,
    linear: int,
    spans: Array,
    span_rows: IntArray,
    wide: Shape,
    first: int,
    most: int,
    table: Array,
    filled: int,
    rows: IntArray,
    starts: Array,
    state: Array,
) -> tuple[int, int]:
    """`arc_pieces` of many curves, from curve `first` on, with arc length counted from the start of the first one.

    Curves as in `span_rows.fill_spans`, whose table and rows are `spans` and `span_rows`; linear  as in a shape. First
    and last row of each curve go into rows (n, 2), where it starts into starts (n + 1,), mm; state (2,) is carried on.
    Returns the first curve for which there was no room any more, or n, and the rows filled. A curve without length has
    none behind it either: it is returned with -1 - rows filled, as is one that needs more rows than `most`.
    """
    axes = points.shape[1]
    room = arc_room(table.shape[1])
    for i in range(first, degrees.shape[0]):
        shape = (degrees[i], axes, linear, rational[i])
        total = 0.0
        if degrees[i] > 1 or rational[i]:
            # in the wide shape, where a curve that is not rational has a weight of 1: the same bits
            total = rough_length(spans, span_rows[i, 0], span_rows[i, 1], (wide[0], axes, linear, wide[3]))
            if not 0.0 < total < math.inf:
                starts[i + 1] = total
                return i, -1 - filled
        own = slice(point_starts[i], point_starts[i + 1] if rational[i] else point_starts[i])
        after = arc_pieces(
            knots[knot_starts[i] : knot_starts[i + 1]],
            points[point_starts[i] : point_starts[i + 1]],
            weights[own],
            shape,
            total,
            table,
            filled,
            wide,
            room,
        )
        if after - filled > most:
            starts[i + 1] = after - filled
            return i, -1 - filled
        if after > table.shape[0]:
            return i, filled
        end = (table[after - 1, HIGH] - table[after - 1, MIDDLE]) * table[after - 1, SCALE]
        length = arc_length(table, after - 1, end)
        if not 0.0 < length < math.inf:
            starts[i + 1] = length
            return i, -1 - filled
        rows[i, 0] = filled
        rows[i, 1] = after - 1
        starts[i] = state[0]
        for row in range(filled, after):
            table[row, START] += state[0]
        step = length - state[1]  # Kahan, so that a long path keeps its last digit
        ahead = state[0] + step
        state[1] = (ahead - state[0]) - step
        state[0] = ahead
        starts[i + 1] = ahead
        filled = after
    return degrees.shape[0], filled

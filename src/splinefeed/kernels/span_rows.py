"""Knot spans, some in parts, as rows of a table of `kernels.pieces`."""

from __future__ import annotations

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.nurbs import power_form
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, ORIGIN, SCALE, Shape
from splinefeed.records import Array, IntArray

#: A row may give back the roundings of its control points this often ...
MOST_ROUNDINGS = 128.0
#: ... unless it covers no more than this share of its knot span: weights that differ by many decades.
LEAST_SHARE = 2.0**-20


@kernel
def fill_row(
    row: Array, knots: Array, points: Array, weights: Array, span: int, low: float, high: float, shape: Shape
) -> None:
    """Write interval, origin and coefficients of the part [low, high] of one knot span into `row`.

    points (n, axes), weights (n,). Arc length columns are left alone.
    """
    degree, axes, _, rational = shape
    columns = axes + rational
    first = span - degree
    near = first + degree // 2
    row[LOW] = low
    row[HIGH] = high
    row[MIDDLE] = 0.5 * (low + high)
    row[SCALE] = 2.0 / (high - low)
    local = np.empty((degree + 1, columns))
    for a in range(axes):
        row[ORIGIN + a] = points[near, a]
    for i in range(degree + 1):
        for a in range(axes):
            local[i, a] = points[first + i, a] - points[near, a]
            if rational:
                local[i, a] *= weights[first + i]
        if rational:
            local[i, axes] = weights[first + i]
    out = np.empty((degree + 1, columns))
    power_form(knots[first : span + degree + 2], local, degree, row[MIDDLE], 0.5 * (high - low), out)
    for c in range(columns):
        for k in range(degree + 1):
            row[ORIGIN + axes + c * (degree + 1) + k] = out[k, c]


@kernel
def keeps_digits(row: Array, shape: Shape, share: float) -> bool:
    """Whether the power form of a row that covers `share` of its knot span gives points as good as their rounding.

    (1 + share)^p sum_k |w_k| / min w  is how often the roundings of the control points come back, at most.
    """
    degree, axes, _, rational = shape
    if share <= LEAST_SHARE:
        return True
    growth = (1.0 + share) ** degree
    if rational:
        at = ORIGIN + axes + axes * (degree + 1)
        total = 0.0
        for k in range(degree + 1):
            total += abs(row[at + k])
        least = total
        for i in range(5):
            t = 0.5 * i - 1.0
            weight = row[at + degree]
            for k in range(degree - 1, -1, -1):
                weight = weight * t + row[at + k]
            least = min(least, weight)
        if not growth * total <= MOST_ROUNDINGS * least:
            return False
    return growth <= MOST_ROUNDINGS


@kernel
def widen(source: Array, shape: Shape, table: Array, row: int, wide: Shape) -> None:
    """Copy one row in `shape` to a row of a table in `wide`, of a degree as high or higher and rational or more so."""
    degree, axes, _, rational = shape
    for c in range(ORIGIN + axes):
        table[row, c] = source[c]
    for a in range(axes + wide[3]):
        at = ORIGIN + axes + a * (wide[0] + 1)
        for k in range(wide[0] + 1):
            table[row, at + k] = 0.0
        if a < axes + rational:
            for k in range(degree + 1):
                table[row, at + k] = source[ORIGIN + axes + a * (degree + 1) + k]
        else:
            table[row, at] = 1.0


@kernel
def fill_rows(table: Array, filled: int, knots: Array, points: Array, weights: Array, shape: Shape, wide: Shape) -> int:
    """Bisect the knot spans of a curve until every row keeps its digits; fill `table`, return the rows that it needs.

    points (n, axes), weights (n,) or none. The first `filled` rows of the table are there and count; it is in the shape
    `wide`, of the same axes. If it has too few rows it is filled as far as it goes.
    """
    one = np.zeros((1, table.shape[1]))
    scratch = one[0]
    for span in range(shape[0], points.shape[0]):
        width = knots[span + 1] - knots[span]
        low = knots[span]
        high = knots[span + 1]
        # the next row is tried from `low` on, over halves, quarters ... of the span until it holds
        while low < knots[span + 1]:
            fill_row(scratch, knots, points, weights, span, low, high, shape)
            middle = 0.5 * (low + high)
            if low < middle < high and not keeps_digits(scratch, shape, (high - low) / width):
                high = middle
                continue
            if filled < table.shape[0]:
                widen(scratch, shape, table, filled, wide)
            filled += 1
            low = high
            high = knots[span + 1]
    return filled


@kernel
def fill_spans(
    degrees: IntArray,
    rational: IntArray,
    knot_starts: IntArray,
    knots: Array,
    point_starts: IntArray,
    points: Array,
    weights: Array,
    wide: Shape,
    first: int,
    table: Array,
    filled: int,
    rows: IntArray,
) -> tuple[int, int]:
    """`fill_rows` of many curves, from curve `first` on.

    degrees, rational (n,); knots, points (m, axes) and weights (m,) of all curves in a row, those of curve i from
    knot_starts[i] and point_starts[i] on. First and last row of each curve go into rows (n, 2). Returns the first curve
    for which there was no room any more, or n, and the rows filled.
    """
    axes = points.shape[1]
    for i in range(first, degrees.shape[0]):
        own = slice(point_starts[i], point_starts[i + 1] if rational[i] else point_starts[i])
        after = fill_rows(
            table,
            filled,
            knots[knot_starts[i] : knot_starts[i + 1]],
            points[point_starts[i] : point_starts[i + 1]],
            weights[own],
            (degrees[i], axes, axes, rational[i]),
            wide,
        )
        if after > table.shape[0]:
            return i, filled
        rows[i, 0] = filled
        rows[i, 1] = after - 1
        filled = after
    return degrees.shape[0], filled

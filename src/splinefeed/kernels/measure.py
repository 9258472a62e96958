"""What was travelled between setpoints: arc length by adaptive quadrature, and the chord's distance from the curve."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.pieces import (
    DEGREES,
    HIGH,
    LOW,
    MIDDLE,
    ORIGIN,
    SCALE,
    Shape,
    derivatives,
    find_row,
    measured,
    point,
    speed,
    turns,
)
from splinefeed.records import Array, IntArray

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(10)
#: Two halves of an interval that agree with the whole to this, relative, are taken; smaller is rounding.
AGREEMENT = 3e-15
#: ... or to this of what the roundings of the coefficients make of the interval: where C' = 0 there is nothing else.
COEFFICIENT_ROUNDING = 1e-15
#: Bisections of one interval; at a cusp inside it the rest is then below rounding. About 100 intervals do for a cusp.
MAX_DEPTH = 45
MOST_INTERVALS = 4096
#: Points of the curve looked at between two setpoints, when its distance from their chord is measured.
CHORD_SAMPLES = 17
#: Points of every row at which the greatest curvature is looked for.
CURVATURE_SAMPLES = 33


@kernel
def _gauss(table: Array, row: int, shape: Shape, low: float, high: float) -> float:
    """Integral of |C'| over [low, high] within one row by 10-point Gauss-Legendre, mm."""
    middle = 0.5 * (low + high)
    half = 0.5 * (high - low)
    total = 0.0
    for i in range(GAUSS_NODES.shape[0]):
        u = middle + half * GAUSS_NODES[i]
        total += GAUSS_WEIGHTS[i] * speed(table, row, shape, (u - table[row, MIDDLE]) * table[row, SCALE])
    return total * half


@kernel
def _coefficient_speed(table: Array, row: int, shape: Shape) -> float:
    """What |C'(u)| of one row would be if no two of its terms cancelled: the measure of its rounding, mm per u."""
    degree, axes, _, rational = shape
    begin, end = measured(table, row, shape)
    weight = 1.0
    turn = 0.0
    if rational:
        at = ORIGIN + axes + axes * (degree + 1)
        weight = table[row, at]
        for k in range(1, degree + 1):
            turn += k * abs(table[row, at + k]) / weight
    total = 0.0
    for a in range(begin, end):
        at = ORIGIN + axes + a * (degree + 1)
        for k in range(degree + 1):
            total += (k + turn) * abs(table[row, at + k]) / weight
    return total * table[row, SCALE] * (DEGREES if end == axes and shape[2] <= 0 else 1.0)


@kernel
def _within_row(table: Array, row: int, shape: Shape, low: float, high: float) -> float:
    """Integral of |C'| over [low, high] within one row, bisected until halves and whole agree, mm."""
    lows = np.empty(MAX_DEPTH + 2)
    highs = np.empty(MAX_DEPTH + 2)
    wholes = np.empty(MAX_DEPTH + 2)
    depths = np.empty(MAX_DEPTH + 2, dtype=np.int64)
    lows[0] = low
    highs[0] = high
    wholes[0] = _gauss(table, row, shape, low, high)
    depths[0] = 0
    scale = abs(wholes[0])
    rounding = COEFFICIENT_ROUNDING * _coefficient_speed(table, row, shape)
    stacked = 1
    intervals = 0
    total = 0.0
    while stacked > 0:
        stacked -= 1
        intervals += 1
        a = lows[stacked]
        b = highs[stacked]
        whole = wholes[stacked]
        depth = depths[stacked]
        middle = 0.5 * (a + b)
        left = _gauss(table, row, shape, a, middle)
        right = _gauss(table, row, shape, middle, b)
        agreed = abs(left + right - whole) <= max(AGREEMENT * scale, rounding * (b - a))
        if agreed or depth >= MAX_DEPTH or intervals >= MOST_INTERVALS:
            total += left + right
            continue
        lows[stacked] = a
        highs[stacked] = middle
        wholes[stacked] = left
        depths[stacked] = depth + 1
        lows[stacked + 1] = middle
        highs[stacked + 1] = b
        wholes[stacked + 1] = right
        depths[stacked + 1] = depth + 1
        stacked += 2
    return total


@kernel
def travelled(table: Array, shape: Shape, start: float, end: float) -> float:
    """Arc length from parameter `start` to `end` of one curve, mm, negative if backwards; table of its knot spans.

    Adaptive Gauss-Legendre quadrature of |C'(u)|: it shares nothing with the arc-length table it is used to judge.
    """
    sign = 1.0
    low = start
    high = end
    if end < start:
        sign = -1.0
        low = end
        high = start
    last = table.shape[0] - 1
    row = find_row(table, 0, last, LOW, low)
    total = 0.0
    while row <= last and low < high:
        until = min(high, table[row, HIGH]) if row < last else high
        if until > low:
            total += _within_row(table, row, shape, low, until)
        low = until
        row += 1
    return sign * total


@kernel
def travelled_each(
    table: Array, curve_rows: IntArray, shape: Shape, curve_starts: Array, curve: IntArray, u: Array, out: Array
) -> None:
    """Arc length from each setpoint to the next along a path, mm, negative if backwards, into out (n - 1,).

    See `travelled`; table, curve_rows (curves, 2): knot spans of all curves; curve (n,), u (n,). Whole curves between
    two setpoints count as long as curve_starts (curves + 1,) says.
    """
    for i in range(u.shape[0] - 1):
        sign = 1.0 if curve[i] <= curve[i + 1] else -1.0
        k = i if sign > 0.0 else i + 1
        before = curve[k]
        start = u[k]
        k = 2 * i + 1 - k
        after = curve[k]
        rows = table[curve_rows[before, 0] : curve_rows[before, 1] + 1]
        if after == before:
            out[i] = travelled(rows, shape, start, u[k])
            continue
        total = travelled(rows, shape, start, rows[rows.shape[0] - 1, HIGH])
        total += curve_starts[after] - curve_starts[before + 1]
        rows = table[curve_rows[after, 0] : curve_rows[after, 1] + 1]
        out[i] = sign * (total + travelled(rows, shape, rows[0, LOW], u[k]))


@kernel
def _point_at(table: Array, first: int, last: int, shape: Shape, u: float, out: Array) -> None:
    row = find_row(table, first, last, LOW, u)
    point(table, row, shape, (u - table[row, MIDDLE]) * table[row, SCALE], out)


@kernel
def _from_chord(
    table: Array, first: int, last: int, shape: Shape, u: float, start: Array, end: Array, at: Array
) -> float:
    """Distance over the linear axes of the curve's point at u from the straight line start - end, mm; `at` is room."""
    _point_at(table, first, last, shape, u, at)
    square = 0.0
    along = 0.0
    for a in range(abs(shape[2])):
        square += (end[a] - start[a]) ** 2
        along += (at[a] - start[a]) * (end[a] - start[a])
    nearest = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    total = 0.0
    for a in range(abs(shape[2])):
        total += (at[a] - start[a] - nearest * (end[a] - start[a])) ** 2
    return math.sqrt(total)


@kernel
def _largest_from_chord(
    table: Array, first: int, last: int, shape: Shape, low: float, high: float, start: Array, end: Array, at: Array
) -> float:
    """Largest `_from_chord` for u in [low, high] of one curve: sampled, then refined twice by a parabola."""
    distance = np.empty(CHORD_SAMPLES)
    step = (high - low) / (CHORD_SAMPLES - 1)
    best = 0
    for k in range(CHORD_SAMPLES):
        distance[k] = _from_chord(table, first, last, shape, low + k * step, start, end, at)
        if distance[k] > distance[best]:
            best = k
    top = distance[best]
    if best == 0 or best == CHORD_SAMPLES - 1:
        return top
    peak = low + best * step
    before = distance[best - 1]
    after = distance[best + 1]
    for _ in range(2):
        bend = before - 2.0 * top + after
        if not bend < 0.0:
            break
        # where all distances are rounding, the parabola's top may lie anywhere
        peak += min(max(0.5 * step * (before - after) / bend, -step), step)
        step *= 0.1
        middle = _from_chord(table, first, last, shape, peak, start, end, at)
        if middle < top:
            break
        top = middle
        before = _from_chord(table, first, last, shape, peak - step, start, end, at)
        after = _from_chord(table, first, last, shape, peak + step, start, end, at)
    return top


@kernel
def chord_errors(table: Array, curve_rows: IntArray, shape: Shape, curve: IntArray, u: Array, out: Array) -> None:
    """Largest distance of the curve from the chord between neighbouring setpoints, mm, into out (n - 1,).

    table and curve_rows are a path's; across a joint the end of one curve and the start of the next are looked at.
    """
    start = np.empty(shape[1])
    end = np.empty(shape[1])
    at = np.empty(shape[1])
    for i in range(u.shape[0] - 1):
        first = curve_rows[curve[i], 0]
        last = curve_rows[curve[i], 1]
        next_first = curve_rows[curve[i + 1], 0]
        next_last = curve_rows[curve[i + 1], 1]
        _point_at(table, first, last, shape, u[i], start)
        _point_at(table, next_first, next_last, shape, u[i + 1], end)
        if curve[i] == curve[i + 1]:
            out[i] = _largest_from_chord(table, first, last, shape, u[i], u[i + 1], start, end, at)
            continue
        before = _largest_from_chord(table, first, last, shape, u[i], table[last, HIGH], start, end, at)
        after = _largest_from_chord(
            table, next_first, next_last, shape, table[next_first, LOW], u[i + 1], start, end, at
        )
        out[i] = max(before, after)


@kernel
def curvature_at(table: Array, row: int, shape: Shape, u: float, work: Array) -> float:
    """Curvature over the linear axes at u of one row, 1/mm, infinite where C' = 0 in motion; work (4, axes)."""
    derivatives(table, row, shape, (u - table[row, MIDDLE]) * table[row, SCALE], 2, work)
    square = 0.0
    product = 0.0
    for a in range(abs(shape[2])):
        square += work[1, a] * work[1, a]
        product += work[1, a] * work[2, a]
    if square == 0.0:
        return 0.0 if shape[2] <= 0 and turns(table, row, shape) else math.inf
    across = 0.0
    for a in range(abs(shape[2])):
        across += (work[2, a] - product / square * work[1, a]) ** 2
    return math.sqrt(across) / square


@kernel
def greatest_curvature(table: Array, shape: Shape) -> float:
    """Greatest curvature that is a number over the linear axes, 1/mm, at CURVATURE_SAMPLES places of every row."""
    work = np.empty((4, shape[1]))
    greatest = 0.0
    for row in range(table.shape[0]):
        width = table[row, HIGH] - table[row, LOW]
        for k in range(CURVATURE_SAMPLES):
            u = table[row, LOW] + width * k / (CURVATURE_SAMPLES - 1)
            curvature = curvature_at(table, row, shape, u, work)
            if curvature < math.inf:
                greatest = max(greatest, curvature)
    return greatest

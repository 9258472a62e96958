"""Runs of short lines: points that stand for their neighbours, and splines near many points by banded least squares."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array, BoolArray

#: Degree of the splines.
DEGREE = 5
#: Rounds of halving knot spans at most: a span is at least a 2^ROUNDS-th of the run.
ROUNDS = 12
#: Samples that a span needs to be halved.
FEWEST = 9
#: A span is halved if it is wider than this many of its neighbours.
GRADE = 2.5


@kernel
def thin(points: Array, held: BoolArray, linear: int, near: Array, turned: float, kept: BoolArray) -> int:
    """Mark the points (n, axes) that stay; the others stand within `near` (n,), mm, of the last one that stayed.

    And within `turned`, rad, over the axes behind the linear ones.
    held  (n,) points that stay whatever is near; the others make room for them. A way out and back to the same place
    keeps the first point that is elsewhere, so that no line loses its length. Returns how many stay.
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


@kernel
def basis(knots: Array, span: int, u: float, values: Array, left: Array, right: Array) -> None:
    """The DEGREE + 1 basis functions at u that are not 0 on a span (The NURBS Book, 2nd ed., algorithm A2.2)."""
    values[0] = 1.0
    for j in range(1, DEGREE + 1):
        left[j] = u - knots[span + 1 - j]
        right[j] = knots[span + j] - u
        saved = 0.0
        for r in range(j):
            share = values[r] / (right[r + 1] + left[j - r])
            values[r] = saved + right[r + 1] * share
            saved = left[j - r] * share
        values[j] = saved


@kernel
def least_squares(s: Array, points: Array, weights: Array, knots: Array, coefficients: Array) -> bool:
    """B-spline coefficients (n, axes) with the least sum of weights |C(s) - points|^2, through both end points.

    Normal equations of DEGREE diagonals by Cholesky's method; False where samples leave a coefficient open.
    """
    count, axes = coefficients.shape
    last = count - 1
    band = np.zeros((count, DEGREE + 1))  # band[i, k] is row i, column i - k
    coefficients[:] = 0.0
    values = np.empty(DEGREE + 1)
    left = np.empty(DEGREE + 1)
    right = np.empty(DEGREE + 1)
    end = points.shape[0] - 1
    span = DEGREE
    rest = np.empty(axes)
    for i in range(points.shape[0]):
        while span < last and s[i] >= knots[span + 1]:
            span += 1
        basis(knots, span, s[i], values, left, right)
        first = span - DEGREE
        for a in range(axes):
            rest[a] = points[i, a]
            if first == 0:
                rest[a] -= values[0] * points[0, a]
            if span == last:
                rest[a] -= values[DEGREE] * points[end, a]
        for j in range(DEGREE + 1):
            row = first + j
            if row == 0 or row == last:
                continue
            weighted = weights[i] * values[j]
            for k in range(j + 1):
                if first + k > 0:
                    band[row, j - k] += weighted * values[k]
            for a in range(axes):
                coefficients[row, a] += weighted * rest[a]
    band[0, 0] = 1.0
    band[last, 0] = 1.0
    for a in range(axes):
        coefficients[0, a] = points[0, a]
        coefficients[last, a] = points[end, a]
    for i in range(count):
        for k in range(min(DEGREE, i), -1, -1):
            j = i - k
            total = band[i, k]
            for m in range(1, min(DEGREE - k, j) + 1):
                total -= band[i, k + m] * band[j, m]
            if k > 0:
                band[i, k] = total / band[j, 0]
            elif total <= 1e-13 * band[i, 0]:
                return False
            else:
                band[i, 0] = math.sqrt(total)
    for a in range(axes):
        for i in range(count):
            total = coefficients[i, a]
            for k in range(1, min(DEGREE, i) + 1):
                total -= band[i, k] * coefficients[i - k, a]
            coefficients[i, a] = total / band[i, 0]
        for i in range(count - 1, -1, -1):
            total = coefficients[i, a]
            for k in range(1, min(DEGREE, last - i) + 1):
                total -= band[i + k, k] * coefficients[i + k, a]
            coefficients[i, a] = total / band[i, 0]
    return True


@kernel
def clamped_knots(grid: Array, spans: int) -> Array:
    """Knots of a clamped spline over the first `spans` spans of a grid."""
    knots = np.empty(spans + 1 + 2 * DEGREE)
    knots[:DEGREE] = grid[0]
    for i in range(spans + 1):
        knots[DEGREE + i] = grid[i]
    knots[DEGREE + spans + 1 :] = grid[spans]
    return knots


@kernel
def graded(grid: Array, wide: BoolArray, room: Array) -> int:
    """Halve the spans that are `wide`, and those GRADE times wider than a neighbour; spans, or 0 if too many."""
    spans = wide.shape[0]
    count = 0
    for i in range(spans):
        if count + 2 >= room.shape[0]:
            return 0
        room[count] = grid[i]
        count += 1
        if wide[i]:
            room[count] = 0.5 * (grid[i] + grid[i + 1])
            count += 1
    room[count] = grid[spans]
    for _ in range(ROUNDS):
        inserted = False
        i = 0
        while i < count:
            width = room[i + 1] - room[i]
            before = room[i] - room[i - 1] if i > 0 else width
            behind = room[i + 2] - room[i + 1] if i + 1 < count else width
            if width > GRADE * min(before, behind):
                if count + 2 >= room.shape[0]:
                    return 0
                for k in range(count, i, -1):
                    room[k + 1] = room[k]
                room[i + 1] = 0.5 * (room[i] + room[i + 2])
                count += 1
                inserted = True
            i += 1
        if not inserted:
            break
    return count


@kernel
def fit_run(
    s: Array, points: Array, weights: Array, linear: int, allowed: float, angular: float
) -> tuple[int, Array, Array, int]:
    """Spans, knots and coefficients of the spline near samples (n, axes) at s (n,), and the worst sample.

    Spans are halved where a sample is further than `allowed`, mm, from C(s), or `angular`, rad, over the axes behind
    the linear ones. 0 spans if that needs spans with fewer than FEWEST samples.
    """
    count, axes = points.shape
    most = max(count // FEWEST, 1)
    grid = np.empty(4 * most + 8)
    room = np.empty(4 * most + 8)
    grid[0] = s[0]
    grid[1] = s[count - 1]
    spans = 1
    values = np.empty(DEGREE + 1)
    left = np.empty(DEGREE + 1)
    right = np.empty(DEGREE + 1)
    worst = 0
    for _ in range(ROUNDS):
        knots = clamped_knots(grid, spans)
        coefficients = np.empty((spans + DEGREE, axes))
        if not least_squares(s, points, weights, knots, coefficients):
            return 0, knots, coefficients, worst
        wide = np.zeros(spans, dtype=np.bool_)
        samples = np.zeros(spans, dtype=np.int64)
        largest = 0.0
        span = DEGREE
        for i in range(count):
            while span < spans + DEGREE - 1 and s[i] >= knots[span + 1]:
                span += 1
            basis(knots, span, s[i], values, left, right)
            along = 0.0
            turned = 0.0
            for a in range(axes):
                off = -points[i, a]
                for j in range(DEGREE + 1):
                    off += values[j] * coefficients[span - DEGREE + j, a]
                if a < linear:
                    along += off * off
                else:
                    turned += off * off
            share = max(math.sqrt(along) / allowed, math.sqrt(turned) / angular)
            samples[span - DEGREE] += 1
            if share > 1.0:
                wide[span - DEGREE] = True
            if share > largest:
                largest = share
                worst = i
        if largest <= 1.0:
            return spans, knots, coefficients, worst
        for i in range(spans):
            if wide[i] and samples[i] < 2 * FEWEST:
                return 0, knots, coefficients, worst
        spans = graded(grid, wide, room)
        if spans == 0 or spans > most:
            return 0, knots, coefficients, worst
        grid[: spans + 1] = room[: spans + 1]
    return 0, knots, coefficients, worst

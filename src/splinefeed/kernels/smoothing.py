"""Runs of short lines: points that stand for their neighbours, and banded least squares sample by sample."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array, BoolArray, IntArray

#: Degree of the splines.
DEGREE = 5


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
def shares(
    s: Array,
    points: Array,
    knots: Array,
    coefficients: Array,
    linear: int,
    allowed: float,
    angular: float,
    out: Array,
    spans: IntArray,
) -> None:
    """How far samples (n, axes) at s (n,) are from C(s), as shares of what is allowed, into out (n,), and their spans.

    allowed, mm, over the linear axes; angular, rad, over those behind; spans (n,) from 0 on.
    """
    values = np.empty(DEGREE + 1)
    left = np.empty(DEGREE + 1)
    right = np.empty(DEGREE + 1)
    span = DEGREE
    for i in range(points.shape[0]):
        while span < coefficients.shape[0] - 1 and s[i] >= knots[span + 1]:
            span += 1
        basis(knots, span, s[i], values, left, right)
        along = 0.0
        turned = 0.0
        for a in range(points.shape[1]):
            off = -points[i, a]
            for j in range(DEGREE + 1):
                off += values[j] * coefficients[span - DEGREE + j, a]
            if a < linear:
                along += off * off
            else:
                turned += off * off
        out[i] = max(math.sqrt(along) / allowed, math.sqrt(turned) / angular)
        spans[i] = span - DEGREE

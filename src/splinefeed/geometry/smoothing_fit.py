"""Splines near many points: least squares over knots that are halved until every sample is near enough."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from splinefeed.geometry.fitting.grid import graded, halved
from splinefeed.records import Array, IntArray

#: Degree of the splines.
DEGREE = 5
#: A coefficient that samples tell to less than this share of its square is open: rounding.
OPEN = 1e-13
#: Rounds of halving knot spans at most: a span is at least a 2^ROUNDS-th of the run.
ROUNDS = 12
#: Samples that a span needs to be halved.
FEWEST = 9
#: A span is halved if it is wider than this many of its neighbours.
GRADE = 2.5


def fit_run(
    s: Array, points: Array, weights: Array, linear: int, allowed: float, angular: float
) -> tuple[Array | None, Array, int]:
    """Coefficients (n + 5, axes) and knots of the spline near samples (count, axes) at s (count,), and the worst one.

    Spans are halved where a sample is further than `allowed`, mm, from C(s), or `angular`, rad, over the axes behind
    the linear ones. No coefficients if that needs spans with fewer than FEWEST samples.
    """
    most, grid, worst = max(len(s) // FEWEST, 1), s[[0, -1]], 0
    for _ in range(ROUNDS):
        knots = np.concatenate([[grid[0]] * DEGREE, grid, [grid[-1]] * DEGREE])
        try:
            coefficients, off, span = least_squares(s, points, weights, knots)
        except LinAlgError:  # samples leave a coefficient open
            break
        norms = [np.linalg.norm(off[:, part], axis=1) for part in (slice(linear), slice(linear, None))]
        share = np.maximum(norms[0] / allowed, norms[1] / angular)
        found = int(np.argmax(share))
        worst = found if share[found] > 0.0 else worst
        if share[found] <= 1.0:
            return coefficients, knots, worst
        wide = np.zeros(len(grid) - 1, dtype=bool)
        wide[span[share > 1.0]] = True
        if np.any(np.bincount(span, minlength=len(wide))[wide] < 2 * FEWEST):
            break
        grid = graded(halved(grid, wide), grade=GRADE)
        if len(grid) - 1 > most:
            break
    return None, knots, worst


def least_squares(s: Array, points: Array, weights: Array, knots: Array) -> tuple[Array, Array, IntArray]:
    """B-spline coefficients (n, axes) with the least sum of weights |C(s) - points|^2, through both end points.

    Also C(s) - points (count, axes), and the span of each sample (count,). Normal equations of DEGREE diagonals, summed
    span by span, by Cholesky's method; LinAlgError where samples leave a coefficient open.
    """
    terms, count = DEGREE + 1, len(knots) - DEGREE - 1
    design = BSpline.design_matrix(s, knots, DEGREE)
    basis, span = design.data.reshape(-1, terms), design.indices[::terms]
    coefficients = np.zeros((count, points.shape[1]))
    coefficients[[0, -1]] = points[[0, -1]]
    weighted, rest = weights[:, None] * basis, points - design @ coefficients
    starts = np.flatnonzero(np.diff(span, prepend=-1))
    squares = np.add.reduceat(basis[:, :, None] * weighted[:, None, :], starts)
    moments = np.add.reduceat(weighted[:, :, None] * rest[:, None, :], starts)
    band, right = np.zeros((terms, count)), np.zeros_like(coefficients)  # band[d, k] is row k + d, column k
    for k in range(terms):
        at = span[starts] + k
        right[at] += moments[:, k]
        for d in range(terms - k):
            band[d, at] += squares[:, k + d, k]
    factor = cholesky_banded(band[:, 1:-1], lower=True, check_finite=False)
    if np.any(factor[0] ** 2 <= OPEN * band[0, 1:-1]):
        raise LinAlgError("samples leave a coefficient open")
    coefficients[1:-1] = cho_solve_banded((factor, True), right[1:-1], check_finite=False)
    return coefficients, design @ coefficients - points, span

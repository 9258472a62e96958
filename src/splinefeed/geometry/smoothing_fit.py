"""Splines near many points: least squares over knots that are halved until every sample is near enough."""

from __future__ import annotations

import numpy as np

from splinefeed.geometry.fitting.grid import graded, halved
from splinefeed.kernels.smoothing import DEGREE, least_squares, shares
from splinefeed.records import Array

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
    share, span = np.empty(len(s)), np.empty(len(s), dtype=np.int64)
    for _ in range(ROUNDS):
        knots = np.concatenate([[grid[0]] * DEGREE, grid, [grid[-1]] * DEGREE])
        coefficients = np.empty((len(grid) - 1 + DEGREE, points.shape[1]))
        if not least_squares(s, points, weights, knots, coefficients):
            break
        shares(s, points, knots, coefficients, linear, allowed, angular, share, span)
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

"""The fewest knots that hold a tolerance, and how often the curvature of a curve turns back."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from splinefeed.errors import CurveError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.differential import curvatures
from splinefeed.geometry.fitting.distance import foot_points
from splinefeed.geometry.fitting.grid import in_spans
from splinefeed.geometry.fitting.spline_space import SplineSpace
from splinefeed.records import Array

#: The share of the tolerance that least squares may use in the end: what is left over makes the curve fair.
FEW_SHARE = 0.8
#: What spreads the knots is evened out over so many spans, and nowhere below this share of its mean.
DENSITY_WIDTH, LEAST_DENSITY = 3, 0.1
#: How many more spans than the fewest are tried, where the curvature would turn back more often than it need.
MORE = (1.0, 1.25, 1.6, 2.0, 2.5)
#: Places a span at which curvature is sampled, and the share of its range below which a turn is none.
PLACES, SWING = 6, 0.01


def solved(space: SplineSpace, u: Array, points: Array, strength: float) -> tuple[NurbsCurve, Array]:
    """Least squares at given parameters, hardly faired, and the distance of each point."""
    curve = space.fitted(space.normal(u, points), space.even(strength), sharpen=True)
    return curve, foot_points(curve, u, points, space.periodic)[1]


def fewer_spans(
    space: SplineSpace, u: Array, points: Array, curve: NurbsCurve, tolerance: float, strength: float
) -> Iterator[tuple[SplineSpace, Array]]:
    """Spaces with fewer spans than `space`, the fewest that were found to hold the tolerance first, and parameters.

    Knots stand where the integral of |C^(p + 1)|^(1 / (p + 1)) grows alike, which spreads the error evenly (de Boor,
    "A Practical Guide to Splines", chapter XII, NEWKNOT); doubling and halving find how many are enough.
    """
    share = np.concatenate([[0.0], np.cumsum(_density(curve, space.grid) * np.diff(space.grid))])
    least = 2 ** math.ceil(math.log2(space.degree + 1)) if space.periodic else 1
    most = len(space.grid) - 1

    def of(spans: int) -> SplineSpace:
        grid = np.interp(np.linspace(0.0, share[-1], spans + 1), share, space.grid)
        grid[0], grid[-1] = 0.0, 1.0
        return SplineSpace.of(space.degree, grid, space.periodic)

    low, high, trial = least - 1, most, least
    while low < trial < high:
        fewer = of(trial)
        try:
            found, errors = solved(fewer, u, points, strength)
            enough = bool(errors.max() <= FEW_SHARE * tolerance)
        except CurveError:
            enough = False
        if enough:
            # feet in place of places between noisy neighbours: a curve need not follow these along itself
            u = foot_points(found, u, points, space.periodic)[0]
            high = trial
        else:
            low = trial
        trial = (low + high) // 2 if high < most else 2 * low
    for more in MORE:
        if (spans := math.ceil(more * high)) < most:
            yield of(spans), u


def _density(curve: NurbsCurve, grid: Array) -> Array:
    """|C^(p + 1)|^(1 / (p + 1)) (spans,) of a curve over `grid`, from the steps of C^(p), evened out a little."""
    from scipy.ndimage import uniform_filter1d

    p, knots, slopes = curve.degree, curve.knots, curve.control_points
    for order in range(p, 0, -1):
        slopes = (
            order * np.diff(slopes, axis=0) / (knots[order + 1 : order + len(slopes)] - knots[1 : len(slopes)])[:, None]
        )
        knots = knots[1:-1]
    steps = np.linalg.norm(np.diff(slopes, axis=0), axis=1)
    rate = np.zeros(len(grid) - 1)
    if len(steps):
        width = 0.5 * (grid[2:] - grid[:-2])
        rate[:-1] += 0.5 * steps / width
        rate[1:] += 0.5 * steps / width
    density = uniform_filter1d(rate ** (1.0 / (p + 1)), DENSITY_WIDTH, mode="nearest")
    return np.asarray(np.maximum(density, LEAST_DENSITY * float(np.mean(density)) + 1e-300))


def swings(curve: NurbsCurve) -> int:
    """How often the curvature turns back by more than SWING of its range; 0 below degree 3, where it jumps."""
    if curve.degree < 3 or curve.axes == 1:
        return 0
    values = curvatures(curve.derivatives(in_spans(curve.breaks, np.linspace(-1.0, 1.0, PLACES)).ravel(), 2))
    values = values[np.isfinite(values)]
    if not len(values):
        return 0
    least = SWING * float(np.ptp(values))
    count, low, high, rising = 0, float(values[0]), float(values[0]), 0
    for value in values.tolist():
        low, high = min(low, value), max(high, value)
        if rising >= 0 and value < high - least:
            count, rising, low = count + (rising > 0), -1, value
        elif rising <= 0 and value > low + least:
            count, rising, high = count + (rising < 0), 1, value
    return count

"""Knot grids that are refined where a fit is not yet good enough, and the checks that every fit begins with."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.curve import MAX_DEGREE
from splinefeed.records import Array, IntArray

#: Most spans of one fitted curve.
MAX_SPANS = 200_000
#: Rounds of knot insertion; each halves spans, so none becomes narrower than 2^-ROUNDS of the domain.
ROUNDS = 40
#: A tolerance below this, relative to the part, asks for more digits than a float has.
LEAST_TOLERANCE = 1e-12
#: Neighbouring spans differ by this factor at most, with a little for rounding: knots that change their density
#: abruptly show in the curvature.
GRADE = 2.01


def check_degree(degree: int) -> int:
    """`degree` if it is a whole number from 1 to 12; InputError otherwise."""
    if isinstance(degree, bool) or not isinstance(degree, int | np.integer) or not 1 <= degree <= MAX_DEGREE:
        raise InputError(f"degree is {degree!r}; expected a whole number from 1 to {MAX_DEGREE}")
    return int(degree)


def check_tolerance(tolerance: float, points: Array) -> float:
    """`tolerance`, mm, as a float if it is positive, and neither larger than the part nor below its rounding."""
    try:
        allowed = float(tolerance)
    except (TypeError, ValueError):
        raise InputError(f"tolerance is {tolerance!r}; expected a length in mm") from None
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not (math.isfinite(allowed) and allowed > 0.0):
        raise InputError(f"tolerance is {allowed:g} mm; it must be finite and greater than 0")
    if allowed >= size:
        raise InputError(f"tolerance is {allowed:g} mm, but the whole part measures {size:g} mm; is the unit right?")
    least = LEAST_TOLERANCE * max(size, float(np.max(np.abs(points))))
    if allowed < least:
        raise InputError(f"tolerance is {allowed:g} mm; below {least:.3g} mm lies the rounding of these coordinates")
    return allowed


def in_spans(grid: Array, nodes: ArrayLike) -> Array:
    """Parameters (spans, nodes) at `nodes` in [-1, 1] of every span of `grid` (spans + 1,)."""
    half = 0.5 * np.diff(grid)
    return np.asarray(
        np.clip(0.5 * (grid[1:] + grid[:-1])[:, None] + half[:, None] * np.asarray(nodes), grid[0], grid[-1])
    )


def span_of(grid: Array, u: Array) -> IntArray:
    """Index (n,) of the span of `grid` that holds each u (n,)."""
    return np.clip(np.searchsorted(grid, u, side="right") - 1, 0, len(grid) - 2).astype(np.int64)


def halved(grid: Array, spans: Array | IntArray | Any) -> Array:
    """`grid` with the chosen spans (a mask) cut in two."""
    return np.sort(np.concatenate([grid, 0.5 * (grid[1:] + grid[:-1])[spans]]))


def graded(grid: Array, periodic: bool = False, grade: float = GRADE) -> Array:
    """`grid` with more spans cut in two until neighbours differ by a factor of `grade` at most."""
    for _ in range(2 * ROUNDS):
        width = np.diff(grid)
        before, after = np.roll(width, 1), np.roll(width, -1)
        if not periodic:
            before[0], after[-1] = width[0], width[-1]
        wide = width > grade * np.minimum(before, after)
        if not np.any(wide):
            break
        grid = halved(grid, wide)
    return grid

"""Knot grids that are refined where a fit is not yet good enough, and splines over them by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import MAX_DEGREE, NurbsCurve
from splinefeed.errors import CurveError, InputError
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
#: Matrices with fewer elements are kept dense: sparse ones would cost more to handle, larger ones wake BLAS threads.
DENSE = 3_000
#: Spaces over no more knots than this are kept.
FEW = 17


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


def design(degree: int, knots: Array, u: Array) -> Any:
    """Sparse (n, coefficients) values N_i,p(u) of all basis functions at u (n,)."""
    from scipy.interpolate import BSpline

    return BSpline.design_matrix(u, knots, degree).tocsr()


def derivative_design(degree: int, knots: Array, u: Array, order: int) -> Any:
    """Sparse (n, coefficients) order-th derivatives of all basis functions at u (n,), by differences of coefficients.

    C' = sum N_i,p-1 p (P_i+1 - P_i) / (u_i+p+1 - u_i+1)      (The NURBS Book, 2nd ed., eq. 3.4)
    """
    from scipy.sparse import diags_array, eye_array

    total: Any = eye_array(len(knots) - degree - 1, format="csr")
    for p in range(degree, degree - order, -1):
        count = len(knots) - p - 1
        slope = p / (knots[p + 1 : p + count] - knots[1:count])
        total = diags_array([-slope, slope], offsets=[0, 1], shape=(count - 1, count)).tocsr() @ total
        knots = knots[1:-1]
    return design(degree - order, knots, u) @ total


def compact(matrix: Any) -> Any:
    """A sparse matrix as an array if it is small."""
    return matrix.toarray() if matrix.shape[0] * matrix.shape[1] < DENSE else matrix


def solve(matrix: Any, right: Array) -> Array:
    """x (unknowns, axes) of a symmetric, positive definite system; CurveError where rounding leaves none."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve
    from scipy.sparse.linalg import splu

    try:
        if isinstance(matrix, np.ndarray):
            return np.asarray(cho_solve(cho_factor(matrix), right))
        factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        return np.asarray(factor.solve(right))
    except (LinAlgError, RuntimeError):
        raise CurveError(
            "the points lie so unevenly that rounding leaves no curve near them; clean or thin them"
        ) from None


class SplineSpace:
    """Curves on [0, 1] of one degree over a grid (spans + 1,): with both ends given, or periodic.

    Coefficients are unknown @ x, and the given ends of an open curve beside them.
    int |C'''|^2 du = sum weights (spans, nodes) |roughness @ coefficients|^2 (C'' or C' for degree 2 or 1), by Gauss.
    """

    def __init__(self, degree: int, grid: Array, periodic: bool) -> None:
        from scipy.sparse import csr_array

        self.degree, self.grid, self.periodic = degree, grid, periodic
        if periodic:
            self.knots = np.concatenate([grid[-degree - 1 : -1] - 1.0, grid, grid[1 : degree + 1] + 1.0])
            number = np.arange(len(grid) - 1 + degree) % (len(grid) - 1)
        else:
            self.knots = np.concatenate([np.full(degree, grid[0]), grid, np.full(degree, grid[-1])])
            number = np.arange(-1, len(grid) - 2 + degree)
            number[-1] = -1  # the ends are given
        free = np.flatnonzero(number >= 0)
        shape = len(number), int(number.max()) + 1
        self.unknown = csr_array((np.ones(len(free)), (free, number[free])), shape=shape)
        order = min(3, degree)
        nodes, weights = np.polynomial.legendre.leggauss(degree - order + 1)
        self.roughness = derivative_design(degree, self.knots, in_spans(grid, nodes).ravel(), order)
        self.rough = compact(self.roughness @ self.unknown)
        self.weights = 0.5 * np.diff(grid)[:, None] * weights

    def even(self, strength: float) -> Array:
        """lambda (spans,) that weighs the roughness of wide and of narrow spans alike."""
        return np.asarray(strength * np.diff(self.grid) ** (2 * min(3, self.degree) - 1))

    def near(self, u: Array, points: Array) -> Callable[..., NurbsCurve]:
        """Of points (n, axes) at u (n,): the curve with the least sum of squares plus int lambda |C'''|^2 du.

        It is called with lambda (spans,). With `sharpen` one more step on what is left over squares the bias of lambda
        away: not for smoothing.
        """
        from scipy.sparse import diags_array

        given = np.zeros((self.unknown.shape[0], points.shape[1]))
        if not self.periodic:
            given[0], given[-1] = points[0], points[-1]
        values = design(self.degree, self.knots, u)
        free, rest = compact(values @ self.unknown), points - values @ given
        squares, rough = free.T @ free, self.rough

        def fitted(strength: Array, *, sharpen: bool = False) -> NurbsCurve:
            weights = (self.weights * strength[:, None]).ravel()
            weighted = rough.T * weights if isinstance(rough, np.ndarray) else rough.T @ diags_array(weights)
            matrix = squares + weighted @ rough
            x = solve(matrix, free.T @ rest - weighted @ (self.roughness @ given))
            if sharpen:
                x += solve(matrix, free.T @ (rest - free @ x))
            return NurbsCurve(self.degree, self.knots, self.unknown @ x + given)

        return fitted


def space_over(degree: int, grid: Array, periodic: bool) -> SplineSpace:
    """The space over a grid; of a few spans, as thousands of short curves in a row have them, made once and kept."""
    return _kept(degree, tuple(grid.tolist()), periodic) if len(grid) <= FEW else SplineSpace(degree, grid, periodic)


@lru_cache(maxsize=256)
def _kept(degree: int, grid: tuple[float, ...], periodic: bool) -> SplineSpace:
    return SplineSpace(degree, np.array(grid), periodic)

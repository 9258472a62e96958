"""A curve near a function, within a tolerance that is checked at other points than the fit's."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curve import MAX_AXES, NurbsCurve
from splinefeed.geometry.fitting.grid import (
    MAX_SPANS,
    ROUNDS,
    check_degree,
    check_tolerance,
    columns,
    design,
    graded,
    halved,
    in_spans,
    least_squares,
)
from splinefeed.records import Array

#: Samples that give the size of the function's image, before anything is fitted.
FIRST_SAMPLES = 257
#: Spans whose error is above this share of the tolerance are halved with those above it: beside a finer span the error
#: grows a little, and would else come over the tolerance one span at a time.
SHARE = 0.7


def fit_function(
    function: Callable[[Array], Array],
    tolerance: float,
    degree: int,
    domain: tuple[float, float],
    breaks: Sequence[float] = (),
    *,
    smoothness: int = 0,
) -> tuple[NurbsCurve, float]:
    """The curve C(u) near function(u) in the least-squares sense, and its largest error |C(u) - function(u)|, mm.

    function    parameters (n,) -> points (n, axes), mm
    domain      first and last u, which the curve keeps
    breaks      inner u at which the function is only `smoothness` times differentiable (0: a corner): so is the curve

    Spans are halved until the error is within `tolerance`, mm, at points that the fit did not use; the ends, and breaks
    of smoothness 0, are met exactly. The error in C(u) bounds the distance between the two curves.
    Raises InputError for arguments that cannot be used, CurveError if MAX_SPANS spans do not hold the tolerance.
    """
    degree = check_degree(degree)
    start, end = float(domain[0]), float(domain[1])
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        raise InputError(f"domain is ({start:g}, {end:g}); it must be finite and increase")
    inner = np.unique(np.asarray(breaks, dtype=np.float64))
    if np.any(~((inner > start) & (inner < end))):
        raise InputError(f"breaks must lie inside the domain ({start:g}, {end:g})")
    if smoothness < 0:
        raise InputError(f"smoothness is {smoothness}; expected 0 or more")
    allowed = check_tolerance(tolerance, _values(function, np.linspace(start, end, FIRST_SAMPLES)))
    nodes = np.polynomial.legendre.leggauss(degree + 2)[0]
    # between the nodes and near the ends of spans, where a least-squares error is largest
    between = np.concatenate([[-1.0], 0.5 * (nodes[1:] + nodes[:-1]), [1.0], np.linspace(-0.97, 0.98, 2 * degree + 3)])
    grid = np.concatenate([[start], inner, [end]])
    for _ in range(ROUNDS):
        curve = _least_squares(function, degree, grid, inner, max(1, degree - smoothness), nodes)
        check = in_spans(grid, between)
        errors = np.linalg.norm(curve(check.ravel()) - _values(function, check.ravel()), axis=1).reshape(check.shape)
        error = float(errors.max())
        if error <= allowed:
            return curve, error
        finer = graded(halved(grid, errors.max(axis=1) > SHARE * allowed))
        if len(finer) > MAX_SPANS:
            break
        grid = finer
    raise CurveError(
        f"{error:.3g} mm of error is left with {len(grid) - 1} spans of degree {degree}; allow more than {allowed:g} mm"
    )


def _least_squares(
    function: Callable[[Array], Array], degree: int, grid: Array, breaks: Array, multiplicity: int, nodes: Array
) -> NurbsCurve:
    """The curve over `grid` with the least sum of squared errors at `nodes` of every span."""
    counts = np.where(np.isin(grid, breaks), multiplicity, 1)
    counts[[0, -1]] = degree + 1
    knots = np.repeat(grid, counts)
    # a knot of multiplicity p or more is a point of the curve: its control point is known
    known = counts >= degree
    held = np.maximum(np.cumsum(counts) - counts - 1, 0)[known]
    values = _values(function, grid[known])
    coefficients = np.zeros((len(knots) - degree - 1, values.shape[1]))
    coefficients[held] = values
    free = np.setdiff1d(np.arange(len(coefficients)), held)
    if len(free):
        u = in_spans(grid, nodes).ravel()
        matrix = design(degree, knots, u)
        coefficients[free] = least_squares(
            matrix @ columns(free, len(coefficients)), _values(function, u) - matrix @ coefficients
        )
    return NurbsCurve(degree, knots, coefficients)


def _values(function: Callable[[Array], Array], u: Array) -> Array:
    """function(u) as (n, axes); InputError if it is of another shape or not finite."""
    values = np.asarray(function(u), dtype=np.float64)
    if values.ndim != 2 or len(values) != len(u) or not 1 <= values.shape[1] <= MAX_AXES:
        raise InputError(f"the function gave shape {values.shape} for {len(u)} parameters; ({len(u)}, axes) expected")
    finite = np.all(np.isfinite(values), axis=1)
    if not np.all(finite):
        raise InputError(f"the function is not finite at u = {u[int(np.argmin(finite))]:g}")
    return values

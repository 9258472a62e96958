"""A curve near a function, within a tolerance that is checked at other points than the fit's."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from splinefeed.curves.curve import MAX_AXES, NurbsCurve
from splinefeed.curves.editing import greville
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.fitting.grid import (
    MAX_SPANS,
    ROUNDS,
    check_degree,
    check_tolerance,
    graded,
    halved,
    in_spans,
)
from splinefeed.records import Array, IntArray

#: Samples that give the size of the function's image, before anything is fitted.
FIRST_SAMPLES = 257
#: Spans whose error is above this share of the tolerance are halved with those above it: beside a finer span the error
#: grows a little, and would else come over the tolerance one span at a time.
SHARE = 0.6

#: First and second derivative, as (order, value (axes,)), at one end of a curve.
Held = Sequence[tuple[int, Array]] | None


def fit_function(
    function: Callable[[Array], Array],
    tolerance: float,
    degree: int,
    domain: tuple[float, float],
    breaks: Sequence[float] = (),
    *,
    smoothness: int = 0,
) -> tuple[NurbsCurve, float]:
    """Fit a curve C(u) to a function by interpolation.

    Parameters
    ----------
    function : callable
        Parameters (n,) to points (n, axes), mm.
    tolerance : float
        Largest error, mm.
    degree : int
        Of the curve.
    domain : (float, float)
        First and last u, which the curve keeps.
    breaks : sequence of float, optional
        Inner u at which the function is only `smoothness` times differentiable (0: a corner): so is the curve.
    smoothness : int, optional
        Of the breaks.

    Returns
    -------
    curve : NurbsCurve
        The ends, and breaks of smoothness 0, are met exactly.
    error : float
        The largest |C(u) - function(u)|, mm, which bounds the distance between the two curves.

    Raises
    ------
    InputError
        For arguments that cannot be used.
    CurveError
        If MAX_SPANS spans do not hold the tolerance.

    Notes
    -----
    Spans are halved until the error is within the tolerance at points that the fit did not use.
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
    times = np.full(len(inner), max(1, degree - smoothness))
    spline, error = interpolated(
        lambda u: _values(function, u), allowed, degree, np.concatenate([[start], inner, [end]]), times
    )
    if error > allowed:
        spans = len(np.unique(spline.t)) - 1
        raise CurveError(
            f"{error:.3g} mm of error is left with {spans} spans of degree {degree}; allow more than {allowed:g} mm"
        )
    return NurbsCurve(degree, spline.t, spline.c), error


def interpolated(
    function: Callable[[Array], Array],
    allowed: float,
    degree: int,
    grid: Array,
    times: IntArray,
    held: tuple[Held, Held] = (None, None),
) -> tuple[Any, float]:
    """Interpolate a function by a spline where each control point counts most (`editing.greville`).

    Parameters
    ----------
    function : callable
        Parameters (n,) to points (n, axes).
    allowed : float
        Largest error.
    degree : int
        p.
    grid : (spans + 1,) array
        To begin with: spans are halved until the error is `allowed`, or MAX_SPANS are reached.
    times : (spans - 1,) array of int
        Multiplicity of the inner knots of this grid; those that halve spans are simple.
    held : tuple, optional
        What it has at the start and at the end beside the value, if anything.

    Returns
    -------
    spline : scipy.interpolate.BSpline
        At the ends, and at knots of multiplicity p, it meets the function.
    error : float
        The largest.
    """
    from scipy.interpolate import make_interp_spline

    breaks = grid[1:-1]
    between = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, 3 * degree + 9))  # more near the ends of spans
    for _ in range(ROUNDS):
        counts = np.ones(len(grid), dtype=np.int64)
        counts[[0, -1]] = degree + 1
        counts[np.searchsorted(grid, breaks)] = times
        knots = np.repeat(grid, counts)
        more = [1, 2] * (held[0] is not None) + [-2, -3] * (held[1] is not None)
        places = np.delete(greville(degree, knots), more)
        spline = make_interp_spline(places, function(places), degree, knots, held)
        check = in_spans(grid, between)
        errors = np.linalg.norm(spline(check.ravel()) - function(check.ravel()), axis=1).reshape(check.shape)
        error = float(errors.max())
        finer = graded(halved(grid, errors.max(axis=1) > SHARE * allowed))
        if error <= allowed or len(finer) > MAX_SPANS:
            break
        grid = finer
    return spline, error


def _values(function: Callable[[Array], Array], u: Array) -> Array:
    """function(u) as (n, axes); InputError if it is of another shape or not finite."""
    values = np.asarray(function(u), dtype=np.float64)
    if values.ndim != 2 or len(values) != len(u) or not 1 <= values.shape[1] <= MAX_AXES:
        raise InputError(f"the function gave shape {values.shape} for {len(u)} parameters; ({len(u)}, axes) expected")
    finite = np.all(np.isfinite(values), axis=1)
    if not np.all(finite):
        raise InputError(f"the function is not finite at u = {u[int(np.argmin(finite))]:g}")
    return values

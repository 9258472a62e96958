"""One smooth curve through points, or within a tolerance of them.

Through the points goes the curve of least int |r'''|^2 du: the natural spline of degree 5, r''' = r'''' = 0 at both
ends, so that no derivative up to the fourth jumps. (A spline whose knots leave out those next to the ends, as without
such conditions, swings far beyond the points.) Near them goes the same spline through other points: those within the
tolerance that take the least of that integral, axis by axis, a least-squares problem with bounds. Its parameter grows
from point to point by the root of their distance, the centripetal choice: E. T. Y. Lee, Computer-Aided Design 21(6),
1989, pp. 363-370; natural splines: I. J. Schoenberg, Proc. Nat. Acad. Sci. 51(1), 1964, pp. 24-28.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline
from scipy.optimize import lsq_linear

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import split
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.each_curve import floats
from splinefeed.records import Array

#: Degree of the spline: its jerk has no steps.
DEGREE = 5
#: Near more points than this a spline takes too long to find: its matrix is full.
MOST_NEAR = 1_000
#: Gauss and Legendre's places and weights in each span: exact for the square of a third derivative.
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def checked_waypoints(waypoints: ArrayLike, axes: Sequence[str] | None) -> Array:
    """Read waypoints.

    Parameters
    ----------
    waypoints : (n, axes) array_like
        mm, rotary axes rad.
    axes : sequence of str or None
        Names of the axes.

    Returns
    -------
    (n, axes) array
        As numbers.

    Raises
    ------
    CurveError
        For what is not 2 or more rows of a finite number for each axis.
    """
    points = floats(waypoints)
    if points.ndim != 2 or len(points) < 2 or points.shape[1] != (points.shape[1] if axes is None else len(axes)):
        each = "as many numbers" if axes is None else f"{len(axes)} numbers: {', '.join(axes)}"
        raise CurveError(f"waypoints have shape {points.shape}; expected 2 or more rows of {each}")
    for row, axis in np.argwhere(~np.isfinite(points)).tolist():
        name = f"column {axis + 1}" if axes is None else axes[axis]
        raise CurveError(f"waypoint {row + 1} has {points[row, axis]:g} for {name}; give finite numbers")
    return points


def through(points: Array, weights: Array, near: ArrayLike) -> list[NurbsCurve]:
    """Lay the spline through points, cut at each of them.

    Parameters
    ----------
    points : (n, axes) array
        mm, rotary axes rad.
    weights : (axes,) array
        What a unit of each axis counts in the distance of two points.
    near : float or (axes,) array_like
        How far each axis may pass beside a point; ends are met.

    Returns
    -------
    list of NurbsCurve
        n - 1 curves.

    Raises
    ------
    CurveError
        For neighbours that are the same.
    InputError
        For a tolerance that cannot be.
    """
    apart = np.sqrt(np.linalg.norm(np.diff(points, axis=0) * weights, axis=1))
    if not np.all(apart > 0.0):
        same = int(np.argmin(apart)) + 1
        raise CurveError(f"waypoints {same} and {same + 1} are the same; leave one out, or plan two paths for a stop")
    u = np.append(0.0, np.cumsum(apart))
    u /= u[-1]
    off = np.asarray(near, dtype=np.float64)
    if off.shape not in ((), points.shape[1:]) or not np.all((off >= 0.0) & (off < np.inf)):
        raise InputError(f"near is {near!r}; expected a number, or {points.shape[1]} numbers, of 0 or more")
    if len(points) > 2 and np.any(off > 0.0):
        points = _nearer(points, u, np.broadcast_to(off, points.shape[1:]))
    spline = _natural(u, points)
    curve = NurbsCurve(spline.k, spline.t, spline.c)
    return split(curve, *u[1:-1].tolist())


def _natural(u: Array, points: Array) -> BSpline:
    """The natural spline of DEGREE through points (n, axes) at u (n,); two points are joined by a line."""
    if len(u) == 2:
        return make_interp_spline(u, points, 1)
    free = [(order, np.zeros(points.shape[1])) for order in (3, 4)]
    return make_interp_spline(u, points, DEGREE, bc_type=(free, free))


def _nearer(points: Array, u: Array, off: Array) -> Array:
    """Points (n, axes) within `off` (axes,) of the given ones, ends the same, whose spline bends least."""
    if len(points) > MOST_NEAR:
        raise InputError(f"near: {len(points)} waypoints are too many; {MOST_NEAR} are possible, or none with near=0")
    basis = _natural(u, np.eye(len(u)))
    knots = np.unique(basis.t)
    half = 0.5 * np.diff(knots)
    at = (0.5 * (knots[1:] + knots[:-1])[:, None] + half[:, None] * _PLACES).ravel()
    root = np.sqrt((half[:, None] * _WEIGHTS).ravel())
    bent = basis.derivative(3)(at) * root[:, None]
    found = points.copy()
    for k in np.flatnonzero(off).tolist():
        given = points[:, k]
        bounds = given[1:-1] - off[k], given[1:-1] + off[k]
        if not np.all(bounds[0] < bounds[1]):
            raise InputError(f"near: {off[k]:g} is below the rounding of the waypoints; give more, or 0")
        pull = -bent[:, [0, -1]] @ given[[0, -1]]
        found[1:-1, k] = lsq_linear(bent[:, 1:-1], pull, bounds, method="bvls").x
    return found

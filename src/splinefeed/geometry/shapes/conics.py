"""Lines, circles, ellipses and a figure of eight, each exactly as a NURBS."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curve import MAX_AXES, NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.geometry.shapes.checks import number, point, positive
from splinefeed.records import Array

#: cos and sin of the quarter circle from angle 0, times its weight, and the weight: Bernstein coefficients of degree 2.
_HALF_ROOT = math.sqrt(0.5)
_QUARTER = np.array([[1.0, 0.0, 1.0], [_HALF_ROOT, _HALF_ROOT, _HALF_ROOT], [0.0, 1.0, 1.0]])


def line(start: Sequence[float] = (0.0, 0.0), end: Sequence[float] = (100.0, 0.0)) -> Path:
    """The straight line from `start` (axes,) to `end` (axes,), mm (axes a, b, c, the fourth to sixth, in rad).

    Raises InputError for coordinates that cannot be used, CurveError if both points are the same.
    """
    first = point(start, "start")
    if not 1 <= len(first) <= MAX_AXES:
        raise InputError(f"start has {len(first)} coordinates; 1 to {MAX_AXES} are possible")
    last = point(end, "end", len(first))
    if np.all(first == last):
        raise CurveError("start and end of the line are the same point: it has no length")
    return Path([NurbsCurve.bezier([first, last])], name="line")


def circle(radius: float = 10.0, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """The full circle of `radius`, mm, about `center` (2,), mm, counterclockwise from the point on the right.

    Four quarters of degree 2 with weights 1, sqrt(1/2), 1; at their joints C' is continuous and C'' is not, but the
    curvature is. Source: The NURBS Book, 2nd ed., example 7.2.
    """
    r = positive(radius, "radius")
    return Path([_round(r, r, 0.0, point(center, "center", 2))], name="circle")


def ellipse(a: float = 20.0, b: float = 10.0, angle: float = 0.0, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """The full ellipse with semi-axes `a` and `b`, mm, the first at `angle`, rad, from x, about `center` (2,), mm.

    The affine image of a circle, which is exact; counterclockwise from the end of semi-axis a.
    """
    long, short = positive(a, "a"), positive(b, "b")
    curve = _round(long, short, number(angle, "angle", " rad"), point(center, "center", 2))
    return Path([curve], name="ellipse")


def figure_eight(width: float = 60.0, height: float | None = None, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """A closed curve of eight (the lemniscate of Gerono), `width` by `height`, mm, that crosses itself at `center`.

    x = (width/2) cos t,  y = height sin t cos t,  t from 0 to 2 pi; height is half the width unless given.

    With cos t = c/w and sin t = s/w on a quarter circle of degree 2, (x, y) = ((width/2) c w, height s c) / w^2 is
    rational of degree 4 and exact: four spans. The curve is smooth everywhere. By its parameter it is C1 at the joints,
    because t'(u) is even about the middle of each quarter; t'' is odd, so that C'' jumps there, but along the tangent
    only, and the curvature is continuous. Source: Lawrence, A Catalog of Special Plane Curves, 1972, p. 124.
    """
    w = positive(width, "width")
    h = 0.5 * w if height is None else positive(height, "height")
    middle = point(center, "center", 2)
    points: list[Array] = []
    for quarter in range(4):
        cosine, sine, weight = _turned(quarter)
        weights = _product(weight, weight)
        x = 0.5 * w * _product(cosine, weight) / weights
        y = h * _product(sine, cosine) / weights
        points.append(np.column_stack([x, y])[: 5 if quarter == 3 else 4] + middle)
    knots = np.repeat(np.linspace(0.0, 1.0, 5), [5, 4, 4, 4, 5])
    weights = np.append(np.tile(weights[:4], 4), 1.0)
    return Path([NurbsCurve(4, knots, _closed(points), weights)], name="figure-eight")


def _round(a: float, b: float, angle: float, center: Array) -> NurbsCurve:
    """The ellipse as four quarters of degree 2."""
    points: list[Array] = []
    for quarter in range(4):
        cosine, sine, weight = _turned(quarter)
        points.append(np.column_stack([a * cosine / weight, b * sine / weight])[: 3 if quarter == 3 else 2])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    knots = np.repeat(np.linspace(0.0, 1.0, 5), [3, 2, 2, 2, 3])
    weights = np.append(np.tile([1.0, _HALF_ROOT], 4), 1.0)
    return NurbsCurve(2, knots, _closed(points) @ turn.T + center, weights)


def _turned(quarter: int) -> tuple[Array, Array, Array]:
    """Bernstein coefficients (3,) of cos, sin and weight on the given quarter of the circle."""
    cosine, sine, weight = _QUARTER.T
    for _ in range(quarter):
        cosine, sine = -sine, cosine
    return cosine, sine, weight


def _product(f: Array, g: Array) -> Array:
    """Bernstein coefficients (5,) of the product of two polynomials of degree 2.

    h_k = sum_{i+j=k} C(2,i) C(2,j) f_i g_j / C(4,k)
    """
    return np.convolve(f * [1.0, 2.0, 1.0], g * [1.0, 2.0, 1.0]) / [1.0, 4.0, 6.0, 4.0, 1.0]


def _closed(points: list[Array]) -> Array:
    """The control points of all quarters, the last one put exactly on the first."""
    whole = np.concatenate(points)
    whole[-1] = whole[0]
    return whole

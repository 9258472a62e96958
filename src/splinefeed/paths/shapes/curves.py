"""Lines, circles, ellipses and a figure of eight, each exactly as a NURBS; the butterfly, and a helix."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib.resources import files

import numpy as np

from splinefeed.curves.arcs import arc
from splinefeed.curves.curve import MAX_AXES, NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.each_curve import DEFAULT_AXES
from splinefeed.paths.fitting import fit_function
from splinefeed.paths.path import Path
from splinefeed.records import Array, check_finite, frozen_array
from splinefeed.records.limits import number as finite

#: cos and sin of the quarter circle from angle 0, times its weight, and the weight: Bernstein coefficients of degree 2.
_HALF_ROOT = math.sqrt(0.5)
_QUARTER = np.array([[1.0, 0.0, 1.0], [_HALF_ROOT, _HALF_ROOT, _HALF_ROOT], [0.0, 1.0, 1.0]])
#: Most turns of a helix; each takes about twenty spans of degree 5, a hundred of degree 3.
MAX_TURNS = 1000
#: Largest size of a shape, mm: a thousand kilometres is not a workpiece.
MAX_SIZE = 1e9


def number(value: object, name: str, unit: str = " mm") -> float:
    """`value` as a finite float not beyond 1e9; InputError names it otherwise."""
    result = finite(value, name)
    if abs(result) > MAX_SIZE:
        raise InputError(f"{name} is {result:g}{unit}; at most {MAX_SIZE:g}{unit} is possible")
    return result


def positive(value: object, name: str, unit: str = " mm") -> float:
    """`value` as a finite float above 0; InputError names it otherwise."""
    result = number(value, name, unit)
    if result <= 0.0:
        raise InputError(f"{name} is {result:g}{unit}; it must be greater than 0")
    return result


def point(value: Sequence[float], name: str, axes: int | None = None) -> Array:
    """`value` as coordinates (axes,), mm; InputError if they are of another number or not finite."""
    result = frozen_array(value, name, 1)
    check_finite(result, name)
    if axes is not None and len(result) != axes:
        raise InputError(f"{name} has {len(result)} coordinates; {axes} are needed")
    for coordinate in result:
        number(coordinate, name)
    return result


def line(
    start: Sequence[float] | None = None,
    end: Sequence[float] | None = None,
    *,
    length: float | None = None,
    angle: float = 0.0,
) -> Path:
    """Make a straight line.

    Parameters
    ----------
    start, end : sequence of float, optional
        Points (axes,), mm (axes a, b, c, the fourth to sixth, in rad); the start is zero unless given. Without an end
        it lies in the plane.
    length : float, optional
        Of a line without an end, mm (100).
    angle : float, optional
        Of a line without an end, rad, from x.

    Returns
    -------
    Path
        One curve.

    Raises
    ------
    InputError
        For coordinates that cannot be used.
    CurveError
        If both points are the same.
    """
    if end is not None and (length is not None or angle):
        raise InputError("line: end is given, so that length and angle follow; leave them out")
    first = point((0.0,) * (2 if end is None else len(end)) if start is None else start, "start")
    if end is None:
        if len(first) != 2:
            raise InputError("line: a line by length and angle lies in the plane; give end= for other axes")
        run, turn = 100.0 if length is None else number(length, "length"), number(angle, "angle", " rad")
        end = first + np.array([run * math.cos(turn), run * math.sin(turn)])
    if not 1 <= len(first) <= MAX_AXES:
        raise InputError(f"start has {len(first)} coordinates; 1 to {MAX_AXES} are possible")
    last = point(end, "end", len(first))
    if np.all(first == last):
        raise CurveError("start and end of the line are the same point: it has no length")
    axes = DEFAULT_AXES[: len(first)] if len(first) <= len(DEFAULT_AXES) else None
    return Path([NurbsCurve.bezier([first, last])], axes, name="line")


def circle(radius: float = 10.0, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """Make a full circle, counterclockwise from the point on the right.

    Parameters
    ----------
    radius : float, optional
        mm.
    center : sequence of float, optional
        (2,), mm.

    Returns
    -------
    Path
        Four quarters of degree 2 with weights 1, sqrt(1/2), 1; at their joints C' is continuous and C'' is not, but the
        curvature is.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., example 7.2.
    """
    r = positive(radius, "radius")
    return Path([_round(r, r, 0.0, point(center, "center", 2))], name="circle")


def ellipse(a: float = 20.0, b: float = 10.0, angle: float = 0.0, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """Make a full ellipse, counterclockwise from the end of semi-axis a.

    Parameters
    ----------
    a, b : float, optional
        Semi-axes, mm.
    angle : float, optional
        Of the first one, rad, from x.
    center : sequence of float, optional
        (2,), mm.

    Returns
    -------
    Path
        The affine image of a circle, which is exact.
    """
    long, short = positive(a, "a"), positive(b, "b")
    curve = _round(long, short, number(angle, "angle", " rad"), point(center, "center", 2))
    return Path([curve], name="ellipse")


def _round(a: float, b: float, angle: float, center: Array) -> NurbsCurve:
    c, s = math.cos(angle), math.sin(angle)
    return arc(center, np.array([a * c, a * s]), np.array([-b * s, b * c]), 0.0, 2.0 * math.pi)


def figure_eight(width: float = 60.0, height: float | None = None, center: Sequence[float] = (0.0, 0.0)) -> Path:
    """Make a closed curve of eight (the lemniscate of Gerono) that crosses itself at its center.

    Parameters
    ----------
    width, height : float, optional
        mm; the height is half the width unless given.
    center : sequence of float, optional
        (2,), mm.

    Returns
    -------
    Path
        Four spans, rational of degree 4 and exact.

    Notes
    -----
    The curve is, with t from 0 to 2 pi,

        x = (width/2) cos t,  y = height sin t cos t

    With cos t = c/w and sin t = s/w on a quarter circle of degree 2, (x, y) = ((width/2) c w, height s c) / w^2 is
    rational of degree 4. The curve is smooth everywhere. By its parameter it is C1 at the joints,
    because t'(u) is even about the middle of each quarter; t'' is odd, so that C'' jumps there, but along the tangent
    only, and the curvature is continuous.

    References
    ----------
    .. [1] Lawrence, A Catalog of Special Plane Curves, 1972, p. 124.
    """
    w = positive(width, "width")
    h = 0.5 * w if height is None else positive(height, "height")
    middle = point(center, "center", 2)
    points: list[Array] = []
    for quarter in range(4):
        cosine, sine, weight = _QUARTER.T
        for _ in range(quarter):
            cosine, sine = -sine, cosine
        weights = _product(weight, weight)
        x = 0.5 * w * _product(cosine, weight) / weights
        y = h * _product(sine, cosine) / weights
        points.append(np.column_stack([x, y])[:4] + middle)
    knots = np.repeat(np.linspace(0.0, 1.0, 5), [5, 4, 4, 4, 5])
    weights = np.append(np.tile(weights[:4], 4), 1.0)
    whole = np.concatenate([*points, points[0][:1]])
    return Path([NurbsCurve(4, knots, whole, weights)], name="figure-eight")


def _product(f: Array, g: Array) -> Array:
    """Bernstein coefficients (5,) of the product of two polynomials of degree 2.

    h_k = sum_{i+j=k} C(2,i) C(2,j) f_i g_j / C(4,k)
    """
    return np.convolve(f * [1.0, 2.0, 1.0], g * [1.0, 2.0, 1.0]) / [1.0, 4.0, 6.0, 4.0, 1.0]


def butterfly(scale: float = 1.0) -> Path:
    """Make the butterfly: 51 control points, degree 3, rational, 382.86 mm long at scale 1, least radius 0.023 mm.

    Parameters
    ----------
    scale : float, optional
        What its coordinates are taken times.

    Returns
    -------
    Path
        |C'| runs from 40 to 802 mm: the hardest of the well-known tests of an interpolator. As its source gives it, the
        curve is open by 0.001 mm at the head.

    References
    ----------
    .. [1] Hu, Jiang, Huo et al., Int. J. Adv. Manuf. Technol. 129, 2843-2860, 2023, doi 10.1007/s00170-023-12427-5.

    Examples
    --------
    >>> import splinefeed as sf
    >>> print(f"{sf.shapes.butterfly().length:.2f} mm")
    382.86 mm
    """
    factor = positive(scale, "scale", "")
    text = files("splinefeed").joinpath("data", "butterfly.json").read_text(encoding="utf-8")
    data = json.loads(text)
    curve = NurbsCurve(data["degree"], data["knots"], data["control_points"], data["weights"])
    return Path([curve if factor == 1.0 else curve.transformed(factor)], name="butterfly")


def helix(
    radius: float = 10.0, pitch: float = 5.0, turns: float = 3.0, tolerance: float = 1e-6, degree: int = 5
) -> Path:
    """Make a helix about z from (radius, 0, 0), counterclockwise seen from above.

    Parameters
    ----------
    radius : float, optional
        mm.
    pitch : float, optional
        Its rise a turn, mm; a negative one goes down.
    turns : float, optional
        How many.
    tolerance : float, optional
        Largest error at equal parameter, mm.
    degree : int, optional
        Of the curve.

    Returns
    -------
    Path
        No NURBS is a helix: a curve is fitted whose point at every parameter lies within the tolerance of the helix's
        (z is exact, so that it rises in step with the angle).

    Raises
    ------
    InputError
        For sizes that cannot be used.
    CurveError
        If the tolerance cannot be held.

    Notes
    -----
    The helix is, with v from 0 to turns,

        x = radius cos 2 pi v,  y = radius sin 2 pi v,  z = pitch v
    """
    r, rise, count = positive(radius, "radius"), number(pitch, "pitch"), positive(turns, "turns", "")
    if rise == 0.0:
        raise InputError("pitch is 0 mm: that is one circle, repeated; use circle")
    if count > MAX_TURNS:
        raise InputError(f"turns is {count:g}; at most {MAX_TURNS} are possible")

    def place(u: Array) -> Array:
        angle = 2.0 * math.pi * count * u
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), rise * count * u])

    curve, error = fit_function(place, tolerance, degree, (0.0, 1.0))
    finding = f"fitted by degree {degree} with {len(curve.breaks) - 1} spans; largest error {error:.3g} mm"
    return Path([curve], name="helix", findings=(finding,))

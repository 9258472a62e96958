"""Arcs of circles and ellipses in the plane or in space, each exactly as one rational curve of degree 2."""

from __future__ import annotations

import cmath
import math
from functools import lru_cache

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import LINE_KNOTS
from splinefeed.records import Array

#: A sweep this little over a quarter turn, in quarters, is still one: rounding is no reason for another span.
_QUARTER_SLACK = 1e-9
#: How far, in radii, a curve may be from a circle and still be called one: rounding.
ROUND = 4e-15
#: Shortest segment of a polyline, as a share of its length, that still has a knot span of its own length.
_LEAST_STEP = 1e-10


def arc(center: Array, first: Array, second: Array, start: float, sweep: float) -> NurbsCurve:
    """Make the curve center + first cos(t) + second sin(t), t from `start` to `start` + `sweep`.

    Parameters
    ----------
    center, first, second : (axes,) array
        mm: two conjugate radii, equal and at right angles for a circle.
    start : float
        rad.
    sweep : float
        rad, up to a full turn, not 0; below 0 it is clockwise as seen from first to second.

    Returns
    -------
    NurbsCurve
        One span a quarter turn, degree 2 with weights 1, cos(half the span), 1; a full turn ends exactly where it
        begins.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., section 7.3; affine images by property P4.2.
    """
    spans, knots, weights = _frame(abs(sweep))
    half = 0.5 * sweep / spans
    angles = start + half * np.arange(2 * spans + 1)
    # the middle control point of a span is the meeting point of its end tangents: farther out by 1 / cos(half)
    reach = np.where(np.arange(2 * spans + 1) % 2 == 1, 1.0 / math.cos(half), 1.0)
    points = center + np.outer(reach * np.cos(angles), first) + np.outer(reach * np.sin(angles), second)
    if abs(sweep) >= 2.0 * math.pi * (1.0 - 1e-15):
        points[-1] = points[0]
    points.setflags(write=False)
    return NurbsCurve.trusted(2, knots, points, weights)


@lru_cache(maxsize=4096)
def _frame(sweep: float) -> tuple[int, Array, Array | None]:
    """Spans, knots and weights of an arc; equal ones are shared: drawings repeat the same corner a thousand times."""
    spans = max(1, math.ceil(sweep / (0.5 * math.pi) - _QUARTER_SLACK))
    knots = np.repeat(np.linspace(0.0, 1.0, spans + 1), [3, *[2] * (spans - 1), 3])
    knots.setflags(write=False)
    weight = math.cos(0.5 * sweep / spans)
    if weight == 1.0:
        return spans, knots, None  # flatter than a number can tell: a parabola is the same curve
    weights = np.ones(2 * spans + 1)
    weights[1::2] = weight
    weights.setflags(write=False)
    return spans, knots, weights


def bulge_arc(begin: Array, end: Array, bulge: float) -> NurbsCurve:
    """Make a circular arc in the x-y plane by its bulge.

    Parameters
    ----------
    begin, end : (2,) or (3,) array
        mm; the arc begins and ends exactly there.
    bulge : float
        tan(sweep / 4), not 0; above 0 it turns counterclockwise.

    Returns
    -------
    NurbsCurve
        The arc; its centre is not used, so that a flat arc keeps its digits.

    References
    ----------
    .. [1] DXF reference, LWPOLYLINE, group code 42.
    """
    places, knots, weights = bulge_points(complex(end[0] - begin[0], end[1] - begin[1]), bulge)
    points = np.empty((len(places), len(begin)))
    points[:] = begin
    points[:, :2] += np.array(places).view(np.float64).reshape(-1, 2)
    points[-1] = end
    points.setflags(write=False)
    return NurbsCurve.trusted(2, knots, points, weights)


def bulge_points(chord: complex, bulge: float) -> tuple[list[complex], Array, Array | None]:
    """Compute control points, knots and weights of an arc from 0 to `chord` by its bulge; see `bulge_arc`.

    Parameters
    ----------
    chord : complex
        x + i y, mm.
    bulge : float
        tan(sweep / 4), not 0.

    Returns
    -------
    points : list of complex
        Control points x + i y, mm.
    knots : (n + 3,) array
        Of degree 2.
    weights : (n,) array or None
        None where they are all 1.
    """
    sweep = 4.0 * math.atan(bulge)
    spans, knots, weights = _frame(abs(sweep))
    half = 0.5 * sweep / spans
    diameter = chord / math.sin(0.5 * sweep)  # along the chord
    tangent = 0.5 * diameter * math.tan(half)
    places = [0j]
    for k in range(spans):
        # a chord to the point at angle phi has length d sin(phi / 2) and lies (sweep - phi) / 2 behind the whole chord
        begin, end = 2.0 * half * k, 2.0 * half * (k + 1)
        places.append(places[-1] + tangent * cmath.rect(1.0, begin - 0.5 * sweep))
        places.append(diameter * math.sin(0.5 * end) * cmath.rect(1.0, 0.5 * (end - sweep)))
    places[-1] = chord
    return places, knots, weights


def polyline(points: Array) -> NurbsCurve:
    """Join straight segments to one curve of degree 1 by its length.

    Parameters
    ----------
    points : (n, axes) array
        At least 2; neighbours must differ.

    Returns
    -------
    NurbsCurve
        Its parameter is the length, mm; 0 to 1 for one segment.
    """
    fixed = np.array(points, dtype=np.float64)
    fixed.setflags(write=False)
    if len(points) == 2:
        return NurbsCurve.trusted(1, LINE_KNOTS, fixed)
    knots = np.zeros(len(points) + 2)
    across = fixed[1:] - fixed[:-1]
    steps = np.sqrt((across * across).sum(axis=1))
    if steps.min() <= _LEAST_STEP * steps.sum():
        steps[:] = 1.0  # knots so close together would be one to rounding
    np.cumsum(steps, out=knots[2:-1])
    knots[-1] = knots[-2]
    knots.setflags(write=False)
    return NurbsCurve.trusted(1, knots, fixed)


def moved(curve: NurbsCurve, matrix: Array, offset: Array) -> NurbsCurve:
    """Transform a curve by a matrix that is not singular.

    Parameters
    ----------
    curve : NurbsCurve
        P.
    matrix : (axes, axes) array
        What each point is multiplied by.
    offset : (axes,) array
        What is added, mm.

    Returns
    -------
    NurbsCurve
        The affine image matrix @ P + offset.
    """
    points = curve.control_points @ matrix.T + offset
    points.setflags(write=False)
    return NurbsCurve.trusted(curve.degree, curve.knots, points, curve.weights, clamped=curve.clamped)


def as_circle(curve: NurbsCurve) -> tuple[tuple[float, float], float, float, float] | None:
    """Find the circle of an arc in x and y, as `arc` makes it.

    Parameters
    ----------
    curve : NurbsCurve
        Any curve.

    Returns
    -------
    tuple or None
        Center (x, y), radius, mm, start and sweep, rad; None for any other curve, and for one that leaves the circle by
        more than ROUND of the radius.
    """
    if curve.degree != 2 or curve.weights is None or not curve.clamped:
        return None
    places, weights = curve.control_points[:, 0] + 1j * curve.control_points[:, 1], curve.weights
    inner = curve.knots[3:-3]
    if len(places) % 2 == 0 or not np.array_equal(inner[0::2], inner[1::2]):
        return None
    on, middle = places[0::2], weights[1::2] / np.sqrt(weights[:-2:2] * weights[2::2])
    chords, between = np.diff(on), 0.5 * (on[1:] + on[:-1])
    if np.any(chords == 0.0) or np.any(middle >= 1.0):
        return None
    # every span turns by 2 acos(w): the control point between its ends is theirs, farther out by 1 / w
    bow = (places[1::2] - between) / chords
    height = bow.imag  # below 0 the curve turns to the left
    if np.any(height == 0.0) or np.ptp(np.sign(height)) > 0.0:
        return None
    # tan(half) = 2 |height|, in chords, and the centre lies on the other side by cot(half) / 2 chords
    centers, half = between - 0.25j * chords / height, np.arctan(2.0 * np.abs(height))
    center = centers.mean()
    away = np.abs(on - center)
    radius = float(np.mean(away))
    off = np.append(np.abs(centers - center), np.abs(away - radius)) / radius
    if max(np.max(off), np.max(np.abs(np.append(np.cos(half) - middle, bow.real)))) > ROUND:
        return None
    sweep = -math.copysign(float(np.sum(2.0 * half)), height[0])
    if places[0] == places[-1]:
        sweep = math.copysign(2.0 * math.pi, sweep)
    return (float(center.real), float(center.imag)), radius, float(np.angle(on[0] - center)), sweep

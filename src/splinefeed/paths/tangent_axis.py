"""A rotary axis theta that follows the tangent of a planar path, as on an X-Y-theta table."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.corners import CORNER_ANGLE
from splinefeed.paths.fitting.function import Held, interpolated
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray

#: Theta needs a degree in which it can be smooth to its second derivative between two knots.
LEAST_DEGREE = 5
#: Least tolerance, rad: not far below it lies the rounding of tangents.
LEAST_TOLERANCE = 1e-9
#: Theta is interpolated to this share of the tolerance; the rest is for the places between.
SHARE = 0.5
#: Parts of a knot span between which the tangent is looked at first, and how often one is halved at most.
PARTS, ROUNDS = 16, 40
#: Between neighbouring places the tangent may turn by this much, rad: then no turn is overlooked.
MAX_STEP = 0.5
#: A speed |C'| below this, relative to size over width of the domain, has no derivative of theta worth using.
STILL = 1e-6
#: Places on a span, off its ends, at which the finished curve is compared.
_PROOF: Array = np.asarray((np.arange(24) + 0.3) / 24.0, dtype=np.float64)


def tangential(path: Path, tolerance: float = 1e-6) -> Path:
    """Add an axis to a path (x, y): theta, the direction of the tangent, rad.

    Parameters
    ----------
    path : Path
        Planar, without corners.
    tolerance : float, optional
        Largest error of theta, rad.

    Returns
    -------
    Path
        Called at s (...), mm, it gives (..., 3): mm, mm, rad.

    Raises
    ------
    CurveError
        For a path that is not planar, and for one with corners, where theta would have to turn while x and y rest.
    InputError
        For a tolerance that cannot be held.

    Notes
    -----
    Its derivative is

        theta' = (x' y'' - y' x'') / (x'^2 + y'^2)

    theta is unwrapped, so that it runs on through full turns; it begins within (-pi, pi]. On each curve it is a
    quotient Theta / w with the weight w of the curve itself, and Theta interpolates theta w over knots that are halved
    until the error is within the tolerance; this is proved on other points of the finished curve. At the curve's own
    knots Theta is as smooth as theta is, so theta' is continuous wherever the curvature is. Curves of a degree below 5
    are elevated to it.

    References
    ----------
    .. [1] docs/paper.md, the table of three axes.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.paths.tangential(sf.shapes.circle(radius=10)).axes
    ('x', 'y', 'theta')
    """
    allowed = float(tolerance)
    if not (math.isfinite(allowed) and allowed >= LEAST_TOLERANCE):
        raise InputError(f"tolerance is {allowed:g} rad; it must be finite and at least {LEAST_TOLERANCE:g} rad")
    if len(path.axes) != 2 or path.linear != 2:
        raise CurveError(f"the path has axes {' '.join(path.axes)}; theta follows a path of two linear axes")
    for corner in path.corners:
        if corner.angle > CORNER_ANGLE:
            raise CurveError(
                f"the path turns by {math.degrees(corner.angle):.4g} deg on the spot at s = {corner.s:.6g} mm "
                f"(curve {corner.curve}, u = {corner.u:.6g}), where theta would jump; round the corner, or make two "
                f"paths that end and begin there"
            )
    curves: list[NurbsCurve] = []
    angle = 0.0
    worst = 0.0
    for i, curve in enumerate(path.joined):
        try:
            followed, error = _followed(curve, allowed, angle)
        except CurveError as problem:
            raise CurveError(f"curve {i} of the path: {problem}") from None
        angle = float(followed.control_points[-1, 2])
        worst = max(worst, error)
        curves.append(followed)
    finding = f"theta follows the tangent within {worst:.3g} rad"
    # ends meet as before; at a corner below CORNER_ANGLE theta may differ by as much
    room = path.tolerance + CORNER_ANGLE
    return Path(
        curves,
        (*path.axes, "theta"),
        name=f"{path.name}-tangential",
        findings=(*path.findings, finding),
        tolerance=room,
        by_tip=True,
    )


def _followed(curve: NurbsCurve, tolerance: float, before: float) -> tuple[NurbsCurve, float]:
    """The curve with theta as third axis, beginning next to the angle `before`, and the largest error, rad."""
    if curve.degree == 1 and len(curve.breaks) == 2:
        angle = _next_to(_angles(curve, np.array([curve.domain[0]])), before)
        points = np.column_stack([curve.control_points, np.full(len(curve.control_points), angle)])
        return NurbsCurve(1, curve.knots, points, curve.weights), 0.0
    base = curve.with_clamped_ends()
    base = base.elevated(max(0, LEAST_DEGREE - base.degree))
    q = base.degree
    weights = np.ones(len(base.control_points)) if base.weights is None else base.weights
    weight = NurbsCurve.trusted(q, base.knots, weights[:, None])
    seen = _turned(curve, before)

    def theta(u: Array) -> Array:
        return _next_to(_angles(curve, u), np.interp(u, *seen))[:, None]

    def leaves(u: float, side: str) -> Held:
        """First and second derivative of Theta on one side of a knot; None where C' = 0."""
        first, second = _turning(curve, u, side)
        here, (w, w1, w2) = theta(np.array([u]))[0], weight.derivatives(u, 2, side=side)
        found = [(1, first * w + here * w1), (2, second * w + 2.0 * first * w1 + here * w2)]
        return found if math.isfinite(second) else None

    inner = base.breaks[1:-1]
    times = 1 + _multiplicity(base, inner)
    # a piece ends at each knot where theta' would not be continuous by itself
    knots, values = [np.full(q + 1, base.domain[0])], [np.empty((0, 1))]
    ends = [0, *(1 + np.flatnonzero(times >= q)), len(base.breaks) - 1]
    for a, b in pairwise(ends):
        low, high = base.breaks[[a, b]].tolist()
        held = leaves(low, "right"), leaves(high, "left")
        within = SHARE * tolerance * float(weights.min())
        spline, _ = interpolated(
            lambda u: theta(u) * weight(u), within, q, base.breaks[a : b + 1], times[a : b - 1], held
        )
        knots.append(spline.t[q + 1 : -1])
        values.append(spline.c[:-1] if b < ends[-1] else spline.c)
    all_knots = np.append(np.concatenate(knots), base.domain[1])
    new, count = np.unique(all_knots[q + 1 : -q - 1], return_counts=True)
    plane = base.with_knots(*np.repeat(new, count - _multiplicity(base, new)))
    turned = np.concatenate(values)[:, 0] / (1.0 if plane.weights is None else plane.weights)
    followed = NurbsCurve(q, plane.knots, np.column_stack([plane.control_points, turned]), plane.weights)
    u = (followed.breaks[:-1, None] + np.diff(followed.breaks)[:, None] * _PROOF).ravel()
    error = np.abs(_next_to(followed(u)[:, 2] - _angles(followed, u), 0.0))
    if error.max() > tolerance:
        left = f"{error.max():.3g} rad is left at u = {u[int(np.argmax(error))]:.6g}; allow more"
        raise CurveError(f"theta cannot follow within {tolerance:g} rad: {left}")
    return followed, float(error.max())


def _angles(curve: NurbsCurve, u: Array) -> Array:
    """Direction of the tangent in x and y, rad, (n,) at u (n,); where it jumps, below CORNER_ANGLE, half way."""
    angle = np.arctan2(*curve.tangent(u, 2).T[::-1])
    at = np.flatnonzero(np.isin(u, curve.breaks))
    left = np.arctan2(*curve.tangent(u[at], 2, "left").T[::-1])
    angle[at] += 0.5 * _next_to(left - angle[at], 0.0)
    return np.asarray(angle)


def _next_to(angle: Array, before: Array | float) -> Array:
    return np.asarray(angle - 2.0 * np.pi * np.round((angle - before) / (2.0 * np.pi)))


def _multiplicity(base: NurbsCurve, u: Array) -> IntArray:
    return np.searchsorted(base.knots, u, side="right") - np.searchsorted(base.knots, u)


def _turned(base: NurbsCurve, before: float) -> tuple[Array, Array]:
    """Parameters (n,), so near that no turn is overlooked between them, and theta (n,) there, beginning at `before`."""
    u = np.append((base.breaks[:-1, None] + np.diff(base.breaks)[:, None] * np.arange(PARTS) / PARTS), base.breaks[-1])
    for _ in range(ROUNDS):
        angles = _angles(base, u)
        far = np.flatnonzero(np.abs(_next_to(np.diff(angles), 0.0)) > MAX_STEP)
        if not len(far):
            return u, np.unwrap(np.append(before, angles))[1:]
        u = np.insert(u, far + 1, 0.5 * (u[far] + u[far + 1]))
    raise CurveError(f"the tangent turns on the spot near u = {u[far[0]]:.6g}, which theta cannot follow")


def _turning(base: NurbsCurve, u: float, side: str) -> tuple[float, float]:
    """theta' and theta'' by u, on one side of it; no numbers where C' = 0."""
    first, second, third = base.derivatives(u, 3, side=side)[1:]
    square = float(first @ first)
    if square <= (STILL * base.size / (base.domain[1] - base.domain[0])) ** 2:
        return math.nan, math.nan
    turn = float(first[0] * second[1] - first[1] * second[0]) / square
    change = float(first[0] * third[1] - first[1] * third[0]) / square
    return turn, change - 2.0 * turn * float(first @ second) / square

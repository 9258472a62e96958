"""Curves near given points: as few knots as the tolerance needs, and as fair as it allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from splinefeed.curves.curve import MAX_AXES, NurbsCurve
from splinefeed.curves.differential import angles
from splinefeed.curves.nearest import Nearest
from splinefeed.curves.packed import Flat
from splinefeed.curves.tables import arc_pieces
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.fitting.grid import check_degree, check_tolerance
from splinefeed.paths.fitting.smooth import smooth_curve_of_many
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray, Points, check_finite, frozen_array

#: Most points that are fitted at once.
MAX_POINTS = 1_000_000
#: Between more corners than this, which is what places in no order come to, curves take fewer rounds to be fair.
MANY_CORNERS = 500
#: Corners are measured over arms of at least this many tolerances.
ARM = 10.0
#: Two neighbouring chords that turn by more than this, rad, may be a corner.
CORNER_ANGLE = math.radians(30.0)
#: A corner turns at least this many times as much as the points before and behind it.
SHARPER = 3.0
#: More than this, rad, is a corner whatever is beside it: fewer than five points a turn define no smooth curve.
SURE_CORNER = math.radians(75.0)


@dataclass(frozen=True, eq=False)
class Fit:
    """Curves near given points.

    Parameters
    ----------
    curves : tuple of NurbsCurve
        With control points (n, axes), mm, joined end to end, parted at corners.
    error : float
        Largest distance of a given point from the curves, mm, to the nearest point of all curves.
    tolerance : float
        As given, mm.

    References
    ----------
    .. [1] docs/math/smoothing.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.paths.fit([[0, 0], [1, 0.2], [2, 0], [3, 0.5]], 0.01).path().name
    'fit'
    """

    curves: tuple[NurbsCurve, ...]
    error: float
    tolerance: float

    @property
    def knots(self) -> int:
        """Number of inner knots of all curves together."""
        return sum(len(curve.knots) - 2 * curve.degree - 2 for curve in self.curves)

    def path(self, axes: Sequence[str] | None = None, name: str = "fit") -> Path:
        """Make a path of the curves, with the error as a finding.

        Parameters
        ----------
        axes : sequence of str, optional
            Names of the axes, as for `Path`.
        name : str, optional
            Of the path.

        Returns
        -------
        Path
            The curves.
        """
        finding = (
            f"fitted by {len(self.curves)} curve(s) of degree {self.curves[0].degree} with {self.knots} knots; "
            f"largest distance {self.error:.3g} mm (tolerance {self.tolerance:g} mm)"
        )
        return Path(self.curves, axes, name=name, findings=(finding,))


def fit(
    points: Points,
    tolerance: float,
    degree: int = 3,
    closed: bool = False,
    corner_angle: float | None = None,
) -> Fit:
    """Fit curves of one degree that pass every point within a tolerance, as fair as the tolerance allows.

    Parameters
    ----------
    points : (n, axes) array_like
        mm, in order; repeated neighbours count once.
    tolerance : float
        Largest distance of a point from the curves, mm.
    degree : int, optional
        Of the curves.
    closed : bool, optional
        Whether to join the last point to the first, smoothly unless there is a corner.
    corner_angle : float, optional
        Chords that turn by more, rad, and much more than their neighbours, part two curves (30 degrees unless given;
        math.pi for never); curves pass exactly through corners and through the ends of an open line.

    Returns
    -------
    Fit
        The curves and their error.

    Raises
    ------
    InputError
        For points, a tolerance or a degree that cannot be used.
    CurveError
        If the tolerance cannot be held.

    Notes
    -----
    The curves minimize, with C'' for degree 2 and C' for degree 1,

        sum_i |C(u_i) - Q_i|^2 + int lambda(u) |C'''(u)|^2 du

    The u_i begin as summed chords and end as arc length. Knots are halved where the error is largest until it is within
    half the tolerance; then the fewest are searched that keep it with no more oscillations of the curvature, and lambda
    grows, span by span, until the error comes near it. Where points are few they are passed exactly: more knots cannot
    help.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., sections 9.2 to 9.4.
    .. [2] Eilers, Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11(2), 1996,
       doi 10.1214/ss/1038425655.

    Examples
    --------
    >>> import splinefeed as sf
    >>> fitted = sf.paths.fit([[0, 0], [1, 0.2], [2, 0], [3, 0.5]], tolerance=0.01)
    >>> fitted.error <= fitted.tolerance
    True
    """
    degree = check_degree(degree)
    angle = CORNER_ANGLE if corner_angle is None else float(corner_angle)
    if not 0.0 < angle <= math.pi:
        raise InputError(f"corner_angle is {angle:g} rad; it must lie above 0 and at most at pi")
    data = _distinct(points, closed)
    allowed = check_tolerance(tolerance, data)
    middle = 0.5 * (data.min(axis=0) + data.max(axis=0))  # near zero the sums keep their digits
    local = data - middle
    corners = corner_indices(local, angle, ARM * allowed, closed)
    if closed and len(corners):
        curves = _closed_with_corners(local, corners, allowed, degree)
    elif closed:
        curves = [smooth_curve_of_many(local, allowed, degree, periodic=True).with_clamped_ends()]
    else:
        cuts = [0, *corners, len(local) - 1]
        brief = len(cuts) > MANY_CORNERS
        curves = [smooth_curve_of_many(local[a : b + 1], allowed, degree, brief=brief) for a, b in pairwise(cuts)]
    curves = [curve.transformed(1.0, middle) for curve in curves]
    error = float(np.max(distances(curves, data)))
    if error > allowed:
        raise CurveError(
            f"the points cannot be passed within {allowed:g} mm by degree {degree}: {error:.3g} mm is left "
            "over; allow more, or clean points that jump back and forth"
        )
    return Fit(tuple(curves), error, allowed)


def _distinct(points: Points, closed: bool) -> Array:
    """Points (n, axes) without those that repeat their neighbour; InputError for what is not a list of points."""
    data = frozen_array(points, "points", 2)
    count, axes = data.shape
    if not 1 <= axes <= MAX_AXES:
        raise InputError(f"points have {axes} axes; 1 to {MAX_AXES} are possible")
    if count > MAX_POINTS:
        raise InputError(f"{count} points; at most {MAX_POINTS} can be fitted at once")
    check_finite(data, "points")
    if count:
        data = data[np.concatenate([[True], np.any(data[1:] != data[:-1], axis=1)])]
    if closed and len(data) > 1 and np.all(data[0] == data[-1]):
        data = data[:-1]
    least = 3 if closed else 2
    if len(data) < least:
        raise InputError(f"{len(data)} distinct point(s) among {count}; expected at least {least}")
    return data


def _closed_with_corners(points: Array, corners: IntArray, tolerance: float, degree: int) -> list[NurbsCurve]:
    """Curves round a contour, parted at its corners and, smoothly, at its first point, where they begin and end."""
    count = len(points)
    curves: list[NurbsCurve] = []
    brief = len(corners) > MANY_CORNERS
    for a, b in zip(corners, [*corners[1:], corners[0] + count], strict=True):
        curve = smooth_curve_of_many(points[np.arange(a, b + 1) % count], tolerance, degree, brief=brief)
        if b <= count:
            curves.append(curve)
            continue
        before, after = curve.split(float(curve.nearest(points[0])[0]))
        curves = [after, *curves, before]
    return curves


def corner_indices(points: Array, angle: float, arm: float, closed: bool = False) -> IntArray:
    """Indices (k,) of the corners among points (n, axes): inner points, or any of them if `closed`.

    A corner turns by more than `angle`, rad, both between its two chords and between arms of at least `arm`, mm, so
    that noise makes none; and SHARPER times as much as the points at the ends of these arms, or more than SURE_CORNER.
    """
    count = len(points)
    line = np.concatenate([points, points, points]) if closed else points
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.arange(1, len(line) - 1)
    back = np.minimum(np.maximum(np.searchsorted(s, s[at] - arm, side="right") - 1, 0), at - 1)
    ahead = np.maximum(np.minimum(np.searchsorted(s, s[at] + arm, side="left"), len(line) - 1), at + 1)
    turn = np.zeros(len(line))
    turn[at] = _turns(line, back, at, ahead)
    sharp = (turn[at] > angle) & (_turns(line, at - 1, at, at + 1) > angle)
    sharp &= (turn[at] >= SHARPER * np.maximum(turn[back], turn[ahead])) | (turn[at] > SURE_CORNER)
    corner = np.zeros(len(line), dtype=bool)
    candidates = np.flatnonzero(sharp)
    for i in candidates[np.argsort(-turn[at][candidates], kind="stable")]:
        if not np.any(corner[back[i] + 1 : ahead[i]]):  # the sharpest within its arms stands for its neighbours
            corner[at[i]] = True
    found = np.flatnonzero(corner)
    if closed:
        found = found[(found >= count) & (found < 2 * count)] - count
    return found.astype(np.int64)


def _turns(points: Array, before: IntArray, at: IntArray, after: IntArray) -> Array:
    """Angles (n,), rad, between the chords before -> at and at -> after."""
    return angles(points[at] - points[before], points[after] - points[at])


def distances(curves: Sequence[NurbsCurve], points: Array) -> Array:
    """Measure how far points are from curves, by `curves.nearest` alone, with nothing that a fitter knows.

    Parameters
    ----------
    curves : sequence of NurbsCurve
        Need not be joined.
    points : (n, axes) array
        mm.

    Returns
    -------
    (n,) array
        Distance of each from the nearest point of all curves, mm.
    """
    flat, axes = Flat.of(curves), curves[0].axes
    shape = (int(flat.degrees.max()), axes, axes, int(flat.rational.max()))
    places, same = np.unique(points, axis=0, return_inverse=True)  # each place is searched once
    return Nearest(arc_pieces(flat, shape, curves).table, shape).find(places)[2][same.ravel()]

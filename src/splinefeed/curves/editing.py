"""The same curve in other forms: reversed, split, clamped, refined, of higher degree, moved."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.flat import Flat
from splinefeed.curves.spline import MAX_AXES, MAX_DEGREE, Spline
from splinefeed.errors import CurveError, InputError
from splinefeed.records import Array, IntArray, check_finite, frozen_array

Curve = TypeVar("Curve", bound=Spline)


def _homogeneous(curve: Spline) -> tuple[Array, Array]:
    """(w (P - origin), w) as rows (n, axes + 1), or P - origin (n, axes) if polynomial; and the origin (axes,).

    About a point near by, the products keep the digits that a part far from the machine's zero would lose.
    """
    origin = 0.5 * (curve.control_points.min(axis=0) + curve.control_points.max(axis=0))
    local = curve.control_points - origin
    if curve.weights is None:
        return local, origin
    return np.column_stack([local * curve.weights[:, None], curve.weights]), origin


def _from_homogeneous(
    curve: Spline, degree: int, knots: Array, points: Array, origin: Array
) -> tuple[Array, Array | None]:
    """Control points and weights of the same curve over other knots."""
    weights = None if curve.weights is None else points[:, -1]
    places = (points if weights is None else points[:, :-1] / weights[:, None]) + origin
    ends = knots[degree], knots[-degree - 1]
    for k, here, there in zip((0, -1), ends, curve.domain, strict=True):
        if curve.clamped and here == there:  # an end is a control point: not a rounding may move it
            places[k] = curve.control_points[k]
    return places, weights


def _refined(curve: Spline, new_knots: Array) -> tuple[Array, Array | None]:
    """Control points and weights over more knots, or over those of a part of the curve."""
    points, origin = _homogeneous(curve)
    # control points next to the ends of an unclamped curve are seen from spans before its first knots: more of those,
    # with control points that count for nothing
    p, (start, end) = curve.degree, curve.domain
    more = (end - start) * np.arange(1.0, p + 2.0)
    knots = np.concatenate([curve.knots[0] - more[::-1], curve.knots, curve.knots[-1] + more])
    out = _over(knots, np.pad(points, ((p + 1, p + 1), (0, 0))), p, new_knots)
    return _from_homogeneous(curve, p, new_knots, out, origin)


def section(curve: Curve, low: float, high: float) -> Curve:
    """Cut the clamped piece between two parameters out of a curve.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    low, high : float
        Parameters of its domain, low < high.

    Returns
    -------
    NurbsCurve
        The piece, on [low, high].
    """
    p = curve.degree
    inner = curve.knots[(curve.knots > low) & (curve.knots < high)]
    knots = np.concatenate([np.full(p + 1, low), inner, np.full(p + 1, high)])
    return type(curve)(p, knots, *_refined(curve, knots))


def clamped(curve: Curve) -> Curve:
    """Insert knots until those at both ends have multiplicity p + 1.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.

    Returns
    -------
    NurbsCurve
        The same curve.
    """
    start, end = curve.domain
    if curve.clamped and curve.knots[0] == start and curve.knots[-1] == end:
        return curve
    return section(curve, start, end)


def with_knots(curve: Curve, *parameters: float) -> Curve:
    """Insert inner knots.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    *parameters : float
        The knots; repeat one to raise its multiplicity, at most to p.

    Returns
    -------
    NurbsCurve
        The same curve.

    Raises
    ------
    InputError
        For a parameter that is not inside the domain.
    CurveError
        For too high a multiplicity.
    """
    added = curve.check_parameters(np.array(parameters, dtype=np.float64))
    if not added.size:
        return curve
    start, end = curve.domain
    if np.any((added <= start) | (added >= end)):
        raise InputError(f"knots can be inserted only strictly inside the domain ({start:g}, {end:g})")
    new_knots = np.sort(np.concatenate([curve.knots, added]))
    for value in np.unique(added):
        count = int(np.count_nonzero(new_knots == value))
        if count > curve.degree:
            raise CurveError(
                f"knot {value:g} would appear {count} times; at most {curve.degree} (the degree) are possible"
            )
    return type(curve)(curve.degree, new_knots, *_refined(curve, new_knots))


def unbroken(
    degree: int, knots: Array, control_points: Array, weights: Array | None = None
) -> list[tuple[Array, Array, Array | None]]:
    """Split a curve at inner knots that stand degree + 1 times or more, where it may jump.

    Parameters
    ----------
    degree : int
        p.
    knots : (n + p + 1,) array
        Not decreasing.
    control_points : (n, axes) array
        mm (rotary axes rad).
    weights : (n,) array, optional
        None for a polynomial curve.

    Returns
    -------
    list of (array, array, array or None)
        Knots (m + p + 1,), control points (m, axes) and weights (m,) of the pieces; one piece, as given, where there is
        no such knot, or where the numbers do not fit.

    Notes
    -----
    What is before such a knot depends on the first degree + 1 of the equal knots, what is after it on the last, and
    control points between have no part in either. The pieces are exact.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., section 2.4.
    """
    count = len(control_points)
    if degree < 1 or len(knots) != count + degree + 1 or not np.all(np.diff(knots) >= 0.0):
        return [(knots, control_points, weights)]
    values, firsts, times = np.unique(knots, return_index=True, return_counts=True)
    inside = (values > knots[degree]) & (values < knots[count]) & (times > degree)
    begin, pieces = 0, []
    for first, time in zip(firsts[inside].tolist(), times[inside].tolist(), strict=True):
        pieces.append((begin, first))
        begin = first + time - degree - 1
    pieces.append((begin, count))
    return [
        (knots[a : b + degree + 1], control_points[a:b], None if weights is None else weights[a:b]) for a, b in pieces
    ]


def split(curve: Curve, *parameters: float) -> list[Curve]:
    """Split a curve at inner parameters.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    *parameters : float
        Where, inside the domain.

    Returns
    -------
    list of NurbsCurve
        Clamped pieces between the domain's ends and these, in order.

    Raises
    ------
    InputError
        For a parameter that is not inside.
    """
    cuts = np.unique(curve.check_parameters(np.array(parameters, dtype=np.float64)))
    start, end = curve.domain
    if np.any((cuts <= start) | (cuts >= end)):
        raise InputError(f"a curve can be split only strictly inside its domain ({start:g}, {end:g})")
    if not len(cuts):
        return [clamped(curve)]
    inner = curve.knots[(curve.knots > start) & (curve.knots < end) & ~np.isin(curve.knots, cuts)]
    knots = np.sort(np.concatenate([inner, np.repeat([start, *cuts, end], curve.degree + 1)]))
    pieces = unbroken(curve.degree, knots, *_refined(curve, knots))
    for (_, before, _), (_, behind, _) in pairwise(pieces):
        behind[0] = before[-1]  # but for rounding it is
    return [type(curve)(curve.degree, *piece) for piece in pieces]


def elevated(curve: Curve, times: int = 1) -> Curve:
    """Elevate the degree.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    times : int, optional
        By how much.

    Returns
    -------
    NurbsCurve
        The same curve at degree p + times.

    Raises
    ------
    InputError
        For a degree beyond 12.
    """
    if not isinstance(times, (int, np.integer)) or times < 0 or curve.degree + times > MAX_DEGREE:
        raise InputError(f"degree {curve.degree} raised {times} times; degrees up to {MAX_DEGREE} are possible")
    whole = clamped(curve)
    if times == 0:
        return whole
    points, origin = _homogeneous(whole)
    knots, degree = whole.knots, whole.degree
    for _ in range(times):
        new_knots = np.sort(np.concatenate([knots, np.unique(knots)]))
        points = _over(knots, points, degree, new_knots, higher=True)
        knots, degree = new_knots, degree + 1
    return type(curve)(degree, knots, *_from_homogeneous(whole, degree, knots, points, origin))


def reversed_curve(curve: Curve) -> Curve:
    """Reverse the direction of a curve.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.

    Returns
    -------
    NurbsCurve
        The same curve traversed from its end to its start, on the same domain.
    """
    flat = Flat.of([curve]).reversed()
    weights = None if curve.weights is None else flat.weights
    return curve.trusted(curve.degree, flat.knots, flat.points, weights, clamped=curve.clamped)


def transformed(curve: Curve, matrix: ArrayLike, offset: ArrayLike | None = None) -> Curve:
    """Transform a curve: its control points by `moved_points`; weights stay.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    matrix : array_like
        (new axes, axes), or one number.
    offset : array_like, optional
        (new axes,), mm.

    Returns
    -------
    NurbsCurve
        The affine image of the curve.

    Raises
    ------
    InputError
        For shapes that do not fit or values that are not finite.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., property P4.2.
    """
    return type(curve)(curve.degree, curve.knots, moved_points(curve.control_points, matrix, offset), curve.weights)


def moved_points(points: Array, matrix: ArrayLike, offset: ArrayLike | None = None) -> Array:
    """Compute matrix @ P + offset for each of many points.

    Parameters
    ----------
    points : (n, axes) array
        P.
    matrix : array_like
        (new axes, axes), or one number.
    offset : array_like, optional
        (new axes,), mm.

    Returns
    -------
    (n, new axes) array
        The images.

    Raises
    ------
    InputError
        For shapes that do not fit or values that are not finite.
    """
    axes = points.shape[1]
    number = np.isscalar(matrix) or (isinstance(matrix, np.ndarray) and matrix.ndim == 0)
    square = frozen_array(np.diag([matrix] * axes) if number else matrix, "matrix", 2)
    check_finite(square, "matrix")
    if square.shape[1] != axes or not 1 <= square.shape[0] <= MAX_AXES:
        raise InputError(f"matrix has shape {square.shape}; (1 to {MAX_AXES}, {axes}) is needed")
    shift = frozen_array(np.zeros(square.shape[0]) if offset is None else offset, "offset", 1)
    check_finite(shift, "offset")
    if shift.shape != (square.shape[0],):
        raise InputError(f"offset has shape {shift.shape}; expected ({square.shape[0]},)")
    with np.errstate(over="ignore", invalid="ignore"):  # the new curve says which coordinate is too large
        return np.asarray(points @ square.T + shift)


def greville(degree: int, knots: Array) -> Array:
    """Compute where each control point counts most.

    Parameters
    ----------
    degree : int
        p.
    knots : (n + p + 1,) array
        Not decreasing.

    Returns
    -------
    (n,) array
        (u_i+1 + ... + u_i+p) / p, equal knots to the bit themselves.
    """
    inner = np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree)
    return np.asarray(inner[:, 0] + np.mean(inner - inner[:, :1], axis=1))


def blossom(knots: Array, points: Array, degree: int, span: IntArray, arguments: Array) -> Array:
    """Evaluate polar forms F(a_1, ..., a_p) of the polynomials of a spline.

    Parameters
    ----------
    knots : (k,) array
        Of the spline.
    points : (m, columns) array
        Its control points.
    degree : int
        p.
    span : (n,) array of int
        Each polynomial is that on [knots[span], knots[span + 1]].
    arguments : (p, n) array
        a_1, ..., a_p; with equal ones it is de Boor's algorithm.

    Returns
    -------
    (n, columns) array
        The values.

    Notes
    -----
    The recurrence is

        d_i^r = (1 - alpha) d_{i-1}^{r-1} + alpha d_i^{r-1},  alpha = (a_r - t_i) / (t_{i+p+1-r} - t_i)

    References
    ----------
    .. [1] Ramshaw, "Blossoms are polar forms", Computer Aided Geometric Design 6(4), 1989, doi
       10.1016/0167-8396(89)90032-0; The NURBS Book, 2nd ed., p. 176.
    """
    work = points[span - degree + np.arange(degree + 1)[:, None]]
    near = knots[span - degree + np.arange(1, 2 * degree + 1)[:, None]]  # t_{span-p+1} ... t_{span+p}
    for r in range(1, degree + 1):
        left, right = near[r - 1 : degree], near[degree : 2 * degree + 1 - r]
        # both from their own end: weights of very different size keep their digits, and end points stay as given
        alpha, beta = (arguments[r - 1] - left) / (right - left), (right - arguments[r - 1]) / (right - left)
        work = beta[..., None] * work[:-1] + alpha[..., None] * work[1:]
    out: Array = work[0]
    return out


def _over(knots: Array, points: Array, degree: int, new_knots: Array, *, higher: bool = False) -> Array:
    """Compute control points of the same spline over other knots, and of one degree more if `higher`.

    Parameters
    ----------
    knots : (k,) array
        Of the spline.
    points : (n, columns) array
        Its control points.
    degree : int
        p.
    new_knots : (m,) array
        Inside the domain they contain `knots`, if `higher` each once more; before the first and behind the last of them
        there are p more `knots`.
    higher : bool, optional
        See above.

    Returns
    -------
    (m - p - 1 - higher, columns) array
        On the span of tau_i, with the last argument first, all that counts is a mean with positive weights, so that no
        digits are lost.

    Notes
    -----
    Q_i = F(tau_{i+1}, ..., tau_{i+p}), Cohen, Lyche, Riesenfeld [1]_; of one degree more

        Q_i = 1/(p+1) sum_j F(tau_{i+1}, ..., without tau_{i+j}, ..., tau_{i+p+1}),

    as the symmetric multi-affine form of degree p + 1 that agrees with F on the diagonal is unique: Ramshaw 1989, see
    `blossom`.

    References
    ----------
    .. [1] "Discrete B-splines and subdivision techniques", CGIP 14(2), 1980, doi 10.1016/0146-664X(80)90040-4.
    """
    first = np.arange(len(new_knots) - degree - 1 - higher)
    span = np.searchsorted(knots, new_knots[first], side="right") - 1
    arguments = new_knots[first + np.arange(degree + higher, 0, -1)[:, None]]
    without = [np.delete(arguments, j, axis=0) for j in range(degree, -1, -1)] if higher else [arguments]
    return np.asarray(sum(blossom(knots, points, degree, span, each) for each in without) / len(without))

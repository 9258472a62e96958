"""Tangents, curvature, bounding boxes and derivatives by arc length, from derivatives by u."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.pieces import coefficients, columns, taylor
from splinefeed.curves.spline import AnySpline
from splinefeed.kernels import layout as pieces
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import chunks

#: A Taylor coefficient below this, relative to the greatest one of its piece, counts as none.
VANISHING = 1e-12
#: Where C' would take the curve less than this part of its size over a piece, it is decided whether C' counts as none.
SUSPECT = 1e-9
#: A coefficient below this, relative to the greatest one, is rounding: as the highest it would be a root far outside.
NO_TERM = 1e-15

#: Which axes count: the first so many, or a slice of them.
Axes = int | slice | None


def _columns(linear: Axes) -> slice:
    return linear if isinstance(linear, slice) else slice(linear)


def curvatures(derivatives: Array, linear: int | None = None) -> Array:
    """Curvature, 1/mm, (...) from derivatives (..., 3 or more, axes), over the first `linear` axes (default: all).

    kappa = |C'' - (C''.T) T| / |C'|^2 with T = C' / |C'|, the form of |C' x C''| / |C'|^3 for any number of axes.
    """
    first = derivatives[..., 1, :linear]
    second = derivatives[..., 2, :linear]
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.sum(first * first, axis=-1)
        along = np.sum(first * second, axis=-1) / square
        across = second - along[..., None] * first
        return np.where(square > 0.0, np.linalg.norm(across, axis=-1) / square, np.inf)


def by_arc_length(derivatives: Array, measured: int | None = None) -> Array:
    """dr/ds, d2r/ds2, d3r/ds3 with r, as (n, 4, axes), from derivatives by u (n, 4, axes); s over `measured` axes.

    With v = |C'|:  u_s = 1/v,  u_ss = -(C'.C'')/v^4,  u_sss = 4 (C'.C'')^2/v^7 - (C''.C'' + C'.C''')/v^5,
    r_s = C' u_s,  r_ss = C'' u_s^2 + C' u_ss,  r_sss = C''' u_s^3 + 3 C'' u_s u_ss + C' u_sss  (the chain rule).
    """
    c1, c2, c3 = (derivatives[:, k, :measured] for k in (1, 2, 3))
    out = np.empty_like(derivatives[:, :4, :])
    out[:, 0] = derivatives[:, 0]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        us = 1.0 / np.sqrt(np.einsum("na,na->n", c1, c1))
        m = np.einsum("na,na->n", c1, c2)
        n = np.einsum("na,na->n", c2, c2) + np.einsum("na,na->n", c1, c3)
        square = us * us
        uss = -m * square * square
        usss = (4.0 * m * m * square - n) * square * square * us
        for a in range(out.shape[2]):
            first, second = derivatives[:, 1, a], derivatives[:, 2, a]
            out[:, 1, a] = first * us
            out[:, 2, a] = second * square + first * uss
            out[:, 3, a] = derivatives[:, 3, a] * (square * us) + 3.0 * second * (us * uss) + first * usss
    if out.shape[2] == 1:  # s is that axis: what else results is rounding
        out[:, 2:] = 0.0
    return out


def angles(before: Array, behind: Array) -> Array:
    """Angles (n,), rad, between vectors (n, axes), small and straight-back ones alike to rounding.

    0 where one has no length. Source: Kahan, "How futile are mindless assessments of roundoff", 2006, section 12.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        a = before / np.linalg.norm(before, axis=1, keepdims=True)
        b = behind / np.linalg.norm(behind, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))
    return np.asarray(np.nan_to_num(angle))


def unit_tangents(curve: AnySpline, u: ArrayLike, linear: Axes = None, side: str = "right") -> Array:
    """Unit tangents (..., linear) at u (...), over the axes `linear`.

    Where C' = 0, the limit: by the first derivative that is not 0. With side="left", and at the end of the domain, the
    piece before u counts. Zero where no piece on that side moves.
    """
    given = curve.check_parameters(u)
    values = given.ravel()
    out = curve.derivatives(values, 1, side=side)[:, 1, _columns(linear)].copy()
    norm = np.linalg.norm(out, axis=1)
    table, _ = curve.table
    row = np.clip(np.searchsorted(table[:, pieces.LOW], values, side="right") - 1, 0, len(table) - 1)
    for k in np.flatnonzero(norm <= SUSPECT * curve.size * table[row, pieces.SCALE]):
        out[k] = _limit_direction(curve, values[k], linear, side == "left" or values[k] == curve.domain[1])
        norm[k] = np.linalg.norm(out[k])
    out /= np.where(norm > 0.0, norm, 1.0)[:, None]
    return out.reshape(*given.shape, out.shape[1])


def _limit_direction(curve: AnySpline, u: float, linear: Axes, backwards: bool) -> Array:
    """The direction (linear,) of the curve as it leaves u, or arrives there if `backwards`; zero if it does not move.

    Where C - C(u) = sum_k c_k x^k, x = t - t(u), the first c_k that is not 0 points along x^k, and with x < 0
    towards u along (-1)^(k - 1) c_k.
    """
    table, shape = curve.table
    row = int(np.clip(np.searchsorted(table[:, pieces.LOW], u, side="right") - 1, 0, len(table) - 1))
    row -= int(backwards and row > 0 and u == table[row, pieces.LOW])
    while 0 <= row < len(table):
        c = table[row, :, None]
        t = (np.clip(u, c[pieces.LOW], c[pieces.HIGH]) - c[pieces.MIDDLE]) * c[pieces.SCALE]
        steps = np.array(taylor(coefficients(c, shape), shape[3], t, curve.degree))[1:, _columns(linear), 0]
        lengths = np.linalg.norm(steps, axis=1)
        moving = np.flatnonzero(lengths > VANISHING * lengths.max())
        if len(moving):
            return np.asarray(steps[moving[0]] * (-1.0 if backwards and moving[0] % 2 else 1.0))
        row += -1 if backwards else 1  # a span that stands still
    return np.zeros(curve.axes)[_columns(linear)]


def extremes(curve: AnySpline) -> Array:
    """Parameters (k,) at which a coordinate may be least or greatest: ends of pieces and where its derivative is 0.

    x' = 0 where A' w - A w' = 0, a polynomial of degree 2p - 1 at most on every piece.
    """
    return np.concatenate([curve.breaks, _turns(curve, np.arange(len(curve.table[0])))])


def _turns(curve: AnySpline, rows: IntArray) -> Array:
    """Parameters (k,) on some pieces at which the derivative of a coordinate is 0."""
    table, shape = curve.table
    found = [np.zeros(0)]
    for some in chunks(len(rows)) if curve.degree > 1 else ():
        c = columns(table, rows[some])
        found += [zeros_on(c, slope, 1e-6)[1] for slope in slopes(c, shape)]
    return np.concatenate(found)


def bounding_box(curve: AnySpline) -> tuple[Array, Array]:
    """Least and greatest coordinates (axes,), mm.

    Only pieces whose control points go beyond the ends of all pieces are searched: no other goes further. Source: The
    NURBS Book, 2nd ed., property P4.3.
    """
    table, _ = curve.table
    ends = curve(curve.breaks)
    first = np.searchsorted(curve.knots, table[:, pieces.LOW], side="right") - 1 - curve.degree
    hull = curve.control_points[np.maximum(first, 0)[:, None] + np.arange(curve.degree + 1)]
    beyond = (hull.max(axis=1) > ends.max(axis=0)) | (hull.min(axis=1) < ends.min(axis=0))
    points = np.concatenate([ends, curve(_turns(curve, np.flatnonzero(beyond.any(axis=1))))])
    return points.min(axis=0), points.max(axis=0)


def slopes(c: Array, shape: pieces.Shape) -> list[Array]:
    """The polynomials A' w - A w' of each axis, (terms, n) each, of the columns c (width, n) of a table."""
    _, axes, _, rational = shape
    a = coefficients(c, shape)
    return [slope_of(each, a[axes] if rational else None) for each in a[:axes]]


def product(a: Array, b: Array) -> Array:
    """The products (terms, n) of polynomials with coefficients (terms, n) of t^k."""
    out = np.zeros((len(a) + len(b) - 1, a.shape[1]))
    for k, each in enumerate(a):
        out[k : k + len(b)] += each * b
    return out


def _derivative(a: Array) -> Array:
    return np.arange(1, len(a))[:, None] * a[1:]


def slope_of(a: Array, w: Array | None, times: float = 1.0) -> Array:
    """The polynomials a' w - times a w' (terms, n): that over w^2 is the derivative of a / w. Without w it is 1."""
    if w is None:
        return _derivative(a)
    return product(_derivative(a), w) - times * product(a, _derivative(w))


def roots(values: Array, real: float) -> tuple[IntArray, Array]:
    """Which of polynomials (terms, n) are 0, and at which t (k,) in [-1, 1], up to an imaginary part `real`.

    Roots are eigenvalues of companion matrices, of one degree at once.
    """
    values = np.where(np.abs(values) > NO_TERM * np.max(np.abs(values), axis=0, initial=0.0), values, 0.0)
    degree = np.max(np.arange(len(values))[:, None] * (values != 0.0), axis=0, initial=0)
    found = [(np.zeros(0, dtype=np.int64), np.zeros(0))]
    for n in np.unique(degree[degree > 0]).tolist():
        which = np.flatnonzero(degree == n)
        companion = np.zeros((len(which), n, n))
        companion[:, np.arange(1, n), np.arange(n - 1)] = 1.0
        companion[:, :, -1] = -(values[:n, which] / values[n, which]).T
        t = np.linalg.eigvals(companion)
        number, k = np.nonzero((np.abs(t.imag) < real) & (np.abs(t.real) <= 1.0))
        found.append((which[number], t.real[number, k]))
    which, at = (np.concatenate(each) for each in zip(*found, strict=True))
    return which, at


def zeros_on(c: Array, values: Array, real: float) -> tuple[IntArray, Array]:
    """On which of pieces, columns c (width, n) of their table, polynomials (terms, n) are 0, and parameters (k,) there.

    See `roots`.
    """
    piece, t = roots(values, real)
    low, high, middle, scale = (c[each, piece] for each in (pieces.LOW, pieces.HIGH, pieces.MIDDLE, pieces.SCALE))
    return piece, np.clip(middle + t / scale, low, high)

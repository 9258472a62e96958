"""Curvature, angles and derivatives by arc length, from derivatives by u; zeros of polynomials on pieces."""

from __future__ import annotations

import numpy as np

from splinefeed.curves.pieces import coefficients
from splinefeed.kernels import layout as pieces
from splinefeed.records import Array, IntArray

#: A coefficient below this, relative to the greatest one, is rounding: as the highest it would be a root far outside.
NO_TERM = 1e-15


def curvatures(derivatives: Array, linear: int | None = None) -> Array:
    """Compute curvatures from derivatives.

    Parameters
    ----------
    derivatives : (..., 3 or more, axes) array
        Points and derivatives by u.
    linear : int, optional
        How many of the first axes count; all by default.

    Returns
    -------
    (...) array
        1/mm.

    Notes
    -----
    The form of |C' x C''| / |C'|^3 for any number of axes, with T = C' / |C'|:

        kappa = |C'' - (C''.T) T| / |C'|^2
    """
    first = derivatives[..., 1, :linear]
    second = derivatives[..., 2, :linear]
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.sum(first * first, axis=-1)
        along = np.sum(first * second, axis=-1) / square
        across = second - along[..., None] * first
        return np.where(square > 0.0, np.linalg.norm(across, axis=-1) / square, np.inf)


def by_arc_length(derivatives: Array, measured: int | None = None) -> Array:
    """Compute derivatives by arc length from those by u.

    Parameters
    ----------
    derivatives : (n, 4, axes) array
        Points and derivatives by u.
    measured : int, optional
        How many of the first axes make the length; all by default.

    Returns
    -------
    (n, 4, axes) array
        r, dr/ds, d2r/ds2, d3r/ds3.

    Notes
    -----
    With v = |C'|, by the chain rule,

        u_s = 1/v,  u_ss = -(C'.C'')/v^4,  u_sss = 4 (C'.C'')^2/v^7 - (C''.C'' + C'.C''')/v^5,
        r_s = C' u_s,  r_ss = C'' u_s^2 + C' u_ss,  r_sss = C''' u_s^3 + 3 C'' u_s u_ss + C' u_sss
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
    """Compute angles between vectors, small and straight-back ones alike to rounding.

    Parameters
    ----------
    before, behind : (n, axes) array
        The vectors.

    Returns
    -------
    (n,) array
        rad; 0 where one has no length.

    References
    ----------
    .. [1] Kahan, "How futile are mindless assessments of roundoff", 2006, section 12.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        a = before / np.linalg.norm(before, axis=1, keepdims=True)
        b = behind / np.linalg.norm(behind, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))
    return np.asarray(np.nan_to_num(angle))


def slopes(c: Array, shape: pieces.Shape) -> list[Array]:
    """Compute the polynomials A' w - A w' of each axis.

    Parameters
    ----------
    c : (width, n) array
        Columns of a table.
    shape : Shape
        Of the table.

    Returns
    -------
    list of (terms, n) array
        One an axis.
    """
    _, axes, _, rational = shape
    a = coefficients(c, shape)
    return [slope_of(each, a[axes] if rational else None) for each in a[:axes]]


def product(a: Array, b: Array) -> Array:
    """Multiply polynomials.

    Parameters
    ----------
    a, b : (terms, n) array
        Their coefficients of t^k.

    Returns
    -------
    (terms, n) array
        Those of the products.
    """
    out = np.zeros((len(a) + len(b) - 1, a.shape[1]))
    for k, each in enumerate(a):
        out[k : k + len(b)] += each * b
    return out


def _derivative(a: Array) -> Array:
    return np.arange(1, len(a))[:, None] * a[1:]


def slope_of(a: Array, w: Array | None, times: float = 1.0) -> Array:
    """Compute the polynomials a' w - times a w': that over w^2 is the derivative of a / w.

    Parameters
    ----------
    a : (terms, n) array
        Coefficients of t^k.
    w : (terms, n) array or None
        Without it w is 1.
    times : float, optional
        See above.

    Returns
    -------
    (terms, n) array
        Coefficients.
    """
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
    """Find where on pieces polynomials are 0; see `roots`.

    Parameters
    ----------
    c : (width, n) array
        Columns of the pieces in their table.
    values : (terms, n) array
        Coefficients of the polynomials.
    real : float
        The imaginary part up to which a root is real.

    Returns
    -------
    piece : (k,) array of int
        On which piece each is.
    u : (k,) array
        Parameters there.
    """
    piece, t = roots(values, real)
    low, high, middle, scale = (c[each, piece] for each in (pieces.LOW, pieces.HIGH, pieces.MIDDLE, pieces.SCALE))
    return piece, np.clip(middle + t / scale, low, high)

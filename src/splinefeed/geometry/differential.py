"""Tangents, curvature, bounding boxes and derivatives by arc length, from derivatives by u."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.kernels import pieces
from splinefeed.records import Array

#: A derivative shorter than this, relative to the curve's size and span, counts as none.
VANISHING = 1e-12


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


def by_arc_length(derivatives: Array, linear: int | None = None) -> Array:
    """dr/ds, d2r/ds2, d3r/ds3 with r, as (n, 4, axes), from derivatives by u (n, 4, axes); s over `linear` axes.

    With v = |C'|:  u_s = 1/v,  u_ss = -(C'.C'')/v^4,  u_sss = 4 (C'.C'')^2/v^7 - (C''.C'' + C'.C''')/v^5,
    r_s = C' u_s,  r_ss = C'' u_s^2 + C' u_ss,  r_sss = C''' u_s^3 + 3 C'' u_s u_ss + C' u_sss  (the chain rule).
    """
    c1, c2, c3 = (derivatives[:, k, :] for k in (1, 2, 3))
    l1, l2, l3 = (c[:, :linear] for c in (c1, c2, c3))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        v = np.linalg.norm(l1, axis=1)
        m = np.sum(l1 * l2, axis=1)
        n = np.sum(l2 * l2, axis=1) + np.sum(l1 * l3, axis=1)
        us = 1.0 / v
        uss = -m / v**4
        usss = 4.0 * m * m / v**7 - n / v**5
        out = np.empty_like(derivatives[:, :4, :])
        out[:, 0] = derivatives[:, 0]
        out[:, 1] = c1 * us[:, None]
        out[:, 2] = c2 * (us * us)[:, None] + c1 * uss[:, None]
        out[:, 3] = c3 * (us**3)[:, None] + 3.0 * c2 * (us * uss)[:, None] + c1 * usss[:, None]
    return out


def unit_tangents(curve: NurbsCurve, u: ArrayLike, linear: int | None = None, side: str = "right") -> Array:
    """Unit tangents (..., linear) at u (...). Where C' = 0, the limit: the first derivative that is not 0.

    With side="left" the piece before a knot counts; approached from the left, an even derivative points backwards.
    """
    values = np.asarray(u, dtype=np.float64)
    start, end = curve.domain
    derivatives = curve.derivatives(values, 3, side=side)[..., :linear]
    out = derivatives[..., 1, :].copy()
    from_left = (values >= end) | (np.full(values.shape, side == "left") & (values > start))
    small = VANISHING * max(curve.size, float(np.abs(curve.control_points).max()) * 1e-3) / (end - start)
    for k in (2, 3):
        vanishing = np.linalg.norm(out, axis=-1) <= small
        sign = np.where(from_left & (k % 2 == 0), -1.0, 1.0)
        out = np.where(vanishing[..., None], sign[..., None] * derivatives[..., k, :], out)
    norm = np.linalg.norm(out, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(norm > 0.0, out / norm, 0.0)


def bounding_box(curve: NurbsCurve) -> tuple[Array, Array]:
    """Least and greatest coordinates (axes,), mm: the ends of the pieces and where a coordinate's derivative is 0.

    x' = 0 where A' w - A w' = 0, a polynomial of degree 2p - 1 at most on every piece.
    """
    table, shape = curve.table
    degree, axes, _, rational = shape
    ends = curve(curve.breaks)
    low, high = ends.min(axis=0), ends.max(axis=0)
    if degree == 1:
        return low, high
    first = pieces.ORIGIN + axes
    for row in table:
        columns = row[first:].reshape(axes + rational, degree + 1)
        weight = columns[axes] if rational else np.ones(1)
        for a in range(axes):
            slope = np.polynomial.polynomial.polysub(
                np.polynomial.polynomial.polymul(np.polynomial.polynomial.polyder(columns[a]), weight),
                np.polynomial.polynomial.polymul(columns[a], np.polynomial.polynomial.polyder(weight)),
            )
            top = np.max(np.abs(slope))
            if top == 0.0:
                continue
            # a highest coefficient that is rounding only would send a spurious root to infinity, with an overflow
            roots = np.polynomial.polynomial.polyroots(
                np.trim_zeros(np.where(np.abs(slope) > 1e-15 * top, slope, 0.0), "b")
            )
            inside = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1.0)]
            if inside.size:
                u = np.clip(row[pieces.MIDDLE] + inside / row[pieces.SCALE], row[pieces.LOW], row[pieces.HIGH])
                values = curve(u)[:, a]
                low[a] = min(low[a], values.min())
                high[a] = max(high[a], values.max())
    return low, high

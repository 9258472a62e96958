"""Tangents, curvature, bounding boxes and derivatives by arc length, from derivatives by u."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import Flat
from splinefeed.geometry.pieces import Pieces, last_below
from splinefeed.kernels import layout as pieces
from splinefeed.kernels.layout import DEGREES
from splinefeed.records import Array, IntArray

#: A Taylor coefficient below this, relative to the greatest one of its piece, counts as none.
VANISHING = 1e-12
#: Where C' would take the curve less than this part of its size over a piece, it is asked whether C' counts as none.
SUSPECT = 1e-9
#: A speed below this part of the greatest one is a cusp: the radius of its turn, as the square, is 1e-12 of the size.
CUSP_SPEED = 1e-6
#: How far from a cusp the tangents before and after it are taken, relative to the span.
CUSP_ARM = 1e-4
#: A cusp no further from a knot than this, relative to the span, is the knot's.
AT_KNOT = 1e-9
#: Samples a piece among which cusps are looked for.
CUSP_SAMPLES = 8
#: Golden section, and the steps that bring it from one sample to rounding.
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
GOLDEN_STEPS = 80


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


def by_arc_length(derivatives: Array, linear: int | None = None) -> Array:
    """dr/ds, d2r/ds2, d3r/ds3 with r, as (n, 4, axes), from derivatives by u (n, 4, axes); s over `linear` axes.

    Where none of these moves (all three derivatives are 0) but those behind them do, s is in degrees over those.

    With v = |C'|:  u_s = 1/v,  u_ss = -(C'.C'')/v^4,  u_sss = 4 (C'.C'')^2/v^7 - (C''.C'' + C'.C''')/v^5,
    r_s = C' u_s,  r_ss = C'' u_s^2 + C' u_ss,  r_sss = C''' u_s^3 + 3 C'' u_s u_ss + C' u_sss  (the chain rule).
    """
    c1, c2, c3 = (derivatives[:, k, :] for k in (1, 2, 3))
    l1, l2, l3 = (c[:, :linear] for c in (c1, c2, c3))
    if linear is not None and linear < derivatives.shape[2]:
        turning = ~np.any(derivatives[:, 1:4, :linear], axis=(1, 2))
        if turning.any():
            unit = np.where(np.arange(derivatives.shape[2]) < linear, ~turning[:, None], DEGREES * turning[:, None])
            l1, l2, l3 = (c * unit for c in (c1, c2, c3))
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


def unit_tangents(curve: NurbsCurve, u: ArrayLike, linear: Axes = None, side: str = "right") -> Array:
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


def _limit_direction(curve: NurbsCurve, u: float, linear: Axes, backwards: bool) -> Array:
    """The direction (linear,) of the curve as it leaves u, or arrives there if `backwards`; zero if it does not move.

    Where C - C(u) = sum_k n_k x^k / w, x = t - t(u), the first n_k that is not 0 points along x^k, and with x < 0
    towards u along (-1)^(k - 1) n_k.
    """
    table, (degree, axes, _, rational) = curve.table
    row = int(np.clip(np.searchsorted(table[:, pieces.LOW], u, side="right") - 1, 0, len(table) - 1))
    row -= int(backwards and row > 0 and u == table[row, pieces.LOW])
    power = np.arange(degree + 1)
    while 0 <= row < len(table):
        columns = table[row, pieces.ORIGIN + axes :].reshape(axes + rational, degree + 1)
        low, high = table[row, pieces.LOW], table[row, pieces.HIGH]
        t = (min(max(u, low), high) - table[row, pieces.MIDDLE]) * table[row, pieces.SCALE]
        about = np.array([[math.comb(j, k) * t ** (j - k) if j >= k else 0.0 for k in power] for j in power])
        taylor = columns @ about
        local = taylor[:axes] - taylor[:axes, :1] * (taylor[axes] / taylor[axes, 0] if rational else power == 0)
        local = local[_columns(linear)]
        lengths = np.linalg.norm(local, axis=0)
        moving = np.flatnonzero(lengths[1:] > VANISHING * lengths.max())
        if len(moving):
            k = int(moving[0]) + 1
            direction: Array = local[:, k] * ((-1.0) ** (k - 1) if backwards else 1.0)
            return direction
        row += -1 if backwards else 1  # a span that stands still
    return np.zeros(axes)[_columns(linear)]


def cusps(flat: Flat, spans: Pieces, curve: IntArray, grid: Array, counts: Array) -> tuple[IntArray, Array]:
    """Curve and parameter (m,), strictly between knots, at which curves turn straight back.

    There C' = 0 within rounding: the speed falls below CUSP_SPEED of its greatest value, and the tangents before and
    after have an obtuse angle.
    curve, grid (n,)  curves in order, and on each of them parameters that increase over its domain and are finer at
                      cusps, as arc-length pieces are
    counts (curves, axes)  1 for the axes that count, or 0; spans  the knot spans of `flat`
    """
    fractions = np.linspace(0.0, 1.0, CUSP_SAMPLES, endpoint=False)
    wide = np.append(curve[1:] == curve[:-1], False)
    steps = np.where(wide, np.append(np.diff(grid), 0.0), 0.0)
    taken = wide[:, None] | (np.arange(CUSP_SAMPLES) == 0)  # the end of a curve is one sample alone
    u = (grid[:, None] + steps[:, None] * fractions)[taken]
    owner = np.repeat(curve, taken.sum(axis=1))

    def velocity(index: IntArray, at: Array) -> Array:
        return spans.evaluate(index, at, 1, False)[:, 1] * counts[index]

    def speed(index: IntArray, at: Array) -> Array:
        return np.asarray(np.linalg.norm(velocity(index, at), axis=1))

    values = speed(owner, u)
    first = np.flatnonzero(np.append(True, owner[1:] != owner[:-1]))
    top = np.repeat(np.maximum.reduceat(values, first), np.diff(np.append(first, len(u))))
    low = (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]) & (values[1:-1] < 0.1 * top[1:-1])
    dip = 1 + np.flatnonzero(low & (owner[:-2] == owner[2:]))
    left, right, owner, top = u[dip - 1], u[dip + 1], owner[dip], top[dip]
    for _ in range(GOLDEN_STEPS if len(dip) else 0):  # golden section, all dips at once
        a, b = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        lower = speed(owner, a) <= speed(owner, b)
        left, right = np.where(lower, left, a), np.where(lower, b, right)
    at = 0.5 * (left + right)
    ends = flat.knot_starts[owner] + flat.degrees[owner], flat.knot_starts[owner + 1] - flat.degrees[owner] - 2
    knot = last_below(flat.knots, *ends, at)
    start, end = flat.knots[knot], flat.knots[knot + 1]
    width = end - start
    cusp = (at - start > AT_KNOT * width) & (end - at > AT_KNOT * width) & (speed(owner, at) <= CUSP_SPEED * top)
    before, after = np.maximum(at - CUSP_ARM * width, start), np.minimum(at + CUSP_ARM * width, end)
    cusp &= np.sum(velocity(owner, before) * velocity(owner, np.nextafter(after, start)), axis=1) < 0.0
    owner, at = owner[cusp], at[cusp]
    same = (np.diff(owner) == 0) & (np.diff(at) <= 0.0)  # two samples as slow give one place twice
    keep = np.append(True, ~same)[: len(at)]
    return owner[keep], at[keep]


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

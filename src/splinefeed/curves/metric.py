"""What each axis counts in the length of a path, and the arc length of the tip where that is another.

    sigma = int |dr|_w,    |r|_w^2 = sum_k (w_k r_k)^2

The length grows wherever any axis moves, so that no axis ever stands out by it: |dr/dsigma|_w = 1. It is the arc length
of the same curves with every axis times its w: 1 for linear axes, RADIUS mm per rad for rotary ones beside them, and
degrees where all of them are rotary.

A programmed feed counts the arc length s of the tip instead, over the linear axes, and where none of them moves over
the others in degrees (RS274/NGC, 2.1.2.5: Kramer, Proctor, Messina, NISTIR 6556, 2000). On paths of linear axes, or of
rotary ones alone, s is sigma.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import Flat
from splinefeed.curves.pieces import Pieces, speed
from splinefeed.curves.tables import arc_pieces
from splinefeed.kernels.layout import Shape
from splinefeed.records import Array

#: What a rad of a rotary axis counts beside linear axes, mm: about the size of a part.
RADIUS = 50.0
DEGREES = 180.0 / math.pi
#: Samples of an arc-length piece among which the tip's slowest places are looked for; a tip slower than this counts.
SAMPLES, SLOW_TIP = np.clip(np.linspace(0.0, 1.0, 9), 1e-9, 1.0 - 1e-9), 0.3
#: A dip of the tip's squared speed by less than this share is rounding.
SHALLOW = 1e-12
#: Halvings that take an interval to the rounding of its middle.
HALVINGS = 50
#: A speed that is as good as 0.
TINY = 1e-150


def metric_of(axes: int, linear: int, *, by_tip: bool = False) -> Array:
    """Compute what each axis counts in the length of a path.

    Parameters
    ----------
    axes : int
        How many there are.
    linear : int
        How many of the first ones are linear.
    by_tip : bool, optional
        Whether the others count nothing.

    Returns
    -------
    (axes,) array
        w of each.
    """
    rotary = DEGREES if not linear else 0.0 if by_tip else RADIUS
    return np.where(np.arange(axes) < linear, 1.0, rotary)


def tip_derivatives(d: Array, linear: int) -> Array:
    """Compute derivatives of the tip's arc length s by sigma.

    Parameters
    ----------
    d : (n, 4, axes) array
        r and its derivatives by sigma.
    linear : int
        How many of the first axes are linear.

    Returns
    -------
    (3, n) array
        s', s'', s'''.
    """
    p = d[:, 1:, :linear]
    alone = ~np.any(p, axis=(1, 2))
    if alone.any():
        p = np.concatenate([p, DEGREES * d[:, 1:, linear:] * alone[:, None, None]], axis=2)
    one, two, three = np.moveaxis(p, 1, 0)
    first = np.sqrt(np.sum(one * one, axis=1))
    safe = np.maximum(first, TINY)
    second = np.sum(one * two, axis=1) / safe
    third = (np.sum(two * two, axis=1) + np.sum(one * three, axis=1) - second * second) / safe
    return np.stack([first, second, third])


def slow_tips(derivatives: Callable[[Array], Array], pieces: Pieces, linear: int) -> Array:
    """Find places at which the speed of the tip has a low minimum.

    Parameters
    ----------
    derivatives : callable
        Of places (n,), mm: r and its derivatives by sigma, (n, 4, axes).
    pieces : Pieces
        Of the path.
    linear : int
        How many of the first axes are linear.

    Returns
    -------
    (k,) array
        Places, mm.
    """
    span = np.diff(np.append(pieces.starts, pieces.length))
    places = (pieces.starts[:, None] + span[:, None] * SAMPLES).ravel()

    def fall(at: Array) -> tuple[Array, Array]:
        d = derivatives(at)[:, :, :linear]
        return np.sum(d[:, 1] * d[:, 2], axis=1), np.sum(d[:, 1] ** 2, axis=1)

    value, square = fall(places)
    dip = np.flatnonzero((value[:-1] < 0.0) & (value[1:] > 0.0))
    low, high = places[dip], places[dip + 1]
    for _ in range(HALVINGS if len(dip) else 0):
        middle = 0.5 * (low + high)
        falls = fall(middle)[0] < 0.0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    beside = np.minimum(square[dip], square[dip + 1])
    return high[fall(high)[1] < np.minimum(SLOW_TIP**2, beside * (1.0 - SHALLOW))] if len(dip) else np.zeros(0)


def tip_pieces(flat: Flat, linear: int, curves: Sequence[NurbsCurve]) -> Pieces:
    """Make arc-length pieces of the tip's s, as `tables.arc_pieces` of sigma.

    Parameters
    ----------
    flat : Flat
        Arrays of the curves.
    linear : int
        How many of the first axes are linear.
    curves : sequence of NurbsCurve
        The same curves.

    Returns
    -------
    Pieces
        By the tip's arc length, mm.
    """
    shape = int(flat.degrees.max()), flat.points.shape[1], linear, int(flat.rational.max())
    return arc_pieces(flat, shape, curves, speed=_tip_speed)


def _tip_speed(a: Array, shape: Shape, t: Array) -> Array:
    """|ds/dt| on pieces with coefficients a; on one over which no linear axis moves A is 0 exactly, about its point."""
    degree, axes, linear, rational = shape
    others = speed(a[linear:], (degree, axes - linear, axes - linear, rational), t)
    return np.where(np.any(a[:linear], axis=(0, 1)), speed(a, shape, t), DEGREES * others)

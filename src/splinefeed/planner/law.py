"""From feed squared to a motion: a quintic in t for each cell, with the feed and acceleration of q at both nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.planner.constants import SAME
from splinefeed.planner.solve import End
from splinefeed.planner.spline import Spline
from splinefeed.records import LAW_COEFFICIENTS, Array

#: Gauss and Legendre's places and weights on [0, 1], by which a cell's time is the integral of ds / sqrt(q).
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
GAUSS, WEIGHTS = 0.5 * (_PLACES + 1.0), 0.5 * _WEIGHTS


@dataclass(frozen=True, eq=False)
class MotionPieces:
    """A motion over arc lengths.

    Parameters
    ----------
    spans : (m,) array
        Times of its pieces, s.
    coefficients : (m, 6) array
        Of s in t from its beginning, mm.
    """

    spans: Array
    coefficients: Array

    @property
    def duration(self) -> float:
        """s."""
        return float(np.sum(self.spans))

    def __len__(self) -> int:
        return len(self.spans)

    def stretched(self, factor: float) -> MotionPieces:
        """The same motion, so many times slower."""
        return MotionPieces(self.spans * factor, self.coefficients / factor ** np.arange(LAW_COEFFICIENTS))

    def slowed_between(self, seconds: float) -> MotionPieces:
        """The motion slower between its ends, so that it takes so long, s, and at both ends as it is.

        t = tau + (seconds - D) B(tau / D), where D is how long it takes and B' = 140 x^3 (1 - x)^3; each piece is the
        quintic between what that makes of its ends.
        """
        tau = np.concatenate([[0.0], np.cumsum(self.spans)])
        whole, x = tau[-1], tau / tau[-1]
        more = seconds / whole - 1.0
        t = tau + more * whole * x**4 * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))
        slower = 1.0 + 140.0 * more * (x * (1.0 - x)) ** 3
        steeper = 420.0 * more / whole * (x * (1.0 - x)) ** 2 * (1.0 - 2.0 * x)
        first, last = self.at(0.0), self.at(1.0)
        s, v = (np.append(each, other[-1]) for each, other in zip(first[:2], last[:2], strict=True))
        a0, a1 = (
            each / slower[ends] ** 2 - v[ends] * steeper[ends] / slower[ends] ** 3
            for each, ends in ((first[2], slice(None, -1)), (last[2], slice(1, None)))
        )
        return MotionPieces(np.diff(t), quintics(s, v / slower, a0, a1, np.diff(t)))

    def part(self, first: int, last: int) -> MotionPieces:
        """The pieces from `first` to the one before `last`."""
        return MotionPieces(self.spans[first:last], self.coefficients[first:last])

    def at(self, share: Array | float) -> tuple[Array, Array, Array, Array]:
        """s, feed, acceleration and jerk after this share of each piece's time, (m,), or of shares (k, 1) (k, m)."""
        t = share * self.spans
        found = []
        for order in range(4):
            value = np.zeros(np.shape(t))
            for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
                value = value * t + self.coefficients[:, k] * math.perm(k, order)
            found.append(value)
        return found[0], found[1], found[2], found[3]


def joined(parts: list[MotionPieces]) -> MotionPieces:
    """Motions one after the other."""
    return MotionPieces(np.concatenate([p.spans for p in parts]), np.concatenate([p.coefficients for p in parts]))


def quintics(nodes: Array, v: Array, a0: Array, a1: Array, spans: Array) -> Array:
    """Compute the polynomials s(t) between nodes.

    Parameters
    ----------
    nodes : (n + 1,) array
        mm.
    v : (n + 1,) array
        Feeds there, mm/s.
    a0, a1 : (n,) array
        Accelerations where each piece begins and ends, mm/s^2.
    spans : (n,) array
        Times of the pieces, s.

    Returns
    -------
    (n, 6) array
        Coefficients of s in t.
    """
    h, t = np.diff(nodes), spans
    v0, v1 = v[:-1], v[1:]
    out = np.empty((len(h), LAW_COEFFICIENTS))
    out[:, 0], out[:, 1], out[:, 2] = nodes[:-1], v0, 0.5 * a0
    # what is left to the cubic and higher terms: small, so that rounding of h does not show in the acceleration
    ds, dv, da = h - t * (v0 + 0.5 * t * a0), t * (v1 - v0 - t * a0), t * t * (a1 - a0)
    out[:, 3] = (10.0 * ds - 4.0 * dv + 0.5 * da) / t**3
    out[:, 4] = (-15.0 * ds + 7.0 * dv - da) / t**4
    out[:, 5] = (6.0 * ds - 3.0 * dv + 0.5 * da) / t**5
    return out


def pieces_of(spline: Spline, c: Array, ends: tuple[End, End]) -> MotionPieces:
    """The motion of q, a cell a piece, and the ramps s = j t^3 / 6 before and behind them where it rests."""
    nodes = spline.nodes
    h = np.diff(nodes)
    n = len(h)
    cell = np.repeat(np.arange(n), len(GAUSS))
    q = spline.combine(spline.basis(cell, (h[:, None] * GAUSS).ravel()), cell, c)[0]
    q = np.maximum(q, SAME * np.max(q))  # between places that are above 0 it may not be: the audit sees that
    spans = h * np.einsum("nk,k->n", (1.0 / np.sqrt(q)).reshape(n, -1), WEIGHTS)
    at = np.minimum(np.arange(n + 1), n - 1)
    y = spline.combine(spline.basis(at, nodes - nodes[at]), at, c)
    v, a = np.sqrt(np.maximum(y[0], SAME * np.max(y[0]))), 0.5 * y[1]
    a0, a1 = a[:-1].copy(), a[1:] - 0.5 * spline.slope_jumps[1:] * y[0, 1:]
    start, stop = ends
    for end, a, place, way in ((start, a0, 0, 1.0), (stop, a1, -1, -1.0)):
        if end.rest:  # that of the ramp, to the last bit: q' rounds where it is short
            a[place] = way * 2.0 / 3.0 * v[place] ** 2 / end.ramp
    parts = [MotionPieces(spans, quintics(nodes, v, a0, a1, spans))]
    if start.rest:
        t = 3.0 * start.ramp / v[0]
        up = np.array([[nodes[0] - start.ramp, 0.0, 0.0, start.ramp / t**3, 0.0, 0.0]])
        parts.insert(0, MotionPieces(np.array([t]), up))
    if stop.rest:
        t = 3.0 * stop.ramp / v[-1]
        down = np.array([[nodes[-1], v[-1], -v[-1] / t, v[-1] / (3.0 * t * t), 0.0, 0.0]])
        parts.append(MotionPieces(np.array([t]), down))
    return joined(parts)

"""From feed squared at nodes of the path to a law in t: quartic pieces with continuous feed and acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.feed.cells import Cells
from splinefeed.feed.square import End
from splinefeed.records import LAW_COEFFICIENTS, Array, BoolArray

#: A piece in which the feed falls below this share of that at both its ends is too coarse.
DIP = 0.2
#: Places of a piece where its feed is looked at.
PLACES = np.array([0.25, 0.5, 0.75])


@dataclass(frozen=True, eq=False)
class Nodes:
    """q = feed^2 and its slope by arc length at the nodes of cells, (n + 1,), and the ends of the stretch.

    low, high  arc lengths of the ends of the stretch, mm: beyond the cells only ramps lie between
    """

    cells: Cells
    q: Array
    slope: Array
    ends: tuple[End, End]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Pieces:
    """A motion over a stretch: instants (m + 1,) from 0, s; coefficients (m, 6) of s; which cells (n,) are too coarse.

    offset  index of the first cell's piece: 1 behind a ramp, else 0
    """

    times: Array
    coefficients: Array
    coarse: BoolArray
    offset: int

    @property
    def duration(self) -> float:
        """s."""
        return float(self.times[-1])

    def stretched(self, factor: float) -> Pieces:
        """The same motion, so many times slower."""
        coefficients = self.coefficients / factor ** np.arange(LAW_COEFFICIENTS)
        return Pieces(self.times * factor, coefficients, self.coarse, self.offset)

    def at(self, t: Array, order: int = 0) -> Array:
        """The order-th derivative of s at instants t (n,), s."""
        piece = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.coefficients) - 1)
        return polynomial(self.coefficients[piece], t - self.times[piece], order)


def polynomial(coefficients: Array, t: Array, order: int) -> Array:
    """The order-th derivative of every piece at its own t, (m,)."""
    value = np.zeros(len(t))
    for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
        value = value * t + coefficients[:, k] * math.perm(k, order)
    return value


def to_pieces(nodes: Nodes) -> Pieces:
    """The stretch as quartics in t.

    v is the cubic in t with the feed and acceleration of q at both nodes, and a cell lasts what this v needs for its
    length:  h = T (v_0 + v_1)/2 + T^2 (a_0 - a_1)/12. Ends at rest are the ramps s = j t^3 / 6.
    """
    v, a = np.sqrt(nodes.q), 0.5 * nodes.slope
    v0, v1, a0, a1 = v[:-1], v[1:], a[:-1], a[1:]
    h = nodes.cells.length
    half, bend = 0.5 * (v0 + v1), (a0 - a1) / 12.0
    # the smaller root of bend T^2 + half T - h = 0, in the form that does not cancel
    inside = half * half + 4.0 * bend * h
    coarse = ~(inside > DIP * half * half)
    t = 2.0 * h / (half + np.sqrt(np.where(coarse, 0.0, inside)))
    dv, da = v1 - v0 - a0 * t, a1 - a0
    middle = np.zeros((len(h), LAW_COEFFICIENTS))
    middle[:, 0] = nodes.cells.s[:-1]
    middle[:, 1] = v0
    middle[:, 2] = 0.5 * a0
    middle[:, 3] = (3.0 * dv - da * t) / (3.0 * t * t)
    middle[:, 4] = (da * t - 2.0 * dv) / (4.0 * t**3)
    for place in PLACES:
        coarse |= polynomial(middle, place * t, 1) < DIP * np.minimum(v0, v1)
    rows, durations = [middle], [t]
    first, last = nodes.ends
    if first.rest:
        time = 3.0 * first.length / v[0]
        ramp = np.zeros((1, LAW_COEFFICIENTS))
        ramp[0, 0], ramp[0, 3] = nodes.low, first.length / time**3
        rows.insert(0, ramp)
        durations.insert(0, np.array([time]))
    if last.rest:
        time = 3.0 * last.length / v[-1]
        ramp = np.zeros((1, LAW_COEFFICIENTS))
        # s = high - length (1 - t / time)^3
        ramp[0, :4] = last.length * np.array([0.0, 3.0 / time, -3.0 / time**2, 1.0 / time**3])
        ramp[0, 0] = nodes.cells.s[-1]
        rows.append(ramp)
        durations.append(np.array([time]))
    times = np.concatenate([[0.0], np.cumsum(np.concatenate(durations))])
    return Pieces(times, np.concatenate(rows), coarse, int(first.rest))

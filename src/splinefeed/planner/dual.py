"""What multipliers of the limits bound the time of every motion by: the dual of the planner's problem.

A row of the limits belongs to a coordinate r(s): c0 = r''', c1 = 3/2 r'', c2 = r'/2 over its limit for jerk, c0 = r'',
c1 = r'/2 for acceleration. Take a function x(s) >= 0, C1, for each side of a row; Z(s) <= 1 sums up those of jerk.
Rows are at most 0: added to the time with these weights they make it no longer. Integrated by parts r''' drops out, and
so do the derivatives of q (of a torque x (c0 - c1') - x' c1 is left):

    T >= int min_{0 < q <= top} [(1 - Z) / sqrt(q) + P q] ds - int sum (x bound) ds + what ends in motion add
    P = sum +- (x'' r' - x' r'') / 2 of jerk + sum +- (x r'' - x' r') / 2 of acceleration

(Boyd and Vandenberghe, *Convex Optimization*, section 5.1.) This is so for every motion, not only for those on some
cells. Here x are cubic splines of coefficients that are not negative, which keep Z <= 1 if their sums do.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from splinefeed.planner.conditions import INSIDE, Conditions
from splinefeed.planner.constants import HALVINGS
from splinefeed.planner.rows import Rows
from splinefeed.planner.spline import DEGREE, Spline
from splinefeed.records import Array, BoolArray

#: Gauss and Legendre's places and weights on [0, 1].
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS, WEIGHTS = 0.5 * (_PLACES + 1.0), 0.5 * _WEIGHTS
#: Coefficients that reach into a cell.
REACHING = DEGREE + 1


def longest(s: Array, step: Array, most: float) -> Array:
    """The longest steps (n,), mm, up to `most`, that any place within them allows; steps allowed at places (n,)."""
    step = np.append(np.minimum(step, most), 0.0)
    found, wider = step[:-1], np.full(len(s), most)
    for _ in range(HALVINGS):
        ends = np.searchsorted(s, s - found), np.searchsorted(s, s + found, side="right")
        wider = np.maximum.reduceat(step, np.stack(ends, axis=1).ravel())[::2]
        if np.array_equal(found, wider):
            return found
        found = wider
    return np.full(len(s), most)


def rows_of(conditions: Conditions, s: Array) -> Rows:
    """The smooth rows at places (n,), mm; of two limits of jerk along the path the larger.

    A step may lie beside the sharpest place around, and an error of chords allow as much as anywhere within the step.
    """
    limits = conditions.limits
    slowing = np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk
    way = 1.0 if limits.jerk >= slowing else -1.0
    rows = conditions.rows(s, rising=way, alone=True, smooth=True)
    period, top = conditions.period or 0.0, rows.own
    if period:
        most = period * float(np.max(top)) ** 0.5
        top = np.minimum(top, longest(s, period * np.sqrt(rows.between), most) ** 2 / period**2)
    return dataclasses.replace(rows, top=top)


class Dual:
    """The rows of a stretch, tested with the splines on nodes (m + 1,), mm; places: Gauss's in `parts` of each cell.

    fields (f,)   rows of jerk up and down, then linear ones high and low; the first `jerks` are of jerk
    pull (m, 4 f, g)  what a coefficient adds to P at the places of a cell; value (m, 4, g) the splines there
    top, weight (m, g); fixed (n, f)  bounds of the tested rows, ends in motion included; held (n, f)  kept at 0
    ends   q and q' where motion begins and ends, mm^2/s^2 and mm/s^2; scale  unit of linear rows' multipliers, s/mm
    """

    def __init__(
        self, conditions: Conditions, nodes: Array, ends: tuple[tuple[float, float], ...], scale: float, parts: int
    ) -> None:
        self.spline = Spline.on(nodes, np.zeros(len(nodes), dtype=bool))
        h, m = np.diff(nodes), len(nodes) - 1
        share = ((np.arange(parts)[:, None] + GAUSS) / parts).ravel()
        cell, self.x = np.repeat(np.arange(m), len(share)), (nodes[:-1, None] + h[:, None] * share).ravel()
        self.weight = h[:, None] * np.tile(WEIGHTS / parts, parts)
        at_ends = np.array([nodes[0] + INSIDE * h[0], nodes[-1] - INSIDE * h[-1]])
        rows, outer = (rows_of(conditions, x) for x in (self.x, at_ends))
        self.top = rows.top.reshape(m, -1)
        self.jerks, self.fields = 2 * len(rows.jerk), 2 * (len(rows.jerk) + len(rows.linear))
        value, slope, bend = self.spline.basis(cell, self.x)
        up = bend * rows.jerk[:, 2, None] - slope * rows.jerk[:, 1, None] / 3.0
        own = 0.5 * rows.linear[:, 0]  # c0 - c1'
        torques = np.arange(rows.coordinates, rows.smooth)
        if len(torques):
            way = INSIDE * np.repeat(h, len(share))
            before, behind = (rows_of(conditions, self.x + side * way).linear[torques] for side in (-1.0, 1.0))
            own[torques] = rows.linear[torques, 0] - (behind[:, 1] - before[:, 1]) / (2.0 * way)
        high = scale * (value * own[:, None] - slope * rows.linear[:, 1, None])
        self.pull = self._by_cell(np.concatenate([up, -up, high, -high]))
        self.value = np.ascontiguousarray(np.moveaxis(value.reshape(REACHING, m, -1), 0, 1))
        bounds = scale * np.concatenate([rows.high, -rows.low])
        cost = np.concatenate([np.zeros((self.jerks, REACHING, len(self.x))), value * bounds[:, None]])
        self.fixed = self.spread(np.einsum("mkg,mg->mk", self._by_cell(cost), self.weight))
        for k, (q, dq) in enumerate(ends):
            value, slope, _ = self.spline.basis(np.array([k * (m - 1)]), nodes[[-k]])[:, :, 0]
            _, c1, c2 = outer.jerk[:, :, k].T[:, :, None]
            given = np.concatenate([
                (c1 * q / 1.5 + c2 * dq) * value - c2 * q * slope, scale * outer.linear[:, 1, k, None] * q * value
            ])  # fmt: skip
            first, second = np.split(given, [self.jerks // 2])
            both = np.concatenate([first, -first, second, -second]).T * (1.0 if k else -1.0)
            self.fixed[k * (m - 1) : k * (m - 1) + REACHING] -= both
        self.held = self._held(conditions, nodes)

    def _by_cell(self, rows: Array) -> Array:
        """(f, 4, places) as (m, 4 f, g)."""
        f, k, n = rows.shape
        m = len(self.spline.nodes) - 1
        return np.ascontiguousarray(rows.reshape(f, k, m, n // m).transpose(2, 1, 0, 3)).reshape(m, k * f, n // m)

    def _held(self, conditions: Conditions, nodes: Array) -> BoolArray:
        """Coefficients (n, f) that reach to where r' jumps, or for jerk r'' next to it: there are no such rows."""
        inside = (conditions.breaks > nodes[0]) & (conditions.breaks < nodes[-1])
        turned, bent = conditions.real_jumps
        turned = turned | np.isin(conditions.breaks, conditions.passed[0])
        bent = bent | turned
        t, held = self.spline.t, np.zeros((self.spline.size, self.fields), dtype=bool)
        reach = (conditions.period or 0.0) * float(np.max(self.top)) ** 0.5
        for jumps, fields in ((bent, slice(self.jerks)), (turned, slice(self.jerks, None))):
            at = conditions.breaks[jumps & inside]
            first, last = np.searchsorted(at, t[:-REACHING] - reach), np.searchsorted(at, t[REACHING:] + reach)
            held[last > first, fields] = True
        return held

    def spread(self, local: Array) -> Array:
        """The sum over cells (m, 4 k) as coefficients (n, k)."""
        m, k = len(local), local.shape[1] // REACHING
        out = np.zeros((m + DEGREE, k))
        for a in range(REACHING):
            out[a : a + m] += local[:, a * k : (a + 1) * k]
        return out

    def near(self, x: Any) -> Any:
        """Coefficients (n, k) that reach into each cell, (m, 4 k)."""
        return np.concatenate([x[a : len(x) - DEGREE + a] for a in range(REACHING)], axis=1)

    def at(self, x: Array) -> tuple[Array, Array]:
        """1 - Z and P at the places, (m, g) each, of multipliers x (n, f)."""
        left = 1.0 - np.sum(x[:, : self.jerks], axis=1, keepdims=True)
        return np.einsum("mkg,mk->mg", self.value, self.near(left)), np.einsum("mkg,mk->mg", self.pull, self.near(x))

    def tested(self, q: Array) -> tuple[Array, Array]:
        """The tested rows of q (m, g), (n, f), and the tested 1 / sqrt(q), (n,)."""
        rows = np.einsum("mkg,mg->mk", self.pull, self.weight * q)
        pace = np.einsum("mkg,mg->mk", self.value, self.weight / np.sqrt(q))
        return self.spread(rows), self.spread(pace)[:, 0]

    def bound(self, x: Array, left: Array, P: Array) -> float:
        """What multipliers x (n, f), with `left` and P of them, bound the time by, s."""
        q = self.top.copy()
        free = P > 0.0
        q[free] = np.minimum(np.cbrt((0.5 * left[free] / P[free]) ** 2), q[free])
        return float(np.sum(self.weight * (left / np.sqrt(q) + P * q)) - np.sum(self.fixed * x))

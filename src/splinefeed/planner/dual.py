"""What multipliers of the limits bound the time of every motion by: the dual of the planner's problem.

A row of the limits belongs to a coordinate r(s): c0 = r''', c1 = 3/2 r'', c2 = r'/2 over its limit for jerk, c0 = r'',
c1 = r'/2 for acceleration. Take a function x(s) >= 0, C1, for each side of a row; Z(s) <= 1 sums up those of jerk.
Rows are at most 0: added to the time with these weights they make it no longer. Integrated by parts r''' drops out, and
so do the derivatives of q (of a torque x (c0 - c1') - x' c1 is left):

    T >= int min_{0 < q <= top} [(1 - Z) / sqrt(q) + P q] ds - int sum (x bound) ds + what ends in motion add
    P = sum +- (x'' r' - x' r'') / 2 of jerk + sum +- (x r'' - x' r') / 2 of acceleration

(Boyd and Vandenberghe, *Convex Optimization*, section 5.1.) This is so for every motion, not only for those on some
cells. Here x are cubic splines of coefficients that are not negative, which keep Z <= 1 if their sums do.

Multipliers may also differ from one q to another. All that they have in common is g = sum +- x c2 of jerk and a = sum
+- x c1 of both: for these, for any, and for every motion

    T = int [1 / sqrt(q) + (g'' - a') q - a q' - g q''] ds + what ends in motion add

and at each place and each q the largest a q' + g q'' within the limits is a linear program of two unknowns. Whatever
multipliers meet sum +- y c2 = g and sum +- y c1 = a bound it, so that (1 - Z) / sqrt(q) + P q - C is below the
integrand for each of them, Z <= 1 or not: `by_place` takes the best ones for each of INTERVALS of q, and their least.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from splinefeed.planner.conditions import INSIDE, Conditions
from splinefeed.planner.constants import HALVINGS, SAME, TOGETHER
from splinefeed.planner.rows import Rows
from splinefeed.planner.spline import DEGREE, Spline
from splinefeed.records import Array, BoolArray

#: Gauss and Legendre's places and weights on [0, 1].
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS, WEIGHTS = 0.5 * (_PLACES + 1.0), 0.5 * _WEIGHTS
#: Coefficients that reach into a cell.
REACHING = DEGREE + 1
#: Intervals of sqrt(q) at each place, from 0 to so many times the least q; one more goes to the top.
INTERVALS, FAR = 48, 25.0


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
    """Test the rows of a stretch with the splines on nodes (m + 1,), at Gauss's places in `parts` of each cell.

    Attributes
    ----------
    fields : (f,) array
        Rows of jerk up and down, then linear ones high and low, then those of jerk again, under a chord of 1 / sqrt(q)
        from `least` (a function of places, q in mm^2/s^2) to the top; the first `jerks` are of jerk.
    pull : (m, 4 f, g) array
        What a coefficient adds to P at the places of a cell.
    value : (m, 4, g) array
        The splines there.
    top, weight : (m, g) array
        Of the places.
    fixed, held : (n, f) array
        Bounds of the tested rows, ends in motion included; those kept at 0.
    ends : tuple
        q and q' where motion begins and ends, mm^2/s^2 and mm/s^2.
    scale : float
        Unit of linear rows' multipliers, s/mm.
    """

    def __init__(
        self,
        conditions: Conditions,
        nodes: Array,
        ends: tuple[tuple[float, float], ...],
        scale: float,
        parts: int,
        least: Callable[[Array], Array] | None = None,
    ) -> None:
        self.spline = Spline.on(nodes, np.zeros(len(nodes), dtype=bool))
        h, m = np.diff(nodes), len(nodes) - 1
        share = ((np.arange(parts)[:, None] + GAUSS) / parts).ravel()
        self.cell, self.x = np.repeat(np.arange(m), len(share)), (nodes[:-1, None] + h[:, None] * share).ravel()
        self.weight = h[:, None] * np.tile(WEIGHTS / parts, parts)
        at_ends = np.array([nodes[0] + INSIDE * h[0], nodes[-1] - INSIDE * h[-1]])
        self.rows, outer = (rows_of(conditions, x) for x in (self.x, at_ends))
        rows = self.rows
        self.top = rows.top.reshape(m, -1)
        self.jerks, self.linears = 2 * len(rows.jerk), 2 * len(rows.linear)
        self.scale = scale
        self.basis = value, slope, bend = self.spline.basis(self.cell, self.x)
        up = bend * rows.jerk[:, 2, None] - slope * rows.jerk[:, 1, None] / 3.0
        own = 0.5 * rows.linear[:, 0]  # c0 - c1'
        torques = np.arange(rows.coordinates, rows.smooth)
        if len(torques):
            way = INSIDE * np.repeat(h, len(share))
            before, behind = (rows_of(conditions, self.x + side * way).linear[torques] for side in (-1.0, 1.0))
            own[torques] = rows.linear[torques, 0] - (behind[:, 1] - before[:, 1]) / (2.0 * way)
        self.turning = rows.linear[:, 0] - own
        high = scale * (value * own[:, None] - slope * rows.linear[:, 1, None])
        pull, bounds = [up, -up, high, -high], scale * np.concatenate([rows.high, -rows.low])
        costs = [np.zeros((self.jerks, REACHING, len(self.x))), value * bounds[:, None]]
        self.low = None if least is None else np.minimum(least(self.x), (1.0 - SAME) * rows.top)
        if self.low is not None:
            low = self.low
            steep = (low**-0.5 - rows.top**-0.5) / (rows.top - low)
            pull += [up + steep * value, steep * value - up]
            self.chord = low**-0.5 + steep * low
            costs.append(np.broadcast_to(value * self.chord, (self.jerks, *value.shape)))
        self.pull = self._by_cell(np.concatenate(pull))
        self.fields = sum(len(each) for each in pull)
        self.value = np.ascontiguousarray(np.moveaxis(value.reshape(REACHING, m, -1), 0, 1))
        self.at_ends = np.zeros((self.spline.size, self.fields))
        for k, (q, dq) in enumerate(ends):
            value, slope, _ = self.spline.basis(np.array([k * (m - 1)]), nodes[[-k]])[:, :, 0]
            _, c1, c2 = outer.jerk[:, :, k].T[:, :, None]
            given = np.concatenate([
                (c1 * q / 1.5 + c2 * dq) * value - c2 * q * slope, scale * outer.linear[:, 1, k, None] * q * value
            ])  # fmt: skip
            first, second = np.split(given, [self.jerks // 2])
            both = [first, -first, second, -second, *([] if least is None else [first, -first])]
            self.at_ends[k * (m - 1) : k * (m - 1) + REACHING] -= np.concatenate(both).T * (1.0 if k else -1.0)
        cost = self._by_cell(np.concatenate(costs))
        self.fixed = self.spread(np.einsum("mkg,mg->mk", cost, self.weight)) + self.at_ends
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
        linear = (np.arange(self.fields) >= self.jerks) & (np.arange(self.fields) < self.jerks + self.linears)
        for jumps, fields in ((bent, ~linear), (turned, linear)):
            at = conditions.breaks[jumps & inside]
            first, last = np.searchsorted(at, t[:-REACHING] - reach), np.searchsorted(at, t[REACHING:] + reach)
            held[np.ix_(last > first, fields)] = True
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
        """What multipliers x (n, f) of Z <= 1, with `left` and P of them, bound the time by, s."""
        return float(np.sum(self._values(left, P)) - np.sum(self.fixed * x))

    def _values(self, left: Array, P: Array) -> Array:
        """The least (1 - Z) / sqrt(q) + P q, times the weight, at the places, (m, g)."""
        q = self.top.copy()
        free = P > 0.0
        q[free] = np.minimum(np.cbrt((0.5 * left[free] / P[free]) ** 2), q[free])
        return np.asarray(self.weight * (left / np.sqrt(q) + P * q))

    def by_place(self, x: Array) -> tuple[float, Array]:
        """What multipliers x (n, f), which may differ with q, bound the time by, s, whatever their Z.

        And by how much that is less in each cell than what they promise, (m,), s: `least` was too high for it. Without
        `least` they are the same at each q.
        """
        left, pull = self.at(x)
        if self.low is None:
            return self.bound(x, left, pull), np.zeros(len(self.weight))
        rows, (given, (value, jerk, linear)) = self.rows, self.common(x)
        kinds = np.split(value, [self.jerks, self.jerks + self.linears])
        cost = self.scale * np.sum(kinds[1] * np.concatenate([rows.high, -rows.low]), axis=0)
        P = given[2] + np.sum(jerk * rows.jerk[:, 0], axis=0) + np.sum(linear * rows.linear[:, 0], axis=0)
        own = np.stack([1.0 - np.sum(kinds[0], axis=0) - np.sum(kinds[2], axis=0), P, cost])
        free = ~np.any(self.near(self.held[:, :1]), axis=1)[self.cell]
        edges = np.sqrt(np.minimum(FAR * self.low, rows.top)) * np.linspace(0.0, 1.0, INTERVALS + 1)[:, None]
        edges = np.concatenate([edges, np.sqrt(rows.top)[None]])
        found, most = np.empty(len(P)), max(TOGETHER // max(len(jerk) * len(linear), 1), 1)
        for first in range(0, len(P), most):
            some = np.arange(first, min(first + most, len(P)))
            found[some] = _least(rows.at(some), given[:, some], own[:, some], free[some], edges[:, some])
        promised = self._values(left, pull).ravel() - self.weight.ravel() * (cost + np.sum(kinds[2], 0) * self.chord)
        found = self.weight.ravel() * found
        short = np.sum((promised - found).reshape(len(self.weight), -1), axis=1)
        return float(np.sum(found) - np.sum(self.at_ends * x)), short

    def common(self, x: Array) -> tuple[Array, tuple[Array, Array, Array]]:
        """g, a and b = g'' - a' (3, places) of multipliers x (n, f); their fields, and what rows have of them."""
        near = x[self.spline.first[self.cell] + np.arange(REACHING)[:, None]]
        value, slope, bend = np.einsum("dkn,knf->dfn", self.basis, near)
        (jerk, linear), (jerk_slope, linear_slope), (jerk_bend, _) = map(self._net, (value, slope, bend))
        c0, c1, c2 = self.rows.jerk.transpose(1, 0, 2)
        l1 = self.rows.linear[:, 1]
        g, a = np.sum(jerk * c2, axis=0), np.sum(jerk * c1, axis=0) + np.sum(linear * l1, axis=0)
        b = np.sum(jerk_bend * c2 - jerk_slope * c1 / 3.0 - jerk * c0, axis=0)
        b -= np.sum(linear_slope * l1 + linear * self.turning, axis=0)
        return np.stack([g, a, b]), (value, jerk, linear)

    def _net(self, values: Array) -> tuple[Array, Array]:
        """What fields (f, places) make of rows of jerk and of linear ones, (k, places): one side less the other."""
        jerks, linears, under = np.split(values, [self.jerks, self.jerks + self.linears])
        (up, down), (high, low) = np.split(jerks, 2), np.split(linears, 2)
        net = up - down
        if len(under):
            up, down = np.split(under, 2)
            net = net + up - down
        return net, self.scale * (high - low)


def _tried(*parts: Array) -> Array:
    """1 - Z, P and C of multipliers, (..., n) each, as (3, k, n); those that are none bound nothing."""
    found = np.stack(np.broadcast_arrays(*parts)).reshape(3, -1, parts[0].shape[-1])
    none = np.array([0.0, 0.0, np.inf])[:, None, None]
    return np.where(np.all(np.isfinite(found), axis=0), found, none)


@np.errstate(all="ignore")  # of multipliers that are none
def _least(rows: Rows, given: Array, own: Array, free: BoolArray, edges: Array) -> Array:
    """Find a number that 1 / sqrt(q) + b q - a q' - g q'' is nowhere below, within rows and 0 < q <= top.

    Parameters
    ----------
    rows : Rows
        At n places.
    given : (3, n) array
        g, a, b.
    own : (3, n) array
        1 - Z, P and C of multipliers that meet them.
    free : (n,) array of bool
        Whether jerk counts.
    edges : (k, n) array
        Of intervals of sqrt(q), from 0 to that of the top.

    Returns
    -------
    (n,) array
        The bound.

    Notes
    -----
    Others are of one row of jerk, which meets g, and a linear one for what is left of a, or, where jerk counts whatever
    g is, of two of jerk; each interval has its best ones.
    """
    g, a, b = given
    c0, c1, c2 = rows.jerk.transpose(1, 0, 2)[:, :, None]
    l0, l1 = rows.linear.transpose(1, 0, 2)
    y = g / c2
    z = (a - y * c1) / l1
    one = _tried(1.0 - np.abs(y), b + y * c0 + z * l0, np.maximum(z * rows.high, z * rows.low))
    first, other = np.triu_indices(len(c2), 1)
    (d0, d1, d2), (e0, e1, e2) = (rows.jerk[each].transpose(1, 0, 2) for each in (first, other))
    y, z = (np.where(free, each / (d2 * e1 - e2 * d1), np.nan) for each in (g * e1 - a * e2, a * d2 - g * d1))
    two = _tried(1.0 - np.abs(y) - np.abs(z), b + y * d0 + z * e0, np.zeros_like(y))
    A, P, C = np.concatenate([own[:, None], one, two], axis=1)
    inner = np.where((A > 0.0) & (P > 0.0), np.cbrt((0.5 * A / P) ** 2), np.inf)  # where the least value is
    low = np.where(A == 0.0, 0.0, A * np.inf)
    found = np.full(len(g), np.inf)
    for begin, end in itertools.pairwise(edges):
        high = A / end + P * end**2
        value = np.minimum(low, high)
        inside = (inner > begin**2) & (inner < end**2)
        value = np.where(inside, A / np.sqrt(inner) + P * inner, value)
        found = np.minimum(found, np.max(value - C, axis=0))
        low = high
    return found

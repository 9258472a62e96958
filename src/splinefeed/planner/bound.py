"""A lower bound of the time of every motion within the limits: the dual of the planner's problem, by an interior point.

A row of the limits belongs to a coordinate r(s): c0 = r''', c1 = 3/2 r'', c2 = r'/2 over its limit for jerk, c0 = r'',
c1 = r'/2 for acceleration. Take a function x(s) >= 0, C1, for each side of a row; Z(s) <= 1 sums up those of jerk.
Rows are at most 0: added to the time with these weights they make it no longer. Integrated by parts r''' drops out, and
so do the derivatives of q (of a torque x (c0 - c1') - x' c1 is left):

    T >= int min_{0 < q <= top} [(1 - Z) / sqrt(q) + P q] ds - int sum (x bound) ds + what ends in motion add
    P = sum +- (x'' r' - x' r'') / 2 of jerk + sum +- (x r'' - x' r') / 2 of acceleration

(Boyd and Vandenberghe, *Convex Optimization*, section 5.1.) This is so for every motion, not only for those on some
cells. Here x are cubic splines of coefficients that are not negative, which keep Z <= 1 if their sums do. The best ones
are the multipliers of a convex problem: q at the places of the integral, rows tested with splines, sum of
w_i B_i (row)_i <= 0, and one pace p for 1 / sqrt(q) (section 11.7 there).

Z <= 1 is what it costs that the limit of jerk is not convex: it is the bound of motions that may exceed this limit
where they spend |j| / J of time a millimetre. So `top` is also what the rows of a place leave q at all, see `feasible`,
where the bound is looked for again. What is left to rounding is the integral: the difference that halved cells make to
it is taken off.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from scipy.linalg import lapack

from splinefeed.planner.conditions import INSIDE, Conditions
from splinefeed.planner.constants import SAME
from splinefeed.planner.rows import Rows
from splinefeed.planner.solve import FAR, NEAR, RIDGES, STEPS, Problem, Solution
from splinefeed.planner.spline import DEGREE, Spline
from splinefeed.records import Array, BoolArray, IntArray

#: Gauss and Legendre's places and weights on [0, 1].
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS, WEIGHTS = 0.5 * (_PLACES + 1.0), 0.5 * _WEIGHTS
#: Coefficients that reach into a cell.
REACHING = DEGREE + 1
#: While the bound is below this share of the time it is looked for again, so many times in all, as long as that is
#: worth a share: on cells half as long, first everywhere and then where jerk binds.
CLOSE, TIMES, WORTH = 0.995, 5, 1e-4
#: Jerk binds where its multipliers sum up to more than this.
NEARLY = 0.5
#: A multiplier that begins below this, and those whose splines overlap it, too, stays 0: its row does not bind there.
BINDING = 1e-3
#: Newton steps to the largest q that rows of a place leave: from above, so that any number of them will do.
FEASIBLE = 3


def rows_of(conditions: Conditions, s: Array) -> Rows:
    """The smooth rows at places (n,), mm; of two limits of jerk along the path the larger.

    Between setpoints the largest q counts that any place within a step allows: a step may lie beside the sharpest one.
    """
    limits = conditions.limits
    slowing = np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk
    way = 1.0 if limits.jerk >= slowing else -1.0
    rows = conditions.rows(s, rising=way, alone=True, smooth=True)
    step = (conditions.period or 0.0) * float(np.max(rows.own)) ** 0.5
    around = np.stack([np.searchsorted(s, s - step), np.searchsorted(s, s + step, side="right")], axis=1)
    between = np.maximum.reduceat(np.append(rows.between, 0.0), around.ravel())[::2]
    return dataclasses.replace(rows, top=np.minimum(rows.own, between))


@np.errstate(all="ignore")  # of rows that bound nothing
def feasible(rows: Rows, jerk: BoolArray) -> Array:
    """The largest q (n,), mm^2/s^2, that leaves any q' and q'' to rows; jerk (n,) whether rows of jerk count.

    Two rows of jerk, one times c2 of the other, make one without q'', of at most (|c2| + |c2|) / sqrt(q); a linear row
    takes q' out of it. What is left is e q <= room / sqrt(q) + most.
    """
    first, other = np.triu_indices(len(rows.jerk), 1)
    (a0, a1, a2), (b0, b1, b2) = (rows.jerk[each].transpose(1, 0, 2) for each in (first, other))
    without, slope, room = a0 * b2 - b0 * a2, a1 * b2 - b1 * a2, np.abs(a2) + np.abs(b2)
    found = rows.top
    for (c0, c1), low, high in zip(rows.linear, rows.low, rows.high, strict=True):
        e = without - slope / c1 * c0
        part = np.sign(e) * slope / c1
        e, most = np.abs(e), np.maximum(-part * low, -part * high)
        v = np.cbrt(room / e) + np.sqrt(most / e)  # no less than sqrt(q)
        for _ in range(FEASIBLE):
            v = (2.0 * e * v**3 + room) / (3.0 * e * v**2 - most)
        found = np.fmin(found, np.fmin.reduce(np.where(jerk, v * v, np.inf), axis=0, initial=np.inf))
    return found


class Dual:
    """Test the rows of a stretch with the splines on nodes (m + 1,), at Gauss's places in `parts` of each cell.

    Attributes
    ----------
    fields : (f,) array
        Rows of jerk up and down, then linear ones high and low; the first `jerks` are of jerk.
    pull : (m, 4 f, g) array
        What a coefficient adds to P at the places of a cell.
    value : (m, 4, g) array
        The splines there.
    top, weight : (m, g) array
        Of the places; `within` says whether `feasible` counts for the first.
    fixed, held : (n, f) array
        Bounds of the tested rows, ends in motion included; those kept at 0.
    """

    def __init__(
        self,
        conditions: Conditions,
        nodes: Array,
        ends: tuple[tuple[float, float], ...],
        scale: float,
        parts: int,
        *,
        within: bool = False,
    ) -> None:
        """Ends have q and q', mm^2/s^2 and mm/s^2; scale, s/mm, is the unit of linear rows' multipliers."""
        self.spline = Spline.on(nodes, np.zeros(len(nodes), dtype=bool))
        h, m = np.diff(nodes), len(nodes) - 1
        share = ((np.arange(parts)[:, None] + GAUSS) / parts).ravel()
        cell, self.x = np.repeat(np.arange(m), len(share)), (nodes[:-1, None] + h[:, None] * share).ravel()
        self.weight = h[:, None] * np.tile(WEIGHTS / parts, parts)
        at_ends = np.array([nodes[0] + INSIDE * h[0], nodes[-1] - INSIDE * h[-1]])
        rows, outer = (rows_of(conditions, x) for x in (self.x, at_ends))
        self.jerks, self.linears = 2 * len(rows.jerk), 2 * len(rows.linear)
        self.fields = self.jerks + self.linears
        value, slope, bend = self.spline.basis(cell, self.x - nodes[cell])
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
        self.fixed = np.zeros((self.spline.size, self.fields))
        bounds = scale * np.concatenate([rows.high, -rows.low])
        cost = self._by_cell(value * bounds[:, None])
        self.fixed[:, self.jerks :] = self.spread(np.einsum("mkg,mg->mk", cost, self.weight))
        for k, (q, dq) in enumerate(ends):
            value, slope, _ = self.spline.basis(np.array([k * (m - 1)]), nodes[[-k]] - nodes[[k * (m - 1)]])[:, :, 0]
            _, c1, c2 = outer.jerk[:, :, k].T[:, :, None]
            jerk = (c1 * q / 1.5 + c2 * dq) * value - c2 * q * slope
            linear = scale * outer.linear[:, 1, k, None] * q * value
            given = np.concatenate([jerk, -jerk, linear, -linear]).T
            self.fixed[k * (m - 1) : k * (m - 1) + REACHING] += -given if k else given
        self.held = self._held(conditions, nodes, float(np.max(rows.top)))
        if within:
            free = ~np.any(self.near(self.held[:, :1]), axis=1)[cell]
            rows = dataclasses.replace(rows, top=feasible(rows, free))
        self.top = rows.top.reshape(m, -1)

    def _by_cell(self, rows: Array) -> Array:
        """(f, 4, places) as (m, 4 f, g)."""
        f, k, n = rows.shape
        m = len(self.spline.nodes) - 1
        return np.ascontiguousarray(rows.reshape(f, k, m, n // m).transpose(2, 1, 0, 3)).reshape(m, k * f, n // m)

    def _held(self, conditions: Conditions, nodes: Array, top: float) -> BoolArray:
        """Coefficients (n, f) that reach to where r' jumps, or for jerk r'' next to it: there are no such rows."""
        inside = (conditions.breaks > nodes[0]) & (conditions.breaks < nodes[-1])
        turned, bent = conditions.real_jumps
        turned = turned | np.isin(conditions.breaks, conditions.passed[0])
        t, held = self.spline.t, np.zeros((self.spline.size, self.fields), dtype=bool)
        reach = (conditions.period or 0.0) * top**0.5
        for jumps, fields in ((bent | turned, slice(self.jerks)), (turned, slice(self.jerks, None))):
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

    def bound(self, x: Array) -> float:
        """What multipliers x (n, f) of Z <= 1 bound the time by, s."""
        left, P = self.at(x)
        q, free = self.top.copy(), P > 0.0
        q[free] = np.minimum(np.cbrt((0.5 * left[free] / P[free]) ** 2), q[free])
        return float(np.sum(self.weight * (left / np.sqrt(q) + P * q)) - np.sum(self.fixed * x))


def lower_bound(
    conditions: Conditions, problem: Problem, solution: Solution, low: float, high: float, gap: float
) -> float:
    """Find a lower bound of the time from a solution.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    problem : Problem
        Between the ends.
    solution : Solution
        Of it.
    low, high : float
        The ends, mm.
    gap : float
        Share of the best that multipliers on its cells can give, within which it is.

    Returns
    -------
    float
        s.
    """
    inner, ends = problem.spline.nodes, problem.ends
    ramp = 0.5 ** np.arange(1.0, DEGREE + 1.0)  # cells on a ramp, as many as splines overlap
    up, down = low + (inner[0] - low) * ramp, high - (high - inner[-1]) * ramp
    nodes = np.unique(np.concatenate([[low], up, inner, down, [high]]))
    states, found = tuple((end.q, end.slope) for end in ends), 0.0
    scale = solution.time / (high - low)
    at, x = _first(problem, solution, scale)

    def planned(places: Array) -> Array:
        """q of the solution, (n,)."""
        q = problem.spline.at(solution.c, np.clip(places, inner[0], inner[-1]))[0]
        for end, away in zip(ends, (places - low, high - places), strict=True):
            if end.rest:
                q *= np.minimum(away / end.ramp, 1.0) ** (4.0 / 3.0)
        return np.asarray(np.maximum(q, SAME * np.max(q)))

    for k in range(TIMES):
        dual, close = (Dual(conditions, nodes, states, scale, parts, within=k > 0) for parts in (1, 2))
        q, here = planned(dual.x).reshape(dual.top.shape), dual.spline.greville()
        begin = np.array([np.interp(here, at, each) for each in x.T]).reshape(-1, len(here)).T
        at, x = here, _best(dual, q, begin, gap)
        before, closer = found, close.bound(x)
        found = float(np.fmax(found, closer - abs(closer - dual.bound(x))))
        time = float(np.sum(dual.weight / np.sqrt(q)))
        if found > CLOSE * time or (k and found - before < WORTH * time):
            break
        binding = np.sum(x[:, : dual.jerks], axis=1, keepdims=True) > NEARLY
        halved = np.any(dual.near(binding), axis=1) if k else slice(None)
        nodes = np.sort(np.append(nodes, (0.5 * (nodes[1:] + nodes[:-1]))[halved]))
    return found


def _first(problem: Problem, solution: Solution, scale: float) -> tuple[Array, Array]:
    """Middles of cells (n,), mm, and multipliers (n, f): those of a solution, less weight, as means over the cells."""
    rows, nodes, cell, columns = problem.rows, problem.spline.nodes, problem.cell, []
    total = np.bincount(cell, problem.weight)
    linear, jerk = problem.kinds
    for (up, down, *_), many, unit in ((jerk, rows.jerks, 1.0), (linear, rows.smooth, scale)):
        for part in (up, down):
            columns += [np.bincount(cell, each) / (unit * total) for each in solution.z[part][:many]]
    return 0.5 * (nodes[1:] + nodes[:-1]), np.array(columns).reshape(-1, len(total)).T


def _best(dual: Dual, q: Array, x: Array, gap: float) -> Array:
    """Multipliers (n, f) whose bound is nearly the best, from q (m, g) at the places and multipliers to begin with.

    They are those of the least sum of p (n,) under tested rows C(q) + y = fixed, and + p for jerk, under
    R(1 / sqrt(q)) + w = p and q + t = top, with slacks y, w, t, multipliers x, u = 1 - Z, v, and their products at mu.
    A step solves for dx: dq, dy, dw and dv follow from it.
    """
    f, weight, top = dual.fields, dual.weight, dual.top
    free = x > BINDING
    for _ in range(DEGREE):
        free[1:] |= free[:-1]
        free[:-1] |= free[1:]
    free &= ~dual.held
    number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    (one, other, at), (coupled, _, at_node) = _pairs(dual.near(number)), _pairs(number[:, : dual.jerks])
    at = np.concatenate([at, at_node], axis=1)
    of_jerk = (np.arange(f) < dual.jerks).astype(np.float64)
    q = (1.0 - NEAR) * np.minimum(q, top)
    x = np.where(free, np.maximum(x, FAR / f), 0.0)
    x[:, : dual.jerks] *= np.minimum(1.0, (1.0 - FAR) / np.maximum(np.sum(x[:, : dual.jerks], axis=1), FAR))[:, None]
    u = 1.0 - np.sum(x[:, : dual.jerks], axis=1)
    count = int(np.sum(free)) + len(x) + q.size
    mu = FAR * float(np.sum(weight / np.sqrt(q))) / count
    v, w = mu / (weight * (top - q)), mu / u
    C, R = dual.tested(q)
    y = np.maximum(dual.fixed + (R + w)[:, None] * of_jerk - C, mu / np.where(free, x, 1.0))[free]
    best = np.zeros_like(x)
    most = dual.bound(best)
    for _ in range(STEPS if np.any(free) else 0):
        r, t, z = q**-0.5, top - q, x[free]
        left, P = dual.at(x)
        found = dual.bound(x)
        best, most = (x, found) if found > most else (best, most)
        if np.sum(z * y) + np.sum(u * w) + np.sum(weight * v * t) < gap * most:
            break
        r3 = r * r * r
        stiff = 0.75 * left * r3 * r * r + v / t
        rest = 0.5 * left * r3 - P - mu / (weight * t)
        pull = dual.pull.copy()
        pull.reshape(len(q), REACHING, f, -1)[:, :, : dual.jerks] += 0.5 * (dual.value * r3[:, None])[:, :, None]
        C, R = dual.tested(q)
        push = dual.spread(np.einsum("mkg,mg->mk", pull, weight * rest / stiff)) + C - dual.fixed
        push -= np.outer(mu / u + R, of_jerk)
        scaled = (pull * np.sqrt(weight / stiff)[:, None]).reshape(-1, q.shape[1])
        by_pair = np.einsum("pg,pg->p", scaled.take(one, axis=0), scaled.take(other, axis=0))
        dz = _solved(np.concatenate([by_pair, np.repeat(w / u, dual.jerks)[coupled]]), at, y / z, push[free] + mu / z)
        if dz is None:
            break
        dx = np.zeros_like(x)
        dx[free] = dz
        du = -np.sum(dx[:, : dual.jerks], axis=1)
        dq = (rest - np.einsum("mkg,mk->mg", pull, dual.near(dx))) / stiff
        dy, dw = mu / z - y - y / z * dz, mu / u - w - w / u * du
        dv = (mu / weight - v * t + v * dq) / t
        along, along_x = _longest(-dy / y, -dw / w, dq / t, -dq / q), _longest(-dz / z, -du / u, -dv / v)
        q, y, w = q + along * dq, y + along * dy, w + along * dw
        x, v = x + along_x * dx, v + along_x * dv
        u = 1.0 - np.sum(x[:, : dual.jerks], axis=1)
        mu = (
            max(FAR, 1.0 - min(along, along_x))
            * float(np.sum(x[free] * y) + np.sum(u * w) + np.sum(weight * v * (top - q)))
            / count
        )
    return best


def _pairs(number: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Places (p,), row by row, and numbers (2, p) of pairs of numbers in each row of (m, k), increasing; -1 is none."""
    one, other = np.triu_indices(number.shape[1])
    row, pair = np.nonzero((number >= 0)[:, one] & (number >= 0)[:, other])
    place, columns = row * number.shape[1], np.stack([one[pair], other[pair]])
    return place + columns[0], place + columns[1], number[row, columns]


def _longest(*shares: Array) -> float:
    """The longest step, at most 1, that leaves NEAR: shares are of what is left."""
    return min(1.0, (1.0 - NEAR) / max(*(float(np.max(each)) for each in shares), 1e-300))


def _solved(pairs: Array, at: IntArray, diagonal: Array, push: Array) -> Array | None:
    """The step under a band matrix of pairs (p,) at (2, p), added up, and a diagonal; None if rounding spoils it."""
    n, width = len(push), int(np.max(at[1] - at[0])) + 1
    band = np.bincount((at[1] - at[0]) * n + at[0], pairs, width * n).reshape(width, n)
    diagonal = band[0] + diagonal
    for more in RIDGES:
        band[0] = diagonal * (1.0 + more)
        _, step, info = lapack.dpbsv(band, push, lower=1)
        if info == 0:
            return np.asarray(step)
    return None

"""The optimiser: the least integral of ds / sqrt(q) under rows, by a primal-dual interior point on a band matrix.

Nocedal and Wright, Numerical Optimization, 2nd ed., chapter 19: rows g <= 0 with slacks s and multipliers z, and Newton
steps on

    grad f + sum z grad g = 0        g + s = 0        z s = mu.

All rows are rows on y = (q, q', q'') at a place, so that derivatives are put together there, in 3 x 3, and carried to
the four coefficients of the cell once. One term keeps the problem from being convex, the bound 1 / sqrt(q) of jerk: its
curvature takes away from that of the time, 3/4 (weight - sum z) / sqrt(q)^5, and counts as far as that is positive.
Where q falls to nothing the slack of that bound grows without end, so that many places close together draw the motion
to a standstill there while mu is large: -mu/2 log q for each row of jerk takes that away. So s counts as a share of
the bound, and it is gone when mu is.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import lapack

from splinefeed.errors import PlanError
from splinefeed.planner.constants import ALMOST, HALVINGS, SAME
from splinefeed.planner.rows import FREE, Rows
from splinefeed.planner.spline import DEGREE, Spline
from splinefeed.records import Array, BoolArray, IntArray

#: Rows and columns of the upper triangle of the 4 x 4 matrix of a cell, and of the 3 x 3 matrix of a place.
UPPER, UPPER_3 = np.triu_indices(DEGREE + 1), np.triu_indices(DEGREE)
#: Most Newton steps: a motion whose jerk binds along a ramp takes hundreds.
STEPS = 320
#: Shares of the diagonal that are added to it until rounding leaves the matrix positive.
RIDGES = (0.0, SAME, ALMOST, 1e-6)
#: Complementarity to begin with, as a share of the time, from a guess and from multipliers. Aimed at is at least the
#: first as a share of that of now, or what a short step left of its way. The second is the slack, too, of a row that is
#: over its limit then, as a share of the limit, and what a step leaves of slacks, multipliers and q.
FAR, NEAR = 0.1, 0.02
#: ... and at least this share of what the last step gained: while the time still falls fast, steps jam at rows that a
#: small complementarity lets come close.
GAINED = 0.3


@dataclass(frozen=True)
class End:
    """One end of a window: q and q' there, or rest, behind a ramp of this length, mm, on which q goes with s^(4/3).

    With `at_most` both q and q' may be any one share of what they are, up to 1.
    """

    ramp: float = 0.0
    q: float = 0.0
    slope: float = 0.0
    at_most: bool = False

    @property
    def rest(self) -> bool:
        """Whether the motion begins or ends at rest here."""
        return self.ramp > 0.0

    def steepness(self, side: float) -> float:
        """q' / q inwards, 1/mm (`side` 1 at the start)."""
        return 4.0 / 3.0 / self.ramp if self.rest else side * self.slope / self.q

    def way(self, side: float) -> float:
        """Over half of this way, mm, q would vanish with the slope it has here, inwards (`side` 1 at the start)."""
        return 0.5 * self.q / (-side * self.slope) if side * self.slope < 0.0 else np.inf


@dataclass(frozen=True, eq=False)
class Solution:
    """What was found.

    Parameters
    ----------
    c : (m,) array
        Coefficients of q.
    time : float
        Of the motion, s.
    z : (rows, n) array
        Multipliers to go on from.
    kept : bool
        Whether every row holds.
    """

    c: Array
    time: float
    z: Array
    kept: bool


class Problem:
    """Places, the splines that reach them, and their rows.

    Parameters
    ----------
    spline : Spline
        The splines.
    cell : (n,) array of int
        Cell of each place.
    x : (n,) array
        Where it is, mm.
    weight : (n,) array
        Its weight in the time, the sum of weight / sqrt(q).
    rows : Rows
        At the places.
    ends : (End, End)
        How the motion is at both ends.
    """

    def __init__(
        self, spline: Spline, cell: IntArray, x: Array, weight: Array, rows: Rows, ends: tuple[End, End]
    ) -> None:
        self.spline, self.cell, self.weight, self.ends = spline, cell, weight, ends
        self.basis = spline.basis(cell, x - spline.nodes[cell])
        self.size, self.first = spline.size, spline.first[cell]
        self.gather = self.first + np.arange(DEGREE + 1)[:, None]
        self.offset = np.zeros((3, len(x)))
        self.given = np.full(self.size, np.nan)  # coefficients that a state gives
        self.ties: dict[int, float] = {}  # coefficients that follow their neighbour
        for end, side in zip(ends, (1, -1), strict=True):
            self._hold(end, side)
        self.free = np.isnan(self.given)
        self.free[list(self.ties)] = False
        self._carry()
        self.hold(rows)

    def _carry(self) -> None:
        """What carries the second derivatives by y at places to those by the coefficients of their cells."""
        a, b = UPPER
        self.carry = np.empty((len(a), len(UPPER_3[0]), len(self.first)))
        for k, (i, j) in enumerate(zip(*UPPER_3, strict=True)):
            half = self.basis[i][a] * self.basis[j][b]
            self.carry[:, k] = half if i == j else half + self.basis[j][a] * self.basis[i][b]

    def part(self, active: BoolArray, c: Array) -> tuple[Problem, IntArray, IntArray]:
        """The problem of the cells of `active` alone, all else held at c; which coefficients and places it has."""
        inside = active[self.cell]
        at = np.flatnonzero(inside)
        used = np.unique(self.gather[:, at])
        outside = ~self.free
        outside[self.gather[:, ~inside]] = True
        part = copy(self)
        part.size, part.free, part.ties = len(used), ~outside[used], {}
        part.given = np.where(part.free, np.nan, c[used])
        part.cell, part.weight = self.cell[at], self.weight[at]
        part.first = np.searchsorted(used, self.first[at])
        part.gather = part.first + np.arange(DEGREE + 1)[:, None]
        held = np.nan_to_num(part.given)[part.gather]
        part.offset = self.offset[:, at] + np.einsum("dkn,kn->dn", self.basis[:, :, at], held)
        part.basis = self.basis[:, :, at] * part.free[part.gather]
        part._carry()
        part.hold(self.rows.at(at))
        return part, used, at

    def _hold(self, end: End, side: int) -> None:
        """Take the coefficients that an end decides out of the basis: one by q' / q, or both by q and q'."""
        t, n = self.spline.t, self.spline.size
        outer, inner, step = (0, 1, (t[4] - t[1]) / DEGREE) if side > 0 else (n - 1, n - 2, (t[-2] - t[-5]) / DEGREE)
        if end.rest or end.at_most:
            tie = 1.0 / (1.0 + step * end.steepness(side))
            self.ties[outer] = tie
            k, at = np.nonzero(self.gather == outer)
            self.basis[:, k + side, at] += tie * self.basis[:, k, at]
            self.basis[:, k, at] = 0.0
            return
        for index, value in ((outer, end.q), (inner, end.q + side * end.slope * step)):
            k, at = np.nonzero(self.gather == index)
            self.given[index] = value
            self.offset[:, at] += value * self.basis[:, k, at]
            self.basis[:, k, at] = 0.0

    def hold(self, rows: Rows) -> None:
        """From now on these rows."""
        self.rows = rows
        linear, jerk = rows.linear, rows.jerk
        self.count = (1 + 2 * len(linear) + 2 * len(jerk)) * linear.shape[2]
        sizes = np.cumsum([1, len(linear), len(linear), len(jerk), len(jerk)])
        high, low, up, down = (slice(int(a), int(b)) for a, b in pairwise(sizes))  # behind the top
        squares = jerk[:, 1] ** 2, jerk[:, 1] * jerk[:, 2], jerk[:, 2] ** 2
        self.jerks = up, down
        self.kinds = (  # of linear rows and of those of jerk: which they are, what goes with q' and q'', its products
            (high, low, linear[:, 1:], linear[:, 1:] ** 2),
            (up, down, jerk[:, 1:], np.stack(squares, axis=1)),
        )

    def complete(self, c: Array) -> Array:
        """Coefficients with those that the ends decide."""
        c = np.where(np.isnan(self.given), c, self.given)
        for index, tie in self.ties.items():
            c[index] = tie * c[1 if index == 0 else index - 1]
        return c

    def look(self, c: Array) -> tuple[Array, Array, Array]:
        """y (3, n), 1 / sqrt(q) (n,) and g (rows, n), of which nothing may be above 0; empty where q is not > 0."""
        y: Array = np.einsum("dkn,kn->dn", self.basis, c[self.gather]) + self.offset
        q = y[0]
        if not np.min(q) > 0.0:
            return y, q, np.empty(0)
        root = np.sqrt(q)
        r = 1.0 / root
        rows = self.rows
        a = np.einsum("mdn,dn->mn", rows.linear, y[:2])
        rise, fall = (a, -a) if rows.root is None else (a + rows.root[0] * root, rows.root[1] * root - a)
        j = np.einsum("mdn,dn->mn", rows.jerk, y)
        (up, up_root), (down, down_root) = rows.jump
        over = (j - r + up + up_root * root, -j - r + down + down_root * root)
        return y, r, np.concatenate([(q / rows.top - 1.0)[None], rise - rows.high, rows.low + fall, *over])

    def newton(self, y: Array, r: Array, z: Array, s: Array, push: Array, mu: float) -> Array | None:
        """The Newton step in the coefficients, (m,), towards z s = mu, s; None if there is none.

        push (rows, n) = (mu + z (g + s)) / s
        """
        w, stiff, (up, down) = self.weight, z / s, self.jerks
        r3 = r * r * r
        grad, hess = np.zeros((3, len(r))), np.zeros((6, len(r)))
        grad[0] += -0.5 * w * r3 + push[0] / self.rows.top
        bent = np.maximum(w - np.sum(z[up] + z[down], axis=0), 0.0)
        hess[0] = 0.75 * bent * r3 * r * r + stiff[0] / self.rows.top**2
        level = mu * len(self.rows.jerk) * r * r  # of the term -mu/2 log q of each row of jerk
        grad[0] -= level
        hess[0] += level * r * r
        for (one, other, more, pairs), (rise, fall) in zip(self.kinds, self.slopes(r), strict=True):
            above, below = stiff[one] * rise, stiff[other] * fall
            grad[0] += np.sum(push[one] * rise - push[other] * fall, axis=0)
            grad[1 : 1 + more.shape[1]] += np.einsum("mn,mdn->dn", push[one] - push[other], more)
            hess[0] += np.sum(above * rise + below * fall, axis=0)
            hess[1 : 1 + more.shape[1]] += np.einsum("mn,mdn->dn", above + below, more)
            hess[3 : 3 + pairs.shape[1]] += np.einsum("mn,mdn->dn", stiff[one] + stiff[other], pairs)
        local = np.einsum("abn,bn->an", self.carry, hess)
        slope = np.einsum("dkn,dn->kn", self.basis, grad)
        m = self.size
        band, total = np.zeros((DEGREE + 1, m)), np.zeros(m)
        for a in range(DEGREE + 1):
            total += np.bincount(self.first + a, slope[a], m)
        for k, (a, b) in enumerate(np.transpose(UPPER).tolist()):
            band[b - a] += np.bincount(self.first + a, local[k], m)
        band[0, ~self.free] = 1.0
        total[~self.free] = 0.0
        diagonal = band[0].copy()
        for ridge in RIDGES:
            band[0] = diagonal * (1.0 + ridge)
            _, step, info = lapack.dpbsv(band, -total, lower=1)
            if info == 0:
                return np.asarray(step)
        return None

    def slopes(self, r: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """The factors of dq in linear rows (m, n) and in those of jerk (k, n), at 1 / sqrt(q) (n,).

        Of both upwards and, negative, downwards.
        """
        rows = self.rows
        linear, jerk = rows.linear[:, 0], rows.jerk[:, 0]
        jump = 0.5 * r * (rows.jump[:, 1] + r * r)
        by_jerk = jerk + jump[0], jerk - jump[1]
        if rows.root is None:
            return (linear, linear), by_jerk
        root = 0.5 * r * rows.root
        return (linear + root[0], linear - root[1]), by_jerk

    def change(self, y: Array, r: Array, dc: Array) -> tuple[Array, Array]:
        """What a step in the coefficients does to q (n,) and, to first order, to g (rows, n)."""
        dy = np.einsum("dkn,kn->dn", self.basis, dc[self.gather])
        dg = [(dy[0] / self.rows.top)[None]]
        for (_, _, more, _), (rise, fall) in zip(self.kinds, self.slopes(r), strict=True):
            rest = np.einsum("mdn,dn->mn", more, dy[1 : 1 + more.shape[1]])
            dg += [rest + rise * dy[0], -rest - fall * dy[0]]
        return dy[0], np.concatenate(dg)

    def time(self, r: Array) -> float:
        """Sum of weight / sqrt(q), s."""
        return float(np.sum(self.weight * r))


def solve(problem: Problem, c: Array, gap: float, z: Array | None = None) -> Solution:
    """Find coefficients of a time within a share of the least.

    Parameters
    ----------
    problem : Problem
        Places and rows.
    c : (m,) array
        Coefficients to begin with, q > 0.
    gap : float
        The share.
    z : (rows, n) array, optional
        Multipliers to go on from.

    Returns
    -------
    Solution
        What was found.

    Notes
    -----
    A row that is over its limit has a slack of its own until it is not; one that is not stays so. So every solution
    keeps every row unless one could not be kept at all, and steps may end anywhere.
    """
    c = problem.complete(c)
    y, r, g = problem.look(c)
    if not len(g):
        raise PlanError("no feed above 0 everywhere was found: a limit leaves almost none")
    time = problem.time(r)
    s = np.maximum(-g, NEAR if z is None else NEAR**2)
    mu = (FAR if z is None else NEAR) * time / problem.count
    z = mu / s if z is None else np.clip(z, 0.1 * mu / s, 10.0 * mu / s)
    before, fall = time, np.inf
    for _ in range(STEPS):
        residual = g + s
        dc = problem.newton(y, r, z, s, (mu + z * residual) / s, mu)
        if dc is None:
            break
        dq, dg = problem.change(y, r, dc)
        ds = -residual - dg
        dz = (mu - z * s - z * ds) / s
        along = _longest(ds / s, 1.0 - NEAR, min(1.0, (1.0 - FAR) / max(float(np.max(-dq / y[0])), 1e-300)))
        along_z = _longest(dz / z, 1.0 - NEAR, 1.0)
        held = residual <= 0.0
        for _ in range(HALVINGS):
            new = c + along * dc
            y_new, r_new, g_new = problem.look(new)
            if len(g_new) and np.all((g_new <= -0.5 * NEAR * s) | ~held):
                break
            along *= 0.6
        else:
            break
        s = np.where(held, -g_new, np.maximum(s + along * ds, -g_new))
        c, y, r, g = new, y_new, r_new, g_new
        fell, time = fall, problem.time(r)
        fall, before = before - time, time
        z = z + along_z * dz
        complementary = float(np.sum(z * s))
        if not complementary < FREE * time:  # rows that contradict each other
            break
        least = min(along, along_z)
        # what is left of a fall that shrinks by fall / fell from step to step is fall^2 / (fell - fall)
        settled = least > 0.5 and fall * abs(fall) <= gap * time * (fell - fall)
        if settled and np.max(g) < 0.0 and complementary < gap * time:
            break
        mu = max(max(FAR, 1.0 - least) * complementary, GAINED * fall, 0.1 * gap * time) / problem.count
    return Solution(problem.complete(c), time, z, bool(np.max(g) < 0.0))


def _longest(ratio: Array, kept: float, most: float) -> float:
    """The longest step, at most `most`, that takes no more than the share `kept`: ratio is change / value."""
    return min(most, kept / max(float(np.max(-ratio)), 1e-300))

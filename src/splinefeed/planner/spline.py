"""q(s) = feed^2 as a cubic spline: four coefficients reach into each cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.records import Array, BoolArray, IntArray

DEGREE = 3


@dataclass(frozen=True, eq=False)
class Spline:
    """Cubic B-splines on the cells between nodes (n + 1,), mm; C2, but C1 at nodes where the path itself jumps.

    Parameters
    ----------
    nodes : (n + 1,) array
        mm.
    t : (m,) array
        Knots: the end nodes four times, the nodes of `jumps` twice.
    first : (n,) array of int
        Index of the first of the four coefficients that reach into each cell.
    slope_jumps : (n + 1,) array
        1/mm: by what share of q its slope jumps at nodes, 0 at both ends.

    Notes
    -----
    Where r'' jumps q' may jump, too, by a share of q: there they are multiplied by exp(u), where u is 0 at nodes and
    has slopes of half that share away from this one, at x, mm, in a cell of h, mm,

        u = share/2 x (1 - x/h)^2
    """

    nodes: Array
    t: Array
    first: IntArray
    slope_jumps: Array

    @classmethod
    def on(cls, nodes: Array, jumps: BoolArray, slope_jumps: Array | None = None) -> Spline:
        """The splines on nodes (n + 1,), with a double knot at the inner ones of `jumps` (n + 1,)."""
        times = np.where(jumps, 2, 1)
        times[[0, -1]] = DEGREE + 1
        t = np.repeat(nodes, times)
        slope_jumps = np.zeros(len(nodes)) if slope_jumps is None else slope_jumps
        return cls(nodes, t, np.cumsum(times)[:-1] - 1 - DEGREE, slope_jumps)

    @property
    def size(self) -> int:
        """How many coefficients there are."""
        return len(self.t) - DEGREE - 1

    def basis(self, cell: IntArray, x: Array) -> Array:
        """Values, first and second derivatives (3, 4, n) of the four splines that reach into cells (n,).

        At places x (n,), mm, from where the cells begin: far along a path that is finer than arc length itself.
        Cox and de Boor's recurrence and its derivative; The NURBS Book, eqs. (2.5) and (2.7).
        """
        t, span = self.t, self.first[cell] + DEGREE
        around = {k: t[span + k] - self.nodes[cell] for k in range(1 - DEGREE, DEGREE + 1)}
        levels = [[np.ones(len(x))]]
        for p in range(1, DEGREE + 1):
            new = [np.zeros(len(x)) for _ in range(p + 1)]
            for j in range(p):
                a, b = around[1 + j - p], around[1 + j]
                w = levels[-1][j] / (b - a)
                new[j] += w * (b - x)
                new[j + 1] += w * (x - a)
            levels.append(new)

        def derived(lower: list[Array], p: int) -> list[Array]:
            out = [np.zeros(len(x)) for _ in range(p + 1)]
            for j in range(p):
                w = p * lower[j] / (around[1 + j] - around[1 + j - p])
                out[j] -= w
                out[j + 1] += w
            return out

        return self._bent(np.array([levels[3], derived(levels[2], 3), derived(derived(levels[1], 2), 3)]), cell, x)

    def _bent(self, basis: Array, cell: IntArray, x: Array) -> Array:
        """A basis (3, 4, n) times exp(u), with its derivatives."""
        some = np.flatnonzero((self.slope_jumps[cell] != 0.0) | (self.slope_jumps[cell + 1] != 0.0))
        if not len(some):
            return basis
        cell, u = cell[some], np.zeros((3, len(some)))
        h = self.nodes[cell + 1] - self.nodes[cell]
        for node, way, away in ((cell, 1.0, x[some]), (cell + 1, -1.0, h - x[some])):
            half, t = 0.5 * self.slope_jumps[node], away / h
            u += half * np.stack([t * (1.0 - t) ** 2 * h, way * (1.0 - t) * (1.0 - 3.0 * t), (6.0 * t - 4.0) / h])
        value, slope, bend = basis[:, :, some]
        bent = [value, slope + u[1] * value, bend + 2.0 * u[1] * slope + (u[2] + u[1] ** 2) * value]
        basis[:, :, some] = np.exp(u[0]) * np.array(bent)
        return basis

    def greville(self) -> Array:
        """Where each coefficient acts, (size,), mm."""
        t = self.t
        found: Array = (t[1:-3] + t[2:-2] + t[3:-1]) / 3.0
        return found

    def of(self, other: Spline, coefficients: Array) -> Array:
        """Coefficients (size,) of another spline, as it is where its nodes are among these, but for jumps of q'.

        c = q + q' (a + b) / 3 + q'' a b / 6 at the middle one of three knots, a and b the way to the other two: de Boor
        and Fix (1973), doi:10.1016/0021-9045(73)90080-9.
        """
        before, here, behind = self.t[1:-3], self.t[2:-2], self.t[3:-1]
        q, slope, bend = other.at(coefficients, here)
        a, b = before - here, behind - here
        found: Array = q + slope * (a + b) / 3.0 + bend * a * b / 6.0
        return found

    def at(self, coefficients: Array, x: Array) -> Array:
        """q, q', q'' (3, n) at x (n,), mm."""
        cell = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.first) - 1)
        return self.combine(self.basis(cell, x - self.nodes[cell]), cell, coefficients)

    def combine(self, basis: Array, cell: IntArray, coefficients: Array) -> Array:
        """q, q', q'' (3, n) from a basis (3, 4, n) in cells (n,)."""
        local = coefficients[self.first[cell] + np.arange(DEGREE + 1)[:, None]]
        found: Array = np.einsum("dkn,kn->dn", basis, local)
        return found

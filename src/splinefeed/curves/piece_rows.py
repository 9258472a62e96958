"""The pieces of a path as columns, one array a coefficient: many places at once, each on its own piece.

Only code that checks a motion reads the path's polynomials here; the planner and the interpolators do not.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from splinefeed.curves.pieces import Pieces, arc, coefficients, t_behind
from splinefeed.kernels import layout
from splinefeed.records import Array, IntArray

EPSILON = float(np.finfo(np.float64).eps)


class PieceRows:
    """Rows of a table of pieces, of a path or of a curve, r of them, as columns.

    low, high, middle, scale   (r,)  interval of u, and t = (u - middle) scale, in [-1, 1]
    start, end                 (r,)  arc length at both ends, mm
    origin                     (axes, r)  a point near the piece
    terms                      (axes + 1 if rational, degree + 1, r)  coefficients of t^k of A, and of the weight

    The curve is origin + A(t) / w(t); see `kernels.layout`.
    """

    def __init__(self, pieces: Pieces) -> None:
        self.degree, self.axes, self.linear, rational = pieces.shape
        self.rational, self.curves = bool(rational), pieces.rows
        c = np.ascontiguousarray(pieces.table.T)
        column: list[Array] = list(c[: layout.ARC])
        self.low, self.high, self.middle, self.scale, self.start = column
        self.end: Array = self.start + pieces.lengths
        self.origin: Array = c[layout.ORIGIN : layout.ORIGIN + self.axes]
        self.terms: Array = coefficients(c, pieces.shape)
        self._columns, self._pieces = c, pieces

    def __len__(self) -> int:
        return len(self.low)

    @cached_property
    def sizes(self) -> Array:
        """How large the numbers are that a point of each row is made of, (axes, r): eps times that is its rounding."""
        size = np.abs(self.origin)
        weight = self.terms[self.axes, 0] if self.rational else 1.0
        for k in range(self.degree + 1):
            size = size + np.abs(self.terms[: self.axes, k]) / weight
        return size

    @cached_property
    def parameters(self) -> Array:
        """Largest |u| of each row, (r,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    def find(self, curve: IntArray, u: Array) -> tuple[IntArray, Array]:
        """Row (n,) that holds u (n,) of the curves (n,), and u moved into the curve's domain."""
        first, last = self.curves[curve, 0], self.curves[curve, 1]
        value = np.minimum(np.maximum(u, self.low[first]), self.high[last])
        return self._pieces.row_at(curve, value, False), value

    def at(self, s: Array) -> IntArray:
        """The last row that begins at or before arc lengths s (n,), mm."""
        return self._pieces.row_by_length(s)

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """S (n,), mm, at t (n,) of rows (n,)."""
        return self.start[row] + arc(np.take(self._columns[: layout.ORIGIN], row, axis=1), t)

    def parameter(self, row: IntArray, ahead: Array) -> Array:
        """t (n,) in [-1, 1] of rows (n,) at which S is `ahead` (n,), mm, behind their start."""
        if not len(row):
            return np.zeros(0)
        a = np.take(self._columns[layout.ARC : layout.ORIGIN], row, axis=1)
        return t_behind(a, self.end[row] - self.start[row], ahead)

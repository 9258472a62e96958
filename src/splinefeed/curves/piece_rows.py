"""The pieces of a path as columns, one array a coefficient: many places at once, each on its own piece."""

from __future__ import annotations

import numpy as np

from splinefeed.curves.pieces import Pieces, arc, coefficients, taylor
from splinefeed.kernels import layout
from splinefeed.records import Array, IntArray


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

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """S (n,), mm, at t (n,) of rows (n,)."""
        return self.start[row] + arc(np.take(self._columns[: layout.ORIGIN], row, axis=1), t)

    def taylor(self, terms: Array, rational: bool, t: Array, order: int) -> list[Array]:
        """Columns of some terms, or A / w, and derivatives by t over k!, at t (n,)."""
        return taylor(terms, int(rational), t, order)

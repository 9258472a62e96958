"""The pieces of a path as columns, one array a coefficient: many places at once, each on its own piece.

Only code that checks a motion reads the path's polynomials here; the planner and the interpolators do not.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.geometry.pieces import Pieces, arc, coefficients, t_behind, taylor, turns
from splinefeed.geometry.pieces import dot as dot
from splinefeed.kernels import layout
from splinefeed.records import Array, BoolArray, IntArray

EPSILON = float(np.finfo(np.float64).eps)


class Rows:
    """Rows of a table of pieces, of a path or of a curve, r of them, as columns.

    low, high, middle, scale   (r,)  interval of u, and t = (u - middle) scale, in [-1, 1]
    start, end                 (r,)  arc length at both ends, mm
    origin                     (axes, r)  a point near the piece
    terms                      (axes + 1 if rational, degree + 1, r)  coefficients of t^k of A, and of the weight

    The curve is origin + A(t) / w(t); see `kernels.layout`.
    """

    def __init__(self, pieces: Pieces) -> None:
        self.degree, self.axes, linear, rational = pieces.shape
        self.linear, self.rational, self.curves = abs(linear), bool(rational), pieces.rows
        c = np.ascontiguousarray(pieces.table.T)
        column: list[Array] = list(c[: layout.ARC])
        self.low, self.high, self.middle, self.scale, self.start = column
        self.end: Array = self.start + pieces.lengths
        self.origin: Array = c[layout.ORIGIN : layout.ORIGIN + self.axes]
        self.terms: Array = coefficients(c, pieces.shape)
        #: Rows (r,) on which only rotary axes move; None if there are none.
        self.turns: BoolArray | None = turns(self.terms, pieces.shape) if linear <= 0 else None
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


def taken(index: Array | IntArray | BoolArray, *arrays: Any) -> tuple[Any, ...]:
    """The elements `index` of the last axis of each array."""
    return tuple(each[..., index] for each in arrays)


class Places:
    """The polynomials of the rows (n,) that n places lie on, gathered once and evaluated often."""

    def __init__(self, rows: Rows, row: IntArray) -> None:
        self._rows, self._row = rows, row
        self._terms: Array = np.take(rows.terms, row, axis=2)
        self.middle, self.scale = rows.middle[row], rows.scale[row]
        self.linear = rows.linear
        #: Which of them lie where only rotary axes move, (n,), or that none do.
        self.turning: BoolArray | bool = rows.turns is not None and bool(np.any(rows.turns[row])) and rows.turns[row]

    def t(self, u: Array) -> Array:
        """t (..., n) of parameters u (..., n)."""
        return (u - self.middle) * self.scale

    def derivatives(self, t: Array, order: int) -> list[Array]:
        """C and its derivatives by u to `order` <= 3 at t (..., n), each (axes, ..., n)."""
        c = self._taylor(t, order)
        c[0] = c[0] + self._rows.origin[:, self._row].reshape(self._rows.axes, *(1,) * (t.ndim - 1), -1)
        factor = self.scale
        for k in range(1, order + 1):
            c[k] = c[k] * factor
            factor = factor * self.scale * (k + 1)
        return c

    def speed(self, t: Array) -> Array:
        """|C'(u)| at t (..., n) over the axes that make the arc length, mm a unit of u."""
        slope = self._taylor(t, 1)[1]
        return np.sqrt(self.product(slope, slope)) * self.scale

    def product(self, one: Array, other: Array) -> Array:
        """Scalar product (..., n) of derivatives (axes, ..., n) over the axes that make the arc length, mm."""
        linear = self._rows.linear
        total = dot(one[:linear], other[:linear])
        if self.turning is False:
            return total
        return np.where(self.turning, layout.DEGREES**2 * dot(one[linear:], other[linear:]), total)

    def _taylor(self, t: Array, order: int) -> list[Array]:
        """A / w and its derivatives by t over k! to `order`, (axes, ..., n) each."""
        terms = self._terms.reshape(*self._terms.shape[:2], *(1,) * (t.ndim - 1), -1)
        return taylor(terms, int(self._rows.rational), t, order)

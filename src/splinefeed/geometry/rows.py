"""The pieces of a path as columns, one array a coefficient: many places at once, each on its own piece.

Only code that checks a motion reads the path's polynomials here; the planner and the interpolators do not.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.geometry.pieces import Pieces, inverted, taylor
from splinefeed.kernels import layout
from splinefeed.records import Array, BoolArray, IntArray

EPSILON = float(np.finfo(np.float64).eps)


class Rows:
    """Rows of a table of pieces, of a path or of a curve, r of them, as columns.

    low, high, middle, scale   (r,)  interval of u, and t = (u - middle) scale, in [-1, 1]
    start                      (r,)  arc length at low, mm
    origin                     (axes, r)  a point near the piece
    terms                      (axes + 1 if rational, degree + 1, r)  coefficients of t^k of A, and of the weight

    The curve is origin + A(t) / w(t); see `kernels.layout`.
    """

    def __init__(self, pieces: Pieces) -> None:
        table, (degree, axes, linear, rational) = pieces.table, pieces.shape
        self.axes, self.linear, self.degree, self.rational = axes, abs(linear), degree, bool(rational)
        column = [np.ascontiguousarray(table[:, k]) for k in range(layout.ARC)]
        self.low, self.high, self.middle, self.scale, self.start = column
        self.origin: Array = table[:, layout.ORIGIN : layout.ORIGIN + axes].T.copy()
        terms = table[:, layout.ORIGIN + axes :].T
        self.terms: Array = np.ascontiguousarray(terms).reshape(axes + rational, degree + 1, len(table))
        self._arc = table[:, layout.ARC : layout.ORIGIN].T
        self.curves, self._pieces = pieces.rows, pieces
        self._may_turn = linear <= 0

    def __len__(self) -> int:
        return len(self.low)

    @cached_property
    def turns(self) -> BoolArray | None:
        """Rows (r,) on which only rotary axes move; None if there are none."""
        if not self._may_turn:
            return None
        moves: BoolArray = np.any(self.terms[: self.linear] != 0.0, axis=(0, 1))
        return ~moves

    @cached_property
    def arc(self) -> Array:
        """Coefficients of S(t) - start, (terms, r), mm."""
        return np.ascontiguousarray(self._arc)

    @cached_property
    def end(self) -> Array:
        """Arc length at the end of each row, (r,), mm."""
        return self.arc_length(np.arange(len(self)), np.ones(len(self)))

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
        return np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """S (n,), mm, at t (n,) of rows (n,)."""
        total: Array = self.arc[-1][row]
        for k in range(len(self.arc) - 2, -1, -1):
            total = total * t + self.arc[k][row]
        total = self.start[row] + total
        return total

    def parameter(self, row: IntArray, ahead: Array) -> Array:
        """t (n,) in [-1, 1] of rows (n,) at which S is `ahead` (n,), mm, behind their start."""
        whole = self.end[row] - self.start[row]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(whole > 0.0, np.clip(2.0 * ahead / whole - 1.0, -1.0, 1.0), 0.0)
        if not len(t):
            return t
        with np.errstate(divide="ignore", invalid="ignore"):
            return inverted(np.take(self.arc, row, axis=1), ahead, t)


def taken(index: Array | IntArray | BoolArray, *arrays: Any) -> tuple[Any, ...]:
    """The elements `index` of the last axis of each array."""
    return tuple(each[..., index] for each in arrays)


class Places:
    """The polynomials of the rows (n,) that n places lie on, gathered once and evaluated often."""

    def __init__(self, rows: Rows, row: IntArray) -> None:
        self._rows, self._row = rows, row
        self._terms: Array = np.take(rows.terms, row, axis=2)
        self.middle, self.scale = rows.middle[row], rows.scale[row]
        turns = rows.turns
        self.linear = rows.linear
        #: Which of them lie where only rotary axes move, (n,), or that none do.
        self.turning: BoolArray | bool = False if turns is None or not np.any(turns[row]) else turns[row]

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


def dot(one: Array, other: Array) -> Array:
    """Scalar product over the first axis, added one after the other, so that how many there are changes no bit."""
    total: Array = one[0] * other[0] if len(one) else np.zeros(np.broadcast_shapes(one.shape, other.shape)[1:])
    for k in range(1, len(one)):
        total += one[k] * other[k]
    return total

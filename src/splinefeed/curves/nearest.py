"""Nearest: the nearest point of one curve, or of all pieces of a path, to any number of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.pieces import Pieces, arc, coefficients, taylor
from splinefeed.curves.search import Search
from splinefeed.errors import InputError
from splinefeed.kernels import layout
from splinefeed.records import Array, IntArray, check_finite

#: A query coordinate beyond this, mm, has a square that is not a number.
FARTHEST = 1e150


class PieceRows:
    """Rows of a table of pieces as columns, r of them; see `search.Rows` and `kernels.layout`."""

    def __init__(self, pieces: Pieces) -> None:
        self.degree, self.axes, self.linear, rational = pieces.shape
        self.rational = bool(rational)
        self._columns: Array = np.ascontiguousarray(pieces.table.T)
        column: list[Array] = list(self._columns[: layout.ARC])
        self.low, self.high, self.middle, self.scale, self.start = column
        self.end: Array = self.start + pieces.lengths
        self.origin: Array = self._columns[layout.ORIGIN : layout.ORIGIN + self.axes]
        self.terms: Array = coefficients(self._columns, pieces.shape)

    def __len__(self) -> int:
        return len(self.low)

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """S (n,), mm, at t (n,) of rows (n,)."""
        return self.start[row] + arc(np.take(self._columns[: layout.ORIGIN], row, axis=1), t)

    def taylor(self, terms: Array, rational: bool, t: Array, order: int) -> list[Array]:
        """Columns of some terms, or A / w, and derivatives by t over k!, at t (n,)."""
        return taylor(terms, int(rational), t, order)


class Nearest:
    """Find nearest points over the linear axes of an arc-length table; made once, used often.

    Parameters
    ----------
    table : (pieces, width) array
        Of a curve's `arc`, or of a `Path`.
    shape : Shape
        Of the table, see `kernels.layout`.
    """

    def __init__(self, table: Array, shape: layout.Shape) -> None:
        self.rows = PieceRows(Pieces(table, shape, np.array([[0, len(table) - 1]])))
        self.search = Search(self.rows)

    def find(self, points: ArrayLike) -> tuple[IntArray, Array, Array]:
        """Find the nearest points: none is nearer, by more than rounding; of several as near, any one.

        Parameters
        ----------
        points : array_like
            Places (..., linear), mm. Many at once are found fastest, those in order along the curve first.

        Returns
        -------
        row : (...) array of int
            Row of the table.
        u : (...) array
            Parameter on it.
        distance : (...) array
            mm.

        Raises
        ------
        InputError
            For a wrong shape or values that are not finite.
        """
        linear = self.rows.linear
        try:
            queries = np.array(points, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise InputError(f"points: expected numbers, got {type(points).__name__} ({error})") from None
        if queries.ndim == 0 or queries.shape[-1] != linear:
            raise InputError(f"points: expected shape (..., {linear}), got {queries.shape}")
        check_finite(queries, "points")
        if queries.size and np.abs(queries).max() > FARTHEST:
            raise InputError(f"points: a coordinate is beyond {FARTHEST:g} mm; distances to it would be rounding")
        shape = queries.shape[:-1]
        found = self.search.whole(np.ascontiguousarray(queries.reshape(int(np.prod(shape)), linear).T))
        row = found.row
        low, high, middle, scale = (
            each[row] for each in (self.rows.low, self.rows.high, self.rows.middle, self.rows.scale)
        )
        u = np.clip(middle + found.t / scale, low, high)
        u = np.where(found.t <= (low - middle) * scale, low, u)  # an end is met exactly
        u = np.where(found.t >= (high - middle) * scale, high, u)
        return row.reshape(shape), u.reshape(shape), np.sqrt(found.square).reshape(shape)

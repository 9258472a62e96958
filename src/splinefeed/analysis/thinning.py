"""Fewer points that look the same: a million ticks in a figure of some hundred pixels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from splinefeed.analysis.bands import Band, Bands
from splinefeed.records import Array, IntArray

#: Columns of pixels that a curve over time is thinned to; two points are kept in each.
COLUMNS = 700
#: Cells along the larger side of the picture that a path is thinned to.
CELLS = 1200


def extremes(values: Array, columns: int = COLUMNS) -> IntArray:
    """Choose the places of the least and the greatest of values in equal stretches, and both ends.

    Parameters
    ----------
    values : (n,) array
        Those that are not finite are neither, where a stretch has others.
    columns : int, optional
        How many stretches.

    Returns
    -------
    (k,) array of int
        Indices; all where there are few.
    """
    count = len(values)
    if count <= 4 * columns:
        return np.arange(count, dtype=np.int64)
    size = -(-count // columns)
    padded = np.pad(values, (0, columns * size - count), constant_values=np.nan)
    starts, finite = np.arange(columns, dtype=np.int64) * size, np.isfinite(padded)
    least, most = (
        starts + np.argmax(np.where(finite, sign * padded, -np.inf).reshape(columns, size), axis=1)
        for sign in (-1.0, 1.0)
    )
    kept = np.unique(np.concatenate([[0], least, most, [count - 1]]))
    return kept[kept < count].astype(np.int64)


def least_and_greatest(values: Array, starts: IntArray) -> tuple[Array, Array]:
    """Find the least and the greatest of values in stretches.

    Parameters
    ----------
    values : (n,) array
        Some may not be finite.
    starts : (m,) array of int
        Where stretches begin.

    Returns
    -------
    low, high : (m,) array
        NaN where a stretch has none that is finite.
    """
    return np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


def envelope(x: Array, values: Array, edges: Array) -> tuple[Array, Array, Array]:
    """Find the least and the greatest of values in columns of a picture.

    Parameters
    ----------
    x : (n,) array
        Rising.
    values : (n,) array
        At x.
    edges : array
        Of the columns.

    Returns
    -------
    middle, low, high : (m,) array
        Of the columns that have points. A picture drawn between the two is that of all points to a column, however many
        there are.
    """
    column = np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(edges) - 2)
    starts = np.flatnonzero(np.diff(column, prepend=-1)).astype(np.int64)
    there = column[starts]
    return 0.5 * (edges[there] + edges[there + 1]), *least_and_greatest(values, starts)


def cells(points: Array) -> IntArray:
    """Choose the points that enter another cell of a fine grid over all of them, and both ends.

    Parameters
    ----------
    points : (n, 2 or 3) array
        mm.

    Returns
    -------
    (k,) array of int
        Indices.
    """
    span = float(np.max(np.ptp(points, axis=0)))
    if len(points) < 3 or span <= 0.0:
        return np.arange(len(points), dtype=np.int64)
    cell = np.floor(points * (CELLS / span))
    enters = np.any(cell[1:] != cell[:-1], axis=1)
    enters[-1] = True
    return np.concatenate([[0], 1 + np.flatnonzero(enters)]).astype(np.int64)


def runs(levels: IntArray) -> list[tuple[int, int]]:
    """Return first and last index of each stretch of equal `levels` (n,)."""
    changes = np.flatnonzero(np.diff(levels)) + 1
    return list(zip([0, *changes.tolist()], [*(changes - 1).tolist(), len(levels) - 1], strict=True))


class Kept:
    """Keep rows of columns that come piece by piece, thinned to those that a figure needs.

    Parameters
    ----------
    most : float, optional
        Rows up to which all stay.

    Notes
    -----
    From there on those stay of each block of rows at which a quantity is least or greatest, and both ends; blocks
    become longer where it is too many again. `bands` has what figures over time show where rows are left out.
    """

    def __init__(self, most: float = math.inf) -> None:
        self.block, self._most, self._count = 1, most, 0
        self._parts: dict[str, list[Array]] = {}
        self._bands = Bands()

    @property
    def whole(self) -> bool:
        """Whether all rows are kept, however many come."""
        return self._most == math.inf

    def see(
        self,
        columns: Mapping[str, Array],
        quantities: Mapping[str, Array],
        between: Mapping[str, tuple[Array, Array]] = MappingProxyType({}),
    ) -> None:
        """Take the next rows.

        Parameters
        ----------
        columns : mapping of str to (n, ...) array
            Every column.
        quantities : mapping of str to (n,) or (n, k) array
            Those of which no peak is lost.
        between : mapping of str to (array, array), optional
            The least and the greatest of some of them from each row to the next, where rows do not have it.
        """
        if self.whole:  # no quantity is needed
            self._put(columns)
            return
        pairs = {name: (values, values) for name, values in quantities.items()}
        self._bands.see(columns["t"], {**pairs, **between})
        self._add({**columns, "": np.column_stack(list(quantities.values()))}, self.block)
        while self._count > self._most:
            rows = {name: self.column(name) for name in self._parts}
            width = 4 * (rows[""].shape[1] + 1)  # twice the extremes of a block
            self._parts, self._count, self.block = {}, 0, self.block * width
            self._add(rows, width)

    def _add(self, rows: Mapping[str, Array], block: int) -> None:
        peaked = rows[""]
        kept = np.arange(len(peaked))
        if block > 1:
            blocks = -(-len(peaked) // block)
            kept = np.unique(np.concatenate([extremes(values, blocks) for values in peaked.T]))
        self._count += len(kept)
        self._put({name: values[kept] for name, values in rows.items()})

    def _put(self, rows: Mapping[str, Array]) -> None:
        for name, values in rows.items():
            self._parts.setdefault(name, []).append(values)

    def bands(self) -> dict[str, Band]:
        """Return the least and the greatest of every quantity over time; empty where all rows are kept."""
        return {} if self.block == 1 else self._bands.finish()

    def take(self, name: str) -> Array:
        """Return what `column` does, and forget it, so that it is in memory once."""
        found = self.column(name)
        self._parts.pop(name, None)
        return found

    def column(self, name: str) -> Array:
        """Return the rows of a column that are kept; empty where it is not known."""
        return np.concatenate(self._parts[name]) if name in self._parts else np.zeros(0)

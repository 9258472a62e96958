"""The least and the greatest of quantities over time, however long: blocks of ticks, in memory that stays flat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from splinefeed.records import Array, IntArray

#: Blocks at the most. An hour at 1 ms has blocks of 64 ms.
MOST_BLOCKS = 65_536


@dataclass(frozen=True, eq=False)
class Band:
    """The least and the greatest of a quantity over blocks of time, both edges included.

    Attributes
    ----------
    edges : (m + 1,) array
        Of the blocks, s.
    low, high : (m, k) array
        Of k columns.
    """

    edges: Array
    low: Array
    high: Array


class Bands:
    """Take quantities tick by tick and keep their bands, in memory that stays flat.

    Parameters
    ----------
    most : int, optional
        Blocks at the most.

    Attributes
    ----------
    size : int
        Ticks of a block: 1 at first, doubled where there would be more blocks.

    Notes
    -----
    Values are in single precision.
    """

    def __init__(self, most: int = MOST_BLOCKS) -> None:
        self.size, self._most = 1, most
        self._ticks, self._end = 0, 0.0
        self._columns: dict[str, slice] = {}
        self._edges = np.zeros(most)

    def see(self, t: Array, quantities: Mapping[str, tuple[Array, Array]]) -> None:
        """Take the next ticks.

        Parameters
        ----------
        t : (n,) array
            s.
        quantities : mapping of str to (array, array)
            Least and greatest, (n,) or (n, k) each, from each tick to the next one.
        """
        if not len(t):
            return
        if not self._columns:
            self._begin({name: np.ndim(each[0]) == 1 or each[0].shape[1] for name, each in quantities.items()})
        low, high = (np.column_stack([each[side] for each in quantities.values()]) for side in (0, 1))
        while -(-(self._ticks + len(t)) // self.size) > self._most:
            self._halve()
        first = -self._ticks % self.size  # ticks that still belong to the last block
        blocks = -(-self._ticks // self.size)
        with np.errstate(over="ignore"):  # what is beyond single precision is infinite in a picture
            if blocks:  # the next block's first tick is its right edge
                part, last = slice(0, first + 1), blocks - 1
                self._low[last] = np.fmin(self._low[last], np.fmin.reduce(low[part]))
                self._high[last] = np.fmax(self._high[last], np.fmax.reduce(high[part]))
            starts = np.arange(first, len(t), self.size, dtype=np.int64)
            if len(starts):
                new = slice(blocks, blocks + len(starts))
                self._edges[new] = t[starts]
                self._low[new] = _with_edges(np.fmin, low, starts)
                self._high[new] = _with_edges(np.fmax, high, starts)
        self._ticks, self._end = self._ticks + len(t), float(t[-1])

    def _begin(self, widths: Mapping[str, int]) -> None:
        end = 0
        for name, width in widths.items():
            self._columns[name] = slice(end, end + width)
            end += width
        self._low, self._high = (np.empty((self._most, end), dtype=np.float32) for _ in range(2))

    def _halve(self) -> None:
        """Make one block of every two."""
        blocks = -(-self._ticks // self.size)
        self.size *= 2
        pairs = np.arange(0, blocks, 2)
        for most, rows in ((np.fmin, self._low), (np.fmax, self._high)):
            rows[: len(pairs)] = most.reduceat(rows[:blocks], pairs)
        self._edges[: len(pairs)] = self._edges[pairs]

    def finish(self) -> dict[str, Band]:
        """Return the bands by name."""
        blocks = -(-self._ticks // self.size)
        edges = np.append(self._edges[:blocks], self._end)
        low, high = (cast(Array, rows[:blocks]) for rows in (self._low, self._high))
        return {name: Band(edges, low[:, columns], high[:, columns]) for name, columns in self._columns.items()}


def _with_edges(most: np.ufunc, rows: Array, starts: IntArray) -> Array:
    """The least or greatest of rows (n, k) in blocks that begin at starts (m,), the first row of the next included."""
    found: Array = most.reduceat(rows, starts)
    found[:-1] = most(found[:-1], rows[starts[1:]])
    return found

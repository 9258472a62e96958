"""Fewer points that look the same: a million ticks in a figure of some hundred pixels."""

from __future__ import annotations

import numpy as np

from splinefeed.records import Array, IntArray

#: Columns of pixels that a curve over time is thinned to; two points are kept in each.
COLUMNS = 700
#: Cells along the larger side of the picture that a path is thinned to.
CELLS = 1200
#: Cells along the larger side of the picture of a thread, to begin with, and how many of them are drawn at the most.
THREAD_CELLS, MOST_CELLS = 600, 40_000
#: Places of a cell's number along each side in one whole number.
_SHIFTS, _MASK = (0, 20, 40), (1 << 20) - 1


def extremes(values: Array, columns: int = COLUMNS) -> IntArray:
    """Indices of the least and the greatest of `values` (n,) in each of `columns` equal stretches, and of both ends.

    All indices where there are few; values that are not finite are neither, where a stretch has others.
    """
    count = len(values)
    if count <= 4 * columns:
        return np.arange(count, dtype=np.int64)
    size = -(-count // columns)
    low = np.full(columns * size, np.inf)
    high = np.full(columns * size, -np.inf)
    finite = np.isfinite(values)
    low[:count] = np.where(finite, values, np.inf)
    high[:count] = np.where(finite, values, -np.inf)
    starts = np.arange(columns, dtype=np.int64) * size
    least = starts + np.argmin(low.reshape(columns, size), axis=1)
    most = starts + np.argmax(high.reshape(columns, size), axis=1)
    kept = np.unique(np.concatenate([[0], least, most, [count - 1]]))
    return kept[kept < count].astype(np.int64)


def cells(points: Array) -> IntArray:
    """Indices of the points (n, 2 or 3) that enter another cell of a fine grid over all of them, and of both ends."""
    span = float(np.max(np.ptp(points, axis=0)))
    if len(points) < 3 or span <= 0.0:
        return np.arange(len(points), dtype=np.int64)
    cell = np.floor(points * (CELLS / span))
    enters = np.any(cell[1:] != cell[:-1], axis=1)
    enters[-1] = True
    return np.concatenate([[0], 1 + np.flatnonzero(enters)]).astype(np.int64)


def runs(levels: IntArray) -> list[tuple[int, int]]:
    """First and last index of each stretch of equal `levels` (n,)."""
    changes = np.flatnonzero(np.diff(levels)) + 1
    return list(zip([0, *changes.tolist()], [*(changes - 1).tolist(), len(levels) - 1], strict=True))


class Thread:
    """The line that a motion of any length leaves in a picture: each cell of a grid is drawn when it is first entered.

    low, high  (d,) corners of the picture, d = 2 or 3, mm
    The cells double when there are more than MOST_CELLS, so that memory and picture stay the same however long it is.
    """

    def __init__(self, low: Array, high: Array) -> None:
        span = float(np.max(high - low, initial=0.0))
        self._low, self._cell = low, (span if span > 0.0 else 1.0) / THREAD_CELLS
        self._known = np.zeros(0, dtype=np.int64)
        self._last: tuple[int, Array, bool] | None = None  # code and place of the last entry, and whether it is drawn
        self._parts: list[Array] = []

    def see(self, place: Array) -> None:
        """The next places (n, d), close enough to each other that a straight line may join them."""
        codes = self._codes(place)
        before = codes[:1] - 1 if self._last is None else np.array([self._last[0]])
        enters = np.flatnonzero(np.diff(codes, prepend=before) != 0)
        if not len(enters):
            return
        codes, entered = codes[enters], place[enters]
        new = np.zeros(len(codes), dtype=np.bool_)
        new[np.unique(codes, return_index=True)[1]] = True
        new &= ~np.isin(codes, self._known)
        # a stretch of new cells begins where the line comes from
        starts = np.flatnonzero(new & ~np.append(self._last is not None and self._last[2], new[:-1]))
        if new.any():
            came = np.concatenate([entered[:1] if self._last is None else self._last[1][None], entered[:-1]])
            begins = np.full((2 * len(starts), place.shape[1]), np.nan)
            begins[1::2] = came[starts]
            at = np.repeat(np.cumsum(new)[starts] - 1, 2)
            self._parts.append(np.insert(entered[new], at, begins, axis=0))
        self._known = np.union1d(self._known, codes[new])
        self._last = int(codes[-1]), entered[-1].copy(), bool(new[-1])
        while len(self._known) > MOST_CELLS:
            self._cell *= 2.0
            coarser = np.zeros(len(self._known), dtype=np.int64)
            for shift in _SHIFTS[: place.shape[1]]:
                coarser |= ((self._known >> shift & _MASK) >> 1) << shift
            self._known = np.unique(coarser)
            self._last = int(self._codes(self._last[1][None])[0]), self._last[1], self._last[2]

    @property
    def line(self) -> Array:
        """Places of the line, (m, d), a row of NaN where it is broken."""
        return np.concatenate(self._parts)[1:] if self._parts else np.zeros((0, len(self._low)))

    def _codes(self, place: Array) -> IntArray:
        """One whole number for the cell of each place, (n,)."""
        cells = np.floor((place - self._low) / self._cell).astype(np.int64)
        codes = np.zeros(len(place), dtype=np.int64)
        for k, shift in enumerate(_SHIFTS[: place.shape[1]]):
            codes |= np.clip(cells[:, k], 0, _MASK) << shift
        return codes

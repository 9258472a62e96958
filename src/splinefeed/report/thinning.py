"""Fewer points that look the same: what a figure of some hundred pixels can show of a million ticks."""

from __future__ import annotations

import numpy as np

from splinefeed.records import Array, IntArray

#: Columns of pixels that a curve over time is thinned to; two points are kept in each.
COLUMNS = 700
#: Cells along the larger side of the picture that a path is thinned to.
CELLS = 1200


def extremes(values: Array, columns: int = COLUMNS) -> IntArray:
    """Indices of the least and the greatest of `values` (n,) in each of `columns` equal stretches, and of both ends.

    All indices where there are few; values that are not finite count as the least.
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

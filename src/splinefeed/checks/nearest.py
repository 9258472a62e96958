"""The nearest point of a path near a place on it, or of the whole path, to many positions.

`curves.search` finds nearest points of whole curves, of whatever pieces it is given: here of the spans that the check
makes of a path. Near a place, a window about it is searched in the same way, and of places that are as near as each
other the one counts that is next to the place.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from splinefeed.checks.spans import EPSILON, PathSpans
from splinefeed.curves.search import Found, Search, in_parts
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import expanded, taken

#: Pairs of a position and a cell that are looked at together: what bounds the memory.
MOST_PAIRS = 1 << 15
#: Half-width of the window about the commanded place, in units of the distance from the commanded point.
REACH = 4.0
#: ... and at least this, relative to the length of the path.
LEAST_WINDOW = 1e-9
#: Doublings of a window: from the least one to any path.
DOUBLINGS = 40
#: A nearest point this close to the edge of its window, relative, or to the end of the path, lies on it.
ON_EDGE = 1e-9
#: Places are as near as each other but for so many roundings of the length of the path.
ROUNDINGS = 16.0


class NearestOnPath(Search):
    """Find nearest points of a path, near where they are thought to be or anywhere.

    Parameters
    ----------
    spans : PathSpans
        Of the path.
    closed : bool, optional
        Whether its end goes on at its start.
    units : (axes,) array, optional
        What each axis is taken times; without it the linear axes alone count.
    """

    def __init__(self, spans: PathSpans, *, closed: bool = False, units: Array | None = None) -> None:
        super().__init__(spans, units)
        self.spans, self.closed = spans, closed
        #: Spans that are a point, as only axes that do not count move on them.
        self._points = spans.still if units is None and spans.still.any() else None
        cells = self.cells
        length = spans.ahead(cells.row, cells.high) - spans.ahead(cells.row, cells.low)
        if self._points is not None:
            length[self._points[cells.row]] = 0.0
        self.way = np.concatenate([[0.0], np.cumsum(length)])  # up to the start of each cell, and to the end
        self.rounding = ROUNDINGS * EPSILON * (float(self.way[-1]) + float(np.max(np.abs(cells.first), initial=0.0)))

    def near(self, q: Array, hint: Array, window: float = 0.0) -> Found:
        """Nearest point to positions (dims, n) near arc lengths `hint` (n,), mm.

        The window is [hint - h, hint + h] with h = max(window, REACH |Q - r(hint)|), doubled until its nearest point is
        not one of its own ends, unless that is an end of the path; on a closed path it continues across the seam. It
        ends as the whole path. What lies on moves of axes that do not count is a point.
        """
        return in_parts(q.shape[1], lambda part: self._near(q[:, part], hint[part], window))

    def _near(self, q: Array, hint: Array, window: float) -> Found:
        spans, length = self.spans, float(self.way[-1])
        row = spans.at(hint)
        t = spans.parameter(row, np.clip(hint - spans.start[row], 0.0, spans.lengths[row]))
        gathered = self._gathered(row, q)
        known = self._squared(*gathered, t)
        found = Found(row, t, known[0])
        half = np.maximum(max(window, LEAST_WINDOW * length), REACH * np.sqrt(found.square))
        way = self._ways(row, t)
        # where the distance is convex over all of the window, and that within a span, there is one least distance
        first, last = (np.searchsorted(self.way[:-1], way + side * half, side="right") - 1 for side in (-1, 1))
        cells = self.cells
        bend = np.maximum(cells.bend[np.maximum(first, 0)], cells.bend[last])
        sure = (first >= 0) & (last - first <= 1) & (cells.row[first] == cells.row[last]) & (way + half <= length)
        with np.errstate(invalid="ignore"):
            sure &= (np.sqrt(found.square) + half) * bend < 0.5
        index = np.flatnonzero(sure)
        one = np.ones(len(index))
        some, terms, away = taken(index, row, *gathered)
        each = self._descend(some, terms, away, -one, one, t[index], known=taken(index, *known))
        settled = np.abs(self._ways(each.row, each.t) - way[index]) < half[index] * (1.0 - ON_EDGE)
        found.put(index[settled], each.take(np.flatnonzero(settled)))
        rest = np.ones(len(hint), dtype=bool)
        rest[index[settled]] = False
        index = np.flatnonzero(rest & (found.square > 0.0))
        for _ in range(DOUBLINGS):
            if not len(index):
                break
            index, half = self._in_windows(q, way, index, half, found)
        return found

    def _ways(self, row: IntArray, t: Array) -> Array:
        """Way (n,), mm, along all that counts, up to t (n,) of spans (n,)."""
        if self._points is None:
            return self.spans.arc_length(row, t)
        before = self.way[np.searchsorted(self.cells.row, row)]
        return np.asarray(before + np.where(self._points[row], 0.0, self.spans.ahead(row, t)))

    def _in_windows(self, q: Array, way: Array, index: IntArray, half: Array, found: Found) -> tuple[IntArray, Array]:
        """Better `found` at `index` within half (n,), mm, of way (n,); what is left, and the next half-widths."""
        closed, length, s, h = self.closed, float(self.way[-1]), way[index], half[index]
        covers = 2.0 * h >= length if closed else (h >= s) & (h >= length - s)
        if covers.any():
            found.put(index[covers], self.whole(q[:, index[covers]]))
            index, s, h = taken(~covers, index, s, h)
        local = found.take(index)
        for turn in (-1, 0, 1) if closed else (0,):  # across the seam
            begin, end = np.clip(s - h + turn * length, 0.0, length), np.clip(s + h + turn * length, 0.0, length)
            owner = np.flatnonzero((end > begin) | (turn == 0))
            self._between(q[:, index], owner, begin[owner], end[owner], local, s)
        found.put(index, local)
        at = self._ways(local.row, local.t)
        offset = at - s
        if closed:
            offset -= length * np.round(offset / length)
        edge = ON_EDGE * h
        inside = np.abs(offset) < h - edge
        if not closed:
            inside |= (at <= edge) | (at >= length - edge)
        half = half.copy()
        half[index] *= 2.0
        return index[~inside & (local.square > 0.0)], half

    def _between(self, q: Array, owner: IntArray, begin: Array, end: Array, found: Found, hint: Array) -> None:
        """Better `found` by the nearest points from way begin to end (m,), mm, for positions `owner` (m,)."""
        cells = self.cells
        first = np.maximum(np.searchsorted(self.way[:-1], begin, side="left") - 1, 0)
        last = np.maximum(np.searchsorted(self.way[:-1], end, side="right") - 1, first)
        # where C' = 0 a rounding of the way is far
        low, high = self._places(first, begin - self.rounding), self._places(last, end + self.rounding)
        for part in groups(last - first + 1, MOST_PAIRS):
            pair, number = expanded((last - first + 1)[part])
            pair += part.start
            cell = first[pair] + number
            left = np.where(number == 0, low[pair], cells.low[cell])
            right = np.where(cell == last[pair], high[pair], cells.high[cell])
            cut = self._bound(q[:, owner[pair]], cells, cell) <= found.square[owner[pair]] + self.rounding**2
            who, cell, left, right = taken(cut, owner[pair], cell, left, np.maximum(left, right))

            def better(owner: IntArray, other: Found, slack: float = 0.0) -> None:
                self._better(found, owner, other, hint)

            self._refine(q, who, cell, left, right, found, better)

    def _places(self, cell: IntArray, way: Array) -> Array:
        """t (n,) of cells (n,) at which the way is so long, within the cell."""
        cells, row = self.cells, self.cells.row[cell]
        ahead = self.spans.ahead(row, cells.low[cell]) + way - self.way[cell]
        t = self.spans.parameter(row, np.clip(ahead, 0.0, self.spans.lengths[row]))
        return np.asarray(np.clip(t, cells.low[cell], cells.high[cell]))

    def _better(self, found: Found, owner: IntArray, other: Found, hint: Array) -> None:
        """Take the nearest of the others, each of the position `owner` (m,), where it is nearer.

        Of places that are as near to rounding, the one counts that is next to the way `hint` (n,), mm.
        """

        def rank(each: Found, hint: Array) -> tuple[Array, Array]:
            return np.floor(np.sqrt(each.square) / self.rounding), np.abs(self._ways(each.row, each.t) - hint)

        near, away = rank(other, hint[owner])
        order = np.lexsort((away, near, owner))
        who, first = np.unique(owner[order], return_index=True)
        nearest = order[first]
        old_near, old_away = rank(found.take(who), hint[who])
        near, away = near[nearest], away[nearest]
        good = (near < old_near) | ((near == old_near) & (away < old_away))
        found.put(who[good], other.take(nearest[good]))


def groups(counts: IntArray, most: int) -> Iterator[slice]:
    """Divide owners into runs that have so many things together, or into one owner.

    Parameters
    ----------
    counts : (n,) array of int
        How many each has.
    most : int
        Of one run.

    Yields
    ------
    slice
        Of the next run.
    """
    until, start = np.cumsum(counts), 0
    while start < len(counts):
        before = int(until[start - 1]) if start else 0
        stop = max(int(np.searchsorted(until, before + most, side="right")), start + 1)
        yield slice(start, stop)
        start = stop

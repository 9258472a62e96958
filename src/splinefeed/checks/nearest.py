"""The nearest point of a path, or of a part of it, to many positions: sampled, then Newton's method in a bracket.

A path is cut into cells of little turn. No point of a cell is further from its chord than an eighth of its greatest
second derivative, so most cells cannot hold the nearest point. In the others the distance is sampled, and each place
that is nearer than its neighbours is where Newton's method begins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.checks.spans import EPSILON, PathSpans, SpanPlaces
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import chunks, dot, expanded, taken

#: Positions, and pairs of a position and a cell, that are looked at together: what bounds the memory.
MOST, MOST_PAIRS = 2048, 1 << 15
#: Half-width of the window about the commanded place, in units of the distance from the commanded point.
REACH = 4.0
#: ... and at least this, relative to the length of the path.
LEAST_WINDOW = 1e-9
#: Doublings of a window: from the least one to any path.
DOUBLINGS = 40
#: A nearest point this close to the edge of its window, relative, or to the end of the path, lies on it.
ON_EDGE = 1e-9
#: A cell turns by no more than this, rad, as far as TURNS + 1 tangents of its span show it, and is one of MOST_CELLS.
CELL_TURN, TURNS, MOST_CELLS = 0.5, 8, 64
#: The greatest second derivative of a span is at most so many times that at the same TURNS + 1 places.
BETWEEN = 2.0
#: Intervals of a cell, or of the part of it that counts, at whose ends the distance is sampled.
INTERVALS = 8
#: Cells whose middles are nearest that are looked at before all within a distance.
LOOKS = 4
#: Newton steps, and the step in t behind which the next one is rounding.
STEPS, SMALL_STEP = 60, 1e-9
#: A cell may be so much nearer than its bound, in roundings of the length of the path.
ROUNDINGS = 16.0


@dataclass(eq=False)
class NearestPoints:
    """The nearest point to each of n positions: span and t (n,), squared distance (n,), mm^2."""

    row: IntArray
    t: Array
    square: Array

    def take(self, index: IntArray) -> NearestPoints:
        """Those of these numbers."""
        return NearestPoints(self.row[index], self.t[index], self.square[index])

    def put(self, index: IntArray | slice, other: NearestPoints) -> None:
        """Have the others at these numbers."""
        self.row[index], self.t[index], self.square[index] = other.row, other.t, other.square


class NearestOnPath:
    """Nearest points over the linear axes of a path, or over all, each times its unit, (axes,)."""

    def __init__(self, spans: PathSpans, *, closed: bool = False, units: Array | None = None) -> None:
        self.spans, self.closed = spans, closed
        self.dims = spans.linear if units is None else spans.axes
        self.unit = np.ones(self.dims) if units is None else units
        #: PathSpans that are a point, as only axes that do not count move on them.
        self._points = spans.still if units is None else None
        self._cut()

    def _cut(self) -> None:
        """Cells: span, low and high t, way up to the start, greatest curvature, ends and reach, (c,) or (dims, c)."""
        spans, counts, bends, seconds = self.spans, [], [], []
        for part in chunks(len(spans), MOST_PAIRS // (TURNS + 1)):
            row = np.arange(part.start, part.stop)
            places = SpanPlaces(spans, row)
            t = np.repeat(np.linspace(-1.0, 1.0, TURNS + 1)[:, None], len(row), axis=1)
            _, first, second = (each[: self.dims] * self._units(each) for each in places.expansion(t, 2))
            with np.errstate(divide="ignore", invalid="ignore"):
                speed = np.sqrt(dot(first, first))
                tangent = np.where(speed > 0.0, first / speed, 0.0)
                second = 2.0 * second
                across = second - dot(second, tangent) * tangent
                bend = np.sqrt(dot(across, across)) / (speed * speed)
            apart = np.diff(tangent, axis=1)
            turn = np.sum(np.sqrt(dot(apart, apart)), axis=0)
            counts.append(np.clip(np.ceil(turn / CELL_TURN), 1, MOST_CELLS).astype(np.int64))
            bends.append(np.max(np.where(np.isfinite(bend), bend, np.inf), axis=0))
            seconds.append(np.sqrt(np.max(dot(second, second), axis=0)))
        count = np.concatenate(counts)
        self.row, number = expanded(count)
        self.low, self.high = (-1.0 + 2.0 * (number + k) / count[self.row] for k in (0, 1))
        self.bend = np.concatenate(bends)[self.row]
        length = spans.ahead(self.row, self.high) - spans.ahead(self.row, self.low)
        if self._points is not None:
            length[self._points[self.row]] = 0.0
        self.way = np.concatenate([[0.0], np.cumsum(length)])
        self.first, self.last = (self._at(self.row, t) for t in (self.low, self.high))
        self.rounding = ROUNDINGS * EPSILON * (float(self.way[-1]) + float(np.max(np.abs(self.first), initial=0.0)))
        width = self.high - self.low
        self.reach = BETWEEN * np.concatenate(seconds)[self.row] * width * width / 8.0 + self.rounding

    def _units(self, values: Array) -> Array:
        return self.unit.reshape(-1, *(1,) * (values.ndim - 1))

    def _at(self, row: IntArray, t: Array) -> Array:
        """Points (dims, n) at t (n,) of spans (n,), as they are counted."""
        places = SpanPlaces(self.spans, row)
        return (places.origin + places.expansion(t, 0)[0])[: self.dims] * self.unit[:, None]

    def _squares(self, places: SpanPlaces, q: Array, t: Array) -> tuple[Array, Array, Array]:
        """|C - Q|^2, (C - Q).C' and its derivative C'.C' + (C - Q).C'' by t, (..., n), for Q (dims, n); mm^2."""
        shape = (self.dims, *(1,) * (t.ndim - 1), -1)
        c0, c1, c2 = (each[: self.dims] * self._units(each) for each in places.expansion(t, 2))
        c0 = c0 + (places.origin[: self.dims] * self.unit[:, None] - q).reshape(shape)
        return dot(c0, c0), dot(c0, c1), dot(c1, c1) + 2.0 * dot(c0, c2)

    def _descend(
        self, row: IntArray, q: Array, low: Array, high: Array, t: Array, known: tuple[Array, ...] = ()
    ) -> NearestPoints:
        """A least distance of q (dims, n) on spans (n,), t in [low, high]: Newton's method from t, in a bracket.

        known  `_squares` at t, if it is
        """
        out, index = t.copy(), np.arange(len(t))
        for _ in range(STEPS):
            if not len(index):
                break
            _, slope, bend = known or self._squares(SpanPlaces(self.spans, row[index]), q[:, index], t)
            known = ()
            low, high = np.where(slope < 0.0, t, low), np.where(slope > 0.0, t, high)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = t - slope / bend
            inside = (bend > 0.0) & (new >= low - SMALL_STEP) & (new <= high + SMALL_STEP)  # but for rounding
            new = np.where(inside, np.clip(new, low, high), 0.5 * (low + high))
            new = np.where(slope == 0.0, t, new)
            out[index] = new
            go = np.flatnonzero(~(np.abs(new - t) < SMALL_STEP))
            index, low, high, t = taken(go, index, low, high, new)
        return NearestPoints(row, out, self._squares(SpanPlaces(self.spans, row), q, out)[0])

    def _refine_cells(self, q: Array, owner: IntArray, cell: IntArray, found: NearestPoints) -> None:
        self._refine(q, owner, cell, self.low[cell], self.high[cell], found)

    def _refine(
        self,
        q: Array,
        owner: IntArray,
        cell: IntArray,
        low: Array,
        high: Array,
        found: NearestPoints,
        hint: Array | None = None,
    ) -> None:
        """Better `found` by the nearest points of parts low to high of cells (m,), each for the position `owner`.

        Of places that are as near to rounding, the one counts that is next to the way `hint` (n,), mm, if it is given.
        """
        for part in chunks(len(owner), MOST_PAIRS // (INTERVALS + 1)):
            who, at, left, right = owner[part], cell[part], low[part], high[part]
            near = self._bound(q[:, who], at) <= found.square[who] + self.rounding**2
            who, at, left, right = taken(near, who, at, left, right)
            row, here = self.row[at], q[:, who]
            t = left + (right - left) * np.linspace(0.0, 1.0, INTERVALS + 1)[:, None]
            square = self._squares(SpanPlaces(self.spans, row), here, t)[0]
            padded = np.pad(square, ((1, 1), (0, 0)), constant_values=np.inf)
            least = (square <= padded[:-2]) & (square <= padded[2:])
            k, pair = np.nonzero(least)
            begin, end = t[np.maximum(k - 1, 0), pair], t[np.minimum(k + 1, INTERVALS), pair]
            self._better(found, who[pair], self._descend(row[pair], here[:, pair], begin, end, t[k, pair]), hint)

    def _better(self, found: NearestPoints, owner: IntArray, other: NearestPoints, hint: Array | None) -> None:
        """Take the nearest of the others, each of the position `owner` (m,), where it is nearer."""

        def rank(each: NearestPoints, hint: Array | None) -> tuple[Array, Array]:
            if hint is None:
                return each.square, np.zeros(len(each.square))
            return np.floor(np.sqrt(each.square) / self.rounding), np.abs(self._ways(each.row, each.t) - hint)

        near, away = rank(other, None if hint is None else hint[owner])
        order = np.lexsort((away, near, owner))
        who, first = np.unique(owner[order], return_index=True)
        nearest = order[first]
        old_near, old_away = rank(found.take(who), None if hint is None else hint[who])
        near, away = near[nearest], away[nearest]
        good = (near < old_near) | ((near == old_near) & (away < old_away))
        found.put(who[good], other.take(nearest[good]))

    def _bound(self, q: Array, cell: IntArray) -> Array:
        """Squared distance (n,), mm^2, below which no point of a cell comes: that of the chord, less its reach."""
        first = np.take(self.first, cell, axis=1)
        side, away = np.take(self.last, cell, axis=1) - first, q - first
        chord = dot(side, side)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(chord > 0.0, np.clip(dot(side, away) / chord, 0.0, 1.0), 0.0)
        apart = away - share * side
        return np.asarray(np.maximum(np.sqrt(dot(apart, apart)) - self.reach[cell], 0.0) ** 2)

    # --- the whole path ----------------------------------------------------------------------------------------------

    @cached_property
    def _trees(self) -> list[tuple[IntArray, float, Any]]:
        """Cells of about one size, how far their points are from their middles at most, mm, and a tree of these."""
        from scipy.spatial import cKDTree

        middle = self._at(self.row, 0.5 * (self.low + self.high))
        side = self.last - self.first
        far = 0.5 * np.sqrt(dot(side, side)) + 2.0 * self.reach
        size = np.frexp(far)[1]
        size = np.maximum(size, int(np.median(size)))  # what is smaller is as good as that size
        kinds = [np.flatnonzero(size == each) for each in np.unique(size).tolist()]
        return [(kind, float(np.max(far[kind])), cKDTree(middle[:, kind].T)) for kind in kinds]

    def whole(self, q: Array) -> NearestPoints:
        """The nearest point of the whole path to positions (dims, n)."""
        return _in_parts(q.shape[1], lambda part: self._whole(q[:, part]))

    def _whole(self, q: Array) -> NearestPoints:
        count, trees = q.shape[1], self._trees
        looks = [tree.query(q.T, k=range(1, min(LOOKS, len(kind)) + 1)) for kind, _, tree in trees]
        first = np.stack([distance[:, 0] for distance, _ in looks])
        cell = np.stack([kind[index[:, 0]] for (kind, _, _), (_, index) in zip(trees, looks, strict=True)])
        cell = cell[np.argmin(first, axis=0), np.arange(count)]
        t = 0.5 * (self.low + self.high)[cell]
        found = NearestPoints(self.row[cell], t, self._squares(SpanPlaces(self.spans, self.row[cell]), q, t)[0])
        self._refine_cells(q, np.arange(count), cell, found)
        for (kind, far, tree), (distance, index) in zip(trees, looks, strict=True):
            radius = np.sqrt(found.square) + far
            near = distance <= radius[:, None]
            more = np.flatnonzero(near[:, -1] & (near.shape[1] < len(kind)))  # there may be others within it
            near[more] = False
            owner, column = np.nonzero(near)
            self._refine_cells(q, owner, kind[index[owner, column]], found)
            counts = tree.query_ball_point(q[:, more].T, radius[more], return_length=True) if len(more) else more
            for part in _groups(counts):
                lists = tree.query_ball_point(q[:, more[part]].T, radius[more[part]])
                other = np.concatenate([np.array(each, dtype=np.int64) for each in lists])
                self._refine_cells(q, np.repeat(more[part], counts[part]), kind[other], found)
        return found

    # --- near a place ------------------------------------------------------------------------------------------------

    def near(self, q: Array, hint: Array, window: float = 0.0, *, closed: bool | None = None) -> NearestPoints:
        """Nearest point to positions (dims, n) near arc lengths `hint` (n,), mm.

        The window is [hint - h, hint + h] with h = max(window, REACH |Q - r(hint)|), doubled until its nearest point is
        not one of its own ends, unless that is an end of the path; on a closed path it continues across the seam. It
        ends as the whole path. What lies on moves of axes that do not count is a point.
        """
        closed = self.closed if closed is None else closed
        return _in_parts(q.shape[1], lambda part: self._near(q[:, part], hint[part], window, closed))

    def _near(self, q: Array, hint: Array, window: float, closed: bool) -> NearestPoints:
        spans, length = self.spans, float(self.way[-1])
        row = spans.at(hint)
        t = spans.parameter(row, np.clip(hint - spans.start[row], 0.0, spans.lengths[row]))
        known = self._squares(SpanPlaces(spans, row), q, t)
        found = NearestPoints(row, t, known[0])
        half = np.maximum(max(window, LEAST_WINDOW * length), REACH * np.sqrt(found.square))
        way = self._ways(row, t)
        # where the distance is convex over all of the window, and that within a span, there is one least distance
        first, last = (np.searchsorted(self.way[:-1], way + side * half, side="right") - 1 for side in (-1, 1))
        bend = np.maximum(self.bend[np.maximum(first, 0)], self.bend[last])
        sure = (first >= 0) & (last - first <= 1) & (self.row[first] == self.row[last]) & (way + half <= length)
        sure &= (np.sqrt(found.square) + half) * bend < 0.5
        index = np.flatnonzero(sure)
        one = np.ones(len(index))
        each = self._descend(row[index], q[:, index], -one, one, t[index], taken(index, *known))
        settled = np.abs(self._ways(each.row, each.t) - way[index]) < half[index] * (1.0 - ON_EDGE)
        found.put(index[settled], each.take(np.flatnonzero(settled)))
        rest = np.ones(len(hint), dtype=bool)
        rest[index[settled]] = False
        index = np.flatnonzero(rest & (found.square > 0.0))
        for _ in range(DOUBLINGS):
            if not len(index):
                break
            index, half = self._in_windows(q, way, index, half, found, closed)
        return found

    def _ways(self, row: IntArray, t: Array) -> Array:
        """Way (n,), mm, along all that counts, up to t (n,) of spans (n,)."""
        if self._points is None:
            return self.spans.arc_length(row, t)
        before = self.way[np.searchsorted(self.row, row)]
        return np.asarray(before + np.where(self._points[row], 0.0, self.spans.ahead(row, t)))

    def _in_windows(
        self, q: Array, way: Array, index: IntArray, half: Array, found: NearestPoints, closed: bool
    ) -> tuple[IntArray, Array]:
        """Better `found` at `index` within half (n,), mm, of way (n,); what is left, and the next half-widths."""
        length, s, h = float(self.way[-1]), way[index], half[index]
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

    def _between(self, q: Array, owner: IntArray, begin: Array, end: Array, found: NearestPoints, hint: Array) -> None:
        """Better `found` by the nearest points from way begin to end (m,), mm, for positions `owner` (m,)."""
        first = np.maximum(np.searchsorted(self.way[:-1], begin, side="left") - 1, 0)
        last = np.maximum(np.searchsorted(self.way[:-1], end, side="right") - 1, first)
        # where C' = 0 a rounding of the way is far
        low, high = self._places(first, begin - self.rounding), self._places(last, end + self.rounding)
        for part in _groups(last - first + 1):
            pair, number = expanded((last - first + 1)[part])
            pair += part.start
            cell = first[pair] + number
            left = np.where(number == 0, low[pair], self.low[cell])
            right = np.where(cell == last[pair], high[pair], self.high[cell])
            self._refine(q, owner[pair], cell, left, np.maximum(left, right), found, hint)

    def _places(self, cell: IntArray, way: Array) -> Array:
        """t (n,) of cells (n,) at which the way is so long, within the cell."""
        row = self.row[cell]
        ahead = self.spans.ahead(row, self.low[cell]) + way - self.way[cell]
        t = self.spans.parameter(row, np.clip(ahead, 0.0, self.spans.lengths[row]))
        return np.asarray(np.clip(t, self.low[cell], self.high[cell]))


def _in_parts(count: int, find: Callable[[slice], NearestPoints]) -> NearestPoints:
    """What is found for `count` positions, in parts that stay in the cache."""
    out = NearestPoints(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count))
    for part in chunks(count, MOST):
        out.put(part, find(part))
    return out


def _groups(counts: IntArray) -> Iterator[slice]:
    """Runs of owners that have MOST_PAIRS things together, by how many each has, counts (n,), or one owner."""
    until, start = np.cumsum(counts), 0
    while start < len(counts):
        before = int(until[start - 1]) if start else 0
        stop = max(int(np.searchsorted(until, before + MOST_PAIRS, side="right")), start + 1)
        yield slice(start, stop)
        start = stop

"""The nearest point of a curve or a path, or of a stretch of it, to many positions at once.

The path is cut into cells of little turn. Where D = |C - Q|^2 / 2 is convex all over the stretch that counts, Newton's
method from the commanded place finds its only minimum; that is so for almost every position. Elsewhere cells that can
hold a nearer point are found in a tree of boxes, and bisected until each part has one minimum at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from splinefeed.errors import InputError
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import chunks, dot, taken

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

#: Positions that are processed together: they stay in the processor's cache.
MOST = 2048
#: Length of a cell times its greatest curvature: its tangent turns by no more, rad.
CELL_TURN = 0.6
#: A cell is cut by no more bisections than this, and none shorter than this, relative to the path.
MAX_HALVINGS, NO_LENGTH = 50, 1e-14
#: Places of a cell from which the search of the whole path begins.
CELL_SAMPLES = 4
#: Rounding of a length or a coordinate, relative, as bounds allow for it.
ROUNDING = 1e-15
#: Bisections of a cell before minima are searched without proof that there is one at most.
MAX_BISECTIONS = 4
#: Newton steps inside a bracket, and the step in t behind which the next is rounding.
MAX_STEPS, SMALL_STEP = 60, 1e-9
#: Pairs of a position and a cell, or a box of cells, that are looked at together: some hundred bytes each.
MOST_PAIRS = 1 << 17
#: A place lies in so many boxes for each part of a cell at the most, or cells are cut further; most parts of a cell.
MOST_INSIDE, MOST_PARTS = 8, 16
#: So many pairs of a position and a cell are compared in one search of the whole path, and as many more for each
#: position: a microsecond each.
MOST_COMPARED, EACH_COMPARED = 4_000_000, 100


@dataclass(frozen=True, eq=False)
class Cells:
    """Parts of rows, c of them, in the order of the path.

    Parameters
    ----------
    row : (c,) array of int
        Which row.
    low, high : (c,) array
        Which part of it, in t.
    speed, bend : (c,) array
        Greatest |dC/dt|, mm, and curvature, 1/mm.
    reach : (c,) array
        No point is further than this from the chord between the ends, mm.
    first, last : (dims, c) array
        The ends.
    """

    row: IntArray
    low: Array
    high: Array
    speed: Array
    bend: Array
    reach: Array
    first: Array
    last: Array

    @property
    def boxes(self) -> tuple[Array, Array]:
        """Least and greatest coordinates, (dims, c)."""
        return np.minimum(self.first, self.last) - self.reach, np.maximum(self.first, self.last) + self.reach


@dataclass(eq=False)
class Found:
    """The nearest point to each of n positions.

    Parameters
    ----------
    row : (n,) array of int
        Its row.
    t : (n,) array
        Where on it, in [-1, 1].
    square : (n,) array
        Squared distance, mm^2.
    """

    row: IntArray
    t: Array
    square: Array

    def take(self, index: IntArray) -> Found:
        """Those of these numbers."""
        return Found(self.row[index], self.t[index], self.square[index])

    def put(self, index: IntArray | slice, other: Found) -> None:
        """Have the others at these numbers."""
        self.row[index], self.t[index], self.square[index] = other.row, other.t, other.square

    def better(self, owner: IntArray, other: Found, slack: float = 0.0) -> None:
        """Take the nearest of the others, each of the position `owner` (m,), where it is nearer; slack: relative."""
        good = np.flatnonzero(other.square <= self.square[owner] * (1.0 + slack))
        order = good[np.lexsort((other.square[good], owner[good]))]
        who, first = np.unique(owner[order], return_index=True)
        least = np.minimum(self.square[who], other.square[order[first]])
        self.put(who, other.take(order[first]))
        self.square[who] = least


class Rows(Protocol):
    """Pieces of a path as columns, r of them: origin + A(t) / w(t) on each, t = (u - middle) scale in [-1, 1].

    Attributes
    ----------
    degree, axes, linear : int
        Highest degree, number of axes, and how many of them make the length.
    rational : bool
        Whether there is a w.
    low, high, middle, scale : (r,) array
        Interval of u.
    start, end : (r,) array
        Arc length at both ends, mm.
    origin : (axes, r) array
        A point near each.
    terms : (axes + 1 if rational, degree + 1, r) array
        Coefficients of t^k of A, and of w.
    """

    degree: int
    axes: int
    linear: int
    rational: bool
    low: Array
    high: Array
    middle: Array
    scale: Array
    start: Array
    end: Array
    origin: Array
    terms: Array

    def __len__(self) -> int: ...

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """Arc length (n,), mm, at t (n,) of rows (n,)."""

    def taylor(self, terms: Array, rational: bool, t: Array, order: int) -> list[Array]:
        """Columns of some terms, or A / w where the last one is w, and derivatives by t over k!, at t (n,)."""


class Search:
    """Find nearest points of pieces of a path.

    Parameters
    ----------
    rows : Rows
        The pieces.
    units : (axes,) array, optional
        What each axis is taken times; without it the first `rows.linear` axes count.
    """

    def __init__(self, rows: Rows, units: Array | None = None) -> None:
        self.rows, self.length = rows, float(rows.end[-1])
        self.dims = rows.linear if units is None else rows.axes
        self.unit = np.ones(self.dims) if units is None else units
        kept = np.r_[np.arange(self.dims), rows.axes : len(rows.terms)]
        self._terms = rows.terms if len(kept) == len(rows.terms) else rows.terms[kept]
        self._origin = rows.origin[: self.dims]
        if np.any(self.unit != 1.0):
            scaled = np.append(self.unit, np.ones(len(kept) - self.dims))
            self._terms, self._origin = self._terms * scaled[:, None, None], self._origin * self.unit[:, None]

    # --- arithmetic --------------------------------------------------------------------------------------------------

    def _taylor(self, terms: Array, t: Array, order: int) -> list[Array]:
        """A / w and its derivatives by t over k!, (dims, n), at t (n,); terms (dims + weight, degree + 1, n)."""
        return self.rows.taylor(terms, self.rows.rational, t, order)

    def _gathered(self, row: IntArray, q: Array) -> tuple[Array, Array]:
        """Terms of rows (n,), and origin - Q of them, (dims, n): so a part far from zero loses nothing."""
        return np.take(self._terms, row, axis=2), np.take(self._origin, row, axis=1) - q

    def _squared(self, terms: Array, away: Array, t: Array) -> tuple[Array, Array, Array, Array]:
        """|C - Q|^2, (C - Q).C', its derivative C'.C' + (C - Q).C'', and C'.C', by t, (n,) each; mm^2."""
        c0, c1, c2 = self._taylor(terms, t, 2)
        c0 = c0 + away
        velocity = dot(c1, c1)
        return dot(c0, c0), dot(c0, c1), velocity + 2.0 * dot(c0, c2), velocity

    # --- cells -------------------------------------------------------------------------------------------------------

    @cached_property
    def cells(self) -> Cells:
        """Every row, bisected until it turns by CELL_TURN, and cut where boxes of many lie over each other.

        So they do of long lines that cross a plate in all ways. Of n boxes that lie anyhow a place is inside of n times
        the mean share that a box has of all space; cut in two, they are twice as many, of a half or a quarter of the
        size each.
        """
        rows = self.rows
        row = np.arange(len(rows))
        low, high = ((end - rows.middle) * rows.scale for end in (rows.low, rows.high))
        done: list[tuple[Any, ...]] = []
        for halvings in range(MAX_HALVINGS + 1):
            speed, bend = self._bends(row, low, high)
            length = speed * (high - low)
            with np.errstate(invalid="ignore"):
                cut = (bend * length > CELL_TURN) & (length > NO_LENGTH * self.length) & (halvings < MAX_HALVINGS)
            done.append(taken(~cut, row, low, high, speed, bend))
            if not cut.any():
                break
            middle = 0.5 * (low + high)
            row = np.repeat(row[cut], 2)
            low, high = (np.column_stack(pair).ravel() for pair in ((low[cut], middle[cut]), (middle[cut], high[cut])))
        row, low, high, speed, bend = (np.concatenate(each) for each in zip(*done, strict=True))
        cells = self._cells(*taken(np.lexsort((low, row)), row, low, high, speed, bend))
        least, greatest = cells.boxes
        size = np.max(greatest, axis=1) - np.min(least, axis=1)
        wide = size > 0.0
        inside = float(np.sum(np.prod((greatest - least)[wide] / size[wide, None], axis=0)))
        parts = 1
        while parts < MOST_PARTS and inside > MOST_INSIDE * parts and wide.sum() > 1:
            parts, inside = 2 * parts, inside / 2.0 ** (wide.sum() - 1)
        if parts == 1:
            return cells
        share = np.arange(parts + 1) / parts
        t = cells.low[:, None] * (1.0 - share) + cells.high[:, None] * share
        of = np.repeat(np.arange(len(cells.row)), parts)
        return self._cells(cells.row[of], t[:, :-1].ravel(), t[:, 1:].ravel(), cells.speed[of], cells.bend[of])

    def _cells(self, row: IntArray, low: Array, high: Array, speed: Array, bend: Array) -> Cells:
        """The cells of these parts of rows, (c,) each.

        All points of an arc lie in the ellipsoid with its ends as foci: of length l and chord c none is further from
        the chord than sqrt(l^2 - c^2) / 2.
        """
        first, last = (self._taylor(self._terms[:, :, row], t, 0)[0] + self._origin[:, row] for t in (low, high))
        length = self.rows.arc_length(row, high) - self.rows.arc_length(row, low) + ROUNDING * self.length
        square = np.maximum(length * length - np.sum((last - first) ** 2, axis=0), 0.0)
        reach = 0.5 * np.sqrt(square + 8.0 * ROUNDING * length * length)
        reach += ROUNDING * np.max(np.maximum(np.abs(first), np.abs(last)), axis=0, initial=0.0)
        return Cells(row, low, high, speed, bend, reach, first, last)

    def _bends(self, row: IntArray, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of |dC/dt|, mm, and curvature, 1/mm, from low to high (n,) of rows (n,).

        About the middle, C - C_0 = B / w with B_0 = 0 in x = (t - middle) / half, |x| <= 1, where sum |B_k| bounds |B|
        and |B'| >= 2 |B_1| - sum k |B_k|. With r the bound of |C - C_0|, from C' = (B' - w' (C - C_0)) / w and its
        derivative; infinite where they say nothing. The curvature is |C''| / |C'|^2 at most.
        """
        out, orders = np.zeros((2, len(row))), np.arange(self.rows.degree + 1.0)[:, None]
        for start in range(0, len(row), MOST):
            part = slice(start, start + MOST)
            half = 0.5 * (high[part] - low[part])
            a = np.array(self.rows.taylor(self._terms[:, :, row[part]], False, low[part] + half, self.rows.degree))
            a *= half ** orders[:, None]
            w = a[:, self.dims] if self.rows.rational else np.where(orders == 0.0, 1.0, 0.0 * half)
            b = np.linalg.norm(a[:, : self.dims] - a[0, : self.dims] / w[0] * w[:, None], axis=1)
            (b1, b2), (w1, w2) = (
                ((orders * each).sum(axis=0), (orders * (orders - 1.0) * each).sum(axis=0)) for each in (b, np.abs(w))
            )
            least, most = 2.0 * w[0] - np.abs(w).sum(axis=0), np.abs(w).sum(axis=0)
            with np.errstate(divide="ignore", invalid="ignore"):
                r = b.sum(axis=0) / least
                fast, slow = (b1 + w1 * r) / least, (2.0 * b[1] - b1 - w1 * r) / most
                second = (b2 + 2.0 * w1 * fast + w2 * r) / least
                bend = np.where(slow > 0.0, second / slow**2, np.where(second > 0.0, np.inf, 0.0))
                out[:, part] = np.where(least > 0.0, (fast / half, bend), np.inf)
        return out[0], out[1]

    @cached_property
    def _boxes(self) -> tuple[IntArray, Array, Array]:
        """Cells (c,), those near each other in space beside each other; least and greatest coordinates (dims, 2 width).

        Node i holds 2 i and 2 i + 1, width + i the cell i of these.
        """
        from scipy.spatial import cKDTree

        cells = self.cells
        order = cKDTree(0.5 * (cells.first + cells.last).T).indices
        count = len(order)
        width = 1 << (count - 1).bit_length()
        least, greatest = np.full((self.dims, 2 * width), np.inf), np.full((self.dims, 2 * width), -np.inf)
        least[:, width : width + count], greatest[:, width : width + count] = (each[:, order] for each in cells.boxes)
        while width > 1:
            pair, half = slice(width, 2 * width), slice(width // 2, width)
            least[:, half] = least[:, pair].reshape(self.dims, -1, 2).min(axis=2)
            greatest[:, half] = greatest[:, pair].reshape(self.dims, -1, 2).max(axis=2)
            width //= 2
        return order, least, greatest

    @cached_property
    def _samples(self) -> tuple[Array, cKDTree]:
        """t of CELL_SAMPLES places of each cell, (CELL_SAMPLES c,), and these in a tree of points."""
        from scipy.spatial import cKDTree

        cells = self.cells
        share = (np.arange(CELL_SAMPLES) + 0.5) / CELL_SAMPLES
        t = (cells.low[:, None] + (cells.high - cells.low)[:, None] * share).ravel()
        row = np.repeat(cells.row, CELL_SAMPLES)
        return t, cKDTree((self._taylor(self._terms[:, :, row], t, 0)[0] + self._origin[:, row]).T)

    # --- the whole path ----------------------------------------------------------------------------------------------

    def whole(self, q: Array) -> Found:
        """Find the nearest point of the whole path.

        Parameters
        ----------
        q : (dims, n) array
            Positions.

        Returns
        -------
        Found
            Row, t (n,) and squared distance (n,), mm^2.

        Raises
        ------
        InputError
            Where so many parts of the path are as near to them that it takes more than MOST_COMPARED.
        """
        left = [MOST_COMPARED + EACH_COMPARED * q.shape[1]]
        return in_parts(q.shape[1], lambda part: self._whole(q[:, part], left))

    def _whole(self, q: Array, left: list[int]) -> Found:
        cells = self.cells
        samples, tree = self._samples
        nearest = tree.query(q.T)[1]
        own, t = nearest // CELL_SAMPLES, samples[nearest]
        row = cells.row[own]
        # near the nearest sample is what most other cells are further than: a minimum, and often the only one
        found = self._descend(row, *self._gathered(row, q), cells.low[own], cells.high[own], t)
        for owner, cell in self._candidates(q, found):
            left[0] -= len(owner)
            if left[0] < 0:
                raise InputError(
                    f"more than {MOST_COMPARED} parts of the path are about as near to points as the nearest: it "
                    "passes the same places again and again; split it"
                )
            self._refine(q, owner, cell, cells.low[cell], cells.high[cell], found)
        return found

    def _candidates(self, q: Array, found: Found) -> Iterator[tuple[IntArray, IntArray]]:
        """Pairs of a position and a cell that can be nearer than what is `found` (n,).

        They come in blocks of MOST_PAIRS, so that a path that passes the same places again and again, or is far away,
        fits into the memory; what is found by then leaves out more of the next block.
        """
        order, least, greatest = self._boxes
        width = least.shape[1] // 2
        blocks = [(np.arange(q.shape[1]), np.ones(q.shape[1], dtype=np.int64))]
        while blocks:
            owner, node = blocks.pop()
            if len(owner) > MOST_PAIRS:
                half = len(owner) // 2
                blocks += [(owner[half:], node[half:]), (owner[:half], node[:half])]
            elif len(owner) and node[0] >= width:
                cell = order[node - width]
                near = self._bound(q[:, owner], self.cells, cell) <= found.square[owner]
                yield owner[near], cell[near]
            elif len(owner):
                owner, node = np.repeat(owner, 2), np.repeat(2 * node, 2)
                node[1::2] += 1
                at = np.take(q, owner, axis=1)
                outside = np.maximum(np.take(least, node, axis=1) - at, at - np.take(greatest, node, axis=1))
                np.maximum(outside, 0.0, out=outside)
                near = dot(outside, outside) <= found.square[owner]
                blocks.append((owner[near], node[near]))

    def _bound(self, q: Array, parts: Cells, part: IntArray) -> Array:
        """Squared distance (n,), mm^2, that no point of a part falls below: to the chord, less its reach."""
        first = np.take(parts.first, part, axis=1)
        side, away = np.take(parts.last, part, axis=1) - first, q - first
        chord = dot(side, side)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(chord > 0.0, np.clip(dot(side, away) / chord, 0.0, 1.0), 0.0)
        apart = away - share * side
        return np.asarray(np.maximum(np.sqrt(dot(apart, apart)) - parts.reach[part], 0.0) ** 2)

    def _refine(
        self,
        q: Array,
        owner: IntArray,
        cell: IntArray,
        low: Array,
        high: Array,
        found: Found,
        better: Callable[..., None] | None = None,
    ) -> None:
        """Better `found` by the nearest points of parts of cells, each for one position.

        Parameters
        ----------
        q : (dims, n) array
            Positions.
        owner, cell : (m,) array of int
            Whose each part is, and of which cell.
        low, high : (m,) array
            From where to where, in t.
        found : Found
            Of the n positions.
        better : callable, optional
            Takes what is found, in place of `found.better`.

        Notes
        -----
        With arc length s, dD/ds = (C - Q).T and d2D/ds2 = 1 + (C - Q).kN. Within h of a place of distance d the last
        term is at most b = (d + h) k, k the greatest curvature. So there

            |C - Q| >= d - h  and  |C - Q|^2 >= d^2 - 2 |dD/ds| h - max(b - 1, 0) h^2   (nothing better: left out),
            b < 1:  D is convex, it has one minimum;  |dD/ds| > h (1 + b):  D falls towards one end.

        What is neither is bisected; after MAX_BISECTIONS it is so short that dD/dt is practically a cubic: from an
        end at which D falls inwards Newton's method comes to the minimum next to it, and a cubic has no others.
        """
        cells, better = self.cells, better or found.better
        todo: list[tuple[Any, ...]] = []
        for bisections in range(MAX_BISECTIONS + 1):
            if not len(owner):
                break
            row, place = cells.row[cell], 0.5 * (low + high)
            gathered = self._gathered(row, q[:, owner])
            square, slope, bend, velocity = self._squared(*gathered, place)
            better(owner, Found(row, place, square))
            h = (high - place) * cells.speed[cell]
            d, best = np.sqrt(square), found.square[owner]
            with np.errstate(divide="ignore", invalid="ignore"):
                b = (d + h) * cells.bend[cell]
                fall = np.where(velocity > 0.0, np.abs(slope) / np.sqrt(velocity), 0.0)
                hopeless = (d > h) & ((d - h) ** 2 > best)
                hopeless |= square - 2.0 * fall * h - np.maximum(b - 1.0, 0.0) * h * h > best
                proven = (b < 1.0) | (fall > h * (1.0 + b))
                newton = place - slope / bend
            one = ~hopeless & proven & (slope != 0.0)
            if one.any():  # D falls from here against its slope, to its only minimum or to the end
                down = slope > 0.0
                begin, end = np.where(down, low, place), np.where(down, place, high)
                start = np.where(bend > 0.0, np.clip(newton, begin, end), np.where(down, low, high))
                todo.append(taken(one, owner, row, begin, end, start))
            more = ~hopeless & ~proven
            owner, cell, low, high, place = taken(more, owner, cell, low, high, place)
            if bisections < MAX_BISECTIONS:
                owner, cell = np.repeat(owner, 2), np.repeat(cell, 2)
                low, high = (np.column_stack(pair).ravel() for pair in ((low, place), (place, high)))
                continue
            row = cells.row[cell]
            gathered = self._gathered(row, q[:, owner])
            for end, inwards in ((low, -1.0), (high, 1.0)):
                square, slope, _, _ = self._squared(*gathered, end)
                better(owner, Found(row, end, square))
                todo.append(taken(slope * inwards > 0.0, owner, row, low, high, end))
        if todo:
            owner, row, low, high, start = (np.concatenate(each) for each in zip(*todo, strict=True))
            least = self._descend(row, *self._gathered(row, q[:, owner]), low, high, start)
            better(owner, least, slack=4.0 * ROUNDING)

    def _descend(
        self,
        row: IntArray,
        terms: Array,
        away: Array,
        low: Array,
        high: Array,
        t: Array,
        *,
        known: tuple[Array, ...] | None = None,
    ) -> Found:
        """Find a minimum of |C - Q|^2 over an interval of t: Newton's method on its slope, in a bracket.

        Parameters
        ----------
        row : (n,) array of int
            The rows.
        terms : (columns, degree + 1, n) array
            Theirs.
        away : (dims, n) array
            C - Q but for the terms.
        low, high, t : (n,) array
            The interval, and where to begin.
        known : tuple of array, optional
            `_squared` at t, (n,).

        Returns
        -------
        Found
            The last step is so small that the parabola gives the minimum to rounding. What has converged is not changed
            again, so that its bits do not depend on its neighbours.
        """
        found = Found(row, t.copy(), np.full(len(t), np.inf))
        index, left, right, longest = np.arange(len(t)), low, high, high - low
        for _ in range(MAX_STEPS):
            if not len(index):
                break
            square, slope, bend, _ = self._squared(terms, away, t) if known is None else known
            known = None
            rises, falls = slope > 0.0, slope < 0.0
            at_end = (rises & (t <= left)) | (falls & (t >= right)) | (slope == 0.0)
            right, left = np.where(rises, t, right), np.where(falls, t, left)
            with np.errstate(divide="ignore", invalid="ignore"):
                newton = np.where(bend > 0.0, t - slope / bend, np.where(rises, -np.inf, np.inf))
                lowest = np.maximum(square - slope * slope / bend, 0.0)
            after = np.minimum(np.maximum(newton, left), right)
            last = ~at_end & (after == newton) & (np.abs(after - t) < SMALL_STEP)
            at, least = np.where(last, after, t), np.where(last, np.minimum(lowest, square), square)
            found.t[index], found.square[index] = at, least
            after = np.where(np.abs(after - t) > longest, 0.5 * (left + right), after)
            going = ~at_end & ~last & (after != t)
            longest, t = 0.5 * np.abs(after - t), after
            if not going.all():
                some = np.flatnonzero(going)
                index, left, right, longest, t, terms, away = taken(some, index, left, right, longest, t, terms, away)
        return found


def in_parts(count: int, find: Callable[[slice], Found]) -> Found:
    """Find something for many positions, in parts that stay in the cache.

    Parameters
    ----------
    count : int
        How many.
    find : callable
        Of a slice of them, what is found.

    Returns
    -------
    Found
        For all.
    """
    out = Found(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count))
    for part in chunks(count, MOST):
        out.put(part, find(part))
    return out

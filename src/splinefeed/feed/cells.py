"""A stretch of a path cut into cells, with the path's derivatives by arc length at both ends and the middle of each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kernels import layout as pieces
from splinefeed.records import Array, BoolArray, IntArray

#: A cell may be this much longer than its neighbour: a jump of the grid costs accuracy of q'.
GROWTH = 2.5
#: A speed |C'| at the end of a cell below this share of that in its middle counts as none; derivatives are then taken
#: this share of the way to the middle.
STILL, ASIDE = 1e-6, 1e-3
#: Arc lengths are rounded to this many eps of the whole; a place is told from one with C' = 0 by half of INDISTINCT
#: times that.
ROUNDINGS_OF_S, INDISTINCT = 4.0, 32.0
#: Passes that even out a grid.
MAX_EVENING = 40


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells between nodes of one stretch; every knot and joint of the path inside it is a node.

    curve  (n,)    curve of each cell;  u0, u1  (n,)  its parameters there
    s      (n+1,)  arc length of the nodes along the path, mm
    """

    path: Path
    curve: IntArray
    u0: Array
    u1: Array
    s: Array

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.curve)

    @property
    def length(self) -> Array:
        """Length of each cell, mm, (n,)."""
        return np.diff(self.s)

    def halved(self, marked: BoolArray) -> Cells:
        """The marked cells (n,) cut in two at the middle parameter, and then whatever an even grid asks for besides."""
        cells = self._cut(marked)
        for _ in range(MAX_EVENING):
            h = cells.length
            long = np.zeros(len(h), dtype=bool)
            long[1:] |= h[1:] > GROWTH * h[:-1]
            long[:-1] |= h[:-1] > GROWTH * h[1:]
            finer = cells._cut(long)
            if finer.count == cells.count:
                break
            cells = finer
        return cells

    def followed_by(self, other: Cells) -> Cells:
        """These cells and others that begin where they end, evened out."""
        both = Cells(
            self.path,
            np.concatenate([self.curve, other.curve]),
            np.concatenate([self.u0, other.u0]),
            np.concatenate([self.u1, other.u1]),
            np.concatenate([self.s, other.s[1:]]),
        )
        return both.halved(np.zeros(both.count, dtype=bool))

    def _cut(self, marked: BoolArray) -> Cells:
        after = np.flatnonzero(marked)
        middle = 0.5 * (self.u0 + self.u1)[after]
        s = _lengths(self.path, self.curve[after], middle)
        # a cell of a few roundings of s stays whole: its halves would have no length
        kept = (s > self.s[after]) & (s < self.s[after + 1])
        after, middle, s = after[kept], middle[kept], s[kept]
        return Cells(
            self.path,
            np.insert(self.curve, after + 1, self.curve[after]),
            np.insert(self.u0, after + 1, middle),
            np.insert(self.u1, after, middle),
            np.insert(self.s, after + 1, s),
        )

    def derivatives(self) -> tuple[Array, Array]:
        """Fractions (3, n) of start, middle and end of each cell, and r', r'', r''' by arc length, (3, n, 3, axes).

        They are taken inside the cell: one-sided at knots, and where C' = 0 a little further inside.
        """
        middle = 0.5 * (self.u0 + self.u1)
        at = [
            self.path.evaluate(self.curve, self.u0, 3),
            self.path.evaluate(self.curve, middle, 3),
            self.path.evaluate(self.curve, self.u1, 3, side="left"),
        ]
        speeds = [speed_by_u(d[:, 1], self.path.linear) for d in at]
        for place, u in ((0, self.u0), (2, self.u1)):
            still = np.flatnonzero(speeds[place] <= STILL * speeds[1])
            inside = u[still] + ASIDE * (middle - u)[still]
            at[place][still] = self.path.evaluate(self.curve[still], inside, 3)
        with np.errstate(divide="ignore", invalid="ignore"):  # a cell without length has no fractions: no room is found
            half = (_lengths(self.path, self.curve, middle) - self.s[:-1]) / self.length
        fractions = np.stack([np.zeros(self.count), half, np.ones(self.count)])
        found = np.stack([by_arc_length(d, self.path.linear)[:, 1:] for d in at])
        return fractions, np.where(np.isfinite(found), found, 0.0)


def _lengths(path: Path, curve: IntArray, u: Array) -> Array:
    """Arc length along the path at parameters u (n,) of `curve` (n,), mm."""
    return path.arc_length(curve, u)


def located(path: Path, curve: IntArray, s: Array) -> Array:
    """Parameters (n,) on the curves (n,) at arc lengths s (n,), mm, that lie on them but for rounding."""
    found, u = path.locate(np.clip(s, 0.0, path.length))
    ends = path.flat.domains[curve]
    inside: Array = np.where(found < curve, ends[:, 0], np.where(found > curve, ends[:, 1], u))
    return inside


def speed_by_u(first: Array, linear: int) -> Array:
    """|C'| (n,) over the linear axes of C' (n, axes), or over the rotary ones, in degrees, where only these move."""
    moved = np.linalg.norm(first[:, :linear], axis=1)
    turned = np.degrees(np.linalg.norm(first[:, linear:], axis=1))
    found: Array = np.where(moved > 0.0, moved, turned)
    return found


def by_length(path: Path, curve: IntArray, u: Array, side: str = "right") -> Array:
    """Position and its first three derivatives by arc length at parameters u (n,) of curves (n,): (n, 4, axes).

    In mm, 1, 1/mm, 1/mm^2, rotary axes with rad for the first mm. 0 where they are 0/0 but for rounding: nearer to
    C' = 0 than arc length is known. `side`: which one-sided derivatives are taken at a knot.
    """
    by_u = path.evaluate(curve, u, 3, side=side)
    slack = ROUNDINGS_OF_S * float(np.finfo(np.float64).eps) * path.length
    # C' = 0 is about |C'|^2 / (2 |C''|) away
    told = np.sum(by_u[:, 1] ** 2, axis=1) > INDISTINCT * slack * np.linalg.norm(by_u[:, 2], axis=1)
    d = by_arc_length(by_u, path.linear)
    found: Array = np.where(np.isfinite(d) & told[:, None, None], d, 0.0)
    return found


def rows_between(path: Path, start: float, end: float) -> tuple[int, int, IntArray]:
    """First and last row of the path's table that [start, end], mm, touches, and the curve of each of them."""
    table = path.table
    first = max(int(np.searchsorted(table[:, pieces.START], start, side="right")) - 1, 0)
    last = max(int(np.searchsorted(table[:, pieces.START], end, side="left")) - 1, first)
    owner = np.searchsorted(path.curve_rows[:, 1], np.arange(first, last + 1), side="left")
    return first, last, owner.astype(np.int64)


def sample(path: Path, start: float, end: float, per_piece: int) -> tuple[IntArray, Array, Array]:
    """Curve, parameter and arc length of `per_piece` points of every arc-length piece in [start, end], mm."""
    first, last, owner = rows_between(path, start, end)
    chosen = path.table[first : last + 1]
    fraction = (np.arange(per_piece) + 0.5) / per_piece
    u = (chosen[:, pieces.LOW, None] + fraction * (chosen[:, pieces.HIGH] - chosen[:, pieces.LOW])[:, None]).ravel()
    curve = np.repeat(owner, per_piece)
    s = path.arc_length(curve, u)
    inside = (s > start) & (s < end)
    return curve[inside], u[inside], s[inside]


def cells_between(path: Path, start: float, end: float, s: Array, cumulative: Array) -> Cells:
    """Cells between arc lengths `start` and `end`, mm; so many of them lie before s (m,) as `cumulative` says."""
    levels = np.interp([start, end], s, cumulative)
    count = max(math.ceil(levels[1] - levels[0]), 1)
    nodes = np.interp(np.linspace(levels[0], levels[1], count + 1), cumulative, s)
    nodes[0], nodes[-1] = start, end
    # knots and joints are nodes, exactly; an even node that falls close to one gives way to it
    fixed_s, fixed_curve, fixed_before, fixed_after = _breaks(path, start, end)
    close = np.zeros(len(nodes), dtype=bool)
    if fixed_s.size:
        spacing = np.interp(nodes, 0.5 * (nodes[1:] + nodes[:-1]), np.diff(nodes)) if count > 1 else np.diff(nodes)
        nearest = np.searchsorted(fixed_s, nodes)
        for side in (np.clip(nearest - 1, 0, len(fixed_s) - 1), np.clip(nearest, 0, len(fixed_s) - 1)):
            close |= np.abs(nodes - fixed_s[side]) < 0.3 * spacing
    close[[0, -1]] = False
    free = nodes[~close]
    curve, u = path.locate(free)
    all_s = np.concatenate([free, fixed_s])
    order = np.argsort(all_s, kind="stable")
    all_s = all_s[order]
    # the cell to the right of a node is on `right_curve` from `right_u`; the one to its left ends at `left_u`
    right_curve = np.concatenate([curve, fixed_curve[:, 1]])[order]
    right_u = np.concatenate([u, fixed_after])[order]
    left_u = np.concatenate([u, fixed_before])[order]
    last_curve = int(np.searchsorted(path.curve_starts, end, side="left")) - 1
    if end >= path.curve_starts[last_curve + 1]:
        left_u[-1] = path.curves[last_curve].domain[1]
    # nodes in one place are one: what is before it is the first one's, what is behind it the last one's
    apart = np.diff(all_s) > 1e-15 * path.length
    first, last = np.append(True, apart), np.append(apart, True)
    right_curve, right_u, left_u, all_s = right_curve[last], right_u[last], left_u[first], all_s[last]
    all_s[0], all_s[-1] = start, end
    cells = Cells(path, right_curve[:-1], right_u[:-1], left_u[1:], all_s)
    return cells.halved(np.zeros(cells.count, dtype=bool))


def _breaks(path: Path, start: float, end: float) -> tuple[Array, IntArray, Array, Array]:
    """Knots and joints inside (start, end): arc length (m,), curves before and after (m, 2), u before and after."""
    s_all, curves, before, after = [], [], [], []
    first = max(int(np.searchsorted(path.curve_starts, start, side="right")) - 1, 0)
    slack = 1e-12 * path.length
    for i in range(first, len(path.curves)):
        low, high = path.curve_starts[i], path.curve_starts[i + 1]
        if low >= end:
            break
        curve = path.curves[i]
        if start + slack < low < end - slack and i > 0:
            s_all.append(low)
            curves.append((i - 1, i))
            before.append(path.curves[i - 1].domain[1])
            after.append(curve.domain[0])
        inner = curve.breaks[1:-1]
        if inner.size and not (high < start):
            s = path.arc_length(np.full(len(inner), i), inner)
            keep = (s > start + slack) & (s < end - slack)
            for value, u in zip(s[keep], inner[keep], strict=True):
                s_all.append(value)
                curves.append((i, i))
                before.append(u)
                after.append(u)
    return (
        np.array(s_all),
        np.array(curves, dtype=np.int64).reshape(-1, 2),
        np.array(before),
        np.array(after),
    )

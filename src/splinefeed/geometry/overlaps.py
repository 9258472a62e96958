"""Straight lines and arcs of circles that lie on each other in part: which a tool would cut twice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.arcs import as_circle
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array, BoolArray, IntArray

#: Most arcs that are compared; more would take longer than reading them.
MOST_ARCS = 5_000
#: Lines and circles are the same if they differ by less than this share of the drawing's size, or the tolerance.
SAME = 1e-9
_MULTIPLIERS = np.random.default_rng(20_040_917).integers(1, 2**62, 16) | 1


@dataclass(frozen=True)
class Overlaps:
    """How many pieces of lines and of arcs lie on the one before on their line or circle, and the first such stretch.

    piece  index of the piece that the first stretch belongs to; begin, end  of that stretch, (axes,), mm
    """

    count: int
    piece: int
    begin: Array
    end: Array


def overlaps(pieces: Sequence[Sequence[NurbsCurve]], tolerance: float) -> Overlaps | None:
    """Stretches longer than `tolerance`, mm, that two straight lines, or two arcs of circles in a plane, share.

    Each line is cut from its kind by what all lines on it share: d d^T and the foot of the perpendicular from the
    middle of the drawing; each circle by its centre and radius. Along these the stretches are sorted, and neighbours
    compared: if any two overlap, so do two neighbours.
    """
    owner, begin, end = _segments(pieces)
    corners = [begin, end]
    arcs = _arcs(pieces)
    if not len(begin) and not len(arcs):
        return None
    every = np.concatenate([*corners, *([arcs[:, 1:3]] if len(arcs) and begin.shape[1] == 2 else [])])
    middle, size = 0.5 * (every.min(axis=0) + every.max(axis=0)), float(np.linalg.norm(np.ptp(every, axis=0)))
    cell = max(tolerance, SAME * size)
    found: list[Overlaps] = []
    if len(begin) > 1:
        step = end - begin
        length = np.linalg.norm(step, axis=1)
        kept = length > cell
        owner, begin, step, length = owner[kept], begin[kept] - middle, step[kept], length[kept]
        along = step / length[:, None]
        along *= np.where((along @ _MULTIPLIERS[: along.shape[1]].astype(np.float64)) < 0.0, -1.0, 1.0)[:, None]
        upper = np.triu_indices(along.shape[1])
        first = np.sum(begin * along, axis=1)
        foot = begin - first[:, None] * along
        keys = np.column_stack([(along[:, upper[0]] * along[:, upper[1]]) * size, foot])
        other = np.sum((begin + step) * along, axis=1)
        low, high = np.minimum(first, other), np.maximum(first, other)
        pairs = _neighbours(keys, low, high, cell)
        found += [
            Overlaps(len(pairs), int(owner[i]), middle + foot[i] + a * along[i], middle + foot[i] + b * along[i])
            for i, a, b in pairs[:1]
        ]
    if len(arcs) > 1:
        radius, low = arcs[:, 3], np.mod(arcs[:, 4], 2.0 * math.pi)
        doubled = np.concatenate([arcs, arcs])
        low = np.concatenate([low, low + 2.0 * math.pi])
        sweep = np.concatenate([arcs[:, 5], arcs[:, 5]])
        scale = np.concatenate([radius, radius])
        pairs = _neighbours(doubled[:, 1:4], low * scale, (low + sweep) * scale, cell)
        alike: dict[int, tuple[int, float, float]] = {}  # what overlaps does so a turn later again
        for i, a, b in pairs:
            alike.setdefault(i % len(arcs), (i, a, b))
        apart = list(alike.values())
        for i, a, b in apart[:1]:
            center, r = doubled[i, 1:3], scale[i]
            ends = [center + r * np.array([math.cos(t / r), math.sin(t / r)]) for t in (a, b)]
            found.append(Overlaps(len(apart), int(doubled[i, 0]), *ends))
    if not found:
        return None
    first_found = found[0]
    return Overlaps(sum(each.count for each in found), first_found.piece, first_found.begin, first_found.end)


def _segments(pieces: Sequence[Sequence[NurbsCurve]]) -> tuple[IntArray, Array, Array]:
    """Piece, begin and end of every straight line, (n,), (n, axes), (n, axes)."""
    owners, points, counts = [], [], []
    for i, piece in enumerate(pieces):
        for curve in piece:
            if curve.degree == 1 and curve.clamped:
                owners.append(i)
                points.append(curve.control_points)
                counts.append(len(curve.control_points))
    axes = pieces[0][0].axes
    if not points:
        return np.empty(0, dtype=np.int64), np.empty((0, axes)), np.empty((0, axes))
    every, lengths = np.concatenate(points), np.array(counts)
    inside = np.ones(len(every) - 1, dtype=bool)
    inside[np.cumsum(lengths)[:-1] - 1] = False  # between the last point of one curve and the first of the next
    starts = np.flatnonzero(inside)
    return np.repeat(np.array(owners), lengths - 1), every[starts], every[starts + 1]


def _arcs(pieces: Sequence[Sequence[NurbsCurve]]) -> Array:
    """Piece, centre, radius, start and sweep, counterclockwise, of every arc, (n, 6); none in space or if too many."""
    if pieces[0][0].axes != 2:
        return np.empty((0, 6))
    curves = [(i, c) for i, piece in enumerate(pieces) for c in piece if c.degree == 2 and c.weights is not None]
    rows = []
    for i, curve in curves if len(curves) <= MOST_ARCS else ():
        circle = as_circle(curve)
        if circle is not None:
            (x, y), radius, start, sweep = circle
            rows.append((i, x, y, radius, start if sweep > 0.0 else start + sweep, abs(sweep)))
    return np.array(rows).reshape(-1, 6)


def _neighbours(keys: Array, low: Array, high: Array, cell: float) -> list[tuple[int, float, float]]:
    """Stretches that begin before the one before them on the same line ends: index, and where both lie."""
    # two grids, one shifted by half a cell, so that no two alike lie in different cells of both
    found: dict[int, tuple[float, float]] = {}
    for shift in (0.0, 0.5):
        grid = np.floor(keys / (4.0 * cell) + shift).astype(np.int64)
        with np.errstate(over="ignore"):
            mixed = grid @ _MULTIPLIERS[: grid.shape[1]]
        order = np.lexsort((low, mixed))
        before, after = order[:-1], order[1:]
        shared = np.minimum(high[before], high[after]) - low[after]
        doubled: BoolArray = (mixed[before] == mixed[after]) & (shared > cell)
        for i, j in zip(before[doubled].tolist(), after[doubled].tolist(), strict=True):
            found.setdefault(j, (float(low[j]), float(min(high[i], high[j]))))
    return [(i, *found[i]) for i in sorted(found)]

"""Paths cut into parts and joined again: their arc-length tables go with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.geometry.curves import Flat, Lines, Packed
from splinefeed.geometry.path import Path
from splinefeed.geometry.pieces import Pieces
from splinefeed.geometry.tables import in_a_row

#: Tables of a path by the names of its properties, and whether they are measured by arc length.
TABLES = {"arc_pieces": True, "span_pieces": False}


def cut(path: Path, first: int, last: int) -> Path:
    """The curves from number `first` to the one before `last`, with the feeds, tolerances and markers among them."""
    curves, count = path.joined, len(path.joined)
    markers = [m for m in path.markers if first <= m.before < last or m.before == last == count]
    piece = Path(
        Lines(curves.points[first : last + 1]) if isinstance(curves, Lines) else Packed(path.flat.part(first, last)),
        path.axes,
        name=path.name,
        feeds=None if path.feeds is None else path.feeds[first:last],
        tolerances=None if path.tolerances is None else path.tolerances[first:last],
        markers=[replace(m, before=m.before - first) for m in markers],
        tolerance=path.tolerance,
    )
    for name, measured in TABLES.items():
        if name in path.__dict__ and _same(piece, last - first, [path]):
            whole: Pieces = path.__dict__[name]
            begin, end = int(whole.rows[first, 0]), int(whole.rows[last - 1, 1]) + 1
            some = Pieces(whole.table[begin:end], whole.shape, whole.rows[first:last] - begin)
            piece.__dict__[name] = in_a_row([some], measured=measured)
    return piece


def joined(parts: Sequence[Path]) -> Path:
    """Paths that follow each other as one: its name is that of the first, its tolerance the largest."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(each.joined) for each in parts)]).tolist()
    feeds = [np.full(len(each.joined), np.inf) if each.feeds is None else each.feeds for each in parts]
    markers = [
        replace(marker, before=marker.before + start)
        for each, start in zip(parts, starts, strict=False)
        for marker in each.markers
    ]
    whole = Path(
        Packed(Flat.joined([each.flat for each in parts])),
        parts[0].axes,
        name=parts[0].name,
        feeds=None if all(each.feeds is None for each in parts) else np.concatenate(feeds),
        markers=markers,
        tolerance=max(each.tolerance for each in parts),
    )
    for name, measured in TABLES.items():
        if all(name in each.__dict__ for each in parts) and _same(whole, starts[-1], parts):
            whole.__dict__[name] = in_a_row([each.__dict__[name] for each in parts], measured=measured)
    return whole


def _same(path: Path, count: int, others: Sequence[Path]) -> bool:
    return len(path.joined) == count and all(path.shape == other.shape for other in others)

"""Paths cut into parts and joined again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.geometry.curves import Flat, Lines, Packed
from splinefeed.geometry.path import Path


def cut(path: Path, first: int, last: int) -> Path:
    """The curves from number `first` to the one before `last`, with the feeds, tolerances and markers among them."""
    curves, count = path.joined, len(path.joined)
    markers = [m for m in path.markers if first <= m.before < last or m.before == last == count]
    return Path(
        Lines(curves.points[first : last + 1]) if isinstance(curves, Lines) else Packed(path.flat.part(first, last)),
        path.axes,
        name=path.name,
        feeds=None if path.feeds is None else path.feeds[first:last],
        tolerances=None if path.tolerances is None else path.tolerances[first:last],
        markers=[replace(m, before=m.before - first) for m in markers],
        lines=None if path.lines is None else path.lines[first:last],
        tolerance=path.tolerance,
        by_tip=path.by_tip,
    )


def joined(parts: Sequence[Path]) -> Path:
    """Paths that follow each other as one: its name is that of the first, its tolerance the largest."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(each.joined) for each in parts)]).tolist()
    feeds = [np.full(len(each.joined), np.inf) if each.feeds is None else each.feeds for each in parts]
    lines = [each.lines for each in parts if each.lines is not None]
    markers = [
        replace(marker, before=marker.before + start)
        for each, start in zip(parts, starts, strict=False)
        for marker in each.markers
    ]
    return Path(
        Packed(Flat.joined([each.flat for each in parts])),
        parts[0].axes,
        name=parts[0].name,
        feeds=None if all(each.feeds is None for each in parts) else np.concatenate(feeds),
        markers=markers,
        lines=np.concatenate(lines) if len(lines) == len(parts) else None,
        tolerance=max(each.tolerance for each in parts),
        by_tip=parts[0].by_tip,
    )

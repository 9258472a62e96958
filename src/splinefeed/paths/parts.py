"""Paths cut into parts and joined again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.curves.editing import split
from splinefeed.curves.packed import Flat, Packed
from splinefeed.paths.path import Path
from splinefeed.records import IntArray


def cut(path: Path, first: int, last: int) -> Path:
    """Cut curves out of a path, with the feeds, tolerances and markers among them.

    Parameters
    ----------
    path : Path
        The path.
    first, last : int
        Number of the first curve, and of the one behind the last.

    Returns
    -------
    Path
        These curves.
    """
    count = len(path.joined)
    markers = [m for m in path.markers if first <= m.before < last or m.before == last == count]
    return Path(
        Packed(path.flat.part(first, last)),
        path.axes,
        name=path.name,
        feeds=None if path.feeds is None else path.feeds[first:last],
        tolerances=None if path.tolerances is None else path.tolerances[first:last],
        markers=[replace(m, before=m.before - first) for m in markers],
        lines=None if path.lines is None else path.lines[first:last],
        tolerance=path.tolerance,
        by_tip=path.by_tip,
    )


def cut_at_corners(path: Path) -> tuple[Path, IntArray]:
    """The same path with a curve of its own between any two corners: polylines as lines, others cut where they turn.

    And how many curves stand for each, (curves,). Feeds, tolerances and lines go with each part, markers stay at their
    places. The path itself where no curve has a corner inside.
    """
    flat = path.flat
    owner, _, times = flat.inner_knots()
    counts = np.ones(len(flat), dtype=np.int64)
    if not np.any(times >= flat.degrees[owner] - 1):
        return path, counts
    corners = path.corners
    inside = corners.u < flat.domains[corners.curve, 1]
    at, places = corners.curve[inside], corners.u[inside]
    whole = (flat.degrees == 1) & (flat.rational == 0)
    polyline = whole & (np.diff(flat.point_starts) > 2)
    concerned = np.unique(np.concatenate([at, np.flatnonzero(polyline)])).tolist()
    if not concerned:
        return path, counts
    made = {}
    for i in concerned:
        if polyline[i]:
            points = flat.points[flat.point_starts[i] : flat.point_starts[i + 1]]
            points = points[np.append(True, np.any(np.diff(points, axis=0) != 0.0, axis=1))]
            made[i] = Flat.beziers(np.stack([points[:-1], points[1:]], axis=1))
        else:
            made[i] = Flat.of(split(path.joined[i], *places[at == i].tolist()))
        counts[i] = len(made[i])
    starts = np.concatenate([[0], np.cumsum(counts)]).tolist()
    said = path._said()
    for name in ("feeds", "tolerances", "lines"):
        said[name] = None if said[name] is None else np.repeat(said[name], counts)
    said["times"] = None
    said["markers"] = [replace(marker, before=starts[marker.before]) for marker in path.markers]
    return Path(Packed(flat.changed(made)), path.axes, **said), counts


def joined(parts: Sequence[Path]) -> Path:
    """Join paths that follow each other.

    Parameters
    ----------
    parts : sequence of Path
        At least one.

    Returns
    -------
    Path
        Its name is that of the first, its tolerance the largest.
    """
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

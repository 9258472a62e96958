"""Paths cut into parts and joined again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.curves.editing import split
from splinefeed.curves.packed import Flat, Packed
from splinefeed.paths.each_curve import chosen_of_each
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray


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
    said = {**path._said(), "findings": (), "times": None}
    last_of_all = last == len(path.joined)
    said["markers"] = [m for m in path.markers if first <= m.before < last + last_of_all]
    return Path(Packed(path.flat.part(first, last)), path.axes, **chosen_of_each(said, np.arange(first, last)))


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
    said = chosen_of_each({**path._said(), "times": None}, np.repeat(np.arange(len(flat)), counts))
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
    curves, said = in_a_row(parts)
    return Path(curves, parts[0].axes, name=parts[0].name, by_tip=parts[0].by_tip, **said)


def in_a_row(parts: Sequence[Path]) -> tuple[Packed, dict[str, Any]]:
    """The curves of paths that follow each other, and what is said of them; without a feed they are rapid moves."""
    counts = [len(each.joined) for each in parts]

    def of_all(name: str, default: float) -> Array | None:
        given = [getattr(each, name) for each in parts]
        if all(values is None for values in given):
            return None
        filled = [np.full(n, default) if values is None else values for values, n in zip(given, counts, strict=True)]
        return np.concatenate(filled)

    starts = np.cumsum([0, *counts]).tolist()
    pairs = zip(parts, starts, strict=False)
    return Packed(Flat.joined([each.flat for each in parts])), {
        "feeds": of_all("feeds", np.inf),
        "tolerances": of_all("tolerances", 0.0),
        "lines": None if any(each.lines is None for each in parts) else of_all("lines", 0.0),
        "markers": [replace(marker, before=marker.before + start) for each, start in pairs for marker in each.markers],
        "tolerance": max(each.tolerance for each in parts),
    }

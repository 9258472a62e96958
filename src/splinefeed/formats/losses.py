"""What a drawing has no place for, said in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.records import ROTARY_AXES, Array

#: Columns of a drawing's coordinates by the names of axes; others stand where they come.
_PLACES = {"x": 0, "y": 1, "z": 2}


def losses(paths: Sequence[Path], title: str, *, depth: bool = True) -> list[str]:
    """A sentence on what `paths` have and a format does not; depth: whether it has a z."""
    rotary = sorted({axis for path in paths for axis in path.axes if axis in ROTARY_AXES})
    deep = not depth and any(
        np.ptp(np.concatenate([three_axes(each.control_points, path)[:, 2] for each in path.curves])) > 0.0
        for path in paths
    )
    lost = {
        f"rotary axes ({', '.join(rotary)})": bool(rotary),
        "z": deep,
        "feeds": any(path.feeds is not None for path in paths),
        "tolerances of smoothing": any(path.tolerances is not None for path in paths),
        "markers": any(path.markers for path in paths),
    }
    found = [what for what, there in lost.items() if there]
    return [f"{title} has no place for these, which are left out: {', '.join(found)}"] if found else []


def three_axes(points: Array, path: Path) -> Array:
    """The linear axes of `points` (n, axes) of `path` as x, y, z (n, 3), mm; InputError for more than three."""
    if path.linear > len(_PLACES):
        raise InputError(f"path {path.name!r} has {path.linear} linear axes; a drawing has x, y and z")
    names = path.axes[: path.linear]
    placed = [_PLACES[name] for name in names] if set(names) <= set(_PLACES) else list(range(path.linear))
    out = np.zeros((len(points), len(_PLACES)))
    out[:, placed] = points[:, : path.linear]
    return out

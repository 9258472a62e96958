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
    """One sentence for each kind of thing that `paths` have and a format does not; depth: whether it has a z."""
    found = []
    rotary = sorted({axis for path in paths for axis in path.axes if axis in ROTARY_AXES})
    if rotary:
        found.append(f"{title} has no rotary axes: {', '.join(rotary)} are left out")
    if not depth and any(np.ptp(_z(path)) > 0.0 for path in paths):
        found.append(f"{title} is flat: z is left out")
    if any(path.feeds is not None for path in paths):
        found.append(f"{title} has no feeds: they are left out")
    if any(path.tolerances is not None for path in paths):
        found.append(f"{title} has no tolerances of smoothing: they are left out")
    count = sum(len(path.markers) for path in paths)
    if count:
        found.append(f"{title} has no markers: {count} are left out")
    return found


def three_axes(points: Array, path: Path) -> Array:
    """The linear axes of `points` (n, axes) of `path` as x, y, z (n, 3), mm; InputError for more than three."""
    if path.linear > len(_PLACES):
        raise InputError(f"path {path.name!r} has {path.linear} linear axes; a drawing has x, y and z")
    names = path.axes[: path.linear]
    placed = [_PLACES[name] for name in names] if set(names) <= set(_PLACES) else list(range(path.linear))
    out = np.zeros((len(points), len(_PLACES)))
    out[:, placed] = points[:, : path.linear]
    return out


def _z(path: Path) -> Array:
    return np.concatenate([three_axes(curve.control_points, path)[:, 2] for curve in path.curves])

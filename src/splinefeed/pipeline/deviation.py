"""Where a machine was beside the true path, for a picture that shows the contour error enlarged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.analysis.contour import ContourMeter
from splinefeed.geometry.path import Path
from splinefeed.records import Array, Response


@dataclass(frozen=True, eq=False)
class Deviation:
    """Samples of a response over two linear axes: foot (n, 2) on the path, offset (n, 2) from it, error (n,), mm."""

    path: Path
    foot: Array
    offset: Array
    error: Array


def deviation(response: Response, path: Path, s: Array) -> Deviation | None:
    """Feet and offsets of a response over the first two linear axes; None if it lacks one of them.

    s  (n,) commanded arc length of each sample, mm, as `Servo.commanded` has it or setpoints say it
    """
    if path.linear < 2 or any(axis not in response.axes for axis in path.axes[: path.linear]):
        return None
    columns = [response.axes.index(axis) for axis in path.axes[: path.linear]]
    position = np.ascontiguousarray(response.position[:, columns])
    found = ContourMeter(path).measure(position, s_hint=np.clip(s[: len(response)], 0.0, path.length))
    foot = path(np.clip(found.s, 0.0, path.length))[:, : path.linear]
    return Deviation(path, foot[:, :2], (position - foot)[:, :2], found.error)

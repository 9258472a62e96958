"""Where along the path setpoints command the tool to be, also where only their positions are known."""

from __future__ import annotations

import numpy as np

from splinefeed.analysis.contour import ContourMeter
from splinefeed.errors import InputError
from splinefeed.geometry.nearest import Nearest
from splinefeed.geometry.path import Path
from splinefeed.kernels import check_place as search
from splinefeed.records import Array, Setpoints

#: A closed path's end counts as its start for a first setpoint within this, relative to the length of the path.
AT_SEAM = 1e-6


class Placer:
    """Commanded arc length of setpoints that come in order, whole or in chunks."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._nearest = Nearest(path.table, path.shape)
        self._state: Array | None = None
        #: Largest distance so far of a setpoint without arc length from the path, mm.
        self.apart = 0.0

    def place(self, points: Setpoints) -> Array:
        """Arc length (n,), mm: what the setpoints say, or else the nearest point next to where the last ones went.

        The first setpoint is placed on the whole path, each one after it near the place that its two forerunners let
        expect, so that a path that crosses itself or turns back is followed in order. Raises InputError for setpoints
        that lack a linear axis of the path.
        """
        if np.isfinite(points.s).all():
            return np.clip(points.s, 0.0, self.path.length)
        position = self._position(points)
        n = len(points)
        if self._state is None:
            first = ContourMeter(self.path).measure(position[:1]).s[0]
            if self.path.closed and first >= (1.0 - AT_SEAM) * self.path.length:
                first = 0.0
            self._state = np.array([first, first, 0.0])
        rows, found = np.empty(n, dtype=np.int64), np.empty((n, search.FOUND))
        search.locate(
            self.path.table, self.path.curve_rows, self.path.shape, self._nearest.cells, self._nearest.boxes, 0.0,
            np.full(n, -1), np.full(n, np.nan), position, self._state, rows, found,
        )  # fmt: skip
        self.apart = max(self.apart, float(np.max(found[:, search.APART], initial=0.0)))
        return np.clip(found[:, search.S], 0.0, self.path.length)

    def _position(self, points: Setpoints) -> Array:
        """The positions in the order of the path's axes; rotary axes that the setpoints lack are 0."""
        position = np.zeros((len(points), len(self.path.axes)))
        for column, axis in enumerate(self.path.axes):
            if axis in points.axes:
                position[:, column] = points.position[:, points.axes.index(axis)]
            elif column < self.path.linear:
                raise InputError(
                    f"the path has an axis {axis}, which the setpoints do not tell; theirs are {', '.join(points.axes)}"
                )
        return position

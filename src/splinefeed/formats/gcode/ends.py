"""How moves begin and end: tangents, curvature vectors and radii over the linear axes, for all moves at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.formats.gcode.arcs import Arcs
from splinefeed.formats.gcode.moves import LETTERS, LINEAR, Moves
from splinefeed.records import Array


@dataclass(frozen=True)
class Ends:
    """Of moves (n,): tangents and curvature vectors, 1/mm, (n, 6) at both ends, and the least radius (n,), mm.

    tangents are not numbers where a move has no length over the linear axes; radius is inf on lines
    """

    tangents: tuple[Array, Array]
    bends: tuple[Array, Array]
    radius: Array

    @classmethod
    def of(cls, moves: Moves, arcs: Arcs) -> Ends:
        """Measure lines, arcs and splines: of a helix r (1 + (rise / (r sweep))^2) is the radius."""
        linear = moves.step[:, LINEAR]
        with np.errstate(invalid="ignore", divide="ignore"):
            leave = linear / np.linalg.norm(linear, axis=1)[:, None]
        found = cls((leave, leave.copy()), (np.zeros_like(leave), np.zeros_like(leave)), np.full(len(moves), np.inf))
        if len(arcs):
            found._arcs(arcs, linear)
        found._splines(moves)
        return found

    def _arcs(self, arcs: Arcs, linear: Array) -> None:
        rows, (a, b) = np.arange(len(arcs)), arcs.axes.T
        rise = linear[arcs.move]  # X, Y, Z are the first linear axes too
        rise[rows, a] = rise[rows, b] = 0.0
        rise /= np.abs(arcs.sweep)[:, None]
        turn = np.sign(arcs.sweep)
        for end, angle, radius in ((0, arcs.angle, arcs.first), (1, arcs.angle + arcs.sweep, arcs.last)):
            there = rise.copy()
            there[rows, a], there[rows, b] = -turn * radius * np.sin(angle), turn * radius * np.cos(angle)
            # an arc that ends at its centre, as a spiral of a repaired program may, has no tangent there
            speed = np.maximum(np.linalg.norm(there, axis=1), 1e-150)
            self.tangents[end][arcs.move] = there / speed[:, None]
            inward = np.zeros_like(there)
            inward[rows, a], inward[rows, b] = -radius * np.cos(angle), -radius * np.sin(angle)
            self.bends[end][arcs.move] = inward / (speed**2)[:, None]
        least = np.minimum(arcs.first, arcs.last)
        slope = np.linalg.norm(rise, axis=1) / np.maximum(least, 1e-100)
        self.radius[arcs.move] = least * (1.0 + slope**2)

    def _splines(self, moves: Moves) -> None:
        for i, spline in moves.spline_moves():
            path = spline.path
            if path is None:
                continue
            (curve,) = path.curves
            columns = [LINEAR.index(LETTERS.index(axis.upper())) for axis in path.axes]
            self.radius[i] = path.minimum_radius()
            for end, u in enumerate(curve.domain):
                self.tangents[end][i] = 0.0
                self.tangents[end][i, columns] = curve.tangent(u)
                _, velocity, second = curve.derivatives(u, 2, side=("right", "left")[end])
                square = float(velocity @ velocity)
                if square > 0.0:
                    self.bends[end][i, columns] = (second - (second @ velocity) / square * velocity) / square

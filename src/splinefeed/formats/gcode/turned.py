"""Turned coordinate systems (G10 L2 R), to the axes of the machine and back, and polar coordinates (@, ^)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.arcs import arc_curve, find_arcs
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import AXES, CLOCKWISE, COUNTERCLOCKWISE, POLAR, SPLINE, Moves, Spline
from splinefeed.records import Array, IntArray


@dataclass(frozen=True)
class Frame:
    """X and Y turned by `angle`, rad, counterclockwise, about a centre (2,), mm."""

    angle: float
    centre: Array

    def to_machine(self, places: Array) -> Array:
        """Places (..., 9) of the turned system as those of the axes."""
        turned = places.copy()
        if self.angle:
            turned[..., :2] = self.centre + (places[..., :2] - self.centre) @ self._matrix
        return turned

    def from_machine(self, places: Array) -> Array:
        """Places (..., 9) of the axes as those of the turned system."""
        return Frame(-self.angle, self.centre).to_machine(places)

    @property
    def _matrix(self) -> Array:
        """What places (n, 2) are multiplied by from the right."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.array([[cosine, sine], [-sine, cosine]])

    def turn_rows(self, start: Array, rows: Array, marks: IntArray, splines: list[Spline]) -> None:
        """Turn moves that begin at `start` (9,) in the turned system: rows (n, 16) and marks (n, 6), in place.

        An arc across the plane of the turn becomes the spline that it is.
        """
        if not self.angle or not len(rows):
            return
        across = (marks[:, layout.ROW_PLANE] != 17) & np.isin(marks[:, layout.KIND], (CLOCKWISE, COUNTERCLOCKWISE))
        for i in np.flatnonzero(across).tolist():
            begin = rows[i - 1, :AXES] if i else start
            made = find_arcs(Moves(begin, rows[i : i + 1], marks[i : i + 1]))
            curve = arc_curve(begin, rows[i, :AXES], made, 0, np.arange(AXES))
            weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights
            line = int(marks[i, layout.ROW_LINE])
            splines.append(Spline(curve.degree, curve.knots, curve.control_points, weights, line))
            marks[i, layout.KIND], marks[i, layout.SPLINE] = SPLINE, len(splines) - 1
        for k in marks[marks[:, layout.KIND] == SPLINE, layout.SPLINE].tolist():
            splines[k] = replace(splines[k], points=self.to_machine(splines[k].points))
        rows[:, :AXES] = self.to_machine(rows[:, :AXES])
        centre, absolute = rows[:, layout.CENTER : layout.CENTER + 2], marks[:, layout.FLAGS] & layout.ABSOLUTE != 0
        base = np.where(absolute[:, None], self.centre, 0.0)
        centre[:] = base + (centre - base) @ self._matrix
        axes = marks[:, layout.AXES]  # one word moves X and Y, and states none of them
        xy, stated = 0b11, 0b11 << layout.STATED
        moved, both = np.where(axes & xy, xy, 0), np.where(axes & stated == stated, stated, 0)
        marks[:, layout.AXES] = axes & ~(xy | stated) | moved | both


def from_polar(words: Mapping[str, float], x: float, y: float, relative: bool) -> dict[str, float]:
    """Axis words with X and Y in place of @, the distance from zero, and ^, the angle in degrees, at the place x, y.

    What is not said stays; `relative` (G91) both are steps, and so are X and Y then. LineError where they say nothing.
    """
    if words.keys() & {"X", "Y"}:
        raise LineError("X or Y beside polar coordinates (@, ^); write one or the other")
    distance, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if distance == 0.0 and (relative or "^" not in words):
        raise LineError("polar coordinates (@, ^) have no angle at the zero point; write X and Y")
    if relative:
        distance, angle = distance + words.get("@", 0.0), angle + words.get("^", 0.0)
    else:
        distance, angle = words.get("@", distance), words.get("^", angle)
    there = distance * math.cos(math.radians(angle)), distance * math.sin(math.radians(angle))
    rest = {letter: value for letter, value in words.items() if letter not in POLAR}
    return rest | {"X": there[0] - x * relative, "Y": there[1] - y * relative}

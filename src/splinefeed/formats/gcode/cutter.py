"""Cutter compensation: moves beside the programmed contour by the radius of the tool.

Source: LinuxCNC documentation, "Cutter Compensation". The first move is a line that ends beside its own end; convex
corners become arcs around the corner (rapid moves: lines), concave ones are cut off where the moves meet; G40 leaves
the tool where it is. What the tool cannot reach without a gouge is refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.arcs import find_arcs
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import CLOCKWISE, COUNTERCLOCKWISE, RAPID, Moves
from splinefeed.formats.gcode.state import State
from splinefeed.records import Array

#: A turn below this, rad, is no corner, and one this near to half a turn leads back: what LinuxCNC 2.9 does there, its
#: interpreter shows with pairs of lines and arcs. Places this near each other, mm, are one.
NO_CORNER, SAME_PLACE = 0.05, 1e-7
GOUGE = "the tool of radius {:.6g} mm cannot reach this corner without a gouge; take a smaller one or a larger radius"


@dataclass
class _Side:
    """A move beside its contour in the plane: the row, directions at its ends, where it begins and ends.

    sense  of an arc, 1 counterclockwise, with its centre and radius beside the contour; 0 for a line
    """

    row: int
    first: Array
    last: Array
    begin: Array
    end: Array
    sense: int = 0
    centre: Array | None = None
    radius: float = 0.0

    def reaches(self, begin: Array, end: Array) -> bool:
        """Whether `end` lies behind `begin` on the move as it is without its neighbours."""
        if self.centre is None:
            return float((end - begin) @ self.first) >= -SAME_PLACE
        from_begin = [self._angle(self.begin, each) for each in (begin, end)]
        whole = self._angle(self.begin, self.end) or 2.0 * math.pi
        slack = SAME_PLACE / self.radius
        inside = [0.0 if each > 2.0 * math.pi - slack else each for each in from_begin]
        if inside[1] == 0.0 and np.linalg.norm(end - self.end) < SAME_PLACE:
            inside[1] = whole
        return inside[0] <= inside[1] + slack and inside[1] <= whole + slack

    def _angle(self, start: Array, end: Array) -> float:
        """How far an arc turns from one place to another, rad, 0 to 2 pi."""
        assert self.centre is not None
        (x, y), (u, v) = start - self.centre, end - self.centre
        turned = self.sense * math.atan2(x * v - y * u, x * u + y * v)
        return turned % (2.0 * math.pi) if abs(turned) * self.radius > SAME_PLACE else 0.0


class Cutter:
    """Moves the rows of a `State` to the side, while it is `on`; radius, mm, is greater than 0 left of the contour."""

    def __init__(self, state: State) -> None:
        self.state = state
        self.on, self._radius, self.first_line = False, 0.0, 0
        self._ended = False  # G40 was the last word about it
        self._last: _Side | None = None
        self._here = self._begins = np.zeros(2)
        self._axes = [0, 1]

    def begin(self, radius: float, line: int) -> None:
        """G41 (radius above 0) and G42."""
        self.first_line = line
        self.on = self.state.held = True
        self._radius, self._last = radius, None
        self._axes = list(layout.PLANES[int(self.state.modes[layout.PLANE])])
        self._here = self.state.position[self._axes].copy()

    def end(self) -> None:
        """G40: the tool is where it is; axes that the next line leaves out go to the contour, as in LinuxCNC."""
        self._ended |= self.on
        self.on = self.state.held = False

    def forget(self) -> None:
        """M6: the next line begins where the tool is, as in LinuxCNC, which asks the machine for its place."""
        if self._ended:
            self.state.position[self._axes] = self._here
        self._ended = False

    @property
    def busy(self) -> bool:
        """Whether the next move matters to it."""
        return self.on or self._ended

    def check_exit(self, kind: int) -> None:
        """LineError for an arc as the first move behind G40, as in LinuxCNC."""
        if self._ended and kind in (CLOCKWISE, COUNTERCLOCKWISE):
            raise LineError("the first move after G40 must be a line, G0 or G1")
        self._ended = False

    def moved(self, start: Array) -> None:
        """The last row of the state leads from `start` (9,) on the contour: put it to the side."""
        state, axes, radius = self.state, self._axes, self._radius
        i = state.count - 1
        row = state.rows[i]
        kind = int(state.marks[i, layout.KIND])
        if kind not in (CLOCKWISE, COUNTERCLOCKWISE) and np.linalg.norm(row[axes] - start[axes]) < SAME_PLACE:
            row[axes] = self._here
            return
        state.count -= 1  # a row that is refused is none
        side = self._beside(i, start)
        last, self._last = self._last, side
        if last is None:
            if side.sense:
                self._enter(side)
            elif np.linalg.norm(row[axes] - self._here) <= abs(radius) + SAME_PLACE:
                raise LineError(
                    f"the line on which cutter compensation begins must be longer than the tool's radius, "
                    f"{abs(radius):.6g} mm"
                )
            self._begins = self._here
        else:
            before = self._begins
            self._begins = side.begin
            self._corner(last, side, start[axes], before)
        state.count = side.row + 1
        state.rows[side.row, axes] = self._here = side.end

    def _enter(self, side: _Side) -> None:
        """An arc as first move: from where the tool is, tangent at its end to the arc beside the contour."""
        assert side.centre is not None
        out, way = (side.end - side.centre) / side.radius, side.end - self._here
        radius = float(way @ way) / (2.0 * float(way @ out)) if way @ out > SAME_PLACE else 0.0
        if not 0.0 < radius <= layout.LARGEST:
            raise LineError("the arc on which cutter compensation begins does not lead beside its contour; take a line")
        centre = side.end - radius * out
        self.state.rows[side.row, [layout.CENTER + axis for axis in self._axes]] = centre
        side.centre, side.radius, side.begin = centre, radius, self._here

    def _beside(self, i: int, start: Array) -> _Side:
        """Row i, which begins at `start`, beside its contour."""
        state, axes, radius = self.state, self._axes, self._radius
        row, codes = state.rows[i], state.marks[i]
        begin, end = start[axes], row[axes].copy()
        normal = np.array([[0.0, -1.0], [1.0, 0.0]])
        if codes[layout.KIND] not in (CLOCKWISE, COUNTERCLOCKWISE):
            along = (end - begin) / np.linalg.norm(end - begin)
            shift = radius * (normal @ along)
            return _Side(i, along, along, begin + shift, end + shift)
        arcs = find_arcs(Moves(start, state.rows[i : i + 1], state.marks[i : i + 1]))
        centre, sense = arcs.centre[0], 1 if arcs.sweep[0] > 0.0 else -1
        first, last = (sense * (normal @ (each - centre)) / np.linalg.norm(each - centre) for each in (begin, end))
        beside = float(arcs.last[0]) - sense * radius
        if beside <= SAME_PLACE:
            raise LineError(f"the arc's radius {arcs.last[0]:.6g} mm is too small for the tool's {abs(radius):.6g} mm")
        row[[layout.CENTER + axis for axis in axes]] = centre
        row[layout.RADIUS] = 0.0
        codes[layout.FLAGS] = codes[layout.FLAGS] & ~layout.HAS_R | layout.ABSOLUTE | sum(1 << axis for axis in axes)
        return _Side(
            i, first, last, begin + radius * (normal @ first), end + radius * (normal @ last), sense, centre, beside
        )

    def _corner(self, last: _Side, side: _Side, corner: Array, before: Array) -> None:
        """Lead from one move to the next one around the corner of the contour."""
        radius = self._radius
        sine = float(last.last[0] * side.first[1] - last.last[1] * side.first[0])
        turn = math.copysign(1.0, radius) * math.atan2(sine, float(last.last @ side.first))
        if abs(turn) < NO_CORNER:
            return
        # what leads back beside it meets an arc that bends away from the tool, and passes by everything else
        back, bend = abs(turn) > math.pi - NO_CORNER, side.sense or last.sense
        if bend * radius >= 0.0 if back else turn < 0.0:
            self._around(side, corner)
            return
        meets = [
            each for each in _meets(last, side, corner, radius)
            if last.reaches(before, each) and side.reaches(each, side.end)
        ]  # fmt: skip
        if not meets:
            raise LineError(GOUGE.format(abs(radius)))
        meet = meets[0]
        self.state.rows[last.row : side.row, self._axes] = meet
        self._begins = meet

    def _around(self, side: _Side, corner: Array) -> None:
        """An arc, or a line where the tool moves rapidly, before the row of `side`."""
        state, i = self.state, side.row
        rapid = int(state.marks[i, layout.KIND]) == RAPID
        kind = RAPID if rapid else CLOCKWISE if self._radius > 0.0 else COUNTERCLOCKWISE
        state.count = i + 1
        end = state.rows[i, : len(state.position)].copy()
        state.add(kind, end, 0, 0, int(state.marks[i, layout.ROW_LINE]))
        for rows in (state.rows, state.marks):
            rows[[i, i + 1]] = rows[[i + 1, i]]
        state.rows[i, : len(end)] = state.rows[i - 1, : len(end)] if i else end
        state.rows[i, self._axes] = side.begin
        bits = sum(1 << axis for axis in self._axes)
        state.marks[i, layout.AXES] = bits | state.marks[i + 1, layout.AXES]
        if not rapid:
            state.rows[i, [layout.CENTER + axis for axis in self._axes]] = corner
            state.marks[i, layout.FLAGS] |= layout.ABSOLUTE | bits
        side.row += 1
        self._begins = side.begin


def _meets(last: _Side, side: _Side, corner: Array, radius: float) -> list[Array]:
    """Where two moves beside the contour meet, the place nearest to the corner first."""
    if last.centre is None and side.centre is None:
        normals = (last.end + side.begin - 2.0 * corner) / radius
        return [corner + radius * normals / (1.0 + float(last.last @ side.first))]
    if last.centre is not None and side.centre is not None:
        between = side.centre - last.centre
        distance = float(np.linalg.norm(between))
        if distance < SAME_PLACE:
            return []
        along = (distance**2 + last.radius**2 - side.radius**2) / (2.0 * distance)
        foot, way, circle = last.centre + along * between / distance, between / distance, last.radius
        centre, way = last.centre, np.array([-way[1], way[0]])
    else:
        line, arc = (last, side) if last.centre is None else (side, last)
        assert arc.centre is not None
        centre, circle, way = arc.centre, arc.radius, line.first
        foot = line.begin + float((centre - line.begin) @ way) * way
        if line is last:
            foot = line.end + float((centre - line.end) @ way) * way
    height = circle**2 - float((foot - centre) @ (foot - centre))
    if height < 0.0:
        return []
    both = [foot + sign * math.sqrt(height) * way for sign in (1.0, -1.0)]
    return sorted(both, key=lambda each: float(np.linalg.norm(each - corner)))

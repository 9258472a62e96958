"""Cutter compensation [1]_: moves beside the programmed contour by the radius of the tool.

The first move is a line that ends beside its own end; convex corners become arcs around the corner (rapid moves:
lines), concave ones are cut off where the moves meet; G40 leaves the tool where it is. What the tool cannot reach
without a gouge is refused. Places of the plane are complex numbers.

References
----------
.. [1] LinuxCNC documentation, "Cutter Compensation".
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

from splinefeed.programs.gcode.arcs import find_arcs
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import LARGEST, PLANES, Flag, MoveKind, Moves
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.records import Array

#: A turn below this, rad, is no corner, and one this near to half a turn leads back: what LinuxCNC 2.9 does there, its
#: interpreter shows with pairs of lines and arcs. Places this near each other, mm, are one.
NO_CORNER, SAME_PLACE = 0.05, 1e-7
_ARCS = (MoveKind.CLOCKWISE, MoveKind.COUNTERCLOCKWISE)


@dataclass
class _Side:
    """A move beside its contour: the row, directions at its ends, where it begins and ends.

    `sense` of an arc is 1 counterclockwise, with its centre and radius beside the contour; 0 of a line.
    """

    row: int
    first: complex
    last: complex
    begin: complex
    end: complex
    sense: int = 0
    centre: complex = 0j
    radius: float = 0.0

    def reaches(self, begin: complex, end: complex) -> bool:
        """Whether `end` lies behind `begin` on the move as it is without its neighbours."""
        if not self.sense:
            return _along(end - begin, self.first) >= -SAME_PLACE
        whole, slack = self._angle(self.end) or 2.0 * math.pi, SAME_PLACE / self.radius
        low, high = (0.0 if each > 2.0 * math.pi - slack else each for each in map(self._angle, (begin, end)))
        if high == 0.0 and abs(end - self.end) < SAME_PLACE:
            high = whole
        return low <= high + slack and high <= whole + slack

    def _angle(self, end: complex) -> float:
        """How far the arc turns from its begin to another place, rad, 0 to 2 pi."""
        turned = self.sense * cmath.phase((end - self.centre) * (self.begin - self.centre).conjugate())
        return turned % (2.0 * math.pi) if abs(turned) * self.radius > SAME_PLACE else 0.0


class Cutter:
    """Moves the rows of a `ProgramState` aside, while it is `on`; radius, mm, is greater than 0 left of the contour."""

    def __init__(self, state: ProgramState) -> None:
        self.state = state
        self.on, self._radius, self.first_line = False, 0.0, 0
        self._ended = False  # G40 was the last word about it
        self._last: _Side | None = None
        self._here = self._begins = 0j
        self._axes = [0, 1]

    def _at(self, place: Array) -> complex:
        return complex(*place[self._axes])

    def _put(self, row: Array, place: complex) -> None:
        row[self._axes] = place.real, place.imag

    def begin(self, radius: float, line: int) -> None:
        """G41 (radius above 0) and G42."""
        self.first_line = line
        self.on = self.state.held = True
        self._radius, self._last = radius, None
        self._axes = list(PLANES[self.state.plane])
        self._here = self._at(self.state.position)

    def end(self) -> None:
        """G40: the tool is where it is; axes that the next line leaves out go to the contour, as in LinuxCNC."""
        self._ended |= self.on
        self.on = self.state.held = False

    def forget(self) -> None:
        """M6: the next line begins where the tool is, as in LinuxCNC, which asks the machine for its place."""
        if self._ended:
            self._put(self.state.position, self._here)
        self._ended = False

    @property
    def busy(self) -> bool:
        """Whether the next move matters to it."""
        return self.on or self._ended

    def check_exit(self, kind: int) -> None:
        """LineError for an arc as the first move behind G40, as in LinuxCNC."""
        refuse(self._ended and kind in _ARCS, "the first move after G40 must be a line, G0 or G1")
        self._ended = False

    def moved(self, start: Array) -> None:
        """The last row of the state leads from `start` (9,) on the contour: put it to the side."""
        state, i = self.state, self.state.count - 1
        ends = state.rows["end"]
        corner, end = self._at(start), self._at(ends[i])
        if state.rows["kind"][i] not in _ARCS and abs(end - corner) < SAME_PLACE:
            self._put(ends[i], self._here)
            return
        state.count -= 1  # a row that is refused is none
        side = self._beside(i, start)
        last, self._last = self._last, side
        before, self._begins = self._begins, side.begin
        if last is not None:
            self._corner(last, side, corner, before)
        elif side.sense:
            self._enter(side)
        elif abs(end - self._here) <= abs(self._radius) + SAME_PLACE:
            raise LineError(
                f"the line on which cutter compensation begins must be longer than the tool's radius, "
                f"{abs(self._radius):.6g} mm"
            )
        else:
            self._begins = self._here
        state.count = side.row + 1
        self._here = side.end
        self._put(state.rows["end"][side.row], self._here)

    def _enter(self, side: _Side) -> None:
        """An arc as first move: from where the tool is, tangent at its end to the arc beside the contour."""
        out, way = (side.end - side.centre) / side.radius, side.end - self._here
        aside = _along(way, out)
        radius = abs(way) ** 2 / (2.0 * aside) if aside > SAME_PLACE else 0.0
        if not 0.0 < radius <= LARGEST:
            raise LineError("the arc on which cutter compensation begins does not lead beside its contour; take a line")
        side.centre, side.radius, side.begin = side.end - radius * out, radius, self._here
        self._put(self.state.rows["centre"][side.row], side.centre)
        self._begins = self._here

    def _beside(self, i: int, start: Array) -> _Side:
        """Row i, which begins at `start`, beside its contour."""
        state, shift = self.state, 1j * self._radius
        row = state.rows[i]
        begin, end = self._at(start), self._at(row["end"])
        if row["kind"] not in _ARCS:
            along = (end - begin) / abs(end - begin)
            return _Side(i, along, along, begin + shift * along, end + shift * along)
        arcs = find_arcs(Moves(start, state.rows[i : i + 1]))
        centre, sense = complex(*arcs.centre[0]), 1 if arcs.sweep[0] > 0.0 else -1
        first, last = (1j * sense * (each - centre) / abs(each - centre) for each in (begin, end))
        beside = float(arcs.last[0]) - sense * self._radius
        if beside <= SAME_PLACE:
            raise LineError(
                f"the arc's radius {arcs.last[0]:.6g} mm is too small for the tool's {abs(self._radius):.6g} mm"
            )
        self._put(row["centre"], centre)
        row["radius"] = 0.0
        row["flags"] = row["flags"] & ~Flag.R | Flag.ABSOLUTE | sum(1 << a for a in self._axes)
        return _Side(i, first, last, begin + shift * first, end + shift * last, sense, centre, beside)

    def _corner(self, last: _Side, side: _Side, corner: complex, before: complex) -> None:
        """Lead from one move to the next one around the corner of the contour."""
        turn = math.copysign(1.0, self._radius) * cmath.phase(side.first * last.last.conjugate())
        if abs(turn) < NO_CORNER:
            return
        # what leads back beside it meets an arc that bends away from the tool, and passes by everything else
        back, bend = abs(turn) > math.pi - NO_CORNER, side.sense or last.sense
        if bend * self._radius >= 0.0 if back else turn < 0.0:
            self._around(side, corner)
            return
        for meet in _meets(last, side, corner, self._radius):
            if last.reaches(before, meet) and side.reaches(meet, side.end):
                for end in self.state.rows["end"][last.row : side.row]:
                    self._put(end, meet)
                self._begins = meet
                return
        raise LineError(
            f"the tool of radius {abs(self._radius):.6g} mm cannot reach this corner without a gouge; take a smaller "
            "one or a larger radius"
        )

    def _around(self, side: _Side, corner: complex) -> None:
        """An arc, or a line where the tool moves rapidly, before the row of `side`."""
        state, i = self.state, side.row
        rapid, bits = state.rows["kind"][i] == MoveKind.RAPID, sum(1 << axis for axis in self._axes)
        kind = MoveKind.RAPID if rapid else MoveKind.CLOCKWISE if self._radius > 0.0 else MoveKind.COUNTERCLOCKWISE
        state.count = i + 1
        end, axes = state.rows["end"][i].copy(), bits | int(state.rows["axes"][i])
        state.add(kind, end, axes, int(state.rows["line"][i]), flags=0 if rapid else Flag.ABSOLUTE | bits)
        state.rows[[i, i + 1]] = state.rows[[i + 1, i]]
        around = state.rows[i]
        around["end"] = state.rows["end"][i - 1] if i else end
        self._put(around["end"], side.begin)
        if not rapid:
            self._put(around["centre"], corner)
        side.row += 1
        self._begins = side.begin


def _along(way: complex, direction: complex) -> float:
    return (way * direction.conjugate()).real


def _meets(last: _Side, side: _Side, corner: complex, radius: float) -> list[complex]:
    """Where two moves beside the contour meet, the place nearest to the corner first."""
    if not (last.sense or side.sense):
        normals = (last.end + side.begin - 2.0 * corner) / radius
        return [corner + radius * normals / (1.0 + _along(last.last, side.first))]
    arc = last if last.sense else side
    if last.sense and side.sense:
        between = side.centre - last.centre
        distance = abs(between)
        if distance < SAME_PLACE:
            return []
        way = between / distance
        foot = last.centre + (distance**2 + last.radius**2 - side.radius**2) / (2.0 * distance) * way
        way *= 1j
    else:
        way, base = (side.first, side.begin) if last.sense else (last.first, last.end)
        foot = base + _along(arc.centre - base, way) * way
    height = arc.radius**2 - abs(foot - arc.centre) ** 2
    both = [foot + sign * math.sqrt(height) * way for sign in (1.0, -1.0)] if height >= 0.0 else []
    return sorted(both, key=lambda each: abs(each - corner))

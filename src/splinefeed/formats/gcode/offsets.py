"""Where the program's zero lies: G54 to G59.3, G10 and its turns, G52, the G92 family, the tool's offset of G43."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splinefeed.formats.gcode.arcs import arc_curve, find_arcs
from splinefeed.formats.gcode.expressions import LineError, refuse
from splinefeed.formats.gcode.moves import AXES, POLAR, STATED, Flag, Kind, Moves, Spline
from splinefeed.records import Array

#: Coordinate systems by their code, as G10's P numbers them.
SYSTEMS = {540: 1, 550: 2, 560: 3, 570: 4, 580: 5, 590: 6, 591: 7, 592: 8, 593: 9}
#: First parameters of the nine systems, G28, G30, G92 and the current position; those of the system in force and of the
#: tool in the spindle; the first of them all: LinuxCNC, "Parameters".
SYSTEM_PARAMETERS, SYSTEM_STEP = 5221, 20
REFERENCE_PARAMETERS = {280: 5161, 300: 5181}
G92_PARAMETERS, POSITION_PARAMETERS = 5211, 5420
SYSTEM_PARAMETER, TOOL_PARAMETER, FIRST_PARAMETER = 5220, 5400, 5211
#: Places that G28 and G30 lead to, by the name that `offsets=` has for them.
REFERENCES = {"G28": 280, "G30": 300}


class Offsets:
    """Offsets (9,), mm and rad, of the nine systems, of G92 (which G52 shares) and the tool, and the system in force.

    given  by number of the system, and places of G28 and G30 by their code
    """

    def __init__(self, given: Mapping[int, Array]) -> None:
        self.systems = {number: np.array(given.get(number, np.zeros(AXES))) for number in range(1, 10)}
        self.known = {number for number in given if number < 10}
        self.references = {code: given[code] for code in REFERENCES.values() if code in given}
        self.angles: dict[int, float] = {}  # how far systems are turned, rad, by number
        self.active = 1
        self.used: set[int] = set()
        self.g92 = np.zeros(AXES)
        self.stored = np.zeros(AXES)
        self.tool = np.zeros(AXES)
        self.tip = False  # positions are those of the tool's tip

    @property
    def total(self) -> Array:
        """What is added to a programmed position, (9,)."""
        total: Array = self.systems[self.active] + self.g92 + self.length
        return total

    @property
    def length(self) -> Array:
        """What the tool adds, (9,): nothing where positions are those of its tip."""
        return np.zeros(AXES) if self.tip else self.tool

    @property
    def frame(self) -> Frame:
        """How the system in force is turned about its zero, in the coordinates of the axes."""
        return Frame(self.angles.get(self.active, 0.0), (self.systems[self.active] + self.length)[:2])

    def parameters(self, place: Array, scale: Array) -> dict[int, float]:
        """Values of parameters by number; `place` (9,) is the tool's in the system in force, `scale` mm of one unit."""
        found = {SYSTEM_PARAMETER: float(self.active)}
        rows = {POSITION_PARAMETERS: place, G92_PARAMETERS: self.g92}
        for number, system in self.systems.items():
            first = SYSTEM_PARAMETERS + SYSTEM_STEP * (number - 1)
            rows[first], found[first + AXES] = system, math.degrees(self.angles.get(number, 0.0))
        for first, values in rows.items():
            found |= dict(enumerate((values / scale).tolist(), first))
        return found

    def select(self, number: int) -> bool:
        """Put a system in force; False where its offset from the one before is not known."""
        self.active = number
        self.used.add(number)
        return len(self.used) < 2 or number in self.known

    def set_system(self, number: int, values: Mapping[int, float], angle: float | None = None) -> None:
        """G10 L2: offsets by axis, and how far the system is turned, rad."""
        number = number or self.active
        if angle is not None:
            self.angles[number] = angle
        self.systems[number][list(values)] = list(values.values())
        self.known.add(number)

    def zero(self, values: Mapping[int, float], place: Array, number: int = 0, tool: bool = False) -> dict[int, float]:
        """What a system must be, by axis, for `place` (9,) of the machine to have the values, and the others as before.

        With `tool` what the tool must add; beside a `number` without G92 (G10 L11). A turned system moves X and Y.
        """
        shift = np.zeros(AXES) if tool and number else self.g92
        number = number or self.active
        system, turned = self.systems[number], Frame(self.angles.get(number, 0.0), np.zeros(2))
        said = turned.from_machine(place - system - self.length) - shift
        said[list(values)] = list(values.values())
        both = place - turned.to_machine(said + shift)
        zero = both - (system if tool else self.length)
        moved = values.keys() | ({0, 1} if turned.angle and values.keys() & {0, 1} else set())
        return {axis: float(zero[axis]) for axis in moved}

    def shift(self, values: Mapping[int, float], position: Array | None = None) -> None:
        """G92: the offset by which `position` (9,) gets the given values; G52, without one: the offset itself."""
        base = np.zeros(AXES) if position is None else position - self.systems[self.active] - self.length
        for axis, value in values.items():
            self.g92[axis] = value if position is None else base[axis] - value

    def clear(self, code: int) -> None:
        """G92.1 forgets the offset, G92.2 keeps it aside, G92.3 takes it up again."""
        if code == 923:
            self.g92 = self.stored.copy()
            return
        self.stored = np.zeros(AXES) if code == 921 else self.g92.copy()
        self.g92 = np.zeros(AXES)


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

    def turn_rows(self, start: Array, rows: NDArray[np.void], splines: list[Spline]) -> None:
        """Turn rows (n,) of moves that begin at `start` (9,) in the turned system, in place.

        An arc across the plane of the turn becomes the spline that it is.
        """
        if not self.angle or not len(rows):
            return
        ends, kinds, axes = rows["end"], rows["kind"], rows["axes"]
        for i in np.flatnonzero(
            (rows["plane"] != 17) & np.isin(kinds, (Kind.CLOCKWISE, Kind.COUNTERCLOCKWISE))
        ).tolist():
            begin = ends[i - 1] if i else start
            curve = arc_curve(begin, ends[i], find_arcs(Moves(begin, rows[i : i + 1])), 0, np.arange(AXES))
            weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights
            kinds[i], rows["spline"][i] = Kind.SPLINE, len(splines)
            splines.append(Spline(curve.degree, curve.knots, curve.control_points, weights, int(rows["line"][i])))
        for k in rows["spline"][kinds == Kind.SPLINE].tolist():
            splines[k] = replace(splines[k], points=self.to_machine(splines[k].points))
        ends[:] = self.to_machine(ends)
        centre, absolute = rows["centre"][:, :2], rows["flags"] & Flag.ABSOLUTE != 0
        base = np.where(absolute[:, None], self.centre, 0.0)
        centre[:] = base + (centre - base) @ self._matrix
        xy, stated = 0b11, 0b11 << STATED
        moved, both = np.where(axes & xy, xy, 0), np.where(axes & stated == stated, stated, 0)
        axes[:] = axes & ~(xy | stated) | moved | both  # one word moves X and Y, and states none of them


def from_polar(words: Mapping[str, float], x: float, y: float, relative: bool) -> dict[str, float]:
    """Axis words with X and Y in place of @, the distance from zero, and ^, the angle in degrees, at the place x, y.

    What is not said stays; `relative` (G91) both are steps, and so are X and Y then. LineError where they say nothing.
    """
    refuse(words.keys() & {"X", "Y"}, "X or Y beside polar coordinates (@, ^); write one or the other")
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

"""Where the program's zero lies: G54 to G59.3, G10, G52, the G92 family and the tool's offset of G43."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from splinefeed.formats.gcode.moves import AXES
from splinefeed.formats.gcode.turned import Frame
from splinefeed.records import Array

#: Coordinate systems by their code, as G10's P numbers them.
SYSTEMS = {540: 1, 550: 2, 560: 3, 570: 4, 580: 5, 590: 6, 591: 7, 592: 8, 593: 9}
#: First parameters of the nine systems, of G28, G30, G92 and of the current position: LinuxCNC, "Parameters".
SYSTEM_PARAMETERS, SYSTEM_STEP = 5221, 20
REFERENCE_PARAMETERS = {280: 5161, 300: 5181}
#: Places that G28 and G30 lead to, by the name that `offsets=` has for them.
REFERENCES = {"G28": 280, "G30": 300}
G92_PARAMETERS, POSITION_PARAMETERS = 5211, 5420
#: Number of the system in force, and of the tool in the spindle.
SYSTEM_PARAMETER, TOOL_PARAMETER = 5220, 5400


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

    def select(self, number: int) -> bool:
        """Put a system in force; False where its offset from the one before is not known."""
        self.active = number
        self.used.add(number)
        return len(self.used) < 2 or number in self.known

    def set_system(self, number: int, values: Mapping[int, float], angle: float | None = None) -> None:
        """G10 L2: offsets by axis, and how far the system is turned, rad."""
        system = self.systems[number or self.active]
        if angle is not None:
            self.angles[number or self.active] = angle
        for axis, value in values.items():
            system[axis] = value
        self.known.add(number or self.active)

    def set_here(self, number: int, values: Mapping[int, float], place: Array) -> None:
        """G10 L20: the system in which `place` (9,) of the machine has the given values."""
        number = number or self.active
        zero = self._zero(number, values, place, self.g92)
        self.set_system(number, {axis: value - self.length[axis] for axis, value in zero.items()})

    def tool_by(self, values: Mapping[int, float], place: Array, fixture: bool) -> dict[int, float]:
        """G10 L10: the tool's offset by axis with which `place` (9,) has the values; L11: in G59.3 without G92."""
        number, shift = (SYSTEMS[593], np.zeros(AXES)) if fixture else (self.active, self.g92)
        zero = self._zero(number, values, place, shift)
        return {axis: value - self.systems[number][axis] for axis, value in zero.items()}

    def _zero(self, number: int, values: Mapping[int, float], place: Array, shift: Array) -> dict[int, float]:
        """What a system and the tool must add, by axis, for `place` (9,) to have the values, and the others as before.

        A system that is turned moves X and Y together.
        """
        turned = Frame(self.angles.get(number, 0.0), np.zeros(2))
        said = turned.from_machine(place - self.systems[number] - self.length) - shift
        for axis, value in values.items():
            said[axis] = value
        zero = place - turned.to_machine(said + shift)
        moved = values.keys() | ({0, 1} if turned.angle and values.keys() & {0, 1} else set())
        return {axis: float(zero[axis]) for axis in moved}

    def set_g92(self, values: Mapping[int, float], position: Array) -> None:
        """G92: the offset by which `position` (9,) gets the given values."""
        for axis, value in values.items():
            self.g92[axis] = position[axis] - self.systems[self.active][axis] - self.length[axis] - value

    def set_local(self, values: Mapping[int, float]) -> None:
        """G52: the offset itself."""
        for axis, value in values.items():
            self.g92[axis] = value

    def clear(self, code: int) -> None:
        """G92.1 forgets the offset, G92.2 keeps it aside, G92.3 takes it up again."""
        if code == 923:
            self.g92 = self.stored.copy()
            return
        self.stored = np.zeros(AXES) if code == 921 else self.g92.copy()
        self.g92 = np.zeros(AXES)

"""Where the program's zero lies: G54 to G59.3, G10, G52, the G92 family, the tool's offset of G43."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.moves import AXES
from splinefeed.records import Array

#: Coordinate systems by their code, as G10's P numbers them.
SYSTEMS = {540: 1, 550: 2, 560: 3, 570: 4, 580: 5, 590: 6, 591: 7, 592: 8, 593: 9}
#: Number of the system before G54.1 P1, which Haas calls G154 P1, and the highest P.
MORE_SYSTEMS, MOST_SYSTEMS = 1000, 300
#: First parameters of the nine systems, G28, G30, G92 and the current position; those of the system in force and of the
#: tool in the spindle; the first of them all: LinuxCNC, "Parameters".
SYSTEM_PARAMETERS, SYSTEM_STEP = 5221, 20
REFERENCE_PARAMETERS = {280: 5161, 300: 5181}
G92_PARAMETERS, POSITION_PARAMETERS = 5211, 5420
SYSTEM_PARAMETER, TOOL_PARAMETER, FIRST_PARAMETER = 5220, 5400, 5211
#: Places that G28 and G30 lead to, by the name that `offsets=` has for them.
REFERENCES = {"G28": 280, "G30": 300}


class Offsets:
    """Offsets of the nine systems, of G92 (which G52 shares) and of the tool, and the system in force.

    Parameters
    ----------
    given : mapping of int to array (9,)
        By number of the system, and places of G28 and G30 by their code; mm and rad.
    """

    def __init__(self, given: Mapping[int, Array]) -> None:
        self.systems = {number: np.array(given.get(number, np.zeros(AXES))) for number in range(1, 10)}
        self.systems |= {number: np.array(given[number]) for number in given if number > MORE_SYSTEMS}
        self.known = {number for number in given if number not in REFERENCES.values()}
        self._given = bool(self.known)
        self.references = {code: given[code] for code in REFERENCES.values() if code in given}
        self.external = np.zeros(AXES)  # of all systems (Fanuc's G10 L2 P0)
        self.active = 1
        self.used: set[int] = set()
        self.g92 = np.zeros(AXES)
        self.stored = np.zeros(AXES)
        self.tool = np.zeros(AXES)
        self.tip = False  # positions are those of the tool's tip

    @property
    def total(self) -> Array:
        """What is added to a programmed position, (9,)."""
        total: Array = self.systems[self.active] + self.external + self.g92 + self.length
        return total

    @property
    def length(self) -> Array:
        """What the tool adds, (9,): nothing where positions are those of its tip."""
        return np.zeros(AXES) if self.tip else self.tool

    def parameters(self, place: Array, scale: Array) -> dict[int, float]:
        """Values of parameters by number; `place` (9,) is the tool's in the system in force, `scale` mm of one unit."""
        found = {SYSTEM_PARAMETER: float(self.active)}
        rows = {POSITION_PARAMETERS: place, G92_PARAMETERS: self.g92}
        for number in SYSTEMS.values():
            system = self.systems[number]
            first = SYSTEM_PARAMETERS + SYSTEM_STEP * (number - 1)
            rows[first], found[first + AXES] = system, 0.0  # how far it is turned
        for first, values in rows.items():
            found |= dict(enumerate((values / scale).tolist(), first))
        return found

    def select(self, number: int, moved: bool = False) -> int:
        """Put a system in force.

        Parameters
        ----------
        number : int
            Of the system.
        moved : bool, optional
            Whether there were places in the system before; offsets that the user gives are from the first system.

        Returns
        -------
        int
            Number of a system whose offset from the others is not known; 0 where all is known.
        """
        self.used |= {self.active} if moved else set()
        self.active = number
        self.systems.setdefault(number, np.zeros(AXES))
        self.used.add(number)
        unknown = ({number} if self._given else self.used) - self.known
        return 0 if len(self.used) < 2 or not unknown else number if number in unknown else min(unknown)

    def set_system(self, number: int, values: Mapping[int, float], added: bool = False) -> None:
        """G10 L2: offsets by axis, or what is added to them."""
        number = number or self.active
        system = self.systems.setdefault(number, np.zeros(AXES))
        system[list(values)] = list(values.values()) + system[list(values)] * added
        self.known.add(number)

    def zero(self, values: Mapping[int, float], place: Array, number: int = 0, tool: bool = False) -> dict[int, float]:
        """What a system must be, by axis, for `place` (9,) of the machine to have the values.

        With `tool` what the tool must add; beside a `number` without G92 (G10 L11).
        """
        system = self.systems[number or self.active] + self.external
        zero = place - (system if tool else self.length) - (0.0 if tool and number else self.g92)
        return {axis: float(zero[axis]) - value for axis, value in values.items()}

    def shift(self, values: Mapping[int, float], position: Array | None = None) -> None:
        """G92: the offset by which `position` (9,) gets the given values; G52, without one: the offset itself."""
        base = (
            np.zeros(AXES) if position is None else position - self.systems[self.active] - self.external - self.length
        )
        for axis, value in values.items():
            self.g92[axis] = value if position is None else base[axis] - value

    def clear(self, code: int) -> None:
        """G92.1 forgets the offset, G92.2 keeps it aside, G92.3 takes it up again."""
        if code == 923:
            self.g92 = self.stored.copy()
            return
        self.stored = np.zeros(AXES) if code == 921 else self.g92.copy()
        self.g92 = np.zeros(AXES)


def system_name(number: int) -> str:
    """The code of a coordinate system by its number: G54, or G54.1 P1 (G154 P1)."""
    codes = {each: code for code, each in SYSTEMS.items()}
    return g_name(codes[number]) if number in codes else f"G54.1 P{number - MORE_SYSTEMS}"

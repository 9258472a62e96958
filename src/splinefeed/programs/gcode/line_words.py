"""The words of one line, each taken once by the code that it belongs to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set

from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import LETTERS
from splinefeed.programs.gcode.state import ProgramState


class LineWords(dict[str, float]):
    """Values by letter; what no code takes belongs to none of them. `whole` are letters without a decimal point."""

    whole: Set[str] = frozenset()

    def need(self, letter: str, name: str) -> float:
        """Take a word that the code called `name` cannot do without."""
        refuse(letter not in self, f"{name} needs {letter}")
        return self.pop(letter)

    def need_whole(self, letter: str, name: str) -> int:
        """Take a whole number from 0."""
        value = self.need(letter, name)
        if not 0.0 <= value < 1e9 or abs(value - round(value)) > 1e-4:
            raise LineError(f"{letter}{value:g} of {name} is not a whole number from 0")
        return round(value)

    def axes(self, state: ProgramState) -> dict[int, float]:
        """Take the words of axes, in mm or rad by axis."""
        return {axis: state.scaled(axis, self.pop(letter)) for axis, letter in enumerate(LETTERS) if letter in self}

    def wait(self, dwell: float, pointed: float | None) -> float:
        """Take P, a time, in s: `dwell` s a unit, or `pointed` where P has a decimal point; not a number without P."""
        unit = dwell if pointed is None or "P" in self.whole else pointed
        return self.pop("P", math.nan) * unit

    def check_used(self, names: Mapping[str, str]) -> None:
        """LineError for a word that nothing has taken; `names` of words that the dialect calls otherwise."""
        if self:
            letter, value = next(iter(self.items()))
            hint = "; a number has no exponent, and E is a printer's (option dialect)" * (letter == "E")
            raise LineError(f"{names.get(letter, letter)}{value:g} is used by no code of the line{hint}")

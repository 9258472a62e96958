"""The words of one line, which are taken one after the other by the codes that they belong to."""

from __future__ import annotations

import math

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import LETTERS, RAPID
from splinefeed.formats.gcode.state import State
from splinefeed.records import Array

#: Most turns of one arc.
MAX_TURNS = 1_000


class LineWords:
    """Values by letter; what is left when all codes of a line have taken theirs belongs to none of them."""

    def __init__(self, state: State) -> None:
        self.state = state
        self._words: dict[str, float] = {}

    def _take(self, letter: str, otherwise: float | None = None) -> float | None:
        """The value of a word, which is then done with."""
        return self._words.pop(letter, otherwise)

    def _need(self, letter: str, code: int) -> float:
        value = self._take(letter)
        if value is None:
            raise LineError(f"{g_name(code)} needs {letter}")
        return value

    def _whole(self, letter: str, code: int) -> int:
        value = self._need(letter, code)
        if abs(value) > 1e6 or abs(value - round(value)) > 1e-4:
            raise LineError(f"{letter}{value:g} of {g_name(code)} is not a whole number")
        return round(value)

    def _axes(self) -> dict[int, float]:
        """Axis words as values in mm or rad by axis, which are then done with."""
        found = {axis: self._take(letter) for axis, letter in enumerate(LETTERS) if letter in self._words}
        return {axis: self.state.scaled(axis, value) for axis, value in found.items() if value is not None}

    def _feed(self, kind: int, there: Array) -> dict[str, float]:
        """The feed of a move to `there` (9,) by inverse time, on its own line, or by G96 at its mean X."""
        state = self.state
        if state.modes[layout.FEED_MODE] == layout.SURFACE and kind != RAPID:
            middle = 0.5 * (there[0] + state.position[0]) - state.values[layout.OFFSET]
            return {"feed": state.feed_per_turn * state.turns(float(middle))}
        if state.modes[layout.FEED_MODE] != layout.INVERSE:
            return {}
        feed = self._take("F")
        if kind == RAPID:
            return {}
        if feed is None:
            raise LineError("F is missing; in inverse time (G93) every move needs its own")
        return {"feed": feed, "flags": layout.INVERSE_FEED}

    def _arc(self) -> dict[str, float]:
        state = self.state
        across = "IJK"[state.across]
        if self._words.get(across) == 0.0:  # as FreeCAD writes it beside I and J
            self._take(across)
        if across in self._words:
            plane = state.modes[layout.PLANE]
            raise LineError(f"{across} lies across the plane G{plane}; choose another plane or leave it out")
        turns = self._take("P", 1.0) or 0.0
        if not 1.0 <= turns <= MAX_TURNS or turns != math.floor(turns):
            raise LineError(f"P{turns:g}: the turns of an arc must be whole, 1 to {MAX_TURNS}")
        radius = self._take("R")
        offsets = {k: self._take(letter) for k, letter in enumerate("IJK") if letter in self._words}
        if (radius is None) == (not offsets):
            both = "both are given" if offsets else "none is given"
            raise LineError(f"an arc needs its centre (I, J, K) or its radius (R), and {both}")
        if radius is not None:
            scaled = state.scaled(0, radius)
            return {"radius": scaled, "turns": turns, "flags": layout.HAS_R} | self._checked(scaled)
        flags = 0
        more: dict[str, float] = {"turns": turns}
        for k, value in offsets.items():
            base = state.values[layout.OFFSET + k] if state.modes[layout.CENTRES] else 0.0
            more["ijk"[k]] = base + state.scaled(k, value or 0.0)
            self._checked(more["ijk"[k]])
            flags |= 1 << k
        if state.modes[layout.CENTRES]:
            flags |= layout.ABSOLUTE
            if flags & 7 != 7 & ~(1 << state.across):
                raise LineError("with G90.1 an arc needs both words of its centre")
        return {**more, "flags": flags}

    @staticmethod
    def _checked(value: float) -> dict[str, float]:
        if not abs(value) <= layout.LARGEST:
            raise LineError(f"the centre or radius of the arc, {value:g} mm, is too large")
        return {}

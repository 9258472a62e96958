"""Canned cycles: G73, G74, G81 to G86 and G89 as the moves and switches that they stand for.

Source: LinuxCNC documentation, "G-Codes", G73, G74, "G80-G89 Canned Cycles", G98 and G99; where it leaves a choice,
what its interpreter does: with G91 R counts from the plane in which the row of cycles began, and Z from R. Fanuc
(Series 30i-MODEL B, User's Manual B-64484EN, "Canned cycle for drilling") keeps R, Z, P and Q from one cycle to the
next, repeats by K, and returns to the initial plane, or with G99 to R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import LETTERS, LINE, RAPID
from splinefeed.formats.gcode.state import State, check_size

#: Most moves that one line may stand for, and most repeats.
MAX_MOVES, MAX_REPEATS = 100_000, 10_000
#: How far a peck goes back, or stays above the bottom of the last one, mm: LinuxCNC's 0.010 in.
PECK_CLEARANCE = 0.254
#: Levels this near each other, mm, are one: a peck that ends at the bottom is the last.
SAME_LEVEL = 1e-9
#: The axis across each plane, which is drilled along.
_ACROSS = {17: 2, 18: 1, 19: 0}


@dataclass(frozen=True)
class Cycle:
    """What a cycle does beyond drilling from R to Z.

    peck     "chip" lifts off the bottom after each Q, "full" returns to R; dwell  whether P is needed
    out      how the tool leaves; to_r  as far as R only, and rapidly from there
    spindle  M code of the direction in which it must turn; it is reversed at the bottom. stops  whether it stops there
    """

    peck: str = ""
    dwell: bool = False
    out: int = RAPID
    to_r: bool = False
    spindle: int = 0
    stops: bool = False


CYCLES = {
    730: Cycle(peck="chip"),
    740: Cycle(out=LINE, spindle=4),
    810: Cycle(),
    820: Cycle(dwell=True),
    830: Cycle(peck="full"),
    840: Cycle(out=LINE, spindle=3),
    850: Cycle(out=LINE, to_r=True),
    860: Cycle(dwell=True, stops=True),
    890: Cycle(dwell=True, out=LINE),
}


class Cycles:
    """Runs one cycle after the other on a `State`; R, Z, P and Q stay in force as long as the cycle does."""

    def __init__(self, state: State, dialect: Dialect) -> None:
        self.state, self.dialect = state, dialect
        self.returns = dialect.returns
        self._code = 0
        self._kept: dict[str, float] = {}
        self._initial = 0.0

    def forget(self) -> None:
        """Another kind of motion, or G80, ends the row of cycles."""
        self._code, self._kept = 0, {}

    def line(self, code: int, words: dict[str, float], line: int) -> None:
        """One line of the cycle `code`; the words that it uses are taken from `words`."""
        state, cycle = self.state, CYCLES[code]
        if state.modes[layout.INVERSE]:
            raise LineError(f"{g_name(code)} cannot have feeds by inverse time; write G94")
        across = _ACROSS[int(state.modes[layout.PLANE])]
        axes = {letter: words.pop(letter) for letter in LETTERS if letter in words}
        if wrong := next((letter for letter in axes if letter not in "XYZ"), ""):
            raise LineError(f"{wrong}: {g_name(code)} moves X, Y and Z only")
        if not axes:
            raise LineError(f"{g_name(code)} needs the place of its hole, X, Y or Z")
        if not self._code:
            self._initial = float(state.position[across] - state.values[layout.OFFSET + across])
        if code != self._code and not self.dialect.keeps_cycles:
            self._kept = {}
        self._code = code
        depth = LETTERS[across]
        own = "RQ" if cycle.peck else "RP" if cycle.dwell or cycle.spindle else "R"
        self._kept |= {letter: words.pop(letter) for letter in own if letter in words}
        if depth in axes:
            self._kept["depth"] = axes.pop(depth)
        optional = cycle.spindle or self.dialect.keeps_cycles
        for letter in ("depth", *(own.strip("P") if optional else own)):
            if letter not in self._kept:
                raise LineError(f"{g_name(code)} needs {depth if letter == 'depth' else letter}")
        clearance = state.scaled(across, words.pop("D")) if cycle.peck and "D" in words else PECK_CLEARANCE
        times = self._repeats(code, words)
        relative = bool(state.modes[layout.RELATIVE])
        zero = float(state.values[layout.OFFSET + across])
        initial = zero + self._initial
        base = initial if relative else zero
        retract = base + state.scaled(across, self._kept["R"])
        bottom = (retract if relative else base) + state.scaled(across, self._kept["depth"])
        for letter, level in (("R", retract), (depth, bottom)):
            check_size(letter, level)
        if retract < bottom:
            raise LineError(f"{g_name(code)}: R lies {bottom - retract:.6g} mm below {depth}, the bottom of the hole")
        clear = max(initial, retract) if self.returns == 98 else retract
        hole = _Hole(self, code, cycle, across, line, retract, bottom, clear, clearance)
        hole.check(times)
        if times and initial < retract:
            hole.move(RAPID, retract)
        for _ in range(times):
            there, said, stated = state.target(axes)
            there[across] = state.position[across] if state.position[across] > retract else clear
            if any(there[axis] != state.position[axis] for axis in range(3)):
                state.add(RAPID, there, said, stated, line)
            hole.drill()

    def _repeats(self, code: int, words: dict[str, float]) -> int:
        """How often; LinuxCNC's L is at least 1, Fanuc's K may be 0, which only keeps the words."""
        letters = [letter for letter in self.dialect.repeats if letter in words]
        times = words.pop(letters[0]) if letters else 1.0
        least = 0 if self.dialect.keeps_cycles else 1
        if not least <= times <= MAX_REPEATS or times != math.floor(times):
            raise LineError(f"{letters[0]}{times:g}: repeats of {g_name(code)} are whole, {least} to {MAX_REPEATS}")
        return int(times)


@dataclass
class _Hole:
    """One line's cycle along its axis; levels in mm."""

    cycles: Cycles
    code: int
    cycle: Cycle
    across: int
    line: int
    retract: float
    bottom: float
    clear: float  # where the tool ends: G98 the plane in which the row began, if that is higher, G99 R
    clearance: float

    def check(self, times: int) -> None:
        """LineError for a spindle that turns the wrong way, for no peck, and for too many."""
        state, cycle = self.cycles.state, self.cycle
        if cycle.spindle and state.spindle != cycle.spindle and not self.cycles.dialect.keeps_cycles:
            raise LineError(f"{g_name(self.code)} needs the spindle to turn by M{cycle.spindle}")
        if cycle.stops and not state.spindle:
            raise LineError(f"{g_name(self.code)} needs the spindle to turn; write M3 or M4 before it")
        if not cycle.peck:
            return
        if not self.peck > 0.0:
            raise LineError(f"{g_name(self.code)} Q{self.cycles._kept['Q']:g}: the depth of a peck is greater than 0")
        if times * 3.0 * (self.retract - self.bottom) > MAX_MOVES * self.peck:
            raise LineError(f"{g_name(self.code)} stands for more than {MAX_MOVES} moves; drill deeper at a time (Q)")

    @property
    def peck(self) -> float:
        """Depth of one peck, mm."""
        return self.cycles.state.scaled(self.across, self.cycles._kept.get("Q", 0.0))

    def move(self, kind: int, level: float) -> None:
        """Along the axis of the hole, unless the tool is there."""
        state = self.cycles.state
        if state.position[self.across] == level:
            return
        there = state.position.copy()
        there[self.across] = level
        state.add(kind, there, 1 << self.across, 0 if state.modes[layout.RELATIVE] else 1 << self.across, self.line)

    def drill(self) -> None:
        """From above the hole to its bottom and out again."""
        state, cycle = self.cycles.state, self.cycle
        self.move(RAPID, self.retract)
        level = self.retract - self.peck
        while cycle.peck and level > self.bottom + SAME_LEVEL:
            self.move(LINE, level)
            if cycle.peck == "full":
                self.move(RAPID, self.retract)
            # a peck less than the clearance begins above the retract plane, as in LinuxCNC
            self.move(RAPID, level + self.clearance)
            level -= self.peck
        self.move(LINE, self.bottom)
        turning = state.spindle
        if cycle.spindle:
            self._switch(5, 7 - turning if turning else 0)
        if wait := self.cycles._kept.get("P", 0.0) * self.cycles.dialect.dwell if cycle.dwell or cycle.spindle else 0.0:
            if not 0.0 <= wait <= layout.LARGEST:
                raise LineError(f"{g_name(self.code)}: a wait of {wait:g} s is not possible")
            state.say(self.line, dwell=wait)
        if cycle.stops:
            self._switch(5)
        self.move(cycle.out, self.retract if cycle.to_r else self.clear)
        self.move(RAPID, self.clear)
        if cycle.spindle:
            self._switch(5, turning)
        elif cycle.stops:
            self._switch(turning)

    def _switch(self, *codes: int) -> None:
        """M codes of the spindle, one marker each."""
        for code in codes:
            if code:
                self.cycles.state.say(self.line, f"M{code}")

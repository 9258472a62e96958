"""Canned cycles: G73, G74, G81 to G86, G89, and Fanuc's G76, G87 and G88, as the moves that they stand for.

Source: LinuxCNC documentation, "G-Codes", G73, G74, "G80-G89 Canned Cycles", G98 and G99; where it leaves a choice,
what its interpreter does: with G91 R counts from the plane in which the row of cycles began, and Z from R. Fanuc
(Series 30i-MODEL B, User's Manual B-64484EN, "Canned cycle for drilling") keeps R, Z, P and Q from one cycle to the
next, repeats by K, returns to the initial plane, or with G99 to R, and taps by pecks where G74 and G84 have Q; for
G76, G87 and G88 also Series 15i/150i-MA, Operator's Manual (Programming), "Canned cycle".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import LETTERS, LINE, POLAR, RAPID, Findings
from splinefeed.formats.gcode.state import UNSAID, State, check_size

#: Most moves that one line may stand for, and most repeats.
MAX_MOVES, MAX_REPEATS = 100_000, 10_000
#: How far a peck goes back, or stays above the bottom of the last one, mm: LinuxCNC's 0.010 in.
PECK_CLEARANCE = 0.254
#: Levels this near each other, mm, are one: a peck that ends at the bottom is the last.
SAME_LEVEL = 1e-9


@dataclass(frozen=True)
class Cycle:
    """What a cycle does beyond drilling from R to Z.

    peck     "chip" lifts off the bottom after each Q, "full" returns to R; dwell  whether P is needed
    out      how the tool leaves; to_r  as far as R only, and rapidly from there
    spindle  M code of the direction in which it must turn; it is reversed at the bottom. stops  whether it stops there
    shift    whether the spindle is oriented and the tool leaves the wall by Q before it goes out; back  whether it cuts
             upwards, from R to Z; by_hand  whether the machine waits for a retract by hand
    """

    peck: str = ""
    dwell: bool = False
    out: int = RAPID
    to_r: bool = False
    spindle: int = 0
    stops: bool = False
    shift: bool = False
    back: bool = False
    by_hand: bool = False


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
FANUC = CYCLES | {
    740: Cycle(peck="tap", out=LINE, spindle=4),
    760: Cycle(dwell=True, shift=True),
    840: Cycle(peck="tap", out=LINE, spindle=3),
    870: Cycle(dwell=True, shift=True, back=True),
    880: Cycle(dwell=True, stops=True, by_hand=True),
}


class Cycles:
    """Runs one cycle after the other on a `State`; R, Z, P and Q stay in force as long as the cycle does."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings) -> None:
        self.state, self.dialect, self.findings = state, dialect, findings
        state.returns = dialect.returns
        self.known = FANUC if dialect.keeps_cycles else CYCLES
        self.first_line = 0  # where the row of cycles began; 0 where there is none
        self._code = 0
        self._kept: dict[str, float] = {}
        self._initial = 0.0

    def forget(self) -> None:
        """Another kind of motion, or G80, ends the row of cycles."""
        self._code, self._kept, self.first_line = 0, {}, 0

    def line(self, code: int, words: dict[str, float], line: int) -> None:
        """One line of the cycle `code`; the words that it uses are taken from `words`."""
        state, cycle = self.state, self.known[code]
        if state.modes[layout.FEED_MODE] == layout.INVERSE:
            raise LineError(f"{g_name(code)} cannot have feeds by inverse time; write G94")
        across = state.across
        axes = {letter: words.pop(letter) for letter in LETTERS + POLAR if letter in words}
        if wrong := next((letter for letter in axes if letter not in "XYZ" + POLAR), ""):
            raise LineError(f"{wrong}: {g_name(code)} moves X, Y and Z only")
        if not axes:
            raise LineError(f"{g_name(code)} needs the place of its hole, X, Y or Z")
        if not self._code:
            self._initial = float(state.position[across] - state.values[layout.OFFSET + across])
            self.first_line = line
        if code != self._code and not self.dialect.keeps_cycles:
            self._kept = {}
        self._code = code
        depth = LETTERS[across]
        own = "R" + "Q" * bool(cycle.peck or cycle.shift) + "P" * bool(cycle.dwell or cycle.spindle)
        self._kept |= {letter: words.pop(letter) for letter in own if letter in words}
        if depth in axes:
            self._kept["depth"] = axes.pop(depth)
        optional = "P" * bool(cycle.spindle or self.dialect.keeps_cycles) + "Q" * (cycle.peck == "tap")
        for letter in ("depth", *(each for each in own if each not in optional)):
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
        if cycle.back:
            retract, bottom = bottom, retract
        if retract < bottom:
            below = f"above {depth}, to which it cuts" if cycle.back else f"below {depth}, the bottom of the hole"
            raise LineError(f"{g_name(code)}: R lies {bottom - retract:.6g} mm {below}")
        clear = max(initial, retract) if state.returns == 98 or cycle.back else retract
        hole = _Hole(state, across, line, self, code, cycle, retract, bottom, clear, clearance)
        hole.check(times)
        if times and initial < retract and not cycle.back:
            hole.move(RAPID, retract)
        before = float(state.values[layout.TOLERANCE]), int(state.modes[layout.EXACT_STOP])
        if self.dialect.of_linuxcnc and before[0] != UNSAID:
            state.values[layout.TOLERANCE] = state.modes[layout.EXACT_STOP] = 0  # exact path, as in LinuxCNC
        for _ in range(times):
            there, said, stated = state.target(axes)
            there[across] = state.position[across] if state.position[across] > retract else clear
            if any(there[axis] != state.position[axis] for axis in range(3)):
                state.add(RAPID, there, said, stated, line)
            hole.drill()
        state.values[layout.TOLERANCE], state.modes[layout.EXACT_STOP] = before

    def _repeats(self, code: int, words: dict[str, float]) -> int:
        """How often; LinuxCNC's L is at least 1, Fanuc's K may be 0, which only keeps the words."""
        letters = [letter for letter in self.dialect.repeats if letter in words]
        times = words.pop(letters[0]) if letters else 1.0
        least = 0 if self.dialect.keeps_cycles else 1
        if not least <= times <= MAX_REPEATS or times != math.floor(times):
            raise LineError(f"{letters[0]}{times:g}: repeats of {g_name(code)} are whole, {least} to {MAX_REPEATS}")
        return int(times)


@dataclass
class Along:
    """Moves of the tool along one axis, in one line; levels in mm."""

    state: State
    across: int
    line: int

    def move(self, kind: int, level: float, feed: float | None = None) -> None:
        """Along the axis of the hole, unless the tool is there."""
        self.go(kind, self.across, level, feed)

    def go(self, kind: int, axis: int, level: float, feed: float | None = None) -> None:
        """Along an axis, unless the tool is there."""
        state = self.state
        if state.position[axis] == level:
            return
        there = state.position.copy()
        there[axis] = level
        stated = 0 if state.modes[layout.RELATIVE] else 1 << axis
        state.add(kind, there, 1 << axis, stated, self.line, **({} if feed is None else {"feed": feed}))

    def switch(self, *codes: int) -> None:
        """M codes, one marker each; 0 is none."""
        for code in codes:
            if code:
                self.state.say(self.line, f"M{code}")

    def wait(self, seconds: float, name: str) -> None:
        """A dwell, unless it is 0; LineError for one that cannot be."""
        if not 0.0 <= seconds <= layout.LARGEST:
            raise LineError(f"{name}: a wait of {seconds:g} s is not possible")
        if seconds:
            self.state.say(self.line, dwell=seconds)


@dataclass
class _Hole(Along):
    """One line's cycle along its axis."""

    cycles: Cycles
    code: int
    cycle: Cycle
    retract: float
    bottom: float
    clear: float  # where the tool ends: G98 the plane in which the row began, if that is higher, G99 R
    clearance: float

    def check(self, times: int) -> None:
        """LineError for a spindle that turns the wrong way, for no peck, and for too many."""
        state, cycle = self.state, self.cycle
        if cycle.spindle and state.spindle != cycle.spindle and not self.cycles.dialect.keeps_cycles:
            raise LineError(f"{g_name(self.code)} needs the spindle to turn by M{cycle.spindle}")
        if (cycle.stops or cycle.shift) and not state.spindle:
            raise LineError(f"{g_name(self.code)} needs the spindle to turn; write M3 or M4 before it")
        if not (cycle.peck and "Q" in self.cycles._kept):
            return
        if not self.peck > 0.0:
            raise LineError(f"{g_name(self.code)} Q{self.cycles._kept['Q']:g}: the depth of a peck is greater than 0")
        if times * 3.0 * (self.retract - self.bottom) > MAX_MOVES * self.peck:
            raise LineError(f"{g_name(self.code)} makes more than {MAX_MOVES} moves; drill deeper at a time (Q)")

    @property
    def peck(self) -> float:
        """Depth of one peck, mm; without Q that of the hole."""
        deep = self.retract - self.bottom
        kept = self.cycles._kept
        return self.state.scaled(self.across, kept["Q"]) if "Q" in kept else deep

    @property
    def dwell(self) -> float:
        """Seconds of P."""
        cycle = self.cycle
        return self.cycles._kept.get("P", 0.0) * self.cycles.dialect.dwell if cycle.dwell or cycle.spindle else 0.0

    def drill(self) -> None:
        """From above the hole to its bottom and out again."""
        if self.cycle.back:
            self._bore_upwards()
            return
        cycle, name, turning = self.cycle, g_name(self.code), self.state.spindle
        self.move(RAPID, self.retract)
        level = self.retract - self.peck
        while cycle.peck and level > self.bottom + SAME_LEVEL:
            self.move(LINE, level)
            if cycle.peck == "tap":
                self._reverse(turning)
                self.move(LINE, self.retract)
                self.switch(5, turning)
            elif cycle.peck == "full":
                self.move(RAPID, self.retract)
            if cycle.peck != "tap":
                # a peck less than the clearance begins above the retract plane, as in LinuxCNC
                self.move(RAPID, level + self.clearance)
            level -= self.peck
        self.move(LINE, self.bottom)
        if cycle.spindle:
            self._reverse(turning)
        else:
            self.wait(self.dwell, name)
        if cycle.stops:
            self.switch(5)
        if cycle.by_hand:
            self.cycles.findings.count(f"{name} waits for a retract by hand to R, which is taken as rapid", self.line)
            self.state.say(self.line, "M0")
        away = self._shifted() if cycle.shift else None
        self.move(cycle.out, self.retract if cycle.to_r else self.clear)
        self.move(RAPID, self.clear)
        if away is not None:
            self.go(RAPID, self.aside, away)
        if cycle.spindle:
            self.switch(5, turning)
        elif cycle.stops or cycle.shift:
            self.switch(turning)

    def _reverse(self, turning: int) -> None:
        """At the bottom of a tapped hole: the other direction, then P."""
        self.switch(5, 7 - turning if turning else 0)
        self.wait(self.dwell, g_name(self.code))

    @property
    def aside(self) -> int:
        """The first axis of the plane, along which the tool leaves the wall."""
        return (self.across + 1) % 3

    def _shifted(self) -> float:
        """Orient the spindle and leave the wall by Q, rapidly: where the tool was before."""
        self.switch(19)
        here = float(self.state.position[self.aside])
        self.cycles.findings.count(
            f"{g_name(self.code)} leaves the wall by Q in the direction +{LETTERS[self.aside]}; which one it is "
            "the control has in a parameter",
            self.line,
        )
        self.go(RAPID, self.aside, here + abs(self.state.scaled(self.aside, self.cycles._kept["Q"])))
        return here

    def _bore_upwards(self) -> None:
        """G87: beside the hole to R, back to its axis, up to Z, beside it again and out."""
        turning, name = self.state.spindle, g_name(self.code)
        here = self._shifted()
        self.move(RAPID, self.bottom)
        self.go(RAPID, self.aside, here)
        self.switch(turning)
        self.move(LINE, self.retract)
        self.wait(self.dwell, name)
        self._shifted()
        self.move(RAPID, self.clear)
        self.go(RAPID, self.aside, here)
        self.switch(turning)

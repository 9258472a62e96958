"""Canned cycles: rows of steps, by code: LinuxCNC's and Fanuc's G73 to G89, and Siemens' CYCLE81 to CYCLE84.

Where LinuxCNC's documentation [1]_ leaves a choice, what its interpreter does: with G91 R counts from the plane in
which the row of cycles began, and Z from R. Fanuc [2]_ keeps R, Z, P and Q from one cycle to the next, at the levels
that they had when they were said, so that a row of holes goes on with G91 X10 K3 (Haas [3]_: with G91 and L). It
repeats by K, returns to the initial plane, or with G99 to R, and taps by pecks where G74 and G84 have Q; for G76, G87
and G88 see [4]_, too. Of Siemens' cycles [5]_ RTP, RFP and DP are places of the program, SDIS, DPR, FDPR and DAM ways
without a sign; the speed SST of CYCLE84 is taken as constant.

References
----------
.. [1] LinuxCNC documentation, "G-Codes", G73, G74, "G80-G89 Canned Cycles", G98 and G99.
.. [2] Fanuc Series 30i-MODEL B, User's Manual B-64484EN, "Canned cycle for drilling".
.. [3] Haas, Mill Operator's Manual, "Canned cycles": looping with G91 and L.
.. [4] Fanuc Series 15i/150i-MA, Operator's Manual (Programming), "Canned cycle".
.. [5] SINUMERIK 840D/840Di/810D, Programming Guide "Cycles" (PGZ), 11.02 Edition, 2.1 "Drilling cycles".
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.dialects import Dialect
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.line_words import LineWords
from splinefeed.programs.gcode.moves import LARGEST, LETTERS, POLAR, Findings, MoveKind
from splinefeed.programs.gcode.state import UNSAID, ProgramState, check_size
from splinefeed.programs.gcode.threads import TIED

#: Most moves that one line may stand for, and most repeats.
MAX_MOVES, MAX_REPEATS = 100_000, 10_000
#: How far a peck goes back, or stays above the bottom of the last one, mm: LinuxCNC's 0.010 in.
PECK_CLEARANCE = 0.254
#: Levels this near each other, mm, are one: a peck that ends at the bottom is the last.
SAME_LEVEL = 1e-9

#: Steps: 0R leads rapidly to the level R, 1R by feed; P and S wait; M5 is a switch, M+ the spindle as it turned before,
#: M- the other way; >Q leaves the wall by Q, <Q leads back. Q( ) holds the steps of each peck but the last. Levels: R
#: and Z as programmed, C where the tool ends, L the end of a peck, A where the next one begins.
_TAP = "1Z M5 M- P 1C M5 M+"
CYCLES = {
    730: "0R Q( 1L 0A ) 1Z 0C",
    740: f"0R {_TAP}",
    810: "0R 1Z 0C",
    820: "0R 1Z P 0C",
    830: "0R Q( 1L 0R 0A ) 1Z 0C",
    840: f"0R {_TAP}",
    850: "0R 1Z 1R 0C",
    860: "0R 1Z P M5 0C M+",
    890: "0R 1Z P 1C",
}
#: By feed back to R alone, and from there rapidly (B-64484EN, figures of G84 and G89).
_PECKED_TAP = "0R Q( 1L M5 M- P 1R M5 M+ ) 1Z M5 M- P 1R M5 M+ 0C"
FANUC = CYCLES | {
    740: _PECKED_TAP,
    760: "0R 1Z P M19 >Q 0C <Q M+",
    840: _PECKED_TAP,
    870: "M19 >Q 0R <Q M+ 1Z P M19 >Q 0C <Q M+",
    880: "0R 1Z P M5 M0 0C M+",
    890: "0R 1Z P 1R 0C",
}
#: A Haas waits at the bottom of the last peck (Mill Operator's Manual, G73 and G83: P); Fanuc's have no P.
HAAS = FANUC | {730: "0R Q( 1L 0A ) 1Z P 0C", 830: "0R Q( 1L 0R 0A ) 1Z P 0C"}
#: As `Dialect.cycles` calls them.
KINDS = {"linuxcnc": CYCLES, "fanuc": FANUC, "haas": HAAS}
_PECKS = (730, 830)
#: How the spindle turns in LinuxCNC's tapping cycles, and the cycle that cuts upwards, from R to Z.
_TURNING, _UPWARDS = {740: 4, 840: 3}, 870
_NOTES = {
    "M0": "waits for a retract by hand to R, which is taken as rapid",
    ">Q": "leaves the wall by Q in the direction +X (G18 +Z, G19 +Y); which one it is the control has in a parameter",
}
#: Siemens': names of the parameters in their order, and steps; R is where feed begins, and `in` and `out` are markers.
_HOLE = ("RTP", "RFP", "SDIS", "DP", "DPR")
SIEMENS: dict[str, tuple[tuple[str, ...], str]] = {
    "CYCLE81": (_HOLE, "0R 1Z 0C"),
    "CYCLE82": ((*_HOLE, "DTB"), "0R 1Z P 0C"),
    "CYCLE83": ((*_HOLE, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI"), "0R Q( 1L P 0R S 0A ) 1Z P 0C"),
    "CYCLE84": ((*_HOLE, "DTB", "SDAC", "MPIT", "PIT", "POSS", "SST", "SST1"), "0R in 1Z P out 1R end 0C"),
}
_BREAKING = "0R Q( 1L P 1A ) 1Z P 0C"  # CYCLE83 with VARI=0
#: Least stroke of CYCLE83 where a factor makes it less, mm (_MDEP is not read); what a peck for breaking chips is
#: lifted, mm; how far above the last depth feed begins again, mm, in holes to so deep, mm, and as a part of the depth
#: of deeper ones, and at most, mm.
_LEAST, _LIFT, _AHEAD, _AHEAD_TO, _AHEAD_PART, _AHEAD_MOST = 1.0, 1.0, 0.6, 30.0, 1.0 / 50.0, 7.0
#: Coarse pitches of metric threads, mm, by size: ISO 261.
_PITCHES = {
    3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5, 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0,
    27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5, 48: 5.0,
}  # fmt: skip


@dataclass
class Hole:
    """What the steps of a cycle lead to, in one line; levels are along the axis across the plane, mm.

    Parameters
    ----------
    state : ProgramState
        Of the program, whose tool moves.
    line : int
        Of the program.
    name : str
        Of the cycle.
    levels : dict of str to float
        By letter, mm.
    pecks : sequence of tuple, optional
        Where each but the last ends, and where the next begins, mm.
    said : mapping of str to str or float, optional
        What steps other than moves say: a text, or how long they wait, s.
    aside : float, optional
        mm of >Q.
    feeds, steady : dict of str to float, optional
        mm a minute, by level, for the first move there, and for all moves there.
    """

    state: ProgramState
    line: int
    name: str
    levels: dict[str, float]
    pecks: Sequence[tuple[float, float]] = ()
    said: Mapping[str, str | float] = field(default_factory=dict)
    aside: float = 0.0
    feeds: dict[str, float] = field(default_factory=dict)
    steady: dict[str, float] = field(default_factory=dict)

    def drill(self, steps: str) -> None:
        """Carry out the steps where the tool is."""
        before, _, rest = steps.partition("Q(")
        each, _, after = rest.partition(")")
        self._do(before)
        for end, again in self.pecks:
            self.levels |= {"L": end, "A": again}
            self._do(each)
        self._do(after)

    def _do(self, steps: str) -> None:
        state = self.state
        wall = (state.across + 1) % 3
        for step in steps.split():
            said = self.said.get(step, step)
            if step[0] in "01":
                kind, feed = MoveKind.RAPID, None
                if step[0] == "1":
                    kind, feed = MoveKind.LINE, self.feeds.pop(step[1], self.steady.get(step[1]))
                self.move(kind, state.across, self.levels[step[1]], feed)
            elif step == ">Q":
                self.levels["Q"] = float(state.position[wall])
                self.move(MoveKind.RAPID, wall, self.levels["Q"] + self.aside)
            elif step == "<Q":
                self.move(MoveKind.RAPID, wall, self.levels["Q"])
            elif isinstance(said, str):
                state.say(self.line, said)
            elif not 0.0 <= said <= LARGEST:
                raise LineError(f"{self.name}: a wait of {said:g} s is not possible")
            elif said:
                state.say(self.line, dwell=said)

    def move(self, kind: int, axis: int, level: float, feed: float | None = None) -> None:
        """Along an axis, unless the tool is there."""
        state = self.state
        if state.position[axis] == level:
            return
        there = state.position.copy()
        there[axis] = level
        state.add(kind, there, state.stated(1 << axis), self.line, feed=feed)


class Cycles:
    """Runs one cycle after the other on a `ProgramState`; R, Z, P and Q stay in force as long as the cycle does."""

    def __init__(self, state: ProgramState, dialect: Dialect, findings: Findings) -> None:
        self.state, self.dialect, self.findings = state, dialect, findings
        state.returns = dialect.returns
        self.known = KINDS[dialect.cycles]
        self._initial = 0.0
        self.forget()

    def forget(self) -> None:
        """Another kind of motion, or G80, ends the row of cycles."""
        self.first_line = 0  # where the row of cycles began; 0 where there is none
        self._code = 0
        self._kept: dict[str, float] = {}
        self._levels: dict[str, float] = {}  # of R and Z from the zero point, which Fanuc keeps

    def line(self, code: int, words: LineWords, line: int) -> None:
        """One line of the cycle `code`; the words that it uses are taken from `words`."""
        state, steps, name = self.state, self.known[code], g_name(code)
        refuse(state.feed_mode == 93, f"{name} cannot have feeds by inverse time; write G94")
        across, relative = state.across, state.relative
        zero, depth = float(state.offset[across]), LETTERS[across]
        axes = {letter: words.pop(letter) for letter in LETTERS + POLAR if letter in words}
        if wrong := next((letter for letter in axes if letter not in "XYZ" + POLAR), ""):
            raise LineError(f"{wrong}: {name} moves X, Y and Z only")
        refuse(not axes, f"{name} needs the place of its hole, X, Y or Z")
        if not self._code:
            self._initial, self.first_line = float(state.position[across] - zero), line
        if code != self._code and not self.dialect.keeps_cycles:
            self._kept = {}
        if code in _PECKS and "P" in words and self.dialect.keeps_cycles and "P" not in steps:
            words.pop("P")
            self.findings.count(f"P of {name} is left out: Fanuc has none there, a Haas waits at the bottom", line)
        said_now = {"R"} & words.keys() | ({"Z"} if depth in axes else set())
        self._code, kept = code, self._kept
        kept |= {letter: words.pop(letter) for letter in "RQ" if letter in steps and letter in words}
        if "P" in steps and "P" in words:
            kept["P"] = words.wait(self.dialect.dwell, self.dialect.dwell_pointed)
        if depth in axes:
            kept["Z"] = axes.pop(depth)
        optional = "P" * ("M-" in steps or self.dialect.keeps_cycles) + "Q" * ("M-" in steps)
        for letter in "ZRQP":
            if letter in steps and letter not in kept and letter not in optional:
                raise LineError(f"{name} needs {depth if letter == 'Z' else letter}")
        clearance = state.scaled(across, words.pop("D")) if "Q(" in steps and "D" in words else PECK_CLEARANCE
        times = self._repeats(name, words)
        initial = zero + self._initial
        base = initial if relative else zero
        retract = base + state.scaled(across, kept["R"])
        if self.dialect.of_fanuc and "R" not in said_now:
            retract = zero + self._levels["R"]
        bottom = (retract if relative else base) + state.scaled(across, kept["Z"])
        if self.dialect.of_fanuc and "Z" not in said_now:
            bottom = zero + self._levels["Z"]
        self._levels = {"R": retract - zero, "Z": bottom - zero}
        for letter, level in (("R", retract), (depth, bottom)):
            check_size(letter, level)
        back = code == _UPWARDS
        top, low = (bottom, retract) if back else (retract, bottom)
        if top < low:
            below = f"above {depth}, to which it cuts" if back else f"below {depth}, the bottom of the hole"
            raise LineError(f"{name}: R lies {low - top:.6g} mm {below}")
        turning, clear = state.spindle, max(initial, top) if state.returns == 98 or back else top
        if "M-" in steps:
            if turning != _TURNING[code] and not self.dialect.keeps_cycles:
                raise LineError(f"{name} needs the spindle to turn by M{_TURNING[code]}")
        elif "M+" in steps and not turning:
            raise LineError(f"{name} needs the spindle to turn; write M3 or M4 before it")
        for step, note in _NOTES.items():
            if step in steps:
                self.findings.count(f"{name} {note}", line)
        pecks = self._pecks(name, top, low, times if "Q(" in steps else 0)
        switches = {"M+": f"M{turning}", "M-": f"M{7 - turning}"} if turning else {"M+": 0.0, "M-": 0.0}
        hole = Hole(
            state, line, name, {"R": retract, "Z": bottom, "C": clear}, [(peck, peck + clearance) for peck in pecks],
            {"P": kept.get("P", 0.0), **switches},
            abs(state.scaled((across + 1) % 3, kept.get("Q", 0.0))),
        )  # fmt: skip
        if times and initial < top and not back:
            hole.move(MoveKind.RAPID, across, top)
        before = state.tolerance, state.exact_stop
        if self.dialect.of_linuxcnc and before[0] != UNSAID:
            state.tolerance, state.exact_stop = 0.0, False  # exact path, as in LinuxCNC
        for _ in range(times):
            there, said = state.target(axes)
            there[across] = state.position[across] if state.position[across] > top else clear
            if any(there[axis] != state.position[axis] for axis in range(3)):
                state.add(MoveKind.RAPID, there, said, line)
            hole.drill(steps)
        state.tolerance, state.exact_stop = before

    def _repeats(self, name: str, words: LineWords) -> int:
        """How often; LinuxCNC's L is at least 1, Fanuc's K may be 0, which only keeps the words."""
        letters = [letter for letter in self.dialect.repeats if letter in words]
        times = words.pop(letters[0]) if letters else 1.0
        least = 0 if self.dialect.keeps_cycles else 1
        if not least <= times <= MAX_REPEATS or times != math.floor(times):
            raise LineError(f"{letters[0]}{times:g}: repeats of {name} are whole, {least} to {MAX_REPEATS}")
        return int(times)

    def _pecks(self, name: str, top: float, low: float, times: int) -> list[float]:
        """Where all pecks but the last end; without Q there is one."""
        if not times or "Q" not in self._kept:
            return []
        peck = self.state.scaled(self.state.across, self._kept["Q"])
        refuse(not peck > 0.0, f"{name} Q{self._kept['Q']:g}: the depth of a peck is greater than 0")
        if times * 3.0 * (top - low) > MAX_MOVES * peck:
            raise LineError(f"{name} makes more than {MAX_MOVES} moves; drill deeper at a time (Q)")
        levels = [top - peck]
        while levels[-1] > low + SAME_LEVEL:
            levels.append(levels[-1] - peck)
        return levels[:-1]


def parameters(name: str, values: Sequence[float | None]) -> dict[str, float]:
    """What stands in the brackets of Siemens' cycle, by name; LineError for too many values, or too large ones."""
    names, given = SIEMENS[name][0], {}
    for i, value in enumerate(values):
        if value is not None:
            refuse(i >= len(names), f"{name}: parameter {i + 1} is not supported; leave out what follows {names[-1]}")
            given[names[i]] = check_size(names[i], value)
    return given


def siemens(name: str, given: Mapping[str, float], state: ProgramState, line: int, findings: Findings) -> None:
    """Carry out Siemens' cycle where the tool is."""
    zero, scale = float(state.offset[state.across]), float(state.scale[state.across])
    for needed in ({"RTP"}, {"RFP"}, {"DP", "DPR"}):
        refuse(not needed & given.keys(), f"{name} needs {' or '.join(sorted(needed))}")
    surface, back = (zero + given[each] * scale for each in ("RFP", "RTP"))
    begin = surface + abs(given.get("SDIS", 0.0)) * scale
    bottom = surface - abs(given["DPR"]) * scale if given.get("DPR") else zero + given.get("DP", 0.0) * scale
    if bottom >= begin:
        raise LineError(f"{name}: the depth lies {bottom - begin:.6g} mm above the plane where it begins (RFP + SDIS)")
    if back < begin - SAME_LEVEL:
        raise LineError(f"{name}: RTP lies {begin - back:.6g} mm below the plane where it begins (RFP + SDIS)")
    waits = {}
    for step, word in (("P", "DTB"), ("S", "DTS")):
        waits[step] = given.get(word, 0.0)
        if waits[step] < 0.0:  # turns of the spindle
            if not (turns := state.turns(0.0)):
                raise LineError(f"{name}: {word} counts turns of the spindle, whose speed is not known; write S before")
            waits[step] *= -60.0 / turns
    hole = Hole(state, line, name, {"R": begin, "Z": bottom, "C": back}, said=waits)
    steps = SIEMENS[name][1]
    if name == "CYCLE83":
        first = abs(given.get("FDPR", 0.0)) * scale
        if not first:
            first = surface - zero - given["FDEP"] * scale if "FDEP" in given else surface - bottom
        steps = steps if given.get("VARI", 0.0) else _BREAKING
        _less_by_less(hole, given, steps == _BREAKING, surface, first, scale)
    if name != "CYCLE84":
        hole.drill(steps)
        return
    after = _tap(hole, given)
    findings.count(TIED, line)
    hole.drill(steps)
    state.switch(after)


def _less_by_less(
    hole: Hole, given: Mapping[str, float], breaking: bool, surface: float, first: float, scale: float
) -> None:
    """Pecks whose strokes become less by DAM, or by -DAM as a factor; the first one may have a feed of its own."""
    begin, total, less = hole.levels["R"], surface - hole.levels["Z"], given.get("DAM", 0.0)
    part = given.get("FRF", 0.0) or 1.0
    refuse(not 0.001 <= part <= 1.0, f"CYCLE83: FRF={part:g}, the part of the feed for the first depth, is 0.001 to 1")
    if not 0.0 < first <= total + SAME_LEVEL:
        raise LineError(f"CYCLE83: the first depth, {first:.6g} mm, must be greater than 0 and at most {total:.6g} mm")
    refuse(less <= -1.0, f"CYCLE83: DAM={less:g}; a factor of the stroke lies between -1 and 0")
    least, stroke, depths = max(less, 0.0) * scale, first, [first]
    while (rest := total - depths[-1]) > SAME_LEVEL:
        if len(depths) > MAX_MOVES // 4:
            raise LineError(f"CYCLE83 makes more than {MAX_MOVES} moves; drill deeper at a time (FDPR, DAM)")
        if less > 0.0:  # the last two are alike
            stroke = 0.5 * rest if least < rest <= 2.0 * least else max(stroke - least, least)
        elif less < 0.0:
            stroke = max(-less * stroke, _LEAST)
        depths.append(depths[-1] + min(stroke, rest))
    levels = [surface - depth for depth in depths[:-1]]
    hole.pecks = [(level, min(level + (_LIFT if breaking else ahead(total)), begin)) for level in levels]
    hole.feeds = {"L" if levels else "Z": hole.state.feed * part}


def ahead(depth: float) -> float:
    """How far above the last depth feed begins again in a hole of that depth, mm."""
    return _AHEAD if depth <= _AHEAD_TO else min(depth * _AHEAD_PART, _AHEAD_MOST)


def _tap(hole: Hole, given: Mapping[str, float]) -> int:
    """Feeds of a tap by its pitch and the speed of the spindle; by which M code that goes on."""
    size, pitch, state = given.get("MPIT", 0.0), given.get("PIT", 0.0), hole.state
    if not pitch and abs(size) not in _PITCHES:
        raise LineError("CYCLE84 needs PIT, the pitch, or MPIT, the size of a metric thread, 3 to 48")
    lead = abs(pitch) * float(state.scale[0]) if pitch else _PITCHES[int(abs(size))]
    speed = given.get("SST", 0.0) or state.turns(0.0)
    out = given.get("SST1", 0.0) or speed
    if not (0.0 < speed <= LARGEST and 0.0 < out <= LARGEST):
        raise LineError("CYCLE84 needs SST, the speed of the spindle, greater than 0")
    after = int(given.get("SDAC", 5.0) or 5.0)
    if after not in (3, 4, 5):
        raise LineError(f"CYCLE84: SDAC={given['SDAC']:g}; the spindle goes on by 3, 4 or 5 (M3, M4, M5)")
    turning = 3 if math.copysign(1.0, pitch or size) > 0.0 else 4
    hole.feeds = {"Z": lead * speed, "R": lead * out}
    hole.said = {
        **hole.said, "in": f"M19 S{speed:g} M{turning}", "out": f"S{out:g} M{7 - turning}", "end": f"M{after}",
    }  # fmt: skip
    return after

"""What a line does: the interpreter of RS274 as LinuxCNC has it, and of the dialects that are near to it.

Source: LinuxCNC documentation, "G-Codes", "M-Codes" and "G-Code Overview"; NISTIR 6556. Order within a line: feed mode,
feed, speed, tool, spindle and coolant, dwell, plane, units, tool length, coordinate system, path control, distance
mode, offsets and reference points, motion, stop. F beside G20 or G21 is in the units that the program has said before,
as in LinuxCNC; where it has said none, and in other dialects, it is in those of its own line. A finding says which.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from splinefeed.formats.gcode import codes, layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.cycles import Cycles
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import CLOCKWISE, COUNTERCLOCKWISE, LETTERS, LINE, POLAR, RAPID, Findings
from splinefeed.formats.gcode.offset_words import OffsetWords
from splinefeed.formats.gcode.spline_words import SplineWords
from splinefeed.formats.gcode.state import UNBOUNDED, Modal, State, number
from splinefeed.formats.gcode.threads import thread, tied
from splinefeed.formats.gcode.tool_tip import SWITCH_OFF, SWITCH_ON, TOOL_AXIS
from splinefeed.formats.gcode.words import Block, parse, without_comments, without_nested

_RATE = {0: RAPID, 10: LINE, 20: CLOCKWISE, 30: COUNTERCLOCKWISE}
_SPLINES = (50, 51, 52, 53, 62, 63)
#: Letters that belong to M codes where no G code of the line takes them.
_M_WORDS = "PLQEDIJKRU"


class Interpreter(OffsetWords):
    """Runs lines one after the other on a `State`; `ended` is set by M2, M30 and the like."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings, *, repair: bool = False) -> None:
        super().__init__(state, dialect, findings, repair)
        self.ended = False
        self.call: tuple[int, int] | None = None  # what M98 calls, and how often
        self.returns = False  # whether there was an M99
        self.splines = SplineWords(state, findings)
        self.cycles = Cycles(state, dialect, findings)
        self._percents = False
        self._kept: list[tuple[Modal, int] | None] = [None]  # what M70 or M73 has kept, by level of calls

    def run(self, text: str, line: int) -> None:
        """Do what the line `text` says; LineError, without the line's number, for what cannot be done."""
        self.line = line
        if self.state.modes[layout.MOTION] >= 0:  # the kernel has seen G0 to G3 meanwhile
            self._set_modal(10 * int(self.state.modes[layout.MOTION]))
        text = self._plain(text)
        if self.repair:
            text = self._closed(text)
        block = parse(text, self.parameters, exponents=self.repair)
        if block.deletable:
            self.findings.count("lines with / are executed, as with block delete off", line)
        if block.percent:
            self._percent()
        if not block.empty:
            self._do(block)
        for key, value in block.settings:
            self.parameters.set(key, value)

    @property
    def unfinished(self) -> tuple[int, str]:
        """Where what goes over several lines began, and what it is; line 0 where there is nothing of the kind."""
        if self.cutter.on:
            return self.cutter.first_line, "cutter compensation (G41, G42)"
        if self.splines.open:
            return self.splines.first_line, "a spline"
        return self.cycles.first_line, "a row of canned cycles (G80)"

    def enter(self, arguments: Sequence[float] | None = None) -> None:
        """A sub begins; with `arguments` it has its own #1 to #30."""
        self.parameters.enter(arguments)
        self._kept.append(None)

    def leave(self) -> None:
        """A sub ends: what its M73 has kept is in force again."""
        kept = self._kept.pop()
        if kept is not None and kept[1] == 73:
            self._restore(kept[0])
        self.parameters.leave()

    def end(self) -> None:
        """The file is at its end; LineError if a spline is still open."""
        self.splines.end()

    def _percent(self) -> None:
        """A % in front of the program, its first one, begins it; any other ends it."""
        if self._percents or self.state.busy:
            self.splines.end()
            self.ended = True
        self._percents = True

    def _closed(self, text: str) -> str:
        """The line without comments in comments and comments that are not closed, each a finding."""
        try:
            without_comments(text)
        except LineError as fault:
            self.findings.count(f"{fault}; a comment ends at its last bracket, or at the end of the line", self.line)
            text = without_nested(text)
        return text

    # --- words ------------------------------------------------------------------------------------------------------

    def _plain(self, text: str) -> str:
        """The line without what only its dialect knows."""
        if self.dialect.directives and text.lstrip().startswith(self.dialect.directives):
            self.findings.count(
                f"lines that begin with {self.dialect.directives} switch functions of the control", self.line
            )
            return ""
        for code in self.dialect.texts:
            if text.lstrip().upper().startswith(f"M{code}"):
                return ""
        if self.dialect.extruder and "*" in text:
            text = without_comments(text).rpartition("*")[0]  # a checksum
        return text

    # --- one line ---------------------------------------------------------------------------------------------------

    def _do(self, block: Block) -> None:
        self._words = dict(block.words)
        self._bare_g92 = not self._words.keys() & {"S", "E"}  # G92 S limits a spindle, G92 E is about filament
        known = {code for code in block.g if code not in self.dialect.modes}
        for code in sorted(set(block.g) - known):
            for letter in "PQRE":
                self._take(letter)
            self.findings.count(f"{g_name(code)} switches a function of the control and moves nothing", self.line)
        if self.dialect.extruder and "E" in self._words:
            self._take("E")
            self.state.modes[layout.EXTRUDED] = 1
        for code in sorted(known):
            self._refuse(code, known)
        if not known & {100, 730, 830, 410, 411, 420, 421, 960}:
            self._take("D")
        if self.cutter.on:
            self._beside_contour(block, known)
        said = {codes.GROUP_OF[code]: code for code in sorted(known, reverse=True) if code in codes.GROUP_OF}
        if "F" in self._words and "units" in said:
            self._units_of_feed(said["units"])
        for group, do in _ACTS.items():
            if group is None:
                self._feed_word(said.get("motion", self._modal))
                self._spindle_mode(said.get("spindle mode"), known)
                self._outputs(block)
            elif group in said:
                do(self, said[group])
        if not known & {100, 760}:
            self._take("H")
        self._motion(said.get("motion"), known)
        self._stops(block)
        if self._words:
            letter, value = next(iter(self._words.items()))
            hint = "; a number cannot have an exponent" if letter == "E" else ""
            raise LineError(f"{letter}{value:g} is used by no code of the line{hint}")

    def _refuse(self, code: int, known: set[int]) -> None:
        reason = codes.REFUSED.get(code)
        if self._compensates(code) or code in self.cycles.known or (code == 760 and self.dialect.of_linuxcnc):
            return
        if reason is None:
            if code not in codes.GROUP_OF and code not in codes.WITHOUT_EFFECT:
                raise LineError(f"{g_name(code)} is not known in the dialect {self.dialect.title}")
            return
        if self.repair and code in codes.READ_AS_THEY_STAND:
            what = reason.partition(",")[0]
            self.findings.count(f"{g_name(code)} ({what}) is left out; the path is as programmed", self.line)
            return
        if self.repair and 310 <= code <= 385 and code not in (330, 331):
            self.findings.count(f"{g_name(code)} is left out: {reason.partition(';')[0]}", self.line)
            self._axes()
            known.discard(code)
            self._modal = None
            self.state.modes[layout.MOTION] = -1
            return
        raise LineError(f"{g_name(code)} is {reason}")

    def _feed_mode(self, code: int) -> None:
        state = self.state
        before, mode = state.modes[layout.FEED_MODE], {930: layout.INVERSE, 950: layout.PER_TURN}.get(code, 0)
        if mode == layout.PER_TURN:
            mode = layout.SURFACE if state.surface else layout.PER_TURN
            self.findings.say(
                f"line {self.line}: G95: feeds are F times the speed S of the spindle, which is taken as constant"
            )
        if before != mode and max(before, mode) >= layout.PER_TURN:  # as in LinuxCNC F is said anew
            state.values[layout.FEED] = state.feed_per_turn = 0.0
        state.modes[layout.FEED_MODE] = mode

    def _spindle_mode(self, code: int | None, known: set[int]) -> None:
        """G96, S at the surface with D as the highest speed, and G97; G92 S and G50 S of lathes are that speed too."""
        state = self.state
        if self.dialect.lead == "F" and known & {920, 500} and not self._words.keys() & set(LETTERS):
            state.top_speed = self._take("S", state.top_speed) or math.inf
        if code is None:
            return
        if code == 960 and "S" not in self._words:
            raise LineError("G96 needs S, the speed at the surface")
        state.surface = code == 960
        if state.surface:
            state.top_speed = self._take("D", state.top_speed) or math.inf
            self.findings.say(
                f"line {self.line}: G96: with G95 a move has the feed at its mean distance from X0; speeds of the "
                "spindle are taken as reached at once"
            )
        if state.modes[layout.FEED_MODE] >= layout.PER_TURN:
            state.modes[layout.FEED_MODE] = layout.SURFACE if state.surface else layout.PER_TURN
            state.set_feed(None)

    def _units(self, code: int) -> None:
        self.state.set_units(20 if code in (200, 700) else 21)

    def _units_of_feed(self, code: int) -> None:
        """F on a line that changes units: the new ones come first, unless LinuxCNC knows others from lines before."""
        before = int(self.state.modes[layout.UNITS])
        if (code in (200, 700)) == self.state.inch:
            return
        if not (self.dialect.of_linuxcnc and before):
            self._units(code)
        unit = "inches" if self.state.inch else "mm"
        self.findings.count(f"F on a line that changes units is taken in {unit} a minute", self.line)

    def _feed_word(self, motion: int | None) -> None:
        feed, state = self._words.get("F"), self.state
        if motion in (330, 331) and feed is not None:
            if self.dialect.lead != "F":
                raise LineError(f"F is not allowed with {g_name(motion)}, whose feed is K times the spindle's speed")
            return
        if feed is not None and not 0.0 <= feed <= layout.LARGEST:
            raise LineError(f"F{feed:g} is not a feed")
        if feed is not None and state.modes[layout.FEED_MODE] != layout.INVERSE:
            state.set_feed(feed)
            self._take("F")

    def _outputs(self, block: Block) -> None:
        """S, T and M as markers before the motion of the line; dwells likewise."""
        wait = self._dwell() if 40 in block.g else None
        if "T" in self._words:
            self.state.select(self._words["T"], self.line)
        stop = "T" in self._words or ("S" in self._words and self.state.new_speed(self._words["S"]))
        said = [f"G{code // 10}" for code in (960, 970) if code in block.g]
        said += [f"{letter}{number(self._words.pop(letter))}" for letter in "ST" if letter in self._words]
        before = [m for m in block.m if m not in codes.M_GROUPS["stop"]]
        if self.dialect.of_linuxcnc:
            before = [code for code in before if not self._modal_state(code)]
        for code in before:
            self.state.switch(code)
            if code == 6:
                self.cutter.forget()
            if code == 61 and self.dialect.of_linuxcnc:
                self._tool_number()
            if code in (SWITCH_ON, SWITCH_OFF) and self.dialect.of_linuxcnc:
                self.tool_tip.switch(code, self.line)
            if code in codes.SUBPROGRAMS:
                self._subprogram(code, block)
        before = [code for code in before if code not in codes.SUBPROGRAMS]
        number_said = f" Q{number(self.state.loaded)}" if self.dialect.of_linuxcnc else ""
        said += [f"M{code}{number_said if code == 61 else ''}" for code in before]
        if before and not any(code in codes.GROUP_OF for code in block.g):
            said += [f"{each}{number(self._words.pop(each))}" for each in _M_WORDS if each in self._words]
        if said:
            stop |= any(code not in codes.ON_THE_MOVE for code in before)
            self.state.say(self.line, " ".join(said), stop=stop)
        if wait is not None:
            self.state.say(self.line, dwell=wait)

    def _tool_number(self) -> None:
        """M61 Q: the tool in the spindle has another number."""
        if "Q" not in self._words:
            raise LineError("M61 needs Q, the number of the tool in the spindle")
        state, selected = self.state, self.state.selected
        state.select(self._words.pop("Q"), self.line)
        state.loaded, state.selected = state.selected, selected

    def _modal_state(self, code: int) -> bool:
        """M70 keeps how things are, M73 also for the end of the sub, M72 restores it, M71 forgets it."""
        if code in (70, 73):
            self._kept[-1] = self.state.modal(), code
        elif code == 71:
            self._kept[-1] = None
        elif code == 72:
            if (kept := self._kept[-1]) is None:
                raise LineError("M72: nothing is kept here; write M70 before it, in the same sub")
            self._restore(kept[0])
        return 70 <= code <= 73

    def _restore(self, kept: Modal) -> None:
        length = self.state.length_code
        self.state.restore(kept, self.line)
        if self.state.length_code != length:
            self._tool_length(self.state.length_code)

    def _subprogram(self, code: int, block: Block) -> None:
        """M98: what `Flow` calls behind this line, P by number and L times; Fanuc's P may say both."""
        if code != 98 or not self.dialect.jumps:
            raise LineError(f"M{code}: subprograms are not supported here; write the program in one piece")
        if "P" not in self._words:
            raise LineError("M98 needs P, the number of the subprogram")
        if self.dialect.of_linuxcnc and (block.g or self._words.keys() - {"P", "L"}):
            raise LineError("M98 must be alone on its line; LinuxCNC ignores the rest of it")
        packed = self.dialect.keeps_cycles and "L" not in self._words
        number = self._whole_m("P", 98)
        times, number = divmod(number, 10_000) if packed and number > 9_999 else (1, number)
        self.call = number, self._whole_m("L", 98) if "L" in self._words else times

    def _whole_m(self, letter: str, code: int) -> int:
        value = self._words.pop(letter)
        if not 0.0 <= value < 1e9 or abs(value - round(value)) > 1e-4:
            raise LineError(f"{letter}{value:g} of M{code} is not a whole number from 0")
        return round(value)

    def _dwell(self) -> float:
        """The seconds of G4."""
        seconds = self._take("P")
        seconds = None if seconds is None else seconds * self.dialect.dwell
        for letter in self.dialect.dwell_words:
            seconds = self._take(letter, seconds)
        if seconds is None:
            raise LineError("G4 needs P, the time to wait")
        if not 0.0 <= seconds <= layout.LARGEST:
            raise LineError(f"G4: a wait of {seconds:g} s is not possible")
        return seconds

    def _plane(self, code: int) -> None:
        self.state.modes[layout.PLANE] = code // 10

    def _path_control(self, code: int) -> None:
        state, bound = self.state, 0.0
        state.modes[layout.EXACT_STOP] = code == 611
        if code == 640:
            bound = self._words.pop("P", UNBOUNDED)
            self._take("Q")
            if not bound >= 0.0:
                raise LineError("G64: P, the tolerance, must be 0 or more")
            if bound == 0.0 and self.dialect.of_linuxcnc:  # LinuxCNC's interpreter makes no difference
                bound = UNBOUNDED
        state.values[layout.TOLERANCE] = bound * state.values[layout.SCALE]

    def _retract(self, code: int) -> None:
        self.state.returns = code // 10

    def _distance(self, code: int) -> None:
        self.state.modes[layout.RELATIVE] = code == 910

    def _arc_distance(self, code: int) -> None:
        self.state.modes[layout.CENTRES] = code == 901

    # --- motion -----------------------------------------------------------------------------------------------------

    def _motion(self, code: int | None, known: set[int]) -> None:
        state = self.state
        if self.splines.open and code is not None and code != 53 and not self.splines.goes_on(code, self._words):
            self.splines.end()
        if code == 800:
            self._set_modal(None)
            return
        if code is not None:
            self._set_modal(code)
        if code in _SPLINES or (self._modal in _SPLINES and self._spline_words()):
            inverse = self._words.get("F") if state.modes[layout.FEED_MODE] == layout.INVERSE else None
            self.splines.line(code, self._modal, self._words, self.line, inverse)
            if code == 53:
                self.splines.end()
                self._set_modal(None)
            return
        axes = {letter: self._words[letter] for letter in LETTERS + POLAR if letter in self._words}
        if self._modal == 760 and self.dialect.of_linuxcnc and 530 not in known and (axes or code is not None):
            thread(state, self._words, self.line, self.findings)
            return
        if self._modal in self.cycles.known and 530 not in known and (axes or code is not None):
            self.cycles.line(self._modal, self._words, self.line)
            return
        centre = {letter: self._words[letter] for letter in "IJK" if letter in self._words}
        if 530 in known:
            self._machine_move(axes)
            return
        tool_axis = self.tool_tip.taken(self._words, self._modal)
        if not axes and not tool_axis and not (self._modal in (20, 30) and centre):
            return
        if self._modal in (330, 331):
            there, said, stated = state.target(axes)
            for letter in axes:
                self._take(letter)
            lead = self._take(self.dialect.lead)
            tied(state, self._modal, (there, said, stated), lead, self.line, self.findings)
            return
        if self._modal not in _RATE:
            raise LineError("axis words without G0, G1, G2 or G3 before them")
        kind = _RATE[self._modal]
        there, said, stated = state.target(axes)
        for letter in axes:
            self._take(letter)
        more = self._feed(kind, there)
        if tool_axis:
            said, stated = said | TOOL_AXIS, stated | TOOL_AXIS
            more = {**more, **tool_axis, "flags": int(more.get("flags", 0)) | int(tool_axis["flags"])}
        if kind in (CLOCKWISE, COUNTERCLOCKWISE):
            said |= 7 & ~(1 << state.across)
            arc = self._arc()
            more = {**more, **arc, "flags": int(more.get("flags", 0)) | int(arc["flags"])}
        before = state.position.copy()
        self.cutter.check_exit(kind)
        state.add(kind, there, said, stated, self.line, **more)
        if self.cutter.on:
            self.cutter.moved(before)
            state.position[:] = there

    def _set_modal(self, code: int | None) -> None:
        self._modal = None if code == 53 else code
        if code not in self.cycles.known:
            self.cycles.forget()
        self.state.modes[layout.MOTION] = -1 if code not in _RATE else code // 10

    def _spline_words(self) -> bool:
        return any(letter in self._words for letter in "XYZABCUVWIJKPQR")

    def _stops(self, block: Block) -> None:
        """M0, M1, M2, M30, M60 and M99, behind the motion of their line."""
        for code in block.m:
            if code == 99:
                if not self.dialect.jumps or "P" in self._words:
                    raise LineError("M99 with P, or in this dialect, is not supported; write the program in one piece")
                self._take("L")
                self.returns = True
            elif code in codes.M_GROUPS["stop"]:
                self.state.say(self.line, f"M{code}")
            if code in codes.ENDS:
                self.ended = True
        if self.ended:
            self._words.clear()
            self.splines.end()


#: What carries out the code of each group, in LinuxCNC's order; None: feed, speed, tool, spindle, coolant and dwell.
_ACTS: dict[str | None, Callable[[Interpreter, int], None]] = {
    "feed mode": Interpreter._feed_mode,
    None: lambda *_: None,
    "plane": Interpreter._plane,
    "units": Interpreter._units,
    "cutter compensation": Interpreter._cutter,
    "tool length": Interpreter._tool_length,
    "coordinate system": Interpreter._system,
    "path control": Interpreter._path_control,
    "retract": Interpreter._retract,
    "distance": Interpreter._distance,
    "arc distance": Interpreter._arc_distance,
    "one line": Interpreter._places,
}

"""What a line does: the interpreter of RS274 [1]_ [2]_ as LinuxCNC has it, and of the dialects that are near to it.

Order within a line: feed mode, feed, speed, tool, spindle and coolant, dwell, plane, units, tool length, coordinate
system, path control, distance mode, offsets and reference points, motion, stop. F beside G20 or G21 is in the units
that the program has said before, as in LinuxCNC; where it has said none, and in other dialects, it is in those of its
own line. A finding says which.

References
----------
.. [1] LinuxCNC documentation, "G-Codes", "M-Codes" and "G-Code Overview".
.. [2] Kramer, Proctor, Messina, The NIST RS274NGC Interpreter, version 3, NISTIR 6556, 2000.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.programs.gcode import codes
from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.corner_words import WORDS as CORNER_WORDS
from splinefeed.programs.gcode.corner_words import CornerWords
from splinefeed.programs.gcode.cutter import Cutter
from splinefeed.programs.gcode.cycles import Cycles
from splinefeed.programs.gcode.dialects import DIALECTS, IN_MILLISECONDS, IN_SECONDS, UNSURE_FROM, Dialect
from splinefeed.programs.gcode.expressions import Block, Parameters, mended, parse
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.line_words import LineWords
from splinefeed.programs.gcode.moves import LARGEST, LETTERS, POLAR, STATED, Findings, Flag, MoveKind
from splinefeed.programs.gcode.places import Places
from splinefeed.programs.gcode.spline_words import SplineWords
from splinefeed.programs.gcode.state import UNBOUNDED, Modal, ProgramState, check_size, number
from splinefeed.programs.gcode.threads import thread, tied
from splinefeed.programs.gcode.tool_tip import SWITCH_OFF, SWITCH_ON, TOOL_AXIS, TOOL_TIP, ToolTip
from splinefeed.records import Array

_RATE = {
    0: MoveKind.RAPID,
    10: MoveKind.LINE,
    20: MoveKind.CLOCKWISE,
    30: MoveKind.COUNTERCLOCKWISE,
    330: MoveKind.LINE,
    331: MoveKind.LINE,
}
_SPLINES, _SPLINE_WORDS = (50, 51, 52, 53, 62, 63), set("XYZABCUVWIJKPQR")
#: Letters that belong to M codes where no G code of the line takes them.
_M_WORDS = "PLQEDIJKRU"
#: Letters of places and ways: what least increments count.
_COUNTED = frozenset("XYZUVWABCIJKRQ")
#: A / within a line, which is no division and in no comment.
_SKIP = re.compile(r"(?<=[0-9.\s])/[0-9]?(?=\s*[A-Z])(?![^(]*\))", re.IGNORECASE)
#: A comment behind // at the end of a line, and comments in brackets, which may have // in them.
_TRAILING = re.compile(r"(\([^)]*+(?:\)|$)|;.*)|(?<=\S)\s*+//.*")
#: Words of M codes that stand beside moves, and codes that take such words themselves (LinuxCNC, "M-Codes").
_WORDS_OF_M = {
    19: "RQP", **dict.fromkeys((50, 51, 52, 53, 62, 63, 64, 65), "P"), 66: "PELQ", 67: "EQ", 68: "EQ",
    **dict.fromkeys(range(100, 200), "PQ"),
}  # fmt: skip
_TAKES_WORDS = frozenset((40, 100, 640, *codes.GROUPS["motion"])) - {0, 10, 800}
#: Codes and letters of a line that only moves.
_MOVES, _MOVING = frozenset((0, 10, 20, 30)), frozenset("XYZABCUVWIJKRF")
#: Fanuc's variables that raise an alarm and that stop with a message (B-64484EN, "System variables").
_ALARM, _MESSAGE = 3000, 3006
#: Most turns of one arc.
MAX_TURNS = 1_000


class Interpreter:
    """Runs lines one after the other on a `ProgramState`; `ended` is set by M2, M30 and the like."""

    def __init__(self, state: ProgramState, dialect: Dialect, findings: Findings, *, repair: bool = False) -> None:
        self.state, self.dialect, self.findings, self.repair = state, dialect, findings, repair
        self.line = 0
        if dialect.extruder:
            state.rapid = MoveKind.LINE
        state.speed_stops = not dialect.laser
        self.parameters = Parameters(state.parameter, dialect.of_fanuc)
        self._words = LineWords()  # of the line
        self.untold = False  # whether nothing in the program shows its dialect
        self.increments = False  # whether words of axes without a decimal point count least increments
        self._before_cycles = -1  # G0 to G3, which Fanuc's G80 puts in force again
        self.ended = False
        self.jumps = dialect.jumps  # whether what calls and ends subprograms is carried out by `Flow`
        self.call: tuple[int, int] | None = None  # what M98 calls, and how often
        self.calls_line = False  # whether the call is of a line (N), by M97
        self.returns = False  # whether there was an M99
        self.goes_on = 0  # the line (N) at which Fanuc's M99 P goes on
        self.cutter, self.tool_tip, self.splines = Cutter(state), ToolTip(state, findings), SplineWords(state, findings)
        self.splines.of_fanuc = dialect.of_fanuc
        self.cycles, self.corners = Cycles(state, dialect, findings), CornerWords(state, dialect.corners)
        self.places = Places(state, dialect, findings, self.parameters)
        self._begun = False  # whether there was a line of the program, or the % in front of it
        self._kept: list[tuple[Modal, int] | None] = [None]  # what M70 or M73 has kept, by level of calls

    def run(self, text: str, line: int) -> None:
        """Do what the line `text` says; LineError, without the line's number, for what cannot be done."""
        self.line = line
        fanuc = self.dialect.of_fanuc
        block = parse(self._plain(text), self.parameters, bare=fanuc, corners=bool(self.dialect.corners))
        if block.deletable:
            self.findings.count("lines with / are executed, as with block delete off", line)
        if block.percent:  # the first one, in front of the program, begins it; any other ends it
            self.ended = self._begun or self._modal >= 0
            self._begun = True
        self.carry_out(block)
        for key, value in block.settings:
            self.parameters.set(key, value)
            if fanuc and key in (_ALARM, _MESSAGE) and value:
                refuse(key == _ALARM, f"the program raises alarm #3000={value:g}: {text.strip()[:60]}")
                self.state.say(line, f"#3006={value:g}")

    def carry_out(self, block: Block) -> None:
        """Do what the words of a line say, if there are any."""
        if self._modal not in self.cycles.known:
            self.cycles.forget()
        if block.words or block.g or block.m:
            self._do(block)

    @property
    def busy(self) -> bool:
        """Whether what goes over several lines is under way, so that `run` must have every line."""
        return bool(self.splines.open or self.cutter.busy or self.corners.open)

    def plain_lines(self, block: bytes) -> bytes:
        """The lines of a block as `Lines` may read them; `UNKNOWN` in those that are for `run` alone."""
        return block

    @property
    def unfinished(self) -> tuple[int, str]:
        """Where what goes over several lines began, and what it is; line 0 where there is nothing of the kind."""
        if self.cutter.on:
            return self.cutter.first_line, "cutter compensation (G41, G42)"
        if self.splines.open:
            return self.splines.first_line, "a spline"
        return self.cycles.first_line if self._modal in self.cycles.known else 0, "a row of canned cycles (G80)"

    def enter(self, arguments: Sequence[float] | Mapping[int, float] | None = None) -> None:
        """A sub begins; with `arguments` it has its own #1 to #30, and a macro its #1 to #33."""
        self.parameters.enter(arguments)
        self._kept.append(None)

    def leave(self) -> None:
        """A sub ends: what its M73 has kept is in force again."""
        kept = self._kept.pop()
        if kept is not None and kept[1] == 73:
            self._restore(kept[0])
        self.parameters.leave()

    def end(self) -> None:
        """The file is at its end; LineError if a spline or a corner is still open."""
        self.splines.end()
        self.corners.end()

    def _plain(self, text: str) -> str:
        """The line without what only its dialect knows, and mended if the user wants that."""
        dialect = self.dialect
        if text.lstrip().upper().startswith(dialect.silent):
            self.findings.count(f"lines that begin with {' or '.join(dialect.silent)} move nothing", self.line)
            return ""
        if not dialect.percent_ends and text.lstrip().startswith("%"):
            return ""
        if "//" in text and not dialect.of_linuxcnc:
            text = _TRAILING.sub(lambda found: found[1] or "", text)
        if dialect.of_fanuc and "/" in text and "#" not in text:
            plain = _SKIP.sub(" ", text)
            if plain != text:
                self.findings.count("a / within a line skips its rest with block delete on; it is off", self.line)
                text = plain
        return mended(text, lambda fault: self.findings.count(fault, self.line)) if self.repair else text

    def _do(self, block: Block) -> None:
        self._words, self._begun = LineWords(block.words), True
        self._words.whole = block.whole
        for letter in block.whole & _COUNTED if self.increments else ():
            self._words[letter] /= 1e4 if self.state.inch and letter not in "ABC" else 1e3
        if _MOVES.issuperset(block.g) and not block.m and _MOVING.issuperset(block.words) and not self.cutter.on:
            self._feed_word(block.g[0] if block.g else self._modal)
            self._motion(block.g[0] if block.g else None, set(block.g))
            self._words.check_used(self.corners.names)
            return
        bare_g92 = not self._words.keys() & {"S", "E"}  # G92 S limits a spindle, G92 E is about filament
        known = {code for code in block.g if code not in self.dialect.modes}
        for code in sorted(set(block.g) - known):
            for letter in "PQRE":
                self._words.pop(letter, None)
            self.findings.count(f"{g_name(code)} switches a function of the control and moves nothing", self.line)
        for code in sorted(known):
            self._refuse(code, known)
        self._unknown_m(block, known)
        if not known & {100, 730, 830, 410, 411, 420, 421, 960}:
            self._words.pop("D", None)
        if self.cutter.on:
            self._beside_contour(block, known)
        said = {codes.GROUP_OF[code]: code for code in sorted(known, reverse=True) if code in codes.GROUP_OF}
        if "units" in said:
            self._units_late(said["units"])
        if "F" in self._words and "units" in said:
            self._units_of_feed(said["units"])
        if "feed mode" in said:
            self._feed_mode(said["feed mode"])
        self._feed_word(said.get("motion", self._modal))
        self._spindle_mode(said.get("spindle mode"), known)
        self._outputs(block)
        for code in known & codes.MODES.keys():
            entry, mode = codes.MODES[code]
            setattr(self.state, entry, mode)
        self.state.returns = said.get("retract", 10 * self.state.returns) // 10
        for group, do in (
            ("units", self.state.set_units), ("cutter compensation", self._cutter),
            ("tool length", self._tool_length), ("path control", self._path_control),
        ):  # fmt: skip
            if group in said:
                do(said[group])
        if "coordinate system" in said:
            self.places.choose(said["coordinate system"], self._words, self.line)
        if "one line" in said:
            self.places.shift(said["one line"], self._words, self.line, bare_g92)
        if not known & {100, 760}:
            self._words.pop("H", None)
        self._motion(said.get("motion"), known)
        self._stops(block)
        self._words.check_used(self.corners.names)

    def _unknown_m(self, block: Block, known: set[int]) -> None:
        """An M code that the dialect does not have takes the words of its line with it, unless a G code moves there."""
        there = self.dialect.m_codes
        for code in [each for each in block.m if there and each not in there]:
            said = f"M{code} is not known in the dialect {self.dialect.title}; its words move nothing"
            self.findings.count(said, self.line)
            if not any(codes.GROUP_OF.get(each) in ("motion", "one line") for each in known):
                self._words.clear()

    def _refuse(self, code: int, known: set[int]) -> None:
        reason, name = codes.REFUSED.get(code), g_name(code)
        if self._compensates(code) or code in self.cycles.known or (code == 760 and self.dialect.of_linuxcnc):
            return
        if reason is None:
            elsewhere = code in (700, 710) and not self.dialect.units_by_70
            if elsewhere or (code not in codes.GROUP_OF and code not in codes.WITHOUT_EFFECT):
                others = [each.name for each in DIALECTS.values() if code in each.own]
                own = f"{name} is a code of {self.dialect.title} that is not read; let the CAM system write its moves"
                refuse(code in self.dialect.own, own)
                named = ", ".join(others[:-1]) + " and " * (len(others) > 1) + "".join(others[-1:])
                hint = f"it is a code of {named}" if others else "the program may be another control's"
                hint += ": name the control (option dialect)"
                raise LineError(f"{name} is not known in the dialect {self.dialect.title}; {hint}")
        elif self.repair and code in (*codes.PROBES, *codes.COMPENSATION):
            self.findings.count(f"{name} is left out, the path is as programmed: {reason.partition(';')[0]}", self.line)
            if code in codes.PROBES:
                self._words.axes(self.state)
                known.discard(code)
                self.state.motion = -1
        elif code in codes.COMPENSATION and not self.dialect.jumps:
            raise LineError(
                f"{name} is cutter compensation, which is not read in the dialect {self.dialect.title}; write the "
                "compensated path (G40), or read the path as programmed (option repair)"
            )
        else:
            raise LineError(f"{name} is {reason}")

    def _feed_mode(self, code: int) -> None:
        state, mode = self.state, code // 10
        if mode == 95:
            self.findings.count("feeds by G95 are F times the speed S of the spindle, taken as constant", self.line)
        if state.feed_mode != mode and 95 in (state.feed_mode, mode):
            state.feed = state.feed_per_turn = 0.0  # as in LinuxCNC F is said again
        state.feed_mode = mode

    def _spindle_mode(self, code: int | None, known: set[int]) -> None:
        """G96, S at the surface with D as the highest speed, and G97; G92 S and G50 S of lathes are that speed too."""
        state = self.state
        if self.dialect.of_fanuc and known & {920, 500} and not self._words.keys() & set(LETTERS):
            state.top_speed = self._words.pop("S", state.top_speed) or math.inf
        if code is None:
            return
        refuse(code == 960 and "S" not in self._words, "G96 needs S, the speed at the surface")
        state.surface = code == 960
        if state.surface:
            state.top_speed = self._words.pop("D", state.top_speed) or math.inf
            said = "with G96 and G95 a move has the feed at its mean distance from X0, the spindle its speed at once"
            self.findings.count(said, self.line)
        state.set_feed(None)

    def _units_late(self, code: int) -> None:
        """Say that moves before the first line with units are in others, if they are."""
        state = self.state
        if not state.units and (state.moved or state.count) and (code in (200, 700)) != state.inch:
            unit = "inches" if state.inch else "mm"
            self.findings.count(f"moves before the first line with units are taken in {unit} (option units)", self.line)

    def _units_of_feed(self, code: int) -> None:
        """F on a line that changes units: the new ones come first, unless LinuxCNC knows others from lines before."""
        if self.state.geometry_alone and code in (700, 710):
            return
        if (code in (200, 700)) != self.state.inch:
            if not (self.dialect.of_linuxcnc and self.state.units):
                self.state.set_units(code)
            unit = "inches" if self.state.inch else "mm"
            self.findings.count(f"F on a line that changes units is taken in {unit} a minute", self.line)

    def _feed_word(self, motion: int | None) -> None:
        feed, state = self._words.get("F"), self.state
        if feed is None or (motion in (330, 331) and self.dialect.lead == "F"):
            return
        if motion in (330, 331):
            raise LineError(f"F is not allowed with {g_name(motion)}, whose feed is K times the spindle's speed")
        if not 0.0 <= feed <= LARGEST:
            raise LineError(f"F{feed:g} is not a feed")
        if state.feed_mode != 93:
            state.set_feed(self._words.pop("F"))

    def _outputs(self, block: Block) -> None:
        """S, T and M as markers before the motion of the line; dwells likewise."""
        state, words, linuxcnc = self.state, self._words, self.dialect.of_linuxcnc
        wait = self._dwell() if 40 in block.g else None
        spindles = {3, 4, 5, 19} & set(block.m) or {960, 970} & set(block.g) or "S" in words
        if "$" in words and linuxcnc and spindles and words.pop("$") > 0.0:
            self.findings.count("spindles other than $0 are left out", self.line)
            words.pop("S", None)
            block.m[:] = [code for code in block.m if code not in (3, 4, 5, 19)]
        if "T" in words:
            state.select(words["T"])
        stop = ("S" in words and state.new_speed(words["S"])) or "T" in words
        said = [f"G{code // 10}" for code in (960, 970) if code in block.g]
        said += [f"{letter}{number(words.pop(letter))}" for letter in "ST" if letter in words]
        any_m = False
        for code in block.m:
            if code in codes.M_GROUPS["stop"] or (linuxcnc and self._modal_state(code)):
                continue
            state.switch(code)
            if code == 6:
                self.cutter.forget()
            if linuxcnc and code in (SWITCH_ON, SWITCH_OFF):
                self.tool_tip.switch(code, self.line)
            if code in codes.SUBPROGRAMS:
                self._subprogram(code, block)
                continue
            any_m, stop = True, stop or code not in codes.ON_THE_MOVE
            said.append(f"M{code}")
            if code == 61 and linuxcnc:  # the tool in the spindle has another number
                selected = state.selected
                state.select(self._words.need("Q", "M61"))
                state.loaded, state.selected = state.selected, selected
                said.append(f"Q{number(state.loaded)}")
        if any_m and not any(code in codes.GROUP_OF for code in block.g):
            said += [f"{each}{number(words.pop(each))}" for each in _M_WORDS if each in words]
        elif any_m and linuxcnc and not _TAKES_WORDS & {*block.g, self._modal}:
            own = {each for code in block.m for each in _WORDS_OF_M.get(code, "")}
            said += [f"{each}{number(words.pop(each))}" for each in _M_WORDS if each in words and each in own]
        if said:
            state.say(self.line, " ".join(said), stop=stop)
        if wait is not None:
            state.say(self.line, dwell=wait)

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
        """M98: what `Flow` calls behind this line, P by number and L times; Fanuc's P may say both.

        M97 of a Haas calls the lines of the same program from N on.
        """
        words = self._words
        if code == 97 and self.dialect.calls_lines:
            number, times = words.need_whole("P", "M97"), words.need_whole("L", "M97") if "L" in words else 1
            self.call, self.calls_line = (number, times), True
            return
        if code != 98 or not self.jumps:
            raise LineError(f"M{code}: subprograms are not supported here; write the program in one piece")
        if self.dialect.of_linuxcnc and (block.g or self._words.keys() - {"P", "L"}):
            raise LineError("M98 must be alone on its line; LinuxCNC ignores the rest of it")
        packed = self.dialect.of_fanuc and "L" not in words
        number = words.need_whole("P", "M98")
        times, number = divmod(number, 10_000) if packed and number > 9_999 else (1, number)
        self.call = number, words.need_whole("L", "M98") if "L" in words else times

    def _dwell(self) -> float:
        """The seconds of G4."""
        words, dialect = self._words, self.dialect
        if self.untold and "P" in words.whole and words.get("P", 0.0) >= UNSURE_FROM:
            p, there, others = words["P"], ", ".join(IN_SECONDS), ", ".join(IN_MILLISECONDS)
            raise LineError(
                f"G4 P{p:g} waits {p:g} s in {there}, and {1e-3 * p:g} s in {others}; nothing shows which control the "
                "program is for: name it (option dialect)"
            )
        self._say_unit(words)
        seconds = words.wait(dialect.dwell, dialect.dwell_pointed)
        for letter in dialect.dwell_words:
            if letter in words.whole and dialect.increments and not self.increments:
                said = f"{letter} of G4 without a decimal point is taken in s (option increments)"
                self.findings.count(said, self.line)
            as_p = letter in words.whole and dialect.dwell_pointed is not None and not dialect.increments
            seconds = words.pop(letter, seconds) * (dialect.dwell if as_p else 1.0)
        if self.dialect.extruder and math.isnan(seconds):
            return 0.0  # it waits until the printer rests
        hint = "; X and U are Fanuc's: name the control (option dialect)" if self._words.keys() & {"X", "U"} else ""
        refuse(math.isnan(seconds), f"G4 needs P, the time to wait{hint}")
        refuse(not 0.0 <= seconds <= LARGEST, f"G4: a wait of {seconds:g} s is not possible")
        return seconds

    def _say_unit(self, words: LineWords) -> None:
        """What is to be said of the unit of P, a time."""
        dialect = self.dialect
        if dialect.dwell_said and "P" in words and not (dialect.dwell_pointed and "P" in words.whole):
            self.findings.count(dialect.dwell_said, self.line)

    def _path_control(self, code: int) -> None:
        state, bound = self.state, 0.0
        state.exact_stop = code == 611
        if code == 640:
            bound = self._words.pop("P", UNBOUNDED)
            self._words.pop("Q", None)
            refuse(not bound >= 0.0, "G64: P, the tolerance, must be 0 or more")
            if bound == 0.0 and self.dialect.of_linuxcnc:  # LinuxCNC's interpreter makes no difference
                bound = UNBOUNDED
        state.tolerance = bound * state.scale[0]

    def _motion(self, code: int | None, known: set[int]) -> None:
        state = self.state
        if self.splines.open and code is not None and code != 53 and not self.splines.goes_on(code, self._words):
            self.splines.end()
        if state.motion in _RATE:
            self._before_cycles = state.motion
        if code is not None:
            again = self._before_cycles if code == 800 and self.dialect.of_fanuc else -1
            state.motion = again if code in (53, 800) else code
        if code == 800:
            if state.motion < 0 or not self._words.keys() & set(LETTERS):
                return
            code = None
        if code in _SPLINES or (self._modal in _SPLINES and self._words.keys() & _SPLINE_WORDS):
            inverse = self._words.get("F") if state.feed_mode == 93 else None
            self.splines.line(code, self._modal, self._words, self.line, inverse)
            if code == 53:
                self.splines.end()
            return
        axes = {letter: self._words[letter] for letter in LETTERS + POLAR if letter in self._words}
        if 530 in known:
            if axes and (move := self.places.machine_move(self._words, self.line)):
                kind, end, said = move
                state.add(kind, end, said, self.line, **self._feed(kind, end))
            return
        if axes or code is not None:
            refuse(self.corners.open and (code not in (None, 0, 10, 20, 30)), "a corner needs a line, G1, behind it")
            if self._modal == 760 and self.dialect.of_linuxcnc:
                thread(state, self._words, self.line, self.findings)
                return
            if self._modal in self.cycles.known:
                self._say_unit(self._words)
                if self.dialect.increments and "Q" in self._words.whole and not self.increments:
                    unit = "mm or inches (option increments)"
                    self.findings.count(
                        f"Q, the depth of a peck, without a decimal point is taken in {unit}", self.line
                    )
                self.cycles.line(self._modal, self._words, self.line)
                return
        tool_axis = self.tool_tip.taken(self._words, self._modal)
        if not axes and tool_axis is None and not (self._modal in (20, 30) and self._words.keys() & set("IJK")):
            return
        refuse(self._modal not in _RATE, "axis words without G0, G1, G2 or G3 before them")
        there, said = state.target(axes)
        for letter in axes:
            del self._words[letter]
        if self._modal in (330, 331):
            lead = self._words.pop(self.dialect.lead, None)
            tied(state, self._modal, (there, said), lead, self.line, self.findings)
            return
        kind = _RATE[self._modal] or state.rapid
        more = self._feed(kind, there)
        flags = more.pop("flags", 0)
        if self._modal == 0 and kind != MoveKind.RAPID:
            flags |= Flag.G0_AT_F
        if tool_axis is not None:
            said, flags, more["centre"] = said | TOOL_AXIS | TOOL_AXIS << STATED, flags | Flag.VECTOR, tool_axis
        if kind in (MoveKind.CLOCKWISE, MoveKind.COUNTERCLOCKWISE):
            said |= 7 & ~(1 << state.across)
            arc = self._arc()
            flags |= arc.pop("flags")
            more |= arc
        before = state.position.copy() if self.cutter.on else state.position
        self.cutter.check_exit(kind)
        corner = next((word for word in CORNER_WORDS if word in self._words), "") if self._words else ""
        refuse((corner or self.corners.open) and self.cutter.on, "corners cannot be rounded beside G41 and G42")
        self.corners.complete(kind, there)
        state.add(kind, there, said, self.line, flags=flags, **more)
        if corner:
            self.corners.begin(corner, state.scaled(0, self._words.pop(corner)))
        if self.cutter.on:
            self.cutter.moved(before)
            state.position[:] = there

    def _stops(self, block: Block) -> None:
        """M0, M1, M2, M30, M60 and M99, behind the motion of their line."""
        for code in block.m:
            if code == 99:
                if not self.jumps or ("P" in self._words and not self.dialect.of_fanuc):
                    raise LineError("M99 with P, or in this dialect, is not supported; write the program in one piece")
                self.goes_on = self._words.need_whole("P", "M99") if "P" in self._words else 0
                self._words.pop("L", None)
                self.returns = True
            elif code in codes.M_GROUPS["stop"]:
                self.state.say(self.line, f"M{code}")
            if code in codes.ENDS:
                self.ended = True
        if self.ended:
            self._words.clear()
            self.splines.end()
            self.corners.end()

    @property
    def _modal(self) -> int:
        """The motion in force, as tenths of its G code; -1 for none."""
        return self.state.motion

    def _feed(self, kind: int, there: Array) -> dict[str, Any]:
        """The feed of a move to `there` (9,) by inverse time, on its own line, or by G96 at its mean X."""
        state = self.state
        if kind != MoveKind.RAPID and state.surface and state.feed_mode == 95:
            middle = 0.5 * (there[0] + state.position[0]) - state.offset[0]
            return {"feed": state.feed_per_turn * state.turns(float(middle))}
        if state.feed_mode != 93:
            return {}
        feed = self._words.pop("F", None)
        refuse(kind != MoveKind.RAPID and feed is None, "F is missing; in inverse time (G93) every move needs its own")
        return {} if kind == MoveKind.RAPID or feed is None else {"feed": feed, "flags": Flag.INVERSE_FEED}

    def _arc(self) -> dict[str, Any]:
        state = self.state
        across = "IJK"[state.across]
        if self._words.get(across) == 0.0:  # as FreeCAD writes it beside I and J
            del self._words[across]
        if across in self._words:
            raise LineError(f"{across} lies across the plane G{state.plane}; choose another plane or leave it out")
        turns = self._words.pop("P", 1.0)
        if not 1.0 <= turns <= MAX_TURNS or turns != math.floor(turns):
            raise LineError(f"P{turns:g}: the turns of an arc must be whole, 1 to {MAX_TURNS}")
        radius = self._words.pop("R", None)
        words = {k: self._words.pop(letter) for k, letter in enumerate("IJK") if letter in self._words}
        if (radius is None) == (not words):
            both = "both are given" if words else "none is given"
            raise LineError(f"an arc needs its centre (I, J, K) or its radius (R), and {both}")
        if radius is not None:
            return {"radius": check_size("R", state.scaled(0, radius)), "turns": turns, "flags": Flag.R}
        absolute = state.absolute_centres
        refuse(absolute and len(words) < 2, "with G90.1 an arc needs both words of its centre")
        centre = np.zeros(3)
        for k, value in words.items():
            centre[k] = check_size("IJK"[k], float(state.scaled(k, value) + state.offset[k] * absolute))
        flags = sum(1 << k for k in words) | absolute * Flag.ABSOLUTE
        return {"centre": centre, "turns": turns, "flags": flags}

    def _tool_length(self, code: int) -> None:
        """G43 and its kin: the programmed point is the tool tip: the axes move by the tool offset."""
        state, name = self.state, g_name(code)
        axes = self._words.axes(self.state) if code in (431, 432) else {}
        number = self._words.pop("H", state.loaded if code == 430 else None)
        if code in TOOL_TIP:
            self.tool_tip.begin(TOOL_TIP[code], self.line, number, vectors=code == 435)
            return
        said, offset = "the path is that of the tool tip, as programmed (option tools)", state.offsets.tool
        if state.tools is not None:
            said = "from here on places are those of the axes, not the tip"
            state.length_code = 490 if code == 490 else 430
            refuse(code == 432 and (number is None) == (not axes), "G43.2 needs H, or axes, and not both")
            if code in (430, 490):
                offset[:] = 0.0
            if number is not None:
                offset += state.tools.tool(number or state.loaded).offset
            for axis, value in axes.items():
                offset[axis] = value + (offset[axis] if code == 432 else 0.0)
        if state.tip:
            self.tool_tip.length(code, self.line)
        elif code != 490:
            self.findings.say(f"line {self.line}: {name}: {said}")
        state.set_offsets()

    def _compensates(self, code: int) -> bool:
        """Whether the code begins cutter compensation, and the radius is known."""
        known = code in (411, 421) or (code in (410, 420) and self.state.tools is not None)
        return known and self.dialect.jumps and not self.repair

    def _cutter(self, code: int) -> None:
        """G40 to G42.1: D is a tool's number, or with G41.1 and G42.1 its diameter."""
        state, name = self.state, g_name(code)
        if code == 400:
            self.cutter.end()
            return
        if not self._compensates(code):
            self._words.pop("D", None)
            return
        if self.cutter.on or state.tip or state.plane == 19:
            what = "G40" if self.cutter.on else "the end of tool centre point control" if state.tip else "G17 or G18"
            raise LineError(f"{name} needs {what} before it")
        refuse(code % 10 and self._words.pop("L", 0.0), f"{name} L: tools of a lathe are not supported")
        if code % 10 or state.tools is None:
            diameter = state.scaled(0, self._words.need("D", name))
        else:
            diameter = state.tools.tool(self._words.pop("D", state.loaded)).diameter
        refuse(abs(diameter) > LARGEST, f"{name}: a tool of diameter {diameter:.6g} mm does not compensate")
        if diameter == 0.0:
            self.findings.count(f"{name} with a tool of diameter 0 moves nothing to the side", self.line)
            return
        said = "cutter compensation is on; not every gouge is found: look at the path before you cut"
        self.findings.count(said, self.line)
        self.cutter.begin(0.5 * diameter * (1.0 if code < 420 else -1.0), self.line)

    def _beside_contour(self, block: Block, known: set[int]) -> None:
        """LineError for what cannot stand between G41 and G40."""
        allowed = {0, 10, 20, 30, 40, 400, 800}
        groups = ("motion", "one line", "plane", "coordinate system", "tool length", "units", "feed mode")
        same = {10 * self.state.plane, 940, 200 if self.state.inch else 210}
        wrong = [code for code in known - allowed - same if codes.GROUP_OF.get(code) in groups and 400 not in known]
        named = g_name(min(wrong)) if wrong else ""
        named = "M70 to M73 are" if any(70 <= code <= 73 for code in block.m) else f"{named} is" if named else ""
        if 6 in block.m or self.state.feed_mode == 93:
            named = named or "a change of tool and G93 are"
        refuse(named, f"{named} not allowed between G41 or G42 and G40")

"""What a line does: the interpreter of RS274 as LinuxCNC has it, and of the dialects that are near to it.

Source: LinuxCNC documentation, "G-Codes", "M-Codes" and "G-Code Overview"; NISTIR 6556. Order within a line: feed mode,
units, feed, speed, tool, spindle and coolant, dwell, plane, tool length, coordinate system, path control, distance
mode, offsets and reference points, motion, stop. LinuxCNC takes F in the units of the line before; here F goes with
G20 and G21 of its own line, and a finding says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from splinefeed.formats.gcode import codes, layout
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.cutter import Cutter
from splinefeed.formats.gcode.cycles import CYCLES, Cycles
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError, Parameters
from splinefeed.formats.gcode.line_words import LineWords
from splinefeed.formats.gcode.moves import AXES, CLOCKWISE, COUNTERCLOCKWISE, LETTERS, LINE, RAPID, Findings
from splinefeed.formats.gcode.offsets import REFERENCE_PARAMETERS, SYSTEMS
from splinefeed.formats.gcode.spline_words import SplineWords
from splinefeed.formats.gcode.state import UNBOUNDED, State, number
from splinefeed.formats.gcode.tool_tip import SWITCH_OFF, SWITCH_ON, TOOL_AXIS, TOOL_TIP, ToolTip
from splinefeed.formats.gcode.tools import Tool
from splinefeed.formats.gcode.words import Block, parse, without_comments, without_nested

_RATE = {0: RAPID, 10: LINE, 20: CLOCKWISE, 30: COUNTERCLOCKWISE}
_SPLINES = (50, 51, 52, 53, 62, 63)
#: Letters that belong to M codes where no G code of the line takes them.
_M_WORDS = "PLQEDIJKRU"


class Interpreter(LineWords):
    """Runs lines one after the other on a `State`; `ended` is set by M2, M30 and the like."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings, *, repair: bool = False) -> None:
        super().__init__(state)
        self.dialect = dialect
        self.findings = findings
        self.repair = repair
        self.parameters = Parameters(state.parameter)
        self.ended = False
        self.call: tuple[int, int] | None = None  # what M98 calls, and how often
        self.returns = False  # whether there was an M99
        self.line = 0
        self.splines = SplineWords(state, findings)
        self.cycles = Cycles(state, dialect)
        self.cutter = Cutter(state)
        self.tool_tip = ToolTip(state, findings)
        self._modal: int | None = None
        self._percents = False
        self._machine_known = bool(state.offsets.known or state.offsets.references)

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
            self.findings.count("lines with / are carried out, as if block delete were off", line)
        if block.percent:
            self._percent()
        if not block.empty:
            self._do(block)
        for key, value in block.settings:
            self.parameters.set(key, value)

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
            self.findings.count(f"{fault}; comments are taken to their last bracket, or to the end", self.line)
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
        if not known & {100, 730, 830, 410, 411, 420, 421}:
            self._take("D")
        if self.cutter.on:
            self._beside_contour(block, known)
        said = {codes.GROUP_OF[code]: code for code in sorted(known, reverse=True) if code in codes.GROUP_OF}
        for group, do in _ACTS.items():
            if group is None:
                self._feed_word()
                self._outputs(block)
            elif group in said:
                do(self, said[group])
        if not known & {100}:
            self._take("H")
        self._motion(said.get("motion"), known)
        self._stops(block)
        if self._words:
            letter, value = next(iter(self._words.items()))
            hint = "; a number cannot have an exponent" if letter == "E" else ""
            raise LineError(f"{letter}{value:g} belongs to no code of the line{hint}")

    def _refuse(self, code: int, known: set[int]) -> None:
        reason = codes.REFUSED.get(code)
        if self._compensates(code):
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
        self.state.modes[layout.INVERSE] = code == 930

    def _units(self, code: int) -> None:
        inch = code in (200, 700)
        if inch != self.state.inch:
            if "F" in self._words:
                unit = "inches" if inch else "mm"
                self.findings.count(f"F stands with a change of units and is taken in {unit} a minute", self.line)
            self.state.set_units(inch=inch)

    def _feed_word(self) -> None:
        feed, state = self._words.get("F"), self.state
        if feed is not None and not 0.0 <= feed <= layout.LARGEST:
            raise LineError(f"F{feed:g} is no feed")
        if feed is not None and not state.modes[layout.INVERSE]:
            state.values[layout.FEED] = feed * state.values[layout.SCALE]
            self._take("F")

    def _outputs(self, block: Block) -> None:
        """S, T and M as markers before the motion of the line; dwells likewise."""
        wait = self._dwell() if 40 in block.g else None
        wait_tool = 0.0
        if "T" in self._words:
            self.state.select(self._words["T"], self.line)
        stop = "T" in self._words or ("S" in self._words and self.state.new_speed(self._words["S"]))
        said = [f"{letter}{number(self._words.pop(letter))}" for letter in "ST" if letter in self._words]
        before = [m for m in block.m if m not in codes.M_GROUPS["stop"]]
        for code in before:
            wait_tool += self.state.switch(code)
            if code in (SWITCH_ON, SWITCH_OFF) and self.dialect.name == "linuxcnc":
                self.tool_tip.switch(code, self.line)
            if code in codes.SUBPROGRAMS:
                self._subprogram(code, block)
        before = [code for code in before if code not in codes.SUBPROGRAMS]
        said += [f"M{code}" for code in before]
        if before and not any(code in codes.GROUP_OF for code in block.g):
            said += [f"{each}{number(self._words.pop(each))}" for each in _M_WORDS if each in self._words]
        if said:
            stop |= any(code not in codes.ON_THE_MOVE for code in before)
            self.state.say(self.line, " ".join(said), wait_tool, stop)
        if wait is not None:
            self.state.say(self.line, dwell=wait)

    def _subprogram(self, code: int, block: Block) -> None:
        """M98: what `Flow` calls behind this line, P by number and L times; Fanuc's P may say both."""
        if code != 98 or not self.dialect.jumps:
            raise LineError(f"M{code}: subprograms are not read; write the program in one piece")
        if "P" not in self._words:
            raise LineError("M98 needs P, the number of the subprogram")
        if self.dialect.name == "linuxcnc" and (block.g or self._words.keys() - {"P", "L"}):
            raise LineError("M98 stands alone on its line; LinuxCNC loses what else the line says")
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

    def _system(self, code: int) -> None:
        if not self.state.offsets.select(SYSTEMS[code]):
            self.findings.say(f"line {self.line}: the offset of {g_name(code)} is not known: taken as 0 (offsets=)")
        self.state.set_offsets()

    def _path_control(self, code: int) -> None:
        state, bound = self.state, 0.0
        state.modes[layout.EXACT_STOP] = code == 611
        if code == 640:
            bound = self._words.pop("P", UNBOUNDED)
            self._take("Q")
            if not bound >= 0.0:
                raise LineError("G64: P, the tolerance, must be 0 or more")
        state.values[layout.TOLERANCE] = bound * state.values[layout.SCALE]

    def _compensates(self, code: int) -> bool:
        """Whether the code begins cutter compensation, and the radius is known."""
        known = code in (411, 421) or (code in (410, 420) and self.state.tools is not None)
        return known and self.dialect.jumps and not self.repair

    def _cutter(self, code: int) -> None:
        """G40 to G42.1: D is a tool's number, or with G41.1 and G42.1 its diameter."""
        if code == 400:
            self.cutter.end()
            return
        if not self._compensates(code):
            self._take("D")
            return
        if self.cutter.on or self.state.tip:
            what = "cutter compensation is on; write G40" if self.cutter.on else "X, Y, Z are the tool's tip; end that"
            raise LineError(f"{g_name(code)}: {what} before it")
        if self.state.modes[layout.PLANE] == 19:
            raise LineError(f"{g_name(code)}: there is no cutter compensation in G19; choose G17 or G18")
        if code % 10:
            if self._take("L", 0.0):
                raise LineError(f"{g_name(code)} L: tools of a lathe are not read")
            diameter = self.state.scaled(0, self._need("D", code))
        else:
            tools, number = self.state.tools, self._take("D", self.state.loaded)
            diameter = 0.0 if tools is None else tools.tool(number or 0.0).diameter
        if abs(diameter) > layout.LARGEST or diameter == 0.0:
            raise LineError(f"{g_name(code)}: a tool of diameter {diameter:.6g} mm does not compensate")
        self.findings.count(
            "cutter compensation is on; not every gouge is found: look at the path before you cut", self.line
        )
        self.cutter.begin(0.5 * diameter * (1.0 if code < 420 else -1.0))

    def _beside_contour(self, block: Block, known: set[int]) -> None:
        """LineError for what cannot stand between G41 and G40."""
        allowed = {0, 10, 20, 30, 40, 400, 800}
        groups = ("motion", "one line", "plane", "coordinate system", "tool length", "units", "feed mode")
        same = {10 * int(self.state.modes[layout.PLANE]), 940, 200 if self.state.inch else 210}
        for code in sorted(known - allowed - same):
            if 400 not in known and codes.GROUP_OF.get(code) in groups:
                raise LineError(f"{g_name(code)} cannot stand between G41 or G42 and G40")
        if 6 in block.m or self.state.modes[layout.INVERSE]:
            raise LineError("a change of tool and G93 cannot stand between G41 or G42 and G40")

    def _retract(self, code: int) -> None:
        self.cycles.returns = code // 10

    def _distance(self, code: int) -> None:
        self.state.modes[layout.RELATIVE] = code == 910

    def _arc_distance(self, code: int) -> None:
        self.state.modes[layout.CENTRES] = code == 901

    def _tool_length(self, code: int) -> None:
        """G43 and its kin: the programmed point is the tool tip: the axes move by the tool offset."""
        state = self.state
        axes = self._axes() if code in (431, 432) else {}
        number = self._take("H", state.loaded if code == 430 else None)
        if code in TOOL_TIP:
            self.tool_tip.begin(TOOL_TIP[code], self.line, number, vectors=code == 435)
            return
        if state.tools is None:
            if state.tip:
                self.tool_tip.length(code, self.line)
            elif code != 490:
                self.findings.say(
                    f"line {self.line}: {g_name(code)}: the path is that of the tool's tip, as programmed (tools=)"
                )
            return
        offset = state.offsets.tool
        if code == 432 and (number is None) == (not axes):
            raise LineError("G43.2 needs H, or axes, and not both")
        if code in (430, 490):
            offset[:] = 0.0
        if number is not None:
            offset += state.tools.tool(number or state.loaded).offset
        for axis, value in axes.items():
            offset[axis] = value + (offset[axis] if code == 432 else 0.0)
        if state.tip:
            self.tool_tip.length(code, self.line)
        elif offset.any():
            self.findings.say(
                f"line {self.line}: {g_name(code)}: from here on places are those of the axes, not the tip"
            )
        state.set_offsets()

    def _places(self, code: int) -> None:
        """G10, G52, G92 and the reference points of G28 and G30."""
        offsets, position = self.state.offsets, self.state.position
        if code == 100:
            self._set_system()
        elif code == 520:
            offsets.set_local(self._axes())
        elif code == 920:
            axes = self._axes()
            if not axes and self._bare_g92:
                raise LineError("G92 needs the axes whose places it gives")
            offsets.set_g92(axes, position)
        elif code in (921, 922, 923):
            offsets.clear(code)
        elif code in (281, 301):
            offsets.references[code - 1] = position.copy()
        self.state.set_offsets()
        if code in (280, 300):
            self._go_to_reference(code)

    def _set_system(self) -> None:
        kind, state = self._whole("L", 100), self.state
        if kind in (1, 10) and state.tools is not None:
            number, radius, axes = self._whole("P", 100), self._take("R"), self._axes()
            tool = state.tools.by_number.get(number, Tool(np.zeros(AXES)))
            offset, diameter = tool.offset.copy(), tool.diameter if radius is None else 2.0 * state.scaled(0, radius)
            bare = state.position - state.offsets.total + state.offsets.length
            for axis, value in axes.items():
                offset[axis] = value if kind == 1 else bare[axis] - value
            by_number = {**state.tools.by_number, number: Tool(offset, diameter)}
            state.tools = replace(state.tools, by_number=by_number)
            return
        if kind not in (2, 20):
            self.findings.count(f"G10 L{kind} changes the tool table, which no path knows", self.line)
            self._words = {each: value for each, value in self._words.items() if each in "FST"}
            return
        system = self._whole("P", 100)
        if not 0 <= system <= 9:
            raise LineError(f"G10 P{system}: coordinate systems are 1 to 9, or 0 for the one in force")
        if self._take("R", 0.0):
            raise LineError("G10 R: turned coordinate systems are not read; write the turned coordinates")
        if kind == 2:
            state.offsets.set_system(system, self._axes())
        else:
            state.offsets.set_here(system, self._axes(), state.position)
        self._machine_known = True

    def _go_to_reference(self, code: int) -> None:
        state = self.state
        there, said, stated = state.target({x: v for x in LETTERS if (v := self._take(x)) is not None})
        point = state.offsets.references.get(code)
        first = REFERENCE_PARAMETERS[code]
        if point is None and any(first + axis in self.parameters.numbers for axis in range(AXES)):
            values = [self.parameters.numbers.get(first + axis, 0.0) for axis in range(AXES)]
            point = np.array([state.scaled(axis, value) for axis, value in enumerate(values)])
        if point is None:
            self.findings.count(
                f"{g_name(code)} is left out: where the machine's reference point lies is not known here", self.line
            )
            if said and stated:
                state.add(RAPID, there, said, stated, self.line)
            return
        if said:
            state.add(RAPID, there, said, stated, self.line)
        end = np.where([said >> axis & 1 or not said for axis in range(AXES)], point, state.position)
        moved = sum(1 << axis for axis in range(AXES) if said >> axis & 1 or end[axis] != state.position[axis])
        state.add(RAPID, end, moved, moved, self.line)

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
            inverse = self._words.get("F") if state.modes[layout.INVERSE] else None
            self.splines.line(code, self._modal, self._words, self.line, inverse)
            if code == 53:
                self.splines.end()
                self._set_modal(None)
            return
        axes = {letter: self._words[letter] for letter in LETTERS if letter in self._words}
        if self._modal in CYCLES and 530 not in known and (axes or code is not None):
            self.cycles.line(self._modal, self._words, self.line)
            return
        centre = {letter: self._words[letter] for letter in "IJK" if letter in self._words}
        if 530 in known:
            self._machine_move(axes)
            return
        tool_axis = self.tool_tip.taken(self._words, self._modal)
        if not axes and not tool_axis and not (self._modal in (20, 30) and centre):
            return
        if self._modal not in _RATE:
            raise LineError("axis words without G0, G1, G2 or G3 before them")
        kind = _RATE[self._modal]
        there, said, stated = state.target(axes)
        for letter in axes:
            self._take(letter)
        more = self._feed(kind)
        if tool_axis:
            said, stated = said | TOOL_AXIS, stated | TOOL_AXIS
            more = {**more, **tool_axis, "flags": int(more.get("flags", 0)) | int(tool_axis["flags"])}
        if kind in (CLOCKWISE, COUNTERCLOCKWISE):
            said |= {17: 3, 18: 5, 19: 6}[int(state.modes[layout.PLANE])]
            arc = self._arc()
            more = {**more, **arc, "flags": int(more.get("flags", 0)) | int(arc["flags"])}
        before = state.position.copy()
        state.add(kind, there, said, stated, self.line, **more)
        if self.cutter.on:
            self.cutter.moved(before)
            state.position[:] = there

    def _set_modal(self, code: int | None) -> None:
        self._modal = None if code == 53 else code
        if code not in CYCLES:
            self.cycles.forget()
        self.state.modes[layout.MOTION] = -1 if code not in _RATE else code // 10

    def _spline_words(self) -> bool:
        return any(letter in self._words for letter in "XYZABCUVWIJKPQR")

    def _machine_move(self, axes: dict[str, float]) -> None:
        """G53: the words are places of the machine, which are known only where its offsets are."""
        if not axes:
            return
        if self._modal not in (0, 10):
            raise LineError("G53 needs G0 or G1")
        for letter in axes:
            self._take(letter)
        if not self._machine_known:
            self.findings.count(
                "G53 is left out: where the machine's zero lies is not known here (offsets=)", self.line
            )
            return
        end = self.state.position.copy()
        said = 0
        for axis, letter in enumerate(LETTERS):
            if letter in axes:
                end[axis] = self.state.scaled(axis, axes[letter])
                self._checked(float(end[axis]))
                said |= 1 << axis
        kind = _RATE[self._modal]
        self.state.add(kind, end, said, said, self.line, **self._feed(kind))

    def _stops(self, block: Block) -> None:
        """M0, M1, M2, M30, M60 and M99, behind the motion of their line."""
        for code in block.m:
            if code == 99:
                if not self.dialect.jumps or "P" in self._words:
                    raise LineError("M99 with P, or in this dialect, is not read; write the program in one piece")
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
    "units": Interpreter._units,
    None: lambda *_: None,
    "plane": Interpreter._plane,
    "cutter compensation": Interpreter._cutter,
    "tool length": Interpreter._tool_length,
    "coordinate system": Interpreter._system,
    "path control": Interpreter._path_control,
    "retract": Interpreter._retract,
    "distance": Interpreter._distance,
    "arc distance": Interpreter._arc_distance,
    "one line": Interpreter._places,
}

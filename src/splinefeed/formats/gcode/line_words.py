"""What the words of a line say of the tool, of zero and of arcs: G10, G28, G30, G40 to G43, G49, G52 to G59.3, G92."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.formats.gcode import codes
from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.cutter import Cutter
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import Block, LineError, Parameters
from splinefeed.formats.gcode.moves import AXES, LARGEST, LETTERS, LINE, POLAR, RAPID, STATED, Findings, Flag
from splinefeed.formats.gcode.offsets import REFERENCE_PARAMETERS, SYSTEMS
from splinefeed.formats.gcode.state import State
from splinefeed.formats.gcode.tool_tip import TOOL_TIP, ToolTip
from splinefeed.formats.gcode.tools import Tool
from splinefeed.records import Array

#: Most turns of one arc.
MAX_TURNS = 1_000


class LineWords:
    """Values by letter; what is left when all codes of a line have taken theirs belongs to none of them."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings, repair: bool) -> None:
        self.state, self.dialect, self.findings, self.repair = state, dialect, findings, repair
        self.line = 0
        self.cutter, self.tool_tip = Cutter(state), ToolTip(state, findings)
        self.parameters = Parameters(state.parameter)
        self._words: dict[str, float] = {}
        self._bare_g92 = True
        self._machine_known = bool(state.offsets.known or state.offsets.references)

    @property
    def _modal(self) -> int:
        """The motion in force, as tenths of its G code; -1 for none."""
        return self.state.motion

    def _need(self, letter: str, name: str) -> float:
        if letter not in self._words:
            raise LineError(f"{name} needs {letter}")
        return self._words.pop(letter)

    def _whole(self, letter: str, name: str) -> int:
        value = self._need(letter, name)
        if not 0.0 <= value < 1e9 or abs(value - round(value)) > 1e-4:
            raise LineError(f"{letter}{value:g} of {name} is not a whole number from 0")
        return round(value)

    def _axes(self) -> dict[int, float]:
        """Axis words as values in mm or rad by axis, which are then done with."""
        scaled, words = self.state.scaled, self._words
        return {axis: scaled(axis, words.pop(letter)) for axis, letter in enumerate(LETTERS) if letter in words}

    def _feed(self, kind: int, there: Array) -> dict[str, Any]:
        """The feed of a move to `there` (9,) by inverse time, on its own line, or by G96 at its mean X."""
        state = self.state
        if kind != RAPID and state.surface and state.feed_mode == 95:
            middle = 0.5 * (there[0] + state.position[0]) - state.offset[0]
            return {"feed": state.feed_per_turn * state.turns(float(middle))}
        if state.feed_mode != 93:
            return {}
        feed = self._words.pop("F", None)
        if kind != RAPID and feed is None:
            raise LineError("F is missing; in inverse time (G93) every move needs its own")
        return {} if kind == RAPID or feed is None else {"feed": feed, "flags": Flag.INVERSE_FEED}

    def _arc(self) -> dict[str, Any]:
        state = self.state
        across = "IJK"[state.across]
        if self._words.get(across) == 0.0:  # as FreeCAD writes it beside I and J
            del self._words[across]
        if across in self._words:
            plane = state.plane
            raise LineError(f"{across} lies across the plane G{plane}; choose another plane or leave it out")
        turns = self._words.pop("P", 1.0)
        if not 1.0 <= turns <= MAX_TURNS or turns != math.floor(turns):
            raise LineError(f"P{turns:g}: the turns of an arc must be whole, 1 to {MAX_TURNS}")
        radius = self._words.pop("R", None)
        words = {k: self._words.pop(letter) for k, letter in enumerate("IJK") if letter in self._words}
        if (radius is None) == (not words):
            both = "both are given" if words else "none is given"
            raise LineError(f"an arc needs its centre (I, J, K) or its radius (R), and {both}")
        if radius is not None:
            return {"radius": self._checked(state.scaled(0, radius)), "turns": turns, "flags": Flag.R}
        absolute = state.absolute_centres
        if absolute and len(words) < 2:
            raise LineError("with G90.1 an arc needs both words of its centre")
        centre = np.zeros(3)
        for k, value in words.items():
            centre[k] = self._checked(state.scaled(k, value) + state.offset[k] * absolute)
        flags = sum(1 << k for k in words) | absolute * Flag.ABSOLUTE
        return {"centre": centre, "turns": turns, "flags": flags}

    @staticmethod
    def _checked(value: float) -> float:
        if not abs(value) <= LARGEST:
            raise LineError(f"the centre or radius of the arc, {value:g} mm, is too large")
        return value

    def _tool_length(self, code: int) -> None:
        """G43 and its kin: the programmed point is the tool tip: the axes move by the tool offset."""
        state, name = self.state, g_name(code)
        axes = self._axes() if code in (431, 432) else {}
        number = self._words.pop("H", state.loaded if code == 430 else None)
        if code in TOOL_TIP:
            self.tool_tip.begin(TOOL_TIP[code], self.line, number, vectors=code == 435)
            return
        said, offset = "the path is that of the tool tip, as programmed (option tools)", state.offsets.tool
        if state.tools is not None:
            said = "from here on places are those of the axes, not the tip"
            state.length_code = 490 if code == 490 else 430
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
        if code % 10 and self._words.pop("L", 0.0):
            raise LineError(f"{name} L: tools of a lathe are not supported")
        if code % 10 or state.tools is None:
            diameter = state.scaled(0, self._need("D", name))
        else:
            diameter = state.tools.tool(self._words.pop("D", state.loaded)).diameter
        if abs(diameter) > LARGEST:
            raise LineError(f"{name}: a tool of diameter {diameter:.6g} mm does not compensate")
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
        if named:
            raise LineError(f"{named} not allowed between G41 or G42 and G40")

    def _system(self, code: int) -> None:
        if not self.state.offsets.select(SYSTEMS[code]):
            self.findings.count(f"the offset of {g_name(code)} is not known: taken as 0 (option offsets)", self.line)
        self.state.set_offsets()

    def _places(self, code: int) -> None:
        """G10, G52, G92 and the reference points of G28 and G30."""
        offsets, position = self.state.offsets, self.state.position
        if code == 100:
            self._set_system()
        elif code in (520, 920):
            axes = self._axes()
            if code == 920 and not axes and self._bare_g92:
                raise LineError("G92 needs the axes whose places it gives")
            offsets.shift(axes, position if code == 920 else None)
        elif code in (921, 922, 923):
            offsets.clear(code)
        elif code in (281, 301):
            offsets.references[code - 1] = self.state.place
        self.state.set_offsets()
        if code in (280, 300):
            self._go_to_reference(code)

    def _set_system(self) -> None:
        kind, state, offsets = self._whole("L", "G10"), self.state, self.state.offsets
        if kind in (1, 10, 11) and state.tools is not None:
            number, radius, values = self._whole("P", "G10"), self._words.pop("R", None), self._axes()
            if kind > 1:
                values = offsets.zero(values, state.place, SYSTEMS[593] if kind == 11 else 0, tool=True)
            tool = state.tools.by_number.get(number, Tool(np.zeros(AXES)))
            offset, diameter = tool.offset.copy(), tool.diameter if radius is None else 2.0 * state.scaled(0, radius)
            offset[list(values)] = list(values.values())
            by_number = {**state.tools.by_number, number: Tool(offset, diameter)}
            state.tools = replace(state.tools, by_number=by_number)
        elif kind not in (2, 20):
            self.findings.count(f"G10 L{kind} changes the tool table, which is not supported", self.line)
            self._words = {each: value for each, value in self._words.items() if each in "FST"}
        else:
            system, values = self._whole("P", "G10"), self._axes()
            if system > 9:
                raise LineError(f"G10 P{system}: coordinate systems are 1 to 9, or 0 for the one in force")
            angle = self._words.pop("R", None) if kind == 2 else None
            values = values if kind == 2 else offsets.zero(values, state.place, system)
            offsets.set_system(system, values, None if angle is None else math.radians(angle))
            self._machine_known = True

    def _go_to_reference(self, code: int) -> None:
        state, numbers = self.state, self.parameters.numbers
        there, said = state.target({x: self._words.pop(x) for x in LETTERS if x in self._words})
        point, first = state.offsets.references.get(code), REFERENCE_PARAMETERS[code]
        if point is None and numbers.keys() & set(range(first, first + AXES)):
            point = np.array([state.scaled(axis, numbers.get(first + axis, 0.0)) for axis in range(AXES)])
        if point is None:
            self.findings.count(f"{g_name(code)} is left out: the machine's reference point is unknown here", self.line)
        if said and (not state.relative or point is not None):
            state.add(RAPID, there, said, self.line)
        if point is None:
            return
        chosen = said >> np.arange(AXES) & 1 != 0
        end = np.where(chosen | (not said), state.frame.from_machine(point), state.position)
        moved = int((chosen | (end != state.position)) @ (1 << np.arange(AXES)))
        state.add(RAPID, end, moved | moved << STATED, self.line)

    def _machine_move(self, axes: dict[str, float]) -> None:
        """G53: the words are places of the machine, which are known only where its offsets are."""
        if not axes:
            return
        if self._modal not in (0, 10):
            raise LineError("G53 needs G0 or G1")
        if axes.keys() & set(POLAR):
            raise LineError("polar coordinates (@, ^) are not machine positions; write X and Y with G53")
        if not self._machine_known:
            self._axes()
            self.findings.count("G53 is left out: the machine's zero is unknown here (option offsets)", self.line)
            return
        end, places = self.state.place, self._axes()
        end[list(places)] = [self._checked(place) for place in places.values()]
        said = sum(1 << axis | 1 << axis + STATED for axis in places)
        kind, end = LINE if self._modal else RAPID, self.state.frame.from_machine(end)
        self.state.add(kind, end, said, self.line, **self._feed(kind, end))

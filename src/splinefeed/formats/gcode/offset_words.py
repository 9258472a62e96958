"""Words about where zero lies: G10, G52, G54 to G59.3, the G92 family, and the machine's own places, G28, G30, G53."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from splinefeed.formats.gcode.codes import g_name
from splinefeed.formats.gcode.dialects import Dialect
from splinefeed.formats.gcode.expressions import LineError, Parameters
from splinefeed.formats.gcode.moves import AXES, LETTERS, LINE, POLAR, RAPID, Findings
from splinefeed.formats.gcode.offsets import REFERENCE_PARAMETERS, SYSTEMS
from splinefeed.formats.gcode.state import State
from splinefeed.formats.gcode.tool_words import ToolWords
from splinefeed.formats.gcode.tools import Tool


class OffsetWords(ToolWords):
    """Moves zero, and moves to the machine's own places where they are known."""

    def __init__(self, state: State, dialect: Dialect, findings: Findings, repair: bool) -> None:
        super().__init__(state, dialect, findings, repair)
        self.parameters = Parameters(state.parameter)
        self._bare_g92 = True
        self._modal: int | None = None
        self._machine_known = bool(state.offsets.known or state.offsets.references)

    def _system(self, code: int) -> None:
        if not self.state.offsets.select(SYSTEMS[code]):
            self.findings.say(
                f"line {self.line}: the offset of {g_name(code)} is not known: taken as 0 (option offsets)"
            )
        self.state.set_offsets()

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
            offsets.references[code - 1] = self.state.place
        self.state.set_offsets()
        if code in (280, 300):
            self._go_to_reference(code)

    def _set_system(self) -> None:
        kind, state = self._whole("L", 100), self.state
        if kind in (1, 10, 11) and state.tools is not None:
            number, radius, axes = self._whole("P", 100), self._take("R"), self._axes()
            tool = state.tools.by_number.get(number, Tool(np.zeros(AXES)))
            offset, diameter = tool.offset.copy(), tool.diameter if radius is None else 2.0 * state.scaled(0, radius)
            for axis, value in (axes if kind == 1 else state.offsets.tool_by(axes, state.place, kind == 11)).items():
                offset[axis] = value
            by_number = {**state.tools.by_number, number: Tool(offset, diameter)}
            state.tools = replace(state.tools, by_number=by_number)
            return
        if kind not in (2, 20):
            self.findings.count(f"G10 L{kind} changes the tool table, which is not supported", self.line)
            self._words = {each: value for each, value in self._words.items() if each in "FST"}
            return
        system = self._whole("P", 100)
        if not 0 <= system <= 9:
            raise LineError(f"G10 P{system}: coordinate systems are 1 to 9, or 0 for the one in force")
        if kind == 2:
            angle = self._take("R")
            state.offsets.set_system(system, self._axes(), None if angle is None else math.radians(angle))
        else:
            state.offsets.set_here(system, self._axes(), state.place)
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
            self.findings.count(f"{g_name(code)} is left out: the machine's reference point is unknown here", self.line)
            if said and stated:
                state.add(RAPID, there, said, stated, self.line)
            return
        if said:
            state.add(RAPID, there, said, stated, self.line)
        point = state.turned_back(point)
        end = np.where([said >> axis & 1 or not said for axis in range(AXES)], point, state.position)
        moved = sum(1 << axis for axis in range(AXES) if said >> axis & 1 or end[axis] != state.position[axis])
        state.add(RAPID, end, moved, moved, self.line)

    def _machine_move(self, axes: dict[str, float]) -> None:
        """G53: the words are places of the machine, which are known only where its offsets are."""
        if not axes:
            return
        if self._modal not in (0, 10):
            raise LineError("G53 needs G0 or G1")
        if axes.keys() & set(POLAR):
            raise LineError("polar coordinates (@, ^) are not machine positions; write X and Y with G53")
        for letter in axes:
            self._take(letter)
        if not self._machine_known:
            self.findings.count("G53 is left out: the machine's zero is unknown here (option offsets)", self.line)
            return
        end = self.state.place
        said = 0
        for axis, letter in enumerate(LETTERS):
            if letter in axes:
                end[axis] = self.state.scaled(axis, axes[letter])
                self._checked(float(end[axis]))
                said |= 1 << axis
        kind = LINE if self._modal else RAPID
        end = self.state.turned_back(end)
        self.state.add(kind, end, said, said, self.line, **self._feed(kind, end))

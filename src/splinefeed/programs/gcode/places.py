"""Codes that shift the zero point, choose a system or go to places of the machine: G10, G28, G52 to G59, G92.

Fanuc's G10 L2 has P1 to P6 (G54 to G59) and P0 (of all systems), L20 has P1 (G54.1 P1); both are added with G91 [2]_.

References
----------
.. [1] LinuxCNC documentation, "Coordinate System", and "G-Codes", G10, G28, G53, G92.
.. [2] Fanuc B-64484EN, "Workpiece coordinate system".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.dialects import Dialect
from splinefeed.programs.gcode.expressions import Parameters
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.line_words import LineWords
from splinefeed.programs.gcode.moves import AXES, LETTERS, POLAR, STATED, Findings, MoveKind
from splinefeed.programs.gcode.offsets import MORE_SYSTEMS, MOST_SYSTEMS, REFERENCE_PARAMETERS, SYSTEMS, system_name
from splinefeed.programs.gcode.state import ProgramState, check_size
from splinefeed.programs.gcode.tools import Tool
from splinefeed.records import Array

#: A Haas's systems that are G154 P1 to P20.
_MORE_OF_HAAS = range(1100, 1300, 10)


class Places:
    """Does such a code with the words of its line, on the state's offsets; the path keeps its coordinates."""

    def __init__(self, state: ProgramState, dialect: Dialect, findings: Findings, parameters: Parameters) -> None:
        self.state, self.dialect, self.findings, self.parameters = state, dialect, findings, parameters
        self._machine_known = bool(state.offsets.known or state.offsets.references)

    def choose(self, code: int, words: LineWords, line: int) -> None:
        """G54 to G59.3, and what a dialect has beyond them: the system in force."""
        number, name = SYSTEMS.get(code, 0), g_name(code)
        if not number:
            own = code in self.dialect.own
            refuse(
                code not in self.dialect.systems and own,
                f"{name} is a code of {self.dialect.title} that is not read; write its moves",
            )
            refuse(code not in self.dialect.systems, f"{name} is not known in the dialect {self.dialect.title}")
            more = (code - _MORE_OF_HAAS[0]) // 10 + 1 if code in _MORE_OF_HAAS else words.need_whole("P", name)
            refuse(not 1 <= more <= MOST_SYSTEMS, f"{name} P{more}: coordinate systems are P1 to P{MOST_SYSTEMS}")
            number = MORE_SYSTEMS + more
        if unknown := self.state.offsets.select(number, self.state.motion >= 0):
            said = f"the offset of {system_name(unknown)} is not known: taken as 0 (option offsets)"
            self.findings.count(said, line)
        self.state.set_offsets()

    def shift(self, code: int, words: LineWords, line: int, bare: bool) -> None:
        """G10, G52, G92 and the reference points of G28 and G30; `bare`: G92 without axes gives no place."""
        offsets, position = self.state.offsets, self.state.position
        if code == 100:
            self._set_system(words, line)
        elif code in (520, 920):
            axes = words.axes(self.state)
            refuse(code == 920 and not axes and bare, "G92 needs the axes whose places it gives")
            offsets.shift(axes, position if code == 920 else None)
        elif code in (921, 922, 923):
            offsets.clear(code)
        elif code in (281, 301):
            offsets.references[code - 1] = self.state.position.copy()
        self.state.set_offsets()
        if code in (280, 300):
            self._go_to_reference(code, words, line)

    def machine_move(self, words: LineWords, line: int) -> tuple[int, Array, int] | None:
        """G53: kind, end and axes of a move to places of the machine, which are known only where its offsets are."""
        state = self.state
        refuse(state.motion not in (0, 10), "G53 needs G0 or G1")
        refuse(words.keys() & set(POLAR), "polar coordinates (@, ^) are not machine positions; write X and Y with G53")
        places = words.axes(state)
        if not self._machine_known:
            self.findings.count("G53 is left out: the machine's zero is unknown here (option offsets)", line)
            return None
        end = state.position.copy()
        end[list(places)] = [check_size(LETTERS[axis], place) for axis, place in places.items()]
        said = sum(1 << axis | 1 << axis + STATED for axis in places)
        return (MoveKind.LINE if state.motion else MoveKind.RAPID), end, said

    def _set_system(self, words: LineWords, line: int) -> None:
        kind, state, offsets = words.need_whole("L", "G10"), self.state, self.state.offsets
        if kind in (1, 10, 11) and state.tools is not None:
            number, radius, values = words.need_whole("P", "G10"), words.pop("R", None), words.axes(state)
            if kind > 1:
                values = offsets.zero(values, state.position, SYSTEMS[593] if kind == 11 else 0, tool=True)
            tool = state.tools.by_number.get(number, Tool(np.zeros(AXES)))
            offset, diameter = tool.offset.copy(), tool.diameter if radius is None else 2.0 * state.scaled(0, radius)
            offset[list(values)] = list(values.values())
            by_number = {**state.tools.by_number, number: Tool(offset, diameter)}
            state.tools = replace(state.tools, by_number=by_number)
        elif kind not in (2, 20):
            self.findings.count(f"G10 L{kind} changes the tool table, which is not supported", line)
            for letter in words.keys() - set("FST"):
                del words[letter]
        else:
            system, values = words.need_whole("P", "G10"), words.axes(state)
            if self.dialect.of_fanuc:
                self._set_system_of_fanuc(kind, system, values)
                return
            refuse(system > 9, f"G10 P{system}: coordinate systems are 1 to 9, or 0 for the one in force")
            if kind == 2 and words.pop("R", 0.0):
                raise LineError("G10 L2 R turns a coordinate system; write the turned coordinates")
            offsets.set_system(system, values if kind == 2 else offsets.zero(values, state.position, system))
            self._machine_known = True

    def _set_system_of_fanuc(self, kind: int, number: int, values: dict[int, float]) -> None:
        """G10 L2 P1 to P6 (G54 to G59), P0 (of all systems), and L20 P1 (G54.1 P1): offsets, added with G91."""
        offsets, most = self.state.offsets, MOST_SYSTEMS if kind == 20 else 6
        refuse(not kind // 20 <= number <= most, f"G10 L{kind} P{number}: coordinate systems are 1 to {most}")
        if kind == 2 and number == 0:
            added = offsets.external[list(values)] * self.state.relative
            offsets.external[list(values)] = list(values.values()) + added
        else:
            offsets.set_system(number + MORE_SYSTEMS * (kind == 20), values, self.state.relative)
        self._machine_known = True

    def _go_to_reference(self, code: int, words: LineWords, line: int) -> None:
        state, numbers = self.state, self.parameters.numbers
        there, said = state.target({x: words.pop(x) for x in LETTERS if x in words})
        point, first = state.offsets.references.get(code), REFERENCE_PARAMETERS[code]
        if point is None and numbers.keys() & set(range(first, first + AXES)):
            point = np.array([state.scaled(axis, numbers.get(first + axis, 0.0)) for axis in range(AXES)])
        if point is None:
            self.findings.count(f"{g_name(code)} is left out: the machine's reference point is unknown here", line)
        if said and (not state.relative or point is not None):
            state.add(MoveKind.RAPID, there, said, line)
        if point is None:
            return
        chosen = said >> np.arange(AXES) & 1 != 0
        end = np.where(chosen | (not said), point, state.position)
        moved = int((chosen | (end != state.position)) @ (1 << np.arange(AXES)))
        state.add(MoveKind.RAPID, end, moved | moved << STATED, line)

"""A whole file into moves, a part at a time: `ProgramLines` takes the simple lines, the interpreter all others."""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.source import check_file, check_size, head_text, read_bytes, read_head
from splinefeed.programs.gcode.arcs import find_arcs
from splinefeed.programs.gcode.dialects import (
    Dialect,
    contradiction,
    not_read,
    recognized,
    whole_numbers,
    without_leader,
)
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.flow import MAX_BYTES as LARGEST_THAT_JUMPS
from splinefeed.programs.gcode.flow import PLAIN, Flow, ProgramText, Walk, blocks_of, too_long
from splinefeed.programs.gcode.heidenhain import Heidenhain
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.klartext import KlartextFlow
from splinefeed.programs.gcode.lathe import lathe_sign
from splinefeed.programs.gcode.lines import ProgramLines
from splinefeed.programs.gcode.moves import AXES, MAX_LINE, STATED, Findings, Moves
from splinefeed.programs.gcode.offsets import Offsets
from splinefeed.programs.gcode.printers import Printer
from splinefeed.programs.gcode.siemens import Siemens
from splinefeed.programs.gcode.siemens_flow import SiemensFlow
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.programs.gcode.tools import Tools
from splinefeed.records import Array

#: Largest program, bytes.
MAX_BYTES = 2 * 2**30
#: Bytes that are read at once: what is made of them stays in the processor's cache.
BLOCK = 2**18
#: Lines that are carried out by arrays at once, behind a line for the interpreter, and at most.
_FIRST, _MOST = 256, 16384
#: How much of a program is looked at to recognize it, bytes, lines of pictures (base64, as slicers write them) aside,
#: and with them at most.
_HEAD, _MOST_HEAD = 2**16, 2**23
_PICTURE = re.compile(rb"^;[ \t]*+[A-Za-z0-9+/=]{40,}+[ \t\r]*+$", re.MULTILINE)
#: Bytes that texts of programs have, tapes' controls (leaders of zeros, DC1 to DC4, end of file) and other languages'
#: letters too; and how many, and how much of a file, may be others.
_TEXT, _FEW, _CONTROLS = bytes({0, *range(9, 14), *range(17, 21), 26, *range(32, 256)}), 20, 0.02
#: What is said of the dialect of a program that shows none, and of one that the user names.
NOTHING_TELLS, GIVEN = "nothing tells another", "as given"


@dataclass
class Reading:
    """How a program is read, and what came of it.

    Parameters
    ----------
    dialect : Dialect, optional
        Detected if None.
    offsets : mapping of int to array (9,), optional
        By number of the coordinate system, mm and rad.
    start : array (9,), optional
        Where the tool is before the first line, mm and rad.
    tools : Tools, optional
        Whose lengths G43 puts in force; None where the path is that of the tool's tip.
    from_line : int, optional
        Number of the line at which the program is resumed; 0 for its beginning.
    increments : bool, optional
        Whether a Fanuc's words of axes without a decimal point count least increments, not mm.
    inch_unsaid : bool or None, optional
        Whether lengths are in inches until G20 or G21 is said; None for mm, with a finding where that is a setting.
    repair : bool, optional
        Whether findings are made of what can be mended.
    fast : bool, optional
        Whether `ProgramLines` takes what it knows.

    Attributes
    ----------
    findings : Findings
        What is said of the program.
    dialect_by : str
        What shows the dialect.
    lines : int
        How many the program has.
    ended, inch : bool
        Whether it says its end, and whether its lengths are in inches.
    stated : int
        Bits of the axes whose place the lines before `from_line` state.
    file : Path
        Of the program.
    fault : LineError or None
        What ended the reading.
    """

    dialect: Dialect | None = None
    offsets: Mapping[int, Array] = field(default_factory=dict)
    start: Array = field(default_factory=lambda: np.zeros(AXES))
    tools: Tools | None = None
    from_line: int = 0
    increments: bool = False
    inch_unsaid: bool | None = None
    repair: bool = False
    fast: bool = True
    findings: Findings = field(default_factory=Findings)
    dialect_by: str = GIVEN  # what shows the dialect
    lines: int = 0
    ended: bool = False
    inch: bool = False
    stated: int = 0
    file: pathlib.Path = pathlib.Path()
    fault: LineError | None = None  # what ended it
    _resumed: bool = False  # or there is nothing to resume
    _line: int = 0  # of the file, that is carried out
    _flow: Walk | None = None

    def moves(self, file: str | os.PathLike[str]) -> Iterator[Moves]:
        """The moves of a program, in the order of the file; FormatError that names file and line."""
        check_size(check_file(file), MAX_BYTES)
        head = _head_of(file)
        if len(head.translate(None, _TEXT)) > max(_CONTROLS * len(head), _FEW):
            raise FormatError(f"{file}: is no text, so no G-code program: it may be encrypted or compressed")
        if self.dialect is None:
            if said := not_read(head) or contradiction(head):
                raise FormatError(f"{file}: {said}")
            self.dialect, shown = recognized(head)
            self.dialect_by = shown or NOTHING_TELLS
        text = head_text(head)
        kind = "untold" if self.dialect_by is NOTHING_TELLS else self.dialect.lathe
        if sign := lathe_sign(text, kind, given=self.dialect_by is GIVEN):
            raise FormatError(f"{file}: line {sign[0]}: {sign[1]}")
        first, lines, beside = whole_numbers(text) if self.dialect.increments else ("", [], False)
        for line in lines:
            taken = (
                "thousandths of mm (inch programs: ten-thousandths of an inch)" if self.increments else "mm or inches"
            )
            others = " beside others with one" * beside
            said = f"axis words without a decimal point{others}, as {first}, are taken as {taken}"
            self.findings.count(f"{said} (option increments)", line)
        self.file, self._resumed = pathlib.Path(file), not self.from_line
        for moves in self._run(self.file, self.dialect):
            if self._resumed:
                yield moves
            else:
                self._leave_out(moves)
        if not self._resumed:
            raise FormatError(
                f"{file}: line {self.from_line}: is never executed: the program ends before it or jumps over it; "
                "resume at another line (from_line)"
            )

    def checked(self, file: str | os.PathLike[str]) -> Iterator[Moves]:
        """The same; FormatError with the line, too, for an arc that misses its circle, unless it is to be mended."""
        for moves in self.moves(file):
            try:
                find_arcs(moves, self.findings if self.repair else None)
            except LineError as missed:
                raise FormatError(f"{file}: line {missed.line}: {missed}") from None
            yield moves

    def _leave_out(self, moves: Moves) -> None:
        """Moves before the line at which the program is resumed: only which places they state counts."""
        self.stated |= moves.axes >> STATED

    def _run(self, file: pathlib.Path, dialect: Dialect) -> Iterator[Moves]:
        state = ProgramState(Offsets(self.offsets), self.start, self.tools)
        state.inch_unsaid = bool(self.inch_unsaid)
        state.set_units(0)
        run = LANGUAGES[dialect.language].run(state, dialect, self.findings, repair=self.repair)
        run.increments = self.increments and dialect.increments
        run.untold = self.dialect_by is NOTHING_TELLS
        self.fast &= not run.increments
        try:
            for block in self._blocks(file, run):
                yield from self._lines(block, run)
                if run.ended:
                    break
            run.end()
        except LineError as error:
            fault = error
            try:
                made = state.take()
            except LineError as before:
                fault = before
            else:
                yield made  # what is wrong in a line before is said first
            self.fault = fault
            where = self._flow.text.file if self._flow else file
            raise FormatError(f"{where}: line {fault.line or self._line}: {fault}") from None
        finally:
            self._flow = None  # it knows this reading, and holds the text
        self.ended, self.inch = run.ended, state.inch
        if not state.units and self.inch_unsaid is None and not dialect.metric:
            self.findings.say(f"no line has {dialect.units}: lengths are taken in mm (option units)")
        if state.extruded:
            self.findings.say(
                "E words, the filament of a printer, are no axis of the path; alone, they take their time"
            )
        if (made := state.take()).marks or len(made):
            yield made

    def _blocks(self, file: pathlib.Path, run: Interpreter) -> Iterator[bytes]:
        """Whole lines in the order in which they are carried out; a long file cannot jump, and is read as it comes."""
        if file.stat().st_size > LARGEST_THAT_JUMPS:
            run.jumps = False
            with file.open("rb") as stream:
                yield from blocks_of(stream, BLOCK)
        else:
            content, flow = without_leader(read_bytes(file)), LANGUAGES[run.dialect.language].flow
            self._flow = flow(content, file, run, lambda line: self._arrive(line, run))
            for block, before in self._flow.blocks(BLOCK):
                self._line = before
                yield block

    def _arrive(self, line: int, run: Interpreter) -> None:
        """Before a line is carried out: if the program is resumed at it, forget the moves, keep how things are."""
        self._line = line
        if self._flow and self._flow.shown:
            return
        self.lines = max(self.lines, line)
        if line != self.from_line or self._resumed:
            return
        first, what = run.unfinished
        refuse(first, f"lies within {what}; resume at line {first}, where that begins, or after its end")
        state = run.state
        self._leave_out(state.take())
        self._resumed = True
        if said := state.summary():
            state.say(line, said)
        where = " ".join(f"{letter}{v:g}" for letter, v in zip("XYZ", state.position[:3].round(6), strict=True))
        self.findings.say(
            f"line {line}: the program is resumed with the tool at {where} (mm, coordinates of the path): "
            "bring it there first"
        )

    def _lines(self, block: bytes, run: Interpreter) -> Iterator[Moves]:
        """The moves of whole lines."""
        state, texts = run.state, block.split(b"\n")[:-1]
        shown = self._flow.shown if self._flow else 0  # the line that they are said to be of, if not their own
        fast = self.fast and not shown and len(texts) >= PLAIN
        lines = ProgramLines(run.plain_lines(block), run.dialect.extruder) if fast else None
        at, size = 0, _MOST
        while at < len(texts) and not run.ended:
            if lines is not None and not run.busy:
                high = min(int(lines.next_odd[at]), at + size)
                if self._line < self.from_line:
                    high = min(high, at + self.from_line - 1 - self._line)
                done = lines.scan(state, at, high, self._line + 1) if high - at >= PLAIN else 0
                at, self._line = at + done, self._line + done
                size = min(8 * size, _MOST) if at == high else _FIRST
                if state.full:
                    yield state.take()
                if at == high and done:
                    continue
            self._arrive(self._line + 1, run)
            if len(texts[at]) > MAX_LINE:
                texts[at] = texts[at].partition(b";")[0]  # a comment may have any length
            if len(texts[at]) > MAX_LINE:
                raise LineError(too_long(len(texts[at])))
            run.run(texts[at].decode("utf-8-sig", errors="replace"), shown or self._line)
            at += 1
            if state.full:
                yield state.take()
        if not shown:
            self.lines = max(self.lines, self._line)


class Language(NamedTuple):
    """How the programs of some dialects are carried out.

    Parameters
    ----------
    run : type of Interpreter
        Who runs a line.
    flow : callable
        Gives what says which line comes next, of a content, its file, who runs it, and what is called with the number
        of a line before it jumps.
    """

    run: type[Interpreter]
    flow: Callable[[bytes, pathlib.Path, Any, Callable[[int], None]], Walk]


def _flow(content: bytes, file: pathlib.Path, run: Interpreter, arrives: Callable[[int], None]) -> Flow:
    text = ProgramText(content, file, run.jumps, run.dialect.of_fanuc)
    return Flow(text, run, file.parent, arrives)


def _klartext(content: bytes, file: pathlib.Path, run: Heidenhain, arrives: Callable[[int], None]) -> KlartextFlow:
    return KlartextFlow(ProgramText(content, file, False), run, run.quantities, arrives)


def _siemens(content: bytes, file: pathlib.Path, run: Siemens, arrives: Callable[[int], None]) -> SiemensFlow:
    return SiemensFlow(ProgramText(content, file, False), run, run.values, arrives)


#: The languages, as `Dialect.language` calls them.
LANGUAGES = {
    "rs274": Language(Interpreter, _flow),
    "printer": Language(Printer, _flow),
    "siemens": Language(Siemens, _siemens),
    "klartext": Language(Heidenhain, _klartext),
}


def _head_of(file: str | os.PathLike[str]) -> bytes:
    """The first bytes of a program; lines of pictures in it are empty comments."""
    size = _HEAD
    while True:
        head = read_head(file, size)
        plain = _PICTURE.sub(b";", head)
        if len(head) < size or len(plain) >= _HEAD or size >= _MOST_HEAD:
            return plain
        size *= 4

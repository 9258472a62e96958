"""A whole file into moves, a part at a time: `Lines` takes the simple lines, the interpreter all others."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.dialects import Dialect, detect
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.flow import MAX_BYTES as LARGEST_THAT_JUMPS
from splinefeed.formats.gcode.flow import PER_STEP, Flow, Text, leads_elsewhere
from splinefeed.formats.gcode.interpreter import Interpreter
from splinefeed.formats.gcode.lines import Lines
from splinefeed.formats.gcode.moves import AXES, Findings, Mark, Moves, Spline
from splinefeed.formats.gcode.offsets import Offsets
from splinefeed.formats.gcode.siemens import Siemens
from splinefeed.formats.gcode.state import State
from splinefeed.formats.gcode.tools import Tools
from splinefeed.formats.source import check_file, check_size, read_head
from splinefeed.records import Array, IntArray

#: Dialects whose lines are not those of RS274.
_INTERPRETERS: dict[str, type[Interpreter]] = {"siemens": Siemens}
#: Largest program, bytes.
MAX_BYTES = 2 * 2**30
#: Bytes that are read at once: what is made of them stays in the processor's cache.
BLOCK = 2**18
#: Bytes without an end of line that are no program.
LONGEST = 2**21
#: Arrays cost, for few lines, what the interpreter does for so many. After so many runs of fewer lines, one behind the
#: other, it takes the next ones, whatever they are: twice as many each time, at most so many.
WORTH, PATIENCE, MOST = 16, 4, 64
_HEAD = 2**16


@dataclass
class Reading:
    """How a program is read, and what came of it.

    dialect  one of `dialects.DIALECTS`, detected if None; offsets  (9,) by number of the coordinate system
    tools    whose lengths G43 puts in force; None where the path is that of the tool's tip
    from_line  number of the line at which the program is resumed; 0 for its beginning. stated  bits of the axes whose
             place the lines before state
    repair   make findings of what can be mended; fast  let `Lines` take what it knows
    """

    dialect: Dialect | None = None
    offsets: Mapping[int, Array] = field(default_factory=dict)
    start: Array = field(default_factory=lambda: np.zeros(AXES))
    tools: Tools | None = None
    from_line: int = 0
    repair: bool = False
    fast: bool = True
    findings: Findings = field(default_factory=Findings)
    lines: int = 0
    ended: bool = False
    inch: bool = False
    stated: int = 0
    _resumed: bool = False
    _short: int = 0  # runs of few lines, one behind the other
    _left: int = 0  # lines that the interpreter takes, whatever they are

    def moves(self, file: str | os.PathLike[str]) -> Iterator[Moves]:
        """The moves of a program, in the order of the file; FormatError that names file and line."""
        check_size(check_file(file), MAX_BYTES)
        head = read_head(file, _HEAD)
        self.dialect = self.dialect or detect(head)
        for moves in self._run(file, self.dialect):
            if not self.from_line or self._resumed:
                yield moves
            else:
                self._leave_out(moves)
        if self.from_line and not self._resumed:
            raise FormatError(
                f"{file}: line {self.from_line}: is never executed: the program ends before it or jumps over it; "
                "resume at another line (from_line)"
            )

    def _leave_out(self, moves: Moves) -> None:
        """Moves before the line at which the program is resumed: only which places they state counts."""
        if len(moves):
            self.stated |= int(np.bitwise_or.reduce(moves.codes[:, layout.AXES])) >> layout.STATED

    def _resume(self, state: State, run: Interpreter) -> None:
        """Before the line at which the program is resumed: forget the moves, keep how things are."""
        first, what = run.unfinished
        if first:
            fault = LineError(f"lies within {what}; resume at line {first}, where that begins, or after its end")
            fault.line = self.from_line
            raise fault
        self._leave_out(state.take())
        self._resumed = True
        if said := state.summary():
            state.say(self.from_line, said)
        where = " ".join(f"{letter}{v:g}" for letter, v in zip("XYZ", state.place[:3].round(6), strict=True))
        self.findings.say(
            f"line {self.from_line}: the program is resumed with the tool at {where} (mm, coordinates of the path): "
            "bring it there first"
        )

    def _run(self, file: str | os.PathLike[str], dialect: Dialect) -> Iterator[Moves]:
        lines = pathlib.Path(file).stat().st_size // 2 + 1  # a letter and an end of line at least
        state = State(Offsets(self.offsets), self.start, dialect.extruder, lines, self.tools)
        interpreter = _INTERPRETERS.get(dialect.name, Interpreter)
        run = interpreter(state, dialect, self.findings, repair=self.repair)
        self.fast &= interpreter is Interpreter
        try:
            blocks = _blocks(file)
            for block in blocks:
                if rest := (yield from self._block(block, state, run, jumps=dialect.jumps, fast=self.fast)):
                    text = Text(_rest(rest, blocks), self.lines, file)
                    yield from self._walk(Flow(text, run, pathlib.Path(file).parent), state, run)
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
            raise FormatError(f"{fault.file or file}: line {fault.line or self.lines}: {fault}") from None
        self.ended, self.inch = run.ended, state.inch
        if state.modes[layout.EXTRUDED]:
            self.findings.say("E words, the filament of a 3-D printer, are not part of the path and are left out")
        if (made := state.take()).marks or len(made):
            yield made

    def _walk(self, flow: Flow, state: State, run: Interpreter) -> Iterator[Moves]:
        """The moves of a program that jumps, in the order in which its lines are carried out."""
        last = self.lines
        try:
            while not (run.ended or flow.done):
                text, low = flow.text, flow.at
                high = text.next_jump(low)
                fast = self.fast and not text.other and high - low >= WORTH
                flow.count((high - low) // PER_STEP if fast else high - low)
                self.lines, shown = text.before + low, flow.shown if text.other else 0
                for block in text.blocks(low, high, BLOCK):
                    yield from self._block(block, state, run, fast=fast, shown=shown)
                flow.at = high
                last = last if text.other else max(last, self.lines)
                if run.ended:
                    break
                if high == text.count:
                    flow.finish()
                    break
                self.lines = flow.line
                if self.lines == self.from_line and not (self._resumed or text.other):
                    self._resume(state, run)
                flow.jump()
                if state.full:
                    yield state.take()
        except LineError as fault:
            fault.line = fault.line or self.lines
            fault.file = str(flow.text.file)
            raise
        self.lines = max(last, flow.line if not flow.text.other else 0)

    def _block(
        self, block: bytes, state: State, run: Interpreter, *, fast: bool, jumps: bool = False, shown: int = 0
    ) -> Generator[Moves, None, bytes]:
        """The moves of whole lines; `self.lines` counts them.

        jumps  stop at the first line that leads elsewhere, and return the lines from there on
        shown  line that the moves are said to be of, if not their own
        """
        before = self.from_line - 1 - self.lines
        if before >= 0 and not (self._resumed or shown) and self.from_line and block.count(b"\n") > before:
            at = 0
            for _ in range(before):
                at = block.index(b"\n", at) + 1
            rest = yield from self._lines(block[:at], state, run, fast=fast, jumps=jumps)
            if rest or run.ended:
                return rest + block[at:] if rest else b""
            self._resume(state, run)
            block = block[at:]
        return (yield from self._lines(block, state, run, fast=fast, jumps=jumps, shown=shown))

    def _lines(
        self, block: bytes, state: State, run: Interpreter, *, fast: bool, jumps: bool, shown: int = 0
    ) -> Generator[Moves, None, bytes]:
        """As `_block`, but for the line at which the program is resumed."""
        lines = Lines(block) if fast else None
        at = 0
        while at < len(block) and not run.ended:
            if self._left:
                self._left -= 1
            elif lines is not None and not (run.splines.open or run.cutter.busy):
                before = state.modes[layout.LINE] = self.lines
                at, why = state.scan(lines, at)
                self.lines = int(state.modes[layout.LINE])
                self._short = self._short + 1 if self.lines - before < WORTH else 0
                self._left = min(2**self._short, MOST) if self._short > PATIENCE else 0
                if state.full:
                    yield state.take()
                if why == layout.FULL:
                    continue
                if at >= len(block):
                    break
            end = block.index(b"\n", at)
            if jumps and leads_elsewhere(block[at:end]):
                return block[at:]
            self.lines += 1
            if end - at > layout.MAX_LINE:
                raise LineError(f"has {end - at} characters; at most {layout.MAX_LINE} can be read")
            run.run(block[at:end].decode("utf-8", errors="replace"), shown or self.lines)
            at = end + 1
            if state.full:
                yield state.take()
        return b""


def joined(parts: list[Moves]) -> Moves:
    """Moves one after the other as one record."""
    if not parts:
        return Moves(np.zeros(AXES), np.zeros((0, layout.FLOATS)), np.zeros((0, layout.INTEGERS), dtype=np.int64))
    if len(parts) == 1:
        return parts[0]
    marks: list[Mark] = []
    splines: list[Spline] = []
    numbered: list[IntArray] = []
    moves = 0
    for part in parts:
        numbered.append(part.codes.copy())
        column = numbered[-1][:, layout.SPLINE]
        column[column >= 0] += len(splines)
        marks += [replace(mark, move=mark.move + moves) for mark in part.marks]
        splines += part.splines
        moves += len(part)
    return Moves(
        parts[0].start,
        np.concatenate([part.values for part in parts]),
        np.concatenate(numbered),
        tuple(splines),
        tuple(marks),
    )


def _rest(first: bytes, blocks: Iterator[bytes]) -> bytes:
    """All that is left of a file; as soon as that is too much, no more of it."""
    parts = [first]
    size = len(first)
    while size <= LARGEST_THAT_JUMPS and (part := next(blocks, b"")):
        parts.append(part)
        size += len(part)
    return b"".join(parts)


def _blocks(file: str | os.PathLike[str]) -> Iterator[bytes]:
    """Whole lines of the file, BLOCK bytes or so at a time; lines that end as on old Macs included."""
    rest = b""
    try:
        with pathlib.Path(file).open("rb") as stream:
            first = True
            while part := stream.read(BLOCK):
                if first:
                    part = part.removeprefix(b"\xef\xbb\xbf")
                    first = False
                block = rest + part
                if b"\r" in block and b"\n" not in block:
                    block = block.replace(b"\r", b"\n")
                cut = block.rfind(b"\n") + 1
                rest = block[cut:]
                if len(rest) > LONGEST:
                    yield rest + b"\n"  # a line that long is refused where lines are counted
                    return
                if cut:
                    yield block[:cut]
    except OSError as error:
        raise FormatError(f"{file}: cannot be read: {error.strerror or error}") from None
    if rest:
        yield rest + b"\n"

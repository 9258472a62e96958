"""O-words [1]_ and subprograms [2]_: which line of a program comes next.

A sub has named parameters of its own, and one that `o call` calls #1 to #30 too. Names that begin with _ are
everyone's.

References
----------
.. [1] LinuxCNC documentation, "O Codes" and "M98 and M99".
.. [2] Fanuc Series 15i/150i-MA, Operator's Manual (Programming), "Subprogram".
"""

from __future__ import annotations

import os
import pathlib
import re
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.source import check_file, check_size, read_bytes
from splinefeed.programs.gcode.expressions import VACANT, Scanner, capitals
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.moves import MAX_LINE
from splinefeed.records import IntArray

#: Most lines that are carried out; so many plain ones, or more in a row, are read by arrays and count a part of each.
MAX_STEPS, PLAIN = 1_000_000, 16
#: Most jumps and calls that are carried out, of which a turn of a loop is two: each takes as long as several lines.
MAX_JUMPS = 300_000
#: Most calls within calls (LinuxCNC), arguments of one, bytes of a program that jumps, and files of subprograms.
MAX_CALLS, MAX_ARGUMENTS, MAX_BYTES, MAX_FILES = 10, 30, 2**26, 100
#: How files of numbered subprograms end.
_ENDINGS = (".nc", ".NC", ".cnc", ".CNC", ".tap", ".TAP", "")
#: Bytes without an end of line that are no program.
LONGEST = 2**21

_SAID = "ENDREPEAT|ENDWHILE|CONTINUE|ELSEIF|ENDSUB|REPEAT|RETURN|BREAK|ENDIF|WHILE|CALL|ELSE|SUB|IF|DO"
_OWORD = re.compile(
    rf"(?:/[0-9]?)?(?:N[0-9.]+)?(?:O|:O?)(?:(?P<number>[0-9]+)|(?P<name><[^<>]*>)|(?=[#\[]))(?P<word>{_SAID})?"
)
_CALL = re.compile(r"M0*9[789](?![0-9.])")
#: What every line that jumps has: one of these characters, and more than that.
_LIKELY, _MORE = bytes(each in b"oO:mM" for each in range(256)), re.compile(rb"[oO:]|[mM][ \t0]*9[ \t]*[789]")
#: Lines of Fanuc's macros that jump: IF[..]GOTO 10, IF[..]THEN #1=2, WHILE[..]DO1 to END1, GOTO 10.
_MACRO = re.compile(r"(?:/[0-9]?)?(?:N[0-9]+)?(?P<word>IF(?=\[)|WHILE(?=\[)|GOTO|DO(?=[0-9])|END(?=[0-9]))")
_MACRO_LIKELY = re.compile(
    rb"IF[ \t]*\[|WHILE[ \t]*\[|GOTO|DO[ \t]*[0-9]|END[ \t]*[0-9]|G[ \t]*0*65(?![0-9.])", re.IGNORECASE
)
_MACRO_CALL = re.compile(r"G0*65(?![0-9.])")
#: The variables of a macro that letters of G65 set; I J K may be said up to ten times, and set #4 to #33 in turn.
_VARIABLES = {
    "A": 1, "B": 2, "C": 3, "D": 7, "E": 8, "F": 9, "H": 11, "M": 13, "Q": 17, "R": 18, "S": 19, "T": 20, "U": 21,
    "V": 22, "W": 23, "X": 24, "Y": 25, "Z": 26,
}  # fmt: skip
_CENTRES, _MOST_CENTRES = "IJK", 10
_LABEL = re.compile(rb"^[ \t]*+(?:/[ \t]*+[0-9]?[ \t]*+)?N[ \t]*+([0-9]{1,9})(?![0-9.])", re.IGNORECASE | re.MULTILINE)
_ABORT = re.compile(r"\s*\(\s*abort\s*,([^)]*)\)", re.IGNORECASE)
#: The words that may follow in a statement, by the one that begins it; the last one ends it.
_STATEMENTS = {
    "if": ("elseif", "else", "endif"), "while": ("endwhile",), "do": ("while",), "repeat": ("endrepeat",),
    "sub": ("endsub",),
}  # fmt: skip
_LEAVE = dict.fromkeys(("break", "continue"), ("while", "do"))


@dataclass
class Jump:
    """A line that may lead elsewhere.

    Parameters
    ----------
    at : int
        The line.
    word : str
        "" for a name alone, "M" for M98 and M99.
    name : str
        Of what it leads to.
    rest : str
        What follows.
    text : str
        The whole line.
    fault : str, optional
        Why it cannot be carried out.
    first, after, last : int, optional
        Lines of its statement: the one that begins it, the next part, the end.
    """

    at: int
    word: str
    name: str
    rest: str
    text: str
    fault: str = ""
    first: int = -1
    after: int = -1
    last: int = -1

    @property
    def said(self) -> str:
        """o100 if, for messages."""
        return f"o{self.name} {self.word}"


def _jump_of(text: str, at: int, macros: bool) -> Jump | None:
    """The jump in line `at`, or None; with `macros` those of Fanuc's too."""
    if (aborts := _ABORT.match(text)) is not None:
        return Jump(at, "abort", "", "", text, f"the program ends itself: {aborts[1].strip()}")
    try:
        plain = capitals(text)
    except LineError:
        return None  # the interpreter says what is wrong
    if macros and _MACRO_CALL.search(plain):
        return Jump(at, "G65", "", "", text)
    if macros and (macro := _MACRO.match(plain)):
        return Jump(at, "macro", macro["word"], plain[macro.end() :], text)
    match = _OWORD.match(plain)
    if match is None:
        return Jump(at, "M", "", "", text) if _CALL.search(plain) else None
    rest, name = plain[match.end() :], (match["name"] or match["number"] or "").lower()
    name = str(int(name)) if name.isdigit() else name
    word = (match["word"] or "").lower()
    if not name:
        return Jump(at, "call", "", rest, text)  # its number is computed
    wrong = f"o{name}: expected sub, call, if, while, repeat or the like, got {rest[:20]!r}"
    return Jump(at, word, name, rest, text, wrong if rest and not word else "")


def too_long(characters: int) -> str:
    """What is said of a line of so many."""
    return f"has {characters} characters; at most {MAX_LINE} can be read"


class ProgramText:
    """A file of whole lines, and where those that jump lead; without `jumps` none does, and Fanuc's with `macros`."""

    def __init__(self, content: bytes, file: str | os.PathLike[str], jumps: bool, macros: bool = False) -> None:
        content = content if b"\n" in content else content.replace(b"\r", b"\n")
        self.text, self.file = content if content.endswith(b"\n") else content + b"\n", file
        ends = np.flatnonzero(np.frombuffer(self.text, dtype=np.uint8) == ord("\n"))
        self.begins: IntArray = np.concatenate([[0], ends + 1])
        self.count = len(ends)
        self.jumps: dict[int, Jump] = {}
        likely = np.flatnonzero(np.frombuffer(self.text.translate(_LIKELY), dtype=bool)) if jumps else ends[:0]
        at_macros = [found.start() for found in _MACRO_LIKELY.finditer(self.text)] if jumps and macros else []
        lines = np.searchsorted(ends, np.concatenate([likely, np.array(at_macros, dtype=np.int64)]))
        for at in np.unique(lines).tolist():
            line = self.between(at, at + 1)
            if not (_MORE.search(line) or (macros and _MACRO_LIKELY.search(line))):
                continue
            if jump := _jump_of(self.jumping(at).decode("utf-8-sig", errors="replace"), at, macros):
                self.jumps[at] = jump
        self.order = [*self.jumps, self.count]
        self.subs: dict[tuple[str, str], Jump] = {}
        self._labels: dict[int, list[int]] | None = None
        self._link()
        self._link_macros()

    def _link_macros(self) -> None:
        """Find the lines of each DO and its END, which have one number, and may be used again behind it."""
        opened: dict[str, Jump] = {}
        for jump in (each for each in self.jumps.values() if each.word == "macro"):
            begins = re.search(r"DO([0-9]+)$", jump.name + jump.rest)
            if jump.name in ("WHILE", "DO") and begins is None:
                jump.fault = f"{jump.name} needs DO1, DO2 or DO3 at the end of its line"
            elif jump.name in ("WHILE", "DO") and begins is not None:
                opened[begins[1]] = jump
                jump.fault = f"DO{begins[1]} has no END{begins[1]} after it"
            elif jump.name == "END":
                first = opened.pop(jump.rest, None)
                if first is None:
                    jump.fault = f"END{jump.rest[:9]} has no DO{jump.rest[:9]} before it"
                else:
                    first.last, jump.first, first.fault = jump.at, first.at, ""

    def label(self, number: int, at: int) -> int:
        """Line that begins with N and the number: the next one behind line `at`, else the first of its program."""
        heads = sorted(each.at for (kind, _), each in self.subs.items() if not kind)
        low = max((each for each in heads if each <= at), default=0)
        high = min((each for each in heads if each > at), default=self.count)
        lines = [line for line in self.lines_of(number) if low <= line < high]
        refuse(not lines, f"GOTO {number}: no line of the program begins with N{number}")
        return next((line for line in lines if line > at), lines[0])

    def lines_of(self, number: int) -> list[int]:
        """Lines that begin with N and the number."""
        if self._labels is None:
            self._labels = {}
            for found in _LABEL.finditer(self.text):
                line = int(np.searchsorted(self.begins, found.start(1), "right")) - 1
                self._labels.setdefault(int(found[1]), []).append(line)
        return self._labels.get(number, [])

    def _link(self) -> None:
        """Find the lines of each statement, which have one label; labels within a sub are its own."""
        parts: dict[str, list[Jump]] = {}
        sub: Jump | None = None
        scope = outer = ""
        for jump in self.jumps.values():
            key = f"{'sub' if jump.word in ('sub', 'endsub') else scope}/{jump.name}"
            opened = parts.get(key, [])
            owner = opened[0].word if opened and opened[0].last < 0 else ""
            words = _STATEMENTS.get(owner, ())
            if jump.fault or jump.word in ("M", "G65", "call", "return", "macro"):
                continue
            if jump.word in words or (jump.word in _LEAVE and owner in _LEAVE[jump.word]):
                opened[-1].after = jump.at
                opened.append(jump)
                if jump.word in words[-1:]:
                    for each in opened:
                        each.first, each.last = opened[0].at, jump.at
                if jump.word == "endsub":
                    scope, sub = outer, None
            elif jump.word == "":
                self.subs.setdefault(("", jump.name), jump)
                scope = scope if sub else jump.said
            elif jump.word not in _STATEMENTS:
                owners = [each for each, words in _STATEMENTS.items() if jump.word in words] or _LEAVE[jump.word]
                jump.fault = f"{jump.said} has no o{jump.name} {' or '.join(owners)} before it"
            elif sub and jump.word == "sub":
                jump.fault = f"{jump.said} is inside o{sub.name}; define it outside"
            elif opened:
                jump.fault = f"{jump.said}: line {opened[0].at + 1} has the label; write another number"
            else:
                parts[key] = [jump]
                if jump.word == "sub":
                    self.subs["sub", jump.name] = sub = jump
                    outer, scope = scope, jump.said
        for first, *_ in parts.values():
            if first.last < 0:
                first.fault = f"{first.said} has no o{first.name} {_STATEMENTS[first.word][-1]} after it"

    def jumping(self, at: int) -> bytes:
        """A line that may jump, without its comment where it is long; FormatError where it is too long then."""
        line = self.between(at, at + 1)
        line = line if len(line) <= MAX_LINE else line.partition(b";")[0]
        if len(line) > MAX_LINE:
            raise FormatError(f"{self.file}: line {at + 1}: {too_long(len(line))}")
        return line

    def between(self, low: int, high: int) -> bytes:
        """Some lines in a row."""
        return self.text[self.begins[low] : self.begins[high]]


class Walk:
    """A way through a program, of whose lines some lead elsewhere: the line `at` of `text`.

    Once from its beginning to its end, and MAX_STEPS lines and MAX_JUMPS jumps beside that: an endless loop is refused.
    `arrives` is called with the number of a line before it jumps.
    """

    def __init__(self, text: ProgramText, run: Interpreter, arrives: Callable[[int], None]) -> None:
        self.text, self.at = text, 0
        self._run, self._arrives = run, arrives
        self._lines, self._jumps = MAX_STEPS + text.count, MAX_JUMPS + text.count  # that may still be carried out

    @property
    def shown(self) -> int:
        """Line of the program itself that moves are said to be of where a sub stands in another file, else 0."""
        return 0

    def blocks(self, size: int) -> Iterator[tuple[bytes, int]]:
        """Lines in the order in which they are carried out, without those that jump, and the number before each."""
        while not self._run.ended:
            text, low, high = self.text, self.at, self._until()
            self._spend((high - low) // PLAIN if high - low >= PLAIN and not self.shown else high - low)
            while low < high:
                end = max(low + 1, min(high, int(np.searchsorted(text.begins, text.begins[low] + size, "right")) - 1))
                yield text.between(low, end), low
                low = end
            self.at = high
            if self._run.ended or self._over():
                break
            self._next()

    def _until(self) -> int:
        """The next line that jumps, or the number of lines."""
        return self.text.order[bisect_left(self.text.order, self.at)]

    def _over(self) -> bool:
        return self.at == self.text.count

    def _next(self) -> None:
        """Carry out a line that jumps."""
        self._arrives(self.at + 1)
        self._spend(1, jumps=1)
        self._jump(self.at)

    def _jump(self, at: int) -> None:
        raise NotImplementedError

    def _spend(self, lines: int, jumps: int = 0) -> None:
        """Take lines and jumps off what may still be carried out; LineError where the program goes on for ever."""
        self._lines, self._jumps = self._lines - lines, self._jumps - jumps
        for left, most, what in ((self._lines, MAX_STEPS, "lines"), (self._jumps, MAX_JUMPS, "jumps")):
            refuse(left < 0, f"more than {most} {what} are executed; is there an endless loop near here?")

    def _expect(self, turns: int) -> None:
        """Look at so many turns before they begin: each takes a jump at least."""
        refuse(turns > self._jumps, f"repeats {turns} times, and at most {MAX_JUMPS} jumps are executed; leave L out")


@dataclass
class _Call:
    """A sub that is being carried out: where it begins, and where and with what it goes on."""

    jump: Jump
    text: ProgramText
    back: tuple[ProgramText, int]
    shown: int = 0
    repeats: int = 1
    arguments: dict[int, float] | None = None  # of G65
    left: dict[str, int] = field(default_factory=dict)


class Flow(Walk):
    """Where a program of O-words, M98 and Fanuc's macros is."""

    def __init__(
        self, text: ProgramText, run: Interpreter, folder: pathlib.Path, arrives: Callable[[int], None]
    ) -> None:
        super().__init__(text, run, arrives)
        self.main = text
        self._parameters, self._folder = run.parameters, folder
        self._calls = [_Call(Jump(-1, "", "", "", ""), text, (text, 0))]  # the first one is the program itself
        self._files: dict[str, ProgramText] = {}

    @property
    def shown(self) -> int:
        """Line of the program itself that moves are said to be of where a sub stands in another file, else 0."""
        return 0 if self.text is self.main else self._calls[-1].shown

    def blocks(self, size: int) -> Iterator[tuple[bytes, int]]:
        """Lines in the order in which they are carried out, without those that jump, and the number before each."""
        yield from super().blocks(size)
        if len(self._calls) > 1 and not self._run.ended:
            call = self._calls[-1].jump
            self._arrives(self.text.count)
            raise LineError(f"the file ends within o{call.name}, which has no {'endsub' if call.word else 'M99'}")

    def _jump(self, at: int) -> None:
        """Carry out the line, which is a jump."""
        jump = self.text.jumps[at]
        refuse(jump.fault, jump.fault)
        left = self._calls[-1].left
        self.at += 1
        match jump.word:
            case "M":
                self._m_code(jump)
            case "macro":
                self._macro(jump)
            case "G65":
                self._macro_call(jump)
            case "call":
                self._call(jump)
            case "return" | "endsub":
                self._return(jump)
            case "if":
                while jump.word in ("if", "elseif") and not self._values(jump, 1, 1)[0]:
                    jump = self.text.jumps[jump.after]
                    self._arrives(jump.at + 1)
                self.at = jump.at + 1
            case "else" | "elseif" | "sub" | "break":
                self.at = jump.last + 1
            case "while":
                self.at = 1 + (jump.first if self._values(jump, 1, 1)[0] else jump.last)
            case "endwhile":
                self.at = jump.first
            case "continue":
                self.at = jump.first if self.text.jumps[jump.first].word == "while" else jump.last
            case "repeat" | "endrepeat":
                if jump.word == "repeat":
                    left[jump.name] = int(min(np.floor(self._values(jump, 1, 1)[0] + 0.5), MAX_STEPS)) + 1
                left[jump.name] = left.get(jump.name, 0) - 1
                self.at = 1 + (jump.first if left[jump.name] > 0 else jump.last)

    def _macro(self, jump: Jump) -> None:
        """A line of Fanuc's macros."""
        scanner = Scanner(jump.rest, self._parameters)
        if jump.name == "END":
            self.at = jump.first
        elif jump.name == "WHILE":
            self.at = self.at if scanner.value() else jump.last + 1
        elif jump.name == "GOTO":
            self._go_to(scanner, jump)
        elif jump.name == "IF":
            holds = scanner.value()
            then = scanner.text[scanner.at :][:4]
            refuse(
                then not in ("GOTO", "THEN"), f"IF[..]: expected GOTO or THEN, got {scanner.text[scanner.at :][:12]!r}"
            )
            scanner.at += 4
            if holds and then == "GOTO":
                self._go_to(scanner, jump)
            elif holds:
                self._run.run(scanner.text[scanner.at :], self.shown or self.at)

    def _macro_call(self, jump: Jump) -> None:
        """G65 P, L times, with the variables that its letters set."""
        plain = re.sub(r"^/[0-9]?", "", capitals(jump.text))
        scanner = Scanner(plain, self._parameters)
        once, arguments = dict[str, float](), dict[int, float]()
        rounds, last = 0, len(_CENTRES)
        while letter := scanner.peek():
            refuse(not "A" <= letter <= "Z", f"G65: expected a letter, got {plain[scanner.at :][:20]!r}")
            scanner.at += 1
            value = scanner.value()
            if letter in _CENTRES:
                rounds += _CENTRES.index(letter) <= last
                last = _CENTRES.index(letter)
                refuse(rounds > _MOST_CENTRES, f"G65: I, J and K may be said {_MOST_CENTRES} times")
                key = 1 + 3 * rounds + last
            elif letter in _VARIABLES:
                key = _VARIABLES[letter]
            else:
                wrong = letter not in "GNPL" or letter in once
                refuse(wrong, f"{letter}{value:g} beside G65: write it on its own line")
                once[letter] = value
                continue
            arguments.pop(key, None)
            if value is not VACANT:
                arguments[key] = value
        refuse("P" not in once, "G65 needs P, the number of a program")
        number, repeats = (_whole_of(once.get(letter, 1.0), f"{letter} of G65") for letter in "PL")
        self._expect(repeats)
        if repeats > 0:
            self._enter("", str(number), f"begin it with O{number}", repeats)
            self._calls[-1].arguments = arguments
            self._run.enter(arguments)

    def _go_to(self, scanner: Scanner, jump: Jump) -> None:
        value = scanner.value()
        refuse(scanner.peek(), f"GOTO: expected a number alone, got {scanner.text[scanner.at :][:12]!r}")
        refuse(not 0.0 < value < 1e9 or value != int(value), f"GOTO {value:g}: expected the number of a line (N)")
        self.at = self.text.label(int(value), jump.at)

    def _values(self, jump: Jump, most: int, least: int = 0) -> list[float]:
        """Expressions in brackets behind the word."""
        scanner = Scanner(jump.rest, self._parameters)
        found: list[float] = []
        while scanner.peek() == "[" and len(found) < most:
            found.append(scanner.value())
        if scanner.peek():
            raise LineError(f"{jump.said}: expected brackets, {most} at most, got {scanner.text[scanner.at :][:20]!r}")
        refuse(len(found) < least, f"{jump.said} needs a value in brackets")
        return found

    def _call(self, jump: Jump) -> None:
        if not jump.name:
            scanner = Scanner(jump.rest, self._parameters)
            value = scanner.value()
            rest = scanner.text[scanner.at :]
            if not (abs(value) < 1e6 and abs(value - round(value)) < 1e-4) or rest[:4] != "CALL":
                raise LineError(f"o{value:g}: only a call may have a computed number, which is whole")
            jump = Jump(jump.at, "call", str(round(value)), rest[4:], jump.text)
        arguments = self._values(jump, MAX_ARGUMENTS)
        self._enter("sub", jump.name, "define it with sub and endsub")
        self._run.enter(arguments)

    def _enter(self, kind: str, name: str, mend: str, repeats: int = 1) -> None:
        """Go to where a sub begins: in this file, in the program itself, or in a file of its name beside it."""
        base = name.strip("<>")
        texts = [self.text, self.main]
        here = any((kind, name) in text.subs for text in texts)
        if not here and re.fullmatch("[a-z0-9_-]+", base) and (file := self._beside(base)):
            if base not in self._files:
                refuse(len(self._files) >= MAX_FILES, f"o{name}: subprograms in more than {MAX_FILES} files")
                self._files[base] = _load(file, self._parameters.macros)
            texts.append(self._files[base])
        text = next((text for text in texts if (kind, name) in text.subs), None)
        if text is None:
            called, there = f"o{name}", f"{base}.ngc"
            if self._parameters.macros and base.isdigit():  # as a Fanuc has it
                called, there = f"O{base}", f"O{int(base):04d}.nc"
            raise LineError(f"{called} is called, and is neither in the program nor in {there} beside it; {mend}")
        jump = text.subs[kind, name]
        refuse(jump.fault, jump.fault)
        if len(self._calls) > MAX_CALLS:
            raise LineError(f"o{name}: more than {MAX_CALLS} calls within calls; does a sub call itself?")
        self._calls.append(_Call(jump, text, (self.text, self.at), self.shown or self.at, repeats))
        self.text, self.at = text, jump.at + 1

    def _enter_lines(self, number: int, repeats: int, jump: Jump) -> None:
        """Go to the lines from N on, up to M99."""
        at = self.text.label(number, jump.at)
        if len(self._calls) > MAX_CALLS:
            raise LineError(f"M97 P{number}: more than {MAX_CALLS} calls within calls; does a sub call itself?")
        begin = Jump(at - 1, "", f"N{number}", "", "")  # its first line may say more than N
        self._calls.append(_Call(begin, self.text, (self.text, self.at), self.shown or self.at, repeats))
        self.at = at

    def _beside(self, base: str) -> pathlib.Path | None:
        """The file of a sub beside the program: 1000.ngc, of a numbered one also O1000.nc and the like."""
        names = [f"{base}.ngc"]
        if base.isdigit():
            names += [f"{stem}{end}" for stem in (f"O{int(base):04d}", base) for end in _ENDINGS]
        return next((self._folder / name for name in names if (self._folder / name).is_file()), None)

    def _return(self, jump: Jump) -> None:
        refuse(not self._calls[-1].jump.word, f"{jump.said} is outside of a called sub")
        value = self._values(jump, 1)
        self._run.leave()
        self._parameters.set("_value", value[0] if value else 0.0)
        self._parameters.set("_value_returned", float(len(value)))
        self.text, self.at = self._calls.pop().back

    def _m_code(self, jump: Jump) -> None:
        """A line with M98 or M99, after what else it says."""
        run, call = self._run, self._calls[-1]
        run.call, run.returns, run.goes_on, run.calls_line = None, False, 0, False
        run.run(jump.text, self.shown or self.at)
        if run.call is not None and run.call[1] > 0:
            number, repeats = run.call
            self._expect(repeats)
            if run.calls_line:
                self._enter_lines(number, repeats, jump)
            else:
                self._enter("", str(number), f"begin it with O{number}", repeats)
            run.enter()
        if not run.returns:
            return
        refuse(call.jump.word, f"M99 is inside o{call.jump.name} sub; write endsub or return")
        if len(self._calls) == 1 and run.goes_on:
            self.at = self.text.label(run.goes_on, jump.at)
            return
        if len(self._calls) == 1:
            run.findings.say(f"line {self.at}: M99 begins the program again without end; one pass is read")
            run.ended = True
            return
        call.repeats -= 1
        run.leave()
        if call.repeats > 0 and not run.goes_on:
            self.text, self.at = call.text, call.jump.at + 1
            run.enter(call.arguments)
        else:
            self.text, self.at = self._calls.pop().back
            if run.goes_on:
                self.at = self.text.label(run.goes_on, self.at - 1)


def blocks_of(stream: BinaryIO, size: int) -> Iterator[bytes]:
    """Whole lines, `size` bytes or so at a time; lines that end as on old Macs included."""
    rest = b""
    while part := stream.read(size):
        block = rest + part
        block = block if b"\n" in block else block.replace(b"\r", b"\n")
        cut = block.rfind(b"\n") + 1
        rest = block[cut:]
        if cut:
            yield block[:cut]
        if len(rest) > LONGEST:
            break  # a line that long is refused where lines are counted
    if rest:
        yield rest + b"\n"


def _whole_of(value: float, name: str) -> int:
    refuse(not 0.0 <= value < 1e9 or value != round(value), f"{name} is {value:g}; it must be a whole number from 0")
    return round(value)


def _load(file: pathlib.Path, macros: bool) -> ProgramText:
    """A file of subprograms."""
    try:
        check_size(check_file(file), MAX_BYTES)
        return ProgramText(read_bytes(file), file, jumps=True, macros=macros)
    except FormatError as error:
        raise LineError(f"{file.name} is called and cannot be read: {error}") from None

"""O-words and subprograms: which line of a program comes next.

Source: LinuxCNC documentation, "O Codes" and "M98 and M99"; Fanuc Series 15i/150i-MA, "Subprogram". A sub has
named parameters of its own, and one that `o call` calls #1 to #30 too. Names that begin with _ are everyone's.
"""

from __future__ import annotations

import os
import pathlib
import re
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.gcode.expressions import LineError, Scanner
from splinefeed.formats.gcode.interpreter import Interpreter
from splinefeed.formats.gcode.words import without_comments
from splinefeed.formats.source import check_file, check_size
from splinefeed.records import IntArray

#: Most lines that are carried out behind the first jump; lines that are read by arrays count as a part of one.
MAX_STEPS, PER_STEP = 1_000_000, 16
#: Most calls within calls (LinuxCNC), arguments of one, bytes of a program that jumps, and files of subprograms.
MAX_CALLS, MAX_ARGUMENTS, MAX_BYTES, MAX_FILES = 10, 30, 2**26, 100

_WORDS = "endrepeat|endwhile|continue|elseif|endsub|repeat|return|break|endif|while|call|else|sub|if|do"
_OWORD = re.compile(
    rf"(?:/[0-9]?)?(?:N[0-9.]+)?(?:O|:O?)(?:(?P<number>[0-9]+)|(?P<name><[^<>]*>)|(?=[#\[]))(?P<word>{_WORDS})?",
    re.IGNORECASE,
)
_CALL = re.compile(r"M0*9[89](?![0-9.])", re.IGNORECASE)
_LIKELY = re.compile(
    rb"^[ \t/0-9]*(?:[nN][ \t]*[0-9. \t]+)?[oO:][^\n]*|^[^\n]*(?:[mM][ \t]*0*[ \t]*9[ \t]*[89](?![0-9.])|"
    rb"\([ \t]*[aA][bB][oO][rR][tT][ \t]*,)[^\n]*",
    re.MULTILINE,
)
_ABORT = re.compile(r"\(\s*abort\s*,([^)]*)\)", re.IGNORECASE)
#: Words that begin what a label names, and what ends it; break and continue are those of while and do alone.
_BEGIN = frozenset(("if", "while", "do", "repeat"))
_OWNERS = {
    "else": ("if",), "elseif": ("if",), "endif": ("if",), "endwhile": ("while",), "endrepeat": ("repeat",),
    "break": ("while", "do"), "continue": ("while", "do"),
}  # fmt: skip


@dataclass(frozen=True)
class Jump:
    """A line that may lead elsewhere: its word ("" for a name alone, "M" for M98 and M99), name, and what follows."""

    word: str
    name: str
    rest: str
    text: str

    @property
    def said(self) -> str:
        """o100 if, for messages."""
        return f"o{self.name} {self.word}"


def jump_of(text: str) -> Jump | None:
    """The jump in a line, or None."""
    if (aborts := _ABORT.search(text)) is not None and not text[: aborts.start()].strip():
        return Jump("abort", "", aborts[1].strip(), text)
    try:
        plain = re.sub(r"\s+", "", without_comments(text))
    except LineError:
        return None  # the interpreter says what is wrong
    match = _OWORD.match(plain)
    if match is not None:
        rest, name = plain[match.end() :], (match["name"] or match["number"] or "").lower()
        name = str(int(name)) if name.isdigit() else name
        word = (match["word"] or "").lower()
        if not name:
            return Jump("call", "", rest, text)  # its number is computed
        return Jump(word or ("?" if rest else ""), name, rest, text)
    return Jump("M", "", "", text) if _CALL.search(plain) else None


def leads_elsewhere(line: bytes) -> bool:
    """Whether a line of a program is a jump, and no name of it alone."""
    if _LIKELY.match(line) is None:
        return False
    jump = jump_of(line.decode("utf-8", errors="replace"))
    return jump is not None and jump.word not in ("", "abort")


class Text:
    """Whole lines of a file, from the one behind number `before` on.

    other  whether it is not the program itself but a file that it calls
    """

    def __init__(self, text: bytes, before: int, file: str | os.PathLike[str], other: bool = False) -> None:
        if len(text) > MAX_BYTES:
            raise LineError(
                f"jumps, and {len(text)} bytes follow; programs that jump may have {MAX_BYTES}: split the program"
            )
        self.text, self.before, self.file, self.other = text, before, file, other
        ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
        self.begins: IntArray = np.concatenate([[0], ends + 1])
        self.count = len(ends)

    @cached_property
    def jumps(self) -> dict[int, Jump]:
        """By index of the line, in order."""
        found = {}
        for match in _LIKELY.finditer(self.text):
            index = int(np.searchsorted(self.begins, match.start(), side="right")) - 1
            begin, end = self.begins[index], self.begins[index + 1] - 1
            jump = jump_of(self.text[begin:end].decode("utf-8", errors="replace"))
            if jump is not None:
                found[index] = jump
        return found

    @cached_property
    def order(self) -> list[int]:
        """Indices of the lines that jump."""
        return list(self.jumps)

    @cached_property
    def named(self) -> dict[str, list[int]]:
        """Indices of them by name."""
        found: dict[str, list[int]] = {}
        for index, jump in self.jumps.items():
            found.setdefault(jump.name, []).append(index)
        return found

    def next_jump(self, index: int) -> int:
        """The first one from a line on, or behind the last line."""
        at = bisect_left(self.order, index)
        return self.order[at] if at < len(self.order) else self.count

    def first(self, name: str, words: tuple[str, ...], start: int = 0, end: int | None = None) -> int | None:
        """The first line of that name from `start` on that has one of the words."""
        lines = self.named.get(name, [])
        for index in lines[bisect_left(lines, start) :]:
            if end is not None and index > end:
                break
            if self.jumps[index].word in words:
                return index
        return None

    def blocks(self, low: int, high: int, size: int) -> Iterator[bytes]:
        """Whole lines, `size` bytes or so at a time."""
        while low < high:
            upto = int(np.searchsorted(self.begins, self.begins[low] + size))
            upto = min(max(upto, low + 1), high)
            yield self.text[self.begins[low] : self.begins[upto]]
            low = upto


@dataclass
class _Call:
    """A sub that is being carried out: its name ("" in the program itself), and where and with what it goes on."""

    name: str
    text: Text
    first: int
    end: int | None  # its endsub
    back: tuple[Text, int]
    shown: int
    repeats: int = 1
    own: bool = True
    left: dict[str, int] = field(default_factory=dict)


class Flow:
    """Where a program that jumps is: the line `at` of `text`; `done` at its end."""

    def __init__(self, text: Text, run: Interpreter, folder: pathlib.Path) -> None:
        self.main = self.text = text
        self.at = 0
        self.done = False
        self._run, self._parameters, self._folder = run, run.parameters, folder
        self._steps = 0
        self._calls: list[_Call] = []
        self._left: dict[str, int] = {}
        self._labels: dict[tuple[str, str], tuple[Text, int, str]] = {}
        self._files: dict[str, Text] = {}

    @property
    def line(self) -> int:
        """Number of the line in its file."""
        return self.text.before + self.at + 1

    @property
    def shown(self) -> int:
        """Line of the program itself that moves are said to be of: the call, where a sub stands in another file."""
        return self._calls[-1].shown if self.text.other else self.line

    def count(self, lines: int) -> None:
        """So many lines are carried out; LineError for too many."""
        self._steps += lines
        if self._steps > MAX_STEPS:
            raise LineError(f"more than {MAX_STEPS} lines are executed; is there an endless loop near here?")

    def finish(self) -> None:
        """The text is at its end."""
        if self._calls:
            call = self._calls[-1]
            ends = "endsub" if call.own else "M99"
            raise LineError(f"the file ends within o{call.name}, which has no {ends}")
        self.done = True

    def jump(self) -> None:
        """Carry out the line, which is a jump."""
        jump = self.text.jumps[self.at]
        self.count(1)
        if jump.word == "M":
            self._m_code(jump)
        elif jump.word == "":
            self.at += 1
        elif jump.word == "abort":
            raise LineError(f"the program ends itself: {jump.rest}")
        elif jump.word == "?":
            raise LineError(f"o{jump.name}: expected sub, call, if, while, repeat or the like, got {jump.rest[:20]!r}")
        else:
            getattr(self, f"_{jump.word}")(jump)

    # --- values -----------------------------------------------------------------------------------------------------

    def _values(self, jump: Jump, most: int, least: int = 0) -> list[float]:
        """Expressions in brackets behind the word."""
        scanner = Scanner(jump.rest, self._parameters)
        found: list[float] = []
        while scanner.peek() == "[" and len(found) < most:
            found.append(scanner.value())
        if scanner.peek():
            raise LineError(f"{jump.said}: expected brackets, {most} at most, got {scanner.text[scanner.at :][:20]!r}")
        if len(found) < least:
            raise LineError(f"{jump.said} needs a value in brackets")
        return found

    def _holds(self, jump: Jump) -> bool:
        return self._values(jump, 1, 1)[0] != 0.0

    # --- labels -----------------------------------------------------------------------------------------------------

    @property
    def _counts(self) -> dict[str, int]:
        return self._calls[-1].left if self._calls else self._left

    @property
    def _scope(self) -> str:
        return self._calls[-1].name if self._calls else ""

    def _begin(self, jump: Jump) -> None:
        """The line begins what its label names."""
        place = (self.text, self.at, jump.word)
        if self._labels.setdefault((self._scope, jump.name), place) != place:
            before = self._labels[self._scope, jump.name]
            raise LineError(f"{jump.said}: line {before[0].before + before[1] + 1} has the label; write another number")

    def _owner(self, jump: Jump) -> tuple[int, str]:
        """Line and word of what the line belongs to."""
        text, index, word = self._labels.get((self._scope, jump.name), (self.text, -1, ""))
        if word not in _OWNERS[jump.word] or text is not self.text:
            raise LineError(f"{jump.said} has no o{jump.name} {' or '.join(_OWNERS[jump.word])} before it")
        return index, word

    def _find(self, jump: Jump, *words: str) -> int:
        """The next line of the same label with one of the words."""
        end = self._calls[-1].end if self._calls else None
        found = self.text.first(jump.name, words, self.at + 1, end)
        if found is None:
            raise LineError(f"{jump.said} has no o{jump.name} {words[-1]} after it")
        return found

    # --- branches and loops -----------------------------------------------------------------------------------------

    def _if(self, jump: Jump) -> None:
        self._begin(jump)
        self._branch(jump)

    def _branch(self, jump: Jump) -> None:
        """Go on with the first branch whose condition holds."""
        while not self._holds(jump):
            self.at = self._find(jump, "else", "elseif", "endif")
            jump = self.text.jumps[self.at]
            if jump.word != "elseif":
                break
        self.at += 1

    def _else(self, jump: Jump) -> None:
        self._owner(jump)
        self.at = self._find(jump, "endif") + 1

    _elseif = _else

    def _endif(self, jump: Jump) -> None:
        self._owner(jump)
        self.at += 1

    def _while(self, jump: Jump) -> None:
        text, index, word = self._labels.get((self._scope, jump.name), (self.text, -1, ""))
        if word == "do" and text is self.text and index < self.at:
            self.at = index + 1 if self._holds(jump) else self.at + 1
            return
        self._begin(jump)
        self.at = 1 + (self.at if self._holds(jump) else self._find(jump, "endwhile"))

    def _endwhile(self, jump: Jump) -> None:
        self.at, _ = self._owner(jump)

    def _do(self, jump: Jump) -> None:
        self._begin(jump)
        self.at += 1

    def _repeat(self, jump: Jump) -> None:
        self._begin(jump)
        times = self._values(jump, 1, 1)[0]
        self._counts[jump.name] = int(min(np.floor(times + 0.5), MAX_STEPS + 1.0))
        self.at = 1 + (self.at if self._counts[jump.name] > 0 else self._find(jump, "endrepeat"))

    def _endrepeat(self, jump: Jump) -> None:
        index, _ = self._owner(jump)
        self._counts[jump.name] -= 1
        self.at = 1 + (index if self._counts[jump.name] > 0 else self.at)

    def _break(self, jump: Jump) -> None:
        _, word = self._owner(jump)
        self.at = self._find(jump, "endwhile" if word == "while" else "while") + 1

    def _continue(self, jump: Jump) -> None:
        index, word = self._owner(jump)
        self.at = index if word == "while" else self._find(jump, "while")

    # --- subs -------------------------------------------------------------------------------------------------------

    def _sub(self, jump: Jump) -> None:
        if self._calls:
            raise LineError(f"{jump.said} is inside o{self._scope}; define it outside")
        if (before := self.text.first(jump.name, ("sub",))) != self.at and before is not None:
            raise LineError(f"{jump.said}: line {self.text.before + before + 1} defines it already")
        end = self._find(jump, "endsub")
        inside = next((i for i in self.text.order if self.at < i < end and self.text.jumps[i].word == "sub"), None)
        if inside is not None:
            fault = LineError(f"{self.text.jumps[inside].said} is inside o{jump.name}; define it outside")
            fault.line = self.text.before + inside + 1
            raise fault
        self.at = end + 1

    def _call(self, jump: Jump) -> None:
        name = jump.name
        if not name:
            scanner = Scanner(jump.rest, self._parameters)
            value = scanner.value()
            rest = scanner.text[scanner.at :]
            if not (abs(value) < 1e6 and abs(value - round(value)) < 1e-4) or rest[:4].lower() != "call":
                raise LineError(f"o{value:g}: only a call may have a computed number, which is whole")
            name = str(round(value))
            jump = Jump("call", name, rest[4:], jump.text)
        arguments = self._values(jump, MAX_ARGUMENTS)
        text, first = self._target(name, ("sub",), "define it with sub and endsub")
        end = text.first(name, ("endsub",), first)
        if end is None:
            raise LineError(f"o{name} sub has no o{name} endsub after it")
        self._enter(_Call(name, text, first, end, (self.text, self.at + 1), self.shown))
        self._run.enter(arguments)

    def _enter(self, call: _Call) -> None:
        if len(self._calls) >= MAX_CALLS:
            raise LineError(f"o{call.name}: more than {MAX_CALLS} calls within calls; does a sub call itself?")
        self._calls.append(call)
        self.text, self.at = call.text, call.first + 1

    def _target(self, name: str, words: tuple[str, ...], mend: str) -> tuple[Text, int]:
        """Where a sub begins: in this file, in the program itself, or in a file of its name beside it."""
        for text in (self.text, self.main):
            if (found := text.first(name, words)) is not None:
                return text, found
        base = name.strip("<>")
        file = self._folder / f"{base}.ngc"
        if re.fullmatch(r"[a-z0-9_-]+", base) and file.is_file():
            if base not in self._files:
                if len(self._files) >= MAX_FILES:
                    raise LineError(f"o{name}: subprograms in more than {MAX_FILES} files")
                self._files[base] = _load(file)
            if (found := self._files[base].first(name, words)) is not None:
                return self._files[base], found
        raise LineError(f"o{name} is called, and is neither in the program nor in {base}.ngc beside it; {mend}")

    def _return(self, jump: Jump) -> None:
        if not self._calls or not self._calls[-1].own:
            raise LineError(f"{jump.said} is outside of a called sub")
        if jump.word == "endsub" and self.at != self._calls[-1].end:
            raise LineError(f"{jump.said} is inside o{self._scope}, which has an endsub of its own name")
        value = self._values(jump, 1)
        self._run.leave()
        self._parameters.set("_value", value[0] if value else 0.0)
        self._parameters.set("_value_returned", float(len(value)))
        self.text, self.at = self._calls.pop().back

    _endsub = _return

    def _m_code(self, jump: Jump) -> None:
        """A line with M98 or M99, after what else it says."""
        run = self._run
        run.call, run.returns = None, False
        run.run(jump.text, self.shown)
        if run.returns:
            self._m99()
        elif run.call is not None and run.call[1] > 0:
            number, repeats = run.call
            name = str(number)
            text, first = self._target(name, ("",), f"begin it with O{number}")
            self._enter(_Call(name, text, first, None, (self.text, self.at + 1), self.shown, repeats, own=False))
            self._run.enter()
        else:
            self.at += 1

    def _m99(self) -> None:
        if not self._calls:
            self._run.findings.say(f"line {self.line}: M99 begins the program again without end; one pass is read")
            self._run.ended = True
            return
        call = self._calls[-1]
        if call.own:
            raise LineError(f"M99 is inside o{call.name} sub; write endsub or return")
        call.repeats -= 1
        self._run.leave()
        if call.repeats > 0:
            self.text, self.at = call.text, call.first + 1
            self._run.enter()
            return
        self.text, self.at = self._calls.pop().back


def _load(file: pathlib.Path) -> Text:
    """A file of subprograms."""
    try:
        check_size(check_file(file), MAX_BYTES)
        content = file.read_bytes().removeprefix(b"\xef\xbb\xbf")
    except (FormatError, OSError) as error:
        raise LineError(f"{file.name} is called and cannot be read: {error}") from None
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    return Text(content + b"\n", 0, file, other=True)

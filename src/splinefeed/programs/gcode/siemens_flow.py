"""Labels, jumps and loops of Siemens' programs [1]_: IF, GOTOF, WHILE, FOR, LOOP, REPEAT.

References
----------
.. [1] SINUMERIK 840D sl/828D, Programming Manual "NC programming", 12/2019, 6FC5398-2EP40-0BA0, 3.1 "Flexible NC
       programming": program jumps, check structures, repetition of program sections.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.flow import ProgramText, Walk
from splinefeed.programs.gcode.interpreter import Interpreter
from splinefeed.programs.gcode.siemens_words import Values

#: Sections that are repeated within each other.
MAX_CALLS = 19

#: What stands before a block: `/` of a block that may be skipped, N, and a label.
HEAD = re.compile(
    r"\s*+(?:/\s*+[0-9]?+\s*+)?(?:N\s*+[0-9]++(?![0-9.])\s*+)?(?:(?P<label>[A-Z_][A-Z0-9_]++)\s*+:(?!=)\s*+)?"
)
_LIKELY = re.compile(
    rb"^[^;\n]*?(?<![A-Z0-9_])(?:(?:IF|ELSE|ENDIF|GOTO[FBCS]?|WHILE|ENDWHILE|FOR|ENDFOR|LOOP|ENDLOOP|REPEATB?|UNTIL|ENDLABEL)\b"
    rb"|[A-Z_]\w++[ \t]*+:)",
    re.MULTILINE | re.IGNORECASE,
)
_WORD = re.compile(
    r"(IF|ELSE|ENDIF|GOTO[FBCS]?|WHILE|ENDWHILE|FOR|ENDFOR|LOOP|ENDLOOP|REPEATB?|UNTIL)(?![A-Z0-9_])\s*+"
)
_GOTO = re.compile(
    r"(?:IF\b(?P<if>.+?))?(?<![A-Z0-9_])(?P<way>GOTO[FBCS]?+)(?![A-Z0-9_])\s*+(?P<aim>[A-Z_][A-Z0-9_]*+)\s*+"
)
_FOR = re.compile(r"([A-Z_][A-Z0-9_]*+)\s*+=(.+?)(?<![A-Z0-9_])TO(?![A-Z0-9_])(.+)")
_REPEAT = re.compile(
    r"(?P<first>[A-Z_][A-Z0-9_]++)(?:\s++(?P<last>(?!P\s*+=|P[0-9])[A-Z_][A-Z0-9_]++))?(?:\s++P\s*+=?+\s*+(?P<times>.+))?"
)
_OPENS = {"IF": "ENDIF", "WHILE": "ENDWHILE", "FOR": "ENDFOR", "LOOP": "ENDLOOP", "REPEAT": "UNTIL"}


@dataclass
class _Step:
    """A line that may lead elsewhere: its word, what follows, and the lines of its structure."""

    at: int
    word: str
    rest: str
    first: int = -1
    after: int = -1  # ELSE or the end
    fault: str = ""


@dataclass
class _Repeat:
    """A section that runs again: its lines, how often, and where the program goes on."""

    begin: int
    stop: int
    left: int
    back: int


class SiemensFlow(Walk):
    """Where a program is; `arrives` is called with the number of a line before it jumps."""

    def __init__(self, text: ProgramText, run: Interpreter, values: Values, arrives: Callable[[int], None]) -> None:
        super().__init__(text, run, arrives)
        self._values = values
        self._steps_at: dict[int, _Step] = {}
        self._labels: dict[str, list[int]] = {}
        for found in _LIKELY.finditer(text.text):
            at = int(np.searchsorted(text.begins, found.start(), "right")) - 1
            said = _code_of(text.jumping(at))
            head = HEAD.match(said)
            if head and head["label"]:
                self._labels.setdefault(head["label"], []).append(at)
            plain = said[head.end() :] if head else said
            if word := _WORD.match(plain):
                self._steps_at[at] = _Step(at, word[1], plain[word.end() :].strip())
            elif jump := re.search(r"(?<![A-Z0-9_])GOTO[FBCS]?\s", plain):
                fault = f"{plain[jump.start() :][:20]!r}: a jump must be alone on its line, or behind IF"
                self._steps_at[at] = _Step(at, "GOTO", plain, fault=fault)
        self._link()
        text.order = [*sorted(self._steps_at), text.count]
        self._repeats: list[_Repeat] = []

    def _link(self) -> None:
        """Find the lines of each structure."""
        opened: list[_Step] = []
        for step in self._steps_at.values():
            block = step.word in _OPENS and not (step.word == "IF" and _GOTO.match(f"IF {step.rest}"))
            if step.word == "REPEAT" and step.rest:
                continue
            if block:
                step.fault = f"{step.word} has no {_OPENS[step.word]} after it"
                step.first = step.at
                opened.append(step)
            elif step.word == "ELSE" or step.word in _OPENS.values():
                wanted = "IF" if step.word == "ELSE" else next(k for k, end in _OPENS.items() if end == step.word)
                if not opened or self._steps_at[opened[-1].first].word != wanted:
                    step.fault = f"{step.word} has no {wanted} before it"
                    continue
                begin = opened.pop()
                begin.after, begin.fault, step.first = step.at, "", begin.first
                if step.word == "ELSE":
                    step.fault = "ELSE has no ENDIF after it"
                    opened.append(step)

    def _until(self) -> int:
        """The next line that jumps, or the end of the section that is repeated."""
        return min([super()._until(), *[each.stop for each in self._repeats[-1:]]])

    def _over(self) -> bool:
        return super()._over() and not self._repeats

    def _next(self) -> None:
        """Begin a section again or leave it at its end; else carry out a line that jumps."""
        if not self._repeats or self.at != self._repeats[-1].stop:
            super()._next()
            return
        section = self._repeats[-1]
        section.left -= 1
        self.at = section.begin if section.left > 0 else self._repeats.pop().back

    def _jump(self, at: int) -> None:
        self.at = self._behind(self._steps_at[at])

    def _behind(self, step: _Step) -> int:
        """The line that follows a line that jumps."""
        refuse(step.fault, step.fault)
        word, behind = step.word, step.at + 1
        if (word == "IF" and step.after < 0) or word.startswith("GOTO"):
            return self._jumped(step)
        match word:
            case "IF":
                return behind if self._values.value(step.rest) else step.after + 1
            case "ELSE":
                return step.after + 1
            case "WHILE":
                return behind if self._values.value(step.rest) else step.after + 1
            case "ENDWHILE" | "ENDLOOP":
                return step.first
            case "UNTIL":
                return behind if self._values.value(step.rest) else step.first + 1
            case "FOR":
                return self._for(step, begins=True)
            case "ENDFOR":
                return self._for(self._steps_at[step.first], begins=False)
            case "REPEAT" | "REPEATB":
                return self._repeat(step) if step.rest else behind
        return behind

    def _for(self, step: _Step, *, begins: bool) -> int:
        said = _FOR.fullmatch(step.rest)
        if said is None:
            raise LineError(f"FOR {step.rest[:20]}: expected FOR R1=1 TO 5")
        name = said[1]
        refuse(not self._values.known(name), f"{name} is not a variable; declare it with DEF INT")
        self._values.set(name, self._values.value(said[2]) if begins else self._values.get(name) + 1.0)
        return step.at + 1 if self._values.get(name) <= self._values.value(said[3]) else step.after + 1

    def _jumped(self, step: _Step) -> int:
        """GOTOF, GOTOB, GOTO and GOTOC, each behind its own IF or none; the first that holds."""
        text, at = f"{step.word} {step.rest}", 0
        while at < len(text):
            jump = _GOTO.match(text, at)
            if jump is None:
                raise LineError(f"{text[at:][:24]!r}: expected GOTOF, GOTOB or GOTO with a label")
            at = jump.end()
            if jump["if"] is None or self._values.value(jump["if"]):
                return self._aim(jump["way"], jump["aim"], step.at)
        return step.at + 1

    def _aim(self, way: str, label: str, at: int) -> int:
        """The line of a label, or of N and its number, that a jump from line `at` goes to."""
        if way == "GOTOS":
            raise LineError("GOTOS begins the program again without end")
        if number := re.fullmatch(r"N([0-9]+)", label):
            places = self.text.lines_of(int(number[1]))
        else:
            places = self._labels.get(label, [])
        ahead, before = [line for line in places if line > at], [line for line in places if line <= at]
        if way == "GOTOF":
            before = []
        elif way == "GOTOB":
            ahead = []
        if not ahead and not before:
            if way == "GOTOC":
                return at + 1
            where = {"GOTOF": " behind it", "GOTOB": " before it"}.get(way, "")
            raise LineError(f"{way} {label}: no line of the program{where} has that label")
        aim = ahead[0] if ahead else before[-1]
        inside = not self._repeats or self._repeats[-1].begin <= aim < self._repeats[-1].stop
        refuse(not inside, f"{way} {label} leads out of a section that REPEAT repeats, which is not read")
        return aim

    def _repeat(self, step: _Step) -> int:
        """REPEAT A P=3: from label A to here, or to the line of a second label, so many times; REPEATB: its line."""
        said = _REPEAT.fullmatch(step.rest)
        if said is None:
            raise LineError(f"{step.word} {step.rest[:20]}: expected a label, and P= with how often")
        first = self._section(said["first"], step.at, step.word)
        times = self._values.value(said["times"]) if said["times"] else 1.0
        refuse(times != int(times) or times < 0, f"{step.word}: P={times:g} must be a whole number from 0")
        if said["last"]:
            stop = self._section(said["last"], step.at, step.word) + 1
        elif step.word == "REPEATB":
            stop = first + 1
        else:
            ends = [line for line in self._labels.get("ENDLABEL", []) if line > first]
            stop = step.at if first < step.at else ends[0] + 1 if ends else -1
            stop = min(stop, ends[0] + 1) if ends and first < step.at else stop
        refuse(stop <= first, f"{step.word} {said['first']}: its section ends before it begins")
        if not times:
            return step.at + 1
        refuse(len(self._repeats) >= MAX_CALLS, f"{step.word}: more than {MAX_CALLS} repeats within repeats")
        self._repeats.append(_Repeat(first, stop, int(times), step.at + 1))
        return first

    def _section(self, label: str, at: int, word: str) -> int:
        places = self._labels.get(label, [])
        if not places:
            raise LineError(f"{word} {label}: no line of the program has that label")
        before = [line for line in places if line < at]
        return before[-1] if before else places[0]


def _code_of(line: bytes) -> str:
    """A line in capitals without its comment, whose ; may stand in a text."""
    text = line.decode("utf-8-sig", errors="replace")
    return without_remarks(text).strip().upper()


def without_remarks(text: str) -> str:
    """The line up to a semicolon outside of a text."""
    if ";" not in text:
        return text
    return re.match(r"(?:[^\";]|\"[^\"]*+\"|\")*", text)[0]  # type: ignore[index]

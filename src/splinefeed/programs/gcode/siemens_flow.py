"""Variables, expressions and jumps of Siemens' programs: R parameters, DEF, IF, GOTOF, WHILE, FOR, REPEAT.

Source: SINUMERIK 840D sl/828D, Programming Manual "NC programming", 12/2019, 6FC5398-2EP40-0BA0, 3.1 "Flexible NC
programming": variables, arithmetic functions, "Priority of the operations" (p. 444: comparisons bind least, AND and OR
tighter), equality within 1e-12 of the values, program jumps, check structures, repetition of program sections. A
parameter that the program has not set is refused: the control keeps its value from before.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from splinefeed.numbers import within
from splinefeed.programs.gcode.expressions import LineError, refuse
from splinefeed.programs.gcode.flow import ProgramText, Walk

#: Sections that are repeated within each other, and brackets within brackets.
MAX_CALLS, MAX_DEPTH = 19, 50
#: Two values this near each other, relative to the greater, are equal.
SAME = 1e-12

_NUMBER = r"(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:EX[-+]?+[0-9]++)?+"
_TOKEN = re.compile(rf"\s*+({_NUMBER}|\$?[A-Z_][A-Z0-9_]*+|==|<>|<=|>=|<<|[-+*/()<>\[\],])")
_PLAIN = re.compile(
    rf"\s*+([-+]?+{_NUMBER})(?![A-Z0-9_.]|\s*+(?:[-+*/<>=(\[]|(?:DIV|MOD|AND|OR|XOR|B_[A-Z]+)(?![A-Z0-9_])))"
)
#: What gets a value, text that is none, and a cycle whose values may be computed.
_GIVEN = re.compile(
    r"\"[^\"]*+(?:\"|$)|(?<![A-Z0-9_$])(?:(?P<cycle>CYCLE8[1-4]\s*+\()"
    r"|(?P<name>\$?+[A-Z_][A-Z0-9_]*+)\s*+(?P<index>\[)?(?(index)|=(?!=)))"
)
_OWN_WAY = re.compile(r"\s*+(AC|IC|DC|ACP|ACN)\s*+\(")
_DECLARED = re.compile(r"DEF\s++(REAL|INT|BOOL|STRING\s*+\[\s*+[0-9]++\s*+\])\s++(.+)")
_NAME = re.compile(r"(?<![A-Z0-9_])[A-Z_][A-Z0-9_]++")
_PARAMETER = re.compile(r"R[0-9]{1,4}")


def _inverse(function: Callable[[float], float]) -> Callable[..., float]:
    return lambda value: math.degrees(function(value))


def _rounded(value: float) -> float:
    return math.floor(value + 0.5)


#: What each function makes of its values, which are one unless it is said.
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "SIN": lambda v: math.sin(math.radians(v)), "COS": lambda v: math.cos(math.radians(v)),
    "TAN": lambda v: math.tan(math.radians(v)), "ASIN": _inverse(math.asin), "ACOS": _inverse(math.acos),
    "ATAN2": lambda a, b: math.degrees(math.atan2(a, b)), "SQRT": math.sqrt, "POT": lambda v: v * v, "ABS": abs,
    "TRUNC": math.trunc, "ROUND": _rounded, "LN": math.log, "EXP": math.exp, "MINVAL": min, "MAXVAL": max,
}  # fmt: skip
_TWO = ("ATAN2", "MINVAL", "MAXVAL")
_CONSTANTS = {"$PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= SAME * max(abs(a), abs(b))


#: Operators from those that bind least to those that bind most.
_LEVELS: tuple[dict[str, Callable[[float, float], float]], ...] = (
    {
        "==": _same, "<>": lambda a, b: not _same(a, b), ">": lambda a, b: a > b and not _same(a, b),
        "<": lambda a, b: a < b and not _same(a, b), ">=": lambda a, b: a > b or _same(a, b),
        "<=": lambda a, b: a < b or _same(a, b),
    },
    {"OR": lambda a, b: bool(a) or bool(b)},
    {"XOR": lambda a, b: bool(a) != bool(b)},
    {"AND": lambda a, b: bool(a) and bool(b)},
    {"B_OR": lambda a, b: _whole(a) | _whole(b)},
    {"B_XOR": lambda a, b: _whole(a) ^ _whole(b)},
    {"B_AND": lambda a, b: _whole(a) & _whole(b)},
    {"+": lambda a, b: a + b, "-": lambda a, b: a - b},
    {"*": lambda a, b: a * b, "/": lambda a, b: a / b, "DIV": lambda a, b: math.trunc(a / b), "MOD": math.fmod},
)  # fmt: skip


def _whole(value: float) -> int:
    refuse(value != int(value), f"{value:g} is not whole: bits need whole numbers")
    return int(value)


class Values:
    """R parameters and variables of DEF, by name."""

    def __init__(self) -> None:
        self._values: dict[str, float] = {}
        self._whole = set[str]()  # of DEF INT and DEF BOOL
        self._texts = set[str]()

    def declare(self, text: str) -> bool:
        """Carry out DEF, if that is what the line says."""
        if not text.startswith("DEF "):
            return False
        declared = _DECLARED.fullmatch(text)
        if declared is None:
            raise LineError(f"{text[:24]!r}: only DEF REAL, DEF INT, DEF BOOL and DEF STRING are read")
        kind = declared[1]
        if kind.startswith("STRING"):
            self._texts |= {each[0] for each in _NAME.finditer(re.sub(r"\"[^\"]*\"", "", declared[2]))}
            return True
        for name, value in _declarations(declared[2]):
            refuse(
                not _NAME.fullmatch(name), f"DEF {name[:20]}: no name of two letters or more; arrays are not supported"
            )
            if kind != "REAL":
                self._whole.add(name)
            self.set(name, self.value(value) if value else 0.0)  # 0 is what the control begins with
        return True

    def known(self, name: str) -> bool:
        """Whether it is a variable and no word of the language."""
        return name in self._values or name in self._texts or bool(_PARAMETER.fullmatch(name))

    def set(self, name: str, value: float) -> None:
        """Give a variable a value."""
        self._values[name] = _rounded(value) if name in self._whole else value

    def get(self, name: str) -> float:
        """Value of a variable or a constant; LineError if it has none."""
        if name in _CONSTANTS:
            return _CONSTANTS[name]
        refuse(name[0] == "$", f"{name} is a variable of the control's own, which is not read")
        refuse(name in self._texts, f"{name} is a text, which is not read as a value")
        if name not in self._values:
            raise LineError(f"{name} has no value; set it in the program before it is used")
        return self._values[name]

    def filled(self, text: str) -> str:
        """The line with numbers in place of what is computed, without the variables that it sets."""
        if "=" not in text and "CYCLE8" not in text and "[" not in text:
            return text
        parts, done, begin = list[str](), 0, 0
        while (found := _GIVEN.search(text, begin)) is not None:
            begin, name = found.end(), found["name"]
            if found["cycle"]:
                value, begin = self._filled_cycle(text, begin)
                parts += [text[done : found.end()], value]
                done = begin
                continue
            if name is None:
                continue
            variable = self.known(name)
            if found["index"]:
                if name != "R":
                    refuse(name[0] == "$", f"{name}[ is a variable of the control's own, which is not read")
                    continue
                reader = _SiemensReader(self, text, begin)
                name, variable = f"R{_number_of_parameter(reader.part(0))}", True
                reader.take("]")
                after = re.compile(r"\s*+=(?!=)").match(text, reader.at)
                if after is None:
                    raise LineError(f"{text[found.start() :][:20].strip()!r}: expected = behind a parameter")
                begin = after.end()
            refuse(name[0] == "$", f"{name} is a variable of the control's own, which is not read")
            if re.compile(r"\s*\"").match(text, begin):
                continue
            value, end = self._value_at(text, begin)
            if variable:
                parts.append(text[done : found.start()])
                self.set(name, float(value))
                done = end
            elif value != text[begin:end].strip():
                parts += [text[done:begin], value, " "]
                done = end
            begin = end
        return "".join([*parts, text[done:]]).strip() if parts else text

    def _value_at(self, text: str, begin: int) -> tuple[str, int]:
        """What stands behind an = sign as a number, in AC( or IC( where it does, and where it ends."""
        if plain := _PLAIN.match(text, begin):
            return plain[1].replace("EX", "E"), plain.end()
        way = _OWN_WAY.match(text, begin)
        reader = _SiemensReader(self, text, way.end() if way else begin)
        value = _finite(text[begin : begin + 40], lambda: reader.part(0))
        if way:
            reader.take(")")
            return f"{way[1]}({value:.17f})", reader.at
        return f"{value:.17f}", reader.at

    def _filled_cycle(self, text: str, begin: int) -> tuple[str, int]:
        """Values in the brackets of a cycle, up to the bracket that closes them."""
        values, at = list[str](), begin
        while True:
            end = re.compile(r"\s*+(?:\"[^\"]*+\"|[A-Z_][A-Z0-9_]*+)?+\s*+(?=[,)]|$)").match(text, at)
            if end and not self.known(end[0].strip()):
                values.append(text[at : end.end()])
                at = end.end()
            else:
                value, at = self._value_at(text, at)
                values.append(value)
            at = len(text) if at >= len(text) else at + len(re.compile(r"\s*").match(text, at)[0])  # type: ignore[index]
            if text[at : at + 1] != ",":
                return ",".join(values), at
            at += 1

    def value(self, text: str) -> float:
        """The value of an expression; LineError for what is none."""
        reader = _SiemensReader(self, text, 0)
        value = _finite(text.strip()[:40], lambda: reader.part(0))
        refuse(reader.peek(), f"expected an expression, got {text[reader.at :].strip()[:20]!r}")
        return value


def _declarations(text: str) -> list[tuple[str, str]]:
    """Names and values of DEF, which are parted by commas outside of brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    pairs = (each.partition("=") for each in parts)
    return [(name.strip(), value.strip()) for name, _, value in pairs]


def _number_of_parameter(value: float) -> int:
    refuse(value != int(value) or not 0 <= value < 10_000, f"R[{value:g}]: expected a whole number from 0")
    return int(value)


def _finite(said: str, compute: Callable[[], float]) -> float:
    try:
        value = float(compute())
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        raise LineError(f"{said.strip()} has no value") from None
    refuse(not within(value), f"{said.strip()} is too large")
    return value


class _SiemensReader:
    """Reads an expression from a place of a line on; `at` is the place reached."""

    def __init__(self, values: Values, text: str, at: int) -> None:
        self.values, self.text, self.at = values, text, at
        self._depth = 0

    def peek(self) -> str:
        """The next token, or nothing."""
        found = _TOKEN.match(self.text, self.at)
        return found[1] if found else self.text[self.at :].strip()[:1]

    def take(self, wanted: str = "") -> str:
        """Pass over the next token, which is `wanted` if that is said."""
        found = _TOKEN.match(self.text, self.at)
        if found is None or (wanted and found[1] != wanted):
            rest = self.text[self.at :].strip()[:20]
            raise LineError(f"expected {wanted or 'a value'}{f', got {rest!r}' if rest else ' at the end of the line'}")
        self.at = found.end()
        return found[1]

    def part(self, level: int) -> float:
        """What binds as `level` says, or stronger."""
        if level == len(_LEVELS):
            return self._one()
        value = self.part(level + 1)
        count = 0
        while (name := self.peek()) in _LEVELS[level]:
            count += 1
            refuse(
                level == 0 and count > 1,
                "comparisons beside each other: AND and OR bind tighter than they do; put each in brackets",
            )
            self.take()
            value = _LEVELS[level][name](value, self.part(level + 1))
        refuse(self.peek() == "<<", "texts (<<) are not read")
        return value

    def _one(self) -> float:
        self._depth += 1
        refuse(self._depth > MAX_DEPTH, f"more than {MAX_DEPTH} brackets within brackets")
        token, value = self.take(), 0.0
        if token in ("+", "-"):
            value = self._one() * (-1.0 if token == "-" else 1.0)
        elif token == "NOT":
            value = not self._one()
        elif token == "B_NOT":
            value = ~_whole(self._one())
        elif token == "(":
            value = self.part(0)
            self.take(")")
        elif token in _FUNCTIONS:
            self.take("(")
            given = [self.part(0)]
            if token in _TWO:
                self.take(",")
                given.append(self.part(0))
            self.take(")")
            value = _FUNCTIONS[token](*given)
        elif token == "R" and self.peek() == "[":
            self.take("[")
            value = self.values.get(f"R{_number_of_parameter(self.part(0))}")
            self.take("]")
        elif token[0].isdigit() or token[0] == ".":
            value = float(token.replace("EX", "E"))
        elif token[0].isalpha() or token[0] in "_$":
            refuse(self.peek() in ("(", "["), f"{token}{self.peek()} is not known in an expression")
            value = self.values.get(token)
        else:
            raise LineError(f"expected a value, got {token!r}")
        self._depth -= 1
        return value


# --- which line comes next --------------------------------------------------------------------------------------------

#: What stands before a block: `/` of a block that may be skipped, N, and a label.
HEAD = re.compile(
    r"\s*+(?:/\s*+[0-9]?+\s*+)?+(?:N\s*+[0-9]++(?![0-9.])\s*+)?(?:(?P<label>[A-Z_][A-Z0-9_]++)\s*+:(?!=)\s*+)?"
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

    def __init__(
        self, text: ProgramText, values: Values, ended: Callable[[], bool], arrives: Callable[[int], None]
    ) -> None:
        super().__init__(text, ended, arrives)
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
        self._order = [*sorted(self._steps_at), text.count]
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

    def blocks(self, size: int) -> Iterator[tuple[bytes, int]]:
        """Lines in the order in which they are carried out, without those that jump, and the number before each."""
        at = 0
        while not self._ended():
            if self._repeats and at == self._repeats[-1].stop:
                section = self._repeats[-1]
                section.left -= 1
                at = section.begin if section.left > 0 else self._repeats.pop().back
                continue
            high = self._order[bisect_left(self._order, at)]
            if self._repeats and at < self._repeats[-1].stop:
                high = min(high, self._repeats[-1].stop)
            yield from self.plain(at, high, size)
            at = high
            if self._ended() or (at == self.text.count and not self._repeats):
                break
            if high in self._steps_at and not (self._repeats and at == self._repeats[-1].stop):
                self._arrives(high + 1)
                self._budget.jump()
                at = self._next(self._steps_at[high])

    def _next(self, step: _Step) -> int:
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
    return re.match(r"(?:[^\";]|\"[^\"]*+\"|\")*+", text)[0]  # type: ignore[index]

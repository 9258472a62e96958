"""The words of a line of Siemens' programs, with their values: numbers, R parameters, variables of DEF, formulas.

Comparisons bind least, AND and OR tighter; values within 1e-12 are equal [1]_. A parameter that the program has not set
is refused: the control keeps its value from before.

References
----------
.. [1] SINUMERIK 840D sl/828D, Programming Manual "NC programming", 12/2019, 6FC5398-2EP40-0BA0, 3.1 "Flexible NC
       programming": variables, arithmetic functions, "Priority of the operations" (p. 444).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from splinefeed.programs.gcode.cycles import SIEMENS, parameters
from splinefeed.programs.gcode.expressions import Block
from splinefeed.programs.gcode.faults import LineError, refuse, shown
from splinefeed.programs.gcode.formulas import ARITHMETIC, FUNCTIONS, Formula, computed
from splinefeed.programs.gcode.moves import LETTERS

#: Two values this near each other, relative to the greater, are equal.
SAME = 1e-12
#: Components of the tool axis, from the tip to the spindle.
TOOL_AXIS = ("A3", "B3", "C3")
_NUMBER = r"(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)"
#: What gets a value, with = or the bracket of an R parameter; a letter with its number; a word, and what it calls.
_GIVEN = re.compile(r"\s*+(\$?+[A-Z_][A-Z0-9_]*+)\s*+(=(?!=)|\[)")
_LETTER = re.compile(rf"\s*+([A-Z])\s*+([-+]?+{_NUMBER})")
#: A number that no operator follows, and a letter or an axis with such a one: most words of most programs.
_ALONE = rf"([-+]?+{_NUMBER})(?=\)|\s*+$|\s++[A-Z][0-9]?+[-+.0-9=])"
_PLAIN, _USUAL = re.compile(rf"\s*+{_ALONE}"), re.compile(rf"\s*+(?:([FGIJKNXYZ])|([ABC]3)=){_ALONE}")
_KEY = re.compile(r"\s*+([A-Z_][A-Z_0-9]*+)(?:\s*+\()?")
_WORD, _TEXT = re.compile(r"[A-Z_]+[0-9]*"), re.compile(r"\s*+\"[^\"]*+\"")
_OWN_WAY, _INSIDE = re.compile(r"\s*+(AC|IC|DC|ACP|ACN)\s*+\("), re.compile(r"([^)]*+)(\)?)")
_DECLARED = re.compile(r"DEF\s++(REAL|INT|BOOL|STRING\s*+\[\s*+[0-9]++\s*+\])\s++")
_NAME, _PARAMETER = re.compile(r"(?<![A-Z0-9_])[A-Z_][A-Z0-9_]++"), re.compile(r"R[0-9]{1,4}")


def _rounded(value: float) -> float:
    return math.floor(value + 0.5)


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= SAME * max(abs(a), abs(b))


def _whole(value: float) -> int:
    refuse(value != int(value), f"{value:g} is not whole: bits need whole numbers")
    return int(value)


def _texts(a: float, b: float) -> float:
    raise LineError("texts (<<) are not read")


#: What each function makes of its values, which are one unless it is said.
_FUNCTIONS: dict[str, Callable[..., float]] = FUNCTIONS | {
    "ATAN2": lambda a, b: math.degrees(math.atan2(a, b)), "POT": lambda v: v * v, "TRUNC": math.trunc,
    "ROUND": _rounded, "MINVAL": min, "MAXVAL": max,
}  # fmt: skip
_TWO = ("ATAN2", "MINVAL", "MAXVAL")
_CONSTANTS = {"$PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}
#: Operators from those that bind least to those that bind most.
_LEVELS: tuple[dict[str, Callable[[float, float], float]], ...] = (
    {
        "==": _same, "<>": lambda a, b: not _same(a, b), ">": lambda a, b: a > b and not _same(a, b),
        "<": lambda a, b: a < b and not _same(a, b), ">=": lambda a, b: a > b or _same(a, b),
        "<=": lambda a, b: a < b or _same(a, b), "<<": _texts,
    },
    {"OR": lambda a, b: bool(a) or bool(b)},
    {"XOR": lambda a, b: bool(a) != bool(b)},
    {"AND": lambda a, b: bool(a) and bool(b)},
    {"B_OR": lambda a, b: _whole(a) | _whole(b)},
    {"B_XOR": lambda a, b: _whole(a) ^ _whole(b)},
    {"B_AND": lambda a, b: _whole(a) & _whole(b)},
    {"+": ARITHMETIC["+"], "-": ARITHMETIC["-"]},
    {"*": ARITHMETIC["*"], "/": ARITHMETIC["/"], "DIV": lambda a, b: math.trunc(a / b), "MOD": math.fmod},
)  # fmt: skip
_OPERATIONS = {name: (rank, compute) for rank, level in enumerate(_LEVELS) for name, compute in level.items()}

#: Values that a line has beside its words, and values that say nothing here: tools by name, corrections, tolerances.
_COLLECTED, _SILENT = ("SD", "PL", "PW", "LIMS", *TOOL_AXIS), ("T", "D", "ADIS", "ADISPOS", "CTOL", "OTOL")
#: What LinuxCNC calls words with a value; TURN counts turns beyond the first.
_LETTERS = {"CR": "R", "TURN": "P", "RND": ",R", "CHR": ",C", "CHF": ",L"}
#: Words and calls that switch functions of the control, or set it up, and move nothing.
IGNORED = frozenset(
    ("SOFT", "BRISK", "DRIVE", "FFWON", "FFWOF", "COMPOF", "COMPON", "COMPCURV", "COMPCAD", "UPATH", "SPATH", "STOPRE",
     "CUT2D", "CFIN", "CFTCP", "CFC", "FNORM", "FLIN", "ORIAXES", "ORIVECT", "ORIMKS", "ORIWKS", "RTLION", "RTLIOF",
     "CYCLE832", "MSG", "WORKPIECE", "FGROUP", "DISPLOF", "SETMS", "DIAMOF")
)  # fmt: skip


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
        declared = _DECLARED.match(text)
        if declared is None:
            raise LineError(f"{text[:24]!r}: only DEF REAL, DEF INT, DEF BOOL and DEF STRING are read")
        kind, rest = declared[1], SiemensWords(text, self, declared.end())
        if kind.startswith("STRING"):
            self._texts |= {each[0] for each in _NAME.finditer(re.sub(r"\"[^\"]*\"", "", text[declared.end() :]))}
            return True
        while True:
            name = rest.take()
            wrong = not _NAME.fullmatch(name) or rest.peek() == "["
            refuse(wrong, f"DEF {name[:20]}: no name of two letters or more; arrays are not supported")
            if kind != "REAL":
                self._whole.add(name)
            self.set(name, 0.0)  # what the control begins with
            if rest.peek() == "=":
                rest.take()
                self.set(name, rest.chain())
            if not rest.peek():
                return True
            rest.take(",")

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

    def value(self, text: str) -> float:
        """The value of a formula; LineError for what is none."""
        reader = SiemensWords(text, self)
        value = reader.chain()
        refuse(reader.peek(), f"expected an expression, got {text[reader.at :].strip()[:20]!r}")
        return value


class SiemensWords(Formula):
    """The words of a line, read from left to right: `read` sets the variables that it sets, and finds the rest.

    Attributes
    ----------
    block : Block
        Words as LinuxCNC has them.
    extra : dict of str to float
        Values of SD, PL, PW and the like.
    keys : set of str
        Words without a value.
    ways : dict of str to bool
        Axes that say themselves whether they are absolute.
    call : tuple or None
        A cycle with its parameters.
    """

    operations = _OPERATIONS
    operator = re.compile(r"\s*+(==|<>|<=|>=|<<|[-+*/<>]|(?:B_AND|B_X?OR|AND|X?OR|DIV|MOD)(?![A-Z0-9_]))")
    token = re.compile(rf"\s*+({_NUMBER}(?:EX[-+]?+[0-9]++)?|\$?[A-Z_][A-Z0-9_]*+|[-+=()\[\],])")

    def __init__(self, text: str, values: Values, at: int = 0) -> None:
        super().__init__(text, at)
        self._values = values
        self.block, self.extra, self.keys, self.ways = Block(), dict[str, float](), set[str](), dict[str, bool]()
        self.call: tuple[str, dict[str, float]] | None = None

    def read(self) -> None:
        """Read the whole line; LineError for what is no word."""
        while self.at < len(self.text):
            if usual := _USUAL.match(self.text, self.at):
                self.at = usual.end()
                if usual[1]:
                    self.block.add(usual[1], float(usual[3]))
                else:
                    self.extra[usual[2]] = float(usual[3])
                continue
            given = _GIVEN.match(self.text, self.at)
            if given and self._gets(given[1], given[2]):
                self.at = given.end()
                self._given(given[1], given[2])
            elif word := _LETTER.match(self.text, self.at):
                self.at = word.end()
                refuse(word[1] == "L", f"L{word[2]} calls a subprogram, which is not read; write the program in one "
                       "piece")  # fmt: skip
                if word[1] != "D":
                    self.block.add(word[1], float(word[2]))
            elif key := _KEY.match(self.text, self.at):
                self.at = key.end()
                self._key(key[1], key[0].endswith("("))
            else:
                raise LineError(f"expected a word of a Siemens program, got {shown(self.text[self.at :])}")
        if 40 in self.block.g:  # F is in seconds there, S in turns of the spindle
            words = self.block.words
            words |= {new: words.pop(old) for old, new in (("F", "P"), ("S", "U")) if old in words}

    def _gets(self, name: str, sign: str) -> bool:
        """Whether what stands before = or [ gets a value: X=5, and not G1X=5."""
        if sign == "[":
            return name == "R" or name[0] == "$"
        return name[0] == "$" or self._values.known(name) or bool(_WORD.fullmatch(name))

    def _given(self, name: str, sign: str) -> None:
        """What stands behind = or [."""
        refuse(name[0] == "$", f"{name} is a variable of the control's own, which is not read")
        variable = sign == "[" or self._values.known(name)
        if sign == "[":
            name = self._parameter()
            self.take("=")
        if text := _TEXT.match(self.text, self.at):
            self.at = text.end()
            return
        way = None if variable else _OWN_WAY.match(self.text, self.at)
        self.at = way.end() if way else self.at
        if plain := _PLAIN.match(self.text, self.at):  # the usual case
            self.at, value = plain.end(), float(plain[1])
        else:
            value = self.chain()
        if way:
            self.take(")")
        refuse(name == "RNDM", "RNDM= rounds all corners, which is not supported; write RND= on each line")
        if variable:
            self._values.set(name, value)
        elif name in _COLLECTED:
            self.extra[name] = value
        elif name in _LETTERS or (len(name) == 1 and name not in "DRNT"):
            if way:
                wrong = way[1] not in ("AC", "IC") or name not in LETTERS + "IJK"
                refuse(wrong, f"{name}={way[1]}( is not supported in a Siemens program")
                self.ways[name] = way[1] == "AC"
            self.block.add(_LETTERS.get(name, name), value + (name == "TURN"))
        else:
            refuse(name not in _SILENT, f"{name}= is not supported in a Siemens program")

    def _key(self, key: str, calls: bool) -> None:
        """A word without a value, or what it calls."""
        if not calls:
            self.keys.add(key)
        elif key in SIEMENS:
            given: list[float | None] = [None if self.peek() in (",", ")", "") else self.chain()]
            while self.peek() == ",":
                self.take()
                given.append(None if self.peek() in (",", ")", "") else self.chain())
            self.take(")", f"{key}( is not closed by )")
            self.call = key, parameters(key, given)
        else:
            inside = _INSIDE.match(self.text, self.at)
            self.at = inside.end() if inside else self.at
            if key in IGNORED or key == "TRAORI":
                self.keys.add(key)
            elif key != "CYCLE800" or (inside and inside[1].strip()):  # CYCLE800() ends a turned plane
                raise LineError(f"{key}( is a call, which is not supported; write plain lines")

    def _parameter(self) -> str:
        """The name of a parameter by what stands in R[ ]."""
        value = self.chain()
        self.take("]")
        refuse(value != int(value) or not 0 <= value < 10_000, f"R[{value:g}]: expected a whole number from 0")
        return f"R{int(value)}"

    def _one(self) -> float:
        token = self.take()
        if token in ("+", "-"):
            return self.value() * (-1.0 if token == "-" else 1.0)
        if token == "NOT":
            return float(not self.value())
        if token == "B_NOT":
            return float(~_whole(self.value()))
        if token == "(":
            value = self.chain()
            self.take(")")
            return value
        if token in _FUNCTIONS:
            self.take("(")
            given = [self.chain()]
            if token in _TWO:
                self.take(",")
                given.append(self.chain())
            self.take(")")
            return computed(f"{token}({', '.join(['{:g}'] * len(given))})", _FUNCTIONS[token], *given)
        if token[0] in ".0123456789":
            return computed(token, float, float(token.replace("EX", "E")))
        refuse(not (token[0].isalpha() or token[0] in "_$"), f"expected a value, got {token!r}")
        if token == "R" and self.peek() == "[":
            self.take()
            token = self._parameter()
        refuse(self.peek() in ("(", "["), f"{token}{self.peek()} is not known in an expression")
        return self._values.get(token)

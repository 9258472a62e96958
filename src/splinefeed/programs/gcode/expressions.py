"""One line of a program as words: letters with their values, which are numbers, parameters, [#1 * COS[30] + 2.5].

References
----------
.. [1] Kramer, Proctor, Messina, The NIST RS274NGC Interpreter, version 3, NISTIR 6556, 2000, section 3.3.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from splinefeed.numbers import within
from splinefeed.programs.gcode.codes import GROUP_OF, M_GROUP_OF, g_name
from splinefeed.programs.gcode.faults import LineError, refuse, shown
from splinefeed.programs.gcode.formulas import ARITHMETIC, FUNCTIONS, Formula, Operations, computed

#: All parameters up to this number exist, set or not (LinuxCNC).
LAST_NUMBER = 5601
#: Parameters that a sub gets from its call.
ARGUMENTS = range(1, 31)
#: Two numbers this near each other are the same to EQ and NE, as in the standard.
SAME = 1e-4

#: What operators make of two values, and how tightly they bind.
_OPERATIONS: Operations = {
    "**": (5, math.pow),
    "*": (4, ARITHMETIC["*"]),
    "/": (4, ARITHMETIC["/"]),
    "MOD": (4, lambda a, b: a - b * math.floor(a / b)),
    "+": (3, ARITHMETIC["+"]),
    "-": (3, ARITHMETIC["-"]),
    "EQ": (2, lambda a, b: abs(a - b) < SAME),
    "NE": (2, lambda a, b: abs(a - b) >= SAME),
    "GT": (2, lambda a, b: a > b),
    "GE": (2, lambda a, b: a >= b),
    "LT": (2, lambda a, b: a < b),
    "LE": (2, lambda a, b: a <= b),
    "AND": (1, lambda a, b: a != 0.0 and b != 0.0),
    "OR": (1, lambda a, b: a != 0.0 or b != 0.0),
    "XOR": (1, lambda a, b: (a != 0.0) != (b != 0.0)),
}
_FUNCTIONS: dict[str, Callable[[float], float]] = FUNCTIONS | {
    "FIX": math.floor,
    "FUP": math.ceil,
    "ROUND": lambda x: math.copysign(math.floor(abs(x) + 0.5), x),
}
#: Fanuc's macros (B-64484EN, "Custom macro", arithmetic and logic): what rounds towards zero and away from it, names of
#: their own, and logic bit by bit.
_OF_MACROS: dict[str, Callable[[float], float]] = {
    "FIX": math.trunc,
    "FUP": lambda x: math.copysign(math.ceil(abs(x)), x),
    "RND": _FUNCTIONS["ROUND"],
    "SQR": math.sqrt,
}
_BITS: dict[str, Callable[[int, int], int]] = {
    "AND": lambda a, b: a & b, "OR": lambda a, b: a | b, "XOR": lambda a, b: a ^ b,
}  # fmt: skip
_NUMBER = re.compile(r"[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)")
_SIMPLE = re.compile(rf"(?:[A-MP-Z]{_NUMBER.pattern}|N(?![+-]){_NUMBER.pattern})+")
_SIMPLE_WORD = re.compile(rf"([A-Z])({_NUMBER.pattern})")
_FUNCTION = re.compile("|".join(["ATAN", "EXISTS", *_FUNCTIONS]))
_MACRO_FUNCTION = re.compile("|".join(["ATAN", *_FUNCTIONS, "RND", "SQR"]))
_PLAIN_PARAMETER = re.compile(r"#([1-9][0-9]{0,4})(?![0-9.])")
_NAME = re.compile(r"<([^<>\[\]#]*)>")

#: Largest whole number that a code may have, and most words of a line.
MAX_CODE = 999
MAX_WORDS = 100
_CODE_SLACK = 1e-4

#: What stands in brackets, and from a semicolon on.
#: A bracket that nothing closes goes to the end: the rest is not looked through again from each bracket in it.
_COMMENT = re.compile(r"\([^)]*+(?:\)|$)|;.*", re.DOTALL)
_BLANKS = re.compile(r"\s+")
_EXPONENT = re.compile(r"(?<![0-9])(?:[0-9]++\.?[0-9]*+|\.[0-9]++)[eE][+-]?[0-9]{1,3}(?![0-9])")
_OPERATOR = re.compile(f"({'|'.join(map(re.escape, _OPERATIONS))})")
_CHARACTER = re.compile(r"(.)", re.DOTALL)
_MACRO = re.compile(r"(?:N[0-9]+)?(IF|WHILE|GOTO|END|THEN|DO|SETVN|POPEN|DPRNT)[\[0-9#]")


class Vacant(float):
    """The value of a macro's variable that has none: 0 in arithmetic, equal to #0 alone; its letter is no word."""


VACANT = Vacant(0.0)
#: Variables of a macro's own, and #0, which never has a value (Fanuc).
LOCALS = range(34)


class Parameters:
    """Values of numbered and named parameters.

    Names that begin with _ are those of the whole program, all others those of the sub that is being carried out.

    Parameters
    ----------
    known : callable
        Gives those that the interpreter computes, such as positions; None for others.
    macros : bool, optional
        Whether they are the variables of Fanuc's macros.
    """

    def __init__(self, known: Callable[[int | str], float | None], macros: bool = False) -> None:
        self.known, self.macros = known, macros
        self.numbers: dict[int, float] = {}
        self._own: dict[str, float] = {}
        self._everyones: dict[str, float] = {"_value": 0.0, "_value_returned": 0.0}
        self._callers: list[tuple[dict[str, float], dict[int, float] | None]] = []

    def _store(self, key: int | str) -> dict[Any, float]:
        if isinstance(key, int):
            return self.numbers
        return self._everyones if key.startswith("_") else self._own

    def enter(self, arguments: Sequence[float] | Mapping[int, float] | None = None) -> None:
        """A sub begins, with names of its own; with `arguments` it has its own #1 to #30 too, a macro #1 to #33."""
        kept = None if arguments is None else {k: self.numbers[k] for k in self._locals() if k in self.numbers}
        self._callers.append((self._own, kept))
        self._own = {}
        if isinstance(arguments, Mapping):
            for k in LOCALS:
                self.numbers.pop(k, None)
            self.numbers |= arguments
        elif arguments is not None:
            self.numbers |= dict.fromkeys(ARGUMENTS, 0.0) | dict(enumerate(arguments, 1))

    def leave(self) -> None:
        """The sub ends: its caller's names, and its #1 to #30 if they were kept, are in force again."""
        self._own, kept = self._callers.pop()
        if kept is not None:
            for k in self._locals():
                self.numbers.pop(k, None)
            self.numbers |= kept

    def _locals(self) -> range:
        """Numbers that belong to a sub: #1 to #30 in LinuxCNC, #1 to #33 (#0 is vacant) in macros."""
        return LOCALS if self.macros else ARGUMENTS

    def get(self, key: int | str) -> float:
        """Value of a parameter; LineError if it has none."""
        value = self.find(key)
        if value is None:
            name = key if isinstance(key, int) else f"<{key}>"
            raise LineError(f"#{name} has no value; set it in the program before it is used")
        return value

    def find(self, key: int | str) -> float | None:
        """Value of a parameter, or None."""
        computed = self.known(key)
        if computed is not None:
            return computed
        vacant = VACANT if self.macros and key in LOCALS else None
        return self._store(key).get(key, vacant)

    def set(self, key: int | str, value: float) -> None:
        """Give a parameter a value."""
        if isinstance(key, str) and self.known(key) is not None:
            raise LineError(f"#<{key}> is set by the machine and cannot be assigned")
        refuse(key == 0, "#0 never has a value and cannot be assigned")
        if value is VACANT:
            self._store(key).pop(key, None)
        else:
            self._store(key)[key] = value


class Scanner(Formula):
    """Reads one line without blanks, in capitals, from left to right; a token is one character."""

    operations = _OPERATIONS
    operator, token = _OPERATOR, _CHARACTER

    def __init__(self, text: str, parameters: Parameters) -> None:
        super().__init__(text)
        self.parameters = parameters
        self._functions = _MACRO_FUNCTION if parameters.macros else _FUNCTION

    def peek(self) -> str:
        """The next character, or nothing."""
        return self.text[self.at : self.at + 1]

    def _one(self) -> float:
        """A real value: a number, an expression in brackets, a parameter or a function."""
        c = self.peek()
        if c == "#":
            if (match := _PLAIN_PARAMETER.match(self.text, self.at)) is None:
                return self.parameters.get(self.parameter())
            self.at = match.end()  # the usual case, without looking for its number as a value
            return self.parameters.get(int(match[1]))
        if (match := _NUMBER.match(self.text, self.at)) is not None:
            self.at = match.end()
            value = float(match[0])
            refuse(not within(value), f"{match[0][:20]}... is too large for a number")
            return value
        if c and c in "+-":
            self.at += 1
            return -self.value() if c == "-" else self.value()
        if c == "[":
            return self._bracket()
        if (match := self._functions.match(self.text, self.at)) is None:
            self.take("a number")
        else:
            self.at = match.end()
            return self._function(match[0])
        return 0.0

    def parameter(self, missing: str = "") -> int | str:
        """The number or name of a parameter, with the # before it."""
        self.take("#", missing)
        if self.peek() == "<":
            match = _NAME.match(self.text, self.at)
            if match is None:
                own = re.match(r"<_(?:HAL|INI)\[[^>]*>", self.text[self.at :])
                refuse(
                    own, f"#{own[0].lower() if own else ''} is a value of the machine's own, which is not known here"
                )
                raise LineError("a parameter's name needs < and >")
            self.at = match.end()
            return match[1].lower()
        value = self.value()
        number = round(value) if math.isfinite(value) and abs(value) < 1e6 else -1
        if number < 1 - self.parameters.macros or abs(value - number) > SAME:
            raise LineError(f"#{value:g} is not a parameter; their numbers are whole and from 1")
        return number

    def _bracket(self) -> float:
        self.take("[")
        value = self.chain()
        self.take("]")
        return value

    def joined(self, name: str, left: float, right: float) -> float:
        """What an operator makes of two values."""
        if self.parameters.macros and name in _BITS:
            return float(_BITS[name](round(left), round(right)))
        if name in ("EQ", "NE") and (left is VACANT or right is VACANT):
            return float((left is right) == (name == "EQ"))
        return super().joined(name, left, right)

    def _function(self, name: str) -> float:
        if name == "EXISTS":
            wanted = "EXISTS needs a parameter in brackets"
            self.take("[", wanted)
            key = self.parameter(wanted)
            self.take("]", wanted)
            numbered = isinstance(key, int) and key <= LAST_NUMBER
            return float(numbered or self.parameters.find(key) is not None)
        value, macros = self._bracket(), self.parameters.macros
        if name == "ATAN":
            if macros and self.text[self.at : self.at + 2] != "/[":
                return math.degrees(math.atan(value))
            self.take("/", "ATAN needs two values: ATAN[y]/[x]")
            return math.degrees(math.atan2(value, self._bracket()))
        compute = _OF_MACROS[name] if macros and name in _OF_MACROS else _FUNCTIONS[name]
        return computed(f"{name}[{{:g}}]", compute, value)


@dataclass
class Block:
    """A line as words.

    Parameters
    ----------
    words : dict of str to float, optional
        Values by letter.
    g, m : list of int, optional
        Codes in their order, G as tenths.
    settings : list of tuple, optional
        Parameters to set, with their values.
    whole : set of str, optional
        Letters whose numbers have no decimal point.
    deletable : bool, optional
        Whether `/` stood before it.
    percent : bool, optional
        Whether it is a %.
    """

    words: dict[str, float] = field(default_factory=dict)
    g: list[int] = field(default_factory=list)
    m: list[int] = field(default_factory=list)
    settings: list[tuple[int | str, float]] = field(default_factory=list)
    whole: set[str] = field(default_factory=set)
    deletable: bool = False
    percent: bool = False

    def add(self, letter: str, value: float, text: str = "") -> None:
        """Add a letter with its value, which stands there as `text`; LineError for one twice and for unknown codes."""
        if text.lstrip("+-").isdigit():
            self.whole.add(letter)
        if letter in "GM":
            code = round(value * (10 if letter == "G" else 1)) if abs(value) <= MAX_CODE else -1
            if code < 0 or abs(value * (10 if letter == "G" else 1) - code) > _CODE_SLACK:
                raise LineError(f"{letter}{value:g} is not known")
            (self.g if letter == "G" else self.m).append(code)
        elif letter in self.words:
            raise LineError(f"{letter} appears twice")
        elif letter != "N":
            self.words[letter] = value

    def checked(self) -> Block:
        """The block; LineError for two codes of one group."""
        if len(self.g) > 1:
            _check_groups(self.g, GROUP_OF, g_name)
        if len(self.m) > 1:
            _check_groups(self.m, M_GROUP_OF, "M{}".format)
        return self


def parse(text: str, parameters: Parameters, *, bare: bool = False, corners: bool = False) -> Block:
    """Take a line apart into words.

    Parameters
    ----------
    text : str
        The line.
    parameters : Parameters
        Values that it may use.
    bare : bool, optional
        Whether a parameter may be set to operators without brackets, #1=#2+5, as in Fanuc's macros.
    corners : bool, optional
        Whether ,R and ,C (and ,L for Siemens' CHF) are words.

    Returns
    -------
    Block
        Its words.

    Raises
    ------
    LineError
        For what is no word, for words twice and for codes that exclude each other.

    Notes
    -----
    As in RS274 blanks mean nothing, not even within a number.
    """
    block = Block()
    plain = capitals(text)
    if _SIMPLE.fullmatch(plain):  # the usual line: letters and numbers
        words = _SIMPLE_WORD.findall(plain)
        refuse(len(words) > MAX_WORDS, f"more than {MAX_WORDS} words")
        for letter, number in words:
            value = float(number)
            refuse(not within(value), f"{letter}: {number[:20]}... is too large for a number")
            block.add(letter, value, number)
        return block.checked()
    scanner = Scanner(plain, parameters)
    if scanner.peek() == "/":
        block.deletable = True
        scanner.at += 2 if scanner.text[1:2].isdigit() else 1  # /2: the number of a switch
    if scanner.peek() == "%":
        if scanner.text[scanner.at + 1 :]:
            raise LineError("% must be alone on its line")
        block.percent = True
        return block
    if macro := _MACRO.match(scanner.text):
        raise LineError(f"{macro[1]}: jumps and loops of macros are not supported here; write plain lines")
    for _ in range(MAX_WORDS + 1):
        if not (c := scanner.peek()):
            break
        if c == "#":
            key = scanner.parameter()
            scanner.take("=", "= is missing behind the parameter that the line sets")
            block.settings.append((key, scanner.chain() if bare else scanner.value()))
            continue
        if c == "," and (corner := scanner.text[scanner.at + 1 :][:1]) in ("R", "C", "A"):
            what = {"R": "a rounded corner", "C": "a chamfer", "A": "the angle of a line"}[corner]
            refuse(not corners or corner == "A", f",{corner} is {what}, which is not supported; write its moves")
        if c == "," and corners and (corner := scanner.text[scanner.at + 1 :][:1]) in ("R", "C", "L"):
            scanner.at += 2
            refuse(f",{corner}" in block.words, f",{corner} appears twice")
            block.words[f",{corner}"] = scanner.value()
            continue
        if not ("A" <= c <= "Z" or c in ":@^$"):
            raise LineError(f"expected a letter, got {shown(scanner.text[scanner.at :])}")
        scanner.at += 1
        if c in "O:":
            if block.words or block.g or block.m:
                said = scanner.text[: scanner.at][-8:] + scanner.text[scanner.at : scanner.at + 6]
                raise LineError(f"{said!r}: a letter O within a line; is it the digit 0?")
            # the number of a program alone is only its name
            if re.fullmatch(r"(O|:O?)[0-9]+|O<[^<>]*>", scanner.text[scanner.at - 1 :]):
                return block
            raise LineError(f"{text.strip()[:20]}: subprograms, loops and jumps are not read here; write plain lines")
        if c == "N" and not re.match(r"[0-9.]", scanner.peek()):
            raise LineError("N: a number is missing")
        begin = scanner.at
        try:
            value = scanner.value()
        except LineError as fault:
            raise LineError(f"{c}: {fault}") from None
        if value is VACANT:
            refuse(c in "GMNOP", f"{c}: its variable has no value")
            continue
        block.add(c, value, scanner.text[begin : scanner.at])
    else:
        raise LineError(f"more than {MAX_WORDS} words")
    return block.checked()


@lru_cache(maxsize=1024)  # lines of loops come again
def capitals(text: str) -> str:
    """The line in capitals, without comments and blanks."""
    return _BLANKS.sub("", without_comments(text)).upper()


def without_comments(text: str) -> str:
    """The line up to a semicolon, without what stands in brackets; LineError for a bracket that is not closed."""
    plain = _COMMENT.sub(lambda found: "" if found[0][0] == ";" or found[0][-1] == ")" else "(", text)
    if left := re.search(r"[()]", plain):
        raise LineError(") closes no comment" if left[0] == ")" else "a comment opens with ( and is not closed with )")
    return plain


def mended(text: str, say: Callable[[str], None]) -> str:
    """The line without comments, `say` hears of wrong ones, and with numbers such as 1.5E-05 written out."""
    try:
        text = without_comments(text)
    except LineError as fault:
        say(f"{fault}; a comment ends at its last bracket, or at the end of the line")
        text = _outside(text)
    return _EXPONENT.sub(_written_out, text)


def _written_out(number: re.Match[str]) -> str:
    value = float(number[0])
    refuse(not within(value), f"{number[0][:20]} is too large for a number")
    return f"{value:.20f}"


def _outside(text: str) -> str:
    """What of a line stands outside of comments, brackets within brackets being one, up to what none closes or `;`."""
    open_at: list[int] = []  # how long the text outside was at each bracket that is open
    kept: list[str] = []
    for letter in text:
        if letter == "(":
            open_at.append(len(kept))
        elif letter == ")":
            if open_at:
                del kept[open_at.pop() :]
            continue
        elif letter == ";" and not open_at:
            break
        kept.append(letter)
    return "".join(kept[: open_at[0]] if open_at else kept)


def _check_groups(codes: Sequence[int], groups: Mapping[int, str], name: Callable[[int], str]) -> None:
    """LineError for two codes of one group."""
    seen: dict[str, int] = {}
    for code in codes:
        group = groups.get(code, "")
        if group in seen and 800 in (code, seen[group]):  # G80 beside a move only ends the cycle before it
            seen[group] = min(code, seen[group])
        elif group in seen:
            before, after = name(seen[group]), name(code)
            raise LineError(f"{before} and {after} exclude each other (both: {group}); write one of them")
        elif group:
            seen[group] = code

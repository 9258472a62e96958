"""One line of a program as words: letters with their values, G and M codes, and parameters that are set."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from splinefeed.formats.gcode.codes import GROUP_OF, M_GROUP_OF, g_name
from splinefeed.formats.gcode.expressions import LineError, Parameters, Scanner

#: Largest whole number that a code may have, and most words of a line.
MAX_CODE = 999
MAX_WORDS = 100
_CODE_SLACK = 1e-4

#: What stands in brackets, and from a semicolon on.
_COMMENT = re.compile(r"\([^)]*\)|;.*", re.DOTALL)
_BLANKS, _BLANKS_BUT_E = re.compile(r"\s+"), re.compile(r"\s+(?![eE])")
_MACRO = re.compile(r"(?:N[0-9]+)?(IF|WHILE|GOTO|END|THEN|DO|SETVN|POPEN|DPRNT)[\[0-9#]", re.IGNORECASE)


@dataclass
class Block:
    """A line: values by letter, codes in their order (G as tenths), parameters to set, whether `/` stood before it."""

    words: dict[str, float] = field(default_factory=dict)
    g: list[int] = field(default_factory=list)
    m: list[int] = field(default_factory=list)
    settings: list[tuple[int | str, float]] = field(default_factory=list)
    deletable: bool = False
    percent: bool = False

    @property
    def empty(self) -> bool:
        """Whether there is nothing in it but comments and its number."""
        return not (self.words or self.g or self.m or self.settings)


def parse(text: str, parameters: Parameters, *, exponents: bool = False) -> Block:
    """The words of the line `text`; LineError for what is none, for words twice and for codes that exclude each other.

    exponents   whether a number may end in E-05
    """
    block = Block()
    # as in RS274 blanks mean nothing, not even within a number; but 1 E5 is no 1e5
    scanner = Scanner((_BLANKS_BUT_E if exponents else _BLANKS).sub("", without_comments(text)), parameters, exponents)
    if scanner.peek() == "/":
        block.deletable = True
        scanner.at += 1
        if scanner.peek().isdigit():
            scanner.at += 1  # /2: the number of a switch
    if scanner.peek() == "%":
        if scanner.text[scanner.at + 1 :].strip():
            raise LineError("% must be alone on its line")
        block.percent = True
        return block
    macro = _MACRO.match("".join(scanner.text.split()))
    if macro is not None:
        raise LineError(
            f"{macro[1].upper()}: jumps and loops are not supported here; let the CAM system write plain lines"
        )
    count = 0
    while c := scanner.peek().upper():
        count += 1
        if count > MAX_WORDS:
            raise LineError(f"more than {MAX_WORDS} words")
        if c == "#":
            _setting(scanner, block)
            continue
        if not ("A" <= c <= "Z" or c in ":@^"):
            raise LineError(f"expected a letter, got {_shown(scanner.text[scanner.at :])}")
        scanner.at += 1
        if c in "O:":
            _program_number(scanner, text)
            return block
        if c == "N":
            _line_number(scanner)
            continue
        try:
            value = scanner.value()
        except LineError as fault:
            raise LineError(f"{c}: {fault}") from None
        if not math.isfinite(value):
            raise LineError(f"{c}{value}: is too large for a number")
        _add(block, c, value)
    _check_groups(block)
    return block


def without_comments(text: str) -> str:
    """The line up to a semicolon, without what stands in brackets; LineError for a bracket that is not closed."""
    plain = _COMMENT.sub("", text)
    if left := re.search(r"[()]", plain):
        raise LineError(") closes no comment" if left[0] == ")" else "a comment opens with ( and is not closed with )")
    return plain


def without_nested(text: str) -> str:
    """The line without comments, where they may stand in each other, end with the line, or close twice."""
    kept: list[str] = []
    depth = 0
    for c in text:
        if c == ";" and depth == 0:
            break
        depth += (c == "(") - (c == ")" and depth > 0)
        if depth == 0 and c != ")":
            kept.append(c)
    return "".join(kept)


def _setting(scanner: Scanner, block: Block) -> None:
    key = scanner.parameter()
    if scanner.peek() != "=":
        raise LineError("= is missing behind the parameter that the line sets")
    scanner.at += 1
    value = scanner.value()
    block.settings.append((key, value))


def _program_number(scanner: Scanner, text: str) -> None:
    """Behind O, : or :O: the number of a program alone is only its name; everything else is a subprogram."""
    if not re.fullmatch(r"(O|:O?)[0-9]+|O<[^<>]*>", scanner.text[scanner.at - 1 :], re.IGNORECASE):
        raise LineError(
            f"{_shown(text)[1:-1]}: subprograms, loops and jumps are not supported here; write the program in one piece"
        )
    scanner.at = len(scanner.text)


def _line_number(scanner: Scanner) -> None:
    """Behind N: digits, which mean nothing."""
    if not re.match(r"[0-9.]", scanner.peek()):
        raise LineError("N: a number is missing")
    scanner.value()


def _add(block: Block, letter: str, value: float) -> None:
    if letter == "G":
        code = round(10.0 * value) if abs(value) <= MAX_CODE else -1
        if code < 0 or abs(10.0 * value - code) > _CODE_SLACK:
            raise LineError(f"G{value:g} is not known")
        block.g.append(code)
    elif letter == "M":
        code = round(value) if abs(value) <= MAX_CODE else -1
        if code < 0 or abs(value - code) > _CODE_SLACK:
            raise LineError(f"M{value:g} is not known")
        block.m.append(code)
    else:
        if letter in block.words:
            raise LineError(f"{letter} appears twice")
        block.words[letter] = value


def _check_groups(block: Block) -> None:
    """LineError for two codes of one group."""
    seen: dict[str, int] = {}
    for code in block.g:
        group = GROUP_OF.get(code)
        if group is None:
            continue
        if group in seen and 800 in (code, seen[group]):  # G80 beside a move only ends the cycle before it
            seen[group] = min(code, seen[group])
            continue
        if group in seen:
            before, after = g_name(seen[group]), g_name(code)
            raise LineError(f"{before} and {after} exclude each other (both: {group}); write one of them")
        seen[group] = code
    m_seen: dict[str, int] = {}
    for code in block.m:
        group = M_GROUP_OF.get(code)
        if group is not None and group in m_seen:
            raise LineError(f"M{m_seen[group]} and M{code} exclude each other (both: {group}); write one of them")
        if group is not None:
            m_seen[group] = code


def _shown(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= 20 else f"{text[:17]}...")

"""One line of a program as words: letters with their values, G and M codes, and parameters that are set."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from splinefeed.formats.gcode.codes import GROUP_OF, M_GROUP_OF, g_name
from splinefeed.formats.gcode.expressions import LineError, Parameters, Scanner

#: Largest whole number that a code may have, and most words of a line.
MAX_CODE = 999
MAX_WORDS = 100
_CODE_SLACK = 1e-4

#: What stands in brackets, and from a semicolon on.
_COMMENT = re.compile(r"\([^)]*\)|;.*", re.DOTALL)
_BLANKS = re.compile(r"\s+")
_EXPONENT = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][+-]?[0-9]{1,3}(?![0-9])")
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


def parse(text: str, parameters: Parameters) -> Block:
    """The words of the line `text`; LineError for what is none, for words twice and for codes that exclude each other.

    As in RS274 blanks mean nothing, not even within a number.
    """
    block = Block()
    scanner = Scanner(_BLANKS.sub("", without_comments(text)), parameters)
    if scanner.peek() == "/":
        block.deletable = True
        scanner.at += 2 if scanner.text[1:2].isdigit() else 1  # /2: the number of a switch
    if scanner.peek() == "%":
        if scanner.text[scanner.at + 1 :]:
            raise LineError("% must be alone on its line")
        block.percent = True
        return block
    if macro := _MACRO.match(scanner.text):
        raise LineError(f"{macro[1].upper()}: jumps and loops of macros are not supported here; write plain lines")
    for _ in range(MAX_WORDS + 1):
        if not (c := scanner.peek().upper()):
            break
        if c == "#":
            key = scanner.parameter()
            scanner.take("=", "= is missing behind the parameter that the line sets")
            block.settings.append((key, scanner.value()))
            continue
        if not ("A" <= c <= "Z" or c in ":@^"):
            raise LineError(f"expected a letter, got {scanner.text[scanner.at :][:20]!r}")
        scanner.at += 1
        if c in "O:":
            # the number of a program alone is only its name
            if re.fullmatch(r"(O|:O?)[0-9]+|O<[^<>]*>", scanner.text[scanner.at - 1 :], re.IGNORECASE):
                return block
            raise LineError(f"{text.strip()[:20]}: subprograms, loops and jumps are not read here; write plain lines")
        if c == "N" and not re.match(r"[0-9.]", scanner.peek()):
            raise LineError("N: a number is missing")
        try:
            value = scanner.value()
        except LineError as fault:
            raise LineError(f"{c}: {fault}") from None
        if not math.isfinite(value):
            raise LineError(f"{c}{value}: is too large for a number")
        if c in "GM":
            code = round(value * (10 if c == "G" else 1)) if abs(value) <= MAX_CODE else -1
            if code < 0 or abs(value * (10 if c == "G" else 1) - code) > _CODE_SLACK:
                raise LineError(f"{c}{value:g} is not known")
            (block.g if c == "G" else block.m).append(code)
        elif c in block.words:
            raise LineError(f"{c} appears twice")
        elif c != "N":
            block.words[c] = value
    else:
        raise LineError(f"more than {MAX_WORDS} words")
    _check_groups(block.g, GROUP_OF, g_name)
    _check_groups(block.m, M_GROUP_OF, "M{}".format)
    return block


def without_exponents(text: str) -> str:
    """The line with numbers such as 1.5E-05 written out."""
    return _EXPONENT.sub(lambda number: f"{float(number[0]):.20f}", text)


def without_comments(text: str) -> str:
    """The line up to a semicolon, without what stands in brackets; LineError for a bracket that is not closed."""
    plain = _COMMENT.sub("", text)
    if left := re.search(r"[()]", plain):
        raise LineError(") closes no comment" if left[0] == ")" else "a comment opens with ( and is not closed with )")
    return plain


def without_nested(text: str) -> str:
    """The line without comments, where they may stand in each other, end with the line, or close twice."""
    while (plain := re.sub(r"\([^()]*\)", "", text)) != text:
        text = plain
    return re.sub(r"[(;].*|\)", "", text)


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

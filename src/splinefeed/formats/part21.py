"""The clear text of ISO 10303-21 (STEP): whether a file is whole and refers to nothing that is not there."""

from __future__ import annotations

import pathlib
import re

from splinefeed.errors import FormatError
from splinefeed.formats import part21_splines

START = b"ISO-10303-21"
END = b"END-ISO-10303-21"
#: Strings and comments: in them nothing has a meaning. A quote stands twice inside of a string.
_SILENT = re.compile(rb"'(?:[^']|'')*'|/\*.*?\*/", re.DOTALL)
_BLANKS = bytes(letter if letter in b"\r\n" else 32 for letter in range(256))
_INSTANCE = re.compile(rb"\s*#\s*([0-9]{1,18})\s*=\s*([A-Z_a-z!]\w*)?\s*\(")
_REFERENCE = re.compile(rb"#\s*([0-9]{1,18})")
#: Parentheses in parentheses; a real file has five or so.
MAX_DEPTH = 32
_DEEP = re.compile(rb"\((?:[^()]*\(){%d}" % MAX_DEPTH)


def holds(head: bytes) -> bool:
    """Whether `head` looks like STEP."""
    return _SILENT.sub(b"", head[:4096]).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(START)


def plain(content: bytes) -> bytes:
    """`content` with blank strings and comments; every byte that is left stands where it stood."""

    def blank(match: re.Match[bytes]) -> bytes:
        said = match[0]
        return b"'" + said[1:-1].translate(_BLANKS) + b"'" if said.startswith(b"'") else said.translate(_BLANKS)

    return _SILENT.sub(blank, content)


def check(content: bytes, file: pathlib.Path, *, repair: bool) -> list[str]:
    """Raise FormatError for a file that is cut off or broken; with `repair` what it lacks is a finding instead.

    Looked at are the first and last word, the shape of every instance and whether each reference has its instance.
    """
    findings: list[str] = []

    def fault(what: str) -> None:
        if not repair:
            raise FormatError(f"{file}: {what}")
        findings.append(what)

    if not holds(content):
        raise FormatError(f"{file}: does not begin with {START.decode()}; is it STEP?")
    text = plain(content)
    sections = END in text, b"DATA" in text, b"ENDSEC" in text
    if not all(sections):
        fault(f"{END.decode()} does not end it, at byte {len(content)}; is the file cut off?")
    if text.count(b"'") % 2:
        fault("a quote is opened and never closed")
    defined: set[int] = set()
    used: dict[int, int] = {}
    line = 1
    for statement in text.split(b";"):
        begin = line + statement[: len(statement) - len(statement.lstrip())].count(b"\n")
        line += statement.count(b"\n")
        if not statement.lstrip().startswith(b"#"):
            continue
        match = _INSTANCE.match(statement)
        if match is None or not statement.rstrip().endswith(b")") or statement.count(b"(") != statement.count(b")"):
            shown = statement.strip()[:40].decode("ascii", "replace")
            fault(f"line {begin}: {' '.join(shown.split())!r} is no whole instance, such as #12 = NAME(...)")
            continue
        if _DEEP.search(statement):
            raise FormatError(f"{file}: line {begin}: parentheses lie more than {MAX_DEPTH} deep")
        number = int(match[1])
        if number in defined:
            fault(f"line {begin}: #{number} stands there for the second time")
        defined.add(number)
        for reference in _REFERENCE.findall(statement, match.end()):
            used.setdefault(int(reference), begin)
    line, at = 1, 0
    for place, why in part21_splines.mended(content, text)[1]:
        line, at = line + text.count(b"\n", at, place), place
        fault(f"line {line}: {why}")
    missing = sorted(set(used) - defined, key=lambda number: used[number])
    if missing:
        more = f", and {len(missing) - 1} more" if len(missing) > 1 else ""
        fault(f"line {used[missing[0]]}: refers to #{missing[0]}, which is not there{more}; is the file complete?")
    if not defined:
        raise FormatError(f"{file}: has no instances in its DATA section; there is nothing to read")
    return findings

"""The clear text of ISO 10303-21 (STEP): whether a file is whole and refers to nothing that is not there."""

from __future__ import annotations

import pathlib
import re

from splinefeed.errors import FormatError

START = b"ISO-10303-21"
END = b"END-ISO-10303-21"
#: Strings and comments: in them nothing has a meaning. A quote stands twice inside of a string.
_SILENT = re.compile(rb"'(?:[^']|'')*'|/\*.*?\*/", re.DOTALL)
_INSTANCE = re.compile(rb"\s*#\s*([0-9]{1,18})\s*=\s*([A-Z_a-z!]\w*)?\s*\(")
_REFERENCE = re.compile(rb"#\s*([0-9]{1,18})")
#: Parentheses in parentheses; a real file has five or so.
MAX_DEPTH = 32
_DEEP = re.compile(rb"\((?:[^()]*\(){%d}" % MAX_DEPTH)


def holds(head: bytes) -> bool:
    """Whether `head` looks like STEP."""
    return _SILENT.sub(b"", head[:4096]).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(START)


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
    text = _SILENT.sub(lambda match: b"\n" * match[0].count(b"\n") + b"''", content)
    sections = END in text, b"DATA" in text, b"ENDSEC" in text
    if not all(sections):
        fault(f"{END.decode()} does not end it, at byte {len(content)}; is the file cut off?")
    if b"'" in text.replace(b"''", b""):
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
        if b"_CURVE_WITH_KNOTS" in statement and (times := _too_often(statement)):
            fault(
                f"line {begin}: #{number}: an inner knot stands {times} times, more than the degree, and OCCT leaves "
                f"such curves out; let the CAD system split it there"
            )
        if number in defined:
            fault(f"line {begin}: #{number} stands there for the second time")
        defined.add(number)
        for reference in _REFERENCE.findall(statement, match.end()):
            used.setdefault(int(reference), begin)
    missing = sorted(set(used) - defined, key=lambda number: used[number])
    if missing:
        more = f", and {len(missing) - 1} more" if len(missing) > 1 else ""
        fault(f"line {used[missing[0]]}: refers to #{missing[0]}, which is not there{more}; is the file complete?")
    if not defined:
        raise FormatError(f"{file}: has no instances in its DATA section; there is nothing to read")
    return findings


def _too_often(statement: bytes) -> int:
    """How often an inner knot of a B-spline curve stands, if that is more than its degree; else 0."""
    degree, times = _DEGREE.search(statement), _TIMES.search(statement)
    if degree is None or times is None:
        return 0
    most = max(map(int, times[1].split(b",")[1:-1]), default=0)
    return most if most > int(degree[1]) else 0


_DEGREE = re.compile(rb"B_SPLINE_CURVE(?:_WITH_KNOTS)?\s*\(\s*(?:''\s*,\s*)?([0-9]{1,4})\s*,")
_TIMES = re.compile(rb"\(\s*([0-9]{1,6}(?:\s*,\s*[0-9]{1,6})+)\s*\)\s*,\s*\(")
_RATIONAL = re.compile(rb"#[0-9]+\s*=\s*\([^;']*RATIONAL_B_SPLINE_CURVE\s*\(\s*\(([^()]*)\)[^;]*;")
_CLOSED = re.compile(rb"(B_SPLINE_CURVE\s*\(\s*[0-9]+\s*,\s*\([^()]*\)\s*,\s*\.[A-Z_]+\.\s*,\s*\.)[TU](?=\.)")


def not_periodic(content: bytes) -> bytes:
    """`content` with rational curves called open that are closed with different weights at their ends.

    OCCT makes every curve that is called closed periodic, where first and last weight must be the same, and drops the
    last one: the curve would be another. To be called closed changes no point of it.
    """

    def opened(match: re.Match[bytes]) -> bytes:
        weights = match[1].split(b",")
        try:
            same = float(weights[0]) == float(weights[-1])
        except ValueError:  # OCCT will say what is wrong with them
            same = True
        return match[0] if same else _CLOSED.sub(rb"\1F", match[0])

    return _RATIONAL.sub(opened, content)

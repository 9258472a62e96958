"""IGES 5.x in fixed lines of 80 columns: curves in space, read by OCCT.

Read are entities 100 (arc), 102 (composite), 104 (conic), 106 (copious data), 110 (line), 112 (parametric spline), 126
(rational B-spline) and 130 (offset) with their transformations, and on request, or where there is nothing else, the
edges of faces. Curves in the parameters of a surface are no tool paths.
"""

from __future__ import annotations

import pathlib
import re

from splinefeed.errors import FormatError
from splinefeed.formats import cad_process
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import join_tolerance
from splinefeed.formats.source import read_bytes
from splinefeed.geometry.path import JOIN_TOLERANCE

_OCCT = cad_process.Library("iges", "OCP", "OCCT (package cadquery-ocp-novtk)")
_SECTIONS = b"SGDPT"
_COUNTS = re.compile(rb"S\s*([0-9]{1,7})G\s*([0-9]{1,7})D\s*([0-9]{1,7})P\s*([0-9]{1,7})")
_CUT = "is the file cut off?"
#: Columns of a line before the letter of its section.
_TEXT = 72


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: the letter S or, in the compressed form, C, and a number in column 73."""
    line = head[: _TEXT * 2].splitlines()[0] if head.splitlines() else b""
    return line[_TEXT : _TEXT + 1] in (b"S", b"C", b"B") and line[_TEXT + 1 :].strip().lstrip(b"0") == b"1"


def from_file(
    file: pathlib.Path, *, edges: bool = False, tolerance: float | str = JOIN_TOLERANCE, repair: bool = False
) -> Contents:
    """The paths in `file`; `edges` adds the edges of faces, curves whose ends meet within `tolerance` make one path."""
    allowed = join_tolerance(tolerance)
    findings = check(read_bytes(file), file, repair=repair)
    return cad_process.read(file, _OCCT, findings, tolerance=allowed, repair=repair, edges=edges)


def check(content: bytes, file: pathlib.Path, *, repair: bool) -> list[str]:
    """Raise FormatError for a file that is cut off or broken; with `repair` what it lacks is a finding instead."""
    findings: list[str] = []

    def fault(what: str) -> None:
        if not repair:
            raise FormatError(f"{file}: {what}")
        findings.append(what)

    counts = dict.fromkeys(_SECTIONS, 0)
    before = 0
    end = b""
    for number, line in enumerate(content.splitlines(), start=1):
        if not line.strip(b" \0\x1a"):
            continue
        letter = line[_TEXT] if len(line) > _TEXT else 0
        if letter in b"BC" and number == 1:
            raise FormatError(
                f"{file}: is IGES in its {'binary' if letter == 66 else 'compressed'} form; save it as ASCII"
            )
        if letter not in counts:
            fault(f"line {number}: has none of S, G, D, P, T in column 73; is this IGES, and is it whole?")
            continue
        place = _SECTIONS.index(letter)
        if place < before:
            fault(f"line {number}: section {chr(letter)} stands behind section {chr(_SECTIONS[before])}")
        before = max(before, place)
        counts[letter] += 1
        sequence = line[_TEXT + 1 : _TEXT + 8].strip().decode("ascii", "replace")
        if sequence.lstrip("0") != str(counts[letter]):
            fault(f"line {number}: is number {counts[letter]} of section {chr(letter)}, but says {sequence!r}")
        end = line if letter == ord("T") else end
    said = _COUNTS.match(end)
    if said is None:
        fault(f"the line that counts the others (S, G, D, P) is missing behind line {sum(counts.values())}; {_CUT}")
    else:
        for letter, count in zip(b"SGDP", said.groups(), strict=True):
            if int(count) != counts[letter]:
                fault(f"section {chr(letter)} has {counts[letter]} lines, but the last line says {int(count)}")
    if counts[ord("D")] < 2 or counts[ord("D")] % 2:
        fault(f"section D has {counts[ord('D')]} lines; two an entity are needed")
    return findings

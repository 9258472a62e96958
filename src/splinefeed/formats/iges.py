"""IGES 5.x in fixed lines of 80 columns: curves in space, read by OCCT.

Read are entities 100 (arc), 102 (composite), 104 (conic), 106 (copious data), 110 (line), 112 (parametric spline), 126
(rational B-spline) and 130 (offset) with their transformations, and on request, or where there is nothing else, the
edges of faces. Curves in the parameters of a surface are no tool paths.
"""

from __future__ import annotations

import math
import pathlib
import re
from collections.abc import Callable

from splinefeed.errors import FormatError
from splinefeed.formats import cad_process
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import join_tolerance
from splinefeed.formats.source import read_bytes
from splinefeed.geometry.path import JOIN_TOLERANCE

_OCCT = cad_process.Library("iges", "OCP", "OCCT (package cadquery-ocp-novtk)")
_SECTIONS = b"SGDPT"
_COUNTS = re.compile(rb"S\s*([0-9]{1,7})G\s*([0-9]{1,7})D\s*([0-9]{1,7})P\s*([0-9]{1,7})")
_STRING = re.compile(rb"\s*([0-9]{1,6})H")
#: Columns of a line of parameters, place of the resolution in section G, and words of an arc: its type and seven more.
_DATA, _RESOLUTION, _ARC = 64, 18, 8
#: Resolution below which a file's word for it is not believed, units of the file: what ten digits are worth.
LEAST_RESOLUTION = 1e-6
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
    sections: dict[int, list[bytes]] = {letter: [] for letter in _SECTIONS}
    before = 0
    for number, line in enumerate(content.splitlines(), start=1):
        if not line.strip(b" \0\x1a"):
            continue
        letter = line[_TEXT] if len(line) > _TEXT else 0
        if letter in b"BC" and number == 1:
            form = "binary" if letter == ord("B") else "compressed"
            raise FormatError(f"{file}: is IGES in its {form} form; save it as ASCII")
        if letter not in counts:
            fault(f"line {number}: has none of S, G, D, P, T in column 73; is this IGES, and is it whole?")
            continue
        place = _SECTIONS.index(letter)
        if place < before:
            fault(f"line {number}: section {chr(letter)} stands behind section {chr(_SECTIONS[before])}")
        before = max(before, place)
        counts[letter] += 1
        sections[letter].append(line)
        sequence = line[_TEXT + 1 : _TEXT + 8].strip().decode("ascii", "replace")
        if sequence.lstrip("0") != str(counts[letter]):
            fault(f"line {number}: is number {counts[letter]} of section {chr(letter)}, but says {sequence!r}")
    end = sections[ord("T")][-1] if sections[ord("T")] else b""
    said = _COUNTS.match(end)
    if said is None:
        fault(f"the line that counts the others (S, G, D, P) is missing behind line {sum(counts.values())}; {_CUT}")
    else:
        for letter, count in zip(b"SGDP", said.groups(), strict=True):
            if int(count) != counts[letter]:
                fault(f"section {chr(letter)} has {counts[letter]} lines, but the last line says {int(count)}")
    if counts[ord("D")] < 2 or counts[ord("D")] % 2:
        fault(f"section D has {counts[ord('D')]} lines; two an entity are needed")
    if not findings:
        _check_curves(sections, fault)
    return findings


def _check_curves(sections: dict[int, list[bytes]], fault: Callable[[str], None]) -> None:
    """Say which arcs (100) do not end on the circle that they begin on, and which B-splines (126) jump.

    The error that the file allows itself is its resolution, the 19th word of section G. OCCT would move such a spline.
    """
    words = _words(b"".join(line[:_TEXT] for line in sections[ord("G")]), b",", b";")
    allowed = max(_number(words[_RESOLUTION]) if len(words) > _RESOLUTION else 0.0, LEAST_RESOLUTION)
    separators = [
        words[i][2:3] if len(words) > i and words[i].startswith(b"1H") else standard
        for i, standard in enumerate((b",", b";"))
    ]
    entries, parameters = sections[ord("D")], sections[ord("P")]
    for i in range(0, len(entries) - 1, 2):
        kind = entries[i][:8].strip()
        if kind not in (b"100", b"126"):
            continue
        first, count = _number(entries[i][8:16]), _number(entries[i + 1][24:32])
        lines = parameters[int(first) - 1 : int(first + count) - 1] if first >= 1.0 and count >= 1.0 else []
        text = b"".join(line[:_DATA] for line in lines)
        if kind == b"126":
            _check_spline(i + 1, text.partition(separators[1])[0].split(separators[0]), allowed, fault)
            continue
        values = [_number(word) for word in _words(text, *separators)]
        if len(values) < _ARC:
            fault(f"entity D{i + 1}: an arc has {max(len(values) - 1, 0)} parameters; {_ARC - 1} are needed")
            continue
        _, _, x, y, *ends = values[:_ARC]
        begin, end = (math.hypot(ends[k] - x, ends[k + 1] - y) for k in (0, 2))
        if not abs(end - begin) <= allowed:
            fault(
                f"entity D{i + 1}: an arc begins with radius {begin:.9g} and ends with {end:.9g}; "
                f"{abs(end - begin):.3g} apart, and {allowed:.3g} is the resolution of the file"
            )


def _check_spline(entry: int, words: list[bytes], allowed: float, fault: Callable[[str], None]) -> None:
    """Say whether a spline has an inner knot above the degree in multiplicity where it jumps or its weights do."""
    try:
        last, degree = int(words[1]), int(words[2])
        count = last + 1
        if not (degree >= 1 and count > degree) or len(words) < 7 + 5 * count + degree + 1:
            return  # OCCT will say what is wrong with it
        knots = [_number(word) for word in words[7 : 7 + count + degree + 1]]
    except (IndexError, ValueError):
        return
    weights, places = 7 + count + degree + 1, 7 + 2 * count + degree + 1
    first = 0
    for k in range(1, count + 1):
        if knots[k] == knots[k - 1]:
            continue
        times, begin, first = k - first, first - 1, k
        if times <= degree or not knots[degree] < knots[k - 1] < knots[count]:
            continue
        # a piece ends on the point before the first of the equal knots, the next begins on that before the last p + 1
        met = [[_number(word) for word in words[places + 3 * i : places + 3 * i + 3]] for i in range(begin, k - degree)]
        gaps = [math.dist(met[0], point) for point in met[1:]]
        same = len({_number(word) for word in words[weights + begin : weights + k - degree]}) == 1
        if not same or not all(gap <= allowed for gap in gaps):
            why = f"jumps there by {max(gaps):.3g}" if same else "changes its weight there"
            fault(
                f"entity D{entry}: a B-spline of degree {degree} has the inner knot {knots[k - 1]:g} {times} times and "
                f"{why}, which OCCT cannot hold; let the CAD system split it there"
            )
            return


def _words(text: bytes, separator: bytes, end: bytes) -> list[bytes]:
    """The parameters in `text` up to its `end`; in strings such as 3Ha,b separators have no meaning."""
    words = []
    at = 0
    while at < len(text):
        string = _STRING.match(text, at)
        begin = string.end() + int(string[1]) if string else at
        stops = [place for place in (text.find(separator, begin), text.find(end, begin)) if place >= 0]
        stop = min(stops, default=len(text))
        words.append(text[at:stop].strip())
        if text[stop : stop + 1] == end:
            break
        at = stop + 1
    return words


def _number(word: bytes) -> float:
    """A number of IGES, D for e allowed; not a number for what is none."""
    try:
        return float(word.replace(b"D", b"E").replace(b"d", b"e") or b"0")
    except ValueError:
        return math.nan

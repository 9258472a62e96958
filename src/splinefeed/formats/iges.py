"""IGES 5.x in fixed lines of 80 columns: curves in space, read by OCCT.

Read are entities 100 (arc), 102 (composite), 104 (conic), 106 (copious data), 110 (line), 112 (parametric spline), 126
(rational B-spline) and 130 (offset) with their transformations; see docs/cad-files.md.
"""

from __future__ import annotations

import pathlib
import re

from splinefeed.files.source import read_bytes
from splinefeed.formats import cad_process
from splinefeed.formats.drawing import Drawing
from splinefeed.paths.contents import Contents
from splinefeed.paths.path import JOIN_TOLERANCE

#: Columns of a line before the letter of its section.
_TEXT = 72


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format: the letter S and a number in column 73."""
    line = head[: _TEXT * 2].splitlines()[0] if head.splitlines() else b""
    return line[_TEXT : _TEXT + 1] == b"S" and line[_TEXT + 1 :].strip().lstrip(b"0") == b"1"


def from_file(
    file: pathlib.Path,
    *,
    edges: bool = False,
    tolerance: float | str = JOIN_TOLERANCE,
    hidden: bool = False,
    repair: bool = False,
) -> Contents:
    """Read the paths in an IGES file.

    Parameters
    ----------
    file : path
        The file.
    edges : bool, optional
        Whether the edges of faces are read, too.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm.
    hidden : bool, optional
        Whether what the author's program does not show is read, too.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.

    Returns
    -------
    Contents
        Paths in the order of the file, mm, and its units.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    return cad_process.read(
        Drawing(file, tolerance, repair, hidden=hidden), "iges", _faults(read_bytes(file)), edges=edges
    )


def _faults(content: bytes) -> list[str]:
    """What is wrong with the lines of a file, if anything. OCCT takes what lies in memory for what is missing.

    Every line has the letter of its section in column 73, and the last one says how many there are of each.
    """
    lines = [(i, line) for i, line in enumerate(content.splitlines(), start=1) if line.strip(b" \0\x1a")]
    letters = b"".join(line[_TEXT : _TEXT + 1] or b"-" for _, line in lines)
    end = re.match(rb"S*G*D*P*T?", letters)
    if end and end.end() < len(letters):
        place = f"line {lines[end.end()][0]}"
        return [f"{place}: has none of S, G, D, P, T in column 73, or not in order; save it as ASCII"]
    said = re.findall(rb"([SGDP])\s*([0-9]{1,7})", lines[-1][1]) if letters.endswith(b"T") else []
    if len(said) != 4 or any(int(count) != letters.count(letter) for letter, count in said):
        return [f"line {len(letters)}: does not count the lines of sections S, G, D and P; is the file complete?"]
    return []

"""Tool tables as LinuxCNC has them [1]_: T number, P pocket, D diameter, offsets by axis, ; comment.

References
----------
.. [1] LinuxCNC documentation, "Tool Table Format".
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.source import read_text
from splinefeed.numbers import within
from splinefeed.programs.gcode.faults import LineError
from splinefeed.programs.gcode.moves import AXES, LARGEST, LETTERS, ROTARY
from splinefeed.records import Array

#: Most tools of a table, and its largest size, bytes.
MAX_TOOLS, MAX_BYTES = 10_000, 2**20
_WORD = re.compile(r"([TPDXYZABCUVWIJQ])\s*([-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++))\s*", re.IGNORECASE)


@dataclass(frozen=True)
class Tool:
    """Offset (9,), mm and rad, that G43 puts in force, and diameter, mm."""

    offset: Array
    diameter: float = 0.0


@dataclass(frozen=True)
class Tools:
    """Tools by number."""

    by_number: Mapping[int, Tool]

    def tool(self, number: float) -> Tool:
        """The tool of that number, T0 being none; LineError where the table has no such tool."""
        found = self.by_number.get(int(number)) if number == int(number) else None
        if found is None and number:
            numbers = sorted(self.by_number)
            there = ", ".join(f"T{each}" for each in numbers[:5]) + " and more" * (len(numbers) > 5)
            raise LineError(f"tool {number:g} is not in the tool table, which has {there or 'none'}; add it there")
        return found or Tool(np.zeros(AXES))


def read_tools(file: str | os.PathLike[str]) -> Tools:
    """The table in `file`, lines of T1 P1 Z50.2 D6 ; comment, in mm and degrees; FormatError that names the line."""
    found: dict[int, Tool] = {}
    for line, whole in enumerate(read_text(file, "a tool table", MAX_BYTES).splitlines(), 1):
        said = whole.partition(";")[0].strip()
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(said)}
        if _WORD.sub("", said) or (said and "T" not in words):
            raise FormatError(f"{file}: line {line}: expected T1 P1 Z50.2 D6, got {whole[:40]!r}")
        if not said:
            continue
        if not all(map(within, words.values())):
            raise FormatError(f"{file}: line {line}: a word is beyond {LARGEST:g}")
        number = words["T"]
        if number in found or number < 0 or number != int(number):
            raise FormatError(f"{file}: line {line}: T{number:g} appears twice, or is not a tool number")
        if max(map(abs, words.values())) > LARGEST or len(found) == MAX_TOOLS:
            raise FormatError(f"{file}: line {line}: a word is beyond {LARGEST:g}, or a tool beyond {MAX_TOOLS}")
        offset = np.array([words.get(letter, 0.0) for letter in LETTERS])
        offset[list(ROTARY)] = np.deg2rad(offset[list(ROTARY)])
        found[int(number)] = Tool(offset, words.get("D", 0.0))
    return Tools(found)

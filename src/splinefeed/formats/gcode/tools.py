"""Tool tables: LinuxCNC's `.tbl`, and a TOML of ours with the time that a change takes.

Source: LinuxCNC documentation, "Tool Table Format": T number, P pocket, D diameter, offsets by axis, ; comment.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import AXES, LETTERS, ROTARY
from splinefeed.formats.source import read_text
from splinefeed.records import Array
from splinefeed.units import parse

#: Most tools of a table, and its largest size, bytes.
MAX_TOOLS, MAX_BYTES = 10_000, 2**20
_WORD = re.compile(r"([TPDXYZABCUVWIJQ])\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))\s*", re.IGNORECASE)


@dataclass(frozen=True)
class Tool:
    """Offset (9,), mm and rad, that G43 puts in force, and diameter, mm."""

    offset: Array
    diameter: float = 0.0


@dataclass(frozen=True)
class Tools:
    """Tools by number, and how long M6 takes, s."""

    by_number: Mapping[int, Tool]
    change: float = 0.0

    def tool(self, number: float) -> Tool:
        """The tool of that number, T0 being none; LineError where the table has no such tool."""
        if number == 0.0:
            return self.by_number.get(0, Tool(np.zeros(AXES)))
        found = self.by_number.get(int(number)) if number == int(number) else None
        if found is None:
            raise LineError(
                f"tool {number:g} is not in the tool table, which has {_listed(self.by_number)}; add it there"
            )
        return found


def read_tools(file: str | os.PathLike[str]) -> Tools:
    """The table in `file`, by its suffix; FormatError that names the line or the key that is wrong.

    .toml   change_time, and a table [tools.N] a tool with length, diameter or offset.x, ... as quantities (mm, deg)
    others  LinuxCNC's lines, T1 P1 Z50.2 D6 ; comment, in mm and degrees
    """
    text = read_text(file, "a tool table", MAX_BYTES)
    change, found = _of_toml(text, file) if str(file).lower().endswith(".toml") else (0.0, _of_lines(text, file))
    if len(found) > MAX_TOOLS:
        raise FormatError(f"{file}: has {len(found)} tools; at most {MAX_TOOLS} can be read")
    return Tools(found, change)


def _of_lines(text: str, file: str | os.PathLike[str]) -> dict[int, Tool]:
    found: dict[int, Tool] = {}
    for line, whole in enumerate(text.splitlines(), 1):
        said = whole.partition(";")[0].strip()
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(said)}
        if _WORD.sub("", said) or (said and "T" not in words):
            raise FormatError(f"{file}: line {line}: expected T1 P1 Z50.2 D6, got {whole[:40]!r}")
        if not said:
            continue
        number = words["T"]
        if number in found or number < 0 or number != int(number):
            raise FormatError(f"{file}: line {line}: T{number:g} appears twice, or is not a tool number")
        found[int(number)] = _tool({each: words[each] for each in LETTERS if each in words}, words.get("D", 0.0), file)
    return found


def _of_toml(text: str, file: str | os.PathLike[str]) -> tuple[float, dict[int, Tool]]:
    try:
        content = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(f"{file}: {error}") from None
    _check_keys(content, {"change_time", "tools"}, "", file)
    found = {}
    tables = content.get("tools", {})
    for name, table in tables.items() if isinstance(tables, dict) else [("", tables)]:
        if not str(name).isdigit() or not isinstance(table, dict):
            raise FormatError(f"{file}: tools: expected a table [tools.1] a tool, got {name!r}")
        _check_keys(table, {"length", "diameter", "offset"}, f"tools.{name}.", file)
        axes = {"z": table["length"]} if "length" in table else {}
        axes |= dict(table["offset"]) if isinstance(table.get("offset"), dict) else {}
        _check_keys(axes, set(LETTERS.lower()), f"tools.{name}.offset.", file)
        values = {
            axis.upper(): _quantity(v, "angle" if axis in "abc" else "length", f"tools.{name}.{axis}", file)
            for axis, v in axes.items()
        }
        diameter = _quantity(table.get("diameter", 0.0), "length", f"tools.{name}.diameter", file)
        found[int(name)] = _tool(values, diameter, file, turned=True)
    change = _quantity(content.get("change_time", 0.0), "time", "change_time", file)
    if change < 0.0:
        raise FormatError(f"{file}: change_time: {change:g} s is less than 0")
    return change, found


def _check_keys(table: Mapping[str, Any], known: set[str], where: str, file: str | os.PathLike[str]) -> None:
    for key in table:
        if key not in known:
            raise FormatError(f"{file}: {where}{key} is not known; there are {', '.join(sorted(known))}")


def _quantity(value: Any, kind: str, name: str, file: str | os.PathLike[str]) -> float:
    try:
        return parse(value, kind)
    except InputError as error:
        raise FormatError(f"{file}: {name}: {error}") from None


def _tool(axes: Mapping[str, float], diameter: float, file: str | os.PathLike[str], turned: bool = False) -> Tool:
    """A tool by its offsets, mm and degrees, or radians if `turned`."""
    offset = np.zeros(AXES)
    for letter, value in axes.items():
        offset[LETTERS.index(letter)] = value
    if not turned:
        offset[list(ROTARY)] = np.deg2rad(offset[list(ROTARY)])
    if not (np.all(np.abs(offset) <= layout.LARGEST) and abs(diameter) <= layout.LARGEST):
        raise FormatError(f"{file}: an offset or diameter of a tool is beyond {layout.LARGEST:g} mm")
    return Tool(offset, diameter)


def _listed(numbers: Mapping[int, Tool]) -> str:
    named = ", ".join(f"T{number}" for number in sorted(numbers)[:5])
    return (named + (" and more" if len(numbers) > 5 else "")) or "none"

"""Points in a table (.csv, .xyz, ...): measured or scanned, in order, fitted by curves within a tolerance.

One point a line, numbers between commas, semicolons, tabs or blanks; lines that begin with # or % do not count. A line
above the numbers may name the columns: x, y, z, a, b, c, theta, with a unit behind (x [in]); mm and degrees otherwise.
"""

from __future__ import annotations

import math
import os
import pathlib
import re

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError, UnitError
from splinefeed.formats.fitted import fitted_path
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.formats.source import head_text
from splinefeed.geometry.fitting import MAX_POINTS
from splinefeed.geometry.path import Path
from splinefeed.records import ROTARY_AXES, Array

#: Largest distance between the points and the fitted curve unless the caller says another, mm.
DEFAULT_TOLERANCE = 1e-3
#: Columns in the order in which a path has them; without names the first ones are taken, at most x, y and z.
AXES = ("x", "y", "z", "a", "b", "c", "theta")
UNNAMED = 3
#: How a file of setpoints of ours begins.
_OURS = "# splinefeed"
_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")
_NAME = re.compile(r"([a-z]+)\s*(?:[\[(]\s*([^\])]*)\s*[\])])?")


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: two lines of as many numbers, two or more, and before them words only."""
    counts = []
    for line in head_text(head[:4096]).splitlines():
        if not line.strip() or line.lstrip()[0] in "#%":
            if line.startswith(_OURS):
                return False
            continue
        if (numbers := _numbers(line)) is not None:
            counts.append(len(numbers))
        elif counts or not _names(line):
            return False
        if len(counts) == 2:
            return counts[0] == counts[1] >= 2
    return False


def from_text(
    text: str,
    source: str | os.PathLike[str],
    *,
    tolerance: float | str = DEFAULT_TOLERANCE,
    degree: int = 3,
) -> list[Path]:
    """The points in `text` as one path of fitted curves, mm and rad, parted at corners.

    `tolerance` is the largest distance, mm, of a fit of the given `degree` from the points. Where the last point is
    the first one again, the path is closed, smoothly unless there is a corner. The findings report the distance that
    was measured and everything that the file leaves open.
    """
    allowed = units.parse(tolerance, "length")
    if allowed <= 0.0:
        raise InputError(f"tolerance is {allowed:g} mm; it must be greater than 0")
    if text.startswith(_OURS):
        raise FormatError(f"{source}: holds setpoints; follow, check and stream take them, as a path they are none")
    rows, names, lines = _rows(text, source)
    axes, points, findings = _chosen(rows, names, source)
    bad = ~np.all(np.isfinite(points), axis=1)
    if bad.any():
        raise FormatError(f"{source}: line {lines[int(np.argmax(bad))]}: is no finite point")
    if np.max(np.abs(points)) > MAX_COORDINATE:
        raise FormatError(f"{source}: holds coordinates beyond {MAX_COORDINATE:g} mm; is the unit right?")
    closed = len(points) > 3 and bool(np.all(points[0] == points[-1]))
    if closed:
        findings.append("the last point is the first one again: the path is closed")
    try:
        path = fitted_path(
            points, allowed, source, axes=axes, name=pathlib.Path(source).stem, degree=degree, closed=closed,
            findings=[f"{len(points)} points", *findings],
        )  # fmt: skip
    except InputError as error:
        raise FormatError(f"{source}: {error}") from None
    return [path]


def _numbers(line: str) -> list[float] | None:
    """The numbers of a line; None if it holds something else."""
    try:
        return [float(word) for word in _BETWEEN.split(line.strip().rstrip(",;"))]
    except ValueError:
        return None


def _names(line: str) -> list[tuple[str, str]]:
    """Names and units of the columns, in small letters, if the line holds x or y among them; none otherwise."""
    words = re.split(r"\s*[,;\t]\s*", line.strip()) if re.search(r"[,;\t]", line) else line.split()
    found = [_NAME.fullmatch(word.strip(" \"'").lower()) for word in words]
    named = [(match[1], match[2] or "") if match else ("", "") for match in found]
    return named if {"x", "y"} & {name for name, _ in named} else []


def _rows(text: str, source: str | os.PathLike[str]) -> tuple[Array, list[tuple[str, str]], list[int]]:
    """Numbers (n, columns), names and units of the columns if they are said, and the line of each row."""
    names: list[tuple[str, str]] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped or stripped[0] in "#%":
            names = names or _names(stripped.lstrip("#% ")) if not rows else names
            continue
        values = _numbers(stripped)
        if values is None:
            if rows:
                raise FormatError(f"{source}: line {number}: expected {len(rows[0])} numbers, got {stripped[:40]!r}")
            names = _names(stripped) or names
            continue
        if rows and len(values) != len(rows[0]):
            raise FormatError(f"{source}: line {number}: holds {len(values)} numbers, the lines above {len(rows[0])}")
        rows.append(values)
        lines.append(number)
        if len(rows) > MAX_POINTS:
            raise FormatError(f"{source}: holds more than {MAX_POINTS} points; thin or split them")
    if not rows or len(rows[0]) < 2:
        raise FormatError(f"{source}: holds no points; one a line is needed, at least x and y")
    if names and len(names) != len(rows[0]):
        raise FormatError(f"{source}: names {len(names)} columns, but line {lines[0]} holds {len(rows[0])} numbers")
    return np.array(rows), names, lines


def _chosen(
    rows: Array, names: list[tuple[str, str]], source: str | os.PathLike[str]
) -> tuple[tuple[str, ...], Array, list[str]]:
    """Axes, points (n, axes), mm and rad, and what is left out."""
    findings = []
    given = [name for name, _ in names] or list(AXES[: min(rows.shape[1], UNNAMED)])
    twice = [axis for axis in AXES if given.count(axis) > 1]
    if twice:
        raise FormatError(f"{source}: two columns are called {twice[0]}")
    axes = tuple(axis for axis in AXES if axis in given)
    if left := rows.shape[1] - len(axes):
        findings.append(f"{left} of {rows.shape[1]} columns are no axes that are named, and left out")
    columns = []
    for axis in axes:
        unit = names[given.index(axis)][1] if names else ""
        kind, usual = ("angle", "deg") if axis in ROTARY_AXES else ("length", "mm")
        try:
            factor = units.parse(f"1{unit or usual}", kind)
        except UnitError as error:
            raise FormatError(f"{source}: column {axis}: {error}") from None
        columns.append(factor * rows[:, given.index(axis)])
    if any(axis in ROTARY_AXES for axis in axes):
        findings.append(
            f"rotary axes are fitted with the others, 1 mm of tolerance counting as {math.degrees(1):.3g} deg"
        )
    return axes, np.column_stack(columns), findings

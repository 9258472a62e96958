"""Points in a table (.csv, .xyz, ...): measured or scanned, in order, fitted by curves within a tolerance.

One point a line, numbers between commas, semicolons, tabs or blanks, with points or commas before their decimals; lines
that begin with #, %, ! or // do not count. A line above the numbers may name the columns: x, y, z, a, b, c, theta, with
a unit behind (x [in], x_in); mm and degrees otherwise. One number alone above them is how many there are.
"""

from __future__ import annotations

import math
import os
import pathlib
from dataclasses import dataclass, field

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError, UnitError
from splinefeed.formats import table_text
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


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: two lines of as many numbers, two or more, and before them words only."""
    counts = []
    for line in head_text(head[:4096]).splitlines():
        if not line.strip() or table_text.comment(line.lstrip()) is not None:
            if line.startswith(_OURS):
                return False
            continue
        if (numbers := table_text.numbers(line)) is not None:
            counts.append(len(numbers[0]))
        elif counts or not _named(table_text.names(line)[0]):
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
    check_no_setpoints(text, source)
    table = _table(text, source)
    axes, points, findings = chosen(table)
    if any(axis in ROTARY_AXES for axis in axes):
        findings.append(
            f"rotary axes are fitted with the others, 1 mm of tolerance counting as {math.degrees(1):.3g} deg"
        )
    closed = len(points) > 3 and bool(np.all(points[0] == points[-1]))
    if closed:
        findings.append("the last point is the first one: the path is closed")
    try:
        path = fitted_path(
            points, allowed, source, axes=axes, name=pathlib.Path(source).stem, degree=degree, closed=closed,
            findings=[f"{len(points)} points", *findings],
        )  # fmt: skip
    except InputError as error:
        raise FormatError(f"{source}: {error}") from None
    return [path]


def check_no_setpoints(text: str, source: str | os.PathLike[str]) -> None:
    """FormatError for a file of ours that begins with `text` and holds a motion."""
    if text.startswith(_OURS):
        raise FormatError(f"{source}: holds setpoints, not a path; give it to follow, check or stream")


def _named(names: list[tuple[str, str]]) -> bool:
    """Whether x or y is among the names of the columns."""
    return bool({"x", "y"} & {name for name, _ in names})


@dataclass
class Table:
    """Numbers, the line of each row, names and units of the columns if they are said; and what there is to say."""

    source: str | os.PathLike[str]
    rows: list[list[float]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    names: list[tuple[str, str]] = field(default_factory=list)
    remarked: list[tuple[str, str]] = field(default_factory=list)  # names in a comment, which may be mere words
    findings: list[str] = field(default_factory=list)
    unknown: tuple[int, str, int] | None = None  # a line of names that are none of an axis, itself and their count
    said: int | None = None  # how many points the file says that it has

    def add(self, number: int, line: str) -> None:
        """Take over a line that is not blank."""
        behind = table_text.comment(line)
        found = table_text.numbers(line) if behind is None else None
        if found is None:
            if behind is None and self.rows:
                raise FormatError(
                    f"{self.source}: line {number}: expected {len(self.rows[0])} numbers, got {line[:40]!r}"
                )
            self._head(number, line if behind is None else behind, remark=behind is not None)
            return
        values, decimal = found
        if self.rows and len(values) != len(self.rows[0]):
            if len(self.rows) > 1 or len(self.rows[0]) > 1 or self.rows[0][0] != int(self.rows[0][0]):
                raise FormatError(
                    f"{self.source}: line {number}: holds {len(values)} numbers, the lines above {len(self.rows[0])}"
                )
            self.said = int(self.rows.pop()[0])
            self.lines.clear()
        if decimal and not self.findings:
            self.findings.append(f"line {number}: commas are read as decimal points, {line[:40]!r} as {values}")
        self.rows.append(values)
        self.lines.append(number)
        if len(self.rows) > MAX_POINTS:
            raise FormatError(
                f"{self.source}: holds more than {MAX_POINTS} points; thin or split them, or read their parts"
                ", as splinefeed run does"
            )

    def _head(self, number: int, line: str, *, remark: bool) -> None:
        """A line that is not of numbers, above them: of names, a title, or a comment."""
        if self.rows:
            return
        found, marked = table_text.names(line)
        if _named(found) and remark:
            self.remarked = self.remarked or found
        elif _named(found):
            self.names = self.names or found
        elif not remark and not any(letter.isalpha() for letter in line):
            raise FormatError(f"{self.source}: line {number}: expected numbers, got {line[:40]!r}")
        elif not remark and marked:
            self.unknown = number, line, len(found)

    def check(self) -> None:
        """FormatError for a table without points, of other names than it has columns, or of names that are no axes."""
        if not self.rows or len(self.rows[0]) < 2:
            raise FormatError(f"{self.source}: no points found; expected one point per line, at least x and y")
        columns = len(self.rows[0])
        if not self.names and len(self.remarked) == columns:
            self.names = self.remarked
        if self.names and len(self.names) != columns:
            raise FormatError(
                f"{self.source}: names {len(self.names)} columns, but line {self.lines[0]} holds {columns} numbers"
            )
        if self.unknown is not None and not self.names and self.unknown[2] == columns:
            number, line, _ = self.unknown
            raise FormatError(
                f"{self.source}: line {number}: none of the columns {line[:40]!r} is called x or y; "
                f"name them ({', '.join(AXES)}), or take the line out"
            )

    def check_count(self, count: int) -> None:
        """FormatError for another number of points than the file says."""
        if self.said is not None and self.said != count:
            raise FormatError(f"{self.source}: says {self.said} points, but {count} follow; is the file complete?")


def _table(text: str, source: str | os.PathLike[str]) -> Table:
    table = Table(source)
    for number, line in enumerate(text.splitlines(), start=1):
        if stripped := line.strip():
            table.add(number, stripped)
    table.check()
    table.check_count(len(table.rows))
    return table


def chosen(table: Table) -> tuple[tuple[str, ...], Array, list[str]]:
    """Axes, points (n, axes), mm and rad, and what is left out; FormatError for points that are none."""
    rows, names, source, findings = np.array(table.rows), table.names, table.source, list(table.findings)
    given = [name for name, _ in names] or list(AXES[: min(rows.shape[1], UNNAMED)])
    twice = [axis for axis in AXES if given.count(axis) > 1]
    if twice:
        raise FormatError(f"{source}: two columns are called {twice[0]}")
    axes = tuple(axis for axis in AXES if axis in given)
    if left := rows.shape[1] - len(axes):
        findings.append(f"{left} of {rows.shape[1]} columns are not named as axes and are left out")
    columns = []
    for axis in axes:
        unit = names[given.index(axis)][1] if names else ""
        kind, usual = ("angle", "deg") if axis in ROTARY_AXES else ("length", "mm")
        try:
            factor = units.parse(f"1{unit or usual}", kind)
        except UnitError as error:
            raise FormatError(f"{source}: column {axis}: {error}") from None
        columns.append(factor * rows[:, given.index(axis)])
    points = np.column_stack(columns)
    bad = ~np.all(np.isfinite(points), axis=1)
    if bad.any():
        raise FormatError(f"{source}: line {table.lines[int(np.argmax(bad))]}: is not a finite point")
    if np.max(np.abs(points)) > MAX_COORDINATE:
        raise FormatError(f"{source}: holds coordinates beyond {MAX_COORDINATE:g} mm; is the unit right?")
    return axes, points, findings

"""Points in a table (.csv, .xyz, ...): measured or scanned, in order, fitted by curves within a tolerance.

One point a line, numbers between commas, semicolons, tabs or blanks, with points or commas before their decimals; lines
that begin with #, %, ! or // do not count. A line above the numbers may name the columns: x, y, z, a, b, c, theta, with
a unit behind (x [in], x_in); mm and degrees otherwise. One number alone above them is how many there are.
"""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain, islice

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError, UnitError
from splinefeed.formats import table_text
from splinefeed.formats.fitted import fitted_path
from splinefeed.formats.path_parts import PathParts
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.formats.source import check_file, check_size, head_text, read_head
from splinefeed.geometry.fitting import MAX_POINTS
from splinefeed.geometry.path import Path
from splinefeed.records import ROTARY_AXES, Array

#: Largest distance between the points and the fitted curve unless the caller says another, mm.
DEFAULT_TOLERANCE = 1e-3
#: Columns in the order in which a path has them; without names the first ones are taken, at most x, y and z.
AXES = ("x", "y", "z", "a", "b", "c", "theta")
UNNAMED = 3
#: Points of one part, and the largest table that is read in parts, bytes.
PART = 4096
MAX_BYTES = 2 * 2**30
_BLOCK = 2**20
#: How a file of setpoints of ours begins.
_OURS = "# splinefeed"

Points = tuple[tuple[str, ...], Array, list[str]]  # axes, points (n, axes), mm and rad, and findings


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: two lines of as many numbers, two or more, and before them words only."""
    counts = []
    for line in head_text(head[:4096]).splitlines():
        if not line.strip() or line.lstrip().startswith(table_text.COMMENTS):
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
    (axes, points, findings), *more = islice(_blocks(text.splitlines(), source, MAX_POINTS), 2)
    if more:
        raise FormatError(
            f"{source}: holds more than {MAX_POINTS} points; thin or split them, or read parts as splinefeed run does"
        )
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


def in_parts(file: pathlib.Path) -> PathParts:
    """The points in `file`, joined by straight lines, read part by part."""
    check_size(check_file(file), MAX_BYTES)
    read_head(file, _BLOCK)
    with file.open("rb") as stream:
        count = sum(block.count(b"\n") for block in iter(partial(stream.read, _BLOCK), b""))
    axes, _, findings = next(_parts(file))
    return PathParts(
        name=file.stem, axes=axes, count=count, unit="lines", make=partial(_paths, file), findings=tuple(findings)
    )


def _parts(file: pathlib.Path) -> Iterator[Points]:
    try:
        with file.open(encoding="utf-8-sig", errors="replace") as stream:
            yield from _blocks(stream, file, PART)
    except OSError as error:
        raise FormatError(f"{file}: cannot be read: {error.strerror or error}") from None


def _paths(file: pathlib.Path) -> Iterator[Path]:
    """Parts of the path; points that are the same as the one before are left out."""
    before: Array | None = None
    made = False
    for axes, places, _ in _parts(file):
        joined = places if before is None else np.concatenate([before, places])
        joined = joined[np.append(True, np.any(np.diff(joined, axis=0) != 0.0, axis=1))]
        before = joined[-1:].copy()
        if len(joined) > 1:
            made = True
            yield Path.polyline(joined, axes, name=file.stem)
    if not made:
        raise FormatError(f"{file}: holds one point only; a path needs two")


def _named(names: list[tuple[str, str]]) -> bool:
    return bool({"x", "y"} & {name for name, _ in names})


def _blocks(lines: Iterable[str], source: str | os.PathLike[str], most: int) -> Iterator[Points]:
    """The points of a table, at most `most` at a time; at least one block, or FormatError with the line."""

    def fault(number: int, text: str) -> FormatError:
        return FormatError(f"{source}: line {number}: {text}")

    heads: list[tuple[int, str, bool]] = []  # lines above the numbers, and whether each is a comment
    names: list[tuple[str, str]] = []
    findings: list[str] = []
    rows: list[list[float]] = []
    numbers: list[int] = []
    width = count = 0
    said: float | None = None  # how many points the file says that it has
    for number, line in chain(enumerate(map(str.strip, lines), start=1), [(0, "")]):
        if not line and number:
            continue
        if number == 1 and line.startswith(_OURS):
            raise FormatError(f"{source}: holds setpoints, not a path; give it to follow, check or stream")
        if line.startswith(table_text.COMMENTS):
            heads += [] if width else [(number, line.lstrip("#%!/ "), True)]
            continue
        values, decimal = table_text.numbers(line) or ([], False)
        if number and not values and (width or not any(letter.isalpha() for letter in line)):
            raise fault(number, f"expected numbers, got {line[:40]!r}")
        if number and not values:
            heads.append((number, line, False))
            continue
        if len(values) == 1 and not width and said is None:
            said = values[0]
            continue
        if number and not width:
            width, names = len(values), _names(heads, len(values), number, source)
        if number and len(values) != width:
            raise fault(number, f"holds {len(values)} numbers, the lines above {width}")
        if decimal and not findings:
            findings.append(f"line {number}: commas are read as decimal points, {line[:40]!r} as {values}")
        if rows and (not number or len(rows) == most):
            yield _chosen(rows, numbers, names, source, list(findings))
            count += len(rows)
            rows, numbers = [], []
        rows.append(values)
        numbers.append(number)
    if width < 2:
        raise FormatError(f"{source}: no points found; expected one point per line, at least x and y")
    if said not in (None, count):
        raise FormatError(f"{source}: says {said:g} points, but {count} follow; is the file complete?")


def _names(
    heads: list[tuple[int, str, bool]], width: int, number: int, source: str | os.PathLike[str]
) -> list[tuple[str, str]]:
    """Names and units of the columns that the lines above the first point, line `number`, say; empty if none do.

    A comment may be mere words, so that it counts only if it names as many columns as there are.
    """
    remarked: list[tuple[str, str]] = []
    for line, text, remark in heads:
        found, marked = table_text.names(text)
        fits = len(found) == width
        if fits and _named(found):
            if not remark:
                return found
            remarked = remarked or found
        elif not remark and (_named(found) or (marked and fits)):
            raise FormatError(
                f"{source}: line {line}: {text[:40]!r} does not name {width} columns, one of them x or y, "
                f"as line {number} has; name them ({', '.join(AXES)}), or take the line out"
            )
    return remarked


def _chosen(
    rows: list[list[float]],
    numbers: list[int],
    names: list[tuple[str, str]],
    source: str | os.PathLike[str],
    findings: list[str],
) -> Points:
    """The columns that are axes, in mm and rad; FormatError for points that are none."""
    table = np.array(rows)
    given = [name for name, _ in names] or list(AXES[: min(table.shape[1], UNNAMED)])
    twice = [axis for axis in AXES if given.count(axis) > 1]
    if twice:
        raise FormatError(f"{source}: two columns are called {twice[0]}")
    axes = tuple(axis for axis in AXES if axis in given)
    if left := table.shape[1] - len(axes):
        findings.append(f"{left} of {table.shape[1]} columns are not named as axes and are left out")
    points = table[:, [given.index(axis) for axis in axes]]
    for k, axis in enumerate(axes):
        unit = names[given.index(axis)][1] if names else ""
        kind, usual = ("angle", "deg") if axis in ROTARY_AXES else ("length", "mm")
        try:
            points[:, k] *= units.parse(f"1{unit or usual}", kind)
        except UnitError as error:
            raise FormatError(f"{source}: column {axis}: {error}") from None
    bad = ~np.all(np.abs(points) <= MAX_COORDINATE, axis=1)
    if bad.any():
        at = numbers[int(np.argmax(bad))]
        raise FormatError(
            f"{source}: line {at}: is not a finite point within {MAX_COORDINATE:g} mm; is the unit right?"
        )
    return axes, points, findings

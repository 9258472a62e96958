"""Points in a table (.csv, .xyz, ...): measured or scanned, in order, fitted by curves within a tolerance.

docs/formats.md says what a line may be. A line above the numbers may name the columns; one number alone above them is
how many there are. Blank lines part contours, unless they stand between all points.
"""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, islice, zip_longest

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError
from splinefeed.files import table_text
from splinefeed.files.metadata import naming
from splinefeed.files.sizes import MAX_COORDINATE
from splinefeed.files.source import check_size, count_lines, head_text
from splinefeed.files.table_text import AXES, JOINTS, OURS
from splinefeed.paths.fitting import MAX_POINTS
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.records import ROTARY_AXES, Array, IntArray

#: Largest distance between the points and the fitted curve unless the caller says another, mm.
DEFAULT_TOLERANCE = 1e-3
#: Columns without names that are taken: x, y and z.
UNNAMED = 3
#: What lines without numbers consist of, as spreadsheets save empty rows.
BLANK = " \t,;"
#: Points of one part, and the largest table that is read in parts, bytes.
PART = 4096
MAX_BYTES = 2 * 2**30

#: Axes, points (n, axes), mm and rad, findings, and the number of each point's contour (n,).
Points = tuple[tuple[str, ...], Array, list[str], IntArray]


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format.

    That is two lines of as many numbers, two or more, and before them words only.
    """
    counts = []
    for line in head_text(head[:4096]).splitlines():
        if not line.strip(BLANK) or line.lstrip().startswith(table_text.COMMENTS):
            if line.startswith(OURS):
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
    """Read the points in the text of a table as paths of fitted curves, parted at corners.

    Parameters
    ----------
    text : str
        Of the file.
    source : path
        The file, for messages.
    tolerance : float or str, optional
        Largest distance of the fit from the points, mm.
    degree : int, optional
        Of the fit.

    Returns
    -------
    list of Path
        One a contour, mm and rad. Findings have the distance that was measured and everything that the file leaves
        open.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.

    Notes
    -----
    Where the last point is the first one again, the path is closed, smoothly unless there is a corner.
    """
    (axes, points, findings, contours), *more = islice(_blocks(text.splitlines(), MAX_POINTS), 2)
    if more:
        raise InputError(
            f"holds more than {MAX_POINTS} points; thin or split them, or read parts as splinefeed run does"
        )
    if any(axis in ROTARY_AXES for axis in axes):
        findings.append(
            f"rotary axes are fitted with the others, 1 mm of tolerance counting as {math.degrees(1):.3g} deg"
        )
    name = pathlib.Path(source).stem
    sizes = np.bincount(contours)
    parts = np.split(points, np.cumsum(sizes)[:-1]) if sizes.max() > 1 else [points]
    kept = [part for part in parts if len(part) > 1] or parts
    if len(parts) > 1:
        findings.append(f"{len(parts)} contours, parted by blank lines")
    if len(kept) < len(parts):
        findings.append(f"{len(parts) - len(kept)} contour(s) of one point are left out")
    paths = []
    for number, part in enumerate(kept, start=1):
        closed = len(part) > 3 and bool(np.all(part[0] == part[-1]))
        said = [f"{len(part)} points", *findings]
        if closed:
            said.append("the last point is the first one: the path is closed")
        called = name if len(kept) == 1 else f"{name}#{number}"
        paths.append(fitted_path(part, tolerance, axes=axes, name=called, findings=said, degree=degree, closed=closed))
    return paths


def fitted_path(
    points: Array,
    tolerance: float | str,
    *,
    axes: Sequence[str],
    name: str,
    findings: Sequence[str],
    degree: int = 3,
    closed: bool = False,
) -> Path:
    """Fit a path to points, the last finding on the distance of the points.

    Parameters
    ----------
    points : (n, axes) array
        mm and rad.
    tolerance : float or str
        Largest distance of the path from the points, mm.
    axes, name, findings : sequence of str, str, sequence of str
        Of the path.
    degree : int, optional
        Of the curves.
    closed : bool, optional
        Whether the path is closed.

    Returns
    -------
    Path
        Near the points.

    Raises
    ------
    InputError
        For a tolerance that is not above 0.

    Notes
    -----
    The distance is measured by means that the fit does not share, and again where the motion leaves the curves of the
    fit or not all axes are linear.
    """
    from splinefeed.curves.nearest import Nearest
    from splinefeed.curves.tables import arc_pieces
    from splinefeed.paths.fitting import fit

    allowed = positive_length(tolerance, "tolerance")
    made = fit(points, allowed, degree=degree, closed=closed)
    path = Path(made.curves, axes, name=name)
    far = made.error
    if path.linear < len(axes) or any(a is not b for a, b in zip_longest(path.joined, made.curves)):
        places = np.unique(points[:, : path.linear or None], axis=0)  # each is searched once
        flat = replace(path.flat, points=np.ascontiguousarray(path.flat.points[:, : path.linear or None]))
        measured = int(flat.degrees.max()), flat.points.shape[1], flat.points.shape[1], int(flat.rational.max())
        far = float(Nearest(arc_pieces(flat, measured, path.joined).table, measured).find(places)[2].max())
    if far > allowed:
        raise InputError(f"the fit is {far:.6g} mm from a point, not {allowed:g} mm; please report it")
    controls = sum(len(curve.control_points) for curve in made.curves)
    note = (
        f"fitted by {len(made.curves)} curve(s) of degree {degree} with {controls} control points; largest distance of "
        f"a point {max(far, made.error) if path.linear < len(axes) else far:.3g} mm (tolerance {allowed:g} mm)"
    )
    return Path(made.curves, axes, name=name, findings=(*findings, note))


def positive_length(value: float | str, name: str) -> float:
    """Return a length that a caller gives, mm; InputError with its `name` unless it is above 0."""
    length = units.parse(value, "length")
    if length <= 0.0:
        raise InputError(f"{name} is {length:g} mm; it must be greater than 0")
    return length


# --- part by part -----------------------------------------------------------------------------------------------------


def in_parts(file: pathlib.Path) -> PathParts:
    """Read the points in `file`, joined by straight lines, part by part."""
    check_size(file, MAX_BYTES)
    axes, _, findings, _ = next(_parts(file))
    return PathParts(
        name=file.stem, axes=axes, count=count_lines(file), unit="lines", make=partial(_paths, file),
        findings=tuple(findings),
    )  # fmt: skip


def _parts(file: pathlib.Path) -> Iterator[Points]:
    with naming(file), file.open(encoding="utf-8-sig", errors="replace") as stream:
        yield from _blocks(stream, PART)


def _paths(file: pathlib.Path) -> Iterator[Path]:
    """Parts of the path; points that are the same as the one before are left out."""
    before: Array | None = None
    made = False
    for axes, places, _, contours in _parts(file):
        if contours[-1]:
            raise FormatError(
                f"{file}: has contours parted by blank lines, which are not read in parts; make a file of each"
            )
        joined = places if before is None else np.concatenate([before, places])
        joined = joined[np.append(True, np.any(np.diff(joined, axis=0) != 0.0, axis=1))]
        before = joined[-1:].copy()
        if len(joined) > 1:
            made = True
            yield Path.polyline(joined, axes, name=file.stem)
    if not made:
        raise FormatError(f"{file}: holds one point only; a path needs two")


# --- a table ----------------------------------------------------------------------------------------------------------


def _named(names: list[tuple[str, str]]) -> bool:
    return bool({"x", "y", *JOINTS} & {name for name, _ in names})


def _blocks(text: Iterable[str], most: int) -> Iterator[Points]:
    """The points of a table, at most `most` at a time; at least one block, or InputError with the line."""
    every = enumerate(map(str.strip, text), start=1)
    lines = ((number, line) for number, line in every if line.strip(BLANK))
    heads: list[tuple[int, str, bool]] = []  # lines above the numbers, and whether each is a comment
    width = 0
    said: float | None = None  # how many points the file says that it has
    for number, line in lines:
        if number == 1 and line.startswith(OURS):
            raise InputError("holds setpoints, not a path; give it to follow, check or stream")
        comment = line.startswith(table_text.COMMENTS)
        if comment or (not table_text.numbers(line) and any(letter.isalpha() for letter in line)):
            heads.append((number, line.lstrip("#%!/ ") if comment else line, comment))
            continue
        values, _ = _row(line, number)
        if len(values) > 1 or said is not None:
            width = len(values)
            break
        said = values[0]
    if width < 2:
        raise InputError("no points found; expected one point per line, at least x and y")
    names, unit_said = _of_all(*_names(heads, width, number))
    joints = tuple(name for name, _ in names if name in JOINTS)
    columns = table_text.columns(names or [(axis, "") for axis in AXES[: min(width, UNNAMED)]], joints or AXES)
    axes = joints or tuple(axis for axis in AXES if axis in columns)
    if joints and (both := [name for name, _ in names if name in AXES]):
        raise InputError(
            f"names joints ({joints[0]}, ...) and places ({both[0]}); which is the path? Rename the others"
        )
    places, factors = zip(*(columns[axis] for axis in axes), strict=True)
    left = width - len(axes)
    findings = [f"{left} of {width} columns are not named as axes and are left out"] if left else []
    findings += unit_said
    if unsaid := [name for name, unit in names if name in joints and not unit]:
        findings.append(f"joints without a unit are in rad: {', '.join(unsaid)}; name it in the column, as q1 (deg)")
    count, commas = 0, False
    body = _numbered(chain([(number, line)], every))
    while part := list(islice(body, most)):
        rows = []
        for at, row, _ in part:
            values, decimal = _row(row, at)
            if len(values) != width:
                raise InputError(f"line {at}: holds {len(values)} numbers, the lines above {width}")
            if decimal and not commas:
                commas = True
                findings.append(f"line {at}: commas are read as decimal points, {row[:40]!r} as {values}")
            rows.append(values)
        table = np.array(rows)
        if not names and not count:
            findings += _doubts(table, part[0])
        points = table[:, places] * factors
        bad = ~np.all(np.abs(points) <= MAX_COORDINATE, axis=1)
        if bad.any():
            raise InputError(
                f"line {part[np.argmax(bad)][0]}: is not a finite point within {MAX_COORDINATE:g} mm; is the "
                f"unit right?"
            )
        count += len(part)
        yield axes, points, list(findings), np.array([contour for _, _, contour in part])
    if said not in (None, count):
        raise InputError(f"says {said:g} points, but {count} follow; is the file complete?")


def _of_all(names: list[tuple[str, str]], marked: bool) -> tuple[list[tuple[str, str]], list[str]]:
    """The names, and what is to be said of units that not all places have.

    Behind names without marks between them, `x y z [m]`, a unit is that of all places.
    """
    places = [(name, unit) for name, unit in names if name in AXES and name not in ROTARY_AXES]
    unit = places[-1][1] if places else ""
    if unit and len(places) > 1 and not marked and not any(each for _, each in places[:-1]):
        named = [name for name, _ in places]
        every = [(name, unit if name in named else own) for name, own in names]
        return every, [f"the unit behind the last name, {unit}, is taken for {', '.join(named)}"]
    without = [name for name, each in places if not each]
    mixed = 0 < len(without) < len(places)
    return names, [f"columns without a unit beside others with one are in mm: {', '.join(without)}"] * mixed


def _numbered(lines: Iterable[tuple[int, str]]) -> Iterator[tuple[int, str, int]]:
    """Lines of numbers with their number and that of their contour: blank lines, marks alone too, part contours."""
    contour, blank, begun = 0, False, False
    for at, row in lines:
        if not row.strip(BLANK):
            blank = begun
        elif not row.startswith(table_text.COMMENTS):
            contour, blank, begun = contour + blank, False, True
            yield at, row, contour


def _doubts(table: Array, first: tuple[int, str, int]) -> list[str]:
    """What a table without names may mean otherwise: InputError where that is another table altogether."""
    at, row, _ = first
    whole = bool(np.all(table == np.round(table))) and not any(mark in row for mark in ".;\t")
    if whole and "," in row and table.shape[1] in (4, 6) and not np.any(np.signbit(table[:, 1::2])):
        raise InputError(
            f"line {at}: {row[:40]!r} may have commas as decimal points and between numbers; write decimal points, "
            "semicolons between numbers, or a line of names above (x,y,z,...)"
        )
    if table.shape[1] > 2 and len(table) > 2 and bool(np.all(np.diff(table[:, 0]) == 1.0)):
        return ["column 1 counts by 1 and is read as x; if it only numbers the points, name the columns (n,x,y,...)"]
    return []


def _row(line: str, number: int) -> tuple[list[float], bool]:
    found = table_text.numbers(line)
    if found is None:
        raise InputError(f"line {number}: expected numbers, got {line[:40]!r}")
    return found


def _names(heads: list[tuple[int, str, bool]], width: int, number: int) -> tuple[list[tuple[str, str]], bool]:
    """Names and units of the columns that the lines above the first point, line `number`, say; empty if none do.

    And whether marks stand between them.

    A comment may be mere words, so that it counts only if it names as many columns as there are.
    """
    remarked: tuple[list[tuple[str, str]], bool] = [], False
    for line, text, remark in heads:
        found, marked = table_text.names(text)
        fits = len(found) == width
        if fits and _named(found):
            if not remark:
                return found, marked
            remarked = remarked if remarked[0] else (found, marked)
        elif not remark and (_named(found) or (marked and fits)):
            raise InputError(
                f"line {line}: {text[:40]!r} does not name {width} columns, one of them x, y or a joint (q1), "
                f"as line {number} has; name them ({', '.join(AXES)}), or take the line out"
            )
    return remarked

"""Airfoil sections (.dat): points in Selig or Lednicer order, of unit chord, scaled and fitted within a tolerance.

Selig: from the trailing edge over the upper side to the nose and back below. Lednicer: two counts, then each side from
the nose to the trailing edge. A name may stand in the first line.
"""

from __future__ import annotations

import math
import os
import pathlib
import re

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError
from splinefeed.formats import table_text
from splinefeed.formats.fitted import fitted_path
from splinefeed.formats.sizes import MAX_COORDINATE
from splinefeed.formats.source import head_text
from splinefeed.geometry.path import Path
from splinefeed.records import Array

#: Chord that a section gets unless the caller says another, mm.
DEFAULT_CHORD = 100.0
#: Largest distance between the given points and the fitted curve unless the caller says another, mm.
DEFAULT_TOLERANCE = 1e-3
#: Ends of a section may lie this far apart along the chord, in chords; more means that points are missing.
MAX_END_DIFFERENCE = 0.02
#: The chord in the file may differ by this much from 1 before it is worth a finding.
UNIT_CHORD_SLACK = 0.02
#: A word that is no slip in a number.
_WORDS = re.compile(r"[^\W\d_]{3}")
#: Fewer points than this are no section.
LEAST_POINTS = 5
#: More points than this are no section but a scan of one; published sections have some hundreds.
MAX_AIRFOIL_POINTS = 20_000
#: A section of unit chord is nowhere farther from 0 than this along the chord; one in percent is.
_PERCENT = 2.0
#: How far points of a section may lie before its nose or behind its trailing edge, in chords.
_BEYOND = 0.1
#: How many repeated points a finding names.
_NAMED_REPEATS = 3


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: a flat section of unit chord, or in percent of it, behind a name at most.

    Its points begin at the trailing edge, or at the nose and end there, or two counts stand before them. Any other two
    columns are points in mm, which `points` reads.
    """
    lines = [line for line in head_text(head).splitlines() if line.strip()]
    if all(_pair(line) is None for line in lines[:2]):
        return False
    rows = np.array([pair for pair in map(_pair, lines[:MAX_AIRFOIL_POINTS]) if pair is not None])
    counted = _counts(*rows[0])
    x, y = rows[int(counted) :].T
    if len(x) < 2:
        return False
    span = 100.0 if np.max(np.abs(x)) > _PERCENT else 1.0
    if not (np.all((x >= -_BEYOND * span) & (x <= (1.0 + _BEYOND) * span)) and np.max(np.abs(y)) <= 0.5 * span):
        return False
    back = 0.9 * span
    return bool((counted and x[0] <= 0.1 * span) or x[0] >= back or max(x[0], x[-1]) <= 0.1 * span < back <= np.max(x))


def from_text(
    text: str,
    source: str | os.PathLike[str],
    *,
    chord: float | str = DEFAULT_CHORD,
    tolerance: float | str = DEFAULT_TOLERANCE,
    degree: int = 3,
) -> list[Path]:
    """The section in `text`, x and y in mm, as one path; `chord` is the length of one unit of the file, mm.

    `tolerance` is the largest distance, mm, of a fit of the given `degree` from the points; the path's findings report
    the distance reached, and everything that the file leaves open.
    """
    scale, allowed = _positive(chord, "chord"), _positive(tolerance, "tolerance")
    name, rows, remarks = _rows(text, source)
    points, lines, order = _in_order(rows, source)
    findings = [f"{order} order, {len(points)} points; 1 unit of the file is {scale:g} mm (option chord)", *remarks]
    points, repeats = _without_repeats(points, lines)
    findings += repeats
    _check_section(points, source)
    span = float(np.ptp(points[:, 0]))
    if abs(span - 1.0) > UNIT_CHORD_SLACK:
        findings.append(f"the chord is {span:g} in the file, not 1, so the section is {span * scale:g} mm long")
    points = points * scale
    if np.max(np.abs(points)) > MAX_COORDINATE:
        raise FormatError(f"{source}: the section is larger than {MAX_COORDINATE:g} mm; give a smaller chord")
    gap = float(np.linalg.norm(points[-1] - points[0]))
    if gap > 0.0:
        findings.append(f"the trailing edge is open by {gap:.6g} mm; it is left open")
    said = name or pathlib.Path(source).stem
    return [fitted_path(points, allowed, source, axes=("x", "y"), name=said, findings=findings, degree=degree)]


def _positive(value: float | str, name: str) -> float:
    length = units.parse(value, "length")
    if length <= 0.0:
        raise InputError(f"{name} is {length:g} mm; it must be greater than 0")
    return length


def _pair(line: str) -> tuple[float, float] | None:
    """The two numbers of a line; None if it holds something else."""
    found = table_text.numbers(line)
    return None if found is None or len(found[0]) != 2 else (found[0][0], found[0][1])


def _counts(first: float, second: float) -> bool:
    """Whether two numbers are how many points each side has, as Lednicer's order says before them."""
    return first >= 2.0 and second >= 2.0 and first.is_integer() and second.is_integer()


def _rows(text: str, source: str | os.PathLike[str]) -> tuple[str, list[tuple[int, float, float]], list[str]]:
    """The name of the section, line number, x and y of every line with numbers, and a finding on words behind them."""
    name, behind = "", 0
    rows: list[tuple[int, float, float]] = []
    first = True
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        pair = _pair(line)
        if pair is None and first:
            name = " ".join(line.split())[:80]
        elif behind or (pair is None and len(rows) >= LEAST_POINTS and _WORDS.search(line)):
            behind = behind or number  # collections put sources and coefficients there
            if pair is not None:
                raise FormatError(f"{source}: line {number}: holds a point, but line {behind} above it is text")
        elif pair is None:
            raise FormatError(f"{source}: line {number}: expected two numbers x y, got {line.strip()[:40]!r}")
        elif not (math.isfinite(pair[0]) and math.isfinite(pair[1])):
            raise FormatError(f"{source}: line {number}: {line.strip()[:40]!r} is not a finite point")
        else:
            rows.append((number, *pair))
        first = False
    if len(rows) > MAX_AIRFOIL_POINTS:
        raise FormatError(f"{source}: has {len(rows)} points; at most {MAX_AIRFOIL_POINTS} can be read")
    if len(rows) < LEAST_POINTS:
        raise FormatError(f"{source}: has {len(rows)} point(s); a section needs at least {LEAST_POINTS}")
    return name, rows, [f"text behind the points, from line {behind} on, is left out"] if behind else []


def _in_order(rows: list[tuple[int, float, float]], source: str | os.PathLike[str]) -> tuple[Array, list[int], str]:
    """Points (n, 2) from the trailing edge over the nose and back, their line numbers, and the order of the file."""
    number, first, second = rows[0]
    if not _counts(first, second):
        return np.array([row[1:] for row in rows]), [row[0] for row in rows], "Selig"
    upper, lower = int(first), int(second)
    if upper + lower != len(rows) - 1:
        raise FormatError(
            f"{source}: line {number}: says {upper} and {lower} points, but {len(rows) - 1} follow; "
            f"is the file complete?"
        )
    sides = rows[1 : upper + 1], rows[upper + 1 :]
    for side, title in zip(sides, ("upper", "lower"), strict=True):
        if not side[0][1] < side[-1][1]:
            raise FormatError(f"{source}: line {side[0][0]}: the {title} side does not run from the nose backwards")
    ordered = [*reversed(sides[0]), *sides[1]]
    if ordered[upper - 1][1:] == ordered[upper][1:]:
        del ordered[upper]  # each side begins with the nose
    return np.array([row[1:] for row in ordered]), [row[0] for row in ordered], "Lednicer"


def _without_repeats(points: Array, lines: list[int]) -> tuple[Array, list[str]]:
    """The points without those that repeat the one before, and a finding that names their lines."""
    repeats = np.flatnonzero(np.all(points[1:] == points[:-1], axis=1)) + 1
    if not repeats.size:
        return points, []
    named = ", ".join(str(lines[i]) for i in repeats[:_NAMED_REPEATS])
    more = f" and {repeats.size - _NAMED_REPEATS} more" if repeats.size > _NAMED_REPEATS else ""
    return np.delete(points, repeats, axis=0), [f"repeated points are left out: line {named}{more}"]


def _check_section(points: Array, source: str | os.PathLike[str]) -> None:
    """FormatError unless the points run from the trailing edge to a nose and back."""
    if len(points) < LEAST_POINTS:
        raise FormatError(f"{source}: has {len(points)} different point(s); a section needs at least {LEAST_POINTS}")
    x = points[:, 0]
    span, nose = float(np.ptp(x)), float(np.min(x))
    if not 0.0 < span <= MAX_COORDINATE:
        raise FormatError(f"{source}: the chord in the file is {span:g}; that is not a section")
    if x[0] - nose < 0.5 * span:
        raise FormatError(f"{source}: begins at x = {x[0]:g}, at its nose; points must begin at the trailing edge")
    if abs(x[-1] - x[0]) > MAX_END_DIFFERENCE * span:
        raise FormatError(
            f"{source}: begins at x = {x[0]:g} but ends at x = {x[-1]:g}; points are missing, is the file complete?"
        )

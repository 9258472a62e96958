"""Airfoil sections (.dat): points in Selig or Lednicer order, of unit chord, scaled and fitted within a tolerance.

Selig: from the trailing edge over the upper side to the nose and back below. Lednicer: two counts, then each side from
the nose to the trailing edge. A name may stand in the first line.
"""

from __future__ import annotations

import os
import pathlib
import re

import numpy as np

from splinefeed.errors import InputError
from splinefeed.files import table_text
from splinefeed.files.sizes import MAX_COORDINATE
from splinefeed.files.source import head_text
from splinefeed.formats.points import DEFAULT_TOLERANCE, fitted_path, positive_length
from splinefeed.paths.path import Path
from splinefeed.records import Array

#: Chord that a section gets unless the caller says another, mm.
DEFAULT_CHORD = 100.0
#: Ends of a section may lie this far apart along the chord, in chords; more means that points are missing.
MAX_END_DIFFERENCE = 0.02
#: The chord in the file may differ by this much from 1 before it is worth a finding.
UNIT_CHORD_SLACK = 0.02
#: A word that is no slip in a number.
_WORDS = re.compile(r"[^\W\d_]{3}")
#: Fewer points than this are no section; more are no section but a scan of one: published ones have some hundreds.
LEAST_POINTS, MAX_AIRFOIL_POINTS = 5, 20_000
#: Most lines of a file, blank ones and words behind the points included.
MAX_LINES = 4 * MAX_AIRFOIL_POINTS
#: A section of unit chord is nowhere farther from 0 than this along the chord; one in percent is.
_PERCENT = 2.0
#: How far points of a section may lie before its nose or behind its trailing edge, in chords.
_BEYOND = 0.1


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like this format.

    That is a flat section of unit chord, or in percent of it, behind a name at most. Its points begin at the trailing
    edge, or at the nose and end there, or two counts stand before them. Any other two columns are points in mm, which
    `points` reads.
    """
    lines = [line for line in head_text(head).splitlines() if line.strip()][:MAX_AIRFOIL_POINTS]
    pairs = [_pair(line) for line in lines]
    rows = np.array([pair for pair in pairs if pair is not None]).reshape(-1, 2)
    if not any(pairs[:2]) or len(rows) < 3:
        return False
    counted = _counts(rows[0])
    x, y = rows[int(counted) :].T
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
    """Read the section in the text of an airfoil file as one path.

    Parameters
    ----------
    text : str
        Of the file.
    source : path
        The file, for messages.
    chord : float or str, optional
        Length of one unit of the file, mm.
    tolerance : float or str, optional
        Largest distance of the fit from the points, mm.
    degree : int, optional
        Of the fit.

    Returns
    -------
    list of Path
        One, x and y in mm. Its findings have the distance reached, and everything that the file leaves open.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    scale = positive_length(chord, "chord")
    name, rows, lines, remarks = _rows(text)
    points, order = _in_order(rows, lines)
    findings = [f"{order} order, {len(points)} points; 1 unit of the file is {scale:g} mm (option chord)", *remarks]
    repeated = np.append(False, np.all(points[1:] == points[:-1], axis=1))
    if repeated.any():
        points = points[~repeated]
        findings.append(f"repeated points are left out: {np.count_nonzero(repeated)}")
    span = _checked_span(points)
    if abs(span - 1.0) > UNIT_CHORD_SLACK:
        findings.append(f"the chord is {span:g} in the file, not 1, so the section is {span * scale:g} mm long")
    points = points * scale
    if np.max(np.abs(points)) > MAX_COORDINATE:
        raise InputError(f"the section is larger than {MAX_COORDINATE:g} mm; give a smaller chord")
    gap = float(np.linalg.norm(points[-1] - points[0]))
    if gap > 0.0:
        findings.append(f"the trailing edge is open by {gap:.6g} mm; it is left open")
    said = name or pathlib.Path(source).stem
    return [fitted_path(points, tolerance, axes=("x", "y"), name=said, findings=findings, degree=degree)]


def _pair(line: str) -> tuple[float, float] | None:
    """The two numbers of a line; None if it holds something else."""
    found = table_text.numbers(line)
    return None if found is None or len(found[0]) != 2 else (found[0][0], found[0][1])


def _counts(row: Array) -> bool:
    """Whether two numbers are how many points each side has, as Lednicer's order says before them."""
    return bool(np.all(row >= 2.0) and np.all(row == np.floor(row)))


def _rows(text: str) -> tuple[str, Array, list[int], list[str]]:
    """The name of the section, x and y (n, 2) and the number of every line with numbers, and a finding on words behind.

    Collections put sources and coefficients behind the points.
    """
    if (count := text.count("\n")) > MAX_LINES:
        raise InputError(f"has {count} lines; a section has {LEAST_POINTS} to {MAX_AIRFOIL_POINTS} points")
    lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    name = "" if not lines or _pair(lines[0][1]) else " ".join(lines.pop(0)[1].split())[:80]
    pairs = [_pair(line) for _, line in lines]
    words = (k for k, (_, line) in enumerate(lines) if k >= LEAST_POINTS and not pairs[k] and _WORDS.search(line))
    end = next(words, len(lines))
    for k, (number, line) in enumerate(lines):
        if k > end and pairs[k]:
            raise InputError(f"line {number}: holds a point, but line {lines[end][0]} above it is text")
        if k < end and not np.isfinite(pairs[k] or (np.nan,)).all():
            raise InputError(f"line {number}: expected two finite numbers x y, got {line[:40]!r}")
    if not LEAST_POINTS <= end <= MAX_AIRFOIL_POINTS:
        raise InputError(f"has {end} points; a section has {LEAST_POINTS} to {MAX_AIRFOIL_POINTS}")
    behind = [f"text behind the points, from line {number} on, is left out" for number, _ in lines[end : end + 1]]
    return name, np.array(pairs[:end]), [number for number, _ in lines], behind


def _in_order(rows: Array, lines: list[int]) -> tuple[Array, str]:
    """Points (n, 2) from the trailing edge over the nose and back, and the order of the file."""
    if not _counts(rows[0]):
        return rows, "Selig"
    upper, lower = map(int, rows[0].tolist())
    if upper + lower != len(rows) - 1:
        raise InputError(
            f"line {lines[0]}: says {upper} and {lower} points, but {len(rows) - 1} follow; is the file complete?"
        )
    sides = rows[1 : upper + 1], rows[upper + 1 :]
    for side, first in zip(sides, (lines[1], lines[upper + 1]), strict=True):
        if not side[0, 0] < side[-1, 0]:
            raise InputError(f"line {first}: the side does not run from the nose backwards")
    shared = int(np.array_equal(sides[0][0], sides[1][0]))  # each side begins with the nose
    return np.concatenate([sides[0][::-1], sides[1][shared:]]), "Lednicer"


def _checked_span(points: Array) -> float:
    """The chord in the file; InputError unless the points run from the trailing edge to a nose and back."""
    x = points[:, 0]
    span, nose = float(np.ptp(x)), float(np.min(x))
    if len(points) < LEAST_POINTS or not 0.0 < span <= MAX_COORDINATE:
        raise InputError(f"{len(points)} different point(s) along a chord of {span:g} in the file are not a section")
    if x[0] - nose < 0.5 * span:
        raise InputError(f"begins at x = {x[0]:g}, at its nose; points must begin at the trailing edge")
    if abs(x[-1] - x[0]) > MAX_END_DIFFERENCE * span:
        raise InputError(f"begins at x = {x[0]:g} but ends at x = {x[-1]:g}; points are missing, is the file complete?")
    return span

"""A program as a path: one curve a move, with its feed, its tolerance and what stands between the moves.

Where the tool is when a program starts is not known. Rapid moves that only lead to the first place are left out: the
path begins where every axis that moves has been stated. Axes that a feed move needs before that are taken to be at 0.
With `start` the path begins there, and nothing is left out.
"""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Mapping, Sequence

import numpy as np

from splinefeed.errors import CurveError, FormatError, InputError
from splinefeed.formats.contents import Contents
from splinefeed.formats.gcode import arcs as arc_maker
from splinefeed.formats.gcode.dialects import named
from splinefeed.formats.gcode.moves import (
    AXES,
    LETTERS,
    LINE,
    PATH_ORDER,
    RAPID,
    ROTARY,
    SPLINE,
    Findings,
    Moves,
    Spline,
)
from splinefeed.formats.gcode.offsets import SYSTEMS
from splinefeed.formats.gcode.reader import Reading, joined
from splinefeed.formats.gcode.state import UNSAID
from splinefeed.geometry.curve import MAX_AXES, NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS, Lines
from splinefeed.geometry.path import Marker, Path
from splinefeed.kernels import gcode as layout
from splinefeed.records import Array, IntArray

#: Most moves of a program that becomes a path; `summary` knows no such bound.
MAX_MOVES = 1_000_000
#: A move no longer than this, mm or rad, is none.
NO_LENGTH = 1e-9
_LINEAR = [column for column in range(AXES) if column not in ROTARY]


def from_file(
    file: pathlib.Path,
    *,
    dialect: str | None = None,
    start: str | Sequence[float] | None = None,
    offsets: str | Mapping[str, Sequence[float]] | None = None,
    repair: bool = False,
) -> list[Path]:
    """The path of the program in `file`.

    dialect  one of `dialects.DIALECTS`, told by the content if not given
    start    where the tool is before the first line, X,Y,Z,A,B,C,U,V,W in mm and degrees (fewer will do)
    offsets  of coordinate systems, in mm and degrees: {"G54": (x, y, z)} or "G54=x,y,z;G55=x,y,z"

    With `repair` arcs that miss their circle become spirals, and codes that cannot be read are left out, with findings.
    Raises FormatError that names the line.
    """
    reading = reading_of(dialect, start, offsets, repair)
    moves = read_moves(reading, file)
    if not len(moves):
        raise FormatError(f"{file}: no line of it moves an axis")
    path = to_path(moves, reading, file, keep_start=start is not None)
    return Contents([path], units="in" if reading.inch else "mm")


def reading_of(
    dialect: str | None,
    start: str | Sequence[float] | None,
    offsets: str | Mapping[str, Sequence[float]] | None,
    repair: bool,
) -> Reading:
    """How to read a program, from the options of `from_file`; InputError for one that is wrong."""
    return Reading(
        dialect=None if dialect is None else named(dialect),
        offsets=parse_offsets(offsets),
        start=np.zeros(AXES) if start is None else _place(start, "start"),
        repair=repair,
    )


def read_moves(reading: Reading, file: str | os.PathLike[str], most: int = MAX_MOVES) -> Moves:
    """All moves of a program; FormatError for the first line that is wrong, or more than `most` moves."""
    parts: list[Moves] = []
    count = 0
    try:
        for part in reading.moves(file):
            parts.append(part)
            count += len(part)
            if count > most:
                raise FormatError(
                    f"{file}: has more than {most} moves; split it, look at it with info, or run it --by-windows"
                )
    except FormatError:
        for part in parts:  # an arc before that line is wrong first
            find_arcs(part, file, Findings(), reading.repair)
        raise
    return joined(parts)


def find_arcs(moves: Moves, file: str | os.PathLike[str], findings: Findings, repair: bool) -> arc_maker.Arcs:
    """`arcs.find_arcs` with the file's name in its error."""
    try:
        return arc_maker.find_arcs(moves, findings, repair)
    except arc_maker.ArcError as missed:
        raise FormatError(f"{file}: line {missed.line}: {missed}") from None


def to_path(moves: Moves, reading: Reading, file: str | os.PathLike[str], *, keep_start: bool = False) -> Path:
    """The path of all moves; FormatError where there is none."""
    findings = reading.findings
    columns = path_columns(moves.used, file)
    arcs = find_arcs(moves, file, findings, reading.repair)
    first = 0 if keep_start else leading(moves, columns, findings)
    kept, points = with_length(moves, first, columns, findings)
    if not len(kept):
        raise FormatError(f"{file}: no move of it has a length; is the program complete?")
    curves = curves_of(moves, arcs, kept, points, columns, file)
    feeds = feeds_of(moves, arcs, kept, findings)
    tolerances, said = tolerances_of(moves, kept)
    axes = [LETTERS[column].lower() for column in columns]
    try:
        return Path(
            curves,
            axes,
            name=pathlib.Path(file).stem,
            findings=findings.all(),
            feeds=feeds,
            tolerances=tolerances if said else None,
            markers=markers_of(moves, kept),
        )
    except CurveError as error:
        raise FormatError(f"{file}: {error}") from None


def path_columns(used: int, file: str | os.PathLike[str]) -> IntArray:
    """Columns of the axes that the program moves, in the order of a path."""
    columns = np.array([column for column in PATH_ORDER if used >> column & 1], dtype=np.int64)
    if len(columns) > MAX_AXES:
        names = " ".join(LETTERS[column] for column in columns)
        raise FormatError(f"{file}: moves the {len(columns)} axes {names}; a path has at most {MAX_AXES}")
    return columns


def leading(moves: Moves, columns: IntArray, findings: Findings) -> int:
    """How many rapid moves at the beginning only lead to the first place; a finding says so."""
    stated = moves.codes[:, layout.AXES] >> layout.STATED
    needed = sum(1 << int(column) for column in columns)
    known = 0
    for i in range(len(moves)):
        if known & needed == needed:
            break
        if moves.kind[i] != RAPID or not stated[i]:
            missing = " ".join(LETTERS[c] for c in columns if not known >> int(c) & 1)
            findings.say(
                f"line {moves.line[i]}: where {missing} is before this move is not said: taken as 0 "
                "in the program's first coordinate system (start=)"
            )
            return i if i and known else 0
        known |= int(stated[i])
    else:
        return 0  # rapid moves alone: all of them are the path
    if i:
        findings.say(f"{i} rapid move(s) to the first place, up to line {moves.line[i - 1]}, are left out (start=)")
    return i


def with_length(moves: Moves, first: int, columns: IntArray, findings: Findings) -> tuple[IntArray, Array]:
    """Numbers of the moves from `first` on that have a length, and the places (n + 1, 9) between them."""
    starts, ends = moves.starts, moves.ends
    step = np.max(np.abs(ends - starts)[:, columns], axis=1)
    straight = (moves.kind == RAPID) | (moves.kind == LINE)
    none = straight & (step <= NO_LENGTH)
    for i in np.flatnonzero(moves.kind == SPLINE).tolist():
        points = moves.splines[int(moves.codes[i, layout.SPLINE])].points
        none[i] = float(np.max(np.ptp(points, axis=0))) <= NO_LENGTH
    none[:first] = False
    for line in moves.line[none].tolist():
        findings.count("{count} move(s) without length are left out", line)
    kept = np.flatnonzero(~none & (np.arange(len(moves)) >= first))
    places = np.concatenate([starts[first : first + 1], ends[kept]])
    return kept, places


def curves_of(
    moves: Moves, arcs: arc_maker.Arcs, kept: IntArray, points: Array, columns: IntArray, file: str | os.PathLike[str]
) -> Sequence[NurbsCurve]:
    """One curve a move, each from where the one before ends."""
    number_of_arc = {int(move): i for i, move in enumerate(arcs.move)}
    flat = points[:, columns]
    if np.all(moves.kind[kept] <= LINE):
        return Lines(flat)
    curves = []
    for n, i in enumerate(kept.tolist()):
        kind, line = int(moves.kind[i]), int(moves.line[i])
        try:
            if kind == SPLINE:
                spline = moves.splines[int(moves.codes[i, layout.SPLINE])]
                places = spline.points.copy()
                places[0] = points[n]
                curves.append(NurbsCurve(spline.degree, spline.knots, places[:, columns], spline.weights))
            elif i in number_of_arc:
                curves.append(arc_maker.arc_curve(points[n], points[n + 1], arcs, number_of_arc[i], columns))
            else:
                curves.append(NurbsCurve.trusted(1, LINE_KNOTS, flat[n : n + 2]))
        except CurveError as error:
            raise FormatError(f"{file}: line {line}: {error}") from None
    return curves


def feeds_of(moves: Moves, arcs: arc_maker.Arcs, kept: IntArray, findings: Findings) -> Array:
    """Feeds (n,), mm/s: infinite for rapid moves, and for those before any F, with a finding."""
    feeds = programmed_feeds(moves, lengths(moves, arcs))[kept]
    unsaid = (feeds <= 0.0) & (moves.kind[kept] != RAPID)
    for line in moves.line[kept[unsaid]].tolist():
        findings.count("moves without a feed before them (F) run as fast as the limits allow", line)
    return np.where(unsaid | (moves.kind[kept] == RAPID), math.inf, feeds)


def tolerances_of(moves: Moves, kept: IntArray) -> tuple[Array, bool]:
    """How far each move may be smoothed (n,), mm, 0 where nothing is said; and whether anything is."""
    tolerances = moves.values[kept, layout.ROW_TOLERANCE]
    said = tolerances != UNSAID
    return np.where(said, tolerances, 0.0), bool(said.any())


def programmed_feeds(moves: Moves, length: Array) -> Array:
    """Feeds (n,) as the program says them, mm/s, or deg/s where rotary axes move alone; 0 where it says none.

    length  (n,) of the moves, for feeds by inverse time: F is one over the minutes that the move takes
    """
    feeds = moves.values[:, layout.ROW_FEED] / 60.0
    inverse = moves.flags & layout.INVERSE_FEED != 0
    feeds = np.where(inverse, feeds * length, feeds)
    step = moves.ends - moves.starts
    turns = (moves.kind <= LINE) & np.all(step[:, _LINEAR] == 0.0, axis=1) & ~inverse
    inch = turns & (moves.flags & layout.INCH != 0)
    return np.where(inch, feeds / 25.4, feeds)


def straight_lengths(step: Array) -> Array:
    """Lengths (n,) of straight moves by (n, 9), mm, or degrees where rotary axes move alone."""
    length: Array = np.linalg.norm(step[:, _LINEAR], axis=1)
    turned = np.rad2deg(np.linalg.norm(step[:, list(ROTARY)], axis=1))
    return np.where(length > 0.0, length, turned)


def lengths(moves: Moves, arcs: arc_maker.Arcs) -> Array:
    """Lengths (n,) of all moves as `Path` counts them; splines by their arc-length tables."""
    found = straight_lengths(moves.ends - moves.starts)
    found[arcs.move] = arc_maker.arc_lengths(moves, arcs)
    for i in np.flatnonzero(moves.kind == SPLINE).tolist():
        path = spline_path(moves.splines[int(moves.codes[i, layout.SPLINE])])
        found[i] = 0.0 if path is None else path.length
    return found


def spline_path(spline: Spline) -> Path | None:
    """A spline over the linear axes that it moves; None if there are none."""
    moving = [column for column in _LINEAR if np.ptp(spline.points[:, column]) > 0.0]
    if not moving:
        return None
    curve = NurbsCurve(spline.degree, spline.knots, spline.points[:, moving], spline.weights)
    return Path([curve], [LETTERS[column].lower() for column in moving])


def markers_of(moves: Moves, kept: IntArray) -> list[Marker]:
    """What stands between the curves: M, S, T and dwells, and the exact stops of G61.1."""
    places = np.searchsorted(kept, [mark.move for mark in moves.marks]).tolist()
    markers = [Marker(place, mark.text, mark.dwell, mark.stop) for place, mark in zip(places, moves.marks, strict=True)]
    stops = np.flatnonzero(moves.flags[kept[:-1]] & layout.STOPS) + 1  # at the end it rests anyway
    return markers + [Marker(int(place), "", 0.0, True) for place in stops]


def parse_offsets(given: str | Mapping[str, Sequence[float]] | None) -> dict[int, Array]:
    """Offsets (9,) in mm and rad by number of the coordinate system; InputError for what is none."""
    if given is None:
        return {}
    if isinstance(given, str):
        pairs = [each.partition("=") for each in given.split(";") if each.strip()]
        given = {name.strip(): _numbers(text, f"offsets: {name.strip()}") for name, _, text in pairs}
    known = {f"G{code / 10:g}": number for code, number in SYSTEMS.items()}
    for name in given:
        if name.upper() not in known:
            raise InputError(f"offsets: {name!r} is no coordinate system; there are {', '.join(known)}")
    return {known[name.upper()]: _place(values, f"offsets: {name}") for name, values in given.items()}


def _numbers(text: str, name: str) -> list[float]:
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        raise InputError(f"{name}: {text[:40]!r} is no list of numbers; write for example 10,20,0") from None


def _place(given: str | Sequence[float], name: str) -> Array:
    """A place (9,) in mm and rad from X,Y,Z,A,B,C,U,V,W in mm and degrees."""
    values = _numbers(given, name) if isinstance(given, str) else [float(each) for each in given]
    if not 1 <= len(values) <= AXES or not all(abs(value) <= layout.LARGEST for value in values):
        raise InputError(f"{name}: 1 to {AXES} numbers are needed, in the order {' '.join(LETTERS)}, got {values}")
    place = np.zeros(AXES)
    place[: len(values)] = values
    place[list(ROTARY)] = np.deg2rad(place[list(ROTARY)])
    return place

"""A program as a path: one curve a move, with its feed, its tolerance and what stands between the moves.

Where the tool is when a program starts is not known. Rapid moves that only lead to the first place are left out: the
path begins where every axis that moves has been stated. Axes that a feed move needs before that are taken to be at 0.
With `start` the path begins there, and nothing is left out. What moves mean is said here once: `Program.pieces` hands
them out with all that a path, its parts (`in_parts`) and `overview` need of them.
"""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, FormatError, InputError
from splinefeed.formats.contents import Contents
from splinefeed.formats.gcode import arcs as arc_maker
from splinefeed.formats.gcode import layout, tool_paths
from splinefeed.formats.gcode.dialects import named
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import (
    AXES,
    LETTERS,
    LINE,
    LINEAR,
    PATH_ORDER,
    RAPID,
    ROTARY,
    SPLINE,
    Findings,
    Moves,
)
from splinefeed.formats.gcode.offsets import REFERENCES, SYSTEMS
from splinefeed.formats.gcode.reader import Reading, joined
from splinefeed.formats.gcode.state import UNSAID
from splinefeed.formats.gcode.tools import Tools, read_tools
from splinefeed.formats.path_parts import PathParts
from splinefeed.formats.sizes import MAX_MOVES
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS, Lines
from splinefeed.geometry.path import Marker, Path
from splinefeed.records import Array, BoolArray, IntArray

#: Moves of one part.
PART = 4096
#: A move no longer than this, mm or rad, is none.
NO_LENGTH = 1e-9


def from_file(
    file: pathlib.Path,
    *,
    dialect: str | None = None,
    start: str | Sequence[float] | None = None,
    offsets: str | Mapping[str, Sequence[float]] | None = None,
    tools: str | os.PathLike[str] | Tools | None = None,
    from_line: int | str | None = None,
    repair: bool = False,
) -> list[Path]:
    """The path of the program in `file`.

    dialect  one of `dialects.DIALECTS`, recognized by the content if not given
    start    where the tool is before the first line, X,Y,Z,A,B,C,U,V,W in mm and degrees (fewer will do)
    offsets  of coordinate systems, in mm and degrees: {"G54": (x, y, z)} or "G54=x,y,z;G55=x,y,z"; places of G28, G30
    tools    a tool table, LinuxCNC's .tbl or .toml: then G43 shifts the path by the length of the tool
    from_line  number of the line at which the program is resumed, as it is there when it is first carried out

    With `repair` arcs that miss their circle become spirals, and codes that cannot be read are left out, with findings.
    Raises FormatError that names the line.
    """
    program = Program(file, dialect, start, offsets, tools, repair, from_line)
    reading = program.reading()
    moves = program.all_moves(reading)
    if np.any(moves.flags & layout.TIP):
        return Contents(program.tool_paths(moves, reading), units="in" if reading.inch else "mm")
    columns = path_columns(moves.used, file)
    (piece,) = program.pieces([moves], reading, columns, max(len(moves), 1))
    if not len(piece.kept):
        raise FormatError(f"{file}: no move has a length; is the program complete?")
    tolerances, said = piece.tolerances
    path = piece.path(tolerances if said else None, piece.markers, reading.findings)
    return Contents([path], units="in" if reading.inch else "mm")


def in_parts(file: pathlib.Path, **options: Any) -> PathParts:
    """The program in `file`, of any length, as parts of its path, with the options of `from_file`.

    It is looked through twice before: for its axes, and for its feeds. So a faulty line is reported before anything is
    made of the lines above it.
    """
    program = Program(file, **options)
    used = 0
    for moves in program.reading().moves(file):
        used |= moves.used
        if len(tip := np.flatnonzero(moves.flags & layout.TIP)):
            raise FormatError(
                f"{file}: line {moves.line[tip[0]]}: X, Y and Z are the tool's tip; such a program is read as a "
                "whole, not by windows"
            )
    columns = path_columns(used, file)
    reading = program.reading()
    any_length, count, top, rapid, tolerance, said = False, 0, 0.0, False, 0.0, False
    for piece in program.pieces(reading.moves(file), reading, columns):
        any_length, count = any_length or len(piece.kept) > 0, count + len(piece.moves)
        known = piece.feeds[np.isfinite(piece.feeds)]
        top = max(top, float(np.max(known, initial=0.0)))
        rapid |= len(known) < len(piece.feeds)
        tolerances, any_said = piece.tolerances
        tolerance, said = max(tolerance, float(np.max(tolerances, initial=0.0))), said or any_said
    if not any_length:
        raise FormatError(f"{file}: no move has a length; is the program complete?")
    return PathParts(
        name=file.stem,
        axes=axis_names(columns),
        count=count,
        unit="moves",
        make=lambda: program.parts(columns, said),
        findings=tuple(reading.findings.all()),
        feeds=(top, rapid),
        tolerance=tolerance if said else None,
    )


@dataclass(frozen=True, eq=False)
class Piece:
    """Some moves in a row, and what a path needs of those that have a length.

    left_out  how many of them only lead to the first place; none  (n,) those without length behind these
    kept      (k,) numbers of the others; places  (k + 1, 9) between them; columns  those of the path's axes
    """

    file: str | os.PathLike[str]
    moves: Moves
    arcs: arc_maker.Arcs
    columns: IntArray
    left_out: int
    none: BoolArray
    kept: IntArray
    places: Array
    findings: Findings

    @cached_property
    def lengths(self) -> Array:
        """Lengths (n,) of all moves as `Path` counts them: mm, or degrees where rotary axes move alone."""
        step = self.moves.ends - self.moves.starts
        length: Array = np.linalg.norm(step[:, LINEAR], axis=1)
        turned = np.rad2deg(np.linalg.norm(step[:, list(ROTARY)], axis=1))
        length = np.where(length > 0.0, length, turned)
        length[self.arcs.move] = arc_maker.arc_lengths(self.moves, self.arcs)
        for i, spline in self.moves.spline_moves():
            length[i] = 0.0 if spline.path is None else spline.path.length
        return length

    @cached_property
    def programmed_feeds(self) -> Array:
        """Feeds (n,) as the program says them, mm/s, or deg/s where rotary axes move alone; 0 where it says none."""
        moves = self.moves
        feeds = moves.values[:, layout.ROW_FEED] / 60.0
        inverse = moves.flags & layout.INVERSE_FEED != 0
        if inverse.any():  # F is one over the minutes that the move takes
            feeds = np.where(inverse, feeds * self.lengths, feeds)
        step = moves.ends - moves.starts
        xyz, whole = (np.linalg.norm(step[:, columns], axis=1) for columns in ([0, 1, 2], LINEAR))
        beside = (moves.kind == LINE) & ~inverse & (xyz > 0.0) & (whole > xyz)
        if beside.any():  # F counts X, Y and Z alone where they move, and a path counts U, V and W too
            feeds = np.where(beside, feeds * whole / np.where(beside, xyz, 1.0), feeds)
        inch = moves.flags & layout.INCH != 0
        if inch.any():  # degrees are not inches
            inch &= (moves.kind <= LINE) & np.all(step[:, LINEAR] == 0.0, axis=1) & ~inverse
            feeds = np.where(inch, feeds / 25.4, feeds)
        return feeds

    @cached_property
    def feeds(self) -> Array:
        """Feeds (k,), mm/s: infinite for rapid moves, and for those before any F, with a finding."""
        feeds, rapid = self.programmed_feeds[self.kept], self.moves.kind[self.kept] == RAPID
        unsaid = (feeds <= 0.0) & ~rapid
        for line in self.moves.line[self.kept[unsaid]].tolist():
            self.findings.count("moves without a feed before them (F) run as fast as the limits allow", line)
        return np.where(unsaid | rapid, math.inf, feeds)

    @property
    def tolerances(self) -> tuple[Array, bool]:
        """How far each move may be smoothed (k,), mm, 0 where nothing is said; and whether anything is."""
        tolerances = self.moves.values[self.kept, layout.ROW_TOLERANCE]
        said = tolerances != UNSAID
        return np.where(said, tolerances, 0.0), bool(said.any())

    @property
    def markers(self) -> list[Marker]:
        """What stands between the curves: M, S, T and dwells, and the exact stops of G61.1."""
        marks = self.moves.marks
        places = np.searchsorted(self.kept, [mark.move for mark in marks]).tolist()
        markers = [Marker(place, mark.text, mark.dwell, mark.stop) for place, mark in zip(places, marks, strict=True)]
        stops = np.flatnonzero(self.moves.flags[self.kept[:-1]] & layout.STOPS) + 1  # at the end it stops anyway
        return markers + [Marker(int(place), "", 0.0, True) for place in stops]

    def curves(self) -> Sequence[NurbsCurve]:
        """One curve a move, each from where the one before ends; FormatError with the line of one that is none."""
        moves, points, columns = self.moves, self.places, self.columns
        flat = points[:, columns]
        if np.all(moves.kind[self.kept] <= LINE):
            return Lines(flat)
        number_of_arc = {int(move): i for i, move in enumerate(self.arcs.move)}
        curves = []
        for n, i in enumerate(self.kept.tolist()):
            try:
                if moves.kind[i] == SPLINE:
                    spline = moves.splines[int(moves.codes[i, layout.SPLINE])]
                    places = spline.points.copy()
                    places[0] = points[n]
                    curves.append(NurbsCurve(spline.degree, spline.knots, places[:, columns], spline.weights))
                elif i in number_of_arc:
                    curves.append(arc_maker.arc_curve(points[n], points[n + 1], self.arcs, number_of_arc[i], columns))
                else:
                    curves.append(NurbsCurve.trusted(1, LINE_KNOTS, flat[n : n + 2]))
            except CurveError as error:
                raise FormatError(f"{self.file}: line {int(moves.line[i])}: {error}") from None
        return curves

    def path(
        self, tolerances: Array | None, markers: Sequence[Marker], findings: Findings | None = None, name: str = ""
    ) -> Path:
        """The path of these moves; FormatError where there is none."""
        curves, feeds = self.curves(), self.feeds
        try:
            return Path(
                curves,
                axis_names(self.columns),
                name=name or pathlib.Path(self.file).stem,
                findings=[] if findings is None else findings.all(),
                feeds=feeds,
                tolerances=tolerances,
                markers=markers,
            )
        except CurveError as error:
            raise FormatError(f"{self.file}: {error}") from None


class Program:
    """A file and how to read it, as often as it takes; InputError for an option that is wrong."""

    def __init__(
        self,
        file: str | os.PathLike[str],
        dialect: str | None = None,
        start: str | Sequence[float] | None = None,
        offsets: str | Mapping[str, Sequence[float]] | None = None,
        tools: str | os.PathLike[str] | Tools | None = None,
        repair: bool = False,
        from_line: int | str | None = None,
    ) -> None:
        self.file = file
        self._keeps_start = start is not None
        self._reading = Reading(
            dialect=None if dialect is None else named(dialect),
            offsets=parse_offsets(offsets),
            start=np.zeros(AXES) if start is None else _place(start, "start"),
            tools=tools if tools is None or isinstance(tools, Tools) else read_tools(tools),
            repair=repair,
            from_line=0 if from_line is None else _line_number(from_line),
        )

    def reading(self) -> Reading:
        """A reading of its own, without findings yet."""
        return replace(self._reading, findings=Findings())

    def all_moves(self, reading: Reading) -> Moves:
        """All moves of the program; FormatError for the first line that is wrong, or more than MAX_MOVES moves.

        `in_parts` and `overview` know no such bound.
        """
        parts: list[Moves] = []
        count = 0
        try:
            for part in reading.moves(self.file):
                parts.append(part)
                count += len(part)
                if count > MAX_MOVES:
                    raise FormatError(
                        f"{self.file}: has more than {MAX_MOVES} moves; split it, look at it with info, or read "
                        "its parts, as splinefeed run does"
                    )
        except FormatError:
            for part in parts:  # an arc before that line is wrong first
                find_arcs(part, self.file, Findings(), reading.repair)
            raise
        return joined(parts)

    def tool_paths(self, moves: Moves, reading: Reading) -> list[Path]:
        """The tool paths of a program, and what it does in joints with a feed between them, in order."""
        rotary = [column for column in ROTARY if moves.used >> column & 1]
        turns = sum(1 << column for column in ROTARY)
        known, found = (-1 if self._keeps_start else 0), list[tool_paths.Named]()
        for part, tip, length in tool_paths.sections(moves):
            if tip:
                found += tool_paths.tool_paths(
                    part, length, rotary, known, partial(self._piece, reading), str(self.file), reading.findings
                )
            elif np.any(part.kind != RAPID):
                columns = path_columns(part.used, self.file)
                (piece,) = self.pieces([part], reading, columns, max(len(part), 1))
                found += [partial(self._joints, piece)] if len(piece.kept) else []
            else:
                for line in part.line.tolist():
                    reading.findings.count("rapid moves without tool centre point control are left out", line)
            known |= int(np.bitwise_or.reduce(part.codes[:, layout.AXES] >> layout.STATED)) & turns
        if not found:
            raise FormatError(f"{self.file}: no move has a length; is the program complete?")
        stem = pathlib.Path(self.file).stem
        return [make(stem if len(found) == 1 else f"{stem}-{i}") for i, make in enumerate(found, start=1)]

    def _piece(
        self, reading: Reading, part: Moves, columns: IntArray, out: int, none: BoolArray, kept: IntArray, at: Array
    ) -> Piece:
        arcs = find_arcs(part, self.file, reading.findings, reading.repair)
        return Piece(self.file, part, arcs, columns, out, none, kept, at, reading.findings)

    @staticmethod
    def _joints(piece: Piece, name: str) -> Path:
        tolerances, said = piece.tolerances
        return piece.path(tolerances if said else None, piece.markers, piece.findings, name)

    def pieces(
        self, parts: Iterable[Moves], reading: Reading, columns: IntArray | None = None, size: int | None = None
    ) -> Iterator[Piece]:
        """All moves, `size` (PART) at a time, with what there is to say of them in the findings of `reading`.

        columns  of the axes of the path; None while they are not known: those of the first moves say where it begins
        """
        size = size or PART
        known = np.arange(AXES) if columns is None else columns
        place: Array | None = None
        for moves, first in self._led(parts, columns, reading):
            for low in range(0, max(len(moves), 1), size):
                part = moves.part(low, min(low + size, len(moves)))
                arcs = find_arcs(part, self.file, reading.findings, reading.repair)
                left_out = min(max(first - low, 0), len(part))
                none, kept, places = _with_length(part, left_out, known, reading.findings)
                if place is not None:
                    places[0] = place  # what has no length is left out, and moves begin where the last one ended
                if len(kept):
                    place = places[-1].copy()
                yield Piece(self.file, part, arcs, known, left_out, none, kept, places, reading.findings)

    def _led(self, parts: Iterable[Moves], columns: IntArray | None, reading: Reading) -> Iterator[tuple[Moves, int]]:
        """Moves as they are read, and how many of them only lead to the first place."""
        every = -1 if columns is None else sum(1 << int(column) for column in columns)
        held: list[Moves] = []
        found = self._keeps_start
        for moves in parts:
            if found:
                yield moves, 0
                continue
            held.append(moves)
            if columns is None and len(moves):
                every, found = moves.used, True
            needed = every & ~reading.stated  # a program that is resumed has said some of it before
            if found := found or _begins(held, needed) or sum(map(len, held)) > MAX_MOVES:
                whole, held = joined(held), []
                yield whole, _leading(whole, needed, reading.findings)
        if held:
            whole = joined(held)
            yield whole, _leading(whole, every & ~reading.stated, reading.findings)

    def parts(self, columns: IntArray, said: bool) -> Iterator[Path]:
        """The path, part by part; tolerances with them if any is `said` in the program."""
        held: Path | None = None
        behind: list[Marker] = []  # what stands behind the last curve so far: before the next one, or at the end
        reading = self.reading()
        for piece in self.pieces(reading.moves(self.file), reading, columns):
            markers, count = piece.markers, len(piece.kept)
            if not count:
                behind += markers
                continue
            if held is not None:
                yield held
            here = [*behind, *(marker for marker in markers if marker.before < count)]
            behind = [replace(marker, before=0) for marker in markers if marker.before == count]
            if piece.moves.flags[piece.kept[-1]] & layout.STOPS:
                behind.append(Marker(0, "", 0.0, True))
            held = piece.path(piece.tolerances[0] if said else None, here)
        assert held is not None  # it has been looked through
        end = [replace(marker, before=len(held.curves)) for marker in behind]
        yield Path(
            held.curves, held.axes, name=held.name, feeds=held.feeds, tolerances=held.tolerances,
            markers=[*held.markers, *end],
        )  # fmt: skip


def find_arcs(moves: Moves, file: str | os.PathLike[str], findings: Findings, repair: bool) -> arc_maker.Arcs:
    """`arcs.find_arcs` with the file's name in its error."""
    try:
        return arc_maker.find_arcs(moves, findings, repair)
    except LineError as missed:
        raise FormatError(f"{file}: line {missed.line}: {missed}") from None


def path_columns(used: int, file: str | os.PathLike[str]) -> IntArray:
    """Columns of the axes that the program moves, in the order of a path; FormatError for none."""
    columns = np.array([column for column in PATH_ORDER if used >> column & 1], dtype=np.int64)
    if not len(columns):
        raise FormatError(f"{file}: no line moves an axis")
    return columns


def axis_names(columns: IntArray) -> tuple[str, ...]:
    """Names of the axes of these columns in a path."""
    return tuple(LETTERS[column].lower() for column in columns)


def _begins(parts: Sequence[Moves], needed: int) -> bool:
    """Whether these moves say where the path begins: `_leading` would end among them."""
    known = 0
    for moves in parts:
        stated = moves.codes[:, layout.AXES] >> layout.STATED
        before = (
            np.concatenate([[known], known | np.bitwise_or.accumulate(stated)]) if len(moves) else np.array([known])
        )
        if np.any((before[:-1] & needed == needed) | (moves.kind != RAPID) | (stated == 0)):
            return True
        known = int(before[-1])
    return False


def _leading(moves: Moves, needed: int, findings: Findings) -> int:
    """How many rapid moves at the beginning only lead to the first place; a finding says so."""
    stated = moves.codes[:, layout.AXES] >> layout.STATED
    known = 0
    for i in range(len(moves)):
        if known & needed == needed:
            break
        if moves.kind[i] != RAPID or not stated[i]:
            missing = " ".join(LETTERS[c] for c in PATH_ORDER if needed & ~known & 1 << c)
            findings.say(
                f"line {moves.line[i]}: where {missing} is before this move is unknown and taken as 0 "
                "in the program's first coordinate system (option start)"
            )
            return i if i and known else 0
        known |= int(stated[i])
    else:
        return 0  # rapid moves alone: all of them are the path
    if i:
        findings.say(
            f"{i} rapid move(s) to the first place, up to line {moves.line[i - 1]}, are left out (option start)"
        )
    return i


def _with_length(moves: Moves, first: int, columns: IntArray, findings: Findings) -> tuple[BoolArray, IntArray, Array]:
    """Which moves (n,) from `first` on have no length, the numbers (k,) of the others, and the places (k + 1, 9)."""
    starts, ends = moves.starts, moves.ends
    step = np.max(np.abs(ends - starts)[:, columns], axis=1)
    none = (moves.kind <= LINE) & (step <= NO_LENGTH)
    for i, spline in moves.spline_moves():
        none[i] = float(np.max(np.ptp(spline.points, axis=0))) <= NO_LENGTH
    none[:first] = False
    for line in moves.line[none].tolist():
        findings.count("{count} move(s) without length are left out", line)
    kept = np.flatnonzero(~none & (np.arange(len(moves)) >= first))
    begin = starts[first] if first < len(moves) else ends[-1] if len(moves) else moves.start
    places = np.concatenate([begin[None], ends[kept]])
    return none, kept, places


def parse_offsets(given: str | Mapping[str, Sequence[float]] | None) -> dict[int, Array]:
    """Offsets (9,) in mm and rad by number of the coordinate system; InputError for what is none."""
    if given is None:
        return {}
    if isinstance(given, str):
        pairs = [each.partition("=") for each in given.split(";") if each.strip()]
        given = {name.strip(): _numbers(text, f"offsets: {name.strip()}") for name, _, text in pairs}
    known = {f"G{code / 10:g}": number for code, number in SYSTEMS.items()} | REFERENCES
    for name in given:
        if name.upper() not in known:
            raise InputError(f"offsets: {name!r} is not a coordinate system; there are {', '.join(known)}")
    return {known[name.upper()]: _place(values, f"offsets: {name}") for name, values in given.items()}


def _numbers(text: str, name: str) -> list[float]:
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        raise InputError(f"{name}: {text[:40]!r} is not a list of numbers; write for example 10,20,0") from None


def _line_number(given: int | str) -> int:
    """The number of a line; InputError for what is none."""
    if isinstance(given, bool) or not str(given).isascii() or not str(given).isdigit() or not 0 < int(given) < 2**40:
        raise InputError(f"from_line: {str(given)[:40]!r} is not a line number; lines count from 1")
    return int(given)


def _place(given: str | Sequence[float], name: str) -> Array:
    """A place (9,) in mm and rad from X,Y,Z,A,B,C,U,V,W in mm and degrees."""
    values = _numbers(given, name) if isinstance(given, str) else [float(each) for each in given]
    if not 1 <= len(values) <= AXES or not all(abs(value) <= layout.LARGEST for value in values):
        raise InputError(f"{name}: 1 to {AXES} numbers expected, in the order {' '.join(LETTERS)}, got {values}")
    place = np.zeros(AXES)
    place[: len(values)] = values
    place[list(ROTARY)] = np.deg2rad(place[list(ROTARY)])
    return place

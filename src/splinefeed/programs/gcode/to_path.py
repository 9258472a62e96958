"""A program as a path: one curve a move, with its feed, its tolerance and what stands between the moves.

Where the tool is when a program starts is not known. Rapid moves that only lead to the first place are left out: the
path begins where every axis that moves has been stated. Axes that a feed move needs before that are taken to be at 0.
With `start` the path begins there, and nothing is left out. What moves mean is said here once: `Program.pieces` hands
them out with all that a path, its parts (`in_parts`) and `overview` need of them.
"""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.files.sizes import MAX_MOVES
from splinefeed.numbers import finite, whole
from splinefeed.paths.contents import Contents
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.path_parts import PathParts
from splinefeed.programs.gcode.dialects import named
from splinefeed.programs.gcode.moves import AXES, LARGEST, LETTERS, PATH_ORDER, ROTARY, Findings, Flag, Moves, joined
from splinefeed.programs.gcode.offsets import MORE_SYSTEMS, REFERENCES, SYSTEMS
from splinefeed.programs.gcode.piece import NOTHING, Piece, axis_names, leading, path_columns, say_leading
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.tool_paths import tool_paths
from splinefeed.programs.gcode.tools import Tools, read_tools
from splinefeed.records import Array, IntArray

_MORE_SYSTEMS = re.compile(r"G(?:54\.1|154) ?P([0-9]{1,3})")
#: Moves of one part.
PART = 4096


def from_file(
    file: pathlib.Path,
    *,
    dialect: str | None = None,
    start: str | Sequence[float] | None = None,
    offsets: str | Mapping[str, Sequence[float]] | None = None,
    tools: str | os.PathLike[str] | Tools | None = None,
    from_line: int | str | None = None,
    increments: bool = False,
    units: str | None = None,
    repair: bool = False,
) -> list[Path]:
    """Read the path of a program.

    Parameters
    ----------
    file : Path
        Of G-code.
    dialect : str, optional
        One of `dialects.DIALECTS`, recognized by the content if not given.
    start : str or sequence of float, optional
        Where the tool is before the first line, X,Y,Z,A,B,C,U,V,W in mm and degrees; fewer will do.
    offsets : str or mapping, optional
        Of coordinate systems, in mm and degrees: {"G54": (x, y, z)} or "G54=x,y,z;G55=x,y,z"; places of G28, G30.
    tools : str or PathLike or Tools, optional
        A tool table as LinuxCNC has it (.tbl): then G43 shifts the path by the length of the tool.
    from_line : int or str, optional
        Number of the line at which the program is resumed, as it is there when it is first carried out.
    increments : bool, optional
        Whether a Fanuc's axis words without a decimal point count 0.001 mm (0.0001 in), not mm.
    units : str, optional
        "mm" or "in": of lengths and feeds until the program says its own; mm if not given, with a finding.
    repair : bool, optional
        Whether arcs that miss their circle become spirals, and codes that cannot be read are left out, with findings.

    Returns
    -------
    list of Path
        One path; of a program with a tool axis a ToolPath, or several.

    Raises
    ------
    FormatError
        That names the line.
    InputError
        For an option that is wrong.
    """
    program = Program(file, dialect, start, offsets, tools, repair, from_line, increments, units)
    reading = program.reading()
    moves = program.all_moves(reading)
    if np.any(moves["flags"] & Flag.TIP):
        paths = tool_paths(moves, reading, program.keeps_start, lambda part: program.whole(part, reading))
    else:
        paths = [program.whole(moves, reading).path()]
    return Contents(paths, units="in" if reading.inch else "mm")


def in_parts(file: pathlib.Path, **options: Any) -> PathParts:
    """Read a program of any length as parts of its path.

    Parameters
    ----------
    file : Path
        Of G-code.
    **options : object
        As of `from_file`.

    Returns
    -------
    PathParts
        Made as they are wanted.

    Raises
    ------
    FormatError
        That names the line; and for a program whose X, Y and Z are the tool's tip.

    Notes
    -----
    It is looked through twice before: for its axes, and for its feeds. So a faulty line is reported before anything is
    made of the lines above it.
    """
    program = Program(file, **options)
    used = 0
    for moves in program.reading().moves(file):
        used |= moves.axes
        if len(tip := np.flatnonzero(moves["flags"] & Flag.TIP)):
            raise FormatError(
                f"{file}: line {moves['line'][tip[0]]}: X, Y and Z are the tool's tip; such a program is read as a "
                "whole, not by windows"
            )
    columns = path_columns(used, file)
    reading = program.reading()
    any_length, count, top, rapid, said = False, 0, 0.0, False, list[float]()
    for piece in program.pieces(reading.checked(file), reading, columns):
        any_length, count = any_length or len(piece.kept) > 0, count + len(piece.moves)
        known = piece.feeds[np.isfinite(piece.feeds)]
        top = max(top, float(np.max(known, initial=0.0)))
        rapid |= len(known) < len(piece.feeds)
        if (tolerances := piece.tolerances) is not None:
            said = [max(float(np.max(tolerances)), *said, 0.0)]
    if not any_length:
        raise FormatError(f"{file}: {NOTHING}")
    return PathParts(
        name=file.stem,
        axes=axis_names(columns),
        count=count,
        unit="moves",
        make=lambda: program.parts(columns, bool(said)),
        findings=tuple(reading.findings.all()),
        feeds=(top, rapid),
        tolerance=said[0] if said else None,
    )


class Program:
    """A file and how to read it, as often as it takes.

    Parameters
    ----------
    file : str or PathLike
        Of G-code.
    dialect, start, offsets, tools, repair, from_line, increments, units : optional
        As of `from_file`.

    Raises
    ------
    InputError
        For an option that is wrong.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        dialect: str | None = None,
        start: str | Sequence[float] | None = None,
        offsets: str | Mapping[str, Sequence[float]] | None = None,
        tools: str | os.PathLike[str] | Tools | None = None,
        repair: bool = False,
        from_line: int | str | None = None,
        increments: bool = False,
        units: str | None = None,
    ) -> None:
        self.file = file
        self.keeps_start = start is not None
        self._reading = Reading(
            dialect=None if dialect is None else named(dialect),
            offsets=_offsets(offsets),
            start=np.zeros(AXES) if start is None else _place(start, "start"),
            tools=tools if tools is None or isinstance(tools, Tools) else read_tools(tools),
            repair=repair,
            increments=increments,
            inch_unsaid=None if units is None else _inches(units),
            from_line=0 if from_line is None else _line_number(from_line),
        )

    def reading(self) -> Reading:
        """A reading of its own, without findings yet."""
        return replace(self._reading, findings=Findings())

    def all_moves(self, reading: Reading) -> Moves:
        """All moves of the program, MAX_MOVES at most; `in_parts` and `overview` know no such bound."""
        parts: list[Moves] = []
        for part in reading.checked(self.file):
            parts.append(part)
            if sum(map(len, parts)) > MAX_MOVES:
                raise FormatError(
                    f"{self.file}: has more than {MAX_MOVES} moves; split it, look at it with info, or read "
                    "its parts, as splinefeed run does"
                )
        return joined(parts)

    def whole(self, moves: Moves, reading: Reading) -> Piece:
        """All moves as one piece, over the axes that they move."""
        columns = path_columns(moves.axes, self.file)
        (piece,) = self.pieces([moves], reading, columns, max(len(moves), 1))
        return piece

    def pieces(
        self, parts: Iterable[Moves], reading: Reading, columns: IntArray | None = None, size: int | None = None
    ) -> Iterator[Piece]:
        """Cut moves into pieces.

        Parameters
        ----------
        parts : iterable of Moves
            As they are read.
        reading : Reading
            Whose findings take what there is to say of them.
        columns : array (axes,), optional
            Of the axes of the path; None while they are not known: those of the first moves say where it begins.
        size : int, optional
            Moves of a piece, PART by default.

        Yields
        ------
        Piece
            All moves, in order.
        """
        size = size or PART
        known = np.arange(AXES) if columns is None else columns
        place: Array | None = None
        for moves, first in self._led(parts, columns, reading):
            for low in range(0, max(len(moves), 1), size):
                part = moves.part(low, min(low + size, len(moves)))
                # what has no length is left out, and moves begin where the last one ended
                piece = Piece(part, known, reading, min(max(first - low, 0), len(part)), place)
                if len(piece.kept):
                    place = piece.places[-1].copy()
                yield piece

    def _led(self, parts: Iterable[Moves], columns: IntArray | None, reading: Reading) -> Iterator[tuple[Moves, int]]:
        """Moves as they are read, and how many of them only lead to the first place."""
        parts, held, found = iter(parts), list[Moves](), self.keeps_start
        while not found and sum(map(len, held)) <= MAX_MOVES and (moves := next(parts, None)) is not None:
            held = [joined([*held, moves])]
            every = held[0].axes & (1 << AXES) - 1 if columns is None else sum(1 << int(column) for column in columns)
            first, missing = leading(held[0], every & ~reading.stated)  # what a resumed program has said before
            if found := first < len(held[0]):
                names = [LETTERS[column] for column in PATH_ORDER if missing >> column & 1]
                say_leading(held[0], first, names, "as 0 in the program's first coordinate system", reading.findings)
                yield held.pop(), first
        if held:
            yield held.pop(), 0  # rapid moves alone: all of them are the path
        yield from ((moves, 0) for moves in parts)

    def parts(self, columns: IntArray, said: bool) -> Iterator[Path]:
        """The path, part by part; tolerances with them if any is `said` in the program."""
        held: Piece | None = None
        here: list[Marker] = []
        behind: list[Marker] = []  # what stands behind the last curve so far: before the next one, or at the end
        reading = self.reading()

        def made(piece: Piece) -> Path:
            tolerances = np.zeros(len(piece.kept)) if said and piece.tolerances is None else piece.tolerances
            return piece.path(markers=here, findings=(), tolerances=tolerances)

        for piece in self.pieces(reading.checked(self.file), reading, columns):
            markers, count = piece.markers, len(piece.kept)
            if not count:
                behind += markers
                continue
            if held is not None:
                yield made(held)
            held, here = piece, [*behind, *(marker for marker in markers if marker.before < count)]
            behind = [replace(marker, before=0) for marker in markers if marker.before == count]
            if piece.moves["flags"][piece.kept[-1]] & Flag.STOPS:
                behind.append(Marker(0, "", 0.0, True))
        assert held is not None  # it has been looked through
        here += [replace(marker, before=len(held.kept)) for marker in behind]
        yield made(held)


def _offsets(given: str | Mapping[str, Sequence[float]] | None) -> dict[int, Array]:
    """Offsets (9,) in mm and rad by number of the coordinate system; InputError for what is none."""
    if isinstance(given, str):
        pairs = [each.partition("=") for each in given.split(";") if each.strip()]
        given = {name.strip(): _numbers(text, f"offsets: {name.strip()}") for name, _, text in pairs}
    known = {f"G{code / 10:g}": number for code, number in SYSTEMS.items()} | REFERENCES
    for name in given or ():
        if more := _MORE_SYSTEMS.fullmatch(name.strip().upper()):
            known[name.upper()] = MORE_SYSTEMS + int(more[1])
        if name.upper() not in known:
            raise InputError(f"offsets: {name!r} is not a coordinate system; there are {', '.join(known)}")
    return {known[name.upper()]: _place(values, f"offsets: {name}") for name, values in (given or {}).items()}


def _inches(units: str) -> bool:
    if units not in ("mm", "in"):
        raise InputError(f"units: {str(units)[:40]!r} is none of a program; give mm or in")
    return units == "in"


def _numbers(text: str, name: str) -> list[float]:
    try:
        return [finite(each) for each in text.split(",")]
    except InputError:
        raise InputError(f"{name}: {text[:40]!r} is not a list of numbers; write for example 10,20,0") from None


def _line_number(given: int | str) -> int:
    try:
        return whole(given, least=1, most=2**40)
    except InputError:
        raise InputError(f"from_line: {str(given)[:40]!r} is not a line number; lines count from 1") from None


def _place(given: str | Sequence[float], name: str) -> Array:
    """A place (9,) in mm and rad from X,Y,Z,A,B,C,U,V,W in mm and degrees."""
    values = _numbers(given, name) if isinstance(given, str) else [float(each) for each in given]
    if not 1 <= len(values) <= AXES or not all(abs(value) <= LARGEST for value in values):
        raise InputError(f"{name}: 1 to {AXES} numbers expected, in the order {' '.join(LETTERS)}, got {values}")
    place = np.zeros(AXES)
    place[: len(values)] = values
    place[list(ROTARY)] = np.deg2rad(place[list(ROTARY)])
    return place

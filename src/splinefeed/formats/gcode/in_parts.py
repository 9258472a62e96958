"""A program of any length as parts of its path: the curves of `to_path`, made when asked for, then forgotten."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats.gcode import arcs as arc_maker
from splinefeed.formats.gcode.moves import LETTERS, RAPID, Findings, Moves
from splinefeed.formats.gcode.reader import Reading, joined
from splinefeed.formats.gcode.to_path import (
    MAX_MOVES,
    curves_of,
    feeds_of,
    find_arcs,
    leading,
    markers_of,
    path_columns,
    reading_of,
    tolerances_of,
    with_length,
)
from splinefeed.formats.path_parts import PathParts
from splinefeed.geometry.path import Marker, Path
from splinefeed.kernels import gcode as layout
from splinefeed.records import Array, IntArray

#: Moves of one part.
PART = 4096


def in_parts(
    file: pathlib.Path,
    *,
    dialect: str | None = None,
    start: str | Sequence[float] | None = None,
    offsets: str | Mapping[str, Sequence[float]] | None = None,
    repair: bool = False,
) -> PathParts:
    """The program in `file`, read part by part, with the options of `to_path.from_file`.

    It is looked through twice before: for its axes, and for its feeds. So a faulty line is told before anything is
    made of the lines above it.
    """
    program = _Program(file, dialect, start, offsets, repair)
    found = Findings()
    first, moves, top, rapid, tolerance, said = 0, 0, 0.0, False, 0.0, False
    for piece in program.pieces(found):
        first, moves = first or len(piece.kept), moves + len(piece.moves)
        known = piece.feeds[np.isfinite(piece.feeds)]
        top = max(top, float(np.max(known, initial=0.0)))
        rapid |= len(known) < len(piece.feeds)
        tolerances, any_said = tolerances_of(piece.moves, piece.kept)
        tolerance, said = max(tolerance, float(np.max(tolerances, initial=0.0))), said or any_said
    if not first:
        raise FormatError(f"{file}: no move of it has a length; is the program complete?")
    axes = tuple(LETTERS[column].lower() for column in program.columns)
    return PathParts(
        name=file.stem,
        axes=axes,
        count=moves,
        unit="moves",
        make=lambda: program.paths(axes, said),
        findings=tuple(found.all()),
        feeds=(top, rapid),
        tolerance=tolerance if said else None,
    )


@dataclass(eq=False)
class _Piece:
    """Some moves in a row, and what a path needs of those that have a length.

    kept    (n,) their numbers; places  (n + 1, 9) between them; feeds (n,), mm/s
    """

    moves: Moves
    arcs: arc_maker.Arcs
    kept: IntArray
    places: Array
    feeds: Array


@dataclass(eq=False)
class _Program:
    """A file and how to read it, as often as it takes."""

    file: pathlib.Path
    dialect: str | None
    start: str | Sequence[float] | None
    offsets: str | Mapping[str, Sequence[float]] | None
    repair: bool
    columns: IntArray = field(init=False)

    def __post_init__(self) -> None:
        used = 0
        for moves in self._reading().moves(self.file):
            used |= moves.used
        if not used:
            raise FormatError(f"{self.file}: no line of it moves an axis")
        self.columns = path_columns(used, self.file)

    def _reading(self) -> Reading:
        return reading_of(self.dialect, self.start, self.offsets, self.repair)

    def pieces(self, findings: Findings) -> Iterator[_Piece]:
        """All moves of the program from the first place on, PART at a time; `findings` is told what there is to say."""
        reading = self._reading()
        reading.findings = findings
        place: Array | None = None
        for moves, first in self._led(reading):
            for low in range(0, len(moves), PART) if len(moves) else (0,):
                part = _slice(moves, low, min(low + PART, len(moves)))
                arcs = find_arcs(part, self.file, findings, self.repair)
                kept, places = with_length(part, min(max(first - low, 0), len(part)), self.columns, findings)
                if place is not None:
                    places[0] = place  # what has no length is left out, and moves begin where the last one ended
                if len(kept):
                    place = places[-1].copy()
                yield _Piece(part, arcs, kept, places, feeds_of(part, arcs, kept, findings))

    def _led(self, reading: Reading) -> Iterator[tuple[Moves, int]]:
        """Moves as they are read, and how many of them only lead to the first place."""
        needed = sum(1 << int(column) for column in self.columns)
        held: list[Moves] = []
        found = self.start is not None
        for moves in reading.moves(self.file):
            if found:
                yield moves, 0
                continue
            held.append(moves)
            if found := _begins(held, needed) or sum(map(len, held)) > MAX_MOVES:
                whole, held = joined(held), []
                yield whole, leading(whole, self.columns, reading.findings)
        if held:
            whole = joined(held)
            yield whole, leading(whole, self.columns, reading.findings)

    def paths(self, axes: Sequence[str], said: bool) -> Iterator[Path]:
        """The path, part by part; tolerances with them if any is `said` in the program."""
        held: Path | None = None
        behind: list[Marker] = []  # what stands behind the last curve so far: before the next one, or at the end
        for piece in self.pieces(Findings()):
            markers = markers_of(piece.moves, piece.kept)
            count = len(piece.kept)
            if not count:
                behind += markers
                continue
            if held is not None:
                yield held
            here = [*behind, *(marker for marker in markers if marker.before < count)]
            behind = [dataclasses.replace(marker, before=0) for marker in markers if marker.before == count]
            if piece.moves.flags[piece.kept[-1]] & layout.STOPS:
                behind.append(Marker(0, "", 0.0, True))
            try:
                held = Path(
                    curves_of(piece.moves, piece.arcs, piece.kept, piece.places, self.columns, self.file),
                    axes,
                    name=self.file.stem,
                    feeds=piece.feeds,
                    tolerances=tolerances_of(piece.moves, piece.kept)[0] if said else None,
                    markers=here,
                )
            except CurveError as error:
                raise FormatError(f"{self.file}: {error}") from None
        assert held is not None  # it has been looked through
        end = [dataclasses.replace(marker, before=len(held.curves)) for marker in behind]
        yield Path(
            held.curves, axes, name=held.name, feeds=held.feeds, tolerances=held.tolerances,
            markers=[*held.markers, *end],
        )  # fmt: skip


def _begins(parts: Sequence[Moves], needed: int) -> bool:
    """Whether these moves say where the path begins: `leading` would end among them."""
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


def _slice(moves: Moves, low: int, high: int) -> Moves:
    """The moves from `low` to the one before `high`, with the marks before them and, at the end, behind them."""
    if low == 0 and high == len(moves):
        return moves
    last = high == len(moves)
    marks = [
        dataclasses.replace(mark, move=mark.move - low)
        for mark in moves.marks
        if low <= mark.move and (mark.move < high or last)
    ]
    start = moves.start if low == 0 else moves.ends[low - 1]
    return Moves(start, moves.values[low:high], moves.codes[low:high], moves.splines, tuple(marks))

"""The blocks of a program as arrays: what a control needs of each to plan its feed."""

from __future__ import annotations

import math
import os
import pathlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.source import check_file, read_head
from splinefeed.machine.control import Control, Place
from splinefeed.programs.gcode.arcs import Arcs
from splinefeed.programs.gcode.dialects import HEAD_BYTES, SUFFIXES, holds
from splinefeed.programs.gcode.moves import AXES, ROW, STATED, Flag, Mark, MoveKind, Moves, SplineMove
from splinefeed.programs.gcode.offsets import REFERENCES
from splinefeed.programs.gcode.piece import NO_LENGTH, NOTHING, straight_lengths
from splinefeed.programs.gcode.to_path import Program
from splinefeed.records import Array, BoolArray, IntArray

#: Places along a spline at which its radius is measured, and chords of a trace for each of its control points.
_PLACES, _CHORDS = 65, 8
#: Turn of an arc within a chord of a trace at most, rad.
_CHORD = np.pi / 36.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """The n moves of a program, without blocks that have no length.

    Parameters
    ----------
    line : array (n,)
        Of the file.
    rapid : array (n,)
        Whether it is G0.
    length : array (n,)
        mm, of rotary moves alone deg.
    feed : array (n,)
        mm/s, inf where none.
    step : array (n, 9)
        mm and rad.
    moved : array (n, 9)
        Whether an axis moves, as on a full circle, whose step is 0.
    first, last : array (n, 6)
        Direction at start and end over the linear axes.
    radius : array (n,)
        mm, inf on lines, the least of a spline or spiral.
    kink : array (n,)
        rad: sqrt(2 d / r) of an arc whose radii at its ends differ by d, else 0.
    tolerance : array (n,)
        Of G64 P, mm, NaN where none is given.
    stops : array (n,)
        Whether the tool stops at its end (G61.1).
    end : array (n,)
        Row of `trace` at which it ends.
    trace : array (k, 3)
        X, Y and Z along the program, from its start, mm: arcs and splines as chords.
    marks : tuple of Mark
        Other events, each before the block of its number.
    findings : tuple of str
        Of the reader.
    dialect : str, optional
        Its name.
    """

    line: IntArray
    rapid: BoolArray
    length: Array
    feed: Array
    step: Array
    moved: BoolArray
    first: Array
    last: Array
    radius: Array
    kink: Array
    tolerance: Array
    stops: BoolArray
    end: IntArray
    trace: Array
    marks: tuple[Mark, ...]
    findings: tuple[str, ...]
    dialect: str = ""

    def __len__(self) -> int:
        return len(self.line)


def read_blocks(file: str | os.PathLike[str], control: Control, **options: Any) -> Blocks:
    """Read a program as blocks.

    Parameters
    ----------
    file : str or PathLike
        Of G-code.
    control : Control
        That says where G28 and changes go.
    **options : object
        As of `splinefeed.read`.

    Returns
    -------
    Blocks
        The moves, and what happens between.

    Raises
    ------
    FormatError
        With the line that is wrong, or where nothing moves.
    """
    if not holds(read_head(check_file(file), HEAD_BYTES)) and pathlib.Path(file).suffix.lower() not in SUFFIXES:
        raise FormatError(f"{file}: holds no G-code; expected a program")
    home = [control.home.x or 0.0, control.home.y or 0.0, control.home.z or 0.0, *[0.0] * (AXES - 3)]
    given = {name: value for name, value in options.items() if value is not None}
    program = Program(file, **{"start": home, **given})
    reading = program.reading()
    if control.home != Place():
        references = {number: np.array(home) for number in REFERENCES.values()}
        reading = replace(reading, offsets={**references, **reading.offsets})
    moves = program.all_moves(reading)
    if not len(moves):
        raise FormatError(f"{file}: no line moves an axis")
    moves, step = _by_way_of_changes(moves, control.change_place)
    (piece,) = program.pieces([moves], reading, np.arange(AXES), len(moves))
    rapid, arcs = moves["kind"] == MoveKind.RAPID, piece.arcs
    length = np.where(rapid, straight_lengths(step), piece.lengths)
    moved = step != 0.0
    moved[arcs.move[:, None], arcs.axes] = True
    kink = np.zeros(len(moves))
    kink[arcs.move] = np.sqrt(4.0 * np.abs(arcs.first - arcs.last) / (arcs.first + arcs.last))
    ends = piece.ends
    for i, spline in moves.spline_moves():
        moved[i] = np.ptp(spline.points, axis=0) > 0.0
        ends.radius[i] = _radius(spline)
    kept = np.flatnonzero(length > NO_LENGTH)
    if not len(kept):
        raise FormatError(f"{file}: {NOTHING}")
    feed, tolerance = piece.programmed_feeds, moves["tolerance"]
    if missing := moves["line"][kept[(feed <= 0.0)[kept] & ~rapid[kept]]].tolist():
        reading.findings.say(f"line {missing[0]}: no feed before it (F): timed as rapid")
    end, trace = _trace(moves, arcs)
    first, last = (np.nan_to_num(each) for each in ends.tangents)
    arrays = {
        "line": moves["line"], "rapid": rapid, "length": length, "step": step, "moved": moved, "first": first,
        "feed": np.where((feed <= 0.0) | rapid, np.inf, feed), "last": last, "radius": ends.radius, "kink": kink,
        "tolerance": np.where(tolerance >= 0.0, tolerance, np.nan), "end": end,
        "stops": moves.has(Flag.STOPS),
    }  # fmt: skip
    numbers = np.searchsorted(kept, [mark.move for mark in moves.marks]).tolist()
    marks = tuple(replace(mark, move=number) for mark, number in zip(moves.marks, numbers, strict=True))
    chosen: dict[str, Any] = {name: values[kept] for name, values in arrays.items()}
    dialect = "" if reading.dialect is None else reading.dialect.name
    return Blocks(**chosen, trace=trace, marks=marks, findings=tuple(reading.findings.all()), dialect=dialect)


def _by_way_of_changes(moves: Moves, place: Place) -> tuple[Moves, Array]:
    """With a rapid move behind each M6, and the steps (n, 9) of all moves.

    The step of that move leads to where tools change; those of rapid moves that state an axis begin there.
    """
    there = {axis: value for axis, value in enumerate((place.x, place.y, place.z)) if value is not None}
    changes = [k for k, mark in enumerate(moves.marks) if there and "M6" in mark.text.split()]
    at = np.array([moves.marks[k].move for k in changes], dtype=np.int64)
    rows = np.zeros(len(at), ROW)
    rows["end"] = np.concatenate([moves.start[None], moves["end"]])[at]
    rows["line"] = [moves.marks[k].line for k in changes]
    rows["plane"], rows["spline"] = 17, -1
    before = np.searchsorted(changes, np.arange(len(moves.marks))).tolist()
    marks = tuple(replace(mark, move=mark.move + k) for mark, k in zip(moves.marks, before, strict=True))
    moves = replace(moves, rows=np.insert(moves.rows, at, rows), marks=marks)
    step = moves.step
    for way in (at + np.arange(len(at))).tolist():
        away = {axis: value - moves["end"][way, axis] for axis, value in there.items()}
        step[way, list(away)] = list(away.values())
        for move in range(way + 1, len(moves)):
            if not away or moves["kind"][move] != MoveKind.RAPID:
                break
            for axis in [axis for axis in away if moves["axes"][move] >> STATED + axis & 1]:
                step[move, axis] -= away.pop(axis)
    return moves, step


def _radius(spline: SplineMove) -> float:
    """The least radius between places along a spline, mm: a cusp between two of them is passed as a corner is."""
    if spline.path is None:
        return math.inf
    legs = np.diff(spline.path(np.linspace(0.0, spline.path.length, _PLACES)), axis=0)
    sizes = np.maximum(np.linalg.norm(legs, axis=1), 1e-300)
    turns = np.linalg.norm(np.diff(legs / sizes[:, None], axis=0), axis=1)
    return float(np.min(0.5 * (sizes[:-1] + sizes[1:]) / np.maximum(turns, 1e-12)))


def _trace(moves: Moves, arcs: Arcs) -> tuple[IntArray, Array]:
    """The row (n,) at which each move ends, and X, Y and Z (k, 3) along all of them, the first row where they begin."""
    count = np.ones(len(moves), dtype=np.int64)
    count[arcs.move] = np.maximum(np.ceil(np.abs(arcs.sweep) / _CHORD), 1.0)
    for i, spline in moves.spline_moves():
        count[i] = _CHORDS * len(spline.points)
    end = np.cumsum(count)
    move = np.repeat(np.arange(len(moves)), count)
    share = (np.arange(1, len(move) + 1) - (end - count)[move]) / count[move]
    trace = moves.starts[move, :3] + share[:, None] * moves.step[move, :3]
    number = np.full(len(moves), -1)
    number[arcs.move] = np.arange(len(arcs))
    rows = np.flatnonzero(number[move] >= 0)
    arc, part = number[move[rows]], share[rows]
    angle = arcs.angle[arc] + part * arcs.sweep[arc]
    radius = arcs.first[arc] + part * (arcs.last[arc] - arcs.first[arc])
    trace[rows[:, None], arcs.axes[arc]] = (
        arcs.centre[arc] + np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]
    )
    for i, spline in moves.spline_moves():
        if spline.path is not None:
            at = spline.path(np.linspace(0.0, spline.path.length, count[i] + 1)[1:])
            for column, axis in enumerate(spline.path.axes):
                if axis in "xyz":
                    trace[end[i] - count[i] : end[i], "xyz".index(axis)] = at[:, column]
    return end, np.concatenate([moves.start[None, :3], trace])

"""The blocks of a program as arrays: what a control needs of each to plan its feed."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import registry
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.arcs import Arcs
from splinefeed.formats.gcode.ends import Ends
from splinefeed.formats.gcode.moves import AXES, LETTERS, LINEAR, RAPID, Mark, Moves, Spline
from splinefeed.formats.gcode.offsets import REFERENCES
from splinefeed.formats.gcode.piece import NO_LENGTH
from splinefeed.formats.gcode.to_path import Program
from splinefeed.machine.control import Control, Place
from splinefeed.records import Array, BoolArray, IntArray

#: Places along a spline at which its radius is measured, and chords of a trace for each of its control points.
_PLACES, _CHORDS = 65, 8
#: Turn of an arc within a chord of a trace at most, rad.
_CHORD = np.pi / 36.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """The moves of a program, (n,) each, without blocks that have no length.

    line        of the file; rapid  whether it is G0; length  mm, of rotary moves alone deg; feed  mm/s, inf where none
    step        (n, 9) mm and rad; moved  (n, 9) whether an axis moves, as on a full circle, whose step is 0
    first, last (n, 6) direction at start and end over the linear axes
    radius      mm, inf on lines, the least of a spline or spiral; tolerance  of G64 P, mm, NaN where none is given
    kink        rad: sqrt(2 d / r) of an arc whose radii at its ends differ by d, else 0
    stops       whether the tool stops at its end (G61.1)
    end         row of `trace` at which it ends
    trace       (k, 3) X, Y and Z along the program, from its start, mm: arcs and splines as chords
    marks       other events, each before the block of its number; findings  of the reader
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

    def __len__(self) -> int:
        return len(self.line)


#: Fields of `Blocks` that have one row a block.
_ARRAYS = ("line", "rapid", "length", "feed", "step", "moved", "first", "last", "radius", "kink", "tolerance", "stops",
           "end")  # fmt: skip


def read_blocks(file: str | os.PathLike[str], control: Control, **options: Any) -> Blocks:
    """Read the program in `file` with the options of `splinefeed.read`; `control` says where G28 and changes go.

    Raises FormatError with the line that is wrong, or where nothing moves.
    """
    if (found := registry.format_of(file, any_size=True)).module != "gcode":
        raise FormatError(f"{file}: is read as {found.title}; expected a G-code program")
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
    (piece,) = program.pieces([moves], reading, np.arange(AXES), len(moves))
    step, rapid = moves.ends - moves.starts, moves.kind == RAPID
    end, trace = _trace(moves, piece.arcs, step)
    ways = _by_way_of_changes(step, moves, control.change_place)
    length = np.where(rapid, _straight(step), piece.lengths)
    feed = piece.programmed_feeds
    if missing := moves.line[(feed <= 0.0) & ~rapid & (length > NO_LENGTH)].tolist():
        reading.findings.say(f"line {missing[0]}: no feed before it (F): timed as rapid")
    kink, arcs, moved = np.zeros(len(moves)), piece.arcs, step != 0.0
    moved[arcs.move[:, None], arcs.axes] = True
    kink[arcs.move] = np.sqrt(4.0 * np.abs(arcs.first - arcs.last) / (arcs.first + arcs.last))
    ends = Ends.of(moves, arcs)
    first, last = (np.nan_to_num(each) for each in ends.tangents)
    for i, spline in moves.spline_moves():
        moved[i] = np.ptp(spline.points, axis=0) > 0.0
        ends.radius[i] = _radius(spline)
    tolerance = moves.values[:, layout.ROW_TOLERANCE]
    made = Blocks(
        moves.line, rapid, length, np.where((feed <= 0.0) | rapid, np.inf, feed), step, moved, first, last, ends.radius,
        kink, np.where(tolerance >= 0.0, tolerance, np.nan), moves.flags & layout.STOPS != 0, end, trace,
        tuple(moves.marks), (),
    )  # fmt: skip
    made = _with_length(_with_ways(made, ways))
    if not len(made):
        raise FormatError(f"{file}: no move has a length; is the program complete?")
    return replace(made, findings=tuple(reading.findings.all()))


def _with_length(blocks: Blocks) -> Blocks:
    """Without blocks that have no length."""
    kept = np.flatnonzero(blocks.length > NO_LENGTH)
    numbers = np.searchsorted(kept, [mark.move for mark in blocks.marks])
    marks = tuple(replace(mark, move=int(k)) for mark, k in zip(blocks.marks, numbers, strict=True))
    return replace(blocks, **{name: getattr(blocks, name)[kept] for name in _ARRAYS}, marks=marks)


def _with_ways(blocks: Blocks, ways: Mapping[int, Array]) -> Blocks:
    """With a rapid block behind each mark of that number: the way (9,) to where tools are changed."""
    if not ways:
        return blocks
    at = [blocks.marks[number].move for number in ways]
    steps = np.array(list(ways.values()))
    size = np.linalg.norm(steps[:, LINEAR], axis=1)
    straight = steps[:, LINEAR] / np.maximum(size, NO_LENGTH)[:, None]
    more: dict[str, Any] = {
        "line": [blocks.marks[number].line for number in ways], "rapid": True, "length": size, "feed": np.inf,
        "step": steps, "moved": steps != 0.0, "first": straight, "last": straight, "radius": np.inf, "kink": 0.0,
        "tolerance": np.nan, "stops": False, "end": np.append(blocks.end, 0)[np.array(at) - 1],
    }  # fmt: skip
    arrays = {name: np.insert(getattr(blocks, name), at, more[name], axis=0) for name in _ARRAYS}
    before = np.searchsorted(list(ways), np.arange(len(blocks.marks)), "left").tolist()
    marks = tuple(replace(mark, move=mark.move + k) for mark, k in zip(blocks.marks, before, strict=True))
    return replace(blocks, **arrays, marks=marks)


def _straight(step: Array) -> Array:
    """Lengths (n,) of straight moves (n, 9): mm, of rotary moves alone deg."""
    length = np.linalg.norm(step[:, LINEAR], axis=1)
    out: Array = np.where(length > 0.0, length, np.rad2deg(np.linalg.norm(step[:, 3:6], axis=1)))
    return out


def _by_way_of_changes(step: Array, moves: Moves, place: Place) -> dict[int, Array]:
    """The way (9,) to where tools change, by number of each M6 mark; rapid moves in `step` behind it begin there."""
    there = {axis: value for axis, value in enumerate((place.x, place.y, place.z)) if value is not None}
    ways = {}
    for number, mark in enumerate(moves.marks if there else ()):
        if "M6" not in mark.text.split():
            continue
        at = moves.starts[mark.move] if mark.move < len(moves) else moves.ends[-1]
        away = {axis: value - at[axis] for axis, value in there.items()}
        ways[number] = np.array([away.get(axis, 0.0) for axis in range(AXES)])
        for move in range(mark.move, len(moves)):
            if not away or moves.kind[move] != RAPID:
                break
            stated = int(moves.codes[move, layout.AXES]) >> layout.STATED
            for axis in [axis for axis in away if stated >> axis & 1]:
                step[move, axis] -= away.pop(axis)
    return ways


def _radius(spline: Spline) -> float:
    """The least radius between places along a spline, mm: a cusp between two of them is passed as a corner is."""
    if spline.path is None:
        return math.inf
    legs = np.diff(spline.path(np.linspace(0.0, spline.path.length, _PLACES)), axis=0)
    sizes = np.maximum(np.linalg.norm(legs, axis=1), 1e-300)
    turns = np.linalg.norm(np.diff(legs / sizes[:, None], axis=0), axis=1)
    return float(np.min(0.5 * (sizes[:-1] + sizes[1:]) / np.maximum(turns, 1e-12)))


def _trace(moves: Moves, arcs: Arcs, step: Array) -> tuple[IntArray, Array]:
    """The row (n,) at which each move ends, and X, Y and Z (k, 3) along all of them, the first row where they begin."""
    count = np.ones(len(moves), dtype=np.int64)
    count[arcs.move] = np.maximum(np.ceil(np.abs(arcs.sweep) / _CHORD), 1.0)
    for i, spline in moves.spline_moves():
        count[i] = _CHORDS * len(spline.points)
    end = np.cumsum(count)
    move = np.repeat(np.arange(len(moves)), count)
    share = (np.arange(1, len(move) + 1) - (end - count)[move]) / count[move]
    trace = moves.starts[move, :3] + share[:, None] * step[move, :3]
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


def letter(axis: int) -> str:
    """Name of the axis of a column, as machine files have it."""
    return LETTERS[axis].lower()

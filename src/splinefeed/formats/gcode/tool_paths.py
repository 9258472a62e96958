"""Programs under tool centre point control as tool paths: the tip is a path, the tool axis stands beside it.

Where the control goes on or off, or another tool comes, one path ends and the next one begins. So it does where the
tool turns while its tip rests: arc length of the tip says nothing there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.moves import LETTERS, LINE, RAPID, ROTARY, Findings, Moves
from splinefeed.formats.gcode.tool_tip import TOOL_AXIS
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.geometry.resolution import RESOLUTION
from splinefeed.geometry.tool_path import ANGLES, JUMP, VECTORS, ToolPath, beside
from splinefeed.records import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from splinefeed.formats.gcode.to_path import Piece

#: Bits of X, Y and Z.
_XYZ = 7
_CENTRE = slice(layout.CENTER, layout.CENTER + 3)
#: Makes a Piece of moves, with how many of them are left out, those without length, the others, and places between.
Make = Callable[[Moves, IntArray, int, BoolArray, IntArray, Array], "Piece"]
#: Makes a path of a name.
Named = Callable[[str], Path]


def sections(moves: Moves) -> Iterator[tuple[Moves, bool, float]]:
    """Moves under the same control, in order: whether places are the tool's tip, and the tool's length, mm."""
    tip = moves.flags & layout.TIP != 0
    lengths = [(mark.move, mark.length) for mark in moves.marks if mark.length is not None]
    inner = np.union1d(np.flatnonzero(np.diff(tip)) + 1, np.array([at for at, _ in lengths], dtype=np.int64))
    bounds = [0, *inner[(inner > 0) & (inner < len(moves))].tolist(), len(moves)]
    for low, high in pairwise(bounds):
        said = [length for at, length in lengths if at <= low]
        part = moves.part(low, high)
        marks = tuple(mark for mark in part.marks if mark.length is None)
        yield replace(part, marks=marks), bool(tip[low]), said[-1] if said else math.nan


def tool_paths(
    moves: Moves, length: float, rotary: Sequence[int], known: int, make: Make, file: str, findings: Findings
) -> Iterator[Named]:
    """What makes the tool paths of moves under tool centre point control, one call each.

    length  of the tool, mm, or not a number; rotary  columns of the rotary axes that the program moves
    known   bits of the axes whose places are stated before
    """
    vectors = moves.flags & layout.VECTOR != 0
    _check_one_way(moves, vectors, file)
    axis = _axes(moves, vectors) if vectors.any() else None
    columns = np.array([0, 1, 2] if axis is not None else [0, 1, 2, *rotary], dtype=np.int64)
    needed = TOOL_AXIS | _XYZ if axis is not None else sum(1 << int(column) for column in columns)
    first = _first(moves, needed, known, findings)
    for low, high in _runs(moves, first, axis, rotary, findings):
        part = moves.part(low, high)
        none = np.zeros(len(part), dtype=bool)
        step = np.linalg.norm((part.ends - part.starts)[:, :3], axis=1)
        none[(part.kind <= LINE) & (step <= RESOLUTION)] = True
        kept = np.flatnonzero(~none)
        if not len(kept):
            continue
        places = np.concatenate([part.starts[:1], part.ends[kept]])
        piece = make(part, columns, 0, none, kept, places)
        ends = None if axis is None else np.stack([axis[low:high], axis[low + 1 : high + 1]], axis=1)[kept]
        yield partial(_tool_path, piece, ends, tuple(LETTERS[column].lower() for column in rotary), length)


def _check_one_way(moves: Moves, vectors: BoolArray, file: str) -> None:
    """FormatError where both vectors and rotary words say how the tool stands."""
    said = moves.codes[:, layout.AXES] & sum(1 << column for column in ROTARY) != 0
    if vectors.any() and said.any():
        both = int(moves.line[np.flatnonzero(said)[0]])
        raise FormatError(
            f"{file}: line {both}: a rotary axis is programmed, and line "
            f"{int(moves.line[np.argmax(vectors)])} gives the "
            "tool axis as a vector; write one of them"
        )


def _axes(moves: Moves, vectors: BoolArray) -> Array:
    """Unit vectors (n + 1, 3) of the tool axis before the first move and behind each; upright before the first one."""
    rows = np.concatenate([[[0.0, 0.0, 1.0]], moves.values[:, _CENTRE]])
    last = np.maximum.accumulate(np.concatenate([[0], np.where(vectors, np.arange(1, len(moves) + 1), 0)]))
    found = rows[last]
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _first(moves: Moves, needed: int, known: int, findings: Findings) -> int:
    """How many rapid moves only lead to the first place of tip and tool axis; a finding says so."""
    stated = moves.codes[:, layout.AXES] >> layout.STATED
    for i in range(len(moves)):
        missing = needed & ~known
        if not missing:
            if i:
                findings.say(
                    f"{i} rapid move(s) to the first place of the tool, up to line {moves.line[i - 1]}, are left out"
                )
            return i
        if moves.kind[i] != RAPID:
            names = [letter for column, letter in enumerate(LETTERS) if missing >> column & 1]
            names += ["the tool axis (upright)"] if missing & TOOL_AXIS else []
            findings.say(
                f"line {moves.line[i]}: where {', '.join(names)} is before this move is unknown: taken as it was "
                "before tool centre point control began; write a rapid move (G0) with all of them"
            )
            return i
        known |= int(stated[i])
    return len(moves) if not needed & ~known else 0


def _runs(
    moves: Moves, first: int, axis: Array | None, rotary: Sequence[int], findings: Findings
) -> Iterator[tuple[int, int]]:
    """Moves from one to the one before another between which the tool does not turn while its tip rests."""
    step = moves.ends - moves.starts
    still = (moves.kind <= LINE) & (np.linalg.norm(step[:, :3], axis=1) <= RESOLUTION)
    turn = np.linalg.norm(step[:, list(rotary)] if axis is None else np.diff(axis, axis=0), axis=1)
    cut = np.flatnonzero(still & (turn > JUMP) & (np.arange(len(moves)) >= first))
    for line in moves.line[cut].tolist():
        findings.count(
            "the tool turns while its tip stands still; one path ends before it and the next begins after it", line
        )
    yield from zip([first, *(cut + 1).tolist()], [*cut.tolist(), len(moves)], strict=True)


def _tool_path(piece: Piece, ends: Array | None, rotary: tuple[str, ...], length: float, name: str) -> ToolPath:
    """The tool path of a piece; ends (k, 2, 3) are the tool axes of its curves, None where angles stand behind z."""
    feeds = piece.feeds
    curves = piece.curves()
    tips = [beside(curve, curve.control_points[:, :3]) for curve in curves]
    axes: list[NurbsCurve] | None = None
    if ends is not None:
        axes = []
        for curve, (begin, end) in zip(tips, ends, strict=True):
            count = len(curve.control_points)
            share = np.linspace(0.0, 1.0, count)[:, None]  # a line has two; on others the axis stands still
            axes.append(beside(curve, begin + share * (end - begin)))
    elif rotary:
        axes = [beside(curve, curve.control_points[:, 3:]) for curve in curves]
    tolerances, said = piece.tolerances
    try:
        return ToolPath(
            tips,
            axes,
            kind=ANGLES if ends is None else VECTORS,
            rotary=rotary if ends is None else (),
            lines=piece.moves.line[piece.kept],
            tool_length=None if math.isnan(length) else length,
            name=name,
            feeds=feeds,
            findings=piece.findings.all(),
            tolerances=tolerances if said else None,
            markers=piece.markers,
        )
    except CurveError as error:
        raise FormatError(f"{piece.file}: {error}") from None

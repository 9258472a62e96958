"""Programs under tool centre point control as tool paths: the tip is a path, the tool axis stands beside it.

Where the control goes on or off, or another tool comes, one path ends and the next one begins. So it does where the
tool turns while its tip holds its position: arc length of the tip says nothing there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, FormatError
from splinefeed.paths.path import Path
from splinefeed.paths.resolution import RESOLUTION
from splinefeed.paths.tool_path import ANGLES, JUMP, VECTORS, ToolPath, beside
from splinefeed.programs.gcode.moves import LETTERS, ROTARY, STATED, Flag, MoveKind, Moves
from splinefeed.programs.gcode.piece import NOTHING, Piece, leading, say_leading
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.tool_tip import TOOL_AXIS
from splinefeed.records import Array

#: Bits of X, Y and Z, and of the rotary axes.
_XYZ, _TURNS = 7, sum(1 << column for column in ROTARY)


def tool_paths(
    moves: Moves,
    reading: Reading,
    keeps_start: bool,
    in_joints: Callable[[Moves], Piece],
) -> list[Path]:
    """Make the tool paths of a program, and what it does in joints with a feed between them.

    Parameters
    ----------
    moves : Moves
        Of the whole program.
    reading : Reading
        Whose findings take what there is to say.
    keeps_start : bool
        Whether the user said where the tool is before the first line.
    in_joints : callable
        Makes a piece of moves that are not under tool centre point control.

    Returns
    -------
    list of Path
        In order.
    """
    rotary = [column for column in ROTARY if moves.axes >> column & 1]
    known, makers = (-1 if keeps_start else 0), list[Callable[[str], Path]]()
    for part, tip, length in _sections(moves):
        if tip:
            found = _under_control(part, reading, rotary, known)
            makers += [partial(_tool_path, piece, axes, rotary, length) for piece, axes in found]
        elif np.any(part["kind"] != MoveKind.RAPID):
            piece = in_joints(part)
            makers += [piece.path] if len(piece.kept) else []
        else:
            for line in part["line"].tolist():
                reading.findings.count("rapid moves without tool centre point control are left out", line)
        known |= part.axes >> STATED & _TURNS
    if not makers:
        raise FormatError(f"{reading.file}: {NOTHING}")
    stem = reading.file.stem
    return [make(stem if len(makers) == 1 else f"{stem}-{i}") for i, make in enumerate(makers, start=1)]


def _sections(moves: Moves) -> Iterator[tuple[Moves, bool, float]]:
    """Moves under the same control, in order: whether places are the tool's tip, and the tool's length, mm."""
    tip = moves.has(Flag.TIP)
    lengths = [(mark.move, mark.length) for mark in moves.marks if mark.length is not None]
    inner = {*(np.flatnonzero(np.diff(tip)) + 1).tolist(), *(at for at, _ in lengths)}
    for low, high in pairwise([0, *sorted(at for at in inner if 0 < at < len(moves)), len(moves)]):
        said = [length for at, length in lengths if at <= low]
        part = moves.part(low, high)
        marks = tuple(mark for mark in part.marks if mark.length is None)
        yield replace(part, marks=marks), bool(tip[low]), said[-1] if said else math.nan


def _under_control(
    moves: Moves, reading: Reading, rotary: Sequence[int], known: int
) -> Iterator[tuple[Piece, Array | None]]:
    """Pieces, with the tool axes (k, 2, 3) of their curves: none turns the tool while its tip holds its position.

    The axes are None where angles stand behind z; `known` are bits of the axes whose places are stated before.
    """
    vectors = moves.has(Flag.VECTOR)
    turned = moves["axes"] & _TURNS != 0
    axis: Array | None = None
    if vectors.any():
        if turned.any():
            raise FormatError(
                f"{reading.file}: line {moves['line'][np.argmax(turned)]}: a rotary axis is programmed, and line "
                f"{moves['line'][np.argmax(vectors)]} gives the tool axis as a vector; write one of them"
            )
        # before the first move and behind each, (n + 1, 3); upright before the first vector
        rows = np.concatenate([[[0.0, 0.0, 1.0]], moves["centre"]])
        axis = rows[np.maximum.accumulate(np.append(0, np.where(vectors, np.arange(1, len(rows)), 0)))]
        axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    columns = np.array([0, 1, 2] if axis is not None else [0, 1, 2, *rotary], dtype=np.int64)
    needed = TOOL_AXIS | _XYZ if axis is not None else sum(1 << int(column) for column in columns)
    first, missing = leading(moves, needed, known)
    if first == len(moves) and missing:
        first = 0  # rapid moves alone: all of them are the path
    else:
        names = [*LETTERS, "the tool axis (upright)"]
        names = [name for column, name in enumerate(names) if missing >> column & 1]
        say_leading(moves, first, names, "as it was before tool centre point control began", reading.findings)
    step = moves.step
    still = (moves["kind"] <= MoveKind.LINE) & (np.linalg.norm(step[:, :3], axis=1) <= RESOLUTION)
    turn = np.linalg.norm(step[:, list(rotary)] if axis is None else np.diff(axis, axis=0), axis=1)
    cut = np.flatnonzero(still & (turn > JUMP) & (np.arange(len(moves)) >= first))
    for line in moves["line"][cut].tolist():
        reading.findings.count(
            "the tool turns while its tip stands still; one path ends before it and the next begins after it", line
        )
    for low, high in zip([first, *(cut + 1).tolist()], [*cut.tolist(), len(moves)], strict=True):
        piece = Piece(moves.part(low, high), columns, reading, tip=True)
        if len(piece.kept):
            both = None if axis is None else np.stack([axis[low:high], axis[low + 1 : high + 1]], axis=1)
            yield piece, None if both is None else both[piece.kept]


def _tool_path(piece: Piece, ends: Array | None, rotary: Sequence[int], length: float, name: str) -> ToolPath:
    curves = piece.curves()
    tips = [beside(curve, curve.control_points[:, :3]) for curve in curves]
    axes: list[NurbsCurve] | None = None
    if ends is not None:  # a line has two control points; on others the axis stands still
        shares = [np.linspace(0.0, 1.0, len(curve.control_points))[:, None] for curve in tips]
        axes = [
            beside(curve, begin + share * (end - begin))
            for curve, share, (begin, end) in zip(tips, shares, ends, strict=True)
        ]
    elif rotary:
        axes = [beside(curve, curve.control_points[:, 3:]) for curve in curves]
    try:
        return ToolPath(
            tips,
            axes,
            kind=ANGLES if ends is None else VECTORS,
            rotary=tuple(LETTERS[column].lower() for column in rotary) if ends is None else (),
            tool_length=None if math.isnan(length) else length,
            **piece.said(name),
        )
    except CurveError as error:
        raise FormatError(f"{piece.file}: {error}") from None

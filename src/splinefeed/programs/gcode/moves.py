"""Moves: what a program does, one row of an array each, in machine coordinates, mm and rad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.curves.curve import NurbsCurve
from splinefeed.paths.path import Path
from splinefeed.records import Array, BoolArray

#: Letters of the axes in the order of the columns.
LETTERS = "XYZABCUVW"
AXES = len(LETTERS)
#: Distance and angle of polar coordinates in X and Y.
POLAR = "@^"
ROTARY = (3, 4, 5)
LINEAR = [0, 1, 2, 6, 7, 8]
#: Order of the axes in a path: linear ones first.
PATH_ORDER = (0, 1, 2, 6, 7, 8, 3, 4, 5)

#: Longest line that is read, characters, and largest word, mm or rad.
MAX_LINE, LARGEST = 4096, 1e9


class MoveKind(IntEnum):
    """Of a move: G0 to G3, and splines."""

    RAPID, LINE, CLOCKWISE, COUNTERCLOCKWISE, SPLINE = range(5)


#: First and second axis of each plane, counterclockwise from the first to the second.
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}

#: A move: place at its end; words of its centre, radius and turns; feed, mm or deg a minute, or one over minutes;
#: tolerance, mm; kind, line of the file, plane, flags, number of its spline or -1; bits of the axes that it concerns,
#: and from STATED on of those whose place the program states.
ROW = np.dtype(
    [("end", "f8", AXES), ("centre", "f8", 3), *((name, "f8") for name in ("radius", "turns", "feed", "tolerance"))]
    + [(name, "i8") for name in ("kind", "line", "plane", "flags", "spline", "axes")]
)
STATED = 16


class Flag(IntFlag):
    """Bits of a move: I, J, K, R are given; in `centre` is an absolute place, or the tool axis at the end (VECTOR).

    G0_AT_F is a line that a printer has as G0, TIED one that goes with the angle of the spindle: G33, G33.1, G76.
    """

    I, J, K, R, ABSOLUTE, VECTOR, INVERSE_FEED, STOPS, INCH, TIP, G0_AT_F, TIED = (1 << bit for bit in range(12))  # noqa: E741


@dataclass(frozen=True)
class SplineMove:
    """A NURBS of a program.

    Parameters
    ----------
    degree : int
        Of the curve.
    knots : array (n + degree + 1,)
        Not decreasing.
    points : array (n, 9)
        Control points, mm and rad.
    weights : array (n,)
        Positive.
    line : int
        Where it begins.
    """

    degree: int
    knots: Array
    points: Array
    weights: Array
    line: int

    @cached_property
    def path(self) -> Path | None:
        """It alone over the linear axes that it moves; None if there are none."""
        moving = [column for column in LINEAR if np.ptp(self.points[:, column]) > 0.0]
        if not moving:
            return None
        curve = NurbsCurve(self.degree, self.knots, self.points[:, moving], self.weights)
        return Path([curve], [LETTERS[column].lower() for column in moving])

    @classmethod
    def bezier(cls, points: Array, line: int) -> SplineMove:
        """A polynomial curve of one span by its control points (n, 9)."""
        return cls(len(points) - 1, np.repeat([0.0, 1.0], len(points)), points, np.ones(len(points)), line)


@dataclass(frozen=True)
class Mark:
    """What is not a motion; see `paths.Marker`.

    Parameters
    ----------
    move : int
        Number of the move of its chunk before which it is.
    line : int
        Of the program.
    text : str, optional
        Its words.
    dwell : float, optional
        s.
    stop : bool, optional
        Whether the tool stops there.
    length : float or None, optional
        Of the tool whose tip X, Y and Z are from here on, mm, not a number where no table says it; else None.
    """

    move: int
    line: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True
    length: float | None = None


@dataclass(frozen=True)
class Moves:
    """Some moves in a row.

    Parameters
    ----------
    start : array (9,)
        Where the first one begins, mm and rad.
    rows : array (n,) of ROW
        The moves.
    splines : sequence of SplineMove, optional
        What the rows point into.
    marks : sequence of Mark, optional
        What is not a motion.
    """

    start: Array
    rows: NDArray[np.void]
    splines: Sequence[SplineMove] = ()
    marks: Sequence[Mark] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.rows[name]

    @cached_property
    def starts(self) -> Array:
        """Where each one begins, (n, 9)."""
        return np.concatenate([self.start[None, :], self["end"]])[: len(self)]

    def has(self, flag: Flag) -> BoolArray:
        """Which ones have a flag, (n,)."""
        has: BoolArray = self["flags"] & flag != 0
        return has

    @property
    def step(self) -> Array:
        """From where each one begins to its end, (n, 9)."""
        step: Array = self["end"] - self.starts
        return step

    def spline_moves(self) -> list[tuple[int, SplineMove]]:
        """Number and spline of each move that is one."""
        return [(i, self.splines[self["spline"][i]]) for i in np.flatnonzero(self["kind"] == MoveKind.SPLINE).tolist()]

    def part(self, low: int, high: int) -> Moves:
        """The moves from `low` to the one before `high`, with the marks before them and, at the end, behind them."""
        if low == 0 and high == len(self):
            return self
        last = len(self) if high == len(self) else high - 1
        marks = tuple(replace(mark, move=mark.move - low) for mark in self.marks if low <= mark.move <= last)
        return Moves(self["end"][low - 1] if low else self.start, self.rows[low:high], self.splines, marks)

    @property
    def axes(self) -> int:
        """Bits of the axes that any of them concerns, and from STATED on of those that any states."""
        return int(np.bitwise_or.reduce(self["axes"]))


def joined(parts: Sequence[Moves]) -> Moves:
    """Moves one after the other as one record."""
    if len(parts) == 1:
        return parts[0]
    marks: list[Mark] = []
    splines: list[SplineMove] = []
    rows = np.concatenate([np.zeros(0, ROW), *(part.rows for part in parts)])
    count = 0
    for part in parts:
        chosen = rows["spline"][count : count + len(part)]
        chosen[chosen >= 0] += len(splines)
        marks += [replace(mark, move=mark.move + count) for mark in part.marks]
        splines += part.splines
        count += len(part)
    return Moves(parts[0].start if parts else np.zeros(AXES), rows, tuple(splines), tuple(marks))


@dataclass
class Findings:
    """What a reader has to say: sentences once each, and faults of one kind counted with the lines of the first few."""

    found: dict[str, list[int]] = field(default_factory=dict)  # how many, and where; nothing for what is not counted

    #: How many lines a finding names.
    NAMED = 3

    def say(self, sentence: str) -> None:
        """Add a sentence unless it is there."""
        self.found.setdefault(sentence, [])

    def count(self, what: str, line: int) -> None:
        """One more fault of the kind `what`, at `line`; {count} in it becomes their number, else a line counts once."""
        counted = self.found.setdefault(what, [0])
        if counted[-1] == line and len(counted) > 1 and "{count}" not in what:
            return
        counted[0] += 1
        if len(counted) <= self.NAMED:
            counted.append(line)

    def all(self, place: str = "line") -> list[str]:
        """All of it, one sentence each; `place` is what the numbers beside the faults count."""
        said = []
        for what, (count, *lines) in ((what, counted or [0]) for what, counted in self.found.items()):
            more = f" and {count - len(lines)} more" if count > len(lines) else ""
            where = f": {place} {', '.join(map(str, lines))}{more}" if count else ""
            said.append(what.replace("{count}", str(count)) + where)
        return said

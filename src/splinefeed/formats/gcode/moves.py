"""Moves: what a program does, as flat arrays, in machine coordinates, mm and rad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from splinefeed.formats.gcode import layout
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.records import Array, IntArray

#: Letters of the axes in the order of the columns.
LETTERS = "XYZABCUVW"
AXES = len(LETTERS)
#: Distance and angle of polar coordinates in X and Y.
POLAR = "@^"
ROTARY = (3, 4, 5)
LINEAR = [0, 1, 2, 6, 7, 8]
#: Order of the axes in a path: linear ones first.
PATH_ORDER = (0, 1, 2, 6, 7, 8, 3, 4, 5)

RAPID, LINE, CLOCKWISE, COUNTERCLOCKWISE, SPLINE = range(5)


@dataclass(frozen=True)
class Spline:
    """A NURBS of a program: knots, control points (n, 9) in mm and rad, weights (n,), and the line where it begins."""

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
    def bezier(cls, points: Array, line: int) -> Spline:
        """A polynomial curve of one span by its control points (n, 9)."""
        return cls(len(points) - 1, np.repeat([0.0, 1.0], len(points)), points, np.ones(len(points)), line)


@dataclass(frozen=True)
class Mark:
    """What is not a motion, before move number `move` of its chunk; see `geometry.path.Marker`.

    length  of the tool, mm, whose tip X, Y and Z are from here on, not a number where no table says it; else None
    """

    move: int
    line: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True
    length: float | None = None


@dataclass(frozen=True)
class Moves:
    """Some moves in a row, (n,) each.

    start    (9,) where the first one begins
    values   (n, 16) ends of 9 axes, words of arcs, feed and tolerance; codes  (n, 6) kind, line of the file, plane,
             flags, spline and axes: both as `layout` lays them out
    splines  what the codes point into; marks  what is not a motion
    """

    start: Array
    values: Array
    codes: IntArray
    splines: Sequence[Spline] = ()
    marks: Sequence[Mark] = ()

    def __len__(self) -> int:
        return len(self.values)

    @property
    def kind(self) -> IntArray:
        """RAPID, LINE, CLOCKWISE, COUNTERCLOCKWISE or SPLINE, (n,)."""
        return self.codes[:, layout.KIND]

    @property
    def line(self) -> IntArray:
        """Number of the line in the file, from 1, (n,)."""
        return self.codes[:, layout.ROW_LINE]

    @property
    def flags(self) -> IntArray:
        """Bits as in `layout`, (n,)."""
        return self.codes[:, layout.FLAGS]

    @property
    def ends(self) -> Array:
        """Where each one leads, (n, 9)."""
        return self.values[:, :AXES]

    @cached_property
    def starts(self) -> Array:
        """Where each one begins, (n, 9)."""
        return np.concatenate([self.start[None, :], self.ends[:-1]]) if len(self) else self.ends

    def spline_moves(self) -> list[tuple[int, Spline]]:
        """Number and spline of each move that is one."""
        numbers = np.flatnonzero(self.kind == SPLINE).tolist()
        return [(i, self.splines[int(self.codes[i, layout.SPLINE])]) for i in numbers]

    def part(self, low: int, high: int) -> Moves:
        """The moves from `low` to the one before `high`, with the marks before them and, at the end, behind them."""
        if low == 0 and high == len(self):
            return self
        marks = [
            replace(mark, move=mark.move - low)
            for mark in self.marks
            if low <= mark.move and (mark.move < high or high == len(self))
        ]
        start = self.start if low == 0 else self.ends[low - 1]
        return Moves(start, self.values[low:high], self.codes[low:high], self.splines, tuple(marks))

    @property
    def used(self) -> int:
        """Bits of the axes that any of them concerns."""
        return int(np.bitwise_or.reduce(self.codes[:, layout.AXES])) & 0x1FF if len(self) else 0


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
        """One more fault of the kind `what`, at `line`; {count} in it becomes their number."""
        counted = self.found.setdefault(what, [0])
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

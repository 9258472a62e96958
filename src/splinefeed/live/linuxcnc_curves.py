"""True curves in place of the arcs that LinuxCNC makes of a block of G5.2: from the program, read as it reads it."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path as File
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import split
from splinefeed.errors import SplinefeedError
from splinefeed.files.source import read_text
from splinefeed.formats.registry import read
from splinefeed.live.linuxcnc_limits import Mill
from splinefeed.live.linuxcnc_moves import curve_of
from splinefeed.live.linuxcnc_pieces import at_knots
from splinefeed.records import IntArray

#: What a program has that has such blocks.
SPLINE = re.compile(r"(?i)G\s*0*5\.2(?![0-9])")
#: Letters that are looked at in one go, and how many of them again: the planner's other threads go on in between.
AT_ONCE, AGAIN = 2**18, 100
#: Ends of a curve and of its arcs are one place, mm; ends of arcs within lie this near, share of the curve's length.
SAME_END, NEAR = 1e-5, 0.02
#: A curve is cut for its moves at a knot that is nearer than this share of its domain.
SAME_PLACE = 0.002


def appears(pattern: re.Pattern[str], text: str) -> bool:
    """Whether a pattern of a few letters is in a text of any length."""
    return any(pattern.search(text, at, at + AT_ONCE + AGAIN) for at in range(0, len(text), AT_ONCE))


class ProgramCurves:
    """Curves of a program's G5.2 blocks by its lines.

    Parameters
    ----------
    file : str
        The program.
    mill : Mill
        The machine that runs it.
    say : callable
        Takes a line where arcs are planned in their place.
    """

    def __init__(self, file: str, mill: Mill, say: Callable[[str], None]) -> None:
        self.mill, self._say = mill, say
        self._fell: set[int] = set()
        self._begins: list[int] = []  # line of each curve of the path, in order, once
        self._curves: dict[int, NurbsCurve] = {}
        self._columns: IntArray = np.zeros(0, dtype=np.int64)
        try:
            if not appears(SPLINE, read_text(File(file), "a program")):
                return
            path = read(file, dialect="linuxcnc")
            if path.needs_machine or path.lines is None:
                raise SplinefeedError("it is no path of linear axes")
        except SplinefeedError as error:
            say(f"curves of G5.2 are planned as LinuxCNC's arcs: {error}")
            return
        self._columns = np.array([mill.axes.index(axis) for axis in path.axes if axis in mill.axes])
        if len(self._columns) != len(path.axes):
            return
        lines, count = np.unique(path.lines, return_counts=True)
        self._begins = lines.tolist()
        single = set(lines[count == 1].tolist())
        for line, curve in zip(path.lines.tolist(), path.joined, strict=True):
            if line in single and len(np.unique(curve.knots)) > 2:
                self._curves[line] = curve

    def _line(self, move: Any) -> int:
        """The line at which the block of a move begins, if that is one of G5.2 that began before it; else -1."""
        line = int(move["line"])
        at = int(np.searchsorted(self._begins, line, side="right")) - 1
        begin = self._begins[at] if at >= 0 else -1
        return begin if begin < line and begin in self._curves else -1

    def runs(self, moves: Any) -> list[tuple[int, int, int]]:
        """Moves that are of one block: its line, first of them and the one behind the last, in order."""
        if not self._curves:
            return []
        lines = np.array([self._line(move) for move in moves])
        edges = [0, *(np.flatnonzero(np.diff(lines)) + 1).tolist(), len(lines)]
        return [(int(lines[a]), a, b) for a, b in pairwise(edges) if lines[a] >= 0]

    def _placed(self, line: int, moves: Any) -> NurbsCurve:
        """The curve of a block where its first move begins."""
        curve = self._curves[line]
        start = (moves[0]["from"] * self.mill.units)[self.mill.columns]
        points = np.tile(start, (len(curve.control_points), 1))
        points[:, self._columns] += curve.control_points - curve(curve.domain[0])
        return NurbsCurve(curve.degree, curve.knots, points, curve.weights)

    def whole(self, line: int, moves: Any) -> bool:
        """Whether the moves of a block end where its curve does."""
        end = (moves[-1]["to"] * self.mill.units)[self.mill.columns]
        curve = self._placed(line, moves)
        return bool(np.max(np.abs(curve(curve.domain[1]) - end)) < SAME_END)

    def curves_of(self, moves: Any) -> list[NurbsCurve]:
        """A curve for each move: a part of the true one where its block is whole and its arcs near, else its own."""
        out = [curve_of(move, self.mill) for move in moves]
        for line, a, b in self.runs(moves):
            parts = self._parts(line, moves[a:b], out[a:b]) if self.whole(line, moves[a:b]) else []
            if parts:
                out[a:b] = parts
            elif line not in self._fell:
                self._fell.add(line)
                self._say(f"line {line}: LinuxCNC's arcs do not end where the curve of G5.2 does; they are planned")
        return out

    def _parts(self, line: int, moves: Any, arcs: list[NurbsCurve]) -> list[NurbsCurve]:
        """The curve of a block in as many parts as it has arcs; none where an arc ends far from it."""
        curve = self._placed(line, moves)
        if len(arcs) == 1:
            return [curve]
        cuts, off = curve.nearest(np.array([arc(arc.domain[1]) for arc in arcs[:-1]]))
        low, high = curve.domain
        cuts = at_knots(curve, cuts, SAME_PLACE)
        if np.any(np.diff(np.concatenate([[low], cuts, [high]])) <= 0.0) or off.max() > NEAR * curve.length:
            return []
        return split(curve, *cuts.tolist())

"""Corners between two lines that a word rounds or bevels: Fanuc's ,R and ,C, Siemens' RND=, CHR= and CHF=.

C is the distance from the corner to where the chamfer begins and ends, R the radius of an arc that touches both
lines [1]_. CHR is that distance, CHF the length of the chamfer itself, RND the radius [2]_.

References
----------
.. [1] Fanuc B-64484EN, "Optional chamfering and corner R".
.. [2] SINUMERIK 840D sl/828D, Fundamentals, 05/2017 (A5E40869423), "Chamfer, rounding".
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import LINEAR, PLANES, Flag, MoveKind
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.records import Array

#: What is read of a line: a radius, the way from the corner, and the length of the chamfer.
WORDS = (",R", ",C", ",L")
#: Lines that turn by less than this, rad, have no corner.
STRAIGHT = 1e-9


class CornerWords:
    """The corner at the end of the last move, which the next one completes; `open` while there is one.

    Parameters
    ----------
    state : ProgramState
        Of the program.
    names : sequence of str
        What the dialect calls `WORDS`, in that order.
    """

    def __init__(self, state: ProgramState, names: Sequence[str]) -> None:
        self._state, self.names = state, dict(zip(WORDS, names, strict=False))
        self.open, self._word, self._size = False, "", 0.0

    @property
    def _name(self) -> str:
        """The word as the program has it."""
        return self.names.get(self._word, self._word)

    def begin(self, word: str, size: float) -> None:
        """The last move, a line, ends in a corner of that size, mm."""
        state, self._word, self._size = self._state, word, size
        refuse(not size >= 0.0, f"{self._name}{size:g}: the size of a corner is 0 or more")
        refuse(
            not state.count or state.rows["kind"][state.count - 1] != MoveKind.LINE,
            f"{self._name} needs a line, G1, where it stands and behind it; write the corner's moves",
        )
        self.open = state.held = size > 0.0

    def complete(self, kind: int, there: Array) -> None:
        """The next move leads to `there` (9,): cut the last one short, and put the corner behind it."""
        if not self.open:
            return
        state = self._state
        self.open = state.held = False
        rows, i = state.rows, state.count - 1
        corner = state.position.copy()
        before = rows["end"][i - 1] if i else state.chunk_start
        axes = list(PLANES[state.plane])
        back, ahead = before - corner, there - corner
        others = [axis for axis in range(len(back)) if axis not in axes]
        refuse(
            kind != MoveKind.LINE or back[others].any() or ahead[others].any(),
            f"{self._name} joins two lines, G1, in the plane G{state.plane}; write the corner's moves",
        )
        along, on = (float(np.linalg.norm(each[axes])) for each in (back, ahead))
        refuse(not along or not on, f"{self._name} stands beside a move without length")
        u, v = back / along, ahead / on
        turn = math.pi - math.acos(float(np.clip(u @ v, -1.0, 1.0)))
        if turn < STRAIGHT:
            return
        half = 0.5 * (math.pi - turn)  # between a line and the middle of the corner
        if self._word == ",R":
            away = self._size / math.tan(half) if half > STRAIGHT else math.inf
        else:
            away = self._size if self._word == ",C" else 0.5 * self._size / math.sin(half) if half else math.inf
        if away > min(along, on) * (1.0 + 1e-12):
            raise LineError(f"{self._name}{self._size:g} takes {away:.6g} mm of lines of {along:.6g} and {on:.6g} mm")
        first, last = corner + away * u, corner + away * v
        row = state.room(1)
        state.rows[i + 1] = state.rows[i]
        state.rows["end"][i] = first
        row["end"] = last
        if self._word == ",R":
            left = u[axes[1]] * v[axes[0]] - u[axes[0]] * v[axes[1]] > 0.0  # the path turns counterclockwise
            middle = (u + v) / float(np.linalg.norm(u + v))
            centre = corner + middle * (self._size / math.sin(half)) - first
            row["kind"] = MoveKind.COUNTERCLOCKWISE if left else MoveKind.CLOCKWISE
            row["flags"] = int(row["flags"][0]) | sum((Flag.I, Flag.J, Flag.K)[axis] for axis in axes)
            row["centre"] = centre[LINEAR[:3]]
            row["radius"], row["turns"] = 0.0, 1.0

    def end(self) -> None:
        """The program is at its end."""
        refuse(self.open, f"{self._name} has no line behind it")

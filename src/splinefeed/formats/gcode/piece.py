"""Some moves as curves: what has no length is left out, and each curve has its feed, its tolerance and its markers."""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats.gcode.arcs import Arcs, arc_curve, arc_lengths, find_arcs
from splinefeed.formats.gcode.expressions import LineError
from splinefeed.formats.gcode.moves import (
    LETTERS,
    LINE,
    LINEAR,
    PATH_ORDER,
    RAPID,
    ROTARY,
    SPLINE,
    STATED,
    Findings,
    Flag,
    Moves,
)
from splinefeed.formats.gcode.reader import Reading
from splinefeed.formats.gcode.state import UNSAID
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS, Lines
from splinefeed.geometry.path import Marker, Path
from splinefeed.geometry.resolution import RESOLUTION
from splinefeed.records import Array, BoolArray, IntArray

#: A move no longer than this, mm or rad, is none.
NO_LENGTH = 1e-9
NOTHING = "no move has a length; is the program complete?"


@dataclass(frozen=True, eq=False)
class Piece:
    """Some moves in a row, and what a path needs of those that have a length.

    left_out  how many of them only lead to the first place; none  (n,) those without length behind these
    kept      (k,) numbers of the others; places  (k + 1, 9) between them; columns  those of the path's axes
    """

    file: str | os.PathLike[str]
    moves: Moves
    arcs: Arcs
    columns: IntArray
    left_out: int
    none: BoolArray
    kept: IntArray
    places: Array
    findings: Findings

    @classmethod
    def of(
        cls,
        file: str | os.PathLike[str],
        moves: Moves,
        columns: IntArray,
        reading: Reading,
        left_out: int = 0,
        begin: Array | None = None,
        tip: bool = False,
    ) -> Piece:
        """The piece that these moves make, from `begin` (9,) on; of a tool's `tip` only X, Y and Z have a length."""
        arcs = arcs_of(file, moves, reading)
        starts, ends = moves.starts, moves["end"]
        step = np.abs(ends - starts)[:, columns]
        short = np.linalg.norm(step[:, :3], axis=1) <= RESOLUTION if tip else np.max(step, axis=1) <= NO_LENGTH
        none: BoolArray = (moves["kind"] <= LINE) & short
        for i, spline in moves.spline_moves():
            none[i] = float(np.max(np.ptp(spline.points, axis=0))) <= NO_LENGTH
        none[:left_out] = False
        for line in moves["line"][none & (not tip)].tolist():
            reading.findings.count("{count} move(s) without length are left out", line)
        kept = np.flatnonzero(~none & (np.arange(len(moves)) >= left_out))
        if begin is None:
            begin = np.concatenate([starts, ends[-1:] if len(moves) else moves.start[None]])[left_out]
        places = np.concatenate([begin[None], ends[kept]])
        return cls(file, moves, arcs, columns, left_out, none, kept, places, reading.findings)

    @cached_property
    def lengths(self) -> Array:
        """Lengths (n,) of all moves as `Path` counts them: mm, or degrees where rotary axes move alone."""
        length = straight_lengths(self.moves["end"] - self.moves.starts)
        length[self.arcs.move] = arc_lengths(self.moves, self.arcs)
        for i, spline in self.moves.spline_moves():
            length[i] = 0.0 if spline.path is None else spline.path.length
        return length

    @cached_property
    def programmed_feeds(self) -> Array:
        """Feeds (n,) as the program says them, mm/s, or deg/s where rotary axes move alone; 0 where it says none."""
        moves = self.moves
        feeds = moves["feed"][:] / 60.0
        inverse = moves.has(Flag.INVERSE_FEED)
        if inverse.any():  # F is one over the minutes that the move takes
            feeds = np.where(inverse, feeds * self.lengths, feeds)
        step = moves.step
        xyz, whole = (np.linalg.norm(step[:, columns], axis=1) for columns in ([0, 1, 2], LINEAR))
        beside = (moves["kind"] == LINE) & ~inverse & (xyz > 0.0) & (whole > xyz)
        if beside.any():  # F counts X, Y and Z alone where they move, and a path counts U, V and W too
            feeds = np.where(beside, feeds * whole / np.where(beside, xyz, 1.0), feeds)
        inch = (moves.has(Flag.INCH)) & (moves["kind"] <= LINE) & (whole == 0.0) & ~inverse
        return np.where(inch, feeds / 25.4, feeds)  # degrees are not inches

    @cached_property
    def feeds(self) -> Array:
        """Feeds (k,), mm/s: infinite for rapid moves, and for those before any F, with a finding."""
        feeds, rapid = self.programmed_feeds[self.kept], self.moves["kind"][self.kept] == RAPID
        unsaid = (feeds <= 0.0) & ~rapid
        for line in self.moves["line"][self.kept[unsaid]].tolist():
            self.findings.count("moves without a feed before them (F) run as fast as the limits allow", line)
        return np.where(unsaid | rapid, math.inf, feeds)

    @property
    def tolerances(self) -> Array | None:
        """How far each move may be smoothed (k,), mm, 0 where nothing is said; None where nothing is said at all."""
        tolerances = self.moves["tolerance"][self.kept]
        said = tolerances != UNSAID
        return np.where(said, tolerances, 0.0) if said.any() else None

    @property
    def markers(self) -> list[Marker]:
        """What stands between the curves: M, S, T and dwells, and the exact stops of G61.1."""
        marks = self.moves.marks
        places = np.searchsorted(self.kept, [mark.move for mark in marks]).tolist()
        markers = [Marker(place, mark.text, mark.dwell, mark.stop) for place, mark in zip(places, marks, strict=True)]
        stops = np.flatnonzero(self.moves["flags"][self.kept[:-1]] & Flag.STOPS) + 1  # at the end it stops anyway
        return markers + [Marker(int(place), "", 0.0, True) for place in stops]

    def curves(self) -> Sequence[NurbsCurve]:
        """One curve a move, each from where the one before ends; FormatError with the line of one that is none."""
        moves, points, columns = self.moves, self.places, self.columns
        flat = points[:, columns]
        if np.all(moves["kind"][self.kept] <= LINE):
            return Lines(flat)
        number_of_arc = {int(move): i for i, move in enumerate(self.arcs.move)}
        curves = []
        for n, i in enumerate(self.kept.tolist()):
            try:
                if moves["kind"][i] == SPLINE:
                    spline = moves.splines[int(moves["spline"][i])]
                    places = np.concatenate([points[n : n + 1], spline.points[1:]])
                    curves.append(NurbsCurve(spline.degree, spline.knots, places[:, columns], spline.weights))
                elif i in number_of_arc:
                    curves.append(arc_curve(points[n], points[n + 1], self.arcs, number_of_arc[i], columns))
                else:
                    curves.append(NurbsCurve.trusted(1, LINE_KNOTS, flat[n : n + 2]))
            except CurveError as error:
                raise FormatError(f"{self.file}: line {int(moves['line'][i])}: {error}") from None
        return curves

    def said(self, name: str = "") -> dict[str, Any]:
        """What a path of these moves has beside its curves."""
        feeds = self.feeds  # which may add a finding
        return {
            "name": name or pathlib.Path(self.file).stem, "feeds": feeds, "tolerances": self.tolerances,
            "markers": self.markers, "findings": self.findings.all(),
        }  # fmt: skip

    def path(self, name: str = "", **other: Any) -> Path:
        """The path of these moves, with `other` than what they say; FormatError where there is none."""
        if not len(self.kept):
            raise FormatError(f"{self.file}: {NOTHING}")
        curves, said = self.curves(), self.said(name)
        try:
            return Path(curves, axis_names(self.columns), **{**said, **other})
        except CurveError as error:
            raise FormatError(f"{self.file}: {error}") from None


def arcs_of(file: str | os.PathLike[str], moves: Moves, reading: Reading) -> Arcs:
    """The circles of all arcs; FormatError with the line for one that misses its circle."""
    try:
        return find_arcs(moves, reading.findings, reading.repair)
    except LineError as missed:
        raise FormatError(f"{file}: line {missed.line}: {missed}") from None


def straight_lengths(step: Array) -> Array:
    """Lengths (n,) of straight moves (n, 9): mm, of rotary axes alone degrees."""
    length = np.linalg.norm(step[:, LINEAR], axis=1)
    lengths: Array = np.where(length > 0.0, length, np.rad2deg(np.linalg.norm(step[:, list(ROTARY)], axis=1)))
    return lengths


def leading(moves: Moves, needed: int, known: int = 0) -> tuple[int, int]:
    """How many rapid moves only lead to the first place, and which of the `needed` axes are not stated before the next.

    Axes are bits; all moves do so where the places of all axes are not stated before the end.
    """
    stated = moves["axes"] >> STATED
    before = known | np.concatenate([[0], np.bitwise_or.accumulate(stated)])
    others = np.flatnonzero((before[:-1] & needed == needed) | (moves["kind"] != RAPID) | (stated == 0))
    first = int(others[0]) if len(others) else len(moves)
    return first, needed & ~int(before[first])


def say_leading(moves: Moves, first: int, missing: Sequence[str], taken: str, findings: Findings) -> None:
    """What of `leading` a user should know."""
    if missing:
        findings.say(
            f"line {moves['line'][first]}: where {' '.join(missing)} is before this move is unknown and taken {taken} "
            "(option start)"
        )
    elif first:
        lines = f"{first} rapid move(s) to the first place, up to line {moves['line'][first - 1]},"
        findings.say(f"{lines} are left out (option start)")


def path_columns(used: int, file: str | os.PathLike[str]) -> IntArray:
    """Columns of the axes that the program moves, in the order of a path; FormatError for none."""
    columns = np.array([column for column in PATH_ORDER if used >> column & 1], dtype=np.int64)
    if not len(columns):
        raise FormatError(f"{file}: no line moves an axis")
    return columns


def axis_names(columns: IntArray) -> tuple[str, ...]:
    """Names of the axes of these columns in a path."""
    return tuple(LETTERS[column].lower() for column in columns)

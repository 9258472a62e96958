"""Some moves as curves: what has no length is left out, and each curve has its feed, its tolerance and its markers."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import LINE_KNOTS, lines_through
from splinefeed.errors import CurveError, FormatError
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.path import Path
from splinefeed.paths.resolution import RESOLUTION
from splinefeed.programs.gcode.arcs import arc_curve, arc_lengths, find_arcs
from splinefeed.programs.gcode.moves import LETTERS, LINEAR, PATH_ORDER, ROTARY, STATED, Findings, Flag, MoveKind, Moves
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.state import UNSAID
from splinefeed.records import Array, BoolArray, IntArray

#: A move no longer than this, mm or rad, is none.
NO_LENGTH = 1e-9
NOTHING = "no move has a length; is the program complete?"


@dataclass(frozen=True)
class Ends:
    """Of moves: tangents and curvature vectors, 1/mm, (2, n, 6) at both ends, and the least radius (n,), mm.

    tangents are not numbers where a move has no length over the linear axes; radius is inf on lines
    """

    tangents: Array
    bends: Array
    radius: Array


class Piece:
    """Some moves in a row, and what a path needs of those that have a length.

    Parameters
    ----------
    moves : Moves
        n of them.
    columns : array (axes,)
        Those of the path's axes.
    reading : Reading
        Whose findings take what there is to say.
    left_out : int, optional
        How many of them only lead to the first place.
    begin : array (9,), optional
        Where the others begin, mm and rad.
    tip : bool, optional
        Whether X, Y and Z are a tool's tip, and they alone have a length.

    Attributes
    ----------
    none : array (n,)
        Which of the others have no length.
    kept : array (k,)
        Numbers of those that have one.
    places : array (k + 1, 9)
        Between them, from `begin` on.
    """

    def __init__(
        self, moves: Moves, columns: IntArray, reading: Reading, left_out: int = 0, begin: Array | None = None,
        tip: bool = False,
    ) -> None:  # fmt: skip
        self.file, self.findings, self.moves, self.columns = reading.file, reading.findings, moves, columns
        self.left_out = left_out
        self.arcs = find_arcs(moves, Findings())  # the reading has said what is mended
        step = np.abs(moves.step)[:, columns]
        short = np.linalg.norm(step[:, :3], axis=1) <= RESOLUTION if tip else np.max(step, axis=1) <= NO_LENGTH
        self.none: BoolArray = (moves["kind"] <= MoveKind.LINE) & short
        for i, spline in moves.spline_moves():
            self.none[i] = float(np.max(np.ptp(spline.points, axis=0))) <= NO_LENGTH
        self.none[:left_out] = False
        for line in moves["line"][self.none & (not tip)].tolist():
            self.findings.count("{count} move(s) without length are left out", line)
        self.kept = np.flatnonzero(~self.none & (np.arange(len(moves)) >= left_out))
        if begin is None:
            begin = moves["end"][left_out - 1] if left_out else moves.start
        self.places = np.concatenate([begin[None], moves["end"][self.kept]])

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
        beside = (moves["kind"] == MoveKind.LINE) & ~inverse & (xyz > 0.0) & (whole > xyz)
        if beside.any():  # F counts X, Y and Z alone where they move, and a path counts U, V and W too
            feeds = np.where(beside, feeds * whole / np.where(beside, xyz, 1.0), feeds)
        inch = (moves.has(Flag.INCH)) & (moves["kind"] <= MoveKind.LINE) & (whole == 0.0) & ~inverse
        return np.where(inch, feeds / 25.4, feeds)  # degrees are not inches

    @cached_property
    def feeds(self) -> Array:
        """Feeds (k,), mm/s: infinite for rapid moves, and for those before any F, with a finding."""
        feeds, rapid = self.programmed_feeds[self.kept], self.moves["kind"][self.kept] == MoveKind.RAPID
        unsaid = (feeds <= 0.0) & ~rapid
        for line in self.moves["line"][self.kept[unsaid]].tolist():
            self.findings.count("moves without a feed before them (F) run as fast as the limits allow", line)
        return np.where(unsaid | rapid, math.inf, feeds)

    @cached_property
    def ends(self) -> Ends:
        """How all moves begin and end: of a helix r (1 + (rise / (r sweep))^2) is the radius."""
        arcs, linear = self.arcs, self.moves.step[:, LINEAR]
        with np.errstate(invalid="ignore", divide="ignore"):
            tangents = np.stack([linear / np.linalg.norm(linear, axis=1)[:, None]] * 2)
        bends, radius = np.zeros_like(tangents), np.full(len(linear), np.inf)
        rows, (a, b) = np.arange(len(arcs)), arcs.axes.T
        rise = linear[arcs.move]  # X, Y, Z are the first linear axes too
        rise[rows, a] = rise[rows, b] = 0.0
        rise /= np.abs(arcs.sweep)[:, None]
        for end, angle, size in ((0, arcs.angle, arcs.first), (1, arcs.angle + arcs.sweep, arcs.last)):
            outward = np.zeros_like(rise)
            outward[rows, a], outward[rows, b] = size * np.cos(angle), size * np.sin(angle)
            there, turn = rise.copy(), np.sign(arcs.sweep)
            there[rows, a], there[rows, b] = -turn * outward[rows, b], turn * outward[rows, a]
            # an arc that ends at its centre, as a spiral of a repaired program may, has no tangent there
            speed = np.maximum(np.linalg.norm(there, axis=1), 1e-150)[:, None]
            tangents[end, arcs.move], bends[end, arcs.move] = there / speed, -outward / speed**2
        least = np.minimum(arcs.first, arcs.last)
        slope = np.linalg.norm(rise, axis=1) / np.maximum(least, 1e-100)
        radius[arcs.move] = least * (1.0 + slope**2)
        for i, spline in self.moves.spline_moves():
            if (path := spline.path) is None:
                continue
            (curve,) = path.curves
            columns = [LINEAR.index(LETTERS.index(axis.upper())) for axis in path.axes]
            radius[i] = path.minimum_radius()
            for end, u in enumerate(curve.domain):
                tangents[end, i] = 0.0
                tangents[end, i, columns] = curve.tangent(u)
                _, velocity, second = curve.derivatives(u, 2, side=("right", "left")[end])
                square = float(velocity @ velocity)
                if square > 0.0:
                    bends[end, i, columns] = (second - (second @ velocity) / square * velocity) / square
        return Ends(tangents, bends, radius)

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

    def curves(self, most: int | None = None) -> Sequence[NurbsCurve]:
        """One curve a move, each from where the one before ends; FormatError with the line of one that is none."""
        moves, points, columns, kept = self.moves, self.places, self.columns, self.kept[:most]
        flat = points[: len(kept) + 1, columns]
        if len(kept) and np.all(moves["kind"][kept] <= MoveKind.LINE):
            return lines_through(flat)
        number_of_arc = {int(move): i for i, move in enumerate(self.arcs.move)}
        curves = []
        for n, i in enumerate(kept.tolist()):
            try:
                if moves["kind"][i] == MoveKind.SPLINE:
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
            "name": name or self.file.stem, "feeds": feeds, "tolerances": self.tolerances,
            "markers": self.markers, "findings": self.findings.all(), "lines": self.moves["line"][self.kept],
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


def straight_lengths(step: Array) -> Array:
    """Lengths (n,) of straight moves (n, 9): mm, of rotary axes alone degrees."""
    length = np.linalg.norm(step[:, LINEAR], axis=1)
    lengths: Array = np.where(length > 0.0, length, np.rad2deg(np.linalg.norm(step[:, list(ROTARY)], axis=1)))
    return lengths


def leading(moves: Moves, needed: int, known: int = 0) -> tuple[int, int]:
    """Count the rapid moves that only lead to the first place.

    Parameters
    ----------
    moves : Moves
        From the beginning of the program.
    needed : int
        Bits of the axes that must be stated.
    known : int, optional
        Bits of those that are.

    Returns
    -------
    first : int
        How many there are; all moves, where the places of all axes are not stated before the end.
    missing : int
        Bits of the needed axes that are not stated before the next.
    """
    stated = moves["axes"] >> STATED
    before = known | np.concatenate([[0], np.bitwise_or.accumulate(stated)])
    rapid = (moves["kind"] == MoveKind.RAPID) | moves.has(Flag.G0_AT_F)
    others = np.flatnonzero((before[:-1] & needed == needed) | ~rapid | (stated == 0))
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

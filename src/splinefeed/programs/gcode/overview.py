"""What is in a program, from its moves alone: no curve is made of a line, so that any size will do.

Lengths, boxes, corners and radii are those that the path of the same program has; a test holds them together. Corners
are those of the linear axes alone.
"""

from __future__ import annotations

import math
import os
import pathlib
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.files.metadata import axis_units, to_degrees
from splinefeed.paths.corners import CORNER_ANGLE, CURVATURE_JUMP, STOP_ANGLE
from splinefeed.programs.gcode.arcs import Arcs, arc_degrees
from splinefeed.programs.gcode.moves import AXES, LETTERS, LINEAR, Flag, MoveKind, Moves
from splinefeed.programs.gcode.piece import Ends, Piece, axis_names, path_columns
from splinefeed.programs.gcode.reader import Reading
from splinefeed.programs.gcode.state import CAPACITY
from splinefeed.programs.gcode.to_path import Program
from splinefeed.records import Array, BoolArray, IntArray

_KINDS = dict(enumerate(("G0", "G1", "G2", "G3", "splines")))


@dataclass
class Summary:
    """Counts and measures of a program, lengths in mm, times in s; `summary` makes it.

    Attributes
    ----------
    curves : list of dict
        Of the first moves, `most_listed` at most, what `info` says of each.
    """

    name: str
    most_listed: int = 0
    dialect: str = ""
    dialect_by: str = ""
    lines: int = 0
    units: str = "mm"
    moves: dict[str, int] = field(default_factory=lambda: dict.fromkeys(_KINDS.values(), 0))
    lengths: dict[str, float] = field(default_factory=lambda: dict.fromkeys(_KINDS.values(), 0.0))
    without_length: int = 0
    left_out: int = 0
    feed_time: float = 0.0
    dwell_time: float = 0.0
    feeds: tuple[float, float] = (math.inf, 0.0)
    markers: int = 0
    ends: bool = False
    degrees: set[int] = field(default_factory=set)
    min_radius: float = math.inf
    corners: int = 0
    stops: int = 0
    used: int = 0
    low: Array = field(default_factory=lambda: np.full(AXES, np.inf))
    high: Array = field(default_factory=lambda: np.full(AXES, -np.inf))
    first: Array | None = None
    last: Array = field(default_factory=lambda: np.zeros(AXES))
    findings: list[str] = field(default_factory=list)
    curves: list[dict[str, Any]] = field(default_factory=list)
    _behind: tuple[Array, Array] = (np.zeros((0, len(LINEAR))),) * 2  # tangent and bend (k, 6) at the end so far
    _rests: bool = False

    def page(self, file: str | os.PathLike[str]) -> dict[str, Any]:
        """The keys of `info --json`: `paths` with one entry, the first `curves`, how many more, and the others."""
        columns = path_columns(self.used, file)
        axes = axis_names(columns)
        assert self.first is not None
        gap = float(np.linalg.norm((self.last - self.first)[LINEAR]))
        count = sum(self.moves.values()) - self.without_length - self.left_out
        path = {
            "name": self.name,
            "axes": list(axes),
            "axis_units": axis_units(axes, rotary="deg"),
            "curves": count,
            "degrees": sorted(self.degrees),
            "length_mm": math.fsum(self.lengths.values()),
            "bbox_min": to_degrees(self.low[columns][None], axes)[0].tolist(),
            "bbox_max": to_degrees(self.high[columns][None], axes)[0].tolist(),
            "closed": gap <= max(1e-6, 1e-9 * self._size),
            "min_radius_mm": self.min_radius if math.isfinite(self.min_radius) else None,
            "corners": self.corners,
            "stops": self.stops,
            "corner_places": [],
            "gaps": 0,
            "largest_gap_mm": 0.0,
        }
        return {
            "paths": [path],
            "curves": self.curves,
            "curves_left_out": count - len(self.curves),
            "program": self.program(),
            "units": self.units,
            "findings": self.findings,
        }

    def program(self) -> dict[str, Any]:
        """What only a program has."""
        low, high = self.feeds
        same = ("dialect", "dialect_by", "lines", "without_length", "left_out", "markers", "ends")
        return {
            **{name: getattr(self, name) for name in same},
            "motion_blocks": {kind: count for kind, count in self.moves.items() if count},
            "lengths_mm": {kind: length for kind, length in self.lengths.items() if self.moves[kind]},
            "feed_min_mm_s": low if high else None,
            "feed_max_mm_s": high or None,
            "feed_time_s": self.feed_time,
            "dwell_s": self.dwell_time,
        }

    @property
    def _size(self) -> float:
        return float(np.linalg.norm((self.high - self.low)[LINEAR]))

    def _within(self, places: Array, axes: Any = slice(None)) -> None:
        self.low[axes] = np.minimum(self.low[axes], places.min(axis=0))
        self.high[axes] = np.maximum(self.high[axes], places.max(axis=0))

    def add(self, piece: Piece) -> None:
        """Count and measure the next moves."""
        moves, behind = piece.moves, piece.left_out
        self.markers += sum(bool(mark.text) for mark in moves.marks)
        self.dwell_time += math.fsum(mark.dwell for mark in moves.marks)
        if not len(moves):
            return
        self.used |= moves.axes
        if self.first is None:
            self.first = moves.starts[behind]
        self.left_out += behind
        self.last = moves["end"][-1].copy()
        self.without_length += int(np.sum(piece.none))
        for kind, name in _KINDS.items():
            self.moves[name] += int(np.sum(moves["kind"] == kind))
            self.lengths[name] += float(np.sum(piece.lengths[behind:][moves["kind"][behind:] == kind]))
        kept = piece.kept
        if not len(kept):
            self._rests |= any(mark.stop for mark in moves.marks)
            return
        fed = kept[np.isfinite(piece.feeds)]
        feeds = piece.programmed_feeds[fed]
        self.feed_time += float(np.sum(piece.lengths[fed] / feeds))
        self.feeds = min(self.feeds[0], feeds.min(initial=math.inf)), max(self.feeds[1], feeds.max(initial=0.0))
        self._within(np.concatenate([moves.starts[kept[:1]], moves["end"][kept]]))
        self._add_arcs(piece.arcs, np.isin(piece.arcs.move, kept))
        self.degrees |= {1} if np.any(moves["kind"][kept] <= MoveKind.LINE) else set()
        self.degrees |= set(arc_degrees(moves, piece.arcs).tolist())
        for _, spline in moves.spline_moves():
            if (path := spline.path) is not None:
                self.corners, self.stops = self.corners + len(path.corners), self.stops + len(path.stops)
                self.degrees.add(path.curves[0].degree)
                self._within(np.array(path.bounding_box()), [LETTERS.index(axis.upper()) for axis in path.axes])
        self._list(piece)
        self._add_joints(moves, piece.ends, kept)

    def _add_arcs(self, arcs: Arcs, kept: BoolArray) -> None:
        """The places of arcs that lie farthest out, a quarter of a turn from each other."""
        for quarter in range(4):
            angle = 0.5 * math.pi * quarter
            ahead = np.mod(np.where(arcs.sweep > 0.0, angle - arcs.angle, arcs.angle - angle), 2.0 * math.pi)
            reached = (ahead <= np.abs(arcs.sweep)) & kept
            part = ahead[reached] / np.abs(arcs.sweep[reached])
            radius = arcs.first[reached] + (arcs.last - arcs.first)[reached] * part
            axis = arcs.axes[reached, quarter % 2]
            place = arcs.centre[reached, quarter % 2] + (radius if quarter < 2 else -radius)
            (np.maximum if quarter < 2 else np.minimum).at(self.high if quarter < 2 else self.low, axis, place)

    def _list(self, piece: Piece) -> None:
        """What `info` says of the curves of these moves, which are those of the path."""
        most = self.most_listed - len(self.curves)
        for length, curve in zip(piece.lengths[piece.kept[:most]].tolist(), piece.curves(most), strict=True):
            said = {"path": 1, "degree": curve.degree, "control_points": len(curve.control_points)}
            said |= {"spans": len(curve.breaks) - 1, "rational": curve.rational, "closed": curve.closed}
            self.curves.append({**said, "length_mm": length})

    def _add_joints(self, moves: Moves, ends: Ends, kept: IntArray) -> None:
        """Joints at which the tangent turns or the curvature jumps, the one to the part before included."""
        self.min_radius = min(self.min_radius, float(np.min(ends.radius)))
        moving = kept[np.all(np.isfinite(ends.tangents[0][kept]), axis=1)]
        rest = np.zeros(len(moving) + 1, dtype=bool)  # before each move, and behind the last one
        rest[np.searchsorted(moving, [mark.move for mark in moves.marks if mark.stop])] = True
        rest[1:] |= moves["flags"][moving] & Flag.STOPS != 0
        rest[0] |= self._rests
        self._rests = bool(rest[-1])
        if not len(moving):
            return
        (leave, bend), (arrive, bent) = ((ends.tangents[k][moving], ends.bends[k][moving]) for k in (0, 1))
        joined = len(self._behind[0])  # 0 for the first part
        before, was = (np.concatenate([self._behind[k], each[:-1]]) for k, each in enumerate((arrive, bent)))
        after, now = leave[1 - joined :], bend[1 - joined :]
        norm = partial(np.linalg.norm, axis=1)
        angle = 2.0 * np.arctan2(norm(after - before), norm(after + before))
        floor = CURVATURE_JUMP * (1.0 / self._size + norm(was) + norm(now))
        self.corners += int(np.sum((angle > CORNER_ANGLE) | (norm(now - was) > floor)))
        self.stops += int(np.sum((angle > STOP_ANGLE) | rest[1 - joined : -1]))
        self._behind = arrive[-1:], bent[-1:]


def summary(
    file: str | os.PathLike[str], *, most_listed: int = 0, reading: Reading | None = None, **options: Any
) -> Summary:
    """Measure a program, of any length.

    Parameters
    ----------
    file : str or PathLike
        Of G-code.
    most_listed : int, optional
        Moves that are listed, the first ones.
    reading : Reading, optional
        That takes the findings.
    **options : object
        As of `to_path.from_file`.

    Returns
    -------
    Summary
        Counts, lengths, mm, and times, s.

    Raises
    ------
    FormatError
        For a line that is wrong, or where nothing moves.
    """
    program = Program(file, **options)
    reading = reading or program.reading()
    found = Summary(pathlib.Path(file).stem, most_listed)
    for piece in program.pieces(reading.checked(file), reading, size=CAPACITY):
        found.add(piece)
    path_columns(found.used, file)
    if not found.degrees:
        raise FormatError(f"{file}: no move has a length; is the program complete?")
    found.dialect = "" if reading.dialect is None else reading.dialect.name
    found.dialect_by = reading.dialect_by
    found.lines, found.ends, found.units = reading.lines, reading.ended, "in" if reading.inch else "mm"
    found.findings = reading.findings.all()
    return found

"""What is in a program, from its moves alone: no curve is made of a line, so that any size will do.

Lengths, boxes, corners and radii are those that the path of the same program has; a test holds them together. Corners
are those of the linear axes alone.
"""

from __future__ import annotations

import math
import os
import pathlib
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.arcs import Arcs, arc_degrees
from splinefeed.formats.gcode.ends import Ends
from splinefeed.formats.gcode.moves import (
    AXES,
    CLOCKWISE,
    COUNTERCLOCKWISE,
    LETTERS,
    LINE,
    LINEAR,
    RAPID,
    SPLINE,
    Moves,
)
from splinefeed.formats.gcode.piece import Piece, axis_names, path_columns
from splinefeed.formats.gcode.reader import Reading
from splinefeed.formats.gcode.state import CAPACITY
from splinefeed.formats.gcode.to_path import Program
from splinefeed.formats.metadata import axis_units, to_degrees
from splinefeed.geometry.corners import CORNER_ANGLE, CURVATURE_JUMP, STOP_ANGLE
from splinefeed.records import Array, BoolArray

_KINDS = {RAPID: "G0", LINE: "G1", CLOCKWISE: "G2", COUNTERCLOCKWISE: "G3", SPLINE: "splines"}


@dataclass
class Summary:
    """Counts and measures of a program; lengths mm, times s. Made by `summary`.

    curves  of the first moves, `most_listed` at most, what `info` says of each
    """

    name: str
    dialect: str = ""
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
    last: Array | None = None
    findings: list[str] = field(default_factory=list)
    most_listed: int = 0
    curves: list[dict[str, Any]] = field(default_factory=list)

    @property
    def length(self) -> float:
        """Length of the path over the linear axes, mm."""
        return math.fsum(self.lengths.values())

    def page(self, file: str | os.PathLike[str]) -> dict[str, Any]:
        """The keys of `info --json`: `paths` with one entry, the first `curves`, how many more, and the others."""
        columns = path_columns(self.used, file)
        axes = axis_names(columns)
        assert self.first is not None
        assert self.last is not None
        size = float(np.linalg.norm((self.high - self.low)[LINEAR]))
        gap = float(np.linalg.norm((self.last - self.first)[LINEAR]))
        count = sum(self.moves.values()) - self.without_length - self.left_out
        path = {
            "name": self.name,
            "axes": list(axes),
            "axis_units": axis_units(axes, rotary="deg"),
            "curves": count,
            "degrees": sorted(self.degrees),
            "length_mm": self.length,
            "bbox_min": to_degrees(self.low[columns][None], axes)[0].tolist(),
            "bbox_max": to_degrees(self.high[columns][None], axes)[0].tolist(),
            "closed": gap <= max(1e-6, 1e-9 * size),
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
        return {
            "dialect": self.dialect,
            "lines": self.lines,
            "motion_blocks": {kind: count for kind, count in self.moves.items() if count},
            "lengths_mm": {kind: length for kind, length in self.lengths.items() if self.moves[kind]},
            "without_length": self.without_length,
            "left_out": self.left_out,
            "feed_min_mm_s": low if high else None,
            "feed_max_mm_s": high or None,
            "feed_time_s": self.feed_time,
            "dwell_s": self.dwell_time,
            "markers": self.markers,
            "ends": self.ends,
        }


def summary(
    file: str | os.PathLike[str],
    *,
    most_listed: int = 0,
    reading: Reading | None = None,
    **options: Any,
) -> Summary:
    """Measure the program in `file`, with the options of `to_path.from_file`.

    Raises FormatError for a line that is wrong, or where nothing moves.
    """
    program = Program(file, **options)
    reading = reading or program.reading()
    found = Summary(pathlib.Path(file).stem, most_listed=most_listed)
    joint = _Joint()
    for piece in program.pieces(reading.moves(file), reading, size=CAPACITY):
        found.markers += sum(bool(mark.text) for mark in piece.moves.marks)
        found.dwell_time += math.fsum(mark.dwell for mark in piece.moves.marks)
        if len(piece.moves):
            _add(found, piece, joint)
    path_columns(found.used, file)
    if not found.degrees:
        raise FormatError(f"{file}: no move has a length; is the program complete?")
    found.dialect = "" if reading.dialect is None else reading.dialect.name
    found.lines, found.ends, found.units = reading.lines, reading.ended, "in" if reading.inch else "mm"
    found.findings = reading.findings.all()
    return found


@dataclass
class _Joint:
    """How the last move ends: tangent and curvature vector over the linear axes, and whether the tool stops there."""

    tangent: Array | None = None
    bend: Array | None = None
    rest: bool = False


def _add(found: Summary, piece: Piece, joint: _Joint) -> None:
    moves, arcs = piece.moves, piece.arcs
    found.used |= moves.used
    if found.first is None:
        found.first = moves.starts[piece.left_out]
    found.left_out += piece.left_out
    found.last = moves.ends[-1].copy()
    found.without_length += int(np.sum(piece.none))
    for kind, name in _KINDS.items():
        found.moves[name] += int(np.sum(moves.kind == kind))
        found.lengths[name] += float(np.sum(piece.lengths[piece.left_out :][moves.kind[piece.left_out :] == kind]))
    if not len(piece.kept):
        joint.rest |= any(mark.stop for mark in moves.marks)
        return
    kept = np.zeros(len(moves), dtype=bool)
    kept[piece.kept] = True
    ends = Ends.of(moves, arcs)
    found.min_radius = min(found.min_radius, float(np.min(ends.radius)))
    _splines(found, moves)
    _list(found, piece)
    _feeds(found, piece)
    _boxes(found, moves, arcs, kept)
    if np.any(kept & (moves.kind <= LINE)):
        found.degrees.add(1)
    found.degrees |= set(arc_degrees(moves, arcs).tolist())
    _corners(found, moves, ends, kept, joint)


def _splines(found: Summary, moves: Moves) -> None:
    """Measure every spline as the curve that it is."""
    for _, spline in moves.spline_moves():
        path = spline.path
        if path is None:
            continue
        axes = [LETTERS.index(axis.upper()) for axis in path.axes]
        found.corners += len(path.corners)
        found.stops += len(path.stops)
        found.degrees.add(path.curves[0].degree)
        low, high = path.bounding_box()
        found.low[axes], found.high[axes] = np.minimum(found.low[axes], low), np.maximum(found.high[axes], high)


def _list(found: Summary, piece: Piece) -> None:
    """What `info` says of the curves of these moves, which are those of the path."""
    chosen = piece.kept[: found.most_listed - len(found.curves)]
    first = replace(piece, kept=chosen, places=piece.places[: len(chosen) + 1])
    for length, curve in zip(piece.lengths[chosen].tolist(), first.curves() if len(chosen) else (), strict=True):
        found.curves.append(
            {
                "path": 1,
                "degree": curve.degree,
                "control_points": len(curve.control_points),
                "spans": len(curve.spans),
                "rational": curve.rational,
                "closed": curve.closed,
                "length_mm": length,
            }
        )


def _feeds(found: Summary, piece: Piece) -> None:
    said = piece.kept[np.isfinite(piece.feeds)]
    feeds = piece.programmed_feeds[said]
    if len(said):
        found.feed_time += float(np.sum(piece.lengths[said] / feeds))
        found.feeds = min(found.feeds[0], float(feeds.min())), max(found.feeds[1], float(feeds.max()))


def _boxes(found: Summary, moves: Moves, arcs: Arcs, kept: BoolArray) -> None:
    first = int(np.argmax(kept))
    for places in (moves.starts[first][None], moves.ends[kept]):
        found.low, found.high = np.minimum(found.low, places.min(axis=0)), np.maximum(found.high, places.max(axis=0))
    for quarter in range(4):
        angle = 0.5 * math.pi * quarter
        ahead = np.mod(np.where(arcs.sweep > 0.0, angle - arcs.angle, arcs.angle - angle), 2.0 * math.pi)
        reached = (ahead <= np.abs(arcs.sweep)) & kept[arcs.move]
        part = ahead[reached] / np.abs(arcs.sweep[reached])
        radius = arcs.first[reached] + (arcs.last - arcs.first)[reached] * part
        axis = arcs.axes[reached, quarter % 2]
        place = arcs.centre[reached, quarter % 2] + (radius if quarter < 2 else -radius)
        (np.maximum if quarter < 2 else np.minimum).at(found.high if quarter < 2 else found.low, axis, place)


def _corners(found: Summary, moves: Moves, ends: Ends, kept: BoolArray, joint: _Joint) -> None:
    """Joints at which the tangent turns or the curvature jumps, the one to the part before included."""
    moving = kept & np.all(np.isfinite(ends.tangents[0]), axis=1)
    leave, bend = ends.tangents[0][moving], ends.bends[0][moving]
    rest = np.zeros(len(leave) + 1, dtype=bool)  # before each move, and behind the last one
    rest[np.searchsorted(np.flatnonzero(moving), [mark.move for mark in moves.marks if mark.stop])] = True
    rest[1:] |= moves.flags[moving] & layout.STOPS != 0
    rest[0] |= joint.rest
    joint.rest = bool(rest[-1])
    if not len(leave):
        return
    arrive, bent = ends.tangents[1][moving], ends.bends[1][moving]
    before = arrive[:-1] if joint.tangent is None else np.concatenate([joint.tangent[None], arrive[:-1]])
    was = bent[:-1] if joint.bend is None else np.concatenate([joint.bend[None], bent[:-1]])
    after, now = (leave[1:], bend[1:]) if joint.tangent is None else (leave, bend)
    angle = 2.0 * np.arctan2(np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1))
    size = float(np.linalg.norm((found.high - found.low)[LINEAR]))
    floor = CURVATURE_JUMP * (1.0 / size + np.linalg.norm(was, axis=1) + np.linalg.norm(now, axis=1))
    found.corners += int(np.sum((angle > CORNER_ANGLE) | (np.linalg.norm(now - was, axis=1) > floor)))
    found.stops += int(np.sum((angle > STOP_ANGLE) | rest[1 if joint.tangent is None else 0 : -1]))
    joint.tangent, joint.bend = arrive[-1], bent[-1]

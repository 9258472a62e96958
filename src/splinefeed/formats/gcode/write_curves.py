"""One curve as lines of a program: in the words that hold it exactly, or approximated and measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.formats.gcode.arcs import HELIX_ERROR
from splinefeed.formats.gcode.fit_arcs import biarcs, chords, circle_of, in_plane
from splinefeed.formats.gcode.moves import LETTERS, PLANES
from splinefeed.formats.gcode.text import CONTROLS, Text
from splinefeed.geometry import editing
from splinefeed.geometry.arcs import polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.nearest import Nearest
from splinefeed.geometry.path import Path
from splinefeed.records import Array

#: Knots this near to equal steps, relative, are equal.
UNIFORM = 1e-12
#: A coordinate that changes by no more than this, mm or rad, rests.
RESTS = 1e-12
#: Least samples of a curve and of each of its spans at which what approximates it is measured, and of each piece.
MEASURED, MEASURED_SPAN, MEASURED_PIECE = 2000, 50, 9
#: Weights of Siemens' PW: 0 to 3.
HIGHEST_WEIGHT = 3.0


@dataclass(frozen=True)
class Task:
    """A curve to write: its number, the letters of its axes and which of them turn, how, and its feed, mm/s."""

    number: int
    curve: NurbsCurve
    letters: list[str]
    rotary: list[bool]
    form: str
    tolerance: float
    feed: float | None
    rapid: bool

    def degrees(self, points: Array) -> Array:
        """Points (n, axes) with rotary axes in degrees."""
        return np.where(self.rotary, np.rad2deg(points), points)

    @property
    def moving(self) -> set[str]:
        """Letters of the axes that the curve moves."""
        spread = np.ptp(self.curve.control_points, axis=0)
        return {letter for letter, step in zip(self.letters, spread, strict=True) if step > RESTS}

    @property
    def planes(self) -> list[tuple[int, tuple[int, int]]]:
        """Planes whose axes the curve has, with their columns."""
        named = {plane: [LETTERS[axis] for axis in axes] for plane, axes in PLANES.items()}
        return [
            (plane, (self.letters.index(a), self.letters.index(b)))
            for plane, (a, b) in named.items()
            if {a, b} <= set(self.letters)
        ]


def write_curve(task: Task, text: Text) -> None:
    """Write one curve: lines and circular arcs as such, all else as `task.form` says."""
    curve = task.curve
    if curve.degree == 1:
        _lines(task, curve(curve.breaks), text)
    elif task.rapid or task.form == "g1":
        _chords(task, text, "written as lines (G1)")
    elif not _whole_arc(task, text):
        {"arcs": _biarcs, "g5.2": _planar_nurbs, "g6.2": _knotted, "bspline": _bspline}[task.form](task, text)


def _lines(task: Task, points: Array, text: Text) -> None:
    for point in task.degrees(points)[1:]:
        words = text.places(task.letters, point)
        text.move("G0" if task.rapid else "G1", words or [f"{task.letters[0]}{text.at[task.letters[0]]}"], task.feed)


def _chords(task: Task, text: Text, what: str) -> None:
    points = chords(task.curve, task.tolerance, np.array(task.rotary))
    flat = points[:, ~np.array(task.rotary)]
    flat = flat[np.append(np.any(np.diff(flat, axis=0) != 0.0, axis=1), True)]
    text.approximate(what, task.number, _measured(_linear(task, task.curve), [polyline(flat)] if len(flat) > 1 else []))
    _lines(task, points, text)


def _whole_arc(task: Task, text: Text) -> bool:
    """Write the curve as one arc or helix if it is one to rounding."""
    points = task.curve(np.linspace(*task.curve.domain, 65))
    for plane, columns in task.planes:
        places = in_plane(points, columns)
        found = circle_of(places)
        if found is None:
            continue
        centre, sweep = found
        part = np.unwrap(np.angle((places - centre) / (places[0] - centre)))[:, None] / sweep
        rest = np.delete(points, columns, axis=1)
        if np.any(np.abs(rest - rest[0] - part * (rest[-1] - rest[0])) > 2.0 * HELIX_ERROR):
            return False
        _arc(task, plane, points[-1], centre - complex(places[0]), sweep, text)
        return True
    return False


def _arc(task: Task, plane: int, end: Array, centre: complex, sweep: float, text: Text) -> None:
    """One G2 or G3 with its centre from the start, and P for more than one turn."""
    text.change("plane", f"G{plane}")
    words = text.places(task.letters, task.degrees(end[None])[0])
    for axis, value in zip(PLANES[plane], (centre.real, centre.imag), strict=True):
        words.append(f"{'IJK'[axis]}{text.number(value)}")
    turns = math.ceil(abs(sweep) / (2.0 * math.pi) - 1e-9)
    if turns > 1:
        words.append(f"P{turns}" if text.dialect != "siemens" else f"TURN={turns - 1}")
    text.move("G3" if sweep > 0.0 else "G2", words, task.feed)


def _biarcs(task: Task, text: Text) -> None:
    """A curve in a plane as biarcs, any other one as lines."""
    planes = [(k, columns) for k, columns in task.planes if task.moving <= {task.letters[c] for c in columns}]
    if not planes:
        _chords(task, text, "in none of the planes G17, G18, G19, written as lines (G1)")
        return
    plane, columns = planes[0]
    curve, arcs = task.curve, biarcs(task.curve, columns, task.tolerance)
    flat = NurbsCurve(curve.degree, curve.knots, curve.control_points[:, columns], curve.weights)
    pieces = [arcs.curve(i) for i in range(len(arcs.sweep))]
    text.approximate("written as arcs (G2, G3)", task.number, _measured(flat, pieces))
    for piece, offset, sweep in zip(pieces, (arcs.centre - arcs.start).tolist(), arcs.sweep.tolist(), strict=True):
        end = curve.control_points[0].copy()
        end[list(columns)] = piece.control_points[-1]
        if sweep:
            _arc(task, plane, end, offset, sweep, text)
        else:
            _lines(task, np.array([end, end]), text)


def _planar_nurbs(task: Task, text: Text) -> None:
    """LinuxCNC's G5.2: X and Y, knots clamped and uniform; others as the Bezier pieces that they consist of."""
    if not task.moving <= {"X", "Y"} <= set(task.letters):
        _biarcs(task, text)
        return
    whole = editing.clamped(task.curve)
    pieces, steps = [whole], np.diff(whole.breaks)
    if _repeats(whole) or np.ptp(steps) > UNIFORM * np.max(steps):
        pieces = whole.split(*whole.breaks[1:-1].tolist())
        text.said.say(f"curve {task.number}: its knots are not uniform, so that it is written as {len(pieces)} pieces")
    columns = [task.letters.index("X"), task.letters.index("Y")]
    text.change("plane", "G17")
    for piece in pieces:
        weights = [f"P{text.number(weight)}" for weight in _weights(piece)]
        rows = [text.places("XY", point, every=True) for point in piece.control_points[1:, columns]]
        rows = [[*row, weight] for row, weight in zip(rows, weights[1:], strict=True)]
        _spline(task, text, "G5.2", [[weights[0], f"L{piece.degree + 1}"], *rows, ["G5.3"]])


def _repeats(curve: NurbsCurve) -> bool:
    """Whether an inner knot is not simple."""
    return len(curve.knots) > 2 * (curve.degree + 1) + len(curve.breaks) - 2


def _weights(curve: NurbsCurve) -> list[float]:
    return [1.0] * len(curve.control_points) if curve.weights is None else curve.weights.tolist()


def _spline(task: Task, text: Text, word: str, rows: list[list[str]]) -> None:
    text.motion = ""  # the words before and behind a spline say their G word again
    text.move(word, rows[0], task.feed)
    text.lines += [" ".join(row) for row in rows[1:]]
    text.motion = ""


def _cubic(task: Task, text: Text) -> NurbsCurve:
    """The clamped curve, or a cubic one near it where the control knows no such degree."""
    curve, degree = editing.clamped(task.curve), CONTROLS[text.dialect].degree
    if curve.degree <= degree:
        return curve
    from splinefeed.geometry.fitting import fit_function

    smooth = [(u, int(np.count_nonzero(curve.knots == u))) for u in curve.breaks[1:-1]]
    rough = [float(u) for u, times in smooth if curve.degree - times < 2]
    fitted, _ = fit_function(lambda u: curve(u), 0.9 * task.tolerance, degree, curve.domain, rough)
    error = _measured(_linear(task, curve), [_linear(task, fitted)])
    text.approximate(f"of a degree above {degree}, fitted by one of it", task.number, error)
    return fitted


def _knotted(task: Task, text: Text) -> None:
    """G6.2: order, knots, control points and weights as they are."""
    curve = _cubic(task, text)
    knots = [f"K{text.number(float(knot))}" for knot in curve.knots - curve.knots[0]]
    points = [text.places(task.letters, point, every=True) for point in task.degrees(curve.control_points)]
    weights = [f"R{text.number(weight)}" for weight in _weights(curve)]
    rows = [[knot, *point, weight] for knot, point, weight in zip(knots, points, weights, strict=False)]
    rows[0].insert(0, f"P{curve.degree + 1}")
    word = "G6.2" if text.dialect == "linuxcnc" else "G06.2"
    _spline(task, text, word, rows + [[knot] for knot in knots[len(rows) :]])


def _bspline(task: Task, text: Text) -> None:
    """Siemens' BSPLINE: the first control point is where the tool is, PL the steps between knots, PW the weights."""
    curve = _cubic(task, text)
    weights = np.array(_weights(curve)) / _weights(curve)[0]
    if np.max(weights) > HIGHEST_WEIGHT or _repeats(curve):
        # PW ends at 3, and a step PL of 0 within a curve is not what the manual describes: piece by piece then
        _chords(task, text, "with weights above 3 or repeated knots, written as lines (G1)")
        return
    if "PL=" in text.lines[-1]:
        text.lines.append("G1")  # or the control would take both for one spline
    steps = np.zeros(len(weights) - 1)
    steps[: len(curve.breaks) - 1] = np.diff(curve.breaks)
    rows = []
    for point, weight, step in zip(task.degrees(curve.control_points)[1:], weights[1:], steps, strict=True):
        row = text.places(task.letters, point, every=True)
        row += [f"PW={text.number(float(weight))}"] if curve.weights is not None else []
        rows.append([*row, f"PL={text.number(float(step))}"])
    rows[0].append(f"SD={curve.degree}")
    _spline(task, text, "BSPLINE", rows)


def _linear(task: Task, curve: NurbsCurve) -> NurbsCurve:
    """A curve over the linear axes."""
    return NurbsCurve(curve.degree, curve.knots, curve.control_points[:, ~np.array(task.rotary)], curve.weights)


def _measured(curve: NurbsCurve, pieces: Sequence[NurbsCurve]) -> float:
    """Greatest distance, mm, both ways, between a curve and pieces that stand for it, over linear axes."""
    if not pieces:
        return 0.0
    joined = Path(pieces, [f"l{i}" for i in range(curve.axes)], tolerance=1e-3)
    spans = len(curve.breaks) - 1
    there = Nearest(joined.table, joined.shape).find(_samples(curve, max(MEASURED_SPAN, math.ceil(MEASURED / spans))))
    back = curve.nearest(np.concatenate([_samples(piece, MEASURED_PIECE) for piece in pieces]))
    return float(max(there[2].max(), back[1].max()))


def _samples(curve: NurbsCurve, each: int) -> Array:
    """Points of a curve (n, axes), as many on each span, and its ends."""
    fractions = (np.arange(each) + 0.5) / each
    u = curve.breaks[:-1, None] + fractions * np.diff(curve.breaks)[:, None]
    return curve(np.append(u.ravel(), curve.domain))

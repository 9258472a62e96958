"""One curve as lines of a program: in the words that hold it exactly, or approximated and measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.formats.gcode.arcs import HELIX_ERROR
from splinefeed.formats.gcode.fit_arcs import PLANES, Arc, biarcs, circle_of
from splinefeed.formats.gcode.fit_lines import chords
from splinefeed.formats.gcode.text import HIGHEST_DEGREE, Text
from splinefeed.geometry import editing
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
    def moving(self) -> list[str]:
        """Letters of the axes that the curve moves."""
        spread = np.ptp(self.curve.control_points, axis=0)
        return [letter for letter, step in zip(self.letters, spread, strict=True) if step > RESTS]


def write_curve(task: Task, text: Text) -> None:
    """Write one curve: lines and circular arcs as such, all else as `task.form` says."""
    curve = task.curve
    if curve.degree == 1:
        _lines(task, curve(curve.breaks), text)
        return
    if task.rapid or task.form == "g1":
        _chords(task, text, "written as lines (G1)")
        return
    if _whole_arc(task, text):
        return
    {"arcs": _biarcs, "g5.2": _planar_nurbs, "g6.2": _knotted, "bspline": _bspline}[task.form](task, text)


# --- lines ----------------------------------------------------------------------------------------------------------


def _lines(task: Task, points: Array, text: Text) -> None:
    for point in task.degrees(points)[1:]:
        words = text.places(task.letters, point)
        text.move("G0" if task.rapid else "G1", words or [f"{task.letters[0]}{text.at[task.letters[0]]}"], task.feed)


def _chords(task: Task, text: Text, what: str) -> None:
    points = chords(task.curve, task.tolerance, np.array(task.rotary))
    linear = ~np.array(task.rotary)
    pieces = [NurbsCurve.bezier(pair) for pair in zip(points[:-1, linear], points[1:, linear], strict=True)
              if np.any(pair[0] != pair[1])]  # fmt: skip
    text.approximate(what, task.number, _measured(task, pieces))
    _lines(task, points, text)


# --- arcs -----------------------------------------------------------------------------------------------------------


def _whole_arc(task: Task, text: Text) -> bool:
    """Write the curve as one arc or helix if it is one to rounding."""
    points = task.curve(np.linspace(*task.curve.domain, 65))
    for plane, (a, b) in PLANES.items():
        if a not in task.letters or b not in task.letters:
            continue
        columns = [task.letters.index(a), task.letters.index(b)]
        found = circle_of(points[:, columns])
        if found is None:
            continue
        centre, sweep = found
        off = points[:, columns] - centre
        turned = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
        part = ((turned - turned[0]) / sweep)[:, None]
        rest = np.delete(points, columns, axis=1)
        if np.any(np.abs(rest - rest[0] - part * (rest[-1] - rest[0])) > 2.0 * HELIX_ERROR):
            return False
        _arc(task, plane, points[0], points[-1], centre, sweep, text)
        return True
    return False


def _arc(task: Task, plane: str, start: Array, end: Array, centre: Array, sweep: float, text: Text) -> None:
    """One G2 or G3 with its centre from the start, and P for more than one turn."""
    a, b = PLANES[plane]
    columns = [task.letters.index(a), task.letters.index(b)]
    text.set_plane(plane)
    words = text.places(task.letters, task.degrees(end[None])[0])
    offset = centre - start[columns]
    names = {"X": "I", "Y": "J", "Z": "K"}
    words += [f"{names[letter]}{text.number(float(value))}" for letter, value in zip((a, b), offset, strict=True)]
    turns = math.ceil(abs(sweep) / (2.0 * math.pi) - 1e-9)
    if turns > 1:
        words.append(f"P{turns}" if text.dialect != "siemens" else f"TURN={turns - 1}")
    text.move("G3" if sweep > 0.0 else "G2", words, task.feed)


def _biarcs(task: Task, text: Text) -> None:
    """A curve in a plane as biarcs, any other one as lines."""
    plane = _plane(task)
    if plane is None:
        _chords(task, text, "in none of the planes G17, G18, G19, written as lines (G1)")
        return
    a, b = PLANES[plane]
    columns = task.letters.index(a), task.letters.index(b)
    arcs = biarcs(task.curve, columns, task.tolerance)
    text.approximate("written as arcs (G2, G3)", task.number, _measured_arcs(task, arcs, columns))
    base = task.curve.control_points[0].copy()
    for arc in arcs:
        start, end = base.copy(), base.copy()
        start[list(columns)], end[list(columns)] = arc.start, arc.end
        if arc.centre is None:
            _lines(task, np.array([start, end]), text)
        else:
            _arc(task, plane, start, end, arc.centre, arc.sweep, text)


def _plane(task: Task) -> str | None:
    """The plane in which all that moves lies."""
    for plane, (a, b) in PLANES.items():
        if set(task.moving) <= {a, b} and a in task.letters and b in task.letters:
            return plane
    return None


# --- splines --------------------------------------------------------------------------------------------------------


def _planar_nurbs(task: Task, text: Text) -> None:
    """LinuxCNC's G5.2: X and Y, knots clamped and uniform; others as the Bezier pieces that they consist of."""
    if not set(task.moving) <= {"X", "Y"} or not {"X", "Y"} <= set(task.letters):
        _biarcs(task, text)
        return
    whole = editing.clamped(task.curve)
    pieces = [whole]
    if not _uniform(whole):
        pieces = whole.split(*whole.breaks[1:-1].tolist())
        text.said.say(f"curve {task.number}: its knots are not uniform, so that it is written as {len(pieces)} pieces")
    columns = [task.letters.index("X"), task.letters.index("Y")]
    text.set_plane("G17")
    for piece in pieces:
        weights = np.ones(len(piece.control_points)) if piece.weights is None else piece.weights
        words = [f"P{text.number(float(weights[0]))}", f"L{piece.degree + 1}"]
        text.break_motion()
        text.move("G5.2", words, task.feed)
        for point, weight in zip(piece.control_points[1:, columns], weights[1:], strict=True):
            words = [f"X{text.number(float(point[0]))}", f"Y{text.number(float(point[1]))}"]
            text.lines.append(" ".join([*words, f"P{text.number(float(weight))}"]))
        text.lines.append("G5.3")
        text.places(task.letters, task.degrees(piece.control_points[-1:])[0])
        text.break_motion()


def _uniform(curve: NurbsCurve) -> bool:
    """Whether all inner knots are simple and in equal steps."""
    steps = np.diff(curve.breaks)
    simple = len(curve.knots) == 2 * (curve.degree + 1) + len(curve.breaks) - 2
    return simple and bool(np.ptp(steps) <= UNIFORM * np.max(steps))


def _cubic(task: Task, text: Text) -> tuple[NurbsCurve, ...]:
    """The clamped curve, or a cubic one near it where the control knows no such degree."""
    curve = editing.clamped(task.curve)
    if curve.degree <= HIGHEST_DEGREE[text.dialect]:
        return (curve,)
    from splinefeed.geometry.fitting import fit_function

    degree = HIGHEST_DEGREE[text.dialect]
    smooth = [(u, int(np.count_nonzero(curve.knots == u))) for u in curve.breaks[1:-1]]
    rough = [float(u) for u, times in smooth if curve.degree - times < 2]
    fitted, _ = fit_function(lambda u: curve(u), 0.9 * task.tolerance, degree, curve.domain, rough)
    text.approximate(f"of a degree above {degree}, fitted by one of it", task.number, _measured(task, [fitted]))
    return (fitted,)


def _knotted(task: Task, text: Text) -> None:
    """G6.2: order, knots, control points and weights as they are."""
    for curve in _cubic(task, text):
        weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights
        knots = curve.knots - curve.knots[0]
        text.break_motion()
        for i, (point, weight) in enumerate(zip(task.degrees(curve.control_points), weights, strict=True)):
            words = text.places(task.letters, point, every=True)
            words = [f"K{text.number(float(knots[i]))}", *words, f"R{text.number(float(weight))}"]
            if i == 0:
                text.move(
                    "G6.2" if text.dialect == "linuxcnc" else "G06.2", [f"P{curve.degree + 1}", *words], task.feed
                )
            else:
                text.lines.append(" ".join(words))
        text.lines += [f"K{text.number(float(knot))}" for knot in knots[len(weights) :]]
        text.break_motion()


def _bspline(task: Task, text: Text) -> None:
    """Siemens' BSPLINE: the first control point is where the tool is, PL the steps between knots, PW the weights."""
    for curve in _cubic(task, text):
        weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights / curve.weights[0]
        multiple = len(curve.knots) > 2 * (curve.degree + 1) + len(curve.breaks) - 2
        if np.max(weights) > HIGHEST_WEIGHT or multiple:
            # PW ends at 3, and a step PL of 0 within a curve is not what the manual describes: piece by piece then
            _chords(task, text, "with weights above 3 or repeated knots, written as lines (G1)")
            return
        steps = np.zeros(len(weights) - 1)
        spans = np.diff(curve.breaks)
        steps[: len(spans)] = spans
        if text.lines[-1].find("PL=") >= 0:
            text.lines.append("G1")  # or the control would take both for one spline
        text.break_motion()
        for i, (point, weight) in enumerate(zip(task.degrees(curve.control_points)[1:], weights[1:], strict=True)):
            words = text.places(task.letters, point, every=True)
            words += [f"PW={text.number(float(weight))}"] if curve.weights is not None else []
            words.append(f"PL={text.number(float(steps[i]))}")
            if i == 0:
                text.move("BSPLINE", [*words, f"SD={curve.degree}"], task.feed)
            else:
                text.lines.append(" ".join(words))
        text.break_motion()


# --- measures -------------------------------------------------------------------------------------------------------


def _linear(task: Task, curve: NurbsCurve) -> NurbsCurve:
    """The curve over its linear axes."""
    columns = [i for i, turns in enumerate(task.rotary) if not turns]
    return NurbsCurve(curve.degree, curve.knots, curve.control_points[:, columns], curve.weights)


def _measured(task: Task, pieces: Sequence[NurbsCurve]) -> float:
    """Greatest distance, mm, both ways, between the curve and pieces that stand for it, over the linear axes."""
    if not pieces:
        return 0.0
    curve = _linear(task, task.curve)
    own = [piece if piece.axes == curve.axes else _linear(task, piece) for piece in pieces]
    joined = Path(own, [f"l{i}" for i in range(curve.axes)], tolerance=1e-3)
    there = Nearest(joined.table, joined.shape).find(_samples(curve, MEASURED))[2]
    back = curve.nearest(np.concatenate([_samples(piece, MEASURED_PIECE) for piece in own]))[1]
    return float(max(there.max(), back.max()))


def _measured_arcs(task: Task, arcs: Sequence[Arc], columns: tuple[int, int]) -> float:
    """`_measured` for arcs and lines in a plane."""
    flat = NurbsCurve(task.curve.degree, task.curve.knots, task.curve.control_points[:, columns], task.curve.weights)
    return _measured(
        Task(task.number, flat, ["X", "Y"], [False, False], task.form, task.tolerance, None, False),
        [_arc_curve(arc) for arc in arcs],
    )


def _arc_curve(arc: Arc) -> NurbsCurve:
    """An arc of less than a full turn as a curve of degree 2."""
    if arc.centre is None:
        return NurbsCurve.bezier([arc.start, arc.end])
    pieces = max(1, math.ceil(abs(arc.sweep) / (0.5 * math.pi)))
    half = 0.5 * arc.sweep / pieces
    first = math.atan2(*(arc.start - arc.centre)[::-1])
    angle = first + half * np.arange(2 * pieces + 1)
    radius = np.full(len(angle), float(np.linalg.norm(arc.start - arc.centre)))
    radius[1::2] /= math.cos(half)
    points = arc.centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    points[0], points[-1] = arc.start, arc.end
    weights = np.where(np.arange(len(angle)) % 2, math.cos(half), 1.0)
    return NurbsCurve(2, np.repeat(np.arange(pieces + 1.0), [3, *[2] * (pieces - 1), 3]), points, weights)


def _samples(curve: NurbsCurve, count: int) -> Array:
    """Points of a curve (n, axes), `count` at least, and as many on each span."""
    spans = len(curve.breaks) - 1
    each = math.ceil(count / spans) if count <= MEASURED_PIECE else max(MEASURED_SPAN, math.ceil(count / spans))
    fractions = (np.arange(each) + 0.5) / each
    u = curve.breaks[:-1, None] + fractions * np.diff(curve.breaks)[:, None]
    return curve(np.append(u.ravel(), curve.domain))

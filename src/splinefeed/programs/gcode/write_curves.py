"""The text of a program while it is written: curves in the words that hold them, or approximated and measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.curves import editing
from splinefeed.curves.arcs import polyline
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.nearest import Nearest
from splinefeed.paths.path import Path
from splinefeed.programs.gcode.arcs import HELIX_ERROR
from splinefeed.programs.gcode.fit_arcs import biarcs, chords, circle_of, in_plane
from splinefeed.programs.gcode.moves import LETTERS, PLANES, Findings
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
class WrittenControl:
    """How programs of a control are written.

    Parameters
    ----------
    forms : tuple of str
        Its spline words and other forms of curves, the default first.
    header : tuple of str
        First lines, by which a reader recognizes the dialect.
    decimals : int
        Of numbers, 17 where it reads all digits of a float.
    degree : int, optional
        The highest of its splines.
    dwell : str, optional
        Letter of a wait in seconds.
    exact : str, optional
        Its exact stop, "" where there is none.
    footer : tuple of str, optional
        Last lines.
    point : bool, optional
        Whether every number has a decimal point.
    knotted : str, optional
        Its word for a NURBS by knots.
    turns : tuple, optional
        Word of how often an arc goes round, and how much is counted off for the first time.
    within : str, optional
        Word of a tolerance behind G64, "" where there is none.
    g0_at_f : bool, optional
        Whether G0 moves at the feed in force, and a line is one command, which comes first.
    """

    forms: tuple[str, ...]
    header: tuple[str, ...]
    decimals: int
    degree: int = 0
    dwell: str = "P"
    exact: str = "G61"
    footer: tuple[str, ...] = ("M2",)
    point: bool = False
    knotted: str = "G06.2"
    turns: tuple[str, int] = ("P", 0)
    within: str = ""
    g0_at_f: bool = False


#: Fanuc's P, the order of a spline, is 2 to 4, Siemens' SD 2 or 3.
CONTROLS = {
    "linuxcnc": WrittenControl(
        ("g5.2", "g6.2", "arcs", "g1"), ("G17 G21 G40 G49 G80 G90 G91.1 G94",), 17, 12, knotted="G6.2", within="P"
    ),
    "fanuc": WrittenControl(
        ("g6.2", "arcs", "g1"),
        ("%", "O0001", "G17 G21 G40 G49 G80 G90 G94"),
        6,
        3,
        dwell="X",
        footer=("M30", "%"),
        point=True,
    ),
    "siemens": WrittenControl(
        ("bspline", "arcs", "g1"),
        ("; SINUMERIK", "G17 G71 G40 G90 G94"),
        9,
        3,
        "F",
        "G60",
        footer=("M30",),
        turns=("TURN=", 1),
    ),
    "mach3": WrittenControl(("arcs", "g1"), ("(Mach3)", "G17 G21 G40 G49 G80 G90 G91.1 G94"), 6),
    "printer": WrittenControl(("g1", "arcs"), (";FLAVOR:Marlin", "G21", "G90"), 5, dwell="S", exact="", g0_at_f=True),
}


class WrittenText:
    """A program that is being written.

    Parameters
    ----------
    dialect : str
        A row of CONTROLS.
    form : str
        What curves become.
    tolerance : float
        mm.
    decimals : int
        Of numbers.

    Attributes
    ----------
    letters, rotary : list of str, array (axes,)
        Of the axes of the path, and which of them turn.
    index, curve, feed : int, NurbsCurve, float
        The curve that is being written, and its feed, mm/s.
    """

    feed: float | None

    def __init__(self, dialect: str, form: str, tolerance: float, decimals: int) -> None:
        self.dialect, self.control = dialect, CONTROLS[dialect]
        self.form, self.tolerance, self.decimals = form, tolerance, decimals
        self.lines, self.said, self.worst = list(self.control.header), Findings(), 0.0
        self.at: dict[str, str] = {}  # words in force
        self.motion, self.plane, self.path_control, self.feed_word = "", "G17", "", ""

    def begin_path(self, letters: list[str], rotary: Sequence[bool], start: Array) -> None:
        """A path over axes with these letters: a rapid move leads to where it starts."""
        self.letters, self.rotary = letters, np.array(rotary)
        self.motion, self.feed = "", None
        self.move("G0", self.places(letters, self.degrees(start), every=True))

    def number(self, value: float) -> str:
        """A number as the control reads it: no exponent, all digits that count, a point."""
        text = np.format_float_positional(float(value) + 0.0, unique=True, precision=self.decimals, trim="-")
        text = "0" if text in ("-0", "-0.", "0.") else text
        return f"{text}." if self.control.point and "." not in text else text

    def places(self, letters: Sequence[str], point: Array, *, every: bool = False) -> list[str]:
        """Words of the axes that change, or of all of them."""
        words = []
        for letter, value in zip(letters, point, strict=True):
            text = self.number(float(value))
            if every or self.at.get(letter) != text:
                words.append(f"{letter}{text}")
            self.at[letter] = text
        return words

    def move(self, motion: str, words: Sequence[str]) -> None:
        """A line of motion; G word and F only where they change."""
        line = [*([] if motion == self.motion else [motion]), *words]
        if self.feed is not None and motion != "G0":
            said = f"F{self.number(60.0 * self.feed)}"
            line += [said] if said != self.feed_word else []
            self.feed_word = said
        self.motion = motion
        self.lines.append(" ".join(line))

    def change(self, name: str, said: str) -> None:
        """A line that says `plane` or `path_control` where it changes."""
        if said != getattr(self, name):
            self.lines.append(said)
            setattr(self, name, said)

    def approximate(self, what: str, error: float) -> None:
        """The curve is not what it was."""
        self.said.count(what, self.index)
        self.worst = max(self.worst, error)

    def findings(self) -> list[str]:
        """All that is to be said of the program."""
        found = self.said.all("curve")
        if self.worst > 0.0:
            found.append(f"what is approximated is at most {self.worst:.3g} mm from the curves, measured both ways")
        if self.decimals < 15:
            found.append(f"numbers have {self.decimals} decimals, so that places are rounded")
        return found

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
        at = {LETTERS.index(letter): column for column, letter in enumerate(self.letters)}
        return [(plane, (at[a], at[b])) for plane, (a, b) in PLANES.items() if {a, b} <= at.keys()]

    def write_curve(self, index: int, curve: NurbsCurve, feed: float | None) -> None:
        """Write a curve: lines and circular arcs as such, all else as `form` says, or where it is rapid as lines."""
        self.index, self.curve, self.feed = index, curve, feed
        if curve.degree == 1:
            self._lines(curve(curve.breaks))
        elif self.form == "g1" or feed == math.inf:
            self._chords("written as lines (G1)")
        elif not self._whole_arc():
            forms = {"arcs": self._biarcs, "g5.2": self._planar_nurbs, "g6.2": self._knotted, "bspline": self._bspline}
            forms[self.form]()

    def _lines(self, points: Array) -> None:
        for point in self.degrees(points)[1:]:
            words = self.places(self.letters, point) or [f"{self.letters[0]}{self.at[self.letters[0]]}"]
            self.move("G0" if self.feed == math.inf else "G1", words)

    def _chords(self, what: str) -> None:
        points = chords(self.curve, self.tolerance, self.rotary)
        flat = points[:, ~self.rotary]
        flat = flat[np.append(np.any(np.diff(flat, axis=0) != 0.0, axis=1), True)]
        self.approximate(what, _measured(self._linear(self.curve), [polyline(flat)] if len(flat) > 1 else []))
        self._lines(points)

    def _whole_arc(self) -> bool:
        """Write the curve as one arc or helix if it is one to rounding."""
        points = self.curve(np.linspace(*self.curve.domain, 65))
        for plane, columns in self.planes:
            places = in_plane(points, columns)
            found = circle_of(places)
            if found is None:
                continue
            centre, sweep = found
            part = np.unwrap(np.angle((places - centre) / (places[0] - centre)))[:, None] / sweep
            rest = np.delete(points, columns, axis=1)
            if np.any(np.abs(rest - rest[0] - part * (rest[-1] - rest[0])) > 2.0 * HELIX_ERROR):
                return False
            self._arc(plane, points[-1], centre - complex(places[0]), sweep)
            return True
        return False

    def _arc(self, plane: int, end: Array, centre: complex, sweep: float) -> None:
        """One G2 or G3 with its centre from the start, and P for more than one turn."""
        self.change("plane", f"G{plane}")
        words = self.places(self.letters, self.degrees(end))
        for axis, value in zip(PLANES[plane], (centre.real, centre.imag), strict=True):
            words.append(f"{'IJK'[axis]}{self.number(value)}")
        turns = math.ceil(abs(sweep) / (2.0 * math.pi) - 1e-9)
        if turns > 1:
            word, off = self.control.turns
            words.append(f"{word}{turns - off}")
        self.move("G3" if sweep > 0.0 else "G2", words)

    def _biarcs(self) -> None:
        """A curve in a plane as biarcs, any other one as lines."""
        planes = [(k, columns) for k, columns in self.planes if self.moving <= {self.letters[c] for c in columns}]
        if not planes:
            self._chords("in none of the planes G17, G18, G19, written as lines (G1)")
            return
        plane, columns = planes[0]
        curve, arcs = self.curve, biarcs(self.curve, columns, self.tolerance)
        flat = NurbsCurve(curve.degree, curve.knots, curve.control_points[:, columns], curve.weights)
        pieces = [arcs.curve(i) for i in range(len(arcs.sweep))]
        self.approximate("written as arcs (G2, G3)", _measured(flat, pieces))
        for piece, offset, sweep in zip(pieces, (arcs.centre - arcs.start).tolist(), arcs.sweep.tolist(), strict=True):
            end = curve.control_points[0].copy()
            end[list(columns)] = piece.control_points[-1]
            if sweep:
                self._arc(plane, end, offset, sweep)
            else:
                self._lines(np.array([end, end]))

    def _planar_nurbs(self) -> None:
        """LinuxCNC's G5.2: X and Y, knots clamped and uniform; others as the Bezier pieces that they consist of."""
        if not self.moving <= {"X", "Y"} <= set(self.letters):
            self._biarcs()
            return
        whole = editing.clamped(self.curve)
        pieces, steps = [whole], np.diff(whole.breaks)
        if _repeats(whole) or np.ptp(steps) > UNIFORM * np.max(steps):
            pieces = whole.split(*whole.breaks[1:-1].tolist())
            self.said.say(
                f"curve {self.index}: its knots are not uniform, so that it is written as {len(pieces)} pieces"
            )
        columns = [self.letters.index("X"), self.letters.index("Y")]
        self.change("plane", "G17")
        for piece in pieces:
            weights = [f"P{self.number(weight)}" for weight in _weights(piece)]
            rows = [self.places("XY", point, every=True) for point in piece.control_points[1:, columns]]
            rows = [[*row, weight] for row, weight in zip(rows, weights[1:], strict=True)]
            self._spline("G5.2", [[weights[0], f"L{piece.degree + 1}"], *rows, ["G5.3"]])

    def _spline(self, word: str, rows: list[list[str]]) -> None:
        self.motion = ""  # the words before and behind a spline say their G word again
        self.move(word, rows[0])
        self.lines += [" ".join(row) for row in rows[1:]]
        self.motion = ""

    def _cubic(self) -> NurbsCurve:
        """The clamped curve, or a cubic one near it where the control knows no such degree."""
        curve, degree = editing.clamped(self.curve), self.control.degree
        if curve.degree <= degree:
            return curve
        from splinefeed.paths.fitting import fit_function

        smooth = [(u, int(np.count_nonzero(curve.knots == u))) for u in curve.breaks[1:-1]]
        rough = [float(u) for u, times in smooth if curve.degree - times < 2]
        fitted, _ = fit_function(lambda u: curve(u), 0.9 * self.tolerance, degree, curve.domain, rough)
        error = _measured(self._linear(curve), [self._linear(fitted)])
        self.approximate(f"of a degree above {degree}, fitted by one of it", error)
        return fitted

    def _knotted(self) -> None:
        """G6.2: order, knots, control points and weights as they are."""
        curve = self._cubic()
        knots = [f"K{self.number(float(knot))}" for knot in curve.knots - curve.knots[0]]
        points = [self.places(self.letters, point, every=True) for point in self.degrees(curve.control_points)]
        weights = [f"R{self.number(weight)}" for weight in _weights(curve)]
        rows = [[knot, *point, weight] for knot, point, weight in zip(knots, points, weights, strict=False)]
        rows[0].insert(0, f"P{curve.degree + 1}")
        self._spline(self.control.knotted, rows + [[knot] for knot in knots[len(rows) :]])

    def _bspline(self) -> None:
        """Siemens' BSPLINE: the first control point is where the tool is, PL are steps between knots, PW weights."""
        curve = self._cubic()
        weights = np.array(_weights(curve)) / _weights(curve)[0]
        if np.max(weights) > HIGHEST_WEIGHT or _repeats(curve):
            # PW ends at 3, and a step PL of 0 within a curve is not what the manual describes: piece by piece then
            self._chords("with weights above 3 or repeated knots, written as lines (G1)")
            return
        if "PL=" in self.lines[-1]:
            self.lines.append("G1")  # or the control would take both for one spline
        steps = np.zeros(len(weights) - 1)
        steps[: len(curve.breaks) - 1] = np.diff(curve.breaks)
        rows = []
        for point, weight, step in zip(self.degrees(curve.control_points)[1:], weights[1:], steps, strict=True):
            row = self.places(self.letters, point, every=True)
            row += [f"PW={self.number(float(weight))}"] if curve.weights is not None else []
            rows.append([*row, f"PL={self.number(float(step))}"])
        rows[0].append(f"SD={curve.degree}")
        self._spline("BSPLINE", rows)

    def _linear(self, curve: NurbsCurve) -> NurbsCurve:
        """A curve over the linear axes."""
        return NurbsCurve(curve.degree, curve.knots, curve.control_points[:, ~self.rotary], curve.weights)


def _repeats(curve: NurbsCurve) -> bool:
    """Whether an inner knot is not simple."""
    return len(curve.knots) > 2 * (curve.degree + 1) + len(curve.breaks) - 2


def _weights(curve: NurbsCurve) -> list[float]:
    return [1.0] * len(curve.control_points) if curve.weights is None else curve.weights.tolist()


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

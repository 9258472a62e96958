"""Splines as LinuxCNC and Fanuc write them: G5, G5.1, G5.2 with G5.3, and G6.2.

In G5.2 [1]_ the tool's place is the first control point, L is the order (3 unless given), knots are whole numbers,
clamped. In G6.2 [2]_ P is the order (4 unless given), K the knots, as many as control points and order together, R the
weights; without a place in its first line the curve begins where the tool is, without a knot there it has that of the
second [3]_. Mitsubishi [4]_ has the same but for the knot. LinuxCNC 2.10 writes the last knots as lines of their own
that repeat the word (G6.2 K2), and a method Q, which says how its control samples the curve. Its G5.2 takes the words
of the plane in force.

References
----------
.. [1] LinuxCNC documentation, "G-Codes", G5 to G5.3.
.. [2] Fanuc Series 15i/150i-MA, Operator's Manual (Programming), "NURBS interpolation".
.. [3] Fanuc B-63324EN/03, 4.17.1.
.. [4] Mitsubishi M700V, 6.15.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from splinefeed.curves.curve import MAX_DEGREE, NurbsCurve
from splinefeed.errors import CurveError
from splinefeed.programs.gcode.codes import g_name
from splinefeed.programs.gcode.faults import LineError, refuse
from splinefeed.programs.gcode.moves import LARGEST, LETTERS, PLANES, Findings, Flag, SplineMove
from splinefeed.programs.gcode.state import ProgramState
from splinefeed.records import Array

#: Order unless the program gives it.
LINUXCNC_ORDER, FANUC_ORDER = 3, 4
#: Most control points of one spline.
MAX_POINTS = 100_000
#: The first control point may lie this far from where the tool is, mm or rad: rounding of the words.
START_TOLERANCE = 1e-3
#: The kind of a spline of Siemens.
BSPLINE = 1


class SplineWords:
    """Collects the lines of one spline after the other and adds them to the state."""

    def __init__(self, state: ProgramState, findings: Findings) -> None:
        self.state, self.findings = state, findings
        self.of_fanuc = False  # whether the first line may leave out its knot
        self.open = 0  # the code of the block that is being collected: 52 or 62
        self._tangent: Array | None = None
        self.clear()

    def clear(self) -> None:
        """No spline is open."""
        self.begin(0, 0)

    def begin(self, kind: int, line: int, order: int = 0, more: dict[str, Any] | None = None) -> None:
        """Open a spline; `kind` is 52, 62, or BSPLINE."""
        self.open, self.first_line, self.order, self._more = kind, line, order, more or {}
        self.points: list[Array] = []
        self.weights: list[float] = []
        self._knots: list[float] = []
        self.steps: list[float | None] = []  # between knots, of Siemens' PL; None for 1
        self._said, self._late = 0, False  # whether the first knot is said by the second line

    def line(
        self, code: int | None, modal: int | None, words: dict[str, float], line: int, inverse: float | None
    ) -> None:
        """One line that begins, continues or ends a spline; the words it uses are taken from `words`."""
        kind = code if code is not None else modal
        if kind in (50, 51) and self.state.plane != 17:
            raise LineError(f"{g_name(kind)} needs the plane G17")
        more: dict[str, Any] = {}
        if inverse is not None:
            words.pop("F")
            more = {"feed": inverse, "flags": Flag.INVERSE_FEED}
        elif self.state.feed_mode == 93 and code in (50, 51, 52, 62) and not self.open:
            raise LineError("F is missing; in inverse time (G93) every move needs its own")
        if kind != 50:
            self._tangent = None
        if kind in (50, 51):
            self._bezier(kind, words, line, more)
        elif kind == 53 and self.open != 52:
            raise LineError("G5.3 has no G5.2 before it")
        elif kind == 52:
            self._planar(code, words, line, more)
        elif kind == 62:
            self._knotted(code, words, line, more)

    def _bezier(self, kind: int, words: dict[str, float], line: int, more: dict[str, Any]) -> None:
        """G5 and G5.1: a polynomial curve by its control points beside its ends."""
        leave, arrive = self._pair(words, "IJ", kind == 50), self._pair(words, "PQ", True) if kind == 50 else None
        axes = {letter: words.pop(letter) for letter in LETTERS if letter in words}
        refuse(not axes or set(axes) - {"X", "Y"}, f"{g_name(kind)} moves X and Y, and nothing else")
        there, said = self.state.target(axes)
        if kind == 50:
            leave = self._tangent if leave is None else leave
            if leave is None or arrive is None:
                raise LineError("G5 needs P and Q" if arrive is None else "the first G5 of a row needs I and J")
            self._tangent = -arrive
        elif leave is None or not leave.any():
            raise LineError("G5.1 needs I or J, and not both 0")
        points = np.array([self.state.position, self.state.position, *([there] if kind == 50 else []), there])
        points[1, :2] += leave
        if arrive is not None:
            points[2, :2] += arrive
        self.state.add_spline(SplineMove.bezier(points, line), said | 3, **more)

    def _pair(self, words: dict[str, float], letters: str, both: bool) -> Array | None:
        """Two words in mm, or None if neither stands; LineError for one alone where `both` are needed."""
        there = [letter for letter in letters if letter in words]
        refuse(both and len(there) == 1, f"{letters[0]} and {letters[1]} belong together; one is missing")
        return np.array([self.state.scaled(0, words.pop(letter, 0.0)) for letter in letters]) if there else None

    def _planar(self, code: int | None, words: dict[str, float], line: int, more: dict[str, Any]) -> None:
        """G5.2: a control point in the plane in force; the first one may be where the tool is."""
        axes = {letter: words.pop(letter) for letter in LETTERS if letter in words}
        weight = words.pop("P", 1.0)
        if code == 52:
            self.begin(52, line, order_of(words.pop("L", LINUXCNC_ORDER)), more)
            self.here(1.0 if axes else weight)
            if not axes:
                return
        plane = self.state.plane
        first, second = (LETTERS[axis] for axis in sorted(PLANES[plane]))
        if set(axes) != {first, second}:
            raise LineError(f"a control point of G5.2 in G{plane} needs {first} and {second}, and nothing else but P")
        refuse(self.state.relative, "control points of G5.2 need absolute places (G90)")
        self.point(axes, weight)

    def goes_on(self, code: int, words: dict[str, float]) -> bool:
        """Whether a line with the word `code` is one of the spline that is open: G6.2 with nothing but a knot."""
        return code == self.open == 62 and "K" in words and "P" not in words and not words.keys() & set(LETTERS)

    def _knotted(self, code: int | None, words: dict[str, float], line: int, more: dict[str, Any]) -> None:
        """G6.2: a control point with its knot, or one of the last knots."""
        if code == 62 and not self.open:
            self.begin(62, line, order_of(words.pop("P", FANUC_ORDER)), more)
            words.pop("Q", None), words.pop("L", None)
        elif not self.open:
            raise LineError("the spline before has all its knots; begin the next one with G6.2")
        axes = {letter: words.pop(letter) for letter in LETTERS if letter in words}
        knot, weight = words.pop("K", None), words.pop("R", 1.0)
        if knot is None and not self.points and self.of_fanuc:
            self._late = True
        else:
            refuse(knot is None and (code is None or axes), "every line of G6.2 needs its knot, K")
        if axes:
            self.point(axes, weight)
        elif not self.points:
            self.here(weight)
        self._knots += [] if knot is None else [knot] * (1 + self._late)
        self._late &= knot is None
        if len(self._knots) == len(self.points) + self.order:
            self.end()

    def here(self, weight: float) -> None:
        """The first control point is where the tool is."""
        self.points.append(self.state.position.copy())
        self.weights.append(weight)

    def point(self, axes: dict[str, float], weight: float) -> None:
        """A control point: what is not said stays as in the one before, and relative words count from it."""
        refuse(len(self.points) >= MAX_POINTS, f"a spline of more than {MAX_POINTS} control points")
        refuse(not 0.0 < weight <= LARGEST, f"the weight {weight:g} of a control point must be greater than 0")
        there, said = self.state.target(axes, self.points[-1] if self.points else None)
        self.points.append(there)
        self.weights.append(weight)
        self._said |= said

    def end(self) -> None:
        """Finish the block that is open, if one is; LineError for one that is not complete."""
        if not self.open:
            return
        order, points, weights = self.order, np.array(self.points), np.array(self.weights)
        who, spans = f"the spline from line {self.first_line} on", max(len(points) - order + 1, 0)
        refuse(any(self.steps[spans:]), f"{who}: the last {order - 2} PL must be 0 or left out")
        steps = [1.0 if step is None else step for step in self.steps[:spans]] or [1.0] * spans
        knots = np.array(self._knots if self.open == 62 else np.pad(np.cumsum([0.0, *steps]), order - 1, "edge"))
        if len(knots) != len(points) + order or spans < 1 or np.ptp(points, axis=0).any():  # else it has no length
            try:
                curve = NurbsCurve(order - 1, knots, points, weights).with_clamped_ends()
            except CurveError as error:
                raise LineError(f"{who}: {error}") from None
            knots, points = curve.knots, curve.control_points.copy()
            weights = np.ones(len(points)) if curve.weights is None else curve.weights
        if (off := float(np.max(np.abs(points[-1] - self.points[-1])))) > START_TOLERANCE:
            self.findings.say(
                f"line {self.first_line}: the spline ends where its last knot span ends, at knot {knots[-1]:g}, "
                f"{off:.6g} mm from its last control point; repeat the last knot {order} times to reach it"
            )
        if (gap := float(np.max(np.abs(points[0] - self.state.position)))) > START_TOLERANCE:
            raise LineError(
                f"{who} begins {gap:.6g} mm from where the tool is; its first control point must be the place "
                "reached before"
            )
        points[0] = self.state.position
        spline = SplineMove(order - 1, knots, points, weights, self.first_line)
        self.state.add_spline(spline, self._said, **self._more)
        self.clear()


def order_of(value: float) -> int:
    """The order that a program says; LineError for none that can be."""
    if not 2 <= value <= MAX_DEGREE + 1 or value != round(value):
        raise LineError(f"the order {value:g} of a spline must be whole, 2 to {MAX_DEGREE + 1}")
    return round(value)

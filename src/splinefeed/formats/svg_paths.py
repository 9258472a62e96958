"""The data of SVG paths: commands to exact curves, in user units, y down.

Source: W3C, Scalable Vector Graphics (SVG) 1.1, chapter 8 and appendix F.6; 2.0, chapter 9.
"""

from __future__ import annotations

import cmath
import math
import re
from typing import NamedTuple

from splinefeed.geometry.arcs import bulge_points
from splinefeed.records import Array

_NUMBER = r"\s*+,?\s*+((?>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?))"
_FLAG = r"\s*+,?\s*+([01])"
_COMMAND = re.compile(r"\s*([MmZzLlHhVvCcSsQqTtAa])")
_MORE = re.compile(rf"{_NUMBER}|\s*,")
#: How many numbers each command takes at a time; an arc's fourth and fifth are flags.
_COUNTS = {"M": 2, "Z": 0, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
_ARGUMENTS = {letter: re.compile(_NUMBER * count) for letter, count in _COUNTS.items()}
_ARGUMENTS["A"] = re.compile(_NUMBER * 3 + _FLAG * 2 + _NUMBER * 2)
#: Letters of the data that a message shows.
_SHOWN = 20


class Piece(NamedTuple):
    """One curve: Bezier control points as complex numbers x + i y; weights where they are not 1; knots of an arc."""

    points: list[complex]
    weights: Array | None = None
    knots: Array | None = None


class Subpath(NamedTuple):
    """Pieces joined end to end."""

    pieces: list[Piece]


def parse(data: str) -> tuple[list[Subpath], str]:
    """Subpaths of path data, and what is wrong with it; "" if nothing is. What stands before the fault is kept."""
    if data.strip() in ("", "none"):
        return [], ""
    return _Builder(data).build()


class _Builder:
    """Walks the data once; `fault` says where it stopped."""

    def __init__(self, data: str) -> None:
        self.data = data
        self.at = 0
        self.subpaths: list[Subpath] = []
        self.pieces: list[Piece] = []
        self.here = self.start = 0j
        self.handle: complex | None = None  # the last control point, which S and T mirror
        self.last = ""

    def build(self) -> tuple[list[Subpath], str]:
        fault = self._walk()
        self._end()
        return self.subpaths, fault

    def _walk(self) -> str:
        data = self.data.rstrip()
        while self.at < len(data):
            match = _COMMAND.match(data, self.at)
            if match is None:
                return self._fault("expected a command")
            letter = match[1]
            command, relative = letter.upper(), letter.islower()
            if not self.last and command != "M":
                return self._fault("expected M first")
            self.at = match.end()
            if command == "Z":
                self._close()
                continue
            found = None if data.startswith(",", self.at) else _ARGUMENTS[command].match(data, self.at)
            if found is None or found[0].lstrip().startswith(","):
                return self._fault(f"{letter} needs {_COUNTS[command]} numbers")
            while found is not None:
                values = [float(each) for each in found.groups()]
                self.at = found.end()
                if not all(map(math.isfinite, values)):
                    return self._fault("a number is too large")
                self._draw(command, values, relative)
                if command == "M":
                    command = "L"  # more pairs after a move are lines
                found = _ARGUMENTS[command].match(data, self.at)
            if _MORE.match(data, self.at):
                return self._fault(f"{letter} needs {_COUNTS[command]} numbers")
        return ""

    def _fault(self, text: str) -> str:
        rest = self.data[self.at :].strip()
        return f"{text} at {rest[:_SHOWN]!r}" if rest else f"{text}, but the data ends"

    # --- commands -----------------------------------------------------------------------------------------------------

    def _draw(self, command: str, values: list[float], relative: bool) -> None:
        if self.last == "Z" and command != "M":
            self.here = self.start
        last, self.last = self.last, command
        origin = self.here if relative else 0j
        if command == "H":
            points = [complex(values[0] + origin.real, self.here.imag)]
        elif command == "V":
            points = [complex(self.here.real, values[0] + origin.imag)]
        else:
            coordinates = values[-2:] if command == "A" else values
            points = [complex(x, y) + origin for x, y in zip(coordinates[0::2], coordinates[1::2], strict=True)]
        if command == "M":
            self._end()
            self.here = self.start = points[0]
            self.handle = None
            return
        if command in "ST":  # the control point of a curve of the same degree before goes on
            same = self.handle is not None and last in ("CS" if command == "S" else "QT")
            points.insert(0, 2.0 * self.here - self.handle if same and self.handle is not None else self.here)
        if command == "A" and (piece := elliptical(self.here, points[0], *values[:5])):
            self.pieces.append(piece)
            self.handle, self.here = None, points[0]
            return
        self._add([self.here, *points], points[-2] if command in "CSQT" else None)

    def _add(self, points: list[complex], handle: complex | None = None) -> None:
        self.handle = handle
        if any(point != points[0] for point in points):
            self.pieces.append(Piece(points))
        self.here = points[-1]

    def _end(self) -> None:
        if self.pieces:
            self.subpaths.append(Subpath(self.pieces))
        self.pieces = []

    def _close(self) -> None:
        if self.here != self.start:
            self._add([self.here, self.start])
        self._end()
        self.here, self.handle, self.last = self.start, None, "Z"


def elliptical(
    begin: complex, end: complex, rx: float, ry: float, degrees: float, large: float, positive: float
) -> Piece | None:
    """The arc of an ellipse from `begin` to `end` exactly; None where it is a straight line.

    In the plane where the ellipse is the unit circle its sweep follows from the chord alone, and the arc from both, so
    that a flat arc of a huge ellipse keeps its digits. Radii that are too small grow until the chord fits (F.6.6).
    """
    rx, ry = abs(rx), abs(ry)
    if begin == end or rx == 0.0 or ry == 0.0:
        return None
    turn = cmath.exp(1j * math.radians(degrees)) if degrees % 360.0 else 1.0 + 0j
    if degrees % 90.0 == 0.0:
        turn = (1, 1j, -1, -1j)[round(degrees / 90.0) % 4] + 0j
    across = (end - begin) * turn.conjugate()
    chord = complex(across.real / rx, across.imag / ry)
    half = abs(chord) / 2.0
    if not math.isfinite(half) or half == 0.0:
        return None
    if half >= 1.0:
        rx, ry, chord = rx * half, ry * half, chord / half
        quarter_sweep = 0.25 * math.pi
    else:
        quarter_sweep = 0.5 * math.asin(half)
        if large:
            quarter_sweep = 0.5 * math.pi - quarter_sweep
    bulge = math.tan(quarter_sweep) if positive else -math.tan(quarter_sweep)
    places, knots, weights = bulge_points(chord, bulge)
    points = [begin + complex(place.real * rx, place.imag * ry) * turn for place in places]
    points[-1] = end
    return Piece(points, weights, knots)

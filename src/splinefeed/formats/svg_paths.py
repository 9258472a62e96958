"""The data of SVG paths: commands to exact curves, in user units, y down.

Source: W3C, Scalable Vector Graphics (SVG) 1.1, chapter 8 and appendix F.6; 2.0, chapter 9.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable
from typing import NamedTuple

from splinefeed.geometry.arcs import bulge_points
from splinefeed.records import Array

_NUMBER_TEXT = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_FIRST = re.compile(rf"\s*({_NUMBER_TEXT})")
_NEXT = re.compile(rf"\s*,?\s*({_NUMBER_TEXT})")
_FLAG = re.compile(r"\s*,?\s*([01])")
_COMMAND = re.compile(r"\s*([MmZzLlHhVvCcSsQqTtAa])")
_SPACE = re.compile(r"\s*")
#: How many numbers each command takes at a time; an arc's fourth and fifth are flags.
_ARGUMENTS = {"M": 2, "Z": 0, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
_FLAGS = (3, 4)
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
        self._torn = False
        self.handle: complex | None = None  # the last control point, which S and T mirror
        self.last = ""
        self._commands: dict[str, Callable[[list[float], bool], None]] = {
            "M": self._move, "L": self._line, "H": self._horizontal, "V": self._vertical, "C": self._cubic,
            "S": self._smooth_cubic, "Q": self._quadratic, "T": self._smooth_quadratic, "A": self._arc,
        }  # fmt: skip

    def build(self) -> tuple[list[Subpath], str]:
        fault = self._walk()
        self._end()
        return self.subpaths, fault

    def _walk(self) -> str:
        data, length = self.data, len(self.data)
        self.at = _SPACE.match(data).end()  # type: ignore[union-attr]
        while self.at < length:
            match = _COMMAND.match(data, self.at)
            if match is None:
                return self._fault("expected a command")
            letter = match.group(1)
            command, relative = letter.upper(), letter.islower()
            if not self.last and command != "M":
                return self._fault("expected M first")
            self.at = match.end()
            if command == "Z":
                self._close()
                self.last = "Z"
            else:
                first = True
                while True:
                    values = self._values(_ARGUMENTS[command], command == "A", first)
                    if values is None:
                        if first:
                            return self._fault(f"{letter} needs {_ARGUMENTS[command]} numbers")
                        break
                    if not all(map(math.isfinite, values)):
                        return self._fault("a number is too large")
                    if self.last == "Z" and command != "M":
                        self.here = self.start
                    self._commands[command](values, relative)
                    self.last = command
                    if command == "M":
                        command = "L"  # more pairs after a move are lines
                    first = False
                if self._torn:
                    return self._fault(f"{letter} needs {_ARGUMENTS[command]} numbers")
            self.at = _SPACE.match(data, self.at).end()  # type: ignore[union-attr]
        return ""

    def _values(self, count: int, arc: bool, first: bool) -> list[float] | None:
        """The next `count` numbers, or None; `_torn` tells whether some but not all of them are there."""
        values: list[float] = []
        at = self.at
        self._torn = False
        for k in range(count):
            pattern = _FLAG if arc and k in _FLAGS else _FIRST if first and k == 0 else _NEXT
            match = pattern.match(self.data, at)
            if match is None:
                self._torn = k > 0 or self.data[at:].lstrip().startswith(",")
                return None
            values.append(float(match.group(1)))
            at = match.end()
        self.at = at
        return values

    def _fault(self, text: str) -> str:
        rest = self.data[self.at :].strip()
        return f"{text} at {rest[:_SHOWN]!r}" if rest else f"{text}, but the data ends"

    # --- commands -----------------------------------------------------------------------------------------------------

    def _points(self, values: list[float], relative: bool) -> list[complex]:
        origin = self.here if relative else 0j
        return [complex(x, y) + origin for x, y in zip(values[0::2], values[1::2], strict=True)]

    def _end(self) -> None:
        if self.pieces:
            self.subpaths.append(Subpath(self.pieces))
        self.pieces = []

    def _add(self, points: list[complex], handle: complex | None = None) -> None:
        self.handle = handle
        if any(point != points[0] for point in points):
            self.pieces.append(Piece(points))
        self.here = points[-1]

    def _move(self, values: list[float], relative: bool) -> None:
        (point,) = self._points(values, relative)
        self._end()
        self.here = self.start = point
        self.handle = None

    def _close(self) -> None:
        if self.here != self.start:
            self._add([self.here, self.start])
        self._end()
        self.here = self.start
        self.handle = None

    def _line(self, values: list[float], relative: bool) -> None:
        self._add([self.here, *self._points(values, relative)])

    def _horizontal(self, values: list[float], relative: bool) -> None:
        self._add([self.here, complex(values[0] + (self.here.real if relative else 0.0), self.here.imag)])

    def _vertical(self, values: list[float], relative: bool) -> None:
        self._add([self.here, complex(self.here.real, values[0] + (self.here.imag if relative else 0.0))])

    def _cubic(self, values: list[float], relative: bool) -> None:
        points = self._points(values, relative)
        self._add([self.here, *points], points[1])

    def _smooth_cubic(self, values: list[float], relative: bool) -> None:
        points = self._points(values, relative)
        self._add([self.here, self._mirrored("CS"), *points], points[0])

    def _quadratic(self, values: list[float], relative: bool) -> None:
        points = self._points(values, relative)
        self._add([self.here, *points], points[0])

    def _smooth_quadratic(self, values: list[float], relative: bool) -> None:
        middle = self._mirrored("QT")
        self._add([self.here, middle, *self._points(values, relative)], middle)

    def _mirrored(self, after: str) -> complex:
        return 2.0 * self.here - self.handle if self.handle is not None and self.last in after else self.here

    def _arc(self, values: list[float], relative: bool) -> None:
        end = complex(values[5], values[6]) + (self.here if relative else 0j)
        piece = elliptical(self.here, end, values[0], values[1], values[2], values[3] != 0.0, values[4] != 0.0)
        if piece is None:
            self._add([self.here, end])
            return
        self.handle = None
        self.pieces.append(piece)
        self.here = end


def elliptical(
    begin: complex, end: complex, rx: float, ry: float, degrees: float, large: bool, positive: bool
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

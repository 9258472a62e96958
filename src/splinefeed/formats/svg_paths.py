"""Path data and basic shapes of SVG as exact pieces of curves, in user units, y down.

Source: W3C, Scalable Vector Graphics (SVG) 1.1, chapters 8 and 9 and appendix F.6; 2.0, chapter 9.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from splinefeed.curves.arcs import arc, bulge_points
from splinefeed.formats.svg_places import ShapeError, View, length, numbers
from splinefeed.numbers import MOST, within
from splinefeed.records import Array

_NUMBER = r"\s*+,?\s*+((?>[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]+)?))"
_FLAG = r"\s*+,?\s*+([01])"
_COMMAND = re.compile(r"\s*([MmZzLlHhVvCcSsQqTtAa])(?!\s*,)")
#: How many numbers each command takes at a time; an arc's fourth and fifth are flags.
_COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
_ARGUMENTS = {letter: re.compile(_NUMBER * count) for letter, count in _COUNTS.items()}
_ARGUMENTS["A"] = re.compile(_NUMBER * 3 + _FLAG * 2 + _NUMBER * 2)


class SvgPiece(NamedTuple):
    """Straight lines, a Bezier curve or an arc.

    Parameters
    ----------
    points : list of complex
        Control points x + i y, px.
    straight : bool, optional
        Whether it is a line through all of its points.
    weights : array, optional
        One a point, where they are not 1.
    knots : array, optional
        Of an arc.
    """

    points: list[complex]
    straight: bool = False
    weights: Array | None = None
    knots: Array | None = None


@lru_cache(maxsize=256)
def parse(data: str) -> tuple[list[list[SvgPiece]], str]:
    """Read path data of SVG.

    Parameters
    ----------
    data : str
        The attribute d.

    Returns
    -------
    runs : list of list of SvgPiece
        Pieces joined end to end.
    fault : str
        What is wrong, if anything; what comes before is kept.
    """
    builder = _Builder()
    fault = "" if data.strip() == "none" else builder.read(data)
    return [run for run in builder.runs if run], fault


class _Builder:
    """The curves of path data, command by command."""

    def __init__(self) -> None:
        self.runs: list[list[SvgPiece]] = []
        self.here = self.start = 0j
        self.handle: complex | None = None  # the last control point, which S and T mirror
        self.last = ""

    def read(self, data: str) -> str:
        """Take over path data up to its first fault, and say what that is."""
        at, end, expected = 0, len(data.rstrip()), ""
        while at < end and not expected:
            match = _COMMAND.match(data, at)
            if match is None or not (self.last or match[1] in "Mm"):
                expected = "a command, M first"
                break
            letter, at = match[1], match.end()
            if letter in "Zz":
                self._close()
                continue
            pattern = _ARGUMENTS[letter.upper()]
            found = pattern.match(data, at)
            expected = "" if found else f"{_COUNTS[letter.upper()]} numbers for {letter}"
            while found and not expected:
                values = [float(each) for each in found.groups()]
                if not all(map(within, values)):
                    expected = f"numbers of at most {MOST:g}"
                    break
                self._draw(letter, values)
                at = found.end()
                letter = {"M": "L", "m": "l"}.get(letter, letter)  # more pairs after a move are lines
                found = pattern.match(data, at)
        rest = data[at:].strip()[:20]
        return expected and f"expected {expected}{f' at {rest!r}' if rest else ', but the data ends'}"

    def _draw(self, letter: str, values: list[float]) -> None:
        command, origin = letter.upper(), self.here if letter.islower() else 0j
        last, self.last = self.last, command
        if command == "H":
            points = [complex(values[0] + origin.real, self.here.imag)]
        elif command == "V":
            points = [complex(self.here.real, values[0] + origin.imag)]
        else:
            coordinates = values[-2:] if command == "A" else values
            points = [complex(x, y) + origin for x, y in zip(coordinates[0::2], coordinates[1::2], strict=True)]
        if command == "M":
            self.here = self.start = points[0]
            self.runs.append([])
            return
        if last in ("", "Z"):
            self.runs.append([])
        if command in "ST":  # the control point of a curve of the same degree before goes on
            mirrored = self.handle is not None and last in ("CS" if command == "S" else "QT")
            points.insert(0, 2.0 * self.here - self.handle if mirrored and self.handle is not None else self.here)
        self.handle = points[-2] if command in "CSQT" else None
        if command == "A" and (piece := elliptical(self.here, points[0], *values[:5])):
            self.runs[-1].append(piece)
        elif len(points) == 1:
            self._line(points[0])
        elif any(point != self.here for point in points):
            self.runs[-1].append(SvgPiece([self.here, *points]))
        self.here = points[-1]

    def _line(self, end: complex) -> None:
        run = self.runs[-1]
        if end == self.here:
            return
        if run and run[-1].straight:
            run[-1].points.append(end)
        else:
            run.append(SvgPiece([self.here, end], straight=True))

    def _close(self) -> None:
        if self.last != "Z":
            self._line(self.start)
        self.here, self.handle, self.last = self.start, None, "Z"


def elliptical(
    begin: complex, end: complex, rx: float, ry: float, degrees: float, large: float, positive: float
) -> SvgPiece | None:
    """Return the arc of an ellipse from `begin` to `end` exactly; None where it is a straight line.

    Parameters
    ----------
    begin, end : complex
        x + i y, px.
    rx, ry : float
        Radii, px.
    degrees : float
        By which the ellipse is turned, deg.
    large, positive : float
        Flags of the path data: whether not 0.

    Returns
    -------
    SvgPiece or None
        The arc.

    Notes
    -----
    In the plane where the ellipse is the unit circle its sweep follows from the chord alone, and the arc from both, so
    that a flat arc of a huge ellipse keeps its digits. Radii that are too small grow until the chord fits.

    References
    ----------
    .. [1] W3C, SVG 1.1, appendix F.6.6.
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
    return SvgPiece(points, weights=weights, knots=knots)


def shape(tag: str, given: Mapping[str, str], view: View) -> list[list[SvgPiece]]:
    """Return the outline of a basic shape; empty where its size is 0."""
    if tag in ("polyline", "polygon", "line"):
        if tag == "line":
            listed = [length(given, name, view) for name in ("x1", "y1", "x2", "y2")]
        else:
            listed = numbers(given.get("points", ""), "points")
        if len(listed) % 2:
            raise ShapeError(f"points: {len(listed)} numbers; expected pairs")
        points = [complex(x, y) for x, y in zip(listed[0::2], listed[1::2], strict=True)]
        points += points[:1] if tag == "polygon" else []
        points = points[:1] + [end for begin, end in pairwise(points) if begin != end]
        return [[SvgPiece(points, straight=True)]] if len(points) > 1 else []
    rx, ry = (length(given, name, view, math.nan) for name in (("r", "r") if tag == "circle" else ("rx", "ry")))
    rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
    rx, ry = (0.0, 0.0) if math.isnan(rx) else (rx, ry)  # one that is not given is as the other
    width, height = length(given, "width", view), length(given, "height", view)
    if min(width, height, rx, ry) < 0.0:
        raise ShapeError("its width, height or radius is below 0; expected 0 or more")
    if tag == "rect":
        return _rectangle(length(given, "x", view), length(given, "y", view), width, height, rx, ry)
    if rx == 0.0 or ry == 0.0:
        return []
    center = np.array([length(given, "cx", view), length(given, "cy", view)])
    whole = arc(center, np.array([rx, 0.0]), np.array([0.0, ry]), 0.0, 2.0 * math.pi)
    points = whole.control_points.view(np.complex128).ravel().tolist()
    return [[SvgPiece(points, weights=whole.weights, knots=whole.knots)]]


def _rectangle(x: float, y: float, width: float, height: float, rx: float, ry: float) -> list[list[SvgPiece]]:
    if width == 0.0 or height == 0.0:
        return []
    rx, ry = min(rx, 0.5 * width), min(ry, 0.5 * height)
    rx, ry = (rx, ry) if rx > 0.0 and ry > 0.0 else (0.0, 0.0)
    right, low = x + width, y + height
    corner = f"A{rx!r} {ry!r} 0 0 1"
    return parse(
        f"M{x + rx!r} {y!r}H{right - rx!r}{corner}{right!r} {y + ry!r}V{low - ry!r}{corner}{right - rx!r} {low!r}"
        f"H{x + rx!r}{corner}{x!r} {low - ry!r}V{y + ry!r}{corner}{x + rx!r} {y!r}Z"
    )[0]

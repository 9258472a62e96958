"""Arcs of a curve: the one that it is, or biarcs within a tolerance.

Source: Bolton, Biarc curves, Computer-Aided Design 7, 1975, doi:10.1016/0010-4485(75)90086-X; the biarc whose tangents
at both ends have the same length to the joint's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats.gcode import layout
from splinefeed.formats.gcode.moves import LETTERS
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array

#: Arcs that are flatter than this, relative to their chord, and larger than LARGEST_RADIUS, mm, are written as lines.
FLAT = 1e-9
LARGEST_RADIUS = 1e5
#: Most arcs of one curve.
MAX_ARCS = 200_000
#: A curve this near a circle, relative to its radius, is one.
EXACT = 1e-9
#: First and second axis of each plane, counterclockwise from the one to the other, as letters.
PLANES = {f"G{plane}": (LETTERS[a], LETTERS[b]) for plane, (a, b) in layout.PLANES.items()}


@dataclass(frozen=True)
class Arc:
    """One arc or, without a centre, one line in a plane, (2,) each; sweep rad, positive counterclockwise."""

    start: Array
    end: Array
    centre: Array | None = None
    sweep: float = 0.0

    def distances(self, points: Array) -> Array:
        """Distances (n,) of points (n, 2)."""
        if self.centre is None:
            chord = self.end - self.start
            part = np.clip((points - self.start) @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
            return _lengths(points - self.start - part[:, None] * chord)
        off: Array = points - self.centre
        radius = float(np.linalg.norm(self.start - self.centre))
        turn = 1.0 if self.sweep > 0.0 else -1.0
        first = math.atan2(*(self.start - self.centre)[::-1])
        ahead = np.mod(turn * (np.arctan2(off[:, 1], off[:, 0]) - first), 2.0 * math.pi)
        inside = ahead <= abs(self.sweep)
        ends = np.minimum(_lengths(points - self.start), _lengths(points - self.end))
        return np.where(inside, np.abs(_lengths(off) - radius), ends)


def _lengths(vectors: Array) -> Array:
    """Lengths (n,) of vectors (n, 2)."""
    lengths: Array = np.linalg.norm(vectors, axis=1)
    return lengths


def circle_of(points: Array) -> tuple[Array, float] | None:
    """Centre (2,) and sweep of the arc that runs through points (n, 2) in order; None if they lie on no circle."""
    n = len(points)
    a, b, c = points[0], points[n // 3], points[2 * n // 3]
    matrix = 2.0 * np.array([b - a, c - a])
    determinant = float(np.linalg.det(matrix))
    scale = float(np.max(np.abs(matrix)))
    if abs(determinant) <= FLAT * scale * scale or scale == 0.0:
        return None
    centre = a + np.linalg.solve(matrix, [(b - a) @ (b - a), (c - a) @ (c - a)])
    off = points - centre
    radii = np.linalg.norm(off, axis=1)
    if radii[0] > LARGEST_RADIUS or np.ptp(radii) > EXACT * (1.0 + radii[0]):
        return None
    angles = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
    turned = np.diff(angles)
    if not (np.all(turned > 0.0) or np.all(turned < 0.0)) or np.max(np.abs(turned)) > 1.0:
        return None
    return centre, float(angles[-1] - angles[0])


def biarcs(curve: NurbsCurve, columns: tuple[int, int], tolerance: float) -> list[Arc]:
    """Arcs and lines in a plane, tangent to each other, within `tolerance`, mm, of the curve at samples of each."""
    found: list[Arc] = []
    pending = [(float(a), float(b), 0) for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True)][::-1]
    fractions = np.linspace(0.0, 1.0, 18)[1:-1]
    while pending:
        low, high, depth = pending.pop()
        u = low + fractions * (high - low)
        ends = curve(np.array([low, high]))[:, columns]
        tangents = _tangents(curve, low, high, columns)
        pair = _biarc(ends[0], ends[1], *tangents)
        points = curve(u)[:, columns]
        if pair is not None:
            off = np.min([arc.distances(points) for arc in pair], axis=0)
            if float(off.max()) <= 0.95 * tolerance:
                found += pair
                if len(found) > MAX_ARCS:
                    raise InputError(f"more than {MAX_ARCS} arcs for one curve; allow more than {tolerance:g} mm")
                continue
        if depth >= 40:
            found.append(Arc(ends[0], ends[1]))
            continue
        middle = 0.5 * (low + high)
        pending += [(middle, high, depth + 1), (low, middle, depth + 1)]
    return [arc for arc in found if np.any(arc.start != arc.end)]


def _tangents(curve: NurbsCurve, low: float, high: float, columns: tuple[int, int]) -> tuple[Array, Array]:
    """Unit tangents (2,) at the ends of a part of the curve, from inside it."""
    from splinefeed.geometry.differential import unit_tangents

    ends = [unit_tangents(curve, [u], side=side)[0][list(columns)] for u, side in ((low, "right"), (high, "left"))]
    return ends[0], ends[1]


def _biarc(start: Array, end: Array, leave: Array, arrive: Array) -> list[Arc] | None:
    """Two arcs from start to end with the given unit tangents; None if there is no good pair."""
    chord = end - start
    square = float(chord @ chord)
    if square == 0.0:
        return None
    both = float(chord @ (leave + arrive))
    spread = 2.0 * (1.0 - float(leave @ arrive))
    if spread > 1e-12:
        length = (-both + math.sqrt(both * both + spread * square)) / spread
    elif both > 0.0:
        length = square / (2.0 * both)
    else:
        return None
    if not 0.0 < length < 10.0 * math.sqrt(square):
        return None
    joint = 0.5 * (start + end + length * (leave - arrive))
    first, second = _arc(start, joint, leave, forward=True), _arc(joint, end, arrive, forward=False)
    if abs(first.sweep) > 0.9 * math.pi or abs(second.sweep) > 0.9 * math.pi:
        return None
    return [first, second]


def _arc(start: Array, end: Array, tangent: Array, *, forward: bool) -> Arc:
    """The arc from start to end with a unit tangent at the start, or at the end if not `forward`."""
    chord = end - start
    base = start if forward else end
    normal = np.array([-tangent[1], tangent[0]])
    towards = chord if forward else -chord
    height = float(normal @ towards)
    square = float(chord @ chord)
    if abs(height) <= FLAT * math.sqrt(square) or square > 2.0 * LARGEST_RADIUS * abs(height):
        return Arc(start, end)
    radius = square / (2.0 * height)
    centre = base + radius * normal
    along = float(tangent @ chord)
    sweep = 2.0 * math.atan2(height, along)
    return Arc(start, end, centre, sweep)

"""Lines and arcs near a curve: the arc that it is, biarcs within a tolerance, or chords.

Source: Bolton, Biarc curves, Computer-Aided Design 7, 1975, doi:10.1016/0010-4485(75)90086-X; the biarc whose tangents
at both ends have the same length to the joint's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import InputError
from splinefeed.geometry.arcs import bulge_arc, polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array, BoolArray

#: Places of a plane, as complex numbers.
Places = NDArray[np.complex128]
#: Arcs that are flatter than this, relative to their chord, and larger than LARGEST_RADIUS, mm, are written as lines.
FLAT = 1e-9
LARGEST_RADIUS = 1e5
#: Most arcs and chords of one curve.
MAX_ARCS, MAX_CHORDS = 200_000, 500_000
#: A curve this near a circle, relative to its radius, is one.
EXACT = 1e-9
#: Samples of an arc, and of a chord, at which its distance from the curve is taken, and the share of the tolerance that
#: it may use up there: between the samples it is a little more.
ARC_SAMPLES, SAMPLES, SHARE = 16, 9, 0.95
#: How far rotary axes may be from the curve's, rad.
ROTARY_TOLERANCE = 1e-4
#: Halvings of a span after which an arc is a line.
_DEEPEST = 40


@dataclass(frozen=True)
class Arc:
    """One arc or, without a sweep, one line; sweep rad, positive counterclockwise."""

    start: complex
    end: complex
    centre: complex = 0j
    sweep: float = 0.0

    @property
    def ends(self) -> Array:
        """Start and end, (2, 2)."""
        return np.array([[self.start.real, self.start.imag], [self.end.real, self.end.imag]])

    @property
    def curve(self) -> NurbsCurve:
        """The curve (x, y) that a control runs."""
        begin, end = self.ends
        return bulge_arc(begin, end, math.tan(0.25 * self.sweep)) if self.sweep else polyline(self.ends)

    def distances(self, places: Places) -> Array:
        """Distances (n,) of places (n,)."""
        if not self.sweep:
            chord = self.end - self.start
            along = (np.conj(chord) * (places - self.start)).real / max(abs(chord) ** 2, 1e-300)
            return np.asarray(np.abs(places - self.start - np.clip(along, 0.0, 1.0) * chord))
        off, first = places - self.centre, self.start - self.centre
        ahead = np.mod(math.copysign(1.0, self.sweep) * np.angle(off / first), 2.0 * math.pi)
        ends = np.minimum(np.abs(places - self.start), np.abs(places - self.end))
        return np.where(ahead <= abs(self.sweep), np.abs(np.abs(off) - abs(first)), ends)


def circle_of(places: Places) -> tuple[complex, float] | None:
    """Centre and sweep of the arc that runs through places (n,) in order; None if they lie on no circle."""
    n = len(places)
    a, one, other = places[0], places[n // 3] - places[0], places[2 * n // 3] - places[0]
    cross = float((np.conj(one) * other).imag)
    if abs(cross) <= FLAT * max(abs(one), abs(other)) ** 2:
        return None
    centre = complex(a + 0.5j * (one * abs(other) ** 2 - other * abs(one) ** 2) / cross)
    off = places - centre
    radii = np.abs(off)
    if radii[0] > LARGEST_RADIUS or np.ptp(radii) > EXACT * (1.0 + radii[0]):
        return None
    turned = np.angle(off[1:] / off[:-1])
    if not (np.all(turned > 0.0) or np.all(turned < 0.0)) or np.max(np.abs(turned)) > 1.0:
        return None
    return centre, float(turned.sum())


def biarcs(curve: NurbsCurve, columns: tuple[int, int], tolerance: float) -> list[Arc]:
    """Arcs and lines in a plane, tangent to each other, within `tolerance`, mm, of the curve at samples of each."""
    from splinefeed.geometry.differential import unit_tangents

    found: list[Arc] = []
    pending = [(float(a), float(b), 0) for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True)][::-1]
    while pending:
        low, high, depth = pending.pop()
        places = in_plane(curve(np.linspace(low, high, ARC_SAMPLES + 2)), columns)
        ways = [unit_tangents(curve, [u], side=side) for u, side in ((low, "right"), (high, "left"))]
        leave, arrive = (complex(in_plane(way, columns)[0]) for way in ways)
        pair = _biarc(complex(places[0]), complex(places[-1]), leave, arrive)
        near = pair and np.min([arc.distances(places[1:-1]) for arc in pair], axis=0).max() <= SHARE * tolerance
        if not near and depth < _DEEPEST:
            middle = 0.5 * (low + high)
            pending += [(middle, high, depth + 1), (low, middle, depth + 1)]
            continue
        found += pair if near else [Arc(complex(places[0]), complex(places[-1]))]
        if len(found) > MAX_ARCS:
            raise InputError(f"more than {MAX_ARCS} arcs for one curve; allow more than {tolerance:g} mm")
    return [arc for arc in found if arc.start != arc.end]


def in_plane(points: Array, columns: tuple[int, int]) -> Places:
    """Points (n, axes) as places (n,) of the plane of two axes."""
    return np.asarray(points[:, columns[0]] + 1j * points[:, columns[1]], dtype=np.complex128)


def _biarc(start: complex, end: complex, leave: complex, arrive: complex) -> list[Arc]:
    """Two arcs from start to end with the given unit tangents; none if there is no good pair."""
    chord = end - start
    both = (chord.conjugate() * (leave + arrive)).real
    spread = 2.0 * (1.0 - (leave.conjugate() * arrive).real)
    if spread > 1e-12:
        length = (-both + math.sqrt(both * both + spread * abs(chord) ** 2)) / spread
    else:
        length = abs(chord) ** 2 / (2.0 * both) if both > 0.0 else 0.0
    if not 0.0 < length < 10.0 * abs(chord):
        return []
    joint = 0.5 * (start + end + length * (leave - arrive))
    pair = [_arc(start, joint, leave, start), _arc(joint, end, arrive, end)]
    return [] if max(abs(arc.sweep) for arc in pair) > 0.9 * math.pi else pair


def _arc(start: complex, end: complex, tangent: complex, base: complex) -> Arc:
    """The arc from start to end with a unit tangent at one of them, `base`."""
    chord = end - start
    height = (tangent.conjugate() * (chord if base == start else -chord)).imag
    if abs(height) <= FLAT * abs(chord) or abs(chord) ** 2 > 2.0 * LARGEST_RADIUS * abs(height):
        return Arc(start, end)
    centre = base + 0.5j * abs(chord) ** 2 / height * tangent
    return Arc(start, end, centre, 2.0 * math.atan2(height, (tangent.conjugate() * chord).real))


def chords(curve: NurbsCurve, tolerance: float, rotary: BoolArray) -> Array:
    """Points (n, axes) on the curve, ends and corners among them, whose chords are within `tolerance`, mm, of it.

    Chords are halved until the curve at SAMPLES parameters between is near enough; rotary axes are held to
    ROTARY_TOLERANCE of what they are at the nearest place of the chord.
    """
    u, linear = curve.breaks, ~rotary
    fractions = np.arange(1.0, SAMPLES + 1.0) / (SAMPLES + 1.0)
    fixed = np.zeros(len(u) - 1, dtype=bool)
    while not fixed.all():
        low, high = u[:-1][~fixed], u[1:][~fixed]
        first, last = curve(low), curve(high)
        between = curve(low[:, None] + fractions * (high - low)[:, None])
        chord = (last - first)[:, None, :]
        square = np.sum(chord[..., linear] ** 2, axis=-1)
        along = np.sum((between - first[:, None])[..., linear] * chord[..., linear], axis=-1)
        part = np.clip(np.where(square > 0.0, along / np.where(square > 0.0, square, 1.0), fractions), 0.0, 1.0)
        off = between - (first[:, None] + part[..., None] * chord)
        far = np.max(np.linalg.norm(off[..., linear], axis=-1), axis=1) > SHARE * tolerance
        far |= np.max(np.abs(off[..., rotary]), axis=(1, 2), initial=0.0) > ROTARY_TOLERANCE
        far &= high - low > 1e-12 * (u[-1] - u[0])
        rest = np.flatnonzero(~fixed)
        fixed[rest[~far]] = True
        split = rest[far]
        u = np.insert(u, split + 1, 0.5 * (u[split] + u[split + 1]))
        fixed = np.insert(fixed, split + 1, False)
        if len(u) > MAX_CHORDS:
            raise InputError(f"more than {MAX_CHORDS} lines for one curve; allow more than {tolerance:g} mm")
    return curve(u)

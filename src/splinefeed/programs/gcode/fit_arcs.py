"""Lines and arcs near a curve: the arc that it is, biarcs [1]_ within a tolerance, or chords.

Of the biarcs the one whose tangents at both ends have the same length to the joint's.

References
----------
.. [1] K. M. Bolton, Biarc curves, Computer-Aided Design 7, 1975, doi:10.1016/0010-4485(75)90086-X.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.curves.arcs import bulge_arc, polyline
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import InputError
from splinefeed.records import Array, BoolArray

#: Places of a plane, as complex numbers.
Places = NDArray[np.complex128]
#: Arcs that are flatter than this, relative to their chord, and larger than LARGEST_RADIUS, mm, are written as lines.
FLAT = 1e-9
LARGEST_RADIUS = 1e5
#: Most lines or pairs of arcs of one curve.
MAX_PIECES = 500_000
#: A curve this near a circle, relative to its radius, is one.
EXACT = 1e-9
#: Samples of a biarc, and of a chord, at which its distance from the curve is taken, and the share of the tolerance
#: that it may use up there: between the samples it is a little more.
BIARC_SAMPLES, SAMPLES, SHARE = 16, 9, 0.95
#: How far rotary axes may be from the curve's, rad.
ROTARY_TOLERANCE = 1e-4


@dataclass(frozen=True)
class FittedArcs:
    """Arcs and, where sweep is 0, lines of a plane, (n,) each; sweep rad, positive counterclockwise."""

    start: Places
    end: Places
    centre: Places
    sweep: Array

    @classmethod
    def of(cls, start: Places, end: Places, tangent: Places, base: Places, forward: bool) -> FittedArcs:
        """From start to end with a unit tangent at `base`, which is the start, or not `forward` the end."""
        chord = end - start
        height = (np.conj(tangent) * (chord if forward else -chord)).imag
        flat = (np.abs(height) <= FLAT * np.abs(chord)) | (np.abs(chord) ** 2 > 2.0 * LARGEST_RADIUS * np.abs(height))
        centre = base + 0.5j * np.abs(chord) ** 2 / np.where(flat, 1.0, height) * tangent
        sweep = np.where(flat, 0.0, 2.0 * np.arctan2(height, (np.conj(tangent) * chord).real))
        return cls(start, end, centre, sweep)

    def __getitem__(self, chosen: Any) -> FittedArcs:
        return FittedArcs(self.start[chosen], self.end[chosen], self.centre[chosen], self.sweep[chosen])

    def distances(self, places: Places) -> Array:
        """Distances (n, m) of places (n, m)."""
        start, end, centre, sweep = (each[:, None] for each in (self.start, self.end, self.centre, self.sweep))
        chord, from_start, off, first = end - start, places - start, places - centre, start - centre
        along = np.clip((np.conj(chord) * from_start).real / np.maximum(np.abs(chord) ** 2, 1e-300), 0.0, 1.0)
        ahead = np.mod(np.copysign(1.0, sweep) * np.angle(off * np.conj(first)), 2.0 * math.pi)
        ends = np.minimum(np.abs(from_start), np.abs(places - end))
        around = np.where(ahead <= np.abs(sweep), np.abs(np.abs(off) - np.abs(first)), ends)
        return np.where(sweep == 0.0, np.abs(from_start - along * chord), around)

    def curve(self, i: int) -> NurbsCurve:
        """The curve (x, y) of one of them as a control runs it."""
        ends = np.array([self.start[i], self.end[i]]).view(np.float64).reshape(2, 2)
        return bulge_arc(ends[0], ends[1], math.tan(0.25 * self.sweep[i])) if self.sweep[i] else polyline(ends)


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


def biarcs(curve: NurbsCurve, columns: tuple[int, int], tolerance: float) -> FittedArcs:
    """Approximate a curve in a plane by arcs and lines that are tangent to each other.

    Parameters
    ----------
    curve : NurbsCurve
        To be approximated.
    columns : tuple of int
        The two axes of the plane.
    tolerance : float
        Of distances from samples of each piece, mm.

    Returns
    -------
    FittedArcs
        In order.
    """
    fractions = np.linspace(0.0, 1.0, BIARC_SAMPLES + 2)

    def fitted(low: Array, high: Array) -> tuple[FittedArcs, FittedArcs, BoolArray]:
        places = in_plane(curve(low[:, None] + fractions * (high - low)[:, None]), columns)
        start, end = places[:, 0], places[:, -1]
        leave, arrive = (in_plane(curve.tangent(u, side=side), columns) for u, side in ((low, "right"), (high, "left")))
        both = (np.conj(end - start) * (leave + arrive)).real
        spread, square = 2.0 * (1.0 - (np.conj(leave) * arrive).real), np.abs(end - start) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            bent = (-both + np.sqrt(both * both + spread * square)) / spread
            length = np.where(spread > 1e-12, bent, np.where(both > 0.0, square / (2.0 * both), 0.0))
            good = (length > 0.0) & (length < 10.0 * np.sqrt(square))
        joint = 0.5 * (start + end + np.where(good, length, 0.0) * (leave - arrive))
        first, second = FittedArcs.of(start, joint, leave, start, True), FittedArcs.of(joint, end, arrive, end, False)
        good &= np.maximum(np.abs(first.sweep), np.abs(second.sweep)) <= 0.9 * math.pi
        off = np.minimum(first.distances(places[:, 1:-1]), second.distances(places[:, 1:-1]))
        return first, second, good & (np.max(off, axis=1) <= SHARE * tolerance)

    u = _halved(curve, lambda low, high: fitted(low, high)[2], tolerance)
    first, second, good = fitted(u[:-1], u[1:])
    line = FittedArcs(
        first.start, np.where(good, first.end, second.end), first.centre, np.where(good, first.sweep, 0.0)
    )
    pairs = [np.column_stack(pair).ravel() for pair in zip(vars(line).values(), vars(second).values(), strict=True)]
    kept = np.column_stack([line.start != line.end, good & (second.start != second.end)]).ravel()
    return FittedArcs(*pairs)[kept]


def in_plane(points: Array, columns: tuple[int, int]) -> Places:
    """Points (..., axes) as places (...) of the plane of two axes."""
    return np.asarray(points[..., columns[0]] + 1j * points[..., columns[1]], dtype=np.complex128)


def chords(curve: NurbsCurve, tolerance: float, rotary: BoolArray) -> Array:
    """Approximate a curve by chords.

    Parameters
    ----------
    curve : NurbsCurve
        To be approximated.
    tolerance : float
        Of the curve from its chords, mm.
    rotary : array (axes,)
        Which axes turn.

    Returns
    -------
    array (n, axes)
        Points on the curve, ends and corners among them.

    Notes
    -----
    Chords are halved until the curve at SAMPLES parameters between is near enough; rotary axes are held to
    ROTARY_TOLERANCE of what they are at the nearest place of the chord.
    """
    fractions, linear = np.arange(1.0, SAMPLES + 1.0) / (SAMPLES + 1.0), ~rotary

    def near(low: Array, high: Array) -> BoolArray:
        first = curve(low)[:, None]
        chord = curve(high)[:, None] - first
        off = curve(low[:, None] + fractions * (high - low)[:, None]) - first
        square = np.sum(chord[..., linear] ** 2, axis=-1)
        along = np.sum(off[..., linear] * chord[..., linear], axis=-1) / np.where(square > 0.0, square, 1.0)
        off -= np.clip(np.where(square > 0.0, along, fractions), 0.0, 1.0)[..., None] * chord
        close: BoolArray = np.max(np.linalg.norm(off[..., linear], axis=-1), axis=1) <= SHARE * tolerance
        close &= np.max(np.abs(off[..., rotary]), axis=(1, 2), initial=0.0) <= ROTARY_TOLERANCE
        return close

    return curve(_halved(curve, near, tolerance))


def _halved(curve: NurbsCurve, near: Callable[[Array, Array], BoolArray], tolerance: float) -> Array:
    """Parameters from the curve's breaks on, halved until between each two `near` holds."""
    u = curve.breaks
    fixed = np.zeros(len(u) - 1, dtype=bool)
    while not fixed.all():
        rest = np.flatnonzero(~fixed)
        low, high = u[rest], u[rest + 1]
        far = ~near(low, high) & (high - low > 1e-12 * (u[-1] - u[0]))
        fixed[rest[~far]] = True
        split = rest[far]
        u = np.insert(u, split + 1, 0.5 * (u[split] + u[split + 1]))
        fixed = np.insert(fixed, split + 1, False)
        if len(u) > MAX_PIECES:
            raise InputError(f"more than {MAX_PIECES} pieces for one curve; allow more than {tolerance:g} mm")
    return u

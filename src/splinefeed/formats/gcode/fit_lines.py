"""Chords of a curve within a tolerance."""

from __future__ import annotations

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array, BoolArray

#: Most chords of one curve.
MAX_CHORDS = 500_000
#: Samples of a chord at which its distance from the curve is taken, and the share of the tolerance that it may use up
#: there: between the samples it is a little more.
SAMPLES, SHARE = 9, 0.95
#: How far rotary axes may be from the curve's, rad.
ROTARY_TOLERANCE = 1e-4


def chords(curve: NurbsCurve, tolerance: float, rotary: BoolArray) -> Array:
    """Points (n, axes) on the curve, ends and corners among them, whose chords are within `tolerance`, mm, of it.

    Chords are halved until the curve at SAMPLES parameters between is near enough; rotary axes are held to
    ROTARY_TOLERANCE of what they are at the nearest place of the chord.
    """
    u = curve.breaks
    if curve.degree == 1:
        return curve(u)
    fractions = np.arange(1.0, SAMPLES + 1.0) / (SAMPLES + 1.0)
    fixed = np.zeros(len(u) - 1, dtype=bool)
    while not fixed.all():
        low, high = u[:-1][~fixed], u[1:][~fixed]
        first, last = curve(low), curve(high)
        between = curve(low[:, None] + fractions * (high - low)[:, None])
        chord = (last - first)[:, None, :]
        linear = ~rotary
        square = np.sum(chord[..., linear] ** 2, axis=-1)
        along = np.sum((between - first[:, None])[..., linear] * chord[..., linear], axis=-1)
        part = np.clip(
            np.divide(along, square, out=np.broadcast_to(fractions, along.shape).copy(), where=square > 0), 0, 1
        )
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

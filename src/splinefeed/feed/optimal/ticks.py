"""Whether the setpoints of a motion keep the limits of the axes: differences over the period at every tick."""

from __future__ import annotations

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.records import Array, Limits, TimeLaw

#: Ticks that are looked at together.
TOGETHER = 1 << 16
#: Longer motions are not looked at, and so not kept: half an hour at 1 ms takes a second.
MOST_TICKS = 2_000_000
#: A difference may be over a limit by this share, and by so many roundings of a position.
KEPT, ROUNDINGS = 1e-9, 8.0


def kept_at_ticks(law: TimeLaw, path: Path, limits: Limits, passed: Array, breaks: Array) -> bool:
    """Whether |D^k r| / T^k <= limit for the setpoints r at the ticks of the period T, k = 1, 2, 3, and their chords.

    False, too, for more than MOST_TICKS ticks.
    passed (k,)  arc lengths of corners that are passed in motion, mm, across which differences are no derivatives
    breaks (m,)  arc lengths where derivatives jump or the path bends sharply, mm
    """
    bounds = [limits.of_axes(name, path.axes) for name in ("axis_velocity", "axis_acceleration", "axis_jerk")]
    period = law.period
    if period is None or (limits.chord_error is None and not np.any(np.isfinite(bounds))):
        return True
    count = int(np.floor(law.duration / period * (1.0 + 1e-12))) + 1
    if count > MOST_TICKS:
        return False
    for first in range(0, count, TOGETHER):
        ticks = np.arange(max(first - 3, 0), min(first + TOGETHER, count))
        s = np.clip(law(ticks * period), 0.0, path.length)
        s[ticks * period >= law.duration * (1.0 - 1e-12)] = path.length  # where setpoints end, to the bit
        r = path(s)
        rounding = ROUNDINGS * np.spacing(np.max(np.abs(r), axis=0))
        for order, bound in enumerate(bounds, start=1):
            if len(ticks) <= order:
                continue
            seen = np.abs(np.diff(r, n=order, axis=0)) / period**order
            crosses = np.searchsorted(passed, s[:-order]) != np.searchsorted(passed, s[order:], side="right")
            over = seen > bound * (1.0 + KEPT) + 2.0**order * rounding / period**order
            if np.any(over[~crosses]):
                return False
        if limits.chord_error is not None and not _chords_kept(path, s, r, breaks, limits.chord_error):
            return False
    return True


def _chords_kept(path: Path, s: Array, r: Array, breaks: Array, limit: float) -> bool:
    """Whether the path stays within `limit`, mm, of the chords between setpoints r (n, axes) at s (n,).

    It is looked at in three places of every chord, and where its derivatives jump or it bends sharply.
    """
    inside = breaks[(breaks > s[0]) & (breaks < s[-1])]
    at = np.concatenate([inside, *((1.0 - share) * s[:-1] + share * s[1:] for share in (0.25, 0.5, 0.75))])
    first = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
    begin, chord = r[first, : path.linear], np.diff(r[:, : path.linear], axis=0)[first]
    away = path(at)[:, : path.linear] - begin
    square = np.maximum(np.sum(chord * chord, axis=1), 1e-300)
    along = np.clip(np.sum(away * chord, axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(away - along[:, None] * chord, axis=1)
    return bool(np.max(distance, initial=0.0) <= limit * (1.0 + KEPT) + ROUNDINGS * np.spacing(np.max(np.abs(r))))

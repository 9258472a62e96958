"""Limits along the path that are none of a coordinate: a function each, which makes rows of one limit.

A limit of PLACES in the table (`limit_table.py`) has a row maker in ROWS, one of TICKS a longest step in STEPS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from splinefeed.paths.track import Track
from splinefeed.planner.rows import TINY, Rows
from splinefeed.records import Array
from splinefeed.records.modelled import ModelRows

#: Places before and behind that are looked at, at most, for being within one step of the servo.
NEIGHBOURS = 512
#: Of q that chords allow a motion takes this share: curvature that changes within a step leaves up to 4e-5 more.
ROOM = 1.0 - 1e-4


@dataclass(frozen=True, eq=False)
class Places:
    """n places of a path, as row makers see them.

    Parameters
    ----------
    track : Track
    s : (n,) array
        sigma, mm, increasing.
    d : (n, 4, columns) array
        What `Track.derivatives` says there.
    tip : (2, n) array
        s' and s'' of the tip's arc length by sigma.
    turn : (m, n) array
        How far x' of each coordinate turns within a period.
    """

    track: Track
    s: Array
    d: Array
    tip: Array
    turn: Array

    @cached_property
    def of_tip(self) -> Array:
        """Positions of the tip and their derivatives by sigma, (n, 4, linear): a planar path has two linear axes."""
        return self.d[:, :, self.track.tip_columns]

    @cached_property
    def bend(self) -> Array:
        """s'^2 times the curvature of the tip's path, (n,): |p''| across p' for the tip p."""
        one, two = self.of_tip[:, 1], self.of_tip[:, 2]
        square = np.sum(one * one, axis=1)
        across = two - (np.sum(one * two, axis=1) / np.maximum(square, TINY))[:, None] * one
        return np.asarray(np.linalg.norm(across, axis=1))

    @cached_property
    def between_ticks(self) -> tuple[Array | None, Array | None]:
        """What `Track.between_ticks` says."""
        return self.track.between_ticks(self.d)


def centripetal(at: Places, most: float) -> ModelRows:
    """kappa s'^2 q <= most, mm/s^2."""
    return ModelRows(top=most / np.maximum(at.bend, TINY))


def chord_error(at: Places, delta: float) -> Array:
    """The longest steps of sigma that leave chords within `delta`, mm, (n,).

    A chord of length c leaves an arc of curvature kappa by kappa c^2 / 8 and turns of theta in all by c theta / 4 at
    most: c = 2 delta / (theta/4 + sqrt(theta^2/16 + kappa delta/2)). No point of a chord of 2 delta is further than
    delta from one of its ends: that is always allowed. A tip that slows down, as other axes turn, may turn back.
    """
    s1 = np.maximum(at.tip[0], TINY**0.5)
    left = at.between_ticks[0]
    bend = at.bend if left is None else left  # s'^2 times the curvature that the chord leaves
    turn = np.linalg.norm(at.turn[at.track.tip_columns], axis=0)  # of the tip's direction within reach, times s'
    quarter = 0.25 * turn / s1
    step = 2.0 * delta / np.maximum(quarter + np.sqrt(quarter**2 + 0.5 * bend / s1**2 * delta), TINY) / s1
    if not np.any(at.tip[1]):  # the tip never slows down
        return np.asarray(np.maximum(step, 2.0 * delta / s1))
    whole = np.maximum(np.linalg.norm(at.of_tip[:, 2], axis=1), TINY)
    step = np.minimum(step, s1 / whole)  # further on the tip may turn back
    step = np.maximum(step, np.sqrt(2.0 * delta / whole))
    return np.asarray(np.maximum(step, np.minimum(2.0 * delta / s1, s1 / whole)))


def orientation_error(at: Places, most: float) -> Array | None:
    """The longest steps of sigma that leave the tool axis within `most`, rad, (n,); None without a tool axis."""
    bend = at.between_ticks[1]
    if bend is None:
        return None
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(8.0 * most / bend))


#: Of each limit of PLACES the rows that it makes.
ROWS: dict[str, Callable[[Places, float], ModelRows]] = {"centripetal": centripetal}
#: Of each limit of TICKS the longest steps that it allows.
STEPS: dict[str, Callable[[Places, float], Array | None]] = {
    "chord_error": chord_error,
    "orientation_error": orientation_error,
}


def within_steps(rows: Rows, at: Places, ticks: Mapping[str, float], period: float, alone: bool) -> Rows:
    """Return rows within limits of TICKS, by name; alone  whether steps see only their own place."""
    for name, most in ticks.items():
        step = STEPS[name](at, most)
        if step is not None:
            longest = step if alone else within_reach(at.s, step)
            rows = rows.lowered(ROOM * longest**2 / period**2, between=True)
    return rows


def within_reach(s: Array, step: Array) -> Array:
    """Steps (n,) that are no longer than those allowed at places s (n,), increasing, that they come to."""
    found = step.copy()
    for k in range(1, min(NEIGHBOURS, len(s) - 1) + 1):
        away = s[k:] - s[:-k]
        if not np.any(away < np.maximum(found[k:], found[:-k])):
            break
        found[k:] = np.minimum(found[k:], np.maximum(step[:-k], away))
        found[:-k] = np.minimum(found[:-k], np.maximum(step[k:], away))
    return found

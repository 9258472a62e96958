"""The chord error: how far the path is from the straight line between two setpoints."""

from collections.abc import Iterator

import numpy as np

from splinefeed.feed.limits.rows import Places, Row, Top
from splinefeed.records import Array, Limits

#: Places before and behind that are looked at, at most, for being within one step of the servo.
NEIGHBOURS = 64


def rows(at: Places, limits: Limits) -> Iterator[Row]:
    """v T <= the longest chord that the limit delta allows, wherever within v T the path bends.

    A chord of length c leaves an arc of curvature kappa by kappa c^2 / 8 and turns of theta in all by c theta / 4 at
    most: c = 2 delta / (theta/4 + sqrt(theta^2/16 + kappa delta/2)). No point on a chord of 2 delta is further than
    delta from one of its ends, however it bends: v T = 2 delta is always allowed.
    """
    if limits.chord_error is None or at.period is None:
        return
    delta = limits.chord_error
    quarter = 0.25 * np.linalg.norm(np.sum(at.turn[:, : at.linear], axis=0), axis=0)
    with np.errstate(divide="ignore"):
        kappa = at.curvature if at.chord is None else at.chord
        step = 2.0 * delta / (quarter + np.sqrt(quarter**2 + 0.5 * kappa * delta))
    step = np.maximum(step, 2.0 * delta)
    yield Top("chord_error", ((step if at.alone else within_reach(at.s, step)) / at.period) ** 2)


def within_reach(s: Array, step: Array) -> Array:
    """Steps (n,) that are no longer than those allowed at places s (n,), mm, increasing, that they come to."""
    found = step.copy()
    least = float(np.min(step, initial=np.inf))
    for k in range(1, min(NEIGHBOURS, len(s) - 1) + 1):
        away = s[k:] - s[:-k]
        if not np.any(away < np.maximum(found[k:], found[:-k])) or not np.isfinite(least):
            break
        found[k:] = np.minimum(found[k:], np.maximum(step[:-k], away))
        found[:-k] = np.minimum(found[:-k], np.maximum(step[k:], away))
    return found

"""What planners of other packages are given of a path, and how what they return is judged: by nodes along s."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import splinefeed as sf
from splinefeed.curves.differential import by_arc_length

Array = NDArray[np.float64]
#: Slowed at most so often, until what is left over a limit is a hair.
STRETCHES, HAIR = 30, 1e-6


@dataclass(frozen=True)
class Profile:
    """A motion: its duration in s, where it is at a time (mm along the path), and what computing it took in s."""

    duration: float
    at: Callable[[Array], Array]
    computing: float


@dataclass(frozen=True)
class Sampled:
    """The path's derivatives by arc length at nodes: s (n,), then r, r', r'', r''' each (n, axes)."""

    s: Array
    r: Array
    r1: Array
    r2: Array
    r3: Array

    @classmethod
    def of(cls, path: sf.Path, s: Array) -> Sampled:
        """Exact derivatives of the path at each s."""
        derivatives = by_arc_length(path.evaluate(*path.locate(s), 3))
        return cls(s, *(np.ascontiguousarray(derivatives[:, order]) for order in range(4)))


def grid(path: sf.Path, nodes: int) -> Array:
    """Nodes along s (nodes,), half of them even in length and half even in turning, so that tips get their share."""
    s = np.linspace(0.0, path.length, 200 * nodes + 1)
    g = Sampled.of(path, s)
    turning = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(g.r1, axis=0), axis=1))])
    measure = s / s[-1] + (turning / turning[-1] if turning[-1] > 0.0 else 0.0)
    return np.interp(np.linspace(0.0, measure[-1], nodes), measure, s)


def stretched(path: sf.Path, limits: tuple[float, float, float], profile: Profile, period: float) -> Profile:
    """The same motion slowed as a whole until its setpoints hold every limit: times k makes v/k, a/k^2 and j/k^3."""
    total = 1.0
    for _ in range(STRETCHES):
        slower = Profile(total * profile.duration, _slower(profile.at, total), profile.computing)
        feed, acceleration, jerk = shares_at_setpoints(path, slower, limits, period)
        k = max(feed, acceleration**0.5, jerk ** (1.0 / 3.0))
        if k <= 1.0 + HAIR:
            break
        total *= k
    return slower


def _slower(at: Callable[[Array], Array], k: float) -> Callable[[Array], Array]:
    return lambda t: at(t / k)


def shares_at_setpoints(
    path: sf.Path, profile: Profile, limits: tuple[float, float, float], period: float
) -> tuple[float, float, float]:
    """Worst step along the path, second and third difference of any axis, as shares of their limits; rest outside."""
    feed, acceleration, jerk = limits
    ticks = int(np.ceil(profile.duration / period - 1e-9))
    s = profile.at(np.minimum(np.arange(ticks + 1) * period, profile.duration))
    position = path(np.clip(s, 0.0, path.length))
    first = np.diff(s).max() / period
    rest = np.ones((3, 1))
    position = np.concatenate([rest * position[0], position, rest * position[-1]])
    second = np.abs(np.diff(position, 2, axis=0)).max() / period**2
    third = np.abs(np.diff(position, 3, axis=0)).max() / period**3
    return float(first / feed), float(second / acceleration), float(third / jerk)

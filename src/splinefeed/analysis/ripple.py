"""How well setpoints keep the planned feed and place: ripple, drift and chord error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.analysis import between
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import EPSILON, Places, Rows
from splinefeed.records import Array, Setpoints, TimeLaw

#: Ripple is measured where the feed is above this share of its top; near rest a step is smaller than the rounding of s.
FEED_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Ripple:
    """The actual feed of setpoints against the planned one.

    t         (m,)  start of each step that counts, s
    relative  (m,)  (arc length of the step) / (planned step) - 1
    floor     the rounding of s over the smallest of these steps: the lowest possible ripple
    rms       root mean square of `relative`, 0 if no step counts; of a long motion over all steps, those left out too
    Source: docs/math/interpolators.md. Example: `sf.analysis.feed_ripple(setpoints, path, law).relative`
    """

    t: Array
    relative: Array
    floor: float
    rms: float

    @property
    def max(self) -> float:
        """Largest |relative|, 0 if no step counts."""
        return float(np.max(np.abs(self.relative), initial=0.0))


def steps(setpoints: Setpoints, path: Path) -> Array:
    """Arc length along the path from each setpoint to the next, (n - 1,), mm, negative where one goes back.

    By adaptive quadrature of |C'(u)|, independent of the arc-length table that the interpolators use.
    """
    if len(setpoints) < 2:
        return np.zeros(0)
    rows = Rows(path.arc_pieces)
    return between.lengths(rows, *rows.find(setpoints.curve, setpoints.u))[0]


def feed_ripple(setpoints: Setpoints, path: Path, law: TimeLaw, *, top: float | None = None) -> Ripple:
    """Relative error of each step's arc length against the law's, where the feed is above a tenth of its top.

    relative_k = (S(u_{k+1}) - S(u_k)) / (l(t_{k+1}) - l(t_k)) - 1, by `steps`. The chord would be shorter by
    kappa^2 (V T)^2 / 24, which is not an error of the interpolator.

    top  highest feed of the motion, mm/s, where `setpoints` are a part of it
    Returns a Ripple of m steps, (m,). Raises InputError where setpoints and path do not go together.
    Source: docs/math/interpolators.md. Example: `sf.analysis.feed_ripple(setpoints, path, law).max`
    """
    top = float(np.max(setpoints.feed, initial=0.0)) if top is None else top
    planned = np.diff(law(setpoints.t))
    feed = np.minimum(law.feed(setpoints.t)[:-1], law.feed(setpoints.t)[1:])
    counts = feed > FEED_SHARE * top
    counts &= planned > 0.0
    actual = steps(setpoints, path)[counts]
    wanted = planned[counts]
    floor = EPSILON * path.length / float(wanted.min()) if wanted.size else 0.0
    relative = actual / wanted - 1.0
    rms = float(np.sqrt(np.mean(relative**2))) if relative.size else 0.0
    return Ripple(setpoints.t[:-1][counts], relative, floor, rms)


def drift(setpoints: Setpoints, law: TimeLaw) -> Array:
    """How far each setpoint is ahead of the law along the path, (n,), mm: S(u_k) - l(t_k)."""
    return setpoints.s - law(setpoints.t)


def chord_errors(setpoints: Setpoints, path: Path) -> Array:
    """Largest distance of the curve from the straight line between neighbouring setpoints, (n - 1,), mm."""
    if len(setpoints) < 2:
        return np.zeros(0)
    rows = Rows(path.arc_pieces)
    row, u = rows.find(setpoints.curve, setpoints.u)
    places = Places(rows, row)
    return between.chord_errors(rows, row, u, places.derivatives(places.t(u), 0)[0])

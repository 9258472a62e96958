"""What an override runs: a law along a path, and what that asks of the axes in each tick."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.geometry.path import Path
from splinefeed.kernels.layout import START
from splinefeed.kernels.override_demand import ask
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Limits, TimeLaw, positive

#: A law that is over its limits by less than this is at them.
AT_LIMITS = 1e-6
#: A jump of q'' counts for so many periods before and behind it, a little less than the one that plans leave room for,
#: as that ends where feeds, not times, say; the jerk that it counts as over that time; most ticks that this touches.
REACH = 0.95
PEAK, TICKS_IN_REACH = 0.75 / (1.0 - (1.5 - REACH) ** 3 / 3.0), 3
#: A jump of q'' below this share of the largest q'' around is rounding.
LEAST_JUMP = 1e-7
#: Places in a tick at which joints of a tool path are looked at, and how far beside a break, as a share of the path.
LOOKED_AT, BESIDE = 5, 1e-9


class Course(Protocol):
    """Positions q(tau) by plan time, at rest at both ends; `period` and `duration` in s."""

    axes: tuple[str, ...]
    period: float
    duration: float

    def asked(self, first: int, count: int) -> Array:
        """What the axes need in `count` ticks from `first` on, (count, 4, axes + 1); 0 beyond both ends.

        Largest |q'| and |q''|; jerk at rate 1, jumps of q'' included; jerk over r^2 as the rate r goes to 0, where only
        these are left. In between the latter is at most a mean of both. The last column is that of the arc length.
        """

    def bend_share(self, limits: Limits) -> float:
        """Share of the limits that hold for the feed on a bend, at rate 1: the square root of what it asks for."""


class LawCourse:
    """A law along a path; period in s, the law's if it is not said.

    Raises LimitsError for a law that does not rest at both ends, and where nobody says a period.
    Source: docs/math/override.md. Example: `sf.live.LawCourse(path, law, 1e-3).duration`
    """

    def __init__(self, path: Path | JointPath, law: TimeLaw, period: float | None = None) -> None:
        wanted = law.period if period is None else period
        if wanted is None:
            raise LimitsError("no period: the law was planned without one; give period= in s")
        if law.feed(0.0) > AT_LIMITS or law.feed(law.duration) > AT_LIMITS:
            raise LimitsError(
                "a law that can be overridden begins and ends at rest; leave start_feed and end_feed at 0"
            )
        self.path, self.law, self.period = path, law, positive(wanted, "period")
        self.axes, self.duration = path.axes, law.duration

    def asked(self, first: int, count: int) -> Array:
        """As `Course` says, from the exact derivatives of path and law.

        For one period before and behind it, less a twentieth, a jump D of q'' counts as jerk of PEAK D / T: the
        quadratic B-spline by which a third difference sees it is nowhere above PEAK times its own mean over that time.
        """
        edges = np.clip(self.period * np.arange(first - 1, first + count + 2), 0.0, self.duration)
        cells, at, jumps = self._look(edges[:-1], edges[1:])
        cells[:, 2], cells[:, 3] = np.max(cells[:, 2:], axis=1, initial=0.0), 0.0
        sharp = np.any(np.abs(jumps) > LEAST_JUMP * np.max(cells[:, 1], axis=0), axis=1)
        if np.any(sharp):
            self._add(cells, first - 1, at[sharp], jumps[sharp])
        return cells[1:-1]

    def _add(self, cells: Array, first: int, at: Array, jumps: Array) -> None:
        """Add jumps (k, axes + 1) of q'' at times (k,), s, to the needs of ticks from `first` on, (n, 4, axes + 1)."""
        period, reach = self.period, REACH * self.period
        ends = np.unique(np.clip([at - reach, at + reach], 0.0, self.duration))
        middle = 0.5 * (ends[:-1] + ends[1:])
        begin, end = (np.searchsorted(at, middle + way) for way in (-reach, reach))
        near = end > begin
        low, high, begin, end = ends[:-1][near], ends[1:][near], begin[near], end[near]
        ways = np.stack([np.maximum(jumps, 0.0), np.maximum(-jumps, 0.0)], axis=1)
        total = np.concatenate([np.zeros_like(ways[:1]), np.cumsum(ways, axis=0)])
        alone = PEAK / period * (total[end] - total[begin])
        both = np.max(alone + self._look(low, high)[0][:, 2:], axis=1)
        alone = np.max(alone, axis=1)
        for k in range(TICKS_IN_REACH):
            tick = (low / period).astype(np.int64) + k - first
            inside = (tick >= 0) & (tick < len(cells)) & (period * (tick + first) < high)
            np.maximum.at(cells[:, 2], tick[inside], np.maximum(both, alone / 3.0)[inside])
            np.maximum.at(cells[:, 3], tick[inside], alone[inside])

    def _look(self, low: Array, high: Array) -> tuple[Array, Array, Array]:
        """As the kernel `ask` finds it from times low to high (n,), s; with the times (k,) and jumps (k, axes + 1)."""
        if isinstance(self.path, JointPath):
            return _of_joints(self.path, self.law, low, high)
        law, table, columns = self.law, self.path.table, len(self.axes) + 1
        ends = np.array([low[0], high[-1]])
        parts = np.searchsorted(law.breaks, ends) + np.searchsorted(table[:, START], law(ends))
        most = int(parts[1] - parts[0]) + 4
        cells, at, jumps = np.empty((len(low), 4, columns)), np.empty(most), np.empty((most, columns))
        count = ask(law.breaks, law.coefficients, table, self.path.shape, low, high, cells, at, jumps)
        return cells, at[:count], jumps[:count]

    def bend_share(self, limits: Limits) -> float:
        """Share of the limits that hold for the feed on a bend, at rate 1: the square root of what it asks for."""
        settings = self.law.settings.get("limits", {})
        shares = [
            math.sqrt(settings.get(name, math.inf) / limit)
            for name in ("centripetal", "chord_error", "orientation_error")
            if (limit := getattr(limits, name)) is not None
        ]
        if not all(map(math.isfinite, shares)):
            raise LimitsError(
                "the law was not planned under the limits of centripetal acceleration, chord or orientation error"
            )
        return max(shares, default=0.0)


def _of_joints(path: JointPath, law: TimeLaw, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """As `LawCourse._look`, of joints and tip."""
    inside = np.linspace(1e-6, 1.0 - 1e-6, LOOKED_AT)
    t = (low[:, None] + (high - low)[:, None] * inside).ravel()
    v, a, j = (each(t)[:, None] for each in (law.feed, law.acceleration, law.jerk))
    away = BESIDE * path.length
    s = _beside_stops(law, np.asarray(path.stops), t, away)
    r = path.derivatives(np.clip(s, 0.0, path.length))[:, :, 3:]
    joints = (r[:, 1] * v, r[:, 2] * v**2 + r[:, 1] * a, r[:, 3] * v**3 + 3.0 * r[:, 2] * v * a + r[:, 1] * j)
    each = np.stack([np.concatenate(pair, axis=1) for pair in zip(joints, (v, a, j), strict=True)], axis=1)
    each = np.concatenate([np.abs(each[:, :2]), each[:, 2:], -each[:, 2:]], axis=1)
    cells = np.max(each.reshape(len(low), LOOKED_AT, 4, -1), axis=1)
    cells[low >= high] = 0.0
    stops = np.array([-1.0, *path.stops, path.length + 1.0])
    after = np.searchsorted(stops, path.breaks)
    moving = np.minimum(path.breaks - stops[after - 1], stops[after] - path.breaks) > away
    breaks = path.breaks[moving]  # at rest nothing jumps, however joints turn there
    ends = np.unique(np.concatenate([low, high]))
    s = law(ends)
    breaks = breaks[(breaks > s[0]) & (breaks < s[-1])]
    at = np.interp(breaks, s, ends)
    before, behind = (path.derivatives(breaks + way)[:, :, 3:] for way in (-away, away))
    v, a = law.feed(at)[:, None], law.acceleration(at)[:, None]
    jumps = (behind[:, 2] - before[:, 2]) * v**2 + (behind[:, 1] - before[:, 1]) * a
    return cells, at, np.pad(jumps, ((0, 0), (0, 1)))


def _beside_stops(law: TimeLaw, stops: Array, t: Array, away: float) -> Array:
    """Arc lengths (n,) at times (n,), s; those within `away` mm of a stop as far from it, on the side of their time."""
    s: Array = np.asarray(law(t))
    if not len(stops):
        return s
    nearest = np.clip(np.searchsorted(0.5 * (stops[1:] + stops[:-1]), s), 0, len(stops) - 1)
    when = law.breaks[np.searchsorted(law.coefficients[:, 0], stops - away)]
    beside = stops[nearest] + np.where(t < when[nearest], -away, away)
    return np.where(np.abs(s - stops[nearest]) <= away, beside, s)

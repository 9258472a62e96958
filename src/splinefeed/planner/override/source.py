"""What an override runs: a law along a path, and what that asks of the axes in each tick."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.limit_table import KINDS, PLACES, TICKS
from splinefeed.paths.track import Track
from splinefeed.planner.conditions import BESIDE
from splinefeed.planner.constants import SAME
from splinefeed.planner.timed import times_at
from splinefeed.records import Array, BoolArray, IntArray, Limits, TimeLaw, Torque, positive
from splinefeed.records.motion import derivative

#: Highest rate, where the limits allow it, if nobody says else.
HIGHEST = 2.0
#: What weight and friction leave of a torque is never taken to be less than this share of it.
LEAST_ROOM = 1e-6
#: A law that is over its limits by less than this is at them.
AT_LIMITS = 1e-6
#: A jump of q'' counts for so many periods before and behind it, a little less than the one that plans leave room for,
#: as that ends where feeds, not times, say; the jerk that it counts as over that time; most ticks that this touches.
REACH = 0.95
PEAK, TICKS_IN_REACH = 0.75 / (1.0 - (1.5 - REACH) ** 3 / 3.0), 3
#: A jump of q'' below this share of the largest q'' around is rounding.
LEAST_JUMP = 1e-7
#: Breaks nearer to each other than this share of the duration are one.
ROUNDING = 1e-14


#: No weighted sums of axes.
NO_SUMS: Array = np.zeros((0, 0))


def with_sums(values: Array, sums: Array) -> Array:
    """Values of axes (..., axes), and behind them those of weighted sums of these, (k, axes): (..., axes + k)."""
    return np.concatenate([values, values @ sums.T], axis=-1) if len(sums) else values


class MotionSource(Protocol):
    """Positions q(tau) by plan time, at rest at its end; `period` and `duration` in s.

    It begins at plan time `begin`, s, in motion if it is `moving`; what lies behind that is the way back.
    """

    axes: tuple[str, ...]
    period: float
    duration: float
    begin: float
    moving: bool

    def demands(self, first: int, count: int, sums: Array = NO_SUMS) -> Array:
        """Compute what axes and weighted sums of them need in ticks; 0 beyond both ends.

        Parameters
        ----------
        first : int
            The first tick.
        count : int
            How many.
        sums : (k, axes) array, optional
            Weights of the sums.

        Returns
        -------
        (count, 4, axes + k + 1) array
            Largest |q'| and |q''|; jerk at rate 1, jumps of q'' included; jerk over r^2 as the rate r goes to 0, where
            only these are left. In between the latter is at most a mean of both. The last column is that of the arc
            length.
        """

    def bend_share(self, limits: Limits) -> float:
        """Compute the share of the limits that hold for the feed on a bend, at rate 1.

        Parameters
        ----------
        limits : Limits
            That hold for what is sent.

        Returns
        -------
        float
            The square root of what the bend asks for.
        """


class LawSource:
    """Run a law along a path under an override.

    Parameters
    ----------
    path : Track
        Of the law.
    law : TimeLaw
        What runs; it ends at rest.
    period : float, optional
        Servo period, s; the law's if it is not given.

    Attributes
    ----------
    begin : float
        Plan time, s, at which the law passes the state that it was planned from, with a way back behind it; else 0.
    moving : bool
        Whether it moves there, as a law that was planned again from where an override was.

    Raises
    ------
    LimitsError
        For a law that does not end at rest, and where nobody gives a period.

    References
    ----------
    .. [1] docs/math/override.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> slow = sf.plan(path, sf.planner.with_reserve(limits), period=1e-3)
    >>> sf.planner.LawSource(path, slow).duration == slow.duration
    True
    """

    def __init__(self, path: Track, law: TimeLaw, period: float | None = None) -> None:
        wanted = law.period if period is None else period
        if wanted is None:
            raise LimitsError("no period: the law was planned without one; give period= in s")
        if law.feed(law.duration) > AT_LIMITS:
            raise LimitsError("a law that can be overridden ends at rest; leave end_feed at 0")
        self.begin = float(law.settings.get("start_s", 0.0))
        self.moving = bool(law.feed(self.begin) > AT_LIMITS)
        self.path, self.law, self.period = path, law, positive(wanted, "period")
        self.axes, self.duration = path.axes, law.duration
        #: The torques that an override keeps, each a column behind the others.
        self.torque: Torque | None = None

    def demands(self, first: int, count: int, sums: Array = NO_SUMS) -> Array:
        """Compute what axes and weighted sums of them need in ticks, from the exact derivatives of path and law.

        Parameters
        ----------
        first : int
            The first tick.
        count : int
            How many.
        sums : (k, axes) array, optional
            Weights of the sums.

        Returns
        -------
        (count, 4, axes + k + 1) array
            As `MotionSource.demands` has it.

        Notes
        -----
        For one period before and behind it, less a twentieth, a jump D of q'' counts as jerk of PEAK D / T: the
        quadratic B-spline by which a third difference sees it is nowhere above PEAK times its own mean over that time.
        """
        edges = np.clip(self.period * np.arange(first - 1, first + count + 2), 0.0, self.duration)
        cells, at, jumps = self._look(edges[:-1], edges[1:], sums)
        cells[:, 2], cells[:, 3] = np.max(cells[:, 2:], axis=1, initial=0.0), 0.0
        sharp = np.any(np.abs(jumps) > LEAST_JUMP * np.max(cells[:, 1], axis=0), axis=1)
        if np.any(sharp):
            self._add(cells, first - 1, at[sharp], jumps[sharp], sums)
        return cells[1:-1]

    def _add(self, cells: Array, first: int, at: Array, jumps: Array, sums: Array) -> None:
        """Add jumps (k, columns) of q'' at times (k,), s, to the needs of ticks from `first` on, (n, 4, columns)."""
        period, reach = self.period, REACH * self.period
        ends = np.unique(np.clip([at - reach, at + reach], 0.0, self.duration))
        middle = 0.5 * (ends[:-1] + ends[1:])
        begin, end = (np.searchsorted(at, middle + way) for way in (-reach, reach))
        near = end > begin
        low, high, begin, end = ends[:-1][near], ends[1:][near], begin[near], end[near]
        ways = np.stack([np.maximum(jumps, 0.0), np.maximum(-jumps, 0.0)], axis=1)
        total = np.concatenate([np.zeros_like(ways[:1]), np.cumsum(ways, axis=0)])
        alone = PEAK / period * (total[end] - total[begin])
        both = np.max(alone + self._look(low, high, sums)[0][:, 2:], axis=1)
        alone = np.max(alone, axis=1)
        for k in range(TICKS_IN_REACH):
            tick = (low / period).astype(np.int64) + k - first
            inside = (tick >= 0) & (tick < len(cells)) & (period * (tick + first) < high)
            np.maximum.at(cells[:, 2], tick[inside], np.maximum(both, alone / 3.0)[inside])
            np.maximum.at(cells[:, 3], tick[inside], alone[inside])

    def _look(self, low: Array, high: Array, sums: Array) -> tuple[Array, Array, Array]:
        """Largest |q'|, |q''|, q''' and -q''' of axes, sums and arc length, from times low to high (n,), s.

        low, high increase; (n, 4, columns): 0, and minus infinity for q''', where nothing is between them. With the
        times (k,), s, at which q'' jumps, and by how much, (k, columns).
        """
        law, ends = self.law, np.unique(np.concatenate([low, high]))
        places, reached = self.path.pieces, law(ends[[0, -1]])
        places = places[np.searchsorted(places, reached[0], side="right") : np.searchsorted(places, reached[1])]
        starts, near = law.coefficients[:, 0], SAME * self.path.length
        apart = np.searchsorted(starts, places - near) == np.searchsorted(starts, places + near)
        breaks = np.concatenate([law.breaks, times_at(law, places[apart])])
        edges = np.unique(np.concatenate([ends, breaks[(breaks > ends[0]) & (breaks < ends[-1])]]))
        edges = edges[np.diff(edges, prepend=-np.inf) > ROUNDING * self.duration]  # what ends together
        middle = 0.5 * (edges[:-1] + edges[1:])
        cell = np.searchsorted(low, middle, side="right") - 1
        within = middle < high[cell]
        begin, end, middle, cell = edges[:-1][within], edges[1:][within], middle[within], cell[within]
        piece = np.searchsorted(law.breaks, middle, side="right") - 1
        at = derivative(law.coefficients[piece], middle - law.breaks[piece], 0)
        row = np.searchsorted(self.path.pieces, at, side="right") - 1
        follows = begin[1:] == end[:-1]
        smooth = np.zeros(len(begin), dtype=bool)
        smooth[:-1] = follows & (piece[1:] == piece[:-1]) & (row[1:] == row[:-1])
        # each part is looked at in three places; where nothing can jump one ends as the next one begins
        count, ending = len(begin), np.flatnonzero(~smooth)
        part = np.concatenate([np.arange(count), np.arange(count), ending])
        t = np.concatenate([begin, middle, end[ending]])
        c, tau = law.coefficients[piece[part]], t - law.breaks[piece[part]]
        s, v, a, j = (derivative(c, tau, order)[:, None] for order in range(4))
        with np.errstate(invalid="ignore", over="ignore"):  # where C' = 0
            r = with_sums(self._derivatives(row[part], s[:, 0]), sums)
        known: BoolArray = np.all(np.isfinite(r[:, 3]), axis=1)
        r[~known] = 0.0
        q = np.empty((3, len(r), r.shape[2] + 1))
        q[0, :, :-1] = r[:, 1] * v
        q[1, :, :-1] = r[:, 2] * (v * v) + r[:, 1] * a
        q[2, :, :-1] = r[:, 3] * (v * v * v) + r[:, 2] * (3.0 * v * a) + r[:, 1] * j
        s1, s2, s3 = self.path.tip(r)[:, :, None]
        tip = s1 * v, s1 * a + s2 * v * v, s1 * j + 3.0 * s2 * v * a + s3 * v * v * v
        q[:, :, -1:] = np.where(known[:, None], tip, 0.0)
        if self.torque is not None:
            q = np.concatenate([q, _of_torque(self.torque, r[:, 0], q, self.torque.columns(self.axes))], axis=2)
        first, inner, last = q[:, :count], q[:, count : 2 * count], np.roll(q[:, :count], -1, axis=1)
        last[:, ending] = q[:, 2 * count :]
        most, least = (each(each(first, inner), last) for each in (np.maximum, np.minimum))
        parts = np.stack([*np.maximum(most[:2], -least[:2]), most[2], -least[2]], axis=1)
        cells = np.zeros((len(low), *parts.shape[1:]))
        cells[:, 2:] = -np.inf
        new = np.diff(cell, prepend=-1) > 0
        cells[cell[new]] = parts[new]
        np.maximum.at(cells, cell[~new], parts[~new])
        met = ending[:-1][follows[ending[:-1]] & known[ending[:-1] + 1] & known[2 * count : -1]]
        return cells, end[met], first[1, met + 1] - last[1, met]

    def _derivatives(self, row: IntArray, s: Array) -> Array:
        """Axes and their derivatives by s, (n, 4, axes), at s (n,), mm, between breaks `row` (n,)."""
        path = self.path
        if not path.sided:
            ends = np.append(path.pieces, path.length)
            away = np.minimum(BESIDE * path.length, 0.5 * np.diff(ends)[row])
            s = np.clip(s, ends[row] + away, ends[row + 1] - away)
        return path.derivatives(s, row)[:, :, : len(path.axes)]

    def bend_share(self, limits: Limits) -> float:
        """Compute the share of the limits that hold for the feed on a bend, at rate 1.

        Parameters
        ----------
        limits : Limits
            That hold for what is sent.

        Returns
        -------
        float
            As a factor on the feed.
        """
        settings = self.law.settings.get("limits", {})
        given = limits.given(PLACES) | limits.given(TICKS)
        shares = [(settings.get(name, math.inf) / most) ** (1.0 / KINDS[name].power) for name, most in given.items()]
        if not all(map(math.isfinite, shares)):
            names = ", ".join(KINDS[name].words for name in given if name not in settings)
            raise LimitsError(f"the law was not planned under the limits of {names}")
        return max(shares, default=0.0)


def _of_torque(torque: Torque, position: Array, q: Array, columns: list[int]) -> Array:
    """Torques as three columns of derivatives each, (3, n, joints), with a limit of 1 on the second.

    At the rate r of the law torques are c + r^2 (tau - c) + M q' dr/dt, in the form of accelerations, for the weight c;
    what weight and friction leave of the limit is the unit. Viscous friction goes with r, and counts as at HIGHEST.
    """
    at, v, a = position[:, columns], q[0][:, columns], q[1][:, columns]
    none = np.zeros_like(at)
    still = torque.of(at, none, none)
    coulomb, viscous = torque.dry
    most = np.array(list(torque.most.values()))
    room = np.maximum(most - np.abs(still) - coulomb - HIGHEST * viscous * np.abs(v), LEAST_ROOM * most)
    found = np.stack([torque.of(at, none, v) - still, torque.of(at, v, a) - still, none])
    return np.asarray(np.where(np.isfinite(most), found / room, 0.0))

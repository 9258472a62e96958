"""What a motion is planned under: the path, its coordinates, the period, what jumps there, and where it rests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from splinefeed.limit_table import PLACES, TICKS
from splinefeed.paths.track import Track
from splinefeed.planner.constants import SAME
from splinefeed.planner.coordinates import PEAK, Coordinates, rows_of
from splinefeed.planner.path_rows import ROWS, Places, within_steps
from splinefeed.planner.rows import Rows
from splinefeed.records import Array, BoolArray, Limits

#: A place is within reach of a jump of the path if the motion passes that less than a period before or behind.
WITHIN = 1.0 - 1e-9
#: How far inside of a cell, as a share of it, derivatives are taken as those at its end, where they may jump.
INSIDE = 1e-7
#: ... and at most this share of the path, far above the rounding of arc length: a sharp bend is no jump.
BESIDE = 4.0 * SAME
#: A jump is worth cells of its own where it takes more than this share of a limit of jerk, or of the chord error.
WORTH, WORTH_CHORD = 1e-3, 0.03
#: A jump below this share of the derivative itself, or of what its own slope makes of it over INSIDE, is rounding.
ROUNDING = 1e-8
#: The slope of q jumps where that makes the largest jump of an acceleration less than this share of what it is.
WORTH_SLOPE = 0.98
#: ... by no more than so many times what r'' jumps by, as a share of q: a cell turns by little, and so does q.
MOST_SLOPE = 20.0
#: Directions count what is above this share of the fastest change.
DIRECTION = 1e-6


@dataclass(frozen=True, eq=False)
class Conditions:
    """A path and what the motion along it must keep.

    Parameters
    ----------
    track : Track
        The path.
    limits : Limits
        Of the motion.
    period : float or None
        Servo period, s.
    feed_steps : (k,) and (k + 1,) array
        Arc lengths, mm, at which the feed that the path asks for changes, and the feeds, mm/s.
    passed : two (p,) arrays
        Arc lengths of corners that are passed in motion, mm, and the largest feed there, mm/s.
    rests : (r,) array
        Arc lengths strictly inside at which the motion stops, mm.
    paces : (k,) and (k + 1,) array, optional
        Arc lengths, mm, at which the share of the limits changes that the motion may use, and these shares, as factors
        on q.
    """

    track: Track
    limits: Limits
    period: float | None
    feed_steps: tuple[Array, Array]
    passed: tuple[Array, Array]
    rests: Array
    paces: tuple[Array, Array] = (np.zeros(0), np.ones(1))

    @cached_property
    def at(self) -> Coordinates:
        """The coordinates and their limits."""
        track = self.track
        return Coordinates.of(
            self.limits, track.axes, track.linear or len(track.axes), beside=track.beside, alone=track.alone
        )

    @property
    def two_jerks(self) -> bool:
        """Whether speeding up and slowing down have two limits of jerk."""
        return self.limits.deceleration_jerk not in (None, self.limits.jerk)

    @cached_property
    def _tip(self) -> slice:
        """Columns of the tip; of none where only rotary axes move."""
        return self.track.tip_columns

    @cached_property
    def _has_tip(self) -> bool:
        return bool(self._tip.stop > self._tip.start)

    @cached_property
    def _along_path(self) -> tuple[dict[str, float], dict[str, float]]:
        """Limits of PLACES and of TICKS, by name; none without a tip."""
        return (self.limits.given(PLACES), self.limits.given(TICKS)) if self._has_tip else ({}, {})

    @cached_property
    def breaks(self) -> Array:
        """Where derivatives may jump and rows change, mm; places that differ by rounding are one."""
        given = np.unique(np.concatenate([self.feed_steps[0], self.passed[0], self.rests, self.paces[0]]))
        known = np.concatenate([[-np.inf], given, [np.inf]])
        own = self.track.breaks
        next_one = np.searchsorted(known, own)
        apart = np.minimum(own - known[next_one - 1], known[next_one] - own)
        return np.unique(np.concatenate([given, own[apart > SAME * self.track.length]]))

    def place(self, s: float) -> float:
        """A place, mm, as people read it: the tip's arc length."""
        return float(self.track.tip_length(min(max(s, 0.0), self.track.length))) if s > 0.0 else 0.0

    def between(self, low: float, high: float) -> str:
        """Two places, mm, as people read them: the tip's arc length."""
        return f"from s = {self.place(low):.6g} to {self.place(high):.6g} mm"

    def inside(self, low: float, high: float) -> Array:
        """The breaks strictly between two places, mm."""
        same = SAME * self.track.length
        first, last = np.searchsorted(self.breaks, [low + same, high - same], side="right")
        return self.breaks[first:last]

    def along(self, s: Array) -> tuple[Array, Array]:
        """r and its derivatives (n, 4, axes), and x', x'', x''' of the coordinates (3, m, n), at places s (n,)."""
        d = self.track.derivatives(s)
        return d, self.at.along(d, self.track.tip(d))

    @cached_property
    def _beside(self) -> tuple[Array, Array, Array]:
        """x', x'', x''' (3, m, k) just before and behind the breaks, and how far off, (k + 1,), mm."""
        b, length = self.breaks, self.track.length
        away = np.minimum(INSIDE * np.diff(np.concatenate([[0.0], b, [length]])), BESIDE * length)
        return self.along(b - away[:-1])[1], self.along(b + away[1:])[1], away

    @cached_property
    def jumps(self) -> Array:
        """Jumps of x' and of x'' of all coordinates at the breaks, (2, m, k); none at rests and at corners passed.

        There differences of setpoints are a step of velocity or those of a motion at rest.
        """
        before, after, _ = self._beside
        found = np.nan_to_num(after[:2] - before[:2])
        found[:, :, np.isin(self.breaks, np.concatenate([self.rests, self.passed[0]]))] = 0.0
        return found

    @cached_property
    def real_jumps(self) -> BoolArray:
        """At which breaks (2, k) some x', or some x'', jumps by more than rounding and its own slope make of it."""
        before, after, away = self._beside
        own = np.abs(before) + np.abs(after)
        slope = np.abs(before[1:]) * away[:-1] + np.abs(after[1:]) * away[1:]
        floor = ROUNDING * np.max(own[:2], axis=1, keepdims=True) + 3.0 * slope
        return np.asarray(np.any(np.abs(self.jumps) > floor, axis=1))

    @cached_property
    def slope_jumps(self) -> Array:
        """By what share of q, 1/mm, q' jumps at the breaks, (k,), so that accelerations jump by less: see `least_jump`.

        On mixed paths alone, where a constant feed of the tip takes that: elsewhere the jump would be one of the feed's
        own acceleration.
        """
        shares = np.zeros(len(self.breaks))
        before, after, _ = self._beside
        limit = np.minimum(self.at.j, self.at.dj)
        if self.period is None or not self.track.mixed:
            return shares
        turned, bent = self.real_jumps
        some, counted = np.flatnonzero(bent & ~turned), np.isfinite(limit)
        if len(some) and np.any(counted):
            half = 0.25 * (before[0] + after[0])[counted][:, some] / limit[counted, None]
            # where a tip turns back its s' is 0 and s'' jumps, whatever q' does: r'' of the axes does not jump there
            axes = self.jumps[1, : len(self.track.axes), some] * self.track.weights[: len(self.track.axes)]
            most = MOST_SLOPE * np.linalg.norm(axes, axis=1)
            shares[some] = least_jump(self.jumps[1][counted][:, some] / limit[counted, None], half, most)
        return shares

    def slope_jumps_at(self, nodes: Array, jumps: BoolArray) -> Array:
        """The same at nodes (n + 1,), mm, at those of `jumps` inside."""
        found = np.zeros(len(nodes))
        if np.any(self.slope_jumps):
            k = np.clip(np.searchsorted(self.breaks, nodes), 0, len(self.breaks) - 1)
            found[1:-1] = np.where(jumps & (self.breaks[k] == nodes), self.slope_jumps[k], 0.0)[1:-1]
        return found

    @cached_property
    def _totals(self) -> Array:
        """Jumps up and down of x' and, with what q' takes of it, x'', summed over the breaks: (2, 2, m, k + 1)."""
        before, after, _ = self._beside
        jumps = self.jumps.copy()
        jumps[1] += 0.25 * (before[0] + after[0]) * self.slope_jumps
        each = np.stack([np.maximum(jumps, 0.0), np.maximum(-jumps, 0.0)], axis=1)
        return np.pad(np.cumsum(each, axis=3), ((0, 0), (0, 0), (0, 0), (1, 0)))

    def jumps_worth_cells(self, low: float, high: float, s: Array, q: Array) -> tuple[Array, Array]:
        """Breaks within reach between two places whose jumps take a share of a limit of jerk; q there, by q (n,) at s.

        Those within a period before the first and behind the last place reach in.
        """
        way = WITHIN * (self.period or 0.0) * np.sqrt(q[[0, -1]])
        b = self.inside(low - float(way[0]), high + float(way[1]))
        if self.period is None or not len(b):
            return b[:0], b[:0]
        there = np.interp(b, s, q)
        turn, bend = np.abs(self.jumps[:, :, np.searchsorted(self.breaks, b)])
        limit = np.minimum(self.at.j, self.at.dj)[:, None]
        taken = (turn * np.sqrt(there) / self.period**2 + PEAK * bend * there / self.period) / limit
        worth = taken.max(axis=0, initial=0.0) > WORTH
        if self.limits.chord_error is not None and self._has_tip:  # 4 delta / turn is the longest chord across one
            turned = np.linalg.norm(turn[self._tip], axis=0)
            worth |= turned * np.sqrt(there) * self.period > 4.0 * WORTH_CHORD * self.limits.chord_error
        return b[worth], there[worth]

    def rows(
        self,
        s: Array,
        seen: tuple[Array, Array] | None = None,
        *,
        v: Array | None = None,
        reach: tuple[Array, Array] | None = None,
        rising: Array | float = 0.0,
        alone: bool = False,
        smooth: bool = False,
    ) -> Rows:
        """Make all rows at places.

        Parameters
        ----------
        s : (n,) array
            Places, mm, no breaks.
        seen : tuple of array, optional
            What `along` gives there, (...), if it is known.
        v : (n,) array, optional
            How fast the motion may be there decides which jumps are within reach.
        reach : two (n,) arrays, optional
            From where to where they are, mm, in place of `v`.
        rising : (n,) array or float, optional
            1 where the tip surely speeds up, -1 where it slows down, 0 where it may do either.
        alone : bool, optional
            Whether what bends within a step of a place is of no concern: setpoints decide that.
        smooth : bool, optional
            Whether limits of models with friction, or of jerk, are left out.

        Returns
        -------
        Rows
            At the n places.
        """
        d, x = self.along(s) if seen is None else seen
        if reach is None:
            way = np.zeros(len(s)) if v is None or self.period is None else np.minimum(v, 1e6) * self.period * WITHIN
            reach = s - way, s + way
        first, last = np.searchsorted(self.breaks, reach[0]), np.searchsorted(self.breaks, reach[1], side="right")
        turn, bend = self._totals[..., np.maximum(last, first)] - self._totals[..., first]
        signs = np.broadcast_to(np.asarray(rising), s.shape)
        rows = rows_of(self.at, x, self.feed_at(s), (turn, bend), self.period, signs)
        limits, track = self.limits, self.track
        at, (places, ticks) = Places(track, s, d, x[:2, -1], np.sum(turn, axis=0)), self._along_path
        if self.period is not None:
            rows = within_steps(rows, at, ticks, self.period, alone)
        if len(self.passed[0]):
            rows = rows.lowered(self.corner_at(s) ** 2)
        given = [ROWS[name](at, most) for name, most in places.items()]
        given += [model.rows(s, d[:, :, model.columns(track.axes)]) for model in (limits.models if len(s) else ())]
        plain = [own.root is None and own.jerk is None for own in given]  # else a bound of the time does without it
        for own, is_plain in sorted(zip(given, plain, strict=True), key=lambda each: not each[1]):
            if is_plain or not smooth:
                rows = rows.joined(own, smooth=is_plain)
        steps, shares = self.paces
        if np.any(shares != 1.0):
            rows = rows.tightened(np.tile(shares[np.searchsorted(steps, s, side="right")], (3, 1)))
        return rows

    def speed_at(self, s: float, feed: float) -> float:
        """sigma_dot at a place, mm/s, where the tip has a feed, mm/s."""
        length = self.track.length
        inside = min(max(s, BESIDE * length), (1.0 - BESIDE) * length)
        return feed / float(self.along(np.array([inside]))[1][0, -1, 0]) if feed > 0.0 else 0.0

    def feed_at(self, s: Array) -> Array:
        """Feed that the path asks for, mm/s."""
        steps, feeds = self.feed_steps
        return feeds[np.searchsorted(steps, s, side="right")]

    def corner_at(self, s: Array) -> Array:
        """Largest feed at corners that are passed, mm/s: at the ends of the cells beside them, elsewhere infinite."""
        edges = np.concatenate([[0.0], self.breaks, [self.track.length]])
        most = np.full(len(edges), np.inf)
        most[np.searchsorted(edges, self.passed[0])] = self.passed[1]
        k = np.clip(np.searchsorted(edges, s), 1, len(edges) - 1)
        beside = 2.0 * INSIDE * (edges[k] - edges[k - 1])
        before, behind = s - edges[k - 1] <= beside, edges[k] - s <= beside
        return np.minimum(np.where(before, most[k - 1], np.inf), np.where(behind, most[k], np.inf))

    def directions(self, d: Array, x: Array) -> tuple[Array, Array]:
        """Unit directions (n, k) whose turn cells must follow, and how fast they turn, 1/mm, (n,).

        That of the path, and that in which each coordinate counts by its limit of acceleration, or velocity.
        """
        at, weights = self.at, self.track.weights
        some = slice(None) if self.track.mixed else slice(-1)  # with the tip, where it is not the path
        limit = np.where(np.isfinite(at.a), at.a, at.v)[some, None]
        one, two = x[:2, some] / limit
        size = np.sqrt(np.sum(one * one, axis=0))
        size = np.maximum(size, DIRECTION * np.max(size, initial=0.0) + 1e-300)
        along = np.sum(one * two, axis=0) / size
        across = np.sqrt(np.maximum(np.sum(two * two, axis=0) - along * along, 0.0)) / size
        own, bend = d[:, 1] * weights, np.linalg.norm(d[:, 2] * weights, axis=1)
        return np.concatenate([own, (one / size).T], axis=1), np.maximum(bend, across)


def least_jump(jump: Array, half: Array, most: Array) -> Array:
    """The factors f (k,) for which the largest of |jump + f half|, each (m, k), is least; 0 where that gains little.

    It is where two of these lines cross, up or down, or as far as |f| is allowed to go, most (k,).
    """
    m, k = jump.shape
    i, j = (each.ravel() for each in np.indices((m, m)))
    found, least = np.zeros(k), WORTH_SLOPE * np.max(np.abs(jump), axis=0)
    for sign in (1.0, -1.0):
        with np.errstate(divide="ignore", invalid="ignore"):
            factors = -(jump[i] + sign * jump[j]) / (half[i] + sign * half[j])
        for factor in np.clip(np.nan_to_num(factors, nan=0.0), -most, most):
            value = np.max(np.abs(jump + factor * half), axis=0)
            better = value < least
            found, least = np.where(better, factor, found), np.where(better, value, least)
    return found

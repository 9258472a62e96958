"""What a motion is planned under: the path, its limits, the period, and what jumps there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from splinefeed.feed.limits import Places, Rows, rows_at
from splinefeed.feed.numbers import SAME
from splinefeed.feed.track import Track
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Limits

#: A place is within reach of a jump of the path if the motion passes that less than so many periods before or behind.
REACH = 1.0
#: How far inside of a cell, as a share of it, derivatives are taken as those at its end, where they may jump.
INSIDE = 1e-7
#: ... and as a share of the path, far above the rounding of arc length: a sharp bend is no jump.
BESIDE = 4.0 * SAME
#: A jump below this share of the derivative itself, or of what its own slope makes of it over INSIDE, is rounding.
ROUNDING = 1e-8


@dataclass(frozen=True, eq=False)
class Setting:
    """A path and what the motion along it must keep.

    feed_steps  (k,), (k + 1,)  arc lengths, mm, at which the feed that the path asks for changes, and the feeds, mm/s
    passed      (p,), (p,)      arc lengths of corners that are passed in motion, mm, and the largest feed there, mm/s
    rests       (r,)            arc lengths strictly inside at which the motion stops, mm
    """

    track: Track
    limits: Limits
    axes: tuple[str, ...]
    linear: int
    period: float | None
    feed_steps: tuple[Array, Array]
    passed: tuple[Array, Array]
    rests: Array

    @cached_property
    def breaks(self) -> Array:
        """Where cells must end, mm; places that differ by rounding are one."""
        given = np.unique(np.concatenate([self.feed_steps[0], self.passed[0], self.rests]))
        known = np.concatenate([[-np.inf], given, [np.inf]])
        own = self.track.breaks
        next_one = np.searchsorted(known, own)
        apart = np.minimum(own - known[next_one - 1], known[next_one] - own)
        return np.unique(np.concatenate([given, own[apart > SAME * self.track.length]]))

    def inside(self, low: float, high: float) -> Array:
        """The breaks strictly between two places, mm."""
        same = SAME * self.track.length
        first, last = np.searchsorted(self.breaks, [low + same, high - same], side="right")
        return self.breaks[first:last]

    @cached_property
    def beside(self) -> tuple[Array, Array, Array]:
        """r and its derivatives just before and behind the breaks, (k, 4, axes), and how far off, (k + 1,), mm."""
        b, length = self.breaks, self.track.length
        away = np.minimum(INSIDE * np.diff(np.concatenate([[0.0], b, [length]])), BESIDE * length)
        return self.track.derivatives(b - away[:-1]), self.track.derivatives(b + away[1:]), away

    @cached_property
    def turns_within(self) -> Array:
        """Over about how much path the direction changes just before and behind the breaks, (2, k), mm."""
        d = np.abs(np.stack(self.beside[:2])[:, :, 1:]) * self.weights
        with np.errstate(all="ignore"):
            first, _, third = np.moveaxis(np.max(d, axis=3), 2, 0)
            found: Array = np.sqrt(first / third)
        return found

    @cached_property
    def jumps(self) -> tuple[Array, Array]:
        """Jumps of r' and of r'' at the breaks, (k, axes) each, 0 where there is none but rounding."""
        b = self.breaks
        if not len(b):
            none = np.zeros((0, len(self.axes)))
            return none, none
        before, after, away = self.beside
        found = []
        for order in (1, 2):
            jump = after[:, order] - before[:, order]
            own = np.abs(before[:, order]) + np.abs(after[:, order])
            slope = np.abs(before[:, order + 1]) * away[:-1, None] + np.abs(after[:, order + 1]) * away[1:, None]
            found.append(np.where(np.abs(jump) > ROUNDING * own.max(axis=1, keepdims=True) + 3.0 * slope, jump, 0.0))
        # differences across a corner that is passed are its step of velocity, and at rest there are none
        other = np.isin(b, np.concatenate([self.passed[0], self.rests]))
        for jump in found:
            jump[other] = 0.0
        return found[0], found[1]

    @cached_property
    def real_jumps(self) -> Array:
        """The breaks at which r' or r'' jumps, mm."""
        turn, bend = self.jumps
        return self.breaks[np.any((turn != 0.0) | (bend != 0.0), axis=1)]

    @cached_property
    def jump_totals(self) -> Array:
        """Jumps of r' and of r'', those up and those down, summed over `real_jumps`, (2, 2, k + 1, axes)."""
        real = np.isin(self.breaks, self.real_jumps)
        return np.stack(
            [
                np.pad(np.cumsum([np.maximum(jump, 0.0), np.maximum(-jump, 0.0)], axis=1), ((0, 0), (1, 0), (0, 0)))
                for jump in (each[real] for each in self.jumps)
            ]
        )

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

    @cached_property
    def weights(self) -> Array:
        """What a unit of motion of each axis counts, (axes,): the inverse of its limit of acceleration, or of another.

        0 for an axis without limits.
        """
        found = np.zeros(len(self.axes))
        for name in ("axis_velocity", "axis_jerk", "axis_acceleration"):
            limit = self.limits.of_axes(name, self.axes)
            found = np.where(np.isfinite(limit), 1.0 / limit, found)
        return found

    def turning(self, d: Array) -> tuple[Array, Array]:
        """Directions (n, axes) of the path with derivatives d (n, 4, axes), and how fast they turn, rad/mm, (n,).

        Linear axes by their tangent; rotary ones with limits by their share of them, of the greatest one of all axes.
        """
        first, k = d[:, 1], self.linear
        curvature = np.linalg.norm(d[:, 2, :k], axis=1)
        if not np.any(self.weights[k:]):
            return first[:, :k], curvature
        along = 1.0 / min(self.limits.acceleration, 1e9)
        greatest = np.maximum(np.max(np.abs(first) * self.weights, axis=1), along)
        directions = np.concatenate([first[:, :k], first[:, k:] * self.weights[k:] / greatest[:, None]], axis=1)
        rotary = np.max(np.abs(d[:, 2, k:]) * self.weights[k:], axis=1) / greatest
        return directions, np.maximum(curvature, rotary)

    def places(
        self,
        s: Array,
        feed: Array | None = None,
        rising: Array | None = None,
        d: Array | None = None,
        alone: bool = False,
    ) -> Places:
        """Places at s (n,), no breaks; how fast the motion may be there, feed (n,), mm/s, tells what is in reach.

        d (n, 4, axes)  r and its derivatives there, if they are known
        """
        n = len(s)
        turn, bend = np.zeros((2, len(self.axes), n)), np.zeros((2, len(self.axes), n))
        d = self.track.derivatives(s) if d is None else d
        at = self.real_jumps
        if self.period is not None and len(at):
            v = np.minimum(self.limits.feed, self.feed_at(s)) if feed is None else feed
            reach = REACH * (1.0 - 1e-9) * self.period * np.minimum(v, 1e6)
            low, high = np.searchsorted(at, s - reach), np.searchsorted(at, s + reach, side="right")
            for totals, out in zip(self.jump_totals, (turn, bend), strict=True):
                for row, total in enumerate(totals):
                    out[row] = (total[high] - total[low]).T
        chord = axis_chord = None
        if isinstance(self.track, JointPath) and (self.limits.chord_error or self.limits.orientation_error):
            chord, axis_chord = self.track.between_ticks(d)
        return Places(
            s=s,
            d=d,
            linear=self.linear,
            axes=self.axes,
            period=self.period,
            feed=self.feed_at(s),
            corner=self.corner_at(s),
            turn=turn,
            bend=bend,
            rising=np.zeros(n) if rising is None else rising,
            chord=chord,
            axis_chord=axis_chord,
            alone=alone,
        )

    def rows(self, places: Places) -> Rows:
        """All limits at places, those of corners that are passed included."""
        return rows_at(places, self.limits)

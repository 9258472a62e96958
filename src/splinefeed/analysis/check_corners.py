"""Corners that may be passed in motion: where they are, and how much the velocity of each axis jumps there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.records import AXIS_LIMITS, Array, BoolArray, IntArray, Limits

#: A tick is at a corner within this, relative to the arc length there.
AT_TICK = 1e-12
#: Steps on either side of one with a corner that show how constant the feed is around it.
BESIDE = 2
#: A corner that turns further than this, rad, turns back: it is never passed at speed.
TURNING_BACK = np.pi - 1e-6


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners that may be passed in motion, k of them.

    s         (k,)          arc lengths, mm
    jumps     (k, axes)     by how much dr/ds of each axis jumps there
    tangents  (k, 2, axes)  |dr/ds| before and behind
    bends     (k, 2, axes)  |d2r/ds2| before and behind, 1/mm
    """

    s: Array
    jumps: Array
    tangents: Array
    bends: Array

    def slopes(self, k: IntArray, feed: Array, limits: Limits, axes: tuple[str, ...]) -> tuple[Array, Array]:
        """Most acceleration, (n, 2), mm/s^2, and jerk, (n, 2), mm/s^3, of the path before and behind corners k (n,).

        Before it the feed falls, behind it grows, as in a dip; each axis holds |r_ss v^2 + r_s a| <= A at the feed v.
        """
        along = np.array([limits.deceleration or np.inf, limits.acceleration])
        acceleration, jerk = (limits.of_axes(name, axes) for name in AXIS_LIMITS[1:])
        tangents = self.tangents[k]
        with np.errstate(divide="ignore", invalid="ignore"):
            by_axes = (acceleration + self.bends[k] * (feed * feed)[:, None, None]) / tangents
            steepest = np.minimum(along, np.fmin.reduce(by_axes, axis=2))
            twist = np.array([limits.deceleration_jerk or np.inf, limits.jerk])
            # beside a limit of acceleration that of an axis' jerk says little more, and in a bend not this
            free = np.where(np.isfinite(steepest), np.inf, np.fmin.reduce(jerk / tangents, axis=2))
        return steepest, np.minimum(twist, free)

    def least_feeds(
        self, k: IntArray, means: Array, i: IntArray, ahead: Array, floor: Array, period: float, limits: Limits,
        axes: tuple[str, ...],
    ) -> Array:  # fmt: skip
        """A bound of the feed at corners k (n,), mm/s, `ahead` mm (n,) into steps i (n,), by the mean feeds of all."""
        index = i[:, None] + np.arange(-BESIDE, BESIDE + 1)
        known = (index >= 0) & (index < len(means))
        around = np.where(known, means[np.clip(index, 0, len(means) - 1)], np.nan)
        top = np.fmax.reduce(around, axis=1)
        accelerations, jerks = self.slopes(k, top, limits, axes)
        way = means[i] * period
        at_tick = np.minimum(ahead, way - ahead) <= AT_TICK * (self.s[k] + way)
        quickest = 0.25 * period * np.minimum(np.min(accelerations, axis=1), 0.125 * period * np.min(jerks, axis=1))
        rest = at_tick & (top <= quickest) & (quickest < np.inf)  # such steps are within the limits from rest to rest
        # a dip also bends the feed around it
        bent = accelerations + (np.fmax.reduce(np.abs(np.diff(around, axis=1)), axis=1) / period)[:, None]
        dip = hidden_dip(around, floor, period, bent, jerks)
        middle = around[:, BESIDE - 1 : BESIDE + 2]
        return np.where(rest, 0.0, np.maximum(corner_feed(middle, ahead, period) - dip, 0.0))


def passable(path: Path, wanted: bool) -> Corners:
    """Every corner of the tangent at which the tool may go on, if they are wanted, else none.

    Where C' = 0 on one side no velocity jumps: the tool must rest there, and differences see whether it does.
    """
    found = [each for each in path.corners if each.stop and each.angle <= TURNING_BACK] if wanted else []
    curve, u = np.array([each.curve for each in found], dtype=np.int64), np.array([each.u for each in found])
    domains = path.flat.domains
    at_end = (u >= domains[curve, 1]) & (curve + 1 < len(domains))
    after = np.where(at_end, curve + 1, curve)
    sides = [
        path.evaluate(curve, u, 2, side="left")[:, 1:],
        path.evaluate(after, np.where(at_end, domains[after, 0], u), 2)[:, 1:],
    ]
    speed = np.stack([_speed(side[:, 0], path.linear) for side in sides], axis=1)
    passes = np.min(speed, axis=1) > 1e-9 * np.max(speed, axis=1)
    sides, speed = [side[passes] for side in sides], speed[passes]
    tangents, bends = zip(*(_by_length(d, speed[:, k], path.linear) for k, d in enumerate(sides)), strict=True)
    return Corners(
        np.array([each.s for each in found])[passes],
        np.abs(tangents[1] - tangents[0]),
        np.abs(np.stack(tangents, axis=1)),
        np.abs(np.stack(bends, axis=1)),
    )


def _by_length(d: Array, speed: Array, linear: int) -> tuple[Array, Array]:
    """r_s and r_ss of each axis, (n, axes), from C', C'' (n, 2, axes) and s_u (n,): r_ss = (C'' - r_s s_uu) / s_u^2."""
    first, second = d[:, 0], d[:, 1]
    along = np.sum(first[:, :linear] * second[:, :linear], axis=1)
    turning = ~np.any(first[:, :linear], axis=1)
    along = np.where(turning, np.degrees(np.degrees(np.sum(first[:, linear:] * second[:, linear:], axis=1))), along)
    tangent = first / speed[:, None]
    return tangent, (second - tangent * (along / speed)[:, None]) / (speed * speed)[:, None]


def _speed(first: Array, linear: int) -> Array:
    """|C'| (n,) over the linear axes or, where only rotary ones move, over these in degrees; first (n, axes)."""
    moved = np.linalg.norm(first[:, :linear], axis=1)
    return np.asarray(np.where(moved > 0.0, moved, np.degrees(np.linalg.norm(first[:, linear:], axis=1))))


def contain(corners: Array, begin: Array, end: Array) -> BoolArray:
    """Whether a corner lies strictly between arc lengths begin and end, (n,)."""
    with np.errstate(invalid="ignore"):
        inside: BoolArray = np.searchsorted(corners, end, "left") > np.searchsorted(corners, begin, "right")
    return inside


def corner_feed(means: Array, ahead: Array | float, period: float) -> Array:
    """A bound of the feed at a corner, mm/s, by the mean feeds of the step that it is in and of those beside, (..., 3).

    With steady acceleration a over the three steps the feed at `ahead` mm into the middle one is v,

        v^2 = v_0^2 + 2 a ahead,   v_0 = middle mean - a T / 2

    Where a changes once, or one way only, half the second difference of the means is more than v can be too large.
    """
    before, here, after = means[..., 0], means[..., 1], means[..., 2]
    gained = 0.5 * (after - before)
    square = (here - 0.5 * gained) ** 2 + 2.0 * gained * ahead / period
    found = np.sqrt(np.maximum(square, 0.0)) - 0.5 * np.abs(before - 2.0 * here + after)
    return np.asarray(np.maximum(found, 0.0))


def hidden_dip(means: Array, floor: Array | float, period: float, accelerations: Array, jerks: Array) -> Array:
    """How far the feed may dip at a corner below what the mean feeds of the steps around it let expect, mm/s.

    A dip loses distance, which shows: whatever second difference the means (..., m) have above that of their floor,
    mm/s, may be one, w = 2 T max |second difference| at most. With no more than acceleration a before and behind, or
    jerk j, (..., 2), it is as deep as d:

        w = d^2 (1 / a_1 + 1 / a_2) / 2,   w = sqrt(2) / 3 d^(3/2) (1 / sqrt(j_1) + 1 / sqrt(j_2))

    Where nothing limits either, the feed is taken to be as even as the means are.
    """
    rough = np.fmax.reduce(np.abs(np.diff(means, n=2, axis=-1)), axis=-1, initial=0.0) - 4.0 * floor
    way = 2.0 * np.maximum(rough, 0.0) * period
    with np.errstate(divide="ignore", invalid="ignore"):
        by_acceleration = np.sqrt(2.0 * way / np.sum(1.0 / accelerations, axis=-1))
        by_jerk = (3.0 * way / np.sqrt(2.0) / np.sum(1.0 / np.sqrt(jerks), axis=-1)) ** (2.0 / 3.0)
    deepest = np.fmin(by_acceleration, by_jerk)
    return np.asarray(np.where((way > 0.0) & np.isfinite(deepest), deepest, 0.0))


def neighbours(rests: Array, begin: Array, end: Array, slack: Array | float) -> BoolArray:
    """Whether begin and end, mm, (n,), are one of the sorted `rests` (m,), mm, and the next one, within slack, mm."""
    first = np.clip(np.searchsorted(rests, begin + slack, side="right") - 1, 0, len(rests) - 2)
    with np.errstate(invalid="ignore"):
        found: BoolArray = (np.abs(rests[first] - begin) <= slack) & (np.abs(rests[first + 1] - end) <= slack)
    return found


def standing(rests: Array, s: Array, slack: Array | float) -> BoolArray:
    """Whether s, mm, (n,), is one of the sorted `rests` (m,), mm, at least two, within slack, mm."""
    after = np.clip(np.searchsorted(rests, s), 1, len(rests) - 1)
    with np.errstate(invalid="ignore"):
        found: BoolArray = np.minimum(np.abs(rests[after - 1] - s), np.abs(rests[after] - s)) <= slack
    return found

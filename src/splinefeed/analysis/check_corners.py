"""Corners that may be passed in motion: where they are, and how much the velocity of each axis jumps there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.records import AXIS_LIMITS, Array, BoolArray, Limits

#: A tick is at a corner within this, relative to the arc length there.
AT_TICK = 1e-12
#: Steps on either side of one with a corner that tell how steady the feed is around it.
BESIDE = 2
#: A corner that turns further than this, rad, turns back: it is no corner to pass.
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

    def slopes(self, k: int, feed: float, limits: Limits, axes: tuple[str, ...]) -> tuple[Array, Array]:
        """Most acceleration, (2,), mm/s^2, and jerk, (2,), mm/s^3, of the path before and behind corner k.

        Before it the feed falls, behind it grows, as in a dip; each axis holds |r_ss v^2 + r_s a| <= A at this feed v.
        """
        along = np.array([limits.deceleration or np.inf, limits.acceleration])
        acceleration, jerk = (limits.of_axes(name, axes) for name in AXIS_LIMITS[1:])
        with np.errstate(divide="ignore", invalid="ignore"):
            by_axes = np.fmin.reduce((acceleration + self.bends[k] * feed**2) / self.tangents[k], axis=1)
            steepest = np.minimum(along, by_axes)
            twist = np.array([limits.deceleration_jerk or np.inf, limits.jerk])
            # beside a limit of acceleration that of an axis' jerk says little more, and in a bend not this
            free = np.where(np.isfinite(steepest), np.inf, np.fmin.reduce(jerk / self.tangents[k], axis=1))
        return steepest, np.minimum(twist, free)

    def least_feed(
        self,
        k: int,
        means: Array,
        i: int,
        ahead: float,
        floor: float,
        period: float,
        limits: Limits,
        axes: tuple[str, ...],
    ) -> float:
        """No more than the feed at corner k, mm/s, which is `ahead` mm into step i, by the mean feeds of all steps."""
        around = means[max(i - BESIDE, 0) : i + BESIDE + 1]
        accelerations, jerks = self.slopes(k, float(np.max(around)), limits, axes)
        at_tick = min(ahead, means[i] * period - ahead) <= AT_TICK * (self.s[k] + period * means[i])
        quickest = 0.25 * period * min(float(np.min(accelerations)), 0.125 * period * float(np.min(jerks)))
        if at_tick and np.max(around) <= quickest < np.inf:
            return 0.0  # such steps are within the limits from rest to rest
        accelerations = accelerations + np.max(np.abs(np.diff(around))) / period  # a dip bends what goes on besides
        dip = hidden_dip(around, floor, period, accelerations, jerks)
        return max(corner_feed(means[i - 1 : i + 2], ahead, period) - dip, 0.0)


def passable(path: Path) -> Corners:
    """Every corner of the tangent at which the tool may go on.

    Where C' = 0 on one side no velocity jumps: the tool must rest there, and differences see whether it does.
    """
    places, jumps, tangents, bends = [], [], [], []
    for corner in path.corners:
        if not corner.stop or corner.angle > TURNING_BACK:
            continue
        curve, u = corner.curve, corner.u
        after = curve + 1 if u >= path.curves[curve].domain[1] and curve + 1 < len(path.curves) else curve
        before = path.evaluate([curve], [u], 2, side="left")[0, 1:]
        behind = path.evaluate([after], [u if after == curve else path.curves[after].domain[0]], 2)[0, 1:]
        speeds = [_speed(d[0], path.linear) for d in (before, behind)]
        if min(speeds) <= 1e-9 * max(speeds):
            continue
        places.append(corner.s)
        jumps.append(np.abs(behind[0] / speeds[1] - before[0] / speeds[0]))
        sides = [_by_length(d, c, path.linear) for d, c in zip((before, behind), speeds, strict=True)]
        tangents.append([tangent for tangent, _ in sides])
        bends.append([bend for _, bend in sides])
    axes = len(path.axes)
    two = (-1, 2, axes)
    return Corners(
        np.array(places), np.reshape(jumps, (-1, axes)), np.reshape(tangents, two), np.reshape(bends, two)
    )  # fmt: skip


def _by_length(d: Array, speed: float, linear: int) -> tuple[Array, Array]:
    """|r_s| and |r_ss| of each axis, (axes,), from C', C'' (2, axes) and ds/du: r_ss = (C'' - r_s s_uu) / s_u^2."""
    first, second = d
    moved = slice(linear) if np.any(first[:linear]) else slice(linear, None)
    unit = speed / float(np.linalg.norm(first[moved]))
    tangent = first / speed
    gain = unit * unit * float(np.dot(first[moved], second[moved])) / speed
    return np.abs(tangent), np.abs(second - tangent * gain) / speed**2


def _speed(first: Array, linear: int) -> float:
    """|C'| over the linear axes or, where only rotary ones move, over these in degrees."""
    moved = float(np.linalg.norm(first[:linear]))
    return moved if moved > 0.0 else float(np.degrees(np.linalg.norm(first[linear:])))


def contain(corners: Array, begin: Array, end: Array) -> BoolArray:
    """Whether a corner lies strictly between arc lengths begin and end, (n,)."""
    with np.errstate(invalid="ignore"):
        inside: BoolArray = np.searchsorted(corners, end, "left") > np.searchsorted(corners, begin, "right")
    return inside


def corner_feed(means: Array, ahead: float, period: float) -> float:
    """No more than the feed at a corner, mm/s, by the mean feeds of the step that it is in and of those beside, (3,).

    With steady acceleration a over the three steps the feed at `ahead` mm into the middle one is v,

        v^2 = v_0^2 + 2 a ahead,   v_0 = middle mean - a T / 2

    Where a changes once, or one way only, half the second difference of the means is more than v can be too large.
    """
    before, here, after = (float(mean) for mean in means)
    gained = 0.5 * (after - before)
    square = (here - 0.5 * gained) ** 2 + 2.0 * gained * ahead / period
    return max(float(np.sqrt(max(square, 0.0))) - 0.5 * abs(before - 2.0 * here + after), 0.0)


def hidden_dip(means: Array, floor: float, period: float, accelerations: Array, jerks: Array) -> float:
    """How far the feed may dip at a corner below what the mean feeds of the steps around it let expect, mm/s.

    A dip costs way, and that shows: whatever second difference the means (m,) have above that of their floor, mm/s,
    may be one, w = 2 T max |second difference| at most. With no more than acceleration a before and behind, or jerk j,
    (2,), it is as deep as d:

        w = d^2 (1 / a_1 + 1 / a_2) / 2,   w = sqrt(2) / 3 d^(3/2) (1 / sqrt(j_1) + 1 / sqrt(j_2))

    Where nothing limits either, the feed is taken to be as even as the means are.
    """
    rough = float(np.max(np.abs(np.diff(means, n=2)), initial=0.0)) - 4.0 * floor
    way = 2.0 * max(rough, 0.0) * period
    if not way > 0.0:
        return 0.0 * way
    with np.errstate(divide="ignore"):
        by_acceleration = np.sqrt(2.0 * way / np.sum(1.0 / accelerations))
        by_jerk = (3.0 * way / np.sqrt(2.0) / np.sum(1.0 / np.sqrt(jerks))) ** (2.0 / 3.0)
    deepest = float(np.fmin(by_acceleration, by_jerk))
    return deepest if np.isfinite(deepest) else 0.0


def neighbours(rests: Array, begin: Array, end: Array, slack: float) -> BoolArray:
    """Whether begin and end, mm, (n,), are one of the sorted `rests` (m,), mm, and the next one, within slack, mm."""
    first = np.clip(np.searchsorted(rests, begin + slack, side="right") - 1, 0, len(rests) - 2)
    with np.errstate(invalid="ignore"):
        found: BoolArray = (np.abs(rests[first] - begin) <= slack) & (np.abs(rests[first + 1] - end) <= slack)
    return found


def standing(rests: Array, s: Array, slack: float) -> BoolArray:
    """Whether s, mm, (n,), is one of the sorted `rests` (m,), mm, at least two, within slack, mm."""
    after = np.clip(np.searchsorted(rests, s), 1, len(rests) - 1)
    with np.errstate(invalid="ignore"):
        found: BoolArray = np.minimum(np.abs(rests[after - 1] - s), np.abs(rests[after] - s)) <= slack
    return found

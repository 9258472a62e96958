"""Corners that may be passed in motion: where they are, and how much the velocity of each axis jumps there."""

from __future__ import annotations

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.records import Array, BoolArray

#: A corner that turns further than this, rad, turns back: it is no corner to pass.
TURNING_BACK = np.pi - 1e-6


def passable(path: Path) -> tuple[Array, Array]:
    """Arc lengths (k,) of corners of the tangent, mm, and by how much dr/ds of each axis jumps there, (k, axes).

    Where C' = 0 on one side there is no such jump: the tool must rest there, and differences see whether it does.
    """
    places, jumps = [], []
    for corner in path.corners:
        if not corner.stop or corner.angle > TURNING_BACK:
            continue
        curve, u = corner.curve, corner.u
        after = curve + 1 if u >= path.curves[curve].domain[1] and curve + 1 < len(path.curves) else curve
        before = path.evaluate([curve], [u], 1, side="left")[0, 1]
        behind = path.evaluate([after], [u if after == curve else path.curves[after].domain[0]], 1)[0, 1]
        speeds = [_speed(d, path.linear) for d in (before, behind)]
        if min(speeds) <= 1e-9 * max(speeds):
            continue
        places.append(corner.s)
        jumps.append(np.abs(behind / speeds[1] - before / speeds[0]))
    return np.array(places), np.array(jumps).reshape(-1, len(path.axes))


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


def neighbours(rests: Array, begin: Array, end: Array, slack: float) -> BoolArray:
    """Whether begin and end, mm, (n,), are one of the sorted `rests` (m,), mm, and the next one, within slack, mm."""
    first = np.clip(np.searchsorted(rests, begin + slack, side="right") - 1, 0, len(rests) - 2)
    with np.errstate(invalid="ignore"):
        found: BoolArray = (np.abs(rests[first] - begin) <= slack) & (np.abs(rests[first + 1] - end) <= slack)
    return found

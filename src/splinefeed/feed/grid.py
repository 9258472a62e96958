"""A first grid for a stretch, dense where the feed must be low, and the ramps at its ends."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.feed.bounds import deceleration, deceleration_jerk, feed_squared_bound
from splinefeed.feed.cells import Cells, by_length, cells_between, located, sample
from splinefeed.feed.square import End, Setting
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.records import Array, IntArray

#: Cells of the first grid: so many for each arc-length piece of the path, within these bounds, ...
CELLS_PER_PIECE, FEWEST_CELLS, MOST_CELLS = 4, 1000, 200_000
#: ... but no more than so many for each period of the motion: what is shorter than a tick is not seen.
CELLS_PER_PERIOD = 3.0
#: ... and at least so many for each change of the feed by the factor e; a feed below this share of the largest is no
#: longer told apart.
CELLS_PER_E, LEAST_SHARE = 4.0, 1e-12
#: The ramp at rest is this share of the length in which acceleration would build up.
RAMP_SHARE = 0.02
#: Longest and shortest ramp, relative to the stretch; each that is tried is this share of the one before.
LONGEST_RAMP, SHORTEST_RAMP, SHORTER = 1e-3, 1e-9, 0.25
#: Bending may take this share of the axis jerk that a straight ramp has.
BENT = 0.75
#: Places of a ramp, as shares of its length, where it is held to the limits.
RAMP_PLACES = np.geomspace(1e-12, 1.0, 49)
#: Extra places near the ends of a stretch, as shares of it.
TIP = np.minimum(0.25, 1e-6 * 1.25 ** np.arange(56))
#: ... and around sharp bends.
AROUND = np.concatenate([-np.geomspace(1e-2, 1e-10, 25), [0.0], np.geomspace(1e-10, 1e-2, 25)])


def first_cells(
    path: Path, low: float, high: float, feeds: tuple[float | None, float | None], setting: Setting
) -> tuple[Cells, tuple[End, End]]:
    """A first grid of the stretch and its ends; feeds are those at its ends, mm/s, 0 for rest, None for any."""
    limits, axes, period = setting.limits, setting.axes, setting.period
    curve, u, s = sample(path, low, high, 9)
    length = high - low
    extra = np.concatenate([low + length * TIP, high - length * TIP[::-1]])
    sharp = setting.sharp[(setting.sharp > low) & (setting.sharp < high)]
    around = (sharp[:, None] + length * AROUND).ravel()
    extra = np.concatenate([extra, around[(around > low) & (around < high)]])
    extra_curve, extra_u = path.locate(extra)
    s = np.concatenate([s, extra])
    order = np.argsort(s, kind="stable")
    s, curve, u = s[order], np.concatenate([curve, extra_curve])[order], np.concatenate([u, extra_u])[order]
    d = by_arc_length(path.evaluate(curve, u, 3), path.linear)
    d = np.where(np.isfinite(d), d, 0.0)
    tops = curve_feeds(path, limits)[curve]
    with np.errstate(divide="ignore", invalid="ignore"):
        top = feed_squared_bound(d[:, 1], d[:, 2], tops, limits, axes, period, path.linear)
        top = np.fmin(top, np.fmin.reduce(axes.acceleration / np.abs(d[:, 2]), axis=1))
        top = np.fmin(top, np.fmin.reduce(axes.jerk / np.abs(d[:, 3]), axis=1) ** (2.0 / 3.0))
        push = np.fmin(np.fmin.reduce(axes.acceleration / np.abs(d[:, 1]), axis=1), limits.acceleration)
        twist = np.fmin(np.fmin.reduce(axes.jerk / np.abs(d[:, 1]), axis=1), limits.jerk)
    ends = (
        _end(path, int(curve[0]), low, high, feeds[0], setting),
        _end(path, int(curve[-1]), high, low, feeds[1], setting),
    )
    push_top, twist_top = float(np.min(push)), float(np.min(twist))
    grow = np.full(len(s), np.inf)
    for place, least in _low_points(path, low, high, ends, setting):
        away = np.abs(s - place)
        rest = np.maximum(away, min((e.length for e in ends if e.rest), default=1e-6 * length))
        if math.isfinite(push_top):
            grow = np.minimum(grow, least + 2.0 * push_top * rest)
        if math.isfinite(twist_top):
            grow = np.minimum(grow, least + (4.5 * twist_top * rest**2) ** (2.0 / 3.0))
    if math.isfinite(push_top):
        # from every place q grows no faster than the acceleration lets it
        top = np.minimum(top, grow)
        least = float(np.min(top))
        slope = 2.0 * push_top * s
        top = np.minimum(top, slope + np.minimum.accumulate(top - slope))
        top = np.minimum(top, (np.minimum.accumulate((top + slope)[::-1])[::-1]) - slope)
        top = np.maximum(top, least)  # rounding
    feed = np.sqrt(np.maximum(np.minimum(top, grow), LEAST_SHARE * float(np.max(np.minimum(top, grow)))))
    duration = float(np.sum(np.diff(s) / np.minimum(feed[1:], feed[:-1])))
    count = min(max(CELLS_PER_PIECE * (len(curve) // 9), FEWEST_CELLS), MOST_CELLS)
    if period is not None:
        count = min(count, max(int(CELLS_PER_PERIOD * duration / period), 24))
    s = np.concatenate([[low], s, [high]])
    feed = np.concatenate([feed[:1], feed, feed[-1:]])
    # as many cells a second throughout, and some for each change of the feed by a factor
    cells = np.concatenate([[0.0], np.cumsum(count / duration * np.diff(s) * 0.5 * (1.0 / feed[1:] + 1.0 / feed[:-1]))])
    cells += np.concatenate([[0.0], np.cumsum(CELLS_PER_E * np.abs(np.diff(np.log(feed))))])
    return cells_between(path, low + ends[0].length, high - ends[1].length, s, cells), ends


def _low_points(
    path: Path, low: float, high: float, ends: tuple[End, End], setting: Setting
) -> list[tuple[float, float]]:
    """Places from which the feed grows again, mm, and q there: rests, moving ends, corners passed, slower curves."""
    found = [
        (s, 0.0 if end.feed is None else end.feed**2)
        for s, end in zip((low, high), ends, strict=True)
        if end.rest or end.feed is not None
    ]
    found += [
        (float(s), float(v) ** 2) for s, v in zip(setting.corner_s, setting.corner_feed, strict=True) if low < s < high
    ]
    if path.feeds is not None:
        feeds = curve_feeds(path, setting.limits)
        joints = path.curve_starts[1:-1]
        for k in np.flatnonzero((joints > low) & (joints < high) & (feeds[1:] != feeds[:-1])):
            found.append((float(joints[k]), float(min(feeds[k], feeds[k + 1])) ** 2))
    return found


def _end(path: Path, curve: int, at: float, other: float, feed: float | None, setting: Setting) -> End:
    """The end of a stretch at arc length `at`; from rest, the longest ramp that is short beside all else.

    A ramp s = j t^3 / 6 has v a = 3 j s, v^3 = 9/2 j s^2, so that an axis sees

        jerk  j (r' + 9 r'' s + 9/2 r''' s^2),    acceleration  (6 j^2 s)^(1/3) (r' + 3/2 r'' s)
    """
    if feed is None or feed > 0.0:
        return End(feed=feed)
    length = abs(other - at)
    size = LONGEST_RAMP * length
    bare, _, _ = _ramp(path, curve, at, other, SHORTEST_RAMP * length, setting)
    bare = bare if math.isfinite(bare) else 0.0
    while True:
        jerk, push, top = _ramp(path, curve, at, other, size, setting)
        sizes = [LONGEST_RAMP * length]
        if math.isfinite(jerk):
            sizes.append(RAMP_SHARE * top**0.75 / math.sqrt(jerk) / 6.0)
            if math.isfinite(push):
                sizes.append(RAMP_SHARE * push**3 / (6.0 * jerk**2))
        else:
            sizes.append(1e-9 * length)
        fits = size <= min(sizes) and jerk >= BENT * bare
        if fits or size <= SHORTEST_RAMP * length:
            return End(length=size, jerk=jerk)
        size = max(min(SHORTER * size, max(min(sizes), SHORTEST_RAMP * length)), SHORTEST_RAMP * length)


def _ramp(path: Path, curve: int, at: float, other: float, size: float, setting: Setting) -> tuple[float, float, float]:
    """Largest jerk of a ramp of that size, largest acceleration along the path near it, and least bound of q there."""
    limits, axes = setting.limits, setting.axes
    away = RAMP_PLACES * size
    curves: IntArray = np.full(len(away), curve)
    places = at + np.sign(other - at) * away
    d = by_length(path, curves, located(path, curves, places))
    # towards the stretch: run backwards, odd derivatives change their sign, and so does nothing that counts here
    sign = np.sign(other - at)
    r1, r2, r3 = d[:, 1], sign * d[:, 2], d[:, 3]
    feed = np.full(len(away), curve_feeds(path, limits)[curve])
    forwards = other > at
    with np.errstate(divide="ignore", invalid="ignore"):
        s = away[:, None]
        by_jerk = np.fmin.reduce(axes.jerk / np.abs(r1 + 9.0 * r2 * s + 4.5 * r3 * s * s), axis=None)
        straight = np.fmin.reduce(axes.jerk / np.abs(r1), axis=None)
        bent = (6.0 * s) ** (1.0 / 3.0) * np.abs(r1 + 1.5 * r2 * s)
        by_push = np.fmin.reduce(axes.acceleration / bent, axis=None) ** 1.5
        along = limits.acceleration if forwards else deceleration(limits)
        by_along = (along / (6.0 * size) ** (1.0 / 3.0)) ** 1.5
        top: Array = feed_squared_bound(r1, r2, feed, limits, axes, setting.period, path.linear)
        by_top = float(np.min(top**1.5 / (4.5 * away * away)))
        push = min(float(np.fmin.reduce(axes.acceleration / np.abs(r1), axis=None)), along)
    given = limits.jerk if forwards else deceleration_jerk(limits)
    jerk = min(BENT * float(by_jerk) if by_jerk < BENT * straight else float(by_jerk), given)
    if math.isfinite(jerk):
        jerk = min(jerk, float(by_push), float(by_along), by_top)
    return jerk, push, float(np.min(top))

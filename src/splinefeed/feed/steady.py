"""A slow plan that always is: one seven-phase profile over a stretch, stretched in time until it keeps every limit."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.bounds import deceleration, deceleration_jerk, feed_squared_bound, shares
from splinefeed.feed.cells import rows_between
from splinefeed.feed.law_pieces import Pieces
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.feed.square import Setting
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kernels import pieces as rows
from splinefeed.records import Array, IntArray, Limits

#: Places of each arc-length piece of the path that are looked at, Chebyshev-Lobatto, and how much is left for what lies
#: between them.
PLACES, MARGIN = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 17))), 1.01
#: Bisections that find when the profile is at a place.
BISECTIONS = 60
#: Where there is no limit of acceleration or jerk along the path, these many of them fit into the stretch.
RAMPS = 10.0


def steady(path: Path, low: float, high: float, setting: Setting) -> Pieces:
    """From rest to rest in seven phases; every limit holds, the time is what it takes."""
    curve, u, s, side = _places(path, low, high)
    d = by_arc_length(path.evaluate(curve, u, 3), path.linear)
    left = by_arc_length(path.evaluate(curve, u, 3, side="left"), path.linear)
    d = np.where(side[:, None, None], left, d)
    d = np.where(np.isfinite(d), d, 0.0)
    limits, axes = setting.limits, setting.axes
    feeds = curve_feeds(path, limits)[curve]
    top = feed_squared_bound(d[:, 1], d[:, 2], feeds, limits, axes, setting.period, path.linear)
    with np.errstate(divide="ignore"):
        top = np.minimum(top, np.fmin.reduce(axes.acceleration / np.abs(d[:, 2]), axis=1))
        top = np.minimum(top, np.fmin.reduce(axes.jerk / np.abs(d[:, 3]), axis=1) ** (2.0 / 3.0))
        push = float(np.min(axes.acceleration / np.max(np.abs(d[:, 1]), axis=0)))
        twist = float(np.min(axes.jerk / np.max(np.abs(d[:, 1]), axis=0)))
    length = high - low
    feed = math.sqrt(float(np.min(top)))
    if not (0.0 < feed < math.inf):
        raise PlanError(f"the limits allow no motion between s = {low:.6g} and {high:.6g} mm")
    push = min(push, limits.acceleration, deceleration(limits), RAMPS * feed * feed / length)
    twist = min(twist, limits.jerk, deceleration_jerk(limits), RAMPS * feed * push / length)
    law = SevenPhase.solve(length, Limits(feed=feed, acceleration=0.5 * push, jerk=0.5 * twist)).law()
    coefficients = law.coefficients.copy()
    coefficients[:, 0] += low
    pieces = Pieces(law.breaks.copy(), coefficients, np.zeros(0, dtype=bool), 0)
    begin, end = np.zeros(len(s)), np.full(len(s), pieces.duration)
    for _ in range(BISECTIONS):
        middle = 0.5 * (begin + end)
        ahead = pieces.at(middle) < s
        begin, end = np.where(ahead, middle, begin), np.where(ahead, end, middle)
    v, a = pieces.at(end, 1), pieces.at(end, 2)
    worst = 0.0
    for j in (np.zeros(len(s)), np.full(len(s), 0.5 * twist), np.full(len(s), -0.5 * twist)):
        over = shares(d, v, a, j, feeds, limits, axes, setting.period, path.linear)
        worst = max(worst, float(np.max(over)))
    return pieces.stretched(math.sqrt(max(worst, 1.0)) * MARGIN)


def _places(path: Path, low: float, high: float) -> tuple[IntArray, Array, Array, Array]:
    """Curve, parameter, arc length and whether the left side counts, of places of every arc-length piece between."""
    first, last, owner = rows_between(path, low, high)
    table = path.table[first : last + 1]
    u = table[:, rows.LOW, None] + np.diff(table[:, [rows.LOW, rows.HIGH]], axis=1) * PLACES
    curve = np.repeat(owner, len(PLACES)).astype(np.int64)
    s = path.arc_length(curve, u.ravel())
    side = np.tile(PLACES == 1.0, len(table))
    inside = (s >= low) & (s <= high)
    return curve[inside], u.ravel()[inside], s[inside], side[inside]

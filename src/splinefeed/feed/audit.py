"""How far a planned motion is over its limits: by exact derivatives of its law, and at the ticks of the servo."""

from __future__ import annotations

import numpy as np

from splinefeed.feed.bounds import deceleration_jerk, shares
from splinefeed.feed.cells import ROUNDINGS_OF_S, by_length, located, rows_between
from splinefeed.feed.law_pieces import Nodes, Pieces, polynomial
from splinefeed.feed.square import Setting
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.path import Path
from splinefeed.kernels import pieces as rows
from splinefeed.records import Array, BoolArray, IntArray

#: Places in every piece of the law where it is held against the limits.
CHECKED = np.linspace(0.0, 1.0, 7)
#: ... and at last, before what is left over is taken by a stretch: ends closer, as ramps bend most next to rest.
LAST_CHECKED = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 33)))
#: The rise of a peak between them is taken this much larger, as a parabola is not the whole truth.
PEAK_MARGIN = 2.0
#: Bisections that find when a ramp is at a place.
BISECTIONS = 60
#: Places of the curve between two ticks whose distance from their chord is looked at.
CHORD_PLACES = np.linspace(0.0, 1.0, 11)[1:-1]
#: A chord's share is taken this much larger, for what lies between those places. Where a parabola through the furthest
#: and those beside it rises by more than a share of it, or bends by more than that on an arc, 0.08 of it, as at a tip,
#: and it is not below a share of what is allowed, it is looked for by golden section.
CHORD_MARGIN, PEAKED, BENT, WORTH_A_LOOK = 1.0 + 1e-2, 1e-3, 0.1, 0.4
SECTIONS, GOLDEN = 30, 0.5 * (5.0**0.5 - 1.0)
#: Roundings of a position that a difference may be off by.
ROUNDINGS = 8.0
#: An acceleration along the path below this share of the largest in its piece has no sign of its own.
NO_SIGN = 1e-9
#: Ticks that are looked at together.
BLOCK = 65536


def excess(nodes: Nodes, pieces: Pieces, setting: Setting, places: Array = CHECKED) -> Array:
    """By how much each cell's q must come down for the law as it is to keep every limit, (n,); 1 is just kept."""
    cells = nodes.cells
    path = cells.path
    first, last = pieces.offset, int(nodes.ends[1].rest)
    ratios: list[Array] = []
    narrow = setting.narrow_tops(cells)
    durations = np.diff(pieces.times)
    feeds = curve_feeds(path, setting.limits)
    curve = np.concatenate([cells.curve[:1]] * first + [cells.curve] + [cells.curve[-1:]] * last)
    left = np.concatenate([cells.u0[:1]] * first + [cells.u0] + [cells.u1[-1:]] * last)
    right = np.concatenate([cells.u0[:1]] * first + [cells.u1] + [cells.u1[-1:]] * last)
    accelerations = np.array([polynomial(pieces.coefficients, place * durations, 2) for place in places])
    none = np.abs(accelerations) <= NO_SIGN * np.max(np.abs(accelerations), axis=0)
    signs = np.where(none, np.sign(accelerations[len(places) // 2]), np.sign(accelerations))
    fastest = np.zeros(len(durations))
    for place, sign in zip(places, signs, strict=True):
        s, v, a, j = (polynomial(pieces.coefficients, place * durations, k) for k in range(4))
        u = located(path, curve, s)
        inner = slice(first, len(s) - last)
        if place in (0.0, 1.0):
            u[inner] = (left if place == 0.0 else right)[inner]
        d = by_length(path, curve, u, "left" if place == 1.0 else "right")
        ratios.append(shares(d, v, a, j, feeds[curve], setting.limits, setting.axes, setting.period, path.linear, sign))
        fastest = np.maximum(fastest, v)
    worst = _peaks(np.array(ratios))
    worst = np.maximum(worst, _turn_excess(pieces, setting))
    over: Array = np.maximum(worst[inner], fastest[inner] ** 2 / narrow)
    if first:
        over[0] = max(over[0], worst[0], _ramp_excess(path, pieces, 0, nodes.high, setting))
    if last:
        over[-1] = max(over[-1], worst[-1], _ramp_excess(path, pieces, len(durations) - 1, nodes.high, setting))
    return over


def _peaks(ratios: Array) -> Array:
    """The largest of shares (places, limits, n), (n,), and what lies between places, as a parabola of each limit tells.

    Of the largest one of all limits it would not: one that is level beside hides how another one peaks. The last one,
    of jerk along the path, has no peak within a quartic, but jumps where the feed begins to fall.
    """
    bent = ratios[:, :-1]
    below, here, above = bent[:-2], bent[1:-1], bent[2:]
    bend = 2.0 * here - below - above
    peaked = (here >= below) & (here >= above) & (bend > 0.0)
    rise = np.where(peaked, (above - below) ** 2 / (8.0 * np.where(peaked, bend, 1.0)), 0.0)
    worst: Array = np.maximum(np.max(ratios, axis=(0, 1)), np.max(here + PEAK_MARGIN * rise, axis=(0, 1)))
    return worst


def _turn_excess(pieces: Pieces, setting: Setting) -> Array:
    """The same for jerk along the path where speeding up turns into slowing down within a piece, (m,).

    Both limits of jerk hold at that instant; s is a quartic of time, so its acceleration turns twice at most.
    """
    up, down = setting.limits.jerk, deceleration_jerk(setting.limits)
    over = np.zeros(len(pieces.coefficients))
    if up == down:  # that of all places is that of all instants then
        return over
    c, b, a = (factor * pieces.coefficients[:, k] for k, factor in ((2, 2.0), (3, 6.0), (4, 12.0)))
    inside = b * b - 4.0 * a * c
    half = -0.5 * (b + np.copysign(np.sqrt(np.maximum(inside, 0.0)), b))
    with np.errstate(divide="ignore", invalid="ignore"):
        for t in (half / a, c / half):
            turns = (inside >= 0.0) & (t > 0.0) & (t < np.diff(pieces.times))
            jerk = np.where(turns, np.abs(b + 2.0 * a * t), 0.0)
            over = np.maximum(over, (jerk / min(up, down)) ** (2.0 / 3.0))
    return over


def _ramp_excess(path: Path, pieces: Pieces, index: int, high: float, setting: Setting) -> float:
    """The same for the ramp of this index, on every arc-length piece of the path that it runs over, one-sided at both.

    Cells have no knot inside, ramps may: next to a rest at one, or at a span of 1e-6, curvature explodes there.
    """
    last = index + 1 == len(pieces.coefficients)
    begin, end = pieces.coefficients[index, 0], high if last else pieces.coefficients[index + 1, 0]
    slack = ROUNDINGS_OF_S * float(np.finfo(np.float64).eps) * path.length
    if not end - begin > 2.0 * slack:
        return 0.0
    first_row, last_row, owner = rows_between(path, float(begin) + slack, float(end) - slack)
    if first_row == last_row:
        return 0.0
    table = path.table[first_row : last_row + 1]
    law = np.broadcast_to(pieces.coefficients[index], (len(table), pieces.coefficients.shape[1]))
    low, up = np.zeros(len(table)), np.full(len(table), pieces.times[index + 1] - pieces.times[index])
    duration = up.copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + up)
        behind = polynomial(law, middle, 0) < table[:, rows.START]
        low, up = np.where(behind, middle, low), np.where(behind, up, middle)
    edges = np.append(np.where(table[:, rows.START] <= begin, 0.0, up), duration[0])
    ratios: list[Array] = []
    feeds = curve_feeds(path, setting.limits)[owner]
    inside = (table[:, rows.LOW], table[:, rows.HIGH])
    for place in LAST_CHECKED:
        t = edges[:-1] + place * np.diff(edges)
        s, v, a, j = (polynomial(law, t, order) for order in range(4))
        u = np.clip(located(path, owner, s), *inside)
        if place in (0.0, 1.0):
            u[1:] = inside[0][1:] if place == 0.0 else u[1:]
            u[:-1] = inside[1][:-1] if place == 1.0 else u[:-1]
        d = by_length(path, owner, u, "left" if place == 1.0 else "right")
        sign = np.full(len(table), -1.0 if last else 1.0)
        ratios.append(shares(d, v, a, j, feeds, setting.limits, setting.axes, setting.period, path.linear, sign))
    return float(np.max(_peaks(np.array(ratios))))


def tick_excess(path: Path, pieces: Pieces, setting: Setting, start: float, rest: tuple[bool, bool]) -> Array:
    """The same for what only ticks show, for each piece, (m,): chord error, and differences across jumps.

    Ticks are at start + k T, start in [0, T), s; what rests before or behind stands still there.
    """
    period, limits, axes = setting.period, setting.limits, setting.axes
    over = np.zeros(len(pieces.coefficients))
    if period is None:
        return over
    wanted_chord = limits.chord_error is not None
    jumps = _jump_times(path, pieces, setting)
    if not wanted_chord and not len(jumps):
        return over
    count = int(np.floor((pieces.duration - start) / period * (1.0 + 1e-12) + 1e-9)) + 1
    corner_times = _times_at(pieces, setting.corner_s)
    for block in range(0, count, BLOCK):
        k: IntArray = np.arange(block - 3, min(block + BLOCK, count) + 3)
        if not wanted_chord:
            at = (jumps[:, None] - start) / period + np.arange(-4, 5)
            k = np.intersect1d(np.floor(at).astype(int), k)
            if not len(k):
                continue
        t: Array = np.asarray(start + k * period, dtype=np.float64)
        inside = ((t >= -1e-9 * period) | rest[0]) & ((t <= pieces.duration + 1e-9 * period) | rest[1])
        k, t = k[inside], t[inside]
        if len(k) < 2:
            continue
        s = pieces.at(np.clip(t, 0.0, pieces.duration))
        points = joined(path, s)
        if wanted_chord:
            _chords(path, setting, k, s, t, points, pieces, over)
        eps = np.finfo(np.float64).eps
        floor = ROUNDINGS * eps * (np.max(np.abs(points), axis=0) + path.length)
        for order, bound, power in ((2, axes.acceleration, 1.0), (3, axes.jerk, 2.0 / 3.0)):
            if not np.any(np.isfinite(bound)) or len(t) <= order:
                continue
            near = k[order:] - k[:-order] == order
            near &= ~_straddles(t[:-order], t[order:], corner_times)
            seen = (np.abs(np.diff(points, n=order, axis=0)) - floor) / period**order / bound
            ratio = np.where(near, np.maximum(np.max(seen, axis=1), 0.0), 0.0) ** power
            _mark(pieces, t[:-order], t[order:], ratio, over)
    return over


def joined(path: Path, s: Array) -> Array:
    """Points (n, axes) at arc lengths s (n,) without the gaps that a tolerance leaves: no feed closes them."""
    curve, u = path.locate(np.clip(s, 0.0, path.length))
    points: Array = path.evaluate(curve, u, 0)[:, 0]
    if len(path.curves) > 1 and max(path.gaps) > 0.0:
        near = np.unique(np.concatenate([[0], curve]))
        index = np.arange(1, int(near[-1]) + 1)
        starts = path.evaluate(index, path.flat.domains[index, 0], 0)[:, 0]
        ends = path.evaluate(index - 1, path.flat.domains[index - 1, 1], 0)[:, 0]
        gaps = np.concatenate([np.zeros((1, points.shape[1])), np.cumsum(starts - ends, axis=0)])
        points = points - gaps[curve]
    return points


def _chords(
    path: Path, setting: Setting, k: IntArray, s: Array, t: Array, points: Array, pieces: Pieces, over: Array
) -> None:
    """Distance of the curve from each chord, as a share of what is allowed, which goes with q."""
    linear = path.linear
    start, step = points[:-1, :linear], np.diff(points[:, :linear], axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    along = step / np.where(length > 0.0, length, 1.0)

    def away(place: Array, which: IntArray | slice) -> Array:
        at = joined(path, place)[:, :linear] - start[which]
        beside = at - np.sum(at * along[which], axis=1, keepdims=True) * along[which]
        found: Array = np.linalg.norm(beside, axis=1)
        return found

    allowed = float(setting.limits.chord_error or np.inf) / CHORD_MARGIN
    ends = np.zeros((1, len(step)))
    places = [away(s[:-1] + place * np.diff(s), slice(None)) for place in CHORD_PLACES]
    every = np.concatenate([ends, places, ends])
    best = np.clip(np.argmax(every, axis=0), 1, len(CHORD_PLACES))
    below, furthest, above = (np.take_along_axis(every, best[None] + k, axis=0)[0] for k in (-1, 0, 1))
    bend = np.maximum(2.0 * furthest - below - above, 0.0)
    peak = ((above - below) ** 2 > 8.0 * PEAKED * furthest * bend) | (bend > BENT * furthest)
    peaked: IntArray = np.flatnonzero(peak & (furthest > WORTH_A_LOOK * allowed))
    low, high = (s[peaked] + (best[peaked] + k) / (len(CHORD_PLACES) + 1.0) * np.diff(s)[peaked] for k in (-1, 1))
    for _ in range(SECTIONS if len(peaked) else 0):
        one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        nearer = away(one, peaked) >= away(two, peaked)
        low, high = np.where(nearer, low, one), np.where(nearer, two, high)
    furthest[peaked] = np.maximum(furthest[peaked], away(0.5 * (low + high), peaked))
    if len(setting.corner_s):  # a corner in passing is further away than all beside it
        corner = setting.corner_s[np.clip(np.searchsorted(setting.corner_s, s[1:]) - 1, 0, None)]
        furthest = np.maximum(furthest, away(np.clip(corner, s[:-1], s[1:]), slice(None)))
        first = np.minimum(np.searchsorted(setting.corner_s, s[:-1], side="right"), len(setting.corner_s) - 1)
        furthest = np.maximum(furthest, away(np.clip(setting.corner_s[first], s[:-1], s[1:]), slice(None)))
    share = np.where(np.diff(k) == 1, furthest / allowed, 0.0)
    _mark(pieces, t[:-1], t[1:], share, over)


def _mark(pieces: Pieces, begin: Array, end: Array, share: Array, over: Array) -> None:
    """Take the shares of time spans note on all pieces that they touch."""
    low = np.clip(np.searchsorted(pieces.times, begin, side="right") - 1, 0, len(over) - 1)
    high = np.clip(np.searchsorted(pieces.times, end, side="left") - 1, 0, len(over) - 1)
    whole = share > 1.0
    for i, j, value in zip(low[whole], high[whole], share[whole], strict=True):
        over[i : j + 1] = np.maximum(over[i : j + 1], value)
    np.maximum.at(over, low[~whole], share[~whole])


def _times_at(pieces: Pieces, s: Array) -> Array:
    """When the motion is at those of the arc lengths s (k,), mm, that lie inside it, s."""
    starts = pieces.coefficients[:, 0]
    inside = s[(s > starts[0]) & (s < float(pieces.at(pieces.times[-1:])[0]))]
    # most of them begin pieces, but for rounding; within a ramp any place may be one
    found = np.clip(np.searchsorted(starts, inside + 1e-12 * abs(starts[-1]), side="right") - 1, 0, len(starts) - 1)
    low, high = pieces.times[found], pieces.times[found + 1]
    begins = np.abs(starts[found] - inside) <= 1e-12 * abs(starts[-1])
    within = pieces.coefficients[found]
    begin, end = np.zeros(len(inside)), high - low
    for _ in range(BISECTIONS):
        middle = 0.5 * (begin + end)
        behind = polynomial(within, middle, 0) < inside
        begin, end = np.where(behind, middle, begin), np.where(behind, end, middle)
    times: Array = np.where(begins, low, low + end)
    return times


def _straddles(begin: Array, end: Array, corner_times: Array) -> BoolArray:
    """Whether a corner that is passed lies inside a span of time, (n,)."""
    found: BoolArray = np.searchsorted(corner_times, end, side="left") > np.searchsorted(
        corner_times, begin, side="right"
    )
    return found


def _jump_times(path: Path, pieces: Pieces, setting: Setting) -> Array:
    """When direction or curvature may jump without a corner that is passed, s; turns too small for a corner count."""
    if not np.any(np.isfinite([setting.axes.acceleration, setting.axes.jerk])):
        return np.zeros(0)
    low, high = pieces.coefficients[0, 0], float(pieces.at(pieces.times[-1:])[0])
    first, last = np.searchsorted(path.jump_places, low, side="right"), np.searchsorted(path.jump_places, high)
    s = path.jump_places[first:last]
    return _times_at(pieces, s[~np.isin(s, setting.corner_s)])

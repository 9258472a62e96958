"""What a motion really does between the places where it was held to its limits."""

from __future__ import annotations

import numpy as np

from splinefeed.planner.conditions import BESIDE, INSIDE, WITHIN, Conditions
from splinefeed.planner.constants import ALMOST, KEPT, SAME, TOGETHER
from splinefeed.planner.law import MotionPieces
from splinefeed.planner.rows import TINY, Rows
from splinefeed.records import Array, IntArray

#: Shares of each piece's time at which it is looked at, dense at both ends; then where that leaves a peak open.
LOOKED = tuple(0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count))) for count in (9, 33, 129))
#: What a limit may do between the first places beyond their parabolas, in second differences over their number.
DOUBT = 3.5
#: Newton's steps to when a motion is at a break: the feed changes little over a piece.
STEPS = 4


def worst_shares(
    conditions: Conditions, pieces: MotionPieces, end: float, before: tuple[MotionPieces, Array, Array] | None = None
) -> tuple[Array, Array]:
    """Find the largest shares of limits in each piece of a motion.

    Parameters
    ----------
    conditions : Conditions
        What the motion must keep.
    pieces : MotionPieces
        The motion, m pieces.
    end : float
        Where it ends, mm.
    before : tuple, optional
        As many pieces, and the two results of these: a piece that is the same has still the same.

    Returns
    -------
    worst : (3, m) array
        Of tops, linear limits and jerk, as factors on q.
    below : (m,) array
        What the largest is surely below.

    Notes
    -----
    A peak between places is that of a parabola through three of them or a quartic through five. A piece that may be
    over the worst between its places is looked at more closely, and so are the first and the last; then once more
    where parabola and quartic differ by more than KEPT.
    """
    worst, bound = np.empty((3, len(pieces))), np.zeros(len(pieces))
    some = np.arange(len(pieces))
    if before is not None:
        old, worst[:], bound[:] = before
        some = np.flatnonzero(np.any(pieces.coefficients != old.coefficients, axis=1) | (pieces.spans != old.spans))
    if not len(some):
        return worst, bound
    worst[:, some], bound[some] = _looked_at(conditions, pieces, end, 0, some)
    bound[np.intersect1d(some, [0, len(pieces) - 1])] = np.inf
    level = np.zeros(len(pieces), dtype=int)
    # What looks worst from afar may turn out lower: then those that it hid are looked at, too.
    while len(near := np.flatnonzero(~(bound <= max(1.0, float(np.max(worst)))))):
        level[near] += 1
        for k in range(1, len(LOOKED)):
            some = near[level[near] == k]
            worst[:, some], bound[some] = _looked_at(conditions, pieces, end, k, some)
    return worst, bound


def _looked_at(
    conditions: Conditions, pieces: MotionPieces, end: float, level: int, some: IntArray
) -> tuple[Array, Array]:
    """Shares (3, m) of some pieces (m,) by places of a level, and for each what the largest is below, (m,)."""
    begin = pieces.coefficients[:, 0]
    low, high = begin[some], np.append(begin[1:], end)[some]
    chosen = MotionPieces(pieces.spans[some], pieces.coefficients[some])
    worst, bound, looked = np.zeros((3, len(some))), np.zeros(len(some)), LOOKED[level]
    if not len(some):
        return worst, bound
    size = max(TOGETHER // len(looked), 1)
    for first in range(0, len(some), size):
        block = slice(first, first + size)
        inside = INSIDE * (high[block] - low[block])
        s, v, a, j = chosen.part(first, first + size).at(looked[:, None])
        if not np.all(np.isfinite(s)):
            worst[:, block] = bound[block] = np.inf
            continue
        s = np.clip(s, low[block] + inside, high[block] - inside)
        found, signs, rows = _shares(conditions, s, v, a, j)
        peaks, unsure = _peaks(found, signs, len(rows.linear) + rows.jerks)
        if level == 0:
            with np.errstate(invalid="ignore"):
                bends = np.abs(np.diff(found, 2, axis=1)).max(axis=1)
            unsure = DOUBT / len(looked) * np.where(np.isfinite(bends), bends, np.inf)
        elif level == len(LOOKED) - 1:
            unsure = np.zeros_like(peaks)
        worst[:, block] = rows.by_kind(peaks)
        bound[block] = np.max(peaks + unsure, axis=0)
    owner, beside = _beside_breaks(conditions, chosen, low, high)
    for kind, shares in zip((*worst, bound), (*beside, np.max(beside, axis=0)), strict=True):
        np.maximum.at(kind, owner, shares)
    return worst, bound


def _shares(conditions: Conditions, s: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Rows]:
    """Shares (rows, places, n) of each row at places (places, n) of n pieces, signs of the tip's acceleration, rows."""
    way = v * (conditions.period or 0.0) * WITHIN  # what a piece comes within reach of counts for all of it
    reach = np.min(s - way, axis=0), np.max(s + way, axis=0)
    low, high = (np.broadcast_to(each, s.shape).ravel() for each in reach)
    flat = s.ravel()
    seen = conditions.along(flat)
    signs = _rising(seen[1], a, v) if conditions.two_jerks else np.zeros(len(flat))
    rows = conditions.rows(flat, seen, reach=(low, high), rising=signs, alone=True)
    found = rows.shares(v.ravel(), a.ravel(), j.ravel())
    good = (v >= -SAME * np.max(v)).ravel() & np.isfinite(found)
    return np.where(good, found, np.inf).reshape(len(found), *s.shape), signs.reshape(s.shape), rows


def _beside_breaks(conditions: Conditions, pieces: MotionPieces, low: Array, high: Array) -> tuple[IntArray, Array]:
    """In which pieces, from `low` to `high` (m,), mm, breaks of the path lie, (k,), and the shares (3, k) beside them.

    No place of a piece may lie in a curve of micrometres that ends where the piece does.
    """
    b = conditions.inside(float(low[0]), float(high[-1]))
    away = BESIDE * conditions.track.length
    owner = np.searchsorted(low, b, side="right") - 1
    within = (b - low[owner] > 2.0 * away) & (high[owner] - b > 2.0 * away)
    b, owner = b[within], owner[within]
    if not len(b):
        return owner, np.zeros((3, 0))
    own, share = MotionPieces(pieces.spans[owner], pieces.coefficients[owner]), (b - low[owner]) / (high - low)[owner]
    for _ in range(STEPS):
        s, *rates = own.at(share)
        share = np.clip(share - (s - b) / np.maximum(rates[0] * own.spans, TINY), 0.0, 1.0)
    found, _, rows = _shares(conditions, np.stack([b - away, b + away]), *(np.stack([each, each]) for each in rates))
    return owner, rows.by_kind(np.max(found, axis=1))


def _rising(x: Array, a: Array, v: Array) -> Array:
    """The sign (k n,) of the tip's acceleration x' a + x'' v^2 at places (k, n), 0 beside where it changes."""
    tip = x[0, -1].reshape(v.shape) * a + x[1, -1].reshape(v.shape) * v * v
    still = np.abs(tip) <= ALMOST * np.max(np.abs(tip), axis=0)  # it has the sign of what is around it
    sign = np.sign(np.where(still, np.sum(tip, axis=0), tip))
    turns = sign[1:] != sign[:-1]
    either = np.pad(turns, ((1, 0), (0, 0))) | np.pad(turns, ((0, 1), (0, 0)))
    return np.where(either, 0.0, sign).ravel()


def _peaks(found: Array, signs: Array, tip: int) -> tuple[Array, Array]:
    """The largest of shares (k, places, n), (k, n), also between places, and how far that is unsure: 0 below KEPT.

    There it is the peak of a parabola through three, or of the quartic through five where that is higher; what is
    unsure is by how much they differ.
    signs (places, n) of the tip's acceleration: where they differ its limit of jerk does, and no parabola goes through
    shares of that, row `tip`.
    """
    below, here, above = found[:, :-2], found[:, 1:-1], found[:, 2:]
    peaks, unsure = found.max(axis=1), np.zeros((len(found), found.shape[2]))
    with np.errstate(all="ignore"):
        bends = 2.0 * here - below - above
        peak = (here >= below) & (here >= above) & (bends > 0.0) & np.isfinite(bends)
        peak[tip] &= (signs[:-2] == signs[1:-1]) & (signs[2:] == signs[1:-1])
        row, place, piece = np.nonzero(peak)
        bend, near = bends[peak], (above - below)[peak]
        x = 0.5 * near / bend
        rise = 0.25 * x * near
        last = found.shape[1] - 1
        far, further = found[row, np.maximum(place - 1, 0), piece], found[row, np.minimum(place + 3, last), piece]
        third = (further - far - 2.0 * near) / 12.0
        fourth = (further + far - 4.0 * (above + below)[peak] + 6.0 * here[peak]) / 24.0
        slope = 0.5 * near - bend * x + (3.0 * x * x - 1.0) * third + (4.0 * x * x - 2.0) * x * fourth
        steep = bend - 6.0 * x * third - (12.0 * x * x - 2.0) * fourth
        x = np.clip(np.where(steep > 0.0, x + slope / steep, x), -1.0, 1.0)  # a step of Newton's
        more = x * (0.5 * near - 0.5 * bend * x + (x * x - 1.0) * (third + x * fourth)) - rise
        more = np.where((place > 0) & (place + 3 <= last) & np.isfinite(more), more, 0.0)
        at = row * found.shape[2] + piece
        np.maximum.at(peaks.reshape(-1), at, here[peak] + rise + np.maximum(more, 0.0))
        np.maximum.at(unsure.reshape(-1), at, np.where(np.abs(more) > KEPT, np.abs(more), 0.0))
    return peaks, unsure

"""What a motion really does between the places where it was held to its limits."""

from __future__ import annotations

import numpy as np

from splinefeed.feed.law import Pieces
from splinefeed.feed.numbers import ALMOST, SAME, TOGETHER
from splinefeed.feed.setting import INSIDE, Setting
from splinefeed.records import Array, IntArray

#: Shares of each piece's time at which it is looked at, dense at both ends; and where it may be over what was seen.
LOOKED, *CLOSER = (0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count))) for count in (7, 17, 65))
#: What a limit may do between places beyond their parabolas, in second differences over the number of places: at 7
#: places four times what a parabola rises between them, at 17 not twice as much.
DOUBT = 3.5


def worst_shares(setting: Setting, pieces: Pieces, end: float) -> Array:
    """Largest shares in each piece of tops, linear limits and jerk, (3, m), as factors on q; it ends at `end`, mm.

    A peak between places follows from a parabola through three of them. A piece whose share might be above 1 and above
    that of all others between its places is looked at more closely. The first piece, the last one, and those at a break
    beside which the path turns within less than the piece are looked at as closely as can be, whatever was seen.
    """
    worst, bound = _looked_at(setting, pieces, end, LOOKED)
    edges = np.append(pieces.coefficients[:, 0], end)
    first, last = np.searchsorted(setting.breaks, edges[[0, -1]])
    b = setting.breaks[first:last]
    beside = np.stack([np.searchsorted(edges[:-1], b), np.searchsorted(edges[:-1], b, side="right")]) - 1
    closest = np.zeros(len(pieces), dtype=bool)
    closest[beside[setting.turns_within[:, first:last] < np.diff(edges)[beside]]] = closest[[0, -1]] = True
    bound[closest] = np.inf
    for looked in CLOSER:
        done = closest.copy() if looked is not CLOSER[-1] else np.zeros_like(closest)
        while len(doubtful := np.flatnonzero(~done & ~(bound <= max(1.0, float(np.max(worst)))))):
            worst[:, doubtful], bound[doubtful] = _looked_at(setting, pieces, end, looked, doubtful)
            done[doubtful] = True
    return worst


def _looked_at(
    setting: Setting, pieces: Pieces, end: float, looked: Array, some: IntArray | None = None
) -> tuple[Array, Array]:
    """Shares (3, m) of all pieces or of some (m,), and for each what the largest is below, (m,)."""
    begin = pieces.coefficients[:, 0]
    low, high = begin, np.append(begin[1:], end)
    if some is not None:
        low, high, pieces = low[some], high[some], Pieces(pieces.spans[some], pieces.coefficients[some])
    worst, bound = np.zeros((3, len(pieces))), np.zeros(len(pieces))
    size = max(TOGETHER // len(looked), 1)
    for first in range(0, len(pieces), size):
        block = slice(first, first + size)
        inside = INSIDE * (high[block] - low[block])
        s, v, a, j = (each.T for each in pieces.part(first, first + size).at(looked[:, None]))
        if not np.all(np.isfinite(s)):
            worst[:, block] = bound[block] = np.inf
            continue
        s = np.clip(s, (low[block] + inside)[:, None], (high[block] - inside)[:, None])
        places = setting.places(s.ravel(), feed=v.ravel(), rising=_rising(a).ravel(), alone=True)
        for jump in (places.turn, places.bend):  # what a piece comes within reach of counts for all of it
            by_piece = jump.reshape(*jump.shape[:2], *s.shape)
            by_piece[:] = np.max(by_piece, axis=3, keepdims=True)
        rows = setting.rows(places)
        found = rows.shares(v.ravel(), a.ravel(), j.ravel())
        found = np.where((v >= -SAME * np.max(v)).ravel() & np.isfinite(found), found, np.inf)
        found = np.ascontiguousarray(np.moveaxis(found.reshape(-1, *s.shape), 2, 0))
        peaks, bends = _peaks(found)
        worst[:, block] = rows.by_kind(peaks)
        backwards = np.sum(_peaks(-v.T[:, None]), axis=0)[0] >= 0.0  # between places the feed may be below 0
        bound[block] = np.where(backwards, np.inf, np.max(peaks + bends, axis=0))
    return worst, bound


def _rising(a: Array) -> Array:
    """The sign of accelerations (n, k) at places of pieces, 0 beside where it changes."""
    still = np.abs(a) <= ALMOST * np.max(np.abs(a), axis=1, keepdims=True)  # it has the sign of what is around it
    sign = np.sign(np.where(still, np.sum(a, axis=1, keepdims=True), a))
    turns = sign[:, 1:] != sign[:, :-1]
    either = np.pad(turns, ((0, 0), (1, 0))) | np.pad(turns, ((0, 0), (0, 1)))
    return np.where(either, 0.0, sign)


def _peaks(shares: Array) -> tuple[Array, Array]:
    """The largest of shares (places, limits, n), (limits, n), with what parabolas tell between places; how they bend.

    A parabola rises between places by an eighth of its second difference at most.
    """
    below, here, above = shares[:-2], shares[1:-1], shares[2:]
    with np.errstate(invalid="ignore"):
        bend = 2.0 * here - below - above
        peak = (here >= below) & (here >= above) & (bend > 0.0) & (bend < np.inf)
        rise = np.where(peak, (above - below) ** 2 / np.where(peak, 8.0 * bend, 1.0), 0.0)
    found: Array = np.maximum(np.max(shares, axis=0), np.max(here + rise, axis=0))
    return found, DOUBT / len(shares) * np.max(np.abs(bend), axis=0)

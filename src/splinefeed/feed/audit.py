"""What a motion really does between the places where it was held to its limits."""

from __future__ import annotations

import numpy as np

from splinefeed.feed.law import Pieces
from splinefeed.feed.setting import INSIDE, Setting
from splinefeed.records import Array, BoolArray, IntArray

#: Shares of each piece's time at which it is looked at: nine places, dense at both ends.
LOOKED = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 9)))
#: ... and where a share of a limit changes by more than STEEP from one of them to the next.
CLOSELY, STEEP = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 33))), 0.25
#: Feed below 0 by more than this share of the top feed is motion that goes back.
BACK = 1e-12
#: An acceleration below this share of the largest one of its piece is none.
STILL = 1e-9
#: How much larger the rise of a peak between places is taken than a parabola says.
MARGIN = 2.0
#: Places that are looked at together, so that memory stays small.
TOGETHER = 32768


def worst_shares(setting: Setting, pieces: Pieces, end: float) -> Array:
    """Largest shares in each piece of tops, linear limits and jerk, (3, m), as factors on q; it ends at `end`, mm.

    A peak between places follows from a parabola through three of them; where they differ much, by more places.
    """
    begin = pieces.coefficients[:, 0]
    close = np.append(begin[1:], end)
    worst = np.zeros((3, len(pieces)))
    all_pieces = np.arange(len(pieces))
    size = max(TOGETHER // len(LOOKED), 1)
    for first in range(0, len(pieces), size):
        some = all_pieces[first : first + size]
        worst[:, some], steep = _look(setting, pieces, some, begin, close, LOOKED)
        if np.any(steep):
            worst[:, some[steep]] = _look(setting, pieces, some[steep], begin, close, CLOSELY)[0]
    return worst


def _look(
    setting: Setting, pieces: Pieces, some: IntArray, begin: Array, close: Array, looked: Array
) -> tuple[Array, BoolArray]:
    """Largest shares in some pieces (n,), (3, n), and where they change much from one place to the next, (n,)."""
    low, high = begin[some], close[some]
    inside = INSIDE * (high - low)
    spans = pieces.spans[some]
    s, v, a, j = (each.T for each in Pieces(spans, pieces.coefficients[some]).at(looked[:, None]))
    if not np.all(np.isfinite(s)):
        return np.full((3, len(some)), np.inf), np.zeros(len(some), dtype=bool)
    s = np.clip(s, (low + inside)[:, None], (high - inside)[:, None])
    rising = _rising(a, j, spans[:, None] * np.diff(looked))
    places = setting.places(s.ravel(), feed=v.ravel(), rising=rising.ravel(), alone=True)
    for jump in (places.turn, places.bend):  # what a piece comes within reach of counts for all of it
        by_piece = jump.reshape(*jump.shape[:2], *s.shape)
        by_piece[:] = np.max(by_piece, axis=3, keepdims=True)
    rows = setting.rows(places)
    found = rows.shares(v.ravel(), a.ravel(), j.ravel())
    found = np.where((v >= -BACK * np.max(v)).ravel() & np.isfinite(found), found, np.inf)
    found = np.moveaxis(found.reshape(-1, *s.shape), 2, 0)
    with np.errstate(invalid="ignore"):
        steep = np.max(np.abs(np.diff(found, axis=0)), axis=(0, 1)) > STEEP
    return rows.by_kind(_peaks(found)), steep


def _rising(a: Array, j: Array, steps: Array) -> Array:
    """The sign of the acceleration at places (n, k) of pieces, 0 where it may change on the way to the next one.

    a, j  acceleration and jerk at the places, steps (n, k - 1) times between them. Where tangents at two of them meet
    on the other side of 0 the acceleration may go there in between.
    """
    still = np.abs(a) <= STILL * np.max(np.abs(a), axis=1, keepdims=True)  # it has the sign of what is around it
    sign = np.sign(np.where(still, np.sum(a, axis=1, keepdims=True), a))
    a = np.where(still, 0.0, a)
    bend = j[:, 1:] - j[:, :-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = (a[:, :-1] - a[:, 1:] + j[:, 1:] * steps) / bend
        met = (a[:, :-1] + j[:, :-1] * at) * sign[:, :-1]
    turns = (sign[:, 1:] != sign[:, :-1]) | ((at > 0.0) & (at < steps) & (met < 0.0))
    either = np.zeros(a.shape, dtype=bool)
    either[:, 1:] |= turns
    either[:, :-1] |= turns
    return np.where(either, 0.0, sign)


def _peaks(shares: Array) -> Array:
    """The largest of shares (places, limits, n), (limits, n), and of what parabolas tell between places."""
    below, here, above = shares[:-2], shares[1:-1], shares[2:]
    with np.errstate(invalid="ignore"):
        bend = 2.0 * here - below - above
        peak = (here >= below) & (here >= above) & (bend > 0.0) & (bend < np.inf)
        rise = np.where(peak, (above - below) ** 2 / np.where(peak, 8.0 * bend, 1.0), 0.0)
    found: Array = np.maximum(np.max(shares, axis=0), np.max(here + MARGIN * rise, axis=0))
    return found

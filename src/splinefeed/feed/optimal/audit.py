"""What a motion really does between the places where it was held to its limits."""

from __future__ import annotations

import numpy as np

from splinefeed.feed.optimal.law import Pieces
from splinefeed.feed.optimal.setting import INSIDE, Setting
from splinefeed.records import Array

#: Shares of each piece's time at which it is looked at: while it is planned.
LOOKED = (0.0, 0.2, 0.5, 0.8, 1.0)
#: Feed below 0 by more than this share of the top feed is motion that goes back.
BACK = 1e-12
#: How much larger the rise of a peak between places is taken than a parabola says.
MARGIN = 2.0
#: Places that are looked at together, so that memory stays small.
TOGETHER = 32768


def chebyshev(count: int) -> tuple[float, ...]:
    """So many shares from 0 to 1, dense at both ends."""
    return tuple(0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count))))


def worst_shares(setting: Setting, pieces: Pieces, end: float, looked: tuple[float, ...] = LOOKED) -> Array:
    """Largest share of any limit in each piece, as a factor on q = feed^2, (m,); `end`: where the last one ends, mm.

    A peak between places is told by a parabola through three of them.
    """
    begin = pieces.coefficients[:, 0]
    close = np.append(begin[1:], end)
    worst = np.zeros(len(pieces))
    size = max(TOGETHER // len(looked), 1)
    for first in range(0, len(pieces), size):
        block = slice(first, first + size)
        low, high = begin[block], close[block]
        inside = INSIDE * (high - low)
        s, v, a, j = (each.T for each in pieces.part(first, first + size).at(np.array(looked)[:, None]))
        if not np.all(np.isfinite(s)):
            worst[block] = np.inf
            continue
        s = np.clip(s, (low + inside)[:, None], (high - inside)[:, None])
        places = setting.places(s.ravel(), feed=v.ravel(), rising=np.sign(a).ravel())
        for jump in (places.turn, places.bend):  # what a piece comes within reach of counts for all of it
            by_piece = jump.reshape(*jump.shape[:2], *s.shape)
            by_piece[:] = np.max(by_piece, axis=3, keepdims=True)
        found = setting.rows(places).shares(v.ravel(), a.ravel(), j.ravel())
        found = np.where((v >= -BACK * np.max(v)).ravel() & np.isfinite(found), found, np.inf)
        worst[block] = _peaks(np.moveaxis(found.reshape(-1, *s.shape), 2, 0))
    return worst


def _peaks(shares: Array) -> Array:
    """The largest of shares (places, limits, n), (n,), and of what parabolas tell between places."""
    below, here, above = shares[:-2], shares[1:-1], shares[2:]
    with np.errstate(invalid="ignore"):
        bend = 2.0 * here - below - above
        peak = (here >= below) & (here >= above) & (bend > 0.0) & (bend < np.inf)
        rise = np.where(peak, (above - below) ** 2 / np.where(peak, 8.0 * bend, 1.0), 0.0)
    found: Array = np.maximum(np.max(shares, axis=(0, 1)), np.max(here + MARGIN * rise, axis=(0, 1)))
    return found

"""Motion with a moving end, made to last whole periods: slower in between, with the same states at its ends."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.feed.law import GAUSS, WEIGHTS, Pieces, quintics
from splinefeed.feed.numbers import HALVINGS
from splinefeed.records import LAW_COEFFICIENTS, Array

#: No piece may be longer than this share of the stretch, so that quintics follow how it slows down.
LONGEST_PIECE = 1.0 / 64.0
#: q is lowered by this share at most.
MOST = 0.5


def in_periods(pieces: Pieces, high: float, moving: tuple[bool, bool], period: float) -> Pieces | None:
    """The motion up to `high`, mm, made to last whole periods, s; None if it would have to slow down too much.

    q becomes q (1 - share b(s)), where b rises from 0 at an end that is moving to 1, with two derivatives of 0 at both.
    """
    pieces = _cut(pieces, high)
    low = float(pieces.coefficients[0, 0])
    length = high - low
    b = np.array([_rise((pieces.at(share)[0] - low) / length, moving)[0] for share in GAUSS])
    target = max(math.ceil(pieces.duration / period * (1.0 - 1e-12) - 1e-9), 1) * period

    def spans(share: float) -> Array:
        found: Array = pieces.spans * (WEIGHTS @ (1.0 / np.sqrt(1.0 - share * b)))
        return found

    if float(np.sum(spans(MOST))) < target:
        return None
    share, step = 0.0, MOST
    for _ in range(HALVINGS):
        step *= 0.5
        if float(np.sum(spans(share + step))) <= target:
            share += step
    _, v, a, _ = pieces.at(0.0)
    end = pieces.part(len(pieces) - 1, len(pieces)).at(1.0)
    v, a = np.append(v, end[1]), np.append(a, end[2])
    nodes = np.append(pieces.coefficients[:, 0], high)
    rise, slope = _rise((nodes - low) / length, moving)
    left = 1.0 - share * rise
    lasting = spans(share)
    feeds, pushes = v * np.sqrt(left), a * left - 0.5 * v * v * share * slope / length
    return Pieces(lasting, quintics(nodes, feeds, pushes, lasting))


def _cut(pieces: Pieces, high: float) -> Pieces:
    """The same motion, long pieces cut into even parts of their time."""
    length = np.diff(np.append(pieces.coefficients[:, 0], high))
    longest = LONGEST_PIECE * (high - pieces.coefficients[0, 0])
    counts = np.maximum(np.ceil(length / longest), 1.0).astype(int)
    owner = np.repeat(np.arange(len(pieces)), counts)
    index = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    spans = pieces.spans[owner] / counts[owner]
    coefficients = np.zeros((len(owner), LAW_COEFFICIENTS))
    begin = index * spans
    for order in range(LAW_COEFFICIENTS):
        for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
            coefficients[:, order] = coefficients[:, order] * begin + pieces.coefficients[owner, k] * math.comb(
                k, order
            )
    return Pieces(spans, coefficients)


def _rise(x: Array, moving: tuple[bool, bool]) -> tuple[Array, Array]:
    """b and db/dx at shares x of the length: 0 at a moving end, 1 between two of them, or at the end that rests."""
    both = all(moving)
    scale = 2.0 if both else 1.0
    x = np.clip(x, 0.0, 1.0)
    y = scale * np.minimum(x, 1.0 - x) if both else (x if moving[0] else 1.0 - x)
    sign = np.where(x <= 0.5, 1.0, -1.0) if both else (1.0 if moving[0] else -1.0)
    return y**3 * (10.0 - 15.0 * y + 6.0 * y * y), sign * scale * 30.0 * y * y * (1.0 - y) ** 2

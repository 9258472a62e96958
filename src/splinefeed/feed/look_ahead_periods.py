"""Look-ahead motion with an end that moves: slowed down between its ends until it lasts whole periods."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.feed.look_ahead_window import Part
from splinefeed.kernels.look_ahead_law import join
from splinefeed.records import LAW_COEFFICIENTS, Array

#: No piece may be longer than this share of the stretch, so that quintics follow how it slows down.
LONGEST_PIECE = 1.0 / 64.0
#: q is lowered by this share at most.
MOST = 0.5
BISECTIONS = 100
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def in_periods(part: Part, high: float, moving: tuple[bool, bool], period: float) -> Part | None:
    """The motion up to `high`, mm, made to last whole periods, s; None if it would have to slow down too much.

    q becomes q (1 - share b(s)), where b rises from 0 at an end that is `moving` to 1, with two derivatives of 0 at
    both. Feed and acceleration at such an end stay what they are.
    """
    part = _cut(part, high)
    low, length = float(part.starts[0]), high - float(part.starts[0])
    ends = np.append(part.starts[1:], high)
    inner = 0.5 * (_NODES + 1.0)
    t = part.spans[:, None] * inner
    bump = _bump(np.clip((_at(part.coefficients, t) + part.starts[:, None] - low) / length, 0.0, 1.0), moving)[0]
    weights = 0.5 * _WEIGHTS * part.spans[:, None]

    def spans(share: float) -> Array:
        found: Array = np.sum(weights / np.sqrt(1.0 - share * bump), axis=1)
        return found

    duration = float(np.sum(part.spans))
    target = max(math.ceil(duration / period * (1.0 - 1e-12) - 1e-9), 1) * period
    if float(np.sum(spans(MOST))) < target:
        return None
    share, step = 0.0, MOST
    for _ in range(BISECTIONS):
        step *= 0.5
        if float(np.sum(spans(share + step))) <= target:
            share += step
    lasting = spans(share)
    nodes = np.append(part.starts, high)
    b, slope = _bump((nodes - low) / length, moving)
    left = 1.0 - share * b
    bend = -share * slope / length
    feed = np.append(part.coefficients[:, 1], _at(part.coefficients[-1:], part.spans[-1:, None], 1)[0])
    push = np.append(2.0 * part.coefficients[:, 2], _at(part.coefficients[-1:], part.spans[-1:, None], 2)[0])
    after = feed * np.sqrt(left), push * left + 0.5 * feed * feed * bend
    coefficients = np.zeros((len(part), LAW_COEFFICIENTS))
    for i in range(len(part)):
        h = float(ends[i] - part.starts[i])
        join(h, lasting[i], after[0][i], after[1][i], after[0][i + 1], after[1][i + 1], coefficients[i])
    return Part(part.starts, lasting, coefficients)


def _cut(part: Part, high: float) -> Part:
    """The same pieces, the long ones cut into even parts of their time."""
    length = np.diff(np.append(part.starts, high))
    counts = np.maximum(np.ceil(length / (LONGEST_PIECE * (high - part.starts[0]))), 1.0).astype(int)
    owner = np.repeat(np.arange(len(part)), counts)
    index = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    spans = part.spans[owner] / counts[owner]
    begin = (index * spans)[:, None]
    coefficients = np.zeros((len(owner), LAW_COEFFICIENTS))
    for k in range(1, LAW_COEFFICIENTS):
        coefficients[:, k] = _at(part.coefficients[owner], begin, k)[:, 0] / math.factorial(k)
    starts = part.starts[owner] + _at(part.coefficients[owner], begin)[:, 0]
    return Part(starts, spans, coefficients)


def _at(coefficients: Array, t: Array, order: int = 0) -> Array:
    """The order-th derivative of pieces (m, 6) at instants t (m, k) of theirs, without the start of s."""
    value = np.zeros_like(t)
    for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
        value = value * t + (coefficients[:, k, None] * math.perm(k, order) if k > 0 else 0.0)
    return value


def _bump(x: Array, moving: tuple[bool, bool]) -> tuple[Array, Array]:
    """b and db/dx at shares x of the length: 0 at a moving end, 1 in the middle of two, or at the end that rests."""
    both = all(moving)
    scale = 2.0 if both else 1.0
    y = scale * np.minimum(x, 1.0 - x) if both else (x if moving[0] else 1.0 - x)
    sign = np.where(x < 0.5, scale, -scale) if both else (1.0 if moving[0] else -1.0)
    value: Array = y**3 * (10.0 - 15.0 * y + 6.0 * y * y)
    slope: Array = sign * 30.0 * (y * (1.0 - y)) ** 2
    return value, slope

"""A time law at one instant: polynomial pieces in t, read in order of time."""

from __future__ import annotations

from splinefeed.kernels.jit import hot_kernel, kernel
from splinefeed.records import Array


@hot_kernel
def law_at(breaks: Array, coefficients: Array, piece: int, time: float) -> tuple[int, float, float, float]:
    """Piece, s, feed and acceleration at `time`, s; the piece is found by walking on from `piece`.

    s = sum_k c_k tau^k,  tau = time - breaks[piece], coefficients (m, 6) in mm/s^k. Beyond the ends the end holds.
    """
    last = coefficients.shape[0] - 1
    while piece < last and time >= breaks[piece + 1]:
        piece += 1
    while piece > 0 and time < breaks[piece]:
        piece -= 1
    tau = min(max(time, breaks[0]), breaks[last + 1]) - breaks[piece]
    s = coefficients[piece, 5]
    feed = 0.0
    acceleration = 0.0
    for k in range(4, -1, -1):
        acceleration = acceleration * tau + feed
        feed = feed * tau + s
        s = s * tau + coefficients[piece, k]
    return piece, s, feed, 2.0 * acceleration


@kernel
def law_in_piece(coefficients: Array, piece: int, tau: float) -> tuple[float, float, float, float]:
    """s, mm, and its three derivatives, mm/s^k, at tau, s, behind the start of one piece: Horner on c_0 ... c_5."""
    s = coefficients[piece, 5]
    v = 0.0
    a = 0.0
    j = 0.0
    for k in range(4, -1, -1):
        j = j * tau + a
        a = a * tau + v
        v = v * tau + s
        s = s * tau + coefficients[piece, k]
    return s, v, 2.0 * a, 6.0 * j

"""What a law asks of the axes in each of its ticks, run as planned: the largest |q'|, |q''| and |q'''| of every axis.

docs/math/override.md says what becomes of them at another rate.
"""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import parameter_in_row
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.law import law_in_piece
from splinefeed.kernels.pieces import DEGREES, START, Shape, derivatives, find_row, measured
from splinefeed.records import Array

#: Instants looked at in every part of a tick that lies in one piece of the law, its ends included.
INSTANTS = 5
#: Arc length is rounded by so much of what it can be: what is so near to a row of the path has reached it.
ROUNDINGS = 1e-14
#: Halvings that find when the law reaches a row of the path.
BISECTIONS = 52


@kernel
def _motion(
    table: Array, row: int, shape: Shape, t: float, v: float, a: float, j: float, work: Array, out: Array
) -> bool:
    """q', q'' and q''' of every axis, and of the arc length behind them, into out (3, axes + 1); False where C' = 0."""
    derivatives(table, row, shape, t, 3, work)
    begin, end = measured(table, row, shape)
    unit = DEGREES if begin > 0 else 1.0
    square = 0.0
    m = 0.0
    n = 0.0
    for k in range(begin, end):
        c1 = unit * work[1, k]
        c2 = unit * work[2, k]
        square += c1 * c1
        m += c1 * c2
        n += c2 * c2 + c1 * unit * work[3, k]
    if not square > 0.0:
        return False
    size = math.sqrt(square)
    u1 = 1.0 / size
    u2 = -m / (square * square)
    u3 = 4.0 * m * m / (square * square * square * size) - n / (square * square * size)
    axes = shape[1]
    for k in range(axes):
        r1 = work[1, k] * u1
        r2 = work[2, k] * u1 * u1 + work[1, k] * u2
        r3 = work[3, k] * u1 * u1 * u1 + 3.0 * work[2, k] * u1 * u2 + work[1, k] * u3
        out[0, k] = r1 * v
        out[1, k] = r2 * v * v + r1 * a
        out[2, k] = r3 * v * v * v + 3.0 * r2 * v * a + r1 * j
    out[0, axes] = v
    out[1, axes] = a
    out[2, axes] = j
    return math.isfinite(u3)


@kernel
def _time_at(coefficients: Array, piece: int, begin: float, s: float, low: float, high: float) -> float:
    """When, between low and high, a piece that begins at `begin` is at arc length s, by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if law_in_piece(coefficients, piece, middle - begin)[0] < s:
            low = middle
        else:
            high = middle
    return high


@kernel
def ask(
    breaks: Array,
    coefficients: Array,
    table: Array,
    shape: Shape,
    period: float,
    first: int,
    out: Array,
    jumps: Array,
) -> None:
    """Largest |q'|, |q''|, |q'''| of every axis, and of the arc length, in ticks first ... of a law.

    out (n, 3, axes + 1), for plan times (first + i) T to (first + i + 1) T; 0 beyond both ends of the law.
    jumps (n, axes + 1)  by how much q'' jumps there, all jumps together.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    last_piece = coefficients.shape[0] - 1
    end = breaks[last_piece + 1]
    rounding = ROUNDINGS * (table[last_row, START] + coefficients[last_piece, 0])
    work = np.empty((4, axes))
    here = np.zeros((3, axes + 1))
    before = np.zeros((3, axes + 1))
    seen = False  # whether `before` holds the motion at the instant before
    smooth = False  # whether nothing can jump there
    t = 0.0
    out[:] = 0.0
    jumps[:] = 0.0
    start = max(first, 0) * period
    piece = 0
    while piece < last_piece and start >= breaks[piece + 1]:
        piece += 1
    row = find_row(
        table, 0, last_row, START, law_in_piece(coefficients, piece, max(start - breaks[piece], 0.0))[0] + rounding
    )
    for i in range(max(-first, 0), out.shape[0]):
        low = (first + i) * period
        if low >= end:
            break
        tick_end = min((first + i + 1) * period, end)
        # parts of the tick that lie in one piece of the law and one row of the path: there everything is smooth
        for _ in range(table.shape[0] + coefficients.shape[0]):
            high = min(tick_end, breaks[piece + 1])
            begin = breaks[piece]
            while (
                row < last_row and law_in_piece(coefficients, piece, low - begin)[0] >= table[row + 1, START] - rounding
            ):
                row += 1
                smooth = False
            cut = (
                row < last_row and law_in_piece(coefficients, piece, high - begin)[0] > table[row + 1, START] + rounding
            )
            if cut:
                high = _time_at(coefficients, piece, begin, table[row + 1, START], low, high)
            if smooth and seen:
                np.maximum(out[i], np.abs(before), out[i])
            for k in range(1 if smooth and seen else 0, INSTANTS):
                s, v, a, j = law_in_piece(coefficients, piece, low + (high - low) * (k / (INSTANTS - 1)) - begin)
                t = parameter_in_row(table, row, s, t)
                if not _motion(table, row, shape, t, v, a, j, work, here):
                    seen = False
                    continue
                for q in range(axes + 1):
                    for order in range(3):
                        out[i, order, q] = max(out[i, order, q], abs(here[order, q]))
                    if k == 0 and seen:
                        jumps[i, q] += abs(here[1, q] - before[1, q])
                seen = True
                before[:] = here
            low = high
            ends = high >= breaks[piece + 1] and piece < last_piece
            smooth = not cut and not ends
            if cut:
                row += 1
            elif ends:
                piece += 1
            if not cut and high >= tick_end:
                break

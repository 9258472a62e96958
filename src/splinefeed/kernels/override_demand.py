"""What a law asks of the axes from time to time, run as planned: the largest |q'|, |q''|, q''' and -q'''.

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
def _keep(found: Array, out: Array) -> None:
    """The larger of what is in `out` (4, columns) and |q'|, |q''|, q''' and -q''' of `found` (3, columns)."""
    for k in range(out.shape[1]):
        out[0, k] = max(out[0, k], abs(found[0, k]))
        out[1, k] = max(out[1, k], abs(found[1, k]))
        out[2, k] = max(out[2, k], found[2, k])
        out[3, k] = max(out[3, k], -found[2, k])


@kernel
def ask(
    breaks: Array,
    coefficients: Array,
    table: Array,
    shape: Shape,
    low: Array,
    high: Array,
    out: Array,
    at: Array,
    jumps: Array,
) -> int:
    """Largest |q'|, |q''|, q''' and -q''' of every axis, and of the arc length, from times low to high (n,), s.

    low, high increase; out (n, 4, axes + 1): 0, and minus infinity for q''', where nothing is between them.
    at (k,), jumps (k, axes + 1)  when q'' can jump, s, and by how much; how many such times there are is returned.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    last_piece = coefficients.shape[0] - 1
    rounding = ROUNDINGS * (table[last_row, START] + coefficients[last_piece, 0])
    work = np.empty((4, axes))
    here = np.zeros((3, axes + 1))
    before = np.zeros((3, axes + 1))
    seen = False  # whether `before` holds the motion at the instant before
    smooth = False  # whether nothing can jump there
    t = 0.0
    count = 0
    out[:, :2] = 0.0
    out[:, 2:] = -np.inf
    piece = 0
    row = 0
    last = -1.0
    for i in range(out.shape[0]):
        begin_at = low[i]
        end_at = high[i]
        if not begin_at < end_at:
            continue
        if begin_at != last:
            seen = False
            piece = np.searchsorted(breaks[1 : last_piece + 1], begin_at, side="right")
            s = law_in_piece(coefficients, piece, begin_at - breaks[piece])[0]
            row = find_row(table, 0, last_row, START, s + rounding)
        last = end_at
        # parts that lie in one piece of the law and one row of the path: there everything is smooth
        for _ in range(table.shape[0] + coefficients.shape[0]):
            end = min(end_at, breaks[piece + 1])
            begin = breaks[piece]
            while (
                row < last_row
                and law_in_piece(coefficients, piece, begin_at - begin)[0] >= table[row + 1, START] - rounding
            ):
                row += 1
                smooth = False
            cut = (
                row < last_row and law_in_piece(coefficients, piece, end - begin)[0] > table[row + 1, START] + rounding
            )
            if cut:
                end = _time_at(coefficients, piece, begin, table[row + 1, START], begin_at, end)
            if smooth and seen:
                _keep(before, out[i])
            for k in range(1 if smooth and seen else 0, INSTANTS):
                s, v, a, j = law_in_piece(
                    coefficients, piece, begin_at + (end - begin_at) * (k / (INSTANTS - 1)) - begin
                )
                t = parameter_in_row(table, row, s, t)
                if not _motion(table, row, shape, t, v, a, j, work, here):
                    seen = False
                    continue
                _keep(here, out[i])
                if k == 0 and seen:
                    at[count] = begin_at
                    jumps[count] = here[1] - before[1]
                    count += 1
                seen = True
                before[:] = here
            begin_at = end
            ends = end >= breaks[piece + 1] and piece < last_piece
            smooth = not cut and not ends
            if cut:
                row += 1
            elif ends:
                piece += 1
            if not cut and end >= end_at:
                break
    return count

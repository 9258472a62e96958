"""Arithmetic of the override: what a law asks of the axes in each of its ticks, and the rate at which it is run.

A law gives positions q(tau) by plan time tau; run at the rate r = dtau/dt, it moves the axes by

    v = q' r,   a = q'' r^2 + q' r',   j = q''' r^3 + 3 q'' r r' + q' r''

docs/math/override.md bounds each term.
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
#: Places in the state of `run_rate`: plan time s, rate, its slope 1/s, and by how much the slope falls a tick on the
#: stop that is certain to keep the limits, and ticks at rest so far (0, 1 or more).
TAU, RATE, SLOPE, FALL, STILL = 0, 1, 2, 3, 4
STATE = 5
#: Arc length is rounded by so much of what it can be: what is so near to a row of the path has reached it.
ROUNDINGS = 1e-14
#: Halvings that find when the law reaches a row of the path.
BISECTIONS = 52
#: Share of the jerk left beside the law's own that the term 3 q'' r r' may take; the rest is for q' r''.
FOR_SLOPE = 0.5
#: Largest change of the rate in one tick, and of that change: what counts where the axes hardly move.
MOST_STEP = 0.25
#: A rate that comes to rest as near as this to its target is at it; the step that it is moved by is far below 1 %.
AT_TARGET = 1e-9
#: How far beside 0 or the highest rate a stop may end by rounding.
ROUNDING = 1e-12


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
    feeds: Array,
    out: Array,
) -> float:
    """Largest |q'|, |q''|, |q'''| of every axis, and of the arc length, in ticks first ... of a law.

    out (n, 3, axes + 1), for plan times (first + i) T to (first + i + 1) T; 0 beyond the end of the law. A jump of q''
    counts as jerk over the period, as the drive sees it. feeds (rows,) mm/s: the largest share of them is returned.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    last_piece = coefficients.shape[0] - 1
    end = breaks[last_piece + 1]
    rounding = ROUNDINGS * (table[last_row, START] + coefficients[last_piece, 0])
    work = np.empty((4, axes))
    here = np.zeros((3, axes + 1))
    before = np.zeros((3, axes + 1))
    jumped = np.zeros(axes + 1)
    share = 0.0
    seen = False  # whether `before` holds the motion at the instant before
    out[:] = 0.0
    start = first * period
    piece = 0
    while piece < last_piece and start >= breaks[piece + 1]:
        piece += 1
    row = find_row(
        table, 0, last_row, START, law_in_piece(coefficients, piece, max(start - breaks[piece], 0.0))[0] + rounding
    )
    for i in range(out.shape[0]):
        low = (first + i) * period
        if low >= end:
            break
        tick_end = min((first + i + 1) * period, end)
        jumped[:] = 0.0
        # parts of the tick that lie in one piece of the law and one row of the path: there everything is smooth
        for _ in range(table.shape[0] + coefficients.shape[0]):
            high = min(tick_end, breaks[piece + 1])
            begin = breaks[piece]
            while (
                row < last_row and law_in_piece(coefficients, piece, low - begin)[0] >= table[row + 1, START] - rounding
            ):
                row += 1
            cut = (
                row < last_row and law_in_piece(coefficients, piece, high - begin)[0] > table[row + 1, START] + rounding
            )
            if cut:
                high = _time_at(coefficients, piece, begin, table[row + 1, START], low, high)
            for k in range(INSTANTS):
                s, v, a, j = law_in_piece(coefficients, piece, low + (high - low) * (k / (INSTANTS - 1)) - begin)
                share = max(share, v / feeds[row])
                t = parameter_in_row(table, row, s, 0.0)
                if not _motion(table, row, shape, t, v, a, j, work, here):
                    seen = False
                    continue
                for q in range(axes + 1):
                    for order in range(3):
                        out[i, order, q] = max(out[i, order, q], abs(here[order, q]))
                    if k == 0 and seen:
                        jumped[q] += abs(here[1, q] - before[1, q])
                seen = True
                before[:] = here
            low = high
            if cut:
                row += 1
            if not cut and high >= breaks[piece + 1] and piece < last_piece:
                piece += 1
            if not cut and high >= tick_end:
                break
        for q in range(axes + 1):
            out[i, 2, q] += jumped[q] / period
    return share


@kernel
def look_on(cells: Array, window: int, out: Array) -> None:
    """The largest of cells (n + window, orders, columns) in `window` of them from each on, out (n, orders, columns)."""
    # van Herk's way: maxima from the left and from the right inside blocks of one window, two comparisons a cell
    count = cells.shape[0]
    left = np.empty(count)
    right = np.empty(count)
    for order in range(cells.shape[1]):
        for q in range(cells.shape[2]):
            for i in range(count):
                value = cells[i, order, q]
                left[i] = value if i % window == 0 else max(left[i - 1], value)
            for i in range(count - 1, -1, -1):
                value = cells[i, order, q]
                right[i] = value if i == count - 1 or (i + 1) % window == 0 else max(right[i + 1], value)
            for i in range(out.shape[0]):
                out[i, order, q] = max(right[i], left[i + window - 1])


@kernel
def _room(rate: float, slope: float, ahead: Array, limit: Array, period: float) -> float:
    """Largest |r''| at rates up to `rate` and slopes up to `slope`; below 0 where not even r'' = 0 holds.

    ahead (3, n): |q'|, |q''|, |q'''|; limit (2, n): acceleration and jerk. Jumps of q''
    count in |q'''| and grow by r^2: below r = 1 all of it is taken to.
    """
    square = rate * rate
    power = square * max(rate, 1.0)
    most = MOST_STEP / (period * period)
    for k in range(limit.shape[1]):
        if ahead[1, k] * square + ahead[0, k] * slope > limit[0, k]:
            return -1.0
        left = limit[1, k] - ahead[2, k] * power - 3.0 * ahead[1, k] * rate * slope
        if left < 0.0:
            return -1.0
        if left < most * ahead[0, k]:
            most = left / ahead[0, k]
    return most


@kernel
def _steepest(rate: float, ahead: Array, limit: Array, period: float) -> float:
    """Largest |r'| at rates up to `rate` that leaves jerk for r''."""
    square = rate * rate
    power = square * max(rate, 1.0)
    most = MOST_STEP / period
    for k in range(limit.shape[1]):
        left = max(limit[0, k] - ahead[1, k] * square, 0.0)
        if left < most * ahead[0, k]:
            most = left / ahead[0, k]
        left = FOR_SLOPE * max(limit[1, k] - ahead[2, k] * power, 0.0)
        if left < most * 3.0 * ahead[1, k] * rate:
            most = left / (3.0 * ahead[1, k] * rate)
    return most * (1.0 - 1e-9)


@kernel
def _towards(gap: float, slope: float, bend: float, steepest: float, period: float) -> float:
    """Slope at the next tick that brings the rate to its target soonest, `gap` > 0 above it, and lands exactly there.

    From a slope w in n even steps the rate comes to rest after T w n / 2. So w = (2 gap / T - slope) / (n + 1), with
    the fewest n whose steps are within `bend` T.
    """
    step = bend * period
    reach = 2.0 * gap / period - slope
    if reach <= 0.0:
        wanted = 0.0
    else:
        n = math.ceil(0.5 * (math.sqrt(1.0 + 4.0 * reach / step) - 1.0) * (1.0 - 1e-12))
        wanted = reach / (n + 1.0)
    wanted = min(wanted, steepest)
    wanted = min(max(wanted, slope - step), slope + step)
    # the slope changes its sign at a tick, so that the rate is never beyond both ends of a step
    if (slope > 0.0 and wanted < 0.0) or (slope < 0.0 and wanted > 0.0):
        wanted = 0.0
    return wanted


@kernel
def _certain(
    rate: float,
    slope: float,
    wanted: float,
    highest: float,
    top: float,
    left: float,
    ahead: Array,
    limit: Array,
    period: float,
) -> float:
    """By how much the slope may fall a tick so that the step to `wanted` and the stop behind it keep every limit.

    highest  rate that neither exceeds; top  highest rate there is; left  s of plan time for which `ahead` holds.
    Negative if there is no such stop.
    """
    bend = _room(highest, max(abs(slope), abs(wanted)), ahead, limit, period)
    if bend < 0.0 or abs(wanted - slope) > bend * period * (1.0 + ROUNDING):
        return -1.0
    after = rate + 0.5 * period * (slope + wanted)
    n = 0.0
    if wanted != 0.0:
        if not bend > 0.0:
            return -1.0
        n = math.ceil(abs(wanted) / (bend * period) * (1.0 - ROUNDING))
    end = after + 0.5 * period * wanted * n
    if max(rate, after, end) > highest + ROUNDING or end < -ROUNDING or max(after, end) > top + ROUNDING:
        return -1.0
    if (n + 1.0) * period * highest > left:
        return -1.0
    return abs(wanted) / n if n > 0.0 else 0.0


@kernel
def run_rate(
    targets: Array,
    ahead: Array,
    limit: Array,
    first: int,
    window: int,
    period: float,
    top: float,
    duration: float,
    state: Array,
    taus: Array,
    rates: Array,
) -> int:
    """Run a law towards the wanted rates `targets` (n,); plan time and rate at the end of each tick, (n,).

    ahead (cells, 3, columns)  what the law asks for in `window` ticks from tick first + i on; limit (2, columns);
    state (STATE,), carried on. Ends before a tick for which `ahead` has nothing, and at the end of the law; returns the
    ticks that were run.
    """
    for i in range(targets.shape[0]):
        tau = state[TAU]
        rate = state[RATE]
        slope = state[SLOPE]
        cell = int(tau / period) - first
        if tau >= duration or cell >= ahead.shape[0]:
            return i
        now = ahead[cell]
        left = (first + cell + window) * period - tau
        target = min(max(targets[i], 0.0), top)
        if rate == 0.0 and slope == 0.0 and state[STILL] == 1.0:
            target = 0.0  # a rest of one tick would be a setpoint said twice, as by mistake: it lasts two
        gap = target - rate
        sign = 1.0 if gap >= 0.0 else -1.0
        wanted = 0.0
        fall = -1.0
        if gap != 0.0 or slope != 0.0:
            highest = rate
            if sign > 0.0 or slope > 0.0:
                # how far it would still rise: one more step up, and the stop behind it
                bend = max(_room(rate, abs(slope), now, limit, period), 0.0)
                next_slope = max(slope, 0.0) + bend * period
                rise = 0.5 * period * (max(slope, 0.0) + next_slope)
                if bend > 0.0:
                    rise += 0.5 * period * next_slope * (1.0 + next_slope / (bend * period))
                highest = min(rate + 1.1 * rise, top)
                if slope <= 0.0 or rate <= target:
                    highest = min(highest, max(target, rate))
            steepest = _steepest(highest, now, limit, period)
            bend = _room(highest, min(max(abs(slope), steepest), MOST_STEP / period), now, limit, period)
            if bend <= 0.0:
                bend = _room(highest, abs(slope), now, limit, period)
            if bend > 0.0:
                most = left / (period * max(highest, 1e-9)) - 2.0
                steepest = min(steepest, bend * period * max(most, 0.0))
                wanted = sign * _towards(sign * gap, sign * slope, bend, steepest, period)
                fall = _certain(rate, slope, wanted, highest, top, left, now, limit, period)
        else:
            fall = 0.0
        if fall < 0.0:
            # the stop that was certain before still is: another step of it
            fall = state[FALL]
            wanted = max(slope - fall, 0.0) if slope > 0.0 else min(slope + fall, 0.0)
            if abs(wanted) <= 1e-9 * fall:
                wanted = 0.0
        after = rate + 0.5 * period * (slope + wanted)
        if wanted == 0.0 and abs(after - target) <= AT_TARGET:
            after = target
        after = min(max(after, 0.0), top)
        tau += period * (rate + period * (slope / 3.0 + wanted / 6.0))
        state[STILL] = state[STILL] + 1.0 if tau == state[TAU] else 0.0
        state[TAU] = min(tau, duration)
        state[RATE] = after
        state[SLOPE] = wanted
        state[FALL] = fall
        taus[i] = state[TAU]
        rates[i] = after
    return targets.shape[0]

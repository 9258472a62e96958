"""Arithmetic of the check: what lies between two setpoints, and a law's extremes."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.law import law_in_piece
from splinefeed.kernels.measure import _from_chord, _within_row, curvature_at
from splinefeed.kernels.pieces import (
    DEGREES,
    HIGH,
    LOW,
    START,
    Shape,
    derivatives,
    measured,
    way_to_rest,
)
from splinefeed.records import Array, IntArray

#: Intervals in which the curve between two setpoints, within one row, is looked at for its distance from their chord.
CHORD_INTERVALS = 8
#: Steps of the golden section that then finds the largest distance: 0.618^30 of two intervals.
CHORD_STEPS = 30
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
#: What is sampled below this share of the largest so far is not looked at more closely.
WORTH_A_LOOK = 0.9

#: What `law_extremes` keeps the largest value of (SHARE is the feed as a share of its limit there); velocity,
#: acceleration and jerk of each axis stand behind these.
FEED, SPEED_UP, SLOW_DOWN, JERK_UP, JERK_DOWN, CENTRIPETAL, BACKWARDS, SHARE, AXES = 0, 1, 2, 3, 4, 5, 6, 7, 8
#: A place is told from one with C' = 0 by half this many roundings of arc length.
INDISTINCT = 32.0
#: Nearer to C' = 0 than this many roundings, what a rounding of s can change is looked at: 5e-8 of the jerk and more.
NEAR = 1e8
#: Instants looked at in every stretch of a law that lies on one piece of the path, at Chebyshev-Lobatto places.
INSTANTS = 17
#: Bisections that find when a law reaches the end of a row: 2^-60 of a piece.
BISECTIONS = 60
#: An acceleration below this share of the largest one of its piece, or of what the jerk makes of the rounding of an
#: instant, has no sign of its own.
NO_SIGN, ROUNDING_OF_T = 1e-9, float(np.finfo(np.float64).eps)


@kernel
def steps(table: Array, shape: Shape, rows: IntArray, u: Array, feeds: Array, out: Array, least: Array) -> None:
    """Arc length from each located setpoint to the next, (n - 1,), mm, negative where one goes back.

    By adaptive quadrature of |C'(u)| over every row between; NaN where a setpoint has no place. least (n - 1,) is the
    time in s that the step takes at the largest feed of every row, feeds (rows,) mm/s, of the same sign.
    """
    for i in range(u.shape[0] - 1):
        row = rows[i]
        end_row = rows[i + 1]
        low = u[i]
        high = u[i + 1]
        sign = 1.0
        if end_row < row or (end_row == row and high < low):
            row, end_row = end_row, row
            low, high = high, low
            sign = -1.0
        total = math.nan
        time = math.nan
        if math.isfinite(low) and math.isfinite(high):
            total = 0.0
            time = 0.0
            for k in range(row, end_row + 1):
                start = low if k == row else table[k, LOW]
                end = high if k == end_row else table[k, HIGH]
                if end > start:
                    length = _within_row(table, k, shape, start, end)
                    total += length
                    time += length / feeds[k]
        out[i] = sign * total
        least[i] = sign * time


@kernel
def chords(table: Array, shape: Shape, rows: IntArray, u: Array, position: Array, worst: float, out: Array) -> None:
    """Largest distance of the curve from the line between neighbouring setpoints, (n - 1,), mm.

    Every row of a step is looked at by itself, ends included: a corner at a knot is never between two samples. Steps
    below WORTH_A_LOOK of the largest so far (`worst` to begin with) keep their sampled value.
    """
    at = np.empty(shape[1])
    for i in range(u.shape[0] - 1):
        row = rows[i]
        end_row = rows[i + 1]
        low = u[i]
        high = u[i + 1]
        if end_row < row or (end_row == row and high < low):
            row, end_row = end_row, row
            low, high = high, low
        out[i] = math.nan
        if not (math.isfinite(low) and math.isfinite(high)):
            continue
        top = 0.0
        for k in range(row, end_row + 1):
            begin = low if k == row else table[k, LOW]
            width = (high if k == end_row else table[k, HIGH]) - begin
            best = 0
            largest = 0.0
            for j in range(CHORD_INTERVALS + 1):
                place = begin + width * j / CHORD_INTERVALS
                distance = _from_chord(table, k, k, shape, place, position[i], position[i + 1], at)
                if distance > largest:
                    largest = distance
                    best = j
            top = max(top, largest)
            if largest < WORTH_A_LOOK * max(worst, top):
                continue
            left = begin + width * max(best - 1, 0) / CHORD_INTERVALS
            right = begin + width * min(best + 1, CHORD_INTERVALS) / CHORD_INTERVALS
            inner = right - GOLDEN * (right - left)
            outer = left + GOLDEN * (right - left)
            at_inner = _from_chord(table, k, k, shape, inner, position[i], position[i + 1], at)
            at_outer = _from_chord(table, k, k, shape, outer, position[i], position[i + 1], at)
            for _ in range(CHORD_STEPS):
                if at_inner > at_outer:
                    right = outer
                    outer = inner
                    at_outer = at_inner
                    inner = right - GOLDEN * (right - left)
                    at_inner = _from_chord(table, k, k, shape, inner, position[i], position[i + 1], at)
                else:
                    left = inner
                    inner = outer
                    at_inner = at_outer
                    outer = left + GOLDEN * (right - left)
                    at_outer = _from_chord(table, k, k, shape, outer, position[i], position[i + 1], at)
            top = max(top, at_inner, at_outer)
        worst = max(worst, top)
        out[i] = top


@kernel
def least_curvatures(table: Array, shape: Shape, rows: IntArray, u: Array, out: Array) -> None:
    """Least curvature between neighbouring setpoints, (n - 1,), 1/mm: ends and middle of each row's part."""
    work = np.empty((4, shape[1]))
    for i in range(u.shape[0] - 1):
        row = min(rows[i], rows[i + 1])
        end_row = max(rows[i], rows[i + 1])
        least = math.inf
        for k in range(row, end_row + 1):
            begin = table[k, LOW] if k > row else (u[i] if rows[i] == row else u[i + 1])
            end = table[k, HIGH] if k < end_row else (u[i + 1] if rows[i + 1] == end_row else u[i])
            for j in range(3):
                least = min(least, curvature_at(table, k, shape, begin + 0.5 * j * (end - begin), work))
        out[i] = least


@kernel
def _motion(
    table: Array,
    feeds: Array,
    row: int,
    shape: Shape,
    rounding: float,
    s: float,
    v: float,
    a: float,
    j: float,
    way: int,
    work: Array,
    out: Array,
) -> float:
    """Every value that `law_extremes` keeps, at arc length s of one row, into out; returns how far C' = 0 can be, mm.

    0 where that is within the rounding of s, and what depends on it is left out: see `way_to_rest`. way: 1 where the
    feed grows, -1 where it falls, 0 where nobody can tell.

    q' = r_s v,  q'' = r_ss v^2 + r_s a,  q''' = r_sss v^3 + 3 r_ss v a + r_s j,  with r_s, r_ss, r_sss by the chain
    rule: u_s = 1/c, u_ss = -(C'.C'')/c^4, u_sss = 4 (C'.C'')^2/c^7 - (C''.C'' + C'.C''')/c^5, c = |C'|.
    """
    axes = shape[1]
    begin, end = measured(table, row, shape)
    whole = arc_length(table, row, 1.0) - table[row, START]
    ahead = min(max(s - table[row, START], 0.0), whole)
    guess = 2.0 * ahead / whole - 1.0 if whole > 0.0 else 0.0
    t = parameter_in_row(table, row, table[row, START] + ahead, guess)
    derivatives(table, row, shape, t, 3, work)
    out[FEED] = v
    out[SPEED_UP] = a
    out[SLOW_DOWN] = -a
    out[JERK_UP] = abs(j) if way > 0 else 0.0
    out[JERK_DOWN] = abs(j) if way < 0 else 0.0
    out[BACKWARDS] = -v
    out[SHARE] = v / feeds[row]
    square = 0.0
    product = 0.0
    third = 0.0
    bends = 0.0
    twists = 0.0
    for k in range(begin, end):
        bends += work[2, k] * work[2, k]
        twists += work[3, k] * work[3, k]
        square += work[1, k] * work[1, k]
        product += work[1, k] * work[2, k]
        third += work[2, k] * work[2, k] + work[1, k] * work[3, k]
    turning = shape[2] <= 0 and end == axes
    if turning:
        square *= DEGREES * DEGREES
        product *= DEGREES * DEGREES
        third *= DEGREES * DEGREES
        bends *= DEGREES * DEGREES
        twists *= DEGREES * DEGREES
    c = math.sqrt(square)
    us = 1.0 / c
    uss = -product / (square * square)
    usss = 4.0 * product * product / (square * square * square * c) - third / (square * square * c)
    bend = 0.0
    away = way_to_rest(c, math.sqrt(bends), math.sqrt(twists))
    regular = away > 0.5 * INDISTINCT * rounding
    for k in range(axes):
        r1 = work[1, k] * us
        r2 = work[2, k] * us * us + work[1, k] * uss
        r3 = work[3, k] * us * us * us + 3.0 * work[2, k] * us * uss + work[1, k] * usss
        if k < end and not turning:
            bend += r2 * r2
        out[AXES + k] = abs(r1 * v)
        out[AXES + axes + k] = abs(r2 * v * v + r1 * a)
        out[AXES + 2 * axes + k] = abs(r3 * v * v * v + 3.0 * r2 * v * a + r1 * j)
        regular = regular and math.isfinite(out[AXES + k] + out[AXES + axes + k] + out[AXES + 2 * axes + k])
    out[CENTRIPETAL] = math.sqrt(bend) * v * v
    for k in range(0 if regular else out.shape[0]):
        out[k] = out[k] if k < CENTRIPETAL or k in (BACKWARDS, SHARE) else 0.0
    return away if regular else 0.0


@kernel
def _least_motion(
    table: Array,
    feeds: Array,
    row: int,
    shape: Shape,
    rounding: float,
    s: float,
    v: float,
    a: float,
    j: float,
    way: int,
    work: Array,
    other: Array,
    out: Array,
) -> bool:
    """What `_motion` does, each value the least within two roundings of s: of the law's, and of the curve's own.

    Next to C' = 0 derivatives by arc length grow without bound, and a rounding of s changes the jerk by a part of it:
    r_sss goes with c^-5, c with the square root of the way to C' = 0: at x roundings from it, two are a share 5 / x.
    False where it can be none but for rounding. other (8 + 3 axes,): room for work.
    """
    away = _motion(table, feeds, row, shape, rounding, s, v, a, j, way, work, out)
    if 0.0 < away < NEAR * rounding:
        for side in range(2):
            shifted = s + (4.0 * side - 2.0) * rounding
            away = min(away, _motion(table, feeds, row, shape, rounding, shifted, v, a, j, way, work, other))
            for k in range(CENTRIPETAL, out.shape[0]):
                if k not in (BACKWARDS, SHARE):
                    out[k] = min(out[k], other[k])
    return away > 0.0


@kernel
def _time_at(coefficients: Array, piece: int, s: float, low: float, high: float) -> float:
    """tau in [low, high] of one piece at which its s, growing, is reached, by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if law_in_piece(coefficients, piece, middle)[0] < s:
            low = middle
        else:
            high = middle
    return high


@kernel
def _place(low: float, high: float, index: float) -> float:
    """Chebyshev-Lobatto place 0 ... INSTANTS - 1 of [low, high], or between two of them."""
    return low + (high - low) * 0.5 * (1.0 - math.cos(math.pi * index / (INSTANTS - 1)))


@kernel
def law_extremes(
    breaks: Array,
    coefficients: Array,
    table: Array,
    feeds: Array,
    shape: Shape,
    rounding: float,
    worst: Array,
    jumps: Array,
) -> int:
    """Largest value of everything from FEED to the axes' jerks over a whole law, into worst (8 + 3 axes, 4).

    A row of `worst` is value, time s, arc length mm and row of the table; feeds (rows,) is the largest feed on every
    row, mm/s; jumps (3, 3) are the same for the largest jumps of s, feed and
    acceleration between pieces. Every stretch in one piece of the law and one row of the path is looked at alone, ends
    included, on that row's own polynomials: values at knots and breaks are one-sided by construction. Returns how many
    instants had C' = 0. rounding: of s, mm.
    """
    last_row = table.shape[0] - 1
    values = np.empty((INSTANTS + 1, worst.shape[0]))
    work = np.empty((4, shape[1]))
    other = np.empty(worst.shape[0])
    accelerations = np.empty(INSTANTS)
    row = 0
    irregular = 0
    for i in range(coefficients.shape[0]):
        span = breaks[i + 1] - breaks[i]
        end = law_in_piece(coefficients, i, span)
        steepest = hardest = 0.0
        for k in range(INSTANTS):
            _, _, a, j = law_in_piece(coefficients, i, _place(0.0, span, k))
            steepest, hardest = max(steepest, abs(a)), max(hardest, abs(j))
        no_sign = max(NO_SIGN * steepest, ROUNDING_OF_T * abs(breaks[i + 1]) * hardest)
        while row < last_row and coefficients[i, 0] >= table[row + 1, START] - rounding:
            row += 1
        low = 0.0
        for _ in range(last_row + 1):
            cut = row < last_row and end[0] > table[row + 1, START] + rounding
            high = _time_at(coefficients, i, table[row + 1, START], low, span) if cut else span
            for k in range(INSTANTS):
                accelerations[k] = law_in_piece(coefficients, i, _place(low, high, k))[2]
            # in the last rounding of a piece, behind a knot, accelerations can all be rounding: nobody's jerk
            told = np.max(np.abs(accelerations)) > no_sign
            in_middle = 0 if not told else 1 if accelerations[INSTANTS // 2] >= 0.0 else -1
            for k in range(INSTANTS):
                s, v, a, j = law_in_piece(coefficients, i, _place(low, high, k))
                way = in_middle if abs(a) <= no_sign else 1 if a > 0.0 else -1
                irregular += not _least_motion(
                    table, feeds, row, shape, rounding, s, v, a, j, way, work, other, values[k]
                )
            for q in range(worst.shape[0]):
                best = int(np.argmax(values[:INSTANTS, q]))
                top = values[best, q]
                tau = _place(low, high, best)
                if 0 < best < INSTANTS - 1 and top > WORTH_A_LOOK * worst[q, 0]:
                    # the top of the parabola through three samples, which are even in the angle
                    before = values[best - 1, q]
                    after = values[best + 1, q]
                    bend = before - 2.0 * top + after
                    if bend < 0.0:
                        between = _place(low, high, best + 0.5 * (before - after) / bend)
                        s, v, a, j = law_in_piece(coefficients, i, between)
                        way = in_middle if abs(a) <= no_sign else 1 if a > 0.0 else -1
                        regular = _least_motion(
                            table, feeds, row, shape, rounding, s, v, a, j, way, work, other, values[INSTANTS]
                        )
                        if regular and values[INSTANTS, q] > top:
                            top = values[INSTANTS, q]
                            tau = between
                if top > worst[q, 0]:
                    worst[q, 0] = top
                    worst[q, 1] = breaks[i] + tau
                    worst[q, 2] = law_in_piece(coefficients, i, tau)[0]
                    worst[q, 3] = row
            if not cut:
                break
            low = high
            row += 1
        for k in range(3 if i + 1 < coefficients.shape[0] else 0):
            gap = abs(coefficients[i + 1, k] * (2.0 if k == 2 else 1.0) - end[k])
            if gap > jumps[k, 0]:
                jumps[k, 0] = gap
                jumps[k, 1] = breaks[i + 1]
                jumps[k, 2] = end[0]
    return irregular

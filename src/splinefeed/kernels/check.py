"""Arithmetic of the check: where setpoints lie on the path, what lies between two of them, and a law's extremes."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.contour import PLACE, ROW, nearest_in_window
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.law import law_in_piece
from splinefeed.kernels.measure import _from_chord, _within_row, curvature_at
from splinefeed.kernels.pieces import (
    DEGREES,
    HIGH,
    LOW,
    MIDDLE,
    SCALE,
    START,
    Shape,
    derivatives,
    find_row,
    measured,
    point,
    speed,
    turns,
)
from splinefeed.records import Array, IntArray

#: Columns of what `locate` finds: parameter, arc length mm, distance over the linear axes mm, largest deviation of a
#: rotary axis rad, and how far the setpoint is from where its own u says, mm (0 if it has none, or if that is right).
U, S, APART, TURNED, ASTRAY = 0, 1, 2, 3, 4
FOUND = 5
#: Intervals in which the curve between two setpoints, within one row, is looked at for its distance from their chord.
CHORD_INTERVALS = 8
#: Steps of the golden section that then finds the largest distance: 0.618^30 of two intervals.
CHORD_STEPS = 30
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
#: What is sampled below this share of the largest so far is not looked at more closely.
WORTH_A_LOOK = 0.9

#: Rows that turn, either way, which are searched for a position that its linear axes do not place, and Newton steps.
TURNING_ROWS = 64
TURNING_STEPS = 10

#: A step along the path this many times as long as its chord may have taken a turn back over the path.
LONGER = 1.05
#: Places that are as near as each other but for so many roundings of arc length are alike.
ROUNDINGS, EPSILON = 64.0, 2.0**-52

#: What `law_extremes` keeps the largest value of (SHARE is the feed as a share of its limit there); velocity,
#: acceleration and jerk of each axis stand behind these.
FEED, SPEED_UP, SLOW_DOWN, JERK_UP, JERK_DOWN, CENTRIPETAL, BACKWARDS, SHARE, AXES = 0, 1, 2, 3, 4, 5, 6, 7, 8
#: A place is told from one with C' = 0 by half this many roundings of arc length.
INDISTINCT = 32.0
#: Instants looked at in every stretch of a law that lies on one piece of the path, at Chebyshev-Lobatto places.
INSTANTS = 17
#: Bisections that find when a law reaches the end of a row: 2^-60 of a piece.
BISECTIONS = 60
#: An acceleration below this share of the largest one in its stretch has no sign of its own.
NO_SIGN = 1e-9


@kernel
def _apart(at: Array, position: Array, linear: int) -> tuple[float, float]:
    """Distance over the linear axes, mm, and largest deviation of a rotary axis, rad."""
    total = 0.0
    turned = 0.0
    for a in range(at.shape[0]):
        if a < linear:
            total += (at[a] - position[a]) ** 2
        else:
            turned = max(turned, abs(at[a] - position[a]))
    return math.sqrt(total), turned


@kernel
def _apart_squared(
    table: Array, row: int, shape: Shape, t: float, position: Array, work: Array
) -> tuple[float, float, float]:
    """|C - Q|^2 / 2 over all axes, 1 degree as 1 mm, with its first and second derivative by u, at t of one row."""
    derivatives(table, row, shape, t, 2, work)
    square = 0.0
    slope = 0.0
    bend = 0.0
    for a in range(shape[1]):
        unit = 1.0 if a < abs(shape[2]) else DEGREES
        apart = unit * (work[0, a] - position[a])
        square += 0.5 * apart * apart
        slope += apart * unit * work[1, a]
        bend += unit * unit * work[1, a] * work[1, a] + apart * unit * work[2, a]
    return square, slope, bend


@kernel
def _turned_to(
    table: Array, shape: Shape, row: int, t: float, hint: float, least: float, position: Array, work: Array
) -> tuple[int, float]:
    """Row and t of the better of a place and the nearest one, over all axes, beside it or beside the hint.

    hint  arc length, mm; least  arc length before which nothing counts, mm. Looked at are rows on which no linear axis
    moves, for there a position over the linear axes says nothing, as far as they follow each other, and the row before
    and behind them.
    """
    last_row = table.shape[0] - 1
    best, _, _ = _apart_squared(table, row, shape, t, position, work)
    if arc_length(table, row, t) < least:
        best = math.inf
    found = row
    place = t
    for begin in (row, find_row(table, 0, last_row, START, hint)):
        for way in (-1, 1):
            each = begin if way > 0 else begin - 1
            for _ in range(TURNING_ROWS):
                if each < 0 or each > last_row:
                    break
                for k in range(CHORD_INTERVALS + 1):
                    t = 2.0 * k / CHORD_INTERVALS - 1.0
                    for _ in range(TURNING_STEPS):
                        square, slope, bend = _apart_squared(table, each, shape, t, position, work)
                        if square < best and arc_length(table, each, t) >= least:
                            best = square
                            found = each
                            place = t
                        if not bend > 0.0:
                            break
                        t = min(max(t - slope / bend * table[each, SCALE], -1.0), 1.0)
                if each != begin and not turns(table, each, shape):
                    break
                each += way
    return found, place


@kernel
def _named(
    table: Array, first: int, last: int, row: int, shape: Shape, u: float, at: Array
) -> tuple[int, float, float]:
    """Row, parameter and t of the place that u names on a curve of the rows first to last; its point into at (axes,).

    `row` is where the last one was, tried first.
    """
    value = min(max(u, table[first, LOW]), table[last, HIGH])
    if row < first or row > last or value < table[row, LOW] or value >= table[row, HIGH]:
        row = find_row(table, first, last, LOW, value)
    t = (value - table[row, MIDDLE]) * table[row, SCALE]
    point(table, row, shape, t, at)
    return row, value, t


@kernel
def _expect(state: Array, s: float, first: bool) -> None:
    """Take note of the arc length of a setpoint: the next one is expected as far on as it was from the one before."""
    state[0] = s if first and state[1] <= 0.0 else 2.0 * s - state[1]
    state[1] = s


@kernel
def placed(
    table: Array,
    curve_rows: IntArray,
    shape: Shape,
    allowed: float,
    curve: IntArray,
    u: Array,
    position: Array,
    state: Array,
    rows: IntArray,
    found: Array,
    along: Array,
) -> int:
    """As `locate`, as far as every setpoint is where its curve and u say; returns how many were, from the first on.

    It needs no search, which takes longer to compile than all the rest. along (1,): the largest |u| |C'(u)|, mm.
    """
    at = np.empty(shape[1])
    linear = abs(shape[2])
    row = int(state[2])
    for i in range(u.shape[0]):
        index = curve[i]
        if not (0 <= index < curve_rows.shape[0] and math.isfinite(u[i])):
            return i
        row, value, t = _named(table, curve_rows[index, 0], curve_rows[index, 1], row, shape, u[i], at)
        distance, turned = _apart(at, position[i], linear)
        if not (distance <= allowed and turned <= allowed):
            return i
        s = arc_length(table, row, t)
        rows[i] = row
        found[i, U] = value
        found[i, S] = s
        found[i, APART] = distance
        found[i, TURNED] = turned
        found[i, ASTRAY] = 0.0
        along[0] = max(along[0], abs(value) * speed(table, row, shape, t))
        _expect(state, s, i == 0)
        state[2] = row
    return u.shape[0]


@kernel
def _nearest(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    allowed: float,
    hint: float,
    least: float,
    position: Array,
    at: Array,
    work: Array,
) -> tuple[int, float, float, float]:
    """Row and t of the place nearest to a position (axes,), and how far it is, mm and rad, its point into at (axes,).

    Over the linear axes near arc length `hint`, mm; where these do not tell, over all axes, from `least` on, mm.
    """
    linear = abs(shape[2])
    result = np.empty((1, 3))
    near = np.array([min(max(hint, 0.0), arc_length(table, table.shape[0] - 1, 1.0))])
    query = position[:linear].copy().reshape(1, linear)
    nearest_in_window(table, shape, cells, boxes, False, 0.0, query, near, result)
    row = int(result[0, ROW])
    t = result[0, PLACE]
    point(table, row, shape, t, at)
    distance, turned = _apart(at, position, linear)
    if shape[2] <= 0 and not (distance <= allowed and turned <= allowed and arc_length(table, row, t) >= least):
        row, t = _turned_to(table, shape, row, t, near[0], least, position, work)
        point(table, row, shape, t, at)
        distance, turned = _apart(at, position, linear)
    return row, t, distance, turned


@kernel
def _onward(
    table: Array,
    shape: Shape,
    cells: Array,
    boxes: Array,
    allowed: float,
    last: float,
    chord: float,
    row: int,
    t: float,
    distance: float,
    turned: float,
    position: Array,
    at: Array,
    work: Array,
) -> tuple[int, float, float, float]:
    """Row, t and distances, as `_nearest` found them, of the first place at or behind arc length `last`, mm, as near.

    Where a path runs back over itself a position has two places. The tool goes on: from a place behind it to the one
    as far ahead, and not to one that is further along the path than `chord`, the way since `last`, mm, lets expect, if
    there is one before it. Where there is only one place, that stays.
    """
    s = arc_length(table, row, t)
    if s >= last and s - last <= LONGER * chord:
        return row, t, distance, turned
    slack = max(allowed, ROUNDINGS * EPSILON * arc_length(table, table.shape[0] - 1, 1.0))
    ahead = abs(s - last)
    for hint in (last, last + ahead):
        other = _nearest(table, shape, cells, boxes, allowed, hint, last, position, at, work)
        as_near = other[2] <= distance + slack and other[3] <= turned + slack
        if as_near and last <= arc_length(table, other[0], other[1]) <= last + LONGER * ahead + slack:
            return other
        if s >= last:
            break
    return row, t, distance, turned


@kernel
def locate(
    table: Array,
    curve_rows: IntArray,
    shape: Shape,
    cells: Array,
    boxes: Array,
    allowed: float,
    curve: IntArray,
    u: Array,
    position: Array,
    state: Array,
    rows: IntArray,
    found: Array,
) -> float:
    """Row of the table (n,) and FOUND columns (n, 5) of every setpoint; returns the largest |u| |C'(u)|, mm.

    Where the position (n, axes) is within `allowed`, mm and rad, of the point that curve (n,) and u (n,) name, that
    point counts. Elsewhere, and where u is NaN, it is the nearest point near the arc length that is named, or else
    near the one that the last two setpoints let expect. A position that is not finite has NaN in all columns.
    state (3,): expected arc length, last one, row; carried on.
    """
    axes = shape[1]
    linear = abs(shape[2])
    last_row = table.shape[0] - 1
    at = np.empty(axes)
    work = np.empty((3, axes))
    row = find_row(table, 0, last_row, START, state[1])
    point(table, row, shape, parameter_in_row(table, row, state[1], 0.0), at)
    before = at.copy()
    row = int(state[2])
    along = 0.0
    for i in range(u.shape[0]):
        finite = True
        for a in range(axes):
            finite = finite and math.isfinite(position[i, a])
        if not finite:
            rows[i] = row
            found[i, :] = math.nan
            state[0], state[1] = 2.0 * state[0] - state[1], state[0]
            continue
        index = curve[i]
        named = 0 <= index < curve_rows.shape[0] and math.isfinite(u[i])
        good = False
        astray = 0.0
        hint = state[0]
        if named:
            row, value, t = _named(table, curve_rows[index, 0], curve_rows[index, 1], row, shape, u[i], at)
            distance, turned = _apart(at, position[i], linear)
            hint = arc_length(table, row, t)
            good = distance <= allowed and turned <= allowed
            astray = 0.0 if good else distance
        if not good:
            row, t, distance, turned = _nearest(
                table, shape, cells, boxes, allowed, hint, -math.inf, position[i], at, work
            )
            if not named:
                moved = 0.0
                for a in range(axes):
                    unit = 1.0 if a < linear else DEGREES if shape[2] <= 0 else 0.0
                    moved += (unit * (position[i, a] - before[a])) ** 2
                row, t, distance, turned = _onward(
                    table, shape, cells, boxes, allowed, state[1], math.sqrt(moved), row, t, distance, turned,
                    position[i], at, work,
                )  # fmt: skip
            value = min(max(table[row, MIDDLE] + t / table[row, SCALE], table[row, LOW]), table[row, HIGH])
        s = arc_length(table, row, t)
        rows[i] = row
        found[i, U] = value
        found[i, S] = s
        found[i, APART] = distance
        found[i, TURNED] = turned
        found[i, ASTRAY] = astray
        along = max(along, abs(value) * speed(table, row, shape, t))
        before[:] = position[i]
        _expect(state, s, i == 0)
    state[2] = row
    return along


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
    growing: bool,
    work: Array,
    out: Array,
) -> bool:
    """Every value that `law_extremes` keeps, at arc length s of one row, into out; False where the curve has C' = 0.

    That is so where C' = 0 lies within the rounding of s, mm: about |C'|^2 / (2 |C''|) away.

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
    out[JERK_UP] = abs(j) if growing else 0.0
    out[JERK_DOWN] = 0.0 if growing else abs(j)
    out[BACKWARDS] = -v
    out[SHARE] = v / feeds[row]
    square = 0.0
    product = 0.0
    third = 0.0
    bends = 0.0
    for k in range(begin, end):
        bends += work[2, k] * work[2, k]
        square += work[1, k] * work[1, k]
        product += work[1, k] * work[2, k]
        third += work[2, k] * work[2, k] + work[1, k] * work[3, k]
    turning = shape[2] <= 0 and end == axes
    if turning:
        square *= DEGREES * DEGREES
        product *= DEGREES * DEGREES
        third *= DEGREES * DEGREES
    c = math.sqrt(square)
    us = 1.0 / c
    uss = -product / (square * square)
    usss = 4.0 * product * product / (square * square * square * c) - third / (square * square * c)
    bend = 0.0
    regular = square > INDISTINCT * rounding * math.sqrt(bends)
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
    return regular


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
    accelerations = np.empty(INSTANTS)
    row = 0
    irregular = 0
    for i in range(coefficients.shape[0]):
        span = breaks[i + 1] - breaks[i]
        end = law_in_piece(coefficients, i, span)
        while row < last_row and coefficients[i, 0] >= table[row + 1, START] - rounding:
            row += 1
        low = 0.0
        for _ in range(last_row + 1):
            cut = row < last_row and end[0] > table[row + 1, START] + rounding
            high = _time_at(coefficients, i, table[row + 1, START], low, span) if cut else span
            for k in range(INSTANTS):
                accelerations[k] = law_in_piece(coefficients, i, _place(low, high, k))[2]
            no_sign = NO_SIGN * np.max(np.abs(accelerations))
            middle_grows = accelerations[INSTANTS // 2] >= 0.0
            for k in range(INSTANTS):
                s, v, a, j = law_in_piece(coefficients, i, _place(low, high, k))
                grows = a > 0.0 if abs(a) > no_sign else middle_grows
                irregular += not _motion(table, feeds, row, shape, rounding, s, v, a, j, grows, work, values[k])
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
                        grows = a > 0.0 if abs(a) > no_sign else middle_grows
                        regular = _motion(table, feeds, row, shape, rounding, s, v, a, j, grows, work, values[INSTANTS])
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

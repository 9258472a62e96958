"""Arithmetic of the check: where on the path setpoints lie, one after the other."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.arc_length import arc_length, parameter_in_row
from splinefeed.kernels.contour import PLACE, ROW, nearest_in_window
from splinefeed.kernels.jit import kernel
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
    point,
    speed,
    turns,
)
from splinefeed.records import Array, IntArray

#: Columns of what `locate` finds: parameter, arc length mm, distance over the linear axes mm, largest deviation of a
#: rotary axis rad, and how far the setpoint is from where its own u says, mm (0 if it has none, or if that is right).
U, S, APART, TURNED, ASTRAY = 0, 1, 2, 3, 4
FOUND = 5
#: Rows that turn, either way, which are searched for a position that its linear axes do not place, the intervals of
#: each at whose ends the search begins, and Newton steps.
TURNING_ROWS = 64
TURNING_INTERVALS = 8
TURNING_STEPS = 10

#: A step along the path this many times as long as its chord may have taken a turn back over the path.
LONGER = 1.05
#: Places that are as near as each other but for so many roundings of arc length are alike.
ROUNDINGS, EPSILON = 64.0, 2.0**-52


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
                for k in range(TURNING_INTERVALS + 1):
                    t = 2.0 * k / TURNING_INTERVALS - 1.0
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

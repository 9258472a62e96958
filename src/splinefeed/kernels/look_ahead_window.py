"""One look-ahead window: from cells to a law that keeps every limit, or the word that there is none."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead import (
    FEED,
    JERK,
    OF_AXES,
    SLOW_DOWN,
    SPEED_UP,
    along,
    fill_rows,
    least_time,
    push_twist,
    uses,
)
from splinefeed.kernels.look_ahead_cells import at_cells, guess, hold_chords, hold_jumps, lay_cells
from splinefeed.kernels.look_ahead_law import hold_law, lay_law
from splinefeed.kernels.pieces import START, Shape, find_row
from splinefeed.kernels.profile import ROW, seven_phase
from splinefeed.records import Array

#: Newton steps of one round at most, and duality gap relative to the time at which it may end.
MOST_STEPS = 60
GAP = 0.05
#: Halvings of q until a first guess is within the limits.
MOST_HALVINGS = 120
#: Rounds in which cells that are over a limit get tighter ones.
ROUNDS = 9
#: Part of every limit, as a factor on q, that the optimiser may use ...
MARGIN = 0.997
#: ... and by how much more than it is over a cell is tightened, ...
TIGHTEN = 1.004
#: ... at most, in one round ...
MOST_TIGHTER = 1.6
#: ... and by which share of that its neighbours are.
SPREAD = 0.5
#: From a state that is given, q falls by no more than twice this share of itself in the first cell.
SLOWEST = 0.25
#: The law may use this part of every limit: what lies between the places looked at has the rest.
KEEP = 0.9995
#: A window from rest to rest that is over by no more than this is stretched in time instead of planned again.
HAIR = 1.012
#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
#: Part of a jerk and an acceleration limit that the ramp at rest may use: its axes' share is known at its ends only.
RAMP_PART = 0.93


@kernel
def _straight(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, limit: Array, nodes: Array, spans: Array,
    law: Array,
) -> int:  # fmt: skip
    """The seven phases of [low, high] if all axes run straight and at one feed there, else 0; outputs of `plan_window`.

    They are exact: limits of axes are limits along the path.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, low)
    work = np.empty((4, axes))
    d = np.empty((3, axes))
    course = np.empty(axes)
    begun = False
    feed = min(limit[FEED], feeds[row])
    while row <= last_row and (not begun or table[row, START] < high):
        for j in range(3):
            along(table, row, shape, j - 1.0, work, d)
            if not begun:
                course[:] = d[0]
                begun = True
            for k in range(axes):
                if not (abs(d[0, k] - course[k]) <= STRAIGHT and abs(d[1, k]) * (high - low) <= STRAIGHT):
                    return 0
        if min(limit[FEED], feeds[row]) != feed:
            return 0
        row += 1
    up, down, jerk = limit[SPEED_UP], limit[SLOW_DOWN], limit[JERK]
    for k in range(axes):
        slope = abs(course[k])
        if slope > 0.0:
            feed = min(feed, limit[OF_AXES + k] / slope)
            up = min(up, limit[OF_AXES + axes + k] / slope)
            down = min(down, limit[OF_AXES + axes + k] / slope)
            jerk = min(jerk, limit[OF_AXES + 2 * axes + k] / slope)
    if not up + down + jerk < math.inf:
        return 0
    profile = np.zeros(ROW)
    seven_phase(high - low, feed, up, down, jerk, jerk, 0.0, 0.0, profile)
    count = 0
    s = low
    v = 0.0
    a = 0.0
    for phase in range(7):
        t = profile[phase]
        twist = 0.0
        if phase == 0 or phase == 6:
            twist = jerk
        elif phase == 2 or phase == 4:
            twist = -jerk
        if phase == 3 or (phase == 1 and profile[0] == 0.0):
            a = 0.0
        if not t > 0.0:
            continue
        nodes[count] = s
        spans[count] = t
        law[count] = 0.0
        law[count, 1] = v
        law[count, 2] = 0.5 * a
        law[count, 3] = twist / 6.0
        s += ((twist / 6.0 * t + 0.5 * a) * t + v) * t
        v += (0.5 * twist * t + a) * t
        a += twist * t
        count += 1
    nodes[count] = high
    return count


@kernel
def plan_window(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, state: Array, rest: Array, limit: Array,
    nodes: Array, spans: Array, law: Array, report: Array,
) -> int:  # fmt: skip
    """Plan [low, high], mm, each end at rest or in a state; how many pieces, 0 if none was found, -1 for no room.

    feeds (rows,): largest feed on each row of the table, mm/s; state (2, 2): feed and acceleration at both ends, where
    rest (2,) is 0; limit: see `kernels.look_ahead`. nodes (room,) are the ends of the pieces, mm; spans (room,) their
    durations, s; law (room, 6) their coefficients, s counted from the start of each. report (4,): largest share of a
    limit that is used, as a factor on q, time, Newton steps, rounds. A law that is found keeps every limit.
    """
    axes = shape[1]
    if rest[0] > 0.0 and rest[1] > 0.0:
        count = _straight(table, feeds, shape, low, high, limit, nodes, spans, law)
        if count > 0:
            report[0] = 1.0
            report[1] = np.sum(spans[:count])
            return count
    ends = np.empty(2)
    jumps = np.empty((table.shape[0] + 1, 1 + 2 * axes))
    samples = np.empty((table.shape[0] + 1, 8))
    cells = np.empty(nodes.shape[0] - 2)
    widest = np.full(2, math.inf)
    for e in range(2):  # q must not fall to nothing within a cell
        if state[e, 1] != 0.0:
            widest[e] = SLOWEST * state[e, 0] * state[e, 0] / abs(state[e, 1])
    n = lay_cells(table, feeds, shape, low, high, rest, widest, limit, cells, ends, jumps, samples)
    if n < 1:
        return -1
    d = np.empty((n + 2, 5, 3, axes))
    bend = np.empty((n + 2, 5))
    top = np.empty((n, 2))
    bound = np.empty(n + 2)
    at_cells(table, feeds, shape, n, cells, ends, limit, d, bend, top, bound)
    hold_chords(n, cells, bend, limit, top, bound)
    node_top = np.full(n + 1, math.inf)
    for e in range(2):
        if ends[e] > 0.0:
            push, twist = push_twist(d[0 if e == 0 else n + 1, 4 if e == 0 else 0], limit)
            most = 1.5 * RAMP_PART * push * ends[e]
            if twist < math.inf:
                most = min(most, (4.5 * RAMP_PART * twist * ends[e] * ends[e]) ** (2.0 / 3.0))
            node_top[0 if e == 0 else n] = most
    calm = np.empty((n, 2))
    hold_jumps(n, cells, jumps, limit, top, node_top, calm, axes)
    h = cells[1 : n + 1] - cells[:n]
    ties = np.full(2, -1.0)
    for e in range(2):
        if rest[e] > 0.0:
            ties[e] = 1.0 / (1.0 + h[0 if e == 0 else n - 1] / (1.5 * ends[e]))
    c = np.empty(n + 2)
    c[0] = state[0, 0] * state[0, 0]
    c[1] = c[0] + state[0, 1] * h[0]
    c[n + 1] = state[1, 0] * state[1, 0]
    c[n] = c[n + 1] - state[1, 1] * h[n - 1] if n > 1 or rest[0] > 0.0 else c[n]
    begin, finish = c[1], c[n]
    guess(n, cells, d[1 : n + 1], top, node_top, limit, ends, c)
    if rest[1] > 0.0:
        c[n + 1] = ties[1] * c[n]
    else:
        c[n] = finish
    if rest[0] > 0.0:
        c[0] = ties[0] * c[1]
    else:
        c[1] = begin
    first = 1 if rest[0] > 0.0 else 0
    free = rest[0] > 0.0 and rest[1] > 0.0
    linear_rows = 3
    jerk_rows = 0
    if min(limit[SPEED_UP], limit[SLOW_DOWN]) < math.inf:
        linear_rows += 2
    if limit[JERK] < math.inf:
        jerk_rows += 2
    for k in range(axes):
        if limit[OF_AXES + axes + k] < math.inf:
            linear_rows += 2
        if limit[OF_AXES + 2 * axes + k] < math.inf:
            jerk_rows += 2
    linear = np.empty((n, linear_rows, 3))
    offset = np.empty(linear_rows)
    jerk = np.empty((n, jerk_rows, 3))
    root = np.empty((n, 2, 3))
    dual = np.empty((n, linear_rows + jerk_rows))
    feeds_at = np.empty((n, 2))
    row_uses = np.empty((n, linear_rows + jerk_rows))
    scale = np.full(n, MARGIN)
    tighter = np.ones(n + 2)
    # a state that is given may be at its limits
    if rest[0] <= 0.0:
        scale[: min(n, 3)] = KEEP
    if rest[1] <= 0.0:
        scale[max(n - 3, 0) :] = KEEP
    found = np.zeros(3)
    over = np.empty(n + 2)
    worst = math.inf
    best = math.inf
    kept = c.copy()
    report[2] = 0.0
    for attempt in range(ROUNDS):
        fill_rows(n, h, ties, d[1 : n + 1], top, node_top, scale, calm, limit, linear, offset, jerk, root)
        steps = least_time(c, h, ends, ties, linear, offset, jerk, root, GAP, MOST_STEPS, dual, attempt > 0, found)
        if attempt == 0 and free and found[2] > 1.0:
            # it did not come within the limits from outside: from inside it takes more steps, but stays there
            c[:] = kept
            for _ in range(MOST_HALVINGS):
                if uses(c, linear, offset, jerk, root, feeds_at, row_uses) < 0.9:
                    break
                c *= 0.5
            steps += least_time(c, h, ends, ties, linear, offset, jerk, root, GAP, 2 * MOST_STEPS, dual, False, found)
        report[2] += steps
        report[3] = attempt + 1.0
        worst = math.inf
        if lay_law(n, cells, c, ends, spans, law):
            worst = hold_law(n, cells, ends, spans, law, d, bend, bound, node_top, calm, limit, over) / KEEP
        if worst <= 1.0 or (free and worst <= HAIR):
            break
        if not worst < math.inf:
            break
        if math.sqrt(worst) * np.sum(spans[: n + 2]) < best:
            best = math.sqrt(worst) * np.sum(spans[: n + 2])
            kept[:] = c
        if found[2] > 1.0 and attempt < ROUNDS - 3:
            continue  # the optimiser is not yet within its own limits
        over[1] = max(over[1], over[0])
        over[n] = max(over[n], over[n + 1])
        for i in range(1, n + 1):
            tighter[i] = min(over[i] / KEEP * TIGHTEN, MOST_TIGHTER) if over[i] > KEEP else 1.0
        for i in range(n):
            beside = max(tighter[i], tighter[i + 2])
            scale[i] /= max(tighter[i + 1], 1.0 + SPREAD * (beside - 1.0))
    if free and not worst <= HAIR and (best < math.inf or lay_law(n, cells, kept, ends, spans, law)):
        # the rounds did not suffice: the one that was best, or else what they began from, is stretched
        lay_law(n, cells, kept, ends, spans, law)
        worst = hold_law(n, cells, ends, spans, law, d, bend, bound, node_top, calm, limit, over) / KEEP
    report[0] = worst
    if not worst < math.inf or (not free and worst > 1.0):
        return 0
    slower = math.sqrt(max(worst, 1.0))
    time = 0.0
    for i in range(n + 2):
        spans[i] *= slower
        power = 1.0
        for k in range(1, 6):
            power /= slower
            law[i, k] *= power
        time += spans[i]
    report[1] = time
    # pieces without a ramp before them begin at the first cell
    for i in range(n + 1):
        nodes[i + first] = cells[i]
    if first == 1:
        nodes[0] = low
    else:
        for i in range(n + 1):
            spans[i] = spans[i + 1]
            law[i] = law[i + 1]
    last = n + first + (1 if rest[1] > 0.0 else 0)
    nodes[last] = high
    return last


@kernel
def window_end(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, rest: Array, limit: Array, count: int
) -> float:
    """Arc length, at most `high`, mm, up to which [low, high] has about `count` cells."""
    ends = np.empty(2)
    jumps = np.empty((table.shape[0] + 1, 1 + 2 * shape[1]))
    samples = np.empty((table.shape[0] + 1, 8))
    cells = np.empty(count + 2)
    widest = np.full(2, math.inf)
    if lay_cells(table, feeds, shape, low, high, rest, widest, limit, cells, ends, jumps, samples) >= 0:
        return high
    return float(cells[count])

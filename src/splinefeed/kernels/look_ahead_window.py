"""One look-ahead window: from cells to a law that keeps every limit, or the word that there is none."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_bounds import JUMPS, hold_chords, hold_jumps, hold_turns
from splinefeed.kernels.look_ahead_cells import PLACES, at_places, lay_cells, look_at, refine, refined_room
from splinefeed.kernels.look_ahead_law import hold_law, lay_law
from splinefeed.kernels.look_ahead_path import (
    JERK_DOWN,
    JERK_UP,
    OF_AXES,
    PERIOD,
    ROUNDING,
    SLOW_DOWN,
    SPEED_UP,
    push_twist,
    still_top,
)
from splinefeed.kernels.look_ahead_profiles import PHASES, crawl, straight, stretch
from splinefeed.kernels.look_ahead_rows import fill_rows, guess, pull_in
from splinefeed.kernels.look_ahead_samples import COLUMNS, bend_behind, sample_room, sample_rows
from splinefeed.kernels.look_ahead_solver import least_time
from splinefeed.kernels.pieces import Shape
from splinefeed.records import Array

#: Newton steps of one round at most, and duality gap relative to the time at which it may end.
MOST_STEPS = 60
GAP = 0.05
#: A plan that keeps every limit with a larger gap is not yet good.
POOR_GAP = 0.2
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
#: A window that must be stretched by more than this is held against the slow profile that always goes.
POOR = 1.2
#: Jumps this many periods before a state that is given count for the motion behind it.
REACH = 2.5
#: An acceleration below this share of the largest in the window has no sign that a jerk limit could go by.
NO_SIGN = 1e-3
#: Part of a jerk and an acceleration limit that the ramp at rest may use: its axes' share is known at its ends only.
RAMP_PART = 0.93


@kernel
def plan_window(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, state: Array, rest: Array, limit: Array,
    nodes: Array, spans: Array, law: Array, report: Array,
) -> int:  # fmt: skip
    """Plan [low, high], mm, each end at rest or in a state; how many pieces, 0 if none was found, -1 for no room.

    feeds (rows, 2): largest feed on each row and at the corner before it; state (2, 2): feed and acceleration at both
    ends, where rest (2,) is 0; limit: see `look_ahead_path`. nodes (room,) are the ends of the pieces, mm; spans
    (room,) their durations, s; law (room, 6) their coefficients, s counted from the start of each. report (4,): largest
    share of a limit that was used before the whole was stretched, as a factor on q, infinite for seven slow phases;
    time, Newton steps times cells, rounds. A law that is found keeps every limit; from rest to rest one always is.
    """
    axes = shape[1]
    free = rest[0] > 0.0 and rest[1] > 0.0
    pieces = straight(table, feeds, shape, low, high, state, limit, nodes, spans, law)
    if pieces > 0:
        report[0] = 1.0
        report[1] = np.sum(spans[:pieces])
        return pieces
    samples = np.empty((sample_room(table.shape[0]), COLUMNS))
    jumps = np.empty((table.shape[0] + 1, JUMPS + 2 * axes))
    reach = REACH * limit[PERIOD] * state[0, 0] if rest[0] <= 0.0 else 0.0
    count, found = sample_rows(table, feeds, shape, low, high, reach, limit, samples, jumps)
    ends = np.empty(2)
    edges = np.empty(nodes.shape[0] + 1)
    cells = edges[1:]
    widest = np.full(2, math.inf)
    for e in range(2):  # q must not fall to nothing within a cell
        if state[e, 1] != 0.0:
            widest[e] = SLOWEST * state[e, 0] * state[e, 0] / abs(state[e, 1])
    n = lay_cells(count, samples, low, high, rest, widest, limit, cells[: nodes.shape[0] - 2], ends)
    if n < 1:
        if not free:
            return -1
        pieces, report[1] = crawl(
            table, feeds, shape, low, high, count, samples, found, jumps, limit, KEEP, nodes, spans, law
        )  # fmt: skip
        report[0] = math.inf
        return pieces
    edges[0] = low
    edges[n + 2] = high
    start = state[0, 0] * state[0, 0]
    d = np.empty((n + 2, PLACES.shape[0], 3, axes))
    bend = np.empty((n + 2, PLACES.shape[0]))
    bound = np.empty(n + 2)
    unsure = np.empty((n + 2, PLACES.shape[0]))
    at_places(table, feeds, shape, n + 2, edges, ROUNDING * high, d, bend, unsure, bound)
    # the law is held against all at places of cells and ramps first, and then of every part of a row in them
    fine = np.empty(refined_room(n + 2, count))
    owners = np.empty(fine.shape[0], dtype=np.int64)
    m = refine(table, n + 2, edges, count, samples, fine, owners)
    m, fine_d, fine_bend, fine_unsure, fine_bound = look_at(table, feeds, shape, m, fine, owners, limit)
    hold_chords(m, fine, fine_bend, bend_behind(table, shape, low, state[0, 0], limit), limit, fine_bound)
    hold_turns(m, fine, found, jumps, limit, fine_bound)
    node_top = np.full(n + 1, math.inf)
    for e in range(2):
        if ends[e] > 0.0:
            push, twist = push_twist(d[0 if e == 0 else n + 1, 4 if e == 0 else 0], limit)
            most = 1.5 * RAMP_PART * push * ends[e]
            if twist < math.inf:
                most = min(most, (4.5 * RAMP_PART * twist * ends[e] * ends[e]) ** (2.0 / 3.0))
            node_top[0 if e == 0 else n] = most
    for k in range(m):
        i = owners[k]
        if 0 < i <= n:
            bound[i] = min(bound[i], fine_bound[k])
        else:  # on a ramp q goes with s^(4/3)
            e = 0 if i == 0 else 1
            s = fine[k + 1] - low if e == 0 else high - fine[k]
            at = e * n
            node_top[at] = min(node_top[at], fine_bound[k] * (ends[e] / s) ** (4.0 / 3.0))
    top = np.empty((n, 2))
    for i in range(n):
        for p in range(2):
            top[i, p] = min(still_top(d[i + 1, 2 * p + 1], bend[i + 1, 2 * p + 1], limit), bound[i + 1])
    calm = np.empty((n, 2))
    hold_jumps(n, cells, low, start, found, jumps, limit, top, node_top, calm)
    owner = np.arange(n + 2)
    edge_top = np.full(n + 2, math.inf)
    edge_top[1:] = node_top
    edge_calm = np.empty((n + 2, 2))
    for i in range(n + 2):
        edge_calm[i] = calm[min(max(i - 1, 0), n - 1)]
    starts = edges[: n + 2]
    fine_top = np.full(m, math.inf)
    fine_calm = np.empty((m, 2))
    for k in range(m):
        fine_calm[k] = edge_calm[owners[k]]
        if fine[k] == edges[owners[k]]:
            fine_top[k] = edge_top[owners[k]]
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
    linear_rows = 3
    jerk_rows = 0
    uneven = limit[JERK_UP] != limit[JERK_DOWN]
    if min(limit[SPEED_UP], limit[SLOW_DOWN]) < math.inf or uneven:
        linear_rows += 2
    steepest = np.full(n, min(limit[JERK_UP], limit[JERK_DOWN]))
    sign = np.zeros(n)
    if steepest[0] < math.inf:
        jerk_rows += 2
    for k in range(axes):
        if limit[OF_AXES + axes + k] < math.inf:
            linear_rows += 2
        if limit[OF_AXES + 2 * axes + k] < math.inf:
            jerk_rows += 2
    linear = np.empty((n, linear_rows, 3))
    offset = np.empty((n, linear_rows))
    jerk = np.empty((n, jerk_rows, 3))
    root = np.empty((n, 2, 3))
    dual = np.empty((n, linear_rows + jerk_rows))
    scale = np.full(n, MARGIN)
    tighter = np.ones(n + 2)
    # a state that is given may be at its limits
    if rest[0] <= 0.0:
        scale[: min(n, 3)] = KEEP
    if rest[1] <= 0.0:
        scale[max(n - 3, 0) :] = KEEP
    solved = np.zeros(3)
    over = np.empty(n + 2)
    worst = math.inf
    best = math.inf
    kept = c.copy()
    begun = c.copy()
    report[2] = 0.0
    for attempt in range(ROUNDS):
        fill_rows(
            n, h, ties, d[1 : n + 1], top, node_top, scale, calm, steepest, sign, limit, linear, offset, jerk, root
        )  # fmt: skip
        begun[:] = c
        steps = least_time(c, h, ends, ties, linear, offset, jerk, root, GAP, MOST_STEPS, dual, attempt > 0, solved)
        # where it did not come within the limits from outside, from inside it takes more steps but stays there
        if solved[2] > 1.0 and pull_in(begun, ties, linear, offset, jerk, root):
            c[:] = begun
            steps += least_time(c, h, ends, ties, linear, offset, jerk, root, GAP, 2 * MOST_STEPS, dual, False, solved)
        report[2] += steps * n
        report[3] = attempt + 1.0
        worst = math.inf
        if lay_law(n, cells, c, ends, spans, law):
            if uneven and attempt == 0:
                _directions(n, law, limit, steepest, sign)
                continue
            worst = hold_law(
                n + 2, edges, owner, starts, spans[: n + 2], law, d, bend, unsure, bound, edge_top, edge_calm,
                limit, over,
            ) / KEEP  # fmt: skip
            if worst <= (HAIR if free else 1.0):
                worst = hold_law(
                    m, fine, owners, starts, spans[: n + 2], law, fine_d, fine_bend, fine_unsure, fine_bound,
                    fine_top, fine_calm, limit, over,
                ) / KEEP  # fmt: skip
        good = worst <= 1.0 or (free and worst <= HAIR)
        if good and (not free or solved[1] <= POOR_GAP or attempt == ROUNDS - 1):
            break
        if not worst < math.inf:
            break
        if math.sqrt(max(worst, 1.0)) * np.sum(spans[: n + 2]) < best:
            best = math.sqrt(max(worst, 1.0)) * np.sum(spans[: n + 2])
            kept[:] = c
        if good:
            continue  # it is slower than it need be
        if solved[2] > 1.0 and attempt < ROUNDS - 3:
            continue  # the optimiser is not yet within its own limits
        if uneven and attempt == ROUNDS - 3:
            steepest[:] = min(limit[JERK_UP], limit[JERK_DOWN])
            sign[:] = 0.0
        over[1] = max(over[1], over[0])
        over[n] = max(over[n], over[n + 1])
        for i in range(1, n + 1):
            tighter[i] = min(over[i] / KEEP * TIGHTEN, MOST_TIGHTER) if over[i] > KEEP else 1.0
        for i in range(n):
            beside = max(tighter[i], tighter[i + 2])
            scale[i] /= max(tighter[i + 1], 1.0 + SPREAD * (beside - 1.0))
    if free and not worst <= HAIR:
        # the rounds did not suffice: the one that was best is stretched, or the slow profile that always goes
        worst = math.inf
        if best < math.inf and lay_law(n, cells, kept, ends, spans, law):
            worst = hold_law(
                m, fine, owners, starts, spans[: n + 2], law, fine_d, fine_bend, fine_unsure, fine_bound,
                fine_top, fine_calm, limit, over,
            ) / KEEP  # fmt: skip
    # an optimiser that got nowhere, as where numbers overflow, may leave a motion next to rest for ever
    lost = free and not solved[1] <= POOR_GAP
    if lost or (free and not math.sqrt(worst) <= POOR):
        time = math.sqrt(max(worst, 1.0)) * np.sum(spans[: n + 2]) if worst < math.inf else math.inf
        slow_law = np.empty((PHASES, law.shape[1]))
        slow_spans = np.empty(PHASES)
        slow_nodes = np.empty(PHASES + 1)
        pieces, slow_time = crawl(
            table, feeds, shape, low, high, count, samples, found, jumps, limit, KEEP, slow_nodes, slow_spans,
            slow_law,
        )  # fmt: skip
        if pieces > 0 and slow_time < time:
            nodes[: pieces + 1] = slow_nodes[: pieces + 1]
            spans[:pieces] = slow_spans[:pieces]
            law[:pieces] = slow_law[:pieces]
            report[0] = math.inf
            report[1] = slow_time
            return pieces
    report[0] = math.inf if lost else worst
    if not worst < math.inf or (not free and worst > 1.0):
        return 0
    stretch(n + 2, math.sqrt(max(worst, 1.0)), spans, law)
    report[1] = np.sum(spans[: n + 2])
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
def _directions(n: int, law: Array, limit: Array, steepest: Array, sign: Array) -> None:
    """The tangential jerk (n,) in each cell, and the sign (n,) of acceleration where it is the same all over it."""
    largest = np.max(np.abs(law[1 : n + 1, 2]))
    for i in range(n):
        before = law[i + 1, 2]
        after = law[i + 2, 2] if i + 1 < n else before
        steepest[i] = min(limit[JERK_UP], limit[JERK_DOWN])
        if min(before, after) > NO_SIGN * largest:
            steepest[i], sign[i] = limit[JERK_UP], 1.0
        if max(before, after) < -NO_SIGN * largest:
            steepest[i], sign[i] = limit[JERK_DOWN], -1.0


@kernel
def window_end(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, rest: Array, limit: Array, count: int
) -> float:
    """Arc length, at most `high`, mm, up to which [low, high] has about `count` cells."""
    ends = np.empty(2)
    samples = np.empty((sample_room(table.shape[0]), COLUMNS))
    jumps = np.empty((table.shape[0] + 1, JUMPS + 2 * shape[1]))
    cells = np.empty(count + 2)
    widest = np.full(2, math.inf)
    parts, _ = sample_rows(table, feeds, shape, low, high, 0.0, limit, samples, jumps)
    if lay_cells(parts, samples, low, high, rest, widest, limit, cells, ends) >= 0:
        return high
    return float(cells[count])

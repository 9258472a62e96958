"""Seven phases over a look-ahead window: exact where all axes run straight, slow where nothing else is found."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_bounds import JUMPS, hold_chords, hold_jumps, hold_turns
from splinefeed.kernels.look_ahead_cells import look_at, refine, refined_room
from splinefeed.kernels.look_ahead_law import hold_law
from splinefeed.kernels.look_ahead_path import (
    AT_CORNER,
    FEED,
    JERK_DOWN,
    JERK_UP,
    OF_AXES,
    ON_ROW,
    SLOW_DOWN,
    SPEED_UP,
    along,
    still_top,
)
from splinefeed.kernels.look_ahead_samples import COLUMNS, PUSH, SLOW, TOP, TWIST, sample_room, sample_rows
from splinefeed.kernels.pieces import START, Shape, find_row
from splinefeed.kernels.profile import ROW, SOLVED, lasting_jerk, seven_phase
from splinefeed.records import Array

#: Phases, and pieces of a profile, at most.
PHASES = 7
#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line.
STRAIGHT = 1e-12
#: Rounding of late instants, s.
LATE = 2e-12
#: Where nothing limits acceleration or jerk along the path, these many ramps of it fit into the window.
RAMPS = 10.0
#: Feeds of the slow profile that are tried, from the fastest that is possible anywhere, q each this share of the last.
FEEDS, SLOWER = 20, 0.1
#: The slow profile begins from this share of what the limits allow along the path.
CAREFUL = 0.5


@kernel
def straight(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, state: Array, limit: Array, nodes: Array,
    spans: Array, law: Array,
) -> int:  # fmt: skip
    """The phases of [low, high], mm, if all axes run straight and at one feed there, else 0; outputs of `plan_window`.

    They are exact: limits of axes are limits along the path. state (2, 2): feeds and accelerations at the ends, which
    must not accelerate.
    """
    axes = shape[1]
    last_row = table.shape[0] - 1
    row = find_row(table, 0, last_row, START, low)
    work = np.empty((4, axes))
    d = np.empty((3, axes))
    course = np.empty(axes)
    begun = False
    feed = min(limit[FEED], feeds[row, ON_ROW])
    if state[0, 1] != 0.0 or state[1, 1] != 0.0:
        return 0
    while row <= last_row and (not begun or table[row, START] < high):
        if begun and feeds[row, AT_CORNER] < math.inf:
            return 0
        for j in range(3):
            if along(table, row, shape, j - 1.0, 0.0, work, d) < 0.0:
                return 0
            if not begun:
                course[:] = d[0]
                begun = True
            for k in range(axes):
                if not (abs(d[0, k] - course[k]) <= STRAIGHT and abs(d[1, k]) * (high - low) <= STRAIGHT):
                    return 0
        if min(limit[FEED], feeds[row, ON_ROW]) != feed:
            return 0
        row += 1
    up, down = limit[SPEED_UP], limit[SLOW_DOWN]
    jerk_up, jerk_down = limit[JERK_UP], limit[JERK_DOWN]
    for k in range(axes):
        slope = abs(course[k])
        if slope > 0.0:
            feed = min(feed, limit[OF_AXES + k] / slope)
            up = min(up, limit[OF_AXES + axes + k] / slope)
            down = min(down, limit[OF_AXES + axes + k] / slope)
            jerk_up = min(jerk_up, limit[OF_AXES + 2 * axes + k] / slope)
            jerk_down = min(jerk_down, limit[OF_AXES + 2 * axes + k] / slope)
    jerk_up, jerk_down = lasting_jerk(up, jerk_up, LATE), lasting_jerk(down, jerk_down, LATE)
    if not up + down + jerk_up + jerk_down < math.inf or max(state[0, 0], state[1, 0]) > feed:
        return 0
    profile = np.zeros(ROW)
    done = seven_phase(high - low, feed, up, down, jerk_up, jerk_down, state[0, 0], state[1, 0], profile)
    return _pieces(profile, low, high, jerk_up, jerk_down, state[0, 0], nodes, spans, law) if done == SOLVED else 0


@kernel
def _pieces(
    profile: Array, low: float, high: float, jerk_up: float, jerk_down: float, feed: float, nodes: Array, spans: Array,
    law: Array,
) -> int:  # fmt: skip
    """The phases of a profile that last, as pieces; how many."""
    count = 0
    s = low
    v = feed
    a = 0.0
    for phase in range(PHASES):
        t = profile[phase]
        twist = 0.0
        if phase == 0:
            twist = jerk_up
        elif phase == 2:
            twist = -jerk_up
        elif phase == 4:
            twist = -jerk_down
        elif phase == 6:
            twist = jerk_down
        if phase == 3:
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
def crawl(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, count: int, samples: Array, found: int,
    jumps: Array, limit: Array, keep: float, nodes: Array, spans: Array, law: Array,
) -> tuple[int, float]:  # fmt: skip
    """From rest to rest over [low, high], mm, in seven phases so slow that every limit holds; pieces, and time, s.

    What a profile is over, the whole is stretched by; of those of several feeds the one that is then fastest counts.
    samples (count,), jumps (found,): see `sample_rows`; keep: part of every limit that may be used. Outputs of
    `plan_window`.
    """
    least = math.inf
    most = 0.0
    push = min(limit[SPEED_UP], limit[SLOW_DOWN])
    twist = min(limit[JERK_UP], limit[JERK_DOWN])
    for i in range(count):
        least = min(least, samples[i, TOP], samples[i, SLOW])
        most = max(most, samples[i, TOP])
        push = min(push, samples[i, PUSH])
        twist = min(twist, samples[i, TWIST])
    length = high - low
    if not (0.0 < most < math.inf and length > 0.0):
        return 0, math.inf
    best = math.inf
    top = most
    chosen = 0.0
    # the slowest place may be one next to rest, which any profile passes slowly
    for _ in range(FEEDS):
        pieces, slower = _steadily(
            table, feeds, shape, low, high, count, samples, found, jumps, limit, top, push, twist, nodes, spans, law
        )  # fmt: skip
        time = slower * np.sum(spans[:pieces]) if pieces > 0 else math.inf
        if time < best:
            best = time
            chosen = top
        if not top > least:
            break
        top = max(SLOWER * top, least)
    if not best < math.inf:
        return 0, math.inf
    pieces, slower = _steadily(
        table, feeds, shape, low, high, count, samples, found, jumps, limit, chosen, push, twist, nodes, spans, law
    )  # fmt: skip
    slower *= math.sqrt(1.0 / keep)
    stretch(pieces, slower, spans, law)
    return pieces, np.sum(spans[:pieces])


@kernel
def _steadily(
    table: Array, feeds: Array, shape: Shape, low: float, high: float, count: int, samples: Array, found: int,
    jumps: Array, limit: Array, top: float, push: float, twist: float, nodes: Array, spans: Array, law: Array,
) -> tuple[int, float]:  # fmt: skip
    """A profile of seven phases up to a q of `top`: how many pieces, and how many times longer it must last."""
    feed = math.sqrt(top)
    up = CAREFUL * min(push, RAMPS * top / (high - low))
    rise = CAREFUL * min(twist, RAMPS * feed * up / (high - low))
    profile = np.zeros(ROW)
    if not feed > 0.0 or seven_phase(high - low, feed, up, up, rise, rise, 0.0, 0.0, profile) != SOLVED:
        return 0, math.inf
    pieces = _pieces(profile, low, high, rise, rise, 0.0, nodes, spans, law)
    worst = _held(
        table, feeds, shape, low, count, samples, found, jumps, limit, top, pieces, nodes, spans, law
    )  # fmt: skip
    return pieces, math.sqrt(max(worst, 1.0)) if worst < math.inf else math.inf


@kernel
def _held(
    table: Array, feeds: Array, shape: Shape, low: float, count: int, samples: Array, found: int, jumps: Array,
    limit: Array, fastest: float, pieces: int, nodes: Array, spans: Array, law: Array,
) -> float:  # fmt: skip
    """By how much q of a law from rest to rest must come down to keep every limit; it is below `fastest` everywhere."""
    fine = np.empty(refined_room(pieces, count))
    owner = np.empty(fine.shape[0], dtype=np.int64)
    m = refine(table, pieces, nodes[: pieces + 1], count, samples, fine, owner)
    m, d, bend, unsure, bound = look_at(table, feeds, shape, m, fine, owner, limit)
    edge_top = np.full(m + 1, math.inf)
    calm = np.empty((m, 2))
    hold_chords(m, fine, bend, 0.0, limit, bound)
    hold_turns(m, fine, found, jumps, limit, bound)
    tops = np.empty((m, 2))
    for i in range(m):
        for p in range(2):
            tops[i, p] = min(bound[i], fastest, still_top(d[i, 2 * p + 1], bend[i, 2 * p + 1], limit))
    hold_jumps(m, fine, low, 0.0, found, jumps, limit, tops, edge_top, calm)
    over = np.empty(pieces)
    return hold_law(
        m, fine, owner, nodes[:pieces], spans[:pieces], law, d, bend, unsure, bound, edge_top, calm, limit, over
    )  # fmt: skip


@kernel
def held(
    table: Array, feeds: Array, shape: Shape, limit: Array, pieces: int, nodes: Array, spans: Array, law: Array
) -> float:
    """By how much q of a law must come down for it to keep every limit; nodes (pieces + 1,) mm, spans (pieces,) s.

    feeds (rows, 2), limit, law (pieces, 6): see `plan_window`. What lies before and behind it is not looked at.
    """
    low, high = nodes[0], nodes[pieces]
    samples = np.empty((sample_room(table.shape[0]), COLUMNS))
    jumps = np.empty((table.shape[0] + 1, JUMPS + 2 * shape[1]))
    count, found = sample_rows(table, feeds, shape, low, high, 0.0, limit, samples, jumps)
    return _held(
        table, feeds, shape, low, count, samples, found, jumps, limit, math.inf, pieces, nodes, spans, law
    )  # fmt: skip


@kernel
def stretch(pieces: int, slower: float, spans: Array, law: Array) -> None:
    """Make pieces of a law last so many times longer."""
    for i in range(pieces):
        spans[i] *= slower
        power = 1.0
        for k in range(1, law.shape[1]):
            power /= slower
            law[i, k] *= power

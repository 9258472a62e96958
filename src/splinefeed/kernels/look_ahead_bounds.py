"""Bounds of the feed in a look-ahead window that reach over more than one place: jumps of the path, and chords."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.kernels.jit import kernel
from splinefeed.kernels.look_ahead_path import CHORD, FEED, OF_AXES, PERIOD, chord_top
from splinefeed.records import Array

#: Columns of jumps behind the arc length: largest q at a corner that is passed; by what angle the tangent turns at
#: another, rad, and the greatest curvature beside it, 1/mm; jumps of r' of each axis, then of r''.
CAP, TURNED, BESIDE, JUMPS = 1, 2, 3, 4
#: A jump of velocity or acceleration may use this much of the limits that a drive sees; the smooth motion the rest.
JUMP_SHARE = 0.5
#: Part of the limits that is always left to the smooth motion.
LEAST_CALM = 1e-2
#: Curvature is taken this much larger, for what lies between the places looked at.
CHORD_MARGIN = 1.01
#: q at a jump behind a state that is given, at most, relative to the state's.
BEHIND = 1.1


@kernel
def jump_top(sum1: float, sum2: float, axis: int, axes: int, limit: Array) -> float:
    """Largest q at jumps sum1 of r' and sum2 of r'' of one axis, by the share of its limits that they may use."""
    top = math.inf
    period = limit[PERIOD]
    a = JUMP_SHARE * limit[OF_AXES + axes + axis]
    j = JUMP_SHARE * limit[OF_AXES + 2 * axes + axis]
    if period > 0.0 and sum1 > 0.0:
        top = min(top, (min(0.5 * j * period, a) * period / sum1) ** 2)
    if period > 0.0 and sum2 > 0.0:
        top = min(top, j * period / (0.75 * sum2) * (0.5 if sum1 > 0.0 else 1.0))
    return top


@kernel
def hold_chords(m: int, edges: Array, bend: Array, behind: float, limit: Array, bound: Array) -> None:
    """Lower bounds of q (m,) in intervals between edges (m + 1,), mm, to the chord error.

    bend (m, places): curvatures in the intervals; what counts is the largest one that a step of the period comes to: a
    feed is well by which a step does not, v <= max(v by that curvature, distance / period). `behind` is the curvature
    before the first edge.
    """
    if not (limit[CHORD] < math.inf and limit[PERIOD] > 0.0):
        return
    most = np.empty(m)  # q by the curvature in each
    for i in range(m):
        most[i] = chord_top(CHORD_MARGIN * np.max(bend[i]), limit)
    most_behind = chord_top(CHORD_MARGIN * behind, limit)
    for i in range(m):
        q = min(bound[i], most[i])
        left, right = i - 1, i + 1
        while left > -2 or right < m:
            before = edges[i] - edges[left + 1] if left > -2 else math.inf
            after = edges[right] - edges[i + 1] if right < m else math.inf
            reached = min(before, after) / limit[PERIOD]
            if reached * reached >= q:
                break
            if before <= after:
                there = most[left] if left >= 0 else most_behind
                left -= 1
            else:
                there = most[right]
                right += 1
            q = min(q, max(there, reached * reached))
        bound[i] = q


@kernel
def turn_cap(angle: float, kappa: float, limit: Array) -> float:
    """Largest q at which a step of the period across a turn of the tangent, rad, stays within the chord error delta.

    A step of length d leaves its chord by at most d angle/4 + kappa d^2/8, kappa being the curvature beside, 1/mm.
    """
    if not (limit[CHORD] < math.inf and limit[PERIOD] > 0.0) or angle <= 0.0:
        return math.inf
    quarter = 0.25 * angle
    step = 2.0 * limit[CHORD] / (quarter + math.sqrt(quarter * quarter + 0.5 * CHORD_MARGIN * kappa * limit[CHORD]))
    return (step / limit[PERIOD]) ** 2 / CHORD_MARGIN


@kernel
def hold_turns(m: int, edges: Array, found: int, jumps: Array, limit: Array, bound: Array) -> None:
    """Lower bounds of q (m,) in intervals between edges (m + 1,), mm, to the chord error where the tangent turns.

    jumps (found,): see `sample_rows`. All that one step may come to count together; a feed is well where a step does
    not reach them, as in `hold_chords`.
    """
    if not (limit[CHORD] < math.inf and limit[PERIOD] > 0.0):
        return
    for g in range(found):
        if not jumps[g, TURNED] > 0.0:
            continue
        s = jumps[g, 0]
        q = min(limit[FEED] * limit[FEED], turn_cap(jumps[g, TURNED], jumps[g, BESIDE], limit))
        for _ in range(3):
            reach = limit[PERIOD] * math.sqrt(q)
            angle = 0.0
            kappa = 0.0
            k = g
            while k >= 0 and jumps[k, 0] >= s - reach:
                angle += jumps[k, TURNED]
                kappa = max(kappa, jumps[k, BESIDE])
                k -= 1
            k = g + 1
            while k < found and jumps[k, 0] <= s + reach:
                angle += jumps[k, TURNED]
                kappa = max(kappa, jumps[k, BESIDE])
                k += 1
            q = min(q, turn_cap(angle, kappa, limit))
        left = min(max(int(np.searchsorted(edges[: m + 1], s)) - 1, 0), m - 1)
        for way in range(2):
            i = left if way == 0 else left + 1
            while 0 <= i < m:
                apart = max(edges[i] - s, s - edges[i + 1], 0.0) / limit[PERIOD]
                if apart * apart >= bound[i]:
                    if apart * apart >= limit[FEED] * limit[FEED]:
                        break
                else:
                    bound[i] = min(bound[i], max(q, apart * apart))
                i += -1 if way == 0 else 1


@kernel
def hold_jumps(
    n: int, nodes: Array, low: float, start: float, found: int, jumps: Array, limit: Array, top: Array,
    node_top: Array, calm: Array,
) -> None:  # fmt: skip
    """Bounds of q at nodes where r' or r'' jumps, and the share of the limits that is left to the motion about them.

    A jump D1 of r' is seen as an acceleration D1 v/T and a jerk of at most D1 v/T^2, a jump D2 of r'' as a jerk of at
    most 3/4 D2 q/T: the peaks of the B-splines that differences over the period T are means with. What lies within two
    periods of a jump is counted with it. Jumps up to `low`, mm, were passed at a q of about `start` or below.
    top (n, 2), node_top (n + 1,): bounds of q at Gauss places and at nodes; calm (n, 2): shares of acceleration, jerk.
    """
    period = limit[PERIOD]
    axes = (jumps.shape[1] - JUMPS) // 2
    calm[:] = 1.0
    i = 0
    for g in range(found):
        s = jumps[g, 0]
        while i < n and nodes[i] < s:
            i += 1
        if s <= low:
            q = BEHIND * start
        else:
            q = min(node_top[i], jumps[g, CAP])
            for j in range(max(i - 1, 0), min(i + 1, n)):
                q = min(q, top[j, 0], top[j, 1])
        most = q
        left = g
        right = g
        if period > 0.0:
            for _ in range(3):
                reach = 2.0 * period * math.sqrt(most)
                left = g
                while left > 0 and jumps[left - 1, 0] > s - reach:
                    left -= 1
                right = g
                while right + 1 < found and jumps[right + 1, 0] < s + reach:
                    right += 1
                bound = q
                for k in range(axes):
                    sum1 = 0.0
                    sum2 = 0.0
                    for j in range(left, right + 1):
                        sum1 += jumps[j, JUMPS + k]
                        sum2 += jumps[j, JUMPS + axes + k]
                    bound = min(bound, jump_top(sum1, sum2, k, axes, limit))
                most = bound
        if s > low:
            node_top[i] = min(node_top[i], most)
            if nodes[i] != s and i > 0:  # it lies next to a node, or within a ramp
                node_top[i - 1] = min(node_top[i - 1], most)
        if period <= 0.0:
            continue
        share1 = 0.0
        share = 0.0
        feed = math.sqrt(most)
        for k in range(axes):
            a = limit[OF_AXES + axes + k]
            j3 = limit[OF_AXES + 2 * axes + k]
            sum1 = 0.0
            sum2 = 0.0
            for j in range(left, right + 1):
                sum1 += jumps[j, JUMPS + k]
                sum2 += jumps[j, JUMPS + axes + k]
            share1 = max(share1, sum1 * feed / (a * period))
            share = max(share, (sum1 * feed / period + 0.75 * sum2 * most) / (j3 * period))
        if max(share, share1) < 1e-9:
            continue
        reach = 2.0 * period * math.sqrt(min(q, 4.0 * most))
        begin = min(i, n - 1)
        while begin > 0 and nodes[begin] >= s - reach:
            begin -= 1
        j = begin
        while j < n and nodes[j] <= s + reach:
            if nodes[j + 1] >= s - reach:
                calm[j, 0] = min(calm[j, 0], max(1.0 - share1, LEAST_CALM))
                calm[j, 1] = min(calm[j, 1], max(1.0 - share, LEAST_CALM))
            j += 1

"""Rotary axes as setpoints show them: where the rounding of arc length takes of their limits, motion is slower."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.audit import BLOCK, joined
from splinefeed.feed.bounds import AxisLimits
from splinefeed.feed.corners import passed_corners
from splinefeed.feed.stretches import lasting, on_tick
from splinefeed.geometry.path import Path
from splinefeed.records import LAW_COEFFICIENTS, Array, IntArray, Limits, TimeLaw

#: Rounds of slowing down; what is over a limit still, or over it by this factor on q, is no matter of feed. Next to an
#: end in motion, where nothing is slowed down, that is what the check would not let go.
ROUNDS, FAR, FAR_IN_MOTION = 4, 2.0, 1.0 + 1e-9
#: So many setpoints are looked at, at most: eleven days at 1 ms, in minutes.
MOST_TICKS = 1e9
EPSILON = float(np.finfo(np.float64).eps)


def held_at_ticks(law: TimeLaw, path: Path, limits: Limits) -> TimeLaw:
    """The law, slower from one rest to the next where differences of its setpoints are over a limit of an axis.

    |D^k r| / T^k <= limit + 2^k eps max |r| / T^k  for k = 1, 2, 3 and the setpoints r at every tick. Arc length is
    rounded to eps times the length of the path; a rotary axis that turns far within little of the path shows that, and
    where it has limits all ticks are looked at. What is next to an end in motion cannot be slowed down.
    Raises PlanError there, where it is the rounding that is over the limit, which no feed changes, and over MOST_TICKS.
    """
    axes = AxisLimits.of(limits, path.axes)
    bounds = (axes.velocity + 0.0, axes.acceleration, axes.jerk)
    if law.period is None or not any(np.any(np.isfinite(bound[path.linear :])) for bound in bounds):
        return law
    if law.duration > MOST_TICKS * law.period:
        raise PlanError(
            f"the motion would take {law.duration:.3g} s, which is more than the {MOST_TICKS:.0e} setpoints that are "
            "held to the limits of rotary axes; ask for more feed or a longer period, or leave those limits out"
        )
    passed = passed_corners(path, limits, axes, law.period)[0]
    for _ in range(ROUNDS):
        rests = np.flatnonzero(law.coefficients[:, 1] == 0.0)
        first = np.unique(np.append(0, rests))  # a piece from rest, or the first one, and all up to the next
        over, worst = _over(law, path, limits, bounds, law.breaks[first], passed)
        moving = np.zeros(len(first), dtype=bool)
        moving[0] = limits.start_feed > 0.0
        moving[-1] |= limits.end_feed > 0.0
        if not np.any(over > np.where(moving, FAR_IN_MOTION, 1.0)):
            return law
        if np.any(over > np.where(moving, FAR_IN_MOTION, FAR)):
            break
        law = _slower(law, first, np.where(moving, 1.0, over))
    k = int(np.argmax(np.where(moving & (over > FAR_IN_MOTION), np.inf, over)))
    s, axis = worst[k]
    where = f"at s = {s:.6g} mm the setpoints of {path.axes[int(axis)]} are over its limits"
    if moving[k]:
        raise PlanError(
            f"{where}, and next to an end in motion nothing can be slowed down; ask for rest there or for less feed, "
            "or leave the limits of that axis out"
        )
    raise PlanError(
        f"{where} at any feed: it turns so far within so little of the path that the rounding of arc length shows, "
        f"{EPSILON * path.length:.3g} mm; split the path there, let the linear axes stand exactly, or leave the limits "
        "of that axis out"
    )


def _over(
    law: TimeLaw, path: Path, limits: Limits, bounds: tuple[Array, Array, Array], begins: Array, passed: Array
) -> tuple[Array, Array]:
    """By how much q of each stretch (m,) must come down for its ticks, and where and in which axis that is, (m, 2).

    begins (m,): when they begin, s; passed (k,): arc lengths of corners in passing, mm, held by a limit of their own.
    """
    period = float(law.period or 0.0)
    over, worst = np.zeros(len(begins)), np.zeros((len(begins), 2))
    count = math.floor(law.duration / period * (1.0 + 1e-12) + 1e-9) + 1
    before, after = -3 if limits.start_feed == 0.0 else 0, 3 if limits.end_feed == 0.0 else 0
    size = np.zeros(len(path.axes))
    for block in range(before, count + after, BLOCK):
        k: IntArray = np.arange(max(block - 3, before), min(block + BLOCK, count + after))
        t = k * period
        s = law(t)
        points = joined(path, s)
        size = np.maximum(size, np.max(np.abs(points), axis=0))
        owner = np.clip(np.searchsorted(begins, t[:-1] + 0.5 * period, side="right") - 1, 0, None)
        step = points
        for order, bound in enumerate(bounds, start=1):
            step = np.diff(step, axis=0)
            if len(step) == 0:
                break
            shares = (np.abs(step) - 2.0**order * EPSILON * size) / period**order / bound
            axis = np.argmax(shares, axis=1)
            share = np.take_along_axis(shares, axis[:, None], axis=1)[:, 0]
            if len(passed) and order > 1:
                share[np.searchsorted(passed, s[order:]) > np.searchsorted(passed, s[:-order], side="right")] = 0.0
            share = np.maximum(share, 0.0) ** (2.0 / order)
            for i in range(order):
                stretch = owner[i : len(owner) - (order - 1 - i)]
                more = np.flatnonzero(share > np.maximum(over[stretch], 1.0))
                if len(more):
                    more = more[np.argsort(share[more], kind="stable")]  # the largest one of a stretch is put last
                    over[stretch[more]] = share[more]
                    worst[stretch[more]] = np.column_stack([s[more], axis[more]])
    return over, worst


def _slower(law: TimeLaw, first: IntArray, over: Array) -> TimeLaw:
    """The law whose stretches, from pieces first (m,) on, last whole periods longer, enough for q by over (m,) less."""
    period = float(law.period or 0.0)
    edges = np.append(first, len(law.coefficients))
    seconds = np.diff(law.breaks[edges])
    ticks = np.where(over > 1.0, np.maximum(np.ceil(seconds * (np.sqrt(over) - 1.0) / period), 1.0), 0.0)
    factor = np.repeat(1.0 + ticks * period / seconds, np.diff(edges))
    shift = np.concatenate([[0.0], np.cumsum(ticks) * period])
    breaks = np.empty(len(law.breaks))
    for i in range(len(first)):
        begin, end = edges[i], edges[i + 1]
        start = on_tick(float(law.breaks[begin]) + shift[i], period)
        breaks[begin:end] = start + (law.breaks[begin:end] - law.breaks[begin]) * factor[begin]
    breaks[-1] = on_tick(float(law.breaks[-1]) + shift[-1], period)
    breaks, coefficients = lasting(breaks, law.coefficients / factor[:, None] ** np.arange(LAW_COEFFICIENTS))
    return replace(law, breaks=breaks, coefficients=coefficients)

"""What every strategy shares: time at rest put into a law, stretches of it slowed down, instants put on ticks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.constants import ALMOST, SAME
from splinefeed.records import LAW_COEFFICIENTS, Array, IntArray, TimeLaw


def on_tick(time: float, period: float | None) -> float:
    """An instant, s, put on a tick where it is on one but for rounding."""
    if period is None or abs(time / period - round(time / period)) > ALMOST:
        return time
    return round(time / period) * period


def with_dwells(law: TimeLaw, dwells: Sequence[tuple[float, float]], length: float) -> TimeLaw:
    """Put a piece of constant s into a law wherever the path waits.

    Parameters
    ----------
    law : TimeLaw
        The law.
    dwells : sequence of (float, float)
        Where, mm, and how long, s; made whole periods.
    length : float
        Of the path, mm.

    Returns
    -------
    TimeLaw
        The law that waits.

    Raises
    ------
    PlanError
        Where the law does not stop at such a place.
    """
    if not dwells:
        return law
    top, starts = float(np.max(law.coefficients[:, 1])), law.coefficients[:, 0]
    at, begins, shifts = [], [], [0.0]
    for s, seconds in dwells:
        k, feed = len(starts), float(law.feed(law.duration))
        if s < length * (1.0 - SAME):
            # several pieces may begin there but for rounding, some of them in motion
            near = np.searchsorted(starts, [s - SAME * length, s + SAME * length], side="right")
            feeds = np.abs(law.coefficients[near[0] : near[1], 1])
            k = int(near[0] + np.argmin(feeds)) if len(feeds) else -1
            feed = float(law.coefficients[k, 1]) if k >= 0 else math.inf
        if feed > ALMOST * top:
            raise PlanError(f"the law does not stop at s = {s:.9g} mm, where the path waits {seconds:g} s")
        begin = on_tick(float(law.breaks[k]) + shifts[-1], law.period)
        wait = seconds if law.period is None else math.ceil(seconds / law.period - ALMOST) * law.period
        at.append(k)
        begins.append(begin)
        shifts.append(on_tick(begin + wait, law.period) - float(law.breaks[k]))
    breaks = law.breaks + np.array(shifts)[np.searchsorted(at, np.arange(len(law.breaks)), side="right")]
    breaks[-1] = on_tick(float(breaks[-1]), law.period)
    still = np.zeros((len(at), LAW_COEFFICIENTS))
    still[:, 0] = np.append(starts, law.length)[at]
    instants = np.insert(breaks, at, begins)
    lasts = np.diff(instants) > 0.0  # a piece of one rounding of its instant is none at a later one
    rows = np.insert(law.coefficients, at, still, axis=0)[lasts]
    return replace(law, breaks=instants[np.append(True, lasts)], coefficients=rows)


def stretched(law: TimeLaw, first: Sequence[int] | IntArray, more: Sequence[float] | Array) -> TimeLaw:
    """The law whose stretches, from pieces first (m,) on, are slowed down as a whole to last `more` (m,), s, longer."""
    edges = np.append(first, len(law.coefficients))
    seconds, pieces = np.diff(law.breaks[edges]), np.diff(edges)
    factor = np.repeat(1.0 + np.asarray(more) / seconds, pieces)
    ends = law.breaks[edges] + np.append(0.0, np.cumsum(more))
    begins = np.array([on_tick(each, law.period) for each in ends.tolist()])
    into = law.breaks[:-1] - np.repeat(law.breaks[edges[:-1]], pieces)
    breaks = np.append(np.repeat(begins[:-1], pieces) + into * factor, begins[-1])
    return replace(law, breaks=breaks, coefficients=law.coefficients / factor[:, None] ** np.arange(LAW_COEFFICIENTS))

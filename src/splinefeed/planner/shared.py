"""What every strategy shares: time at rest put into a law, instants put on ticks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.planner.constants import ALMOST, SAME
from splinefeed.records import LAW_COEFFICIENTS, Array, TimeLaw

#: No stretch may last longer, s: thirty years.
LONGEST = 1e9


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
    top = float(np.max(law.coefficients[:, 1]))
    starts = law.coefficients[:, 0]
    breaks: list[Array] = []
    pieces: list[Array] = []
    done = 0
    shift = 0.0

    for s, seconds in dwells:
        if s >= length * (1.0 - SAME):
            k, feed = len(starts), float(law.feed(law.duration))
        else:
            # several pieces may begin there but for rounding, some of them in motion: the slowest, then the nearest
            near = np.searchsorted(starts, [s - SAME * length, s + SAME * length], side="right")
            begin_there = np.arange(near[0], near[1])
            rank = np.lexsort((np.abs(starts[begin_there] - s), np.abs(law.coefficients[begin_there, 1])))
            k = int(begin_there[rank[0]]) if len(rank) else -1
            feed = float(law.coefficients[k, 1]) if k >= 0 else math.inf
        if feed > ALMOST * top:
            raise PlanError(f"the law does not stop at s = {s:.9g} mm, where the path waits {seconds:g} s")
        breaks.append(law.breaks[done:k] + shift)
        pieces.append(law.coefficients[done:k])
        begin = on_tick(float(law.breaks[k]) + shift, law.period)
        wait = seconds if law.period is None else math.ceil(seconds / law.period - ALMOST) * law.period
        still = np.zeros((1, LAW_COEFFICIENTS))
        still[0, 0] = starts[k] if k < len(starts) else law.length
        breaks.append(np.array([begin]))
        pieces.append(still)
        shift = on_tick(begin + wait, law.period) - float(law.breaks[k])
        done = k
    breaks += [law.breaks[done:-1] + shift, np.array([on_tick(float(law.breaks[-1]) + shift, law.period)])]
    pieces.append(law.coefficients[done:])
    instants = np.concatenate(breaks)
    lasts = np.diff(instants) > 0.0  # a piece of one rounding of its instant is none at a later one
    return replace(law, breaks=instants[np.append(True, lasts)], coefficients=np.concatenate(pieces)[lasts])

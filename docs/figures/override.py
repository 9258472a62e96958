"""Make the numbers of docs/math/override.md anew, between markers: holds at random places, rates above 100 %."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from marked import rows, words, write

import splinefeed as sf
from splinefeed.errors import LimitsError
from splinefeed.planner.override.override import Override
from splinefeed.planner.override.reserve import ACCELERATION_SHARE, JERK_SHARE, with_reserve
from splinefeed.planner.override.source import LawSource

put = partial(write, "math/override.md", "override")
PERIOD = 1e-3
LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
#: Holds a plan, how long the hold is asked for, ticks, and the longest that it may take to full rate, ticks.
HOLDS, HELD, BACK = 200, 1000, 2000
SEED = 1
#: Shares of acceleration and jerk, and the rate that is left room for, of the plans under a reserve.
USUAL = (ACCELERATION_SHARE, JERK_SHARE, 1.0)
RESERVES = ((0.9, 0.8, 1.0), USUAL, (0.7, 0.5, 1.0), (ACCELERATION_SHARE, JERK_SHARE, 1.2))
#: Highest rate that is asked for above 100 %.
FASTEST = 2.0
#: Limits of the axes where the feed leaves them something, and the strategy and the two feeds: programmed, and limit.
TO_SPARE = sf.Limits(feed=1, axis_acceleration=900, axis_jerk=60000)
FEEDS = (("time-optimal", 40.0, 80.0), ("look-ahead", 25.0, 50.0))


def main() -> None:
    """Hold plans under several reserves, run some faster than planned, and fill docs/math/override.md."""
    butterfly, airfoil = sf.shapes.butterfly(), sf.shapes.naca("0025", perimeter=33)
    lines = [("path", "plan", "duration", "to rest, median", "worst", "to full rate, median", "worst")]
    lines += plans("butterfly", butterfly, RESERVES)
    lines += plans("airfoil, 33 mm", airfoil, (USUAL,))
    put("holds", f"{asked()}\n\n{rows(*lines, left=2)}\n\n{straight()}")
    put("faster", faster(butterfly))


def asked() -> str:
    """What the table of holds shows."""
    return words(
        f"""Measured by `docs/figures/override.py`, time-optimal, {LIMITS.feed:g} mm/s, axes
        {LIMITS.axis_acceleration:g} mm/s^2 and {LIMITS.axis_jerk:g} mm/s^3, 1 ms; {HOLDS} holds of one second at random
        places; in ms from the tick of the feed hold until the axes stand, and from the resume
        until the full rate:"""
    )


def plans(name: str, path: sf.Path, reserves: tuple[tuple[float, float, float], ...]) -> list[tuple[str, ...]]:
    """Lines of the table: the plan without a reserve, then each of those with one."""
    whole = sf.plan(path, LIMITS, strategy="time-optimal", period=PERIOD)
    try:
        Override(LawSource(path, whole), LIMITS)
        raise AssertionError("a plan without a reserve can be held: the page says that it cannot")
    except LimitsError:
        lines = [(name, "no reserve", f"{whole.duration:.3f} s", "cannot be held", "", "", "")]
    for acceleration, jerk, top in reserves:
        law = sf.plan(path, with_reserve(LIMITS, top, acceleration, jerk), strategy="time-optimal", period=PERIOD)
        more = 100.0 * (law.duration / whole.duration - 1.0)
        plan = f"{100.0 * acceleration:.0f} % A, {100.0 * jerk:.0f} % J" + (f", top = {top:g}" if top > 1.0 else "")
        usual = (acceleration, jerk, top) == USUAL
        rest, back = holds(path, law)
        lines.append((
            "", f"**{plan}**" if usual else plan, f"{law.duration:.3f} s (+{more:.1f} %)",
            *(f"{1e3 * PERIOD * each:.0f}" for each in (np.median(rest), rest.max(), np.median(back), back.max())),
        ))  # fmt: skip
    return lines


def holds(path: sf.Path, law: sf.TimeLaw) -> tuple[np.ndarray, np.ndarray]:
    """Ticks from hold to rest and from resume to the full rate, (HOLDS,) each, of holds that end before the path."""
    rng = np.random.default_rng(SEED)
    course, found = LawSource(path, law), []
    ticks = round(law.duration / PERIOD)
    while len(found) < HOLDS:
        at = int(rng.integers(ticks))
        wanted = np.ones(at + HELD + BACK)
        wanted[at : at + HELD] = 0.0
        rate = Override(course, LIMITS).run(wanted).rate
        rest, back = np.flatnonzero(rate[at:] == 0.0), np.flatnonzero(rate[at + HELD :] >= 1.0)
        if len(rest) and len(back):
            found.append((rest[0] + 1, back[0] + 1))
    return tuple(np.array(found).T)


def straight() -> str:
    """How long a stop takes that uses both limits of one axis."""
    speed, most, jerk = LIMITS.feed, float(LIMITS.axis_acceleration), float(LIMITS.axis_jerk)
    assert speed >= most**2 / jerk  # else the deceleration is never reached
    return words(
        f"""A straight stop from {speed:g} mm/s at {most:g} mm/s^2 and {jerk:g} mm/s^3 takes v/A + A/J =
        {1e3 * (speed / most + most / jerk):.0f} ms: what no method could beat along a line. In a live stream the rows
        that are already in the buffer come before."""
    )


def faster(butterfly: sf.Path) -> str:
    """What 200 % makes of plans with a feed to spare, and of one without."""
    side = sf.NurbsCurve(1, [0, 0, 1, 1], [(0, 0), (45, 0)])
    bend = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [(45, 0), (60, 0), (60, 15)], [1, 0.5**0.5, 1])
    path = sf.Path([side, bend, sf.NurbsCurve(1, [0, 0, 1, 1], [(60, 15), (60, 45)])])
    told = []
    for strategy, feed, most in FEEDS:
        limits = replace(TO_SPARE, feed=most)
        planned, ran = times(path, limits, feed, strategy)
        told.append(f"{planned:.2f} s at {feed:g} mm/s into {ran:.2f} s ({strategy})")
    planned, ran = times(butterfly, LIMITS, LIMITS.feed, "time-optimal")
    return words(
        f"""Nothing of this costs time at 100 %: the plan is the one of the table above. What {100.0 * FASTEST:.0f} %
        gains depends on the path. Along 45 mm, a quarter circle of 15 mm radius and 30 mm, axes
        {TO_SPARE.axis_acceleration:g} mm/s^2 and {TO_SPARE.axis_jerk:g} mm/s^3, it makes {told[0]}, and {told[1]}.
        Where the accelerations limit everywhere it gains little: the butterfly, held to {LIMITS.feed:g} mm/s,
        {100.0 * (1.0 - ran / planned):.1f} %."""
    )


def times(path: sf.Path, limits: sf.Limits, feed: float, strategy: str) -> tuple[float, float]:
    """How long a plan for that feed lasts, s, and how long it takes at the highest rate that its limits allow."""
    law = sf.plan(path, with_reserve(replace(limits, feed=feed)), strategy=strategy, period=PERIOD)
    override = Override(LawSource(path, law), limits, rate=FASTEST)
    ran = override.run(np.full(round(law.duration / PERIOD) + 1, FASTEST))
    assert override.done
    return law.duration, len(ran) * PERIOD


if __name__ == "__main__":
    main()

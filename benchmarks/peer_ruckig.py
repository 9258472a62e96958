"""Ruckig: one straight move from rest to rest, where its problem and the seven-phase profile are the same."""

from __future__ import annotations

from functools import partial

import numpy as np

import splinefeed as sf
from benchmarks.tables import Column, Table
from benchmarks.timing import interleaved

#: mm: so short that the feed is not reached, and so long that it is.
LENGTHS = (0.01, 1.0, 30.0, 1000.0)
FEED, ACCELERATION, JERK = 60.0, 500.0, 20000.0
ROUNDS, CALLS = 20, 200


def table() -> Table:
    """Durations and microseconds of both, for each length."""
    rows = []
    for length in LENGTHS:
        line = sf.Path([sf.NurbsCurve.bezier(np.array([[0.0, 0.0], [length, 0.0]]))])
        jobs = {
            "seven-phase": partial(sf.plan, line, sf.Limits(feed=FEED, acceleration=ACCELERATION, jerk=JERK)),
            "ruckig": _ruckig(length),
        }
        law, duration = (job() for job in jobs.values())
        times = interleaved({name: partial(_often, job) for name, job in jobs.items()}, ROUNDS)
        ours, theirs = (1e6 * times[name].least / CALLS for name in jobs)
        rows.append((length, law.duration, duration, abs(law.duration / duration - 1.0), ours, theirs))
    columns = (
        Column("straight line, mm", "g"),
        Column("`seven-phase`, s", ".9f"),
        Column("Ruckig, s", ".9f"),
        Column("relative difference", ".0e"),
        Column("`seven-phase`, us", ".0f"),
        Column("Ruckig, us", ".1f"),
    )
    caption = (
        f"One move from rest to rest: {FEED:g} mm/s, {ACCELERATION:g} mm/s^2, {JERK:g} mm/s^3, without a servo period."
    )
    note = (
        "Both are exact. Ours makes and checks a `TimeLaw` in Python, theirs is one call of C++: where a new target "
        "comes in every control cycle, take Ruckig."
    )
    return Table(caption, columns, tuple(rows), (note,))


def _ruckig(length: float) -> object:
    from ruckig import InputParameter, Ruckig, Trajectory

    planner, asked, found = Ruckig(1), InputParameter(1), Trajectory(1)
    asked.current_position, asked.target_position = [0.0], [length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [FEED], [ACCELERATION], [JERK]

    def call() -> float:
        planner.calculate(asked, found)
        return float(found.duration)

    return call


def _often(job: object) -> None:
    for _ in range(CALLS):
        job()

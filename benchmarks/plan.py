"""Planning: how long each strategy takes and how fast its motion is, beside the best known times."""

from __future__ import annotations

from functools import partial

import splinefeed as sf
from benchmarks import cases
from benchmarks.tables import Column, Headline, Report, Table
from benchmarks.timing import interleaved

ROUNDS = 12
#: Look-ahead may take this much longer than the best known motion, and so many ms to plan a butterfly.
LOSS, MILLISECONDS = 0.01, 40.0


def measure() -> Report:
    """Milliseconds and seconds of motion, for time-optimal and look-ahead in turn."""
    paths = {"butterfly": cases.butterfly(), "airfoil12": cases.airfoil12()}
    rows = []
    for (name, setting), best in cases.BEST.items():
        limits = cases.axis_limits(setting)
        jobs = {
            strategy: partial(sf.plan, paths[name], limits, strategy=strategy, period=cases.PERIOD)
            for strategy in ("time-optimal", "look-ahead")
        }
        optimal, ahead = (job().duration for job in jobs.values())
        times = interleaved(jobs, ROUNDS)
        slow, fast = (1e3 * times[strategy].least for strategy in jobs)
        rows.append((name, setting, best, optimal, ahead, 100.0 * (ahead / best - 1.0), slow, fast, slow / fast))
    columns = (
        Column("curve"),
        Column("limits"),
        Column("best known, s", ".3f"),
        Column("`time-optimal`, s", ".3f"),
        Column("`look-ahead`, s", ".3f"),
        Column("over the best, %", ".1f"),
        Column("`time-optimal`, ms", ".0f"),
        Column("`look-ahead`, ms", ".2f"),
        Column("times faster", ".0f"),
    )
    caption = "Planning from rest to rest under feed, axis velocity, acceleration and jerk, 1 ms, warm."
    notes = (
        "Limits (feed = axis velocity, axis acceleration, axis jerk): A 60, 500, 20000; B 100, 2000, 50000; "
        f"C 60, 50, 2000. Fastest of {ROUNDS} rounds in turn.",
    )
    butterfly = [row for row in rows if row[0] == "butterfly"]
    worst, slowest = max(row[5] for row in butterfly), max(row[7] for row in butterfly)
    headline = Headline(
        "`look-ahead` on the butterfly, against the best known motion",
        f"at most {worst:.1f} % over, planned in at most {slowest:.0f} ms",
        f"{100.0 * LOSS:.0f} %, {MILLISECONDS:.0f} ms",
        worst <= 100.0 * LOSS and slowest <= MILLISECONDS,
    )
    return Report((Table(caption, columns, tuple(rows), notes),), (headline,))

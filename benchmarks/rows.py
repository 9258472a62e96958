"""Long paths: butterflies in a row, each from where the last one ends, without a rest between."""

from __future__ import annotations

import time
from typing import Any

from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table

COPIES = (10, 100, 1000)
STRATEGIES = ("look-ahead", "time-optimal")
SETTING = "A"
#: Growth of the cost of a copy from the first row to the last that still counts as straight.
STRAIGHT = 1.3


def measure() -> Report:
    """Processor time and memory of each strategy, each in a process of its own."""
    rows = []
    for strategy in STRATEGIES:
        for copies in COPIES:
            each = child.outcome("rows", "planned", strategy, copies)
            seconds, before, peak = each["seconds"], each["before"] / 1e6, each["peak"] / 1e6
            length, duration, bound = each["length"] / 1000.0, each["duration"], each["bound"]
            rows.append((strategy, copies, length, duration, bound, seconds, 1e3 * seconds / copies, before, peak))
    columns = (
        Column("strategy"),
        Column("butterflies", ",d"),
        Column("path, m", ".1f"),
        Column("motion, s", ",.3f"),
        Column("bound, s", ",.3f"),
        Column("CPU time, s", ".1f"),
        Column("ms a butterfly", ".1f"),
        Column("memory before, MB", ",.0f"),
        Column("peak memory, MB", ",.0f"),
    )
    notes = (
        "Limits A; `sf.plan` of the whole path at once, warm. Before: the process with the compiled code, a plan of "
        "three butterflies behind it. What grows is the law itself, which is returned whole; a path whose law need not "
        "be, `sf.runs.stream_setpoints` plans in constant memory.",
    )
    straight = max(rows[k + len(COPIES) - 1][6] / rows[k][6] for k in (0, len(COPIES)))
    headline = Headline(
        f"{COPIES[-1]:,d} butterflies in a row, {rows[-1][2]:.0f} m of path, `time-optimal`",
        f"{rows[-1][5]:.0f} s of computing, {rows[-1][8]:,.0f} MB; each costs {straight:.2f} times what it costs "
        f"among {COPIES[0]}",
        "grows with the path",
        straight <= STRAIGHT,
    )
    caption = "The cost of a long path."
    return Report((Table(caption, columns, tuple(rows), notes),), (headline,))


def planned(strategy: str, copies: int) -> dict[str, Any]:
    """Plan so many butterflies; called in a process of its own."""
    import splinefeed as sf
    from benchmarks.cases import PERIOD, axis_limits, butterfly

    one = butterfly().curves[0]
    step = one.control_points[-1] - one.control_points[0]
    limits = axis_limits(SETTING)

    def row(count: int) -> sf.Path:
        return sf.Path(
            [sf.NurbsCurve(one.degree, one.knots, one.control_points + k * step, one.weights) for k in range(count)]
        )

    sf.plan(row(3), limits, strategy=strategy, period=PERIOD)
    before = peak_memory()
    start = time.process_time()
    path = row(copies)
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    seconds = time.process_time() - start
    return {
        "seconds": seconds,
        "before": before,
        "peak": peak_memory(),
        "length": path.length,
        "duration": law.duration,
        "bound": law.settings.get("lower_bound_s"),
    }

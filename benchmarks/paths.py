"""Long paths: building them, their arc length and their corners, and the memory that takes."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table

COUNTS = (1_000, 10_000, 100_000, 1_000_000)
#: Most time, s, and memory, in units of 10^6 bytes, for a path of a million lines with its arc length.
TARGET_TIME = 3.0
TARGET_MEMORY = 1000.0


def measure() -> Report:
    """Seconds and megabytes of a process that builds a path of so many lines in space and looks at its corners."""
    found = [child.outcome("paths", "build", count) for count in COUNTS]
    rows = tuple(
        (
            count,
            each["build"],
            each["table"],
            each["corners"],
            1e6 * (each["build"] + each["table"] + each["corners"]) / count,
            each["peak"] / 1e6,
            each["peak"] / 1e6 - each["before"] / 1e6,
        )
        for count, each in zip(COUNTS, found, strict=True)
    )
    columns = (
        Column("lines", ",d"),
        Column("build, s", ".3f"),
        Column("arc length, s", ".3f"),
        Column("corners, s", ".3f"),
        Column("us a line", ".1f"),
        Column("peak memory, MB", ",.0f"),
        Column("more than before, MB", ",.0f"),
    )
    notes = (
        "`sf.Path.polyline(points)`, then `path.length` and `path.stops`, in a process of its own with all kernels "
        "loaded. Peak memory is that of the whole process, the last column what building added to it.",
    )
    last = rows[-1]
    seconds = last[1] + last[2]
    headline = Headline(
        f"a path of {last[0]:,d} lines with its arc length",
        f"{seconds:.1f} s, {last[5]:,.0f} MB",
        f"{TARGET_TIME:g} s, {TARGET_MEMORY:,.0f} MB",
        seconds <= TARGET_TIME and last[5] <= TARGET_MEMORY,
    )
    return Report((Table("Paths of straight lines, from points in space.", columns, rows, notes),), (headline,))


def build(count: int) -> dict[str, Any]:
    """Seconds that each step takes for a path of `count` lines, and peak memory before and after, bytes.

    Called in a process of its own, whose memory is then that of this job.
    """
    import splinefeed as sf

    points = np.cumsum(np.random.default_rng(0).normal(size=(count + 1, 3)), axis=0)
    assert sf.Path.polyline(points[:9]).stops  # compiles, or loads what was compiled
    before = peak_memory()
    start = time.perf_counter()
    path = sf.Path.polyline(points)
    built = time.perf_counter()
    length = path.length
    measured = time.perf_counter()
    stops = path.stops
    done = time.perf_counter()
    return {
        "build": built - start,
        "table": measured - built,
        "corners": done - measured,
        "length": length,
        "stops": len(stops),
        "before": before,
        "peak": peak_memory(),
    }

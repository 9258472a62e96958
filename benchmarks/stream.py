"""Long jobs: setpoints made and written in chunks, and the memory that takes."""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks import cases, child
from benchmarks.tables import Column, Headline, Report, Table

#: How long each motion is at least, s, and its servo period, s: the last is an hour at 1 ms.
MOTIONS = ((360.0, 1e-3), (3600.0, 1e-2), (3600.0, 1e-3))
CHUNK = 100_000
#: The butterfly's published points leave a gap of a micrometre between its end and its start, mm.
GAP = 0.01
#: Most memory of the hour, in units of 10^6 bytes.
TARGET = 500.0


def measure() -> Report:
    """Megabytes and seconds of a process that writes laps on the butterfly to HDF5, for jobs of different length."""
    found = [child.outcome("stream", "write", *motion) for motion in MOTIONS]
    rows = tuple(
        (
            each["ticks"],
            1e3 * period,
            each["laps"],
            each["peak"] / 1e6,
            each["prepare"],
            each["write"],
            1e9 * each["write"] / each["ticks"],
            each["bytes"] / 1e6,
        )
        for (_, period), each in zip(MOTIONS, found, strict=True)
    )
    columns = (
        Column("ticks", ",d"),
        Column("period, ms", "g"),
        Column("laps", ",d"),
        Column("peak memory, MB", ",.0f"),
        Column("path and plan, s", ".2f"),
        Column("interpolate and write, s", ".2f"),
        Column("ns a tick", ",.0f"),
        Column("file, MB", ",.0f"),
    )
    notes = (
        f"`sf.save(sf.interpolate(path, law, chunk={CHUNK}), ...)` in a process of its own; the path is that many "
        "butterflies in a row. Peak memory is that of the whole process, Python and the compiler included. What makes "
        "it grow is the table of a longer path, not the number of ticks.",
    )
    last = rows[-1]
    headline = Headline(
        f"peak memory of {last[0] / 1e6:.1f} million setpoints written to HDF5",
        f"{last[3]:.0f} MB, {last[5]:.1f} s",
        f"{TARGET:g} MB",
        last[3] < TARGET,
    )
    return Report((Table("An hour at 1 ms, written as it is made.", columns, rows, notes),), (headline,))


def write(seconds: float, period: float) -> dict[str, Any]:
    """Write the setpoints, one each `period` s, of so many whole laps that they take `seconds` at least.

    Called in a process of its own, whose memory is then that of this job.
    """
    import splinefeed as sf

    start = time.perf_counter()
    lap = cases.butterfly()
    laps = max(1, math.ceil(seconds * cases.FAST.feed / lap.length))
    path = sf.Path(lap.curves * laps, lap.axes, name="butterflies", tolerance=GAP)
    law = sf.plan(path, cases.FAST, period=period)
    planned = time.perf_counter()
    count = 0

    def counted() -> Any:
        nonlocal count
        for points in sf.interpolate(path, law, chunk=CHUNK):
            count += len(points)
            yield points

    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        file = Path(folder, "setpoints.h5")
        sf.save(counted(), file)
        written = time.perf_counter()
        size = file.stat().st_size
    return {
        "ticks": count,
        "laps": laps,
        "prepare": planned - start,
        "write": written - planned,
        "bytes": size,
        "peak": peak_memory(),
    }


def peak_memory() -> int:
    """Most memory that this process has had so far, bytes."""
    try:
        # Linux hands the parent's peak on to getrusage of the child; this line is the process's own
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)

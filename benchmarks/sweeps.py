"""The overhead of a sweep, on processes and on Dask, and what a second core brings."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

from benchmarks.tables import Column, Headline, Report, Table
from splinefeed.sweeps.spec import Sweep, from_dict
from splinefeed.sweeps.sweeping import drive, processes, sweep

#: Runs of a few milliseconds whose overhead is measured, and runs of about 50 ms that two cores share.
SHORT, LONG = 400, 100
#: Targets: overhead a run, ms, and how much faster two cores are.
PROCESSES_MS, DASK_MS, SPEED_UP = 1.0, 5.0, 1.8
#: What is extrapolated to: cores, seconds a run, and runs in one task.
CORES, SCALED, BATCHES = 1000, (0.05, 1.0), (1, 20)


def measure() -> Report:
    """Overhead a run and speed-up by engine; the workers have compiled and imported everything before."""
    short = from_dict({"sources": ["line?length=1"], "random": {"count": SHORT, "limits.feed": {"uniform": [10, 20]}}})
    long = from_dict(
        {
            "sources": ["circle?radius=5"],
            "set": {"strategy": "look-ahead", "limits": {"axis_acceleration": 300, "axis_jerk": 9e3}},
            "random": {"count": LONG, "limits.feed": {"uniform": [10, 20]}},
        }
    )
    rows = []
    overheads: dict[str, float] = {}
    with processes(1) as one, processes(2) as two:
        alone, _, _ = _run(long, lambda: one, 1)
        pair, each, _ = _run(long, lambda: two, 2)
        wall, _, over = _run(short, lambda: two, 2)
        overheads["processes"] = over
        rows.append(("processes", 2, SHORT, 1e3 * (wall - over * SHORT / 2) * 2 / SHORT, 1e3 * over))
    dask = _dask(short)
    if dask is not None:
        overheads["Dask"] = dask[2]
        rows.append(("Dask", 2, SHORT, 1e3 * (dask[0] - dask[2] * SHORT / 2) * 2 / SHORT, 1e3 * dask[2]))
    columns = (Column("engine"), Column("workers", "d"), Column("runs", "d"), Column("a run itself, ms", ".2f"),
               Column("overhead, ms a run", ".3f"))  # fmt: skip
    caption = "The overhead of a sweep: workers times wall time, less the time in the runs, a run."
    note = f"{LONG} runs of {1e3 * each:.0f} ms: {alone:.2f} s on one process, {pair:.2f} s on two."
    targets = {"processes": PROCESSES_MS, "Dask": DASK_MS}
    lines = [
        Headline(f"overhead of a sweep's run, on {name}", f"{1e3 * over:.2f} ms", f"{targets[name]:g} ms",
                 1e3 * over <= targets[name])
        for name, over in overheads.items()
    ]  # fmt: skip
    ratio = alone / pair
    lines.append(
        Headline("two cores against one, sweeping", f"{ratio:.2f} times", f"{SPEED_UP} times", ratio >= SPEED_UP)
    )
    return Report((Table(caption, columns, tuple(rows), (note,)), _scaled(overheads)), tuple(lines))


def _scaled(overheads: dict[str, float]) -> Table:
    """What that would mean on many cores if all of it were spent in the one process that hands out the runs."""
    rows = []
    for name, over in overheads.items():
        for runs in BATCHES:
            each = over / runs
            shares = [min(CORES, (run + each) / each) for run in SCALED]
            rows.append((name, runs, 1.0 / each, *shares))
    columns = (
        Column("engine"),
        Column("runs a task", "d"),
        Column("handed out, runs a second", ",.0f"),
        *(Column(f"cores kept busy, runs of {1e3 * run:g} ms", ",.0f") for run in SCALED),
    )
    note = (
        f"Of {CORES:,} cores; computed from the table above, not measured: cores kept busy = (run + overhead) / "
        "overhead. Several runs a task is what would have to be built."
    )
    return Table("How far one process that hands out the runs would reach.", columns, tuple(rows), (note,))


def _run(spec: Sweep, engine: Callable[[], Executor], workers: int) -> tuple[float, float, float]:
    """Wall time, s, time of one run, s, and overhead a run, s; what is warmed up is not counted."""
    executor: Any = engine()
    warm = from_dict({"sources": list(spec.sources), "set": dict(spec.fixed), "random": {"count": 8 * workers}})
    list(sweep(warm, executor, workers=workers))
    start = time.perf_counter()
    took = [seconds for _, seconds in drive(map(spec.task, range(len(spec))), executor, workers)]
    wall = time.perf_counter() - start
    return wall, sum(took) / len(took), max(workers * wall - sum(took), 0.0) / len(took)


def _dask(spec: Sweep) -> tuple[float, float, float] | None:
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        return None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # workers grumble when their scheduler goes
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=logging.CRITICAL
        ) as cluster,
        Client(cluster) as client,
    ):
        executor = client.get_executor(pure=False)
        return _run(spec, lambda: executor, 2)

"""`sweep`: all runs of a spec over an executor, lazily, and kept in a folder if one is given."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from typing import Any

from splinefeed.sweeps import spec as specs
from splinefeed.sweeps.engine import drive, processes, serial
from splinefeed.sweeps.spec import Sweep, Task
from splinefeed.sweeps.store import Store
from splinefeed.sweeps.work import Artefacts, Row


def sweep(
    spec: str | os.PathLike[str] | Mapping[str, Any] | Sweep,
    executor: Executor | Callable[[], Executor] | None = None,
    *,
    folder: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    artefacts: Artefacts | None = None,
) -> Iterator[Row]:
    """Every run of a sweep as a row of numbers, as they come, in no order; `row["index"]` says which it is.

    spec      a TOML file, its content as a dict, or a Sweep
    executor  where the runs are made: an Executor, or a function that makes one (and makes it again if it breaks);
              None for processes on this machine, one a core; workers=0 for this process alone
    folder    keep the rows there as a Parquet dataset; runs that it has already are not made again, nor given
    workers   how many runs go at a time, where the executor does not say

    Only a few runs a worker are on their way at any time, however many there are. A run that fails is a row too, with
    `status` "failed" and its error. Raises SpecError for a spec that cannot be, and InputError for a folder that holds
    another sweep.
    Rows are in mm and s, as `run --json` prints them. Source: docs/sweep.md.
    Example: `list(sf.sweep({"name": "two", "sources": ["butterfly"], "grid": {"limits.feed": [30, 60]}}, workers=0))`
    """
    spec = spec if isinstance(spec, Sweep) else specs.from_dict(spec) if isinstance(spec, Mapping) else specs.read(spec)
    return (row for row, _ in timed(spec, executor, folder=folder, workers=workers, artefacts=artefacts))


def timed(
    spec: Sweep,
    executor: Executor | Callable[[], Executor] | None = None,
    *,
    folder: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    artefacts: Artefacts | None = None,
    start: Callable[[int], None] = lambda already: None,
) -> Iterator[tuple[Row, float]]:
    """As `sweep`, with the time that each run took, s; `start` is called with the number of earlier runs."""
    with ExitStack() as stack:
        store = None if folder is None else stack.enter_context(Store(folder, spec))
        start(0 if store is None else int(store.done.sum()))
        tasks = _tasks(spec, store)
        if workers == 0 and executor is None:
            rows = serial(tasks, artefacts)
        else:
            count = workers or _workers(executor)
            engine = _engine(executor, count)
            rows = drive(tasks, engine, count, artefacts, close=not isinstance(executor, Executor))
        for row, took in rows:
            if store is not None:
                store.add(row)
            yield row, took


def _tasks(spec: Sweep, store: Store | None) -> Iterator[Task]:
    for index in range(len(spec)):
        if store is None or not store.done[index]:
            yield spec.task(index)


def _workers(executor: object) -> int:
    """How many runs an executor makes at a time, as far as it tells."""
    return int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)


def _engine(executor: Executor | Callable[[], Executor] | None, workers: int) -> Callable[[], Executor]:
    if executor is None:
        return lambda: processes(workers)
    if not isinstance(executor, Executor):
        return executor
    return lambda: executor

"""`sweep`: all runs of a spec over any `concurrent.futures.Executor`, lazily, and kept in a folder if one is given."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import nullcontext
from itertools import chain, islice
from typing import Any

from splinefeed.errors import SplinefeedError
from splinefeed.sweeps import spec as specs
from splinefeed.sweeps.spec import Sweep, Task
from splinefeed.sweeps.store import Store
from splinefeed.sweeps.work import Artefacts, Row, lost_row, work
from splinefeed.workers import end_with_parent

#: Work that is handed out in one piece, s, and the most runs in it: small runs travel together.
BATCH_SECONDS, MOST_IN_BATCH = 0.1, 256
#: Pieces that wait for each worker after its current one.
WAITING = 2
#: How often a task that lost its worker is tried in all; one that kills every worker is a failure of its own.
TRIES = 3
#: Workers are lost so often in a row, with no result between, and the sweep gives up.
LOST_IN_A_ROW = 8
#: Address space of a worker, bytes; the libraries alone take some GB of it, most never touched.
MOST_MEMORY = 12 * 2**30

Engine = Callable[[], Executor]


class EngineError(SplinefeedError):
    """The workers of a sweep cannot be kept alive."""


def sweep(
    spec: str | os.PathLike[str] | Mapping[str, Any] | Sweep,
    executor: Executor | Engine | None = None,
    *,
    folder: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    artefacts: Artefacts | None = None,
) -> Iterator[Row]:
    """Make every run of a sweep, and give each as a row of numbers as it comes.

    Parameters
    ----------
    spec : path, mapping or Sweep
        A TOML file, its content, or a Sweep.
    executor : Executor or callable, optional
        Where the runs are made: an Executor, or a function that makes one, and makes it again if it breaks. By default
        processes on this machine, one a core.
    folder : path, optional
        Keep the rows there as a Parquet dataset; runs that it has already are not made again, nor given.
    workers : int, optional
        How many runs go at a time, where the executor does not say; 0 for this process alone.
    artefacts : callable, optional
        Is called with each task and its Run where it was made, to keep more of it than a row.

    Returns
    -------
    iterator of dict
        Rows, in mm and s, as `run --json` prints them; `row["index"]` tells which run it is. A run that fails is a row
        too, with `status` "failed" and its error.

    Raises
    ------
    FormatError
        For a spec that cannot be, with every error at once.
    InputError
        At the first row, for a folder that holds another sweep.

    Notes
    -----
    Only a few runs a worker are on their way at any time, however many there are.

    References
    ----------
    .. [1] docs/sweep.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> spec = {"name": "two", "sources": ["line?start=0,0&end=10,0"], "grid": {"limits.feed": [30, 60]}}
    >>> [(row["limits.feed"], row["status"]) for row in sf.sweep(spec, workers=0)]
    [(30.0, 'ok'), (60.0, 'ok')]
    """
    spec = spec if isinstance(spec, Sweep) else specs.from_dict(spec) if isinstance(spec, Mapping) else specs.read(spec)

    def kept() -> Iterator[Row]:
        with nullcontext() if folder is None else Store(folder, spec) as store:
            yield from rows(spec, store, executor, workers, artefacts)

    return kept()


def rows(
    spec: Sweep, store: Store | None, executor: Executor | Engine | None, workers: int | None,
    artefacts: Artefacts | None,
) -> Iterator[Row]:  # fmt: skip
    """Make the runs that an open store does not have, and give and keep their rows as they come.

    Parameters
    ----------
    spec : Sweep
        The sweep.
    store : Store or None
        Open; None keeps nothing.
    executor, workers, artefacts
        As for `sweep`.

    Yields
    ------
    dict
        The next row.
    """
    tasks = (spec.task(index) for index in range(len(spec)) if store is None or not store.done[index])
    made: Iterable[tuple[Row, float]]
    if workers == 0 and executor is None:
        made = chain.from_iterable(work([task], artefacts) for task in tasks)
    else:
        count = workers or int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)
        made = drive(tasks, executor or (lambda: processes(count)), count, artefacts)
    for row, _ in made:
        if store is not None:
            store.add(row)
        yield row


def processes(workers: int | None = None) -> ProcessPoolExecutor:
    """Start processes on this machine, one a core by default; they share the cache of compiled kernels."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        workers or os.cpu_count() or 1, mp_context=context, initializer=end_with_parent, initargs=(MOST_MEMORY,)
    )


def drive(
    tasks: Iterable[Task], given: Executor | Engine, workers: int, artefacts: Artefacts | None = None
) -> Iterator[tuple[Row, float]]:
    """Work tasks off, at most a few pieces a worker on their way.

    Parameters
    ----------
    tasks : iterable of Task
        Runs.
    given : Executor or callable
        An executor, or what makes one, which is done again when it breaks; the tasks that were on their way are
        tried again, one at a time: the one that kills its worker is not to take others along.
    workers : int
        How many there are.
    artefacts : callable, optional
        As for `sweep`.

    Yields
    ------
    row : dict
        The next row, in no order.
    seconds : float
        The time that it took.

    Raises
    ------
    EngineError
        Where workers are lost again and again without a result.
    """
    waiting = iter(tasks)
    again: list[tuple[Task, int]] = []  # tasks that lost their worker, and how often
    seconds, lost = BATCH_SECONDS, 0
    flying: dict[Future[list[tuple[Row, float]]], list[tuple[Task, int]]] = {}
    executor = given if isinstance(given, Executor) else given()
    try:
        while True:
            size = max(1, min(MOST_IN_BATCH, int(BATCH_SECONDS / max(seconds, 1e-9))))
            try:
                while len(flying) < (1 if again else workers * (1 + WAITING)):
                    batch = [again[-1]] if again else [(task, 0) for task in islice(waiting, size)]
                    if not batch:
                        break
                    again = again or batch  # until it is handed out
                    flying[executor.submit(work, [task for task, _ in batch], artefacts)] = batch
                    again = again[: -len(batch)]
                if not flying:
                    return
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    rows = future.result()
                    del flying[future]
                    lost = 0
                    seconds = 0.8 * seconds + 0.2 * (sum(took for _, took in rows) / len(rows))
                    yield from rows
            except (BrokenExecutor, CancelledError, OSError) as error:
                lost += 1
                if lost > LOST_IN_A_ROW:
                    raise EngineError(f"workers were lost {lost} times in a row without a result: {error}") from None
                again += [(task, tried + 1) for batch in flying.values() for task, tried in batch]
                flying.clear()
                if not isinstance(given, Executor):
                    executor.shutdown(wait=False, cancel_futures=True)
                    executor = given()
                for task, tried in again:
                    if tried >= TRIES:
                        yield lost_row(task, tried), 0.0
                again = [each for each in again if each[1] < TRIES]
    finally:
        for future in flying:
            future.cancel()
        if not isinstance(given, Executor):  # one that was handed in is not ours to close
            executor.shutdown(wait=False, cancel_futures=True)

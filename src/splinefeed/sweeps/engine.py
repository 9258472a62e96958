"""Tasks over any `concurrent.futures.Executor`: lazily, in batches, with back-pressure, and on after a lost worker."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)

from splinefeed.errors import SplinefeedError
from splinefeed.sweeps.spec import Task
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


def processes(workers: int | None = None) -> ProcessPoolExecutor:
    """Processes on this machine, one a core unless said; they start clean and share the cache of compiled kernels."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        workers or os.cpu_count() or 1, mp_context=context, initializer=end_with_parent, initargs=(MOST_MEMORY,)
    )


def drive(
    tasks: Iterable[Task], engine: Engine, workers: int, artefacts: Artefacts | None = None, *, close: bool = True
) -> Iterator[tuple[Row, float]]:
    """Rows as they come, with the time each took, s, in no order; at most a few pieces a worker are on their way.

    engine  makes an executor; it is made again when it breaks, and the tasks that were on their way are tried again
    close   whether executors are shut down when they are not needed any more; not those that somebody handed in
    Raises EngineError where workers are lost again and again without a result.
    """
    waiting = iter(tasks)
    again: list[tuple[Task, int]] = []
    seconds = BATCH_SECONDS
    lost = 0
    executor = engine()
    flying: dict[Future[list[tuple[Row, float]]], list[tuple[Task, int]]] = {}
    try:
        while True:
            size = max(1, min(MOST_IN_BATCH, int(BATCH_SECONDS / max(seconds, 1e-9))))
            try:
                # after a loss one task flies at a time: the one that kills its worker is not to take others along
                while len(flying) < (1 if again else workers * (1 + WAITING)):
                    batch = _next(waiting, again, size)
                    if not batch:
                        break
                    try:
                        flying[executor.submit(work, [task for task, _ in batch], artefacts)] = batch
                    except BrokenExecutor:
                        again += batch
                        raise
                if not flying:
                    return
                done, _ = wait(flying, return_when=FIRST_COMPLETED)
                for future in done:
                    batch = flying.pop(future)
                    try:
                        rows = future.result()
                    except (BrokenExecutor, CancelledError, OSError) as error:
                        again += [(task, tried + 1) for task, tried in batch]
                        raise BrokenExecutor(str(error)) from error
                    lost = 0
                    seconds = 0.8 * seconds + 0.2 * (sum(took for _, took in rows) / len(rows))
                    yield from rows
            except BrokenExecutor as error:
                lost += 1
                if lost > LOST_IN_A_ROW:
                    raise EngineError(f"workers were lost {lost} times in a row without a result: {error}") from None
                again += [(task, tried + 1) for batch in flying.values() for task, tried in batch]
                flying.clear()
                if close:
                    executor.shutdown(wait=False, cancel_futures=True)
                executor = engine()
                yield from _given_up(again)
    finally:
        for future in flying:
            future.cancel()
        if close:
            executor.shutdown(wait=False, cancel_futures=True)


def serial(tasks: Iterable[Task], artefacts: Artefacts | None = None) -> Iterator[tuple[Row, float]]:
    """Rows one after the other, in this process."""
    for task in tasks:
        yield from work([task], artefacts)


def _next(waiting: Iterator[Task], again: list[tuple[Task, int]], size: int) -> list[tuple[Task, int]]:
    """The next tasks to hand out; those that lost a worker first, and each of them alone."""
    if again:
        return [again.pop()]
    out = []
    for task in waiting:
        out.append((task, 0))
        if len(out) == size:
            break
    return out


def _given_up(again: list[tuple[Task, int]]) -> Iterator[tuple[Row, float]]:
    """Rows of the tasks that were tried often enough; they leave `again`."""
    for each in [each for each in again if each[1] >= TRIES]:
        again.remove(each)
        yield lost_row(each[0], each[1]), 0.0

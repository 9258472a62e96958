"""The server's side of a worker process: ask, hear how it goes, and kill it when nobody wants the answer any more."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from splinefeed.workers import LostError, Worker

#: What a worker says while it works: the head of a message.
Heard = Callable[[dict[str, Any]], None]
#: Address space of a worker, bytes; the libraries alone take some GB of it, most never touched.
MOST_MEMORY = 12 * 2**30


@dataclass(frozen=True)
class Answer:
    """What came of a request: `body` is JSON; or `error`, words by field; `entry` is for the history.

    late  the deadline has passed and the worker is gone
    """

    body: bytes = b"{}"
    error: dict[str, Any] | None = None
    entry: dict[str, Any] | None = None
    late: bool = False


class Desk:
    """A worker process that does one thing at a time."""

    def __init__(self, name: str, uploads: Path, made: Path) -> None:
        handler = "splinefeed.studio.worker:open_bench"
        self._worker = Worker(handler, str(uploads), str(made), memory=MOST_MEMORY)
        self._lock = asyncio.Lock()
        self._threads = ThreadPoolExecutor(1, thread_name_prefix=name)
        self.order, self.kill = self._worker.order, self._worker.stop

    async def ask(self, request: dict[str, Any], heard: Heard, deadline: float | None = None) -> Answer:
        """The answer to a request; `heard` is called with progress. After `deadline`, s, the worker is killed."""
        loop = asyncio.get_running_loop()

        def said(head: dict[str, Any]) -> None:
            loop.call_soon_threadsafe(heard, head)

        async with self._lock:
            try:
                head, body = await loop.run_in_executor(self._threads, self._worker.ask, request, said, deadline)
            except LostError as error:
                took = f"takes longer than {deadline:.0f} s" if error.late else "ended its worker"
                words = f"this {took}: the input may be too large or broken"
                return Answer(error={"fields": {"": words}, "fault": False}, late=error.late)
        return Answer(body, head.get("error"), head.get("entry"))

    async def close(self) -> None:
        """End the process and wait until it is gone."""
        await asyncio.get_running_loop().run_in_executor(None, self.kill)
        self._threads.shutdown(wait=False)

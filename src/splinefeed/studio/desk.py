"""The server's side of a worker process: ask, hear how it goes, and kill it when nobody wants the answer any more."""

from __future__ import annotations

import asyncio
import json
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from splinefeed.studio import worker

#: What a worker says while it works: the head of a message, and its body.
Heard = Callable[[dict[str, Any]], None]
#: Time that a worker which was asked to end gets for it, s.
PATIENCE = 2.0


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
    """A worker process that does one thing at a time; it starts with the first request, and anew after its death."""

    def __init__(self, name: str, uploads: Path, made: Path) -> None:
        self.name = name
        self._folders = (str(uploads), str(made))
        self._lock = asyncio.Lock()
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None
        self._threads = ThreadPoolExecutor(1, thread_name_prefix=name)
        self._late = False

    async def ask(self, request: dict[str, Any], heard: Heard, deadline: float | None = None) -> Answer:
        """The answer to a request; heard is told of progress. After `deadline`, s, the worker is killed."""
        async with self._lock:
            loop = asyncio.get_running_loop()
            pipe = self._running()
            self._late = False
            clock = loop.call_later(deadline, self._end_late) if deadline is not None else None
            try:
                pipe.send_bytes(json.dumps(request).encode())
                while True:
                    message = await loop.run_in_executor(self._threads, pipe.recv_bytes)
                    line, _, body = message.partition(b"\n")
                    head = json.loads(line)
                    if head["kind"] == "answer":
                        return Answer(body, entry=head["entry"])
                    if head["kind"] == "error":
                        return Answer(error=head["error"])
                    heard(head)
            except (EOFError, OSError):
                self.kill()
                took = f"takes longer than {deadline:.0f} s" if self._late and deadline else "ended its worker"
                words = f"this {took}: the input may be too large or broken"
                return Answer(error={"fields": {"": words}, "fault": False}, late=self._late)
            finally:
                if clock is not None:
                    clock.cancel()

    def order(self, words: dict[str, Any]) -> None:
        """Tell what runs to do otherwise; nothing if nothing runs."""
        if self._pipe is not None:
            with suppress(OSError):
                self._pipe.send_bytes(json.dumps({"order": words}).encode())

    def kill(self) -> None:
        """End the process at once; whoever waits for an answer hears of it."""
        process, self._process, self._pipe = self._process, None, None
        if process is not None:
            process.kill()

    async def close(self) -> None:
        """End the process and wait until it is gone."""
        process = self._process
        self.kill()
        if process is not None:
            await asyncio.get_running_loop().run_in_executor(None, process.join, PATIENCE)
        self._threads.shutdown(wait=False)

    def _end_late(self) -> None:
        self._late = True
        if self._process is not None:
            self._process.kill()

    def _running(self) -> Connection:
        if self._pipe is None or self._process is None or not self._process.is_alive():
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=worker.main, args=(theirs, *self._folders), daemon=True)
            self._process.start()
            theirs.close()  # so that its end is seen here
        return self._pipe

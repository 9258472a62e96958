"""A worker process: requests come by a pipe, one at a time, answers go as JSON.

Killing it is how work is cancelled. Uploads are read here, never in the server: what crashes a reader, eats memory or
does not end takes a worker with it and nothing else.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

#: Address space of a worker, bytes; the libraries alone take some GB of it, most never touched.
MOST_MEMORY = 12 * 2**30

Tell = Callable[[dict[str, Any], bytes], None]


class Mail:
    """What comes in and goes out on the pipe: requests wait in a queue, orders to what runs are obeyed at once."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._lock = threading.Lock()
        self.requests: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.obey: Callable[[dict[str, Any]], None] = _ignore
        threading.Thread(target=self._listen, daemon=True).start()

    def tell(self, head: dict[str, Any], body: bytes = b"") -> None:
        """Send a line of JSON, and a body of any bytes behind it."""
        with self._lock, suppress(BrokenPipeError):
            self._pipe.send_bytes(json.dumps(head, allow_nan=False).encode() + b"\n" + body)

    def _listen(self) -> None:
        while True:
            try:
                said = json.loads(self._pipe.recv_bytes())
            except (EOFError, OSError):
                os._exit(0)  # the server is gone, and nobody waits for what is being done
            if "order" in said:
                with suppress(Exception):  # an order that makes no sense to what runs changes nothing
                    self.obey(said["order"])
            else:
                self.requests.put(said)


def _ignore(order: dict[str, Any]) -> None:
    """Nothing runs that takes orders."""


def main(pipe: Connection, uploads: str, made: str) -> None:
    """Serve requests until the server goes away."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's, which ends us
    _limit()
    mail = Mail(pipe)

    def say(words: str) -> None:
        mail.tell({"kind": "progress", "words": words})

    from splinefeed.studio.tasks import TASKS, Bench, error_of

    bench = Bench(Path(uploads), Path(made), say, mail)
    while (request := mail.requests.get()) is not None:
        try:
            answer = TASKS[request["task"]](request, bench)
            entry = answer.pop("entry", None)
            body = json.dumps(answer, separators=(",", ":"), allow_nan=False).encode()
            mail.tell({"kind": "answer", "entry": entry}, body)
        except Exception as error:  # the page is told; the next request finds a worker that goes on
            mail.tell({"kind": "error", "error": error_of(error)})


def _limit() -> None:
    """Bound the memory of this process, where the system can."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        top = MOST_MEMORY if hard == resource.RLIM_INFINITY else min(MOST_MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (top, hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

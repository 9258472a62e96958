"""A process that works for this one: a request at a time, bounded in time and memory, killed when nobody wants it.

Requests and answers are JSON, with a body of any bytes behind an answer: the output of a process that a broken file
has driven mad is read as text and never run. What is pickled or imported from the user's program would be; so the
process is started as a program of its own, and a script needs no `if __name__ == "__main__"`.
"""

from __future__ import annotations

import atexit
import json
import multiprocessing
import multiprocessing.connection
import os
import pathlib
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

Said = dict[str, Any]  # what JSON holds
#: The answer of a worker: the head, and a body.
Answer = tuple[Said, bytes]
Handler = Callable[[Said], Answer]
#: Time that a process which was killed gets to be gone, s.
PATIENCE = 2.0
#: Work is spread over processes once it took this long here and twice as much is left, s: they start in half of it.
WORTH_SPREADING = 1.0
#: Address space of a process that work is spread to, bytes, and items that it is given at a time.
MOST_MEMORY, TOGETHER = 12 * 2**30, 8
#: The worker runs the same splinefeed as this process, wherever that was found.
_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv[1]); from splinefeed import workers; del sys.path[0]; "
    "workers.serve(int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), *sys.argv[5:])"
)


class LostError(Exception):
    """A worker was killed or died over a request.

    Parameters
    ----------
    late : bool
        Whether it timed out.
    """

    def __init__(self, late: bool) -> None:
        super().__init__("it timed out" if late else "it died")
        self.late = late


class Worker:
    """A process that starts with the first request, and again after its death.

    Parameters
    ----------
    handler : str
        "module:function"; called in the process with its `Mail` and `words`, it gives what answers requests.
    *words : str
        For the handler.
    memory : int
        Address space of the process, bytes.
    quiet : bool, optional
        Whether what it prints goes nowhere.
    """

    def __init__(self, handler: str, *words: str, memory: int, quiet: bool = False) -> None:
        self._command = [str(memory), handler, *words]
        self._quiet = quiet
        self._own()
        atexit.register(self.stop)

    def begin(self) -> None:
        """Start the process, which a request would do, so that it is there sooner."""
        with self._lock:
            self._running()

    def ask(self, request: Said, heard: Callable[[Said], None] | None = None, seconds: float | None = None) -> Answer:
        """Send a request, and wait for the answer.

        Parameters
        ----------
        request : dict
            For JSON.
        heard : callable, optional
            Gets what the worker says before.
        seconds : float, optional
            Time that it has, s.

        Returns
        -------
        head : dict
            Of JSON.
        body : bytes
            Behind it.

        Raises
        ------
        LostError
            Without an answer.
        """
        if self._owner != os.getpid():  # forked: two must not talk through the same pipe
            self._own()
        with self._lock:
            end = None if seconds is None else time.monotonic() + seconds
            process, pipe = self._running()
            try:
                self._send(pipe, request)
                while True:
                    if end is not None and not pipe.poll(max(0.0, end - time.monotonic())):
                        raise LostError(late=True)
                    line, _, body = pipe.recv_bytes().partition(b"\n")
                    head = json.loads(line)
                    if head["kind"] == "answer":
                        return head, body
                    if heard is not None:
                        heard(head)
            except (EOFError, OSError):
                raise LostError(late=False) from None
            finally:
                if sys.exc_info()[0] is not None:  # Ctrl-C too: an answer that nobody read would be the next one's
                    self._end(process)

    def order(self, words: Said) -> None:
        """Tell what runs to do otherwise; nothing if nothing runs."""
        pipe = self._pipe
        if pipe is not None:
            with suppress(OSError):
                self._send(pipe, {"order": words})

    def _send(self, pipe: Connection, said: Said) -> None:
        """Send all of it before anything else: an order must not come into the middle of a long request."""
        content = json.dumps(said).encode()
        with self._sending:
            pipe.send_bytes(content)

    def stop(self) -> None:
        """Kill the process; whoever waits for an answer has a LostError."""
        if self._owner == os.getpid():
            self._end(self._process)

    def _own(self) -> None:
        self._owner = os.getpid()
        self._lock, self._sending = threading.Lock(), threading.Lock()
        if (inherited := getattr(self, "_lifeline", None)) is not None:
            os.close(inherited)  # or a fork would keep the parent's worker alive
        self._lifeline: int | None = None  # a pipe that is open as long as this process lives
        self._of_parents = [getattr(self, "_process", None)]  # kept, or Python would say that it still runs
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None

    def _end(self, process: subprocess.Popen[bytes] | None) -> None:
        if process is self._process:
            self._process = self._pipe = None
            if self._lifeline is not None:
                os.close(self._lifeline)
                self._lifeline = None
        if process is not None:
            process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE)

    def _running(self) -> tuple[subprocess.Popen[bytes], Connection]:
        if self._process is not None and self._process.poll() is not None:
            self._end(self._process)
        if self._process is None or self._pipe is None:
            home = str(pathlib.Path(__file__).parent.parent)
            self._pipe, theirs = multiprocessing.Pipe()
            nowhere = subprocess.DEVNULL if self._quiet else None
            end, self._lifeline = os.pipe()
            with theirs, open(end, "rb"):  # closed here, so that their ends are seen
                # -P: what lies in the current folder is not imported
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-c", _PROGRAM, home, str(theirs.fileno()), str(end), *self._command],
                    stdin=subprocess.DEVNULL,
                    stdout=nowhere,
                    stderr=nowhere,
                    pass_fds=[theirs.fileno(), end],
                )
        return self._process, self._pipe


# --- work for all cores -----------------------------------------------------------------------------------------------

Outcome = tuple[list[Any], Exception | None]
_alone = False  # whether this process is one of many already


def cores() -> int:
    """How many processes can work side by side; 1 in a process that is one of several."""
    return 1 if _alone else len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def spread(function: Callable[[Any, Any], Any], shared: Any, items: Sequence[Any]) -> Iterator[Any]:
    """Apply a function to items, here as long as that is little work, then on all cores.

    Parameters
    ----------
    function : callable
        Of a module, called with `shared` and an item. What cannot be pickled stays here.
    shared : object
        For all items.
    items : sequence
        To be worked on.

    Yields
    ------
    object
        What the function gives for each item, in order; an exception comes where its result would.
    """
    began, many = time.monotonic(), cores()
    done = 0
    for item in items:
        spent = time.monotonic() - began
        if many > 1 and spent > WORTH_SPREADING and spent * (len(items) - done) > 2.0 * WORTH_SPREADING * done:
            break
        yield function(shared, item)
        done += 1
    try:
        work = pickle.dumps((function, shared, items)) if done < len(items) else b""
    except (pickle.PicklingError, TypeError, AttributeError):  # a model that is a function of the user's, say
        work = b""
    if not work:
        yield from (function(shared, item) for item in items[done:])
        return
    with tempfile.TemporaryDirectory(prefix="splinefeed-") as folder, ThreadPoolExecutor(many) as pool:
        file = pathlib.Path(folder, "work")
        file.write_bytes(work)
        workers = [Worker("splinefeed.workers:_part", str(file), memory=MOST_MEMORY, quiet=True) for _ in range(many)]
        idle: queue.Queue[Worker] = queue.Queue()
        for worker in workers:
            idle.put(worker)

        def part(first: int) -> Outcome:
            worker = idle.get()
            try:
                return pickle.loads(worker.ask({"first": first})[1])  # type: ignore[no-any-return]
            except LostError:
                return _outcome(function, shared, items[first : first + TOGETHER])
            finally:
                idle.put(worker)

        try:
            for results, failed in pool.map(part, range(done, len(items), TOGETHER)):
                yield from results
                if failed is not None:
                    raise failed
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in workers:
                worker.stop()
                atexit.unregister(worker.stop)


def _part(mail: Mail, file: str) -> Handler:
    """What a process does that work is spread to: the items from a number on."""
    global _alone
    _alone = True
    function, shared, items = pickle.loads(pathlib.Path(file).read_bytes())

    def handle(request: Said) -> Answer:
        first = request["first"]
        return {}, pickle.dumps(_outcome(function, shared, items[first : first + TOGETHER]))

    return handle


def _outcome(function: Callable[[Any, Any], Any], shared: Any, items: Sequence[Any]) -> Outcome:
    """The results of items up to the first exception, and that."""
    results: list[Any] = []
    try:
        for item in items:
            results.append(function(shared, item))
    except Exception as failed:
        return results, failed
    return results, None


# --- in the process ---------------------------------------------------------------------------------------------------


class Mail:
    """What comes in and goes out: requests wait in a queue, orders to what runs are obeyed at once."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._lock = threading.Lock()
        self.requests: queue.Queue[Said] = queue.Queue()
        self.obey: Callable[[Said], None] = lambda order: None
        threading.Thread(target=self._listen, daemon=True).start()

    def tell(self, head: Said, body: bytes = b"") -> None:
        """Send a line of JSON, and a body of any bytes behind it."""
        with self._lock, suppress(BrokenPipeError):
            self._pipe.send_bytes(json.dumps(head, allow_nan=False).encode() + b"\n" + body)

    def _listen(self) -> None:
        while True:
            try:
                said = json.loads(self._pipe.recv_bytes())
                order = "order" in said
            except (EOFError, OSError):
                os._exit(0)  # the parent is gone, and nobody waits for the answer
            except (ValueError, TypeError, RecursionError, MemoryError):
                os._exit(1)  # what cannot be understood is no request: the parent begins again with another process
            if order:
                with suppress(Exception):  # an order that makes no sense to what runs changes nothing
                    self.obey(said["order"])
            else:
                self.requests.put(said)


def serve(pipe: int, lifeline: int, memory: int, handler: str, *words: str) -> None:
    """Answer requests, in the process of a worker.

    Parameters
    ----------
    pipe, lifeline : int
        File descriptors: requests come by the first until its other end closes; the process dies when that of the
        second does.
    memory : int
        Address space of the process, bytes.
    handler : str
        As of `Worker`.
    *words : str
        For the handler.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, which ends us
    _die_with(lifeline)
    limit_memory(memory)
    mail = Mail(Connection(pipe))
    module, _, function = handler.partition(":")
    handle: Handler = getattr(import_module(module), function)(mail, *words)
    while True:
        head, body = handle(mail.requests.get())
        mail.tell({**head, "kind": "answer"}, body)


def _die_with(lifeline: int) -> None:
    """Let the system end this process when the other end of a pipe closes, where it can, whatever it does then.

    A listening thread does not come to it while a library works without letting go of the interpreter.
    """
    with suppress(ImportError, AttributeError, OSError):
        import fcntl
        import select

        fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
        flags = fcntl.fcntl(lifeline, fcntl.F_GETFL)
        fcntl.fcntl(lifeline, fcntl.F_SETFL, flags | os.O_ASYNC)  # SIGIO ends a process that does not handle it
        if select.select([lifeline], [], [], 0.0)[0]:  # it was closed before
            os._exit(0)


def limit_memory(most: int) -> None:
    """Bound the address space of this process, bytes, where the system can; it leaves no core behind."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def end_with_parent(memory: int) -> None:
    """Bound the memory of a process of a pool, and end it when its parent is gone: it would wait for work for ever.

    Parameters
    ----------
    memory : int
        Address space of the process, bytes.
    """
    global _alone
    _alone = True
    limit_memory(memory)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()

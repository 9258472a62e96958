"""Processes that work for this one: bounded in time and memory, told otherwise while they run, and gone with it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from splinefeed import workers
from splinefeed.workers import LostError, Worker

GB = 2**30


def tricks(mail, word):  # runs in the process
    def answer(request):
        if request["do"] == "say":
            mail.tell({"kind": "progress", "words": word})
            return {"pid": os.getpid()}, b"\xff\n\x00"
        if request["do"] == "hoard":
            try:
                return {"got": len(bytearray(4 * GB))}, b""
            except MemoryError:
                return {"got": 0}, b""
        if request["do"] == "hang":  # without letting go of the interpreter
            mail.tell({"kind": "progress", "words": str(os.getpid())})
            re.fullmatch("(a|a)*b", "a" * 60)
        if request["do"] == "long":
            heard = []
            mail.obey = heard.append
            mail.tell({"kind": "progress", "words": "ready"})
            time.sleep(0.5)
            return {"orders": len(heard)}, request["text"][-10:].encode()
        if request["do"] == "die":
            os._exit(3)
        heard = []
        mail.obey = heard.append
        while not heard:
            time.sleep(0.01)
        return {"order": heard[0]}, b""

    return answer


@pytest.fixture
def worker(monkeypatch: pytest.MonkeyPatch) -> Iterator[Worker]:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    made = Worker("test_workers:tricks", "at it", memory=3 * GB)
    yield made
    made.stop()


def test_it_says_how_it_goes_and_answers_with_bytes(worker: Worker) -> None:
    heard = []
    head, body = worker.ask({"do": "say"}, heard.append)
    assert (heard, body) == ([{"kind": "progress", "words": "at it"}], b"\xff\n\x00")
    assert head["pid"] != os.getpid() and worker.ask({"do": "say"})[0]["pid"] == head["pid"]


def test_its_memory_is_bounded(worker: Worker) -> None:
    assert worker.ask({"do": "hoard"})[0]["got"] == 0


def test_one_that_dies_or_takes_too_long_is_said_so_and_the_next_request_finds_another(worker: Worker) -> None:
    first = worker.ask({"do": "say"})[0]["pid"]
    for request, late in (("die", False), ("wait", True)):
        with pytest.raises(LostError) as caught:
            worker.ask({"do": request}, seconds=1.0 if late else None)
        assert caught.value.late is late
    assert worker.ask({"do": "say"})[0]["pid"] != first


def test_what_runs_takes_orders(worker: Worker) -> None:
    from threading import Timer

    worker.ask({"do": "say"})
    Timer(0.2, worker.order, [{"rate": 2}]).start()
    assert worker.ask({"do": "wait"})[0]["order"] == {"rate": 2}


def test_it_ends_with_its_parent_and_a_script_needs_no_guard(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import os\nfrom splinefeed.workers import Worker\nworker = Worker('test_workers:tricks', '', memory=2**32)\n"
        "print(worker.ask({'do': 'say'})[0]['pid'], flush=True)\nos._exit(0)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=environment, check=True)
    for _ in range(200):
        if not Path(f"/proc/{int(done.stdout)}").exists():
            return
        time.sleep(0.05)
    pytest.fail("the worker is still there")


def slow_square(shared: list[int], item: int) -> tuple[int, int]:  # runs here and in other processes
    if item == shared[0]:
        raise ValueError(f"{item} is refused")
    return item * item, os.getpid()


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent))
    monkeypatch.setattr(workers, "WORTH_SPREADING", 0.0)
    monkeypatch.setattr(workers, "cores", lambda: 2)


@pytest.mark.usefixtures("at_once")
def test_work_is_spread_and_comes_back_in_order() -> None:
    found = list(workers.spread(slow_square, [-1], range(60)))
    assert [value for value, _ in found] == [k * k for k in range(60)]
    assert len({pid for _, pid in found} - {os.getpid()}) == 2


@pytest.mark.usefixtures("at_once")
def test_an_exception_comes_where_its_result_would() -> None:
    results = workers.spread(slow_square, [40], range(60))
    assert [next(results)[0] for _ in range(40)] == [k * k for k in range(40)]
    with pytest.raises(ValueError, match="40 is refused"):
        next(results)


@pytest.mark.usefixtures("at_once")
def test_what_cannot_be_pickled_stays_here() -> None:
    found = list(workers.spread(lambda _, item: item + 1, None, range(9)))
    assert found == list(range(1, 10))


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has asked about does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(sys.platform != "linux", reason="as Linux has it")
def test_no_orphan_is_left_of_a_parent_that_was_killed_even_in_the_middle_of_a_library(tmp_path: Path) -> None:
    program = (
        "from splinefeed.workers import Worker\n"
        "worker = Worker('test_workers:tricks', 'x', memory=3 * 2**30)\n"
        "worker.ask({'do': 'hang'}, lambda said: print(said['words'], flush=True))\n"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=env) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        time.sleep(0.5)
        assert alive(pid)
        parent.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20.0
    while alive(pid) and time.monotonic() < end:
        time.sleep(0.05)
    assert not alive(pid)


def test_orders_do_not_come_into_the_middle_of_a_long_request(worker: Worker) -> None:
    over = threading.Event()

    def flood() -> None:
        while not over.is_set():
            worker.order({"rate": 1.0})

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        for _ in range(10):
            _, body = worker.ask({"do": "long", "text": "x" * 4_000_000 + "the end"}, seconds=60.0)
            assert body == b"xxxthe end"
    finally:
        over.set()
        thread.join()

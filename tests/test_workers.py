"""Processes that work for this one: bounded in time and memory, told otherwise while they run, and gone with it."""

from __future__ import annotations

import os
import subprocess
import sys
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

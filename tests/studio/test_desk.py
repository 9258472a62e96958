"""Workers: what takes too long is ended, and the next request finds another one."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest

from splinefeed.errors import InputError
from splinefeed.studio import house as rooms
from splinefeed.studio.settings import KEPT, Bench
from splinefeed.studio.staff import Staff

pytest.importorskip("tornado", reason="the studio needs the extra [studio]")


class Page:
    """A page that remembers what it is told."""

    name = "0" * 16

    def __init__(self) -> None:
        self.told = asyncio.Queue()

    def send(self, kind, **said):
        self.told.put_nowait((kind, said))


def test_a_plan_that_takes_too_long_is_left_to_a_job_and_the_next_worker_is_warmed_up(monkeypatch):
    asked = []

    async def ask(worker, request, heard=None, deadline=None):
        """A worker that is too slow for a plan while sliders move."""
        asked.append((worker, request["task"]))
        late = request["task"] == "plan"
        return {"error": {"fields": {"": "ended"}, "fault": False}, "late": True} if late else {}, b"{}"

    async def scene():
        with Staff() as staff:
            return await plan(rooms.House(None, staff))

    async def plan(house):
        monkeypatch.setattr(rooms, "ask", ask)
        page = Page()
        house.tabs[page.name] = page.send
        house._begin(house._warm())
        house.do_plan(page.name, {"n": 3, "settings": {}, "rest": True})
        while (told := await asyncio.wait_for(page.told.get(), 100))[0] == "state":
            pass
        while house._open():
            await asyncio.sleep(0.01)
        await house.close()
        return told, [task for worker, task in asked if worker in house.front.workers]

    with ThreadPoolExecutor(1) as pool:  # the thread of the tests may have the browser's loop
        told, tasks = pool.submit(asyncio.run, scene()).result()
    assert told == ("planned", {"n": 3, "body": rooms.LATER})
    assert tasks[:3] == ["warm", "plan", "warm"]


def test_an_upload_that_hangs_costs_that_upload_only(monkeypatch):
    """The reader of one tab hangs; the file of another tab is read, and the first one can be cancelled."""

    async def scene():
        with Staff() as staff:
            await read(rooms.House(None, staff))

    async def read(house):
        hanging = asyncio.Event()

        async def ask(worker, request, heard=None, deadline=None):
            if request.get("source") == "hangs":
                worker.stop = hanging.set  # what a cancelled job does to its worker
                await hanging.wait()
                return {"error": {"fields": {"": "ended its worker"}, "fault": False}, "late": False}, b""
            return {}, b"{}"

        monkeypatch.setattr(rooms, "ask", ask)
        one, other = Page(), Page()
        house.tabs["1" * 16], house.tabs["2" * 16] = one.send, other.send
        house.do_job("1" * 16, {"kind": "read", "source": "hangs"})
        await asyncio.sleep(0.01)
        house.do_job("2" * 16, {"kind": "read", "source": "good"})
        while (told := await asyncio.wait_for(other.told.get(), 100))[0] != "done":
            assert told[0] == "job"
        assert house.jobs[0].state == rooms.RUNNING
        house.do_cancel("1" * 16, {"job": house.jobs[0].id})
        while (told := await asyncio.wait_for(one.told.get(), 100))[1].get("job", {}).get("state") != rooms.CANCELLED:
            pass
        await asyncio.wait_for(hanging.wait(), 100)
        await house.close()

    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, scene()).result()


def test_tabs_jobs_and_plans_are_bounded(monkeypatch):
    """What pages ask for, without end; the workers are busy."""

    async def scene():
        with Staff() as staff:
            await crowd(rooms.House(None, staff))

    async def crowd(house):
        busy = asyncio.Event()

        async def ask(worker, request, heard=None, deadline=None):
            await busy.wait()
            return {}, b"{}"

        monkeypatch.setattr(rooms, "ask", ask)
        house._offer = asyncio.get_running_loop().create_future()
        tabs = [f"{k:016x}" for k in range(3 * rooms.MOST_TABS)]
        for tab in tabs[: rooms.MOST_TABS]:
            house.welcome(tab, lambda *words, **said: None)
        with pytest.raises(InputError, match="64 tabs are open already; close one"):
            house.welcome(tabs[-1], lambda *words, **said: None)
        house.welcome(tabs[0], lambda *words, **said: None)  # one that was reloaded
        for n, tab in enumerate(tabs * 2):
            house.do_plan(tab, {"n": n, "settings": {}})
        assert len(house._open()) == rooms.MOST_TABS
        for k in range(rooms.MOST_WAITING):
            house.do_job(tabs[0], {"kind": "read", "source": str(k)})
        with pytest.raises(InputError, match="16 jobs are waiting; cancel one, or wait"):
            house.do_job(tabs[0], {"kind": "read", "source": "one more"})
        house.do_job(tabs[0], {"kind": "read", "source": "3"})  # the same again is none
        for k in range(3 * rooms.ANSWERS):
            house.do_job(tabs[1 + k], {"kind": "read", "source": "x"})
        busy.set()
        while house._open() or len(house.jobs) > rooms.ANSWERS:
            await asyncio.sleep(0.01)
        assert len(house.jobs) == rooms.ANSWERS
        await house.close()

    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, scene()).result(100)


def test_a_worker_keeps_the_last_runs_alone(tmp_path):
    """And gives what it kept, without planning again."""

    class NoMail:
        said = 0

        def tell(self, head, body=b""):
            self.said += 1

    bench = Bench(tmp_path, tmp_path, NoMail())
    settings = [{"source": {"shape": f"circle?radius={radius}"}, "period": "5 ms"} for radius in range(2, 3 + 2 * KEPT)]
    made = [bench.done(each)[1] for each in settings]
    assert len(bench.runs) == KEPT
    said = bench.mail.said
    assert bench.done(settings[-1])[1] is made[-1] and bench.mail.said == said
    assert bench.done(settings[0])[1] is not made[0] and len(bench.runs) == KEPT

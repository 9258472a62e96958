"""Workers: what takes too long is ended, and the next request finds another one."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest

from splinefeed.studio import house as rooms

pytest.importorskip("tornado", reason="the studio needs the extra [studio]")


class Page:
    """A page that remembers what it is told."""

    name = "0" * 16

    def __init__(self) -> None:
        self.told = asyncio.Queue()

    def send(self, kind, **said):
        self.told.put_nowait((kind, said))


class SlowDesk:
    """A worker that is too slow for a plan while sliders move."""

    def __init__(self) -> None:
        self.asked = []

    async def ask(self, request, heard=None, deadline=None):
        self.asked.append(request["task"])
        late = request["task"] == "plan"
        return {"error": {"fields": {"": "ended"}, "fault": False}, "late": True} if late else {}, b"{}"

    async def close(self):
        pass


def test_a_plan_that_takes_too_long_is_left_to_a_job_and_the_next_worker_is_warmed_up():
    async def scene():
        house = rooms.House(None)
        house.front, house.player = SlowDesk(), SlowDesk()
        house.add = lambda *words: None
        page = Page()
        house.tabs[page.name] = page.send
        house._begin(house._plan_for_ever())
        house.plan(page.name, {"n": 3, "settings": {}, "rest": True})
        while (told := await asyncio.wait_for(page.told.get(), 100))[0] == "state":
            pass
        await asyncio.sleep(0)
        asked = house.front.asked
        await house.close()
        return told, asked

    with ThreadPoolExecutor(1) as pool:  # the thread of the tests may have the browser's loop
        told, asked = pool.submit(asyncio.run, scene()).result()
    assert told == ("planned", {"n": 3, "body": rooms.LATER})
    assert asked[:3] == ["warm", "plan", "warm"]

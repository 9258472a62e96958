"""Many tabs at once: each gets its plan, whatever the others do, and waits for no other's."""

from __future__ import annotations

import asyncio
import http.client
import json
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("tornado", reason="the studio needs the extra [studio]")

from splinefeed.studio.house import QUICK
from studio_tools import new_tab

#: Tabs, the one that closes in the middle, and the one whose text would hang a reader; s that all may take.
TABS, CLOSES, HANGS, PATIENCE = 20, 7, 11, 300.0
#: Tabs whose plan takes longer than it may while sliders move, s: 36 million ticks.
SLOW_TABS = (12, 13, 14)
SLOW = {
    "source": {"shape": "butterfly"},
    "period": "0.1 ms",
    "limits": {"feed": "0.1", "axis_acceleration": "500", "axis_jerk": "20000"},
}


def quick(k: int) -> dict:
    """Settings of a plan that takes some ms, those of each tab other ones."""
    limits = {"feed": str(20 + k), "axis_acceleration": "500", "axis_jerk": "20000"}
    return {"source": {"shape": "circle"}, "limits": limits}


async def tab(studio, cookie: str, k: int) -> dict | None:
    """What tab `k` is answered; None for the one that closes."""
    async with new_tab(studio.port, cookie) as connection:
        if k == HANGS:
            await connection.write_message(json.dumps({"do": "share", "text": "a=" + "[" * 5_000_000}))
        else:
            given = SLOW if k in SLOW_TABS else quick(k)
            await connection.write_message(json.dumps({"do": "plan", "n": k, "settings": given}))
        if k == CLOSES:
            return None
        while True:
            message = await connection.read_message()
            assert message is not None, f"the socket of tab {k} was closed"
            said = json.loads(message)
            if said["kind"] in ("planned", "refused"):
                return {**said, "at": time.monotonic()}


def test_twenty_tabs_plan_at_once_one_closes_in_the_middle_and_none_waits_for_another(studio):
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=200)
    connection.request("GET", f"/?token={studio.token}")
    with connection.getresponse() as answer:
        cookie = answer.headers["Set-Cookie"].partition(";")[0]
        answer.read()
    connection.close()

    async def all_of_them() -> list[dict | None]:
        every = asyncio.gather(*(tab(studio, cookie, k) for k in range(TABS)))
        return await asyncio.wait_for(every, PATIENCE)

    begin = time.monotonic()
    with ThreadPoolExecutor(1) as pool:  # the thread of the tests may have the browser's loop
        found = pool.submit(asyncio.run, all_of_them()).result()
    for k, said in enumerate(found):
        if k == CLOSES:
            assert said is None
        elif k == HANGS:
            assert said is not None and said["kind"] == "refused"
        else:
            assert said is not None and said["kind"] == "planned" and said["n"] == k
    slow = [found[k]["at"] for k in SLOW_TABS]
    assert all(not found[k]["answer"]["final"] for k in SLOW_TABS) and min(slow) - begin > QUICK - 1.0
    assert max(said["at"] for k, said in enumerate(found) if said is not None and k not in SLOW_TABS) < min(slow)

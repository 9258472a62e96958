"""Everything that a running studio holds: workers, queue, uploads, history, and the tabs that are open."""

from __future__ import annotations

import asyncio
import json
import shutil
import tempfile
from collections import OrderedDict
from collections.abc import Coroutine, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from splinefeed.errors import InputError
from splinefeed.studio.desk import Desk
from splinefeed.studio.history import History
from splinefeed.studio.jobs import DONE, FAILED, Job, Jobs
from splinefeed.studio.offer import offer
from splinefeed.studio.uploads import Uploads

#: Files made for download that are kept; time that a plan may take while sliders move, s.
MADE, QUICK = 16, 20.0
#: The answer to a plan that takes longer: a page at rest then asks for a job, which has time and can be cancelled.
LATER = b'{"final":false,"shown":null}'
COMPILING = "loading the kernels; the first time they are compiled for this machine, a minute or two"


class Tab(Protocol):
    """An open page."""

    name: str

    def send(self, kind: str, **said: Any) -> None:
        """Tell the page something; `body`, bytes of JSON, is put in as it is."""


class House:
    """The parts of a studio and how they work together; `close` ends the workers and takes the files away."""

    def __init__(self, history: Path | None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="splinefeed-studio-"))
        self.uploads = Uploads(self.folder / "uploads")
        self.made = self.folder / "made"
        self.made.mkdir(mode=0o700)
        self.history = None if history is None else History(history, self.uploads)
        self.front = Desk("front", self.uploads.folder, self.made)
        self.back = Desk("back", self.uploads.folder, self.made)
        self.player = Desk("player", self.uploads.folder, self.made)
        self.playing: str | None = None
        self.tabs: dict[str, Tab] = {}
        self.ready = "warming up"
        self.jobs = Jobs(self.back, self._job_changed, self._job_ended)
        self._waiting: OrderedDict[str, dict[str, Any]] = OrderedDict()
        self._wake = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()

    def open(self) -> None:
        """Begin to work: warm the workers up, then take requests."""
        # what pages can choose from needs half the package imported, which is not to keep the server from answering
        self._offer = asyncio.get_running_loop().run_in_executor(None, offer)
        self._begin(self._plan_for_ever())
        self._begin(self.jobs.work())

    def welcome(self, tab: Tab) -> None:
        """Say to a page what there is, how things stand, and what it has missed."""
        self.tabs[tab.name] = tab
        self._begin(self._welcome(tab))

    async def _welcome(self, tab: Tab) -> None:
        there = await asyncio.shield(self._offer)
        tab.send("welcome", offer=there, state=self.ready, jobs=[job.shown() for job in self.jobs.open()])
        for job in list(self.jobs.all):
            if job.tab == tab.name:
                self.deliver(job)

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End all work and leave no file behind."""
        for task in list(self._tasks):
            task.cancel()
        for desk in (self.front, self.back, self.player):
            with suppress(OSError):
                await desk.close()
        if self.history is not None:
            self.history.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def tell(self, kind: str, **said: Any) -> None:
        """Tell every page."""
        for tab in list(self.tabs.values()):
            tab.send(kind, **said)

    def plan(self, tab: str, message: dict[str, Any]) -> None:
        """Plan at once for a tab; its earlier requests without an answer are dropped."""
        self._waiting[tab] = message
        self._wake.set()

    async def _plan_for_ever(self) -> None:
        await self.front.ask({"task": "warm"}, lambda head: self._state(COMPILING))
        self._state("ready")
        self.jobs.add(
            "warm", "warming up", "", {"task": "warm", "all": True}
        )  # not before: both would compile the same
        self._begin(self._warm_player())
        while True:
            if not self._waiting:
                self._wake.clear()
                await self._wake.wait()
                continue
            name, message = self._waiting.popitem(last=False)
            request = {"task": "plan", "settings": message["settings"], "look": message.get("look")}
            answer = await self.front.ask(request, lambda head: None, QUICK)
            if answer.late:
                if name in self.tabs:
                    self.tabs[name].send("planned", n=message["n"], body=LATER)
                await self.front.ask({"task": "warm"}, lambda head: None)  # the next worker begins again
                continue
            if name not in self.tabs:
                continue
            if answer.error is not None:
                self.tabs[name].send("refused", n=message["n"], error=answer.error)
                continue
            self.tabs[name].send("planned", n=message["n"], body=answer.body)
            if answer.entry is not None and message["rest"]:
                self.remember(message["settings"], answer.entry)

    def play(self, tab: str, request: dict[str, Any]) -> None:
        """Begin to play for a tab; InputError while another one plays."""
        if self.playing is not None:
            raise InputError("a motion is being played already, perhaps in another tab; stop it first")
        self.playing = tab
        self._begin(self._play(tab, request))

    async def _play(self, tab: str, request: dict[str, Any]) -> None:
        try:
            answer = await self.player.ask({"task": "play", **request}, lambda head: self._frame(tab, head))
        finally:
            self.playing = None
        if tab in self.tabs:
            if answer.error is not None:
                self.tabs[tab].send("played", error=answer.error)
            else:
                self.tabs[tab].send("played", body=answer.body)

    def _frame(self, tab: str, head: dict[str, Any]) -> None:
        if tab in self.tabs:
            said = {name: value for name, value in head.items() if name != "kind"}
            self.tabs[tab].send("frame" if head["kind"] == "frame" else "playing", **said)

    async def _warm_player(self) -> None:
        await self.player.ask({"task": "warm", "play": True}, lambda head: None)

    def remember(self, settings: Mapping[str, Any], entry: Mapping[str, Any]) -> None:
        """Put a plan into the history."""
        if self.history is not None:
            from splinefeed.studio.settings import complete

            self.history.add(complete(settings), entry)
            self.tell("history")

    def reopen(self, number: int) -> dict[str, Any]:
        """The settings of a plan of the history; InputError if there is none."""
        found = None if self.history is None else self.history.settings(number)
        if found is None:
            raise InputError("that plan is not in the history any more")
        return found

    def download(self, name: str) -> Path | None:
        """A file that was made, None if it is not there any more."""
        kept = sorted((each for each in self.made.iterdir()), key=lambda each: each.stat().st_mtime_ns)
        for old in kept[:-MADE]:
            shutil.rmtree(old, ignore_errors=True)
        place = self.made / name
        files = sorted(place.iterdir()) if place in kept[-MADE:] else []
        return files[0] if files else None

    def _state(self, words: str) -> None:
        self.ready = words
        self.tell("state", words=words)

    def _job_changed(self, job: Job) -> None:
        self.tell("job", job=job.shown())

    def _job_ended(self, job: Job) -> None:
        assert job.answer is not None
        if job.kind == "settle" and job.state == DONE and job.wanted and job.answer.entry is not None:
            self.remember(job.request["settings"], job.answer.entry)
        self.deliver(job)

    def deliver(self, job: Job) -> None:
        """Send the answer of a job to its page, if it is there and the answer still wanted."""
        tab = self.tabs.get(job.tab)
        if tab is None or job.seen or not job.wanted or job.answer is None:
            return
        job.seen = True
        if job.state == FAILED:
            tab.send("failed", job=job.shown(), error=job.answer.error)
        elif job.state == DONE:
            tab.send("done", job=job.shown(), settings=job.request.get("settings"), body=job.answer.body)


def message(kind: str, said: Mapping[str, Any], body: bytes | None) -> bytes:
    """A message to a page; the body, JSON already, is put in as it is."""
    head = json.dumps({"kind": kind, **said}, allow_nan=False).encode()
    return head if body is None else head[:-1] + b',"answer":' + body + b"}"

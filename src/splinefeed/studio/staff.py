"""The workers of a studio and the folders that they share; the first one starts before what serves is imported."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from weakref import WeakValueDictionary

from splinefeed.workers import Worker

#: Address space of a worker, bytes; the libraries alone take some GB of it, most never touched.
MOST_MEMORY = 12 * 2**30
#: Workers for plans while sliders move, and for jobs: so many tabs are worked for at once.
MOST_WORKERS = 4


class Crew:
    """Workers of a kind, each for one tab at a time: what hangs keeps the tab waiting whose task it is, no other.

    A tab has one of them at most. Who was idle last works first, so that one tab alone always has the same.
    """

    def __init__(self, *words: str) -> None:
        # the process of each starts with its first task
        self.workers = [Worker(*words, memory=MOST_MEMORY) for _ in range(MOST_WORKERS)]
        self._idle = self.workers[::-1]
        self._free = asyncio.Semaphore(MOST_WORKERS)
        self._turns: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    @asynccontextmanager
    async def one(self, tab: str) -> AsyncIterator[Worker]:
        """A worker for a tab; those who wait come in their order."""
        turn = self._turns.get(tab) or asyncio.Lock()
        self._turns[tab] = turn
        async with turn, self._free:
            worker = self._idle.pop()
            try:
                yield worker
            finally:
                self._idle.append(worker)


class Staff:
    """The workers of a studio; as a context it ends their processes.

    Attributes
    ----------
    front, back : Crew
        Who plans while sliders move, and who does jobs.
    player : Worker
        Who plays.
    folder : Path
        Of its own, removed at the end, with `uploads` and files `made`.
    """

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="splinefeed-studio-"))
        self.uploads, self.made = self.folder / "uploads", self.folder / "made"
        for each in (self.uploads, self.made):
            each.mkdir()
        words = ("splinefeed.studio.tasks:open_bench", str(self.uploads), str(self.made))
        self.front, self.back = Crew(*words), Crew(*words)
        self.player = Worker(*words, memory=MOST_MEMORY)

    def __enter__(self) -> Staff:
        self.front.workers[0].begin()
        return self

    def __exit__(self, *raised: object) -> None:
        for worker in (*self.front.workers, *self.back.workers, self.player):
            worker.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

"""Jobs that take their time: one at a time, the others wait in a queue; each can be cancelled."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from splinefeed.errors import InputError
from splinefeed.studio.desk import Answer, Desk

#: Jobs that may wait, of all tabs together, and ended ones whose answers are kept for a page that was reloaded.
MOST_WAITING, ANSWERS = 16, 8
WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"
#: A job that others replace is left to end by itself if it has run for less than this, s: a new worker takes longer.
LEFT_ALONE = 3.0


@dataclass
class Job:
    """One job: its request, its tab, and its progress."""

    id: int
    kind: str
    title: str
    tab: str
    request: dict[str, Any]
    state: str = WAITING
    words: str = ""
    answer: Answer | None = None
    seen: bool = False  # whether the page of its tab has had the answer
    begun: float = 0.0
    wanted: bool = True  # whether its answer is still wanted; one that newer settings have replaced is not
    share: list[int] = field(default_factory=list)  # done and total, where the job can tell

    def shown(self) -> dict[str, Any]:
        """What pages show of it."""
        return {
            "id": self.id, "kind": self.kind, "title": self.title, "tab": self.tab, "state": self.state,
            "words": self.words, "share": self.share,
        }  # fmt: skip


class Jobs:
    """The queue, and the worker that works it off.

    changed  called with a job whenever its state or its words change; ended  when it has an answer
    """

    def __init__(self, desk: Desk, changed: Callable[[Job], None], ended: Callable[[Job], None]) -> None:
        self._desk = desk
        self._changed, self._ended = changed, ended
        self._numbers = itertools.count(1)
        self._wake = asyncio.Event()
        self.all: list[Job] = []

    def add(self, kind: str, title: str, tab: str, request: dict[str, Any]) -> Job:
        """Put a job into the queue; one that asks the same for the same tab is taken for it. InputError if it is full.

        A `settle` replaces those before it of its tab.
        """
        for job in self.open():
            if (job.kind, job.tab, job.request) == (kind, tab, request) and job.wanted:
                return job
        if kind == "settle":
            self.replace(tab)
        if len(self.open()) >= MOST_WAITING:
            raise InputError(f"{MOST_WAITING} jobs are waiting; cancel one, or wait")
        job = Job(next(self._numbers), kind, title, tab, request)
        self.all.append(job)
        self._changed(job)
        self._wake.set()
        return job

    def replace(self, tab: str) -> None:
        """The settings of a tab have changed: what it has in the queue by the old ones is not wanted any more."""
        for job in self.open():
            if job.kind == "settle" and job.tab == tab:
                job.wanted = False
                long = job.state == RUNNING and asyncio.get_running_loop().time() - job.begun > LEFT_ALONE
                if job.state == WAITING or long:
                    self.cancel(job.id)

    def open(self) -> list[Job]:
        """Those that wait or run."""
        return [job for job in self.all if job.state in (WAITING, RUNNING)]

    def cancel(self, number: int) -> None:
        """Take a job out of the queue, or end it by ending its worker."""
        for job in self.open():
            if job.id == number:
                running = job.state == RUNNING
                job.state = CANCELLED
                self._changed(job)
                if running:
                    self._desk.kill()

    async def work(self) -> None:
        """Work the queue off, for ever."""
        while True:
            job = next((each for each in self.all if each.state == WAITING), None)
            if job is None:
                self._wake.clear()
                await self._wake.wait()
                continue
            job.state, job.begun = RUNNING, asyncio.get_running_loop().time()
            self._changed(job)
            answer = await self._desk.ask(job.request, lambda head, job=job: self._heard(job, head))  # type: ignore[misc]
            if job.state == RUNNING:
                job.answer = answer
                job.state = FAILED if answer.error else DONE
                self._changed(job)
                self._ended(job)
            self._forget()

    def _heard(self, job: Job, head: dict[str, Any]) -> None:
        job.words = str(head.get("words", ""))
        job.share = list(head.get("share", []))
        if job.state == RUNNING:
            self._changed(job)

    def _forget(self) -> None:
        closed = [job for job in self.all if job.state not in (WAITING, RUNNING)]
        for job in closed[:-ANSWERS]:
            self.all.remove(job)

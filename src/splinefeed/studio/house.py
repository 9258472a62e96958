"""Everything that a running studio holds: workers, queue, files, history, and the tabs that are open."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from splinefeed.errors import InputError
from splinefeed.studio import settings
from splinefeed.studio.history import History
from splinefeed.studio.staff import Staff
from splinefeed.workers import Answer, LostError, Said, Worker

#: Time that a plan may take while sliders move, s.
QUICK = 20.0
#: The answer to a plan that takes longer: a page at rest then asks for a job, which has time and can be cancelled.
LATER = b'{"final":false,"shown":null}'
COMPILING = "loading the kernels; the first time they are compiled for this machine, a minute or two"
#: Jobs of a tab that may wait, and ended ones whose answers are kept for a page that was reloaded.
MOST_WAITING, ANSWERS = 16, 8
#: Most tabs at once, and requests of tabs that are remembered.
MOST_TABS = 64
#: Time that other workers wait for the first page to have its plan, s.
FIRST = 10.0
#: Time that a plan while sliders move and reading an upload may take, s; other jobs say how far they are and can be
#: cancelled.
DEADLINES = {"plan": QUICK, "read": 120.0}
#: What newer settings of a tab replace, and what no list of jobs shows: that ends soon, or is no tab's.
PLANS, UNSEEN = ("plan", "settle"), ("plan", "warm")
#: A job that others replace is left to end by itself if it has run for less than this, s: a new worker takes longer.
LEFT_ALONE = 3.0
WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"


async def ask(
    worker: Worker, request: Said, heard: Callable[[Said], None] = lambda head: None, deadline: float | None = None
) -> Answer:
    """Ask a worker, and wait for its answer.

    Parameters
    ----------
    worker : Worker
        Of a crew, or the player.
    request : dict
        For JSON.
    heard : callable, optional
        Called with progress.
    deadline : float, optional
        Time after which the worker is killed, s.

    Returns
    -------
    head : dict
        With an `error`, words by field, or an `entry` for the history.
    body : bytes
        JSON.
    """
    loop = asyncio.get_running_loop()

    def said(head: Said) -> None:
        loop.call_soon_threadsafe(heard, head)

    try:
        return await asyncio.to_thread(worker.ask, request, said, deadline)
    except LostError as error:
        took = f"takes longer than {deadline:.0f} s" if error.late else "ended its worker"
        words = f"this {took}: the input may be too large or broken"
        return {"error": {"fields": {"": words}, "fault": False}, "late": error.late}, b""


@dataclass
class StudioJob:
    """One job: its request, its tab, and its progress."""

    id: int
    kind: str
    title: str
    tab: str
    request: Said
    state: str = WAITING
    words: str = ""
    share: list[int] = field(default_factory=list)  # done and total, where the job can tell
    answer: Answer | None = None
    begun: float = 0.0
    worker: Worker | None = None  # while it runs
    wanted: bool = True  # whether its page still wants the answer: neither had it nor replaced it by newer settings

    def shown(self) -> dict[str, Any]:
        """What pages show of it."""
        return {name: getattr(self, name) for name in ("id", "kind", "title", "tab", "state", "words", "share")}


#: What each kind of job is called, and what it takes from the page.
JOBS = {
    "settle": ("plan", "settings"),
    "read": ("read file", "source"),
    "make": ("make file", "settings", "what", "form"),
    "tune": ("tune", "settings", "how"),
}


class House:
    """The parts of a studio and how they work together, over its staff; `close` ends all work."""

    def __init__(self, history: Path | None, staff: Staff) -> None:
        self.uploads, self.made = staff.uploads, staff.made
        self.history = None if history is None else History(history, self.uploads)
        self.front, self.back, self.player = staff.front, staff.back, staff.player
        self.playing: str | None = None
        self.tabs: dict[str, Callable[..., None]] = {}  # how to tell something to each open page, by its name
        self.ready = "warming up"
        self.jobs: list[StudioJob] = []
        self._numbers = itertools.count(1)
        self._shown = asyncio.Event()  # whether a page has a final plan
        self._tasks: set[asyncio.Task[None]] = set()

    def open(self) -> None:
        """Begin to work: warm the workers up, then take requests."""
        # what pages can choose from takes its time, which is not to keep the server from answering
        self._offer = asyncio.get_running_loop().run_in_executor(None, settings.offer)
        self._begin(self._warm())

    def _begin(self, work: Coroutine[Any, Any, Any]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End all work."""
        for task in list(self._tasks):
            task.cancel()
        for worker in (*self.front.workers, *self.back.workers, self.player):
            await asyncio.to_thread(worker.stop)
        if self.history is not None:
            self.history.close()

    def welcome(self, tab: str, send: Callable[..., None]) -> None:
        """Say to a page what there is, how things stand, and what it has missed.

        Parameters
        ----------
        tab : str
            What the page calls itself.
        send : callable
            Tells it something of a kind; `body`, bytes of JSON, is put in as it is.

        Raises
        ------
        InputError
            Where too many are open.
        """
        if tab not in self.tabs and len(self.tabs) >= MOST_TABS:
            raise InputError(f"{MOST_TABS} tabs are open already; close one")
        self.tabs[tab] = send

        async def welcome() -> None:
            there = await asyncio.shield(self._offer)
            waiting = [job.shown() for job in self._open() if job.kind not in UNSEEN]
            send("welcome", offer=there, state=self.ready, jobs=waiting)
            for job in list(self.jobs):
                self._deliver(job)

        self._begin(welcome())

    def tell(self, kind: str, **said: Any) -> None:
        """Tell every page."""
        for send in list(self.tabs.values()):
            send(kind, **said)

    def _tell_one(self, name: str, kind: str, **said: Any) -> None:
        if name in self.tabs:
            self.tabs[name](kind, **said)

    async def _warm(self) -> None:
        def state(words: str) -> None:
            self.ready = words
            self.tell("state", words=words)

        async with self.front.one("") as worker:
            await ask(worker, {"task": "warm"}, lambda head: state(COMPILING))
        state("ready")
        with suppress(TimeoutError):  # the first plan, and what it leads to, has the processor for itself
            await asyncio.wait_for(self._shown.wait(), FIRST)
        await ask(self.player, {"task": "warm", "play": True})  # one after the other: a processor is left for sliders
        self.add("warm", "warming up", "", {"task": "warm", "all": True})

    # --- what pages ask, each a method `do_...` ---

    def request(self, tab: str, said: Said) -> None:
        """Do what a page asks; InputError for what cannot be, and any other error for a request that is none."""
        getattr(self, f"do_{said['do']}")(tab, said)

    def do_job(self, tab: str, said: Said) -> None:
        """Put a job into the queue."""
        words, *fields = JOBS[said["kind"]]
        request = {"task": said["kind"], **{name: said[name] for name in fields if name in said}}
        self.add(said["kind"], f"{words} {str(said.get('title', ''))[:60]}".strip(), tab, request)

    def do_history(self, tab: str, said: Said) -> None:
        """Forget an entry of the history, open one, or list all."""
        if self.history is None:
            self._tell_one(tab, "entries", entries=[], kept=False)
        elif "delete" in said:
            self.history.delete(int(said["delete"]))
            self.tell("history")
        elif "open" in said:
            found = self.history.settings(int(said["open"]))
            self._tell_one(tab, "opened", settings=found, pin=bool(said.get("pin")))
        else:
            self._tell_one(tab, "entries", entries=self.history.entries(), kept=True)

    def do_share(self, tab: str, said: Said) -> None:
        """Settings from the text of a file, or to it."""
        if "text" in said:
            self._begin(self._open_text(tab, said.get("n"), str(said["text"])))
        else:
            self._tell_one(tab, "toml", text=settings.to_toml(dict(said["settings"])))

    async def _open_text(self, tab: str, n: Any, text: str) -> None:
        async with self.front.one(tab) as worker:
            head, body = await ask(worker, {"task": "opened", "text": text}, deadline=QUICK)
        if "error" in head:
            self._tell_one(tab, "refused", n=n, error=head["error"])
        else:
            self._tell_one(tab, "opened", settings=json.loads(body)["settings"], pin=False)

    def do_plan(self, tab: str, said: Said) -> None:
        """Plan at once, while sliders move; plans of the tab by older settings are dropped."""
        how = {"n": int(said["n"]), "look": said.get("look"), "rest": bool(said.get("rest"))}
        self.add("plan", "", tab, {"task": "plan", "settings": dict(said["settings"]), **how})
        for old in [job for job in self._open() if job.kind == "plan"][:-MOST_TABS]:
            self._cancel(old)

    def do_stop(self, tab: str, said: Said) -> None:
        """Stop planning for a tab, by ending the worker that does, and what it has in the queue."""
        for job in self._open():
            if job.kind in PLANS and job.tab == tab:
                self._cancel(job)

    def do_order(self, tab: str, said: Said) -> None:
        """Tell the motion that is played to do otherwise."""
        if self.playing == tab:
            self.player.order({name: value for name, value in said.items() if name != "do"})

    def do_play(self, tab: str, said: Said) -> None:
        """Begin to play; InputError while another tab plays."""
        request = {"settings": dict(said["settings"]), "top": float(said["top"]), "override": float(said["override"])}
        if self.playing is not None:
            raise InputError("a motion is being played already, perhaps in another tab; stop it first")
        self.playing = tab
        self._begin(self._play(tab, request))

    async def _play(self, tab: str, request: Said) -> None:
        def heard(head: Said) -> None:
            self._tell_one(tab, "frame" if head.pop("kind") == "frame" else "playing", **head)

        try:
            head, body = await ask(self.player, {"task": "play", **request}, heard)
        finally:
            self.playing = None
        self._tell_one(tab, "played", **({"error": head["error"]} if "error" in head else {"body": body}))

    # --- jobs, one at a time of each tab ---

    def _open(self) -> list[StudioJob]:
        """Jobs that wait or run."""
        return [job for job in self.jobs if job.state in (WAITING, RUNNING)]

    def add(self, kind: str, title: str, tab: str, request: Said) -> None:
        """Put a job into the queue, unless the same tab has sent the same; InputError if it is full.

        A plan replaces those before it of its tab.
        """
        if any((job.kind, job.tab, job.request, job.wanted) == (kind, tab, request, True) for job in self._open()):
            return
        if kind in PLANS:
            self.replace(tab)
        if kind != "plan" and sum(job.tab == tab for job in self._open()) >= MOST_WAITING:
            raise InputError(f"{MOST_WAITING} jobs are waiting; cancel one, or wait")
        job = StudioJob(next(self._numbers), kind, title, tab, request)
        self.jobs.append(job)
        self._changed(job)
        self._begin(self._work(job))

    def replace(self, tab: str) -> None:
        """The settings of a tab have changed: what it has in the queue by the old ones is not wanted any more."""
        for job in self._open():
            if job.kind in PLANS and job.tab == tab:
                job.wanted = False
                ran = asyncio.get_running_loop().time() - job.begun
                if job.state == WAITING or ran > LEFT_ALONE:
                    self._cancel(job)

    def do_cancel(self, tab: str, said: Said) -> None:
        """Cancel a job."""
        for job in self._open():
            if job.id == int(said["job"]):
                self._cancel(job)

    def _cancel(self, job: StudioJob) -> None:
        """Take a job out of the queue, or end it by ending its worker."""
        running, job.state = job.state == RUNNING, CANCELLED
        self._changed(job)
        if running and job.worker is not None:
            job.worker.stop()

    def _changed(self, job: StudioJob) -> None:
        if job.kind not in UNSEEN:
            self.tell("job", job=job.shown())

    async def _work(self, job: StudioJob) -> None:
        def heard(head: Said) -> None:
            job.words, job.share = str(head.get("words", "")), list(head.get("share", []))
            if job.state == RUNNING:
                self._changed(job)

        crew = self.front if job.kind == "plan" else self.back
        async with crew.one(job.tab) as job.worker:
            if job.state == WAITING:
                job.state, job.begun = RUNNING, asyncio.get_running_loop().time()
                self._changed(job)
                head, body = await ask(job.worker, job.request, heard, DEADLINES.get(job.kind))
                if job.state == RUNNING:  # or it was cancelled
                    job.answer, job.state = (head, body), FAILED if "error" in head else DONE
                    self._answered(job, head)
                if job.kind == "plan" and (job.state == CANCELLED or head.get("late")):
                    await ask(job.worker, {"task": "warm"})  # the next worker begins again
        closed = [each for each in self.jobs if each.state not in (WAITING, RUNNING)]
        for each in [job] if job.kind == "plan" else closed[:-ANSWERS]:
            self.jobs.remove(each)

    def _answered(self, job: StudioJob, head: Said) -> None:
        """Tell pages of a job's end, and the history of a plan."""
        entry = head.get("entry")
        if job.kind != "plan" or entry is not None:  # else a final plan follows
            self._shown.set()
        self._changed(job)
        if self.history is not None and job.wanted and entry is not None and job.request.get("rest", True):
            self.history.add(settings.complete(job.request["settings"]), entry)
            self.tell("history")
        self._deliver(job)

    def _deliver(self, job: StudioJob) -> None:
        """Send the answer of a job to its page, if it is there and the answer still wanted."""
        if job.tab not in self.tabs or not job.wanted or job.answer is None:
            return
        job.wanted = False
        (head, body), n = job.answer, job.request.get("n")
        if job.kind == "plan" and job.state == FAILED and not head.get("late"):
            self._tell_one(job.tab, "refused", n=n, error=head["error"])
        elif job.kind == "plan":
            self._tell_one(job.tab, "planned", n=n, body=LATER if job.state == FAILED else body)
        elif job.state == FAILED:
            self._tell_one(job.tab, "failed", job=job.shown(), error=head["error"])
        else:
            self._tell_one(job.tab, "done", job=job.shown(), settings=job.request.get("settings"), body=body)

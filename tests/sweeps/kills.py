"""Sweeps killed with kill -9 again and again, at any moment, and taken up again: `python tests/sweeps/kills.py SEED N`.

Each sweep, in a process that is forked anew for each attempt, dies after a random time, or at a random one of the
things that it does to files (opening, renaming, removing, making folders, locking); N kills in all. After each the
dataset can be read, has lost nothing and holds no row twice; at the end it is, file by file, what an undisturbed sweep
leaves.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

#: What is done to files; each is a moment to die at.
EVENTS = ("open", "os.rename", "os.remove", "os.mkdir", "fcntl.flock")


def spec_of(draw: random.Random) -> dict[str, Any]:
    """A sweep of 6 to 40 short runs, some of which fail."""
    return {
        "sources": ["line?length=1", "line?length=2"],
        "seed": draw.randrange(100),
        "set": {"limits": {"acceleration": 400, "jerk": 2e4}},
        "grid": {
            "method": ["arc-length", "taylor-1"], "strategy": ["seven-phase", "time-optimal"][: draw.randint(1, 2)],
        },
        "random": {"count": draw.randint(3, 10), "limits.feed": {"normal": [10, 6]}},
    }  # fmt: skip


def attempt(spec: dict[str, Any], folder: Path, draw: random.Random, seconds: float) -> bool:
    """Sweep into the folder in a process that is killed on the way; whether it came to the end all the same."""
    import splinefeed as sf

    at_event = draw.randrange(1, 60) if draw.random() < 0.6 else 0
    child = os.fork()
    if child == 0:
        seen = 0

        def die(event: str, _: object) -> None:
            nonlocal seen
            if event in EVENTS:
                seen += 1
                if seen == at_event:
                    os.kill(os.getpid(), signal.SIGKILL)

        try:
            if at_event:
                sys.addaudithook(die)
            for _ in sf.sweep(spec, workers=0, folder=folder):
                pass
            os._exit(0)
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            os._exit(1)
    if not at_event:
        time.sleep(draw.uniform(0.0, seconds))
        os.kill(child, signal.SIGKILL)
    status = os.waitpid(child, 0)[1]
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, "a sweep that was taken up again failed"
    return not os.WIFSIGNALED(status)


def check(seed: int, kills: int) -> int:
    """Kill sweeps so many times in all; how many sweeps that took."""
    draw, hits, sweeps = random.Random(seed), 0, 0
    while hits < kills and sweeps < kills:
        hits += one(draw)
        sweeps += 1
    assert hits, "no kill came before the end"
    return sweeps


def one(draw: random.Random) -> int:
    """One sweep, killed until it comes to its end; how often."""
    import splinefeed as sf
    from splinefeed.sweeps import store

    spec = spec_of(draw)
    store.PART = draw.randint(2, 7)
    begin = time.monotonic()
    rows = list(sf.sweep(spec, workers=0))
    seconds = time.monotonic() - begin
    hits = 0
    with tempfile.TemporaryDirectory() as place:
        folder, clean = Path(place, "killed"), Path(place, "clean")
        known: set[int] = set()
        # a process may need longer to begin than a short sweep takes: each attempt may last a little longer
        while not attempt(spec, folder, draw, 0.25 * seconds * 1.05**hits):
            hits += 1
            assert hits < 1000, "it never comes to its end"
            if not (folder / store.ABOUT).exists():
                assert not known
                continue
            _, found = store.load(folder)
            now = set(found["index"])
            assert len(now) == len(found["index"]), "a row is there twice"
            assert known <= now, "rows are lost"
            for index, duration, status in zip(found["index"], found["duration_s"], found["status"], strict=True):
                assert (duration, status) == (rows[index]["duration_s"], rows[index]["status"]), index
            known = now
        rest = list(sf.sweep(spec, workers=0, folder=folder))
        assert not rest, "runs that were there are made again"
        list(sf.sweep(spec, workers=0, folder=clean))
        assert contents(folder) == contents(clean), "the dataset tells that it was killed"
    return hits


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a sweep's folder."""
    return {str(each.relative_to(folder)): each.read_bytes() for each in folder.rglob("*") if each.is_file()}


if __name__ == "__main__":
    print(check(int(sys.argv[1]), int(sys.argv[2])))

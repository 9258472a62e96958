"""Runs into one folder, killed with kill -9 at random moments: what is left is of one run, or a report says that not.

`python tests/folder_kills.py SEED COUNT` kills COUNT of them and prints what it saw.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path

#: What is done to files; each is a moment to die at.
EVENTS = ("open", "os.rename", "os.remove", "os.mkdir", "shutil.rmtree")
#: Moments in one run of those below, about.
MOMENTS = 120


def run(folder: Path, feed: float, die_at: int) -> bool:
    """Make a run in a process that dies at a moment; whether it came to its end."""
    import splinefeed as sf
    from splinefeed.reports.folder import report

    child = os.fork()
    if child == 0:
        seen = 0

        def die(event: str, given: object) -> None:
            nonlocal seen
            if event in EVENTS and str(folder) in str(given):
                seen += 1
                if seen == die_at:
                    os.kill(os.getpid(), signal.SIGKILL)

        try:
            made = sf.run(sf.shapes.circle(2.0), sf.Limits(feed=feed, acceleration=500, jerk=2e4), period=5e-3)
            sys.addaudithook(die)
            report(made, folder, formats=("hdf5", "csv"))
            os._exit(0)
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            os._exit(1)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, -signal.SIGKILL), code
    return code == 0


def judged(folder: Path) -> str:
    """What a folder holds: "whole", "none" before the first run, "told" where the page does not fit the files."""
    import splinefeed as sf
    from splinefeed.reports import files, record

    if not (folder / files.RECORD).exists():
        return "none"
    page = record.read(folder / files.RECORD)
    law, points = sf.load(folder / files.LAW, sf.TimeLaw), sf.load(folder / files.SETPOINTS["hdf5"], sf.Setpoints)
    assert len(points) > 10 and law.duration > 0.0 and len(sf.load(folder / files.SETPOINTS["csv"], sf.Setpoints)) > 10
    found = files.digests(folder)
    if all(found.get(name) == kept for name, kept in page["sha256"].items()):
        assert points.settings["limits"]["feed"] == page["settings"]["limits"]["feed"]
        return "whole"
    return "told"


def kills(place: Path, seed: int, count: int) -> int:
    """So many kills, each judged; AssertionError for a file that is not whole, or a mixture that nobody tells."""
    draw, done, seen = random.Random(seed), 0, Counter[str]()
    folder = place / "out"
    while done < count:
        done += not run(folder, 10.0 + draw.random(), draw.randrange(1, MOMENTS))
        seen[judged(folder)] += 1
        if draw.random() < 0.3:  # the next run goes on from whatever is left
            assert run(folder, 10.0 + draw.random(), 0)
            assert judged(folder) == "whole"
            assert not [each for each in folder.iterdir() if each.name.startswith(".splinefeed-")]
    print(f"{done} kills: {dict(seen)}")
    return done


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        kills(Path(made), int(sys.argv[1]), int(sys.argv[2]))

"""Commands ended by SIGKILL, SIGINT and SIGTERM at random moments: every file is whole, old or new, and no row is lost.

`python tests/command_kills.py SEED COUNT [COMMAND]` ends COUNT of `run`, `sweep`, `stream` and `convert`, by turns, and
prints how often by each signal. Half of the moments are one of the things that a command does to files, the other half
come by the clock.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import folder_kills
from splinefeed.cli.main import main

EVENTS = (*folder_kills.EVENTS, "os.truncate", "fcntl.flock", "os.link")
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
#: Exit codes of a command that a signal ended, or that was faster, or that stopped on the path.
ENDS = {signal.SIGKILL: (-9,), signal.SIGINT: (130,), signal.SIGTERM: (143,)}
LIMITS = ("--axis-accel", "500", "--axis-jerk", "20000", "--period", "5ms")
SWEEP = """sources = ["line?length=1", "line?length=2"]
[set]
limits.acceleration = 400
[grid]
"limits.jerk" = [1e4, 2e4]
"limits.feed" = [10, 20, 30, 40]
"""


def command(words: list[str], place: Path, number: int = 0, at: int = 0, seconds: float = 0.0) -> int:
    """The exit code of a command in `place` that gets a signal at its `at`-th deed, or after so many seconds."""
    child = os.fork()
    if child == 0:
        seen = 0

        def look(event: str, given: object) -> None:
            nonlocal seen
            if event in EVENTS and str(place) in str(given):
                seen += 1
                if seen == at:
                    os.kill(os.getpid(), number)

        code: object = 1
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background would ignore it
        try:
            os.chdir(place)
            said = os.open("../said", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(said, 1)
            os.dup2(said, 2)
            if at:
                sys.addaudithook(look)
            sys.argv = ["splinefeed", *words]
            main()
        except SystemExit as end:
            code = end.code or 0
        except KeyboardInterrupt:  # before the command began
            code = 130
        finally:
            if not number:
                Path("../modules").write_text("\n".join(sys.modules))
            os._exit(code if isinstance(code, int) else 1)
    if number and not at:
        time.sleep(seconds)
        os.kill(child, number)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class Run:
    """A run into one folder, whose files are of one run, or a page says that they are not."""

    def __init__(self, place: Path) -> None:
        self.folder = place / "out"

    def words(self, draw: random.Random) -> list[str]:
        return ["run", "circle?radius=2", "--feed", f"{draw.uniform(10.0, 30.0)}", *LIMITS, "-o", str(self.folder),
                "--format", "hdf5", "--format", "csv"]  # fmt: skip

    def judge(self, code: int) -> None:
        found = folder_kills.judged(self.folder) if self.folder.exists() else "none"
        assert code or found == "whole", found


class Sweep:
    """A sweep that is taken up again until it is complete; no row is lost, none is there twice."""

    def __init__(self, place: Path) -> None:
        self.place, self.turn, self.known = place, 0, set[int]()
        (place / "sweep.toml").write_text(SWEEP)

    def words(self, draw: random.Random) -> list[str]:
        return ["sweep", str(self.place / "sweep.toml"), "-o", str(self.place / f"sweep{self.turn}"), "--workers", "0"]

    def judge(self, code: int) -> None:
        from splinefeed.sweeps import store

        folder = self.place / f"sweep{self.turn}"
        if (folder / store.ABOUT).exists():
            rows = store.load(folder)[1]["index"]
            assert len(set(rows)) == len(rows) and self.known <= set(rows), "rows are lost, or there twice"
            self.known = set(rows)
        assert code or len(self.known) == 16
        if len(self.known) == 16:
            self.turn, self.known = self.turn + 1, set()


class Stream:
    """A stream into a file, which is that of a whole stream or none; its state says where to resume, or that not."""

    def __init__(self, place: Path) -> None:
        self.rows, self.state, self.first = place / "rows.txt", place / "state.json", b""
        self.resume = False

    def words(self, draw: random.Random) -> list[str]:
        self.resume = self.resume and draw.random() < 0.5
        return ["stream", "circle?radius=4", "--feed", "12", "--axis-accel", "500", "--axis-jerk", "20000", "--to",
                "file", "-o", str(self.rows), "--state", str(self.state), *["--resume"] * self.resume]  # fmt: skip

    def judge(self, code: int) -> None:
        page = json.loads(self.state.read_text()) if self.state.exists() else None
        if self.rows.exists():
            lines = [line for line in self.rows.read_text().splitlines() if line[0] != "#"]
            assert [int(line.split()[0]) for line in lines[:-1]] == list(range(1, len(lines))), "rows are missing"
            assert lines[-1].split()[-1] == "1", "the file has no last row"
            self.rows.unlink()
        going_on = page is not None and not page["done"]
        self.resume = going_on and page["rests_at"] is not None
        if going_on and not self.resume and page["row"]:  # cut off: nothing tells where the axes are
            words = [*self.words(random.Random(0)), "--resume"]
            assert command(words, self.rows.parent) == 2 and not self.rows.exists()


class Convert:
    """A drawing written again and again: that of one source or of the other."""

    SUFFIXES = (".dxf", ".svg", ".json", ".ngc", ".stp")

    def __init__(self, place: Path) -> None:
        self.place = place
        self.known: dict[str, set[str]] = {}

    def words(self, draw: random.Random) -> list[str]:
        self.target = self.place / f"part{draw.choice(self.SUFFIXES)}"
        more = ["--feed", "10"] if self.target.suffix == ".ngc" else []
        return ["convert", f"circle?radius={draw.choice((2, 3))}", str(self.target), *more]

    def judge(self, code: int) -> None:
        import splinefeed as sf

        if self.target.exists():
            length = sf.read(self.target).length
            assert min(abs(length - 4 * 3.14159265), abs(length - 6 * 3.14159265)) < 0.01, length
        assert code or self.target.exists()


COMMANDS = {"run": Run, "sweep": Sweep, "stream": Stream, "convert": Convert}


def kills(place: Path, seed: int, count: int, names: tuple[str, ...] = tuple(COMMANDS)) -> dict[str, Counter[str]]:
    """End so many commands of each name; how many by each signal. AssertionError for what is not whole."""
    draw = random.Random(seed)
    came = {name: Counter[str]() for name in names}
    for name in names:
        folder = place / name
        folder.mkdir()
        kind = COMMANDS[name](folder)
        assert command(kind.words(draw), folder) == 0, (place / "said").read_text()
        kind.judge(0)
        for module in (place / "modules").read_text().split():  # so that each command begins at once
            with suppress(ImportError):
                import_module(module)
        begin = time.monotonic()
        assert command(kind.words(draw), folder) == 0, (place / "said").read_text()
        took = time.monotonic() - begin
        kind.judge(0)
        tries = 0
        while came[name].total() < count:
            number, tries = draw.choice(SIGNALS), tries + 1
            by_deed = draw.random() < 0.5
            deed, seconds = (draw.randrange(1, 90), 0.0) if by_deed else (0, draw.uniform(0.0, took))
            code = command(kind.words(draw), folder, number, deed, seconds)
            said = (folder / "../said").read_text(errors="replace")
            assert "Traceback" not in said and "internal fault" not in said, said
            stopped = name == "stream" and code == 0 and "stopped at" in said
            # 1 and nothing said: it came between the end of the command and that of its process here
            assert code in (0, *ENDS[number], -number) or (code, said) == (1, ""), (name, number, code, said)
            kind.judge(code)
            if code or stopped:
                came[name][signal.Signals(number).name] += 1
            assert tries < 20 * count, f"{name} is always faster"
    return came


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        names = (sys.argv[3],) if sys.argv[3:] else tuple(COMMANDS)
        for name, seen in kills(Path(made), int(sys.argv[1]), int(sys.argv[2]), names).items():
            print(name, json.dumps(seen))

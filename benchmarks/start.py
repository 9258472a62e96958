"""Whole processes from the shell's view: help, and the default run with and without compiled kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.tables import Cell, Column, Headline, Report, Table
from benchmarks.timing import Times

#: Targets, s.
HELP, SECOND, FIRST = 0.4, 4.0, 30.0
HELPS, SECONDS, FIRSTS = 10, 5, 2
#: Nobody waits longer, s.
PATIENCE = 300.0


@dataclass(frozen=True)
class Process:
    """How long one process took, s, by the clock and on the processor, or what it said when it failed."""

    seconds: float
    processor: float
    failure: str = ""


def measure() -> Report:
    """Seconds from the command to its end."""
    helps = [_process(["--help"], {}) for _ in range(HELPS)]
    firsts = []
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        for i in range(FIRSTS):
            caches = _caches(Path(folder, str(i)))
            firsts.append(_process(["run", "-o", str(Path(folder, f"first-{i}"))], caches))
        seconds = [_process(["run", "-o", str(Path(folder, f"second-{i}"))], caches) for i in range(SECONDS)]
    found = (
        ("`splinefeed --help`", helps, HELP),
        ("second `splinefeed run`", seconds, SECOND),
        ("first `splinefeed run`, nothing compiled", firsts, FIRST),
    )
    columns = (
        Column("command"),
        Column("runs", "d"),
        Column("median, s", ".2f"),
        Column("fastest, s", ".2f"),
        Column("on the processor, s", ".2f"),
        Column("target, s", "g"),
        Column("remark"),
    )
    notes = (
        "Whole processes (`python -m splinefeed`), default path and files. For the first run the cache folders of the "
        "kernels and of the report are empty. Time on the processor, the least of all runs, leaves out what other work "
        "on the machine made it wait.",
    )
    table = Table("From the command to its end.", columns, tuple(_row(*each) for each in found), notes)
    return Report((table,), tuple(_headline(*each) for each in found))


def _caches(folder: Path) -> dict[str, str]:
    """Empty cache folders below `folder`, as the environment says it."""
    places = {"NUMBA_CACHE_DIR": folder / "kernels", "XDG_CACHE_HOME": folder / "cache"}
    for place in places.values():
        place.mkdir(parents=True)
    return {name: str(place) for name, place in places.items()}


def _process(arguments: list[str], environment: dict[str, str]) -> Process:
    """Run the command and wait for its end."""
    command = [sys.executable, "-m", "splinefeed", *arguments]
    before = os.times()
    try:
        done = subprocess.run(
            command, env={**os.environ, **environment}, check=False, capture_output=True, text=True, timeout=PATIENCE
        )
    except subprocess.TimeoutExpired:
        return Process(PATIENCE, 0.0, f"stopped after {PATIENCE:g} s")
    after = os.times()
    processor = after.children_user - before.children_user + after.children_system - before.children_system
    failure = "" if done.returncode == 0 and done.stdout else f"status {done.returncode}: {done.stderr.strip()[-200:]}"
    return Process(after.elapsed - before.elapsed, processor, " ".join(failure.split()))


def _row(what: str, runs: list[Process], target: float) -> tuple[Cell, ...]:
    for run in runs:
        if run.failure:
            return what, len(runs), None, None, None, target, run.failure
    times = Times(tuple(run.seconds for run in runs))
    return what, len(runs), times.median, times.least, min(run.processor for run in runs), target, ""


def _headline(what: str, runs: list[Process], target: float) -> Headline:
    _, _, median, *_, remark = _row(what, runs, target)
    if not isinstance(median, float):
        return Headline(what, str(remark), f"{target:g} s", False)
    return Headline(what, f"{median:.2f} s", f"{target:g} s", median <= target)

"""Whole processes from the shell's view: help, and the default run with and without compiled kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.tables import Cell, Column, Headline, Report, Table
from benchmarks.timing import Times

#: Targets, s.
HELP, SECOND, FIRST = 0.4, 4.0, 30.0
HELPS, SECONDS, FIRSTS = 10, 5, 2
#: Nobody waits longer, s.
PATIENCE = 300.0


def measure() -> Report:
    """Seconds from the command to its end."""
    helps = [_seconds(["--help"], {}) for _ in range(HELPS)]
    firsts: list[float | str] = []
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        for i in range(FIRSTS):
            caches = _caches(Path(folder, str(i)))
            firsts.append(_seconds(["run", "-o", str(Path(folder, f"first-{i}"))], caches))
        seconds = [_seconds(["run", "-o", str(Path(folder, f"second-{i}"))], caches) for i in range(SECONDS)]
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
        Column("target, s", "g"),
        Column("remark"),
    )
    notes = (
        "Whole processes (`python -m splinefeed`), default path and files. For the first run the cache folders of the "
        "kernels and of Matplotlib are empty.",
    )
    table = Table("From the command to its end.", columns, tuple(_row(*each) for each in found), notes)
    return Report((table,), tuple(_headline(*each) for each in found))


def _caches(folder: Path) -> dict[str, str]:
    """Empty cache folders below `folder`, as the environment says it."""
    places = {"NUMBA_CACHE_DIR": folder / "kernels", "MPLCONFIGDIR": folder / "matplotlib"}
    for place in places.values():
        place.mkdir(parents=True)
    return {name: str(place) for name, place in places.items()}


def _seconds(arguments: list[str], environment: dict[str, str]) -> float | str:
    """How long the command takes, s, or the last line of what it said when it failed."""
    command = [sys.executable, "-m", "splinefeed", *arguments]
    start = time.perf_counter()
    try:
        done = subprocess.run(
            command, env={**os.environ, **environment}, check=False, capture_output=True, text=True, timeout=PATIENCE
        )
    except subprocess.TimeoutExpired:
        return f"stopped after {PATIENCE:g} s"
    taken = time.perf_counter() - start
    if done.returncode == 0 and done.stdout:
        return taken
    return (done.stderr.strip().splitlines() or [f"ended with status {done.returncode}"])[-1]


def _row(what: str, runs: list[float | str], target: float) -> tuple[Cell, ...]:
    for run in runs:
        if isinstance(run, str):
            return what, len(runs), None, None, target, run
    times = Times(tuple(float(run) for run in runs))
    return what, len(runs), times.median, times.least, target, ""


def _headline(what: str, runs: list[float | str], target: float) -> Headline:
    _, _, median, _, _, remark = _row(what, runs, target)
    if not isinstance(median, float):
        return Headline(what, str(remark), f"{target:g} s", False)
    return Headline(what, f"{median:.2f} s", f"{target:g} s", median <= target)

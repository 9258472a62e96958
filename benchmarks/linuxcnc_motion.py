"""splinefeed as LinuxCNC's trajectory planner against LinuxCNC's own: the same programs, every servo tick recorded."""

from __future__ import annotations

import random
import sys
import tempfile
from pathlib import Path as File

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import splinefeed as sf
from benchmarks.linuxcnc_planner import PERIOD, Mill, Recording, module_missing, recorded
from benchmarks.linuxcnc_programs import Program, programs
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Limits of each linear axis, mm and s, and of a rotary one, deg and s; the planner leaves a reserve below them.
LINEAR, ROTARY = (60.0, 1000.0, 50_000.0), (90.0, 1200.0, 60_000.0)
#: How often a run is tried, and how long each may take, s; places on the programmed path are so far apart, mm.
TRIES, LONGEST, FINE = 3, 120.0, 0.02
START = "G21 G90 G0 X0 Y0 Z0\n"


def machine(axes: str, jerk: float | None = None) -> Mill:
    """A simulated machine with the limits above; jerk  of its linear axes: splinefeed plans."""
    rows = [ROTARY if axis in "abc" else LINEAR for axis in axes]
    jerks = () if jerk is None else tuple(row[2] if row is ROTARY else jerk for row in rows)
    return Mill(tuple(row[0] for row in rows), tuple(row[1] for row in rows), axes=axes, jerk=jerks)


def run(program: str, mill: Mill, **how: object) -> Recording:
    """A recording; tried again where a busy computer lost samples, or all of LinuxCNC."""
    for left in reversed(range(TRIES)):
        try:
            return recorded(START + program, mill, LONGEST, **how)  # type: ignore[arg-type]
        except LinuxcncError as error:
            if not left or "complained" in str(error):
                raise
            print(f"  again: {error}", file=sys.stderr, flush=True)
    raise AssertionError


def shares(found: Recording, axes: str) -> tuple[float, float]:
    """The largest acceleration and jerk of a joint at any tick, as shares of the limits."""
    rows = [ROTARY if axis in "abc" else LINEAR for axis in axes]
    worst = [
        float(
            (np.abs(np.diff(found.position, n=n, axis=0)).max(axis=0) / PERIOD**n / [row[n - 1] for row in rows]).max()
        )
        for n in (2, 3)
    ]
    return worst[0], worst[1]


def programmed(program: Program) -> NDArray[np.float64]:
    """Places on the path that splinefeed's reader of G-code makes of a program, (n, linear axes), mm."""
    with tempfile.TemporaryDirectory() as folder:
        file = File(folder) / "job.ngc"
        file.write_text(START + program.text, encoding="utf-8")
        path = sf.read(file, dialect="linuxcnc")
    places = np.concatenate([np.linspace(0.0, path.length, round(path.length / FINE) + 2), path.curve_starts])
    return np.asarray(path(np.sort(places)))[:, :3]


def off(found: Recording, path: NDArray[np.float64]) -> float:
    """The largest distance, um, of ticks from a path and of its places from the ticks' polyline; linear axes."""
    ticks = found.moving()[:, :3]
    return 1e3 * max(_apart(ticks, path), _apart(path, ticks))


def _apart(points: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    line = others[np.append(True, np.any(np.diff(others, axis=0) != 0.0, axis=1))]
    _, near = cKDTree(line).query(points, k=min(4, len(line)))
    best = np.full(len(points), np.inf)
    for k in near.T:
        for low in (np.maximum(k - 1, 0), np.minimum(k, len(line) - 2)):
            a, ab = line[low], line[low + 1] - line[low]
            t = np.clip(np.einsum("ij,ij->i", points - a, ab) / np.einsum("ij,ij->i", ab, ab), 0.0, 1.0)
            best = np.minimum(best, np.linalg.norm(a + t[:, None] * ab - points, axis=1))
    return float(best.max())


def turned(seconds: float, seed: int) -> str:
    """Overrides and pauses at random over so many seconds, and 100 % at the end."""
    rng, at, out = random.Random(seed), 0.5, []
    while at < max(seconds - 0.5, 1.0):
        what = rng.choice(["feed", "feed", "rapid", "pause"])
        out.append(
            f"{at:.2f}:pause,{at + 0.6:.2f}:resume" if what == "pause" else f"{at:.2f}:{what}={rng.randint(20, 150)}"
        )
        at += rng.uniform(0.3, 1.2) + 0.6 * (what == "pause")
    return ",".join([*out, f"{at:.2f}:feed=100,{at:.2f}:rapid=100"])


def measure() -> Report:
    """Each program by LinuxCNC's planner, by ours, and by ours while the operator turns and pauses."""
    if missing := module_missing():
        raise LinuxcncError(missing)
    rows: list[tuple[Cell, ...]] = []
    spent, failed, worst = [], [], 0.0
    for k, program in enumerate(programs()):
        print(f"  {k + 1}: {program.name}", file=sys.stderr, flush=True)
        row: list[Cell] = [None] * 10
        try:
            path = programmed(program)
            theirs = run(program.text, machine(program.axes))
            row[:4] = [PERIOD * len(theirs.moving()), *shares(theirs, program.axes), off(theirs, path)]
            own = run(program.text, machine(program.axes, LINEAR[2]))
            spent.append(own.spent_ns)
            row[4:8] = [PERIOD * len(own.moving()), *shares(own, program.axes), off(own, path)]
            actions = turned(PERIOD * len(own.moving()), k)
            row[8:] = shares(run(program.text, machine(program.axes, LINEAR[2]), actions=actions), program.axes)
            worst = max(worst, *(float(cell) for cell in row[5:7] + row[8:]))  # type: ignore[arg-type]
        except LinuxcncError as error:
            failed.append(f"{program.name}: {error}.")
        rows.append((program.name, *row))
    columns = (
        Column("program"), *(Column(f"stock: {what}", form) for what, form in WHAT),
        *(Column(f"splinefeed: {what}", form) for what, form in WHAT),
        Column("turned: acceleration", ".3f"), Column("turned: jerk", ".3f"),
    )  # fmt: skip
    caption = (
        "Largest acceleration and jerk of a joint's command at any servo tick, as shares of 1,000 mm/s^2 and "
        "50,000 mm/s^3 (60 mm/s; the rotary axis 90 deg/s, 1,200 deg/s^2, 60,000 deg/s^3)."
    )
    notes = (
        "LinuxCNC 2.9, headless, without a real-time kernel, on a computer that did other work, LinuxCNC and planner "
        "before it (chrt -r 1). Times from first "
        "to last motion, all waits of the planner included; LinuxCNC 2.9 knows no jerk. Turned: feed and rapid "
        "override (20 to 150 %) and pauses at random. Off: largest distance between the ticks and the programmed "
        "path, either way, linear axes; G64 P0.01 allows 10 um (and as much again for LinuxCNC's joining of short "
        "lines), P0.1 100 um, G64 without P any in LinuxCNC, in splinefeed 10 um.",
        *failed,
    )
    ticks = np.concatenate(spent)
    median, high = float(np.median(ticks)) / 1e3, float(np.percentile(ticks, 99)) / 1e3
    notes += (f"tpRunCycle: median {median:.2f} us, p99 {high:.2f} us, its own clock included.",)
    table = Table(caption, columns, tuple(rows), notes)
    done = len(rows) - len(failed)
    line = Headline(
        "inside LinuxCNC: acceleration and jerk of joints over their limits, 20 programs, override and pause at random",
        f"{worst:.3f} in {done} programs", "at most 1.000", worst <= 1.0 and not failed,
    )  # fmt: skip
    return Report(
        (table,), (line, Headline("... tpRunCycle, median and p99", f"{median:.2f} us, {high:.2f} us", "1 us, 3 us",
                                  median <= 1.0 and high <= 3.0)),
    )  # fmt: skip


WHAT = (("s", ".2f"), ("acceleration", ".3f"), ("jerk", ".3f"), ("off, um", ".1f"))

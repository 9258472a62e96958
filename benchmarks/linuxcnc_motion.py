"""splinefeed as LinuxCNC's trajectory planner against LinuxCNC's own: the same programs, every servo tick recorded."""

from __future__ import annotations

import math
import random
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path as File

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import splinefeed as sf
from benchmarks.linuxcnc_planner import PERIOD, Mill, Recording, module_missing, recorded
from benchmarks.linuxcnc_programs import HEAD, Program, pocket, programs
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Limits of each linear axis, mm and s, and of a rotary one, deg and s; the planner leaves a reserve below them.
LINEAR, ROTARY = (60.0, 1000.0, 50_000.0), (90.0, 1200.0, 60_000.0)
#: A jerk that LinuxCNC's own planner keeps, mm/s^3.
LEGAL = 1_000_000.0
#: How often a run is tried in which samples were lost; places on the programmed path are so far apart, mm.
TRIES, FINE = 3, 0.02
START = "G21 G90 G0 X0 Y0 Z0\n"
#: What LinuxCNC's users wait for: seconds.
PAUSE, SETTLED, FIRST, STILL = 0.120, 0.200, 0.100, 0.030


def machine(axes: str, jerk: float | None = None) -> Mill:
    """A simulated machine with the limits above; jerk  of its linear axes: splinefeed plans."""
    rows = [ROTARY if axis in "abc" else LINEAR for axis in axes]
    jerks = () if jerk is None else tuple(row[2] if row is ROTARY else jerk for row in rows)
    return Mill(tuple(row[0] for row in rows), tuple(row[1] for row in rows), axes=axes, jerk=jerks)


def run(program: str, mill: Mill, **how: object) -> Recording:
    """A recording; tried again where a busy computer lost samples."""
    for left in reversed(range(TRIES)):
        try:
            return recorded(START + program, mill, **how)  # type: ignore[arg-type]
        except LinuxcncError as error:
            if not left or "lost" not in str(error):
                raise
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
        "LinuxCNC 2.9, headless, without a real-time kernel, on a computer that did other work. Times from first "
        "to last motion, all waits of the planner included; LinuxCNC 2.9 knows no jerk. Turned: feed and rapid "
        "override (20 to 150 %) and pauses at random. Off: largest distance between the ticks and the programmed "
        "path, either way, linear axes; G64 P0.01 allows 10 um (and as much again for LinuxCNC's joining of short "
        "lines), P0.1 100 um, G64 without P any in LinuxCNC, in splinefeed 10 um.",
        *failed,
    )
    ticks = np.concatenate(spent)
    reactions = list(measured_reactions())
    median, high = float(np.median(ticks)) / 1e3, float(np.percentile(ticks, 99)) / 1e3
    reactions += [("tpRunCycle, median, us", None, median, 1.0), ("tpRunCycle, p99, us", None, high, 3.0)]
    one, other = (run(pocket(), machine("xyz", jerk)) for jerk in (None, LEGAL))
    ratio = len(other.moving()) / len(one.moving())
    reactions.append(("time of the pocket where stock's jerk is legal (10^6 mm/s^3), over stock's", 1.0, ratio, 1.01))
    table = Table(caption, columns, tuple(rows), notes)
    other_table = Table(
        "Reactions: the worst of some, from the operator's command to LinuxCNC, s where nothing else is said.",
        (Column("what"), Column("stock", ".3f"), Column("splinefeed", ".3f"), Column("at most", ".3f")),
        tuple(reactions),
        ("At standstill: from one move's end to the next one's begin at M8, M9 and G4 P0, the median of 12.",),
    )
    done = len(rows) - len(failed)
    line = Headline(
        "inside LinuxCNC: acceleration and jerk of joints over their limits, 20 programs, override and pause at random",
        f"{worst:.3f} in {done} programs", "at most 1.000", worst <= 1.0 and not failed,
    )  # fmt: skip
    return Report((table, other_table), (line,))


WHAT = (("s", ".2f"), ("acceleration", ".3f"), ("jerk", ".3f"), ("off, um", ".1f"))


# --- reactions ----------------------------------------------------------------------------------------------------


def measured_reactions() -> list[tuple[Cell, ...]]:
    """Pauses, overrides, standstills and first motion, by stock and by ours: rows of what, stock, ours, at most."""
    rows = []
    tasks: list[tuple[str, Callable[[Mill], float], float]] = [
        ("pause from 60 mm/s on a line", lambda mill: pauses(LINE, mill), PAUSE),
        ("pause from 60 mm/s on a circle of 3.9 mm", lambda mill: pauses(CIRCLE, mill), PAUSE),
        ("override 100 to 30 % settled", lambda mill: settled(mill, 100, 30), SETTLED),
        ("override 30 to 150 % settled", lambda mill: settled(mill, 30, 150), SETTLED),
        ("first motion behind an MDI command", first_motion, FIRST),
        ("at standstill between moves", standstill, STILL),
    ]
    for name, what, most in tasks:
        print(f"  {name}", file=sys.stderr, flush=True)
        found: list[Cell] = []
        for mill in (machine("xyz"), machine("xyz", LINEAR[2])):
            try:
                found.append(what(mill))
            except LinuxcncError as error:
                print(f"  {error}", file=sys.stderr, flush=True)
                found.append(None)
        rows.append((name, *found, most))
    return rows


LINE = HEAD + "G1 X400 F3600\nG1 X0\nM2\n"
CIRCLE = HEAD + "G1 X1 F3600\n" + "G3 X1 Y0 I3.9 J0 P9\n" * 3 + "M2\n"


def speed(found: Recording) -> NDArray[np.float64]:
    """The speed of each tick, mm/s."""
    return np.asarray(np.linalg.norm(np.diff(found.position[:, :3], axis=0), axis=1) / PERIOD)


def pauses(program: str, mill: Mill) -> float:
    """The longest time from a pause to standstill, s."""
    times = [0.8 + 1.31 * k for k in range(6)]
    actions = ",".join(f"{at:.2f}:pause,{at + 0.5:.2f}:resume" for at in times)
    found = run(program, mill, actions=actions)
    v, longest = speed(found), []
    for row, what in found.acted:
        if what == "pause" and v[min(row, len(v) - 1)] > 0.98 * LINEAR[0]:
            longest.append(int(np.argmax(v[row:] == 0.0)) * PERIOD)
    return max(longest, default=math.nan)


def settled(mill: Mill, before: int, after: int) -> float:
    """From a change of the feed override to the new feed, within 1 % of it for 0.2 s, s: the longest of three."""
    actions = ",".join(f"{0.4 + 1.6 * k:.2f}:feed={before},{1.2 + 1.6 * k:.2f}:feed={after}" for k in range(3))
    found = run(HEAD + "G1 X600 F2400\nM2\n", mill, actions=f"{actions},5.5:feed=150")
    v, longest = speed(found), []
    for row, what in found.acted:
        if what == f"feed={after}" and row < len(v) - 700:
            good = np.abs(v[row : row + 700] - 40.0 * after / 100.0) < 0.01 * 40.0 * after / 100.0
            longest.append(PERIOD * (int(np.max(np.flatnonzero(~good), initial=-1)) + 1))
    return max(longest, default=math.nan)


def first_motion(mill: Mill) -> float:
    """From an MDI command to the first tick of its motion, s: the longest of six."""
    actions = ",".join(f"{2.0 + 1.5 * k:.2f}:mdi=G0 X{5 + 5 * k} Y{k}" for k in range(6))
    found = run(HEAD + "G1 X1\nM2\n", mill, actions=f"{actions},12:feed=100")
    moves = speed(found) > 0.0
    return max(PERIOD * int(np.argmax(moves[row:])) for row, what in found.acted if what.startswith("mdi"))


def standstill(mill: Mill) -> float:
    """The median of the times at rest between moves with words between them that wait for the end of motion, s."""
    words = ["M8", "G4 P0", "M9"]
    program = HEAD + "".join(f"G1 X{4 * k + 4} Y{3 * (k % 2)}\n{words[k % 3]}\n" for k in range(13)) + "M2\n"
    v = speed(run(program, mill))
    moves = np.flatnonzero(v > 0.0)
    gaps = np.diff(moves)
    return PERIOD * float(np.median(gaps[gaps > 1] - 1))

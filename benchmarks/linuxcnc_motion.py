"""splinefeed as LinuxCNC's trajectory planner against LinuxCNC's own: the same programs, every servo tick recorded."""

from __future__ import annotations

import random

import numpy as np
from numpy.typing import NDArray

from benchmarks.linuxcnc_planner import PERIOD, Recording, mill, module_missing, recorded
from benchmarks.tables import Column, Report, Table
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Limits of each axis, mm and s; the reserve of the planner leaves 95 % of the acceleration and 90 % of the jerk.
VELOCITY, ACCELERATION, JERK = 60.0, 1000.0, 50_000.0


def pocket(rings: int = 4) -> str:
    """Rings with rounded corners, as a CAM program leaves them, in G64 P0.01."""
    lines = ["G21 G90 G17 G64 P0.01", "F3000", "G0 X5 Y0 Z2", "G1 Z0"]
    for k in range(1, rings + 1):
        x, y, r = 4.0 * k + 8.0, 4.0 * k, 3.0
        lines += [
            f"G1 X{x - r} Y{-y}", f"G3 X{x} Y{-y + r} I0 J{r}", f"G1 Y{y - r}", f"G3 X{x - r} Y{y} I{-r} J0",
            f"G1 X{-x + r}", f"G3 X{-x} Y{y - r} I0 J{-r}", f"G1 Y{-y + r}", f"G3 X{-x + r} Y{-y} I{r} J0",
        ]  # fmt: skip
    return "\n".join([*lines, "G1 X0 Y0", "G0 Z5", "M2", ""])


def spiral(lines: int = 1000) -> str:
    """Short lines of a spiral that rises and falls, in G64 P0.01."""
    t = np.linspace(0.0, 8.0 * np.pi, lines + 1)[1:]
    r = 20.0 - 12.0 * t / t[-1]
    rows = np.column_stack([r * np.cos(t), r * np.sin(t), 0.5 * np.sin(3.0 * t)])
    text = "\n".join(f"G1 X{x:.5f} Y{y:.5f} Z{z:.5f}" for x, y, z in rows.tolist())
    return f"G21 G90 G17 G64 P0.01\nF3000\nG0 X20 Y0\n{text}\nG0 Z5\nM2\n"


def exact() -> str:
    """Lines, arcs and a helix in G61."""
    return (
        "G21 G90 G17 G61\nF3000\nG0 X10 Y0 Z5\nG1 X40 Y0 Z0\nG2 X60 Y20 I0 J20\nG3 X60 Y20 I-10 J0\n"
        "G3 X50 Y30 Z2 I-10 J0\nG1 X0 Y0 Z5\nM2\n"
    )


def tangents() -> str:
    """Long lines that turn by 2 degrees each, then arcs of a millimetre, tangent to each other."""
    angle, at, lines = 0.0, np.zeros(2), ["G21 G90 G17 G64 P0.01", "F3000"]
    for _ in range(60):
        angle += np.radians(2.0)
        at = at + 4.0 * np.array([np.cos(angle), np.sin(angle)])
        lines.append(f"G1 X{at[0]:.5f} Y{at[1]:.5f}")
    for k in range(40):
        lines.append(f"G{2 + k % 2} X{at[0] + 2.0 * (k + 1):.5f} I1 J0")
    return "\n".join([*lines, "M2", ""])


def shares(found: Recording) -> list[float]:
    """The largest acceleration and jerk of a joint at any tick, as shares of the limits."""
    return [
        float(np.abs(np.diff(found.position, n=n, axis=0)).max() / PERIOD**n / limit)
        for n, limit in ((2, ACCELERATION), (3, JERK))
    ]


def apart(points: NDArray[np.float64], polyline: NDArray[np.float64]) -> float:
    """The largest distance of points (n, axes) from the polyline through others (m, axes), mm."""
    line = polyline[np.append(True, np.any(np.diff(polyline, axis=0) != 0.0, axis=1))]
    a, ab = line[:-1], np.diff(line, axis=0)
    square, worst = np.einsum("ij,ij->i", ab, ab), 0.0
    for x in points:
        t = np.clip(np.einsum("ij,ij->i", x - a, ab) / square, 0.0, 1.0)
        worst = max(worst, float(np.min(np.linalg.norm(a + t[:, None] * ab - x, axis=1))))
    return worst


def turned(seconds: float, seed: int) -> str:
    """Overrides and pauses at random over so many seconds, and 100 % at the end."""
    rng, at, out = random.Random(seed), 0.5, []
    while at < seconds - 1.5:
        what = rng.choice(["feed", "feed", "rapid", "pause"])
        out.append(
            f"{at:.2f}:pause,{at + 0.6:.2f}:resume" if what == "pause" else f"{at:.2f}:{what}={rng.randint(20, 150)}"
        )
        at += rng.uniform(0.7, 1.6)
    return ",".join([*out, f"{seconds:.2f}:feed=100,{seconds:.2f}:rapid=100"])


def measure() -> Report:
    """Each program by LinuxCNC's planner, by ours, and by ours while the operator turns and pauses."""
    if missing := module_missing():
        raise LinuxcncError(missing)
    programs = {
        "lines, arcs, helix, G61": exact(),
        "pocket, G64 P0.01": pocket(),
        "1,000 short lines, G64 P0.01": spiral(),
        "tangent lines and small arcs": tangents(),
    }
    ours, stock = mill(VELOCITY, ACCELERATION, JERK), mill(VELOCITY, ACCELERATION)
    rows, spent = [], []
    for k, (name, program) in enumerate(programs.items()):
        own, theirs = recorded(program, ours), recorded(program, stock)
        moved, moved_there = own.moving(), theirs.moving()
        operated = recorded(program, ours, actions=turned(len(moved) * PERIOD, k))
        spent.append(own.spent_ns)
        off = max(apart(moved[::25], moved_there), apart(moved_there[::25], moved))
        seconds = [len(each) * PERIOD for each in (moved_there, moved)]
        rows.append((name, *seconds, *shares(theirs), *shares(own), *shares(operated), 1e3 * off))
    ticks = np.concatenate(spent)
    ends = ("acceleration", "jerk")
    columns = (
        Column("program"), Column("stock, s", ".2f"), Column("splinefeed, s", ".2f"),
        *(Column(f"stock: {end}", ".3f") for end in ends), *(Column(f"splinefeed: {end}", ".3f") for end in ends),
        *(Column(f"turned: {end}", ".3f") for end in ends), Column("apart, um", ".1f"),
    )  # fmt: skip
    caption = (
        "splinefeed as LinuxCNC's trajectory planner, headless, without a real-time kernel: largest acceleration and "
        "jerk of a joint's command at any servo tick, as shares of 1,000 mm/s^2 and 50,000 mm/s^3 (60 mm/s)."
    )
    notes = (
        "Turned: feed and rapid override and pauses at random by the seconds. Times with all waits of the planner. "
        "LinuxCNC 2.9 knows no jerk. Apart: largest distance between the two paths.",
        f"tpRunCycle: median {np.median(ticks):.0f} ns, p99 {np.percentile(ticks, 99):.0f} ns, its own clock included.",
    )
    return Report((Table(caption, columns, tuple(rows), notes),))

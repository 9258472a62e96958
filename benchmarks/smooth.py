"""Smoothing: real programs before and after under the same limits, and how many lines a second."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import splinefeed as sf
from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Cell, Column, Headline, Report, Table
from splinefeed.curves.nearest import Nearest
from splinefeed.errors import SplinefeedError
from splinefeed.paths.smoothing import smoothed
from splinefeed.paths.smoothing_proven import proven
from splinefeed.records import Array

FOLDER = Path(__file__).parents[1] / "tests" / "data" / "gcode"
#: Programs with short lines or with corners, as they came.
PROGRAMS = ("cncjs_tball.gcode", "cncjs_calibration.gcode", "gcodetoolpath_helical-thread-milling.nc")
TOLERANCE, PERIOD = 0.01, 1e-3
#: Along the path, mm/s, mm/s^2 and mm/s^3, in addition to what the axes of the router allow.
ALONG = {"feed": 100.0, "acceleration": 1500.0, "jerk": 30000.0}
#: Beside LinuxCNC: velocity, mm/s, and acceleration, mm/s^2, of the path and of each axis, and our jerk, mm/s^3.
VELOCITY, ACCELERATION, JERK = 60.0, 1000.0, 30000.0
#: The program that is driven there, and how much of it, curves.
BESIDE, PART = "cncjs_tball.gcode", 900
#: What is done with corners.
HOW = {"as it is": "", "corners kept": "keep", "corners rounded": "round"}
#: Lines of the made-up programs, whole and as a stream, lines of a piece, and least lines a second.
LINES, STREAMED, PIECE, LEAST_RATE = 200_000, 1_000_000, 1000, 50_000.0


def measure() -> Report:
    """Plan every program with look-ahead for the router, as it is, with corners kept, and rounded."""
    rows: list[tuple[Cell, ...]] = []
    for name in PROGRAMS:
        path = sf.read(FOLDER / name, repair=True)
        limits = sf.Limits(**ALONG, **sf.Machine.load("router").limits(path.axes))
        for how, corners in HOW.items():
            after, off = path, None
            if corners:
                proof = proven(path, TOLERANCE, corners=corners)
                after, off = proof.path, 1e3 * proof.order.largest
            law = sf.plan(after, limits, strategy="look-ahead", period=PERIOD)
            position = sf.interpolate(after, law, period=PERIOD).position[:, : path.linear]
            rows.append((Path(name).stem, how, len(after.curves), len(after.stops), law.duration, jerk(position), off))
    columns = (
        Column("program"),
        Column("path"),
        Column("curves", ",d"),
        Column("stops", ",d"),
        Column("time, s", ".2f"),
        Column("axis jerk, mm/s^3", ",.0f"),
        Column("side by side, um", ".2f"),
    )
    programs = Table(
        f"Real programs, smoothed by {1e3 * TOLERANCE:g} um, at their own feeds on the router's limits, look-ahead.",
        columns,
        tuple(rows),
        (
            "Axis jerk: the largest third difference of an axis's setpoints at 1 ms. Side by side: bound of the "
            "distance when both are traversed in order (Frechet), proven by means that the smoothing does not share, "
            "and so is that there is no new self-crossing.",
        ),
    )
    kinds = {"short lines of a curve, rounded to 1 um": "curve", "long lines at random": "walk"}
    found = {
        (words, how): child.outcome("smooth", "rate", kind, count, how)
        for words, kind in kinds.items()
        for count, how in ((LINES, "whole"), (STREAMED if kind == "curve" else LINES, "stream"))
    }
    columns = (
        Column("which"),
        Column("how"),
        Column("lines", ",d"),
        Column("a second", ",.0f"),
        Column("peak memory, MB", ".0f"),
    )
    speed = Table(
        "Lines smoothed a second of one core's time, corners rounded, each in a process of its own.",
        columns,
        tuple((words, how, each["lines"], each["rate"], each["peak_mb"]) for (words, how), each in found.items()),
        ("Stream: `sf.paths.Smoother`, pieces of 1,000 lines. Memory: about 150 MB are Python and the kernels.",),
    )
    least = min(each["rate"] for each in found.values())
    return Report(
        (programs, *beside_linuxcnc(), speed),
        (
            Headline(
                "lines smoothed, one core, short or long, also as a stream",
                f"at least {least:,.0f} a second",
                f"{LEAST_RATE:,.0f}",
                least >= LEAST_RATE,
            ),
        ),
    )


def jerk(position: Array) -> float:
    """Largest third difference of setpoints (n, axes), mm/s^3, but for the ends, where they may be cut."""
    return float(np.abs(np.diff(position, 3, axis=0)).max()) / PERIOD**3


def beside_linuxcnc() -> tuple[Table, ...]:
    """A part of a real program as LinuxCNC drives it with G64 P0.01, and smoothed by ours; nothing without LinuxCNC."""
    from benchmarks.linuxcnc_planner import mill, recorded

    whole = sf.read(FOLDER / BESIDE)
    path = sf.Path.polyline(vertices(whole)[: PART + 1], whole.axes, feeds=whole.feeds[:PART])
    text, first = gcode(path)
    try:
        recording = recorded(text, mill(VELOCITY, ACCELERATION))
    except SplinefeedError as error:
        print(f"not beside LinuxCNC: {error}")
        return ()
    driven = recording.moving(first)
    rows: list[tuple[Cell, ...]] = [
        (
            f"LinuxCNC {recording.version}, G64 P{TOLERANCE:g}",
            (len(driven) - 1) * PERIOD,
            jerk(driven),
            off(path, driven),
        )
    ]
    limits = sf.Limits(
        feed=VELOCITY, acceleration=ACCELERATION, jerk=JERK, axis_velocity=VELOCITY, axis_acceleration=ACCELERATION,
        axis_jerk=JERK,
    )  # fmt: skip
    for how, corners in HOW.items():
        for strategy in ("look-ahead", "time-optimal") if corners else ("look-ahead",):
            after = proven(path, TOLERANCE, corners=corners).path if corners else path
            law = sf.plan(after, limits, strategy=strategy, period=PERIOD)
            position = sf.interpolate(after, law, period=PERIOD).position
            rows.append((f"splinefeed, {how}, {strategy}", law.duration, jerk(position), off(path, position)))
    caption = (
        f"The first {PART} lines of {Path(BESIDE).stem} at its own feeds, {VELOCITY:g} mm/s and {ACCELERATION:g} "
        f"mm/s^2 of path and axes. Ours holds {JERK:,.0f} mm/s^3 of jerk too; LinuxCNC 2.9 has no limit of it."
    )
    columns = (
        Column("planner"),
        Column("time, s", ".2f"),
        Column("axis jerk, mm/s^3", ",.0f"),
        Column("deviation, um", ".2f"),
    )
    note = "Deviation: of the commanded positions at 1 ms from the program, and of the program's points from these."
    return (Table(caption, columns, tuple(rows), (note,)),)


def vertices(path: sf.Path) -> Array:
    """Where the lines of a path begin, and its end, (lines + 1, axes)."""
    return np.vstack([path.ends[:1, 0], path.ends[:, 1]])


def gcode(path: sf.Path) -> tuple[str, int]:
    """The lines of a path as a program for LinuxCNC that begins at rest, and the line of its first move."""
    points = vertices(path)

    def words(point: Array) -> str:
        return " ".join(f"{axis.upper()}{value:.6f}" for axis, value in zip(path.axes, point, strict=True))

    head = ["G21 G90 G17 G40 G61", f"G0 {words(points[0])}", "G4 P0.2", f"G64 P{TOLERANCE:g}"]
    assert path.feeds is not None
    feeds = np.where(np.isfinite(path.feeds), path.feeds, VELOCITY)
    moves = [f"G1 {words(p)} F{60.0 * feed:.4f}" for p, feed in zip(points[1:], feeds, strict=True)]
    return "\n".join([*head, *moves, "M2"]) + "\n", len(head) + 1


def off(path: sf.Path, position: Array) -> float:
    """Largest distance of positions (n, axes) from a path, and of its points from the line through these, um."""
    line = sf.Path.polyline(position, path.axes, repair=True)
    there = Nearest(path.table, path.shape).find(position)[2].max()
    back = Nearest(line.table, line.shape).find(path.ends.reshape(-1, len(path.axes)))[2].max()
    return 1e3 * float(max(there, back))


def curve(first: int, count: int) -> sf.Path:
    """Lines of 0.2 mm on a curve in space, as a program writes them."""
    t = 0.2 * np.arange(first, first + count + 1)
    return sf.Path.polyline(
        np.round(np.c_[100 * np.cos(t / 80) + t / 50, 60 * np.sin(t / 37), 2 * np.sin(t / 9)], 3), axes=("x", "y", "z")
    )


def walk(first: int, count: int) -> sf.Path:
    """Lines of some millimetres in any direction, to and fro."""
    steps = np.random.default_rng(first).uniform(-8.0, 8.0, (count, 3))
    return sf.Path.polyline(np.vstack([np.zeros((1, 3)), np.cumsum(steps - steps.mean(axis=0), axis=0)]).round(9))


def rate(kind: str, count: int, how: str) -> dict[str, float]:
    """Lines a second of this process's time, kernels compiled and lines made, and the peak of its memory, MB."""
    make = {"curve": curve, "walk": walk}[kind]
    smoothed(make(0, PIECE), TOLERANCE, corners="round")
    spent = 0.0
    if how == "whole":
        path = make(0, count)
        start = time.process_time()
        smoothed(path, TOLERANCE, corners="round")
        spent = time.process_time() - start
    else:
        smoother = sf.paths.Smoother(TOLERANCE, ("x", "y", "z"), corners="round")
        for first in range(0, count, PIECE):
            piece = make(first, PIECE)
            start = time.process_time()
            smoother.push(piece)
            spent += time.process_time() - start
        start = time.process_time()
        smoother.finish()
        spent += time.process_time() - start
    return {"lines": count, "rate": count / spent, "peak_mb": peak_memory() / 1e6}

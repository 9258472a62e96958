"""Long jobs by parts: what a path of a million pieces and a motion of a hundred hours cost, and in what memory."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table

#: Pieces of the paths; the last one moves for a hundred hours.
PIECES = (1_000, 10_000, 100_000, 1_000_000)
#: Pieces of a part, their length and the radius of their curvature, mm.
PART, LENGTH, RADIUS = 1_000, 1.0, 50.0
#: mm/s, mm/s^2, mm/s^3: a piece takes 0.36 s at this feed.
FEED, ACCELERATION, JERK = 2.777, 500.0, 2e4
PERIOD = 1e-3
#: Growth from the second to the last row that still counts as flat and as straight.
FLAT, STRAIGHT = 1.15, 1.3


def measure() -> Report:
    """CPU time and peak memory of a process that plans and interpolates arcs as they come, 1 ms."""
    found = [child.outcome("long", "run", pieces) for pieces in PIECES]
    rows = tuple(
        (
            each["pieces"],
            each["ticks"],
            each["ticks"] * PERIOD / 3600.0,
            each["seconds"],
            1e9 * each["seconds"] / each["ticks"],
            each["peak"] / 1e6,
            each["rows"],
        )
        for each in found
    )
    columns = (
        Column("pieces", ",d"),
        Column("ticks", ",d"),
        Column("motion, h", ".2f"),
        Column("CPU time, s", ".1f"),
        Column("ns a tick", ",.0f"),
        Column("peak memory, MB", ",.0f"),
        Column("parts held at most", "d"),
    )
    notes = (
        f"`sf.stream_setpoints(parts, limits, period=1e-3)`: tangent arcs of {LENGTH:g} mm in parts of {PART} that are "
        "made when they are asked for, planned by `look-ahead` and placed on their arc length, in one process; making "
        "the arcs is in the time, writing the setpoints is not. Peak memory is that of the whole process, Python and "
        "the compiler included.",
    )
    memory, ticks = rows[-1][5] / rows[1][5], rows[-1][4] / rows[1][4]
    headline = Headline(
        f"{rows[-1][2]:.0f} hours of motion over {rows[-1][0]:,d} pieces, in parts",
        f"{rows[-1][5]:.0f} MB and {rows[-1][4]:.0f} ns a tick; a hundredth of it {rows[1][5]:.0f} MB, "
        f"{rows[1][4]:.0f} ns",
        "memory flat, cost a tick flat",
        memory <= FLAT and ticks <= STRAIGHT,
    )
    return Report((Table("A path that comes in parts.", columns, rows, notes),), (headline,))


def arcs(pieces: int) -> Iterator[Any]:
    """Parts of a path of tangent arcs that turn one way fifty times and then the other."""
    import splinefeed as sf

    at, heading = np.zeros(2), 0.0
    curves = []
    for k in range(pieces):
        turn = LENGTH / RADIUS * (1.0 if k // 50 % 2 == 0 else -1.0)
        edge = RADIUS * np.tan(0.5 * abs(turn))
        middle = at + edge * np.array([np.cos(heading), np.sin(heading)])
        heading += turn
        end = middle + edge * np.array([np.cos(heading), np.sin(heading)])
        curves.append(sf.NurbsCurve.bezier(np.array([at, middle, end]), [1.0, np.cos(0.5 * turn), 1.0]))
        at = end
        if len(curves) == PART:
            yield sf.Path(curves, ("x", "y"), name="arcs")
            curves = []
    if curves:
        yield sf.Path(curves, ("x", "y"), name="arcs")


def run(pieces: int) -> dict[str, Any]:
    """All setpoints of so many arcs, looked at and let go; called in a process of its own."""
    import weakref

    import splinefeed as sf

    limits = sf.Limits(feed=FEED, axis_acceleration=ACCELERATION, axis_jerk=JERK)
    alive: weakref.WeakSet[Any] = weakref.WeakSet()
    most = 0

    def watched() -> Iterator[Any]:
        nonlocal most
        for part in arcs(pieces):
            alive.add(part)
            most = max(most, len(alive))
            yield part

    for _ in sf.stream_setpoints(arcs(20), limits, period=PERIOD):
        pass  # compiles
    ticks, furthest = 0, 0.0
    start = time.process_time()
    for chunk in sf.stream_setpoints(watched(), limits, period=PERIOD):
        ticks += len(chunk)
        furthest = max(furthest, float(chunk.s[-1]))
    seconds = time.process_time() - start
    if abs(furthest - pieces * LENGTH) > 1e-6 * pieces:
        raise AssertionError(f"the motion ends at {furthest} mm of {pieces * LENGTH} mm")
    return {"pieces": pieces, "ticks": ticks, "seconds": seconds, "peak": peak_memory(), "rows": most}

"""Long jobs by parts: what a path of a million pieces and a motion of a hundred hours cost, and in what memory."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table

if TYPE_CHECKING:
    from splinefeed.records import Verdict
    from splinefeed.runs.meters import Meter
    from splinefeed.runs.run import MotionJob

#: Pieces of the paths; the last one moves for a hundred hours.
PIECES = (1_000, 10_000, 100_000, 1_000_000)
#: Pieces of a part, their length and the radius of their curvature, mm.
PART, LENGTH, RADIUS = 1_000, 1.0, 50.0
#: mm/s, mm/s^2, mm/s^3: a piece takes 0.36 s at this feed.
FEED, ACCELERATION, JERK = 2.777, 500.0, 2e4
PERIOD = 1e-3
#: Of the lines of a file: their length, mm, and the feed, mm/s.
LINE, LINE_FEED = 0.5, 50.0
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
        f"`sf.runs.stream_setpoints(parts, limits, period=1e-3)`: tangent arcs of {LENGTH:g} mm in parts of {PART} "
        "that are made when they are needed, planned by `look-ahead` and placed on their arc length, in one "
        "process; making the arcs is in the time, writing the setpoints is not. Peak memory is that of the whole "
        "process, Python and the compiler included.",
    )
    files = _files()
    memory, ticks = rows[-1][5] / rows[1][5], rows[-1][4] / rows[1][4]
    headline = Headline(
        f"{rows[-1][2]:.0f} hours of motion over {rows[-1][0]:,d} pieces, in parts",
        f"{rows[-1][5]:.0f} MB and {rows[-1][4]:.0f} ns a tick; a hundredth of it {rows[1][5]:.0f} MB, "
        f"{rows[1][4]:.0f} ns",
        "memory flat, cost a tick flat",
        memory <= FLAT and ticks <= STRAIGHT,
    )
    tenth, last = ([float(cell or 0) for cell in row] for row in files.rows[-2:])
    lines = Headline(
        f"{last[0]:,.0f} short lines of a file to checked setpoints on the disk, by windows",
        f"{last[2]:.0f} s and {last[4]:.0f} MB; a tenth of it {tenth[2]:.0f} s, {tenth[4]:.0f} MB",
        "memory flat, cost a line flat",
        last[4] <= FLAT * tenth[4] and last[3] <= STRAIGHT * tenth[3],
    )
    return Report((Table("A path that comes in parts.", columns, rows, notes), files), (headline, lines))


def _files() -> Table:
    """CPU time and peak memory of `run` by windows but for its start and its page of numbers."""
    rows = []
    for count in PIECES:
        with tempfile.TemporaryDirectory() as folder:
            file = str(Path(folder, "lines.nc"))
            child.outcome("long", "write_program", file, count)
            each = child.outcome("long", "by_windows", file)
            measured = child.outcome("long", "measured", file)["seconds"]
        seconds, peak, size = each["seconds"], each["peak"] / 1e6, each["size"] / 1e6
        rows.append((count, each["ticks"], seconds, 1e6 * seconds / count, peak, size, measured))
    columns = (
        Column("lines", ",d"),
        Column("ticks", ",d"),
        Column("CPU time, s", ".1f"),
        Column("us a line", ".1f"),
        Column("peak memory, MB", ",.0f"),
        Column("setpoints on the disk, MB", ",.0f"),
        Column("measured too, s", ".1f"),
    )
    notes = (
        f"G-code of lines of {LINE:g} mm along a winding curve, F{60 * LINE_FEED:g}, smoothed by 0.01 mm, as "
        "`splinefeed run` does it above a million lines: looked through, read, smoothed, planned by `look-ahead` on "
        "the axes' acceleration and jerk, placed, checked and written as HDF5, 1 ms, each in a process of its own. "
        "Measured too: with the use of limits, ripple, chord errors and what figures need, as a whole run has them.",
    )
    return Table("A file of any length, by windows.", columns, tuple(rows), notes)


def write_program(file: str, count: int) -> None:
    """G-code of so many short lines."""
    heading = x = y = 0.0
    with Path(file).open("w", encoding="ascii") as stream:
        stream.write(f"G21 G90\nG64 P0.01\nG0 X0 Y0\nG1 F{60 * LINE_FEED:g}\n")
        for k in range(count):
            heading += 0.02 * math.sin(k / 40.0) + 0.003
            x, y = x + LINE * math.cos(heading), y + LINE * math.sin(heading)
            stream.write(f"X{x:.4f} Y{y:.4f}\n")
        stream.write("M2\n")


def by_windows(file: str) -> dict[str, Any]:
    """From a program to checked setpoints beside it; called in a process of its own."""
    from splinefeed.checks.check import Check
    from splinefeed.runs.fold import Chunk, fold
    from splinefeed.runs.long_path import PartReader, windows

    def made(job: MotionJob, writer: Meter) -> Verdict:
        check = Check(job.limits)
        source = job.path.in_parts
        assert source is not None
        reading = PartReader(source, job.reading, check.part)

        def checked() -> Iterator[Chunk]:
            for chunk in windows(reading, job.limits, job.period):
                check.see(chunk.own)
                yield chunk

        fold(checked(), [writer])
        return check.verdict()

    return _timed(file, made)


def measured(file: str) -> dict[str, Any]:
    """The same with all that a run measures; called in a process of its own."""
    from splinefeed.runs.run import carry_out

    return _timed(file, lambda job, writer: carry_out(job, meters=[writer]).verdict)


def _timed(file: str, made: Callable[[MotionJob, Meter], Verdict]) -> dict[str, Any]:
    """Time, memory and size of what makes a verdict of a job and writes its setpoints."""
    import splinefeed as sf
    from splinefeed.formats.setpoints import Writer
    from splinefeed.runs.meters import FileMeter
    from splinefeed.runs.run import MotionJob

    limits = sf.Limits(feed=LINE_FEED, axis_acceleration=1500, axis_jerk=5e4)
    seconds, verdict = 0.0, None
    write_program(f"{file}.nc", 2_000)
    for source in (f"{file}.nc", file):  # the first one compiles
        start = time.process_time()
        job = MotionJob(sf.formats.read_parts(source), limits, period=PERIOD, reading={"smooth": "program"})
        with Writer(f"{file}.h5") as writer:
            verdict = made(job, FileMeter(writer))
        seconds = time.process_time() - start
        if not verdict.ok:
            raise AssertionError(verdict.problems)
    assert verdict is not None
    size = Path(f"{file}.h5").stat().st_size
    return {"ticks": verdict.numbers["ticks"], "seconds": seconds, "peak": peak_memory(), "size": size}


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

    for _ in sf.runs.stream_setpoints(arcs(20), limits, period=PERIOD):
        pass  # compiles
    ticks, furthest = 0, 0.0
    start = time.process_time()
    for chunk in sf.runs.stream_setpoints(watched(), limits, period=PERIOD):
        ticks += len(chunk)
        furthest = max(furthest, float(chunk.s[-1]))
    seconds = time.process_time() - start
    if abs(furthest - pieces * LENGTH) > 1e-6 * pieces:
        raise AssertionError(f"the motion ends at {furthest} mm of {pieces * LENGTH} mm")
    return {"pieces": pieces, "ticks": ticks, "seconds": seconds, "peak": peak_memory(), "rows": most}

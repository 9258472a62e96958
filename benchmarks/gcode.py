"""G-code: lines a second parsed to moves, beside a plain read of the file, and what `info` takes for 100 MB."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import child
from benchmarks.stream import peak_memory
from benchmarks.tables import Column, Headline, Report, Table
from benchmarks.timing import interleaved

#: Lines of the programs, and least megabytes of the one that `info` is asked about.
LINES, MEGABYTES = 300_000, 100.0
ROUNDS = 5
#: Targets: lines a second; s and MB of `info`.
LEAST_RATE, MOST_SECONDS, MOST_MEMORY = 300_000.0, 15.0, 1000.0


def measure() -> Report:
    """Parse programs of lines, of lines and arcs, and of lines that only the interpreter knows; then one of 100 MB."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        for title, every in (("G1 X Y Z", 0), ("every fourth an arc", 4), ("every tenth with M and S", -10)):
            file = program(Path(folder, "part.ngc"), LINES, every)
            times = interleaved({"ours": lambda file=file: parse(file), "read": lambda file=file: plain(file)}, ROUNDS)
            ours, read = times["ours"].least, times["read"].least
            rows.append((title, LINES, file.stat().st_size / 1e6, LINES / ours, ours / read))
        file = Path(folder, "large.ngc")
        count = int(MEGABYTES * 1e6 / 34)
        while program(file, count, 0).stat().st_size < MEGABYTES * 1e6:
            count = int(1.1 * count)
        found = child.outcome("gcode", "info", str(file))
        large = (file.stat().st_size / 1e6, count, found["seconds"], found["peak"] / 1e6)
    columns = (
        Column("program"),
        Column("lines", ",d"),
        Column("MB", ",.1f"),
        Column("lines a second", ",.0f"),
        Column("times a plain read", ",.0f"),
    )
    parsed = Table("Programs parsed to moves, kernels compiled.", columns, tuple(rows))
    columns = (
        Column("MB", ",.0f"),
        Column("lines", ",d"),
        Column("`info`, s", ".1f"),
        Column("peak memory, MB", ",.0f"),
    )
    info_table = Table("`info` of a large program, in a process of its own.", columns, (large,))
    rate = min(row[3] for row in rows)
    return Report(
        (parsed, info_table),
        (
            Headline("G-code lines parsed to moves", f"{rate:,.0f} a second", f"{LEAST_RATE:,.0f}", rate >= LEAST_RATE),
            Headline(
                f"`info` of {large[0]:.0f} MB of G-code",
                f"{large[2]:.1f} s, {large[3]:.0f} MB",
                f"{MOST_SECONDS:g} s, {MOST_MEMORY:g} MB",
                large[2] <= MOST_SECONDS and large[3] <= MOST_MEMORY,
            ),
        ),
    )


def program(file: Path, lines: int, every: int) -> Path:
    """A walk in a plane; with `every` > 0 some lines are arcs, with `every` < 0 some have M and S words."""
    walk = np.cumsum(np.random.default_rng(1).normal(scale=0.3, size=(lines, 2)), axis=0)
    with file.open("w") as stream:
        stream.write("G21 G90 G17\nG0 X0 Y0 Z5\nF1200\nG1 Z-1\n")
        for k, (x, y) in enumerate(walk.tolist()):
            if every > 0 and k % every == 0:
                stream.write(f"N{k} G2 X{x:.4f} Y{y:.4f} R500\n")
            elif every < 0 and k % -every == 0:
                stream.write(f"N{k} G1 X{x:.4f} Y{y:.4f} S{k} M3\n")
            else:
                stream.write(f"N{k} G1 X{x:.4f} Y{y:.4f} Z{-0.001 * (k % 1000):.4f}\n")
        stream.write("M30\n")
    return file


def parse(file: Path) -> int:
    """Count the moves of a program."""
    from splinefeed.programs.gcode.reader import Reading

    return sum(len(part) for part in Reading().moves(file))


def plain(file: Path) -> int:
    """Read the bytes and count the lines."""
    return file.read_bytes().count(b"\n")


def info(name: str) -> dict[str, Any]:
    """Seconds and peak bytes of a summary, in this process."""
    from splinefeed.programs.gcode.overview import summary

    start = time.perf_counter()
    summary(name).page(name)
    return {"seconds": time.perf_counter() - start, "peak": peak_memory()}

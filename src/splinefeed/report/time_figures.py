"""The time of a program drawn along its lines: stacked bars by kind of time."""

from __future__ import annotations

import numpy as np

from splinefeed.pipeline.cycle_time import KINDS, CycleTime
from splinefeed.records import Array
from splinefeed.report import theme
from splinefeed.report.figure import Axis, Figure, Line, Panel

#: Bars along the program at the most.
BARS = 120


def time_figure(time: CycleTime) -> Figure:
    """Seconds in each stretch of the program's lines, cutting at the bottom."""
    line, seconds, kind, _ = time.rows
    high = int(line.max(initial=0)) + 1
    size = -(-high // BARS)
    edges: Array = np.arange(-(-high // size) + 1, dtype=np.float64) * size
    below: Array = np.zeros(len(edges) - 1, dtype=np.float64)
    marks = []
    for number, name in enumerate(KINDS):
        of = kind == number
        bars: Array = np.asarray(np.bincount(line[of] // size, seconds[of], len(below)), dtype=np.float64)
        if bars.any():
            x, y = _outline(edges, below.copy(), below + bars)
            words = f"{name.replace('_', ' ')} {theme.short(float(bars.sum()))} s"
            marks.append(Line(x, y, words, theme.colour(number), named=True, fill=True))
            below += bars
    title = f"{theme.words(time.name)} on {theme.words(time.machine.name)}: {theme.short(time.total)} s"
    up = Axis(f"time (s) of {size} lines" if size > 1 else "time (s)", low=0.0)
    return Figure(title, (Panel(Axis("line of the program"), up, tuple(marks), height=220),))


def _outline(edges: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The outline of bars between edges (n + 1,) from low (n,) to high (n,): there along the top, back below."""
    steps = np.repeat(edges, 2)[1:-1]
    return np.concatenate([steps, steps[::-1]]), np.concatenate([np.repeat(high, 2), np.repeat(low, 2)[::-1]])

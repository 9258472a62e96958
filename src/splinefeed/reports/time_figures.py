"""A program with its time: stacked bars by kind of time along its lines, and its path by operation and by feed."""

from __future__ import annotations

import numpy as np

from splinefeed.analysis.thinning import cells
from splinefeed.programs.control_planning import KINDS
from splinefeed.programs.cycle_time import CycleTime
from splinefeed.records import Array
from splinefeed.reports import theme
from splinefeed.reports.figure import Coloured, Figure, Line, Panel, PlotAxis, Shades

#: Bars along the program at the most.
BARS = 120
#: Points of a path that are drawn as they are; what lies within a pixel of others is left out beyond that.
POINTS = 200_000
#: mm/min in mm/s.
_A_MINUTE = 60.0


def time_figure(time: CycleTime) -> Figure:
    """Draw the seconds in each stretch of a program's lines, cutting at the bottom.

    Parameters
    ----------
    time : CycleTime
        Of the program.

    Returns
    -------
    Figure
        One panel.
    """
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
    up = PlotAxis(f"time (s) of {size} lines" if size > 1 else "time (s)", low=0.0)
    return Figure(title, (Panel(PlotAxis("line of the program"), up, tuple(marks), height=220),))


def program_figure(time: CycleTime) -> Figure:
    """Draw where the tool goes in a program, as the control reaches it.

    Parameters
    ----------
    time : CycleTime
        Of the program.

    Returns
    -------
    Figure
        One panel, by operation and by feed, mm/min; rapid moves have no colour.
    """
    blocks = time.blocks
    kept = np.arange(len(blocks.trace)) if len(blocks.trace) <= POINTS else cells(blocks.trace)
    place = blocks.trace[kept]
    block = np.minimum(np.searchsorted(blocks.end, kept), len(blocks) - 1)
    line = blocks.line[block]
    reached = _A_MINUTE * blocks.length / time.times.seconds
    operation = np.searchsorted([before for before, _, _ in time.changes], block, "right").astype(np.float64)
    rapid = (blocks.rapid | ~np.isfinite(blocks.feed))[block]
    shades = {
        name: Shades(np.where(rapid, np.nan, values), label, low, float(np.max(values[~rapid], initial=low + 1.0)))
        for name, values, label, low in (
            ("operation", operation, "operation", float(np.min(operation[~rapid], initial=1.0))),
            ("feed", reached[block], "feed (mm/min)", 0.0),
            ("programmed feed", _A_MINUTE * blocks.feed[block], "programmed feed (mm/min)", 0.0),
        )
    }
    flat = float(np.ptp(place[:, 2])) == 0.0
    place = place[:, :2] if flat else place
    hover, track = np.column_stack([line, reached[block]]), _track(time)
    track = track[0], track[1][:, :2] if flat else track[1], track[2]
    coloured = Coloured(place, shades, hover, ("line", "feed (mm/min)"), place, track=track)
    x, y, z = PlotAxis("x (mm)"), PlotAxis("y (mm)"), "" if flat else "z (mm)"
    return Figure(theme.words(time.name), (Panel(x, y, (coloured,), height=300, equal=True, z=z),))


def _track(time: CycleTime) -> tuple[Array, Array, Array]:
    """When the tool is where, (m,) s with waits and (m, 3) mm, and 1 behind a rapid move; each block at one speed."""
    blocks = time.blocks
    _, seconds, _, number = time.rows
    begin = (np.cumsum(seconds) - seconds)[number >= 0]
    owner = np.minimum(np.searchsorted(blocks.end, np.arange(len(blocks.trace))), len(blocks) - 1)
    step = np.linalg.norm(np.diff(blocks.trace, axis=0, prepend=blocks.trace[:1]), axis=1)
    along = np.cumsum(step)
    start = np.append(0.0, along[blocks.end[:-1]])
    size = along[blocks.end] - start
    share = (along - start[owner]) / np.where(size > 0.0, size, 1.0)[owner]
    share[blocks.end] = 1.0
    t = begin[owner] + time.times.seconds[owner] * share
    starts = np.append(0, blocks.end[:-1])  # where it waits before a block
    order = np.argsort(np.concatenate([t, begin]), kind="stable")
    rising = np.maximum.accumulate(np.concatenate([t, begin])[order])
    rapid = np.append((blocks.rapid | ~np.isfinite(blocks.feed))[owner].astype(np.float64), np.zeros(len(starts)))
    return rising, np.concatenate([blocks.trace, blocks.trace[starts]])[order], rapid[order]


def _outline(edges: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The outline of bars between edges (n + 1,) from low (n,) to high (n,): there along the top, back below."""
    steps = np.repeat(edges, 2)[1:-1]
    return np.concatenate([steps, steps[::-1]]), np.concatenate([np.repeat(high, 2), np.repeat(low, 2)[::-1]])

"""The figures of a run over time: records in, a matplotlib Figure out. The path itself is in `path_figure`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from splinefeed.analysis.motion import AxisMotion
from splinefeed.geometry.path import Path
from splinefeed.pipeline.compare import MethodTrace
from splinefeed.records import Array, Limits, TimeLaw, unit_along
from splinefeed.report import theme
from splinefeed.report.drawing import curve, finite_peak, limit, line_at, short, unit_of

#: Instants at which a law is drawn, besides both sides of its breaks.
INSTANTS = 1400
#: Peaks of an axis beyond this many times the path's own limit get a scale that is logarithmic outside that limit.
LINEAR_UP_TO = 100.0
#: A peak that reads as "1 times" the limit is not coloured as one above it.
VISIBLY_ABOVE = 1.005
#: Columns of the panels of methods, and how far below the rounding floor the scale goes.
METHOD_COLUMNS = 4
BELOW_FLOOR = 0.01
#: Most labels of powers of ten along a scale.
MOST_POWERS = 7
_QUANTITIES = ("velocity", "acceleration", "jerk")


def feed_figure(law: TimeLaw, limits: Limits, name: str, along: str = "mm") -> Figure:
    """s, feed, acceleration and jerk along the path over time, with their limits: fig. 1 of the paper; unit of s."""
    jerk, slowing_jerk = limits.jerk, _or_infinite(limits.deceleration_jerk)
    jerks = [("J", jerk), ("-J", -jerk)]
    if slowing_jerk != jerk:
        jerks += [("slowing J", slowing_jerk), ("slowing -J", -slowing_jerk)]
    t = _instants(law)
    panels: tuple[tuple[str, Array, list[tuple[str, float]]], ...] = (
        ("travelled", law(t), []),
        ("feed", law.feed(t), [("limit", limits.feed)]),
        ("acceleration", law.acceleration(t), [("A", limits.acceleration), ("-D", -_or_infinite(limits.deceleration))]),
        ("jerk", law.jerk(t), jerks),
    )
    with theme.applied():
        title = f"{theme.words(name)}: along the path over time, {law.strategy}"
        figure = theme.new_figure(7.6, 7.2, title, gaps=(0.0, 0.16), grid=(4, 1))
        rows = figure.subplots(len(panels), 1, sharex=True)
        for order, (ax, (label, values, lines)) in enumerate(zip(rows, panels, strict=True)):
            unit = unit_of(along, order)
            curve(ax, t, values)
            ax.set_ylabel(f"{label} ({unit})")
            ax.margins(x=0.01, y=0.2 if lines else 0.05)
            ax.locator_params(axis="y", nbins=5)
            theme.plain_ticks(ax.yaxis)
            for symbol, value in lines:
                limit(ax, value, finite_peak(values)[1], f"{symbol} = {short(value)} {unit}")
            ax.yaxis.set_label_coords(-theme.LABEL_AT / (7.6 - theme.LEFT - theme.RIGHT), 0.5)
        rows[-1].set_xlabel("time (s)")
        theme.plain_ticks(rows[-1].xaxis)
        return figure


def _or_infinite(value: float | None) -> float:
    return np.inf if value is None else value


def _instants(law: TimeLaw) -> Array:
    """Even instants of the law, and the last one before and the first one after each break, where the jerk jumps."""
    inner = law.breaks[1:-1]
    even = np.linspace(0.0, law.duration, INSTANTS)
    return np.unique(np.concatenate([even, inner, np.nextafter(inner, 0.0)]))


def axes_figure(motion: AxisMotion, path: Path, limits: Limits) -> Figure:
    """Velocity, acceleration and jerk of each axis over time, beside the A and J that the path was planned with.

    Linear axes in mm, rotary ones in degrees; A and J are those along the path, the larger of speeding up and down.
    """
    own = (
        np.inf,
        max(limits.acceleration, _or_infinite(limits.deceleration)),
        max(limits.jerk, _or_infinite(limits.deceleration_jerk)),
    )
    count = len(path.axes)
    bands = [
        f"{symbol} = {short(value)} {unit_of(unit_along(path.axes), order)}"
        for symbol, value, order in (("A", own[1], 2), ("J", own[2], 3))
        if np.isfinite(value)
    ]
    title = f"{theme.words(path.name)}: what each axis must do"
    title += f"\ngreen band: the path's own {' and '.join(bands)}" if bands else ""
    with theme.applied():
        width = max(3.3 * count + 1.0, 6.0)
        panel = (width - theme.RIGHT) / count - theme.LEFT
        figure = theme.new_figure(width, 7.2, title, gaps=(theme.LEFT, 0.4), grid=(3, count), titles=1)
        grid = figure.subplots(3, count, sharex=True, squeeze=False)
        for column, axis in enumerate(path.axes):
            rotary = column >= path.linear
            for row, quantity in enumerate(_QUANTITIES):
                values = getattr(motion, quantity)[:, column]
                ax = grid[row, column]
                _axis_panel(ax, motion.t, np.rad2deg(values) if rotary else values, np.inf if rotary else own[row], row)
                ax.set_ylabel(f"{theme.words(axis, 12)} {quantity} ({unit_of('deg' if rotary else 'mm', row + 1)})")
                ax.yaxis.set_label_coords(-theme.LABEL_AT / panel, 0.5)
            grid[-1, column].set_xlabel("time (s)")
            grid[-1, column].locator_params(axis="x", nbins=6)
            theme.plain_ticks(grid[-1, column].xaxis)
        return figure


def _axis_panel(ax: Axes, t: Array, values: Array, own: float, row: int) -> None:
    """One axis, one quantity; `own` is the path's limit of that quantity, drawn as a band, or infinite."""
    at, peak = finite_peak(values)
    curve(ax, t, values, linewidth=1.0)
    ax.margins(x=0.01, y=0.08)
    title = f"peak {short(peak)}" if peak > 0.0 else "does not move"
    if np.isfinite(own):
        ax.axhspan(-own, own, color=theme.BAND, zorder=0)
        for value in (-own, own):
            line_at(ax, value, theme.GREEN)
        title += f" = {short(peak / own)} times {'AJ'[row - 1]}" if peak > 0.0 else ""
    if peak > LINEAR_UP_TO * own:
        ax.set_yscale("symlog", linthresh=own, linscale=0.8)
        powers = 10.0 ** np.arange(np.ceil(np.log10(own * 1.5)), np.floor(np.log10(peak)) + 1.0)
        powers = powers[:: 1 + len(powers) // 3]
        ax.set_yticks([*-powers[::-1], 0.0, *powers], minor=False)
        ax.set_yticks([], minor=True)
    else:
        ax.locator_params(axis="y", nbins=6)
    theme.plain_ticks(ax.yaxis)
    if peak > 0.0:
        ax.plot(t[at], values[at], "o", color=theme.VERMILION, markersize=4)
        title += f" at {short(float(t[at]))} s"
    above = peak > VISIBLY_ABOVE * own
    ax.set_title(title, color=theme.VERMILION if above else theme.INK, fontsize=9.5)


def ripple_figure(traces: Sequence[MethodTrace], name: str) -> Figure:
    """|ripple|, the relative error of each step against the planned one, over time: one panel a method, one scale."""
    columns = min(METHOD_COLUMNS, len(traces))
    rows = -(-len(traces) // columns)
    floor = max(trace.result.ripple_floor for trace in traces)
    top = max(finite_peak(trace.relative)[1] for trace in traces)
    low = max(floor, float(np.finfo(float).eps)) * BELOW_FLOOR
    high = max(3.0 * top, 100.0 * low)
    first, last = np.ceil(np.log10(low)), np.floor(np.log10(high))
    powers = 10.0 ** np.arange(first, last + 1.0, 1.0 + (last - first) // MOST_POWERS)
    title = (
        f"{theme.words(name)}: feed ripple by method, |step / planned step - 1|\n"
        "dashed: what the rounding of s alone can make"
    )
    with theme.applied():
        width = max(2.6 * columns + 1.0, 5.6)
        figure = theme.new_figure(
            width, 2.3 * rows + 1.2, title, left=0.78, gaps=(0.14, 0.5), grid=(rows, columns), titles=2
        )
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for ax, trace in zip(grid.flat, traces, strict=False):
            size = np.maximum(np.abs(trace.relative), 0.1 * low)  # out of the picture, but on its logarithmic scale
            curve(ax, trace.t, size, linewidth=0.7)
            line_at(ax, max(floor, low), theme.GREEN)
            ax.set_title(f"{theme.words(trace.result.method, 30)}\nmax {trace.result.ripple_max:.1e}", fontsize=9.5)
        ax = grid[0, 0]
        ax.set_ylim(low, high)  # first: a scale of no points at all would be complained about
        ax.set_yscale("log")
        ax.set_yticks(powers)
        theme.plain_ticks(ax.yaxis, logarithmic=True)
        ax.locator_params(axis="x", nbins=4)
        theme.plain_ticks(ax.xaxis)
        for ax in grid[:, 0]:
            ax.set_ylabel("feed ripple (relative)")
        for ax in grid[-1]:
            ax.set_xlabel("time (s)")
        for ax in list(grid.flat)[len(traces) :]:
            ax.remove()
        return figure

"""Figures over time: the motion along the path and of its axes, and the feed ripple of methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from splinefeed.errors import expect
from splinefeed.geometry.path import Path
from splinefeed.pipeline.compare import MethodTrace
from splinefeed.pipeline.result import Run
from splinefeed.records import Array, Limits, TimeLaw, unit_along, unit_of_axis
from splinefeed.report import theme
from splinefeed.report.figure import Axis, Figure, Level, Line, Mark, Panel, peak

#: The maximum-velocity curve is drawn up to this many times the highest feed.
HEADROOM = 1.6
#: Columns of the panels of methods, and how far below the rounding floor the scale goes.
METHOD_COLUMNS = 4
BELOW_FLOOR = 0.01
TIME = Axis("time (s)")
#: Instants of a law of which none are given.
EVEN = 1000
_QUANTITIES = ("position", "velocity", "acceleration", "jerk")
#: Which of the panels of the axes is that of their jerk.
JERK = 3


def motion(run: Run) -> Figure:
    """Draw s, feed, acceleration and jerk along the path over time, and velocity, acceleration and jerk of each axis.

    In mm and s, rotary axes in degrees. Raises InputError for anything but a Run. Source: `report.motion_figures`.
    Example: `sf.plot.motion(sf.run(sf.shapes.butterfly()))`
    """
    expect("plot.motion(run)", (run, Run))
    t, path = run.kept.t, run.path
    top = np.minimum(run.use.top, HEADROOM * float(np.max(run.kept.feed)))
    above = Line(t, top, "maximum velocity", theme.PALE, 1.0, named=True, stretch=run.stretch)
    panels = (*tip_panels(run, above), *axis_panels(run))
    return Figure(f"{theme.words(path.name)}: motion over time, {run.strategy}", panels)


def tip_panels(run: Run, above: Line | None = None) -> list[Panel]:
    """The panels of `law_panels` for a run: from its law, or from what is kept of it where the path came in parts."""
    along = unit_along(run.path.axes)
    if run.planned is not None:
        return law_panels(run.law, run.limits, along, run.kept.t, above, run.path, run.stretch)
    assert run.tip is not None
    values = (run.kept.s, run.kept.feed, run.tip.acceleration, run.tip.jerk)
    return _panels(run.kept.t, values, run.limits, along, above, run.stretch, run.path)


def law_panels(
    law: TimeLaw,
    limits: Limits,
    along: str = "mm",
    t: Array | None = None,
    above: Line | None = None,
    path: Path | None = None,
    stretch: float = 0.0,
) -> list[Panel]:
    """s, feed, acceleration and jerk of the tip over time with their limits (fig. 1 of the paper).

    along  the unit of s; t  (n,) instants, s, else a thousand even ones; both sides of the breaks of the law are
    added, where the jerk jumps; above  a curve behind the feed; stretch  as of a `Line`
    """
    inner = law.breaks[1:-1]
    even = np.linspace(0.0, law.duration, EVEN) if t is None else t
    at = np.unique(np.concatenate([even, inner, np.nextafter(inner, 0.0)]))
    values = law(at), law.feed(at), law.acceleration(at), law.jerk(at)
    return _panels(at, values if path is None else path.of_tip(*values), limits, along, above, stretch, path)


def _panels(
    at: Array,
    values: tuple[Array, Array, Array, Array],
    limits: Limits,
    along: str,
    above: Line | None,
    stretch: float,
    path: Path | None,
) -> list[Panel]:
    """Panels of s, feed, acceleration and jerk (n,) of the tip at instants (n,), s, with their limits."""
    s, feed, acceleration, jerk = values
    slowing = np.inf if limits.deceleration is None else limits.deceleration
    jerks = [("J", limits.jerk), ("-J", -limits.jerk)]
    if (slow := limits.deceleration_jerk) not in (None, limits.jerk):
        jerks += [("slowing J", slow), ("slowing -J", -slow)]
    rows: tuple[tuple[str, Array, list[tuple[str, float]]], ...] = (
        ("s", s, []),
        ("feed", feed, [("limit", limits.feed)]),
        ("acceleration", acceleration, [("A", limits.acceleration), ("-D", -slowing)]),
        ("jerk", jerk, jerks),
    )
    panels = []
    for name, each, levels in rows:
        factor, unit = theme.of_feed(path, along) if name == "feed" else (1.0, theme.unit(name, along))
        marks: list[Mark] = []
        if name == "feed" and above is not None:
            marks.append(replace(above, y=factor * above.y))
        marks.append(Line(at, factor * each, name, stretch=stretch))
        marks += [Level(factor * value, f"{symbol} = {theme.short(factor * value)} {unit}") for symbol, value in levels]
        panels.append(Panel(TIME, Axis(f"{name} ({unit})"), tuple(marks)))
    return panels


def axis_panels(run: Run) -> list[Panel]:
    """A panel for position, velocity, acceleration and jerk of the axes in each unit.

    With the limit of each axis, in its colour where they differ.
    """
    panels = []
    units = list(map(unit_of_axis, run.axes))
    for own in dict.fromkeys(units):
        columns, factor = [k for k, each in enumerate(units) if each == own], 180.0 / np.pi if own == "deg" else 1.0
        for quantity in _QUANTITIES:
            kept = run.kept if quantity == "position" else run.motion
            values = factor * getattr(kept, quantity)
            unit = theme.of_axis(quantity, run.axes[columns[0]])
            marks: list[Mark] = []
            for k in columns:
                name = theme.words(run.axes[k], 12)
                line = Line(kept.t, values[:, k], f"{name} {quantity}", theme.colour(k), named=name)
                marks.append(replace(line, dash=k >= len(theme.COLOURS), stretch=run.stretch))
            most = max(peak(values[:, k])[1] for k in columns)
            label, note = (
                Axis(f"axis {quantity} {unit if unit.endswith(')') else f'({unit})'}"),
                f"at most {theme.short(most)} {unit}",
            )
            if kept is run.kept:
                note = ""
            else:
                marks += _limits_of_axes(run, quantity, columns, factor, unit)
            panels.append(Panel(TIME, label, tuple(marks), note=note))
    return panels


def _limits_of_axes(run: Run, quantity: str, columns: list[int], factor: float, unit: str) -> list[Level]:
    """A line at each limit of these axes, with the axes that have it; all have one colour where they share it."""
    tops = factor * run.limits.of_axes(f"axis_{quantity}", run.axes)
    found: dict[float, list[int]] = {}
    for k in columns:
        if np.isfinite(tops[k]):
            found.setdefault(float(tops[k]), []).append(k)
    levels = []
    for top, axes in found.items():
        names = " ".join(theme.words(run.axes[k], 12) for k in axes)
        text = f"{'limit' if len(axes) == len(columns) else names} {theme.short(top)} {unit}"
        colour = theme.VERMILION if len(found) == 1 else theme.colour(axes[0])
        levels += [Level(top, text, colour), Level(-top, colour=colour)]
    return levels


def ripple_figure(traces: Sequence[MethodTrace], name: str) -> Figure:
    """Size of the feed ripple over time, one panel a method, logarithmic, above the floor that rounding sets."""
    floor = max(trace.result.ripple_floor for trace in traces)
    top = max(trace.result.ripple_max for trace in traces)
    low = max(floor, float(np.finfo(float).eps)) * BELOW_FLOOR
    panels = []
    for trace in traces:
        size = np.maximum(np.abs(trace.relative), 0.1 * low)  # out of the picture, but on its logarithmic scale
        method = theme.words(trace.result.method, 30)
        y = Axis(method, low, max(3.0 * top, 100.0 * low), log=True)
        line = Line(trace.t, size, method, width=0.8)
        rounding = Level(max(floor, low), colour=theme.GREEN, always=True)
        panels.append(Panel(TIME, y, (line, rounding), note=f"max {trace.result.ripple_max:.1e}", height=140))
    title = f"{theme.words(name)}: feed ripple (relative) by method, |step / planned step - 1|\n"
    columns = min(METHOD_COLUMNS, max(len(traces), 1))
    return Figure(
        f"{title}dashed: what the rounding of s alone can make", tuple(panels), columns, width=max(270 * columns, 560)
    )

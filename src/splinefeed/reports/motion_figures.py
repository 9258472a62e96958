"""Figures over time: the motion along the path and of its axes, and the feed ripple of methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import expect
from splinefeed.limit_table import named
from splinefeed.paths.path import Path
from splinefeed.records import Array, Limits, TimeLaw, unit_along, unit_of, unit_of_axis, words_of
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Level, Line, Mark, Panel, PlotAxis, peak
from splinefeed.runs.comparison import MethodTrace
from splinefeed.runs.meters import MOTION
from splinefeed.runs.result import Run

#: The maximum-velocity curve is drawn up to this many times the highest feed.
HEADROOM = 1.6
#: Columns of the panels of methods, and how far below the rounding floor the scale goes.
METHOD_COLUMNS = 4
BELOW_FLOOR = 0.01
TIME = PlotAxis("time (s)")
#: Instants of a law of which none are given.
EVEN = 1000
_QUANTITIES = ("position", "velocity", "acceleration", "jerk")
#: An end of a travel is drawn where the axis comes nearer to it than this share of the travel.
NEAR = 0.2
#: What lies half a period behind its tick.
LATE = ("velocity", "jerk")
#: Which of the panels of the axes is that of their jerk.
JERK = 3


def motion(run: Run) -> Figure:
    """Draw the motion along the path and of each axis over time.

    Parameters
    ----------
    run : Run
        To be drawn; mm and s, rotary axes in degrees.

    Returns
    -------
    Figure
        Panels of s, feed, acceleration and jerk along the path, of position, velocity, acceleration and jerk of each
        axis, and of torques and what else is limited by a model.

    Raises
    ------
    InputError
        For anything but a Run.

    References
    ----------
    .. [1] docs/start.md shows the report.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000))
    >>> len(sf.plot.motion(run).panels)
    8
    """
    expect("plot.motion(run)", (run, Run))
    panels = (*tip_panels(run, maximum_velocity(run)), *axis_panels(run), *model_panels(run))
    return Figure(f"{theme.words(run.path.name)}: motion over time, {run.strategy}", panels)


def over_time(run: Run, quantity: str, k: int = 0, **how: Any) -> Line:
    """Make the curve of a quantity of a run over time.

    Parameters
    ----------
    run : Run
        Of which it is: at every tick, or its band where ticks are left out.
    quantity : str
        As `CheckMeter` calls it.
    k : int, optional
        Index of the axis or limit.
    **how : object
        How it is drawn, as `Line` takes it.

    Returns
    -------
    Line
        Over s.
    """
    if quantity in run.bands:
        band = run.bands[quantity]
        return Line(band.edges, band.low[:, k], high=band.high[:, k], **how)
    if quantity == "ripple":
        return Line(run.ripple.t, run.ripple.relative, **how)
    of = run.motion if quantity in MOTION else run.use if quantity in ("top", "share") else run.kept
    values = getattr(of, quantity)
    t = run.motion.late(run.kept.period) if quantity in LATE else run.kept.t
    return Line(t, values if values.ndim == 1 else values[:, k], **how)


def maximum_velocity(run: Run) -> Line:
    """The maximum-velocity curve, a little above the highest feed at the most."""
    high = HEADROOM * float(np.max(run.kept.feed))
    line = over_time(run, "top", name="maximum velocity", colour=theme.PALE, width=1.0, named=True)
    return line.through(lambda top: np.minimum(top, high))


def tip_panels(run: Run, above: Line | None = None) -> list[Panel]:
    """The panels of `law_panels` for a run: from its law, or from what is kept where ticks are left out."""
    if run.bands:
        lines = [over_time(run, "tip", k) for k in range(4)]
    elif run.planned is not None:
        t, *values = _of_law(run.law, run.kept.t)
        lines = [Line(t, each) for each in run.path.of_tip(*values)]
    else:
        values = [run.kept.s, run.kept.feed, run.tip.acceleration, run.tip.jerk]
        lines = [Line(run.kept.t, each) for each in values]
    return _panels(lines, run.limits, unit_along(run.path.axes), above, run.path)


def law_panels(law: TimeLaw, limits: Limits) -> list[Panel]:
    """s, feed, acceleration and jerk over time with their limits (fig. 1 of the paper)."""
    t, *values = _of_law(law, np.linspace(0.0, law.duration, EVEN))
    return _panels([Line(t, each) for each in values], limits)


def _of_law(law: TimeLaw, t: Array) -> list[Array]:
    """Instants, s, and sigma, its rate, acceleration and jerk: at t (n,) and on both sides of where the jerk jumps."""
    inner = law.breaks[1:-1]
    t = np.unique(np.concatenate([t, inner, np.nextafter(inner, 0.0)]))
    return [t, law(t), law.feed(t), law.acceleration(t), law.jerk(t)]


def _panels(
    lines: Sequence[Line], limits: Limits, along: str = "mm", above: Line | None = None, path: Path | None = None
) -> list[Panel]:
    """Panels of s, feed, acceleration and jerk of the tip over time, with their limits.

    `along` is the unit of s, `above` a curve behind the feed.
    """
    s, feed, acceleration, jerk = lines
    slowing = np.inf if limits.deceleration is None else limits.deceleration
    jerks = [("J", limits.jerk), ("-J", -limits.jerk)]
    if (slow := limits.deceleration_jerk) not in (None, limits.jerk):
        jerks += [("slowing J", slow), ("slowing -J", -slow)]
    rows: tuple[tuple[str, Line, list[tuple[str, float]]], ...] = (
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
            marks.append(_times(factor, above))
        marks.append(replace(_times(factor, each), name=name))
        marks += [Level(factor * value, f"{symbol} = {theme.given(factor * value)} {unit}") for symbol, value in levels]
        panels.append(Panel(TIME, PlotAxis(f"{name} ({unit})"), tuple(marks)))
    return panels


def _times(factor: float, line: Line) -> Line:
    """The same in another unit, by a factor above 0."""
    return line if factor == 1.0 else line.through(lambda y: factor * y)


def axis_panels(run: Run) -> list[Panel]:
    """A panel for position, velocity, acceleration and jerk of the axes in each unit.

    With the limit of each axis, in its colour where they differ.
    """
    panels = []
    units, names = list(map(unit_of_axis, run.axes)), theme.axis_words(run.axes)
    for own in dict.fromkeys(units):
        columns, factor = [k for k, each in enumerate(units) if each == own], 180.0 / np.pi if own == "deg" else 1.0
        for quantity in _QUANTITIES:
            unit = theme.of_axis(quantity, run.axes[columns[0]])
            marks: list[Mark] = []
            most = 0.0
            for k in columns:
                name = names[k]
                how = {"colour": theme.colour(k), "named": name, "dash": theme.dash(k)}
                line = _times(factor, over_time(run, quantity, k, name=f"{name} {quantity}", **how))
                marks.append(line)
                most = max(most, peak(line.values)[1])
            label = PlotAxis(f"axis {quantity} {unit if unit.endswith(')') else f'({unit})'}")
            note = f"at most {theme.short(most)} {unit}"
            if quantity == "position":
                note = ""
                marks += _travels(run, columns, factor, unit)
            else:
                tops = factor * run.limits.of_axes(f"axis_{quantity}", run.axes)
                marks += _levels(run, columns, dict(enumerate(tops.tolist())), unit)
            panels.append(Panel(TIME, label, tuple(marks), note=note))
    return panels


def model_panels(run: Run) -> list[Panel]:
    """A panel for each limit that a model gives, such as torques of joints, with the limit of each.

    None of a motion of which ticks are left out: their extremes are no motion that a model could count.
    """
    panels, names = [], theme.axis_words(run.axes)
    for model in () if run.bands else run.limits.models:
        columns = model.columns(run.axes)
        of = (run.kept.position, run.motion.velocity, run.motion.acceleration, run.motion.jerk)
        values, most = model.along(*(each[:, columns] for each in of))
        unit, first = unit_of(named(model.kind, model.axes[0])), words_of(model.kind)
        marks: list[Mark] = []
        for k, column in enumerate(columns):
            name = names[column]
            how: dict[str, Any] = {"colour": theme.colour(column), "named": name, "dash": theme.dash(column)}
            marks.append(Line(run.kept.t, values[:, k], f"{name} {first}", **how))
        high = f"at most {theme.short(float(np.max(np.abs(values))))} {unit}"
        if not np.ptp(most, axis=0).any():
            marks += _levels(run, columns, dict(zip(columns, most[0].tolist(), strict=True)), unit)
        panels.append(Panel(TIME, PlotAxis(f"{first} ({unit})"), tuple(marks), note=high))
    return panels


def _travels(run: Run, columns: list[int], factor: float, unit: str) -> list[Level]:
    """A line at each end of the travel of an axis that the axis comes near."""
    levels, called = [], theme.axis_words(run.axes)
    for axis, (low, high) in run.limits.travel_of(run.axes).items():
        k = list(run.axes).index(axis)
        if k not in columns:
            continue
        reached, near = over_time(run, "position", k).values, NEAR * (high - low)
        for which, end in (("from", low), ("to", high)):
            if np.nanmin(np.abs(reached - end)) <= near:
                text = f"{called[k]} {which} {theme.given(factor * end)} {unit}"
                levels.append(Level(factor * end, text, theme.colour(k)))
    return levels


def _levels(run: Run, columns: list[int], tops: Mapping[int, float], unit: str) -> list[Level]:
    """A line at each limit of axes, with the axes that have it; one that several share has no axis' colour."""
    found: dict[float, list[int]] = {}
    for k in columns:
        if np.isfinite(tops[k]):
            found.setdefault(float(tops[k]), []).append(k)
    levels, called = [], theme.axis_words(run.axes)
    for top, axes in found.items():
        names = " ".join(called[k] for k in axes)
        text = f"{'limit' if len(axes) == len(columns) else names} {theme.given(top)} {unit}"
        colour = theme.colour(axes[0]) if len(axes) == 1 else theme.FAINT
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
        y = PlotAxis(method, low, max(3.0 * top, 100.0 * low), log=True)
        line = Line(trace.t, size, method, width=0.8)
        rounding = Level(max(floor, low), colour=theme.GREEN, always=True)
        panels.append(Panel(TIME, y, (line, rounding), note=f"max {trace.result.ripple_max:.1e}", height=140))
    title = f"{theme.words(name)}: feed ripple (relative) by method, |step / planned step - 1|\n"
    columns = min(METHOD_COLUMNS, max(len(traces), 1))
    return Figure(
        f"{title}dashed: what the rounding of s alone can make", tuple(panels), columns, width=max(270 * columns, 560)
    )

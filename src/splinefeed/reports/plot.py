"""Figures of a run in one line: each returns a `Figure`, which a notebook shows and `save` writes (SVG, PNG, PDF)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from splinefeed.errors import InputError, expect
from splinefeed.paths.path import Path
from splinefeed.programs.cycle_time import CycleTime
from splinefeed.records import Limits, Response, TimeLaw
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Level, Mark, Panel, PlotAxis
from splinefeed.reports.motion_figures import (
    JERK,
    TIME,
    axis_panels,
    law_panels,
    motion,
    over_time,
    ripple_figure,
    tip_panels,
)
from splinefeed.reports.path_figures import binding, contour_figure, limits, path_figure, still_figure
from splinefeed.reports.servo_figures import bode_figure, errors_figure
from splinefeed.reports.time_figures import program_figure
from splinefeed.runs.comparison import MethodTrace
from splinefeed.runs.following import Servo
from splinefeed.runs.result import Run
from splinefeed.simulation.tuning import TunedAxis

__all__ = [
    "Figure", "binding", "bode", "compare", "contour", "errors", "joints", "law", "limits", "motion", "overview",
    "path", "program", "ripple",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__


#: What the path of a run may be coloured by.
COLOURS = ("feed", "curvature", "nearest limit")


def overview(run: Run) -> Figure:
    """Draw the path coloured by feed, and below it feed and jerk over time with their limits.

    Parameters
    ----------
    run : Run
        To be drawn, mm and s.

    Returns
    -------
    Figure
        Three panels.

    Raises
    ------
    InputError
        For anything but a Run.

    Notes
    -----
    Jerk is that of the axes where they have a limit of it, else that along the path.

    References
    ----------
    .. [1] docs/start.md shows the report, which has these panels.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000))
    >>> figure = sf.plot.overview(run)
    >>> figure.save("part.svg")
    >>> len(figure.panels)
    3
    """
    expect("plot.overview(run)", (run, Run))
    above = path_figure(run, colour="feed")
    _, feed, _, jerk = tip_panels(run)
    if np.any(np.isfinite(run.limits.of_axes("axis_jerk", run.axes))):
        jerk = axis_panels(run)[JERK]
    return replace(above, panels=(*above.panels, feed, jerk))


def path(run: Run | Path, colour: str = "feed") -> Figure:
    """Draw where the tool goes, of a run, or of a path that is not planned yet.

    Parameters
    ----------
    run : Run or Path
        To be drawn, mm (fig. 9 of the paper). A path in space is drawn in perspective; a run of one axis, over time.
    colour : str, optional
        Of a run "feed" (mm/s), "curvature" (1/mm) or "nearest limit" (%); a bare path is coloured by its curvature.

    Returns
    -------
    Figure
        One panel.

    Raises
    ------
    InputError
        For another colour, and for anything but a Run or a Path with two linear axes.

    References
    ----------
    .. [1] docs/paper.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.plot.path(sf.shapes.butterfly()).save("path.svg")
    """
    if colour not in COLOURS:
        raise InputError(f"plot.path: colour is {colour!r}; choose {', '.join(repr(each) for each in COLOURS)}")
    expect("plot.path(run)", (run, (Run, Path)))
    return path_figure(run, colour=colour) if isinstance(run, Run) else still_figure(run)


def law(law: TimeLaw, limits: Limits) -> Figure:
    """Draw s, feed, acceleration and jerk of a time law over time with their limits.

    Parameters
    ----------
    law : TimeLaw
        To be drawn, mm and s (fig. 1 of the paper).
    limits : Limits
        That it keeps.

    Returns
    -------
    Figure
        Four panels.

    Raises
    ------
    InputError
        For anything but a TimeLaw and Limits.

    References
    ----------
    .. [1] docs/paper.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    >>> law = sf.plan(sf.Path.polyline([[0, 0], [30, 0]]), limits, period=1e-3)
    >>> len(sf.plot.law(law, limits).panels)
    4
    """
    expect("plot.law(law, limits)", (law, TimeLaw), (limits, Limits))
    return Figure(law.strategy, tuple(law_panels(law, limits)))


def joints(run: Run) -> Figure:
    """Draw position, velocity, acceleration and jerk of each axis over time with its limits.

    Parameters
    ----------
    run : Run
        To be drawn; mm, rotary axes in degrees, s.

    Returns
    -------
    Figure
        Four panels for the axes of each unit.

    Raises
    ------
    InputError
        For anything but a Run.

    References
    ----------
    .. [1] docs/start.md shows the report, which has these panels.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000))
    >>> len(sf.plot.joints(run).panels)
    4
    """
    expect("plot.joints(run)", (run, Run))
    return Figure(f"{theme.words(run.path.name)}: axes over time, {run.strategy}", tuple(axis_panels(run)))


def ripple(run: Run) -> Figure:
    """Draw the feed ripple of the setpoints over time.

    Parameters
    ----------
    run : Run
        To be drawn; s, and relative: |step / planned step - 1| from tick to tick.

    Returns
    -------
    Figure
        One panel.

    Raises
    ------
    InputError
        For anything but a Run.

    References
    ----------
    .. [1] docs/math/interpolators.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, axis_jerk=20000), method="taylor-1")
    >>> sf.plot.ripple(run).title
    'circle: feed ripple, taylor-1'
    """
    expect("plot.ripple(run)", (run, Run))
    found = run.ripple
    marks: list[Mark] = [over_time(run, "ripple", name="feed ripple")]
    marks += [Level(sign * found.floor, "rounding alone" * (sign > 0), theme.GREEN, always=True) for sign in (1, -1)]
    panel = Panel(TIME, PlotAxis("feed ripple (relative)"), tuple(marks), note=f"at most {found.max:.2g}", height=220)
    return Figure(f"{theme.words(run.path.name)}: feed ripple, {run.kept.method}", (panel,))


def compare(traces: Iterable[MethodTrace], name: str = "methods") -> Figure:
    """Draw the feed ripple of methods over time, one panel each, on one logarithmic scale.

    Parameters
    ----------
    traces : iterable of MethodTrace
        What `sf.runs.compare` gives; s, and relative.
    name : str, optional
        Of the path, for the title.

    Returns
    -------
    Figure
        A panel a method.

    Raises
    ------
    InputError
        For anything else, or for none.

    References
    ----------
    .. [1] docs/math/interpolators.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> law = sf.plan(path, sf.Limits(feed=50, acceleration=1000, jerk=50000), period=1e-3)
    >>> traces = sf.runs.compare(path, law, methods=["taylor-1", "arc-length"], timed=False)
    >>> len(sf.plot.compare(traces, path.name).panels)
    2
    """
    found = list(traces)
    if not found or not all(isinstance(each, MethodTrace) for each in found):
        raise InputError("plot.compare: expected what sf.runs.compare gives: one trace a method, at least one")
    return ripple_figure(found, name)


def errors(what: Run | Response) -> Figure:
    """Draw contour and following errors of the axes over time.

    Parameters
    ----------
    what : Run or Response
        A run with a machine, or the response of `sf.runs.follow`; s and µm, rotary axes in deg (fig. 5 of the paper).

    Returns
    -------
    Figure
        A panel for the contour error where there is one, then one an axis.

    Raises
    ------
    InputError
        For anything else, and for a run without a machine.

    References
    ----------
    .. [1] docs/paper.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> run = sf.run(path, sf.Limits(feed=20, acceleration=200, jerk=5000), machine="xytheta")
    >>> sf.plot.errors(run).title
    'circle on xytheta: errors over time'
    """
    if isinstance(what, Response):
        return errors_figure({what.settings.get("method", "setpoints"): what})
    expect("plot.errors(run)", (what, Run))
    served = _served(what, "errors")
    return errors_figure({what.kept.method: served.response}, what.path.name, served.machine.name, served.bands)


def contour(run: Run) -> Figure:
    """Draw where the machine of a run is beside the true path, the distance enlarged and as colour.

    Parameters
    ----------
    run : Run
        With a machine; mm, and the distance in µm.

    Returns
    -------
    Figure
        One panel; its title says by how much the distance is enlarged.

    Raises
    ------
    InputError
        For anything but a Run with a machine, and where its path has not two linear axes.

    References
    ----------
    .. [1] docs/machines.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(radius=10)
    >>> run = sf.run(path, sf.Limits(feed=20, acceleration=200, jerk=5000), machine="xytheta")
    >>> sf.plot.contour(run).save("contour.svg")
    """
    expect("plot.contour(run)", (run, Run))
    served = _served(run, "contour")
    beside = served.deviation()
    if beside is None:
        raise InputError(f"plot.contour: {run.path.name} has no contour error: its path has one linear axis, or none")
    return contour_figure(beside, run.path.name, served.machine.name)


def _served(run: Run, what: str) -> Servo:
    if run.served is None or not len(run.served.response):
        raise InputError(f"plot.{what}: the run has no machine that followed; give run(..., machine=...) one")
    return run.served


def bode(tuned: TunedAxis, machine: str = "") -> Figure:
    """Draw gain and phase of an axis's loop over frequency before and after tuning, with its margins.

    Parameters
    ----------
    tuned : Tuning or AxisTuning
        What `sf.runs.tune` gives for an axis; dB and deg over Hz.
    machine : str, optional
        Its name, for the title.

    Returns
    -------
    Figure
        Panels of gain and phase of the open loop, and of gain of the closed loop.

    Raises
    ------
    InputError
        For anything else.

    References
    ----------
    .. [1] docs/tune.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> tuned = sf.runs.tune(sf.Machine.load("xytheta").axes["x"], "tyreus-luyben")
    >>> sf.plot.bode(tuned, "xytheta").title.splitlines()[0]
    'xytheta, axis x: tyreus-luyben'
    """
    expect("plot.bode(tuned)", (tuned, TunedAxis))
    return bode_figure(tuned, machine)


def program(what: CycleTime | Run) -> Figure:
    """Draw a program as a control runs it, or a run of it by its programmed feeds.

    Parameters
    ----------
    what : CycleTime or Run
        As a control runs it, by operation; or a run of a program with feeds, mm/min. Rapid moves are dashed.

    Returns
    -------
    Figure
        One panel.

    Raises
    ------
    InputError
        For anything but a CycleTime, or a Run of a program with feeds.

    References
    ----------
    .. [1] docs/cycle-time.md

    Examples
    --------
    >>> from pathlib import Path
    >>> import splinefeed as sf
    >>> _ = Path("part.nc").write_text("G21 G90 G1 X60 F600")
    >>> sf.plot.program(sf.cycle_time("part.nc", "hurco-04")).save("part.svg")
    """
    if isinstance(what, CycleTime):
        return program_figure(what)
    expect("plot.program(run)", (what, Run))
    if what.path.lines is None or what.path.feeds is None:
        raise InputError(f"plot.program: {what.path.name} is no path of a program; plot.path(run) draws it")
    return path_figure(what, colour="programmed feed")

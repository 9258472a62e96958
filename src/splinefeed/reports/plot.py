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
    """Draw the path coloured by feed, and below it feed and jerk over time with their limits, mm and s.

    Jerk is that of the axes where they have a limit of it, else that along the path. Raises InputError for anything but
    a Run. Source: `reports.motion_figures`, the panels of the report.
    Example: `sf.plot.overview(sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_jerk=20000))).save("part.svg")`
    """
    expect("plot.overview(run)", (run, Run))
    above = path_figure(run, colour="feed")
    _, feed, _, jerk = tip_panels(run)
    if np.any(np.isfinite(run.limits.of_axes("axis_jerk", run.axes))):
        jerk = axis_panels(run)[JERK]
    return replace(above, panels=(*above.panels, feed, jerk))


def path(run: Run | Path, colour: str = "feed") -> Figure:
    """Draw where the tool goes, mm (fig. 9 of the paper): of a run, or of a path that is not planned yet.

    colour  of a run "feed" (mm/s), "curvature" (1/mm) or "nearest limit" (%); a bare path is coloured by its curvature
    A path in space is drawn in perspective; a run of one axis, over time. Raises InputError for another colour, and for
    anything but a Run or a Path with two linear axes. Source: `reports.path_figures`.
    Example: `sf.plot.path(sf.shapes.butterfly())`
    """
    if colour not in COLOURS:
        raise InputError(f"plot.path: colour is {colour!r}; choose {', '.join(repr(each) for each in COLOURS)}")
    expect("plot.path(run)", (run, (Run, Path)))
    return path_figure(run, colour=colour) if isinstance(run, Run) else still_figure(run)


def law(law: TimeLaw, limits: Limits) -> Figure:
    """Draw s, feed, acceleration and jerk of a time law over time with their limits, mm and s (fig. 1 of the paper).

    Raises InputError for anything but a TimeLaw and Limits. Source: `reports.motion_figures`.
    Example: `sf.plot.law(run.law, run.limits)`
    """
    expect("plot.law(law, limits)", (law, TimeLaw), (limits, Limits))
    return Figure(law.strategy, tuple(law_panels(law, limits)))


def joints(run: Run) -> Figure:
    """Draw position, velocity, acceleration and jerk of each axis over time with its limits; mm and degrees.

    Raises InputError for anything but a Run. Source: `reports.motion_figures`.
    Example: `sf.plot.joints(sf.run(sf.shapes.butterfly()))`
    """
    expect("plot.joints(run)", (run, Run))
    return Figure(f"{theme.words(run.path.name)}: axes over time, {run.strategy}", tuple(axis_panels(run)))


def ripple(run: Run) -> Figure:
    """Draw the feed ripple of the setpoints over time, s, relative: |step / planned step - 1| from tick to tick.

    Raises InputError for anything but a Run. Source: docs/math/interpolators.md.
    Example: `sf.plot.ripple(sf.run(sf.shapes.butterfly()))`
    """
    expect("plot.ripple(run)", (run, Run))
    found = run.ripple
    marks: list[Mark] = [over_time(run, "ripple", name="feed ripple")]
    marks += [Level(sign * found.floor, "rounding alone" * (sign > 0), theme.GREEN, always=True) for sign in (1, -1)]
    panel = Panel(TIME, PlotAxis("feed ripple (relative)"), tuple(marks), note=f"at most {found.max:.2g}", height=220)
    return Figure(f"{theme.words(run.path.name)}: feed ripple, {run.kept.method}", (panel,))


def compare(traces: Iterable[MethodTrace], name: str = "methods") -> Figure:
    """Draw the feed ripple of methods over time, s, one panel each, relative, on one logarithmic scale.

    traces  what `sf.runs.compare` gives; name  that of the path, for the title
    Raises InputError for anything else, or for none. Source: `reports.motion_figures`.
    Example: `sf.plot.compare(sf.runs.compare(path, law, methods=["taylor-2", "arc-length"]))`
    """
    found = list(traces)
    if not found or not all(isinstance(each, MethodTrace) for each in found):
        raise InputError("plot.compare: expected what sf.runs.compare gives: one trace a method, at least one")
    return ripple_figure(found, name)


def errors(what: Run | Response) -> Figure:
    """Draw contour and following errors of the axes over time, s, in µm, rotary axes in deg (fig. 5 of the paper).

    what  a run with a machine, or the response of `sf.runs.follow`
    Raises InputError for anything else, and for a run without a machine. Source: `reports.servo_figures`.
    Example: `sf.plot.errors(sf.run(sf.shapes.butterfly(), machine="xytheta"))`
    """
    if isinstance(what, Response):
        return errors_figure({what.settings.get("method", "setpoints"): what})
    expect("plot.errors(run)", (what, Run))
    served = _served(what, "errors")
    return errors_figure({what.kept.method: served.response}, what.path.name, bands=served.bands)


def contour(run: Run) -> Figure:
    """Draw where the machine of a run is beside the true path, mm, the distance enlarged and as colour, µm.

    Raises InputError for anything but a Run with a machine. Source: `reports.path_figures`.
    Example: `sf.plot.contour(sf.run(sf.shapes.butterfly(), machine="xytheta"))`
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
    """Draw gain (dB) and phase (deg) of an axis's loop over frequency (Hz) before and after tuning, with its margins.

    tuned  what `sf.runs.tune` gives for an axis; machine  its name, for the title
    Raises InputError for anything else. Source: docs/tune.md.
    Example: `sf.plot.bode(sf.runs.tune(sf.Machine.load("xytheta").servo_axis("x"), "margins", period=1e-3))`
    """
    expect("plot.bode(tuned)", (tuned, TunedAxis))
    return bode_figure(tuned, machine)


def program(what: CycleTime | Run) -> Figure:
    """Draw a program: as a control runs it, by operation, or a run of it, by its programmed feeds, mm/min.

    Rapid moves are dashed. Raises InputError for anything but a CycleTime, or a Run of a program with feeds.
    Source: `reports.time_figures`.

    Example:
        >>> from pathlib import Path
        >>> import splinefeed as sf
        >>> _ = Path("part.nc").write_text("G21 G90 G1 X60 F600")
        >>> figure = sf.plot.program(sf.cycle_time("part.nc", "hurco-04"))
    """
    if isinstance(what, CycleTime):
        return program_figure(what)
    expect("plot.program(run)", (what, Run))
    if what.path.lines is None or what.path.feeds is None:
        raise InputError(f"plot.program: {what.path.name} is no path of a program; plot.path(run) draws it")
    return path_figure(what, colour="programmed feed")

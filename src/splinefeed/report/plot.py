"""Figures of a run in one line: each returns a `Figure`, which a notebook shows and `save` writes (SVG, PNG, PDF)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.errors import InputError, expect
from splinefeed.geometry.path import Path
from splinefeed.pipeline.result import Run
from splinefeed.records import Limits, TimeLaw
from splinefeed.report.figure import Figure
from splinefeed.report.motion_figures import JERK, axis_panels, law_panels, motion, tip_panels
from splinefeed.report.path_figures import binding, limits, path_figure, still_figure

__all__ = ["Figure", "binding", "law", "limits", "motion", "overview", "path"]


def __dir__() -> list[str]:
    return __all__


#: What the path of a run may be coloured by.
COLOURS = ("feed", "curvature", "nearest limit")


def overview(run: Run) -> Figure:
    """Draw the path coloured by feed, and below it feed and jerk over time with their limits, mm and s.

    Jerk is that of the axes where they have a limit of it, else that along the path. Raises InputError for anything but
    a Run. Source: `report.motion_figures`, the panels of the report.
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
    anything but a Run or a Path with two linear axes. Source: `report.path_figures`.
    Example: `sf.plot.path(sf.shapes.butterfly())`
    """
    if colour not in COLOURS:
        raise InputError(f"plot.path: colour is {colour!r}; choose {', '.join(repr(each) for each in COLOURS)}")
    expect("plot.path(run)", (run, (Run, Path)))
    return path_figure(run, colour=colour) if isinstance(run, Run) else still_figure(run)


def law(law: TimeLaw, limits: Limits) -> Figure:
    """Draw s, feed, acceleration and jerk of a time law over time with their limits, mm and s (fig. 1 of the paper).

    Raises InputError for anything but a TimeLaw and Limits. Source: `report.motion_figures`.
    Example: `sf.plot.law(run.law, run.limits)`
    """
    expect("plot.law(law, limits)", (law, TimeLaw), (limits, Limits))
    return Figure(law.strategy, tuple(law_panels(law, limits)))

"""Figures of a run in one line: each returns a `Figure`, which a notebook shows and `save` writes (SVG, PNG, PDF)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.pipeline.run import Run
from splinefeed.records import Limits, TimeLaw, unit_along
from splinefeed.report.figure import Figure
from splinefeed.report.motion_figures import JERK, axis_panels, law_panels, motion_figure
from splinefeed.report.path_figures import binding_figure, limits_figure, path_figure

__all__ = ["Figure", "binding", "law", "limits", "motion", "overview", "path"]


def overview(run: Run) -> Figure:
    """The path coloured by feed, and below it feed and jerk over time with their limits, mm and s.

    Jerk is that of the axes where they have a limit of it, else that along the path.
    Example: `sf.plot.overview(sf.run(sf.shapes.butterfly(), sf.Limits(feed=60, axis_jerk=20000))).save("part.svg")`
    """
    above = path_figure(run, colour="feed")
    _, feed, _, jerk = law_panels(run.law, run.limits, unit_along(run.path.axes), run.points.t)
    if np.any(np.isfinite(run.limits.of_axes("axis_jerk", run.axes))):
        jerk = axis_panels(run)[JERK]
    return replace(above, panels=(*above.panels, feed, jerk))


def path(run: Run, colour: str = "feed") -> Figure:
    """Where the tool goes, coloured by "feed", "curvature" or "nearest limit", mm (fig. 9 of the paper).

    A path in space is drawn in perspective; a path of one axis, over time.
    """
    return path_figure(run, colour=colour)


def motion(run: Run) -> Figure:
    """s, feed, acceleration and jerk along the path over time, and velocity, acceleration and jerk of each axis."""
    return motion_figure(run)


def limits(run: Run) -> Figure:
    """Feed under the maximum-velocity curve over time, and the share of each limit in use."""
    return limits_figure(run.use, run.points, run.path.name)


def binding(run: Run) -> Figure:
    """The path in the colour of the limit that binds."""
    return binding_figure(run)


def law(law: TimeLaw, limits: Limits) -> Figure:
    """s, feed, acceleration and jerk of a time law over time with their limits, mm and s (fig. 1 of the paper)."""
    return Figure(law.strategy, tuple(law_panels(law, limits)))

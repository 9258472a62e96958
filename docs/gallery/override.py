"""Feedrate override: 50 % after half a second, hold, back to 100 %; all limits of the axes are kept throughout."""

from __future__ import annotations

import numpy as np

import splinefeed as sf
from splinefeed.feed.course import LawCourse
from splinefeed.feed.override import Override
from splinefeed.feed.reserve import with_reserve
from splinefeed.report import theme
from splinefeed.report.figure import Axis, Figure, Line, Panel

LIMITS = sf.Limits(feed=60, axis_velocity=60, axis_acceleration=500, axis_jerk=20000)
PERIOD = 1e-3
#: The feedrate override, and from which second on.
OVERRIDE = ((0.0, 1.0), (0.5, 0.5), (1.5, 0.0), (2.2, 1.0))


def picture() -> Figure:
    """Run one plan under override and feed hold, and draw feed and rate over time."""
    path = sf.shapes.ellipse(a=30, b=8)
    law = sf.plan(path, with_reserve(LIMITS), strategy="time-optimal", period=PERIOD)
    t = np.arange(1, 20000) * PERIOD
    starts, rates = np.array(OVERRIDE).T
    ran = Override(LawCourse(path, law), LIMITS).run(rates[np.searchsorted(starts, t, side="right") - 1])
    t = t[: len(ran)]
    feed = np.diff(law(np.concatenate([[0.0], ran.tau]))) / PERIOD
    when, commanded = np.repeat([*starts, t[-1]], 2)[1:], np.repeat([*rates, rates[-1]], 2)[:-1]
    time = Axis("time (s)")
    rate = (
        Line(t, ran.rate, "rate", named=True),
        Line(when, commanded, "commanded", theme.FAINT, 1.0, named=True),
    )
    panels = (
        Panel(time, Axis("feed (mm/s)"), (Line(t, feed, "feed"),)),
        Panel(time, Axis("feedrate override"), rate),
    )
    return Figure("An ellipse under the feedrate override", panels)

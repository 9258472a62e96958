"""The operator's knob: 50 % after half a second, hold, back to 100 %; all limits of the axes are kept throughout."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import splinefeed as sf
from splinefeed.feed.course import LawCourse
from splinefeed.feed.override import Override
from splinefeed.feed.reserve import with_reserve
from splinefeed.report import theme

LIMITS = sf.Limits(feed=60, axis_velocity=60, axis_acceleration=500, axis_jerk=20000)
PERIOD = 1e-3
#: What is asked for, and from which second on.
KNOB = ((0.0, 1.0), (0.5, 0.5), (1.5, 0.0), (2.2, 1.0))


def picture() -> Figure:
    """Run one plan under the knob, and draw feed and rate over time."""
    path = sf.shapes.ellipse(a=30, b=8)
    law = sf.plan(path, with_reserve(LIMITS), strategy="time-optimal", period=PERIOD)
    t = np.arange(1, 20000) * PERIOD
    starts, rates = np.array(KNOB).T
    ran = Override(LawCourse(path, law), LIMITS).run(rates[np.searchsorted(starts, t, side="right") - 1])
    t = t[: len(ran)]
    feed = np.diff(law(np.concatenate([[0.0], ran.tau]))) / PERIOD
    figure = theme.new_figure(7.2, 4.4, "An ellipse under the knob", grid=(2, 1), gaps=(0.0, 0.55), titles=1)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(t, feed, color=theme.BLUE)
    above.set(title="feed, mm/s")
    below.plot(t, ran.rate, color=theme.BLUE, label="rate")
    below.step([*starts, t[-1]], [*rates, rates[-1]], where="post", color=theme.FAINT, lw=0.8, label="asked for")
    below.set(title="rate of the plan's clock", xlabel="t, s")
    below.legend(loc="center right")
    for axes in (above, below):
        theme.plain_ticks(axes.xaxis)
        theme.plain_ticks(axes.yaxis)
    return figure

"""Short lines into curves: two waves cut into lines of half a millimetre, and smoothed by 10 um."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import splinefeed as sf
from splinefeed.report import theme

LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


def picture() -> Figure:
    """Plan the lines and the curves under the same limits, and draw the feed along both."""
    x = np.arange(0.0, 40.1, 0.5)
    lines = sf.Path.polyline(np.column_stack([x, 5.0 * np.sin(0.1 * np.pi * x)]))
    smooth = lines.smoothed(0.01)
    figure = theme.new_figure(
        7.2, 4.6, "The same wave as lines, and as curves within 10 µm of them", grid=(2, 1), gaps=(0.0, 0.55), titles=1
    )
    above, below = figure.subplots(2, 1)
    for path, colour, label in ((lines, theme.VERMILION, "lines"), (smooth, theme.BLUE, "curves")):
        law = sf.plan(path, LIMITS, strategy="time-optimal", period=1e-3)
        points = sf.interpolate(path, law)
        above.plot(points.t, points.feed, color=colour, label=f"{label}: {law.duration:.2f} s")
        shown = np.abs(points.position[:, 0] - 5.0) < 1.3
        below.plot(*points.position[shown].T, color=colour, lw=1.0)
    above.set(title="feed, mm/s", xlabel="t, s")
    below.set(title="the first crest", xlabel="x, mm", ylabel="y, mm")
    above.legend(loc="upper right")
    for axes in (above, below):
        theme.plain_ticks(axes.xaxis)
        theme.plain_ticks(axes.yaxis)
    return figure

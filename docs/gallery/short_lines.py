"""What do short lines cost? Two waves cut into lines of half a millimetre, and smoothed within 10 µm."""

import numpy as np

import splinefeed as sf
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

LIMITS = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)

x = np.arange(0.0, 40.1, 0.5)
lines = sf.Path.polyline(np.column_stack([x, 5.0 * np.sin(0.1 * np.pi * x)]))
smooth = sf.smooth(lines, 0.01)
above: list[Line] = []
below: list[Line] = []
for path, colour, label in ((lines, theme.VERMILION, "lines"), (smooth, theme.BLUE, "curves")):
    law = sf.plan(path, LIMITS, strategy="time-optimal", period=1e-3)
    points = sf.interpolate(path, law)
    above.append(Line(points.t, points.feed, f"{label}: {law.duration:.2f} s", colour, named=True))
    crest = points.position[np.abs(points.position[:, 0] - 5.0) < 1.3]
    below.append(Line(crest[:, 0], crest[:, 1], label, colour, 1.0))
panels = (
    Panel(PlotAxis("time (s)"), PlotAxis("feed (mm/s)"), tuple(above)),
    Panel(PlotAxis("x (mm)"), PlotAxis("the first crest: y (mm)"), tuple(below), height=190),
)
figure = Figure("The same wave as lines, and as curves within 10 µm of them", panels)
assert len(lines.curves) == 80

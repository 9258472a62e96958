"""What do corners cost? Feed around a square: with stops, and rounded within 0.05 mm."""

import numpy as np

import splinefeed as sf
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

square = sf.Path.polyline([[0, 0], [30, 0], [30, 30], [0, 30], [0, 0]], axes=("x", "y"))
limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)

marks: list[Line] = []
seconds: list[float] = []
for number, (name, path) in enumerate(
    {"stops": square, "within 0.05 mm": sf.smooth(square, 0.05, corners="round")}.items()
):
    law = sf.plan(path, limits, period=1e-3)
    t = np.linspace(0.0, law.duration, 2000)
    marks.append(Line(law(t), law.feed(t), f"{name}: {law.duration:.3f} s", theme.colour(number), named=True))
    seconds.append(law.duration)

panel = Panel(PlotAxis("s (mm)"), PlotAxis("feed (mm/s)", low=0.0), tuple(marks), height=240)
figure = Figure("a square of 30 mm", (panel,))
assert seconds[1] < seconds[0]

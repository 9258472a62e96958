"""What do feed planners differ in? Feed along the butterfly by look-ahead and time-optimal."""

import numpy as np

import splinefeed as sf
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

path = sf.shapes.butterfly()
limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)

lines: list[Line] = []
seconds: dict[str, float] = {}
for number, strategy in enumerate(["look-ahead", "time-optimal"]):
    law = sf.plan(path, limits, period=1e-3, strategy=strategy)
    t = np.linspace(0.0, law.duration, 4000)
    seconds[strategy] = law.duration
    words = f"{strategy}: {law.duration:.3f} s"
    lines.append(Line(law(t), law.feed(t), words, theme.colour(number), named=True))

panel = Panel(PlotAxis("s (mm)"), PlotAxis("feed (mm/s)", low=0.0), tuple(lines), height=260)
figure = Figure("the butterfly by two strategies", (panel,))
assert seconds["time-optimal"] < seconds["look-ahead"]

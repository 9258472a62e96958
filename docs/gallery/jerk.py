"""How much jerk is enough? Time along the butterfly over the jerk limit of its axes."""

import numpy as np

import splinefeed as sf
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

path = sf.shapes.butterfly()
jerks = np.array([2e3, 5e3, 1e4, 2e4, 5e4, 1e5])  # mm/s^3
seconds = np.array(
    [
        sf.plan(path, sf.Limits(feed=60, axis_acceleration=500, axis_jerk=each), period=1e-3).duration
        for each in jerks.tolist()
    ]
)

panel = Panel(
    PlotAxis("axis jerk (mm/s³)", log=True), PlotAxis("time (s)"), (Line(jerks, seconds, "time"),), height=240
)
figure = Figure("the butterfly at 60 mm/s and 500 mm/s²", (panel,))
assert np.all(np.diff(seconds) < 0.0)

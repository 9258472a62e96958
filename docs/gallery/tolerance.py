"""What does a tolerance buy? The time of a program of short lines over the tolerance of its smoothing."""

import numpy as np

import splinefeed as sf
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

angle = np.linspace(0.0, 2.0 * np.pi, 61)
lines = sf.Path.polyline(np.column_stack([30 * np.cos(angle), 15 * np.sin(angle)]), axes=("x", "y"))
limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)

tolerances = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1])  # mm
seconds = np.array([sf.plan(sf.smooth(lines, each), limits, period=1e-3).duration for each in tolerances])
stops = sf.plan(lines, limits, period=1e-3).duration

panel = Panel(
    PlotAxis("tolerance (mm)", log=True), PlotAxis("time (s)"), (Line(tolerances, seconds, "smoothed"),), height=240
)
figure = Figure(f"60 lines: {stops:.3g} s with a stop at each joint", (panel,))
assert seconds[-1] < 0.5 * stops

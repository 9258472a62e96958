"""Of what order is a method? Feed ripple over the servo period, both logarithmic: the slope is the order."""

import numpy as np

import splinefeed as sf
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

path, limits = sf.shapes.ellipse(a=30, b=15), sf.Limits(feed=60, acceleration=500, jerk=20000)
periods = np.array([4e-3, 2e-3, 1e-3, 5e-4])

lines: list[Line] = []
slopes: dict[str, float] = {}
for number, method in enumerate(["taylor-1", "taylor-2", "runge-kutta-4"]):
    ripple: list[float] = []
    for period in periods.tolist():
        law = sf.plan(path, limits, period=period)
        points = sf.interpolate(path, law, method=method, period=period)
        ripple.append(sf.analysis.feed_ripple(points, path, law).max)
    slopes[method] = float(np.polyfit(np.log(periods), np.log(ripple), 1)[0])
    words = f"{method}: order {slopes[method]:.1f}"
    lines.append(Line(1e3 * periods, np.array(ripple), words, theme.colour(number), named=True))

panel = Panel(PlotAxis("servo period (ms)", log=True), PlotAxis("feed ripple", log=True), tuple(lines), height=260)
figure = Figure("feed ripple on an ellipse", (panel,))
assert abs(slopes["taylor-1"] - 1.0) < 0.3

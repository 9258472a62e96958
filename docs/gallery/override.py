"""How does the feed follow the override? 50 % after half a second, feed hold, back to 100 %; all limits hold."""

import numpy as np

import splinefeed as sf
from splinefeed.reports import theme
from splinefeed.reports.figure import Figure, Line, Panel, PlotAxis

LIMITS = sf.Limits(feed=60, axis_velocity=60, axis_acceleration=500, axis_jerk=20000)
PERIOD = 1e-3
#: The feedrate override, and from which second on.
OVERRIDE = ((0.0, 1.0), (0.5, 0.5), (1.5, 0.0), (2.2, 1.0))

path = sf.shapes.ellipse(a=30, b=8)
law = sf.plan(path, sf.planner.with_reserve(LIMITS), strategy="time-optimal", period=PERIOD)
t = np.linspace(PERIOD, 20000 * PERIOD, 20000)
starts, rates = np.array(OVERRIDE).T
ran = sf.planner.Override(sf.planner.LawSource(path, law), LIMITS).run(
    rates[np.searchsorted(starts, t, side="right") - 1]
)
t = t[: len(ran)]
s = law(np.concatenate([[0.0], ran.tau]))
feed = (s[1:] - s[:-1]) / PERIOD
steps = np.repeat(np.array([*OVERRIDE, (float(t[-1]), OVERRIDE[-1][1])]), 2, axis=0)
time = PlotAxis("time (s)")
rate = (
    Line(t, ran.rate, "rate", named=True),
    Line(steps[1:, 0], steps[:-1, 1], "commanded", theme.FAINT, 1.0, named=True),
)
panels = (
    Panel(time, PlotAxis("feed (mm/s)"), (Line(t, feed, "feed"),)),
    Panel(time, PlotAxis("feedrate override"), rate),
)
figure = Figure("An ellipse under the feedrate override", panels)
assert 0.0 <= ran.rate.min() < 1e-9

"""What is an S-curve? Seven phases along a straight line: s, feed, acceleration and jerk."""

import splinefeed as sf

path = sf.Path.polyline([[0.0, 0.0], [50.0, 0.0]], axes=("x", "y"))
limits = sf.Limits(feed=60, acceleration=500, jerk=5000)
law = sf.plan(path, limits, period=1e-3, strategy="seven-phase")

figure = sf.plot.law(law, limits)
assert abs(law.duration - (50 / 60 + 60 / 500 + 500 / 5000)) < 2e-3

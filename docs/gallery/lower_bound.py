"""How far is a plan from the best? Its duration beside a lower bound that no motion within the limits beats."""

import splinefeed as sf

path = sf.shapes.butterfly()
limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
law = sf.plan(path, limits, period=1e-3, bound=True)
bound = float(law.settings["lower_bound_s"])

figure = sf.plot.law(law, limits)
assert 0.0 <= law.duration / bound - 1.0 < 0.01

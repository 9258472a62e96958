"""Which limit holds my machine back? Feed under its bound, and the share of each limit over time."""

import splinefeed as sf

limits = sf.Limits(feed=60, axis_velocity=55, axis_acceleration=500, axis_jerk=20000)
run = sf.run(sf.shapes.butterfly(), limits)

figure = sf.plot.limits(run)
shares = [each.share for each in run.verdict.limits.values()]
assert 0.999 < max(shares) < 1.000001

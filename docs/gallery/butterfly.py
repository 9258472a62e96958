"""How fast can a curve be followed? The butterfly under limits of the axes alone, coloured by feed."""

import splinefeed as sf

limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)  # mm/s, mm/s^2, mm/s^3
run = sf.run(sf.shapes.butterfly(), limits)

figure = sf.plot.path(run)
assert abs(run.duration - 7.711) < 0.005

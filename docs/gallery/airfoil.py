"""What does a plan of an airfoil look like? The paper's NACA 0025: feed and jerk along it, with their limits."""

import splinefeed as sf

path = sf.shapes.naca("0025", perimeter=33)  # mm
run = sf.run(path, sf.Limits(feed=60, acceleration=50, jerk=2000))

figure = sf.plot.overview(run)
assert abs(run.length - 33.0) < 1e-6

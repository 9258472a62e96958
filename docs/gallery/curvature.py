"""Where does a drawing bend most? A path before it is planned, coloured by its curvature."""

import splinefeed as sf

path = sf.shapes.butterfly()

figure = sf.plot.path(path)
assert 0.0 < path.minimum_radius() < 2.0  # mm

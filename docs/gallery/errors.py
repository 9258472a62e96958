"""How far are the axes behind? Contour and following errors of a simulated table."""

import splinefeed as sf

run = sf.run(sf.shapes.naca("0025", perimeter=33), machine="xytheta")

figure = sf.plot.errors(run)
assert run.served is not None
assert run.served.response.contour_error is not None
assert run.served.response.contour_error.max() < 0.1  # mm

"""Where does the table leave the path? The paper's airfoil on its machine as we model it, enlarged."""

import splinefeed as sf

run = sf.run(sf.shapes.naca("0025", perimeter=33), machine="xytheta")

figure = sf.plot.contour(run)
assert "contour error at most" in figure.title

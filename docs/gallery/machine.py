"""What an axis does: the paper's airfoil on the paper's table as we model it, the deviation enlarged."""

from __future__ import annotations

import splinefeed as sf
from splinefeed.pipeline.follow import serve
from splinefeed.report.figure import Figure
from splinefeed.report.path_figures import contour_figure


def picture() -> Figure:
    """Follow the airfoil and draw where the table left it."""
    path = sf.shapes.naca("0025", perimeter=33)
    run = sf.run(path)
    beside = serve(path, run.law, run.points, sf.Machine.load("xytheta")).deviation()
    assert beside is not None  # it moves, so there is something to draw
    return contour_figure(beside, "NACA 0025, 33 mm", "xytheta")

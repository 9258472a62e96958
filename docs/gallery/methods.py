"""Feed ripple of four methods on the butterfly at 60 mm/s and 1 ms: Milne-Simpson rings, the anchored one is silent."""

from __future__ import annotations

import splinefeed as sf
from splinefeed.report.figure import Figure
from splinefeed.report.motion_figures import ripple_figure


def picture() -> Figure:
    """Run the methods on one motion and draw the error of each step."""
    path = sf.shapes.butterfly()
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), period=1e-3)
    names = ["taylor-2", "runge-kutta-4", "milne-simpson", "milne-simpson-anchored"]
    return ripple_figure(list(sf.compare(path, law, methods=names)), "butterfly")

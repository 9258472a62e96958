"""The butterfly, as fast as its axes allow: 500 mm/s^2 and 20000 mm/s^3 on each, coloured by feed."""

from __future__ import annotations

import splinefeed as sf
from splinefeed.report.figure import Figure
from splinefeed.report.path_figures import path_figure


def picture() -> Figure:
    """Plan under the limits of the axes, and draw where the tool is how fast."""
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    run = sf.run(sf.shapes.butterfly(), limits, strategy="look-ahead")
    return path_figure(run)

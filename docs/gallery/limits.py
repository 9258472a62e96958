"""Which limit binds: an ellipse under limits of feed, chord error and axes, and the share of each over time."""

from __future__ import annotations

import splinefeed as sf
from splinefeed.report.figure import Figure


def picture() -> Figure:
    """Plan an ellipse and draw feed, binding limit and shares."""
    limits = sf.Limits(feed=120, chord_error=2e-4, axis_acceleration=1500, axis_jerk=60000)
    run = sf.run(sf.shapes.ellipse(a=30, b=8), limits, strategy="time-optimal")
    return sf.plot.limits(run)

"""S.-S. Yeh, P.-L. Hsu, Computer-Aided Design 34(3), 2002, p. 229-237: the feed that keeps a chord error.

On a circle of radius rho the line from one setpoint to the next is off the arc by delta where the feed is

    V = (2 / T) sqrt(rho^2 - (rho - delta)^2)
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.analysis.measures import chord_errors

PERIOD = 1e-3


@pytest.mark.parametrize(("radius", "delta"), [(10.0, 1e-4), (2.0, 5e-5)])
@pytest.mark.parametrize("strategy", ["time-optimal", "look-ahead"])
def test_the_planned_feed_is_theirs_and_the_chord_error_is_kept(radius, delta, strategy):
    path = sf.shapes.circle(radius=radius)
    limits = sf.Limits(feed=1000, chord_error=delta, axis_acceleration=20000, axis_jerk=2e6)
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    points = sf.interpolate(path, law)
    theirs = 2.0 / PERIOD * math.sqrt(radius**2 - (radius - delta) ** 2)
    # a plan may stay a little below; by more than a rounding above it may not be
    assert 0.98 * theirs < points.feed.max() <= theirs * (1.0 + 1e-4)
    worst = np.max(chord_errors(points, path))
    assert 0.96 * delta < worst <= delta * (1.0 + 1e-6)

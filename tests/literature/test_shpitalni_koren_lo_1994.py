"""M. Shpitalni, Y. Koren, C. C. Lo, Computer-Aided Design 26(11), 1994, doi 10.1016/0010-4485(94)90097-3.

Their first-order interpolator lets the feed err by half of what |C'| changes in a step: V T |C'|' / (2 |C'|^2).
"""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf

pytestmark = pytest.mark.nojit


def test_the_feed_error_of_the_first_order_interpolator():
    path = motions.smooth()
    law = motions.constant(path, 60.0)
    points = sf.interpolate(path, law, period=1e-3, method="taylor-1")
    ripple = sf.analysis.feed_ripple(points, path, law)
    d = path.curves[0].derivatives(points.u, 2)
    size = np.linalg.norm(d[:, 1], axis=1)
    expected = 60.0 * 1e-3 * np.sum(d[:, 1] * d[:, 2], axis=1) / size**3 / 2
    k = np.arange(1, len(points) - 2)  # of the first and the last, short step something else is measured
    assert ripple.relative[k] == pytest.approx(expected[k], abs=0.01 * np.max(np.abs(expected)))
    assert np.max(np.abs(expected)) > 1e-3

"""R. T. Farouki, Y.-F. Tsai, Computer-Aided Design 33(2), 2001, doi 10.1016/S0010-4485(00)00085-3.

The quadratic term that earlier papers gave to the Taylor interpolator leaves out the acceleration: it is right for a
constant feed only, and at any other the interpolator is then no better than one of the first order.
"""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.analysis.measures import drift
from splinefeed.interpolation import registry
from splinefeed.interpolation.stepping import ACCELERATION
from splinefeed.kernels.jit import hot_kernel

pytestmark = pytest.mark.nojit

taylor_2 = registry.method("taylor-2").step


@hot_kernel
def without_acceleration(u, rate, law, period, curve, corrections, tolerance, memory):
    """Eq. (3) as older papers have it: u'' = -V^2 (C' . C'') / |C'|^4."""
    law[ACCELERATION] = 0.0
    return taylor_2(u, rate, law, period, curve, corrections, tolerance, memory)


@pytest.fixture(scope="module")
def older():
    name = "taylor-2-without-acceleration"
    sf.interpolation.register(name, without_acceleration)
    yield name
    registry._methods.pop(name)


def orders(path: sf.Path, law: sf.TimeLaw, method: str) -> np.ndarray:
    errors = [
        np.max(np.abs(drift(sf.interpolate(path, law, period=law.duration / ticks, method=method), law)))
        for ticks in (200, 400, 800)
    ]
    return np.log2(np.array(errors[:-1]) / errors[1:])


def test_at_a_constant_feed_the_older_term_is_right(older):
    path = motions.smooth()
    law = motions.constant(path, 60.0)
    assert orders(path, law, older) == pytest.approx(2.0, abs=0.1)
    ticks = {method: sf.interpolate(path, law, period=1e-3, method=method).u for method in (older, "taylor-2")}
    assert np.array_equal(ticks[older], ticks["taylor-2"])


def test_at_a_changing_feed_it_is_of_the_first_order_only(older):
    path = motions.smooth()
    law = motions.smooth_law(path)
    assert orders(path, law, older) == pytest.approx(1.0, abs=0.1)
    assert orders(path, law, "taylor-2") == pytest.approx(2.0, abs=0.1)
    assert orders(path, law, "taylor-3") == pytest.approx(3.0, abs=0.1)

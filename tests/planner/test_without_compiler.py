"""Small motions through every kernel of planning, so that these also run, and can be stepped through, as Python."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf

pytestmark = pytest.mark.nojit

PERIOD = 1e-3
#: Strong axes on a short way: few cells and few ticks.
LIMITS = sf.Limits(feed=20.0, axis_velocity=20.0, axis_acceleration=2000.0, axis_jerk=5e5, chord_error=1e-3)


def bend() -> sf.NurbsCurve:
    return sf.NurbsCurve.bezier(np.array([[0.0, 0.0], [0.3, 0.5], [0.8, -0.4], [1.0, 0.2]]))


def held(path: sf.Path, limits: sf.Limits, strategy: str) -> sf.TimeLaw:
    """A law by the strategy; its setpoints and itself hold every limit."""
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law, period=PERIOD), path, limits, law=law)
    assert verdict.ok, verdict
    return law


def test_time_optimal_over_one_bend():
    law = held(sf.Path([bend()]), LIMITS, "time-optimal")
    assert 0.05 < law.duration < 0.1


def test_look_ahead_over_bends_a_corner_and_a_jump_of_curvature():
    curves = [
        bend(),
        sf.NurbsCurve.bezier(np.array([[1.0, 0.2], [1.5, 0.9]])),
        sf.NurbsCurve.bezier(np.array([[1.5, 0.9], [2.5, 0.9]])),
        sf.NurbsCurve.bezier(np.array([[2.5, 0.9], [2.8, 0.9], [2.8, 1.2]])),
    ]
    path = sf.Path(curves)
    law = held(path, LIMITS, "look-ahead")
    assert law.length == pytest.approx(path.length, rel=1e-12)

"""Laws held against their limits at every tick, where rotary axes turn far within little of the path."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf

pytestmark = pytest.mark.nojit

PERIOD = 1e-3
LIMITS = sf.Limits(feed=50.0, axis_acceleration={"x": 500.0, "a": 20.0}, axis_jerk={"x": 2e4, "a": 1e3})


def turning(along: float) -> sf.Path:
    """100 mm along x, then `along` mm more while a turns by 1 rad."""
    points = [[0.0, 0.0], [100.0, 0.0], [100.0 + along, 1.0]]
    return sf.Path([sf.NurbsCurve.bezier(points[k : k + 2]) for k in range(2)], ("x", "a"))


def law_of(duration: float, length: float) -> sf.TimeLaw:
    """One rest-to-rest quintic, 10 x^3 - 15 x^4 + 6 x^5."""
    row = np.concatenate([np.zeros(3), length * np.array([10.0, -15.0, 6.0]) / duration ** np.arange(3, 6)])
    return sf.TimeLaw(breaks=np.array([0.0, duration]), coefficients=row[None], strategy="test", period=PERIOD)


def most(law: sf.TimeLaw, path: sf.Path, order: int) -> float:
    """Largest difference quotient of the last axis at ticks, with rest before and behind."""
    t = PERIOD * np.arange(-3, round(law.duration / PERIOD) + 4)
    points = path(law(t))
    return float(np.max(np.abs(np.diff(points[:, -1], order)))) / PERIOD**order


@pytest.mark.parametrize("strategy", ["look-ahead", "time-optimal"])
def test_both_planners_plan_it_however_little_the_tip_moves(strategy):
    for along in (1e-9, 1e-5):
        path = turning(along)
        law = sf.plan(path, LIMITS, strategy=strategy, period=PERIOD)
        verdict = sf.check(sf.interpolate(path, law), path, LIMITS, law=law)
        assert verdict.ok, verdict.problems

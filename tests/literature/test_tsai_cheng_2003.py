"""M.-C. Tsai, C.-W. Cheng, ASME Journal of Manufacturing Science and Engineering 125(3), 2003, p. 449-460.

Their predictor-corrector mends the parameter by the feed that the last pass had, until the feed is within a tolerance.
A correction multiplies what is left by 1 - (du/u) of chord and step, which is of the order of the period: each gains
one order. The predictor, the third difference set to 0, errs by the second power of the period in the feed.
"""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf

pytestmark = pytest.mark.nojit


def feed_errors(path: sf.Path, law: sf.TimeLaw, period: float, **settings) -> np.ndarray:
    """|chord| / (V T) - 1 of each step, without the starting ones and the last, short one."""
    points = sf.interpolate(path, law, period=period, method="tsai-cheng", **settings)
    chords = np.linalg.norm(np.diff(points.position, axis=0), axis=1)
    return (chords / np.diff(law(points.t)) - 1.0)[3:-1]


@pytest.mark.parametrize(("corrections", "order"), [(1, 3), (2, 4)])
def test_each_correction_gains_an_order(corrections, order):
    path = motions.smooth()
    law = motions.constant(path, 60.0)
    worst = [np.max(np.abs(feed_errors(path, law, period, corrections=corrections))) for period in (8e-3, 4e-3, 2e-3)]
    assert np.log2(np.array(worst[:-1]) / worst[1:]) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("make_law", [lambda path: motions.constant(path, 60.0), motions.smooth_law])
def test_the_feed_is_within_the_tolerance_asked_for_at_a_constant_and_at_a_changing_feed(make_law):
    """Their claim: whatever the tolerance, the feed commanded falls within it."""
    path = motions.smooth()
    law = make_law(path)
    shortest = np.min(np.diff(law(np.arange(0.0, law.duration, 5e-3))))
    parameter_speed = 1.0 / np.min(np.linalg.norm(path.curves[0].derivatives(np.linspace(0, 1, 501), 1)[:, 1], axis=1))
    for tolerance in (1e-3, 1e-6, 1e-9):
        # the method stops when u moves by less than its tolerance; du = dr V T / |C'| says how much that is
        step = tolerance * shortest * parameter_speed / 10.0
        errors = feed_errors(path, law, 5e-3, corrections=20, tolerance=step)
        assert np.max(np.abs(errors)) < tolerance

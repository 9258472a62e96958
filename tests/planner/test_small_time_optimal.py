"""Time-optimal plans on a few dozen cells, which plain Python can do: optimiser, repairs, ends in motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf

#: So long a servo period that a stretch has a few dozen cells.
PERIOD = 0.1
PATH = sf.Path([sf.NurbsCurve.bezier([[0, 0], [20, 0], [20, 20]], [1, 0.75, 1])])
EACH = {"acceleration": 300.0, "axis_acceleration": 250.0}


def differences(law: sf.TimeLaw, order: int) -> np.ndarray:
    """Derivatives of both axes by differences of the path itself at many instants, one-sided at none."""
    h = 1e-3
    t = np.linspace(2 * h, law.duration - 2 * h, 400)
    at = [PATH(law(t + k * h)) for k in (-2, -1, 0, 1, 2)]
    if order == 1:
        return (at[0] - 8 * at[1] + 8 * at[3] - at[4]) / (12 * h)
    return (-at[0] + 16 * at[1] - 30 * at[2] + 16 * at[3] - at[4]) / (12 * h * h)


def test_from_rest_to_rest_on_a_few_cells():
    limits = sf.Limits(feed=60, jerk=4000, axis_jerk=4000, **EACH)
    law = sf.plan(PATH, limits, strategy="time-optimal", period=PERIOD, bound=True)
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)
    assert law.settings["lower_bound_s"] < law.duration
    assert law(np.array([0.0, law.duration])) == pytest.approx([0.0, PATH.length], abs=1e-9)
    assert np.max(np.abs(differences(law, 2))) <= 250.0 * (1 + 1e-3)
    assert np.max(np.linalg.norm(differences(law, 1), axis=1)) <= 60.0 * (1 + 1e-6)
    # no slower than seven phases at the feed that every limit allows everywhere
    bend = float(1.0 / PATH.minimum_radius())
    slow = sf.Limits(feed=math.sqrt(125.0 / bend), acceleration=125.0, jerk=500.0)
    assert law.duration < sf.plan(PATH, slow, strategy="seven-phase").duration


def test_feeds_at_the_ends_that_the_path_is_too_short_for():
    limits = sf.Limits(feed=60, jerk=400, axis_jerk=400, start_feed=0.0, end_feed=59.0, **EACH)
    with pytest.raises(sf.errors.PlanError, match=r"end_feed is 59 mm/s; .* allow at most \d+\.\d+ mm/s there"):
        sf.plan(PATH, limits, strategy="time-optimal", period=PERIOD)

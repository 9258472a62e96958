"""The search for the highest feed within a contour tolerance: what it scales, finds, and says."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.errors import InputError, LimitsError
from splinefeed.runs import contour_feed
from splinefeed.runs.contour_feed import scaled, tune_feed

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)
TABLE = sf.Machine.load("xytheta")
OPTIONS = {"period": 1e-3, "strategy": "seven-phase"}


def test_scaled_limits_are_those_of_a_slower_clock() -> None:
    limits = sf.Limits(
        feed=60, acceleration=500, jerk=20000, deceleration=400, deceleration_jerk=9000, start_feed=10,
        chord_error=0.01, centripetal=300, axis_velocity=50, axis_acceleration={"x": 90.0}, axis_jerk=7000,
        axis_velocity_step=2,
        axis_minimum={"x": -5.0}, axis_maximum={"x": 5.0},
    )  # fmt: skip
    half = scaled(limits, 0.5).as_dict()
    assert half == {
        "feed": 30.0, "acceleration": 125.0, "jerk": 2500.0, "deceleration": 100.0, "deceleration_jerk": 1125.0,
        "start_feed": 5.0, "end_feed": 0.0, "chord_error": 0.01, "centripetal": 75.0, "axis_velocity": 25.0,
        "axis_acceleration.x": 22.5, "axis_jerk": 875.0, "axis_velocity_step": 1.0,
        "axis_minimum.x": -5.0, "axis_maximum.x": 5.0,
    }  # fmt: skip
    feed = scaled(limits, 0.5, "feed")
    assert (feed.feed, feed.start_feed, feed.acceleration, feed.axis_velocity) == (30.0, 5.0, 500.0, 50.0)
    path = motions.smooth()
    slow, fast = (sf.plan(path, scaled(LIMITS, k)) for k in (0.5, 1.0))
    assert slow.duration == pytest.approx(2.0 * fast.duration, rel=1e-9)
    with pytest.raises(InputError, match="vary is 'time'; choose one of all, feed"):
        scaled(limits, 0.5, "time")
    with pytest.raises(InputError, match="there is no feed along the path to vary"):
        scaled(sf.Limits(axis_velocity=5), 0.5, "feed")


def test_the_best_feed_keeps_the_tolerance_and_a_little_more_does_not() -> None:
    path = motions.smooth()
    tuning = tune_feed(path, LIMITS, TABLE, 0.02, **OPTIONS)
    best = tuning.best
    assert best is not None
    above = [trial for trial in tuning.trials if trial.scale > best.scale]
    assert all(trial.error > 0.02 for trial in above)
    assert min(trial.scale for trial in above) <= best.scale * contour_feed.CLOSE_ENOUGH
    # what is reported is what the setpoints do, simulated once more
    law = sf.plan(path, best.limits, period=1e-3)
    response = sf.runs.follow(sf.interpolate(path, law), TABLE, path=path)
    assert np.max(response.contour_error) == pytest.approx(best.error, rel=1e-12)
    assert best.error <= 0.02
    np.testing.assert_array_equal(tuning.served.response.position, response.position)
    assert [trial.scale for trial in tuning.trials] == sorted(trial.scale for trial in tuning.trials)
    assert tuning.numbers()["best"] == best.numbers()


def test_limits_that_keep_the_tolerance_stay() -> None:
    tuning = tune_feed(motions.smooth(), LIMITS, TABLE, 1.0, **OPTIONS)
    assert tuning.best.scale == 1.0
    assert tuning.best.limits == LIMITS
    assert len(tuning.trials) == contour_feed.GRID
    assert tuning.notes == ("the given limits keep the tolerance already; raise them to go faster",)


def test_a_tolerance_that_no_feed_keeps_is_said() -> None:
    tuning = tune_feed(motions.smooth(), LIMITS, TABLE, 1e-5, **OPTIONS)
    assert tuning.best is None
    assert tuning.served is None
    assert tuning.least.error == min(trial.error for trial in tuning.trials) > 1e-5
    with pytest.raises(LimitsError, match="contour tolerance is 0; it must be greater than 0"):
        tune_feed(motions.smooth(), LIMITS, TABLE, 0.0, **OPTIONS)


def test_the_error_need_not_fall_with_the_feed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction makes slow motions worse in places; a made-up machine is worse at 0.1 to 0.3 of the limits."""
    real = contour_feed.serve

    def serve(path, law, points, table):
        served = real(path, law, points, table)
        top = float(np.max(points.feed))
        served.tally.contour.value = 0.03 if 6.0 < top < 18.0 or top > 40.0 else 0.01
        return served

    monkeypatch.setattr(contour_feed, "serve", serve)
    tuning = tune_feed(motions.smooth(), LIMITS, TABLE, 0.02, **OPTIONS)
    assert tuning.best.feed == pytest.approx(40.0, rel=5e-3)
    assert tuning.notes[0].startswith("slower is not always better here: at top feeds of ")


def test_scales_that_would_take_for_ever_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contour_feed, "MOST_TICKS", 4000)
    tuning = tune_feed(motions.smooth(), LIMITS, TABLE, 1e-5, **OPTIONS)
    assert 1 < len(tuning.trials) < contour_feed.GRID
    assert tuning.notes[0].endswith("would take more than 4000 ticks and were not tried")

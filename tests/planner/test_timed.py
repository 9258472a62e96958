"""Wanted times: a motion is slowed down to them and keeps its limits, or is refused with what it takes at least."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.planner import timed
from splinefeed.planner.timed import times_at

POINTS = [[0, 0], [30, 40], [80, 35], [90, -20], [40, -30]]
LIMITS = sf.Limits(axis_velocity=300, axis_acceleration=3000, axis_jerk=60000)
PERIOD = 1e-3


def fastest():
    path = sf.Path.through(POINTS)
    law = sf.plan(path, LIMITS, period=PERIOD)
    return law.duration, times_at(law, path.curve_starts)


def ok(path, law):
    return sf.check(sf.interpolate(path, law), path, LIMITS, law=law).ok


@pytest.mark.parametrize("factor", [1.0, 1.7, 20.0])
def test_a_duration_slows_the_fastest_motion_down_as_a_whole(factor):
    least, at = fastest()
    wanted = round(least * factor, 3)
    path = sf.Path.through(POINTS, duration=wanted)
    law = sf.plan(path, LIMITS, period=PERIOD)
    assert law.duration == wanted
    np.testing.assert_allclose(times_at(law, path.curve_starts)[:-1], at[:-1] * wanted / least, rtol=1e-9)
    assert ok(path, law)


def test_each_waypoint_is_passed_within_a_period_of_its_time():
    _, at = fastest()
    wanted = np.concatenate([[0.0], np.cumsum(np.diff(at) * [1.3, 3.0, 1.4, 1.2])])
    path = sf.Path.through(POINTS, times=wanted)
    law = sf.plan(path, LIMITS, period=PERIOD)
    assert np.abs(times_at(law, path.curve_starts) - wanted).max() <= 1.5 * PERIOD
    assert ok(path, law)
    assert law.feed(times_at(law, path.curve_starts)[1:-1]).min() > 1.0  # it stops nowhere between


def test_where_any_time_will_do_the_motion_is_fast():
    least, at = fastest()
    wanted = [0, np.nan, np.round(at[2] * 2, 3), np.nan, np.nan]
    path = sf.Path.through(POINTS, times=wanted)
    law = sf.plan(path, LIMITS, period=PERIOD)
    passed = times_at(law, path.curve_starts)
    assert passed[2] == pytest.approx(wanted[2], abs=1.5 * PERIOD)
    assert law.duration - passed[2] < 1.5 * (least - at[2])
    assert ok(path, law)


def test_without_a_period():
    path = sf.Path.through(POINTS, duration=2.34567891)
    assert sf.plan(path, LIMITS).duration == 2.34567891


def test_a_curve_of_a_tool_has_times_too():
    arc = sf.Path([sf.NurbsCurve.bezier([[0, 0], [40, 0], [40, 40]])], times=[3.0])
    assert sf.plan(arc, LIMITS, period=PERIOD).duration == 3.0
    assert sf.plan(arc, sf.Limits(feed=60, acceleration=500, jerk=10000), period=PERIOD).duration == 3.0
    assert arc.reversed().times is None


def test_what_is_no_whole_period_is_rounded_and_said():
    law = sf.plan(sf.Path.through(POINTS, duration=3.0004), LIMITS, period=PERIOD)
    assert law.duration == 3.0
    assert law.notes == ("3.0004 s are no whole periods of 0.001 s: the motion takes 3",)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"duration": 0.2}, r"the motion takes at least 0\.\d+ s within its limits; 0\.2 s are wanted: give more"),
        (
            {"times": [0, 1, 1.1, 3, 5]},
            r"times: from waypoint 2 to 3 the motion takes 0\.\d+ s within its limits, where .*; 0\.1 s",
        ),
    ],
)
def test_what_is_too_short_is_refused_with_what_it_takes(how, message):
    with pytest.raises(sf.errors.PlanError, match=message):
        sf.plan(sf.Path.through(POINTS, **how), LIMITS, period=PERIOD)


def test_times_that_a_stretch_between_slow_ones_cannot_keep_are_refused_and_the_advice_is_enough():
    _, at = fastest()
    wanted = np.concatenate([[0.0], np.cumsum(np.diff(at) * [6.0, 1.0, 6.0, 1.0])])
    with pytest.raises(sf.errors.PlanError, match="s within its limits, where the others last as wanted; ") as found:
        sf.plan(sf.Path.through(POINTS, times=wanted), LIMITS, period=PERIOD)
    longer = float(str(found.value).split(" times as long")[0].split()[-1])
    assert 1.0 < longer < 3.0
    path = sf.Path.through(POINTS, times=longer * wanted)
    law = sf.plan(path, LIMITS, period=PERIOD)
    assert np.abs(times_at(law, path.curve_starts) - longer * wanted).max() <= 1.5 * PERIOD
    assert ok(path, law)


def test_times_of_more_setpoints_than_are_held_to_limits_are_refused_before_they_are_planned():
    with pytest.raises(sf.errors.PlanError, match=r"times: 1e\+60 s are more than 1e\+09 setpoints"):
        sf.plan(sf.Path.through(POINTS, duration=1e60), LIMITS, period=PERIOD)
    with pytest.raises(sf.errors.InputError, match=r"times are \[1e\+200\] s; they must be above 0, at most 1e\+100"):
        sf.Path.through(POINTS, duration=1e200)


def test_times_that_are_not_found_are_refused_with_the_waypoint_that_is_furthest_off(monkeypatch):
    """The shares converge where a stretch's time is mostly its own affair; where they do not, plans run out."""
    _, at = fastest()
    wanted = np.concatenate([[0.0], np.cumsum(np.diff(at) * [2.0, 20.0, 2.0, 20.0])])
    path = sf.Path.through(POINTS, times=wanted)
    monkeypatch.setattr(timed, "PLANS", 2)
    said = r"times: after 2 plans waypoint \d is passed at [\d.]+ s, and [\d.]+ s are wanted"
    with pytest.raises(sf.errors.PlanError, match=said) as found:
        sf.plan(path, LIMITS, period=PERIOD)
    assert "give them more time, or NaN where any will do" in str(found.value)
    monkeypatch.undo()
    assert ok(path, sf.plan(path, LIMITS, period=PERIOD))


def test_what_has_no_times_is_refused():
    path = sf.Path.through(POINTS, duration=3.0)
    with pytest.raises(
        sf.errors.LimitsError, match="times: a motion with wanted times begins at the start of its path"
    ):
        sf.plan(path, LIMITS, period=PERIOD, start=sf.planner.State(s=3.0))
    back = sf.Path.through([[0, 0], [50, 20], [0, 0]], duration=3.0)
    with pytest.raises(sf.errors.LimitsError, match="rests where it begins and ends and nowhere between"):
        sf.plan(back, LIMITS, period=PERIOD)
    with pytest.raises(sf.errors.InputError, match=r"times have shape \(1,\); expected one number for each of 4"):
        sf.Path(path.curves, times=[2.0])

"""What all strategies share: a feed a curve, time at rest, soft limits, and ends that contradict them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import LimitsError
from splinefeed.paths.each_curve import Marker
from splinefeed.planner.shared import with_dwells

STRATEGIES = ("seven-phase", "time-optimal")
LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)
PERIOD = 1e-3


def bends(feeds=None, markers=()) -> sf.Path:
    """A line, a bend and a line that join smoothly: 20 mm, a Bezier of 20 mm or so, 20 mm."""
    curves = [
        sf.NurbsCurve.bezier([[0, 0], [20, 0]]),
        sf.NurbsCurve.bezier([[20, 0], [26, 0], [32, 0], [38, 6], [38, 12], [38, 18]]),
        sf.NurbsCurve.bezier([[38, 18], [38, 38]]),
    ]
    return sf.Path(curves, feeds=feeds, markers=markers, name="bends")


def planned(path: sf.Path, limits: sf.Limits, strategy: str) -> tuple[sf.TimeLaw, sf.Setpoints]:
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    points = sf.interpolate(path, law)
    verdict = sf.check(points, path, limits, law=law)
    assert verdict.ok, verdict.problems
    return law, points


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_curve_keeps_its_feed(strategy):
    feeds = [np.inf, 12.5, 30.0]
    path = bends(feeds)
    law, _ = planned(path, LIMITS, strategy)
    t = np.linspace(0, law.duration, 20_001)
    s, v = law(t), law.feed(t)
    tops = []
    for k in range(3):
        inside = (s >= path.curve_starts[k]) & (s <= path.curve_starts[k + 1])
        tops.append(v[inside].max())
        assert tops[-1] <= min(60.0, feeds[k]) * (1 + 1e-9)
    if strategy == "time-optimal":
        assert tops == pytest.approx([60, 12.5, 30], rel=1e-3)
    else:
        assert tops == pytest.approx([12.5] * 3, rel=1e-3)  # brought to ticks by a stretch
        assert law.notes == (
            "1 stretch(es) run at the least feed of their curves throughout, as this strategy makes one profile a "
            f"stretch: the first from 0 to {path.length:g} mm at 12.5 mm/s",
        )


def test_seven_phase_keeps_a_feed_a_stretch_without_a_note_where_it_is_one():
    path = bends([40.0, 40.0, 15.0], [Marker(2, "M0")])
    law, _ = planned(path, LIMITS, "seven-phase")
    assert law.notes == ()
    stop = path.stops[0]
    t = np.linspace(0, law.duration, 20_001)
    assert law.feed(t)[law(t) < stop].max() == pytest.approx(40, rel=2e-3)
    assert law.feed(t)[law(t) > stop].max() == pytest.approx(15, rel=2e-3)


def test_the_check_finds_a_feed_that_only_the_path_forbids():
    fast = bends()
    law = sf.plan(fast, LIMITS, period=PERIOD)
    points = sf.interpolate(fast, law)
    feed = float(np.max(law.feed(np.linspace(0, law.duration, 1001))))
    path = bends([np.inf, feed * (1 - 1e-5), np.inf])
    for given in (law, None):
        verdict = sf.check(points, path, LIMITS, law=given)
        assert not verdict.ok
        result = verdict.limits["feed"]
        assert not result.holds
        assert result.limit == pytest.approx(path.feeds[1], rel=1e-12)
        assert path.curve_starts[1] - 1e-9 <= result.at_s <= path.curve_starts[2] + 1e-9
    assert sf.check(points, bends([np.inf, feed, np.inf]), LIMITS, law=law).ok


def test_a_tick_over_a_joint_may_take_what_both_feeds_allow_together():
    """A step of 0.4 periods at 10 and 0.6 at 20 mm/s is 0.016 mm: just that is allowed, and no more."""
    limits = sf.Limits(feed=50, start_feed=10, end_feed=20)
    for extra, ok in ((0.0, True), (4e-8, False)):
        s = np.concatenate([np.arange(101) * 0.01, 1.0 + 0.016 + extra + np.arange(100) * 0.02 * (1 - 1e-6)])
        line = [sf.NurbsCurve.bezier([[0.0], [1.004]]), sf.NurbsCurve.bezier([[1.004], s[-1:]])]
        path = sf.Path(line, ("x",), feeds=[10.0, 20.0])
        curve, u = path.locate(s)
        points = sf.Setpoints(
            t=np.arange(len(s)) * PERIOD, curve=curve, u=u, s=s, feed=np.zeros(len(s)), position=s[:, None],
            axes=("x",), period=PERIOD, method="test",
        )  # fmt: skip
        result = sf.check(points, path, limits).limits["feed"]
        assert result.holds == ok
        if not ok:
            assert result.at_s == pytest.approx(1.0)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_it_waits_whole_periods_where_the_path_says(strategy):
    markers = [Marker(0, "G4", 0.05), Marker(1, "G4", 0.0101), Marker(1, "G4", 0.2), Marker(3, "G4", 1e-3)]
    path = bends(markers=markers)
    law, points = planned(path, LIMITS, strategy)
    without, _ = planned(bends(markers=[Marker(1, "M0")]), LIMITS, strategy)
    waits = {0.0: 50, path.curve_starts[1]: 211, path.length: 1}
    assert law.duration == pytest.approx(without.duration + sum(waits.values()) * PERIOD, abs=1e-12)
    assert law.duration == round(law.duration / PERIOD) * PERIOD
    for s, ticks in waits.items():
        still = np.flatnonzero(np.abs(points.s - s) <= 1e-12)
        assert len(still) == ticks + 1  # from the tick of arrival to the tick of departure
        assert np.ptp(points.position[still], axis=0).max() <= 1e-12
        assert np.all(points.feed[still] <= 1e-6)
    assert sf.plan(path, LIMITS, strategy=strategy).duration == pytest.approx(
        sf.plan(bends(markers=[Marker(1, "M0")]), LIMITS, strategy=strategy).duration + 0.2611, abs=1e-9
    )


def test_the_check_still_finds_a_point_said_twice_on_a_path_that_waits():
    path = bends(markers=[Marker(1, "G4", 0.1)])
    _, points = planned(path, LIMITS, "seven-phase")
    position = points.position.copy()
    at = int(np.argmax(points.feed))
    position[at] = position[at - 1]
    import dataclasses

    nothing = np.full(len(points), np.nan)
    foreign = dataclasses.replace(points, position=position, u=nothing, s=nothing, feed=nothing)
    assert any("the same point twice" in problem for problem in sf.check(foreign, path, LIMITS).problems)


def test_soft_limits_by_the_curve_and_not_by_its_control_points():
    arch = sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, 20], [20, 0]])])  # its top is at y = 10
    for strategy in STRATEGIES:
        for top in (10.0, 30.0):
            fits = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_minimum={"y": 0.0}, axis_maximum={"y": top})
            planned(arch, fits, strategy)
        low = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_minimum={"y": -1.0}, axis_maximum={"y": 9.999})
        with pytest.raises(LimitsError) as caught:
            sf.plan(arch, low, strategy=strategy)
        assert str(caught.value) == (
            f"the path goes to y = 10 mm at s = {arch.length / 2:.6g} mm (curve 0); its travel allows "
            "at most 9.999 mm; move the path into it"
        )


def test_soft_limits_of_a_rotary_axis_are_said_in_degrees():
    turn = sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, math.pi]])], axes=("x", "a"))
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, axis_minimum={"a": -1.0}, axis_maximum={"a": math.pi / 2})
    with pytest.raises(
        LimitsError, match=r"goes to a = 180 deg at s = 10 mm \(curve 0\); its travel allows at most 90"
    ):
        sf.plan(turn, limits)
    with pytest.raises(LimitsError, match=r"travel\.z: the path has no axis 'z'"):
        sf.plan(turn, sf.Limits(feed=1, acceleration=1, jerk=1, axis_minimum={"z": 0}, axis_maximum={"z": 1}))


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_ends_that_contradict_the_path(strategy):
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000, start_feed=20)
    with pytest.raises(LimitsError, match="start_feed is 20 mm/s; the path allows at most 10 mm/s there"):
        sf.plan(bends([10.0, 60.0, 60.0]), limits, strategy=strategy)
    with pytest.raises(LimitsError, match=r"start_feed is 20 mm/s; the path waits 0\.5 s there, at rest"):
        sf.plan(bends(markers=[Marker(0, "G4", 0.5)]), limits, strategy=strategy)


def square(count: int = 4) -> sf.Path:
    """Sides of 20 mm at right angles."""
    corners = np.array([[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]])[: count + 1]
    return sf.Path([sf.NurbsCurve.bezier(corners[k : k + 2]) for k in range(count)], name="square")


def test_a_corner_is_passed_with_the_step_of_velocity_that_is_allowed():
    path = square()
    given = {"feed": 60, "axis_acceleration": 500, "axis_jerk": 20000}
    limits = sf.Limits(**given, axis_velocity_step={"x": 8.0, "y": 5.0})
    law, points = planned(path, limits, "time-optimal")
    assert law.duration < planned(path, sf.Limits(**given), "time-optimal")[0].duration - 0.05
    for s in path.stops:
        t = np.interp(s, law(law.breaks), law.breaks)
        assert law.feed(t) == pytest.approx(5.0, rel=5e-3)
        assert law.feed(t) <= 5.0 * (1 + 1e-9)
    for given_law in (law, None):
        verdict = sf.check(points, path, limits, law=given_law)
        assert verdict.ok
        assert 0.9 < verdict.limits["axis_velocity_step.y"].share <= 1 + 1e-9
        assert verdict.limits["axis_velocity_step.x"].share == pytest.approx(5 / 8, rel=0.1)


def test_the_check_finds_a_corner_that_is_passed_too_fast():
    path = square()
    given = {"feed": 60, "axis_acceleration": 500, "axis_jerk": 20000}
    law, points = planned(path, sf.Limits(**given, axis_velocity_step=5.0), "time-optimal")
    for given_law, step in ((law, 4.997), (None, 4.5)):  # setpoints alone tell the feed there by its mean over a step
        lower = sf.Limits(**given, axis_velocity_step={"x": 5.0, "y": step})
        verdict = sf.check(points, path, lower, law=given_law)
        failing = [name for name, result in verdict.limits.items() if not result.holds]
        assert failing == ["axis_velocity_step.y"]
        assert min(abs(verdict.limits[failing[0]].at_s - s) for s in path.stops) < 0.02
    stopping = sf.check(points, path, sf.Limits(**given), law=law)
    assert not stopping.ok
    assert not stopping.limits["axis_acceleration.x"].holds


def test_markers_cusps_and_tiny_steps_still_stop():
    path = square(2)
    given = {"feed": 60, "axis_acceleration": 500, "axis_jerk": 20000}
    asked = sf.Path(path.curves, markers=[Marker(1, "M0")])
    exact = planned(path, sf.Limits(**given), "time-optimal")[0].duration
    assert planned(asked, sf.Limits(**given, axis_velocity_step=5.0), "time-optimal")[0].duration == exact
    assert planned(path, sf.Limits(**given, axis_velocity_step=1e-6), "time-optimal")[0].duration == exact
    back = sf.Path([sf.NurbsCurve.bezier([[0, 0], [20, 0]]), sf.NurbsCurve.bezier([[20, 0], [5, 0]])])
    law, _ = planned(back, sf.Limits(**given, axis_velocity_step=5.0), "time-optimal")
    assert law.feed(np.interp(20, law(law.breaks), law.breaks)) == pytest.approx(0, abs=1e-6)


def test_a_deceleration_jerk_of_its_own():
    path = bends()
    given = {"feed": 60, "acceleration": 500, "jerk": 20000}
    both = planned(path, sf.Limits(**given), "time-optimal")[0].duration
    for down in (4000.0, 60000.0):
        limits = sf.Limits(**given, deceleration_jerk=down)
        law, _ = planned(path, limits, "time-optimal")
        best = sf.plan(path, limits, strategy="seven-phase", period=PERIOD).duration
        assert best - 2e-3 <= law.duration <= 1.01 * best + 2e-3
        assert (law.duration > both) == (down < 20000)


def test_a_piece_that_lasts_one_rounding_of_its_instant_is_gone_behind_a_dwell():
    """Two breaks that are neighbouring numbers at 0.2 s are the same one at 0.2 s and 100 s."""
    breaks = np.array([0.0, 0.2, np.nextafter(0.2, 1.0), 0.5])
    rows = np.array([[0.0, 0, 250.0, 0, 0, 0], [10.0, 100.0, 0, 0, 0, 0], [10.0, 100.0, 0, 0, 0, 0]])
    law = sf.TimeLaw(breaks=breaks, coefficients=rows, strategy="test", period=PERIOD)
    later = with_dwells(law, [(0.0, 100.0)], 40.0)
    assert later.breaks == pytest.approx([0.0, 100.0, 100.2, 100.5], rel=1e-15)
    assert later.coefficients.tolist() == [[0.0] * 6, rows[0].tolist(), rows[2].tolist()]
    kept = with_dwells(law, [(0.0, 0.001)], 40.0)
    assert len(kept.coefficients) >= 3

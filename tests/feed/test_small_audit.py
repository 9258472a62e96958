"""The audit of a motion and exact plans of straight stretches, in plain Python: against circles, chords and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.feed import audit
from splinefeed.feed.bounds import AxisLimits
from splinefeed.feed.law_pieces import Pieces
from splinefeed.feed.square import Setting

pytestmark = pytest.mark.nojit

PERIOD = 1e-2
NONE = np.zeros(0)


def steady(length: float, feed: float) -> Pieces:
    """One piece at one feed, mm/s."""
    return Pieces(np.array([0.0, length / feed]), np.array([[0.0, feed, 0, 0, 0, 0]]), np.zeros(1, dtype=bool), 0)


def setting(path: sf.Path, limits: sf.Limits, corners: np.ndarray = NONE) -> Setting:
    return Setting(limits, AxisLimits.of(limits, path.axes), PERIOD, corners, np.full(len(corners), 9.0), NONE)


def test_a_chord_on_a_circle_is_off_by_its_sagitta():
    """At v the chord is c = 2 r sin(v T / 2 r), and r - sqrt(r^2 - c^2 / 4) the most the circle is away from it."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [3, 0], [3, 3]], [1.0, math.sqrt(0.5), 1.0])])
    sagitta = 3.0 * (1.0 - math.cos(20.0 * PERIOD / 6.0))
    limits = sf.Limits(feed=20.0, acceleration=1e6, chord_error=0.8 * sagitta)
    over = audit.tick_excess(path, steady(path.length, 20.0), setting(path, limits), 0.0, (False, False))
    assert over == pytest.approx([audit.CHORD_MARGIN / 0.8], rel=1e-2)
    loose = setting(path, sf.Limits(feed=20.0, acceleration=1e6))
    assert audit.tick_excess(path, steady(path.length, 20.0), loose, 0.0, (False, False)).tolist() == [0.0]


def test_a_corner_in_passing_is_off_by_its_distance_from_the_chord_that_cuts_it():
    """A right angle cut by a chord with legs a and b from it: it is a b / sqrt(a^2 + b^2) away."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0]]), sf.NurbsCurve.bezier([[1, 0], [1, 1]])])
    limits = sf.Limits(feed=9.0, acceleration=1e6, chord_error=1e-3)
    seen = audit.tick_excess(path, steady(2.0, 9.0), setting(path, limits, np.array([1.0])), 0.003, (False, False))
    before = 9.0 * (0.003 + PERIOD * np.arange(25))
    a, b = 1.0 - before[before < 1.0][-1], before[before >= 1.0][0] - 1.0
    assert seen == pytest.approx([a * b / math.hypot(a, b) / 1e-3 * audit.CHORD_MARGIN], rel=1e-9)


def test_the_tip_of_a_bend_between_two_places_of_a_chord_is_found():
    """A right angle rounded off by 2 um: against the distances of 20001 places from the chord across it."""
    r = 2e-3
    path = sf.Path(
        [
            sf.NurbsCurve.bezier([[0, 0], [1 - r, 0]]),
            sf.NurbsCurve.bezier([[1 - r, 0], [1, 0], [1, r]], [1.0, math.sqrt(0.5), 1.0]),
            sf.NurbsCurve.bezier([[1, r], [1, 1]]),
        ]
    )
    limits = sf.Limits(feed=9.0, acceleration=1e6, chord_error=1e-2)
    for start in 0.87e-3 * np.arange(11):  # the bend at all kinds of places between two ticks
        seen = audit.tick_excess(path, steady(path.length, 9.0), setting(path, limits), start, (False, False))
        ticks = 9.0 * (start + PERIOD * np.arange(22))
        k = int(np.searchsorted(ticks, 0.5 * path.length))
        x, y = (path(np.linspace(ticks[k - 1], ticks[k], 20001)) - path(ticks[k - 1 : k])).T
        furthest = np.max(np.abs(x * y[-1] - y * x[-1])) / math.hypot(x[-1], y[-1])
        if furthest > audit.WORTH_A_LOOK * 1e-2:
            assert seen[0] * 1e-2 / audit.CHORD_MARGIN == pytest.approx(furthest, rel=1e-6)


def test_where_curvature_jumps_a_drive_sees_the_difference_of_its_setpoints():
    """From a line onto a circle of 2 mm at 10 mm/s: third differences of both axes over T^3, by sine and cosine."""
    path = sf.Path(
        [
            sf.NurbsCurve.bezier([[-2, 0], [0, 0]]),
            sf.NurbsCurve.bezier([[0, 0], [2, 0], [2, 2]], [1.0, math.sqrt(0.5), 1.0]),
        ]
    )
    s = np.arange(0.0, path.length, 10.0 * PERIOD)
    turn = np.clip(s - 2.0, 0.0, None) / 2.0
    points = np.column_stack([np.minimum(s, 2.0) - 2.0 + 2.0 * np.sin(turn), 2.0 - 2.0 * np.cos(turn)])
    near = (s[:-3] < 2.0 + 4 * 10.0 * PERIOD) & (s[3:] > 2.0 - 4 * 10.0 * PERIOD)
    jerk = np.max(np.abs(np.diff(points, 3, axis=0))[near]) / PERIOD**3
    push = np.max(np.abs(np.diff(points, 2, axis=0))) / PERIOD**2
    for share in (0.25, 4.0):
        limits = sf.Limits(feed=10.0, axis_acceleration=1e9, axis_jerk=jerk * share)
        over = audit.tick_excess(path, steady(path.length, 10.0), setting(path, limits), 0.0, (False, False))
        assert over == pytest.approx([share ** (-2.0 / 3.0)], rel=1e-6)
    limits = sf.Limits(feed=10.0, axis_acceleration=0.5 * push, axis_jerk=1e12)
    over = audit.tick_excess(path, steady(path.length, 10.0), setting(path, limits), 0.0, (False, False))
    assert over == pytest.approx([2.0], rel=2e-2)  # near the jump the circle's own acceleration is all there is


def turned(points: np.ndarray) -> list[list[sf.NurbsCurve]]:
    """The polyline through three points as two lines, and as one curve whose middle knot is no smoother than them."""
    return [
        [sf.NurbsCurve.bezier(points[:2]), sf.NurbsCurve.bezier(points[1:])],
        [sf.NurbsCurve(1, [0, 0, 1, 2, 2], points)],
    ]


def test_a_turn_too_small_for_a_corner_is_seen_by_ticks():
    """A turn of 5e-7 is none of the path's corners; with a tick on it the difference is turn v / T^2."""
    turn = 5e-7
    for curves in turned(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, turn]])):
        path = sf.Path(curves)
        assert len(path.corners) == 0
        assert path.jump_places.tolist() == [1.0]
        limits = sf.Limits(feed=10.0, axis_acceleration=1e9, axis_jerk=0.8 * turn * 10.0 / PERIOD**2)
        over = audit.tick_excess(path, steady(path.length, 10.0), setting(path, limits), 0.0, (False, False))
        assert over == pytest.approx([0.8 ** (-2.0 / 3.0)], rel=1e-6)


def test_what_starts_at_full_feed_from_rest_is_seen_as_a_jump():
    """At rest before the first tick the difference is that of a step of velocity: v / T."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [2, 1]])])
    limits = sf.Limits(feed=10.0, axis_acceleration=100.0, axis_jerk=1e9, chord_error=1.0)
    over = audit.tick_excess(path, steady(path.length, 10.0), setting(path, limits), 0.0, (True, False))
    first = path.evaluate(np.zeros(1, dtype=np.int64), path.locate(np.array([0.1]))[1], 0)[0, 0, 0]
    assert over == pytest.approx([first / PERIOD**2 / 100.0], rel=1e-2)


#: Along (0.6, 0.8) a limit of y is one of 1 / 0.8 of it along the path, the lowest.
LINE = sf.Path([sf.NurbsCurve.bezier([[0, 0], [6, 8]])])


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.0), (5.0, 0.0), (0.0, 15.0), (10.0, 20.0)])
def test_a_straight_time_optimal_plan_is_the_seven_phase_profile_between_its_feeds(start: float, end: float):
    limits = sf.Limits(feed=90.0, axis_velocity=20.0, axis_acceleration=200.0, axis_jerk=5e3)
    given = sf.Limits(**{**limits.as_dict(), "start_feed": start, "end_feed": end})
    law = sf.plan(LINE, given, strategy="time-optimal", period=None)
    up, jerk, top = 250.0, 6250.0, 25.0

    def rise(change: float) -> float:
        """Least time of a change of feed, s."""
        return change / up + up / jerk if change * jerk > up * up else 2.0 * math.sqrt(change / jerk)

    ramps = [(feed, rise(top - feed)) for feed in (start, end)]
    way = sum(0.5 * (top + feed) * time for feed, time in ramps)
    assert law.duration == pytest.approx(sum(time for _, time in ramps) + (10.0 - way) / top, rel=1e-9)
    assert law.settings["lower_bound_s"] == pytest.approx(law.duration, rel=1e-12)  # it is the best there is
    assert law.feed(np.array([0.0, law.duration])) == pytest.approx([start, end], rel=1e-12, abs=1e-9)
    ticked = sf.plan(LINE, given, strategy="time-optimal", period=PERIOD)
    assert 0.0 <= ticked.duration - law.duration < PERIOD + 1e-12
    assert ticked.duration / PERIOD == pytest.approx(round(ticked.duration / PERIOD), abs=1e-9)
    assert not ticked.notes
    verdict = sf.check(sf.interpolate(LINE, ticked), LINE, given, ticked)
    assert verdict.ok, verdict.problems


def test_one_feed_all_along_gives_way_until_its_end_is_on_a_tick():
    limits = sf.Limits(feed=30.0, acceleration=300.0, jerk=1e4, start_feed=30.0, end_feed=30.0)
    law = sf.plan(LINE, limits, strategy="time-optimal", period=PERIOD)
    # the way is long enough to slow down for a moment and to end on a tick
    assert law.duration == pytest.approx(34 * PERIOD, rel=1e-12)
    assert not law.notes
    assert sf.check(sf.interpolate(LINE, law), LINE, limits, law).ok


def test_a_stop_between_straight_lines_falls_on_a_tick():
    corner = sf.Path([sf.NurbsCurve.bezier([[0, 0], [2, 0]]), sf.NurbsCurve.bezier([[2, 0], [2, 3]])])
    limits = sf.Limits(feed=20.0, acceleration=200.0, jerk=5e3)
    law = sf.plan(corner, limits, strategy="time-optimal", period=PERIOD)
    t = PERIOD * np.arange(1, round(law.duration / PERIOD))
    stops = t[np.abs(np.asarray(law.feed(t))) < 1e-9]
    assert len(stops) == 1
    assert float(law(stops[0])) == pytest.approx(2.0, abs=1e-12)
    exact = [sf.plan(sf.Path([c]), limits, strategy="seven-phase", period=None).duration for c in corner.curves]
    assert round(law.duration / PERIOD) == sum(math.ceil(each / PERIOD) for each in exact)


def test_limits_that_leave_an_axis_free_are_refused_by_its_name():
    along_x = sf.Path([sf.NurbsCurve.bezier([[0, 0], [2, 0]])])
    with pytest.raises(sf.errors.LimitsError, match=r"only x moves, .* give axis_acceleration\.x, or"):
        sf.plan(along_x, sf.Limits(feed=20.0, axis_acceleration={"y": 100.0}), strategy="time-optimal", period=PERIOD)
    with pytest.raises(sf.errors.LimitsError, match="needs a limit on acceleration or jerk"):
        sf.plan(along_x, sf.Limits(feed=20.0), strategy="time-optimal", period=PERIOD)
    bend = sf.NurbsCurve.bezier([[2, 0], [4, 0], [4, 2]], [1.0, math.sqrt(0.5), 1.0])
    jumps = sf.Path([along_x.curves[0], bend])
    with pytest.raises(sf.errors.LimitsError, match=r"the curvature jumps at s = 2 mm, .* give the servo period"):
        sf.plan(
            jumps, sf.Limits(feed=20.0, axis_acceleration=500.0, axis_jerk=1e4), strategy="time-optimal", period=None
        )


@pytest.mark.parametrize("jerk", [(20.0, 50.0), (50.0, 20.0), (30.0, 30.0)])
def test_where_speeding_up_turns_into_slowing_down_both_limits_of_jerk_hold(jerk: tuple[float, float]):
    """v = 3 + 2 t - 25 t^2 + b t^3 on [0, 0.1] s: a = 0 near t = 0.04 s, where j = -50 + 6 b t."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [9, 0]])])
    limits = sf.Limits(feed=20.0, acceleration=1e6, jerk=jerk[0], deceleration_jerk=jerk[1])
    bends = (0.0, 10.0, -40.0)
    coefficients = np.array([[0.0, 3.0, 1.0, -25.0 / 3.0, b / 4.0, 0.0] for b in bends])
    pieces = Pieces(0.1 * np.arange(4), coefficients, np.zeros(3, dtype=bool), 0)
    found = audit._turn_excess(pieces, setting(path, limits))
    if jerk[0] == jerk[1]:
        assert found.tolist() == [0.0, 0.0, 0.0]
        return
    for b, over in zip(bends, found, strict=True):
        (t,) = (t for t in np.roots([3.0 * b, -50.0, 2.0]) if 0.0 < t < 0.1)
        assert over == pytest.approx((abs(-50.0 + 6.0 * b * t) / 20.0) ** (2.0 / 3.0), rel=1e-12)
    level = Pieces(pieces.times, coefficients * [1, 1, -1, 0, 0, 0], pieces.coarse, 0)  # it does not turn
    assert audit._turn_excess(level, setting(path, limits)).tolist() == [0.0, 0.0, 0.0]

"""The audit of a motion and exact plans of straight stretches, in plain Python: against circles, chords and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.planner.audit import _peaks

pytestmark = pytest.mark.nojit

PERIOD = 1e-2
NONE = np.zeros(0)


def turned(points: np.ndarray) -> list[list[sf.NurbsCurve]]:
    """The polyline through three points as two lines, and as one curve whose middle knot is no smoother than them."""
    return [
        [sf.NurbsCurve.bezier(points[:2]), sf.NurbsCurve.bezier(points[1:])],
        [sf.NurbsCurve(1, [0, 0, 1, 2, 2], points)],
    ]


#: Along (0.6, 0.8) a limit of y is one of 1 / 0.8 of it along the path, the lowest.
LINE = sf.Path([sf.NurbsCurve.bezier([[0, 0], [6, 8]])])


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.0), (5.0, 0.0), (0.0, 15.0), (10.0, 20.0)])
def test_a_straight_time_optimal_plan_takes_as_long_as_seven_phases_between_its_feeds(start: float, end: float):
    limits = sf.Limits(feed=90.0, axis_velocity=20.0, axis_acceleration=200.0, axis_jerk=5e3)
    given = sf.Limits(**{**limits.as_dict(), "start_feed": start, "end_feed": end})
    law = sf.plan(LINE, given, strategy="time-optimal", period=None, bound=True)
    up, jerk, top = 250.0, 6250.0, 25.0

    def rise(change: float) -> float:
        """Least time of a change of feed, s."""
        return change / up + up / jerk if change * jerk > up * up else 2.0 * math.sqrt(change / jerk)

    ramps = [(feed, rise(top - feed)) for feed in (start, end)]
    way = sum(0.5 * (top + feed) * time for feed, time in ramps)
    best = sum(time for _, time in ramps) + (10.0 - way) / top
    if start == end == 0.0:  # in closed form
        assert law.duration == pytest.approx(best, rel=1e-9)
        assert law.settings["lower_bound_s"] == pytest.approx(law.duration, rel=1e-12)  # it is the best there is
    else:
        assert best * (1.0 - 1e-9) <= law.duration <= best * 1.002
    assert law.feed(np.array([0.0, law.duration])) == pytest.approx([start, end], rel=1e-12, abs=1e-9)
    ticked = sf.plan(LINE, given, strategy="time-optimal", period=PERIOD)
    assert 0.0 <= ticked.duration - law.duration < PERIOD + 1e-12
    assert ticked.duration / PERIOD == pytest.approx(round(ticked.duration / PERIOD), abs=1e-9)
    assert not ticked.notes
    verdict = sf.check(sf.interpolate(LINE, ticked), LINE, given, law=ticked)
    assert verdict.ok, verdict.problems


def test_one_feed_all_along_is_slowed_down_between_its_ends_to_whole_periods():
    limits = sf.Limits(feed=30.0, acceleration=300.0, jerk=1e4, start_feed=30.0, end_feed=30.0)
    assert sf.plan(LINE, limits, strategy="time-optimal", period=None).duration == pytest.approx(1.0 / 3.0, rel=1e-12)
    law = sf.plan(LINE, limits, strategy="time-optimal", period=PERIOD)
    assert law.duration == pytest.approx(math.ceil(1.0 / 3.0 / PERIOD) * PERIOD, rel=1e-12)
    assert law.feed(np.array([0.0, law.duration])) == pytest.approx([30.0, 30.0], rel=1e-12)
    assert not law.notes
    assert sf.check(sf.interpolate(LINE, law), LINE, limits, law=law).ok


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


def test_what_no_limit_of_an_axis_bounds():
    """Where only an axis without a limit moves, the least limit of the others holds; without any it is refused."""
    along_x = sf.Path([sf.NurbsCurve.bezier([[0, 0], [2, 0]])])
    law = sf.plan(along_x, sf.Limits(feed=20.0, axis_acceleration={"y": 100.0}), strategy="time-optimal", period=PERIOD)
    assert law.duration == pytest.approx(2.0 * math.sqrt(2.0 / 100.0), abs=1e-2)
    with pytest.raises(sf.errors.LimitsError, match="needs a limit on acceleration or jerk"):
        sf.plan(along_x, sf.Limits(feed=20.0), strategy="time-optimal", period=PERIOD)
    bend = sf.NurbsCurve.bezier([[2, 0], [4, 0], [4, 2]], [1.0, math.sqrt(0.5), 1.0])
    jumps = sf.Path([along_x.curves[0], bend])
    with pytest.raises(sf.errors.LimitsError, match=r"the curvature jumps at s = 2 mm, .* give the servo period"):
        sf.plan(
            jumps, sf.Limits(feed=20.0, axis_acceleration=500.0, axis_jerk=1e4), strategy="time-optimal", period=None
        )


@pytest.mark.parametrize("top", [0.1, 0.3, 0.5, -0.4])
def test_a_peak_between_places_of_what_swings_is_found(top):
    """Of cos(0.35 (n - top)) at whole n: the largest is 1, which a parabola through three places misses."""
    n = np.arange(-8.0, 9.0)
    shares = np.cos(0.35 * (n - top))[None, :, None]
    peaks, unsure = _peaks(shares, np.zeros((len(n), 1)), 0)
    before, here, behind = shares[0, 7:10, 0]
    missed = 1.0 - here - (behind - before) ** 2 / (8.0 * (2.0 * here - before - behind))
    assert missed > 1e-5
    assert abs(1.0 - float(peaks[0, 0])) <= 0.1 * missed
    assert float(unsure[0, 0]) == pytest.approx(missed, rel=0.1)

"""Time-optimal motions small enough for plain Python, each held against what is known of it without the planner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.paths.each_curve import Marker

PERIOD = 2e-3
#: Feed, and velocity of each axis, mm/s; acceleration, mm/s^2, and jerk, mm/s^3, of each axis.
FEED, PUSH, TWIST = 20.0, 2000.0, 5e5
AXES = {"feed": FEED, "axis_velocity": FEED, "axis_acceleration": PUSH, "axis_jerk": TWIST}
#: A quarter of a circle of 1 mm, as a rational quadratic.
ARC = sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]], [1.0, np.sqrt(0.5), 1.0])


def held(path: sf.Path, limits: sf.Limits) -> sf.TimeLaw:
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD, bound=True)
    verdict = sf.check(sf.interpolate(path, law, period=PERIOD), path, limits, law=law)
    assert verdict.ok, verdict.problems
    assert law.settings["lower_bound_s"] <= law.duration
    return law


def test_a_quarter_circle_under_limits_along_the_path_is_one_seven_phase_profile():
    """v^2 / r stays below the centripetal limit at 10 mm/s, a circle has no other say: the closed form is the least."""
    limits = sf.Limits(
        feed=10.0, acceleration=800.0, jerk=1e5, deceleration=400.0, deceleration_jerk=5e4, centripetal=120.0
    )
    law = held(sf.Path([ARC]), limits)
    exact = sf.plan(sf.Path([ARC]), replace(limits, centripetal=None))
    # up to 10 mm/s takes V/A + A/J and half of it on the way, down likewise; the rest goes at 10 mm/s
    up, down = 10 / 800 + 800 / 1e5, 10 / 400 + 400 / 5e4
    by_hand = up + down + (0.5 * np.pi - 5 * (up + down)) / 10
    assert exact.duration == pytest.approx(by_hand, rel=1e-9)
    assert by_hand * (1 - 1e-9) <= law.duration < 1.02 * by_hand + PERIOD


def test_a_tighter_chord_error_slows_a_quarter_circle_down_to_its_feed():
    """chord^2 = 8 r e - 4 e^2 = (V T)^2, the chord error of a circle; e = 1e-5 mm: 4.47 mm/s at 2 ms."""
    feed = np.sqrt(8e-5 - 4e-10) / PERIOD
    law = held(sf.Path([ARC]), sf.Limits(**AXES, chord_error=1e-5))
    top = np.max(law.feed(np.linspace(0, law.duration, 2001)))
    assert 0.95 * feed < top < 1.01 * feed
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)


def test_feeds_at_both_ends_are_met_and_save_time():
    law = held(sf.Path([ARC]), sf.Limits(**AXES, start_feed=6.0, end_feed=8.0))
    rest = held(sf.Path([ARC]), sf.Limits(**AXES))
    assert law.feed([0.0, law.duration]) == pytest.approx([6.0, 8.0], rel=1e-9)
    assert 0.0 < rest.duration - law.duration < 2 * (8 / PUSH + PUSH / TWIST)
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)


def test_a_start_faster_than_the_first_bend_allows_is_refused():
    """On the circle of 1 mm an axis acceleration of 2000 mm/s^2 allows sqrt(2000) = 44.7 mm/s at most."""
    limits = sf.Limits(**{**AXES, "feed": 60.0, "axis_velocity": 60.0}, start_feed=59.0)
    with pytest.raises(sf.errors.PlanError, match=r"start_feed is 59 mm/s; .* allow at most 44\.\d+ mm/s there"):
        sf.plan(sf.Path([ARC]), limits, strategy="time-optimal", period=PERIOD)


def test_a_corner_within_the_step_of_velocity_is_passed_and_others_are_stops():
    """Both axes may jump by 2 mm/s: a bend of 0.2 rad can be passed at about 2 / 0.2 mm/s, one of pi/2 at 2 mm/s."""
    turn = np.array([np.cos(0.2), np.sin(0.2)])
    path = sf.Path(
        [sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [1, 0]]), sf.NurbsCurve(1, [0, 0, 1, 1], [[1, 0], 1 * turn + [1, 0]])]
    )
    stops = held(path, sf.Limits(**AXES))
    passes = held(path, sf.Limits(**AXES, axis_velocity_step=2.0))
    corner = float(passes.feed(np.interp(1.0, passes(t := np.linspace(0, passes.duration, 20001)), t)))
    assert float(np.min(stops.feed(np.linspace(0.3, 0.7, 4001) * stops.duration))) < 0.05
    assert corner <= 2.0 / np.sin(0.2) * (1 + 1e-6)
    assert corner > 0.9 * 2.0 / np.sin(0.2)
    assert passes.duration < stops.duration


def test_a_path_s_own_feeds_and_waits_stand_in_the_law():
    path = sf.Path(
        [ARC, sf.NurbsCurve(1, [0, 0, 1, 1], [[1, 1], [1, 2]])], feeds=[5.0, np.inf], markers=[Marker(1, "G4", 0.0105)]
    )
    law = held(path, sf.Limits(**AXES))
    t = np.linspace(0, law.duration, 20001)
    s, v = law(t), law.feed(t)
    assert np.max(v[s < ARC.length]) <= 5.0 * (1 + 1e-9) < np.max(v)
    # 10.5 ms are six periods of 2 ms, the first of them after the stop
    assert np.ptp(t[np.abs(s - ARC.length) < 1e-12]) == pytest.approx(6 * PERIOD, abs=2e-4)

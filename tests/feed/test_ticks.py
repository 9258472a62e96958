"""Laws held against their limits at every tick, where rotary axes turn far within little of the path."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import PlanError
from splinefeed.feed import ticks

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


def test_a_law_over_a_limit_gets_whole_periods_more_and_no_more_than_it_needs():
    """Slower by x, acceleration falls by x^2: a limit of 0.81 of what there is costs a ninth of the time."""
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 2.0]])], ("x", "a"))
    law = law_of(1.0, 10.0)
    limits = sf.Limits(feed=50.0, axis_acceleration={"x": 1e6, "a": 0.81 * most(law, path, 2)})
    slower = ticks.held_at_ticks(law, path, limits)
    assert most(slower, path, 2) <= 0.81 * most(law, path, 2)
    assert slower.duration == pytest.approx(1.0 / 0.9, abs=2 * PERIOD)
    assert slower.duration / PERIOD == pytest.approx(round(slower.duration / PERIOD), abs=1e-9)
    assert float(slower(slower.duration)) == pytest.approx(10.0, rel=1e-14)


def test_only_the_stretch_that_is_over_is_slowed_down_and_stops_stay_on_ticks():
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 2.0]])], ("x", "a"))
    one, two = law_of(0.5, 1.0), law_of(0.8, 9.0)
    second = two.coefficients + np.array([1.0, 0, 0, 0, 0, 0])
    rows = np.concatenate([one.coefficients, second])
    law = sf.TimeLaw(breaks=np.array([0.0, 0.5, 1.3]), coefficients=rows, strategy="test", period=PERIOD)
    push = 0.9 * most(law, path, 2)
    assert most(one, path, 2) < push
    slower = ticks.held_at_ticks(law, path, sf.Limits(feed=50.0, axis_acceleration={"x": 1e9, "a": push}))
    assert slower.breaks[1] == 0.5
    assert slower.duration - 0.5 == pytest.approx(0.8 / math.sqrt(0.9), abs=2 * PERIOD)
    assert most(slower, path, 2) <= push


def test_within_limits_and_without_those_of_rotary_axes_nothing_changes():
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 2.0]])], ("x", "a"))
    law = law_of(1.0, 10.0)
    assert ticks.held_at_ticks(law, path, sf.Limits(feed=50.0, axis_acceleration={"x": 1e-3})) is law
    assert ticks.held_at_ticks(law, path, sf.Limits(feed=50.0, axis_acceleration={"x": 1e9, "a": 1e9})) is law


@pytest.mark.parametrize("ends", [(True, False), (False, True), (True, True)])
def test_next_to_an_end_in_motion_nothing_is_slowed_down_and_what_is_over_a_limit_is_refused(ends: tuple[bool, bool]):
    """v = 3 + 30 t (1 - t) with both ends in motion, or 3 at one of them, to or from rest."""
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [8.0, 6.0]])], ("x", "a"))
    row = [0.0, 3.0, 15.0, -10.0, 0.0, 0.0] if all(ends) else [0.0, 3.0, 0.0, -1.0, 0.0, 0.0]
    law = sf.TimeLaw(breaks=np.array([0.0, 1.0]), coefficients=np.array([row]), strategy="test", period=PERIOD)
    if ends == (False, True):  # the same backwards: v = 3 - 3 (1 - t)^2
        law = replace(law, coefficients=np.array([[0.0, 0.0, 3.0, -1.0, 0.0, 0.0]]))
    feeds = {"start_feed": 3.0 * ends[0], "end_feed": 3.0 * ends[1]}
    share = float(np.ptp(path([0.0, 1.0])[:, 1]))  # of the way that is a's, rad/mm
    steepest = 30.0 if all(ends) else 6.0
    for allowed, held in ((1.001, True), (0.99, False)):
        given = {"x": 1e9, "a": allowed * steepest * share}
        limits = sf.Limits(feed=50.0, axis_acceleration=given, **feeds)
        if held:
            assert ticks.held_at_ticks(law, path, limits) is law
        else:
            with pytest.raises(PlanError, match="of a are over its limits, and next to an end in motion"):
                ticks.held_at_ticks(law, path, limits)


def test_what_the_rounding_of_arc_length_takes_is_refused():
    """1 rad in 1e-9 mm behind 100 mm: s is told apart by 1.4e-14 mm, a by 1.4e-5 rad, 6e4 rad/s^3 at 1 ms."""
    with pytest.raises(PlanError, match="rounding of arc length shows"):
        ticks.held_at_ticks(law_of(20.0, 100.0 + 1e-9), turning(1e-9), LIMITS)


def test_a_motion_of_months_is_refused_and_not_looked_at_for_hours():
    path = sf.Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 2.0]])], ("x", "a"))
    with pytest.raises(PlanError, match=r"would take 1e\+07 s, which is more than the 1e\+09 setpoints"):
        ticks.held_at_ticks(law_of(1e7, 10.0), path, LIMITS)
    slow = replace(LIMITS, feed=1e-6)
    with pytest.raises(PlanError, match="longer period"):
        sf.plan(path, slow, strategy="look-ahead", period=PERIOD)


@pytest.mark.parametrize("strategy", ["look-ahead", "time-optimal"])
def test_both_planners_refuse_it_and_plan_what_s_can_tell(strategy):
    with pytest.raises(PlanError, match="rounding of arc length shows"):
        sf.plan(turning(1e-9), LIMITS, strategy=strategy, period=PERIOD)
    path = turning(1e-5)
    law = sf.plan(path, LIMITS, strategy=strategy, period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, LIMITS, law=law)
    assert verdict.ok, verdict.problems

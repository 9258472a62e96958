"""Look-ahead over motions small enough for plain Python: every kind of limit and of end, held by the check."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.paths.each_curve import Marker
from splinefeed.planner import LookAhead

PERIOD = 2e-3
AXES = {"feed": 20.0, "axis_velocity": 20.0, "axis_acceleration": 2000.0, "axis_jerk": 5e5}
#: A quarter of a circle of 1 mm, and the line that goes on from it.
ARC = sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]], [1.0, np.sqrt(0.5), 1.0])
LINE = sf.NurbsCurve(1, [0, 0, 1, 1], [[1, 1], [1, 2]])


def held(path: sf.Path, limits: sf.Limits, period: float | None = PERIOD) -> sf.TimeLaw:
    law = sf.plan(path, limits, strategy="look-ahead", period=period)
    verdict = sf.check(sf.interpolate(path, law, period=PERIOD), path, limits, law=law)
    assert verdict.ok, verdict.problems
    assert law.length == pytest.approx(path.length, rel=1e-12)
    return law


def test_limits_along_the_path_alone_give_nearly_the_seven_phase_profile():
    limits = sf.Limits(
        feed=10.0, acceleration=800.0, jerk=1e5, deceleration=400.0, deceleration_jerk=5e4, centripetal=120.0
    )
    law = held(sf.Path([ARC]), limits)
    up, down = 10 / 800 + 800 / 1e5, 10 / 400 + 400 / 5e4
    by_hand = up + down + (0.5 * np.pi - 5 * (up + down)) / 10
    assert by_hand < law.duration < 1.12 * by_hand + PERIOD
    assert law.duration / PERIOD == pytest.approx(round(law.duration / PERIOD), abs=1e-9)


def test_without_a_period_a_smooth_curve_takes_a_period_less():
    with_ticks, without = (held(sf.Path([ARC]), sf.Limits(**AXES), period) for period in (PERIOD, None))
    assert 0.0 <= with_ticks.duration - without.duration < 0.05 * without.duration + PERIOD


def test_a_jump_of_curvature_under_axis_jerk_needs_a_period():
    with pytest.raises(sf.errors.LimitsError, match=r"curvature jumps at s = 1\.5708 mm.*give the servo period"):
        sf.plan(sf.Path([ARC, LINE]), sf.Limits(**AXES), strategy="look-ahead", period=None)


def test_feeds_at_both_ends_are_met():
    law = held(sf.Path([ARC]), sf.Limits(**AXES, start_feed=6.0, end_feed=8.0))
    assert law.feed([0.0, law.duration]) == pytest.approx([6.0, 8.0], rel=1e-9)


def test_a_start_faster_than_the_bend_allows_is_refused():
    limits = sf.Limits(**{**AXES, "feed": 60.0, "axis_velocity": 60.0}, start_feed=59.0)
    with pytest.raises(sf.errors.PlanError, match=r"start_feed is 59 mm/s; .* allow at most 44\.\d+ mm/s there"):
        sf.plan(sf.Path([ARC]), limits, strategy="look-ahead", period=PERIOD)


def test_a_corner_within_the_step_of_velocity_is_passed():
    """Both axes may jump by 2 mm/s: a corner of 0.2 rad is passed at 2 / sin(0.2) mm/s at most."""
    end = [1 + np.cos(0.2), np.sin(0.2)]
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], p) for p in ([[0, 0], [1, 0]], [[1, 0], end])])
    stops, passes = held(path, sf.Limits(**AXES)), held(path, sf.Limits(**AXES, axis_velocity_step=2.0))
    t = np.linspace(0, passes.duration, 20001)
    at = float(passes.feed(np.interp(1.0, passes(t), t)))
    assert 0.5 * 2.0 / np.sin(0.2) < at <= 2.0 / np.sin(0.2) * (1 + 1e-6)
    assert passes.duration < stops.duration


def test_chord_error_slows_the_bend_down_and_a_wait_is_kept():
    """chord^2 = 8 r e - 4 e^2 = (V T)^2 on the circle: 4.47 mm/s for 1e-5 mm at 2 ms."""
    path = sf.Path([ARC, LINE], markers=[Marker(1, "G4", 0.0105)])
    law = held(path, sf.Limits(**AXES, chord_error=1e-5))
    t = np.linspace(0, law.duration, 20001)
    s, v = law(t), law.feed(t)
    assert np.max(v[s < 1.5]) <= np.sqrt(8e-5) / PERIOD * 1.01
    assert np.max(v[s > 1.6]) > 8.0
    assert np.ptp(t[np.abs(s - ARC.length) < 1e-12]) == pytest.approx(6 * PERIOD, abs=3e-4)


def zigzag(count: int) -> list[sf.NurbsCurve]:
    """Arcs of half a millimetre, to one side and to the other, each tangent to the one before."""
    curves, at, heading = [], np.zeros(2), 0.0
    for k in range(count):
        turn = 0.8 if k % 2 else -0.8
        edge = 0.5 * np.tan(0.4)
        ahead = np.array([np.cos(heading), np.sin(heading)])
        heading += turn
        beyond = np.array([np.cos(heading), np.sin(heading)])
        points = np.array([at, at + edge * ahead, at + edge * (ahead + beyond)])
        curves.append(sf.NurbsCurve.bezier(points, [1.0, np.cos(0.4), 1.0]))
        at = points[-1]
    return curves


def test_a_stream_in_small_windows_ends_where_its_curves_end_and_keeps_every_limit():
    curves, limits = zigzag(30), sf.Limits(**AXES)
    path = sf.Path(curves)
    stream = LookAhead(limits, PERIOD, ("x", "y"), 32)
    blocks = [block for curve in curves for block in stream.push(sf.Path([curve]))]
    assert blocks, "nothing was final before the end"
    assert stream.work > 0.0
    assert stream.rows < 200
    blocks += stream.finish()
    starts = [path.curve_starts[block.curve] + block.offset for block in blocks]
    assert starts[0] == 0.0
    for start, block, after in zip(starts, blocks, [*starts[1:], path.length], strict=True):
        assert start + block.law.length == pytest.approx(after, abs=1e-9)
    assert [b.time + b.law.duration for b in blocks[:-1]] == pytest.approx([b.time for b in blocks[1:]])
    rows = [b.law.coefficients + np.eye(1, 6) * start for b, start in zip(blocks, starts, strict=True)]
    breaks = np.concatenate([[0.0], *(b.time + b.law.breaks[1:] for b in blocks)])
    law = sf.TimeLaw(breaks=breaks, coefficients=np.concatenate(rows), strategy="look-ahead", period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems
    assert stream.time == pytest.approx(law.duration)


def test_what_a_stream_refuses():
    with pytest.raises(sf.errors.InputError, match="a window of 2 cells; it must have at least"):
        LookAhead(sf.Limits(**AXES), PERIOD, ("x", "y"), 2)
    with pytest.raises(sf.errors.LimitsError, match="needs a limit on acceleration or jerk"):
        LookAhead(sf.Limits(feed=1.0), PERIOD, ("x", "y"))
    stream = LookAhead(sf.Limits(**AXES), PERIOD, ("x", "y"))
    assert stream.work == 0.0
    with pytest.raises(sf.errors.CurveError, match=r"the path has axes \('x', 'z'\); the motion has \('x', 'y'\)"):
        stream.push(sf.Path([LINE], ("x", "z")))
    stream.push(sf.Path([ARC]))
    with pytest.raises(sf.errors.CurveError, match="gap of 1 between curve 0 and curve 1"):
        stream.push(sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[1, 2], [1, 3]])]))
    assert list(motions.look_ahead([], sf.Limits(**AXES), PERIOD)) == []
    assert LookAhead(sf.Limits(**AXES), PERIOD, ("x", "y")).finish() == []


def test_a_straight_line_takes_the_seven_phase_profile_of_its_steepest_axis():
    """Along (0.6, 0.8) each limit of y is one of 1 / 0.8 of it along the path, the lowest of all: the closed form."""
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0, 0], [6, 8]])])
    law = held(path, sf.Limits(feed=90.0, axis_velocity=20.0, axis_acceleration=2000.0, axis_jerk=5e5), None)
    along = sf.Limits(feed=20.0 / 0.8, acceleration=2000.0 / 0.8, jerk=5e5 / 0.8)
    assert law.duration == pytest.approx(sf.plan(path, along, strategy="seven-phase", period=None).duration, rel=1e-9)
    assert np.max(np.abs(law.jerk(np.linspace(0, law.duration, 5001)))) == pytest.approx(5e5 / 0.8, rel=1e-6)

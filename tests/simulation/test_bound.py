"""Least margins of a loop, and what is drawn of a tuned one, against python-control's formulas by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from simulation.axes import PERIOD, velocity_axis
from splinefeed.errors import InputError
from splinefeed.machine import Friction
from splinefeed.simulation import curves
from splinefeed.simulation.curves import hunts, loop_curves, rest_swing, step_responses
from splinefeed.simulation.linear import MOST_SLACK, Bound, Margins, margins, quick_slacks, read_margins
from splinefeed.simulation.tuning import TunedAxis


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that are watched for less time: every tick counts in plain Python."""
    monkeypatch.setattr(curves, "LONGEST", 0.1)


def with_gain(axis, factor: float):
    c = axis.controller
    return replace(axis, controller=replace(c, kp=factor * c.kp, ki=factor * c.ki, kd=factor * c.kd))


def test_a_loop_1_over_s_times_1_plus_s_squared_has_the_margins_of_the_book():
    """L = 1 / (s (1 + s)^2): -180 deg and |L| = 1/2 at 1 rad/s; |L| = 1 at 0.682 rad/s, where 21.4 deg are left.

    1 rad/s is on the grid: a crossing there was once missed, as neither side of it has another sign.
    """
    omega = np.geomspace(1e-3, 1e3, 400_001)
    loop = 1.0 / (1j * omega * (1 + 1j * omega) ** 2)
    found, _ = read_margins(omega, loop, loop / (1.0 + loop), 0.0)
    assert (found.gain_margin, 2.0 * math.pi * found.gain_frequency) == pytest.approx((2.0, 1.0), rel=1e-4)
    assert found.gain_reduction == 0.0
    crossing = 0.6823278  # x (1 + x^2) = 1
    assert found.phase_margin == pytest.approx(90 - 2 * math.degrees(math.atan(crossing)), rel=1e-4)
    assert found.sensitivity == pytest.approx(1 / np.min(np.abs(1 + loop)), rel=1e-12)


def test_slack_is_the_logarithm_of_what_is_left():
    bound = Bound(gain_margin=2.0, phase_margin=40.0, sensitivity=2.0)

    def slacks(*numbers: float):
        names = ("gain_margin", "gain_reduction", "phase_margin", "sensitivity", "spectral_radius")
        others = dict.fromkeys(("gain_frequency", "phase_frequency", "delay_margin", "bandwidth"), 1.0)
        return bound.slacks(Margins(**dict(zip(names, numbers, strict=True)), **others))

    assert slacks(4.0, 0.25, 60.0, 1.0, 0.99) == pytest.approx([math.log(2), math.log(2), 0.5, math.log(2), 1.0])
    assert slacks(math.inf, 0.0, math.inf, 1.0, 0.0) == pytest.approx([MOST_SLACK] * 3 + [math.log(2), MOST_SLACK])
    assert slacks(2.0, 0.5, 40.0, 2.0, 1.0)[:4] == pytest.approx([0.0] * 4)
    assert slacks(2.0, 0.5, 40.0, 2.0, 1.0)[4] < 0.0
    assert bound.words == "gain margin at least 6.02 dB, phase margin at least 40 deg, sensitivity at most 2"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"gain_margin": 1.0}, "gain_margin is 1.0; it must lie between 1 and inf"),
        ({"sensitivity": math.inf}, "sensitivity is inf; it must lie between 1 and inf"),
        ({"phase_margin": 90.0}, "phase_margin is 90.0; it must lie between 0 and 90"),
    ],
)
def test_a_bound_that_is_none_is_refused(given, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        Bound(**given)


def test_the_quick_test_of_gains_agrees_with_the_exact_margins_and_twice_the_gain_margin_is_unstable():
    axis = velocity_axis()
    exact = margins(axis, PERIOD)
    test = quick_slacks(axis, PERIOD, Bound())
    assert float(np.min(test(axis))) == pytest.approx(np.min(Bound().slacks(exact)), abs=2e-3)
    over = with_gain(axis, 1.2 * exact.gain_margin)
    assert test(over)[4] < 0.0
    assert margins(over, PERIOD).spectral_radius > 1.0


def test_the_curves_of_a_loop_cross_where_its_margins_say():
    axis = velocity_axis()
    found, seen = loop_curves(axis, PERIOD), margins(axis, PERIOD)
    gain = np.abs(found.loop)
    crossing = np.exp(np.interp(0.0, -np.log(gain[:700]), np.log(found.frequency[:700])))
    at = np.interp(crossing, found.frequency, np.unwrap(np.angle(found.loop)))
    assert 180.0 + math.degrees(at) == pytest.approx(seen.phase_margin, abs=0.5)
    assert abs(found.closed[0]) == pytest.approx(1.0, abs=1e-2)


def test_a_step_settles_at_its_size_within_half_the_output():
    old, new = velocity_axis(), with_gain(velocity_axis(), 0.7)
    steps = step_responses(old, new, PERIOD)
    for step in steps:
        assert not step.stopped
        assert step.t[curves.BEFORE] == 0.0
        assert step.position[-1] == pytest.approx(step.size, rel=0.1)
    mantissa = steps[0].size / 10 ** math.floor(math.log10(steps[0].size) + 1e-9)
    assert round(mantissa, 9) in (1.0, 2.0, 5.0)


def test_a_tuned_axis_holds_both_loops():
    old, new = velocity_axis(), with_gain(velocity_axis(), 0.7)
    plain = TunedAxis(rule="by hand", old=old, axis=new, period=PERIOD)
    assert plain.before.gain_margin == pytest.approx(0.7 * plain.margins.gain_margin, rel=1e-6)
    # the loop is the controller, 0.7 times the old one
    ratio = loop_curves(new, PERIOD).loop / loop_curves(old, PERIOD).loop
    assert ratio == pytest.approx(np.full(len(ratio), 0.7), rel=1e-9)


def test_a_good_loop_comes_to_rest_and_one_that_runs_away_does_not(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(curves, "REST_SETTLING", 0.2)
    monkeypatch.setattr(curves, "REST_WATCHED", 0.05)
    quiet = velocity_axis(friction=Friction())
    assert not hunts(quiet, rest_swing(quiet, PERIOD))
    wild = with_gain(velocity_axis(error_limit=0.015), 20.0)
    assert rest_swing(wild, PERIOD) == math.inf
    assert hunts(wild, math.inf)
    blind = replace(quiet, scale=None, controller=replace(quiet.controller, feedback="encoder"))
    assert curves.seen_resolution(blind) == blind.encoder_resolution

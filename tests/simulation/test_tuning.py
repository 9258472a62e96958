"""Experiments and rules: identified against the model, the model against theory, and rules against their tables."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from splinefeed.errors import InputError
from splinefeed.kernels import servo
from splinefeed.machine import Machine
from splinefeed.pipeline.follow import follow
from splinefeed.simulation.experiments import driven, relay, swept_sine
from splinefeed.simulation.linear import margins, spectral_radius
from splinefeed.simulation.plant import parameters, plant, step_table
from splinefeed.simulation.tuning import RULES, model_response, sines, tune, ultimate_point

FREQUENCIES = np.array([3.0, 20.0, 70.0, 150.0, 400.0])


@pytest.mark.parametrize("delay", [0, 1])
def test_the_model_s_frequency_response_is_gain_lag_integrator_and_hold(delay: int) -> None:
    """Below a tenth of the servo rate: k / (s (1 + lag s)) times the hold (1 - e^-sT) / (s T), late by the delay."""
    f = np.array([1.0, 5.0, 20.0])
    s = 2j * math.pi * f
    expected = 25.0 / (s * (1.0 + 0.01 * s)) * (1.0 - np.exp(-s * PERIOD)) / (s * PERIOD) * np.exp(-s * PERIOD * delay)
    got = model_response(velocity_axis(delay=delay), PERIOD, f).value
    np.testing.assert_allclose(got, expected, rtol=1e-3)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_swept_sine_identifies_the_linear_plant(delay: int) -> None:
    axis = velocity_axis(delay=delay)
    found = swept_sine(axis, PERIOD, FREQUENCIES, 1.0, linear=True)
    np.testing.assert_allclose(found.frequency, FREQUENCIES, rtol=2e-3)
    np.testing.assert_allclose(found.value, model_response(axis, PERIOD, found.frequency).value, rtol=1e-9)


def test_a_swept_sine_on_the_full_machine_is_near_the_linear_one() -> None:
    axis = Machine.load("xytheta").axes["x"]
    found = swept_sine(axis, PERIOD, np.array([5.0, 20.0, 60.0]), 2.0)
    shares = np.abs(found.value / model_response(axis, PERIOD, found.frequency).value)
    assert np.all((shares > 0.9) & (shares < 1.05))


def test_the_ultimate_point_is_where_proportional_control_just_swings() -> None:
    axis = velocity_axis()
    point = ultimate_point(axis, PERIOD)

    def radius(kp: float) -> float:
        gains = replace(axis.controller, kp=kp, ki=0.0, kd=0.0)
        return spectral_radius(replace(axis, controller=gains), PERIOD) - 1.0

    assert point.gain == pytest.approx(brentq(radius, 10.0, 300.0), rel=1e-6)
    # phase: -90 - atan(w lag) - w T / 2 = -180 degrees, to the approximation of the hold by half a period of delay
    w = brentq(lambda w: math.pi / 2 - math.atan(w * 0.01) - w * PERIOD / 2, 1.0, 3000.0)
    assert point.period == pytest.approx(2.0 * math.pi / w, rel=0.02)


@pytest.mark.parametrize("experiment", ["relay", "sine"])
@pytest.mark.parametrize("name", ["x", "y", "theta"])
def test_experiments_on_the_full_table_find_the_model_s_ultimate_point(experiment: str, name: str) -> None:
    """Friction, counts, codes and ticks included: 1 % of gain and period, where the bare relay is 40 to 50 % off."""
    axis = Machine.load("xytheta").axes[name]
    point, seen = ultimate_point(axis, PERIOD), tune(axis, experiment=experiment).ultimate
    assert seen.gain == pytest.approx(point.gain, rel=0.01)
    assert seen.period == pytest.approx(point.period, rel=0.01)


@pytest.mark.parametrize(("lag", "delay", "period"), [(0.1, 1, 1e-3), (0.01, 0, 2.5e-4), (0.003, 0, 1e-3)])
def test_a_relay_finds_it_on_other_axes(lag: float, delay: int, period: float) -> None:
    axis = velocity_axis(lag=lag, delay=delay)
    point, seen = ultimate_point(axis, period), relay(axis, period, 4.0)
    assert seen.period == pytest.approx(point.period, rel=0.01)
    assert seen.gain == pytest.approx(point.gain, rel=0.02)
    assert seen.source == "relay of 4 V and sines around its oscillation"


def test_the_bare_swing_of_a_relay_would_not_do() -> None:
    """Why `relay` measures by sines: the swing on X of xytheta takes 12 ticks, and 4 d / (pi a) is 38 % too high."""
    axis = Machine.load("xytheta").axes["x"]
    table_of_steps, numbers = step_table(plant(axis), PERIOD), parameters(axis, PERIOD)
    _, measured, output, _ = driven(servo.RELAY, np.full(4000, 8.0), table_of_steps, numbers)
    assert np.all(output[-48:-12] == output[-36:])
    harmonic = 2.0 * abs(np.mean(measured[-12:] * np.exp(-2j * np.pi * np.arange(12) / 12)))
    point = ultimate_point(axis, PERIOD)
    assert point.period == pytest.approx(14.1 * PERIOD, rel=1e-2)
    assert 4.0 * 8.0 / (math.pi * harmonic) == pytest.approx(1.38 * point.gain, rel=0.01)


def test_friction_takes_its_share_of_a_sine_that_turns_the_axis_round() -> None:
    axis = Machine.load("xytheta").axes["x"]
    frequency = np.array([70.0])
    model = model_response(axis, PERIOD, swept_sine(axis, PERIOD, frequency, 1.0).frequency).value
    turning = swept_sine(axis, PERIOD, frequency, 1.0).value
    going = swept_sine(axis, PERIOD, frequency, 1.0, bias=1.0).value
    assert abs(turning[0] / model[0] - 1.0) > 0.1
    assert abs(going[0] / model[0] - 1.0) < 0.01


@pytest.mark.parametrize("name", ["x", "y", "theta"])
def test_a_swept_sine_of_the_full_table_is_the_model_within_two_percent(name: str) -> None:
    """Up to a tenth of the servo rate, where a swing still has counts enough."""
    axis = Machine.load("xytheta").axes[name]
    found = sines(axis, PERIOD, 2.0)
    model = model_response(axis, PERIOD, found.frequency).value
    low = found.frequency < 100.0
    assert np.count_nonzero(low) > 20
    np.testing.assert_allclose(found.value[low], model[low], rtol=0.02)


def test_the_rules_are_those_of_their_tables() -> None:
    axis = velocity_axis()
    assert tuple(RULES) == ("ziegler-nichols", "tyreus-luyben")
    found = tune(axis, "ziegler-nichols")
    ku, pu = found.ultimate.gain, found.ultimate.period
    assert found.controller.kp == pytest.approx(0.6 * ku)
    assert found.controller.ki == pytest.approx(1.2 * ku / pu)
    assert found.controller.kd == pytest.approx(0.075 * ku * pu)
    found = tune(axis, "tyreus-luyben")
    assert found.controller.kp == pytest.approx(ku / 2.2)
    assert found.controller.ki == pytest.approx(ku / 2.2 / (2.2 * pu))
    assert found.controller.kd == pytest.approx(ku / 2.2 * pu / 6.3)
    plain = tune(axis, "ziegler-nichols", kind="p").controller
    assert (plain.kp, plain.ki, plain.kd) == (pytest.approx(0.5 * ku), 0.0, 0.0)


@pytest.mark.parametrize("rule", ["ziegler-nichols", "tyreus-luyben"])
@pytest.mark.parametrize("experiment", ["model", "relay", "sine"])
def test_tuned_axes_are_stable_and_follow(rule: str, experiment: str) -> None:
    machine = Machine.load("xytheta")
    for name in machine.axes:
        found = tune(machine.axes[name], rule, experiment=experiment)
        assert found.margins.stable
        assert found.margins.bandwidth > 10.0
        wave = 0.5 * (1.0 - np.cos(2.0 * np.pi * 2.0 * np.arange(500) * PERIOD))
        response = follow(setpoints(wave, (name,)), table(found.axis))
        assert response.stopped is None
        assert np.max(np.abs(response.tracking_error)) < 0.05


def test_tuning_says_so_when_the_old_gains_are_unstable() -> None:
    text = tune(velocity_axis(lag=1e-3)).describe()
    assert "old gains unstable: a closed-loop pole has modulus 1.16" in text
    close = tune(velocity_axis(lag=7e-3, delay=1)).describe()
    assert "old gains stable, but close to unstable: gain margin 1." in close
    assert margins(velocity_axis(), PERIOD).verdict == "stable: gain margin 4.09, phase margin 60.8 deg"


@pytest.mark.nojit
def test_what_cannot_be_tuned_is_refused() -> None:
    axis = velocity_axis()
    cases = [
        (lambda: tune(axis, "zn"), "no tuning rule is called 'zn'; there are ziegler-nichols, tyreus-luyben, path"),
        (lambda: tune(axis, "tyreus-luyben", kind="p"), "rule 'tyreus-luyben' has no controller 'p'; it has pi, pid"),
        (lambda: tune(axis, experiment="guess"), "no experiment is called 'guess'; there are model, sine, relay"),
        (lambda: margins(axis, 0.0), "period is 0.0 s; it must be greater than 0 and finite"),
        (
            lambda: tune(force_axis()),
            "axis x: no ultimate gain: proportional control alone is unstable, or stable, at any gain; "
            "rules that start from it need a drive in velocity mode; rule 'path' does not",
        ),
        (lambda: relay(axis, PERIOD, 0.0), "the relay is 0.0 V; it must be greater than 0 and finite"),
        (
            lambda: swept_sine(axis, PERIOD, np.array([600.0]), 1.0),
            "frequencies must lie above 0 and below 500 Hz, half the servo rate",
        ),
        (
            lambda: swept_sine(axis, PERIOD, np.array([5.0]), math.nan),
            "amplitude is nan V; it must be greater than 0 and finite",
        ),
        (
            lambda: swept_sine(axis, PERIOD, np.array([5.0]), 6.0, bias=5.0),
            "amplitude and bias are 6 and 5 V; together they must lie within the 10 V of the output",
        ),
    ]
    for call, message in cases:
        with pytest.raises(InputError) as caught:
            call()
        assert str(caught.value) == message

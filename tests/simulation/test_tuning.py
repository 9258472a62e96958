"""Rules: the model that they start from against theory, and rules against their tables."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from splinefeed.errors import InputError
from splinefeed.machine import Machine
from splinefeed.runs.following import follow
from splinefeed.simulation.linear import discrete_plant, margins, spectral_radius
from splinefeed.simulation.tuning import RULES, tune, ultimate_point


@pytest.mark.parametrize("delay", [0, 1])
def test_the_model_s_frequency_response_is_gain_lag_integrator_and_hold(delay: int) -> None:
    """Below a tenth of the servo rate: k / (s (1 + lag s)) times the hold (1 - e^-sT) / (s T), late by the delay."""
    f = np.array([1.0, 5.0, 20.0])
    s = 2j * math.pi * f
    expected = 25.0 / (s * (1.0 + 0.01 * s)) * (1.0 - np.exp(-s * PERIOD)) / (s * PERIOD) * np.exp(-s * PERIOD * delay)
    got = discrete_plant(velocity_axis(delay=delay), PERIOD).response(2.0 * math.pi * f)
    np.testing.assert_allclose(got, expected, rtol=1e-3)


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
def test_tuned_axes_are_stable_and_follow(rule: str) -> None:
    machine = Machine.load("xytheta")
    for name in machine.axes:
        found = tune(machine.axes[name], rule)
        assert found.margins.stable
        assert found.margins.bandwidth > 10.0
        wave = 0.5 * (1.0 - np.cos(2.0 * np.pi * 2.0 * np.arange(500) * PERIOD))
        response = follow(setpoints(wave, (name,)), table(found.axis))
        assert response.stopped is None
        assert np.max(np.abs(response.tracking_error)) < 0.05


def test_tuning_says_so_when_the_old_gains_are_unstable() -> None:
    text = tune(velocity_axis(lag=1e-3), "ziegler-nichols").describe()
    assert "old gains unstable: a closed-loop pole has modulus 1.16" in text
    close = tune(velocity_axis(lag=7e-3, delay=1), "ziegler-nichols").describe()
    assert "old gains stable, but close to unstable: gain margin 1." in close
    assert margins(velocity_axis(), PERIOD).verdict == "stable: gain margin 4.09, phase margin 60.8 deg"


@pytest.mark.nojit
def test_what_cannot_be_tuned_is_refused() -> None:
    axis = velocity_axis()
    cases = [
        (
            lambda: tune(axis, "zn"),
            "no tuning rule is called 'zn'; there are margins, ziegler-nichols, tyreus-luyben, path",
        ),
        (lambda: tune(axis, "tyreus-luyben", kind="p"), "rule 'tyreus-luyben' has no controller 'p'; it has pi, pid"),
        (lambda: margins(axis, 0.0), "period is 0.0 s; it must be greater than 0 and finite"),
        (
            lambda: tune(force_axis(), "ziegler-nichols"),
            "axis x: no ultimate gain: proportional control alone is unstable, or stable, at any gain; "
            "rules that start from it need a drive in velocity mode; rules 'margins' and 'path' do not",
        ),
    ]
    for call, message in cases:
        with pytest.raises(InputError) as caught:
            call()
        assert str(caught.value) == message

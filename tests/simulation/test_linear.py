"""The linear loop against SciPy, and what the paper's gains do on a plain drive."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import signal

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from splinefeed.machine import Friction, ServoAxis
from splinefeed.runs.following import follow
from splinefeed.simulation.linear import closed_loop, controller_response, discrete_plant, margins, spectral_radius

TIME = np.arange(700) * PERIOD
COMMAND = 10.0 * (1.0 - np.cos(2.0 * np.pi * 3.0 * TIME)) + 0.5 * (TIME > 0.3)

PID = {"kp": 22.3833, "ki": 266.8899, "kd": 0.1862}


def loop_response(axis, period, omega):
    """L = H G, the loop opened at the controller's output."""
    return controller_response(axis.controller, period, omega)[1] * discrete_plant(axis, period).response(omega)


def drive_plant(lag: float = 0.01, gain: float = 25.0) -> Any:
    """25 mm/s a volt with a first-order lag, sampled by SciPy: the numerator and denominator of x / u."""
    numerator, denominator, _ = signal.cont2discrete(([gain], [lag, 1.0, 0.0]), PERIOD, method="zoh")
    return np.atleast_1d(numerator.squeeze()), denominator


def polynomial_controller(filter_time: float, kp: float, ki: float, kd: float) -> Any:
    """Numerator and denominator in z of K_p + K_i T z / (z - 1) + K_d (z - 1) / ((T_f + T) z - T_f)."""
    slope = np.array([filter_time + PERIOD, -filter_time])
    one = np.array([1.0, -1.0])
    numerator = kp * np.polymul(one, slope) + ki * PERIOD * np.polymul([1.0, 0.0], slope) + kd * np.polymul(one, one)
    return numerator, np.polymul(one, slope)


@pytest.mark.parametrize("delay", [0, 1])
@pytest.mark.parametrize("filter_time", [0.0, 2e-3])
def test_a_linear_loop_is_that_of_scipy(delay: int, filter_time: float) -> None:
    axis = velocity_axis(lag=0.012, delay=delay, filter=filter_time, error_limit=1e9)
    plant_numerator, plant_denominator = drive_plant(0.012)
    numerator, denominator = polynomial_controller(filter_time, **PID)
    forward = np.polymul(plant_numerator, numerator)
    whole = np.polymul(np.polymul(plant_denominator, denominator), [1.0] + [0.0] * delay)
    closed = signal.tf2ss(forward, np.polyadd(whole, forward))
    _, expected, _ = signal.dlsim((*closed, PERIOD), COMMAND - COMMAND[0])
    response = follow(setpoints(COMMAND), table(axis), linear=True)
    assert response.stopped is None
    # a transfer function of degree 5 to 6 in z carries its poles to about 1e-10 only
    np.testing.assert_allclose(response.position[:, 0], COMMAND[0] + expected[:, 0], rtol=0, atol=2e-8)


def by_hand(A: Any, B: Any, seen: int, axis: ServoAxis, command: Any) -> Any:
    """The loop run tick by tick in plain Python over the plant as SciPy samples it; the position of state `seen`."""
    phi, gamma, *_ = signal.cont2discrete((A, B, np.eye(len(A)), np.zeros((len(A), 1))), PERIOD, method="zoh")
    c = axis.controller
    z = np.zeros(len(A))
    integral = slope = last_speed = pending = 0.0
    cascade = c.kind == "p-pi"
    last = 0.0 if cascade else command[0]
    last_reference = command[0]
    out = []
    for reference in command:
        measured = z[seen]
        out.append(measured)
        speed = (reference - last_reference) / PERIOD
        forward = c.acceleration_feed_forward * (speed - last_speed) / PERIOD
        last_reference, last_speed = reference, speed
        source = measured if cascade else reference - measured
        slope = (c.filter * slope + (source - last)) / (c.filter + PERIOD)
        last = source
        if cascade:
            wanted = c.position_gain * (reference - measured) - slope
            wanted += c.velocity_feed_forward / c.velocity_kp * speed
            integral += c.velocity_ki * PERIOD * wanted
            volts = c.velocity_kp * wanted + integral + forward
        else:
            integral += c.ki * PERIOD * source
            volts = c.kp * source + integral + c.kd * slope + c.velocity_feed_forward * speed + forward
        applied, pending = (pending, volts) if c.delay else (volts, volts)
        z = phi @ z + gamma[:, 0] * applied
    return np.array(out)


def two_masses() -> tuple[Any, Any]:
    """The linear motor of `force_axis` with a spring of 4000 N/mm and a damper: x_m, v_m, f, x_l, v_l."""
    m, load, k, d, b, lag = 0.002, 0.018, 4000.0, 0.3, 0.02, 3e-4
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k / m, -d / m, 1.0 / m, k / m, d / m],
            [0.0, 0.0, -1.0 / lag, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [k / load, d / load, 0.0, -k / load, -(d + b) / load],
        ]
    )
    return A, np.array([[0.0], [0.0], [60.0 / lag], [0.0], [0.0]])


SMOOTH = 5.0 * (1.0 - np.cos(2.0 * np.pi * 3.0 * TIME))


@pytest.mark.parametrize("delay", [0, 1])
def test_every_linear_part_to_rounding(delay: int) -> None:
    lag_only = np.array([[0.0, 1.0], [0.0, -1.0 / 0.012]]), np.array([[0.0], [25.0 / 0.012]])
    pid = velocity_axis(lag=0.012, delay=delay, filter=1e-3, velocity_feed_forward=0.03, acceleration_feed_forward=1e-4)
    cascade = force_axis(
        stiffness=4000.0,
        damping=0.3,
        friction=Friction(viscous=0.02),
        delay=delay,
        filter=5e-4,
        velocity_feed_forward=0.1,
        acceleration_feed_forward=3e-4,
        velocity_ki=2.0,
        position_gain=30.0,
    )
    for (A, B), seen, axis in ((lag_only, 0, pid), (two_masses(), 3, cascade)):
        expected = by_hand(A, B, seen, axis, SMOOTH)
        response = follow(setpoints(SMOOTH), table(axis), linear=True)
        assert np.max(np.abs(response.position[:, 0] - expected)) <= 1e-12 * np.max(np.abs(expected))
        assert np.max(np.abs(expected - SMOOTH)) < 1.0


@pytest.mark.parametrize(
    "axis",
    [velocity_axis(), velocity_axis(delay=1, filter=1e-3), force_axis(delay=1), force_axis(stiffness=4e3, damping=0.3)],
    ids=["pid", "pid-delay", "p-pi", "two-masses"],
)
def test_the_closed_loop_equations_are_what_follow_does(axis: ServoAxis) -> None:
    F, g, h = closed_loop(axis, PERIOD)
    x = np.zeros(len(g))
    out = []
    for r in SMOOTH:  # the controller's first slope is taken as zero: SMOOTH starts at 0
        out.append(h @ x)
        x = F @ x + g * r
    response = follow(setpoints(SMOOTH), table(axis), linear=True)
    np.testing.assert_allclose(response.position[:, 0], out, rtol=0, atol=1e-10)


def test_gain_margin_is_where_a_pole_reaches_the_unit_circle() -> None:
    axis = velocity_axis()
    found = margins(axis, PERIOD)
    for factor, inside in ((0.999, True), (1.001, False)):
        gain = 25.0 * found.gain_margin * factor
        assert (spectral_radius(velocity_axis(gain=gain), PERIOD) < 1.0) is inside
    w = np.array([2.0 * math.pi * found.phase_frequency])
    assert abs(loop_response(axis, PERIOD, w)[0]) == pytest.approx(1.0, rel=1e-9)


#: Table 2 of the paper, V/mm, V/mm/s, V*s/mm.
TABLE_2 = {
    "x": {"kp": 22.3833, "ki": 266.8899, "kd": 0.1862},
    "y": {"kp": 38.3322, "ki": 266.8, "kd": 0.2975},
}


@pytest.mark.parametrize("name", ["x", "y"])
def test_table_2_is_unstable_on_a_fast_drive(name: str) -> None:
    """Digest, "what we found": unstable at 1 ms of lag and below, with 25 mm/s a volt and no delay."""
    for lag in (1e-4, 2e-4, 5e-4, 1e-3):
        assert spectral_radius(velocity_axis(lag=lag, **TABLE_2[name]), PERIOD) > 1.0
    for lag in (5e-3, 10e-3, 20e-3):
        assert spectral_radius(velocity_axis(lag=lag, **TABLE_2[name]), PERIOD) < 1.0


@pytest.mark.parametrize(("name", "unstable", "stable"), [("x", 5e-3, 7e-3), ("y", 9e-3, 10e-3)])
def test_table_2_with_a_tick_of_delay_needs_a_slow_drive(name: str, unstable: float, stable: float) -> None:
    """Digest, "what we found": with one tick of computing delay stable from about 7 ms (X) and 10 ms (Y)."""
    assert spectral_radius(velocity_axis(lag=unstable, delay=1, **TABLE_2[name]), PERIOD) > 1.0
    found = margins(velocity_axis(lag=stable, delay=1, **TABLE_2[name]), PERIOD)
    assert found.stable
    assert found.verdict.startswith("stable, but close to unstable: gain margin ")


def test_an_unstable_axis_runs_away_in_the_simulation_too() -> None:
    axis = velocity_axis(lag=1e-3)
    assert margins(axis, PERIOD).verdict.startswith("unstable: a closed-loop pole has modulus ")
    response = follow(setpoints(COMMAND), table(axis), linear=True)
    assert response.stopped is not None
    assert len(response) < len(COMMAND)


def test_error_under_constant_acceleration_is_a_over_ki_kv() -> None:
    """With an integrator in controller and plant e = a / (K_i K_v): 7.5 um at 50 mm/s^2 (digest, table 2)."""
    axis = replace(velocity_axis(), controller=replace(velocity_axis().controller, error_limit=1e9))
    time = np.arange(4000) * PERIOD
    response = follow(setpoints(0.5 * 50.0 * time**2), table(axis), linear=True)
    assert response.tracking_error[-1, 0] == pytest.approx(50.0 / (266.8899 * 25.0), rel=2e-3)

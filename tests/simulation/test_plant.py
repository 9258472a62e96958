"""Drive and mechanics against an independent integration, and friction, play, limits and energy on their own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from simulation.axes import PERIOD, force_axis, velocity_axis
from simulation.reference_axis import ReferenceAxis
from splinefeed.kernels import mechanics
from splinefeed.machine import Friction, ServoAxis
from splinefeed.simulation.plant import parameters, plant, step_table

STRIBECK = Friction(coulomb=25.0, static=35.0, stribeck_speed=2.0, viscous=0.1)


def driven(axis: ServoAxis, volts: Any, sub_steps: int = 2) -> Any:
    """States (n, 6) of the plant after each period of `volts` (n,), from rest at 0."""
    table = step_table(plant(axis), PERIOD, sub_steps)
    numbers = parameters(axis, PERIOD, sub_steps)
    memory, scratch = np.zeros(mechanics.MEMORY), np.zeros(mechanics.SCRATCH)
    out = np.empty((len(volts), mechanics.STATES))
    for i, value in enumerate(volts):
        mechanics.advance(memory, float(value), table, numbers, scratch)
        out[i] = memory[: mechanics.STATES]
    return out


def integrated(axis: ServoAxis, volts: Any) -> Any:
    reference = ReferenceAxis(axis, PERIOD)
    return np.array([reference.step(float(value)) for value in volts])


TICKS = np.arange(150)
SLIDE = 1.0 + 0.5 * np.sin(0.1 * TICKS)
REVERSE = np.sin(2.0 * np.pi * 15.0 * TICKS * PERIOD)

CASES = {
    "stribeck": (velocity_axis(friction=STRIBECK), SLIDE),
    "stribeck-reversing": (velocity_axis(friction=STRIBECK), REVERSE),
    "slow-sliding": (velocity_axis(friction=STRIBECK), 0.1 * SLIDE),
    "coulomb": (velocity_axis(friction=Friction(coulomb=40.0)), REVERSE),
    "torque-limit": (velocity_axis(peak=0.8, friction=STRIBECK), 8.0 * REVERSE),
    "force-mode": (force_axis(friction=Friction(coulomb=6.0, static=8.0, stribeck_speed=1.0)), 0.5 * REVERSE),
    "force-limit": (force_axis(friction=Friction(coulomb=6.0)), 20.0 * REVERSE),
    "two-masses": (velocity_axis(stiffness=4000.0, damping=1.0, friction=STRIBECK), REVERSE),
    "spring-with-play": (velocity_axis(stiffness=4000.0, damping=1.0, backlash=0.02, friction=STRIBECK), REVERSE),
    "play-without-compliance": (velocity_axis(backlash=0.05), REVERSE),
    "play-and-friction": (velocity_axis(backlash=0.05, friction=STRIBECK), REVERSE),
    "play-in-force-mode": (force_axis(backlash=0.05, friction=Friction(viscous=0.5)), 0.5 * REVERSE),
    "torque-limit-two-masses": (velocity_axis(peak=0.8, stiffness=4000.0, damping=1.0), 8.0 * REVERSE),
    "drive-lag": (velocity_axis(lag=0.004), REVERSE),
    "play-without-friction": (force_axis(stiffness=4000.0, damping=0.3, backlash=0.05), 0.5 * REVERSE),
}


@pytest.mark.parametrize("name", CASES)
def test_the_plant_is_that_of_solve_ivp(name: str) -> None:
    """Position to 1e-6 of its range at the default sub-step, with stops, break-aways, flanks and limits on the way."""
    axis, volts = CASES[name]
    expected = integrated(axis, volts)
    got = driven(axis, volts)
    for state in (mechanics.MOTOR, mechanics.LOAD):
        scale = np.max(np.abs(expected[:, state]))
        assert np.max(np.abs(got[:, state] - expected[:, state])) <= 1e-6 * scale


def test_sliding_converges_with_the_fourth_order() -> None:
    axis, volts = velocity_axis(friction=STRIBECK), np.full(60, 0.08)
    reference = driven(axis, volts, 64)[20:, mechanics.MOTOR_SPEED]
    errors = [np.max(np.abs(driven(axis, volts, n)[20:, mechanics.MOTOR_SPEED] - reference)) for n in (1, 2, 4)]
    assert errors[0] / errors[1] > 10.0
    assert errors[1] / errors[2] > 10.0


@pytest.mark.nojit
def test_without_friction_the_drive_is_gain_and_lag() -> None:
    """x = k u (t - lag (1 - exp(-t / lag))) under a step."""
    got = driven(velocity_axis(lag=0.01, peak=100.0), np.full(30, 2.0))
    t = (np.arange(30) + 1) * PERIOD
    np.testing.assert_allclose(got[:, mechanics.MOTOR], 50.0 * (t - 0.01 * (1.0 - np.exp(-t / 0.01))), rtol=1e-11)


@pytest.mark.nojit
def test_static_friction_holds_until_it_is_overcome() -> None:
    axis = force_axis(friction=Friction(coulomb=6.0, static=8.0, stribeck_speed=1.0))
    assert np.all(driven(axis, np.full(50, 7.9 / 60.0))[:, mechanics.MOTOR] == 0.0)
    assert driven(axis, np.full(50, 8.1 / 60.0))[-1, mechanics.MOTOR] > 0.0


@pytest.mark.nojit
def test_coulomb_friction_stops_a_coasting_axis_where_energy_says() -> None:
    """A mass that coasts against constant friction stops after v^2 m / (2 F), and stays."""
    axis = force_axis(friction=Friction(coulomb=20.0), lag=1e-6)
    pushed = driven(axis, np.concatenate([np.full(20, 1.0), np.zeros(60)]))
    v, x = pushed[19, mechanics.MOTOR_SPEED], pushed[19, mechanics.MOTOR]
    assert v == pytest.approx((60.0 - 20.0) * 0.02 / 0.02, rel=1e-3)
    assert pushed[-1, mechanics.MOTOR] - x == pytest.approx(0.5 * 0.02 * v * v / 20.0, rel=1e-3)
    assert pushed[-1, mechanics.MOTOR_SPEED] == 0.0
    assert np.all(pushed[-10:, mechanics.MOTOR] == pushed[-1, mechanics.MOTOR])


def test_play_without_compliance_is_a_hysteresis_loop() -> None:
    """Load = motor - half the play on the way up, + half on the way down, and still while the play is crossed."""
    axis = force_axis(backlash=0.4, friction=Friction(viscous=0.5))
    got = driven(axis, np.sin(2.0 * np.pi * 4.0 * np.arange(1000) * PERIOD))
    motor, load, speed = got[:, mechanics.MOTOR], got[:, mechanics.LOAD], got[:, mechanics.MOTOR_SPEED]
    gap = motor - load
    assert np.max(np.abs(gap)) <= 0.2 * (1.0 + 1e-12)
    moved = np.diff(load) != 0.0
    steady = moved & (speed[1:] * speed[:-1] > 0.0)  # not where the motor turned round within the period
    np.testing.assert_allclose(gap[1:][steady], 0.2 * np.sign(speed[1:][steady]), rtol=0, atol=1e-12)
    still = ~moved[100:]
    assert 0 < np.count_nonzero(still) < len(still) / 2
    area = abs(np.sum(0.5 * (load[501:751] + load[500:750]) * np.diff(motor[500:751])))
    # one cycle of a play operator encloses its width times the travel
    assert area == pytest.approx(0.4 * np.ptp(load[500:750]), rel=0.02)


def test_stick_slip_at_low_speed_and_smooth_sliding_at_high_speed() -> None:
    """A mass pulled by a slow spring over a falling friction curve sticks and slips; above the curve it does not."""
    friction = Friction(coulomb=20.0, static=40.0, stribeck_speed=5.0)
    axis = velocity_axis(stiffness=100.0, damping=0.05, friction=friction)
    slow = driven(axis, np.full(3000, 0.04))[1000:, mechanics.LOAD_SPEED]
    fast = driven(axis, np.full(3000, 4.0))[1000:, mechanics.LOAD_SPEED]
    assert np.count_nonzero(slow == 0.0) > len(slow) / 2
    assert np.max(slow) > 5.0
    assert np.min(fast) > 0.5 * np.mean(fast)
    starts = np.flatnonzero((slow[1:] > 0.0) & (slow[:-1] == 0.0))
    assert len(starts) >= 2
    assert np.ptp(np.diff(starts)) <= 0.02 * np.mean(np.diff(starts)) + 1.0  # a regular cycle


@pytest.mark.parametrize("play", [0.0, 0.05])
def test_energy_never_grows_without_a_push(play: float) -> None:
    axis = force_axis(stiffness=4000.0, damping=0.0, backlash=play, friction=Friction(coulomb=3.0), lag=1e-6)
    got = driven(axis, np.concatenate([np.full(15, 5.0), np.zeros(200)]), 8)[16:]
    stretch = np.abs(got[:, mechanics.MOTOR] - got[:, mechanics.LOAD])
    spring = 0.5 * 4000.0 * np.maximum(stretch - 0.5 * play, 0.0) ** 2
    energy = spring + 0.5 * 0.002 * got[:, mechanics.MOTOR_SPEED] ** 2 + 0.5 * 0.018 * got[:, mechanics.LOAD_SPEED] ** 2
    assert np.all(np.diff(energy) <= 1e-7 * energy[0])
    assert energy[-1] < energy[0]


def test_the_torque_limit_bounds_the_acceleration() -> None:
    axis = velocity_axis(peak=0.8)
    top = 0.8 * axis.force_per_motor_force / (axis.motor_inertia + axis.load_inertia)
    got = driven(axis, np.full(200, 10.0))
    gains = np.diff(got[:, mechanics.MOTOR_SPEED]) / PERIOD
    assert np.max(gains) <= top * (1.0 + 1e-9)
    assert np.max(gains) == pytest.approx(top, rel=1e-6)
    assert got[-1, mechanics.MOTOR_SPEED] == pytest.approx(250.0, rel=1e-3)
    assert np.max(got[:, mechanics.MOTOR_SPEED]) < 1.3 * 250.0  # the drive's own integral does not wind up


def test_a_drive_heeds_no_more_than_the_speed_and_the_force_of_its_motor() -> None:
    fast = driven(velocity_axis(peak=100.0), np.full(300, 50.0))[-1, mechanics.MOTOR_SPEED]
    assert fast == pytest.approx(100.0 * math.pi * 5.0 / (2.0 * math.pi), rel=1e-9)
    assert driven(force_axis(), np.full(100, 50.0))[-1, mechanics.DRIVE] == pytest.approx(600.0, rel=1e-9)

"""The linear loop against python-control: its response tick by tick, and margins of random loops to 0.1 %."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from splinefeed.machine import Friction, ServoAxis
from splinefeed.runs.following import follow
from splinefeed.simulation.linear import margins

control = pytest.importorskip("control", reason="python-control is of the extra slow")

pytestmark = pytest.mark.slow

NYQUIST = math.pi / PERIOD
TIME = np.arange(600) * PERIOD
COMMAND = 5.0 * (1.0 - np.cos(2.0 * np.pi * 3.0 * TIME))


def sampled_plant(axis: ServoAxis, delay: int) -> Any:
    """Volts to the position that closes the loop, from the physics of the axis, sampled by python-control."""
    lag, viscous = axis.drive.lag, axis.friction.viscous
    if axis.drive.mode == "velocity":
        gain = axis.drive.speed_per_volt
        made = control.ss([[0.0, 1.0], [0.0, -1.0 / lag]], [[0.0], [gain / lag]], [[1.0, 0.0]], 0.0)
    elif axis.transmission.stiffness is None:
        mass = (axis.motor.inertia + axis.load.inertia) / 1000.0
        A = [[0.0, 1.0, 0.0], [0.0, -viscous / mass, 1.0 / mass], [0.0, 0.0, -1.0 / lag]]
        made = control.ss(A, [[0.0], [0.0], [axis.drive.force_per_volt / lag]], [[1.0, 0.0, 0.0]], 0.0)
    else:
        m, load = axis.motor.inertia / 1000.0, axis.load.inertia / 1000.0
        k, d = axis.transmission.stiffness, axis.transmission.damping
        A = [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k / m, -d / m, k / m, d / m, 1.0 / m],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [k / load, d / load, -k / load, -(d + viscous) / load, 0.0],
            [0.0, 0.0, 0.0, 0.0, -1.0 / lag],
        ]
        B = [[0.0]] * 4 + [[axis.drive.force_per_volt / lag]]
        made = control.ss(A, B, [[0.0, 0.0, 1.0, 0.0, 0.0]], 0.0)
    late = control.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], PERIOD)
    sampled = control.sample_system(made, PERIOD, method="zoh")
    return late * sampled if delay else sampled


def slope_and_sum(filter_time: float) -> tuple[Any, Any]:
    """(z - 1) / ((T_f + T) z - T_f), and T z / (z - 1), as state equations."""
    a = filter_time / (filter_time + PERIOD)
    gain = 1.0 / (filter_time + PERIOD)  # gain (1 - 1/z) / (1 - a/z): y = f + gain e, f+ = a y - gain e
    slope = control.ss([[a]], [[(a - 1.0) * gain]], [[1.0]], [[gain]], PERIOD)
    return slope, control.ss([[1.0]], [[1.0]], [[PERIOD]], [[PERIOD]], PERIOD)


def loops(axis: ServoAxis) -> tuple[Any, Any]:
    """The loop opened at the controller's output, and the closed loop from reference to position."""
    c = axis.controller
    plant = sampled_plant(axis, c.delay)
    slope, total = slope_and_sum(c.filter)
    if c.kind == "pid":
        regulator = c.kp + c.ki * total + c.kd * slope
        return plant * regulator, control.feedback(plant * regulator, 1)
    inner = c.velocity_kp + c.velocity_ki * total
    back = c.position_gain + slope
    return plant * inner * back, control.feedback(plant * inner, back) * c.position_gain


AXES = {
    "pid": velocity_axis(lag=0.012),
    "pid-delay-filter": velocity_axis(lag=0.012, delay=1, filter=1e-3),
    "p-pi": force_axis(friction=Friction(viscous=0.02)),
    "p-pi-delay-filter": force_axis(velocity_ki=2.0, position_gain=30.0, delay=1, filter=5e-4),
    "two-masses": force_axis(
        stiffness=4000.0, damping=0.3, friction=Friction(viscous=0.02), velocity_ki=2.0, position_gain=30.0
    ),
}


@pytest.mark.parametrize("name", AXES)
def test_the_response_is_that_of_python_control(name: str) -> None:
    axis = AXES[name]
    expected = control.forced_response(loops(axis)[1], TIME, COMMAND).outputs
    response = follow(setpoints(COMMAND), table(axis), linear=True)
    assert response.stopped is None
    np.testing.assert_allclose(response.position[:, 0], expected, rtol=0, atol=1e-11 * np.max(np.abs(expected)))


def random_axis(rng: np.random.Generator) -> ServoAxis:
    """An axis with gains around those that are usual, stable or not."""

    def about(value: float, factor: float) -> float:
        return float(value * factor ** rng.uniform(-1.0, 1.0))

    delay, filter_time = int(rng.integers(2)), float(rng.choice([0.0, 5e-4, 2e-3]))
    shared = {"delay": delay, "filter": filter_time, "error_limit": 1e9}
    if rng.random() < 0.5:
        gains = {"kp": about(15.0, 3.0), "ki": about(200.0, 4.0), "kd": about(0.1, 4.0)}
        return velocity_axis(lag=about(0.01, 3.0), gain=about(25.0, 2.0), **shared, **gains)
    stiffness = {"stiffness": about(8000.0, 3.0), "damping": about(1.0, 2.0)} if rng.random() < 0.5 else {}
    gains = {"position_gain": about(30.0, 3.0), "velocity_kp": about(0.06, 3.0), "velocity_ki": about(2.0, 4.0)}
    friction = Friction(viscous=about(0.05, 3.0))
    return force_axis(lag=about(5e-4, 3.0), friction=friction, **stiffness, **shared, **gains)


def compared(axis: ServoAxis) -> bool:
    """Compare the margins of an axis with python-control's; False for an unstable one."""
    mine = margins(axis, PERIOD)
    loop, closed = loops(axis)
    assert mine.spectral_radius == pytest.approx(np.max(np.abs(control.poles(closed))), rel=1e-6)
    if not mine.stable:
        return False
    # over a grid: by polynomials a loop of degree 6 with a double integrator keeps no three digits
    omega = np.geomspace(0.05, NYQUIST * (1.0 - 1e-9), 3000)
    grid = control.frequency_response(loop, omega)
    gains, phases, _, at_gain, at_phase, _ = control.stability_margins(grid, returnall=True)
    ending = float(control.frequency_response(loop, [NYQUIST]).complex.squeeze().real)
    crossings = [*zip(gains, at_gain, strict=True), *([(-1.0 / ending, NYQUIST)] if ending < 0.0 else [])]
    rising = [(g, w) for g, w in crossings if g > 1.0]
    if rising:
        gain, w = min(rising)
        assert mine.gain_margin == pytest.approx(gain, rel=1e-3)
        assert 2.0 * math.pi * mine.gain_frequency == pytest.approx(w, rel=1e-3)
    assert mine.gain_reduction == pytest.approx(max((g for g, _ in crossings if g < 1.0), default=0.0), rel=1e-3)
    i = int(np.argmin(np.abs(phases)))
    assert mine.phase_margin == pytest.approx(phases[i], rel=1e-3)
    assert 2.0 * math.pi * mine.phase_frequency == pytest.approx(at_phase[i], rel=1e-3)
    delays = np.radians(np.mod(phases, 360.0)) / at_phase
    assert mine.delay_margin == pytest.approx(np.min(delays), rel=1e-3)
    w = 2.0 * math.pi * mine.bandwidth
    level = abs(control.frequency_response(closed, [w]).magnitude.squeeze())
    assert level / abs(control.dcgain(closed)) == pytest.approx(math.sqrt(0.5), rel=1e-3)
    at = int(np.argmin(np.abs(1.0 + grid.complex.squeeze())))
    fine = np.linspace(omega[max(at - 1, 0)], omega[min(at + 1, len(omega) - 1)], 300)
    peak = 1.0 / np.min(np.abs(1.0 + control.frequency_response(loop, fine).complex.squeeze()))
    assert mine.sensitivity == pytest.approx(peak, rel=1e-3)
    return True


@pytest.mark.parametrize("name", AXES)
def test_margins_are_those_of_python_control(name: str) -> None:
    assert compared(AXES[name])


def test_margins_of_random_loops_are_those_of_python_control() -> None:
    rng = np.random.default_rng(20250)
    stable = sum(compared(random_axis(rng)) for _ in range(25))
    assert stable >= 8

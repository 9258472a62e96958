"""Whole axes, every nonlinear element at once, against a controller and a plant written down a second time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from simulation.axes import PERIOD, force_axis, setpoints, table, velocity_axis
from simulation.reference_axis import ReferenceAxis
from splinefeed.machine import Friction, ServoAxis
from splinefeed.runs.following import follow

STRIBECK = Friction(coulomb=25.0, static=35.0, stribeck_speed=2.0, viscous=0.1)


def reference(axis: ServoAxis, command: Any) -> tuple[Any, Any, Any]:
    """Position, measured position and output (n,) of an axis from rest at command[0], in plain Python over solve_ivp.

    Controller after the definitions: PID or P-PI, clamping, feed-forward; then limit, converter, delay and drive.
    """
    c, plant = axis.controller, ReferenceAxis(axis, PERIOD)
    plant.state[[0, 4]] = command[0]
    resolution = axis.scale.resolution if c.feedback == "scale" else axis.encoder_resolution
    heeded = math.inf
    if axis.drive.mode == "velocity":
        heeded = axis.motor.rated_speed * axis.travel_per_motor / axis.drive.speed_per_volt
    a = c.filter / (c.filter + PERIOD)
    integral = slope = last_speed = pending = 0.0
    last_reference, last = command[0], None
    out = []
    for r in command:
        place = plant.state[4 if c.feedback == "scale" else 0]
        seen = math.floor(place / resolution + 0.5) * resolution
        speed = (r - last_reference) / PERIOD
        forward = c.acceleration_feed_forward * (speed - last_speed) / PERIOD
        last_reference, last_speed = r, speed
        source = seen if c.kind == "p-pi" else r - seen
        slope = a * slope + (1.0 - a) * (source - (source if last is None else last)) / PERIOD
        last = source
        if c.kind == "p-pi":
            wanted = c.position_gain * (r - seen) + c.velocity_feed_forward / c.velocity_kp * speed - slope
            step = c.velocity_ki * PERIOD * wanted
            volts = c.velocity_kp * wanted + integral + step + forward
        else:
            step = c.ki * PERIOD * source
            volts = c.kp * source + integral + step + c.kd * slope + c.velocity_feed_forward * speed + forward
        if abs(volts) > c.output_limit and volts * step > 0.0:
            volts -= step
        else:
            integral += step
        put = min(max(volts, -c.output_limit), c.output_limit)
        if c.output_bits:
            code = 2.0 * c.output_limit / 2**c.output_bits
            put = min(math.floor(put / code + 0.5) * code, c.output_limit - code)
        out.append((plant.state[4], seen, put))
        applied, pending = (pending, put) if c.delay else (put, put)
        plant.step(min(max(applied, -heeded), heeded))
    return tuple(np.array(column) for column in zip(*out, strict=True))


#: Not longer: some day a position comes so close to the edge of a count that 1e-9 mm decide which one is read.
TIME = np.arange(120) * PERIOD
WAVE = 1.5 * (1.0 - np.cos(2.0 * np.pi * 12.0 * TIME))
STEP = np.where(TIME < 0.005, 0.0, 3.0) + 0.1 * WAVE

CASES = {
    "everything-on-x": (
        velocity_axis(friction=STRIBECK, backlash=0.01, output_bits=16, filter=5e-4, velocity_feed_forward=0.03),
        WAVE,
    ),
    "saturated": (velocity_axis(friction=STRIBECK, ki=800.0, output_bits=16, peak=1.3), STEP),
    "late-on-the-encoder": (
        velocity_axis(friction=STRIBECK, backlash=0.02, feedback="encoder", delay=1, output_bits=12, kp=12.0, kd=0.05),
        WAVE,
    ),
    "two-masses": (
        velocity_axis(friction=STRIBECK, stiffness=4000.0, damping=1.0, backlash=0.01, output_bits=16, kp=10.0, kd=0.0),
        WAVE,
    ),
    "cascade": (
        force_axis(
            friction=Friction(coulomb=6.0, static=8.0, stribeck_speed=1.0, viscous=0.01),
            output_bits=16,
            filter=3e-4,
            velocity_feed_forward=0.1,
            acceleration_feed_forward=3e-4,
        ),
        WAVE,
    ),
    "cascade-saturated": (force_axis(friction=Friction(coulomb=6.0), output_limit=5.0, output_bits=14), 0.5 * STEP),
}


@pytest.mark.parametrize("name", CASES)
def test_a_whole_axis_is_that_of_the_reference(name: str) -> None:
    """Position to 1e-6 of its range, the very same counts and codes."""
    axis, command = CASES[name]
    position, measured, output = reference(axis, command)
    response = follow(setpoints(command), table(axis))
    assert response.stopped is None
    assert np.max(np.abs(response.position[:, 0] - position)) <= 1e-6 * np.ptp(position)
    np.testing.assert_allclose(response.measured[:, 0], measured, rtol=0, atol=1e-12)
    np.testing.assert_allclose(response.output[:, 0], output, rtol=0, atol=1e-9)
    assert response.saturated.any() == ("saturated" in name)

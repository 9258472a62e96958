"""Axes and setpoints that the servo tests share."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from splinefeed.machine import (
    Controller,
    Drive,
    Encoder,
    Friction,
    Load,
    Machine,
    Motor,
    Scale,
    ServoAxis,
    Transmission,
)
from splinefeed.records import Setpoints

PERIOD = 1e-3


def velocity_axis(
    *,
    lag: float = 0.01,
    gain: float = 25.0,
    friction: Friction | None = None,
    backlash: float = 0.0,
    stiffness: float | None = None,
    damping: float = 0.0,
    peak: float = 3.82,
    **control: Any,
) -> ServoAxis:
    """An axis like X of the paper's table, without friction unless given."""
    settings: dict[str, Any] = {
        "kp": 22.3833,
        "ki": 266.8899,
        "kd": 0.1862,
        "feedback": "scale",
        "error_limit": 5.0,
    } | control
    return ServoAxis(
        name="x",
        motor=Motor(rated_force=min(1.27, peak), peak_force=peak, rated_speed=100.0 * math.pi, inertia=1.73e-5),
        drive=Drive(mode="velocity", lag=lag, speed_per_volt=gain, bandwidth=2.0 * math.pi * 60.0),
        transmission=Transmission(
            kind="screw",
            lead=5.0 / (2.0 * math.pi),
            inertia=2e-5,
            backlash=backlash,
            stiffness=stiffness,
            damping=damping,
        ),
        load=Load(inertia=25.0),
        friction=friction or Friction(),
        encoder=Encoder(pulses=5000),
        scale=Scale(resolution=1e-3),
        controller=Controller(**settings),
    )


def force_axis(
    *,
    friction: Friction | None = None,
    backlash: float = 0.0,
    stiffness: float | None = None,
    damping: float = 0.0,
    lag: float = 3e-4,
    **control: Any,
) -> ServoAxis:
    """A linear motor of 2 kg that moves 18 kg, in force mode; 60 N a volt."""
    settings: dict[str, Any] = {
        "kind": "p-pi",
        "position_gain": 60.0,
        "velocity_kp": 0.1,
        "velocity_ki": 5.0,
        "feedback": "scale",
        "error_limit": 1e3,
    } | control
    return ServoAxis(
        name="x",
        motor=Motor(motion="linear", rated_force=200.0, peak_force=600.0, rated_speed=2000.0, inertia=2.0),
        drive=Drive(mode="torque", lag=lag, force_per_volt=60.0),
        transmission=Transmission(kind="direct", backlash=backlash, stiffness=stiffness, damping=damping),
        load=Load(inertia=18.0),
        friction=friction or Friction(),
        scale=Scale(resolution=1e-4),
        controller=Controller(**settings),
    )


def table(*axes: ServoAxis) -> Machine:
    """A machine of these axes."""
    return Machine(name="test", axes={axis.name: axis for axis in axes})


def setpoints(position: Any, axes: tuple[str, ...] = ("x",), period: float = PERIOD) -> Setpoints:
    """Setpoints at these positions, (n,) or (n, axes); curve, parameter and feed say nothing."""
    array = np.asarray(position, dtype=np.float64).reshape(len(position), len(axes))
    count = len(array)
    nothing = np.zeros(count)
    return Setpoints(
        t=np.arange(count) * period,
        curve=np.zeros(count, dtype=np.int64),
        u=nothing,
        s=nothing,
        feed=nothing,
        position=array,
        axes=axes,
        period=period,
        method="test",
    )

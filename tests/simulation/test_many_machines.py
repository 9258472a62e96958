"""Machines drawn at random within sane ranges: they follow, or stop with a reason, and never make a NaN."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from simulation.axes import setpoints
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
from splinefeed.runs.following import follow
from splinefeed.simulation.linear import margins

STOPPED = re.compile(
    r"axis \w+ ran away at [\d.]+ s: an error of \S+ (mm|deg) is beyond its limit of \S+ (mm|deg); "
    r"its loop may be unstable \(splinefeed tune\), or the feed too high"
)


class Lottery:
    """Draws of one seed."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def between(self, low: float, high: float) -> float:
        return float(math.exp(self.rng.uniform(math.log(low), math.log(high))))

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def friction(self, force: float, rotary: bool) -> Friction:
        """Up to a tenth of the peak force, with or without a Stribeck curve."""
        coulomb = force * self.between(1e-4, 0.1)
        viscous = force * self.between(1e-6, 1e-4) * (50.0 if rotary else 1.0)
        if self.chance(0.3):
            return Friction(coulomb=coulomb, viscous=viscous)
        speed = self.between(0.2, 20.0) * (0.02 if rotary else 1.0)
        return Friction(coulomb=coulomb, static=coulomb * self.between(1.0, 2.0), stribeck_speed=speed, viscous=viscous)

    def axis(self, name: str) -> ServoAxis:
        """A linear axis with screw, belt or linear motor, or a rotary one with a gear; some with wild gains."""
        rotary = name in ("a", "theta")
        direct = not rotary and self.chance(0.3)
        if direct:
            peak = self.between(50.0, 2000.0)
            motor = Motor(motion="linear", rated_force=0.4 * peak, peak_force=peak, rated_speed=2e3, inertia=2.0)
            transmission = Transmission(kind="direct", **self.compliance(8.0 * peak, rotary))
        else:
            rated = self.between(0.1, 10.0)
            motor = Motor(
                rated_force=rated,
                peak_force=rated * self.between(1.0, 3.0),
                rated_speed=self.between(100.0, 600.0),
                inertia=rated * self.between(5e-6, 5e-5),
            )
            if rotary:
                ratio = self.between(1.0, 100.0)
                transmission = Transmission(kind="gear", ratio=ratio, **self.compliance(50.0 * rated * ratio, rotary))
            else:
                lead = self.between(2.0, 60.0) / (2.0 * math.pi)
                kind = "belt" if self.chance(0.3) else "screw"
                force = 1000.0 * rated / lead
                transmission = Transmission(kind=kind, lead=lead, **self.compliance(8.0 * force, rotary))
        kind = "rotary" if rotary else "linear"
        parts = {"name": name, "motion": kind, "motor": motor, "transmission": transmission}
        bare = ServoAxis(
            **parts,
            load=Load(inertia=1.0),
            drive=Drive(mode="torque", lag=1e-3, force_per_volt=1.0),
            encoder=None if direct else Encoder(pulses=1000),
            scale=Scale(resolution=1e-3),
            controller=Controller(kp=1.0, feedback="scale", error_limit=1.0),
        )
        force = motor.peak_force * bare.force_per_motor_force
        # a load that the motor gets to 0.2 to 20 g, or to 20 to 2000 rad/s^2
        inertia = force / self.between(20.0, 2000.0) if rotary else force / self.between(2.0, 200.0)
        velocity = not direct and self.chance(0.6)
        top = motor.rated_speed * bare.travel_per_motor
        drive = (
            Drive(
                mode="velocity",
                lag=self.between(5e-4, 2e-2),
                speed_per_volt=top / self.between(5.0, 10.0),
                bandwidth=self.between(100.0, 800.0),
            )
            if velocity
            else Drive(mode="torque", lag=self.between(2e-4, 3e-3), force_per_volt=motor.peak_force / 10.0)
        )
        encoder = None if direct else Encoder(pulses=int(self.between(500, 50_000)))
        scale = Scale(resolution=self.between(1e-6, 1e-3)) if direct or self.chance(0.4) else None
        feedback = "scale" if scale is not None else "encoder"
        made = replace(
            bare,
            load=Load(inertia=inertia),
            drive=drive,
            friction=self.friction(force, rotary),
            encoder=encoder,
            scale=scale,
            controller=Controller(
                kp=1.0,
                feedback=feedback,
                delay=int(self.chance(0.5)),
                output_bits=int(self.rng.choice([0, 12, 16])),
                filter=float(self.rng.choice([0.0, 1e-3])),
                error_limit=self.between(0.1, 20.0) * (0.1 if rotary else 1.0),
            ),
        )
        return self.controlled(made, inertia, velocity)

    def compliance(self, stiffness: float, rotary: bool) -> dict[str, float]:
        """Play of up to 0.1 mm or mrad, and in half of the axes a spring that gives at most some tenths of that."""
        play = self.between(1e-4, 0.1) * (0.01 if rotary else 1.0) if self.chance(0.4) else 0.0
        if self.chance(0.5):
            return {"backlash": play}
        return {"backlash": play, "stiffness": stiffness * self.between(1.0, 30.0), "damping": stiffness * 1e-4}

    def controlled(self, axis: ServoAxis, inertia: float, velocity: bool) -> ServoAxis:
        """Gains that are usual for the drive, or some of them far too high."""
        wild = self.between(1.0, 30.0) if self.chance(0.2) else self.between(0.3, 1.0)
        if velocity:
            kp = wild * 0.4 / (float(axis.drive.speed_per_volt or 1.0) * (axis.drive.lag + 4e-3))
            return replace(axis, controller=replace(axis.controller, kp=kp, ki=10.0 * kp, kd=2e-3 * kp))
        whole = axis.motor_inertia + axis.load_inertia
        per_volt = float(axis.drive.force_per_volt or 1.0) * axis.force_per_motor_force
        kp = wild * 100.0 * whole / per_volt  # a speed loop of 100 rad/s, times `wild`
        gains = {"position_gain": 20.0, "velocity_kp": kp, "velocity_ki": 10.0 * kp}
        control = replace(axis.controller, kind="p-pi", kp=0.0, **gains)
        return replace(axis, controller=control)


def check(seed: int) -> str:
    """One machine on one motion; what came of it."""
    lottery = Lottery(seed)
    names = [("x",), ("x", "y"), ("x", "theta"), ("x", "y", "a")][int(lottery.rng.integers(4))]
    machine = Machine(name="drawn", axes={name: lottery.axis(name) for name in names})
    if seed % 10 == 0:
        assert Machine.parse(machine.to_text(), "drawn") == machine
    period = float(lottery.rng.choice([2.5e-4, 1e-3, 2e-3]))
    time = np.arange(250) * period
    columns = []
    for name in names:
        size = lottery.between(0.01, 5.0) * (0.05 if name in ("a", "theta") else 1.0)
        columns.append(size * (1.0 - np.cos(2.0 * np.pi * lottery.between(0.5, 8.0) * time)))
    points = setpoints(np.column_stack(columns), names, period)
    response = follow(points, machine)
    for values in (response.position, response.measured, response.output):
        assert np.all(np.isfinite(values)), seed
    for i, name in enumerate(names):
        control = machine.axes[name].controller
        assert np.all(np.abs(response.output[:, i]) <= control.output_limit)
        assert np.all(np.abs(response.command - response.measured)[:-1, i] <= control.error_limit)
    if seed % 10 == 0:
        assert all(math.isfinite(margins(machine.axes[name], period).spectral_radius) for name in names)
    if response.stopped is None:
        assert len(response) == len(points)
        return "followed"
    assert STOPPED.fullmatch(response.stopped), response.stopped
    culprit = names.index(response.stopped.split()[1])
    limit = machine.axes[names[culprit]].controller.error_limit
    assert abs(response.command[-1, culprit] - response.measured[-1, culprit]) > limit
    return "stopped"


@pytest.mark.slow
def test_200_machines_follow_or_stop_with_a_reason() -> None:
    ends = [check(seed) for seed in range(200)]
    assert ends.count("followed") >= 100
    assert ends.count("stopped") >= 5

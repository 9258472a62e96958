"""An axis written down a second time, from its physics, and integrated by SciPy at 1e-10 with located events."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from splinefeed.machine import ServoAxis

Vector = Any


class ReferenceAxis:
    """States x, v, drive, integral, load x, load v; `step` moves on by one period under constant volts."""

    def __init__(self, axis: ServoAxis, period: float) -> None:
        self.period = period
        self.state = np.zeros(6)
        self.sliding = 0.0
        self.two = axis.transmission.stiffness is not None
        self.k = axis.transmission.stiffness or 0.0
        self.d = axis.transmission.damping
        self.play = axis.transmission.backlash
        self.motor_mass = axis.motor_inertia
        self.load_mass = axis.load_inertia
        self.total = self.motor_mass + self.load_mass
        self.drive = axis.drive
        self.peak = axis.motor.peak_force * axis.force_per_motor_force
        self.kf = (axis.drive.force_per_volt or 0.0) * axis.force_per_motor_force
        f = axis.friction
        self.coulomb, self.viscous = f.coulomb, f.viscous
        self.static = f.coulomb if f.static is None else f.static
        self.stribeck = f.stribeck_speed or 1.0

    def drive_force(self, z: Vector, volts: float) -> tuple[float, float, float]:
        """Force of the motor, and the derivatives of drive state and integral."""
        if self.drive.mode == "torque":
            target = min(max(self.kf * volts, -self.peak), self.peak)
            return z[2], (target - z[2]) / self.drive.lag, 0.0
        b = self.drive.bandwidth
        rate = (self.drive.speed_per_volt * volts - z[2]) / self.drive.lag
        stiff = self.total * b
        wanted = self.total * rate + stiff * (z[2] - z[1]) + 0.25 * stiff * b * z[3]
        given = min(max(wanted, -self.peak), self.peak)
        return given, rate, z[2] - z[1] + (given - wanted) / stiff

    def spring(self, z: Vector) -> float:
        """Force that the transmission puts on the load."""
        stretch = z[0] - z[4]
        free = math.copysign(max(abs(stretch) - 0.5 * self.play, 0.0), stretch)
        return self.k * free + self.d * (z[1] - z[5])

    def rub(self, v: float) -> float:
        """Dry friction against sliding in the present direction."""
        return self.sliding * (self.coulomb + (self.static - self.coulomb) / (1.0 + (v / self.stribeck) ** 2))

    def pull(self, z: Vector, volts: float) -> float:
        """What friction has to hold at rest."""
        return self.spring(z) if self.two else self.drive_force(z, volts)[0]

    def drag(self, motor: float) -> None:
        """Play without compliance: the load is never farther than half the play from the motor."""
        self.state[4] = min(max(self.state[4], motor - 0.5 * self.play), motor + 0.5 * self.play)

    def rhs(self, _: float, z: Vector, volts: float) -> Vector:
        force, rate, integral = self.drive_force(z, volts)
        held = self.sliding == 0.0 and self.static > 0.0
        if not self.two:
            a = 0.0 if held else (force - self.rub(z[1]) - self.viscous * z[1]) / self.total
            return [z[1], a, rate, integral, 0.0, 0.0]
        s = self.spring(z)
        a = 0.0 if held else (s - self.rub(z[5]) - self.viscous * z[5]) / self.load_mass
        return [z[1], (force - s) / self.motor_mass, rate, integral, z[5], a]

    def step(self, volts: float) -> Vector:
        """One period on."""
        t = 0.0
        speed = 5 if self.two else 1
        if self.static > 0.0 and self.sliding == 0.0 and abs(self.pull(self.state, volts)) > self.static:
            self.sliding = math.copysign(1.0, self.pull(self.state, volts))

        def stops(_: float, z: Vector, __: float) -> float:
            return float(z[speed])

        def turns(_: float, z: Vector, __: float) -> float:
            return float(z[1])

        def breaks(_: float, z: Vector, __: float) -> float:
            return abs(self.pull(z, volts)) - self.static

        while t < self.period * (1.0 - 1e-12):
            event = None
            if self.static > 0.0:
                event = breaks if self.sliding == 0.0 else stops
                event.terminal = True  # type: ignore[attr-defined]
                event.direction = 1.0 if self.sliding == 0.0 else -self.sliding  # type: ignore[attr-defined]
            dragged = not self.two and self.play > 0.0
            found = solve_ivp(
                self.rhs,
                (t, self.period),
                self.state,
                "DOP853",
                args=(volts,),
                events=[each for each in (event, turns if dragged else None) if each is not None] or None,
                rtol=1e-10,
                atol=1e-12,
                max_step=self.period / 4,
            )
            self.state = found.y[:, -1].copy()
            t = found.t[-1]
            if dragged:  # the load goes as far as the motor took it, on the way and at the end
                for z in found.y_events[-1]:
                    self.drag(z[0])
                self.drag(self.state[0])
            if found.status == 1:
                self.state[speed] = 0.0
                pull = self.pull(self.state, volts)
                self.sliding = 0.0 if abs(pull) < self.static * (1.0 - 1e-9) else math.copysign(1.0, pull)
        if not self.two and self.play == 0.0:
            self.state[4] = self.state[0]
        return self.state.copy()

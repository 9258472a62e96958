"""Velocity, acceleration and jerk of each axis, and how much of the tangential limits a law uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Limits, Setpoints, TimeLaw

#: A limit counts as kept up to this, relative: the rounding of the law's own polynomials.
SLACK = 1e-9
#: Instants examined per piece of a law, in addition to its ends.
SAMPLES = 32


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """What each axis does at each tick: velocity, acceleration, jerk, (n, axes), mm/s^k, rotary axes rad/s^k.

    Source: docs/check.md. Example: `run.motion.acceleration`
    """

    t: Array
    velocity: Array
    acceleration: Array
    jerk: Array


@dataclass(frozen=True)
class Share:
    """How much of one limit is used: the limit, the worst value, its share, and where along the path, mm."""

    limit: float
    worst: float
    at_s: float

    @property
    def share(self) -> float:
        """worst / limit."""
        return self.worst / self.limit

    @property
    def kept(self) -> bool:
        """Whether the limit holds, but for rounding."""
        return self.share <= 1.0 + SLACK


def axis_motion(setpoints: Setpoints, path: Path | JointPath, law: TimeLaw) -> AxisMotion:
    """Velocity, acceleration and jerk of each axis or joint at each tick, exact: q(t) = r(s(t)).

    q' = r_s s',  q'' = r_ss s'^2 + r_s s'',  q''' = r_sss s'^3 + 3 r_ss s' s'' + r_s s'''

    Where C' = 0 these forms are 0/0, and differences of the setpoints stand in.
    """
    if isinstance(path, JointPath):
        derivatives = path.derivatives(setpoints.s)[:, :, 3:]
    else:
        derivatives = by_arc_length(path.evaluate(setpoints.curve, setpoints.u, 3), path.linear)
    v, a, j = (f(setpoints.t)[:, None] for f in (law.feed, law.acceleration, law.jerk))
    r1, r2, r3 = derivatives[:, 1], derivatives[:, 2], derivatives[:, 3]
    with np.errstate(invalid="ignore", over="ignore"):
        exact = [r1 * v, r2 * v * v + r1 * a, r3 * v**3 + 3.0 * r2 * v * a + r1 * j]
    out = []
    for order, values in enumerate(exact, start=1):
        holes = ~np.isfinite(values)
        if holes.any():
            values[holes] = differences(setpoints, order)[holes]
        out.append(values)
    return AxisMotion(setpoints.t, *out)


def differences(setpoints: Setpoints, order: int) -> Array:
    """The order-th difference of the setpoints over the period, (n, axes), centred, held at both ends.

    What a drive sees. Its rounding floor is about 2^order eps |x| / T^order.
    """
    values = np.diff(setpoints.position, n=order, axis=0) / setpoints.period**order
    if not len(values):
        return np.zeros_like(setpoints.position)
    before = (len(setpoints) - len(values)) // 2
    after = len(setpoints) - len(values) - before
    return np.pad(values, ((before, after), (0, 0)), mode="edge")


def tangential_shares(law: TimeLaw, limits: Limits) -> Mapping[str, Share]:
    """Worst feed, acceleration, deceleration and jerk of a law against the limits, examined in every piece.

    jerk is held to `limits.jerk` while the feed grows and to `limits.deceleration_jerk` while it falls.
    """
    fraction = np.linspace(0.0, 1.0, SAMPLES)
    tau = (law.breaks[:-1, None] + np.diff(law.breaks)[:, None] * fraction) - law.breaks[:-1, None]
    powers = tau[..., None] ** np.arange(law.coefficients.shape[1])
    s, v, a, j = (np.sum(powers[..., : law.coefficients.shape[1] - k] * _derived(law, k), axis=-1) for k in range(4))
    pushes = a > 0.0
    # a piece that begins or ends with a = 0 belongs to the side its middle is on
    middle = a[:, SAMPLES // 2, None] >= 0.0
    growing = np.where(np.abs(a) <= 1e-9 * np.abs(a).max(), middle, pushes)
    jerk_limit = np.where(growing, limits.jerk, float(limits.deceleration_jerk or limits.jerk))
    worst_jerk = int(np.argmax(np.abs(j) / jerk_limit))
    at = np.unravel_index(worst_jerk, j.shape)
    shares = {
        "feed": _share(limits.feed, v, s),
        "acceleration": _share(limits.acceleration, a, s),
        "deceleration": _share(float(limits.deceleration or limits.acceleration), -a, s),
        "jerk": Share(float(jerk_limit[at]), float(np.abs(j[at])), float(s[at])),
    }
    return {name: share for name, share in shares.items() if np.isfinite(share.limit)}


def _derived(law: TimeLaw, order: int) -> Array:
    """Coefficients of the order-th derivative, (m, 1, 6 - order)."""
    c = law.coefficients
    for _ in range(order):
        c = c[:, 1:] * np.arange(1, c.shape[1])
    return c[:, None, :]


def _share(limit: float, values: Array, s: Array) -> Share:
    at = np.unravel_index(int(np.argmax(values)), values.shape)
    return Share(float(limit), max(float(values[at]), 0.0), float(s[at]))

"""Velocity, acceleration and jerk of each axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Setpoints, TimeLaw


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """What each axis does at each tick: velocity, acceleration, jerk, (n, axes), mm/s^k, rotary axes rad/s^k.

    Source: docs/check.md. Example: `run.motion.acceleration`
    """

    t: Array
    velocity: Array
    acceleration: Array
    jerk: Array


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

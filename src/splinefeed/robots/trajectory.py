"""A motion as trajectory_msgs/JointTrajectory: few points whose quintics, as controllers join them, keep the limits.

Between two points with position, velocity and acceleration ros2_controllers' JointTrajectoryController moves each joint
by the polynomial of degree 5 that has them (its documentation, trajectory.rst; UR's external control does the same):

    q0 + v0 x + a0/2 x^2 + c3 x^3 + c4 x^4 + c5 x^5
    c3 = (20 d - (8 v1 + 12 v0) h - (3 a0 - a1) h^2) / (2 h^3)          d = q1 - q0, over the time h
    c4 = (-30 d + (14 v1 + 16 v0) h + (3 a0 - 2 a1) h^2) / (2 h^4)
    c5 = (12 d - 6 (v1 + v0) h - (a0 - a1) h^2) / (2 h^5)
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import FormatError, InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.paths.track import Track
from splinefeed.records import AXIS_LIMITS, Array, BoolArray, Limits, TimeLaw
from splinefeed.robots.frames import MM
from splinefeed.runs.result import Run

#: How far joints may be from the motion between points, rad and mm, by default.
TOLERANCE = 1e-6
#: Longest time between points, s, and the shortest, in periods of the law or, without one, s.
LONGEST, SHORTEST = 0.1, 1e-3
#: Points at most: above that a controller's message is no message.
MOST_POINTS = 100_000
#: A quintic may be over a limit by this share: the law itself may be by a part of it.
OVER = 2e-4
#: Places of a segment at which its distance, velocity and acceleration are looked at.
PLACES = np.linspace(0.0, 1.0, 17)
NANO = 1_000_000_000


def motion_at(path: Track, law: TimeLaw, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Positions, velocities, accelerations and jerks (n, axes) of the axes at any times t (n,), s, of a law.

    rad or mm by s, exact: q' = r' v, q'' = r'' v^2 + r' a, q''' = r''' v^3 + 3 r'' v a + r' j (the chain rule).
    Raises InputError for times outside the law. Source: docs/readers/robots.md.
    Example: `q, velocity, acceleration, jerk = sf.robots.motion_at(path, law, [0.1, 0.2])`
    """
    times = np.atleast_1d(np.asarray(t, dtype=np.float64))
    if times.ndim != 1 or not np.all((times >= 0.0) & (times <= law.duration * (1.0 + 1e-12))):
        raise InputError(f"t: expected times from 0 to {law.duration:.9g} s, the end of the law")
    times = np.minimum(times, law.duration)
    s = np.clip(law(times), 0.0, path.length)
    v, a, j = (each(times)[:, None] for each in (law.feed, law.acceleration, law.jerk))
    d = path.derivatives(s)[:, :, : len(path.axes)]
    q, r1, r2, r3 = np.moveaxis(d, 1, 0)
    return q, r1 * v, r2 * v * v + r1 * a, r3 * v**3 + 3.0 * r2 * v * a + r1 * j


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Points of a motion: joints, times t (n,), s, and position, velocity, acceleration (n, joints), rad and mm.

    units  of each joint, rad or mm: ROS has m, and a file says what slides in it. `joint_trajectory` makes it.
    Raises FormatError for a file that cannot be written. Source: ros2_controllers, trajectory.rst.
    Example: `sf.robots.joint_trajectory(path, law, limits).save("move.yaml")`
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    t: Array
    position: Array
    velocity: Array
    acceleration: Array

    def __len__(self) -> int:
        return len(self.t)

    def as_dict(self) -> dict[str, Any]:
        """The message trajectory_msgs/JointTrajectory, in rad and m."""
        unit = np.where(np.array(self.units) == "mm", 1.0 / MM, 1.0)
        nanoseconds = np.rint(self.t * NANO).astype(np.int64).tolist()
        rows = zip(
            *((unit * each).tolist() for each in (self.position, self.velocity, self.acceleration)),
            nanoseconds,
            strict=True,
        )
        return {
            "joint_names": list(map(str, self.joints)),
            "points": [
                {
                    "positions": q,
                    "velocities": v,
                    "accelerations": a,
                    "time_from_start": {"sec": ns // NANO, "nanosec": ns % NANO},
                }
                for q, v, a, ns in rows
            ],
        }

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the message as .json or .yaml (what `ros2 topic pub` takes), whole or not at all."""
        name = os.fspath(file)
        if not name.endswith((".json", ".yaml", ".yml")):
            raise FormatError(f"{name}: a JointTrajectory is written as .json or .yaml; name the file so")
        said = self.as_dict()
        with atomic_write(name) as temporary, open(temporary, "w", encoding="utf-8") as out:
            out.write(_yaml(said) if not name.endswith(".json") else json.dumps(said, indent=1) + "\n")


def joint_trajectory(
    path: Track | Run,
    law: TimeLaw | None = None,
    limits: Limits | None = None,
    *,
    tolerance: float = TOLERANCE,
) -> JointTrajectory:
    """A motion as points of a JointTrajectory, so many that the controller's quintics keep path and limits.

    path, law, limits  as for `sf.check`; or a Run, which has all three
    tolerance  how far joints may be from the motion between points, rad and mm

    Points lie closer where a quintic would leave the motion, or its velocity, acceleration or jerk the limits, down to
    a period apart. Raises InputError for a tolerance that is not positive, and for motions of too many points.
    Positions are (n, joints). Source: ros2_controllers, trajectory.rst.
    Example: `sf.robots.joint_trajectory(path, law, limits).save("move.json")`
    """
    if isinstance(path, Run):
        moved, law, limits = path.joints or path.path, path.law, path.limits
    else:
        moved = path
    if law is None or limits is None:
        raise InputError("joint_trajectory: give path, law and limits, or a Run")
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"tolerance is {tolerance!r}; expected rad and mm, greater than 0")
    most = [limits.of_axes(name, moved.axes) * (1.0 + OVER) for name in AXIS_LIMITS]
    shortest = (law.period or SHORTEST) * (1.0 - 1e-6)
    t = _times(np.linspace(0.0, law.duration, int(np.ceil(law.duration / LONGEST)) + 1))
    while True:
        if len(t) > MOST_POINTS:
            raise InputError(f"the motion takes more than {MOST_POINTS} points; raise tolerance, or split it")
        q, v, a, _ = motion_at(moved, law, t)
        bad = _bad(moved, law, t, (q, v, a), most, tolerance) & (np.diff(t) > 2.0 * shortest)
        if not np.any(bad):
            break
        t = _times(np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])[bad]])))
    return JointTrajectory(tuple(moved.axes), moved.axis_units, t, q, v, a)


def _times(t: Array) -> Array:
    """Times in whole nanoseconds, as the message has them."""
    return np.asarray(np.rint(t * NANO) / NANO)


def _bad(
    path: Track,
    law: TimeLaw,
    t: Array,
    states: tuple[Array, Array, Array],
    most: Sequence[Array],
    off: float,
) -> Any:
    """Which segments (n - 1,) leave the motion by more than `off`, or the limits by more than the motion itself."""
    h = np.diff(t)[:, None]
    c = quintic(h, *((each[:-1], each[1:]) for each in states))
    x = PLACES[:, None, None] * h
    wanted = motion_at(path, law, np.minimum((t[:-1] + PLACES[:, None] * h[:, 0]).ravel(), law.duration))
    shape = (*x.shape[:2], states[0].shape[1])
    bad: BoolArray = np.max(np.abs(_value(c, x, 0) - wanted[0].reshape(shape)), axis=(0, 2)) > off
    for order, limit in enumerate(most, start=1):
        bad |= np.any(np.max(np.abs(_value(c, x, order)), axis=0) > limit, axis=1)
    return bad


def quintic(h: Array, q: tuple[Array, Array], v: tuple[Array, Array], a: tuple[Array, Array]) -> Array:
    """Coefficients (6, n, joints) of the controller's polynomials over times h (n, 1), from states at both ends."""
    d, (v0, v1), (a0, a1) = q[1] - q[0], v, a
    return np.stack(
        [
            q[0],
            v0,
            0.5 * a0,
            (20.0 * d - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h**2) / (2.0 * h**3),
            (-30.0 * d + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h**2) / (2.0 * h**4),
            (12.0 * d - 6.0 * (v1 + v0) * h - (a0 - a1) * h**2) / (2.0 * h**5),
        ]
    )


def _value(c: Array, x: Array, order: int) -> Array:
    """The derivative of an order of polynomials c (6, n, joints) at x (k, n, 1), (k, n, joints)."""
    found = np.zeros(x.shape[:2] + c.shape[2:])
    for power in range(5, order - 1, -1):
        factor = float(np.prod(np.arange(power - order + 1, power + 1)))
        found = found * x + factor * c[power]
    return np.asarray(found)


def _yaml(said: dict[str, Any]) -> str:
    """The message as YAML: a point is a few lines of flow sequences."""
    lines = ["joint_names: " + json.dumps(said["joint_names"]), "points:"]
    for point in said["points"]:
        first = "- "
        for key in ("positions", "velocities", "accelerations"):
            lines.append(f"{first}{key}: [{', '.join(map(_number, point[key]))}]")
            first = "  "
        time = point["time_from_start"]
        lines.append(f"  time_from_start: {{sec: {time['sec']}, nanosec: {time['nanosec']}}}")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Shortest digits that read back the same; with a point, which YAML 1.1 wants of numbers with an exponent."""
    text = repr(value)
    if "e" in text and "." not in text:
        text = text.replace("e", ".0e")
    return text

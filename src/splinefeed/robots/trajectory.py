"""A motion as trajectory_msgs/JointTrajectory: few points whose quintics, as controllers join them, keep the limits.

Between two points with position, velocity and acceleration ros2_controllers' JointTrajectoryController moves each joint
by the polynomial of degree 5 that has them (its documentation, trajectory.rst; UR's external control does the same):

    q0 + v0 x + a0/2 x^2 + c3 x^3 + c4 x^4 + c5 x^5
    c3 = (20 d - (8 v1 + 12 v0) h - (3 a0 - a1) h^2) / (2 h^3)          d = q1 - q0, over the time h
    c4 = (-30 d + (14 v1 + 16 v0) h + (3 a0 - 2 a1) h^2) / (2 h^4)
    c5 = (12 d - 6 (v1 + v0) h - (a0 - a1) h^2) / (2 h^5)

Over a jump of jerk such a polynomial swings beyond both sides, however short it is: so points stand at the jumps first,
those of the law and of the path. What comes of it is measured between all points, and `JointTrajectory.shares` says it.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.checks.law import times_at
from splinefeed.errors import FormatError, InputError
from splinefeed.files.atomic import write_text
from splinefeed.paths.track import Track
from splinefeed.records import AXIS_LIMITS, Array, BoolArray, Limits, TimeLaw
from splinefeed.records.motion import derivative
from splinefeed.robots.frames import MM
from splinefeed.runs.result import Run

#: How far joints may be from the motion between points, rad and mm, by default.
TOLERANCE = 1e-6
#: Longest and shortest time between points, s: over a shorter one, doubles would round the jerk.
LONGEST, SHORTEST = 0.1, 2e-5
#: Points at most: above that a controller's message is no message.
MOST_POINTS = 100_000
#: A quintic may be over a limit by this share: the law itself may be by a part of it.
OVER = 2e-4
#: A limit is kept that is not exceeded by more than this share, wherever it is looked at.
KEPT = 1e-3
#: Places of a segment at which it is looked at for more points, and in the end.
PLACES, IN_THE_END = np.linspace(0.0, 1.0, 17), np.linspace(0.0, 1.0, 65)
#: Share of the tolerance that is left for what lies between the places.
FINER = 0.02
#: A jump of jerk above this share of a limit is worth a point.
JUMP = 0.01
NANO = 1_000_000_000


def motion_at(path: Track, law: TimeLaw, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return positions, velocities, accelerations and jerks of the axes at any times of a law.

    Parameters
    ----------
    path : Track
        That the law is of.
    law : TimeLaw
        As `sf.plan` gives it.
    t : array (n,)
        Times, s.

    Returns
    -------
    position, velocity, acceleration, jerk : array (n, axes)
        rad or mm by s, exact.

    Raises
    ------
    InputError
        For times outside the law.

    Notes
    -----
    q' = r' v, q'' = r'' v^2 + r' a, q''' = r''' v^3 + 3 r'' v a + r' j (the chain rule).

    References
    ----------
    .. [1] docs/readers/robots.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [30, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), period=1e-3)
    >>> q, velocity, acceleration, jerk = sf.robots.motion_at(path, law, [0.5 * law.duration])
    >>> q.round(9), velocity.round(9)
    (array([[15.,  0.]]), array([[60.,  0.]]))
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
    """Points of a motion, as trajectory_msgs/JointTrajectory has them; `joint_trajectory` makes it.

    Attributes
    ----------
    joints : tuple of str
        Their names.
    units : tuple of str
        Of each joint, rad or mm: ROS has m, and a file says what slides in it.
    t : array (n,)
        Times, s.
    position, velocity, acceleration : array (n, joints)
        In rad and mm by s.
    shares : mapping of str to float
        Largest share of each kind of limit that the controller's quintics use at any time, at ticks and between.
    off : float
        How far they are from the motion at the most, rad and mm.
    notes : tuple of str
        Which limits they do not keep, and by how much; empty where they keep all.

    Raises
    ------
    FormatError
        By `save`, for a file that cannot be written.

    References
    ----------
    .. [1] ros2_controllers, trajectory.rst

    Examples
    --------
    >>> import splinefeed as sf
    >>> text = '''<robot name="turntable"><link name="base"/><link name="table"/><joint
    ... name="turn" type="continuous"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/></joint></robot>'''
    >>> arm = sf.robot(text, limits={"velocity": 2.0, "acceleration": 10.0, "jerk": 200.0}, torque=False)
    >>> path = arm.through([[0.0], [1.0]])
    >>> found = sf.robots.joint_trajectory(path, sf.plan(path, arm.limits, period=1e-3), arm.limits)
    >>> found.joints, found.units, found.notes
    (('turn',), ('rad',), ())
    >>> found.save("move.yaml")
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    t: Array
    position: Array
    velocity: Array
    acceleration: Array
    shares: Mapping[str, float] = field(default_factory=dict)
    off: float = 0.0
    notes: tuple[str, ...] = ()

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
        """Write the message as JSON or YAML, as `ros2 topic pub` takes it, whole or not at all.

        Parameters
        ----------
        file : str or PathLike
            Its name ends in .json, .yaml or .yml.

        Raises
        ------
        FormatError
            For another ending, and for a file that cannot be written.
        """
        name = os.fspath(file)
        if not name.endswith((".json", ".yaml", ".yml")):
            raise FormatError(f"{name}: a JointTrajectory is written as .json or .yaml; name the file so")
        said = self.as_dict()
        rows = ",\n  ".join(map(json.dumps, said["points"]))
        text = f'{{\n "joint_names": {json.dumps(said["joint_names"])},\n "points": [\n  {rows}\n ]\n}}\n'
        # JSON is YAML, but for numbers such as 1e-05, which YAML 1.1 wants with a point
        write_text(name, re.sub(r"(?<![.\d])(\d+)e(?=[-+]?\d)", r"\1.0e", text))


def joint_trajectory(
    path: Track | Run,
    law: TimeLaw | None = None,
    limits: Limits | None = None,
    *,
    tolerance: float = TOLERANCE,
    shortest: float = SHORTEST,
) -> JointTrajectory:
    """Sample a motion as points of a JointTrajectory, so many that the controller's quintics keep path and limits.

    Parameters
    ----------
    path, law, limits : Track, TimeLaw, Limits
        As for `sf.check`; or a Run in place of the path, which has all three.
    tolerance : float, optional
        How far joints may be from the motion between points, rad and mm.
    shortest : float, optional
        Time between points that the receiver takes, s: ros2_controllers takes any, and samples at its ticks; a
        controller that needs a tick for each point, its period.

    Returns
    -------
    JointTrajectory
        Positions are (n, joints).

    Raises
    ------
    InputError
        For a tolerance that is not positive, a shortest time below 2e-5 s, and for motions of too many points.

    Notes
    -----
    Points stand where the jerk jumps, and closer where a quintic [1]_ would leave the motion, or be over a limit
    (velocity, acceleration, jerk, torque and what else models give) and the motion is not. Where `shortest` is not
    close enough, the `notes` of the trajectory say by how much, from 0.1 % on.

    References
    ----------
    .. [1] ros2_controllers, trajectory.rst

    Examples
    --------
    >>> import splinefeed as sf
    >>> line = sf.Path.polyline([[0, 0], [30, 0]])
    >>> run = sf.run(line, sf.Limits(feed=60, acceleration=500, jerk=20000))
    >>> found = sf.robots.joint_trajectory(run)
    >>> found.position[[0, -1]].round(9)
    array([[ 0.,  0.],
           [30.,  0.]])
    """
    if isinstance(path, Run):
        moved, law, limits = path.joints or path.path, path.law, path.limits
    else:
        moved = path
    if law is None or limits is None:
        raise InputError("joint_trajectory: give path, law and limits, or a Run")
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"tolerance is {tolerance!r}; expected rad and mm, greater than 0")
    if not (np.isfinite(shortest) and shortest >= SHORTEST):
        raise InputError(f"shortest is {shortest!r}; expected a time between points of at least {SHORTEST:g} s")
    quintics = _Quintics(moved, law, limits.on(moved.axes))
    t = _times(np.linspace(0.0, law.duration, int(np.ceil(law.duration / LONGEST)) + 1))
    while True:
        if len(t) > MOST_POINTS:
            raise InputError(f"the motion takes more than {MOST_POINTS} points; raise tolerance, or split it")
        off, used, own = quintics.look(t, PLACES)
        bad = (off > (1.0 - FINER) * tolerance) | np.any(used > np.maximum(own, 1.0) * (1.0 + OVER), axis=0)
        more = quintics.between(t, bad, shortest * (1.0 - 1e-6))
        if not len(more):
            break
        t = _times(np.sort(np.concatenate([t, more])))
    off, used, own = quintics.look(t, IN_THE_END)
    over = used > np.maximum(own, 1.0) * (1.0 + KEPT)
    notes = [
        f"{kind}: up to {100.0 * (used[k, i] - 1.0):.2g} % over its limit between the points at {t[i]:.6g} and "
        f"{t[i + 1]:.6g} s; closer than {shortest:g} s they are not put"
        for k, kind in enumerate(quintics.kinds)
        if np.any(over[k])
        for i in [int(np.argmax(np.where(over[k], used[k], 0.0)))]
    ]
    if np.max(off) > tolerance:
        notes.append(f"joints are up to {np.max(off):.3g} rad (mm) from the motion, more than the tolerance")
    return JointTrajectory(
        tuple(moved.axes),
        moved.axis_units,
        t,
        *motion_at(moved, law, t)[:3],
        shares=dict(zip(quintics.kinds, np.max(used, axis=1).tolist(), strict=True)),
        off=float(np.max(off)),
        notes=tuple(notes),
    )


def _times(t: Array) -> Array:
    """Times in whole nanoseconds, as the message has them."""
    return np.asarray(np.rint(t * NANO) / NANO)


class _Quintics:
    """What a controller's polynomials make of points of a motion; kinds  names of what limits bound."""

    def __init__(self, path: Track, law: TimeLaw, limits: Limits) -> None:
        self.path, self.law, self.limits = path, law, limits
        self.kinds = (*AXIS_LIMITS, *(model.kind for model in limits.models))
        self._most = [limits.of_axes(name, path.axes) for name in AXIS_LIMITS]
        self._jumps, self._sizes = self._jumps_of_jerk()

    def _jumps_of_jerk(self) -> tuple[Array, Array]:
        """When the jerk jumps by more than JUMP of a limit, (n,), s, and by what share of the limit, (n,)."""
        path, law = self.path, self.law
        t = np.unique(np.concatenate([law.breaks, times_at(law, path.breaks)]))[1:-1]
        if len(t) < 1:
            return t, t
        beside = 1e-9 * law.duration
        jerks = [motion_at(path, law, np.clip(t + way, 0.0, law.duration))[3] for way in (-beside, beside)]
        size = np.max(np.abs(jerks[1] - jerks[0]) / self._most[2], axis=1)
        return t[size > JUMP], size[size > JUMP]

    def between(self, t: Array, bad: BoolArray, shortest: float) -> Array:
        """One more time, s, for each bad segment of (n - 1,) that has room: at its largest jump, or its middle."""
        i = np.searchsorted(t, self._jumps, side="right") - 1
        room = np.minimum(self._jumps - t[i], t[np.minimum(i + 1, len(t) - 1)] - self._jumps)
        near = bad[np.minimum(i, len(bad) - 1)] & (room >= shortest)
        order = np.argsort(self._sizes[near], kind="stable")  # the largest of a segment is written last
        found = np.where(bad & (np.diff(t) > 2.0 * shortest), 0.5 * (t[1:] + t[:-1]), np.nan)
        found[i[near][order]] = self._jumps[near][order]
        return np.asarray(found[np.isfinite(found)])

    def look(self, t: Array, places: Array) -> tuple[Array, Array, Array]:
        """How far each segment of points t is from the motion, (n - 1,), at shares of its time.

        Also the shares of limits that it uses, and those that the motion itself uses, (kinds, n - 1) each.
        """
        h = np.diff(t)[:, None]
        ends = motion_at(self.path, self.law, t)[:3]
        c = quintic(h, *((each[:-1], each[1:]) for each in ends))
        wanted = motion_at(self.path, self.law, np.minimum((t[:-1] + places[:, None] * h[:, 0]).ravel(), t[-1]))
        shape = (len(places), len(h), ends[0].shape[1])
        found = [derivative(c, np.broadcast_to(places[:, None, None] * h, shape), order) for order in range(4)]
        off = np.max(np.abs(found[0] - wanted[0].reshape(shape)), axis=(0, 2))
        return off, self._shares(found), self._shares([each.reshape(shape) for each in wanted])

    def _shares(self, motion: list[Array]) -> Array:
        """The largest share of each kind of limit, (kinds, n), of joints and three derivatives (k, n, joints)."""
        found = [np.max(np.abs(each) / most, axis=(0, 2)) for each, most in zip(motion[1:], self._most, strict=True)]
        rows = [each.reshape(-1, each.shape[2]) for each in motion]
        for model in self.limits.models:
            columns = model.columns(self.path.axes)
            used, most = model.along(*(each[:, columns] for each in rows))
            share = np.max(np.abs(used) / most, axis=1).reshape(motion[0].shape[:2])
            found.append(np.max(share, axis=0))
        return np.stack(found)


def quintic(h: Array, q: tuple[Array, Array], v: tuple[Array, Array], a: tuple[Array, Array]) -> Array:
    """Compute the polynomials of the controller between states.

    Parameters
    ----------
    h : array (n, 1)
        Times between the states, s.
    q, v, a : tuple of array (n, joints)
        Positions, velocities and accelerations at the beginning and at the end, rad and mm by s.

    Returns
    -------
    array (n, joints, 6)
        Coefficients, from the constant on; the formulas stand at the head of the module.
    """
    d, (v0, v1), (a0, a1) = q[1] - q[0], v, a
    return np.stack(
        [
            q[0],
            v0,
            0.5 * a0,
            (20.0 * d - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h**2) / (2.0 * h**3),
            (-30.0 * d + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h**2) / (2.0 * h**4),
            (12.0 * d - 6.0 * (v1 + v0) * h - (a0 - a1) * h**2) / (2.0 * h**5),
        ],
        axis=-1,
    )

"""Torques of a serial arm of rigid bodies, by recursive Newton-Euler over arrays [1]_.

From the base out to the tip go angular velocity w, its derivative, and the acceleration of each joint's origin (the
base accelerates upwards at g, which is gravity); from the tip back go force f and moment t. For joint k with
axis z, in its own frame, its body of mass m, centre c and inertia I about c:

    a_c = a + dw x c + w x (w x c)      F = m a_c      N = I dw + w x I w + c x F
    f = F + sum of the next body's f    t = N + the next body's t + p x f       torque = z . t, force = z . f

References
----------
.. [1] R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, chapter 5, doi:10.1007/978-1-4899-7560-7.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import FormatError, InputError, nearest
from splinefeed.records import Array
from splinefeed.robots.description import FIXED, Description, JointDescription
from splinefeed.robots.frames import MM, Frames, onto, rotation_of


@dataclass(frozen=True)
class Payload:
    """What an arm carries, fixed to its tip.

    Parameters
    ----------
    mass : float
        In kg.
    center : array (3,), optional
        Of the mass, in the frame of the tip, mm.
    inertia : array (3, 3), optional
        About the centre, in that frame, kg m^2.

    Raises
    ------
    InputError
        For a mass that is negative, and for an inertia that no body can have.

    References
    ----------
    .. [1] wiki.ros.org/urdf/XML, <inertial>

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.robots.Payload(3.0, center=(0, 0, 50)).center
    array([ 0.,  0., 50.])
    """

    mass: float
    center: ArrayLike = (0.0, 0.0, 0.0)
    inertia: ArrayLike | None = None

    def __post_init__(self) -> None:
        mass = finite_array("payload: mass", self.mass, ())
        if mass < 0.0:
            raise InputError(f"payload: mass is {mass:g} kg; it must not be negative")
        inertia = finite_array("payload: inertia", np.zeros((3, 3)) if self.inertia is None else self.inertia, (3, 3))
        moments = np.linalg.eigvalsh(inertia)
        if not np.allclose(inertia, inertia.T) or moments[0] < -1e-9 * moments[-1]:
            raise InputError("payload: inertia must be symmetric, and no moment about any axis negative")
        object.__setattr__(self, "mass", float(mass))
        object.__setattr__(self, "center", finite_array("payload: center", self.center, (3,)))
        object.__setattr__(self, "inertia", inertia)


@dataclass(frozen=True)
class Body:
    """A rigid body: mass, kg; centre (3,), m; inertia (3, 3) about the centre, kg m^2; in the frame of its joint."""

    mass: float
    center: Array
    inertia: Array

    def seen(self, R: Array, p: Array) -> Body:
        """The same body in a frame in which its own is turned by R and lies at p, m."""
        return Body(self.mass, p + R @ self.center, R @ self.inertia @ R.T)

    @classmethod
    def together(cls, bodies: Sequence[Body]) -> Body:
        """Several bodies fixed to each other: I = sum of I_i + m_i (|d|^2 1 - d d'), d from the common centre."""
        mass = math.fsum(each.mass for each in bodies)
        if not mass > 0.0:
            return cls(0.0, np.zeros(3), np.sum([np.zeros((3, 3)), *(each.inertia for each in bodies)], axis=0))
        center = np.sum([each.mass * each.center for each in bodies], axis=0) / mass
        inertia = np.zeros((3, 3))
        for each in bodies:
            d = each.center - center
            inertia += each.inertia + each.mass * (d @ d * np.eye(3) - np.outer(d, d))
        return cls(mass, center, inertia)


class RigidBodies:
    """The masses that each moving joint of an arm carries, and the torques that moving them takes.

    Called with q, q', q'' (n, joints), rad and mm by s, it gives torques (n, joints), N m, and of sliding joints
    forces, N: without friction and without the rotors of motors, as a URDF says nothing of them.

    Parameters
    ----------
    frames : Frames
        Of the arm.
    bodies : iterable of Body
        What each joint carries, in its frame.
    gravity : array (3,)
        In the frame of the base, m/s^2.

    Notes
    -----
    The recursion of Newton and Euler [1]_; its formulas stand at the head of the module.

    References
    ----------
    .. [1] R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, chapter 5, doi:10.1007/978-1-4899-7560-7.
    """

    def __init__(self, frames: Frames, bodies: Iterable[Body], gravity: ArrayLike) -> None:
        self.frames, self.bodies, self.gravity = frames, tuple(bodies), np.asarray(gravity, dtype=np.float64)
        self._scale = np.where(frames.turns, 1.0, 1.0 / MM)

    def carrying(self, payload: Payload) -> RigidBodies:
        """The same arm with something fixed to its tip."""
        mass, center = payload.mass, np.asarray(payload.center) / MM
        inertia = np.asarray(payload.inertia, dtype=np.float64)
        own = Body(mass, center, inertia).seen(self.frames.tip_rotation, self.frames.tip_place / MM)
        return RigidBodies(self.frames, [*self.bodies[:-1], Body.together([self.bodies[-1], own])], self.gravity)

    def __call__(self, q: Array, velocity: Array, acceleration: Array) -> Array:
        """Torques (n, joints), N m and N."""
        frames, n = self.frames, len(q)
        v, a = (self._scale[:, None] * np.asarray(each, dtype=np.float64).T for each in (velocity, acceleration))
        w, dw, acc = np.zeros((3, n)), np.zeros((3, n)), np.repeat(-self.gravity[:, None], n, axis=1)
        forces, moments, turned, places = [], [], [], []
        for k, turns in enumerate(frames.turns):
            R = frames.rotation[k]
            angle = q[:, k] if turns else np.zeros(n)
            turn = np.cos(angle), np.sin(angle)
            p = frames.place[k][:, None] / MM
            if not turns:
                p = p + R[:, 2:] * (q[:, k] / MM)
            p = np.broadcast_to(p, (3, n))
            acc = acc + _cross(dw, p) + _cross(w, _cross(w, p))
            acc, w, dw = (_turned(turn, R.T @ each, -1.0) for each in (acc, w, dw))
            if turns:
                dw = dw + np.stack([w[1] * v[k], -w[0] * v[k], a[k]])  # w x z v + z a
                w = w + np.stack([np.zeros(n), np.zeros(n), v[k]])
            else:
                acc = acc + np.stack([2.0 * w[1] * v[k], -2.0 * w[0] * v[k], a[k]])
            body = self.bodies[k]
            c = np.broadcast_to(body.center[:, None], (3, n))
            F = body.mass * (acc + _cross(dw, c) + _cross(w, _cross(w, c)))
            forces.append(F)
            moments.append(body.inertia @ dw + _cross(w, body.inertia @ w) + _cross(c, F))
            turned.append(turn)
            places.append(p)
        torque = np.empty((n, len(frames.turns)))
        f, t = np.zeros((3, n)), np.zeros((3, n))
        for k in reversed(range(len(frames.turns))):
            f, t = f + forces[k], t + moments[k]
            torque[:, k] = t[2] if frames.turns[k] else f[2]
            f, t = (frames.rotation[k] @ _turned(turned[k], each, 1.0) for each in (f, t))
            t = t + _cross(places[k], f)
        return torque


def bodies_of(description: Description, way: Sequence[JointDescription]) -> tuple[list[Body], list[str], list[str]]:
    """Gather what each moving joint on the way to the tip carries.

    Parameters
    ----------
    description : Description
        Of the robot.
    way : sequence of JointDescription
        From the base to the tip.

    Returns
    -------
    bodies : list of Body
        One a moving joint; other branches hang on it with their joints at 0.
    held : list of str
        Names of those joints.
    without : list of str
        Names of links that have a shape but no inertia and so count for nothing.

    Raises
    ------
    FormatError
        Where nothing that a joint moves has an inertia.
    """
    below: dict[str, list[JointDescription]] = {}
    for joint in description.joints.values():
        below.setdefault(joint.parent, []).append(joint)
    moving = [joint for joint in way if joint.kind != FIXED]
    names = {joint.name for joint in moving}
    found, held, without = [], [], []
    for joint in moving:
        own: list[Body] = []
        waiting = [(joint.child, onto(joint.axis).T, np.zeros(3))]
        while waiting:
            link, R, p = waiting.pop()
            inertia = description.links[link]
            if inertia is not None:
                ixx, ixy, ixz, iyy, iyz, izz = inertia.moments
                matrix = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
                body = Body(inertia.mass, np.zeros(3), matrix)
                own.append(body.seen(R @ rotation_of(inertia.rpy), p + R @ np.asarray(inertia.xyz)))
            elif link in description.shown:
                without.append(link)
            for each in below.get(link, []):
                if each.name not in names:
                    held += [each.name] if each.kind != FIXED else []
                    waiting.append((each.child, R @ rotation_of(each.rpy), p + R @ np.asarray(each.xyz)))
        if not own:
            raise FormatError(
                f"{description.file}: link {joint.child!r} has no <inertial>; torque needs it of every link that "
                "a joint moves: give it, or torque=False"
            )
        found.append(Body.together(own))
    return found, held, without


def payload_of(value: float | Mapping[str, Any] | Payload) -> Payload:
    """A payload of a mass in kg, of a mapping of its fields, or as it is."""
    if isinstance(value, Payload):
        return value
    if isinstance(value, Mapping):
        known = [each.name for each in fields(Payload)]
        for name in value:
            if name not in known:
                raise InputError(f"payload: {name!r} is not known; {nearest(str(name), known)}")
        if "mass" not in value:
            raise InputError("payload: there is no mass; give it in kg")
        return Payload(**value)
    return Payload(value)


def finite_array(what: str, value: object, shape: tuple[int, ...], unit: str = "") -> Any:
    """A value as an array of this shape; InputError for what is none, or not finite."""
    try:
        found = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if found.shape != shape or not np.all(np.isfinite(found)):
        many = f"{' x '.join(map(str, shape))} finite numbers" if shape else "a finite number"
        raise InputError(f"{what} is {value!r}; expected {many}{', ' * bool(unit)}{unit}")
    return found


def _cross(a: Array, b: Array) -> Array:
    """a x b of vectors (3, n)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _turned(turn: tuple[Array, Array], x: Array, way: float) -> Array:
    """A vector (3, n) turned about z (way 1), or back (-1); turn is cosine and sine."""
    c, s = turn[0], way * turn[1]
    return np.stack([c * x[0] - s * x[1], s * x[0] + c * x[1], x[2]])

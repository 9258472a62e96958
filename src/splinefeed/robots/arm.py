"""`sf.robot`: a serial arm from a URDF, with its forward kinematics, torques and limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, FormatError, InputError, nearest
from splinefeed.paths.path import Path
from splinefeed.paths.waypoints import checked_waypoints
from splinefeed.records import Array, Joint, Limits, Torque, TorqueRate
from splinefeed.robots.arm_path import AT_START, TURNED_AT_START, ArmPath, orientation_of, tip_of
from splinefeed.robots.description import FIXED, MOVING, JointDescription, read_description
from splinefeed.robots.dynamics import Payload, RigidBodies, bodies_of, finite_array, payload_of
from splinefeed.robots.frames import Frames
from splinefeed.robots.inverse import Inverse
from splinefeed.robots.joint_limits import Given, friction_of, joint_limits
from splinefeed.robots.waypoint_path import WaypointPath

#: Standard gravity in the frame of the base, m/s^2: an arm that stands on the floor.
GRAVITY = (0.0, 0.0, -9.81)

#: Numbers of a place with its orientation.
POSE = 6


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm: joints in rad, sliding ones in mm, from its base to its tip; `sf.robot` makes it.

    Joints q are (..., joints), as are the torques of `torque`, N m (sliding joints: N).

    Attributes
    ----------
    name : str
        Of the robot.
    joints : tuple of str
        Their names, from the base on.
    turns : tuple of bool
        Which of them turn; the others slide.
    base, tip : str
        Names of links.
    frames : Frames
        Where each joint is in the one before.
    bodies : RigidBodies or None
        The masses that it moves; None without torque.
    minimum, maximum, velocity, acceleration, jerk, most_torque, torque_rate : array (joints,)
        Limits, infinite where there is none.
    friction : mapping of str to mapping
        `coulomb` and `viscous` by joint, which limits of torque count and `torque` does not.
    notes : tuple of str
        What of the files was left out or assumed.

    Raises
    ------
    InputError
        By methods, for joints of another number.

    References
    ----------
    .. [1] wiki.ros.org/urdf/XML

    Examples
    --------
    >>> import splinefeed as sf
    >>> text = '''<robot name="turntable"><link name="base"/><link name="table"/><joint
    ... name="turn" type="continuous"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/></joint></robot>'''
    >>> arm = sf.robot(text, limits={"velocity": 2.0, "acceleration": 10.0, "jerk": 200.0}, torque=False)
    >>> arm.jacobian([0.0])[:, 0]
    array([0., 0., 0., 0., 0., 1.])
    """

    name: str
    joints: tuple[str, ...]
    turns: tuple[bool, ...]
    base: str
    tip: str
    frames: Frames
    bodies: RigidBodies | None
    minimum: Array
    maximum: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    most_torque: Array
    torque_rate: Array
    friction: Mapping[str, Mapping[str, float]]
    notes: tuple[str, ...] = ()

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each joint: rad or mm."""
        return tuple("rad" if turns else "mm" for turns in self.turns)

    @property
    def limits(self) -> Limits:
        """What `sf.plan` and `sf.check` take: velocity, acceleration, jerk and travel of each joint, and its torque."""

        def by_joint(values: Array) -> dict[str, float]:
            return dict(zip(self.joints, values.tolist(), strict=True))

        def limited(values: Array) -> dict[str, float]:
            return {name: value for name, value in by_joint(values).items() if math.isfinite(value)}

        ended = np.isfinite(self.minimum) & np.isfinite(self.maximum)
        torque: dict[str, Any] = {}
        if self.bodies is not None:
            dry = self.friction.get("coulomb"), self.friction.get("viscous")
            torque["torque"] = Torque(self.torque, by_joint(self.most_torque), *dry)
            if np.any(np.isfinite(self.torque_rate)):
                torque["modelled"] = [TorqueRate(self.torque, by_joint(self.torque_rate))]
        return Limits(
            axis_velocity=limited(self.velocity),
            axis_acceleration=limited(self.acceleration),
            axis_jerk=limited(self.jerk),
            axis_minimum=limited(np.where(ended, self.minimum, np.inf)),
            axis_maximum=limited(np.where(ended, self.maximum, np.inf)),
            **torque,
        )

    def through(
        self,
        waypoints: ArrayLike,
        *,
        near: ArrayLike = 0.0,
        duration: float | None = None,
        times: ArrayLike | None = None,
        name: str = "path",
    ) -> Path:
        """Make one smooth path through joint waypoints, which stops only at its ends.

        Parameters
        ----------
        waypoints : array (n, joints)
            In rad, of sliding joints in mm.
        near : float or array (joints,), optional
            How far each joint may pass beside a waypoint, rad or mm; ends are met.
        duration : float, optional
            Wanted of the whole motion, s: `sf.plan` slows it down as a whole.
        times : array (n,), optional
            Wanted at each waypoint, s, the first 0, NaN where any will do: `sf.plan` slows down what is too early.
        name : str, optional
            In files and figures.

        Returns
        -------
        Path
            The natural spline of degree 5 [1]_, which bends least and hardly swings beyond waypoints: a curve from each
            to the next.

        Raises
        ------
        CurveError
            For waypoints that are the same or out of limits.
        PlanError
            By `sf.plan`, for times that are too short, with the shortest.

        References
        ----------
        .. [1] E. T. Y. Lee, Computer-Aided Design 21(6), 1989.
        """
        points = checked_waypoints(waypoints, self.joints)
        for row, point in enumerate(points):
            if out := self._out(point):
                raise CurveError(f"waypoint {row + 1} has {out}")
        how: dict[str, Any] = {"near": near, "duration": duration, "times": times, "name": name}
        # each joint is measured by its velocity limit: so joints in rad and in mm count alike
        return WaypointPath.through(points, self.joints, weights=1.0 / self.velocity, frames=self.frames, **how)

    def along(
        self,
        curve: Path | NurbsCurve,
        *,
        start: ArrayLike,
        orientation: ArrayLike | None = None,
        hold: str | Sequence[str] = (),
        feed: float | None = None,
    ) -> ArmPath:
        """Make the joints along a curve of the tip, exact at every place.

        Parameters
        ----------
        curve : Path or NurbsCurve
            Of x, y, z, mm, in the base's frame.
        start : array (joints,)
            Joints where the curve begins, rad, sliding ones mm; `inverse` finds them.
        orientation : array, optional
            Of the tip: a rotation (3, 3) or quaternion x, y, z, w; quaternions (k, 4) at equal shares of the length,
            through which it turns smoothly; default that of the start, all along.
        hold : str or sequence of str, optional
            The joints beyond six, which stay as they start.
        feed : float, optional
            Of the tip, mm/s, a limit like any.

        Returns
        -------
        ArmPath
            `sf.plan` and all else takes it as it takes a path.

        Raises
        ------
        InputError
            For a start that is not on the curve.
        CurveError
            Where the curve is out of reach or the arm singular, with the place.
        LimitsError
            Where a joint leaves its limits, with the place.
        """
        joints, free = self._start(start), self._free(hold)
        tip = tip_of(curve, feed)
        turn = orientation_of(orientation, joints, self.frames, tip.length)
        found = ArmPath(self.name, self.joints, self.frames, tip, turn, joints, free)
        found.check_travel(self.limits.travel_of(self.joints))
        return found

    def inverse(
        self, place: ArrayLike, orientation: ArrayLike | None, start: ArrayLike, *, hold: str | Sequence[str] = ()
    ) -> Array:
        """Find joints whose tip is at a place, and stands so.

        Parameters
        ----------
        place : array (3,)
            Of the tip, mm.
        orientation : array or None
            A rotation (3, 3) or a quaternion (4,), x, y, z, w; None for that at `start`.
        start : array (joints,)
            Where the search begins, rad and mm.
        hold : str or sequence of str, optional
            Joints that stay as they start.

        Returns
        -------
        array (joints,)
            In rad, sliding joints mm.

        Raises
        ------
        InputError
            For what is not reached, with how far it is off, and unless six joints are free.
        """
        joints, free = self._start(start), self._free(hold)
        wanted = finite_array("place", place, (3,), "mm")
        turn = orientation_of(orientation, joints, self.frames, 1.0).jets(np.zeros(1), 0)[0, 0]
        found, left = Inverse(self.frames, free).damped(joints, wanted, turn)
        away, angle = 1000.0 * float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))
        if away > AT_START or angle > TURNED_AT_START:
            raise InputError(
                f"place {wanted.tolist()} is not reached from start: the tip stays {away:.4g} mm and {angle:.4g} rad "
                "away; give a start nearer to it, or another orientation"
            )
        return found

    def _start(self, start: ArrayLike) -> Array:
        joints = self._joints(start)
        if joints.ndim != 1 or not np.all(np.isfinite(joints)):
            raise InputError(f"start has shape {joints.shape}; expected {len(self.joints)} finite joints")
        if out := self._out(joints):
            raise InputError(f"start has {out}")
        return joints

    def _out(self, joints: Array) -> str:
        """Which of joints (joints,) is furthest out of its travel, in words; empty where none is."""
        out = np.maximum(self.minimum - joints, joints - self.maximum)
        k = int(np.argmax(out))
        ends = f"{self.minimum[k]:g} to {self.maximum[k]:g}"
        return f"{self.joints[k]} at {joints[k]:g} {self.units[k]}; its limits are {ends}" if out[k] > 0.0 else ""

    def _free(self, hold: str | Sequence[str]) -> tuple[int, ...]:
        """The joints that follow a pose: all but those that are held; InputError unless they are six."""
        held = (hold,) if isinstance(hold, str) else tuple(hold)
        for name in held:
            if name not in self.joints:
                raise InputError(f"hold: the arm has no joint {name!r}; {nearest(name, self.joints)}")
        free = tuple(k for k, name in enumerate(self.joints) if name not in held)
        if len(free) != POSE:
            more = len(free) - POSE
            said = f"hold {more} of {', '.join(self.joints)}" if more > 0 else "an arm along a curve moves six"
            raise InputError(f"hold: {len(free)} joints are free, and a place with its orientation takes 6; {said}")
        return free

    def forward(self, q: ArrayLike) -> tuple[Array, Array]:
        """Compute where the tip is.

        Parameters
        ----------
        q : array (..., joints)
            Joints, rad, sliding ones mm.

        Returns
        -------
        place : array (..., 3)
            Of the tip in the base's frame, mm.
        rotation : array (..., 3, 3)
            Of the tip in that frame.
        """
        joints = self._joints(q)
        place, rotation = self.frames.pose(joints.reshape(1, -1, len(self.joints)))
        shape = joints.shape[:-1]
        return place[0].reshape(*shape, 3), rotation[0].reshape(*shape, 3, 3)

    def derivatives(self, q: ArrayLike) -> tuple[Array, Array]:
        """Compute the place and the rotation of the tip, and their derivatives.

        Parameters
        ----------
        q : array (order + 1, n, joints)
            Joints, rad and mm, and their derivatives by any one parameter: by t, velocity and acceleration.

        Returns
        -------
        place : array (order + 1, n, 3)
            mm, by the same parameter.
        rotation : array (order + 1, n, 3, 3)
            Of the tip in the base's frame.
        """
        given = self._joints(q)
        if given.ndim != 3:
            raise InputError(f"joints have shape {given.shape}; expected (order + 1, n, {len(self.joints)})")
        orders = np.array([float(math.factorial(k)) for k in range(len(given))])
        place, rotation = self.frames.pose(given / orders[:, None, None])
        return place * orders[:, None, None], rotation * orders[:, None, None, None]

    def jacobian(self, q: ArrayLike) -> Array:
        """Compute the velocity and the angular velocity of the tip by each joint.

        Parameters
        ----------
        q : array (..., joints)
            Joints, rad, sliding ones mm.

        Returns
        -------
        array (..., 6, joints)
            Three rows of velocity, mm, then three of angular velocity, rad, by rad or mm of each joint, in the base's
            frame.
        """
        joints = self._joints(q)
        found = self.frames.jacobian(joints.reshape(-1, len(self.joints)))
        return found.reshape(*joints.shape[:-1], *found.shape[1:])

    def torque(self, q: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike) -> Array:
        """Compute the torques that rigid bodies need for a motion, without friction.

        Parameters
        ----------
        q, velocity, acceleration : array (..., joints)
            Of the joints, in rad (sliding joints: mm) and s.

        Returns
        -------
        array (..., joints)
            N m; of sliding joints forces, N.

        Raises
        ------
        InputError
            For an arm that was read with torque=False.
        """
        if self.bodies is None:
            raise InputError(f"{self.name}: was read with torque=False; leave that out for torques")
        given = np.broadcast_arrays(*(self._joints(each) for each in (q, velocity, acceleration)))
        rows = [each.reshape(-1, len(self.joints)) for each in given]
        return self.bodies(rows[0], rows[1], rows[2]).reshape(given[0].shape)

    def _joints(self, q: ArrayLike) -> Array:
        joints = np.asarray(q, dtype=np.float64)
        if not joints.ndim or joints.shape[-1] != len(self.joints):
            raise InputError(
                f"joints have shape {joints.shape}; the last is {len(self.joints)}: {', '.join(self.joints)}"
            )
        return joints

    def __repr__(self) -> str:
        return f"Arm({self.name!r}, {self.base} to {self.tip}, joints {' '.join(self.joints)})"


def robot(
    urdf: str | FilePath,
    tip: str | None = None,
    *,
    base: str | None = None,
    limits: Given = None,
    payload: float | Mapping[str, Any] | Payload = 0.0,
    torque: bool = True,
    friction: Mapping[str, Any] | None = None,
    gravity: Sequence[float] = GRAVITY,
) -> Arm:
    """Read the serial arm from link `base` to link `tip` of a robot.

    Parameters
    ----------
    urdf : str or Path
        File, or its text; xacro already expanded.
    tip : str, optional
        Link at the end of the arm; may be left out where the robot has one end.
    base : str, optional
        Link where the arm begins; default the root.
    limits : str, Path or mapping, optional
        A file joint_limits.yaml of MoveIt (needs the extra [robots]), or a mapping of minimum, maximum, velocity,
        acceleration, jerk, torque and torque_rate to a number, a list in the order of the joints, or values by name:
        rad (sliding joints: mm), s, N m (N). What it gives stands before <limit> of the URDF; nothing is guessed.
    payload : float, mapping or Payload, optional
        Mass at the tip, kg, or a `Payload` with its centre and inertia.
    torque : bool, optional
        Whether torques and their limits are read; False for a URDF without inertia.
    friction : mapping, optional
        Of coulomb, N m (N), and viscous, N m s/rad (N s/mm), to values as those of limits: what limits of torque
        count, too; the <dynamics> of a URDF is often made up, and is not read.
    gravity : array (3,), optional
        In the frame of the base, m/s^2.

    Returns
    -------
    Arm
        Joints beside the way to the tip (fingers) hang on it at 0; `notes` names them. Links are rigid: motors' rotors,
        and friction that is not given, are not counted.

    Raises
    ------
    FormatError
        For a file that is no URDF of a serial arm, with line, value and mend.
    LimitsError
        For limits that are missing: it names every one.

    References
    ----------
    .. [1] wiki.ros.org/urdf/XML

    Examples
    --------
    >>> import splinefeed as sf
    >>> text = '''<robot name="turntable"><link name="base"/><link name="table"/><joint
    ... name="turn" type="continuous"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/></joint></robot>'''
    >>> arm = sf.robot(text, limits={"velocity": 2.0, "acceleration": 10.0, "jerk": 200.0}, torque=False)
    >>> arm.joints, arm.units
    (('turn',), ('rad',))
    """
    description = read_description(urdf)
    way, tip = description.joints_to(tip, base)
    moving = [joint for joint in way if joint.kind != FIXED]
    _refuse(moving, description.file, tip)
    frames = Frames.of_joints(way)
    bodies = None
    notes: list[str] = []
    carried = payload_of(payload)
    if torque:
        own, held, without = bodies_of(description, way)
        pull = finite_array("gravity", gravity, (3,), "m/s^2")
        bodies = RigidBodies(frames, own, pull).carrying(carried)
        if held:
            notes.append(f"{len(held)} joint(s) beside the arm stay at 0 and are carried: {', '.join(sorted(held))}")
        if without:
            names = ", ".join(without)
            notes.append(f"{len(without)} link(s) have a shape but no <inertial> and weigh nothing: {names}")
    elif carried.mass > 0.0:
        raise InputError("payload: it counts for torque alone, and torque=False is given; leave one of them out")
    units = ("rad" if turns else "mm" for turns in frames.turns)
    called = tuple(Joint(joint.name, unit) for joint, unit in zip(moving, units, strict=True))
    found, own_notes = joint_limits(moving, tuple(description.joints), limits, torque=torque)
    return Arm(
        name=description.name,
        joints=called,
        turns=frames.turns,
        base=way[0].parent,
        tip=tip,
        frames=frames,
        bodies=bodies,
        most_torque=found.pop("torque"),
        **found,
        friction=friction_of(friction, called),
        notes=tuple([*notes, *own_notes]),
    )


def _refuse(moving: Sequence[JointDescription], file: str, tip: str) -> None:
    """FormatError for joints on the way to the tip that are not those of a serial arm."""
    if not moving:
        raise FormatError(f"{file}: no joint moves link {tip!r}; name a link at the end of the arm")
    for joint in moving:
        place = f"{file}: line {joint.line}: joint {joint.name!r}"
        if joint.kind not in MOVING:
            raise FormatError(f"{place} is {joint.kind}; an arm has joints {', '.join(MOVING)} and fixed")
        if joint.mimic:
            raise FormatError(f"{place} mimics another; a serial arm moves each joint by itself: name a tip before it")

"""Where the joints of a serial arm are in one another: constant frames whose z is the joint's axis, and jets of poses.

A pose is a rotation R and a place p. With z along the axis of each joint, a joint that turns by q mixes two columns,

    R (x, y, z) -> (cos q x + sin q y, cos q y - sin q x, z),

and one that slides by q moves p by q z. Over arrays: vectors are (3, n), rotations three of them, their columns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.kinematics.jets import Jet, sin_cos
from splinefeed.records import Array
from splinefeed.robots.description import JointDescription, Vector

#: mm in a metre.
MM = 1000.0


def rotation_of(rpy: Vector) -> Array:
    """The rotation (3, 3) of roll, pitch and yaw, rad, about the fixed axes x, y, z in this order."""
    (cr, cp, cy), (sr, sp, sy) = (tuple(map(f, rpy)) for f in (math.cos, math.sin))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def onto(axis: Vector) -> Array:
    """A rotation (3, 3) whose third column is this axis."""
    z = np.asarray(axis) / math.hypot(*axis)
    least = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(least, z) / np.linalg.norm(np.cross(least, z))
    return np.stack([x, np.cross(z, x), z], axis=1)


@dataclass(frozen=True)
class Frames:
    """A serial arm as constants: where the frame of each moving joint is in the one before, and the tip in the last.

    Parameters
    ----------
    turns : tuple of bool
        Of each joint whether it turns; else it slides.
    rotation, place : array (joints, 3, 3), array (joints, 3)
        Of the joint's frame, its z along the axis, in the one before; mm.
    tip_rotation, tip_place : array (3, 3), array (3,)
        Of the tip in the frame of the last joint; mm.
    """

    turns: tuple[bool, ...]
    rotation: Array
    place: Array
    tip_rotation: Array
    tip_place: Array

    @classmethod
    def of_joints(cls, way: Sequence[JointDescription]) -> Frames:
        """From the joints of a URDF on the way to the tip; fixed ones become part of the next frame."""
        R, p = np.eye(3), np.zeros(3)
        turns, rotations, places = [], [], []
        for joint in way:
            p = p + R @ (MM * np.asarray(joint.xyz))
            R = R @ rotation_of(joint.rpy)
            if joint.kind == "fixed":
                continue
            own = onto(joint.axis)
            turns.append(joint.kind != "prismatic")
            rotations.append(R @ own)
            places.append(p)
            R, p = own.T, np.zeros(3)
        return cls(tuple(turns), np.array(rotations), np.array(places), R, p)

    def pose(self, q: Array) -> tuple[Array, Array]:
        """Compute the tip for Taylor coefficients of the joints.

        Parameters
        ----------
        q : array (order + 1, n, joints)
            c_k = q^(k) / k!, rad and mm.

        Returns
        -------
        place : array (order + 1, n, 3)
            Taylor coefficients of the place of the tip, mm.
        rotation : array (order + 1, n, 3, 3)
            Those of its rotation.
        """
        place, columns, _, _ = self._walk(q)
        return np.moveaxis(place.c, 1, 2), np.stack([np.moveaxis(each.c, 1, 2) for each in columns], axis=-1)

    def jacobian(self, q: Array) -> Array:
        """Compute how tip and orientation move with each joint.

        Parameters
        ----------
        q : array (n, joints)
            Joints, rad and mm.

        Returns
        -------
        array (n, 6, joints)
            mm, then rad, by rad or mm of each joint, in the base's frame.
        """
        return self.pose_and_jacobian(q)[2]

    def pose_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Tip: place (n, 3), mm, rotation (n, 3, 3) and Jacobian (n, 6, joints), for joints q (n, joints)."""
        place, columns, axes, origins = self._walk(q[None])
        found = np.zeros((len(q), 6, len(self.turns)))
        tip = place.value.T
        for k, (turns, axis, origin) in enumerate(zip(self.turns, axes, origins, strict=True)):
            z = axis.value.T
            found[:, :3, k] = np.cross(z, tip - origin.value.T) if turns else z
            found[:, 3:, k] = z if turns else 0.0
        return tip, np.stack([each.value.T for each in columns], axis=-1), found

    def sticks(self, q: Array) -> Array:
        """Compute the lines of an arm, for pictures.

        Parameters
        ----------
        q : array (n, joints)
            Joints, rad and mm.

        Returns
        -------
        array (n, joints + 2, 3)
            Base, each joint and the tip, mm.
        """
        place, _, _, origins = self._walk(q[None])
        points = [np.zeros_like(place.value), *(each.value for each in origins), place.value]
        return np.stack([each.T for each in points], axis=1)

    def _walk(self, q: Array) -> tuple[Jet, list[Jet], list[Jet], list[Jet]]:
        """Place of the tip, columns of its rotation, and axis and origin of every joint, jets of (3, n)."""
        order, n = len(q), q.shape[1]
        still = np.zeros((order, 3, n))
        place = Jet(still.copy())
        columns = []
        for unit in np.eye(3):
            c = still.copy()
            c[0] = unit[:, None]
            columns.append(Jet(c))
        axes, origins = [], []
        for k, turns in enumerate(self.turns):
            place, columns = _moved(place, columns, self.rotation[k], self.place[k])
            at = Jet(q[:, None, :, k])
            axes.append(columns[2])
            if turns:
                sine, cosine = sin_cos(at)
                assert isinstance(sine, Jet)
                assert isinstance(cosine, Jet)
                x, y, z = columns
                columns = [cosine * x + sine * y, cosine * y - sine * x, z]
            else:
                place = place + at * columns[2]
            origins.append(place)
        place, columns = _moved(place, columns, self.tip_rotation, self.tip_place)
        return place, columns, axes, origins


def _moved(place: Jet, columns: list[Jet], R: Array, p: Array) -> tuple[Jet, list[Jet]]:
    """A pose followed by a constant one."""
    x, y, z = (each.c for each in columns)
    turned = [Jet(x * a + y * b + z * c) for a, b, c in R.T]
    return Jet(place.c + x * p[0] + y * p[1] + z * p[2]), turned

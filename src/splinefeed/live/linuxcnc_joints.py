"""Joints of LinuxCNC's kinematics modules that are no axes: where they are for a pose.

Formulas: LinuxCNC's manual page kins(9) and "5-Axis Kinematics" of its documentation, as `kinematics.chains` has them;
signs and the order of joints are those that the modules answer. They are affine in the lengths of a machine, which no
INI file has: real time asks the module that is loaded for the joints at some poses as motion from rest is to begin, and
these tell the lengths. A module that answers something else is not what is known, and nothing is planned.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import SplinefeedError
from splinefeed.kinematics import kinematics
from splinefeed.kinematics.jets import Number, sin_cos
from splinefeed.kinematics.with_joints import Joints
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.records import Array

#: Axes of LinuxCNC in the order of its poses.
LETTERS = "xyzabcuvw"
Pose = Mapping[str, Number]
#: Poses whose joints real time tells: lengths in mm, angles in rad; answers may be off by so much, mm.
_TURNS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1], [2, 2, 2]])
PROBES = np.zeros((wires.PROBES, wires.AXES))
PROBES[:8, 3:6] = 0.5 * _TURNS
PROBES[8:, :3] = [[10, 0, 0], [0, 20, 0], [0, 0, 30], [10, 20, 30]]
PROBES[8:, 3:6] = [[0.3, 0.2, 0.1], [0.1, 0.3, -0.2], [-0.2, 0.1, 0.3], [0.3, -0.1, 0.2]]
PROBES[8:, 6:] = [[0, 0, 4], [5, 0, 0], [0, 6, 0], [7, 8, 9]]
NEAR = 1e-6


@dataclass(frozen=True)
class Module:
    """One kinematics module.

    Parameters
    ----------
    order : str
        Letters of its joints.
    free : bool
        Whether coordinates= may say another order.
    needs : str
        Axes that it has to have.
    moved : str
        Letters of the joints that are no axes, one of each formula.
    at : callable
        Gives joints `moved`, mm, for a pose, mm and rad, and lengths, mm.
    lengths : tuple of str, optional
        Names of HAL pins, behind that of the module and a dot.
    bend : bool, optional
        Whether joints move along curves while axes move along lines.
    """

    order: str
    free: bool
    needs: str
    moved: str
    at: Callable[[Pose, Mapping[str, float]], Sequence[Number]]
    lengths: tuple[str, ...] = ()
    bend: bool = True


def _core(pose: Pose, lengths: Mapping[str, float]) -> Sequence[Number]:
    return pose["x"] + pose["y"], pose["x"] + -1.0 * pose["y"]


def _rotated(pose: Pose, lengths: Mapping[str, float]) -> Sequence[Number]:
    s, c = sin_cos(pose.get("c", 0.0))
    return pose["x"] * c + -1.0 * (pose["y"] * s), pose["x"] * s + pose["y"] * c


def _table(kind: str, turns: str) -> Callable[[Pose, Mapping[str, float]], Sequence[Number]]:
    def at(pose: Pose, lengths: Mapping[str, float]) -> Sequence[Number]:
        chain = kinematics(kind, **lengths)
        place = pose["x"], pose["y"], pose["z"] + -lengths["tool-offset"]
        return chain.slides(place, (pose[turns[0]], pose[turns[1]]))

    return at


def _head(pose: Pose, lengths: Mapping[str, float]) -> Sequence[Number]:
    chain, turns = kinematics("5axiskins", **lengths), (pose["b"], pose["c"])
    found = chain.slides((pose["x"], pose["y"], pose["z"]), turns)
    along = pose.get("w", 0.0)  # of the tool
    return [one + along * other for one, other in zip(found, chain.axis(turns), strict=True)]


_TABLE = ("x-rot-point", "y-rot-point", "z-rot-point")
#: Every module that can be planned, but for the one whose joints are axes.
MODULES = {
    "corexykins": Module("xyzabcuvw", False, "xy", "xy", _core, bend=False),
    "rotatekins": Module("xyzabc", False, "xy", "xy", _rotated),
    "xyzac-trt-kins": Module(
        "xyzac", True, "xyzac", "xyz", _table("xyzac-trt", "ac"), (*_TABLE, "y-offset", "z-offset", "tool-offset")
    ),
    "xyzbc-trt-kins": Module(
        "xyzbc", True, "xyzbc", "xyz", _table("xyzbc-trt", "bc"), (*_TABLE, "x-offset", "z-offset", "tool-offset")
    ),
    "5axiskins": Module("xyzbcw", True, "xyzbc", "xyz", _head, ("pivot-length",)),
}


@dataclass(frozen=True, eq=False)
class MovedJoints:
    """The joints of a machine that are no axes.

    Parameters
    ----------
    name, module : str, Module
        Of the kinematics.
    axes : tuple of str
        Of the machine, in the planner's order.
    letters : tuple of str
        Of each joint, whose formula it is.
    numbers : tuple of int
        Of each joint.
    """

    name: str
    module: Module
    axes: tuple[str, ...]
    letters: tuple[str, ...]
    numbers: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What limits call them."""
        return tuple(f"joint {number}" for number in self.numbers)

    def with_lengths(self, lengths: Mapping[str, float]) -> Joints:
        """How they move with these lengths, mm; others are 0."""
        columns = [self.module.moved.index(letter) for letter in self.letters]
        known = {**dict.fromkeys(self.module.lengths, 0.0), **lengths}

        def of(r: tuple[Number, ...]) -> tuple[Number, ...]:
            found = self.module.at(dict(zip(self.axes, r, strict=True)), known)
            return tuple(found[k] for k in columns)

        return Joints(self.names, of, bend=self.module.bend)

    def at(self, joints: Joints, poses: Array) -> Array:
        """Joints (n, joints), mm, at poses (n, 9), mm and rad."""
        columns = [LETTERS.index(axis) for axis in self.axes]
        return joints.beside(poses[:, None, columns])[:, 0, len(columns) :]

    def answering(self, found: Array) -> Joints:
        """Find how they move on a machine that answers.

        Parameters
        ----------
        found : array (probes, joints)
            Where the machine has them at PROBES, mm.

        Returns
        -------
        Joints
            With the lengths that the answers tell.

        Raises
        ------
        SplinefeedError
            Where the machine has other kinematics: neither these nor, as a module may be switched, the trivial ones.
        """
        names = self.module.lengths
        fixed = self.at(self.with_lengths({}), PROBES)
        shares = [(self.at(self.with_lengths({name: 1.0}), PROBES) - fixed).ravel() for name in names]
        values: list[float] = []
        if names and np.all(np.isfinite(found)):
            values = np.linalg.lstsq(np.stack(shares, axis=1), (found - fixed).ravel(), 1e-12)[0].tolist()
        columns = [self.axes.index(letter) for letter in self.letters]
        for joints in (
            self.with_lengths(dict(zip(names, values, strict=False))),
            Joints(self.names, lambda r: tuple(r[k] for k in columns), bend=False),
        ):
            if np.allclose(self.at(joints, PROBES), found, rtol=NEAR, atol=NEAR):
                return joints
        raise SplinefeedError(f"the machine's kinematics are neither those of {self.name} nor trivial: not planned")

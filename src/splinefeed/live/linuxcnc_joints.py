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

    order    letters of its joints;  free  whether coordinates= may say another order
    needs    axes that it has to have
    moved    letters of the joints that are no axes, one of each formula
    at       joints `moved`, mm, for a pose, mm and rad, and lengths, mm
    lengths  names of HAL pins, behind that of the module and a dot
    bend     whether joints move along curves while axes move along lines
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

    name, module  of the kinematics; axes  of the machine, in the planner's order; linear  mm of a linear unit
    letters  of each joint, whose formula it is;  numbers  of each joint
    """

    name: str
    module: Module
    axes: tuple[str, ...]
    linear: float
    letters: tuple[str, ...]
    numbers: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What limits call them."""
        return tuple(f"joint {number}" for number in self.numbers)

    def with_lengths(self, lengths: Mapping[str, float]) -> Joints:
        """How they move with these lengths, mm; others are 0."""
        return self._joints({**dict.fromkeys(self.module.lengths, 0.0), **lengths})

    def answering(self, found: Array) -> Joints:
        """How they move on the machine that has them at (probes, joints), mm, at PROBES.

        Raises SplinefeedError where the machine has other kinematics: neither these nor, as a module may be switched,
        the trivial ones.
        """
        names = self.module.lengths
        fixed = self._at(self.with_lengths({}))
        shares = [self._at(self.with_lengths({name: 1.0})) - fixed for name in names]
        values: Array = np.zeros(0)
        if names and np.all(np.isfinite(found)):
            shares_of = np.stack([each.ravel() for each in shares], axis=1)
            values = np.asarray(np.linalg.lstsq(shares_of, (found - fixed).ravel(), 1e-12)[0], dtype=np.float64)
        for joints in (
            self.with_lengths(dict(zip(names, values.tolist(), strict=False))),
            Joints(self.names, self._trivial, bend=False),
        ):
            if self._off(self._at(joints), found) < NEAR:
                return joints
        raise SplinefeedError(f"the machine's kinematics are neither those of {self.name} nor trivial: not planned")

    @staticmethod
    def _off(one: Array, other: Array) -> float:
        with np.errstate(invalid="ignore"):
            return float(np.max(np.nan_to_num(np.abs(one - other) / (1.0 + np.abs(other)), nan=np.inf)))

    def _pose(self, row: Array) -> tuple[float, ...]:
        return tuple(float(row[LETTERS.index(axis)]) for axis in self.axes)

    def _at(self, joints: Joints) -> Array:
        """Joints (probes, joints) at PROBES."""
        return np.array([[float(np.asarray(each)) for each in joints.of(self._pose(row))] for row in PROBES])

    def _joints(self, lengths: Mapping[str, float]) -> Joints:
        columns = [self.module.moved.index(letter) for letter in self.letters]

        def of(r: tuple[Number, ...]) -> tuple[Number, ...]:
            found = self.module.at(dict(zip(self.axes, r, strict=True)), lengths)
            return tuple(found[k] for k in columns)

        return Joints(self.names, of, bend=self.module.bend)

    def _trivial(self, r: tuple[Number, ...]) -> tuple[Number, ...]:
        return tuple(r[self.axes.index(letter)] for letter in self.letters)

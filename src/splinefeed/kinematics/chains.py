"""The machines: which joints they have, where their axes turn, and both directions of the transformation.

Named and signed as LinuxCNC's kinematics modules are (LinuxCNC 2.9 documentation, "5-Axis Kinematics"): with P the tool
tip on the workpiece, k the tool axis from the tip to the spindle, and R the rotations of a table,

    xyzac-trt   q = Rx(A) (Rz(C) (P - p) - d) + d + p + (0, 0, tool-offset),  d = (0, y-offset, z-offset)
    xyzbc-trt   q = Ry(B) (Rz(C) (P - p) - d) + d + p + (0, 0, tool-offset),  d = (x-offset, 0, z-offset)
    5axiskins   q = P + (pivot-length + tool-offset) k - (0, 0, pivot-length)
    head-table  q = Rz(C) (P - p) + p + (pivot-length + tool-offset) (sin B, 0, cos B) - (0, 0, pivot-length)
    xy-theta    q = Rz(theta) (P - p) + p: the table turns about p, the tool stands upright
    gantry      two joints that move as one: q = (x, y, z, y2 = y + skew)

p is the point about which a table turns (x-rot-point, y-rot-point, z-rot-point), joints are in mm and rad. P is the tip
itself: LinuxCNC's modules take P + (0, 0, tool-offset), as its G43 says, and have tool-offset in d, or in pivot-length;
the joints are the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar

import numpy as np

from splinefeed.errors import InputError
from splinefeed.kinematics.jets import Jet, Number, angle, sin_cos
from splinefeed.records import Array

Vector = tuple[Number, Number, Number]
Turn = tuple[tuple[int, int], int, tuple[float, float]]
"""A turn of the table: the two coordinates that it turns, by which rotary joint, and about which place, mm."""
X, Y, Z = 0, 1, 2


@dataclass(frozen=True, kw_only=True)
class Kinematics:
    """One machine; what every kind of it has.

    kind     its name in a machine file
    joints   names of its joints, the linear ones first
    rotary   how many of them turn: 2 with a tool axis, 1 with an angle in the plane, 0 with neither
    azimuth  azimuth of the tool axis as (sign, offset rad) of the last joint;  tilt  sign of its tilt in the first one
    `forward` takes joints (..., joints), mm and rad, to tip (..., 3), mm, and tool axis (..., 3). A machine file makes
    it, whose reader raises MachineError. Source: docs/how-to/five-axis.md; the trivial and table kinds of LinuxCNC's
    manual. Example: `sf.Machine.load("trunnion").kinematics.joints`
    """

    kind: ClassVar[str] = ""
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    rotary: ClassVar[int] = 0
    tilt: ClassVar[float] = 1.0
    azimuth: ClassVar[tuple[float, float]] = (1.0, 0.0)

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            place = f"kinematics.{each.name.replace('_', '-')}"
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"{place} is {value!r}; expected a finite length in mm")
            object.__setattr__(self, each.name, float(value))

    @property
    def parameters(self) -> dict[str, float]:
        """Lengths, mm, by the names that LinuxCNC's pins have; what must not be given and is 0 is left out."""
        values = {each.name.replace("_", "-"): getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in values.items() if value != 0.0 or parameters_of(self.kind)[name]}

    @property
    def linear(self) -> int:
        """How many joints are linear; they are the first ones."""
        return len(self.joints) - self.rotary

    def table(self) -> tuple[Turn, ...]:
        """How the table turns the workpiece, from the workpiece on; empty where it stands still."""
        return ()

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """Where the linear joints are seen from the tip, mm: what the head and the tool add, by the rotary joints."""
        return 0.0, 0.0, 0.0

    def slides(self, p: Vector, turns: tuple[Number, ...]) -> tuple[Number, ...]:
        """The linear joints, mm, that put the tool tip at p when the rotary ones are at `turns`, rad."""
        place = self._turned(p, turns, 1)
        return tuple(at + arm for at, arm in zip(place, self.reach(turns), strict=True))

    def tip(self, q: tuple[Number, ...]) -> Vector:
        """Tool tip on the workpiece, mm, for joints q: the way of `slides` back."""
        x, y, z = (at - arm for at, arm in zip(q, self.reach(q[3:]), strict=False))
        return self._turned((x, y, z), q[3:], -1)

    def _turned(self, p: Vector, turns: tuple[Number, ...], way: int) -> Vector:
        """A place turned with the table (way 1), or back (-1)."""
        place = list(p)
        for (i, j), k, (x, y) in self.table()[::way]:
            s, c = sin_cos(turns[k] * float(way))
            one, other = place[i] - x, place[j] - y
            place[i], place[j] = one * c - other * s + x, one * s + other * c + y
        return place[0], place[1], place[2]

    def axis(self, turns: tuple[Number, ...]) -> Vector:
        """Tool axis on the workpiece, a unit vector from the tip to the spindle, for rotary joints, rad."""
        if self.rotary < 2:
            return 0.0, 0.0, 1.0
        sign, offset = self.azimuth
        (s, c), (up, across) = sin_cos(self.tilt * turns[0]), sin_cos(sign * turns[1] + offset)
        return s * across, s * up, c

    def forward(self, joints: Array) -> tuple[Array, Array]:
        """Tool tip and tool axis on the workpiece, (n, 3) each, for joints (n, joints), mm and rad."""
        joints = np.asarray(joints, dtype=np.float64)
        q = tuple(np.moveaxis(joints, -1, 0))
        parts = *self.tip(q), *self.axis(q[self.linear :])
        found = np.stack([np.broadcast_to(np.asarray(part), joints.shape[:-1]) for part in parts], axis=-1)
        return found[..., :3], found[..., 3:]

    def turn(self, k: tuple[Jet, Jet, Jet]) -> Jet:
        """The last joint, rad, for the tool axis k, k_xy not 0; half a turn further is right, too."""
        sign, offset = self.azimuth
        return sign * (angle(k[1], k[0]) - offset)

    def tilted(self, k: tuple[Jet, Jet, Jet], turn: Jet) -> Jet:
        """The first rotary joint, rad, for the tool axis k and one of its turns: of either sign."""
        sign, offset = self.azimuth
        s, c = sin_cos(sign * turn + offset)
        return self.tilt * angle(c * k[0] + s * k[1], k[2])


@dataclass(frozen=True, kw_only=True)
class _Table(Kinematics):
    """A table that turns by the last joint about the z axis through p = (x, y, z)-rot-point."""

    x_rot_point: float = 0.0
    y_rot_point: float = 0.0
    z_rot_point: float = 0.0

    def table(self) -> tuple[Turn, ...]:
        """Rz(last joint) about p."""
        return (((X, Y), -1, (self.x_rot_point, self.y_rot_point)),)


@dataclass(frozen=True, kw_only=True)
class XyzacTrt(_Table):
    """A trunnion: the table turns by C and tilts by A, both carry the workpiece."""

    kind: ClassVar[str] = "xyzac-trt"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "c")
    rotary: ClassVar[int] = 2
    azimuth: ClassVar[tuple[float, float]] = (-1.0, 0.5 * math.pi)
    y_offset: float = 0.0
    z_offset: float = 0.0
    tool_offset: float = 0.0

    def table(self) -> tuple[Turn, ...]:
        """Rz(C) about p, then Rx(A) about p + d."""
        return *super().table(), ((Y, Z), 0, (self.y_rot_point + self.y_offset, self.z_rot_point + self.z_offset))

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """(0, 0, tool-offset)."""
        return 0.0, 0.0, self.tool_offset


@dataclass(frozen=True, kw_only=True)
class XyzbcTrt(_Table):
    """A trunnion: the table turns by C and tilts by B, both carry the workpiece."""

    kind: ClassVar[str] = "xyzbc-trt"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "b", "c")
    rotary: ClassVar[int] = 2
    tilt: ClassVar[float] = -1.0
    azimuth: ClassVar[tuple[float, float]] = (-1.0, 0.0)
    x_offset: float = 0.0
    z_offset: float = 0.0
    tool_offset: float = 0.0

    def table(self) -> tuple[Turn, ...]:
        """Rz(C) about p, then Ry(B) about p + d."""
        return *super().table(), ((Z, X), 0, (self.z_rot_point + self.z_offset, self.x_rot_point + self.x_offset))

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """(0, 0, tool-offset)."""
        return 0.0, 0.0, self.tool_offset


@dataclass(frozen=True, kw_only=True)
class FiveAxisKins(Kinematics):
    """A head that turns by C and tilts by B carries the tool; the workpiece stands still."""

    kind: ClassVar[str] = "5axiskins"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "b", "c")
    rotary: ClassVar[int] = 2
    tilt: ClassVar[float] = -1.0
    pivot_length: float
    tool_offset: float = 0.0

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """(pivot-length + tool-offset) k - (0, 0, pivot-length)."""
        arm = self.pivot_length + self.tool_offset
        x, y, z = self.axis(turns)
        return x * arm, y * arm, z * arm - self.pivot_length


@dataclass(frozen=True, kw_only=True)
class HeadTable(_Table):
    """A head that tilts by B carries the tool, a table that turns by C carries the workpiece."""

    kind: ClassVar[str] = "head-table"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "b", "c")
    rotary: ClassVar[int] = 2
    azimuth: ClassVar[tuple[float, float]] = (-1.0, 0.0)
    pivot_length: float
    tool_offset: float = 0.0

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """(pivot-length + tool-offset) (sin B, 0, cos B) - (0, 0, pivot-length)."""
        arm = self.pivot_length + self.tool_offset
        s, c = sin_cos(turns[0])
        return s * arm, 0.0, c * arm - self.pivot_length


@dataclass(frozen=True, kw_only=True)
class XyTheta(_Table):
    """A table on X and Y that turns by theta about its own centre p carries the workpiece; the tool stands upright."""

    kind: ClassVar[str] = "xy-theta"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "theta")
    rotary: ClassVar[int] = 1


@dataclass(frozen=True, kw_only=True)
class Gantry(Kinematics):
    """A bridge on two drives, y and y2, that stand `skew` mm apart when it is square; the tool stands upright."""

    kind: ClassVar[str] = "gantry"
    joints: ClassVar[tuple[str, ...]] = ("x", "y", "z", "y2")
    skew: float = 0.0

    def slides(self, p: Vector, turns: tuple[Number, ...]) -> tuple[Number, ...]:
        """q = (x, y, z, y + skew)."""
        return p[0], p[1], p[2], p[1] + self.skew

    def tip(self, q: tuple[Number, ...]) -> Vector:
        """P = (x, (y + y2 - skew) / 2, z)."""
        return q[0], 0.5 * (q[1] + q[3] - self.skew), q[2]


#: Every kind of kinematics by the name that machine files know it by; a new one is one class and one entry.
KINDS: dict[str, type[Kinematics]] = {
    each.kind: each for each in (XyzacTrt, XyzbcTrt, FiveAxisKins, HeadTable, XyTheta, Gantry)
}


def kinds() -> tuple[str, ...]:
    """Names of all kinds of kinematics."""
    return tuple(KINDS)


def kinematics(kind: str, **parameters: Any) -> Kinematics:
    """The kinematics of this kind with these parameters, in mm, named as in `parameters_of`.

    Raises InputError for an unknown kind or parameter, for one that is missing, and for a value that is no length.
    """
    if kind not in KINDS:
        raise InputError(f"kinematics.type: {kind!r} is not known; write one of {', '.join(KINDS)}")
    known = parameters_of(kind)
    given = {name.replace("_", "-"): value for name, value in parameters.items()}
    for name in given:
        if name not in known:
            there = f"{kind} has {', '.join(known)}"
            raise InputError(f"kinematics.{name}: unknown parameter; {there}")
    for name, needed in known.items():
        if needed and name not in given:
            raise InputError(f'kinematics.{name}: missing; {kind} needs it, such as {name} = "150mm"')
    return KINDS[kind](**{name.replace("-", "_"): value for name, value in given.items()})


def parameters_of(kind: str) -> Mapping[str, bool]:
    """Names of the parameters of a kind as LinuxCNC's pins are called, and whether each must be given."""
    return {each.name.replace("_", "-"): each.default is MISSING for each in fields(KINDS[kind])}

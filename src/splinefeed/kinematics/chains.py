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
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.kinematics.jets import Jet, Number, angle, sin_cos
from splinefeed.records import Array

Vector = tuple[Number, Number, Number]
X, Y, Z = 0, 1, 2
#: The two coordinates that a rotary joint turns, from one to the other, by its letter.
PLANES = {"a": (Y, Z), "b": (Z, X), "c": (X, Y), "theta": (X, Y)}


@dataclass(frozen=True)
class Chain:
    """One kind of machine: what turns what, from which both directions follow.

    Parameters
    ----------
    joints : str
        Names of its joints between blanks, the linear ones first. Of two rotary ones the first, a or b, tilts and turns
        about x or y; the last, c, turns about z.
    lengths : str
        Its parameters, as LinuxCNC's pins are called.
    table : str, optional
        Joints that turn the workpiece, from the workpiece on: about x-rot-point, y-rot-point, z-rot-point, that which
        tilts about a place x-offset, y-offset, z-offset beside it.
    head : str, optional
        Joints that turn the tool, from the tool on, with a minus where positive angles turn it left-handed: about a
        place pivot-length + tool-offset above the tip.
    twins : tuple of (int, str), optional
        Joints that move as the linear one of a number does, each with the length that it is beside it.

    Raises
    ------
    ValueError
        For turns in another order: from the tool to the workpiece the first rotary joint comes before the last.

    Notes
    -----
    A trunnion whose A tilts a table C is ``table="c a"``; a head B and a table C ``table="c", head="b"``. A C on a
    table is next to the workpiece, on a head next to the machine: there its angle is the azimuth of the tool axis.
    """

    joints: str
    lengths: str
    table: str = ""
    head: str = ""
    twins: tuple[tuple[int, str], ...] = ()

    def __post_init__(self) -> None:
        named, turns = self.joints.split(), [*self.head.replace("-", "").split(), *reversed(self.table.split())]
        turning = named[len(named) - self.rotary :]
        upright = not turning or turning[-1] in ("c", "theta")
        if turns != turning or not upright or any(each not in ("a", "b") for each in turning[:-1]):
            raise ValueError(
                f"joints {self.joints!r}, table {self.table!r}, head {self.head!r}: from the tool to the workpiece a "
                "joint a or b must come first, then c (theta where it is alone), and joints must end with the two"
            )

    @property
    def rotary(self) -> int:
        """How many joints turn: 2 with a tool axis, 1 with an angle in the plane, 0 with neither."""
        return len(self.table.split()) + len(self.head.split())

    @property
    def tilt(self) -> float:
        """Sign of the tool axis' tilt in the first rotary joint."""
        first = self.joints.split()[-2]
        return -self._way(first) if first == "a" else self._way(first)

    @property
    def azimuth(self) -> tuple[float, float]:
        """Azimuth of the tool axis as (sign, offset rad) of the last joint."""
        first, last = self.joints.split()[-2:]
        return self._way(last), 0.5 * math.pi if first == "a" else 0.0

    def _way(self, joint: str) -> float:
        """Sign of the tool's turn, seen from the workpiece, in a joint."""
        return 1.0 if joint in self.head.split() else -1.0


_POINT = "x-rot-point y-rot-point z-rot-point"
#: Every kind of kinematics by the name that machine files know it by; a new one is one entry.
KINDS = {
    "xyzac-trt": Chain("x y z a c", f"{_POINT} y-offset z-offset tool-offset", table="c a"),
    "xyzbc-trt": Chain("x y z b c", f"{_POINT} x-offset z-offset tool-offset", table="c b"),
    "5axiskins": Chain("x y z b c", "pivot-length tool-offset", head="-b c"),
    "head-table": Chain("x y z b c", f"{_POINT} pivot-length tool-offset", table="c", head="b"),
    "xy-theta": Chain("x y z theta", _POINT, table="theta"),
    "gantry": Chain("x y z y2", "skew", twins=((Y, "skew"),)),
}
#: Lengths that must be given; all others are 0 unless they are.
NEEDED = frozenset({"pivot-length"})


@dataclass(frozen=True)
class Kinematics:
    """Where joints put tool tip and tool axis on the workpiece, and back, for one machine.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    lengths : mapping of str to float
        Every length of that kind, mm, by the names that LinuxCNC's pins have.

    Raises
    ------
    InputError
        By `kinematics`, which checks kind and lengths. The reader of machine files raises MachineError.

    Notes
    -----
    Joints are mm and rad. `splinefeed.kinematics.chains` has the formula of each kind.

    References
    ----------
    .. [1] LinuxCNC 2.9 documentation, "5-Axis Kinematics".
    .. [2] docs/how-to/five-axis.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> moves = sf.Machine.load("trunnion").kinematics
    >>> moves.joints
    ('x', 'y', 'z', 'a', 'c')
    >>> tip, axis = moves.forward([[0.0, 0.0, 0.0, 0.0, 0.0]])
    >>> axis
    array([[0., 0., 1.]])
    """

    kind: str
    lengths: Mapping[str, float]

    @property
    def chain(self) -> Chain:
        """What every machine of its kind has."""
        return KINDS[self.kind]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its joints, the linear ones first."""
        return tuple(self.chain.joints.split())

    @property
    def rotary(self) -> int:
        """How many joints turn."""
        return self.chain.rotary

    @property
    def linear(self) -> int:
        """How many joints are linear; they are the first ones."""
        return len(self.joints) - self.rotary

    @property
    def parameters(self) -> dict[str, float]:
        """Lengths, mm, by the names that LinuxCNC's pins have; what need not be given and is 0 is left out."""
        return {name: value for name, value in self.lengths.items() if value != 0.0 or name in NEEDED}

    def reach(self, turns: tuple[Number, ...]) -> Vector:
        """Return where the linear joints are seen from the tip: what the head and the tool add.

        Parameters
        ----------
        turns : tuple
            Rotary joints, rad: jets, arrays of any shape, or numbers.

        Returns
        -------
        tuple of 3
            x, y, z, mm, as `turns`.
        """
        pivot = self.lengths.get("pivot-length", 0.0)
        arm = pivot + self.lengths.get("tool-offset", 0.0)
        head = len(self.chain.head.split())
        if head == 0:
            return 0.0, 0.0, arm
        x, y, z = self.axis(turns if head == 2 else (turns[0], 0.0))  # a table turns none of it
        return x * arm, y * arm, z * arm - pivot

    def slides(self, p: Vector, turns: tuple[Number, ...]) -> tuple[Number, ...]:
        """Return the linear joints that put the tool tip at a place.

        Parameters
        ----------
        p : tuple of 3
            The tip on the workpiece, mm: jets, arrays of any shape, or numbers.
        turns : tuple
            Rotary joints, rad, likewise.

        Returns
        -------
        tuple
            The linear joints, mm.
        """
        x, y, z = (at + arm for at, arm in zip(self._turned(p, turns, 1), self.reach(turns), strict=True))
        return x, y, z, *((x, y, z)[of] + self.lengths[beside] for of, beside in self.chain.twins)

    def tip(self, q: tuple[Number, ...]) -> Vector:
        """Return the tool tip on the workpiece: the way of `slides` back.

        Parameters
        ----------
        q : tuple
            All joints, mm and rad: jets, arrays of any shape, or numbers.

        Returns
        -------
        tuple of 3
            x, y, z, mm.
        """
        slides, turns = list(q[:3]), q[self.linear :]
        for twin, (of, beside) in zip(q[3 : self.linear], self.chain.twins, strict=True):
            slides[of] = 0.5 * (slides[of] + twin - self.lengths[beside])  # what both move is where their mean is
        x, y, z = (at - arm for at, arm in zip(slides, self.reach(turns), strict=True))
        return self._turned((x, y, z), turns, -1)

    def _turned(self, p: Vector, turns: tuple[Number, ...], way: int) -> Vector:
        """A place turned with the table (way 1), or back (-1)."""
        place = list(p)
        rotary = self.joints[self.linear :]
        for joint in self.chain.table.split()[::way]:
            i, j = PLANES[joint]
            x, y = (self._about(axis, tilts=joint in "ab") for axis in (i, j))
            s, c = sin_cos(turns[rotary.index(joint)] * float(way))
            one, other = place[i] - x, place[j] - y
            place[i], place[j] = one * c - other * s + x, one * s + other * c + y
        return place[0], place[1], place[2]

    def _about(self, axis: int, *, tilts: bool) -> float:
        """Where a joint of the table turns, mm, along x, y or z."""
        point, beside = (self.lengths.get(f"{'xyz'[axis]}-{name}", 0.0) for name in ("rot-point", "offset"))
        return point + beside if tilts else point

    def axis(self, turns: tuple[Number, ...]) -> Vector:
        """Return the tool axis on the workpiece, from the tip to the spindle.

        Parameters
        ----------
        turns : tuple
            Rotary joints, rad: jets, arrays of any shape, or numbers.

        Returns
        -------
        tuple of 3
            A unit vector.
        """
        if self.rotary < 2:
            return 0.0, 0.0, 1.0
        sign, offset = self.chain.azimuth
        (s, c), (up, across) = sin_cos(self.chain.tilt * turns[0]), sin_cos(sign * turns[1] + offset)
        return s * across, s * up, c

    def forward(self, joints: Array) -> tuple[Array, Array]:
        """Return tool tip and tool axis on the workpiece.

        Parameters
        ----------
        joints : (..., joints) array
            mm and rad.

        Returns
        -------
        tip : (..., 3) array
            mm.
        axis : (..., 3) array
            Unit vectors.
        """
        joints = np.asarray(joints, dtype=np.float64)
        q = tuple(np.moveaxis(joints, -1, 0))
        parts = *self.tip(q), *self.axis(q[self.linear :])
        found = np.stack([np.broadcast_to(np.asarray(part), joints.shape[:-1]) for part in parts], axis=-1)
        return found[..., :3], found[..., 3:]

    def turn(self, k: tuple[Jet, Jet, Jet]) -> Jet:
        """Return the last joint for a tool axis; half a turn further is right, too.

        Parameters
        ----------
        k : tuple of 3 jets
            The tool axis, k_xy not 0.

        Returns
        -------
        Jet
            The joint, rad.
        """
        sign, offset = self.chain.azimuth
        return sign * (angle(k[1], k[0]) - offset)

    def tilted(self, k: tuple[Jet, Jet, Jet], turn: Jet) -> Jet:
        """Return the first rotary joint for a tool axis and one of its turns.

        Parameters
        ----------
        k : tuple of 3 jets
            The tool axis.
        turn : Jet
            The last joint, rad; see `turn`.

        Returns
        -------
        Jet
            The joint, rad, of either sign.
        """
        sign, offset = self.chain.azimuth
        s, c = sin_cos(sign * turn + offset)
        return self.chain.tilt * angle(c * k[0] + s * k[1], k[2])


def kinematics(kind: str, **parameters: Any) -> Kinematics:
    """Make the kinematics of a machine, checked.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    **parameters : float
        Lengths, mm, named as LinuxCNC's pins are, with - or _ between words. Those that are left out are 0.

    Returns
    -------
    Kinematics
        With every length of its kind.

    Raises
    ------
    InputError
        For an unknown kind or parameter, for one that is missing, and for a value that is no length.

    References
    ----------
    .. [1] LinuxCNC 2.9 documentation, "5-Axis Kinematics".

    Examples
    --------
    >>> from splinefeed.kinematics import kinematics
    >>> kinematics("5axiskins", pivot_length=150).parameters
    {'pivot-length': 150.0}
    """
    if kind not in KINDS:
        raise InputError(f"kinematics.type: {kind!r} is not known; write one of {', '.join(KINDS)}")
    known = KINDS[kind].lengths.split()
    given = {name.replace("_", "-"): value for name, value in parameters.items()}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"kinematics.{name}: unknown parameter; {kind} has {', '.join(known)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"kinematics.{name} is {value!r}; expected a finite length in mm")
    for name in known:
        if name in NEEDED and name not in given:
            raise InputError(f'kinematics.{name}: missing; {kind} needs it, such as {name} = "150mm"')
    return Kinematics(kind, {name: float(given.get(name, 0.0)) for name in known})

"""The joints of an arm along a curve of its tip: implicit, exact at every place, one branch from start to end.

Wherever joints are needed they are solved for, by Newton steps from a guess, which lies on the line between the two
nearest places of a table. Nothing of the motion depends on how good the table is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.kinematics import JointPath
from splinefeed.paths.path import Path
from splinefeed.paths.tool_path import VECTORS, ToolPath
from splinefeed.records import Array, IntArray
from splinefeed.robots.frames import MM, Frames
from splinefeed.robots.inverse import Inverse
from splinefeed.robots.orientation import Orientation

#: How far the tip may be from the start of the curve, mm, and from its orientation, rad, where the joints begin.
AT_START, TURNED_AT_START = 1e-3, 1e-5
#: Decimals of joints in a message: they are at the start well within that.
DIGITS = 8
#: First steps along the curve, as a share of it, and the least one.
FIRST_STEP, LEAST_STEP = 1.0 / 64.0, 1e-7
#: Most that joints may move in a step, rad or m, and what is left to the corrector, as a share of that.
MOST_MOVE, CORRECTED = 0.3, 0.2
#: Newton has met a pose within this, m and rad: behind that each step squares it.
MET = 1e-9
#: A guess of the table is good where it is off by less than this, rad or m: two Newton steps make that rounding. Times
#: that its cells are halved at the most.
GOOD_GUESS, HALVINGS = 1e-6, 24
#: A Jacobian whose least singular value is below this, m and rad a rad, is singular.
SINGULAR = 1e-4
#: Places ahead at which is looked how far the curve is out of reach.
AHEAD = 9


@dataclass(frozen=True)
class Tip:
    """What a `JointPath` needs of its kinematics: where the tip is, and how it stands."""

    frames: Frames
    kind: str

    def forward(self, q: Array) -> tuple[Array, Array]:
        """Tip (..., 3), mm, and its rotation (..., 9) over sqrt(2), columns one after the other, for joints (..., n).

        So the norm of a difference of two is that of two unit vectors as far apart: 2 sin(angle / 2).
        """
        place, rotation = self.frames.pose(q.reshape(1, -1, q.shape[-1]))
        shape = q.shape[:-1]
        return place[0].reshape(*shape, 3), _columns(rotation[0]).reshape(*shape, 9)


class ArmPath(JointPath):
    """The joints of an arm along a curve of its tip; `Arm.along` makes it.

    Called with arc lengths of the tip it gives joints, as any JointPath does.

    Parameters
    ----------
    name : str
        In files and figures.
    joints : tuple of str
        Their names.
    frames : Frames
        Of the arm.
    tip : Path
        Of x, y, z, mm.
    orientation : Orientation
        Of the tip along it.
    start : array (joints,)
        Joints at its start, rad, sliding ones mm.
    free : tuple of int
        Numbers of the six joints that follow; the others stay as they start.

    Raises
    ------
    InputError
        For a start that is not on the curve.
    CurveError
        Where the curve is out of reach or the arm singular, with the place.

    References
    ----------
    .. [1] docs/readers/robots.md
    """

    def __init__(
        self,
        name: str,
        joints: Sequence[str],
        frames: Frames,
        tip: Path,
        orientation: Orientation,
        start: Array,
        free: tuple[int, ...],
    ) -> None:
        self.tool = ToolPath(tip, kind=VECTORS)
        self.kinematics: Tip = Tip(frames, name)
        self.axes, self.linear = tuple(joints), 0
        self.name = self.tool.name
        self.travel = {}
        self._turn, self._inverse = orientation, Inverse(frames, free)
        self._s = self._dips = np.zeros(0)
        self._check_start(start)
        self._s, self._known = self._table(*self._march(start))

    # --- where it is ------------------------------------------------------------------------------------------------

    def joints(self, curve: IntArray, u: Array, s: Array) -> Array:
        """Joints (n, joints) at parameters u (n,) of curves (n,), arc lengths s (n,)."""
        place, rotation = self.tool.evaluate(curve, u, 0)[:, 0], self._turn.jets(s, 0)[0]
        return self._inverse.newton(self._guess(s), place, rotation, 2)[0]

    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """Joints and tip and their first three derivatives by arc length, (n, 4, joints + 3), at s (n,), mm."""
        tip = self.tool.derivatives(s)
        c = self._taylor(s, tip, self._guess(s))
        return np.concatenate([np.moveaxis(c, 0, 1) * _FACTORIALS[:, None], tip], axis=2)

    def standing(self, curve: IntArray, u: Array) -> Array:
        """How the tip shall stand at places (n,), as `Tip.forward` says it, (n, 9)."""
        return _columns(self._turn.jets(self.tool.arc_length(curve, u), 0)[0])

    @property
    def _own_breaks(self) -> Array:
        return self._turn.breaks

    def _taylor(self, s: Array, tip: Array, guess: Array) -> Array:
        """Taylor coefficients (4, n, joints) from derivatives of the tip (n, 4, 3) and a guess of the joints."""
        rotation = self._turn.jets(s, 3)
        q, _ = self._inverse.newton(guess, tip[:, 0], rotation[0], 2)
        return self._inverse.taylor(q, np.moveaxis(tip, 1, 0) / _FACTORIALS[:, None, None], rotation)

    def _pose(self, s: Array) -> tuple[Array, Array]:
        return self.tool(s), self._turn.jets(s, 0)[0]

    def sticks(self, position: Array) -> Array:
        """The arm as lines: base, each joint and the tip, (n, joints + 2, 3), mm, for joints (n, joints)."""
        return self.kinematics.frames.sticks(position)

    def drawn(self, places: int) -> None:
        """Nothing: pictures have the arm itself, from `sticks`."""

    def _forward(self, joints: Array) -> Array:
        """Tip and how it stands with derivatives, (3, n, 12), of joints that have them, (3, n, joints)."""
        place, rotation = self.kinematics.frames.pose(joints / _FACTORIALS[: len(joints), None, None])
        found = np.concatenate([place, np.stack([_columns(each) for each in rotation])], axis=2)
        return np.asarray(found * _FACTORIALS[: len(joints), None, None])

    # --- from start to end ------------------------------------------------------------------------------------------

    def _check_start(self, start: Array) -> None:
        place, rotation = self._pose(np.zeros(1))
        own, turned = self.kinematics.frames.pose(start[None, None])
        away = float(np.linalg.norm(place[0] - own[0, 0]))
        angle = 2.0 * np.arcsin(min(np.linalg.norm(rotation[0] - turned[0, 0]) / 8.0**0.5, 1.0))
        if away > AT_START or angle > TURNED_AT_START:
            found, left = self._inverse.damped(start, place[0], rotation[0])
            reached = MM * float(np.linalg.norm(left[:3])) <= AT_START and np.linalg.norm(left[3:]) <= TURNED_AT_START
            mend = f"begin at {np.round(found, DIGITS).tolist()}" if reached else "begin with joints nearer to it"
            raise InputError(
                f"start: there the tip is {away:.3f} mm and {angle:.5f} rad from the start of the curve; {mend}"
            )

    def _march(self, q: Array) -> tuple[Array, Array]:
        """Places along the curve (k,), mm, and joints there (k, joints), followed from the start."""
        unit, length = self._inverse.units, self.length
        q, _ = self._inverse.newton(q[None], *self._pose(np.zeros(1)))
        if not np.all(np.isfinite(q)):
            self._refuse(0.0, q)
        places, joints, s, step = [0.0], [q[0]], 0.0, FIRST_STEP * length
        slope = np.zeros_like(q)
        while s < length:
            to = length if s + step > length * (1.0 - LEAST_STEP) else s + step
            guess = q + (to - s) * slope
            with np.errstate(all="ignore"):
                new, left = self._inverse.newton(guess, *self._pose(np.array([to])))
            moved = float(np.max(np.abs(new - q) * unit))
            off = float(np.max(np.abs(new - guess) * unit))
            if left[0] < MET and moved < MOST_MOVE and (off < CORRECTED * MOST_MOVE or len(places) == 1):
                slope = (new - q) / (to - s)
                s, q = to, new
                places.append(s)
                joints.append(q[0])
                step = min(2.0 * step, FIRST_STEP * length)
                continue
            step = 0.5 * (to - s)
            if step < LEAST_STEP * length:
                self._refuse(s, q)
        return np.array(places), np.array(joints)

    def _refuse(self, s: float, q: Array) -> NoReturn:
        """CurveError for a curve that joints q (1, joints) at s, mm, cannot follow any further."""
        ahead = np.linspace(s, min(s + 2.0 * FIRST_STEP * self.length, self.length), AHEAD)[1:]
        beyond = 0.0
        if np.all(np.isfinite(q)) and len(ahead):
            for place, rotation in zip(*self._pose(ahead), strict=True):
                _, left = self._inverse.damped(q[0], place, rotation)
                beyond = max(beyond, MM * float(np.linalg.norm(left[:3])))
        way = f"of {self.length:.6g} mm, so far the joints follow"
        if beyond > AT_START:
            raise CurveError(
                f"at {self.tool.place(s)} {way}: ahead the curve is out of reach by {beyond:.4g} mm within "
                f"{ahead[-1] - s:.4g} mm; move or turn it, or begin with another start"
            )
        least = float(self._inverse.smallest(q)[0]) if np.all(np.isfinite(q)) else 0.0
        raise CurveError(
            f"at {self.tool.place(s)} {way}: the arm is singular there (least singular value {least:.2g}), and joints "
            "would have to turn at once; move or turn the curve, hold another joint, or begin with another start"
        )

    def _table(self, s: Array, q: Array) -> tuple[Array, Array]:
        """Places (k,), mm, and joints there (k, joints), so near to each other that lines between them are guesses."""
        unit = self._inverse.units
        cells = np.arange(len(s) - 1)  # whose guesses are not known to be good
        for _ in range(HALVINGS):
            middle, guess = 0.5 * (s[cells] + s[cells + 1]), 0.5 * (q[cells] + q[cells + 1])
            known, _ = self._inverse.newton(guess, *self._pose(middle))
            off = np.max(np.abs(guess - known) * unit, axis=1)
            if not np.all(np.isfinite(off)):
                k = int(cells[np.argmin(np.isfinite(off))])
                self._refuse(float(s[k]), q[k : k + 1])
            coarse = (off > GOOD_GUESS) & (s[cells + 1] - s[cells] > LEAST_STEP * self.length)
            if not np.any(coarse):
                break
            cells = cells[coarse]
            s, q = np.insert(s, cells + 1, middle[coarse]), np.insert(q, cells + 1, known[coarse], axis=0)
            cells = np.repeat(cells + np.arange(len(cells)), 2) + np.tile([0, 1], len(cells))
        singular = self._inverse.smallest(q)
        if np.min(singular) < SINGULAR:
            k = int(np.argmin(singular))
            self._refuse(float(s[k]), q[k : k + 1])
        return s, q

    def _guess(self, s: Array) -> Array:
        return np.stack([np.interp(s, self._s, each) for each in self._known.T], axis=1)

    def __repr__(self) -> str:
        return f"ArmPath({self.name!r}, {self.kinematics.kind}, joints {' '.join(self.axes)}, {self.length:.6g} mm)"


_FACTORIALS = np.array([1.0, 1.0, 2.0, 6.0])


def _columns(rotation: Array) -> Array:
    """Rotations (n, 3, 3) as `Tip.forward` says them, (n, 9)."""
    return np.asarray(np.swapaxes(rotation, 1, 2).reshape(len(rotation), 9) / 2.0**0.5)


def tip_of(curve: Any, feed: float | None) -> Path:
    """The curve of a tip as a path of x, y, z, mm, with a feed that its curves ask for, mm/s."""
    path = Path([curve]) if isinstance(curve, NurbsCurve) else curve
    axes = getattr(path, "axes", type(path).__name__)
    if axes != ("x", "y", "z") or not hasattr(path, "tip_path"):
        raise InputError(f"along: the curve of the tip has {axes}; expected a Path or NurbsCurve of x, y, z, mm")
    tip: Path = path.tip_path
    if feed is None:
        return tip
    if isinstance(feed, bool) or not np.isfinite(feed) or not feed > 0.0:
        raise InputError(f"feed is {feed!r}; expected mm/s, greater than 0")
    return tip.with_feeds(np.full(len(tip.curves), float(feed)))


def orientation_of(given: ArrayLike | None, start: Array, frames: Frames, length: float) -> Orientation:
    """What is given, or the orientation of the tip at the start, all along."""
    if given is None:
        given = frames.pose(start[None, None])[1][0, 0]
    return Orientation.of(given, length)

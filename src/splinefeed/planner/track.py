"""What the planner asks of a path: its length, where its derivatives jump, and the derivatives by its parameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from splinefeed.kinematics import JointPath
from splinefeed.paths.path import Path
from splinefeed.planner.constants import SAME
from splinefeed.records import Array


class Track(Protocol):
    """A path as the planner sees it, of any number of axes, by a parameter sigma that grows wherever any of them moves.

    axes     their names, the first `linear` of which are those of the tip; all others turn, or are joints
    weights  (axes,) what a unit of each counts in sigma
    """

    @property
    def alone(self) -> bool:
        """Whether an axis behind the tip's may move while the tip holds its position."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes."""

    @property
    def linear(self) -> int:
        """How many of them, the first ones, carry the tip."""

    @property
    def length(self) -> float:
        """sigma at the end, mm."""

    @property
    def breaks(self) -> Array:
        """Places (k,) strictly inside where a derivative up to the third can jump, mm, increasing."""

    @property
    def weights(self) -> Array:
        """What a unit of each axis counts in sigma, (axes,)."""

    def place(self, s: float) -> float:
        """Arc length of the tip at a place, mm: what messages say."""

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives, (n, 4, axes), at places s (n,) that are no breaks."""

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n) of the tip's arc length, from `derivatives` d (n, 4, axes)."""

    def chords(self, d: Array) -> tuple[Array | None, Array | None]:
        """What chords from tick to tick leave, 1/mm, and of a tool axis, rad/mm^2; None where the path's curvature."""


@dataclass(frozen=True)
class PathTrack:
    """A `Path` as a track."""

    path: Path

    @property
    def alone(self) -> bool:
        """Whether a rotary axis may move while the tip holds its position."""
        return not self.path.by_tip

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes."""
        return self.path.axes

    @property
    def linear(self) -> int:
        """How many of them carry the tip."""
        return self.path.linear

    @property
    def length(self) -> float:
        """Length, mm."""
        return self.path.length

    @cached_property
    def weights(self) -> Array:
        """What a unit of each axis counts, (axes,)."""
        return self.path.weights

    @cached_property
    def breaks(self) -> Array:
        """Knots, joints and corners, and the tips of sharp bends, where cells end, too, mm."""
        path = self.path
        owner, knots, _ = path.flat.inner_knots()
        places = [path.arc_length(owner, knots), path.curve_starts[1:-1], path.corners.s, path.sharp_bends[0]]
        s = np.unique(np.concatenate([*places, path.slow_tips]))
        inside = s[(s > SAME * path.length) & (s < (1.0 - SAME) * path.length)]
        return inside[np.diff(inside, prepend=0.0) > SAME * path.length]

    def place(self, s: float) -> float:
        """Arc length of the tip at a place, mm."""
        return float(self.path.tip_length(min(max(s, 0.0), self.length)))

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives, (n, 4, axes)."""
        return self.path.derivatives(s)

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n) of the tip's arc length."""
        return self.path.tip(d)

    def chords(self, d: Array) -> tuple[Array | None, Array | None]:
        """Setpoints are joined by straight lines: the path's curvature counts."""
        return None, None


#: Names of a tool tip's own coordinates, which have no limits, before those of the joints.
TIP = ("tip.x", "tip.y", "tip.z")


@dataclass(frozen=True)
class JointTrack:
    """The joints of a `JointPath` over the arc length of the tip, behind the tip's own coordinates."""

    path: JointPath

    @cached_property
    def axes(self) -> tuple[str, ...]:
        """Names of the tip's coordinates and of the joints."""
        return (*TIP, *self.path.axes)

    alone = False

    @property
    def linear(self) -> int:
        """The tip's own coordinates."""
        return len(TIP)

    @property
    def length(self) -> float:
        """Arc length of the tip, mm."""
        return self.path.length

    @cached_property
    def weights(self) -> Array:
        """Only the tip counts, (axes,)."""
        return (np.arange(len(self.axes)) < len(TIP)).astype(np.float64)

    @property
    def breaks(self) -> Array:
        """Knots and joints of tip and tool axis, corners, and places nearest to the pole, mm."""
        return self.path.breaks

    def place(self, s: float) -> float:
        """The parameter is the tip's arc length."""
        return s

    def derivatives(self, s: Array) -> Array:
        """Tip and joints with their first three derivatives, (n, 4, axes)."""
        return self.path.derivatives(s)

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n): the parameter is the tip's arc length."""
        return np.repeat([[1.0], [0.0], [0.0]], len(d), axis=1)

    def chords(self, d: Array) -> tuple[Array | None, Array | None]:
        """What joints that move straight from tick to tick leave of the tip's path, 1/mm, and the axis's, rad/mm^2."""
        return self.path.between_ticks(d)

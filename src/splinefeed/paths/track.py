"""Track: what planner, setpoints, check and runs ask of whatever a motion goes along."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.records import Array, IntArray, unit_of_axis

#: How the message begins that says each value in its own unit.
GOES = "the path goes to"


class Track(ABC):
    """Positions of axes by a parameter sigma, mm, that grows wherever any of them moves: what every path is.

    The axes of `Path` and `ToolPath` carry the tip; those of `JointPath` are joints, and the tip has coordinates of its
    own, which `derivatives` has behind the joints. No room asks which kind a track is: it asks for what it needs.

    name           in files and figures
    axes           names of the axes, `axis_units` their units; the first `linear` of them do not turn
    beside         names of the tip's own coordinates, which have no limits; none where axes carry the tip
    sided          whether `derivatives` gives either side of a break, by the row of the piece
    kinematics     of the machine or arm whose joints the axes are; None where axes carry the tip
    needs_machine  whether it has a tool axis, so that a machine has to make joints of it
    in_parts       itself where its parts are read one after the other, else None
    linking        how the contours of a drawing are linked; None for anything else

    Called with places s (...), mm, it gives positions (..., axes), mm, rotary axes rad; `derivatives` at s (n,) gives
    (n, 4, columns). `check_travel` and `check_limits` raise LimitsError.
    Source: docs/code-overview.md. Example: `sf.shapes.butterfly().axis_units`
    """

    name: str
    axes: tuple[str, ...]
    linear: int
    beside: tuple[str, ...] = ()
    sided = False
    kinematics: Any = None
    needs_machine = False
    in_parts = None
    linking: Any = None

    @property
    @abstractmethod
    def length(self) -> float:
        """sigma at the end, mm."""

    @property
    @abstractmethod
    def stops(self) -> tuple[float, ...]:
        """Places strictly inside at which the motion must rest, mm, increasing."""

    @property
    @abstractmethod
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Where the motion waits and how long, (mm, s), in order."""

    @property
    @abstractmethod
    def breaks(self) -> Array:
        """Places (k,) strictly inside where a derivative up to the third may jump, mm, increasing."""

    @property
    @abstractmethod
    def weights(self) -> Array:
        """What a unit of each column of `derivatives` counts in sigma, (columns,)."""

    @property
    def jumps(self) -> Array:
        """Places (k,), mm, at which the second derivative is known to jump while the motion goes on."""
        return np.zeros(0)

    @property
    def axis_units(self) -> tuple[str, ...]:
        """Unit of each axis for people, as files and figures say it."""
        return tuple(map(unit_of_axis, self.axes))

    @property
    def mixed(self) -> bool:
        """Whether sigma is another length than that of the tip."""
        return False

    @property
    def alone(self) -> bool:
        """Whether axes may move while the tip stays."""
        return False

    @property
    @abstractmethod
    def tip_path(self) -> Any:
        """The Path of the tool tip: its curves, feeds, lines and corners."""

    @property
    def carries_tip(self) -> bool:
        """Whether the axes carry the tip, so that it is its own `tip_path`."""
        return self.tip_path is self

    @property
    @abstractmethod
    def tip_columns(self) -> slice:
        """Which columns of `derivatives` are the tip's."""

    @property
    @abstractmethod
    def pieces(self) -> Array:
        """Places (k,), mm, between which derivatives are smooth: where the rows of `derivatives` begin."""

    @abstractmethod
    def __call__(self, s: ArrayLike) -> Array:
        """Positions (..., axes), mm, rotary axes rad, at places s (...), mm."""

    @abstractmethod
    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """r and its first three derivatives by sigma, (n, 4, columns), at places s (n,), mm, on `pieces` row (n,).

        Columns are the axes and, behind them, the coordinates `beside`.
        """

    def standing(self, curve: IntArray, u: Array) -> Array | None:
        """How the tool shall stand at places (n,), as `kinematics.forward` says it, where no tool axis says it."""
        return None

    @abstractmethod
    def positions(self, curve: IntArray, u: Array, s: Array, tip: Array) -> Array:
        """Positions (n, axes) at u (n,) of curves (n,) of the tip's path, s (n,), mm, which is at `tip` there."""

    @property
    @abstractmethod
    def reach(self) -> tuple[Array, Array]:
        """Least and greatest position of each axis, (axes,), mm or rad, or beyond: which axes move."""

    @abstractmethod
    def check_travel(self, travel: Mapping[str, tuple[float, float]]) -> None:
        """Raise LimitsError where an axis leaves its travel, mm or rad: which, how far, and at what place."""

    @abstractmethod
    def check_limits(self, limits: Any) -> None:
        """Raise LimitsError for a limit that no motion along this can have."""

    @abstractmethod
    def between_ticks(self, d: Array) -> tuple[Array | None, Array | None]:
        """What axes that move straight from tick to tick leave of the tip's path, 1/mm, and of a tool axis, rad/mm^2.

        (n,) each, from `derivatives` d (n, 4, columns); None for the curvature of the path, and for no tool axis.
        """

    @abstractmethod
    def chords(self, s: Array, r: Array, places: Array) -> tuple[IntArray, Array, Array | None]:
        """Steps (n,) between setpoints r (k, axes) at s (k,), and how far tip, mm, and tool axis, rad, are off there.

        Steps are looked at inside, and at `places` (m,), mm, where derivatives jump or the path bends sharply.
        """

    @abstractmethod
    def rounding(self, s: Array, r: Array) -> Array:
        """The rounding of positions r (n, axes) at s (n,), mm, on each axis, (axes,) or (n, axes), mm or rad."""

    def sticks(self, position: Array) -> Array | None:
        """The arm that is at positions (n, axes), as lines (n, points, 3), mm; None where there is none."""
        return None

    def drawn(self, places: int) -> Array | None:
        """What holds the tip, as lines (k, points, 3), mm, evenly along the path; None where nothing is known of it."""
        return None

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n) of the tip's arc length s by sigma, from `derivatives` d (n, 4, columns)."""
        return np.repeat([[1.0], [0.0], [0.0]], len(d), axis=1)

    def tip_length(self, s: ArrayLike) -> Array:
        """Arc length of the tip, mm (...), at places s (...), mm."""
        return np.asarray(s, dtype=np.float64)

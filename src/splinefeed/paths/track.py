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

    Attributes
    ----------
    name : str
        In files and figures.
    axes : tuple of str
        Names of the axes, `axis_units` their units; the first `linear` of them do not turn.
    linear : int
        How many do not.
    beside : tuple of str
        Names of the tip's own coordinates, which have no limits; none where axes carry the tip.
    sided : bool
        Whether `derivatives` gives either side of a break, by the row of the piece.
    kinematics : object
        Of the machine or arm whose joints the axes are; None where axes carry the tip.
    needs_machine : bool
        Whether it has a tool axis, so that a machine has to make joints of it.
    in_parts : PathParts or None
        Itself where its parts are read one after the other.
    linking : Linking or None
        How the contours of a drawing are linked; None for anything else.

    Raises
    ------
    LimitsError
        By `check_travel` and `check_limits`.

    Notes
    -----
    The axes of `Path` and `ToolPath` carry the tip; those of `JointPath` are joints, and the tip has coordinates of its
    own, which `derivatives` has behind the joints. No room asks which kind a track is: it asks for what it needs.

    References
    ----------
    .. [1] docs/code-overview.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.butterfly()
    >>> isinstance(path, sf.paths.Track), path.axis_units
    (True, ('mm', 'mm'))
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
        """Compute positions.

        Parameters
        ----------
        s : array_like
            Places (...), mm.

        Returns
        -------
        (..., axes) array
            mm, rotary axes rad.
        """

    @abstractmethod
    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """Compute r and its first three derivatives by sigma.

        Parameters
        ----------
        s : (n,) array
            Places, mm.
        row : (n,) array of int, optional
            Which of `pieces` each is on; that on the right by default.

        Returns
        -------
        (n, 4, columns) array
            Columns are the axes and, behind them, the coordinates `beside`.
        """

    def standing(self, curve: IntArray, u: Array) -> Array | None:
        """Say how the tool shall stand where no tool axis says it.

        Parameters
        ----------
        curve : (n,) array of int
            Curves of the tip's path.
        u : (n,) array
            Parameters on them.

        Returns
        -------
        (n, ...) array or None
            As `kinematics.forward` has it; None where a tool axis says it.
        """
        return None

    @abstractmethod
    def positions(self, curve: IntArray, u: Array, s: Array, tip: Array) -> Array:
        """Compute positions at places of the tip's path.

        Parameters
        ----------
        curve : (n,) array of int
            Curves of the tip's path.
        u, s : (n,) array
            Parameters on them, and places, mm.
        tip : (n, 3) array
            Where the tip is there, mm.

        Returns
        -------
        (n, axes) array
            mm, rotary axes rad.
        """

    @property
    @abstractmethod
    def reach(self) -> tuple[Array, Array]:
        """Least and greatest position of each axis, (axes,), mm or rad, or beyond: which axes move."""

    @abstractmethod
    def check_travel(self, travel: Mapping[str, tuple[float, float]]) -> None:
        """Raise an error where an axis leaves its travel.

        Parameters
        ----------
        travel : mapping of str to (float, float)
            Least and greatest position of axes, mm or rad.

        Raises
        ------
        LimitsError
            Names the axis, how far it goes, and at what place.
        """

    @abstractmethod
    def check_limits(self, limits: Any) -> None:
        """Refuse a limit that no motion along this can have.

        Parameters
        ----------
        limits : Limits
            Of a motion.

        Raises
        ------
        LimitsError
            Names the limit.
        """

    @abstractmethod
    def between_ticks(self, d: Array) -> tuple[Array | None, Array | None]:
        """Compute what axes that move straight from tick to tick leave of the tip's path and of a tool axis.

        Parameters
        ----------
        d : (n, 4, columns) array
            From `derivatives`.

        Returns
        -------
        tip : (n,) array or None
            1/mm; None for the curvature of the path.
        axis : (n,) array or None
            rad/mm^2; None for no tool axis.
        """

    @abstractmethod
    def chords(self, s: Array, r: Array, places: Array) -> tuple[IntArray, Array, Array | None]:
        """Measure how far tip and tool axis are off between setpoints that axes join straight.

        Parameters
        ----------
        s : (k,) array
            Where the setpoints are, mm.
        r : (k, axes) array
            Setpoints, mm or rad.
        places : (m,) array
            Where derivatives jump or the path bends sharply, mm: steps are looked at there, too, and inside.

        Returns
        -------
        step : (n,) array of int
            Numbers of steps.
        tip : (n,) array
            How far the tip is off there, mm.
        axis : (n,) array or None
            How far the tool axis is off, rad.
        """

    @abstractmethod
    def rounding(self, s: Array, r: Array) -> Array:
        """Compute the rounding of positions.

        Parameters
        ----------
        s : (n,) array
            Places, mm.
        r : (n, axes) array
            Positions there, mm or rad.

        Returns
        -------
        (axes,) or (n, axes) array
            On each axis, mm or rad.
        """

    def sticks(self, position: Array) -> Array | None:
        """Draw the arm at positions.

        Parameters
        ----------
        position : (n, axes) array
            mm or rad.

        Returns
        -------
        (n, points, 3) array or None
            As lines, mm; None where there is none.
        """
        return None

    def drawn(self, places: int) -> Array | None:
        """Draw what holds the tip, evenly along the path.

        Parameters
        ----------
        places : int
            How many.

        Returns
        -------
        (k, points, 3) array or None
            As lines, mm; None where nothing is known of it.
        """
        return None

    def tip(self, d: Array) -> Array:
        """Compute derivatives of the tip's arc length s by sigma.

        Parameters
        ----------
        d : (n, 4, columns) array
            From `derivatives`.

        Returns
        -------
        (3, n) array
            s', s'', s'''.
        """
        return np.repeat([[1.0], [0.0], [0.0]], len(d), axis=1)

    def tip_length(self, s: ArrayLike) -> Array:
        """Compute the arc length of the tip.

        Parameters
        ----------
        s : array_like
            Places (...), mm.

        Returns
        -------
        (...) array
            mm.
        """
        return np.asarray(s, dtype=np.float64)

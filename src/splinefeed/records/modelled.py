"""Limits that a model gives: of torques, of how fast these change, of velocities that depend on the position.

A limit is one class and one row of the table of limits. The class says what it bounds by differences of setpoints, for
the check; along a motion, for reports; and as rows of the planner, on q = sigma_dot^2 and its derivatives q', q'':

    q <= top        low <= c0 q + c1 q' + root sqrt(q) <= high
    -1/sqrt(q) <= c0 q + c1 q' + c2 q'' + c <= 1/sqrt(q)       each in units of the limit
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.limit_table import Joint, named
from splinefeed.records.arrays import Array


@dataclass(frozen=True)
class ModelRows:
    """Rows of the planner at n places; the module says on what.

    Parameters
    ----------
    top : (n,) array, optional
        Largest q.
    linear : (m, 2, n) array
        c0 and c1, in units of the limit.
    low, high : (m, n) arrays
        Bounds of the linear rows.
    root : (m, n) array, optional
        What sqrt(q) adds to each linear row.
    jerk : (k, 3, n) array, optional
        c0, c1 and c2, in units of the limit.
    rest : (k, n) array, optional
        What each row of jerk has beside them; it stands where `jerk` does.
    """

    top: Array | None = None
    linear: Array = field(default_factory=lambda: np.zeros((0, 2, 0)))
    low: Array = field(default_factory=lambda: np.zeros((0, 0)))
    high: Array = field(default_factory=lambda: np.zeros((0, 0)))
    root: Array | None = None
    jerk: Array | None = None
    rest: Array | None = None


class Modelled(ABC):
    """Bound quantities that a model gives for axes.

    Attributes
    ----------
    kind : str
        Its row of the table of limits.
    axes : tuple of str
        Whose each quantity is, in the order of the model's columns.
    span : int
        Setpoints that one value by differences needs.
    power : int
        How a value grows with the rate of the motion: by its k-th power.

    Raises
    ------
    LimitsError
        For bounds that are not positive or all infinite.

    Notes
    -----
    Units are those of the quantity: N m, N m/s, or rad/s and mm/s.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> torque = sf.records.Torque(lambda q, v, a: 0.02 * a, {"a": 1.5})
    >>> isinstance(torque, sf.records.Modelled), torque.span, torque.power
    (True, 3, 2)
    """

    kind: str
    span: int
    power: int

    @property
    @abstractmethod
    def axes(self) -> tuple[str, ...]:
        """Axes that the model counts."""

    @abstractmethod
    def seen(self, position: Array, period: float) -> tuple[Array, Array]:
        """Compute values by differences of setpoints, and their limits.

        Parameters
        ----------
        position : (n, axes) array
            Setpoints, mm or rad, in the order of the model's columns.
        period : float
            Servo period, s.

        Returns
        -------
        values, limits : (n - span + 1, axes) array
            In units of the quantity.
        """

    @abstractmethod
    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """Compute values along a motion, and their limits.

        Parameters
        ----------
        position, velocity, acceleration, jerk : (n, axes) array
            At instants, mm or rad, and by s.

        Returns
        -------
        values, limits : (n, axes) array
            In units of the quantity.
        """

    @abstractmethod
    def rows(self, s: Array, d: Array) -> ModelRows:
        """Make rows of the planner.

        Parameters
        ----------
        s : (n,) array
            Places, mm.
        d : (n, 4, axes) array
            The axes there and their derivatives by the length.

        Returns
        -------
        ModelRows
            What bounds q, q' and q'' at these places.
        """

    def columns(self, axes: Sequence[str]) -> list[int]:
        """Find its axes among those of a path.

        Parameters
        ----------
        axes : sequence of str
            Names of the path's axes.

        Returns
        -------
        list of int
            Where each is.

        Raises
        ------
        LimitsError
            For one that is not there.
        """
        for axis in self.axes:
            if axis not in axes:
                raise LimitsError(f"{self.kind}.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")
        return [list(axes).index(axis) for axis in self.axes]

    def names(self) -> list[str]:
        """Names of its limits, one an axis."""
        return [named(self.kind, axis) for axis in self.axes]

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """Bound what roundings of setpoints make of values by differences.

        Parameters
        ----------
        position : (n, axes) array
            Setpoints, mm or rad.
        period : float
            Servo period, s.
        each : (axes,) array
            The rounding of each axis, mm or rad.

        Returns
        -------
        (n - span + 1, axes) array
            What each value may be off, in units of the quantity.
        """
        found, _ = self.seen(position, period)
        total = np.zeros_like(found)
        sign = np.where(np.arange(len(position)) % 2, -1.0, 1.0)
        for k, size in enumerate(each.tolist()):
            moved = position.copy()
            moved[:, k] += size * sign
            total += np.abs(self.seen(moved, period)[0] - found)
        return np.asarray(total)

    def still(self, position: Array) -> Array:
        """Compute values at rest.

        Parameters
        ----------
        position : (n, axes) array
            Where the axes stand, mm or rad.

        Returns
        -------
        (n, axes) array
            In units of the quantity.
        """
        none = np.zeros_like(position)
        return self.along(position, none, none, none)[0]

    def numbers(self) -> dict[str, float]:
        """Its bounds by axis, where they are numbers."""
        return {}


def check_bounds(what: str, bounds: Mapping[str, float]) -> None:
    """Refuse bounds that are not all positive, or all infinite.

    Parameters
    ----------
    what : str
        What they bound, for the message.
    bounds : mapping of str to float
        By axis name.

    Raises
    ------
    LimitsError
        Names the axis.
    """
    if not all(bound > 0.0 for bound in bounds.values()) or min(bounds.values(), default=math.inf) == math.inf:
        raise LimitsError(f"{what} are {dict(bounds)}; one at least is needed, and all must be positive")


def axis_name(axis: object) -> str:
    """A name of an axis as a key: that of a joint keeps its unit."""
    return axis if isinstance(axis, Joint) else str(axis)

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
    """Hold rows of the planner at n places; the module says on what.

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
        """Values and their limits, (n - span + 1, axes) each, at setpoints (n, axes), by differences."""

    @abstractmethod
    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """Values and their limits, (n, axes) each, of a motion (n, axes)."""

    @abstractmethod
    def rows(self, s: Array, d: Array) -> ModelRows:
        """Rows of the planner at places s (n,), mm, from the axes and their derivatives by the length, (n, 4, axes)."""

    def columns(self, axes: Sequence[str]) -> list[int]:
        """Where its axes are among `axes`; LimitsError for one that is not."""
        for axis in self.axes:
            if axis not in axes:
                raise LimitsError(f"{self.kind}.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")
        return [list(axes).index(axis) for axis in self.axes]

    def names(self) -> list[str]:
        """Names of its limits, one an axis."""
        return [named(self.kind, axis) for axis in self.axes]

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """What roundings of setpoints, (axes,), can make of each value by differences, (n - span + 1, axes)."""
        found, _ = self.seen(position, period)
        total = np.zeros_like(found)
        sign = np.where(np.arange(len(position)) % 2, -1.0, 1.0)
        for k, size in enumerate(each.tolist()):
            moved = position.copy()
            moved[:, k] += size * sign
            total += np.abs(self.seen(moved, period)[0] - found)
        return np.asarray(total)

    def still(self, position: Array) -> Array:
        """Its values at rest, (n, axes)."""
        none = np.zeros_like(position)
        return self.along(position, none, none, none)[0]

    def numbers(self) -> dict[str, float]:
        """Its bounds by axis, where they are numbers."""
        return {}


def check_bounds(what: str, bounds: Mapping[str, float]) -> None:
    """LimitsError for bounds that are not all positive, or all infinite."""
    if not all(bound > 0.0 for bound in bounds.values()) or min(bounds.values(), default=math.inf) == math.inf:
        raise LimitsError(f"{what} are {dict(bounds)}; one at least is needed, and all must be positive")


def axis_name(axis: object) -> str:
    """A name of an axis as a key: that of a joint keeps its unit."""
    return axis if isinstance(axis, Joint) else str(axis)

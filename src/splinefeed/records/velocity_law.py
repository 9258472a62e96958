"""Velocity limits of joints that depend on where they are, and how fast a motion may come near to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.records.arrays import Array
from splinefeed.records.modelled import Modelled, ModelRows, axis_name, check_bounds

#: A velocity limit is never below this, rad/s or mm/s: there is no motion where it is 0.
LEAST = 1e-6
#: Simpson's rule: places within a step, and their weights.
PLACES, WEIGHTS = (0.0, 0.5, 1.0), (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0)

Law = Callable[[Array], tuple[Array, Array]]
"""Of positions (n,), rad or mm: the least velocity, below 0, and the greatest one, above 0, (n,) each."""


@dataclass(frozen=True)
class VelocityByPosition(Modelled):
    """Bound velocities of joints by functions of where each is: those of Franka's FR3, of a cylinder near its end.

    Parameters
    ----------
    laws : mapping of str to callable
        By axis name: of positions (n,), rad or mm, the least velocity, below 0, and the greatest, above 0, (n,) each.

    Raises
    ------
    LimitsError
        For a law that cannot be called or gives something else.

    Notes
    -----
    By setpoints the velocity of a step counts against the mean of the law over the step, by Simpson's rule.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import numpy as np
    >>> import splinefeed as sf
    >>> law = sf.records.VelocityByPosition({"a": lambda q: (-np.sqrt(q + 2), np.sqrt(2 - q))})
    >>> law.kind
    'axis_velocity_law'
    """

    laws: Mapping[str, Law]

    kind, span, power = "axis_velocity_law", 2, 1

    def __post_init__(self) -> None:
        if not self.laws or not all(callable(law) for law in self.laws.values()):
            raise LimitsError("axis_velocity_law: give a function of positions for one joint at least, by its name")
        object.__setattr__(self, "laws", MappingProxyType(dict(self.laws)))

    @property
    def axes(self) -> tuple[str, ...]:
        """The joints that have a law."""
        return tuple(self.laws)

    def of(self, position: Array, ahead: Array) -> Array:
        """Evaluate the law in the direction of motion.

        Parameters
        ----------
        position : (n, axes) array
            Where the joints are, rad or mm.
        ahead : (n, axes) array
            The direction, by its sign.

        Returns
        -------
        (n, axes) array
            The largest |velocity|, rad/s or mm/s.
        """
        found = np.empty(position.shape)
        for k, (axis, law) in enumerate(self.laws.items()):
            low, high = (np.asarray(each, dtype=np.float64) for each in law(position[:, k]))
            if low.shape != high.shape or low.shape != position[:, k].shape or not np.all(low <= high):
                raise LimitsError(
                    f"axis_velocity_law.{axis}: gives {low.shape} and {high.shape} for {position[:, k].shape}; "
                    "expected the least and the greatest velocity of each position"
                )
            found[:, k] = np.where(ahead[:, k] >= 0.0, high, -low)
        return np.maximum(found, LEAST)

    def seen(self, position: Array, period: float) -> tuple[Array, Array]:
        """Velocities of the steps, and the mean of the law over each."""
        step = np.diff(position, axis=0)
        mean = sum(
            weight * self.of(position[:-1] + share * step, step) for share, weight in zip(PLACES, WEIGHTS, strict=True)
        )
        return step / period, np.asarray(mean)

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """2 e / T."""
        return np.broadcast_to(2.0 * each / period, (len(position) - 1, len(each)))

    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """Velocities and the law where they are."""
        return velocity, self.of(position, velocity)

    def rows(self, s: Array, d: Array) -> ModelRows:
        """q <= (V(r) / r')^2."""
        most = self.of(d[:, 0], d[:, 1]) / np.maximum(np.abs(d[:, 1]), 1e-150)
        return ModelRows(top=np.min(np.minimum(most, 1e75) ** 2, axis=1))


@dataclass(frozen=True)
class Approach(Modelled):
    """Bound how fast joints speed up near a velocity limit: r'' <= rate (V - |r'|), in the direction of r'.

    Parameters
    ----------
    velocity : VelocityByPosition
        The law V.
    rate : mapping of str to float
        By axis name, 1/s: that of libfranka is its limit of jerk over that of acceleration.

    Raises
    ------
    LimitsError
        For rates that are not positive, or of joints without a law.

    Notes
    -----
    So the acceleration can end, within the limit of jerk, before the velocity is reached. By setpoints the second
    difference of positions (n, axes), rad or mm, counts against the velocity of the step before it and the law where
    that begins, as libfranka's limiter sees them.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> law = sf.records.VelocityByPosition({"a": lambda q: (0 * q - 2, 0 * q + 2)})
    >>> sf.records.Approach(law, {"a": 500.0}).kind
    'axis_approach'
    """

    velocity: VelocityByPosition
    rate: Mapping[str, float]

    kind, span, power = "axis_approach", 3, 2

    def __post_init__(self) -> None:
        rate = {axis_name(axis): float(each) for axis, each in self.rate.items()}
        check_bounds("rates of approach", rate)
        if set(rate) != set(self.velocity.axes):
            raise LimitsError("axis_approach: give a rate for each joint that has a law of velocity")
        object.__setattr__(self, "rate", MappingProxyType({axis: rate[axis] for axis in self.velocity.axes}))

    @property
    def axes(self) -> tuple[str, ...]:
        """The joints of the law."""
        return self.velocity.axes

    @property
    def _rates(self) -> Array:
        return np.array(list(self.rate.values()))

    def _room(self, position: Array, velocity: Array) -> Array:
        room = self.velocity.of(position, velocity) - np.abs(velocity)
        return np.asarray(self._rates * np.maximum(room, LEAST))

    def seen(self, position: Array, period: float) -> tuple[Array, Array]:
        """Second differences in the direction of the step before them, and what is left to them."""
        step = np.diff(position, axis=0) / period
        a = np.sign(step[:-1]) * np.diff(step, axis=0) / period
        return np.maximum(a, 0.0), self._room(position[:-2], step[:-1])

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """4 e / T^2, and what the room loses by a rounding of the velocity."""
        return np.broadcast_to(
            4.0 * each / period**2 + 2.0 * self._rates * each / period, (len(position) - 2, len(each))
        )

    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """Accelerations in the direction of motion, and what is left to them."""
        return np.maximum(np.sign(velocity) * acceleration, 0.0), self._room(position, velocity)

    def rows(self, s: Array, d: Array) -> ModelRows:
        """sign(r') (r' q'/2 + r'' q) + rate |r'| sqrt(q) <= rate V, over rate V."""
        r, r1, r2, _ = np.moveaxis(d, 1, 0)
        high = self._rates * self.velocity.of(r, r1)
        sign = np.sign(r1)
        linear = np.stack([sign * r2 / high, 0.5 * np.abs(r1) / high], axis=1).transpose(2, 1, 0)
        whole = np.ones((len(self.axes), len(r)))
        return ModelRows(linear=linear, low=-1e9 * whole, high=whole, root=(self._rates * np.abs(r1) / high).T)

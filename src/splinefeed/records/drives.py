"""Limits of what drives a machine beside its axes: sums of axes, such as a gantry's two motors, and joint torques."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.records.arrays import Array

#: What of a combination is bounded, in the order of the derivatives.
BOUNDED = ("velocity", "acceleration", "jerk")


def check_axes(name: str, given: Iterable[str], axes: Sequence[str]) -> None:
    """LimitsError for an axis of the limit `name` that is not among those of the path."""
    for axis in given:
        if axis not in axes:
            raise LimitsError(f"{name}.{axis}: the path has no axis {axis!r}; its axes are {', '.join(axes)}")


@dataclass(frozen=True, kw_only=True)
class Combination:
    """Bounds on w . r, a linear combination of axis positions: the motor on one side of a gantry, a tool axis.

    weights  by axis name: what 1 mm (rotary axes: 1 rad) of it counts;  velocity, acceleration, jerk  bounds of the
    derivatives of w . r, in mm/s, mm/s^2 and mm/s^3 for weights without unit

    Raises LimitsError for no weights, weights that are all 0 or not finite, and without any bound.
    Source: docs/math/planner.md.

    >>> import splinefeed as sf
    >>> left = sf.Combination(weights={"y": 1.0, "c": 400.0}, acceleration=5000.0, jerk=100000.0)
    >>> sf.Limits(feed=200.0, axis_jerk=80000.0, combinations={"left": left}).as_dict()["combinations.left.jerk"]
    100000.0
    """

    weights: Mapping[str, float]
    velocity: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf

    def __post_init__(self) -> None:
        weights = {str(axis): float(weight) for axis, weight in self.weights.items()}
        if not all(map(math.isfinite, weights.values())) or not any(weights.values()):
            raise LimitsError(f"the weights of a combination are {weights}; give finite ones, not all of them 0")
        object.__setattr__(self, "weights", MappingProxyType(weights))
        bounds = [float(getattr(self, name)) for name in BOUNDED]
        if not all(bound > 0.0 for bound in bounds) or min(bounds) == math.inf:
            raise LimitsError(f"bounds of a combination are {bounds}; one at least is needed, and all must be positive")

    def on(self, axes: Sequence[str]) -> Array:
        """The weights of `axes`, (axes,); LimitsError for an axis that is not among them."""
        check_axes("combinations", self.weights, axes)
        return np.array([self.weights.get(axis, 0.0) for axis in axes])


@dataclass(frozen=True)
class Torque:
    """Bounds on the torques (of linear joints: forces) that a rigid-body model gives for joints.

    model  inverse dynamics tau(q, q', q''), each (n, joints), rad (linear joints mm) by s, to torques (n, joints),
           N m (N): M(q) q'' + C(q, q') q' + g(q), without friction
    most   the largest torque of every joint by axis name, in the order of the model's columns; inf for none

    Along a path r(s) the torques are a(s) s'' + b(s) s'^2 + c(s), with a = M r', b = M r'' + C(r, r') r' and c = g; see
    Bobrow, Dubowsky and Gibson, Int. J. Robotics Research 4(3), 1985, https://doi.org/10.1177/027836498500400301.
    Raises LimitsError for a model that cannot be called, and for bounds that are not positive or all infinite.

    >>> import splinefeed as sf
    >>> sf.Torque(lambda q, v, a: 0.02 * a, {"a": 1.5}).most["a"]  # a turntable of 0.02 kg m^2
    1.5
    """

    model: Callable[[Array, Array, Array], Array]
    most: Mapping[str, float]

    def __post_init__(self) -> None:
        if not callable(self.model):
            raise LimitsError("the model of torques is a function of positions, velocities and accelerations")
        most = {str(axis): float(limit) for axis, limit in self.most.items()}
        if not all(limit > 0.0 for limit in most.values()) or min(most.values(), default=math.inf) == math.inf:
            raise LimitsError(f"torque limits are {most}; one at least is needed, and all must be positive")
        object.__setattr__(self, "most", MappingProxyType(most))

    def columns(self, axes: Sequence[str]) -> list[int]:
        """Where the joints are among `axes`; LimitsError for one that is not."""
        check_axes("torque", self.most, axes)
        return [list(axes).index(axis) for axis in self.most]

    def of(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Torques (n, joints) of joints (n, joints); LimitsError where the model returns something else."""
        try:
            found = np.asarray(self.model(position, velocity, acceleration), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise LimitsError(f"torque: the model fails on arrays (n, joints): {error}") from error
        if found.shape != position.shape or not np.all(np.isfinite(found)):
            raise LimitsError(
                f"torque: the model gives {found.shape} for {position.shape}, or numbers that are not finite; it gives "
                "one finite torque for every joint of `most` and every row"
            )
        return found

    def by_differences(self, position: Array, period: float, rounding: Array) -> tuple[Array, Array, Array]:
        """Torques of joints at setpoints (n + 2, joints) but the first and the last, (n, joints), by differences.

        f(q_k, (q_{k+1} - q_{k-1}) / 2T, (q_{k+1} - 2 q_k + q_{k-1}) / T^2); with it f(q_k, 0, 0), and what a rounding
        of every setpoint, (joints,), can make of it.
        """
        q, none = position[1:-1], np.zeros_like(position[1:-1])
        still = self.of(q, none, none)
        found = self.of(q, (position[2:] - position[:-2]) / (2.0 * period), np.diff(position, 2, axis=0) / period**2)
        each = 4.0 * np.diag(rounding) / period**2
        floor = np.sum([np.abs(self.of(q, none, none + row) - still) for row in each], axis=0)
        return found, still, np.asarray(floor)

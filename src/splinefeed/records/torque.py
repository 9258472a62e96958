"""Bounds on the torques of joints that a rigid-body model gives, with friction."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.limit_table import named, unit_of
from splinefeed.records.arrays import Array
from splinefeed.records.modelled import Modelled, ModelRows, axis_name, check_bounds

#: A torque that differs from that of the form of rigid bodies by more than this share has friction in its model.
ALMOST = 1e-9
#: The rate at which a reserve counts viscous friction, and a side of a row that never binds.
RESERVED, FREE = 2.0, 1e9

Model = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class OfTorques(Modelled):
    """A limit of the torques that a rigid-body model gives for joints, or of how they change: one bound a joint."""

    model: Model
    most: Mapping[str, float]

    def __post_init__(self) -> None:
        if not callable(self.model):
            raise LimitsError("the model of torques is a function of positions, velocities and accelerations")
        most = {axis_name(axis): float(limit) for axis, limit in self.most.items()}
        check_bounds(f"limits of {self.kind.replace('_', ' ')}", most)
        object.__setattr__(self, "most", MappingProxyType(most))

    @property
    def axes(self) -> tuple[str, ...]:
        """The joints, in the order of the model's columns."""
        return tuple(self.most)

    @property
    def bounds(self) -> Array:
        """The bound of every joint, (joints,)."""
        return np.array(list(self.most.values()))

    def numbers(self) -> dict[str, float]:
        """The bound of every joint by its name."""
        return dict(self.most)

    def of(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Compute the torques of rigid bodies by the model.

        Parameters
        ----------
        position, velocity, acceleration : (n, joints) array
            rad (linear joints mm), and by s.

        Returns
        -------
        (n, joints) array
            N m (N), without friction.

        Raises
        ------
        LimitsError
            Where the model returns something else.
        """
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


@dataclass(frozen=True)
class Torque(OfTorques):
    """Bound the torques (of linear joints: forces) that a rigid-body model gives for joints.

    Parameters
    ----------
    model : callable
        Inverse dynamics tau(q, q', q''), each (n, joints), rad (linear joints mm) by s, to torques (n, joints),
        N m (N): M(q) q'' + C(q, q') q' + g(q), without friction.
    most : mapping of str to float
        The largest torque of every joint by axis name, in the order of the model's columns; inf for none.
    coulomb, viscous : mapping of str to float, optional
        Friction by axis name, N m and N m s/rad (N, N s/mm), at least 0; default none.
    share : float, optional
        How much of what weight and friction leave motion may take: a reserve to slow down with.

    Raises
    ------
    LimitsError
        For a model that cannot be called, and for bounds that are not positive or all infinite.

    Notes
    -----
    Along a path r(s) the torques are a(s) s'' + b(s) s'^2 + c(s), with

        a = M r',   b = M r'' + C(r, r') r',   c = g

    Friction adds coulomb sign(r') + viscous r' s', in the direction in which each joint moves along the path.

    References
    ----------
    .. [1] Bobrow, Dubowsky and Gibson, Int. J. Robotics Research 4(3), 1985,
       https://doi.org/10.1177/027836498500400301.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.records.Torque(lambda q, v, a: 0.02 * a, {"a": 1.5}).most["a"]  # a turntable of 0.02 kg m^2
    1.5
    """

    coulomb: Mapping[str, float] | None = None
    viscous: Mapping[str, float] | None = None
    share: float = 1.0

    kind, span, power = "torque", 3, 2

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("coulomb", "viscous"):
            own = {axis_name(axis): float(each) for axis, each in (getattr(self, name) or {}).items()}
            for axis, value in own.items():
                if axis not in self.most or not 0.0 <= value < np.inf:
                    raise LimitsError(f"torque: {name} of {axis} is {value:g}; give a joint of `most` 0 or more")
            object.__setattr__(self, name, MappingProxyType(own))

    def reserved(self, share: float) -> Torque:
        """Keep a reserve of torque.

        Parameters
        ----------
        share : float
            Of what weight and friction leave, how much motion may take.

        Returns
        -------
        Torque
            The same limits with this share.
        """
        return replace(self, share=share * self.share)

    def _each(self, of: Mapping[str, float] | None) -> Array:
        return np.array([(of or {}).get(axis, 0.0) for axis in self.most])

    @property
    def dry(self) -> tuple[Array, Array]:
        """Coulomb and viscous friction of each joint, (joints,)."""
        return self._each(self.coulomb), self._each(self.viscous)

    def whole(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Compute torques with friction.

        Parameters
        ----------
        position, velocity, acceleration : (n, joints) array
            rad (linear joints mm), and by s.

        Returns
        -------
        (n, joints) array
            N m (N).
        """
        coulomb, viscous = self.dry
        return np.asarray(self.of(position, velocity, acceleration) + coulomb * np.sign(velocity) + viscous * velocity)

    def seen(self, position: Array, period: float) -> tuple[Array, Array]:
        """f(q_k, (q_{k+1} - q_{k-1}) / 2T, (q_{k+1} - 2 q_k + q_{k-1}) / T^2), and the bounds."""
        v, a = (position[2:] - position[:-2]) / (2.0 * period), np.diff(position, 2, axis=0) / period**2
        return self.along(position[1:-1], v, a, a)

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """What roundings of setpoints, (joints,), make of the torques: those of accelerations 4 e / T^2."""
        q, none = position[1:-1], np.zeros_like(position[1:-1])
        still = self.of(q, none, none)
        rows = 4.0 * np.diag(each) / period**2
        coulomb, viscous = self.dry
        found = np.sum([np.abs(self.of(q, none, none + row) - still) for row in rows], axis=0) + viscous * each / period
        if np.any(coulomb):  # the direction of what all but rests is not known
            slow = np.abs(position[2:] - position[:-2]) <= 2.0 * each
            found = found + 2.0 * coulomb * slow
        return np.asarray(found)

    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """Torques and their bounds."""
        most = self.bounds
        if self.share == 1.0:
            found = self.whole(position, velocity, acceleration)
            return found, np.broadcast_to(most, found.shape)
        none = np.zeros_like(position)
        still = self.of(position, none, none)
        coulomb, viscous = self.dry
        room = most - np.abs(still) - coulomb - RESERVED * viscous * np.abs(velocity)
        return self.of(position, velocity, acceleration) - still, np.maximum(self.share * room, ALMOST * most)

    def still(self, position: Array) -> Array:
        """Torques at rest; 0 of what motion takes alone."""
        if self.share < 1.0:
            return np.zeros_like(position)
        return super().still(position)

    def rows(self, s: Array, d: Array) -> ModelRows:
        """Make rows |a q'/2 + b q + c + coulomb sign(r') + viscous r' sqrt(q)| <= most.

        Parameters
        ----------
        s : (n,) array
            Places, mm.
        d : (n, 4, joints) array
            The joints there and their derivatives by the length.

        Returns
        -------
        ModelRows
            What bounds q and q'.

        Raises
        ------
        LimitsError
            For a model with friction.
        PlanError
            Where standing still takes more than the torque.

        Notes
        -----
        The terms are

            c = f(r, 0, 0),  a = f(r, 0, r') - c,  b = f(r, r', r'') - c

        References
        ----------
        .. [1] Pham, Pham, IEEE T-RO 34(3), 2018, https://doi.org/10.1109/TRO.2018.2819195, section II.
        """
        r, r1, r2, _ = np.moveaxis(d, 1, 0)
        none = np.zeros_like(r)
        c = self.of(r, none, none)
        a, b = self.of(r, none, r1) - c, self.of(r, r1, r2) - c
        faster = self.of(r, 2.0 * r1, 4.0 * r2) - c - 4.0 * b
        if np.max(np.abs(faster), initial=0.0) > ALMOST * np.max(np.abs(b) + np.abs(c), initial=0.0):
            raise LimitsError(
                "torque: at twice the velocity and four times the acceleration the model's torque is not four times "
                "what motion takes: it has friction; leave that out of the model and give coulomb and viscous"
            )
        coulomb, viscous = self.dry
        most = self.bounds
        low, high = c - coulomb * (r1 <= 0.0), c + coulomb * (r1 >= 0.0)  # what rests may be pushed either way
        low, high = (np.where(r1 > 0.0, c + coulomb, low), np.where(r1 < 0.0, c - coulomb, high))
        over = np.argwhere(np.maximum(high, -low) >= most)
        if len(over):
            place, k = over[0].tolist()
            unit = unit_of(named("torque", self.axes[k]))
            raise PlanError(
                f"at s = {s[place]:.6g} mm standing still takes {max(high[place, k], -low[place, k]):.6g} "
                f"{unit} of {self.axes[k]}, whose torque is at most {most[k]:.6g} {unit}; only momentum could carry it "
                "past there, and that is not planned: the motion must be able to rest wherever it is; raise the torque "
                "or move the path"
            )
        some = np.isfinite(most)
        a, b, low, high, most = a[:, some], b[:, some], low[:, some], high[:, some], most[some]
        linear = np.stack([b / most, 0.5 * a / most], axis=1).transpose(2, 1, 0)
        root = (viscous * r1)[:, some] / most if np.any(viscous) else None
        if self.share < 1.0:  # either way of it, and viscous friction at a higher rate
            room = self.share * (1.0 - np.abs(c[:, some]) / most - coulomb[some] / most)
            if root is None:
                return ModelRows(linear=linear, low=-room.T, high=room.T)
            both = np.abs(root.T) * self.share * RESERVED
            return ModelRows(
                linear=np.concatenate([linear, -linear]),
                low=np.full((2 * len(both), len(r)), -FREE),
                high=np.concatenate([room.T, room.T]),
                root=np.concatenate([both, both]),
            )
        return ModelRows(
            linear=linear, low=(-1.0 - low / most).T, high=(1.0 - high / most).T, root=None if root is None else root.T
        )

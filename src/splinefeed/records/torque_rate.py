"""Bounds on how fast the torques of joints may change: what makes drives and joints of an arm sing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.records.arrays import Array
from splinefeed.records.modelled import ModelRows
from splinefeed.records.torque import OfTorques, Torque

#: How far joints go, rad or mm, and a motion, s, in the central differences of torques along it.
STEP, INSTANT = 1e-4, 1e-5


@dataclass(frozen=True)
class TorqueRate(OfTorques):
    """Bound the rate at which the torques (of linear joints: forces) of rigid bodies change, N m/s (N/s).

    Parameters
    ----------
    model : callable
        Inverse dynamics as that of `Torque`, without friction, whose steps have no rate.
    most : mapping of str to float
        The largest rate of every joint by axis name, in the order of the model's columns.

    Raises
    ------
    LimitsError
        For a model that cannot be called, and for bounds that are not positive or all infinite.

    Notes
    -----
    With the torques a q'/2 + b q + c along the path,

        d/dt (a q'/2 + b q + c) = sqrt(q) (a q''/2 + (a'/2 + b) q' + b' q + c')

    so it is a row of jerk with a rest. By setpoints it is what torques (n, joints) by differences change by from tick
    to tick, over the period.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.records.TorqueRate(lambda q, v, a: 0.02 * a, {"a": 1000.0}).kind
    'torque_rate'
    """

    kind, span, power = "torque_rate", 4, 3

    @property
    def _torque(self) -> Torque:
        return Torque(self.model, self.most)

    def seen(self, position: Array, period: float) -> tuple[Array, Array]:
        """(tau_{k+1} - tau_k) / T of the torques by differences, and the bounds."""
        found = np.diff(self._torque.seen(position, period)[0], axis=0) / period
        return found, np.broadcast_to(self.bounds, found.shape)

    def rounding(self, position: Array, period: float, each: Array) -> Array:
        """Twice what it makes of a torque, over the period."""
        found = self._torque.rounding(position, period, each)
        return np.asarray((found[1:] + found[:-1]) / period)

    def along(self, position: Array, velocity: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array]:
        """The rate at an instant, by a central difference along the motion, and the bounds."""
        h = INSTANT
        sides = [
            self.of(
                position + way * velocity + 0.5 * h * h * acceleration,
                velocity + way * acceleration + 0.5 * h * h * jerk,
                acceleration + way * jerk,
            )
            for way in (h, -h)
        ]
        found = (sides[0] - sides[1]) / (2.0 * h)
        return found, np.broadcast_to(self.bounds, found.shape)

    def rows(self, s: Array, d: Array) -> ModelRows:
        """a q''/2 + (a'/2 + b) q' + b' q + c', by central differences of a, b and c along the path, over the bound."""
        r, r1, r2, r3 = np.moveaxis(d, 1, 0)
        h = STEP / np.maximum(np.max(np.abs(r1), axis=1), 1e-12)[:, None]

        def parts(h: Array) -> tuple[Array, Array, Array]:
            at, one, two = (
                r + h * r1 + h**2 / 2.0 * r2 + h**3 / 6.0 * r3,
                r1 + h * r2 + h**2 / 2.0 * r3,
                r2 + h * r3,
            )
            none = np.zeros_like(at)
            c = self.of(at, none, none)
            return self.of(at, none, one) - c, self.of(at, one, two) - c, c

        a, b, _ = parts(0.0 * h)
        (a1, b1, c1) = ((ahead - behind) / (2.0 * h) for ahead, behind in zip(parts(h), parts(-h), strict=True))
        most = self.bounds
        some = np.isfinite(most)
        jerk = np.stack([b1, 0.5 * a1 + b, 0.5 * a], axis=1)[:, :, some] / most[some]
        return ModelRows(jerk=jerk.transpose(2, 1, 0), rest=(c1[:, some] / most[some]).T)

"""The limits of a motion at a point of the path: of each axis, of the feed squared, and of a law's own derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.records import Array, Limits


@dataclass(frozen=True, eq=False)
class AxisLimits:
    """Limits of each axis in the order of the path's axes, (axes,), infinite where there is none."""

    velocity: Array
    acceleration: Array
    jerk: Array

    @classmethod
    def of(cls, limits: Limits, names: tuple[str, ...]) -> AxisLimits:
        """The limits of the axes of these names."""
        return cls(*(limits.of_axes(name, names) for name in ("axis_velocity", "axis_acceleration", "axis_jerk")))


def deceleration_jerk(limits: Limits) -> float:
    """mm/s^3 while the feed falls."""
    return np.inf if limits.deceleration_jerk is None else limits.deceleration_jerk


def deceleration(limits: Limits) -> float:
    """mm/s^2."""
    return np.inf if limits.deceleration is None else limits.deceleration


def feed_squared_bound(
    first: Array, second: Array, feed: Array, limits: Limits, axes: AxisLimits, period: float | None, linear: int
) -> Array:
    """Largest q by feed, axis velocity, centripetal acceleration and chord error, (n,), mm^2/s^2; see `_tops`."""
    found: Array = np.min(_tops(first, second, feed, limits, axes, period, linear), axis=0)
    return found


def _tops(
    first: Array, second: Array, feed: Array, limits: Limits, axes: AxisLimits, period: float | None, linear: int
) -> list[Array]:
    """Largest q by feed, by the velocity of each axis with a limit, and by centripetal acceleration and chord error.

    first, second (n, axes): r', r'' by arc length; feed (n,): its limit there. A chord of length v T on radius 1/kappa
    leaves the curve by delta: v^2 = (4 / T^2) (2 delta / kappa - delta^2). On an arc of length 2 delta no point is
    further than delta from one of the ends, however it bends: v T = 2 delta is always allowed.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        tops = [feed**2]
        tops += [(axes.velocity[k] / np.abs(first[:, k])) ** 2 for k in np.flatnonzero(np.isfinite(axes.velocity))]
        kappa = np.linalg.norm(second[:, :linear], axis=1)
        if limits.centripetal is not None:
            tops.append(limits.centripetal / kappa)
        if limits.chord_error is not None and period is not None:
            delta = limits.chord_error
            chord = 4.0 / period**2 * (2.0 * delta * np.maximum(1.0 / kappa, delta) - delta * delta)
            tops.append(np.where(kappa > 0.0, chord, np.inf))
    return tops


def shares(
    d: Array,
    v: Array,
    a: Array,
    j: Array,
    feed: Array,
    limits: Limits,
    axes: AxisLimits,
    period: float | None,
    linear: int,
    rising: Array | None = None,
) -> Array:
    """Share of each limit, put as a factor on q: velocity squared, acceleration, jerk to the power 2/3, (limits, n).

    d (n, 4, axes): r and its derivatives by arc length; v, a, j (n,): of the law; feed (n,): its limit there;
    rising (n,): the sign of the acceleration along the path, 0 where both limits of jerk hold. One row a limit, and one
    for both directions along the path, that of jerk last; what is no number, as next to C' = 0, counts as no share.
    """
    r1, r2, r3 = d[:, 1], d[:, 2], d[:, 3]
    q = v * v
    found = [q / top for top in _tops(r1, r2, feed, limits, axes, period, linear)]
    for k in np.flatnonzero(np.isfinite(axes.acceleration)):
        found.append(np.abs(r1[:, k] * a + r2[:, k] * q) / axes.acceleration[k])
    for k in np.flatnonzero(np.isfinite(axes.jerk)):
        jerk = r1[:, k] * j + 3.0 * r2[:, k] * (v * a) + r3[:, k] * (q * v)
        found.append((np.abs(jerk) / axes.jerk[k]) ** (2.0 / 3.0))
    found.append(np.fmax(a / limits.acceleration, -a / deceleration(limits)))
    up, down = limits.jerk, deceleration_jerk(limits)
    sign = np.zeros(len(a)) if rising is None else rising
    tangential = np.where(sign > 0.0, up, np.where(sign < 0.0, down, min(up, down)))
    found.append((np.abs(j) / tangential) ** (2.0 / 3.0))
    return np.fmax(found, 0.0)

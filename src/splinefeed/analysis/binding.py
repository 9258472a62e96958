"""Which limit binds where: the share of each limit at each tick, and the maximum-velocity curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.analysis.motion import AxisMotion
from splinefeed.analysis.ripple import chord_errors
from splinefeed.geometry.differential import by_arc_length, curvatures
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import AXIS_LIMITS, Array, IntArray, Limits, Setpoints, TimeLaw

#: A limit binds where at least this share of it is used.
BINDS = 0.99


@dataclass(frozen=True, eq=False)
class LimitUse:
    """How much of each limit is used at each tick.

    names  (k,)    the limits as `check` names them, along the path first
    share  (n, k)  value / limit, absolute where it has a sign; t, s  (n,) s and mm
    counts (k+1,)  ticks at which nothing binds, and at which each limit does; of a long motion those left out too
    top    (n,)    maximum-velocity curve at the place of the tick, mm/s, infinite where nothing limits: the highest
                   feed that feed, centripetal, chord, velocity and acceleration limits leave there for any acceleration
    Source: docs/check.md. Example: `run.use.time_bound_by()`
    """

    names: tuple[str, ...]
    t: Array
    s: Array
    share: Array
    top: Array
    counts: IntArray

    @property
    def binding(self) -> IntArray:
        """Index into `names` of the limit that binds at each tick, (n,); -1 where none uses BINDS of its own."""
        return _binding(self.share)

    def time_bound_by(self) -> dict[str, float]:
        """Part of the time in which each limit binds, 0 to 1, those that never do left out; "none" for the rest."""
        none, *parts = (self.counts / max(int(self.counts.sum()), 1)).tolist()
        return {**{name: part for name, part in zip(self.names, parts, strict=True) if part > 0.0}, "none": none}


def _binding(share: Array) -> IntArray:
    """Column of `share` (n, k) that binds in each row, -1 for none."""
    if not share.shape[1]:
        return np.full(len(share), -1, dtype=np.int64)
    most = np.argmax(share, axis=1)
    binds = share[np.arange(len(most)), most] >= BINDS
    return np.where(binds, most, -1).astype(np.int64)


def limit_use(
    motion: AxisMotion, setpoints: Setpoints, path: Path | JointPath, law: TimeLaw, limits: Limits
) -> LimitUse:
    """Shares of all limits at the ticks, from the exact derivatives in `motion` and of `law`.

    On a JointPath the axes are joints, and feed and curvature those of the tip.
    """
    t = setpoints.t
    v, a, j = law.feed(t), law.acceleration(t), law.jerk(t)
    if isinstance(path, JointPath):
        d = path.derivatives(setpoints.s)
        kappa, (chord, axis_chord) = np.linalg.norm(d[:, 2, :3], axis=1), path.between_ticks(d)
        d, feed = d[:, :, 3:], feed_limit(setpoints, path.tool, limits)
    else:
        derivatives = path.evaluate(setpoints.curve, setpoints.u, 3)
        kappa = chord = curvatures(derivatives, path.linear)
        d, feed = by_arc_length(derivatives, path.linear), feed_limit(setpoints, path, limits)
    names: list[str] = []
    shares: list[Array] = []

    def add(name: str, values: Array, limit: Array | float | None) -> None:
        if limit is not None and np.any(np.isfinite(limit)):
            names.append(name)
            shares.append(np.abs(values) / limit)

    with np.errstate(invalid="ignore", over="ignore"):
        add("feed", v, feed)
        add("acceleration", np.maximum(a, 0.0), limits.acceleration)
        add("deceleration", np.minimum(a, 0.0), limits.deceleration)
        slowing = limits.jerk if limits.deceleration_jerk is None else limits.deceleration_jerk
        add("jerk", j, np.where(a < 0.0, slowing, limits.jerk))
        add("centripetal", v * v * kappa, limits.centripetal)
        if limits.chord_error is not None:
            if isinstance(path, JointPath):
                sagitta = chord * (v * setpoints.period) ** 2 / 8.0
            else:
                steps = chord_errors(setpoints, path)
                sagitta = np.append(steps, steps[-1:])
            add("chord_error", sagitta, limits.chord_error)
        if isinstance(path, JointPath):
            add("orientation_error", axis_chord * (v * setpoints.period) ** 2 / 8.0, limits.orientation_error)
        for name, values in zip(AXIS_LIMITS, (motion.velocity, motion.acceleration, motion.jerk), strict=True):
            for k, limit in enumerate(limits.of_axes(name, path.axes)):
                add(f"{name}.{path.axes[k]}", values[:, k], float(limit))
    share = np.column_stack(shares) if shares else np.empty((len(t), 0))
    top = maximum_velocity(d, kappa, chord, path.axes, limits, feed, setpoints.period)
    share = np.where(np.isfinite(share), share, 0.0)
    return LimitUse(
        tuple(names), t, setpoints.s, share, top, np.bincount(_binding(share) + 1, minlength=len(names) + 1)
    )


def feed_limit(setpoints: Setpoints, path: Path, limits: Limits) -> Array:
    """The least of the feed limit and of the feed of the program, at each tick (n,), mm/s.

    At the first tick of a curve the faster one of both sides counts: the step to it lies on the curve before.
    """
    if path.feeds is None:
        return np.full(len(setpoints), limits.feed)
    before = setpoints.curve[np.maximum(np.arange(len(setpoints)) - 1, 0)]
    return np.minimum(limits.feed, np.maximum(path.feeds[setpoints.curve], path.feeds[before]))


def maximum_velocity(
    d: Array, kappa: Array, chord: Array, axes: tuple[str, ...], limits: Limits, feed: Array, period: float
) -> Array:
    """The maximum-velocity curve at n places, (n,), mm/s.

    From derivatives by arc length d (n, 4, axes), curvature kappa (n,), 1/mm, and that which chords see, chord (n,).

    An axis has acceleration r' a + r'' q with q = v^2. Some a keeps all of them within A_i exactly where, for every
    two axes i, k taken with r' > 0,  q (r''_k / r'_k - r''_i / r'_i) <= A_k / r'_k + A_i / r'_i
    (Bobrow, Dubowsky & Gibson 1985, doi:10.1177/027836498500400301, by eliminating a).
    """
    velocity, acceleration = (limits.of_axes(name, axes) for name in AXIS_LIMITS[:2])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        top = np.minimum(feed, np.nanmin(velocity / np.abs(d[:, 1]), axis=1, initial=np.inf))
        square = top * top
        if limits.centripetal is not None:
            square = np.minimum(square, limits.centripetal / kappa)
        if limits.chord_error is not None:
            # the sagitta e of a chord v T on a circle: (v T / 2)^2 = e (2 / kappa - e)
            room = np.maximum(2.0 / chord - limits.chord_error, limits.chord_error)
            square = np.minimum(square, 4.0 * limits.chord_error * room / period**2)
        sign = np.where(d[:, 1] < 0.0, -1.0, 1.0)
        r1, r2 = sign * d[:, 1], sign * d[:, 2]
        along = np.append(acceleration, max(limits.acceleration, limits.deceleration or 0.0))
        r1 = np.column_stack([r1, np.ones(len(r1))])
        r2 = np.column_stack([r2, np.zeros(len(r2))])
        for i in range(r1.shape[1]):
            if not np.isfinite(along[i]):
                continue
            for k in range(r1.shape[1]):
                turn = r1[:, i] * r2[:, k] - r1[:, k] * r2[:, i]
                room = along[k] * r1[:, i] + along[i] * r1[:, k]
                if i == k:
                    turn, room = np.where(r1[:, i] <= 0.0, np.abs(r2[:, i]), 0.0), np.full(len(turn), along[i])
                if np.isfinite(along[k]):
                    square = np.where(turn > 0.0, np.minimum(square, room / turn), square)
        return np.asarray(np.sqrt(square))

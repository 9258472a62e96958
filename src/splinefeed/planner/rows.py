"""Limits as rows on y = (q, q', q'') at n places of a path, and the few that are no limits of a coordinate.

q <= top      low <= c0 q + c1 q' <= high      -1/sqrt(q) + ... <= c0 q + c1 q' + c2 q'' <= 1/sqrt(q) - ...
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from splinefeed.records import Array, IntArray
from splinefeed.records.modelled import ModelRows

#: A bound that never binds: a side of a row that has none, and the feed where nothing limits it.
FREE = 1e9
#: Places before and behind that are looked at, at most, for being within one step of the servo.
NEIGHBOURS = 64
#: A length by sigma, or its square, that is as good as 0.
TINY = 1e-140


@dataclass(frozen=True, eq=False)
class Rows:
    """All rows at n places.

    top (n,)           q <= top: the least of `own` and of `between` (n,), which holds between setpoints
    linear (m, 2, n)   c0, c1, with low and high (m, n), in units of the limit
    jerk (k, 3, n)     c0, c1, c2, in units of the limit
    jump (2, 2, k, n)  what jumps of the path take of the jerk, upwards and downwards: a constant, a factor of sqrt(q)
    coordinates, smooth  how many linear rows are accelerations of coordinates, and how many those and torques
    jerks              how many of those of jerk are of coordinates
    root (m, n)        what sqrt(q) adds to each linear row; None where it adds nothing
    """

    top: Array
    own: Array
    between: Array
    linear: Array
    low: Array
    high: Array
    jerk: Array
    jump: Array
    coordinates: int
    smooth: int
    jerks: int
    root: Array | None = None

    def lowered(self, top: Array, *, between: bool = False) -> Rows:
        """The same and q <= top (n,)."""
        name = "between" if between else "own"
        return replace(self, top=np.minimum(self.top, top), **{name: np.minimum(getattr(self, name), top)})

    def joined(self, more: ModelRows, *, smooth: bool) -> Rows:
        """The same and those of a model; smooth  whether a lower bound of the time may count its linear rows."""
        rows = self
        if more.top is not None:
            rows = rows.lowered(more.top)
        if len(more.linear):
            root = rows.root
            if root is not None or more.root is not None:
                none = np.zeros_like(more.high) if more.root is None else more.root
                root = np.concatenate([np.zeros_like(rows.high) if root is None else root, none])
            pairs = (rows.linear, more.linear), (rows.low, more.low), (rows.high, more.high)
            linear, low, high = (np.concatenate(pair) for pair in pairs)
            many = rows.smooth + smooth * len(more.linear)
            rows = replace(rows, linear=linear, low=low, high=high, root=root, smooth=many)
        if more.jerk is not None and more.rest is not None:
            jump = np.zeros((2, 2, *more.rest.shape))
            jump[0, 0], jump[1, 0] = more.rest, -more.rest
            jerk, jumps = np.concatenate([rows.jerk, more.jerk]), np.concatenate([rows.jump, jump], axis=2)
            rows = replace(rows, jerk=jerk, jump=jumps)
        return rows

    def at(self, some: IntArray) -> Rows:
        """Those at some of the places."""
        names = ["top", "own", "between", "linear", "low", "high", "jerk", "jump"]
        names += [] if self.root is None else ["root"]
        return replace(self, **{name: getattr(self, name)[..., some] for name in names})

    def tightened(self, factor: Array) -> Rows:
        """The same with q held to so much less, factor (3, n): of tops, linear rows, and jerk by its power 3/2."""
        top, linear, jerk = factor[0], factor[1], factor[2] ** -1.5
        return replace(
            self,
            top=self.top * top,
            low=self.low * linear,
            high=self.high * linear,
            jerk=self.jerk * jerk,
            jump=self.jump * jerk,
        )

    def shares(self, v: Array, a: Array, j: Array) -> Array:
        """Share of the top, of each linear row and of each of jerk as a factor on q, (1 + m + k, n).

        At sigma's derivatives by time (n,). Jerk goes with q^(3/2).
        """
        q = v * v
        linear = self.linear[:, 0] * q + self.linear[:, 1] * (2.0 * a)
        if self.root is not None:
            linear += self.root * v
        jerk = self.jerk[:, 0] * (q * v) + self.jerk[:, 1] * (2.0 * a * v) + self.jerk[:, 2] * (2.0 * j)
        up = jerk + self.jump[0, 0] * v + self.jump[0, 1] * q
        down = -jerk + self.jump[1, 0] * v + self.jump[1, 1] * q
        linear = np.maximum(np.maximum(linear, 0.0) / self.high, np.minimum(linear, 0.0) / self.low)
        return np.concatenate([(q / self.top)[None], linear, np.maximum(np.maximum(up, down), 0.0) ** (2.0 / 3.0)])

    def by_kind(self, shares: Array) -> Array:
        """The largest of shares (1 + m + k, ...): of the top, of linear rows and of jerk, (3, ...)."""
        m = 1 + len(self.linear)
        parts = (shares[:1], shares[1:m], shares[m:])
        return np.stack([np.max(each, axis=0, initial=0.0) for each in parts])


def tip_curvature(d: Array) -> tuple[Array, Array]:
    """s'^2, and s'^2 times the curvature of the tip's path, (n,) each: |p''| across p' for the tip p, d (n, 4, 3)."""
    one, two = d[:, 1], d[:, 2]
    square = np.sum(one * one, axis=1)
    across = two - (np.sum(one * two, axis=1) / np.maximum(square, TINY))[:, None] * one
    return square, np.linalg.norm(across, axis=1)


def centripetal(d: Array, most: float) -> Array:
    """The largest q with kappa s'^2 q <= most, (n,)."""
    return np.asarray(most / np.maximum(tip_curvature(d)[1], TINY))


def chord_error(s1: Array, bend: Array, whole: Array | None, turn: Array, delta: float) -> Array:
    """The longest steps of sigma that leave chords within `delta`, mm, (n,).

    A chord of length c leaves an arc of curvature kappa by kappa c^2 / 8 and turns of theta in all by c theta / 4 at
    most: c = 2 delta / (theta/4 + sqrt(theta^2/16 + kappa delta/2)). No point of a chord of 2 delta is further than
    delta from one of its ends: that is always allowed. A tip that slows down, as other axes turn, may turn back.

    s1 (n,)     the tip's way over that of sigma;  bend (n,)  s1^2 times the curvature that the chord leaves
    whole (n,)  |p''| of the tip's path, with what is along it; None where the tip never slows down
    turn (n,)   how far the tip's direction turns within reach, times s1
    """
    s1 = np.maximum(s1, TINY**0.5)
    quarter = 0.25 * turn / s1
    step = 2.0 * delta / np.maximum(quarter + np.sqrt(quarter**2 + 0.5 * bend / s1**2 * delta), TINY) / s1
    if whole is None:
        return np.asarray(np.maximum(step, 2.0 * delta / s1))
    whole = np.maximum(whole, TINY)
    step = np.minimum(step, s1 / whole)  # further on the tip may turn back
    step = np.maximum(step, np.sqrt(2.0 * delta / whole))
    return np.asarray(np.maximum(step, np.minimum(2.0 * delta / s1, s1 / whole)))


def within_reach(s: Array, step: Array) -> Array:
    """Steps (n,) that are no longer than those allowed at places s (n,), increasing, that they come to."""
    found = step.copy()
    for k in range(1, min(NEIGHBOURS, len(s) - 1) + 1):
        away = s[k:] - s[:-k]
        if not np.any(away < np.maximum(found[k:], found[:-k])):
            break
        found[k:] = np.minimum(found[k:], np.maximum(step[:-k], away))
        found[:-k] = np.minimum(found[:-k], np.maximum(step[k:], away))
    return found

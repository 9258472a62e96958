"""Limits as rows on y = (q, q', q'') at n places of a path.

q <= top      low <= c0 q + c1 q' <= high      -1/sqrt(q) + ... <= c0 q + c1 q' + c2 q'' <= 1/sqrt(q) - ...
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from splinefeed.records import Array, IntArray
from splinefeed.records.modelled import ModelRows

#: A bound that never binds: a side of a row that has none, and the feed where nothing limits it.
FREE = 1e9
#: A length by sigma, or its square, that is as good as 0.
TINY = 1e-140


@dataclass(frozen=True, eq=False)
class Rows:
    """All rows at n places.

    Parameters
    ----------
    top : (n,) array
        q <= top: the least of `own` and of `between`.
    own, between : (n,) array
        The top of each place, and that which holds between setpoints.
    linear : (m, 2, n) array
        c0, c1, in units of the limit.
    low, high : (m, n) array
        Bounds of the linear rows.
    jerk : (k, 3, n) array
        c0, c1, c2, in units of the limit.
    jump : (2, 2, k, n) array
        What jumps of the path take of the jerk, upwards and downwards: a constant, a factor of sqrt(q).
    coordinates, smooth : int
        How many linear rows are accelerations of coordinates, and how many those and torques.
    jerks : int
        How many of those of jerk are of coordinates.
    root : (2, m, n) array, optional
        What sqrt(q) adds to each linear row upwards and downwards; None where it adds nothing.
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
                own = np.zeros((2, *rows.high.shape)) if root is None else root
                added = np.zeros_like(more.high) if more.root is None else more.root
                root = np.concatenate([own, np.stack([added, -added])], axis=1)
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
        rise, fall = (linear, -linear) if self.root is None else (linear + self.root[0] * v, self.root[1] * v - linear)
        jerk = self.jerk[:, 0] * (q * v) + self.jerk[:, 1] * (2.0 * a * v) + self.jerk[:, 2] * (2.0 * j)
        up = jerk + self.jump[0, 0] * v + self.jump[0, 1] * q
        down = -jerk + self.jump[1, 0] * v + self.jump[1, 1] * q
        linear = np.maximum(np.maximum(rise, 0.0) / self.high, np.maximum(fall, 0.0) / -self.low)
        return np.concatenate([(q / self.top)[None], linear, np.maximum(np.maximum(up, down), 0.0) ** (2.0 / 3.0)])

    def by_kind(self, shares: Array) -> Array:
        """The largest of shares (1 + m + k, ...): of the top, of linear rows and of jerk, (3, ...)."""
        m = 1 + len(self.linear)
        parts = (shares[:1], shares[1:m], shares[m:])
        return np.stack([np.max(each, axis=0, initial=0.0) for each in parts])

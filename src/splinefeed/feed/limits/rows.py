"""A limit as rows on y = (q, q', q'') at places of a path, and all of them stacked for the optimiser."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from splinefeed.records import Array

#: A bound that never binds: a side of a row that has none, and the feed where nothing limits it.
FREE = 1e9


@dataclass(frozen=True, eq=False)
class Places:
    """Where limits give their rows.

    s       (n,)           arc length, mm
    d       (n, 4, axes)   r, r', r'', r''' by arc length
    linear                 how many axes the arc length counts
    axes                   names of the axes
    period                 servo period, s, or None
    feed    (n,)           feed that the path asks for, mm/s, infinite where none is given
    corner  (n,)           largest feed at a corner that is passed here, mm/s, infinite elsewhere
    turn, bend (2, axes, n)  the sum of the jumps of r' and of r'' within reach of the place, those up and those down
    chord   (n,)           curvature that a chord from tick to tick leaves, 1/mm, where it is not that of the path
    axis_chord (n,)        the same of the tool axis, rad/mm^2, where there is one
    rising  (n,)           1 where the motion surely speeds up, -1 where it slows down, 0 where it may do either
    alone                  whether what bends within a step of a place is of no concern: setpoints tell that
    """

    s: Array
    d: Array
    linear: int
    axes: tuple[str, ...]
    period: float | None
    feed: Array
    corner: Array
    turn: Array
    bend: Array
    rising: Array
    chord: Array | None = None
    axis_chord: Array | None = None
    alone: bool = False

    @property
    def curvature(self) -> Array:
        """|r''| over the axes that the arc length counts, 1/mm, (n,)."""
        return np.asarray(np.linalg.norm(self.d[:, 2, : self.linear], axis=1))


@dataclass(frozen=True, eq=False)
class Top:
    """q <= q (n,), mm^2/s^2."""

    name: str
    q: Array


@dataclass(frozen=True, eq=False)
class Linear:
    """low <= c0 q + c1 q' <= high, each (n,); normalised, so that the larger of -low and high is about 1."""

    name: str
    c0: Array
    c1: Array
    low: Array | float = -1.0
    high: Array | float = 1.0


@dataclass(frozen=True, eq=False)
class Jerk:
    """-1/sqrt(q) + down <= c0 q + c1 q' + c2 q'' <= 1/sqrt(q) - up, normalised by the limit.

    up, down  what jumps of the path take of it: a constant, and a factor of sqrt(q), each (n,) or a number
    """

    name: str
    c0: Array
    c1: Array
    c2: Array
    up: Sequence[Array | float] = (0.0, 0.0)
    down: Sequence[Array | float] = (0.0, 0.0)


Row = Top | Linear | Jerk


@dataclass(frozen=True, eq=False)
class Rows:
    """All rows at n places: tops in one, m linear ones, k of jerk.

    top        (n,);  linear (m, 2, n), low and high (m, n);  jerk (k, 3, n), jump (2, 2, k, n): up and down, each a
    constant and a factor of sqrt(q);  names of each: tops (t,) with their own q (t, n), linear (m,) and jerk (k,)
    """

    top: Array
    tops: Array
    linear: Array
    low: Array
    high: Array
    jerk: Array
    jump: Array
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]

    def tightened(self, factor: Array) -> Rows:
        """The same with q held to so much less, (3, n): tops and linear rows by the factor, jerk by its power 3/2."""
        top, linear, jerk = factor[0], factor[1], factor[2] ** -1.5
        return dataclasses.replace(
            self,
            top=self.top * top,
            low=self.low * linear,
            high=self.high * linear,
            jerk=self.jerk * jerk,
            jump=self.jump * jerk,
        )

    def only_rising(self, way: Array, least: float) -> Rows:
        """And one more linear row: q' >= least where way (n,) is 1, q' <= -least where it is -1, anything where 0."""
        unit = np.max(np.abs(self.linear[:, 1]), axis=0, initial=0.0)
        unit = np.where(unit > 0.0, unit, 1.0)
        row = np.stack([np.zeros(len(way)), unit * way])
        low, high = np.where(way != 0.0, unit * least, -FREE), np.full(len(way), FREE)
        return dataclasses.replace(
            self,
            linear=np.concatenate([self.linear, row[None]]),
            low=np.concatenate([self.low, low[None]]),
            high=np.concatenate([self.high, high[None]]),
            names=(self.names[0], (*self.names[1], "turn"), self.names[2]),
        )

    def by_kind(self, shares: Array) -> Array:
        """The largest of shares (t + m + k, ...) among tops, linear rows and those of jerk, (3, ...)."""
        edges = np.cumsum([0, *(len(names) for names in self.names)])
        parts = [np.max(shares[a:b], axis=0, initial=0.0) for a, b in pairwise(edges.tolist())]
        return np.stack(parts)

    def shares(self, v: Array, a: Array, j: Array) -> Array:
        """Share of each limit as a factor on q, (t + m + k, n), at feeds, accelerations and jerks along the path (n,).

        q for tops, accelerations as they are, jerk to the power 2/3.
        """
        q = v * v
        linear = self.linear[:, 0] * q + self.linear[:, 1] * (2.0 * a)
        jerk = self.jerk[:, 0] * (q * v) + self.jerk[:, 1] * (2.0 * a * v) + self.jerk[:, 2] * (2.0 * j)
        up = jerk + self.jump[0, 0] * v + self.jump[0, 1] * q
        down = -jerk + self.jump[1, 0] * v + self.jump[1, 1] * q
        return np.concatenate(
            [
                q / self.tops,
                np.maximum(np.maximum(linear, 0.0) / self.high, np.minimum(linear, 0.0) / self.low),
                np.maximum(np.maximum(up, down), 0.0) ** (2.0 / 3.0),
            ]
        )


def stacked(rows: Sequence[Row], n: int) -> Rows:
    """Rows in one."""
    tops = [row for row in rows if isinstance(row, Top)]
    linear = [row for row in rows if isinstance(row, Linear)]
    jerk = [row for row in rows if isinstance(row, Jerk)]
    each = _table([(np.minimum(row.q, FREE**2),) for row in tops], 1, n)[:, 0]
    ends = _table([(np.maximum(row.low, -FREE), np.minimum(row.high, FREE)) for row in linear], 2, n)
    jump = np.stack([_table([row.up for row in jerk], 2, n), _table([row.down for row in jerk], 2, n)])
    return Rows(
        top=np.min(each, axis=0),
        tops=each,
        linear=_table([(row.c0, row.c1) for row in linear], 2, n),
        low=ends[:, 0],
        high=ends[:, 1],
        jerk=_table([(row.c0, row.c1, row.c2) for row in jerk], 3, n),
        jump=np.moveaxis(jump, 1, 2),
        names=(tuple(row.name for row in tops), tuple(row.name for row in linear), tuple(row.name for row in jerk)),
    )


def _table(rows: Sequence[Sequence[Array | float]], width: int, n: int) -> Array:
    """Rows of so many values, each (n,) or a number, (rows, width, n)."""
    out = np.empty((len(rows), width, n))
    for each, given in zip(out, rows, strict=True):
        for place, value in zip(each, given, strict=True):
            place[:] = value
    return out

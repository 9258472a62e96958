"""Setpoints at any instants of a law, forwards or backwards: what a law that is run at another rate needs."""

from __future__ import annotations

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.interpolation.stepping import AT_END, placed
from splinefeed.kernels.arc_length import arc_length
from splinefeed.kernels.jit import kernel
from splinefeed.kernels.law import law_at
from splinefeed.kernels.pieces import HIGH, LOW, MIDDLE, SCALE, START, Shape, point, walk_to
from splinefeed.records import Array, IntArray, Setpoints, TimeLaw

METHOD = "arc-length"


@kernel
def _fill(
    breaks: Array,
    coefficients: Array,
    table: Array,
    curve_rows: IntArray,
    shape: Shape,
    length: float,
    tau: Array,
    state: IntArray,
    curve: IntArray,
    u_out: Array,
    s_out: Array,
    feed_out: Array,
    position: Array,
) -> None:
    """The point at every tau (n,), s; state (3,): row, curve, piece of the law, carried on."""
    cursor = np.empty(3, dtype=np.int64)
    cursor[0] = state[0]
    current = state[1]
    piece = state[2]
    last_curve = curve_rows.shape[0] - 1
    end = breaks[breaks.shape[0] - 1]
    for i in range(tau.shape[0]):
        piece, s, feed, _ = law_at(breaks, coefficients, piece, tau[i])
        s = min(max(s, 0.0), length)
        if tau[i] >= end * (1.0 - AT_END) and length - s <= AT_END * length:
            s = length
        while current < last_curve and s >= table[curve_rows[current + 1, 0], START]:
            current += 1
        while current > 0 and s < table[curve_rows[current, 0], START]:
            current -= 1
        first = curve_rows[current, 0]
        last = curve_rows[current, 1]
        cursor[0] = min(max(cursor[0], first), last)
        cursor[1] = first
        cursor[2] = last
        u = placed(table[cursor[0], MIDDLE], s, table, cursor)
        if s >= length:
            u = table[last, HIGH]
        elif s <= table[first, START]:
            u = table[first, LOW]
        u = min(max(u, table[first, LOW]), table[last, HIGH])
        row = walk_to(table, cursor, u)
        t = (u - table[row, MIDDLE]) * table[row, SCALE]
        point(table, row, shape, t, position[i])
        curve[i] = current
        u_out[i] = u
        s_out[i] = arc_length(table, row, t)
        feed_out[i] = max(feed, 0.0)
    state[0] = cursor[0]
    state[1] = current
    state[2] = piece


class Instants:
    """Points of one motion at instants of its law, block by block."""

    def __init__(self, path: Path, law: TimeLaw, period: float) -> None:
        self.path, self.law, self.period = path, law, period
        self.tick = 0
        self._state = np.zeros(3, dtype=np.int64)

    def block(self, tau: Array, rate: Array) -> Setpoints:
        """Setpoints at plan times tau (n,), s, one period apart; rate (n,) of plan time to time, for the feed."""
        count, path = len(tau), self.path
        curve, u, s, feed = np.empty(count, dtype=np.int64), np.empty(count), np.empty(count), np.empty(count)
        position = np.empty((count, len(path.axes)))
        given = (self.law.breaks, self.law.coefficients, path.table, path.curve_rows, path.shape, path.length)
        _fill(*given, np.ascontiguousarray(tau), self._state, curve, u, s, feed, position)
        t = np.arange(self.tick, self.tick + count, dtype=np.float64) * self.period
        self.tick += count
        settings = {**self.law.settings, "path": path.name, "period": self.period, "method": METHOD}
        return Setpoints(
            t=t,
            curve=curve,
            u=u,
            s=s,
            feed=feed * rate,
            position=position,
            axes=path.axes,
            period=self.period,
            method=METHOD,
            settings=settings,
        )

"""q = feed^2 along a stretch as a quadratic spline, and the limits of path and axes as rows on its coefficients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.feed.cells import Cells
from splinefeed.feed.stretches import curve_feeds
from splinefeed.kernels import barrier
from splinefeed.records import Array, Limits

#: Gauss points a cell for the travel time.
GAUSS = 4
#: How much of a jerk limit the end cell may use, as its ramp is bounded at two places only.
END_MARGIN = 0.98
#: Largest weight of one instant in a third difference over the period: the peak of the quadratic B-spline.
PEAK_WEIGHT = 0.75
#: A jump of acceleration at a curvature jump may use this much of the axis jerk; the smooth motion near it the rest.
JUMP_SHARE = 0.5
#: A jump that would use less than this share at full feed is rounding.
NO_JUMP = 1e-9
#: Newton steps of one optimisation; 20 to 60 are usual.
MAX_STEPS = 300


@dataclass(frozen=True, eq=False)
class AxisLimits:
    """Limits of each axis in the order of the path's axes, (axes,), infinite where there is none."""

    velocity: Array
    acceleration: Array
    jerk: Array


class SquareProblem:
    """Least time over one stretch: unknowns c (n + 2,), the coefficients of q on the knots of the cells.

    q is quadratic in s on every cell, with q' continuous:  q' = 2 s'',  sqrt(q) q'' = 2 s'''.
    An axis has  velocity r' sqrt(q),  acceleration r' q'/2 + r'' q,  jerk sqrt(q) (r' q''/2 + 3/2 r'' q' + r''' q).
    At rest, q goes with s^(4/3): the first and the last `end` mm are no cells but ramps of constant jerk.

    scale (n,) <= 1 is how much of every limit each cell may use. With `relaxed` there are no jerk limits, the limits
    are asked for in the middle of each cell only, and the ends start with constant acceleration: a bound from below.
    """

    def __init__(
        self,
        cells: Cells,
        ends: tuple[float, float],
        limits: Limits,
        axes: AxisLimits,
        period: float | None,
        scale: Array | None = None,
        *,
        relaxed: bool = False,
    ) -> None:
        self.cells = cells
        self.ends = ends
        n = cells.count
        h = cells.length
        scale = np.ones(n) if scale is None else scale
        before = np.concatenate([[0.0], h[:-1]])
        after = np.concatenate([h[1:], [0.0]])
        left = before / (before + h)
        right = h / (h + after)
        zero, one = np.zeros(n), np.ones(n)
        # Bezier coefficients of a cell from the three spline coefficients that reach into it
        self._bezier = np.stack(
            [
                np.stack([one - left, left, zero], 1),
                np.stack([zero, one, zero], 1),
                np.stack([zero, one - right, right], 1),
            ]
        )
        #: c[0] = ties[0] c[1] and c[-1] = ties[1] c[-2]: q goes with s^growth from rest, so that q' = growth q / end
        growth = 1.0 if relaxed else 4.0 / 3.0
        self.ties = tuple(
            1.0 / (1.0 + 0.5 * growth * width / end) for width, end in zip((h[0], h[-1]), ends, strict=True)
        )
        fractions, derivatives = cells.derivatives()
        node_top, calm = self._jumps(derivatives, limits, axes, period)
        twist = scale**1.5 * calm
        linear, bound, jerk, root = [], [], [], []
        second = self._second()
        least = np.inf
        feed = curve_feeds(cells.path, limits)[cells.curve]
        for place, fraction in enumerate(fractions):
            if relaxed and place != 1:
                continue
            r1, r2, r3 = (derivatives[place, :, k] for k in range(3))
            q, slope = self._value(fraction), self._slope(fraction)
            top = feed_squared_bound(r1, r2, feed, limits, axes, period, cells.path.linear) * scale
            if place == 0:
                top[0] = min(top[0], self._ramp_bound(0, r1[0], limits, axes) * scale[0])
            if place == len(fractions) - 1:
                top[-1] = min(top[-1], self._ramp_bound(1, r1[-1], limits, axes) * scale[-1])
            if place != 1:
                top = np.minimum(top, node_top[:-1] if place == 0 else node_top[1:])
            least = min(least, float(np.min(top)))
            linear += [self._tied(q / top[:, None]), self._tied(-q / top[:, None])]
            bound += [one, zero]
            for sign, limit in ((1.0, limits.acceleration), (-1.0, limits.deceleration)):
                if limit is not None and np.isfinite(limit):
                    linear.append(self._tied(sign * 0.5 * slope / limit))
                    bound.append(scale)
            tangential = min(limits.jerk, limits.deceleration_jerk or np.inf)
            if np.isfinite(tangential) and not relaxed:
                jerk.append(self._tied(0.5 * second / (tangential * twist)[:, None]))
                root.append(self._tied(q))
            for axis in range(r1.shape[1]):
                d1, d2, d3 = (r[:, axis, None] for r in (r1, r2, r3))
                if np.isfinite(axes.acceleration[axis]):
                    row = self._tied((0.5 * d1 * slope + d2 * q) / axes.acceleration[axis])
                    linear += [row, -row]
                    bound += [scale, scale]
                if np.isfinite(axes.jerk[axis]) and not relaxed:
                    share = (axes.jerk[axis] * twist)[:, None]
                    jerk.append(self._tied((0.5 * d1 * second + 1.5 * d2 * slope + d3 * q) / share))
                    root.append(self._tied(q))
        if relaxed:
            for which, at, place in ((0, 0, 0), (1, n - 1, 2)):
                row = np.zeros((n, 3))
                row[at] = self._value(fractions[place])[at] / self._start_bound(
                    which, derivatives[place, at, 0], limits, axes
                )
                linear.append(self._tied(row))
                bound.append(one)
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        self._rows = np.ascontiguousarray(
            np.stack([self._tied(self._value(np.full(n, 0.5 * (x + 1.0)))) for x in nodes], 1)
        )
        self._weights = np.ascontiguousarray(0.5 * h[:, None] * weights)
        self._linear = np.ascontiguousarray(np.stack(linear, 1))
        self._bound = np.ascontiguousarray(np.stack(bound, 1))
        empty = np.zeros((n, 0, 3))
        self._jerk = np.ascontiguousarray(np.stack(jerk, 1)) if jerk else empty
        self._root = np.ascontiguousarray(np.stack(root, 1)) if root else empty
        #: Least bound of q anywhere, mm^2/s^2.
        self.least_bound = least
        # the time of an end is length / v times 3 at constant jerk, 2 at constant acceleration; the kernel takes 3
        share = 2.0 / 3.0 if relaxed else 1.0
        self._end_rows = np.array([[share * ends[0], self.ties[0]], [share * ends[1], self.ties[1]]])

    def _jumps(self, derivatives: Array, limits: Limits, axes: AxisLimits, period: float | None) -> tuple[Array, Array]:
        """Bound of q at each node, (n + 1,), and share of the axis jerk left to each cell, (n,), by curvature jumps.

        Where r'' jumps by D the acceleration of an axis jumps by D q, and the third difference over the period T sees
        at most 3/4 D q / T of it at once. That gets a share of the axis jerk, and the smooth motion within the reach
        of that difference the rest.
        """
        n = self.cells.count
        bound, calm = np.full(n + 1, np.inf), np.ones(n)
        if period is None or not np.any(np.isfinite(axes.jerk)):
            return bound, calm
        jump = np.abs(derivatives[0, 1:, 1] - derivatives[2, :-1, 1])
        with np.errstate(divide="ignore"):
            whole = np.min(axes.jerk * period / (PEAK_WEIGHT * jump), axis=1)
        feed = curve_feeds(self.cells.path, limits)[self.cells.curve]
        top = feed_squared_bound(
            derivatives[0, 1:, 0], derivatives[0, 1:, 1], feed[1:], limits, axes, period, self.cells.path.linear
        )
        share = np.minimum(top / whole, JUMP_SHARE)
        left = np.ones(n)
        for node in np.flatnonzero(share > NO_JUMP):
            bound[node + 1] = share[node] * whole[node]
            reach = 2.0 * period * np.sqrt(min(top[node], bound[node + 1]))
            near = np.abs(self.cells.s - self.cells.s[node + 1]) <= reach
            left[near[1:] | near[:-1]] -= share[node]
        return bound, np.maximum(left, 1.0 - 1.5 * JUMP_SHARE)

    def _value(self, fraction: Array) -> Array:
        """Rows of q at a fraction of each cell, (n, 3)."""
        f = fraction[:, None]
        b0, b1, b2 = self._bezier
        rows: Array = (1.0 - f) ** 2 * b0 + 2.0 * f * (1.0 - f) * b1 + f * f * b2
        return rows

    def _slope(self, fraction: Array) -> Array:
        """Rows of q' at a fraction of each cell, (n, 3)."""
        f = fraction[:, None]
        b0, b1, b2 = self._bezier
        rows: Array = 2.0 * ((1.0 - f) * (b1 - b0) + f * (b2 - b1)) / self.cells.length[:, None]
        return rows

    def _second(self) -> Array:
        """Rows of q'', (n, 3)."""
        b0, b1, b2 = self._bezier
        rows: Array = 2.0 * (b0 - 2.0 * b1 + b2) / (self.cells.length**2)[:, None]
        return rows

    def _tied(self, rows: Array) -> Array:
        """Rows with the first and the last coefficient put in terms of their neighbours."""
        out = rows.copy()
        out[0, 1] += self.ties[0] * out[0, 0]
        out[0, 0] = 0.0
        out[-1, 1] += self.ties[1] * out[-1, 2]
        out[-1, 2] = 0.0
        return out

    def _ramp_bound(self, which: int, direction: Array, limits: Limits, axes: AxisLimits) -> float:
        """Largest q at the inner end of a ramp: s = j t^3 / 6 gives q = (9/2 j end^2)^(2/3); j by the axes' jerks."""
        with np.errstate(divide="ignore"):
            most = float(np.min(axes.jerk / np.abs(direction)))
        most = END_MARGIN * min(most, limits.jerk, limits.deceleration_jerk or np.inf)
        return float((4.5 * most * self.ends[which] ** 2) ** (2.0 / 3.0)) if np.isfinite(most) else np.inf

    def _start_bound(self, which: int, direction: Array, limits: Limits, axes: AxisLimits) -> float:
        """Largest q at the inner end of a start at constant acceleration, q = 2 a end, with a hair to stay a bound."""
        with np.errstate(divide="ignore"):
            most = min(float(np.min(axes.acceleration / np.abs(direction))), limits.acceleration)
        return 2.0 * 1.01 * most * self.ends[which] if np.isfinite(most) else limits.feed**2

    def complete(self, c: Array) -> Array:
        """c with its tied ends put right."""
        out = c.copy()
        out[0] = self.ties[0] * out[1]
        out[-1] = self.ties[1] * out[-2]
        return out

    def at(self, c: Array, fraction: Array | float) -> tuple[Array, Array, Array]:
        """q, q', q'' at a fraction of each cell, (n,)."""
        f = np.broadcast_to(np.asarray(fraction, dtype=np.float64), (self.cells.count,))
        near = np.stack([c[:-2], c[1:-1], c[2:]], 1)
        return tuple(np.sum(rows * near, axis=1) for rows in (self._value(f), self._slope(f), self._second()))

    def nodes(self, c: Array) -> Array:
        """q at every node, (n + 1,)."""
        return np.append(self.at(c, 0.0)[0], self.at(c, 1.0)[0][-1])

    def room(self, c: Array) -> float:
        """Least relative room to any limit at c; not positive if one does not hold."""
        shape = (self.cells.count, self._bound.shape[1] + 2 * self._jerk.shape[1])
        return float(
            barrier.slacks(
                self.complete(c),
                self._linear,
                self._bound,
                self._jerk,
                self._root,
                np.empty(shape),
                np.empty((1, 1, 3)),
                False,
            )
        )

    def solve(self, c: Array, *, tolerance: float) -> tuple[Array, float, float]:
        """Coefficients, time and duality gap in s of the least time, from c, which must have room to every limit."""
        start = self.complete(c)
        dual = np.empty((self.cells.count, self._bound.shape[1] + 2 * self._jerk.shape[1]))
        report = np.zeros(3)
        barrier.least_time(
            start,
            self._linear,
            self._bound,
            self._jerk,
            self._root,
            self._rows,
            self._weights,
            self._end_rows,
            1,
            self.cells.count,
            tolerance,
            MAX_STEPS,
            dual,
            False,
            report,
        )
        return self.complete(start), float(report[0]), float(report[0] * report[1])


def feed_squared_bound(
    first: Array, second: Array, feed: Array, limits: Limits, axes: AxisLimits, period: float | None, linear: int
) -> Array:
    """Largest q by feed, axis velocity, centripetal acceleration and chord error, (n,), mm^2/s^2.

    first, second (n, axes): r', r'' by arc length; feed (n,): its limit there. A chord of length v T on radius 1/kappa
    leaves the curve by delta: v^2 = (4 / T^2) (2 delta / kappa - delta^2).
    """
    with np.errstate(divide="ignore"):
        top: Array = feed**2
        top = np.minimum(top, np.min((axes.velocity / np.abs(first)) ** 2, axis=1))
        kappa = np.linalg.norm(second[:, :linear], axis=1)
        if limits.centripetal is not None:
            top = np.minimum(top, limits.centripetal / kappa)
        if limits.chord_error is not None and period is not None:
            delta = np.minimum(limits.chord_error, 1.0 / kappa)
            top = np.minimum(top, 4.0 / period**2 * (2.0 * delta / kappa - delta * delta))
    return top

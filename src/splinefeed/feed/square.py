"""q = feed^2 along a stretch as a quadratic spline, and the limits of path and axes as rows on its coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from splinefeed.feed.bounds import AxisLimits, deceleration, deceleration_jerk, feed_squared_bound
from splinefeed.feed.cells import Cells
from splinefeed.feed.stretches import curve_feeds
from splinefeed.kernels import barrier
from splinefeed.records import Array, Limits

#: Gauss points a cell for the travel time.
GAUSS = 4
#: How much of a jerk limit the end cell may use, as its ramp is bounded at a few places only.
END_MARGIN = 0.98
#: Largest weight of one instant in a third difference over the period: the peak of the quadratic B-spline.
PEAK_WEIGHT = 0.75
#: The smooth motion within so many periods of a curvature jump shares the axis jerk with it.
REACH = 2.0
#: A turn too small for a corner may use this much of acceleration and jerk.
TURN_SHARE = 0.5
#: A jump that would use less than this share at full feed is rounding.
NO_JUMP = 1e-9
#: Turns of r' below this are rounding, and places nearer than this share of the path one place.
NO_TURN, SAME_PLACE = 1e-8, 1e-12
#: Newton steps of one optimisation; 20 to 60 are usual.
MAX_STEPS = 300
#: How dear, in travel times, a feed at a moving end is that falls short of the one asked for.
SHORTFALL = 2.0
#: No start of the optimiser falls below this share of what is around it.
LEAST = 1e-3


@dataclass(frozen=True)
class End:
    """One end of a stretch: at rest, in motion, or free.

    length, jerk  of the ramp s = j t^3 / 6 at rest, mm and mm/s^3; 0 at an end that is not at rest
    feed          of an end in motion, mm/s; None where any feed will do
    """

    length: float = 0.0
    jerk: float = 0.0
    feed: float | None = None

    @property
    def rest(self) -> bool:
        """Whether the tool stands there."""
        return self.length > 0.0


@dataclass(frozen=True, eq=False)
class Setting:
    """What a stretch is planned under: limits, those of the axes, the period in s or none, and corners in passing.

    corner_s, corner_feed  (k,)  arc lengths and largest feeds of corners that are passed in motion, mm and mm/s
    sharp  (j,)  arc lengths of sharp bends that samples might miss, mm
    narrow  (i, 2)  and of bends that lie between all places of a cell, with the bound of q there, mm and mm^2/s^2
    """

    limits: Limits
    axes: AxisLimits
    period: float | None
    corner_s: Array
    corner_feed: Array
    sharp: Array
    narrow: Array = field(default_factory=lambda: np.zeros((0, 2)))

    def narrow_tops(self, cells: Cells) -> Array:
        """Bound of q in each cell by the narrow bends in it, (n,), mm^2/s^2; infinite where there is none."""
        found = np.full(cells.count, np.inf)
        inside = (self.narrow[:, 0] >= cells.s[0]) & (self.narrow[:, 0] <= cells.s[-1])
        owner = np.searchsorted(cells.s, self.narrow[inside, 0], side="right") - 1
        np.minimum.at(found, np.minimum(owner, cells.count - 1), self.narrow[inside, 1])
        return found


class SquareProblem:
    """Least time over one stretch: unknowns c (n + 2,), the coefficients of q on the knots of the cells.

    q is quadratic in s on every cell, with q' continuous:  q' = 2 s'',  sqrt(q) q'' = 2 s'''.
    An axis has  velocity r' sqrt(q),  acceleration r' q'/2 + r'' q,  jerk sqrt(q) (r' q''/2 + 3/2 r'' q' + r''' q).
    At rest, q goes with s^(4/3): the first and the last `length` mm are no cells but ramps of constant jerk. At an end
    in motion q' = 0 and q is held to the square of its feed from above, and falling short is made dear.

    scale (n,) <= 1 is how much of every limit each cell may use; rising (n,) is 1 where the feed grows, -1 where it
    falls, 0 where both limits of jerk along the path hold. With `relaxed` there are no jerk limits, the limits are
    asked for in the middle of each cell only, and ends start with constant acceleration: a bound from below. No feed is
    above `cap`, mm/s.
    """

    def __init__(
        self,
        cells: Cells,
        ends: tuple[End, End],
        setting: Setting,
        scale: Array | None = None,
        rising: Array | None = None,
        *,
        cap: float = np.inf,
        relaxed: bool = False,
    ) -> None:
        self.cells = cells
        self.ends = ends
        self.setting = setting
        self.cap = cap
        limits, axes, period = setting.limits, setting.axes, setting.period
        n = cells.count
        h = cells.length
        scale = np.ones(n) if scale is None else scale
        #: What the caller gave, for a problem like this one.
        self.scale, self.rising = scale, rising
        before = np.concatenate([[0.0], h[:-1]])
        after = np.concatenate([h[1:], [0.0]])
        with np.errstate(invalid="ignore"):  # what has no length is found by `room`
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
        #: c[0] = ties[0] c[1] and c[-1] = ties[1] c[-2]: q goes with s^growth from rest, so that q' = growth q / end;
        #: at an end in motion q' = 0, as the relaxation does not ask for
        growth = 1.0 if relaxed else 4.0 / 3.0
        self.ties = tuple(
            1.0 / (1.0 + 0.5 * growth * width / end.length)
            if end.rest
            else (1.0 if end.feed is not None and not relaxed else None)
            for width, end in zip((h[0], h[-1]), ends, strict=True)
        )
        fractions, derivatives = cells.derivatives()
        node_top, jumped = self._jumps(derivatives)
        twist = scale**1.5
        linear, bound, jerk, root, jump = [], [], [], [], []
        second = self._second()
        lowest = np.full(n, np.inf)
        feed = curve_feeds(cells.path, limits)[cells.curve]
        up, down = limits.jerk, deceleration_jerk(limits)
        widest = np.full(n, cap * cap)
        if not relaxed:  # a bound of the time must not take a whole cell for slow
            widest = np.minimum(widest, setting.narrow_tops(cells))
        sign_of = np.zeros(n) if rising is None else rising
        tangential = np.where(sign_of > 0.0, up, np.where(sign_of < 0.0, down, min(up, down)))
        for place, fraction in enumerate(fractions):
            if relaxed and place != 1:
                linear.append(self._tied(-self._value(fraction)))
                bound.append(zero)
                continue
            r1, r2, r3 = (derivatives[place, :, k] for k in range(3))
            q, slope = self._value(fraction), self._slope(fraction)
            top = feed_squared_bound(r1, r2, feed, limits, axes, period, cells.path.linear)
            top = np.minimum(top, widest) * scale
            if place == 0:
                top[0] = min(top[0], self._end_bound(0) * (scale[0] if ends[0].rest else 1.0))
            if place == len(fractions) - 1:
                top[-1] = min(top[-1], self._end_bound(1) * (scale[-1] if ends[1].rest else 1.0))
            if place != 1:
                top = np.minimum(top, node_top[:-1] if place == 0 else node_top[1:])
            lowest = np.minimum(lowest, top)
            linear += [self._tied(q / top[:, None]), self._tied(-q / top[:, None])]
            bound += [one, zero]
            for sign, limit in ((1.0, limits.acceleration), (-1.0, deceleration(limits))):
                if np.isfinite(limit):
                    linear.append(self._tied(sign * 0.5 * slope / limit))
                    bound.append(scale)
            if np.any(np.isfinite(tangential)) and not relaxed:
                jerk.append(self._tied(0.5 * second / (tangential * twist)[:, None]))
                root.append(self._tied(q))
                jump.append(np.zeros((n, 2)))
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
                    jump.append(jumped[:, axis] / twist[:, None])
        if relaxed:
            for which, at, place in ((0, 0, 0), (1, n - 1, 2)):
                if ends[which].feed is None and not ends[which].rest:
                    continue
                row = np.zeros((n, 3))
                row[at] = self._value(fractions[place])[at] / self._start_bound(which, derivatives[place, at, 0])
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
        self._jump = np.ascontiguousarray(np.stack(jump, 1)) if jump else np.zeros((n, 0, 2))
        #: Least bound of q anywhere, mm^2/s^2.
        self.least_bound = float(np.min(lowest))
        # the time of an end is length / v times 3 at constant jerk, 2 at constant acceleration; the kernel takes 3
        share = 2.0 / 3.0 if relaxed else 1.0
        self._end_rows = np.zeros((2, 3))
        self._shortfall = 0.0
        for which, (end, inner, outer) in enumerate(zip(ends, (1, n), (0, n + 1), strict=True)):
            tie = self.ties[which]
            if end.rest and tie is not None:
                # q at the inner end is that of its node: between c and its tied neighbour
                self._end_rows[which] = share * end.length, tie, inner
            elif end.feed is not None:
                around = float(np.sum(h / np.sqrt(lowest))) * SHORTFALL
                self._shortfall += around
                self._end_rows[which] = around * end.feed / 3.0, 1.0, outer if tie is None else inner

    def _jumps(self, derivatives: Array) -> tuple[Array, Array]:
        """Bound of q at each node, (n + 1,), by corners; and by curvature jumps share of axis jerk a q, (n, axes, 2).

        Where r'' jumps by D the acceleration of an axis jumps by D q, and the third difference over the period T sees
        at most 3/4 D q / T of it at once: up or down. Where r' itself turns by D, too little to be a corner,
        differences see D v / T and D v / T^2. At a corner that is passed its own feed counts, and nothing else is
        looked at.
        """
        cells, setting = self.cells, self.setting
        axes, period = setting.axes, setting.period
        n = cells.count
        bound, jumped = np.full(n + 1, np.inf), np.zeros((n, derivatives.shape[3], 2))
        apart = SAME_PLACE * cells.path.length
        passed = np.zeros(n - 1, dtype=bool)
        for s, feed in zip(setting.corner_s, setting.corner_feed, strict=True):
            at = int(np.argmin(np.abs(cells.s - s)))
            if 0 < at < n and abs(cells.s[at] - s) <= apart:
                bound[at] = feed**2
                passed[at - 1] = True
        if period is None:
            return bound, jumped
        turn = np.abs(derivatives[0, 1:, 0] - derivatives[2, :-1, 0])
        turn[turn < NO_TURN] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            slow = np.minimum(
                np.min(axes.acceleration * period / turn, axis=1), np.min(axes.jerk * period**2 / turn, axis=1)
            )
        slow = np.where(passed | np.isnan(slow), np.inf, slow)
        bound[1:-1] = np.minimum(bound[1:-1], (TURN_SHARE * slow) ** 2)
        if not np.any(np.isfinite(axes.jerk)):
            return bound, jumped
        feed = curve_feeds(cells.path, setting.limits)[cells.curve]
        top = np.minimum(
            feed_squared_bound(
                derivatives[0, 1:, 0], derivatives[0, 1:, 1], feed[1:], setting.limits, axes, period, cells.path.linear
            ),
            bound[1:-1],
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            use = PEAK_WEIGHT * (derivatives[0, 1:, 1] - derivatives[2, :-1, 1]) / (axes.jerk * period)
        use[passed | ~np.all(np.isfinite(use), axis=1)] = 0.0
        most = np.max(np.abs(use), axis=1, initial=0.0)
        for node in np.flatnonzero(top * most > NO_JUMP):
            reach = REACH * period * math.sqrt(min(top[node], 1.0 / most[node]))
            begin = max(int(np.searchsorted(cells.s, cells.s[node + 1] - reach)) - 1, 0)
            end = int(np.searchsorted(cells.s, cells.s[node + 1] + reach, side="right"))
            jumped[begin:end, :, 0] += np.maximum(use[node], 0.0)
            jumped[begin:end, :, 1] += np.maximum(-use[node], 0.0)
        return bound, jumped

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
        """Rows with the first and the last coefficient at ends at rest put in terms of their neighbours."""
        out = rows.copy()
        if self.ties[0] is not None:
            out[0, 1] += self.ties[0] * out[0, 0]
            out[0, 0] = 0.0
        if self.ties[1] is not None:
            out[-1, 1] += self.ties[1] * out[-1, 2]
            out[-1, 2] = 0.0
        return out

    def _end_bound(self, which: int) -> float:
        """Largest q at the inner end of a ramp, where s = j t^3 / 6 gives q = (9/2 j s^2)^(2/3), or at a moving end."""
        end = self.ends[which]
        if end.rest:
            return float((4.5 * END_MARGIN * end.jerk * end.length**2) ** (2.0 / 3.0)) if end.jerk < np.inf else np.inf
        return np.inf if end.feed is None else end.feed**2

    def _start_bound(self, which: int, direction: Array) -> float:
        """Largest q at the inner end of a start at constant acceleration, q = 2 a s, with a hair to stay a bound."""
        end = self.ends[which]
        if not end.rest:
            return float(end.feed or 0.0) ** 2
        limits, axes = self.setting.limits, self.setting.axes
        along = limits.acceleration if which == 0 else deceleration(limits)
        with np.errstate(divide="ignore"):
            most = min(float(np.min(axes.acceleration / np.abs(direction))), along)
        return 2.0 * 1.01 * most * end.length if np.isfinite(most) else limits.feed**2

    def complete(self, c: Array) -> Array:
        """c with its tied ends put right."""
        out = c.copy()
        if self.ties[0] is not None:
            out[0] = self.ties[0] * out[1]
        if self.ties[1] is not None:
            out[-1] = self.ties[1] * out[-2]
        return out

    def raised(self, c: Array) -> Array:
        """c with whatever falls below a small share of its surroundings, or of 0, raised to that."""
        around = np.maximum(c, 0.0)
        for _ in range(3):
            wide = np.concatenate([around[:1], around, around[-1:]])
            around = np.maximum(np.maximum(wide[:-2], wide[2:]), around)
        return np.maximum(c, np.maximum(LEAST * around, 1e-12 * self.least_bound))

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
                self._jump,
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
            self._jump,
            self._rows,
            self._weights,
            self._end_rows,
            1 if self.ties[0] is not None else 0,
            self.cells.count + (0 if self.ties[1] is not None else 1),
            tolerance,
            MAX_STEPS,
            dual,
            False,
            report,
        )
        return self.complete(start), float(report[0]) - self._shortfall, float(report[0] * report[1])

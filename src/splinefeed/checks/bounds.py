"""The limits of a check, the worst value of each, and the corners that may be passed in motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from splinefeed.checks.axes import AxesByPlace
from splinefeed.checks.spans import PathSpans, SpanPlaces, spans_of
from splinefeed.limit_table import PLACES, TICKS
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import AXIS_LIMITS, KEPT, Array, BoolArray, IntArray, LimitResult, Limits, named
from splinefeed.records.arrays import chunks

#: How far a setpoint may be from the curve, and an end from the path's, mm (rotary axes rad), by default.
TOLERANCE = 1e-9
#: The limit of how much the velocity of an axis may jump at a corner.
STEP = "axis_velocity_step"
#: What stands for a limit that changes from place to place until one is seen.
LAW = 1e300
#: A tick is at a corner within this, relative to the arc length there.
AT_TICK = 1e-12
#: Places are as bad as each other within this share: rounding.
AS_BAD = 1e-14
#: Steps on either side of one with a corner that show how constant the feed is around it.
BESIDE = 2
#: A tangent that turns by more than this at one place, rad, jumps; by more than the next, the tool has to stop there.
CORNER_ANGLE, STOP_ANGLE = 1e-6, 1e-4
#: A corner that turns further than this, rad, turns back: it is never passed at speed.
TURNING_BACK = np.pi - 1e-6
#: A curvature jumps by more than this share of itself, and of one over the length of the path.
CURVATURE_JUMP = 1e-6
#: A speed |C'| below this share of that around it, or beside it, is 0.
NO_SPEED = 1e-9
#: Knots that are looked at together: what bounds the memory.
BLOCK = 65536


@dataclass
class Worst:
    """The worst of one limit so far.

    Parameters
    ----------
    result : LimitResult
        The worst.
    order : int
        Of its difference, 0 if it bounds none.
    column : int
        Of the steps: 0 the tip, 1 + k axis k, then combinations of axes in their order.
    """

    result: LimitResult
    order: int
    column: int

    @property
    def share(self) -> float:
        """How much of the limit the worst is at least, but for its rounding."""
        return (self.result.worst - self.result.floor) / self.result.limit

    def see(
        self,
        values: Array,
        t: Array,
        s: Array,
        floor: Array,
        limits: Array | None = None,
        by: str = "setpoints",
        place: Callable[[float], float] = float,
    ) -> Array:
        """Record values and their rounding.

        Parameters
        ----------
        values : (n,) array
            In the unit of the limit; NaN is nothing. The worst is the value that is, but for its rounding, nearest to
            its limit or furthest over it.
        t, s : (n,) array
            Times, s, and lengths, mm.
        floor : (n,) array
            The rounding of each.
        limits : (n,) array, optional
            If the limit changes from place to place: that of the result becomes that of the worst.
        by : str, optional
            "setpoints" or "law".
        place : callable, optional
            Makes of a length what the result names: the arc length of the tip.

        Returns
        -------
        (n,) array
            How much of the limit is used, but for rounding; -inf for nothing.
        """
        if not len(values):
            return values
        own = np.full(len(values), self.result.limit) if limits is None else limits
        beyond = values - floor
        beyond = np.where(np.isnan(beyond), -np.inf, beyond)
        with np.errstate(invalid="ignore"):
            share = np.where(own < np.inf, beyond / own, -np.inf)
        self.result = replace(self.result, over=self.result.over + int(np.count_nonzero(beyond > own * (1.0 + KEPT))))
        if np.max(share) > self.share * (1.0 + AS_BAD):
            k = int(np.argmax(share >= np.max(share) * (1.0 - AS_BAD)))  # the first of places that are as bad
            limit, worst, rounding, at_t, at_s = (float(each[k]) for each in (own, values, floor, t, s))
            at_s = place(at_s)
            self.result = replace(self.result, limit=limit, worst=worst, floor=rounding, at_t=at_t, at_s=at_s, by=by)
        return share


@dataclass
class Fault:
    """One kind of fault: how many ticks, the worst amount, and where."""

    count: int
    amount: float
    tick: int
    t: float
    s: float
    detail: str = ""


@dataclass(frozen=True)
class Bounds:
    """The limits of setpoints; see `check`.

    Parameters
    ----------
    path : Path
        That of the setpoints, or of the tip of a `track`.
    limits : Limits
        What they must keep.
    tolerance, resolution : float
        mm or rad, as `check` takes them.
    track : Track, optional
        One whose axes do not carry the tip.
    """

    path: Path
    limits: Limits
    tolerance: float
    resolution: float
    track: Track | None = None

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes that have setpoints."""
        return self.path.axes if self.track is None else self.track.axes

    @cached_property
    def rows(self) -> PathSpans:
        """The path, by its control points, weights and knots."""
        return spans_of(self.path)

    @cached_property
    def series(self) -> AxesByPlace | None:
        """Axes of the track by length, from its positions alone."""
        return None if self.track is None else AxesByPlace(self.track)

    @cached_property
    def feeds(self) -> Array:
        """Largest feed on each curve of the path, (curves,), mm/s: of the limits or, if lower, of the path itself."""
        given = np.full(len(self.path.curves), self.limits.feed)
        return given if self.path.feeds is None else np.fmin(given, self.path.feeds)

    @cached_property
    def row_feeds(self) -> Array:
        """The same for each span of the path, (rows,)."""
        return np.asarray(self.feeds[self.rows.curve])

    @cached_property
    def row_times(self) -> Array:
        """The least time, s, that the feeds of the path allow up to the start of each span of the tip, (rows,)."""
        tip = self.rows.tip
        each = tip.lengths / self.feeds[tip.curve]
        return np.concatenate([[0.0], np.cumsum(each[:-1])])

    def jerks(self, growing: BoolArray, falling: BoolArray) -> Array:
        """Limit of the jerk, mm/s^3, where the feed grows and where it falls; where neither is sure, the larger one."""
        up, down = self.limits.jerk, self.limits.deceleration_jerk or np.inf
        return np.where(growing, up, np.where(falling, down, max(up, down)))

    @cached_property
    def weights(self) -> Array:
        """Weights of the axes in each combination that is limited, (combinations, axes)."""
        return self.limits.axis_bounds(self.axes).weights

    @cached_property
    def corners(self) -> PassedCorners:
        """Corners of the tangent that may be passed in motion: none without a limit on the velocity step of an axis.

        Where C' = 0 on one side no velocity jumps: the tool must rest there, and differences see whether it does.
        """
        if self.limits.axis_velocity_step is None:
            return PassedCorners(np.zeros(0), *np.zeros((3, 0)))
        s, angle, row = self.bends
        passed = (angle > STOP_ANGLE) & (angle <= TURNING_BACK)
        s, (speed, tangents, curves, _) = s[passed], self._sides(*row[:, passed])
        passes = np.min(speed, axis=0) > NO_SPEED * np.max(speed, axis=0)
        tangents, curves = tangents[..., passes].transpose(2, 0, 1), curves[..., passes].transpose(2, 0, 1)
        return PassedCorners(s[passes], np.abs(tangents[:, 1] - tangents[:, 0]), np.abs(tangents), np.abs(curves))

    @cached_property
    def bends(self) -> tuple[Array, Array, IntArray]:
        """Places inside the path where tangent or curvature jump: s, mm, angle, rad, (k,), and spans beside, (2, k).

        All axes count, by the metric of the path; where C' = 0 on a side, the tangent is the limit there.
        """
        rows, found = self.rows, [(np.zeros(0), np.zeros((2, 0), dtype=np.int64))]
        unit = self.path.units[:, None]
        moves, knots = np.flatnonzero(rows.lengths > 0.0), np.cumsum(rows.knot)
        beside = np.stack([moves[:-1], moves[1:]])
        beside = beside[:, knots[beside[1]] > knots[beside[0]]]
        for part in chunks(beside.shape[1], BLOCK):
            row = beside[:, part]
            _, tangents, curves, still = self._sides(*row)
            sizes = np.linalg.norm(tangents * unit, axis=1, keepdims=True)  # 0 where three derivatives are
            one, other = tangents * unit / np.where(sizes > 0.0, sizes, 1.0)
            # 2 atan2 of difference and sum keeps small and straight-back angles alike to rounding
            angle = 2.0 * np.arctan2(np.linalg.norm(other - one, axis=0), np.linalg.norm(other + one, axis=0))
            curves = curves * unit
            size, jump = np.linalg.norm(curves, axis=1), np.linalg.norm(curves[1] - curves[0], axis=0)
            corner = (angle > CORNER_ANGLE) | (jump > CURVATURE_JUMP * (1.0 / rows.length + size[0] + size[1]))
            corner |= np.any(still, axis=0)
            found.append((angle[corner], row[:, corner]))
        angle, row = (np.concatenate(each, axis=-1) for each in zip(*found, strict=True))
        return rows.end[row[0]], angle, row

    def _sides(self, before: IntArray, behind: IntArray) -> tuple[Array, ...]:
        """|C'|, dr/ds, d2r/ds2 at the ends of spans `before` (n,) and the starts of those behind: (2, ..., n) each.

        And whether C' = 0, (2, n): there dr/ds is the next derivative that is not 0, of any length, along the motion.
        """
        sides = []
        for side, end in ((before, 1.0), (behind, -1.0)):
            places = SpanPlaces(self.rows, side)
            c, (_, r1, r2, _) = places.along(np.full(len(side), end))
            speed, second = (np.sqrt(places.product(each, each)) for each in c[1:3])
            least = NO_SPEED * self.rows.lengths[side] * places.scale
            still, limit = speed <= least, np.where(second > least * places.scale, -end * c[2], c[3])
            sides.append((speed, np.where(still, limit, r1), np.where(still, 0.0, r2), still))
        return tuple(np.stack(each) for each in zip(*sides, strict=True))

    @cached_property
    def alone(self) -> Array:
        """Arc lengths of the tip, mm, at which the curves begin on which rotary axes move alone, (k,)."""
        return np.asarray(self.rows.tip.curve_starts[np.unique(self.rows.curve[self.rows.still])])

    def place(self, s: float) -> float:
        """Arc length of the tip, mm, at a length s, mm."""
        return float(self.rows.of_tip(np.array([s]))[0])

    @cached_property
    def rests(self) -> Array:
        """Arc lengths at which the tool may be at rest, (m,), mm, increasing: ends, stops, and where it waits."""
        s, angle, _ = self.bends
        markers = [each.before for each in self.path.markers if each.stop]
        stops = [self.rows.curve_starts[[0, -1, *markers]], s[angle > STOP_ANGLE]]
        return np.unique(np.concatenate([*stops, () if self.track is None else self.track.stops]))

    def worsts(self) -> dict[str, Worst]:
        """One empty Worst a limit that is given, in the order of the report.

        That of the feed is always there: a path in parts may begin with rapid moves and have a feed later.
        """
        limits, axes, out = self.limits, self.axes, {}
        of = (None, *axes, *((None,) * len(self.weights)))  # whose each column is

        def add(name: str, limit: float | None, order: int = 0, column: int = 0) -> None:
            most = np.inf if limit is None else limit
            if name == "feed" or most < np.inf:
                nothing = LimitResult(limit=most, worst=0.0, at_s=0.0, at_t=0.0, axis=of[column])
                out[name] = Worst(nothing, order, column)

        known = self.feeds[np.isfinite(self.feeds)]  # rapid moves may have none
        add("feed", float(np.max(known, initial=0.0)) or np.inf, 1)
        add("acceleration", limits.acceleration, 2)
        add("deceleration", limits.deceleration, 2)
        add("jerk", min(limits.jerk, limits.deceleration_jerk or np.inf), 3)
        for name, most in (limits.given(TICKS) | limits.given(PLACES)).items():
            add(name, most)
        bounded = limits.axis_bounds(axes)
        for order, (names, bounds) in enumerate(zip(bounded.names, bounded.bounds.tolist(), strict=True), start=1):
            for k, (name, most) in enumerate(zip(names, bounds, strict=True), start=1):
                add(name, most, order, k)
        for model in limits.models:
            for name, axis, k in zip(model.names(), model.axes, model.columns(axes), strict=True):
                add(name, model.numbers().get(axis, LAW), 0, k + 1)
        for k, most in enumerate(limits.of_axes(STEP, axes).tolist(), start=1):
            add(named(STEP, axes[k - 1]), most, 0, k)
        for axis, (low, high) in limits.travel_of(axes).items():
            add(named("travel", axis), 0.5 * (high - low), 0, axes.index(axis) + 1)
        return out

    def corner_feeds(self, k: IntArray, means: Array, i: IntArray, ahead: Array, floor: Array, period: float) -> Array:
        """A bound of the feed at corners k (n,), mm/s, `ahead` mm (n,) into steps i (n,), by the mean feeds of all."""
        index = i[:, None] + np.arange(-BESIDE, BESIDE + 1)
        known = (index >= 0) & (index < len(means))
        around = np.where(known, means[np.clip(index, 0, len(means) - 1)], np.nan)
        top = np.fmax.reduce(around, axis=1)
        accelerations, jerks = self._slopes(k, top)
        way = means[i] * period
        at_tick = np.minimum(ahead, way - ahead) <= AT_TICK * (self.corners.s[k] + way)
        quickest = 0.25 * period * np.minimum(np.min(accelerations, axis=1), 0.125 * period * np.min(jerks, axis=1))
        rest = at_tick & (top <= quickest) & (quickest < np.inf)  # such steps are within the limits from rest to rest
        # a dip also bends the feed around it
        bent = accelerations + (np.fmax.reduce(np.abs(np.diff(around, axis=1)), axis=1) / period)[:, None]
        dip = hidden_dip(around, floor, period, bent, jerks)
        middle = around[:, BESIDE - 1 : BESIDE + 2]
        return np.where(rest, 0.0, np.maximum(corner_feed(middle, ahead, period) - dip, 0.0))

    def _slopes(self, k: IntArray, feed: Array) -> tuple[Array, Array]:
        """Most acceleration, (n, 2), mm/s^2, and jerk, (n, 2), mm/s^3, of the path before and behind corners k (n,).

        Before it the feed falls, behind it grows, as in a dip; each axis holds |r_ss v^2 + r_s a| <= A at the feed v.
        """
        limits, tangents = self.limits, self.corners.tangents[k]
        along = np.array([limits.deceleration or np.inf, limits.acceleration])
        acceleration, jerk = (limits.of_axes(name, self.axes) for name in AXIS_LIMITS[1:])
        with np.errstate(divide="ignore", invalid="ignore"):
            by_axes = (acceleration + self.corners.bends[k] * (feed * feed)[:, None, None]) / tangents
            steepest = np.minimum(along, np.fmin.reduce(by_axes, axis=2))
            twist = np.array([limits.deceleration_jerk or np.inf, limits.jerk])
            # beside a limit of acceleration that of an axis' jerk says little more, and in a bend not this
            free = np.where(np.isfinite(steepest), np.inf, np.fmin.reduce(jerk / tangents, axis=2))
        return steepest, np.minimum(twist, free)


@dataclass(frozen=True, eq=False)
class PassedCorners:
    """Corners that may be passed in motion, k of them.

    Parameters
    ----------
    s : (k,) array
        Arc lengths, mm.
    jumps : (k, axes) array
        By how much dr/ds of each axis jumps there.
    tangents : (k, 2, axes) array
        |dr/ds| before and behind.
    bends : (k, 2, axes) array
        |d2r/ds2| before and behind, 1/mm.
    """

    s: Array
    jumps: Array
    tangents: Array
    bends: Array


def contain(corners: Array, begin: Array, end: Array) -> BoolArray:
    """Tell whether a corner lies strictly between arc lengths.

    Parameters
    ----------
    corners : (k,) array
        Arc lengths of corners, mm, increasing.
    begin, end : (n,) array
        mm.

    Returns
    -------
    (n,) array of bool
        Whether one does.
    """
    with np.errstate(invalid="ignore"):
        inside: BoolArray = np.searchsorted(corners, end, "left") > np.searchsorted(corners, begin, "right")
    return inside


def corner_feed(means: Array, ahead: Array | float, period: float) -> Array:
    """Bound the feed at a corner by the mean feeds of the step that it is in and of those beside.

    Parameters
    ----------
    means : (..., 3) array
        mm/s.
    ahead : array or float
        How far into the middle step the corner is, mm, (...).
    period : float
        Servo period, s.

    Returns
    -------
    (...) array
        mm/s.

    Notes
    -----
    With steady acceleration a over the three steps the feed at `ahead` mm into the middle one is v,

        v^2 = v_0^2 + 2 a ahead,   v_0 = middle mean - a T / 2

    Where a changes once, or one way only, half the second difference of the means is more than v can be too large.
    """
    before, here, after = means[..., 0], means[..., 1], means[..., 2]
    gained = 0.5 * (after - before)
    square = (here - 0.5 * gained) ** 2 + 2.0 * gained * ahead / period
    found = np.sqrt(np.maximum(square, 0.0)) - 0.5 * np.abs(before - 2.0 * here + after)
    return np.asarray(np.maximum(found, 0.0))


def hidden_dip(means: Array, floor: Array | float, period: float, accelerations: Array, jerks: Array) -> Array:
    """Bound how far the feed may dip at a corner below what the mean feeds of the steps around it let expect.

    Parameters
    ----------
    means : (..., m) array
        mm/s.
    floor : array or float
        Their rounding, mm/s, (...).
    period : float
        Servo period, s.
    accelerations, jerks : (..., 2) array
        The most before and behind, mm/s^2 and mm/s^3.

    Returns
    -------
    (...) array
        mm/s.

    Notes
    -----
    A dip loses distance, which shows: whatever second difference the means have above that of their floor may be one,
    w = 2 T max |second difference| at most. With no more than acceleration a before and behind, or jerk j, it is as
    deep as d:

        w = d^2 (1 / a_1 + 1 / a_2) / 2,   w = sqrt(2) / 3 d^(3/2) (1 / sqrt(j_1) + 1 / sqrt(j_2))

    Where nothing limits either, the feed is taken to be as even as the means are.
    """
    rough = np.fmax.reduce(np.abs(np.diff(means, n=2, axis=-1)), axis=-1, initial=0.0) - 4.0 * floor
    way = 2.0 * np.maximum(rough, 0.0) * period
    with np.errstate(divide="ignore", invalid="ignore"):
        by_acceleration = np.sqrt(2.0 * way / np.sum(1.0 / accelerations, axis=-1))
        by_jerk = (3.0 * way / np.sqrt(2.0) / np.sum(1.0 / np.sqrt(jerks), axis=-1)) ** (2.0 / 3.0)
    deepest = np.fmin(by_acceleration, by_jerk)
    return np.asarray(np.where((way > 0.0) & np.isfinite(deepest), deepest, 0.0))


def resting(rests: Array, s: Array, slack: Array | float) -> IntArray:
    """Which of the sorted `rests` (m,), mm, at least two, s, mm, (n,), is within slack, mm; -1 for none."""
    after = np.clip(np.searchsorted(rests, s), 1, len(rests) - 1)
    with np.errstate(invalid="ignore"):
        nearest = np.where(s - rests[after - 1] <= rests[after] - s, after - 1, after)
        return np.where(np.abs(rests[nearest] - s) <= slack, nearest, -1)


def neighbours(rests: Array, begin: Array, end: Array, slack: Array | float) -> BoolArray:
    """Whether begin and end, mm, (n,), are one of the sorted `rests` (m,), mm, and the next one, within slack, mm."""
    first, last = (resting(rests, each, slack) for each in (begin, end))
    return np.asarray((first >= 0) & (last == first + 1))

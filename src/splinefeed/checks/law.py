"""The part of the check for a time law: exact derivatives of r(s(t)), and what they cannot decide.

A stretch of time is one in which the law is one polynomial, its acceleration has one sign, and the path is one
polynomial piece. It is examined by itself, ends included, so that values at breaks and knots are one-sided.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.checks.axes import AxesByPlace
from splinefeed.checks.bounds import STEP, Bounds, Worst
from splinefeed.checks.path_limits import TipPlaces, value_of
from splinefeed.checks.spans import EPSILON, SpanPlaces, about, reached
from splinefeed.limit_table import MODELS, TICKS
from splinefeed.paths.path import Path
from splinefeed.records import (
    KEPT,
    TABLE,
    Array,
    BoolArray,
    IntArray,
    LimitResult,
    Limits,
    Setpoints,
    State,
    TimeLaw,
    unit_along,
)
from splinefeed.records.arrays import expanded
from splinefeed.telling import tell

#: Chebyshev-Lobatto places 0 ... INSTANTS - 1 of a stretch, which are even in an angle.
INSTANTS = 17
#: Stretches that are processed together.
MOST = 256
#: An acceleration below this share of the law's largest has no sign: where a law comes to rest, a rounding of its feed
#: is a square root of it in time.
NO_SIGN = 1e-9
#: How many roundings of s may move a value.
SHIFT = 2.0
#: What is sampled below this share of the largest so far, and of its limit, is not examined more closely.
WORTH_A_LOOK = 0.9
#: Limits that only the law decides, not the path.
ALONG = ("feed", "acceleration", "deceleration", "jerk")
#: Limits that only setpoints can keep or exceed, and the one that is compared at corners.
BY_SETPOINTS = (
    *("travel.", STEP),
    *(each.name for each in TABLE if each.bounds == TICKS),
    *(f"{each.name}." for each in TABLE if each.bounds == MODELS),
)
#: Roundings of arc length that two pieces of a law, or a law and its path, may be apart.
ROUNDINGS = 64.0
#: A jump of the feed or the acceleration below this share of the largest one is rounding.
NO_JUMP = 1e-9
#: A law that has more than this share of its largest feed at a corner does not rest there.
MOVING = 1e-3
#: A derivative that is known to less than this share of its limit does not tell whether that holds.
WIDE = 0.1
#: Corners that a note names one by one.
LISTED = 3


def check_law(
    law: TimeLaw, bounds: Bounds, worsts: dict[str, Worst], period: float, begins: State | None
) -> tuple[list[str], list[str]]:
    """Compare a law's exact derivatives with the limits, at many instants of each of its pieces.

    Parameters
    ----------
    law : TimeLaw
        The law.
    bounds : Bounds
        The limits.
    worsts : dict of str to Worst
        Where the worst values are recorded.
    period : float
        Servo period, s.
    begins : State or None
        How it should begin on the way; None for the start of the path, at `start_feed`.

    Returns
    -------
    problems, notes : list of str
        One sentence each; notes name what the setpoints decide.
    """
    track, motion = bounds.track, LawMotion(law, bounds)
    motion.hold({name: worst for name, worst in worsts.items() if not name.startswith(BY_SETPOINTS)})
    corners = bounds.corners.s
    times, jumps = motion.corner_steps(slice(None))
    for name, worst in worsts.items():
        if name.startswith(STEP):
            each = jumps[:, worst.column - 1]
            worst.see(each, times, corners, np.zeros(len(corners)), by="law", place=bounds.place)
    problems, notes = _jumps(law, bounds, motion, period)
    if track is not None and motion.axes is not None:
        apart, wrong = motion.axes.apart(track)
        problems = [*wrong, *problems]
        notes.append(
            f"the law is judged by the positions of {', '.join(track.axes)} alone; what {track.name} says of their "
            f"derivatives is within {apart:.2g} of what positions say, rounding aside"
        )
        if len(where := motion.undecided(motion.axes)):
            first = f"s = {bounds.place(where[0]):.6g} {unit_along(bounds.path.axes)}"
            notes.append(
                f"at {len(where)} place(s), the first at {first}, derivatives of the axes are known from positions to "
                f"{WIDE:.0%} of a limit or less well: there the differences of the setpoints decide"
            )
    if motion.irregular:
        notes.append(
            f"at {motion.irregular} instants of the law C' is 0 to rounding and exact axis derivatives are "
            "0/0; there the differences of the setpoints decide"
        )
    return [*_ends(law, bounds, motion, begins), *problems], [*notes, *_corner_notes(law, bounds, motion.top)]


def limits_along(law: TimeLaw, path: Path, limits: Limits) -> dict[str, LimitResult]:
    """Judge the limits along the path in a law alone: feed, acceleration, deceleration and jerk.

    Parameters
    ----------
    law : TimeLaw
        The law.
    path : Path
        Its path.
    limits : Limits
        What it must keep.

    Returns
    -------
    dict of str to LimitResult
        By name.
    """
    bounds = Bounds(path, limits, 0.0, 0.0)
    worsts = {name: worst for name, worst in bounds.worsts().items() if name in ALONG}
    LawMotion(law, bounds).hold(worsts)
    return {name: replace(worst.result, by="law") for name, worst in worsts.items() if worst.result.limit < math.inf}


def _ends(law: TimeLaw, bounds: Bounds, motion: LawMotion, start: State | None) -> Iterator[str]:
    length, limits, top = bounds.rows.length, bounds.limits, motion.top
    begins = start or State(feed=limits.start_feed)
    unit, allowed = unit_along(bounds.path.axes), bounds.tolerance + ROUNDINGS * EPSILON * length
    low, high = motion_at(law, law.breaks[[0, -1]]).tolist()
    if abs(high - length) > allowed or abs(low - begins.s) > allowed:
        ends = f"{begins.s:.6g} to {length:.12g} {unit}"
        yield f"law: runs from s = {low:.6g} to {high:.12g} {unit}; the path from {ends}"
    value, t, s = motion.backwards
    if value > NO_JUMP * top:
        yield f"law: runs backwards at {value:.6g} {unit}/s at t = {t:.6g} s, s = {s:.6g} {unit}"
    feeds = motion_at(law, law.breaks[[0, -1]], 1)
    places = SpanPlaces(bounds.rows, np.array([0, len(bounds.rows) - 1]))
    with np.errstate(all="ignore"):  # of feeds at the ends of the path, which are those of the tip
        of_tip = feeds * places.tip(places.along(np.array([-1.0, 1.0]))[1])[0]
    feeds = np.where((feeds > 0.0) & [start is None, True], of_tip, feeds)
    given = [("start_feed" if start is None else "that of the start", begins.feed), ("end_feed", limits.end_feed)]
    for (name, wanted), time, feed in zip(given, law.breaks[[0, -1]].tolist(), feeds.tolist(), strict=True):
        if abs(feed - wanted) > NO_JUMP * max(top, wanted):
            yield f"law: its feed at t = {time:.6g} s is {feed:.9g} {unit}/s; {name} is {wanted:.9g} {unit}/s"
    found = float(motion_at(law, law.breaks[:1], 2)[0])
    if start is not None and abs(found - start.acceleration) > NO_JUMP * max(motion.steepest, abs(start.acceleration)):
        yield (
            f"law: its acceleration at t = {law.breaks[0]:.6g} s is {found:.9g} {unit}/s^2; that of the start is "
            f"{start.acceleration:.9g} {unit}/s^2"
        )


def _jumps(law: TimeLaw, bounds: Bounds, motion: LawMotion, period: float) -> tuple[list[str], list[str]]:
    limits, along = bounds.limits, unit_along(bounds.path.axes)
    problems, notes = [], []
    jerk = min(limits.jerk, limits.deceleration_jerk or np.inf)  # may build up this much within a rounding of t
    mixed = bounds.rows.mixed  # the law's acceleration is not that of the tip
    jerk = jerk if jerk < np.inf and not mixed else 0.0
    kinds = (
        ("s", along, ROUNDINGS * EPSILON * bounds.rows.length + NO_JUMP * motion.top * period),
        ("its feed", f"{along}/s", NO_JUMP * motion.top),
        (
            "its acceleration",
            f"{along}/s^2",
            NO_JUMP * motion.steepest + jerk * ROUNDINGS * float(np.spacing(law.duration)),
        ),
    )
    for k, ((what, unit, rounding), (value, t, s)) in enumerate(zip(kinds, breaks_apart(law), strict=True)):
        text = f"law: {what} jumps by {value:.6g} {unit} at t = {t:.9g} s, s = {s:.9g} {along}"
        if value > rounding and k < 2:
            problems.append(text)
        elif value > rounding and jerk > 0.0:
            problems.append(f"{text}: its jerk is infinite there")
        elif value > rounding and (limits.axis_jerk is not None or mixed):
            notes.append(f"{text}: the exact axis jerk is infinite there, and the third difference decides")
    return problems, notes


def _corner_notes(law: TimeLaw, bounds: Bounds, top: float) -> Iterator[str]:
    """Where tangent or curvature jumps and the law does not stop, derivatives of the axes are infinite: note it."""
    corners = bounds.bends[0]
    places = corners[motion_at(law, times_at(law, corners), 1) > MOVING * top]
    if len(places):
        listed = ", ".join(f"{each:.6g}" for each in bounds.rows.of_tip(places[:LISTED])) + (
            ", ..." if len(places) > LISTED else ""
        )
        yield (
            f"at {len(places)} place(s), s = {listed} {unit_along(bounds.path.axes)}, direction or curvature jumps in "
            "motion, and exact derivatives of the axes are infinite: there the differences of the setpoints decide, "
            "which are what the drive sees and grow as the period falls, or the velocity step of each axis where that "
            "is limited"
        )


def _least_feeds(law: TimeLaw, s: Array, rounding: float) -> Array:
    """Least feed of a law within the rounding of arc lengths s (n,), mm/s: where it rests, it is 0 at a break there."""
    first, last = times_at(law, s - rounding), times_at(law, s + rounding)
    least: Array = np.minimum(motion_at(law, first, 1), motion_at(law, last, 1))
    begin, end = np.searchsorted(law.breaks, first, "left"), np.searchsorted(law.breaks, last, "right")
    for k in np.flatnonzero(end > begin):
        least[k] = min(least[k], float(np.min(motion_at(law, law.breaks[begin[k] : end[k]], 1))))
    return np.maximum(least, 0.0)


@dataclass(frozen=True, eq=False)
class OnPath:
    """What the path has at n places, in the order of a raveled array.

    Parameters
    ----------
    row : (n,) int array
        Spans of the path that they lie on.
    at : TipPlaces
        The places, as evaluators see them.
    tip : tuple of (n,) arrays
        First to third derivative of the tip's arc length by the length.
    axes : list of (axes, n) arrays
        First to third derivative of the axes that have limits by the length.
    regular : (n,) bool array
        Where C' is not 0.
    """

    row: IntArray
    at: TipPlaces
    tip: tuple[Array, Array, Array]
    axes: list[Array]
    regular: BoolArray


@dataclass(frozen=True, eq=False)
class LawTicks:
    """What a law makes of its path at n ticks, by exact derivatives.

    Parameters
    ----------
    share : dict of (n,) arrays
        How much is used of each limit that derivatives decide, by name; not finite next to C' = 0.
    motion : (3, n, axes) array
        Velocity, acceleration and jerk of the axes, mm/s^k, rotary ones rad/s^k.
    """

    share: dict[str, Array]
    motion: Array


class LawMotion:
    """Compares a law's motion on a path with limits."""

    def __init__(self, law: TimeLaw, bounds: Bounds) -> None:
        self.law, self.bounds, self.rows = law, bounds, bounds.rows
        #: Rounding of the law's arc length, mm.
        self.rounding = 4.0 * EPSILON * bounds.rows.length
        #: Where derivatives may jump, mm, and the span of the path that begins there or before.
        self.start, self.row = self.rows.start, np.arange(len(self.rows))
        self.axes = bounds.series
        if self.axes is not None:
            self.start = np.union1d(self.start, self.axes.ends[1:-1])
            self.row = self.rows.at(self.start)
            self.stretch = self.axes.stretch(0.5 * (self.start + np.append(self.start[1:], self.rows.length)))
        #: Order and column of each limit of axes and of sums of them, and what of the axes makes each column.
        self.columns = {n: (each.order - 1, each.column - 1) for n, each in bounds.worsts().items() if each.column}
        self.mix = np.vstack([np.eye(len(bounds.axes)), bounds.weights])
        #: Whether the length is not that of the tip: what is along the path is then along that of the tip.
        self.mixed = self.rows.mixed
        #: Largest feed, acceleration or deceleration, and feed backwards with its t and s.
        self.top, self.steepest = 0.0, float(np.max(np.abs(motion_at(law, law.breaks, 2))))
        self.backwards = (0.0, 0.0, 0.0)
        #: Instants with C' = 0 within the rounding of s, at which derivatives of the axes are 0/0.
        self.irregular = 0

    def hold(self, worsts: dict[str, Worst]) -> None:
        """Compare every limit with its values."""
        stretches = self._stretches()
        places = 0.5 * (1.0 - np.cos(np.pi * np.arange(INSTANTS) / (INSTANTS - 1)))[:, None]
        for start in range(0, len(stretches[0]), MOST):
            piece, row, low, width = (each[start : start + MOST] for each in stretches)
            found = self._look(piece, row, low + places * width, worsts, everything=True)
            for name, (value, limit) in found.items():
                each = np.where(np.isnan(value), -np.inf, value)
                best, owner = np.argmax(each, axis=0), np.arange(len(piece))
                top = each[best, owner]
                inner = np.clip(best, 1, INSTANTS - 2)
                with np.errstate(invalid="ignore", divide="ignore"):
                    before, after = each[inner - 1, owner], each[inner + 1, owner]
                    bend = before - 2.0 * top + after
                    near = (best == inner) & (bend < 0.0) & np.isfinite(bend)
                    near &= top > WORTH_A_LOOK * min(worsts[name].share, 1.0) * limit
                    # the top of the parabola through three samples, which are even in the angle
                    angle = np.pi * (best + 0.5 * (before - after) / bend) / (INSTANTS - 1)
                if near.any():
                    tau = low[near] + width[near] * 0.5 * (1.0 - np.cos(angle[near]))
                    self._look(piece[near], row[near], tau[None], {name: worsts[name]})
            tell("checking the law", start + len(piece), len(stretches[0]))

    def places_of(self, setpoints: Setpoints) -> OnPath:
        """The path at setpoints (n,), where their curve and u say."""
        row, u = self.rows.find(setpoints.curve, setpoints.u)
        places = SpanPlaces(self.rows, row)
        t = places.t(u)
        return self._on_path(places, row, t, self.rows.arc_length(row, t))

    def at_ticks(self, setpoints: Setpoints, on: OnPath) -> LawTicks:
        """How much the law uses of each limit at setpoints, which are `on` its path, by the forms that `hold` compares.

        A step of velocity at a corner counts at the tick next to it.
        """
        piece, tau = pieces_at(self.law, setpoints.t)
        s, v, a, j = motion_of(self.law.coefficients[piece], tau)
        worsts = self.bounds.worsts()
        limits = {name: np.full(len(s), worst.result.limit) for name, worst in worsts.items()}
        names = [name for name in worsts if not name.startswith(BY_SETPOINTS)]
        values = self._values(on, v, a, j, names)
        slows = values["acceleration"] < 0.0
        limits |= {"feed": self.bounds.row_feeds[on.row], "jerk": self.bounds.jerks(~slows, slows)}
        times, jumps = self.corner_steps(slice(*np.searchsorted(self.bounds.corners.s, s[[0, -1]], side="right")))
        tick = np.clip(np.rint((times - setpoints.t[0]) / setpoints.period).astype(np.int64), 0, len(s) - 1)
        for name, worst in worsts.items():
            if name.startswith(STEP):
                values[name] = np.zeros(len(s))
                np.maximum.at(values[name], tick, jumps[:, worst.column - 1])
                names.append(name)
        with np.errstate(invalid="ignore", over="ignore"):
            motion = np.stack([each.T for each in by_time(on.axes, v, a, j)])
            for model in self.bounds.limits.models:
                columns = model.columns(self.bounds.axes)
                found, most = model.along(setpoints.position[:, columns], *motion[:, :, columns])
                values |= zip(model.names(), np.abs(found).T, strict=True)
                limits |= zip(model.names(), most.T, strict=True)
                names += model.names()
            share = {name: np.maximum(values[name], 0.0) / limits[name] for name in names}
        return LawTicks(share, motion)

    def corner_steps(self, corners: slice) -> tuple[Array, Array]:
        """When the law passes some corners, s, (k,), and by how much the velocity of each axis steps, (k, axes)."""
        s, jumps = self.bounds.corners.s[corners], self.bounds.corners.jumps[corners]
        return times_at(self.law, s), _least_feeds(self.law, s, self.rounding)[:, None] * jumps

    def _look(
        self, piece: IntArray, row: IntArray, tau: Array, worsts: dict[str, Worst], everything: bool = False
    ) -> dict[str, tuple[Array, Array]]:
        """Compare limits with their values at tau (k, z), s, of stretches (z,); returns both, (k, z) and (z,)."""
        s, v, a, j = motion_of(self.law.coefficients[piece], tau)
        t = self.law.breaks[piece] + tau
        if everything:
            self.top = max(self.top, float(np.max(v)))
            self.steepest = max(self.steepest, float(np.max(np.abs(a))))
            k = np.unravel_index(int(np.argmin(v)), v.shape)
            self.backwards = max(self.backwards, (float(-v[k]), float(t[k]), float(s[k])))
        of_path = [name for name in worsts if self.mixed or name not in ALONG]
        on = self._within(row, s) if of_path else None
        values = self._values(on, v, a, j, worsts)
        # at the ends of a stretch, where the sign of the law's own acceleration changes, that is rounding
        signs = values["acceleration"][slice(1, -1) if everything and not self.mixed else slice(None)]
        signs = np.sign(np.where(np.abs(signs) > NO_SIGN * self.steepest, signs, 0.0))
        way = np.max(signs, axis=0) + np.min(signs, axis=0)  # 0 where it may be either
        regular = np.all([np.isfinite(values[name]) for name in of_path], axis=0)
        self.irregular += int(np.count_nonzero(~regular)) if everything else 0
        limits = {"feed": self.bounds.row_feeds[self.row[row]], "jerk": self.bounds.jerks(way > 0, way < 0)}
        out = {}
        for name, worst in worsts.items():
            value, floor = values[name], np.zeros(s.shape)
            if name in of_path:
                value = np.where(regular, value, np.nan)
            limit = limits.get(name, np.full(len(row), worst.result.limit))
            out[name] = value, limit
            with np.errstate(invalid="ignore"):
                over = value > limit * (1.0 + KEPT)
            if name in of_path and over.any():
                motion = s[over], v[over], a[over], j[over]
                floor[over] = self._floor(row[np.nonzero(over)[-1]], *motion, name, value[over])
                self.irregular += int(np.count_nonzero(np.isnan(floor)))
            limit = np.broadcast_to(limit, s.shape)
            at, flat = (t.ravel(), s.ravel()), floor.ravel()
            worst.see(value.ravel(), *at, flat, limit.ravel(), by="law", place=self.bounds.place)
        return out

    def undecided(self, axes: AxesByPlace) -> Array:
        """Where cells of series lie, mm, of which a limit's derivative is known to no more than WIDE of the limit."""
        middle, floors, bounded = axes.middle, axes.floor[1:], self.bounds.limits.axis_bounds(self.bounds.axes)
        v = motion_at(self.law, times_at(self.law, middle), 1)
        known = floors @ np.abs(self.mix).T * v[:, None] ** np.arange(1.0, 4.0)[:, None, None]
        return np.asarray(middle[np.any(known > WIDE * bounded.bounds[:, None], axis=(0, 2))])

    def _floor(self, row: IntArray, s: Array, v: Array, a: Array, j: Array, name: str, value: Array) -> Array:
        """What roundings of s can make of a value (n,): how much less it is SHIFT of them before or behind; or NaN.

        And what rounding of positions makes of derivatives of axes that do not carry the tip.
        """
        least = value
        for side in (-SHIFT, SHIFT):
            other = self._values(self._within(row, s + side * self.rounding), v, a, j, [name])[name]
            least = np.where(np.isfinite(other), np.minimum(least, other), np.nan)
        if self.axes is None or name not in self.columns:
            return value - least
        (order, k), (_, floor) = self.columns[name], self.axes.at(s, self.stretch[row])
        own = [np.asarray(each @ np.abs(self.mix[k])) for each in floor[1:]]
        return value - least + by_time(own, np.abs(v), np.abs(a), np.abs(j))[order]

    def _within(self, row: IntArray, s: Array) -> OnPath:
        """The path at lengths s (..., n), mm, within intervals row (n,) or (..., n)."""
        rows, interval = self.rows, np.broadcast_to(row, s.shape).ravel()
        every, s = self.row[interval], s.ravel()
        places = SpanPlaces(rows, every)
        t = rows.parameter(every, np.clip(s - rows.start[every], 0.0, rows.lengths[every]))
        return self._on_path(places, every, t, s, None if self.axes is None else self.stretch[interval])

    def _on_path(
        self, places: SpanPlaces, row: IntArray, t: Array, s: Array, stretch: IntArray | None = None
    ) -> OnPath:
        """The path at t (n,) of places on spans (n,), which are at s (n,), mm, on stretches (n,) of a track."""
        derivatives, r = places.along(t)
        axes = r[1:]
        if self.axes is not None:
            found = self.axes.at(s, self.axes.stretch(s) if stretch is None else stretch)[0]
            axes = [np.asarray(each.T) for each in found[1:]]
        with np.errstate(invalid="ignore"):
            regular = places.product(derivatives[1], derivatives[1]) > 0.0
        return OnPath(row, TipPlaces(places, derivatives), places.tip(r), axes, regular)

    def _values(self, on: OnPath | None, v: Array, a: Array, j: Array, names: Iterable[str]) -> dict[str, Array]:
        """Sizes of what limits bound at v, a, j (..., n); those along the path always, with sign but for the jerk.

        Of what the path makes they are NaN next to C' = 0; `on` is not needed where it makes none of them.

        Where r is the path, dq/dt = r_s v,  d2q/dt2 = r_ss v^2 + r_s a,  d3q/dt3 = r_sss v^3 + 3 r_ss v a + r_s j
        """
        along, moved = (v, a, j), (v.ravel(), a.ravel(), j.ravel())

        def known(value: Array) -> Array:
            assert on is not None
            return np.where(on.regular, value, np.nan).reshape(v.shape)

        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            feed = moved[0]
            if on is not None and self.mixed:
                feed, *more = by_time(on.tip, *moved)
                along = known(feed), known(more[0]), known(more[1])
            out = {"feed": along[0], "acceleration": along[1], "deceleration": -along[1], "jerk": np.abs(along[2])}
            of_axes = None
            for name in names:
                if name in ALONG or on is None:
                    continue
                if name in self.columns:
                    of_axes = of_axes or by_time(on.axes, *moved)
                    order, k = self.columns[name]
                    out[name] = known(np.abs(self.mix[k] @ of_axes[order]))
                else:
                    out[name] = known(np.abs(value_of(name, on.at, feed)))
        return out

    def _stretches(self) -> tuple[Any, ...]:
        """Piece of the law, row, begin behind the piece's start, s, and duration of z stretches, (z,) each.

        What is no longer than the rounding of its instant is left out.
        """
        from scipy.interpolate import PPoly

        law, start, c = self.law, self.start, self.law.coefficients
        span, every = np.diff(law.breaks), np.arange(len(c))
        # a piece that begins or ends as near a row's end as two sums of their lengths may be apart begins or ends there
        apart = (ROUNDINGS + len(start) ** 0.5) * EPSILON * self.rows.length
        begin, end = c[:, 0] + apart, motion_of(c, span, 0)[0] - apart
        least = np.maximum(np.searchsorted(start, begin, side="right") - 1, 0)
        most = np.maximum(np.searchsorted(start, end, side="left") - 1, least)
        owner, number = expanded(most - least)
        ends = times_in(c[owner], start[1 + least[owner] + number], span[owner])
        whole = PPoly(
            c[:, ::-1].T, law.breaks
        )  # its acceleration changes sign or turns at the roots, NaN if it stays 0
        turns = np.concatenate([whole.derivative(k).roots(extrapolate=False) for k in (2, 3)])
        own, turning = pieces_at(law, turns[np.isfinite(turns)])
        piece = np.concatenate([every, every, own, owner])
        tau = np.concatenate([np.zeros(len(c)), span, turning, ends])
        order = np.lexsort((tau, piece))
        piece, tau = piece[order], tau[order]
        keep = (piece[1:] == piece[:-1]) & (np.diff(tau) > 2.0 * EPSILON * np.abs(law.breaks[piece[:-1] + 1]))
        piece, low, high = piece[:-1][keep], tau[:-1][keep], tau[1:][keep]
        middle = motion_of(c[piece], 0.5 * (low + high), 0)[0]
        row = np.clip(np.searchsorted(start, middle, side="right") - 1, least[piece], most[piece])
        return piece, row, low, high - low


def by_time(x: Sequence[Array], v: Array, a: Array, j: Array) -> tuple[Array, Array, Array]:
    """Compute derivatives by time of what has derivatives by a length: the chain rule.

    Parameters
    ----------
    x : sequence of array
        Derivatives by the length, order 1 to 3, (..., n).
    v, a, j : (n,) array
        How the length moves.

    Returns
    -------
    tuple of (..., n) array
        Order 1 to 3.
    """
    one, two, three = x
    return one * v, two * (v * v) + one * a, three * (v * v * v) + two * (3.0 * v * a) + one * j


def motion_of(c: Array, tau: Array, order: int = 3) -> list[Array]:
    """s, mm, and its derivatives, mm/s^k, to `order` at tau (..., n), s, of pieces s = sum_k c_k tau^k; c (n, 6)."""
    terms = np.ascontiguousarray(c.T).reshape(1, c.shape[1], *(1,) * (tau.ndim - 1), -1)
    return [math.factorial(k) * each[0] for k, each in enumerate(about(terms, tau, order))]


def motion_at(law: TimeLaw, t: Array, order: int = 0) -> Array:
    """s, mm, or its derivative of this order at instants t (n,), s; before and behind the law as at its ends."""
    piece, tau = pieces_at(law, t)
    return motion_of(law.coefficients[piece], tau, order)[order]


def pieces_at(law: TimeLaw, t: Array) -> tuple[IntArray, Array]:
    """The piece of a law at instants t (n,), s, the one behind at a break, and the time since it began, (n,), s."""
    t = np.clip(t, 0.0, law.breaks[-1])
    piece = np.clip(np.searchsorted(law.breaks, t, side="right") - 1, 0, len(law.coefficients) - 1)
    return piece, t - law.breaks[piece]


def times_at(law: TimeLaw, s: Array) -> Array:
    """Find when a law first reaches arc lengths.

    Parameters
    ----------
    law : TimeLaw
        The law.
    s : (n,) array
        mm.

    Returns
    -------
    (n,) array
        s.
    """
    c = law.coefficients
    piece = np.maximum(np.searchsorted(c[:, 0], s, side="left") - 1, 0)
    return law.breaks[piece] + times_in(c[piece], s, np.diff(law.breaks)[piece])


def times_in(c: Array, s: Array, span: Array) -> Array:
    """tau (n,) from 0 to a span (n,), s, at which polynomials c (n, 6), growing, reach s (n,)."""
    return reached(c.T, s, np.zeros(len(s)), span, 0.5 * span)


def breaks_apart(law: TimeLaw) -> Iterator[tuple[float, float, float]]:
    """Largest jump of s, of the feed and of the acceleration between pieces of a law, each with its t and s."""
    c, span = law.coefficients, np.diff(law.breaks)[:-1]
    before, behind = motion_of(c[:-1], span, 2), motion_of(c[1:], 0.0 * span, 2)
    for one, other in zip(before, behind, strict=True):
        gap = np.abs(other - one).tolist(), law.breaks[1:-1].tolist(), before[0].tolist()
        yield max(zip(*gap, strict=True), key=lambda each: each[0], default=(0.0, 0.0, 0.0))

"""The part of the check for a time law: exact derivatives of r(s(t)), and what they cannot decide.

A stretch of time is one in which the law is one polynomial, its acceleration has one sign, and the path is one
polynomial piece. It is examined by itself, ends included, so that values at breaks and knots are one-sided.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.analysis.check_bounds import STEP, Bounds, Worst
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import EPSILON, Places, Rows
from splinefeed.records import AXIS_LIMITS, KEPT, Array, IntArray, LimitResult, Limits, TimeLaw, unit_along
from splinefeed.records.law import polynomial

#: Chebyshev-Lobatto places 0 ... INSTANTS - 1 of a stretch, which are even in an angle.
INSTANTS = 17
#: Stretches that are processed together.
MOST = 256
#: Bisections that find an instant: 2^-60 of a piece.
BISECTIONS = 60
#: An acceleration below this share of the law's largest has no sign: where a law comes to rest, a rounding of its feed
#: is a square root of it in time.
NO_SIGN = 1e-9
#: Where a rotary axis turns while the linear ones stand still, C' may be 0 within so many roundings of s; and how many
#: may move a value.
INDISTINCT, SHIFT = 16.0, 2.0
#: What is sampled below this share of the largest so far is not examined more closely.
WORTH_A_LOOK = 0.9
#: Limits that only the law decides, not the path.
ALONG = ("feed", "acceleration", "deceleration", "jerk", "deceleration_jerk")
#: Limits that only setpoints can keep or exceed.
BY_SETPOINTS = ("chord_error", "orientation_error", "travel.", "combinations.", "torque.")
#: Roundings of arc length that two pieces of a law, or a law and its path, may be apart.
ROUNDINGS = 64.0
#: A jump of the feed or the acceleration below this share of the largest one is rounding.
NO_JUMP = 1e-9
#: Corners that a note names one by one.
LISTED = 3


@dataclass(frozen=True)
class LawFindings:
    """Results by limit, problems, and notes on what the setpoints decide."""

    results: dict[str, LimitResult]
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def check_law(law: TimeLaw, bounds: Bounds, period: float) -> LawFindings:
    """Compare a law's exact derivatives with the limits, at many instants of each of its pieces; period in s."""
    path = bounds.path
    rounding = 4.0 * EPSILON * path.length
    motion = LawMotion(law, Rows(path.arc_pieces), bounds.limits, path.axes, rounding)
    worsts = {name: worst for name, worst in bounds.worsts().items() if not name.startswith(BY_SETPOINTS)}
    steps = {name: worst for name, worst in worsts.items() if name.startswith(STEP)}
    held = {name: worst for name, worst in worsts.items() if name not in steps}
    motion.hold(held, None if path.feeds is None else bounds.row_feeds)
    corners = bounds.corners.s
    times, feeds = times_at(law, corners), _least_feeds(law, corners, rounding)
    for worst in steps.values():
        worst.see(feeds * bounds.corners.jumps[:, worst.column - 1], times, corners, np.zeros(len(corners)))
    results = {name: _result(worst, path) for name, worst in worsts.items() if name not in steps or len(corners)}
    problems: list[str] = []
    notes: list[str] = []
    _ends(law, bounds, motion, problems)
    _jumps(law, bounds, motion, period, problems, notes)
    if motion.irregular:
        notes.append(
            f"at {motion.irregular} instants of the law C' is 0 to rounding and exact axis derivatives are "
            "0/0; there the differences of the setpoints decide"
        )
    notes += _corner_notes(law, bounds)
    return LawFindings(results, tuple(problems), tuple(notes))


def limits_along(law: TimeLaw, path: Path, limits: Limits) -> dict[str, LimitResult]:
    """How the limits along the path fare in a law alone: feed, acceleration, deceleration and jerk."""
    bounds = Bounds(path, limits.for_axes(path.axes), 0.0, 0.0)
    worsts = {name: worst for name, worst in bounds.worsts().items() if name in ALONG}
    motion = LawMotion(law, Rows(path.arc_pieces), bounds.limits, path.axes, 0.0)
    motion.hold(worsts, None if path.feeds is None else bounds.row_feeds)
    return one_jerk({name: _result(worst, path) for name, worst in worsts.items()})


def one_jerk(results: dict[str, LimitResult]) -> dict[str, LimitResult]:
    """Results with one for jerk, whichever way the feed goes: the worse of both."""
    if "deceleration_jerk" in results:
        results["jerk"] = worse(results.pop("deceleration_jerk"), results.get("jerk"))
    return results


def _result(worst: Worst, path: Path) -> LimitResult:
    axis = path.axes[worst.column - 1] if worst.column else None
    return LimitResult(
        limit=worst.limit, worst=worst.value, at_s=worst.s, at_t=worst.t, floor=worst.floor, axis=axis, by="law",
        over=worst.over,
    )  # fmt: skip


def _ends(law: TimeLaw, bounds: Bounds, motion: LawMotion, problems: list[str]) -> None:
    """The law runs from 0 to the end of the path, forwards, with the end feeds of the limits."""
    length, limits = bounds.path.length, bounds.limits
    unit = unit_along(bounds.path.axes)
    if abs(law.length - length) > bounds.tolerance + ROUNDINGS * EPSILON * length:
        problems.append(f"law: ends at s = {law.length:.12g} {unit}; the path is {length:.12g} {unit} long")
    start = float(law(0.0))
    if abs(start) > bounds.tolerance + ROUNDINGS * EPSILON * length:
        problems.append(f"law: begins at s = {start:.6g} {unit} instead of 0")
    top = motion.top
    value, t, s = motion.backwards
    if value > NO_JUMP * top:
        problems.append(f"law: runs backwards at {value:.6g} {unit}/s at t = {t:.6g} s, s = {s:.6g} {unit}")
    for name, time in (("start_feed", 0.0), ("end_feed", law.duration)):
        feed, wanted = float(law.feed(time)), getattr(limits, name)
        if abs(feed - wanted) > NO_JUMP * max(top, wanted):
            problems.append(
                f"law: its feed at t = {time:.6g} s is {feed:.9g} {unit}/s; {name} is {wanted:.9g} {unit}/s"
            )


def _jumps(
    law: TimeLaw, bounds: Bounds, motion: LawMotion, period: float, problems: list[str], notes: list[str]
) -> None:
    """Jumps of s and of the feed between pieces are faults; of the acceleration, an infinite jerk."""
    length, limits = bounds.path.length, bounds.limits
    along = unit_along(bounds.path.axes)
    top, steepest = motion.top, motion.steepest
    kinds = (
        ("s", along, ROUNDINGS * EPSILON * length + NO_JUMP * top * period),
        ("its feed", f"{along}/s", NO_JUMP * top),
        ("its acceleration", f"{along}/s^2", NO_JUMP * steepest),
    )
    for k, ((what, unit, rounding), (value, t, s)) in enumerate(zip(kinds, breaks_apart(law), strict=True)):
        if not value > rounding:
            continue
        text = f"law: {what} jumps by {value:.6g} {unit} at t = {t:.9g} s, s = {s:.9g} {along}"
        if k < 2:
            problems.append(text)
        elif limits.jerk < np.inf or float(limits.deceleration_jerk or np.inf) < np.inf:
            problems.append(f"{text}: its jerk is infinite there")
        elif limits.axis_jerk is not None:
            notes.append(f"{text}: the exact axis jerk is infinite there, and the third difference decides")


def _corner_notes(law: TimeLaw, bounds: Bounds) -> list[str]:
    """Where tangent or curvature jumps and the law does not stop, derivatives of the axes are infinite: note it."""
    corners = bounds.path.corners
    limits = bounds.limits
    if not corners or (limits.axis_jerk is None and limits.axis_acceleration is None):
        return []
    high = times_at(law, np.array([corner.s for corner in corners]))
    moving = law.feed(high) > 1e-3 * float(np.max(law.feed(np.linspace(0.0, law.duration, 257))))
    notes = []
    unit = unit_along(bounds.path.axes)
    steps = set(bounds.corners.s.tolist())
    for stop, what, which in (
        (False, "the curvature jumps and the exact axis jerk is infinite", "third"),
        (True, "the direction jumps and the exact axis acceleration is infinite", "second and third"),
    ):
        places = [c.s for c, m in zip(corners, moving, strict=True) if m and c.stop == stop and c.s not in steps]
        if places:
            notes.append(
                f"at {len(places)} place(s), s = {_listed(places)} {unit}, {what}: there the {which} difference "
                "of the setpoints over the period decides: it is what the drive sees"
            )
    places = [c.s for c, m in zip(corners, moving, strict=True) if m and c.s in steps]
    if places:
        notes.append(
            f"at {len(places)} corner(s), s = {_listed(places)} {unit}, the tool does not stop: there the "
            "velocity step of each axis is checked, and no difference across the corner"
        )
    return notes


def _listed(places: list[float]) -> str:
    return ", ".join(f"{each:.6g}" for each in places[:LISTED]) + (", ..." if len(places) > LISTED else "")


def _least_feeds(law: TimeLaw, s: Array, rounding: float) -> Array:
    """Least feed of a law within the rounding of arc lengths s (n,), mm/s: where it rests, it is 0 at a break there."""
    first, last = times_at(law, s - rounding), times_at(law, s + rounding)
    least: Array = np.minimum(law.feed(first), law.feed(last))
    begin, end = np.searchsorted(law.breaks, first, "left"), np.searchsorted(law.breaks, last, "right")
    for k in np.flatnonzero(end > begin):
        least[k] = min(least[k], float(np.min(law.feed(law.breaks[begin[k] : end[k]]))))
    return np.maximum(least, 0.0)


def worse(one: LimitResult, other: LimitResult | None) -> LimitResult:
    """Of two findings on one limit the one that is further over it, or nearer to it; counted together."""
    if other is None:
        return one
    pairs = sorted((one, other), key=lambda result: (result.worst - result.floor) / result.limit)
    return replace(pairs[1], over=one.over + other.over)


@dataclass(frozen=True, eq=False)
class Stretches:
    """z stretches: their piece of the law and row of the path (z,), from low to high (z,), s behind the piece's start.

    way (z,)  1 where the feed grows, -1 where it falls, 0 where it is undetermined
    """

    piece: IntArray
    row: IntArray
    low: Array
    high: Array
    way: IntArray


class LawMotion:
    """Compares a law's motion on a path with limits; rounding: of its arc length, mm."""

    def __init__(self, law: TimeLaw, rows: Rows, limits: Limits, axes: tuple[str, ...], rounding: float) -> None:
        self.law, self.rows, self.limits, self.axes, self.rounding = law, rows, limits, axes, rounding
        #: Largest feed, acceleration or deceleration, and feed backwards with its t and s.
        self.top = self.steepest = 0.0
        self.backwards = (0.0, 0.0, 0.0)
        #: Instants with C' = 0 within the rounding of s, at which derivatives of the axes are 0/0.
        self.irregular = 0

    def hold(self, worsts: dict[str, Worst], feeds: Array | None) -> None:
        """Compare every limit with its values; feeds (r,): the largest feed on every row, mm/s, if it changes."""
        stretches = self._stretches()
        places = 0.5 * (1.0 - np.cos(np.pi * np.arange(INSTANTS) / (INSTANTS - 1)))[:, None]
        for start in range(0, len(stretches.piece), MOST):
            part = slice(start, start + MOST)
            piece, row, way = stretches.piece[part], stretches.row[part], stretches.way[part]
            low, width = stretches.low[part], (stretches.high - stretches.low)[part]
            values = self._look(piece, row, way, low + places * width, worsts, feeds, everything=True)
            for name, worst in worsts.items():
                if name not in values:
                    continue
                each = np.where(np.isnan(values[name]), -np.inf, values[name])
                best, owner = np.argmax(each, axis=0), np.arange(len(piece))
                top = each[best, owner]
                inner = np.clip(best, 1, INSTANTS - 2)
                with np.errstate(invalid="ignore", divide="ignore"):
                    before, after = each[inner - 1, owner], each[inner + 1, owner]
                    bend = before - 2.0 * top + after
                    near = (best == inner) & (bend < 0.0) & (top > WORTH_A_LOOK * worst.value) & np.isfinite(bend)
                    # the top of the parabola through three samples, which are even in the angle
                    angle = np.pi * (best + 0.5 * (before - after) / bend) / (INSTANTS - 1)
                if near.any():
                    tau = (low + width * 0.5 * (1.0 - np.cos(angle)))[near]
                    self._look(piece[near], row[near], way[near], tau[None], {name: worst}, feeds)

    def _look(
        self,
        piece: IntArray,
        row: IntArray,
        way: IntArray,
        tau: Array,
        worsts: dict[str, Worst],
        feeds: Array | None,
        everything: bool = False,
    ) -> dict[str, Array]:
        """Compare limits with their values at tau (k, z), s, of the stretches (z,); returns these, (k, z) each."""
        s, v, a, j = self._along(piece, tau)
        t = self.law.breaks[piece] + tau
        if everything:
            self.top = max(self.top, float(np.max(v)))
            self.steepest = max(self.steepest, float(np.max(np.abs(a))))
            k = np.unravel_index(int(np.argmin(v)), v.shape)
            if -v[k] > self.backwards[0]:
                self.backwards = float(-v[k]), float(t[k]), float(s[k])
        jerk, other = self.limits.jerk, float(self.limits.deceleration_jerk or np.inf)
        values = {
            "feed": v,
            "acceleration": a,
            "deceleration": -a,
            "jerk": np.where((way < 0) | ((way == 0) & (jerk < other)), 0.0, np.abs(j)),
            "deceleration_jerk": np.where((way > 0) | ((way == 0) & (other < jerk)), 0.0, np.abs(j)),
        }
        values = {name: values[name] for name in worsts if name in values}
        of_path = [name for name in worsts if name == "centripetal" or name.rpartition(".")[0] in AXIS_LIMITS]
        if of_path:
            found = self._of_path(row, s, v, a, j, of_path)
            regular = np.all([np.isfinite(each) for each in found.values()], axis=0)
            if everything:
                self.irregular += int(np.count_nonzero(~regular))
            values |= {name: np.where(regular, each, np.nan) for name, each in found.items()}
        for name, each in values.items():
            limits = feeds[row] + np.zeros(each.shape) if name == "feed" and feeds is not None else None
            floor = np.zeros(each.shape)
            if name not in ALONG:
                with np.errstate(invalid="ignore"):
                    over = each > worsts[name].limit * (1.0 + KEPT)
                if over.any():
                    owner = np.nonzero(over)[-1]
                    motion = s[over], v[over], a[over], j[over]
                    floor[over] = self._floor(row[owner], *motion, name, each[over])
                    self.irregular += int(np.count_nonzero(np.isnan(floor)))
            worsts[name].see(
                each.ravel(), t.ravel(), s.ravel(), floor.ravel(), None if limits is None else limits.ravel()
            )
        return values

    def _floor(self, row: IntArray, s: Array, v: Array, a: Array, j: Array, name: str, value: Array) -> Array:
        """What roundings of s can make of a value (n,): how much less it is SHIFT of them before or behind; or NaN."""
        least = value
        for side in (-SHIFT, SHIFT):
            other = self._of_path(row, s + side * self.rounding, v, a, j, [name])[name]
            least = np.where(np.isfinite(other), np.minimum(least, other), np.nan)
        return value - least

    def _of_path(self, row: IntArray, s: Array, v: Array, a: Array, j: Array, names: list[str]) -> dict[str, Array]:
        """Sizes of what the path makes of s, v, a, j (..., n) on rows (n,), by name, (..., n) each; NaN next to C' = 0.

        q' = r_s v,  q'' = r_ss v^2 + r_s a,  q''' = r_sss v^3 + 3 r_ss v a + r_s j,  with r_s, r_ss, r_sss by the chain
        rule: u_s = 1/c, u_ss = -(C'.C'')/c^4, u_sss = 4 (C'.C'')^2/c^7 - (C''.C'' + C'.C''')/c^5, c = |C'|.
        """
        rows = self.rows
        every = np.broadcast_to(row, s.shape).ravel()
        ahead = np.clip(s.ravel() - rows.start[every], 0.0, rows.end[every] - rows.start[every])
        places = Places(rows, every)
        _, c1, c2, c3 = places.derivatives(rows.parameter(every, ahead), 3)
        v, a, j = v.ravel(), a.ravel(), j.ravel()
        out = {}
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            square, product = places.product(c1, c1), places.product(c1, c2)
            third = places.product(c2, c2) + places.product(c1, c3)
            c = np.sqrt(square)
            us, uss = 1.0 / c, -product / (square * square)
            usss = 4.0 * product * product / (square * square * square * c) - third / (square * square * c)
            r1 = c1 * us
            r2 = c2 * (us * us) + c1 * uss
            # C' = 0 is no nearer than where both other derivatives go against it: c = b x + d x^2 / 2
            b, d = np.sqrt(places.product(c2, c2)), np.sqrt(places.product(c3, c3))
            steep = b + np.hypot(b, np.sqrt(2.0 * c * d))
            x = np.where(steep > 0.0, 2.0 * c / steep, 0.0)
            away = x * (c - x * (b / 2.0 + x * d / 6.0))
            near = ~(c > 0.0)
            if rows.linear < rows.axes:  # linear axes alone have no such places: see `geometry.resolution`
                near = np.where(steep > 0.0, ~(away > INDISTINCT * self.rounding), near)
            for name in names:
                kind, _, axis = name.rpartition(".")
                if name == "centripetal":
                    bend = np.zeros(len(v))
                    for k in range(rows.linear):
                        bend += r2[k] * r2[k]
                    value = np.where(places.turning, 0.0, np.sqrt(bend)) * v * v
                else:
                    k, order = self.axes.index(axis), AXIS_LIMITS.index(kind)
                    value = r1[k] * v
                    if order == 1:
                        value = r2[k] * v * v + r1[k] * a
                    elif order == 2:
                        r3 = c3[k] * (us * us * us) + 3.0 * c2[k] * us * uss + c1[k] * usss
                        value = r3 * v * v * v + 3.0 * r2[k] * v * a + r1[k] * j
                out[name] = np.where(near, np.nan, np.abs(value)).reshape(s.shape)
        return out

    # --- stretches of time -------------------------------------------------------------------------------------------

    def _along(self, piece: IntArray, tau: Array) -> tuple[Array, Array, Array, Array]:
        """s, mm, and its three derivatives, mm/s^k, at tau (..., n), s, behind the start of pieces (n,)."""
        s, v, a, j = polynomial(self.law.coefficients[piece], tau, 3)
        return s, v, 2.0 * a, 6.0 * j

    def _stretches(self) -> Stretches:
        start, law = self.rows.start, self.law
        piece, low, high, way = self._of_one_sign()
        # a piece that begins or ends within the rounding of a row's end begins or ends there
        every, span = np.arange(len(law.coefficients)), np.diff(law.breaks)
        begin, end = (self._along(every, tau)[0] for tau in (np.zeros(len(span)), span))
        least = np.maximum(np.searchsorted(start, begin + self.rounding, side="right") - 1, 0)
        most = np.maximum(np.searchsorted(start, end - self.rounding, side="left") - 1, least)
        begin, end = self._along(piece, low)[0], self._along(piece, high)[0]
        least, most = least[piece], most[piece]
        first = np.clip(np.searchsorted(start, begin, side="right") - 1, least, most)
        last = np.clip(np.searchsorted(start, end, side="left") - 1, first, most)
        count = last - first + 1
        owner = np.repeat(np.arange(len(piece)), count)
        at = np.cumsum(count)
        row = first[owner] + np.arange(len(owner)) - (at - count)[owner]
        inside = row > first[owner]
        begins, ends = low[owner], high[owner]
        who = owner[inside]
        begins[inside] = reached(law.coefficients[piece[who]], start[row[inside]], low[who], high[who])
        ends[np.flatnonzero(inside) - 1] = begins[inside]
        return Stretches(piece[owner], row, begins, ends, way[owner])

    def _of_one_sign(self) -> tuple[IntArray, Array, Array, IntArray]:
        """Piece, first and last instant, s behind the piece's start, and way of what has one sign of acceleration.

        What is no longer than the rounding of its instant is left out.
        """
        law = self.law
        span = np.diff(law.breaks)
        pieces = np.arange(len(span))
        c = law.coefficients.T
        with np.errstate(divide="ignore", invalid="ignore"):  # where the jerk, c + b tau + a tau^2, is 0
            a, b, constant = 60.0 * c[5], 24.0 * c[4], 6.0 * c[3]
            q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * constant), b))
            turning = np.stack([q / a, constant / q])
            turning = np.where((turning > 0.0) & (turning < span), turning, span)
        cuts = np.sort(np.concatenate([np.zeros((1, len(span))), turning, span[None]]), axis=0)
        # between these the acceleration goes one way, and has one root at most
        low, high = cuts[:-1], cuts[1:]
        start, end = self._along(pieces, low)[2], self._along(pieces, high)[2]
        crosses = start * end < 0.0
        left, right, sign = low[crosses], high[crosses], start[crosses]
        own = law.coefficients[np.broadcast_to(pieces, crosses.shape)[crosses]]
        for _ in range(BISECTIONS if len(left) else 0):
            middle = 0.5 * (left + right)
            before = polynomial(own, middle, 2)[2] * sign > 0.0
            left, right = np.where(before, middle, left), np.where(before, right, middle)
        roots = high.copy()
        roots[crosses] = right
        cuts = np.sort(np.concatenate([cuts, roots]), axis=0)
        low, high = cuts[:-1].T.ravel(), cuts[1:].T.ravel()
        piece = np.repeat(pieces, len(cuts) - 1)
        long = high - low > 2.0 * EPSILON * np.abs(law.breaks[piece + 1])
        piece, low, high = piece[long], low[long], high[long]
        start, middle, end = (self._along(piece, each)[2] for each in (low, 0.5 * (low + high), high))
        largest = np.maximum(np.abs(start), np.abs(end))
        distinct = largest > NO_SIGN * float(np.max(largest, initial=0.0))
        return piece, low, high, np.where(distinct, np.sign(middle), 0.0).astype(np.int64)


def reached(c: Array, s: Array, low: Array, high: Array) -> Array:
    """tau (n,) in [low, high] at which polynomials c (n, 6), growing, reach s (n,), by bisection."""
    for _ in range(BISECTIONS if len(s) else 0):
        middle = 0.5 * (low + high)
        ahead = polynomial(c, middle, 0)[0] < s
        low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
    return high


def times_at(law: TimeLaw, s: Array) -> Array:
    """When a law first reaches arc lengths s (n,), mm, s."""
    c = law.coefficients
    piece = np.maximum(np.searchsorted(c[:, 0], s, side="left") - 1, 0)
    return law.breaks[piece] + reached(c[piece], s, np.zeros(len(s)), np.diff(law.breaks)[piece])


def breaks_apart(law: TimeLaw) -> Iterator[tuple[float, float, float]]:
    """Largest jump of s, of the feed and of the acceleration between pieces of a law, each with its t and s."""
    c = law.coefficients
    s, v, a = polynomial(c[:-1], np.diff(law.breaks)[:-1], 2)
    for k, each in enumerate((s, v, 2.0 * a)):
        gap = np.abs(c[1:, k] * (2.0 if k == 2 else 1.0) - each)
        if not len(gap):
            yield 0.0, 0.0, 0.0
            continue
        i = int(np.argmax(gap))
        yield float(gap[i]), float(law.breaks[i + 1]), float(s[i])

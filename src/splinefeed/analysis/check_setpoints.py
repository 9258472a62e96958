"""The part of the check that looks at setpoints alone: place, order, period, and differences, block by block."""

from __future__ import annotations

import numpy as np

from splinefeed.analysis.check_bounds import STEP, Bounds, Fault
from splinefeed.analysis.check_corners import BESIDE, contain, neighbours, standing
from splinefeed.geometry.nearest import Nearest
from splinefeed.kernels import check as kernels
from splinefeed.kernels import check_place as search
from splinefeed.records import Array, BoolArray, IntArray, LimitResult, Setpoints, TimeLaw, unit_along

EPSILON = float(np.finfo(np.float64).eps)
#: A setpoint may be this many roundings of the largest coordinate off the curve, besides the tolerance.
ROUNDINGS = 64.0
#: A tick that is early or late by less than this, in periods, is on time.
ON_TIME = 1e-6
#: ... and all of them together, first to last, by less than these many periods and this share of the whole.
CREEP = 1e-3
CREEP_SHARE = 1e-9
#: A step longer than this many times both its neighbours, or than the feed allows, skips a part of the path. (From rest
#: at constant jerk steps grow as 1, 7, 19.)
SKIP = 8.0
SKIP_FEED = 2.0
#: A step without length between two that are this many roundings long is a setpoint said twice.
REPEAT = 64.0
#: Ripple is measured where the law moves by more than this share of its longest step, as in `ripple.FEED_SHARE`.
RIPPLE_SHARE = 0.1
#: Steps longer than this share of the longest tell how much an axis turns along the path, rad/mm.
TURN_SHARE = 1e-3


class Judge:
    """Sees all setpoints of one motion once, in order, and remembers what is worst."""

    def __init__(self, bounds: Bounds, first: Setpoints, law: TimeLaw | None) -> None:
        path = bounds.path
        self.law, self.period = law, first.period
        self.placed = not bool(np.isnan(first.u).all())  # else only positions are there, as from another program
        self.worst = bounds.worsts()
        self.faults: dict[str, Fault] = {}
        self.ticks = 0
        self.short: float | None = None
        self._start = self.start_error = self.end_error = 0.0
        self.drift = self.ripple = self.off_path = self.turned_off = 0.0
        self.scale = np.zeros(1 + len(path.axes))  # of rounding, mm or rad: along the path, then each axis
        self.allowed = 0.0
        self._know(bounds)
        self.last_position = np.full(len(path.axes), np.nan)
        self.last_s = self._centripetal_feed = 0.0
        self._state = np.zeros(3)
        self._row = np.zeros(1, dtype=np.int64)
        self._last = np.zeros(3)  # t, s, u of the last tick
        self._steps = np.zeros((0, self.scale.size))
        self._dt = np.zeros(0)
        self._step_places = np.zeros((0, 3))  # t and s at the start of a step, s at its end
        top = 0.0 if law is None else float(np.max(law.feed(np.linspace(0.0, law.duration, 2048))))
        self._ripple_from = RIPPLE_SHARE * top * self.period

    def _know(self, bounds: Bounds) -> None:
        """Hold the setpoints to these bounds, on their path."""
        path, self.bounds = bounds.path, bounds
        self._nearest = Nearest(path.table, path.shape)
        size = float(np.max(np.abs(self._nearest.boxes[1]), initial=0.0))
        rounded = 0.5 * bounds.resolution * np.sqrt(path.linear)
        off = bounds.tolerance + ROUNDINGS * EPSILON * max(size, path.length) + float(rounded)
        self.allowed, self.scale[0] = max(self.allowed, off), max(self.scale[0], path.length)

    def rounding(self, column: int) -> float:
        """Rounding of one coordinate, or of the arc length, mm or rad: eps X + resolution / 2."""
        digit = 0.5 * self.bounds.resolution * (np.sqrt(self.bounds.path.linear) if column == 0 else 1.0)
        return float(EPSILON * self.scale[column] + digit)

    def floor(self, order: int, column: int) -> float:
        """Rounding floor of a difference of that order: 2^k (eps X + resolution / 2) / T^k."""
        return float(2.0**order * self.rounding(column) / self.period**order)

    def see(self, points: Setpoints, last: bool) -> None:
        """The next setpoints; `last` says that they are the last one, alone."""
        self._check_finite(points)
        t, position = points.t, np.where(np.isfinite(points.position), points.position, np.nan)
        rows, found = self._locate(points)
        s, u = found[:, search.S], found[:, search.U]
        dt = self._check_times(t, s, last)
        rest = self.bounds.limits.start_feed == 0.0
        if self.ticks == 0:
            self._start = float(t[0])
            self._check_end("start", found[0], position[0], at_start=True)
            self._row, self._last = rows[:1].copy(), np.array([t[0] - self.period, s[0], u[0]])
            self.last_position = position[0].copy()
            if rest:  # what came before is a stand
                stand = 2 * BESIDE
                self._steps, self._dt = np.zeros((stand, self.scale.size)), np.full(stand, self.period)
                self._step_places = np.full((stand, 3), [t[0], s[0], s[0]])
        rows = np.concatenate([self._row, rows])
        u = np.concatenate([self._last[2:], u])
        travelled, least = np.empty(len(t)), np.empty(len(t))
        path = self.bounds.path
        kernels.steps(path.table, path.shape, rows, u, self.bounds.row_feeds, travelled, least)
        with np.errstate(divide="ignore", invalid="ignore"):
            # over several curves the limit of the mean feed is the way through the least time that their feeds allow
            feeds = np.where(least > 0.0, travelled / least, np.inf)
        corners = np.vstack([self.last_position, position])
        steps = np.column_stack([travelled, np.diff(corners, axis=0)])
        before = np.concatenate([self._last[1:2], s[:-1]])
        places = np.column_stack([np.concatenate([self._last[:1], t[:-1]]), before, s])
        places[:, 0] = np.maximum(places[:, 0], 0.0 if self.ticks == 0 else -np.inf)
        linear = path.linear
        if len(self.scale) > 1 + linear:
            long = np.abs(travelled) > TURN_SHARE * np.fmax.reduce(np.abs(travelled), initial=0.0)
            turns = np.abs(steps[long, 1 + linear :] / travelled[long, None])
            tops = np.fmax.reduce(np.abs(position[:, linear:]), axis=0, initial=0.0)
            tops = tops + self.scale[0] * np.fmax.reduce(turns, axis=0, initial=0.0)
            self.scale[1 + linear :] = np.fmax(self.scale[1 + linear :], np.where(np.isfinite(tops), tops, 0.0))
        self._chords(rows, u, corners, travelled, dt, places)
        self._follow_law(t, s, travelled)
        for name, worst in self.worst.items():
            if name.startswith("travel."):
                low, high = self.bounds.limits.travel[name.removeprefix("travel.")]
                away = np.abs(position[:, worst.column - 1] - 0.5 * (low + high))
                worst.see(away, t, s, self.floor(0, worst.column))
        skip = 0 if rest or self.ticks else 1  # before a start in motion nothing is known
        self._row, self._last = rows[-1:].copy(), np.array([t[-1], s[-1], found[-1, search.U]])
        self.last_position, self.last_s = position[-1].copy(), float(s[-1])
        first = self.ticks + skip
        self.ticks += len(t)
        if skip and len(t) > 1:
            self._edge(2.0 * (float(travelled[1]) / dt[1] - self.bounds.limits.start_feed) / dt[1], places[1])
        self._differences(steps[skip:], dt[skip:], feeds[skip:], places[skip:], first)
        if last:
            self._check_end("end", found[-1], position[-1], at_start=False)
            self._finish(float(dt[-1]))

    # --- single ticks ------------------------------------------------------------------------------------------------

    def _fault(
        self, kind: str, wrong: BoolArray, amount: Array, t: Array, s: Array, detail: str = "", tick: int | None = None
    ) -> None:
        """Remember the ticks that are `wrong` (n,), from `tick` on (default: the next), t and s (n,) beside them."""
        count = int(np.count_nonzero(wrong))
        if not count:
            return
        k = int(np.argmax(np.where(wrong, amount, -np.inf)))
        old = self.faults.get(kind)
        if old is None or amount[k] > old.amount:
            first = self.ticks if tick is None else tick
            seen = old.count if old else 0
            self.faults[kind] = old = Fault(seen, float(amount[k]), first + k, float(t[k]), float(s[k]), detail)
        old.count += count

    def _check_finite(self, points: Setpoints) -> None:
        names = ("t", *(("u", "s", "feed") if self.placed else ()))
        columns = {name: getattr(points, name) for name in names}
        columns |= {axis: points.position[:, k] for k, axis in enumerate(points.axes)}
        for name, values in columns.items():
            bad = ~np.isfinite(values)
            if bad.any():
                what = f"{name} is {values[int(np.argmax(bad))]}"
                self._fault(f"finite {name}", bad, np.ones(len(bad)), points.t, np.nan_to_num(points.s), what)

    def _check_times(self, t: Array, s: Array, last: bool) -> Array:
        """Time of each step that ends at a tick, s: the period, but for a last one that is shorter."""
        T = self.period
        begin = self._last[0] if self.ticks else t[0] - T
        with np.errstate(invalid="ignore"):
            dt = np.diff(np.concatenate([[begin], t]))
            if last and self.ticks and ON_TIME * T < dt[-1] < T * (1.0 - ON_TIME):
                self.short = float(dt[-1])
            else:
                late = np.abs(dt - T)
                self._fault("period", late > ON_TIME * T + 4.0 * EPSILON * np.abs(t), late, t, s)
        taken = np.full(len(t), T)
        if self.short is not None:
            taken[-1] = self.short
        return taken

    def _locate(self, points: Setpoints) -> tuple[IntArray, Array]:
        """Rows of the path's table and what `search.locate` finds, with what is off the curve or misplaced."""
        path = self.bounds.path
        rows = np.empty(len(points), dtype=np.int64)
        found = np.empty((len(points), search.FOUND))
        along = np.zeros(1)
        done = search.placed(
            path.table, path.curve_rows, path.shape, self.allowed, points.curve, points.u, points.position,
            self._state, rows, found, along,
        )  # fmt: skip
        if done < len(points):
            along[0] = max(along[0], search.locate(
                path.table, path.curve_rows, path.shape, self._nearest.cells, self._nearest.boxes, self.allowed,
                points.curve[done:], points.u[done:], points.position[done:], self._state, rows[done:], found[done:],
            ))  # fmt: skip
        self.scale[0] = max(self.scale[0], float(along[0]))
        tops = np.fmax.reduce(np.abs(points.position[:, : path.linear]), axis=0)
        of_linear = self.scale[1 : 1 + path.linear]
        of_linear[:] = np.fmax(of_linear, self.scale[0] + np.where(np.isfinite(tops), tops, 0.0))
        t, s = points.t, found[:, search.S]
        apart, turned, astray = (found[:, k] for k in (search.APART, search.TURNED, search.ASTRAY))
        self.off_path = max(self.off_path, float(np.fmax.reduce(apart, initial=0.0)))
        self.turned_off = max(self.turned_off, float(np.fmax.reduce(turned, initial=0.0)))
        self._fault("off the curve", apart > self.allowed, apart, t, s)
        self._fault("turned off", turned > self.allowed, turned, t, s)
        wrong_u = (astray > self.allowed) & (apart <= self.allowed) & (turned <= self.allowed)
        self._fault("misplaced", wrong_u, astray, t, s)
        return rows, found

    def _check_end(self, kind: str, found: Array, position: Array, at_start: bool) -> None:
        """Whether the first or last setpoint is the path's, by position and, for closed paths, by arc length."""
        path = self.bounds.path
        curve = path.curves[0 if at_start else -1]
        apart = position - curve(curve.domain[0 if at_start else 1])
        s_missing = abs(found[search.S] - (0.0 if at_start else path.length))
        missing, tick = max(float(np.linalg.norm(apart[: path.linear])), s_missing), 0 if at_start else self.ticks - 1
        turned = float(np.max(np.abs(apart[path.linear :]), initial=0.0))
        if at_start:
            self.start_error = missing
        else:
            self.end_error = missing
        if not (missing <= self.allowed + 16.0 * EPSILON * self.scale[0] and turned <= self.allowed):
            besides = f" and {np.degrees(turned):.6g} deg" if turned > self.allowed else ""
            detail = f"{missing:.6g} {unit_along(path.axes)}{besides}"
            self.faults[kind] = Fault(1, missing, tick, self._last[0], found[search.S], detail)

    # --- steps -------------------------------------------------------------------------------------------------------

    def _chords(self, rows: IntArray, u: Array, corners: Array, travelled: Array, dt: Array, places: Array) -> None:
        path = self.bounds.path
        out = np.empty(len(travelled))
        if (worst := self.worst.get("chord_error")) is not None:
            kernels.chords(path.table, path.shape, rows, u, corners, worst.value, out)
            worst.see(out, places[:, 0], places[:, 1], self.chord_floor)
        if (worst := self.worst.get("centripetal")) is not None:
            # somewhere within the step the feed was its mean: with the least curvature there this is safe to say
            kernels.least_curvatures(path.table, path.shape, rows, u, out)
            with np.errstate(invalid="ignore"):
                feed = np.abs(travelled) / dt
                k = worst.see(feed * feed * out, places[:, 0], places[:, 1], 0.0)
            self._centripetal_feed = self._centripetal_feed if k is None else float(feed[k])

    @property
    def chord_floor(self) -> float:
        """Rounding of the distance of a point from a chord, mm: that of a second difference, without a period."""
        return 4.0 * max((self.rounding(1 + k) for k in range(self.bounds.path.linear)), default=0.0)

    def _follow_law(self, t: Array, s: Array, travelled: Array) -> None:
        if self.law is None:
            return
        planned = self.law(t)
        before = self.law(np.concatenate([self._last[:1], t[:-1]]))
        with np.errstate(invalid="ignore", divide="ignore"):
            self.drift = max(self.drift, float(np.fmax.reduce(np.abs(s - planned), initial=0.0)))
            ripple = np.abs(travelled / (planned - before) - 1.0)[planned - before > self._ripple_from]
        self.ripple = max(self.ripple, float(np.fmax.reduce(ripple, initial=0.0)))

    def _differences(self, steps: Array, dt: Array, feeds: Array, places: Array, tick: int) -> None:
        """Feed, acceleration and jerk of path and axes over new steps (n, 1 + axes) that took dt (n,), s.

        feeds (n,): the limit of the feed over each step, mm/s.

        Divided differences times k!: v = step / dt, a = 2 (v2 - v1) / (dt1 + dt2), j = 3 (a2 - a1) / (dt1 + dt2 + dt3).
        places (n, 3) are t and s at the start of each step and s at its end, what spans several is placed in the
        middle; `tick` is where the first step ends.
        """
        n = len(steps)
        steps = np.concatenate([self._steps, steps])
        dt = np.concatenate([self._dt, dt])
        places = np.concatenate([self._step_places, places])
        last = slice(-n - 2, None)
        self._check_steps(steps[last, 0], places[last, 0], places[last, 1], n, tick)
        with np.errstate(invalid="ignore"):
            v = steps / dt[:, None]
            a = np.diff(v, axis=0) / (0.5 * (dt[1:] + dt[:-1]))[:, None]
            j = np.diff(a, axis=0) / ((dt[2:] + dt[1:-1] + dt[:-2]) / 3.0)[:, None]
            # a step shorter than the period has a higher floor: only what is above that counts
            error = 2.0 / dt
            error2 = (error[1:] + error[:-1]) / (0.5 * (dt[1:] + dt[:-1]))
            error3 = (error2[1:] + error2[:-1]) / ((dt[2:] + dt[1:-1] + dt[:-2]) / 3.0)
        values = (v[-n:], a[max(len(a) - n, 0) :], j[max(len(j) - n, 0) :])
        ends = [places[len(places) - len(each) :] for each in values]
        extra = []
        for order, (each, e) in enumerate(zip(values, (error, error2, error3), strict=True), start=1):
            high = e[len(e) - len(each) :] if len(each) else e[:0]
            extra.append(np.maximum(high - (2.0 / self.period) ** order * (1.0 + 1e-12), 0.0))
        growing, falling = self._signs(a, len(values[2]))
        jerk, other = self.bounds.limits.jerk, float(self.bounds.limits.deceleration_jerk or np.inf)
        corners = self.bounds.corners.s
        if len(corners):
            self._corner_steps(v, places, range(max(len(v) - n - BESIDE, 1), len(v) - BESIDE))
        for name, worst in self.worst.items():
            order, column = worst.order, worst.column
            if order == 0 or name == "centripetal" or name.startswith(STEP):
                continue
            each = values[order - 1][:, column]
            if len(corners) and column and order > 1 and len(each):  # what straddles a corner is that corner's step
                begin = places[len(places) - len(each) - order + 1 : len(places) - order + 1, 1]
                each = np.where(contain(corners, begin, ends[order - 1][:, 2]), np.nan, each)
            if name == "deceleration":
                each = -each
            elif name == "jerk":
                each = np.where(falling | (~growing & (jerk < other)), 0.0, np.abs(each))
            elif name == "deceleration_jerk":
                each = np.where(growing | (~falling & (other < jerk)), 0.0, np.abs(each))
            elif name != "acceleration":
                each = np.abs(each)
            t, s, _ = ends[order - 1].T
            local = feeds if name == "feed" and self.bounds.path.feeds is not None else None
            worst.see(each - self.rounding(column) * extra[order - 1], t, s, self.floor(order, column), local)
        self._steps, self._dt, self._step_places = (each[-2 * BESIDE :] for each in (steps, dt, places))

    def _corner_steps(self, v: Array, places: Array, ready: range) -> None:
        """Jump of each axis' velocity at the corners within steps of these indices; v, places as in `_differences`."""
        corners, limits, axes = self.bounds.corners, self.bounds.limits, self.bounds.path.axes
        begin, end, floor = places[:, 1], places[:, 2], self.floor(1, 0)
        for k, s in enumerate(corners.s):
            for i in (j for j in np.flatnonzero((begin < s) & (s <= end)).tolist() if j in ready):
                feed = corners.least_feed(k, v[:, 0], i, float(s - begin[i]), floor, self.period, limits, axes)
                for name, worst in self.worst.items():
                    if name.startswith(STEP):
                        jump = np.array([feed * corners.jumps[k, worst.column - 1]])
                        worst.see(jump, places[i : i + 1, 0], np.array([s]), self.floor(1, worst.column))

    @staticmethod
    def _signs(a: Array, n: int) -> tuple[BoolArray, BoolArray]:
        """Where the feed grows, and where it falls, throughout the last n third differences, (n,)."""
        if n == 0:
            return np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
        one, two = a[-n - 1 : -1, 0], a[-n:, 0]
        with np.errstate(invalid="ignore"):
            bend = np.abs(two - one)
            return np.minimum(one, two) > bend, np.maximum(one, two) < -bend

    def _check_steps(self, d: Array, t: Array, s: Array, n: int, tick: int) -> None:
        """Progress: no step back, none skipped, none said twice.

        d (m + n,) with t and s at their starts; the last n are new, the first of these ends at `tick`.
        """
        floor = 2.0 * EPSILON * self.scale[0] + self.bounds.resolution
        tick -= len(d) - n
        with np.errstate(invalid="ignore"):
            new = np.arange(len(d)) >= len(d) - n
            self._fault("back", new & (d < -floor), -d, t, s, tick=tick)
            before, here, after = d[:-2], d[1:-1], d[2:]
            near = np.maximum(before, after)
            most = SKIP_FEED * float(np.max(self.bounds.feeds)) * self.period
            alone = here > SKIP * near + floor
            if np.any(alone):  # from one stop to the next, a whole stretch may take a single period
                if self.law is not None:  # over nanometres a law may well go from next to rest to next to rest in one
                    alone &= np.abs(self.law(t[1:-1] + self.period) - self.law(t[1:-1]) - here) > REPEAT * floor
                alone &= ~neighbours(self.bounds.rests, s[1:-1], s[1:-1] + here, self.allowed + floor)
            skipped = (here > REPEAT * floor) & (alone | (here > most))
            twice = (np.abs(here) <= floor) & (np.minimum(before, after) > REPEAT * floor)
            if np.any(twice):  # where the tool may stand, the same point twice is a wait, such as for the next tick
                twice &= ~standing(self.bounds.rests, s[1:-1], self.allowed + floor)
        self._fault("skipped", skipped, here, t[1:-1], s[1:-1], tick=tick + 1)
        self._fault("twice", twice, near, t[1:-1], s[1:-1], tick=tick + 1)

    def _finish(self, last_dt: float) -> None:
        """What follows the last setpoint: a stand, or motion of which only the feed is known."""
        place = np.array([self._last[0], self.last_s, self.last_s])
        T = self.period
        crept = abs(self.duration - (self.ticks - 2) * T - last_dt)
        if "period" not in self.faults and crept > CREEP * T + CREEP_SHARE * self.ticks * T:
            self.faults["period"] = Fault(1, crept, self.ticks - 1, float(place[0]), self.last_s)
        feed = self.bounds.limits.end_feed
        if feed == 0.0:
            still = np.zeros((3, self.scale.size))
            nothing = np.full(3, np.inf)
            self._differences(still, np.full(3, self.period), nothing, np.tile(place, (3, 1)), self.ticks)
        elif len(self._steps):
            v = self._steps / self._dt[:, None]
            self._corner_steps(v, self._step_places, range(max(len(v) - BESIDE, 1), len(v) - 1))
            self._edge(2.0 * (feed - float(self._steps[-1, 0]) / last_dt) / last_dt, place)

    def _edge(self, a: float, place: Array) -> None:
        """Acceleration from or to the feed at an end, the mean over one step weighted towards it, mm/s^2."""
        for name, sign in (("acceleration", 1.0), ("deceleration", -1.0)):
            if name in self.worst:
                self.worst[name].see(np.array([sign * a]), place[:1], place[1:2], self.floor(2, 0))

    @property
    def duration(self) -> float:
        """From the first setpoint to the last, s, by their own times."""
        return float(self._last[0]) - self._start

    def results(self) -> dict[str, LimitResult]:
        """Every limit by the setpoints alone."""
        out = {}
        for name, worst in self.worst.items():
            floor = self.floor(worst.order, worst.column)
            if name == "chord_error":
                floor = self.chord_floor
            elif name == "centripetal":  # (v + floor of v)^2 kappa
                feed = self._centripetal_feed
                floor = 2.0 * floor * worst.value / feed if feed > 0.0 else 0.0
            axis = self.bounds.path.axes[worst.column - 1] if worst.column else None
            out[name] = LimitResult(
                limit=worst.limit, worst=worst.value, at_s=worst.s, at_t=worst.t, floor=floor, axis=axis,
                over=worst.over,
            )  # fmt: skip
        return out

"""The part of the check for setpoints alone: place, order, period, and differences, block by block.

Every number that is measured has its rounding beside it. A setpoint is known to

    along the path   d = eps max(L, |u| |C'(u)|)            of arc lengths, up to the path's, and of the parameter
    on an axis       |dx/ds| d + eps X + resolution / 2     X the numbers that its position is made of

and what differences make of that, through their own stencil, is the floor of each of them: there is no other allowance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.analysis import between
from splinefeed.analysis.check_bounds import STEP, Bounds, Fault, jerks
from splinefeed.analysis.check_corners import BESIDE, contain, neighbours, standing
from splinefeed.analysis.check_tool import Tool
from splinefeed.analysis.place import Follower, Located
from splinefeed.errors import InputError
from splinefeed.geometry.rows import EPSILON, Rows
from splinefeed.records import Array, BoolArray, LimitResult, Setpoints, TimeLaw, unit_along

#: A setpoint may be this many roundings of the largest coordinate off the curve, in addition to the tolerance.
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
#: A step without length between two that are this many roundings long is a repeated setpoint.
REPEAT = 64.0
#: Ripple is measured where the law moves by more than this share of its longest step, as in `ripple.FEED_SHARE`.
RIPPLE_SHARE = 0.1


class Judge:
    """Measures all setpoints of one motion once, in order, and keeps the worst values.

    Columns of steps and of all that comes of them: 0 along the path, 1 + k axis k, then combinations of axes. The path
    may change under way, to one that lacks parts that are behind: see `move_on`.
    """

    def __init__(self, bounds: Bounds, first: Setpoints, law: TimeLaw | None) -> None:
        self.law, self.period = law, first.period
        if bounds.joints is not None and np.isnan(first.u).any():
            raise InputError("the setpoints have no u; joints can be checked only where u says their place on the path")
        self.placed = not bool(np.isnan(first.u).all())  # else only positions are there, as from another program
        self.worst = bounds.worsts()
        self.faults: dict[str, Fault] = {}
        self.ticks = 0
        self.short: float | None = None
        self._start = self.start_error = self.end_error = 0.0
        self.drift = self.ripple = self.off_path = 0.0
        self.scale = self.allowed = 0.0
        self.gone = self._seen = 0.0  # length before the path, mm, and how much of that was looked through
        self.turning: list[float] = []  # where the curves begin on which rotary axes move alone, mm
        self._know(bounds)
        self.tool = None if bounds.joints is None else Tool(bounds.joints, self.rows, self._follower)
        axes = len(bounds.axes)
        columns = 1 + axes + len(bounds.weights)
        self._t, self._planned = 0.0, np.zeros(1)
        self._place: Located | None = None  # of the last tick
        self._values = np.zeros((axes, 0))  # positions of the axes there
        self._torques = np.zeros((2, axes, 0))  # positions and their rounding of the last two ticks
        self._steps, self._errors = np.zeros((columns, 0)), np.zeros((columns, 0))
        self._dt = np.zeros(0)
        self._step_places = np.zeros((3, 0))  # t and s at the start of a step, s at its end
        top = 0.0 if law is None else float(np.max(law.feed(np.linspace(0.0, law.duration, 2048))))
        self._ripple_from = RIPPLE_SHARE * top * self.period

    def _know(self, bounds: Bounds) -> None:
        """Compare the setpoints with these bounds, on their path."""
        path, self.bounds = bounds.path, bounds
        self.rows = Rows(path.arc_pieces)
        size = float(np.max(self.rows.sizes[: path.linear], initial=0.0))
        rounded = 0.5 * bounds.resolution * np.sqrt(path.linear)
        off = bounds.tolerance + ROUNDINGS * EPSILON * max(size, path.length) + float(rounded)
        self.allowed, self.scale = max(self.allowed, off), max(self.scale, path.length)
        self._follower = Follower(path, self.rows)

    @property
    def curve(self) -> int:
        """The curve on which the last tick lies."""
        assert self._place is not None
        return int(np.searchsorted(self.bounds.path.curve_rows[:, 0], self._place.row[0], side="right")) - 1

    def move_on(self, bounds: Bounds, left: int) -> None:
        """Go on with a path that lacks the first `left` curves and goes on further."""
        assert self._place is not None
        self._find_turning()
        path, start = self.bounds.path, self._follower
        gone, row = float(path.curve_starts[left]), int(path.curve_rows[left, 0])
        self._know(bounds)
        self._follower.go_on(start, gone)
        self._place = replace(self._place, row=self._place.row - row)
        self.gone += gone
        self._shift(-gone)

    def end(self) -> None:
        """Count arc length from the start of the first part again."""
        self._find_turning()
        self._shift(self.gone)

    def _find_turning(self) -> None:
        places = self.bounds.turning + self.gone
        self.turning += places[places >= self._seen].tolist()
        self._seen = self.gone + self.bounds.path.length

    def _shift(self, by: float) -> None:
        if self._place is not None:
            self._place = replace(self._place, s=self._place.s + by)
        self._step_places[1:] += by
        for worst in self.worst.values():
            worst.s += by
        for fault in self.faults.values():
            fault.s += by

    def see(self, setpoints: Setpoints, last: bool) -> None:
        """The next setpoints; `last` says that they are the last one, alone."""
        self._check_finite(setpoints)
        t, place, values = setpoints.t, *self._locate(setpoints)
        dt = self._check_times(t, place.s, last)
        rest = self.bounds.limits.start_feed == 0.0
        if self._place is None:
            self._start, self._t = float(t[0]), float(t[0]) - self.period
            self._check_end("start", place.part(0, 1), at_start=True)
            if rest:  # what came before is a stand
                self._stand(float(t[0]), float(place.s[0]))
            self._place, self._values = place.part(0, 1), values[:, :1]
        both, values = self._place.joined(place), np.concatenate([self._values, values], axis=1)
        feeds = None if self.bounds.path.feeds is None else self.bounds.row_feeds
        travelled, least = between.lengths(self.rows, both.row, both.u, feeds)
        with np.errstate(divide="ignore", invalid="ignore"):
            # over several curves the limit of the mean feed is the way through the least time that their feeds allow
            limits = None if feeds is None else np.where(least > 0.0, travelled / least, np.inf)
        weights = self.bounds.weights
        moved = np.diff(values, axis=1)
        steps = np.concatenate([travelled[None], moved, weights @ moved])
        rounding = self._rounding(both, values, travelled)
        rounding = np.concatenate([rounding, np.abs(weights) @ rounding[1:]])
        errors = rounding[:, :-1] + rounding[:, 1:]
        began = np.concatenate([[self._t], t[:-1]])
        if self.ticks == 0:
            began[0] = max(began[0], 0.0)
        places = np.stack([began, both.s[:-1], place.s])
        self._chords(both, values, travelled, errors, dt, places)
        self._follow_law(t, place.s, travelled)
        if self.short is None:
            self._see_torques(values[:, 1:], rounding[1 : 1 + len(values), 1:], t, place.s)
        for name, worst in self.worst.items():
            if name.startswith("travel."):
                low, high = self.bounds.limits.travel[name.removeprefix("travel.")]
                away = np.abs(values[worst.column - 1, 1:] - 0.5 * (low + high))
                worst.see(away, t, place.s, rounding[worst.column, 1:])
        skip = 0 if rest or self.ticks else 1  # before a start in motion nothing is known
        self._t, self._place, self._values = float(t[-1]), place.part(len(t) - 1, len(t)), values[:, -1:]
        first = self.ticks + skip
        self.ticks += len(t)
        if skip and len(t) > 1:
            self._edge(steps[0, 1], errors[0, 1], float(dt[1]), self.bounds.limits.start_feed, 1.0, places[:, 1])
        ends = steps[:, skip:], errors[:, skip:], dt[skip:], places[:, skip:]
        self._differences(*ends, None if limits is None else limits[skip:], first)
        if last:
            self._check_end("end", self._place, at_start=False)
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

    def _check_finite(self, setpoints: Setpoints) -> None:
        names = ("t", *(("u", "s", "feed") if self.placed else ()))
        columns = {name: getattr(setpoints, name) for name in names}
        columns |= {axis: setpoints.position[:, k] for k, axis in enumerate(setpoints.axes)}
        for name, values in columns.items():
            bad = ~np.isfinite(values)
            if bad.any():
                what = f"{name} is {values[int(np.argmax(bad))]}"
                self._fault(f"finite {name}", bad, np.ones(len(bad)), setpoints.t, np.nan_to_num(setpoints.s), what)

    def _check_times(self, t: Array, s: Array, last: bool) -> Array:
        """Time of each step that ends at a tick, s: the period, but for a last one that is shorter."""
        T = self.period
        begin = self._t if self.ticks else t[0] - T
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

    def _locate(self, setpoints: Setpoints) -> tuple[Located, Array]:
        """Where the setpoints are on the path, with what is off the curve or misplaced, and the axes (axes, n)."""
        tip, tilted = setpoints, None
        if self.tool is not None:
            tip, tilted = self.tool.tip(setpoints)
        place = self._follower.locate(tip, self.allowed)
        t, s = setpoints.t, place.s
        self.off_path = max(self.off_path, float(np.fmax.reduce(place.apart, initial=0.0)))
        with np.errstate(invalid="ignore"):
            self._fault("off the curve", place.apart > self.allowed, place.apart, t, s)
            self._fault("turned off", place.turned > self.allowed, place.turned, t, s)
            on_curve = (place.apart <= self.allowed) & (place.turned <= self.allowed)
            self._fault("misplaced", (place.astray > self.allowed) & on_curve, place.astray, t, s)
            if tilted is not None:
                self._fault("tilted", tilted > self.allowed, tilted, t, s)
        return place, place.position if self.tool is None else setpoints.position.T

    def _rounding(self, place: Located, values: Array, travelled: Array) -> Array:
        """How far rounding alone can move setpoints along the path and on each axis, (1 + axes, n), mm or rad."""
        rows, path, digit = self.rows, self.bounds.path, 0.5 * self.bounds.resolution
        along = EPSILON * np.maximum(path.length, rows.parameters[place.row] * place.speed)
        of_axes = EPSILON * rows.sizes[:, place.row] + digit
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(place.speed > 0.0, np.abs(place.velocity) / place.speed, 1.0)
        known = along + digit * np.sqrt(path.linear)
        if not self.placed:  # as good as the positions by which they were placed
            known = known + np.max(EPSILON * rows.sizes[: path.linear or None, place.row], axis=0)
        self.scale = max(self.scale, float(np.fmax.reduce(along, initial=0.0)) / EPSILON)
        each = share * along + of_axes if self.tool is None else self.tool.rounding(values, travelled)
        return np.concatenate([known[None], each])

    def _check_end(self, kind: str, place: Located, at_start: bool) -> None:
        """Whether the first or last setpoint is the path's, by position and, for closed paths, by arc length."""
        path = self.bounds.path
        curve = path.curves[0 if at_start else -1]
        apart = place.position[:, 0] - curve(curve.domain[0 if at_start else 1])
        s = float(place.s[0])
        s_missing = abs(s - (0.0 if at_start else path.length))
        missing, tick = max(float(np.linalg.norm(apart[: path.linear])), s_missing), 0 if at_start else self.ticks - 1
        turned = float(np.max(np.abs(apart[path.linear :]), initial=0.0))
        if at_start:
            self.start_error = missing
        else:
            self.end_error = missing
        if not (missing <= self.allowed + 16.0 * EPSILON * self.scale and turned <= self.allowed):
            turning = f" and {np.degrees(turned):.6g} deg" if turned > self.allowed else ""
            detail = f"{missing:.6g} {unit_along(path.axes)}{turning}"
            self.faults[kind] = Fault(1, missing, tick, self._start if at_start else self._t, s, detail)

    # --- steps -------------------------------------------------------------------------------------------------------

    def _chords(self, both: Located, values: Array, travelled: Array, errors: Array, dt: Array, places: Array) -> None:
        """Chord error and centripetal acceleration of the steps between n + 1 places, values (axes, n + 1)."""
        linear, worst = self.bounds.path.linear, self.worst.get("chord_error")
        if self.tool is not None:
            found = self.tool.chords(values, both.s)
            for name, (error, rounding) in zip(("chord_error", "orientation_error"), found, strict=True):
                if name in self.worst:
                    self.worst[name].see(error, places[0], places[1], np.full(len(error), rounding))
        elif worst is not None:
            error = between.chord_errors(self.rows, both.row, both.u, both.position, worth=worst.limit)
            floor = 2.0 * np.max(errors[1 : 1 + linear], axis=0, initial=0.0)
            worst.see(error, places[0], places[1], floor)
        if (worst := self.worst.get("centripetal")) is not None:
            # somewhere within the step the feed was its mean: with the least curvature there this is a safe bound
            least = between.least_curvatures(self.rows, both.row, both.u)
            with np.errstate(invalid="ignore"):
                feed = np.abs(travelled) / dt
                worst.see(feed * feed * least, places[0], places[1], 2.0 * errors[0] / dt * feed * least)

    def _see_torques(self, position: Array, rounding: Array, t: Array, s: Array) -> None:
        """Torques at ticks with one before and one behind: inverse dynamics of differences; (axes, n) each.

        Before a start and behind an end at rest joints stand still.
        """
        torque = self.bounds.limits.torque
        if torque is None:
            return
        new = np.stack([position, rounding])
        if not self._torques.shape[2]:
            still = 2 if self.bounds.limits.start_feed == 0.0 else 0
            self._torques = np.repeat(new[:, :, :1], still, axis=2)
        known = np.concatenate([self._torques, new], axis=2)
        self._torques = known[:, :, -2:]
        if known.shape[2] < 3:
            return
        columns = torque.columns(self.bounds.axes)
        found, _, floor = torque.by_differences(known[0, columns].T, self.period, np.max(known[1, columns], axis=1))
        at = np.clip(np.arange(len(found)) - len(found) + len(t) - 1, 0, None)
        for k, axis in enumerate(torque.most):
            if (worst := self.worst.get(f"torque.{axis}")) is not None:
                worst.see(np.abs(found[:, k]), t[at], s[at], floor[:, k])

    def _follow_law(self, t: Array, s: Array, travelled: Array) -> None:
        if self.law is None:
            return
        planned = self.law(t)
        before = np.concatenate([self._planned if self.ticks else self.law(t[:1] - self.period), planned[:-1]])
        self._planned = planned[-1:]
        with np.errstate(invalid="ignore", divide="ignore"):
            self.drift = max(self.drift, float(np.fmax.reduce(np.abs(s - planned), initial=0.0)))
            ripple = np.abs(travelled / (planned - before) - 1.0)[planned - before > self._ripple_from]
        self.ripple = max(self.ripple, float(np.fmax.reduce(ripple, initial=0.0)))

    def _stand(self, t: float, s: float) -> None:
        """Steps that stand still before the first one."""
        shape = (len(self._steps), 2 * BESIDE)
        self._steps, self._errors = np.zeros(shape), np.zeros(shape)
        self._dt = np.full(shape[1], self.period)
        self._step_places = np.repeat([[t], [s], [s]], shape[1], axis=1)

    def _differences(
        self, steps: Array, errors: Array, dt: Array, places: Array, feeds: Array | None, tick: int
    ) -> None:
        """Feed, acceleration and jerk of path and axes over new steps (1 + axes, n) that took dt (n,), s.

        errors (1 + axes, n): the rounding of the steps; feeds (n,): the limit of the feed over each, mm/s, if it
        changes; `tick` is where the first one ends. places (3, n) are t and s at the start of each step and s at its
        end; what spans several is placed in the middle.

        Divided differences times k!: v = step / dt, a = 2 (v2 - v1) / (dt1 + dt2), j = 3 (a2 - a1) / (dt1 + dt2 + dt3),
        and their rounding by the same formulas, with the sum in place of the difference.
        """
        n = steps.shape[1]
        steps, errors = np.concatenate([self._steps, steps], axis=1), np.concatenate([self._errors, errors], axis=1)
        dt = np.concatenate([self._dt, dt])
        places = np.concatenate([self._step_places, places], axis=1)
        last = slice(-n - 2, None)
        self._check_steps(steps[0, last], errors[0, last], places[0, last], places[1, last], n, tick)
        two, three = 0.5 * (dt[1:] + dt[:-1]), (dt[2:] + dt[1:-1] + dt[:-2]) / 3.0
        with np.errstate(invalid="ignore"):
            v, v_floor = steps / dt, errors / dt
            a, a_floor = np.diff(v, axis=1) / two, (v_floor[:, 1:] + v_floor[:, :-1]) / two
            j, j_floor = np.diff(a, axis=1) / three, (a_floor[:, 1:] + a_floor[:, :-1]) / three
        rounded = v_floor, a_floor, j_floor
        values, floors = ([each[:, max(each.shape[1] - n, 0) :] for each in kind] for kind in ((v, a, j), rounded))
        growing, falling = self._signs(a[0], values[2].shape[1])
        signed = jerks(values[2][0], growing, falling, self.bounds.limits)
        signed |= {"acceleration": a[0], "deceleration": -a[0]}
        corners = self.bounds.corners.s
        if len(corners):
            self._corner_steps(v, v_floor, places, max(v.shape[1] - n - BESIDE, 1), v.shape[1] - BESIDE)
        for name, worst in self.worst.items():
            order, column = worst.order, worst.column
            if order == 0 or name == "centripetal" or name.startswith(STEP):
                continue
            floor = floors[order - 1][column]
            each = signed[name][-len(floor) :] if name in signed else np.abs(values[order - 1][column])
            count, end = len(each), places.shape[1]
            t, s, until = places[:, end - count :]
            if len(corners) and column and order > 1 and count:  # what straddles a corner is that corner's step
                each = np.where(
                    contain(corners, places[1, end - count - order + 1 : end - order + 1], until), np.nan, each
                )
            worst.see(each, t, s, floor, feeds if name == "feed" else None)
        kept = slice(-2 * BESIDE, None)
        self._steps, self._errors, self._dt = steps[:, kept], errors[:, kept], dt[kept]
        self._step_places = places[:, kept]

    def _corner_steps(self, v: Array, floors: Array, places: Array, first: int, stop: int) -> None:
        """Jump of each axis' velocity at the corners within steps `first` to `stop`; the rest as in `_differences`."""
        corners, limits, axes = self.bounds.corners, self.bounds.limits, self.bounds.axes
        t, begin, end = places
        low, high = (np.searchsorted(corners.s, each[first:stop], side="right") for each in (begin, end))
        count = np.where(np.isfinite(end[first:stop]), np.maximum(high - low, 0), 0)
        step = np.repeat(np.arange(len(count)), count)
        if not len(step):
            return
        k = low[step] + np.arange(len(step)) - (np.cumsum(count) - count)[step]
        i = first + step
        s, floor = corners.s[k], floors[0, i]
        feed = corners.least_feeds(k, v[0], i, s - begin[i], floor, self.period, limits, axes)
        for name, worst in self.worst.items():
            if name.startswith(STEP):
                jump = corners.jumps[k, worst.column - 1]
                worst.see(feed * jump, t[i], s, floor * jump)

    @staticmethod
    def _signs(a: Array, n: int) -> tuple[BoolArray, BoolArray]:
        """Where the feed grows, and where it falls, throughout the last n third differences, (n,)."""
        if n == 0:
            return np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
        one, two = a[-n - 1 : -1], a[-n:]
        with np.errstate(invalid="ignore"):
            bend = np.abs(two - one)
            return np.minimum(one, two) > bend, np.maximum(one, two) < -bend

    def _check_steps(self, d: Array, floor: Array, t: Array, s: Array, n: int, tick: int) -> None:
        """Progress: no step back, none skipped, none repeated.

        d (m + n,) and its rounding with t and s at the starts; the last n are new, the first of these ends at `tick`.
        """
        tick -= len(d) - n
        with np.errstate(invalid="ignore"):
            new = np.arange(len(d)) >= len(d) - n
            self._fault("back", new & (d < -floor), -d, t, s, tick=tick)
            before, here, after = d[:-2], d[1:-1], d[2:]
            near, floor = np.maximum(before, after), floor[1:-1]
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
        assert self._place is not None
        s = float(self._place.s[0])
        place = np.array([self._t, s, s])
        T = self.period
        crept = abs(self.duration - (self.ticks - 2) * T - last_dt)
        if "period" not in self.faults and crept > CREEP * T + CREEP_SHARE * self.ticks * T:
            self.faults["period"] = Fault(1, crept, self.ticks - 1, self._t, s)
        feed = self.bounds.limits.end_feed
        if feed == 0.0:
            if self.short is None and self._torques.shape[2]:
                last = np.repeat(self._torques[:, :, -1:], 2, axis=2)
                self._see_torques(last[0], last[1], np.repeat(self._t, 2), np.repeat(s, 2))
            still = np.zeros((len(self._steps), 3))
            feeds = None if self.bounds.path.feeds is None else np.full(3, np.inf)
            self._differences(still, still, np.full(3, T), np.repeat(place[:, None], 3, axis=1), feeds, self.ticks)
        elif self._steps.shape[1]:
            v, floor = self._steps / self._dt, self._errors / self._dt
            count = v.shape[1]
            self._corner_steps(v, floor, self._step_places, max(count - BESIDE, 1), count - 1)
            self._edge(self._steps[0, -1], self._errors[0, -1], last_dt, feed, -1.0, place)

    def _edge(self, step: float, error: float, dt: float, feed: float, sign: float, place: Array) -> None:
        """Acceleration from (sign 1) or to the feed at an end, the mean over one step weighted towards it, mm/s^2."""
        a = 2.0 * sign * (step / dt - feed) / dt
        for name, value in (("acceleration", a), ("deceleration", -a)):
            if name in self.worst:
                self.worst[name].see(np.array([value]), place[:1], place[1:2], np.array([2.0 * error / (dt * dt)]))

    @property
    def duration(self) -> float:
        """From the first setpoint to the last, s, by their own times."""
        return self._t - self._start

    def results(self) -> dict[str, LimitResult]:
        """Every limit by the setpoints alone."""
        return {name: worst.result(self.bounds.axes) for name, worst in self.worst.items()}

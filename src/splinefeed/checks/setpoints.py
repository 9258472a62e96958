"""The part of the check for setpoints alone: place, order, period, and differences, block by block.

Every number that is measured has its rounding beside it. A setpoint is known to

    along the path   d = eps max(L, |u| |C'(u)|) + eps t v  of arc lengths, up to the path's, of the parameter, and
                                                            of its time t at the feed v
    on an axis       |dx/ds| d + eps X + resolution / 2     X the numbers that its position is made of

and what differences make of that, through their own stencil, is the floor of each of them: there is no other allowance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from splinefeed.checks import between
from splinefeed.checks.bounds import BESIDE, STEP, Bounds, Fault, contain, neighbours, resting
from splinefeed.checks.by_tick import ByTick
from splinefeed.checks.differences import ON_TIME, divided
from splinefeed.checks.law import motion_at
from splinefeed.checks.place import Located, Placer
from splinefeed.checks.spans import EPSILON, SpanPlaces
from splinefeed.checks.tool import axes_check
from splinefeed.errors import InputError
from splinefeed.limit_table import KINDS, PLACES
from splinefeed.records import Array, BoolArray, IntArray, Setpoints, State, TimeLaw, unit_along
from splinefeed.records.arrays import expanded

#: A setpoint may be this many roundings of the largest coordinate off the curve, in addition to the tolerance.
ROUNDINGS = 64.0
#: All ticks together, first to last, may be early or late by less than these many periods and this share of the whole.
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

#: Ticks before a block that its differences, and the steps around a corner, may use.
TAIL = 2 * BESIDE + 1


@dataclass(frozen=True, eq=False)
class CheckedTicks(Located):
    """Ticks on their path, n of them.

    Parameters
    ----------
    t, dt : (n,) array
        Time, s, and that of the step that ends there.
    still : (n,) array of bool
        Whether they only continue the stand before the first or behind the last one.
    values : (axes, n) array
        Positions of the axes.
    """

    t: Array
    dt: Array
    still: BoolArray
    values: Array

    def stand(self, period: float) -> CheckedTicks:
        """The last one again and again, TAIL times."""
        at = np.full(TAIL, len(self.t) - 1)
        columns = {each.name: getattr(self, each.name)[..., at] for each in fields(self)}
        return CheckedTicks(**{**columns, "still": np.ones(TAIL, dtype=bool), "dt": np.full(TAIL, period)})


class Judge:
    """Measures all setpoints of one motion once, in order, and keeps the worst values.

    Columns of steps and of all that comes of them: 0 the tip, 1 + k axis k, then combinations of axes. The path may
    change under way, to one that lacks parts that are behind: see `move_on`.
    """

    def __init__(
        self,
        bounds: Bounds,
        first: Setpoints,
        law: TimeLaw | None,
        start: State | None = None,
        by_tick: ByTick | None = None,
    ) -> None:
        self.law, self.period, self.by_tick = law, first.period, by_tick
        self.begins, self.start = start, start or State(feed=bounds.limits.start_feed)
        self._of_tip_at_start = start is None or not bounds.rows.mixed  # whether its feed is the tip's
        if bounds.track is not None and np.isnan(first.u).any():
            raise InputError(
                "the setpoints have no u; axes that do not carry the tip can be checked only where u says their place"
            )
        self.placed = not bool(np.isnan(first.u).all())  # else only positions are there, as from another program
        self.worst = bounds.worsts()
        self.faults: dict[str, Fault] = {}
        self.ticks = 0
        self.short: float | None = None
        self._start = self.start_error = self.end_error = 0.0
        self.drift = self.ripple = self.off_path = 0.0
        self.scale = self.allowed = 0.0
        self.gone = self._seen = 0.0  # arc length of the tip before the path, mm, and up to where the motion is known
        self.alone: list[float] = []  # where the curves begin on which rotary axes move alone, mm
        self._know(bounds)
        axes = len(first.axes)
        if by_tick is not None:  # travel bounds where the path lies, not how fast it is driven
            by_tick.begin(tuple(name for name in self.worst if not name.startswith("travel.")), axes, TAIL)
        self.least, self.greatest = np.full(axes, np.inf), np.full(axes, -np.inf)  # positions so far
        self.own = None if bounds.track is None else axes_check(bounds.track, self.rows, self._placer)
        self._tail: CheckedTicks | None = None  # the last ticks
        top = 0.0 if law is None else float(np.max(motion_at(law, np.linspace(0.0, law.breaks[-1], 2048), 1)))
        self._ripple_from = RIPPLE_SHARE * top * self.period

    def _know(self, bounds: Bounds) -> None:
        path, self.bounds, self.rows = bounds.path, bounds, bounds.rows
        size = float(np.max(self.rows.sizes[: path.linear], initial=0.0))
        rounded = 0.5 * bounds.resolution * np.sqrt(path.linear)
        off = bounds.tolerance + ROUNDINGS * EPSILON * max(size, bounds.rows.length) + float(rounded)
        self.allowed, self.scale = max(self.allowed, off), max(self.scale, bounds.rows.length)
        self._placer = Placer(path, self.rows)
        places = bounds.alone + self.gone
        self.alone += places[places >= self._seen].tolist()
        self._seen = self.gone + bounds.rows.tip.length

    @property
    def curve(self) -> int:
        """The first curve that is not behind the last ticks."""
        assert self._tail is not None
        return int(np.searchsorted(self.rows.curves[:, 0], min(self._tail.row), side="right")) - 1

    def move_on(self, bounds: Bounds, left: int) -> None:
        """Go on with a path that lacks the first `left` curves and goes on further."""
        assert self._tail is not None
        rows, start, tail = self.rows, self._placer, self._tail
        gone = float(rows.curve_starts[left])
        self.gone += float(rows.tip.curve_starts[left])
        self._know(bounds)
        self._placer.go_on(start, gone)
        # a curve may have other spans than before: how finely it is parted hangs on the length of the path
        row, ahead = self.rows.place(rows.curve[tail.row] - left, tail.u)
        self._tail = replace(tail, row=row, s=self.rows.start[row] + ahead, ahead=ahead)

    def see(self, setpoints: Setpoints, last: bool) -> None:
        """The next setpoints; `last` says that they are the last one, alone."""
        self._check_finite(setpoints)
        self.least = np.minimum(self.least, setpoints.position.min(axis=0, initial=np.inf))
        self.greatest = np.maximum(self.greatest, setpoints.position.max(axis=0, initial=-np.inf))
        place, values = self._locate(setpoints)
        t, limits = setpoints.t, self.bounds.limits
        dt, still = self._check_times(t, place.s, last), np.zeros(len(t), dtype=bool)
        new = CheckedTicks(**vars(place), t=t, dt=dt, still=still, values=values)
        if not self.ticks:
            self._start = float(t[0])
            self._check_end("start", new)
            if self.start.feed == 0.0:  # what came before is a stand
                self._tail = new.part(0, 1).stand(self.period)
        self._measure(new, last)
        if last:
            self._check_end("end", new)
            crept = np.abs(self.duration - (self.ticks - 2) * self.period - dt[-1:])
            if "period" not in self.faults:
                wrong = crept > CREEP * self.period + CREEP_SHARE * self.ticks * self.period
                self._fault("period", wrong, crept, t[-1:], new.s[-1:], tick=self.ticks - 1)
            if limits.end_feed == 0.0:
                self._measure(new.stand(self.period), last)
        if self.by_tick is not None:
            self.by_tick.final = self.ticks if last else self.ticks - TAIL

    def _measure(self, new: CheckedTicks, last: bool) -> None:
        bounds = self.bounds
        known = new if self._tail is None else self._tail.joined(new)
        count = len(known.t)
        n = min(len(new.t), count - 1)  # steps that end at new ticks; before a start in motion nothing is known
        first = self.ticks + len(new.t) - count  # tick that `known` begins with
        if self.by_tick is not None:
            self.by_tick.grow(first + count)
        travelled, tip, most = self.rows.steps(known.row, known.ahead), self.rows.tip, None
        row, ahead = known.row, known.ahead
        if self.rows.mixed:
            row, ahead = tip.place(self.rows.curve[row], known.u)
        of_tip = tip.steps(row, ahead)
        if bounds.path.feeds is not None:
            # over several curves the limit of the mean feed is the way through the least time that their feeds allow
            feeds, curve = bounds.feeds[tip.curve[row]], tip.curve[row]
            least = np.diff(ahead / feeds) + np.diff(bounds.row_times[row])
            with np.errstate(divide="ignore", invalid="ignore"):
                most = np.where(least > 0.0, of_tip / least, np.inf)
            most = np.where(curve[1:] == curve[:-1], feeds[1:], most)
        moved = np.diff(known.values, axis=1)
        steps = np.concatenate([of_tip[None], moved, bounds.weights @ moved])
        rounding = self._rounding(known, travelled, moved)
        rounding = np.concatenate([rounding, np.abs(bounds.weights) @ rounding[1:]])
        errors = np.where(known.still[1:] | known.still[:-1], 0.0, rounding[:, :-1] + rounding[:, 1:])
        if self.short is None:
            self._see_models(known, first, rounding, len(new.t))
        if not new.still[0]:
            begin = count - n - 1
            self._chords(known.part(begin, count), first + begin, of_tip[begin:], errors[:, begin:])
            self._follow_law(known, travelled, n)
            for axis, (low, high) in bounds.limits.travel_of(bounds.axes).items():
                k = bounds.axes.index(axis)
                away = np.abs(new.values[k] - 0.5 * (low + high))
                self._see(f"travel.{axis}", away, self.ticks, new.t, new.s, rounding[k + 1, count - len(new.t) :])
        if count > 1:
            near = slice(-n - 2, None)
            self._check_steps(travelled[near], of_tip[near], errors[0, near], known.t[:-1][near], known.s[:-1][near], n)
            if len(bounds.corners.s):
                self._corner_steps(known, first, travelled, errors[0], n, last)
            self._differences(known, first, steps, errors, most, n, last)
        self.ticks += 0 if new.still[0] else len(new.t)
        self._tail = known.part(max(count - TAIL, 0), count)

    def _see(
        self,
        name: str,
        values: Array,
        tick: int | IntArray,
        t: Array,
        s: Array,
        floor: Array,
        limits: Array | None = None,
    ) -> None:
        """Compare a limit, if it is given, with values (n,) at ticks (n,), or from one on; see `Worst.see`."""
        if (worst := self.worst.get(name)) is not None:
            share = worst.see(values, t, s, floor, limits, place=self._place)
            if self.by_tick is not None:
                self.by_tick.see(name, tick, share)

    def _place(self, s: float) -> float:
        """Arc length of the tip from the start of the motion, mm, at a length s of the path, mm."""
        return s if math.isnan(s) else self.gone + self.bounds.place(s)

    # --- single ticks ------------------------------------------------------------------------------------------------

    def _fault(
        self, kind: str, wrong: BoolArray, amount: Array, t: Array, s: Array, detail: str = "", tick: int | None = None
    ) -> None:
        """Remember the ticks that are `wrong` (n,), from `tick` on (default: the next), t and s (n,) beside them."""
        if not np.any(wrong):
            return
        k = int(np.argmax(np.where(wrong, amount, -np.inf)))
        first, old = self.ticks if tick is None else tick, self.faults.get(kind)
        new = Fault(0, float(amount[k]), first + k, float(t[k]), self._place(float(s[k])), detail)
        worst = new if old is None or new.amount > old.amount else old
        self.faults[kind] = replace(worst, count=int(np.count_nonzero(wrong)) + (old.count if old else 0))

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
        begin = t[0] - T if self._tail is None else self._tail.t[-1]
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
        if self.own is not None:
            tip, tilted = self.own.tip(setpoints)
        place = self._placer.locate(tip, self.allowed)
        t, s = setpoints.t, place.s
        self.off_path = max(self.off_path, float(np.fmax.reduce(place.apart, initial=0.0)))
        with np.errstate(invalid="ignore"):
            self._fault("off the curve", place.apart > self.allowed, place.apart, t, s)
            self._fault("turned off", place.turned > self.allowed, place.turned, t, s)
            on_curve = (place.apart <= self.allowed) & (place.turned <= self.allowed)
            self._fault("misplaced", (place.astray > self.allowed) & on_curve, place.astray, t, s)
            if self.own is not None and tilted is not None:
                self._fault(self.own.fault, tilted > self.allowed, tilted, t, s)
        return place, place.position if self.own is None else setpoints.position.T

    def _rounding(self, place: CheckedTicks, travelled: Array, moved: Array) -> Array:
        """How far rounding alone can move ticks along the path and on each axis, (1 + axes, n), mm or rad.

        travelled (n - 1,), moved (axes, n - 1): the steps between them, mm or rad
        """
        rows, path, digit = self.rows, self.bounds.path, 0.5 * self.bounds.resolution
        along = EPSILON * np.maximum(rows.length, rows.parameters[place.row] * place.speed)
        of_axes = EPSILON * rows.sizes[:, place.row] + digit
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(place.speed > 0.0, np.abs(place.velocity) / place.speed, 1.0)
        known = along + digit * np.sqrt(path.linear)
        if not self.placed:  # as good as the positions by which they were placed
            known = known + np.max(EPSILON * rows.sizes[: path.linear or None, place.row], axis=0)
        each = share * along + of_axes if self.own is None else self.own.rounding(place.values, travelled)
        feeds = np.abs(np.concatenate([travelled[None], moved])) / place.dt[1:]
        beside = np.pad(feeds, ((0, 0), (1, 1)))
        late = EPSILON * np.abs(place.t)  # the time of a tick, a product, and where the law's pieces begin, a sum
        with np.errstate(invalid="ignore"):
            out: Array = np.concatenate([known[None], each]) + late * np.fmax(beside[:, 1:], beside[:, :-1])
        return out

    def _check_end(self, kind: str, place: CheckedTicks) -> None:
        """Whether the first or last tick is the path's, by position and, for closed paths, by arc length."""
        path, k = self.bounds.path, 0 if kind == "start" else -1
        end = SpanPlaces(self.rows, np.array([k])).derivatives(np.array([-1.0 if kind == "start" else 1.0]), 0)[0]
        apart = place.position[:, k] - end[:, 0]
        short = abs(float(place.s[k]) - (self.start.s if kind == "start" else self.rows.length))
        if kind == "start" and self.start.s > 0.0:
            apart = np.zeros(len(apart))  # they lie on the curve, or that is a fault of its own
        missing = max(float(np.linalg.norm(apart[: path.linear])), short)
        turned = float(np.max(np.abs(apart[path.linear :]), initial=0.0))
        setattr(self, f"{kind}_error", missing)
        own = float(self.rows.parameters[place.row[k]] * place.speed[k])  # what u rounds by is that much of length
        room = self.allowed + 16.0 * EPSILON * np.fmax(self.scale, own)
        if not (missing <= room and turned <= room):
            also = f" and {np.degrees(turned):.6g} deg" if turned > room else ""
            detail = f"{missing:.6g} {unit_along(path.axes)}{also}"
            at, tick = slice(k, None if k else 1), max(self.ticks - 1, 0)
            self._fault(kind, np.ones(1, bool), np.array([missing]), place.t[at], place.s[at], detail, tick=tick)

    # --- steps -------------------------------------------------------------------------------------------------------

    def _chords(self, ticks: CheckedTicks, first: int, travelled: Array, errors: Array) -> None:
        linear, t, s = self.bounds.path.linear, ticks.t[:-1], ticks.s[:-1]
        if self.own is not None:
            found = self.own.chords(ticks.values, ticks.s)
            for name, (error, rounding) in zip(("chord_error", "orientation_error"), found, strict=True):
                self._see(name, error, first, t, s, np.full(len(error), rounding))
        elif (worst := self.worst.get("chord_error")) is not None:
            error = between.chord_errors(self.rows, ticks.row, ticks.u, ticks.position, worth=worst.result.limit)
            self._see("chord_error", error, first, t, s, 2.0 * np.max(errors[1 : 1 + linear], axis=0, initial=0.0))
        for name in self.bounds.limits.given(PLACES):
            # somewhere within the step the feed was its mean: what the least of the places there makes is a safe bound
            with np.errstate(invalid="ignore", divide="ignore"):
                feed = np.abs(travelled) / ticks.dt[1:]
                least = between.least_values(name, self.rows, ticks.row, ticks.u, feed)
                share = np.where(feed > 0.0, errors[0] / ticks.dt[1:] / feed, 0.0)
                self._see(name, least, first, t, s, KINDS[name].power * share * least)

    def _see_models(self, known: CheckedTicks, first: int, rounding: Array, n: int) -> None:
        """What models give by differences that end at the last n ticks."""
        for model in self.bounds.limits.models:
            span, count = model.span, len(known.t)
            begin = max(count - n - span + 1, 0)
            ticks = known.part(begin, count)
            if len(ticks.t) < span:
                continue
            columns = model.columns(self.bounds.axes)
            rounded = np.max(rounding[1:, -len(ticks.t) :][columns], axis=1)
            position = ticks.values[columns].T
            found, most = model.seen(position, self.period)
            floor, middle = model.rounding(position, self.period, rounded), (span - 1) // 2
            at, tick = slice(middle, middle + len(found)), first + begin + middle
            for k, name in enumerate(model.names()):
                self._see(name, np.abs(found[:, k]), tick, ticks.t[at], ticks.s[at], floor[:, k], most[:, k])

    def _follow_law(self, known: CheckedTicks, travelled: Array, n: int) -> None:
        if self.law is None:
            return
        planned = motion_at(self.law, known.t[-n - 1 :])
        step = np.diff(planned)
        with np.errstate(invalid="ignore", divide="ignore"):
            self.drift = max(self.drift, float(np.fmax.reduce(np.abs(known.s[-n - 1 :] - planned), initial=0.0)))
            ripple = np.abs(travelled[len(travelled) - n :] / step - 1.0)[step > self._ripple_from]
        self.ripple = max(self.ripple, float(np.fmax.reduce(ripple, initial=0.0)))

    def _differences(
        self, known: CheckedTicks, first: int, steps: Array, errors: Array, feeds: Array | None, n: int, last: bool
    ) -> None:
        """Feed, acceleration and jerk of tip and axes over the last n of steps (1 + axes + combinations, m).

        first: tick of the first step; errors: the rounding of the steps; feeds (m,): the limit of the feed over each,
        mm/s, if it changes. What spans several steps is placed at the start of the last one; by ticks it is that of the
        tick in its middle, or before.
        """
        dt, limits, corners = known.dt[1:], self.bounds.limits, self.bounds.corners.s
        t, begin, end = known.t[:-1], known.s[:-1], known.s[1:]
        values, floors = divided(steps, dt), divided(errors, dt, np.add)
        feed, a, _ = (each[0] for each in values)
        with np.errstate(invalid="ignore"):  # where the feed grows, and where it falls, throughout a third difference
            bend = np.abs(np.diff(a))
            jerks = self.bounds.jerks(np.minimum(a[1:], a[:-1]) > bend, np.maximum(a[1:], a[:-1]) < -bend)
        if self.start.feed > 0.0 and not self.ticks and self._of_tip_at_start:
            self._edge(feed[0], floors[0][0, 0], dt[0], self.start.feed, 0, known.t[:1], known.s[:1])
        if limits.end_feed > 0.0 and last:
            self._edge(-feed[-1], floors[0][0, -1], dt[-1], -limits.end_feed, self.ticks, known.t[-1:], known.s[-1:])
        for ahead, (each, floor) in enumerate(zip(values, floors, strict=True)):
            new = slice(max(len(each[0]) - n, 0), len(each[0]))
            at, tick = slice(new.start + ahead, None), first + new.start + ahead - ahead // 2
            if len(corners) and ahead:  # what straddles a corner is that corner's step
                each[1:, new][:, contain(corners, begin[new], end[at])] = np.nan
            if self.by_tick is not None:
                self.by_tick.moved(ahead + 1, tick, each[1 : 1 + len(known.values), new])
            for name, worst in self.worst.items():
                if worst.order != ahead + 1:
                    continue
                value, most = each[worst.column, new], {"feed": feeds, "jerk": jerks}.get(name)
                if name != "acceleration":
                    value = -value if name == "deceleration" else np.abs(value)
                most = None if most is None else most[new]
                self._see(name, value, tick, t[at], begin[at], floor[worst.column, new], most)

    def _corner_steps(
        self, known: CheckedTicks, first: int, travelled: Array, errors: Array, n: int, last: bool
    ) -> None:
        """Jump of each axis' velocity at the corners within steps, of which the last n are new.

        A step counts once the BESIDE steps behind it are known. first: tick of the first step; errors (m,): the
        rounding of the steps.
        """
        corners, dt, begin, end = self.bounds.corners, known.dt[1:], known.s[:-1], known.s[1:]
        open_end = last and self.bounds.limits.end_feed > 0.0  # of what comes then only the feed is known
        start, stop = max(len(dt) - n - BESIDE, 1), len(dt) - (1 if open_end else BESIDE)
        low, high = (np.searchsorted(corners.s, each[start:stop], side="right") for each in (begin, end))
        step, number = expanded(np.where(np.isfinite(end[start:stop]), np.maximum(high - low, 0), 0))
        if not len(step):
            return
        k, i = low[step] + number, start + step
        s, floor = corners.s[k], errors[i] / dt[i]
        with np.errstate(invalid="ignore"):
            feed = self.bounds.corner_feeds(k, travelled / dt, i, s - begin[i], floor, self.period)
        for name, worst in self.worst.items():
            if name.startswith(STEP):
                jump = corners.jumps[k, worst.column - 1]
                self._see(name, feed * jump, first + i, known.t[i], s, floor * jump)

    def _check_steps(self, d: Array, tip: Array, floor: Array, t: Array, s: Array, n: int) -> None:
        """Progress: no step back, none skipped, none repeated.

        d (m + n,), those of the tip, and their rounding, with t and s at the starts; the last n are new.
        """
        tick = self.ticks - (len(d) - n) + (1 if self._tail is None else 0)
        with np.errstate(invalid="ignore"):
            new = np.arange(len(d)) >= len(d) - n
            self._fault("back", new & (d < -floor), -d, t, s, tick=tick)
            before, here, after = d[:-2], d[1:-1], d[2:]
            near, floor = np.maximum(before, after), floor[1:-1]
            most = SKIP_FEED * float(np.max(self.bounds.feeds)) * self.period
            alone = here > SKIP * near + floor
            if np.any(alone):  # from one stop to the next, a whole stretch may take a single period
                if self.law is not None:  # over nanometres a law may well go from next to rest to next to rest in one
                    planned = motion_at(self.law, t[1:-1] + self.period) - motion_at(self.law, t[1:-1])
                    alone &= np.abs(planned - here) > REPEAT * floor
                alone &= ~neighbours(self.bounds.rests, s[1:-1], s[1:-1] + here, self.allowed + floor)
            skipped = (here > REPEAT * floor) & (alone | (tip[1:-1] > most))
            twice = (np.abs(here) <= floor) & (np.minimum(before, after) > REPEAT * floor)
            if np.any(twice):  # where the tool may stand, the same point twice is a wait, such as for the next tick
                twice &= resting(self.bounds.rests, s[1:-1], self.allowed + floor) < 0
        self._fault("skipped", skipped, here, t[1:-1], s[1:-1], tick=tick + 1)
        self._fault("twice", twice, near, t[1:-1], s[1:-1], tick=tick + 1)

    def _edge(self, v: float, floor: float, dt: float, feed: float, tick: int, t: Array, s: Array) -> None:
        """Acceleration from a feed at an end, the mean over one step weighted to it; v and feed < 0 at the last one."""
        a, rounding = np.array([2.0 * (v - feed) / dt]), np.array([2.0 * floor / dt])
        self._see("acceleration", a, tick, t, s, rounding)
        self._see("deceleration", -a, tick, t, s, rounding)

    @property
    def duration(self) -> float:
        """From the first setpoint to the last, s, by their own times."""
        return float(self._tail.t[-1]) - self._start if self._tail is not None else 0.0

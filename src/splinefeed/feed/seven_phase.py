"""The seven-phase feed profile of one stretch, and of a path that rests at its stops."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Protocol, runtime_checkable

import numpy as np

from splinefeed.errors import LimitsError, PlanError
from splinefeed.feed.stretches import SAME_PLACE, least_feeds
from splinefeed.geometry.path import Path
from splinefeed.kernels import profile as kernels
from splinefeed.records import LAW_COEFFICIENTS, Array, Limits, TimeLaw, frozen_array, positive

STRATEGY = "seven-phase"


@runtime_checkable
class Stretched(Protocol):
    """What a planner asks of a path: how long it is, and where the tool must rest because the tangent jumps."""

    @property
    def length(self) -> float:
        """Arc length, mm."""

    @property
    def stops(self) -> tuple[float, ...]:
        """Arc lengths strictly inside (0, length), increasing, mm."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SevenPhase:
    """One profile of seven phases of constant jerk, from start_feed to end_feed over length (eq. 4-22).

    durations      (7,)  T1..T7, s; a phase that does not exist has 0
    length         mm
    peak_feed      feed of phase 4, mm/s: the limit, or the highest that there is room for
    acceleration, deceleration  magnitudes reached, mm/s^2
    jerk, deceleration_jerk     magnitudes used, mm/s^3
    start_feed, end_feed        mm/s
    duration       s
    period         servo period of which the duration is a whole number, s; None if it was not, or could not be, brought
    """

    durations: Array
    length: float
    peak_feed: float
    acceleration: float
    deceleration: float
    jerk: float
    deceleration_jerk: float
    start_feed: float
    end_feed: float
    duration: float
    period: float | None = None

    @classmethod
    def solve(cls, length: float, limits: Limits) -> SevenPhase:
        """Fastest profile over `length` mm under `limits`.

        Raises LimitsError for a length that is not positive; PlanError where the length does not reach from the
        start feed to the end feed, with the least length and the end feeds that would do.
        """
        row = np.zeros(kernels.ROW)
        length = positive(length, "length")
        if kernels.seven_phase.for_work(1)(length, *_kernel_limits(limits), row) != kernels.SOLVED:
            raise _no_room(f"a path of {length:g} mm", length, limits.start_feed, limits.end_feed, limits)
        return cls._from_row(row)

    def to_period(self, period: float) -> SevenPhase:
        """The same profile made to last a whole number of periods (s), or itself where it cannot be.

        From rest to rest by a uniform stretch (v/k, a/k^2, j/k^3), with end feeds by lowering the peak. It cannot
        where the slowest profile, whose peak is the faster of the end feeds, is over before the next tick.
        """
        row = self._row()
        period = positive(period, "period")
        return self._from_row(row, period) if kernels.to_periods.for_work(1)(row, period, 0.0) > 0.0 else self

    def law(self) -> TimeLaw:
        """The profile as a TimeLaw: one cubic piece a phase that has a length, exact."""
        marks = np.array([0.0, self.length])
        return _law(marks, self._row()[np.newaxis], self.period)

    def _row(self) -> Array:
        row = np.zeros(kernels.ROW)
        row[:7] = self.durations
        for place, name in _PLACES.items():
            row[place] = getattr(self, name)
        return row

    @classmethod
    def _from_row(cls, row: Array, period: float | None = None) -> SevenPhase:
        values = {name: float(row[place]) for place, name in _PLACES.items()}
        return cls(durations=frozen_array(row[:7], "durations", 1), period=period, **values)


_PLACES = {
    kernels.LENGTH: "length",
    kernels.PEAK: "peak_feed",
    kernels.ACCELERATION: "acceleration",
    kernels.DECELERATION: "deceleration",
    kernels.JERK: "jerk",
    kernels.DECELERATION_JERK: "deceleration_jerk",
    kernels.START_FEED: "start_feed",
    kernels.END_FEED: "end_feed",
    kernels.DURATION: "duration",
}


def plan_seven_phase(path: Stretched, limits: Limits, period: float | None) -> TimeLaw:
    """One seven-phase profile a stretch between stops, at rest at each stop, each ending on a tick if it can.

    It obeys the tangential limits only: feed (on each stretch the least that the path asks for there), acceleration,
    deceleration and their jerks along the path. It knows nothing of the axes, of curvature or of chord error; `check`
    tells what those see.
    Raises PlanError where the first or last stretch has no room, LimitsError for a period longer than the motion.
    """
    marks = _apart(np.array([0.0, *path.stops, path.length]))
    rows = np.zeros((len(marks) - 1, kernels.ROW))
    along = _kernel_limits(limits)
    feeds = least_feeds(path, limits, marks) if isinstance(path, Path) else np.full(len(rows), along[0])
    failed = kernels.prepare.for_work(len(rows))(marks, feeds, *along[1:], rows)
    if failed < 0:
        rounding = float(np.spacing(rows[:, kernels.DURATION].sum()))
        _, up, down, jerk, deceleration_jerk, start_feed, end_feed = along
        calm = (
            kernels.lasting_jerk.for_work(1)(up, jerk, rounding),
            kernels.lasting_jerk.for_work(1)(down, deceleration_jerk, rounding),
        )
        if calm != (jerk, deceleration_jerk):
            failed = kernels.prepare.for_work(len(rows))(marks, feeds, up, down, *calm, start_feed, end_feed, rows)
    if failed >= 0:
        last = len(rows) - 1
        length = float(marks[failed + 1] - marks[failed])
        what = f"a path of {length:g} mm"
        if last > 0:
            what = f"the stretch from {marks[failed]:g} to {marks[failed + 1]:g} mm"
        start = limits.start_feed if failed == 0 else None
        raise _no_room(what, length, start, limits.end_feed if failed == last else None, limits)
    if period is not None:
        total = float(rows[:, kernels.DURATION].sum())
        if period * (1.0 - kernels.SAME) > total:
            raise LimitsError(
                f"period is {period:g} s, longer than the whole motion of {total:.6g} s; "
                f"choose a period of at most {_outward(total * (1.0 + kernels.ROUNDING), ROUND_FLOOR)} s"
            )
    law = _law(marks, rows, period)
    return replace(law, notes=law.notes + _slowed(path, limits, marks, feeds)) if isinstance(path, Path) else law


def _slowed(path: Path, limits: Limits, marks: Array, feeds: Array) -> tuple[str, ...]:
    """A sentence on the stretches (m,) that run at the least feed of their curves where some of these allow more."""
    most = -least_feeds(path, limits, marks, sign=-1.0)
    slowed = np.flatnonzero(feeds < most)
    if not len(slowed):
        return ()
    k = int(slowed[0])
    return (
        f"{len(slowed)} stretch(es) run at the least feed of their curves throughout, as this strategy makes one "
        f"profile a stretch: the first from {marks[k]:g} to {marks[k + 1]:g} mm at {feeds[k]:g} mm/s",
    )


def _law(marks: Array, rows: Array, period: float | None) -> TimeLaw:
    """The law of solved rows (m, ROW) between marks (m+1,) in mm, brought to ticks where a period in s is given."""
    breaks = np.zeros(7 * len(rows) + 1)
    coefficients = np.zeros((7 * len(rows), LAW_COEFFICIENTS))
    late = np.zeros(len(rows))
    pieces = kernels.lay_out.for_work(len(rows))(
        marks, rows, 0.0 if period is None else period, breaks, coefficients, late
    )
    return TimeLaw(
        breaks=breaks[: pieces + 1],
        coefficients=coefficients[:pieces],
        strategy=STRATEGY,
        period=period,
        notes=() if period is None else _notes(marks, late, period),
    )


def _notes(marks: Array, late: Array, period: float) -> tuple[str, ...]:
    """One sentence for each stretch that does not end on a tick: only the first and the last have end feeds."""
    notes = []
    reason = "its end feeds leave no top feed to lower"
    for index in np.flatnonzero(late):
        if index == len(late) - 1:
            notes.append(f"the last period is short, {late[index]:.6g} s of {period:g} s: {reason}")
        else:
            notes.append(
                f"the stop at {marks[index + 1]:g} mm falls {late[index]:.6g} s after a tick: {reason} before it"
            )
    return tuple(notes)


def _kernel_limits(limits: Limits) -> tuple[float, float, float, float, float, float, float]:
    assert limits.deceleration is not None
    assert limits.deceleration_jerk is not None
    for name in ("feed", "acceleration", "jerk", "deceleration", "deceleration_jerk"):
        if getattr(limits, name) == math.inf:
            raise LimitsError(f"the {STRATEGY} strategy needs a limit on {name}; none is given")
    return (
        limits.feed,
        limits.acceleration,
        limits.deceleration,
        limits.jerk,
        limits.deceleration_jerk,
        limits.start_feed,
        limits.end_feed,
    )


def _no_room(what: str, length: float, start_feed: float | None, end_feed: float | None, limits: Limits) -> PlanError:
    """The error for a stretch that is too short for its change of feed: the length, and each feed, that would do.

    length mm; start_feed, end_feed mm/s, None at a stop, where the tool stops whatever the limits say.
    """
    start, end = start_feed or 0.0, end_feed or 0.0
    _, acceleration, deceleration, jerk, deceleration_jerk, _, _ = _kernel_limits(limits)
    down = start > end
    steepest = (deceleration, deceleration_jerk) if down else (acceleration, jerk)
    slow, fast = min(start, end), max(start, end)
    rise = fast - slow
    least = kernels.ramp_distance.for_work(1)(slow, rise, *steepest) * (
        1.0 - 0.5 * kernels.ROUNDING
    )  # the kernel's own tolerance
    # Raising the slow end: its length grows with the rise, then may fall again (a full stop can be shorter than a
    # brake to a third), but at the full rise it is still too long: so from the first rise that does not fit, none does.
    higher = fast - _largest(lambda x: kernels.ramp_distance.for_work(1)(fast - x, x, *steepest) <= length, rise)
    lower = slow + _largest(lambda x: kernels.ramp_distance.for_work(1)(slow, x, *steepest) <= length, rise)
    at_most = f"of at most {_outward(lower, ROUND_FLOOR, slow)} mm/s"
    at_least = f"of at least {_outward(higher, ROUND_CEILING, fast)} mm/s"
    mends = []
    if start_feed is not None:
        mends.append(f"a start_feed {at_most if down else at_least}")
    if end_feed is not None:
        mends.append(f"an end_feed {at_least if down else at_most}")
    change = "slow down" if down else "speed up"
    return PlanError(
        f"{what} is too short to {change} from {start:g} to {end:g} mm/s: "
        f"that takes at least {_outward(least, ROUND_CEILING)} mm; choose {' or '.join(mends)}"
    )


def _largest(fits: Callable[[float], bool], high: float) -> float:
    """The largest x in [0, high] that fits, where everything below a point fits and nothing above it."""
    low = 0.0
    for _ in range(kernels.STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _outward(value: float, rounding: str, bound: float | None = None) -> str:
    """Six digits, rounded to the side that still holds; more where six would pass `bound`, and at last the bound."""
    for digits in (6, 9, 12):
        rounded = float(Context(prec=digits, rounding=rounding).create_decimal(Decimal(value)))
        if bound is None or (rounded <= bound if rounding == ROUND_CEILING else rounded >= bound):
            return f"{rounded:.{digits}g}"
    return repr(bound)


def _apart(marks: Array) -> Array:
    """The marks (m,), mm, without those that rounding puts beside another; both ends stay."""
    same, inner = SAME_PLACE * marks[-1], marks[1:-1]
    return np.concatenate([marks[:1], inner[(np.diff(marks[:-1]) > same) & (marks[-1] - inner > same)], marks[-1:]])

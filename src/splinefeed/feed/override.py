"""Feed override, hold, resume and reverse: a law run at a rate of its own, within the limits that it was planned under.

The law is planned with a reserve (`with_reserve`), and what is run is q(tau(t)) with a rate dtau/dt, negative
backwards. docs/math/override.md says why no limit is exceeded, whatever is asked for and whenever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import LimitsError
from splinefeed.geometry.path import Path
from splinefeed.kernels import override as kernels
from splinefeed.kernels.override_demand import ask, look_on
from splinefeed.records import Array, Limits, TimeLaw, positive

#: Share of the acceleration and of the jerk that a plan may use, so that the rest can brake it along its own law.
ACCELERATION_SHARE, JERK_SHARE = 0.8, 0.6
#: Ticks of a law looked ahead over: a change of the rate begins only where its end lies within the first; a rate that
#: does not keep the limits everywhere is taken only where the way back from it lies within one of them.
WINDOWS = (128, 256, 512, 1024)
#: Highest rate, where the limits allow it, if nobody says else, and the highest that may be said.
HIGHEST, MOST_RATE = 2.0, 10.0
#: Ticks of the law whose needs are in memory at a time.
BLOCK = 4096
#: What is seen at instants may be so much more between them.
BETWEEN = 1.01
#: A law that is over its limits by less than this is at them.
AT_LIMITS = 1e-6
#: A share below this is as good as none.
LEAST = 1e-12
#: Jumps of q'' within three ticks weigh at most this much each in a third difference, a single one at most 1.
NEAR_JUMPS = 0.75
#: Largest share of acceleration or jerk that a law may use at its highest rate and still be slowed.
MOST = 0.97


def with_reserve(
    limits: Limits, top: float = 1.0, acceleration: float = ACCELERATION_SHARE, jerk: float = JERK_SHARE
) -> Limits:
    """The limits to plan under, so that the plan can be run at rates up to `top` and slowed anywhere.

    V / top,  share_a A / top^2,  share_j J / top^3;  centripetal and chord error / top^2

    acceleration, jerk  the shares. Raises LimitsError for shares that are not in (0, 1) and a top below 1.
    """
    if not 1.0 <= top <= MOST_RATE:
        raise LimitsError(f"the highest override is {top:g}; it must be from 1 to {MOST_RATE:g}")
    for name, share in (("acceleration", acceleration), ("jerk", jerk)):
        if not 0.0 < share < 1.0:
            raise LimitsError(f"the share of {name} for the plan is {share:g}; it must lie between 0 and 1")
    factors = {"velocity": 1.0 / top, "acceleration": acceleration / top**2, "jerk": jerk / top**3}
    names = {
        "feed": "velocity",
        "acceleration": "acceleration",
        "deceleration": "acceleration",
        "jerk": "jerk",
        "deceleration_jerk": "jerk",
        "axis_velocity": "velocity",
        "axis_acceleration": "acceleration",
        "axis_jerk": "jerk",
    }
    changed: dict[str, object] = {}
    for name, kind in names.items():
        changed[name] = _times(getattr(limits, name), factors[kind])
    for name in ("chord_error", "centripetal"):
        changed[name] = _times(getattr(limits, name), top**-2.0)
    return replace(limits, **changed)  # type: ignore[arg-type]


def _times(value: float | Mapping[str, float] | None, factor: float) -> float | dict[str, float] | None:
    if value is None:
        return None
    return {axis: each * factor for axis, each in value.items()} if isinstance(value, Mapping) else value * factor


@dataclass(frozen=True, eq=False)
class Ticks:
    """Ticks that were run: plan time, s, and rate at each, (n,)."""

    tau: Array
    rate: Array

    def __len__(self) -> int:
        return len(self.tau)


class Override:
    """Runs a law at a wanted rate, tick by tick: 1 as planned, 0 hold, negative backwards; never beyond `limits`.

    path, law  what runs; the law rests at both ends      limits  that hold for what is sent, not those of the plan
    period     servo period, s (default: the law's)       rate    to begin with
    tau        plan time to begin at, s: beyond 0 it begins at rest, as after a hold there
    highest    what a wanted rate is cut to, in both directions, from 1 on

    top   highest rate that keeps the limits everywhere. A higher one is run where and while they allow it: what
          programmed feeds of the path (F) ask for is 100 %, `limits.feed` is a limit.
    Raises LimitsError for a law without reserve, corners passed at speed (axis_velocity_step), and without a period.
    """

    def __init__(
        self,
        path: Path,
        law: TimeLaw,
        limits: Limits,
        *,
        period: float | None = None,
        rate: float = 1.0,
        tau: float = 0.0,
        highest: float = HIGHEST,
    ) -> None:
        wanted = law.period if period is None else period
        if wanted is None:
            raise LimitsError("no period: give period= in s, as the law was not brought to one")
        if not 1.0 <= highest <= MOST_RATE:
            raise LimitsError(f"the highest override is {highest:g}; it must be from 1 to {MOST_RATE:g}")
        self.path, self.law, self.limits, self.period = path, law, limits, positive(wanted, "period")
        if limits.axis_velocity_step is not None:
            raise LimitsError(
                "corners passed at speed (axis_velocity_step) cannot be overridden; plan with exact stops"
            )
        if law.feed(0.0) > AT_LIMITS or law.feed(law.duration) > AT_LIMITS:
            raise LimitsError(
                "a law that can be overridden begins and ends at rest; leave start_feed and end_feed at 0"
            )
        axes = path.axes
        along = (
            limits.feed,
            min(limits.acceleration, float(limits.deceleration or math.inf)),
            min(limits.jerk, float(limits.deceleration_jerk or math.inf)),
        )
        orders = ("axis_velocity", "axis_acceleration", "axis_jerk")
        self._limit = np.array([[*limits.of_axes(name, axes), last] for name, last in zip(orders, along, strict=True)])
        self._cells = math.ceil(law.duration / self.period)
        self._windows = np.array(WINDOWS, dtype=np.int64)
        self._first, self._loaded = 0, 0
        self._ahead = np.zeros((len(WINDOWS), 0, 3, len(axes) + 1))
        self._caps = np.zeros((len(WINDOWS), 0))
        bend = self._bend_share()
        self.top = min(self._top(bend), highest)
        self._most = max(min(highest, 1.0 / bend if bend > 0.0 else highest), self.top)
        self._state = np.zeros(kernels.STATE)
        self._state[kernels.DIRECTION] = 1.0
        if not 0.0 <= tau <= law.duration:
            raise LimitsError(f"the plan time to begin at is {tau:g} s; the law lasts {law.duration:g} s")
        self._state[kernels.TAU] = tau
        if tau == 0.0:
            # at rest any rate is as good as another
            self._state[kernels.RATE] = min(max(float(rate), 0.0), self.top)

    def _top(self, bend: float) -> float:
        """The rate at which the law is at its limits; it may be that of plans that are over them by rounding."""
        most = np.zeros_like(self._limit)
        for first in range(0, self._cells, BLOCK):
            most = np.maximum(most, np.max(self._asked(first, min(BLOCK, self._cells - first)), axis=0))
        shares = np.max(most / self._limit, axis=1)
        speed = max(float(shares[0]), bend, LEAST)
        second, third = (max(float(share), LEAST) for share in shares[1:])
        top = min(1.0 / speed, second**-0.5, third ** (-1.0 / 3.0))
        if 1.0 - AT_LIMITS < top < 1.0:
            top = 1.0
        if top < 1.0 or max(second, third) > MOST:
            name = ("velocity", "acceleration", "jerk")[int(np.argmax(shares))]
            raise LimitsError(
                f"the law uses {100.0 * float(np.max(shares)):.3g} % of the {name}, which leaves nothing to slow it "
                "with; plan it under with_reserve(limits)"
            )
        # at the highest rate too something must be left to slow it with
        return float(min(top, (MOST / second) ** 0.5, (MOST / third) ** (1.0 / 3.0)))

    def _bend_share(self) -> float:
        """Share of the limits that hold for the feed on a bend; they grow by the square of the rate."""
        if self.limits.centripetal is None and self.limits.chord_error is None:
            return 0.0
        settings = self.law.settings.get("limits", {})
        shares = [
            math.sqrt(settings.get(name, math.inf) / limit)
            for name in ("centripetal", "chord_error")
            if (limit := getattr(self.limits, name)) is not None
        ]
        if not all(map(math.isfinite, shares)):
            raise LimitsError("the law was not planned under the limits of centripetal acceleration or chord error")
        return max(shares)

    def _asked(self, first: int, count: int) -> Array:
        """What the law asks for in ticks first ... first + count - 1, (count, 3, columns); 0 beyond its ends."""
        columns = len(self.path.axes) + 1
        cells, jumps = np.empty((count + 2, 3, columns)), np.empty((count + 2, columns))
        given = (self.law.breaks, self.law.coefficients, self.path.table, self.path.shape)
        ask(*given, self.period, first - 1, cells, jumps)
        # to the drive a jump of q'' is jerk over the period
        beside = NEAR_JUMPS * (jumps[:-2] + jumps[1:-1] + jumps[2:])
        cells[1:-1, 2] += np.maximum(jumps[1:-1], beside) / self.period
        return cells[1:-1]

    @property
    def tau(self) -> float:
        """Plan time reached, s."""
        return float(self._state[kernels.TAU])

    @property
    def rate(self) -> float:
        """Rate now, negative backwards."""
        return float(self._state[kernels.RATE] * self._state[kernels.DIRECTION])

    @property
    def held(self) -> bool:
        """Whether the axes are at rest because the rate is 0."""
        return self.rate == 0.0 and float(self._state[kernels.SLOPE]) == 0.0

    @property
    def done(self) -> bool:
        """Whether the end of the law is reached."""
        return self.tau >= self.law.duration

    def run(self, wanted: ArrayLike) -> Ticks:
        """Run as many ticks as wanted (n,) has rates, fewer where the law ends; the last one is the end exactly.

        Backwards it comes to rest at the start, and stays there until a wanted rate is positive.
        """
        targets = np.ascontiguousarray(np.nan_to_num(np.asarray(wanted, dtype=np.float64), nan=0.0))
        tau, rate = np.empty(len(targets)), np.empty(len(targets))
        ran = 0
        while ran < len(targets) and not self.done:
            state = self._state
            if self.held and targets[ran] * state[kernels.DIRECTION] < 0.0 and state[kernels.STILL] != 1.0:
                state[kernels.DIRECTION] *= -1.0
            self._load(int(self.tau / self.period), int(state[kernels.DIRECTION]))
            ran += kernels.run_rate(
                targets[ran:],
                self._ahead,
                self._caps,
                self._limit,
                self._first,
                self._windows,
                self.period,
                self.top,
                self.law.duration,
                state,
                tau[ran:],
                rate[ran:],
            )
        return Ticks(tau[:ran], rate[:ran])

    def _load(self, cell: int, direction: int) -> None:
        """Have what is asked for from tick `cell` on, in that direction, in memory."""
        if direction == self._loaded and 0 <= direction * (cell - self._first) < self._ahead.shape[1]:
            return
        longest = WINDOWS[-1]
        count = max(min(BLOCK, self._cells - cell if direction > 0 else cell + 1), 1)
        cells = self._asked(cell if direction > 0 else cell + 1 - count - longest, count + longest)
        cells = BETWEEN * np.ascontiguousarray(cells[::direction])
        self._first, self._loaded = cell, direction
        self._ahead = np.empty((len(WINDOWS), count, *cells.shape[1:]))
        for window, out in zip(WINDOWS, self._ahead, strict=True):
            look_on(cells[: count + window], window, out)
        self._caps = np.full(self._ahead.shape[:2], self.top)
        if self._most > self.top:
            left = self.period * (self._windows.astype(np.float64) - 1.0)
            kernels.cap_rates(self._ahead, self.top, self._most, left, self._limit, self.period, self._caps)

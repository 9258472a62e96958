"""Feed override, hold, resume and reverse: a law run at a rate of its own, within the limits that it was planned under.

The law is planned with a reserve (`with_reserve`), and what is run is q(tau(t)) with a rate dtau/dt, negative
backwards. docs/math/override.md says why no limit is exceeded, whatever the override and whenever it changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d

from splinefeed.errors import LimitsError
from splinefeed.kernels import override as kernels
from splinefeed.planner.override.reserve import ACCELERATION_SHARE, JERK_SHARE, MOST_RATE
from splinefeed.planner.override.source import AT_LIMITS, HIGHEST, LawSource, MotionSource
from splinefeed.records import TABLE, Array, Limits, State

#: Ticks of a law looked ahead over, each twice as many as the one before: a change of the rate begins only where its
#: end lies within the first; a rate that does not keep the limits everywhere is taken only where the way back from it
#: lies within one of them.
WINDOWS = (128, 256, 512, 1024)
#: Ticks of the law whose needs are in memory at a time.
BLOCK = 4096
#: What is seen at instants may be so much more between them.
BETWEEN = 1.01
#: A share below this is as good as none.
LEAST = 1e-12
#: Rates below 1 at which the jerk of a law with jumps is looked at.
BELOW_1 = np.linspace(0.0, 1.0, 1001)
#: Largest share of acceleration or jerk that a law may use at its highest rate and still be slowed.
MOST = 0.97


@dataclass(frozen=True, eq=False)
class OverrideTicks:
    """Ticks that were run.

    Parameters
    ----------
    tau : (n,) array
        Plan time at each, s.
    rate : (n,) array
        Rate at each.

    References
    ----------
    .. [1] docs/math/override.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> slow = sf.plan(path, sf.planner.with_reserve(limits), period=1e-3)
    >>> sf.planner.Override(sf.planner.LawSource(path, slow), limits).run([1.0, 1.0]).rate
    array([1., 1.])
    """

    tau: Array
    rate: Array

    def __len__(self) -> int:
        return len(self.tau)


class Override:
    """Run a law at a wanted rate, tick by tick: 1 as planned, 0 hold, negative backwards; never beyond limits.

    Parameters
    ----------
    source : MotionSource
        What runs, such as a `LawSource`; it rests at its end.
    limits : Limits
        That hold for what is sent, not those of the plan.
    rate : float, optional
        To begin with.
    tau : float, optional
        Plan time to begin at, s: beyond 0 it begins at rest, as after a hold there.
    highest : float, optional
        What a wanted rate is cut to, in both directions.

    Attributes
    ----------
    top : float
        Highest rate that keeps the limits everywhere. A higher one is run where and while they allow it: what
        programmed feeds of the path (F) ask for is 100 %, `limits.feed` is a limit.

    Raises
    ------
    LimitsError
        For a source without reserve, for corners passed at speed (axis_velocity_step), and for limits that models give
        but torques.

    Notes
    -----
    A law that was planned again from `state` begins there, at its rate 1; it is run backwards if it was planned with
    `back`, to the start of the path.

    Torques are kept, too, of a `LawSource`: M q' dr/dt and r^2 of what motion takes, at ticks and between them.

    References
    ----------
    .. [1] docs/math/override.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> slow = sf.plan(path, sf.planner.with_reserve(limits), period=1e-3)
    >>> override = sf.planner.Override(sf.planner.LawSource(path, slow), limits)
    >>> ticks = override.run([0.5] * 1000)
    >>> print(f"rate {ticks.rate[-1]:.2f}, plan time {override.tau:.1f} s after 1 s")
    rate 0.50, plan time 0.5 s after 1 s
    """

    def __init__(
        self,
        source: MotionSource,
        limits: Limits,
        *,
        rate: float = 1.0,
        tau: float = 0.0,
        highest: float = HIGHEST,
    ) -> None:
        if not 0.0 < highest <= MOST_RATE:
            raise LimitsError(f"the highest override is {highest:g}; it must be above 0 and at most {MOST_RATE:g}")
        self.source, self.limits, self.period = source, limits, source.period
        beyond = [each.name for each in TABLE if not each.held and getattr(limits, each.name) is not None]
        beyond += [model.kind for model in limits.modelled]
        if limits.torque is not None and not isinstance(source, LawSource):
            beyond.append("torque")
        if beyond:
            raise LimitsError(f"{', '.join(beyond)}: cannot be overridden; plan without, or run the law as planned")
        axes = source.axes
        along = (
            limits.feed,
            min(limits.acceleration, float(limits.deceleration or math.inf)),
            min(limits.jerk, float(limits.deceleration_jerk or math.inf)),
        )
        bounded = limits.axis_bounds(axes)
        self._limit, self._sums = np.column_stack([bounded.bounds, along]), bounded.weights
        if isinstance(source, LawSource):
            source.torque = limits.torque
        if limits.torque is not None:
            joints = len(limits.torque.most)
            own = np.repeat([[math.inf], [1.0], [math.inf]], joints, axis=1)
            self._limit = np.ascontiguousarray(np.concatenate([self._limit, own], axis=1))
        columns = self._limit.shape[1]
        self._cells = math.ceil(source.duration / self.period)
        self._windows = np.array(WINDOWS, dtype=np.int64)
        self._first, self._loaded = 0, 0
        self._looked_at = np.zeros((0, 4, columns))
        self._ahead = np.zeros((len(WINDOWS), 0, 4, columns))
        self._caps = np.zeros((len(WINDOWS), 0))
        bend = source.bend_share(limits)
        self.top = min(self._top(bend, min(highest, 1.0)), highest)
        self._most = max(min(highest, 1.0 / bend if bend > 0.0 else highest), self.top)
        self._state = np.zeros(kernels.STATE)
        self._state[kernels.DIRECTION] = 1.0
        if not 0.0 <= tau <= source.duration:
            raise LimitsError(f"the plan time to begin at is {tau:g} s; the law lasts {source.duration:g} s")
        elsewhere = rate != 1.0 or self.top < 1.0 if tau == 0.0 else source.begin == 0.0
        if source.moving and elsewhere:
            raise LimitsError(f"a law that begins in motion is run from its start at the rate 1; top is {self.top:.4g}")
        if tau == 0.0:
            tau = source.begin
            # at rest any rate is as good as another
            self._state[kernels.RATE] = min(max(float(rate), 0.0), self.top)
        self._state[kernels.TAU] = tau

    def rest_at(self, tau: float) -> None:
        """Come to rest at a plan time at once, whatever was before.

        Parameters
        ----------
        tau : float
            Plan time, s.
        """
        direction = self._state[kernels.DIRECTION]
        self._state[:] = 0.0
        self._state[kernels.TAU], self._state[kernels.DIRECTION] = tau, direction

    def _top(self, bend: float, least: float) -> float:
        """The rate at which the source is at its limits; it may be that of plans that are over them by rounding.

        LimitsError unless the rate `least` leaves something to slow it with.
        """
        most = np.zeros((4, self._limit.shape[1]))
        for first in range(0, self._cells, BLOCK):
            cells = self.source.demands(first, min(BLOCK, self._cells - first), self._sums)
            most = np.maximum(most, np.max(cells, axis=0))
        shares = np.max(most / self._limit[[0, 1, 2, 2]], axis=1)
        speed = max(float(shares[0]), bend, LEAST)
        second, third, jumps = (max(float(share), LEAST) for share in shares[1:])

        def fastest(acceleration: float, jerk: float) -> float:
            """The highest rate at which it takes these shares of the limits."""
            if third <= jerk:
                return float(min((acceleration / second) ** 0.5, (jerk / third) ** (1.0 / 3.0)))
            takes = [kernels.own_jerk(rate, third, jumps) for rate in BELOW_1]
            return float(min((acceleration / second) ** 0.5, np.interp(jerk, takes, BELOW_1)))

        top = min(1.0 / speed, fastest(1.0, 1.0))
        if (1.0 - AT_LIMITS) * least < top < least:
            top = least
        if top < least or max(second * least**2, kernels.own_jerk(least, third, jumps)) > MOST:
            name = ("velocity", "acceleration", "jerk")[int(np.argmax(shares[:3]))]
            slower = min(fastest(ACCELERATION_SHARE, JERK_SHARE), 1.0 / speed)
            raise LimitsError(
                f"the law uses {100.0 * float(np.max(shares[:3])):.3g} % of the {name}, which leaves no reserve to "
                f"slow down; plan it under with_reserve(limits), or run it at {math.floor(100.0 * slower)} % at "
                "most"
            )
        # at the highest rate too something must be left to slow it with
        return min(top, fastest(MOST, MOST))

    @property
    def tau(self) -> float:
        """Plan time reached, s."""
        return float(self._state[kernels.TAU])

    @property
    def rate(self) -> float:
        """Rate now, negative backwards."""
        return float(self._state[kernels.RATE] * self._state[kernels.DIRECTION])

    @property
    def state(self) -> State:
        """Where on its path the motion is, and how it moves: `sf.plan(path, limits, start=override.state)` goes on.

        Raises
        ------
        LimitsError
            While it runs backwards, and for setpoints without their path.
        """
        if not isinstance(self.source, LawSource):
            raise LimitsError("state: setpoints without their path have none; run a law along a path")
        law, tau, rate, slope = self.source.law, self.tau, self.rate, float(self._state[kernels.SLOPE])
        if rate < 0.0:
            raise LimitsError("state: the motion runs backwards; hold it first")
        feed = float(law.feed(tau)) * rate
        acceleration = float(law.acceleration(tau)) * rate**2 + float(law.feed(tau)) * slope
        return State(feed, acceleration if feed > 0.0 else 0.0, float(law(tau)))

    @property
    def held(self) -> bool:
        """Whether the axes are at rest because the rate is 0."""
        return self.rate == 0.0 and float(self._state[kernels.SLOPE]) == 0.0

    @property
    def done(self) -> bool:
        """Whether the end of the law is reached."""
        return self.tau >= self.source.duration

    def run(self, wanted: ArrayLike) -> OverrideTicks:
        """Run ticks at wanted rates; backwards it comes to rest at the start, until a wanted rate is positive.

        Parameters
        ----------
        wanted : array_like
            The rate that is wanted at each of the next ticks, (n,).

        Returns
        -------
        OverrideTicks
            As many, fewer where the law ends; the last one is the end exactly.
        """
        targets = np.array(wanted, dtype=np.float64, order="C")
        targets[np.isnan(targets)] = 0.0
        if self.source.moving and self.source.begin == 0.0:
            targets = np.maximum(targets, 0.0)
        tau, rate = np.empty(len(targets)), np.empty(len(targets))
        ran = 0
        while ran < len(targets) and not self.done:
            state = self._state
            if self.held and targets[ran] * state[kernels.DIRECTION] < 0.0 and state[kernels.STILL] != 1.0:
                state[kernels.DIRECTION] *= -1.0
            ran += self._run(targets[ran:], tau[ran:], rate[ran:])
        return OverrideTicks(tau[:ran], rate[:ran])

    def prepare(self) -> None:
        """Have everything at hand that the next ticks need, compiled kernels too: where time counts, before it does."""
        self._run(np.zeros(0), np.zeros(0), np.zeros(0))

    def _run(self, targets: Array, tau: Array, rate: Array) -> int:
        self._load(int(self.tau / self.period), int(self._state[kernels.DIRECTION]))
        return kernels.run_rate(
            targets,
            self._ahead,
            self._caps,
            self._limit,
            self._first,
            self._windows,
            self.period,
            self.top,
            self.source.duration,
            self._state,
            tau,
            rate,
        )

    def _load(self, cell: int, direction: int) -> None:
        """Have the demands from tick `cell` on, in that direction, in memory."""
        passed = direction * (cell - self._first) if direction == self._loaded else -1
        if 0 <= passed < self._ahead.shape[1]:
            return
        count = max(min(BLOCK, self._cells - cell if direction > 0 else cell + 1), 1)
        known = self._looked_at[passed:] if passed >= 0 else self._looked_at[:0]
        more = count + WINDOWS[-1] - len(known)
        begin = cell + len(known) if direction > 0 else cell + 1 - len(known) - more
        cells = self.source.demands(begin, more, self._sums)
        cells = np.concatenate([known, BETWEEN * cells[::direction]])
        self._first, self._loaded, self._looked_at = cell, direction, cells
        self._ahead = np.empty((len(WINDOWS), count, *cells.shape[1:]))
        most = maximum_filter1d(cells, WINDOWS[0], axis=0, origin=-(WINDOWS[0] // 2))
        for level, window in enumerate(WINDOWS):
            self._ahead[level] = most[:count]
            most = np.maximum(most[:-window], most[window:])
        self._caps = np.full(self._ahead.shape[:2], self.top)
        if self._most > self.top:
            left = self.period * (self._windows.astype(np.float64) - 1.0)
            kernels.cap_rates(self._ahead, self.top, self._most, left, self._limit, self.period, self._caps)

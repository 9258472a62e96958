"""The seven-phase profile of one stretch as a record of floats: what tests of the formulas look at."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from splinefeed.planner import profiles, seven_phase
from splinefeed.planner.profiles import Profile, each_field
from splinefeed.records import Limits, TimeLaw, frozen_array, positive


@dataclass(frozen=True, eq=False)
class SevenPhase(Profile):
    """The profile of one stretch, by the functions that plan many at once.

    period  servo period of which the duration is a whole number, s; None if it was not, or could not be, brought
    """

    period: float | None = None

    @classmethod
    def solve(cls, length: float, limits: Limits) -> SevenPhase:
        """Fastest profile over `length` mm under `limits`.

        Raises LimitsError for a length that is not positive; PlanError where the length does not reach from the
        start feed to the end feed, with the least length and the end feeds that would do.
        """
        length = positive(length, "length")
        found = profiles.solve(np.array([length]), *seven_phase._along(limits))
        if np.isnan(found.duration[0]):
            raise seven_phase._no_room(f"a path of {length:g} mm", length, limits.start_feed, limits.end_feed, limits)
        return cls._of(found)

    def to_period(self, period: float) -> SevenPhase:
        """The same profile made to last a whole number of periods (s), or itself where it cannot be.

        From rest to rest by a uniform stretch (v/k, a/k^2, j/k^3), with end feeds by lowering the peak. It cannot
        where the slowest profile, whose peak is the faster of the end feeds, is over before the next tick.
        """
        period = positive(period, "period")
        slower, _, late = profiles.to_periods(self._as_one_of_many(), period, 0.0)
        return self if late[0] > 0.0 else self._of(slower, period)

    def law(self) -> TimeLaw:
        """The profile as a TimeLaw: one cubic piece a phase that has a length, exact."""
        return seven_phase._law(np.array([0.0, self.length]), self._as_one_of_many(), self.period)

    def _as_one_of_many(self) -> Profile:
        return Profile(*each_field(lambda value: np.asarray(value)[..., np.newaxis], self))

    @classmethod
    def _of(cls, found: Profile, period: float | None = None) -> SevenPhase:
        times, *numbers = each_field(lambda each: each[..., 0].tolist(), found)
        return replace(cls(frozen_array(times, "durations", 1), *numbers), period=period)

"""The seven-phase profile of one stretch as a record of floats: what tests of the formulas look at."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from splinefeed.paths.path import Path
from splinefeed.planner import profiles, seven_phase
from splinefeed.planner.profiles import Profile
from splinefeed.records import Limits, TimeLaw, frozen_array, positive


@dataclass(frozen=True, eq=False)
class SevenPhase(Profile):
    """The profile of one stretch, by the functions that plan many at once."""

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
        times, *numbers = (getattr(found, each.name)[..., 0].tolist() for each in fields(Profile))
        return cls(frozen_array(times, "durations", 1), *numbers)


def law_of(length: float, limits: Limits, period: float | None = None) -> TimeLaw:
    """The law of a straight line."""
    return seven_phase.plan_seven_phase(Path.polyline([[0.0], [length]]), limits, period)

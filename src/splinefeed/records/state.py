"""State: how a motion moves at a place of its path."""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.errors import InputError


@dataclass(frozen=True)
class State:
    """How a motion moves at a place of its path.

    feed, acceleration  along the path, mm/s and mm/s^2, over all axes as `Path.length` counts them
    s                   length from the start of the path, mm

    Raises InputError for values that are not finite, s or feed below 0, and an acceleration at rest.
    Source: docs/math/planner.md.
    Example: `sf.plan(path, limits, strategy="time-optimal", start=sf.planner.State(feed=20.0))`
    """

    feed: float = 0.0
    acceleration: float = 0.0
    s: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.acceleration) or not (0.0 <= self.feed < math.inf and 0.0 <= self.s < math.inf):
            raise InputError(f"{self}: feed and s must be finite and not negative, the acceleration finite")
        if self.feed == 0.0 != self.acceleration:
            raise InputError(f"{self}: at rest the acceleration is 0")

    def __str__(self) -> str:
        return f"a state of {self.feed:.6g} mm/s and {self.acceleration:.6g} mm/s^2 at s = {self.s:.6g} mm"

    def slower(self, share: float) -> State:
        """The state there of the same motion made slower: feed by the share, acceleration by its square."""
        return State(self.feed * share, self.acceleration * share**2, self.s)


#: At rest where a path begins.
REST = State()

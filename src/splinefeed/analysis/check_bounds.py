"""What setpoints are held to in a check, and what is remembered of the worst of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.records import AXIS_LIMITS, KEPT, Array, Limits


@dataclass
class Worst:
    """The worst of one limit so far; order of its difference, and column of the steps: 0 the path, 1 + k axis k."""

    limit: float
    order: int
    column: int
    value: float = 0.0
    t: float = 0.0
    s: float = 0.0
    over: int = 0

    def see(self, values: Array, t: Array, s: Array, floor: float) -> int | None:
        """Take note of values (n,) at times t and arc lengths s (n,), NaN being nothing; the index of a new worst."""
        if not len(values):
            return None
        known = np.where(np.isnan(values), -np.inf, values)
        self.over += int(np.count_nonzero(known > self.limit * (1.0 + KEPT) + floor))
        k = int(np.argmax(known))
        if not known[k] > self.value:
            return None
        self.value, self.t, self.s = float(known[k]), float(t[k]), float(s[k])
        return k


@dataclass
class Fault:
    """All that is wrong in one way: how many ticks, the worst amount, and where that is."""

    count: int
    amount: float
    tick: int
    t: float
    s: float
    detail: str = ""


@dataclass(frozen=True)
class Bounds:
    """What setpoints are held to; see `check`."""

    path: Path
    limits: Limits
    tolerance: float
    resolution: float

    def worsts(self) -> dict[str, Worst]:
        """One empty Worst a limit that is given, in the order of the report."""
        limits, axes = self.limits, self.path.axes
        along = {
            "feed": (limits.feed, 1),
            "acceleration": (limits.acceleration, 2),
            "deceleration": (limits.deceleration, 2),
            "jerk": (limits.jerk, 3),
            "deceleration_jerk": (limits.deceleration_jerk, 3),
            "chord_error": (limits.chord_error, 0),
            "centripetal": (limits.centripetal, 1),
        }
        found = {n: Worst(v, order, 0) for n, (v, order) in along.items() if v is not None and v < np.inf}
        for order, name in enumerate(AXIS_LIMITS, start=1):
            for k, value in enumerate(limits.of_axes(name, axes)):
                if value < np.inf:
                    found[f"{name}.{axes[k]}"] = Worst(float(value), order, k + 1)
        for axis, (low, high) in limits.travel_of(axes).items():
            found[f"travel.{axis}"] = Worst(0.5 * (high - low), 0, axes.index(axis) + 1)
        return found

    def report_order(self) -> list[str]:
        """Names of the limits as a verdict has them: one for jerk, whichever way the feed goes."""
        return list(dict.fromkeys("jerk" if name == "deceleration_jerk" else name for name in self.worsts()))

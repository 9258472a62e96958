"""The limits of a check, and the worst value of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from splinefeed.analysis.check_corners import Corners, passable
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import AXIS_LIMITS, BOUNDED, KEPT, Array, BoolArray, LimitResult, Limits

#: How far a setpoint may be from the curve, and an end from the path's, mm (rotary axes rad), by default.
TOLERANCE = 1e-9
#: The limit of how much the velocity of an axis may jump at a corner.
STEP = "axis_velocity_step"


@dataclass
class Worst:
    """The worst of one limit so far; order of its difference, and column of the steps.

    Columns: 0 the path, 1 + k axis k, then combinations of axes in their order.

    value, floor  what it is there, and what rounding alone can make of it; over  how many were over the limit
    """

    limit: float
    order: int
    column: int
    value: float = 0.0
    floor: float = 0.0
    t: float = 0.0
    s: float = 0.0
    over: int = 0

    def see(self, values: Array, t: Array, s: Array, floor: Array, limits: Array | None = None) -> None:
        """Record values and their rounding, floor (n,), at times t and arc lengths s (n,); NaN is nothing.

        The worst is the value that is, but for its rounding, nearest to its limit or furthest over it. limits (n,) if
        the limit changes from place to place: `limit` becomes that of the worst.
        """
        if not len(values):
            return
        own = np.full(len(values), self.limit) if limits is None else limits
        beyond = values - floor
        beyond = np.where(np.isnan(beyond), -np.inf, beyond)
        self.over += int(np.count_nonzero(beyond > own * (1.0 + KEPT)))
        share = beyond / own
        k = int(np.argmax(share))
        if share[k] > (self.value - self.floor) / self.limit:
            self.value, self.floor, self.limit = float(values[k]), float(floor[k]), float(own[k])
            self.t, self.s = float(t[k]), float(s[k])

    def result(self, axes: tuple[str, ...], by: str = "setpoints") -> LimitResult:
        """The finding; axes  of the columns."""
        axis = axes[self.column - 1] if 0 < self.column <= len(axes) else None
        return LimitResult(
            limit=self.limit, worst=self.value, at_s=self.s, at_t=self.t, floor=self.floor, axis=axis, by=by,
            over=self.over,
        )  # fmt: skip


def jerks(jerk: Array, growing: BoolArray, falling: BoolArray, limits: Limits) -> dict[str, Array]:
    """|jerk| (..., n) where the feed grows and where it falls, by limit; where neither is sure, under the larger."""
    up, down = limits.jerk, float(limits.deceleration_jerk or np.inf)
    return {
        "jerk": np.where(falling | (~growing & (up < down)), 0.0, np.abs(jerk)),
        "deceleration_jerk": np.where(growing | (~falling & (down < up)), 0.0, np.abs(jerk)),
    }


@dataclass
class Fault:
    """One kind of fault: how many ticks, the worst amount, and where."""

    count: int
    amount: float
    tick: int
    t: float
    s: float
    detail: str = ""


@dataclass(frozen=True)
class Bounds:
    """The limits of setpoints; see `check`. Of joints, path is that of the tool tip."""

    path: Path
    limits: Limits
    tolerance: float
    resolution: float
    joints: JointPath | None = None

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes that have setpoints."""
        return self.path.axes if self.joints is None else self.joints.axes

    @cached_property
    def feeds(self) -> Array:
        """Largest feed on each curve of the path, (curves,), mm/s: of the limits or, if lower, of the path itself."""
        given = np.full(len(self.path.curves), self.limits.feed)
        return given if self.path.feeds is None else np.fmin(given, self.path.feeds)

    @cached_property
    def row_feeds(self) -> Array:
        """The same for each row of the path's table, (rows,)."""
        rows = self.path.curve_rows
        return np.repeat(self.feeds, rows[:, 1] - rows[:, 0] + 1)

    @cached_property
    def weights(self) -> Array:
        """Weights of the axes in each combination that is limited, (combinations, axes)."""
        axes = self.axes
        rows = [each.on(axes) for each in (self.limits.combinations or {}).values()]
        return np.array(rows).reshape(len(rows), len(axes))

    @cached_property
    def corners(self) -> Corners:
        """Corners that may be passed in motion: none without a limit on the velocity step of an axis."""
        return passable(self.path, self.limits.axis_velocity_step is not None)

    @cached_property
    def turning(self) -> Array:
        """Arc lengths, mm, at which the curves begin on which rotary axes move alone, (k,)."""
        return self.path.curve_starts[:-1][self.path.flat.turning(self.path.linear)]

    @cached_property
    def rests(self) -> Array:
        """Arc lengths at which the tool may be at rest, (m,), mm, increasing: ends, stops, and where it waits."""
        ends = np.array([0.0, self.path.length])
        return np.unique(np.concatenate([ends, (self.joints or self.path).stops, [s for s, _ in self.path.dwells]]))

    def worsts(self) -> dict[str, Worst]:
        """One empty Worst a limit that is given, in the order of the report."""
        limits, axes = self.limits, self.axes
        rows: list[tuple[str, float | None, int, int]] = [
            ("feed", float(np.max(self.feeds)), 1, 0),
            ("acceleration", limits.acceleration, 2, 0),
            ("deceleration", limits.deceleration, 2, 0),
            ("jerk", limits.jerk, 3, 0),
            ("deceleration_jerk", limits.deceleration_jerk, 3, 0),
            ("chord_error", limits.chord_error, 0, 0),
            ("orientation_error", limits.orientation_error, 0, 0),
            ("centripetal", limits.centripetal, 1, 0),
        ]
        for order, name in enumerate(AXIS_LIMITS, start=1):
            rows += [(f"{name}.{axes[k]}", v, order, k + 1) for k, v in enumerate(limits.of_axes(name, axes).tolist())]
        for k, (name, each) in enumerate((limits.combinations or {}).items(), start=1 + len(axes)):
            for order, kind in enumerate(BOUNDED, start=1):
                rows.append((f"combinations.{name}.{kind}", getattr(each, kind), order, k))
        if limits.torque is not None:
            columns = limits.torque.columns(axes)
            most = limits.torque.most
            rows += [(f"torque.{a}", v, 0, k + 1) for (a, v), k in zip(most.items(), columns, strict=True)]
        rows += [(f"{STEP}.{axes[k]}", v, 1, k + 1) for k, v in enumerate(limits.of_axes(STEP, axes).tolist())]
        for axis, (low, high) in limits.travel_of(axes).items():
            rows.append((f"travel.{axis}", 0.5 * (high - low), 0, axes.index(axis) + 1))
        return {name: Worst(v, order, column) for name, v, order, column in rows if v is not None and v < np.inf}

    def report_order(self) -> list[str]:
        """Names of the limits as a verdict has them: one for jerk, whichever way the feed goes."""
        return list(dict.fromkeys("jerk" if name == "deceleration_jerk" else name for name in self.worsts()))

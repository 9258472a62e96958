"""What an override runs: a law along a path, and what that asks of the axes in each tick."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.geometry.path import Path
from splinefeed.kernels.override_demand import ask
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Limits, TimeLaw, positive

#: A law that is over its limits by less than this is at them.
AT_LIMITS = 1e-6
#: Jumps of q'' within three ticks weigh at most this much each in a third difference, a single one at most 1.
NEAR_JUMPS = 0.75
#: Places in a tick at which joints of a tool path are looked at, and how far beside a break, as a share of the path.
LOOKED_AT, BESIDE = 5, 1e-9


class Course(Protocol):
    """Positions q(tau) by plan time, at rest at both ends; `period` and `duration` in s."""

    axes: tuple[str, ...]
    period: float
    duration: float

    def asked(self, first: int, count: int) -> Array:
        """Largest |q'|, |q''| and |q'''| in `count` ticks from `first` on, (count, 3, axes + 1); 0 beyond both ends.

        The last column is that of the arc length. A jump of q'' is jerk over the period, as it is for a drive.
        """

    def bend_share(self, limits: Limits) -> float:
        """Share of the limits that hold for the feed on a bend, at rate 1: the square root of what it asks for."""


def with_jumps(cells: Array, jumps: Array, period: float) -> Array:
    """Cells 1 ... n of (n + 2, 3, columns), with the jumps of q'' (n + 2, columns) as jerk over the period, s."""
    beside = NEAR_JUMPS * (jumps[:-2] + jumps[1:-1] + jumps[2:])
    cells[1:-1, 2] += np.maximum(jumps[1:-1], beside) / period
    return cells[1:-1]


class LawCourse:
    """A law along a path; period in s, the law's if it is not said.

    Raises LimitsError for a law that does not rest at both ends, and where nobody says a period.
    Source: docs/math/override.md. Example: `sf.live.LawCourse(path, law, 1e-3).duration`
    """

    def __init__(self, path: Path | JointPath, law: TimeLaw, period: float | None = None) -> None:
        wanted = law.period if period is None else period
        if wanted is None:
            raise LimitsError("no period: the law was planned without one; give period= in s")
        if law.feed(0.0) > AT_LIMITS or law.feed(law.duration) > AT_LIMITS:
            raise LimitsError(
                "a law that can be overridden begins and ends at rest; leave start_feed and end_feed at 0"
            )
        self.path, self.law, self.period = path, law, positive(wanted, "period")
        self.axes, self.duration = path.axes, law.duration

    def asked(self, first: int, count: int) -> Array:
        """As `Course` says, from the exact derivatives of path and law."""
        if isinstance(self.path, JointPath):
            return with_jumps(*_of_joints(self.path, self.law, self.period, first - 1, count + 2), self.period)
        columns = len(self.axes) + 1
        cells, jumps = np.empty((count + 2, 3, columns)), np.empty((count + 2, columns))
        given = (self.law.breaks, self.law.coefficients, self.path.table, self.path.shape)
        ask(*given, self.period, first - 1, cells, jumps)
        return with_jumps(cells, jumps, self.period)

    def bend_share(self, limits: Limits) -> float:
        """Share of the limits that hold for the feed on a bend, at rate 1: the square root of what it asks for."""
        settings = self.law.settings.get("limits", {})
        shares = [
            math.sqrt(settings.get(name, math.inf) / limit)
            for name in ("centripetal", "chord_error", "orientation_error")
            if (limit := getattr(limits, name)) is not None
        ]
        if not all(map(math.isfinite, shares)):
            raise LimitsError(
                "the law was not planned under the limits of centripetal acceleration, chord or orientation error"
            )
        return max(shares, default=0.0)


def _of_joints(path: JointPath, law: TimeLaw, period: float, first: int, count: int) -> tuple[Array, Array]:
    """Largest |q'|, |q''|, |q'''| of joints and tip in ticks, (count, 3, axes + 1), and the jumps of q'' in each."""
    inside = period * np.linspace(1e-6, 1.0 - 1e-6, LOOKED_AT)
    t = np.clip(period * np.arange(first, first + count)[:, None] + inside, 0.0, law.duration).ravel()
    v, a, j = (each(t)[:, None] for each in (law.feed, law.acceleration, law.jerk))
    r = path.derivatives(np.clip(law(t), 0.0, path.length))[:, :, 3:]
    joints = (r[:, 1] * v, r[:, 2] * v**2 + r[:, 1] * a, r[:, 3] * v**3 + 3.0 * r[:, 2] * v * a + r[:, 1] * j)
    each = np.stack([np.concatenate(pair, axis=1) for pair in zip(joints, (v, a, j), strict=True)], axis=1)
    cells = np.max(np.abs(each).reshape(count, LOOKED_AT, 3, -1), axis=1)
    tick = np.arange(first, first + count)
    cells[(tick < 0) | (tick * period >= law.duration)] = 0.0
    jumps = np.zeros((count, cells.shape[2]))
    ends = np.clip(period * np.arange(first, first + count + 1), 0.0, law.duration)
    away = BESIDE * path.length
    stops = np.array([-1.0, *path.stops, path.length + 1.0])
    after = np.searchsorted(stops, path.breaks)
    moving = np.minimum(path.breaks - stops[after - 1], stops[after] - path.breaks) > away
    breaks = path.breaks[moving]  # at rest nothing jumps, however joints turn there
    cell = np.searchsorted(law(ends), breaks, side="right") - 1
    near = (cell >= 0) & (cell < count)
    before, behind = (path.derivatives(breaks[near] + way)[:, :, 3:] for way in (-away, away))
    feed, push = (np.max(np.abs(each.reshape(count, LOOKED_AT, 3, -1)[cell[near], :, k, -1]), axis=1) for k in (0, 1))
    jump = (
        np.abs(behind[:, 2] - before[:, 2]) * feed[:, None] ** 2 + np.abs(behind[:, 1] - before[:, 1]) * push[:, None]
    )
    np.maximum.at(jumps[:, :-1], cell[near], jump)
    return cells, jumps

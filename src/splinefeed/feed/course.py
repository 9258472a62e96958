"""What an override runs: a law along a path, and what that asks of the axes in each tick."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Protocol

import numpy as np

from splinefeed.errors import LimitsError
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, IntArray, Limits, TimeLaw, positive
from splinefeed.records.law import polynomial

#: A law that is over its limits by less than this is at them.
AT_LIMITS = 1e-6
#: Jumps of q'' within three ticks weigh at most this much each in a third difference, a single one at most 1.
NEAR_JUMPS = 0.75
#: Instants looked at in every part of a tick in which everything is smooth, its ends included.
INSTANTS = 5
#: How far beside a break joints of a tool path are looked at, as a share of the path.
BESIDE = 1e-9
#: Arc length and time are rounded by so much of what they can be; halvings that find when a row is reached.
ROUNDING, BISECTIONS = 1e-14, 52


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
            raise LimitsError("no period: give period= in s, as the law was not brought to one")
        if law.feed(0.0) > AT_LIMITS or law.feed(law.duration) > AT_LIMITS:
            raise LimitsError(
                "a law that can be overridden begins and ends at rest; leave start_feed and end_feed at 0"
            )
        self.path, self.law, self.period = path, law, positive(wanted, "period")
        self.axes, self.duration = path.axes, law.duration

    def asked(self, first: int, count: int) -> Array:
        """As `Course` says, from the exact derivatives of path and law."""
        law, period, columns = self.law, self.period, len(self.axes) + 1
        cells, jumps = np.zeros((count + 2, 3, columns)), np.zeros((count + 2, columns))
        begin, end = max(first - 1, 0) * period, min((first + count + 1) * period, law.duration)
        if end > begin:
            low, high, piece, row = self._parts(begin, end)
            tau = (low + (high - low) * np.linspace(0.0, 1.0, INSTANTS)[:, None] - law.breaks[piece]).ravel()
            s, v, a, j = polynomial(law.coefficients[np.tile(piece, INSTANTS)], tau, 3)
            r = self._along(s, np.tile(row, INSTANTS))
            regular = np.isfinite(r).all(axis=(1, 2)).reshape(INSTANTS, -1)  # not where C' = 0
            v, a, j = v[:, None], 2.0 * a[:, None], 6.0 * j[:, None]
            asked = np.empty((len(s), 3, columns))
            asked[:, 0, -1:], asked[:, 1, -1:], asked[:, 2, -1:] = v, a, j
            with np.errstate(invalid="ignore"):
                asked[:, 0, :-1], asked[:, 1, :-1] = r[:, 1] * v, r[:, 2] * v**2 + r[:, 1] * a
                asked[:, 2, :-1] = r[:, 3] * v**3 + 3.0 * r[:, 2] * v * a + r[:, 1] * j
            asked = np.where(regular[..., None, None], asked.reshape(INSTANTS, len(low), 3, columns), 0.0)
            cell = (0.5 * (low + high) / period).astype(np.int64) - (first - 1)
            np.maximum.at(cells, cell, np.max(np.abs(asked), axis=0))
            known = regular[0, 1:] & regular[-1, :-1]
            apart = np.abs(asked[0, 1:, 1] - asked[-1, :-1, 1])
            np.add.at(jumps, cell[1:], np.where(known[:, None], apart, 0.0))
        return with_jumps(cells, jumps, period)

    def _parts(self, begin: float, end: float) -> tuple[Array, Array, IntArray, IntArray]:
        """Parts of ticks in which everything is smooth: from, to (n,), s; piece of the law and row of the path (n,)."""
        law, starts = self.law, self._starts
        rounding = ROUNDING * float(starts[-1] + law.length)
        ticks = self.period * np.arange(math.floor(begin / self.period), math.ceil(end / self.period) + 1)
        reached = starts[(starts > law(begin) + rounding) & (starts < law(end) - rounding)]
        low, high = np.full(len(reached), begin), np.full(len(reached), end)
        for _ in range(BISECTIONS if len(reached) else 0):
            middle = 0.5 * (low + high)
            before = law(middle) < reached
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        cuts = np.unique(np.concatenate([[begin, end], ticks, law.breaks, high]))
        cuts = cuts[(cuts >= begin) & (cuts <= end)]
        cuts = cuts[np.append(np.diff(cuts) > ROUNDING * end, True)]
        low, high = cuts[:-1], cuts[1:]
        middle = 0.5 * (low + high)
        return low, high, *(np.searchsorted(each, at, "right") - 1
                            for each, at in ((law.breaks, middle), (starts, law(middle))))  # fmt: skip

    @cached_property
    def _starts(self) -> Array:
        """Arc lengths at which rows of the path begin: between two of them it is smooth."""
        path = self.path
        return np.append(0.0, path.breaks) if isinstance(path, JointPath) else path.arc_pieces.starts

    def _along(self, s: Array, row: IntArray) -> Array:
        """r and its derivatives by arc length (n, 4, axes) at s (n,), mm, of these rows (n,)."""
        path = self.path
        if isinstance(path, JointPath):
            ends = np.append(self._starts, path.length)
            inside = np.clip(s, ends[row] + BESIDE * path.length, ends[row + 1] - BESIDE * path.length)
            return path.derivatives(inside)[:, :, 3:]
        return by_arc_length(path.arc_pieces.derivatives_on(row, s, 3), path.linear)

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

"""Rows of a motion under feedrate override: plan time, override and positions together, some ticks at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from splinefeed.interpolation.arc_length import fill
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.planner.override.override import Override
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.planner.override.setpoint_source import SetpointSource
from splinefeed.planner.override.source import HIGHEST, LawSource
from splinefeed.planner.planning import plan
from splinefeed.records import ROTARY_AXES, Array, Limits, Setpoints, TimeLaw

#: Rows whose plan time is remembered, for a resume from one that is confirmed later.
REMEMBERED = 1 << 16
#: To find where axes stand: plan times that are examined in each period, then rounds of so many between the nearest.
LOOKS, ROUNDS, CLOSE = 2, 12, 16


class Motion:
    """An override and the rows that it needs, from plan time `tau` of the override on, where the axes are at rest.

    Parameters
    ----------
    override : Override
        Of the motion.
    positions : callable
        Gives positions (n, axes), mm and rad, at plan times (n,), s.
    """

    def __init__(self, override: Override, positions: Callable[[Array], Array]) -> None:
        self.override, self.period, self.axes = override, override.period, override.source.axes
        self.duration = override.source.duration
        self._positions = positions
        #: Where it begins at plan time 0, (axes,).
        self.origin: Array = positions(np.zeros(1))[0]
        self._begin(override.tau)

    def begin_at(self, tau: float) -> None:
        """Restart, at rest, at plan time tau, s."""
        self.override.rest_at(tau)
        self._begin(tau)

    def _begin(self, tau: float) -> None:
        self.start: Array = self._positions(np.array([tau]))[0]
        self._taus = deque([tau], maxlen=REMEMBERED)
        #: How many rows were given: none but the first where it has not begun.
        self.rows = 0
        self.override.prepare()

    @property
    def done(self) -> bool:
        """Whether the end is reached."""
        return self.override.done and self.rows > 0

    def rests(self, wanted: float) -> bool:
        """Whether the axes stand where a feed hold stopped them, and stay there while `wanted` is the rate."""
        back = wanted < 0.0 and self.override.tau == 0.0
        return self.override.held and self.rows > 0 and (wanted == 0.0 or back)

    def take(self, count: int, wanted: float) -> Array:
        """Make the next rows.

        Parameters
        ----------
        count : int
            How many; fewer at the end.
        wanted : float
            The rate, negative backwards.

        Returns
        -------
        array (n, axes)
            In mm and rad; the very first row is where the motion begins.
        """
        if not self.rows:
            self.rows = 1
            return self.start[None]
        ticks = self.override.run(np.full(count, wanted))
        self._taus.extend(ticks.tau.tolist())
        self.rows += len(ticks)
        return self._positions(ticks.tau)

    def tau_of(self, row: int) -> float:
        """Plan time of a row that was given, from 1; of the oldest that is remembered if it is older, s."""
        behind = min(max(self.rows - row, 0), len(self._taus) - 1)
        return self._taus[-1 - behind]

    def go_back_to(self, row: int) -> None:
        """Rest at a row that was given, from 1, and drop the later ones."""
        tau = self.tau_of(row)
        for _ in range(min(self.rows - row, len(self._taus) - 1)):
            self._taus.pop()
        self.rows = row
        self.override.rest_at(tau)

    def begin_near(self, position: Array, low: float, high: float) -> None:
        """Restart, at rest, where the axes are nearest to a position.

        Parameters
        ----------
        position : array (axes,)
            mm and rad.
        low, high : float
            Plan times between which that is, s.
        """
        low, high = max(low, 0.0), min(high, self.duration)
        count, best = max(round(LOOKS * (high - low) / self.period), 1) + 1, low
        for _ in range(ROUNDS):
            taus = np.append(np.linspace(low, high, count), best)  # a row that was sent is reproduced exactly
            away = np.max(np.abs(self._positions(taus) - position), axis=1)
            best, step = float(taus[np.argmin(away)]), (high - low) / (count - 1)
            low, high, count = max(best - step, low), min(best + step, high), CLOSE + 1
        self.begin_at(best)


def along(
    path: Track,
    law: TimeLaw,
    limits: Limits,
    *,
    rate: float = 1.0,
    highest: float = HIGHEST,
) -> Motion:
    """Make the motion of a law along a path.

    Parameters
    ----------
    path, law : Track, TimeLaw
        The law is planned under a reserve of the limits.
    limits : Limits
        Of the rows that are sent.
    rate, highest : float, optional
        The override at the beginning, and the highest, 1 as planned.

    Returns
    -------
    Motion
        At rest at its start.
    """
    override = Override(LawSource(path, law), limits, rate=rate, highest=highest)
    return Motion(override, lambda tau: fill(path, law, tau)[-1])


def planned(
    path: Track, limits: Limits, *, period: float, strategy: str | None = None, top: float = 1.0,
    most: float = 1.0, rate: float = 1.0,
) -> tuple[TimeLaw, Motion]:  # fmt: skip
    """Plan a motion with a reserve for overrides.

    Parameters
    ----------
    path, limits : Track, Limits
        The feed is what is programmed, 100 %; limits at every override are those of the axes.
    period : float
        Of the servo, s.
    strategy : str, optional
        As for `plan`.
    top, most : float, optional
        Overrides that the reserve is for, and that are possible, 1 as planned.
    rate : float, optional
        The override at the beginning.

    Returns
    -------
    law : TimeLaw
        As planned.
    motion : Motion
        At rest at its start.
    """
    law = plan(path, with_reserve(limits, top), strategy=strategy, period=period)
    allowed = replace(limits, feed=max(most, 1.0) * limits.feed)
    return law, along(path, law, allowed, rate=rate, highest=most)


def through(rows: Setpoints, limits: Limits, *, highest: float = HIGHEST) -> Motion:
    """Make the motion of setpoints whose path is not known.

    Parameters
    ----------
    rows : Setpoints
        Positions (n, axes), mm and rad.
    limits : Limits
        Of the rows that are sent.
    highest : float, optional
        Override, 1 as planned.

    Returns
    -------
    Motion
        At rest at its start.
    """
    source = SetpointSource(rows, sum(axis not in ROTARY_AXES for axis in rows.axes))
    return Motion(Override(source, limits, highest=highest), source.positions)


def approach(start: Array, end: Array, axes: tuple[str, ...], limits: Limits, period: float) -> Motion:
    """Plan the straight move from the position of the axes to another, within limits and under the override.

    Parameters
    ----------
    start, end : array (axes,)
        In mm and rad.
    axes : tuple of str
        Their names.
    limits : Limits
        Of the move.
    period : float
        Of the servo, s.

    Returns
    -------
    Motion
        At rest at its start.
    """
    return planned(Path.polyline(np.array([start, end]), axes, name="approach"), limits, period=period)[1]

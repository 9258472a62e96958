"""Rows of a motion that obeys a knob: plan time, override and points together, some ticks at a time."""

from __future__ import annotations

from collections import deque

import numpy as np

from splinefeed.feed.override import Override
from splinefeed.geometry.path import Path
from splinefeed.interpolation.instants import Instants
from splinefeed.records import Array, Limits, Setpoints, TimeLaw

#: Rows whose plan time is remembered, for a resume from one that is confirmed later.
REMEMBERED = 1 << 16


class Motion:
    """A law along a path, tick by tick, from plan time `tau`, s, on, where the axes are at rest.

    limits  those that hold for what is sent; the law is planned under `with_reserve` of them
    """

    def __init__(self, path: Path, law: TimeLaw, limits: Limits, *, tau: float = 0.0, rate: float = 1.0) -> None:
        self.path, self.law, self.limits = path, law, limits
        self.override = Override(path, law, limits, rate=rate, tau=tau)
        self.period = self.override.period
        self._points = Instants(path, law, self.period)
        self._first: Setpoints | None = self._points.block(np.array([tau]), np.zeros(1))
        self.start: Array = self._first.position[0]
        self._taus = deque([tau], maxlen=REMEMBERED)
        self._row = 0  # rows that were given so far

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes."""
        return self.path.axes

    @property
    def done(self) -> bool:
        """Whether the end of the path is reached."""
        return self.override.done and self._first is None

    @property
    def held(self) -> bool:
        """Whether the axes rest where the knob stopped them."""
        return self.override.held

    def take(self, count: int, wanted: float) -> Setpoints:
        """The next `count` setpoints, fewer at the end; the first of all is where the motion begins."""
        if self._first is not None:
            points, self._first = self._first, None
            self._row = 1
            return points
        ticks = self.override.run(np.full(count, wanted))
        self._taus.extend(ticks.tau.tolist())
        self._row += len(ticks)
        return self._points.block(ticks.tau, ticks.rate)

    def tau_of(self, row: int) -> float:
        """Plan time of a row that was given, from 1; of the oldest that is remembered if it is older, s."""
        behind = min(max(self._row - row, 0), len(self._taus) - 1)
        return self._taus[-1 - behind]

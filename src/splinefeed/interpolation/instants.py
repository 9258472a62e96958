"""Setpoints at any instants of a law, forwards or backwards: for a law that runs at another rate."""

from __future__ import annotations

import numpy as np

from splinefeed.geometry.path import Path
from splinefeed.interpolation.arc_length import fill
from splinefeed.kinematics import JointPath
from splinefeed.records import Array, Setpoints, TimeLaw

METHOD = "arc-length"


class Instants:
    """Points of one motion at instants of its law, block by block."""

    def __init__(self, path: Path | JointPath, law: TimeLaw, period: float) -> None:
        self.path, self.law, self.period = path, law, period
        self.tick = 0

    def block(self, tau: Array, rate: Array) -> Setpoints:
        """Setpoints at plan times tau (n,), s, one period apart; rate (n,) of plan time to time, for the feed."""
        count, path = len(tau), self.path
        curve, u, s, feed = np.empty(count, dtype=np.int64), np.empty(count), np.empty(count), np.empty(count)
        position = np.empty((count, len(path.axes)))
        fill(path, self.law, tau, curve, u, s, feed, position)
        t = np.arange(self.tick, self.tick + count, dtype=np.float64) * self.period
        self.tick += count
        settings = {**self.law.settings, "path": path.name, "period": self.period, "method": METHOD}
        return Setpoints(
            t=t,
            curve=curve,
            u=u,
            s=s,
            feed=feed * rate,
            position=position,
            axes=path.axes,
            period=self.period,
            method=METHOD,
            settings=settings,
        )

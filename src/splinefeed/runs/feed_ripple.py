"""The measure of feed ripple."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from splinefeed.analysis.measures import Ripple, feed_ripple
from splinefeed.records import Verdict
from splinefeed.runs.fold import Chunk
from splinefeed.runs.measure import Measure, MeasuredRun, MeasureLabel


class FeedRipple(Measure):
    """The feed of the setpoints against the planned one; see `feed_ripple`. Without a top feed that so far counts."""

    label = MeasureLabel("feed ripple", "ripple_max", beside=("rounding alone", "ripple_floor"))
    columns = ("ripple_max", "ripple_rms")
    ripple: Ripple

    def __init__(self, given: MeasuredRun) -> None:
        super().__init__(given)
        self._rows, self._top, self._known = given.keep(), given.top or 0.0, given.top is not None
        self._squares, self._steps, self._floor = 0.0, 0, 0.0

    def feed(self, chunk: Chunk) -> None:
        """Measure the steps that begin at ticks of a chunk."""
        own, around, inner = chunk.own, chunk.around, chunk.inner
        if not self._known:
            self._top = max(self._top, float(np.max(chunk.law.feed(around.t[inner]))))
        path = chunk.path.tip_path
        ripple = feed_ripple(around, path, chunk.law, top=self._top)
        begin, end = around.t[inner][[0, -1]]
        here = (ripple.t >= begin) & (ripple.t <= end)
        if here.any():
            relative = ripple.relative[here]
            self._squares, self._steps = self._squares + float(np.sum(relative**2)), self._steps + len(relative)
            self._floor = max(self._floor, ripple.floor)
            self._rows.see({"t": ripple.t[here] + (own.t[0] - begin), "relative": relative}, {"ripple": relative})

    def finish(self) -> None:
        """Make a record of what is kept."""
        self.bands = self._rows.bands()
        rms = math.sqrt(self._squares / self._steps) if self._steps else 0.0
        self.ripple = Ripple(self._rows.take("t"), self._rows.take("relative"), self._floor, rms)

    def numbers(self, verdict: Verdict) -> dict[str, Any]:
        """Largest, rms and the rounding's, relative."""
        return {"ripple_max": self.ripple.max, "ripple_rms": self.ripple.rms, "ripple_floor": self.ripple.floor}

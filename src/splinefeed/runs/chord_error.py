"""The measure of chord error."""

from __future__ import annotations

from typing import Any

import numpy as np

from splinefeed.analysis.measures import chord_errors
from splinefeed.records import Verdict
from splinefeed.runs.fold import Chunk
from splinefeed.runs.measure import Measure, MeasuredRun, MeasureLabel


class ChordError(Measure):
    """The largest distance of the path from the line between setpoints, mm; the check knows that of joints."""

    label = MeasureLabel("chord error", "chord_error_max_mm", "mm")
    columns = ("chord_error_max_mm",)

    def __init__(self, given: MeasuredRun) -> None:
        super().__init__(given)
        self.largest = 0.0

    def feed(self, chunk: Chunk) -> None:
        """Measure the steps that begin at ticks of a chunk."""
        if chunk.path.carries_tip:
            errors = chord_errors(chunk.around, chunk.path.tip_path, worth=np.inf)
            self.largest = max(self.largest, float(np.max(errors[chunk.inner], initial=0.0)))

    def numbers(self, verdict: Verdict) -> dict[str, Any]:
        """The largest, mm."""
        return {"chord_error_max_mm": float(verdict.numbers.get("chord_error_max_mm", self.largest))}

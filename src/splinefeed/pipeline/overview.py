"""What figures show of a response of any length: samples with every peak of its errors, and the contour beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from splinefeed.analysis.contour import ContourMeter
from splinefeed.analysis.thinning import Kept
from splinefeed.geometry.path import Path
from splinefeed.pipeline.meter import ANSWER
from splinefeed.records import Array, Response

#: Samples that are kept at the most; a figure has some hundred columns of pixels.
MOST_SAMPLES = 40_000


class Overview:
    """Keeps of a response, and of its commanded arc lengths, the samples with a peak of a following or contour error.

    Up to MOST_SAMPLES ticks all are kept.
    """

    def __init__(self, most: int = MOST_SAMPLES) -> None:
        self._kept = Kept(most=most)
        self._last: Response | None = None

    def see(self, response: Response, s: Array) -> None:
        """The next piece of the response, with its commanded arc lengths (n,), mm, or none."""
        self._last = response if len(response) or self._last is None else self._last
        if len(response):
            columns = {name: getattr(response, name) for name in ANSWER}
            known = {name: values for name, values in columns.items() if values is not None}
            errors = [*response.tracking_error.T, *([] if response.contour_error is None else [response.contour_error])]
            self._kept.see({**known, **({"s": s} if len(s) else {})}, errors)

    @property
    def response(self) -> Response:
        """The samples that were kept, with times that are not even."""
        assert self._last is not None
        columns: dict[str, Any] = {name: self._kept.column(name) for name in ANSWER}
        return replace(self._last, **{name: values for name, values in columns.items() if len(values)})

    def deviation(self, path: Path) -> Deviation | None:
        """Where the machine was beside the path at them."""
        return deviation(self.response, path, self._kept.column("s"))


@dataclass(frozen=True, eq=False)
class Deviation:
    """Samples of a response over two linear axes: foot (n, 2) on the path, offset (n, 2) from it, error (n,), mm."""

    path: Path
    foot: Array
    offset: Array
    error: Array


def deviation(response: Response, path: Path, s: Array) -> Deviation | None:
    """Feet and offsets of a response over the first two linear axes; None if it lacks one of them.

    s  (n,) commanded arc length of each sample, mm, as `Servo.commanded` has it or setpoints say it
    """
    if path.linear < 2 or any(axis not in response.axes for axis in path.axes[: path.linear]):
        return None
    columns = [response.axes.index(axis) for axis in path.axes[: path.linear]]
    position = np.ascontiguousarray(response.position[:, columns])
    found = ContourMeter(path).measure(position, s_hint=np.clip(s[: len(response)], 0.0, path.length))
    foot = path(np.clip(found.s, 0.0, path.length))[:, : path.linear]
    return Deviation(path, foot[:, :2], (position - foot)[:, :2], found.error)

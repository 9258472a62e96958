"""Errors of a response that may be too long to keep: the largest, where, and root mean squares, chunk by chunk."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.records import ROTARY_AXES, Array, Response, shown_by, unit_along


@dataclass
class Worst:
    """The largest |value| so far, its time, s, and commanded arc length, mm or None; count and squares of all."""

    value: float = 0.0
    t: float = 0.0
    s: float | None = None
    count: int = 0
    squares: float = 0.0

    def see(self, values: Array, t: Array, s: Array | None) -> None:
        """More values (n,), with their times and commanded arc lengths."""
        if not len(values):
            return
        at = int(np.argmax(np.abs(values)))
        if not self.count or abs(values[at]) > self.value:
            self.value, self.t = float(abs(values[at])), float(t[at])
            self.s = None if s is None else float(s[at])
        self.count += len(values)
        self.squares += float(np.dot(values, values))

    @property
    def rms(self) -> float:
        """Root mean square of all values."""
        return math.sqrt(self.squares / max(self.count, 1))


class ErrorTally:
    """Following error of each axis and contour error over all that was seen.

    Arrays seen are those of responses in order; memory does not grow with them.
    """

    def __init__(self, axes: tuple[str, ...]) -> None:
        self.axes, self.ticks = axes, 0
        self.tracking, self.saturated = [Worst() for _ in axes], np.zeros(len(axes), dtype=int)
        self.contour: Worst | None = None
        self.stopped: str | None = None

    def see(self, response: Response, s: Array | None = None) -> None:
        """The next piece of a response; s (n,) its commanded arc length, mm, if known."""
        if response.axes != self.axes:
            raise InputError(f"the response has axes {response.axes}; expected {self.axes}")
        for worst, error in zip(self.tracking, np.ascontiguousarray(response.tracking_error.T), strict=True):
            worst.see(error, response.t, s)
        self.saturated += np.count_nonzero(response.saturated, axis=0)
        if response.contour_error is not None:
            self.contour = self.contour or Worst()
            self.contour.see(response.contour_error, response.t, s)
        self.ticks += len(response)
        self.stopped = response.stopped

    def worst_linear(self) -> tuple[str, Worst]:
        """The linear axis with the largest following error; a worst one of 0 where there is none."""
        linear = [each for each in zip(self.axes, self.tracking, strict=True) if each[0] not in ROTARY_AXES]
        return max(linear, key=lambda each: each[1].value, default=("", Worst()))

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints: lengths in mm, rotary axes in degrees; contour errors are None without a path."""
        tracking = {}
        for axis, worst, saturated in zip(self.axes, self.tracking, self.saturated.tolist(), strict=True):
            factor = shown_by("", axis)
            tracking[axis] = {
                "unit": unit_along([axis]),
                "max": factor * worst.value,
                "rms": factor * worst.rms,
                "at_t_s": worst.t,
                "at_s_mm": worst.s,
                "saturated_ticks": saturated,
            }
        contour = self.contour
        return {
            "followed_ticks": self.ticks,
            "contour_error_max_mm": None if contour is None else contour.value,
            "contour_error_rms_mm": None if contour is None else contour.rms,
            "contour_error_at": None if contour is None else {"t_s": contour.t, "s_mm": contour.s},
            "tracking_error_max": {axis: each["max"] for axis, each in tracking.items()},
            "tracking": tracking,
            "stopped": self.stopped,
        }

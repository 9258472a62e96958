"""Errors of a response that may be too long to keep: the largest, where, and root mean squares, chunk by chunk."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.records import ROTARY_AXES, Array, Response


@dataclass
class Worst:
    """The largest |value| so far, its time, s, and commanded arc length, mm or None; and the sum of squares."""

    value: float = 0.0
    t: float = 0.0
    s: float | None = None
    squares: float = 0.0
    seen: bool = False

    def see(self, values: Array, t: Array, s: Array | None) -> None:
        """More values (n,), with their times and commanded arc lengths."""
        if not len(values):
            return
        at = int(np.argmax(np.abs(values)))
        if not self.seen or abs(values[at]) > self.value:
            self.value, self.t = float(abs(values[at])), float(t[at])
            self.s = None if s is None else float(s[at])
        self.seen = True
        self.squares += float(np.dot(values, values))


@dataclass(eq=False)
class ErrorTally:
    """Following error of each axis and contour error over all that was seen.

    Arrays seen are those of responses in order; memory does not grow with them.
    """

    axes: tuple[str, ...]
    period: float
    ticks: int = 0
    tracking: list[Worst] = field(default_factory=list)
    saturated: list[int] = field(default_factory=list)
    contour: Worst | None = None
    stopped: str | None = None

    def __post_init__(self) -> None:
        self.tracking = [Worst() for _ in self.axes]
        self.saturated = [0] * len(self.axes)

    def see(self, response: Response, s: Array | None = None) -> None:
        """The next piece of a response; s (n,) its commanded arc length, mm, if known."""
        if response.axes != self.axes:
            raise InputError(f"the response has axes {response.axes}; expected {self.axes}")
        error = response.tracking_error
        for column, worst in enumerate(self.tracking):
            worst.see(np.ascontiguousarray(error[:, column]), response.t, s)
            self.saturated[column] += int(np.count_nonzero(response.saturated[:, column]))
        if response.contour_error is not None:
            self.contour = self.contour or Worst()
            self.contour.see(response.contour_error, response.t, s)
        self.ticks += len(response)
        self.stopped = response.stopped

    def rms(self, worst: Worst) -> float:
        """Root mean square over all ticks."""
        return math.sqrt(worst.squares / self.ticks) if self.ticks else 0.0

    def worst_linear(self) -> tuple[str, Worst]:
        """The linear axis with the largest following error; a worst one of 0 where there is none."""
        linear = [each for each in zip(self.axes, self.tracking, strict=True) if each[0] not in ROTARY_AXES]
        return max(linear, key=lambda each: each[1].value, default=("", Worst()))

    def numbers(self) -> dict[str, Any]:
        """What `--json` prints: lengths in mm, rotary axes in degrees; contour errors are None without a path."""
        tracking = {}
        for axis, worst, saturated in zip(self.axes, self.tracking, self.saturated, strict=True):
            rotary = axis in ROTARY_AXES
            factor = 180.0 / math.pi if rotary else 1.0
            tracking[axis] = {
                "unit": "deg" if rotary else "mm",
                "max": factor * worst.value,
                "rms": factor * self.rms(worst),
                "at_t_s": worst.t,
                "at_s_mm": worst.s,
                "saturated_ticks": saturated,
            }
        contour = self.contour
        return {
            "followed_ticks": self.ticks,
            "contour_error_max_mm": None if contour is None else contour.value,
            "contour_error_rms_mm": None if contour is None else self.rms(contour),
            "contour_error_at": None if contour is None else {"t_s": contour.t, "s_mm": contour.s},
            "tracking_error_max": {axis: each["max"] for axis, each in tracking.items()},
            "tracking": tracking,
            "stopped": self.stopped,
        }

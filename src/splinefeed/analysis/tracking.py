"""Tracking error: how far each axis was from where it was told to be, and when and where it was worst."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from splinefeed.analysis.contour import commanded_s
from splinefeed.errors import InputError
from splinefeed.records import ROTARY_AXES, Response, Setpoints, check_finite


@dataclass(frozen=True)
class AxisTracking:
    """Tracking error of one axis, in its `unit` ("mm", or "rad" for a rotary axis).

    max, rms  largest and root mean square of |command - position|; error  the largest one with its sign
    tick, t, s  where the largest is: sample, time in s, commanded arc length in mm (None if no setpoints were given)
    saturated  share of the samples, 0 to 1, in which the output was at its limit
    """

    axis: str
    unit: str
    max: float
    rms: float
    error: float
    tick: int
    t: float
    s: float | None
    saturated: float


@dataclass(frozen=True)
class Tracking:
    """Tracking errors of all axes; the linear and the rotary ones apart, since mm and rad cannot be compared.

    of  what was held against the command: "position" (where the axis was) or "measured" (what its encoder said)
    """

    axes: Mapping[str, AxisTracking]
    of: str

    @property
    def linear(self) -> Mapping[str, AxisTracking]:
        """The linear axes, mm."""
        return {name: each for name, each in self.axes.items() if each.unit == "mm"}

    @property
    def rotary(self) -> Mapping[str, AxisTracking]:
        """The rotary axes, rad."""
        return {name: each for name, each in self.axes.items() if each.unit == "rad"}


def tracking(response: Response, points: Setpoints | None = None, *, of: str = "position") -> Tracking:
    """Tracking error command - position of each axis of a response, or command - measured with of="measured".

    With `points`, the setpoints that were followed, the record says at which commanded arc length it was worst, too.
    Raises InputError for a response without samples, one that is not finite, and axes that are not those of `points`.
    """
    if of not in ("position", "measured"):
        raise InputError(f"of is {of!r}; choose 'position' or 'measured'")
    if not len(response):
        raise InputError("the response has no samples, so it has no tracking error")
    if points is not None and points.axes != response.axes:
        raise InputError(f"the response has axes {response.axes}, the setpoints {points.axes}; they must be the same")
    check_finite(response.command, "Response.command")
    check_finite(getattr(response, of), f"Response.{of}")
    errors = response.command - getattr(response, of)
    axes = {}
    for column, axis in enumerate(response.axes):
        error = errors[:, column]
        tick = int(np.argmax(np.abs(error)))
        t = float(response.t[tick])
        axes[axis] = AxisTracking(
            axis=axis,
            unit=axis_unit(axis),
            max=float(abs(error[tick])),
            rms=float(np.sqrt(np.mean(error**2))),
            error=float(error[tick]),
            tick=tick,
            t=t,
            s=None if points is None else float(commanded_s(points, t)),
            saturated=float(np.mean(response.saturated[:, column])),
        )
    return Tracking(axes, of)


def axis_unit(axis: str) -> str:
    """The unit of an axis by its name: "rad" for a rotary one, "mm" for any other."""
    return "rad" if axis in ROTARY_AXES else "mm"

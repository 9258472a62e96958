"""Response: what the axes of a machine did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.records import view
from splinefeed.records.arrays import Array, BoolArray, IntArray, hold_columns

#: Fields of Response that only streams have.
STREAM_COLUMNS = ("row", "depth", "underruns")


@dataclass(frozen=True, eq=False, kw_only=True)
class Response:
    """The motion of a machine's axes that follow setpoints.

    t          (n,)       time of the tick, s
    command    (n, axes)  commanded position of each axis, mm, rotary axes rad
    position   (n, axes)  where it was
    measured   (n, axes)  what its encoder or scale measured
    output     (n, axes)  control output, V
    saturated  (n, axes)  whether the output was at its limit
    contour_error  (n,)   distance of `position` from the true path over the linear axes, mm; None if no path was given
    row, depth, underruns  (n,)  of a stream to a controller: number of its row, rows that it still had, and periods in
                           which it had none so far; None where nothing was streamed
    stopped    why the run ended early, or None; settings  all that is needed to repeat it
    Raises InputError for arrays of other shapes. Source: docs/machines.md.
    Example: `sf.follow(setpoints, machine, path=path).contour_error.max()`
    """

    t: Array
    command: Array
    position: Array
    measured: Array
    output: Array
    saturated: BoolArray
    axes: tuple[str, ...]
    period: float
    contour_error: Array | None = None
    row: IntArray | None = None
    depth: IntArray | None = None
    underruns: IntArray | None = None
    stopped: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", tuple(self.axes))
        maybe = {"contour_error": np.float64, **dict.fromkeys(STREAM_COLUMNS, np.int64)}
        wide = {**dict.fromkeys(("command", "position", "measured", "output"), np.float64), "saturated": np.bool_}
        hold_columns(self, len(self.t), len(self.axes), {"t": np.float64, **maybe}, wide)

    @property
    def tracking_error(self) -> Array:
        """command - position of each axis, (n, axes), mm, rotary axes rad."""
        return self.command - self.position

    @property
    def contour_error_max(self) -> float:
        """Largest contour error, mm; InputError where no path was given."""
        if self.contour_error is None:
            raise InputError("no contour error without the path; give it: follow(setpoints, machine, path=path)")
        return float(np.max(self.contour_error, initial=0.0))

    def __repr__(self) -> str:
        return f"Response({len(self)} ticks of {self.period:g} s, axes {' '.join(self.axes)})"

    def _repr_html_(self) -> str:
        rows = {"response": f"{self!r}", **({"stopped": self.stopped} if self.stopped else {})}
        if self.contour_error is None:
            error = np.max(np.abs(self.tracking_error), axis=1, initial=0.0)
            return view.table(rows, view.sparkline(error, "largest following error over time"))
        rows["contour error"] = f"at most {self.contour_error_max:.4g} mm"
        return view.table(rows, view.sparkline(self.contour_error, "contour error over time"))

    def __len__(self) -> int:
        return len(self.t)

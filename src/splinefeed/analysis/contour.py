"""Contour error: how far a position is from the true path over its linear axes, and on which side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.nearest import Nearest
from splinefeed.geometry.path import Path
from splinefeed.kernels import contour as kernels
from splinefeed.kernels import pieces
from splinefeed.records import Array, check_finite, number

#: The two notions of the nearest point, as `Contour.notion` names them.
NEAR_COMMAND = "near the commanded point"
WHOLE_PATH = "whole path"


@dataclass(frozen=True, eq=False)
class Contour:
    """Contour error of each sample.

    error   (n,)  distance from the path over the linear axes, mm; if `signed`, positive on the left of the path
    s       (n,)  arc length of the nearest point, mm
    notion  which nearest point was looked for: NEAR_COMMAND or WHOLE_PATH, see `ContourMeter.measure`
    """

    error: Array
    s: Array
    notion: str
    signed: bool = False

    @property
    def max(self) -> float:
        """Largest |error|, mm, 0 without samples."""
        return float(np.max(np.abs(self.error), initial=0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the error, mm, 0 without samples."""
        return float(np.sqrt(np.mean(self.error**2))) if self.error.size else 0.0

    @property
    def worst(self) -> int:
        """Index of the sample with the largest |error|; InputError without samples."""
        if not self.error.size:
            raise InputError("there are no samples, so none is the worst")
        return int(np.argmax(np.abs(self.error)))


class ContourMeter:
    """Measures positions against one path; what it needs of the path is made once, here.

    For samples that come in pieces. For one array there is `contour_error`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._nearest = Nearest(path.table, path.shape)

    def measure(
        self,
        position: ArrayLike,
        *,
        s_hint: ArrayLike | None = None,
        window: float = 0.0,
        signed: bool = False,
    ) -> Contour:
        """Contour error of `position` (n, axes) or (n, linear axes), mm; rotary axes do not count.

        Without `s_hint` the nearest point of the whole path counts (WHOLE_PATH). Where the path crosses itself, or
        two of its parts run side by side, that may be a part where the tool has no business to be.

        With s_hint (n,), the commanded arc length of each sample, mm, only the path near the commanded point counts
        (NEAR_COMMAND): arc lengths s_hint - h to s_hint + h, with h four times the distance e of the position from
        the commanded point, and at least `window`, mm. For the nearest point is within 2 e of the commanded one, and
        the path may wind and turn back, by corners up to 150 degrees, before it is 4 e long. While the nearest point
        of the window is one of its ends, and that is no end of the path, h is doubled. On a closed path the window
        runs over the seam. A servo that lags far behind on a path with hairpins wants `window`: its largest lag.

        With `signed`, for two linear axes, the error is positive on the left of the path, seen along it. At a corner
        that is the side of the mean of its two tangents, where the path turns straight back of the one before.

        What is found is the nearest point to rounding. Positions in the order of the motion are fast.
        Raises InputError for shapes that do not fit, values that are not finite, and s_hint outside the path.
        """
        path = self.path
        points = _linear_positions(position, path)
        if signed and path.linear != 2:
            raise InputError(f"a signed contour error needs two linear axes; this path has {path.linear}")
        width = number(window, "window")
        if width < 0.0:
            raise InputError(f"window is {width:g} mm; it must not be negative")
        if width > 0.0 and s_hint is None:
            raise InputError("window is a distance from the commanded arc length; give s_hint too")
        if s_hint is None:
            found = self._of_whole_path(points)
        else:
            hint = _hints(s_hint, len(points), path.length)
            found = np.empty((len(points), 3))
            cells, boxes = self._nearest.cells, self._nearest.boxes
            kernels.nearest_in_window(path.table, path.shape, cells, boxes, path.closed, width, points, hint, found)
        s = np.empty(len(points))
        kernels.arc_lengths(path.table, found, s)
        error = found[:, kernels.DISTANCE].copy()
        if signed:
            side = np.empty(len(points))
            kernels.sides(path.table, path.shape, path.closed, points, found, side)
            error *= side
        return Contour(error, s, WHOLE_PATH if s_hint is None else NEAR_COMMAND, signed)

    def _of_whole_path(self, points: Array) -> Array:
        """What `kernels.contour` calls found, (n, 3), of the nearest point of the whole path."""
        rows, u, distance = self._nearest.find(points)
        table = self.path.table
        # an end of a piece is met exactly, for there the pieces on both sides say what is left and right
        place = (u - table[rows, pieces.MIDDLE]) * table[rows, pieces.SCALE]
        place = np.where(u <= table[rows, pieces.LOW], -1.0, np.where(u >= table[rows, pieces.HIGH], 1.0, place))
        return np.ascontiguousarray(np.column_stack([distance, rows, place]))


def contour_error(
    position: ArrayLike,
    path: Path,
    *,
    s_hint: ArrayLike | None = None,
    window: float = 0.0,
    signed: bool = False,
) -> Array:
    """Distance (n,), mm, of each position (n, axes) from the true path over its linear axes.

    Near the commanded arc length s_hint (n,), mm, if that is given; from the whole path otherwise. What `window` and
    `signed` do, and where the two notions differ: `ContourMeter.measure`.
    """
    return ContourMeter(path).measure(position, s_hint=s_hint, window=window, signed=signed).error


def _linear_positions(position: ArrayLike, path: Path) -> Array:
    """The linear axes of `position` as a contiguous array (n, linear)."""
    try:
        values = np.asarray(position, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"position: expected numbers, got {type(position).__name__} ({error})") from None
    axes = len(path.axes)
    if values.ndim != 2 or values.shape[1] not in (axes, path.linear):
        kinds = f"(n, {axes})" if axes == path.linear else f"(n, {axes}) or, without rotary axes, (n, {path.linear})"
        raise InputError(f"position has shape {values.shape}; expected {kinds}")
    points = np.ascontiguousarray(values[:, : path.linear])
    check_finite(points, "position")
    return points


def _hints(s_hint: ArrayLike, count: int, length: float) -> Array:
    """`s_hint` as a contiguous array (count,) within [0, length] but for rounding."""
    try:
        values = np.ascontiguousarray(s_hint, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"s_hint: expected numbers, got {type(s_hint).__name__} ({error})") from None
    if values.shape != (count,) or np.ndim(s_hint) != 1:
        raise InputError(f"s_hint has shape {np.shape(s_hint)}; expected ({count},), one a position")
    check_finite(values, "s_hint")
    slack = 1e-9 * length
    outside = (values < -slack) | (values > length + slack)
    if outside.any():
        i = int(np.argmax(outside))
        raise InputError(f"s_hint[{i}] is {values[i]:g} mm; the path runs from 0 to {length:g} mm")
    return np.clip(values, 0.0, length)

"""Contour error: how far a position is from the true path over its linear axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import Rows
from splinefeed.geometry.search import Search, on_rows
from splinefeed.records import Array, check_finite, number

#: The two notions of the nearest point, as `Contour.notion` names them.
NEAR_COMMAND = "near the commanded point"
WHOLE_PATH = "whole path"
#: A coordinate beyond this, mm, has a square that is not a number.
FARTHEST = 1e150


@dataclass(frozen=True, eq=False)
class Contour:
    """Contour error of each sample.

    error   (n,)  distance from the path over the linear axes, mm
    s       (n,)  arc length of the nearest point, mm
    notion  which nearest point is meant: NEAR_COMMAND or WHOLE_PATH, see `ContourMeter.measure`
    Source: docs/math/contour-error.md.
    Example: `sf.tune(machine, setpoints=setpoints, path=path, evaluations=2).contour.error`
    """

    error: Array
    s: Array
    notion: str

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
            raise InputError("there are no samples and so no worst one")
        return int(np.argmax(np.abs(self.error)))


class ContourMeter:
    """Measures positions against one path; its tables of the path are made once, here.

    For samples that come in pieces. For one array there is `contour_error`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows = Rows(path.arc_pieces)
        self._search = Search(self._rows, closed=path.closed)

    def measure(
        self,
        position: ArrayLike,
        *,
        s_hint: ArrayLike | None = None,
        window: float = 0.0,
    ) -> Contour:
        """Contour error of `position` (n, axes) or (n, linear axes), mm; rotary axes do not count.

        Without `s_hint` the nearest point of the whole path counts (WHOLE_PATH). Where the path crosses itself, or
        two of its parts run side by side, that may be a part where the tool must not be.

        With s_hint (n,), the commanded arc length of each sample, mm, only the path near the commanded point counts
        (NEAR_COMMAND): arc lengths s_hint - h to s_hint + h, with h four times the distance e of the position from
        the commanded point, and at least `window`, mm. For the nearest point is within 2 e of the commanded one, and
        the path may wind and turn back, by corners up to 150 degrees, before it is 4 e long. While the nearest point
        of the window is one of its ends, and that is not an end of the path, h is doubled. On a closed path the window
        continues across the seam. A servo that lags far behind on a path with hairpins needs `window`: its largest lag.

        The result is the nearest point to rounding. Positions in the order of the motion are fast.
        Raises InputError for shapes that do not fit, values that are not finite, and s_hint outside the path.
        """
        path = self.path
        points = _linear_positions(position, path)
        width = number(window, "window")
        if width < 0.0:
            raise InputError(f"window is {width:g} mm; it must not be negative")
        if width > 0.0 and s_hint is None:
            raise InputError("window is a distance from the commanded arc length; give s_hint too")
        if points.size and np.abs(points).max() > FARTHEST:
            raise InputError(f"position: a coordinate is beyond {FARTHEST:g} mm; distances to it would be rounding")
        q = np.ascontiguousarray(points.T)
        hint = None if s_hint is None else _hints(s_hint, len(points), path.length)
        notion = WHOLE_PATH if hint is None else NEAR_COMMAND
        if not path.linear:  # nothing to be away from: every position is on the path
            return Contour(np.zeros(len(points)), np.zeros(len(points)) if hint is None else hint, notion)
        found = self._search.whole(q) if hint is None else self._search.near(q, hint, width)
        t, _, _ = on_rows(self._rows, found)
        return Contour(np.sqrt(found.square), self._rows.arc_length(found.row, t), notion)


def contour_error(
    position: ArrayLike,
    path: Path,
    *,
    s_hint: ArrayLike | None = None,
    window: float = 0.0,
) -> Array:
    """Distance (n,), mm, of each position (n, axes) from the true path over its linear axes.

    Near the commanded arc length s_hint (n,), mm, if that is given; from the whole path otherwise. What `window`
    does, and where the two notions differ: `ContourMeter.measure`.
    """
    return ContourMeter(path).measure(position, s_hint=s_hint, window=window).error


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

"""Contour error: how far a position is from the true path over its linear axes, and on which side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import Places, Rows
from splinefeed.geometry.search import MOST, Search, on_rows
from splinefeed.records import Array, BoolArray, IntArray, check_finite, number

#: The two notions of the nearest point, as `Contour.notion` names them.
NEAR_COMMAND = "near the commanded point"
WHOLE_PATH = "whole path"
#: A coordinate beyond this, mm, has a square that is not a number.
FARTHEST = 1e150
#: A derivative this much shorter than the next ones over a row counts as 0.
VANISHING = 1e-12


@dataclass(frozen=True, eq=False)
class Contour:
    """Contour error of each sample.

    error   (n,)  distance from the path over the linear axes, mm; if `signed`, positive on the left of the path
    s       (n,)  arc length of the nearest point, mm
    notion  which nearest point is meant: NEAR_COMMAND or WHOLE_PATH, see `ContourMeter.measure`
    Source: docs/math/contour-error.md.
    Example: `sf.tune(machine, setpoints=setpoints, path=path, evaluations=2).contour.error`
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
        signed: bool = False,
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

        With `signed`, for two linear axes, the error is positive on the left of the path, seen along it. At a corner
        that is the side of the mean of its two tangents, where the path turns straight back of the one before.

        The result is the nearest point to rounding. Positions in the order of the motion are fast.
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
        if points.size and np.abs(points).max() > FARTHEST:
            raise InputError(f"position: a coordinate is beyond {FARTHEST:g} mm; distances to it would be rounding")
        q = np.ascontiguousarray(points.T)
        hint = None if s_hint is None else _hints(s_hint, len(points), path.length)
        notion = WHOLE_PATH if hint is None else NEAR_COMMAND
        if not path.linear:  # nothing to be away from: every position is on the path
            return Contour(np.zeros(len(points)), np.zeros(len(points)) if hint is None else hint, notion, signed)
        found = self._search.whole(q) if hint is None else self._search.near(q, hint, width)
        t, at_low, at_high = on_rows(self._rows, found)
        s = self._rows.arc_length(found.row, t)
        error = np.sqrt(found.square)
        if signed:
            for start in range(0, len(s), MOST):
                part = slice(start, start + MOST)
                error[part] *= self._sides(q[:, part], found.row[part], t[part], at_low[part], at_high[part])
        return Contour(error, s, notion, signed)

    def _sides(self, q: Array, row: IntArray, t: Array, at_low: BoolArray, at_high: BoolArray) -> Array:
        """1 for a position (2, n) left of the path at t (n,) of rows (n,), -1 for right of it, (n,).

        Left of the sum of the unit tangents before and behind the point: at a corner that is right for every position
        whose nearest point the corner is. Where the path turns straight back the tangent before it decides.
        """
        rows, last = self._rows, len(self._rows) - 1
        point, before = _direction(rows, row, t, before=True)
        behind = before.copy()
        ends = np.flatnonzero(at_low | at_high)
        if len(ends):
            row, t, low, closed = row[ends], t[ends], at_low[ends], self.path.closed
            other = np.where(low, row - 1, row + 1)
            other = np.where(other < 0, last if closed else 0, np.where(other > last, 0 if closed else last, other))
            beyond = (low & (row == 0) | ~low & (row == last)) & (not closed)
            other_t = np.where(beyond, t, -t)
            first_row, first_t = np.where(low, other, row), np.where(low, other_t, t)
            next_row, next_t = np.where(low, row, other), np.where(low, t, other_t)
            before[:, ends] = _direction(rows, first_row, first_t, before=True)[1]
            point[:, ends], behind[:, ends] = _direction(rows, next_row, next_t, before=False)
        x, y = before + behind
        back = np.hypot(x, y) <= 1e-9
        x, y = np.where(back, before[0], x), np.where(back, before[1], y)
        return np.where(x * (q[1] - point[1]) - y * (q[0] - point[0]) >= 0.0, 1.0, -1.0)


def _direction(rows: Rows, row: IntArray, t: Array, *, before: bool) -> tuple[Array, Array]:
    """Point and unit tangent, (2, n) each, at t (n,) of rows (n,); where C' = 0 its limit from before or behind t."""
    places = Places(rows, row)
    point, *derivatives = (each[:2] for each in places.derivatives(t, 3))
    sizes = [np.hypot(*each) / places.scale**k for k, each in enumerate(derivatives, start=1)]
    # a derivative that is below the rounding of the next ones counts as 0
    none = sizes[0] <= VANISHING * np.maximum(sizes[1], sizes[2])
    second = none & (sizes[1] > VANISHING * sizes[2])
    chosen = np.where(
        second, (-1.0 if before else 1.0) * derivatives[1], np.where(none, derivatives[2], derivatives[0])
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        return point, np.nan_to_num(chosen / np.hypot(*chosen))


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

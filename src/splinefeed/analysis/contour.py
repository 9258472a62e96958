"""Contour error: how far a position is from the true path over its linear axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.path import Path
from splinefeed.geometry.rows import Rows
from splinefeed.geometry.search import Search, on_rows
from splinefeed.records import Array

#: A coordinate beyond this, mm, has a square that is not a number.
FARTHEST = 1e150


@dataclass(frozen=True, eq=False)
class Contour:
    """Contour error of each sample.

    error   (n,)  distance from the path over the linear axes, mm
    s       (n,)  arc length of the nearest point, mm; see `ContourMeter.measure`
    Source: docs/math/contour-error.md.
    Example: `sf.tune(machine, setpoints=setpoints, path=path, evaluations=2).contour.error`
    """

    error: Array
    s: Array

    @property
    def max(self) -> float:
        """Largest error, mm, 0 without samples."""
        return float(np.max(self.error, initial=0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the error, mm, 0 without samples."""
        return float(np.sqrt(np.mean(self.error**2))) if self.error.size else 0.0

    @property
    def worst(self) -> int:
        """Index of the sample with the largest error; InputError without samples."""
        if not self.error.size:
            raise InputError("there are no samples and so no worst one")
        return int(np.argmax(self.error))


class ContourMeter:
    """Measures positions against one path; its tables of the path are made once, here."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows = Rows(path.arc_pieces)
        self._search = Search(self._rows, closed=path.closed)

    def measure(self, position: ArrayLike, *, s_hint: ArrayLike | None = None) -> Contour:
        """Contour error of `position` (n, axes) or (n, linear axes), mm; rotary axes do not count.

        Without `s_hint` the nearest point of the whole path counts. Where the path crosses itself, or two of its parts
        run side by side, that may be a part where the tool must not be.

        With s_hint (n,), the commanded arc length of each sample, mm, only the path near the commanded point counts:
        arc lengths s_hint - h to s_hint + h, with h four times the distance e of the position from the commanded point.
        For the nearest point is within 2 e of the commanded one, and the path may wind and turn back, by corners up to
        150 degrees, before it is 4 e long. While the nearest point of the window is one of its ends, and that is not an
        end of the path, h is doubled. On a closed path the window continues across the seam.

        The result is the nearest point to rounding. Positions in the order of the motion are fast.
        Raises InputError for shapes that do not fit, and values that are not finite.
        """
        path = self.path
        points = np.asarray(position, dtype=np.float64)
        hint = None if s_hint is None else np.ascontiguousarray(s_hint, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (len(path.axes), path.linear):
            raise InputError(f"position has shape {points.shape}; expected (n, {path.linear}), the linear axes")
        if hint is not None and hint.shape != (len(points),):
            raise InputError(f"s_hint has shape {hint.shape}; expected ({len(points)},), one a position")
        q = np.ascontiguousarray(points[:, : path.linear].T)
        if not np.all(np.abs(q) <= FARTHEST) or not np.all(np.isfinite(0.0 if hint is None else hint)):
            raise InputError(f"a position or s_hint is beyond {FARTHEST:g} mm or not finite; its distance is no number")
        hint = None if hint is None else np.clip(hint, 0.0, path.length)
        if not path.linear:  # nothing to be away from: every position is on the path
            return Contour(np.zeros(len(points)), np.zeros(len(points)) if hint is None else hint)
        found = self._search.whole(q) if hint is None else self._search.near(q, hint)
        return Contour(np.sqrt(found.square), self._rows.arc_length(found.row, on_rows(self._rows, found)[0]))

"""ArcLength: S(u) and its inverse for one curve, from a table made once."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.kernels import arc_fitting, pieces
from splinefeed.kernels import arc_length as kernels
from splinefeed.records import Array

if TYPE_CHECKING:
    from splinefeed.geometry.nearest import Nearest

#: Rows to try first; most curves need fewer, the butterfly about 460.
FIRST_ROWS = 512
#: More pieces than this and the curve is refused: it would take more memory than it is worth.
MAX_ROWS = 2_000_000


class ArcLength:
    """Arc length over the first `linear` axes of a curve, to 1e-12 of its length, and its inverse.

    linear  the number of linear axes, or minus that number to count stretches on which only the others move, in degrees
    table   (pieces, width)  see `kernels.pieces`; length  mm
    Raises CurveError for a curve without length over these axes.
    """

    def __init__(self, curve: NurbsCurve, linear: int) -> None:
        table, (degree, axes, _, rational) = curve.table
        self.shape = (degree, axes, linear, rational)
        rough = arc_fitting.rough_length(table, 0, len(table) - 1, self.shape)
        if not np.isfinite(rough):
            raise CurveError(f"the length of {curve!r} is not finite; its coordinates are too large")
        if not rough > 0.0:
            raise CurveError(f"{curve!r} has no length over its linear axes")
        rows = min(FIRST_ROWS, 4 * len(table)) if degree == 1 else FIRST_ROWS
        given = curve.knots, curve.control_points, curve.kernel_weights, self.shape, rough
        room = arc_fitting.arc_room(pieces.width(self.shape))
        while True:
            out = np.empty((rows, pieces.width(self.shape)))
            needed = arc_fitting.arc_pieces(*given, out, 0, self.shape, room)
            if needed <= rows:
                break
            if needed > MAX_ROWS:
                raise CurveError(f"{curve!r} would need {needed} arc-length pieces; at most {MAX_ROWS} are kept")
            rows = needed
        self.table: Array = out[:needed].copy()
        self.table.setflags(write=False)
        self.curve = curve
        self.length = float(self.at(curve.domain[1]))

    @cached_property
    def nearest(self) -> Nearest:
        """The search for nearest points over this table."""
        from splinefeed.geometry.nearest import Nearest

        return Nearest(self.table, self.shape)

    def at(self, u: ArrayLike) -> Array:
        """S(u), mm, (...) at parameters u (...)."""
        values = self.curve.check_parameters(u)
        out = np.empty(values.size)
        kernels.lengths_at(self.table, 0, len(self.table) - 1, values.ravel(), out)
        return out.reshape(values.shape)

    def parameter(self, s: ArrayLike) -> Array:
        """u with S(u) = s, (...) at arc lengths s (...), mm; InputError outside [0, length] by more than rounding."""
        values = np.asarray(s, dtype=np.float64)
        slack = 1e-12 * self.length
        outside = ~((values >= -slack) & (values <= self.length + slack))
        if np.any(outside):
            first = values[outside].flat[0]
            raise InputError(f"arc length {first:g} mm is outside the curve's [0, {self.length:g}] mm")
        out = np.empty(values.size)
        clipped = np.clip(values, 0.0, self.length).ravel()
        kernels.parameters_at(self.table, 0, len(self.table) - 1, clipped, out)
        return out.reshape(values.shape)

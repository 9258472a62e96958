"""ArcLength: S(u) and its inverse for one curve, from a table made once."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import Flat
from splinefeed.geometry.pieces import Pieces
from splinefeed.geometry.tables import arc_rows
from splinefeed.records import Array

if TYPE_CHECKING:
    from splinefeed.geometry.nearest import Nearest


class ArcLength:
    """Arc length over the first `linear` axes of a curve, to 1e-13 of its length, and its inverse.

    linear  the number of linear axes, or minus that number to count stretches on which only the others move, in degrees
    table   (pieces, width)  see `kernels.layout`; length  mm
    Raises CurveError for a curve without length over these axes.
    """

    def __init__(self, curve: NurbsCurve, linear: int) -> None:
        self.shape = (curve.degree, curve.axes, linear, int(curve.rational))
        self.table, rows, _ = arc_rows(Flat.of([curve]), self.shape, [curve])
        self._pieces = Pieces(self.table, self.shape, rows)
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
        return self._pieces.lengths_at(None, values.ravel()).reshape(values.shape)

    def parameter(self, s: ArrayLike) -> Array:
        """u with S(u) = s, (...) at arc lengths s (...), mm; InputError outside [0, length] by more than rounding."""
        values = np.asarray(s, dtype=np.float64)
        slack = 1e-12 * self.length
        outside = ~((values >= -slack) & (values <= self.length + slack))
        if np.any(outside):
            first = values[outside].flat[0]
            raise InputError(f"arc length {first:g} mm is outside the curve's [0, {self.length:g}] mm")
        return self._pieces.parameters(np.clip(values, 0.0, self.length).ravel()).reshape(values.shape)

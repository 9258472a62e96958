"""Many curves in a row: as flat arrays that kernels walk through, and lines that become curves on access."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import LARGEST, NurbsCurve, numbers
from splinefeed.curves.flat import Flat as Flat
from splinefeed.errors import CurveError
from splinefeed.records import Array, IntArray, frozen_array

#: Knots of every line.
LINE_KNOTS: Array = frozen_array([0.0, 0.0, 1.0, 1.0], "knots", 1)


def curve_of(flat: Flat, i: int) -> NurbsCurve:
    """Curve number i, of copies of its arrays."""
    a, b = int(flat.point_starts[i]), int(flat.point_starts[i + 1])
    degree, knots = int(flat.degrees[i]), flat.knots[flat.knot_starts[i] : flat.knot_starts[i + 1]]
    weights = flat.weights[a:b].copy() if flat.rational[i] else None
    clamped = bool(knots[1] == knots[degree] and knots[-2] == knots[-degree - 1])
    return NurbsCurve.trusted(degree, knots.copy(), flat.points[a:b].copy(), weights, clamped=clamped)


class Packed(Sequence[NurbsCurve]):
    """Curves that are made when they are needed, from the arrays of all of them; these must be right."""

    __slots__ = ("flat",)

    def __init__(self, flat: Flat) -> None:
        self.flat = flat

    def __len__(self) -> int:
        return len(self.flat)

    @overload
    def __getitem__(self, index: int) -> NurbsCurve: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[NurbsCurve]: ...

    def __getitem__(self, index: int | slice) -> NurbsCurve | Sequence[NurbsCurve]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(*index.indices(len(self))))
        return self._curve(range(len(self))[index])

    def _curve(self, i: int) -> NurbsCurve:
        return curve_of(self.flat, i)

    def __repr__(self) -> str:
        return f"Packed({len(self)} curves)"


class Lines(Packed):
    """The straight lines between neighbouring points, a sequence of curves that are made when they are needed.

    points  (n + 1, axes), mm (rotary axes rad), n at least 1
    Raises CurveError that names the point or the line: values that are not finite or too large, lines without length.
    """

    __slots__ = ("points",)

    def __init__(self, points: ArrayLike) -> None:
        self.points = numbers(points, "points", 2)
        if (count := len(self.points)) < 2:
            raise CurveError(f"{count} point(s) for a polyline; expected at least 2")
        if len(kept := lines_with_length(self.points)) < count - 1:
            i = int(np.argmax(np.append(kept, -1) != np.arange(len(kept) + 1)))
            raise CurveError(f"line {i} from points[{i}] to points[{i + 1}] has no length; leave one of them out")
        super().__init__(Flat.beziers(np.stack([self.points[:-1], self.points[1:]], axis=1)))

    def _curve(self, i: int) -> NurbsCurve:
        return NurbsCurve.trusted(1, LINE_KNOTS, self.points[i : i + 2])

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Lines):
            return np.array_equal(self.points, other.points)
        return NotImplemented

    def __hash__(self) -> int:
        return hash((self.points + 0.0).tobytes())

    def __reduce__(self) -> tuple[object, ...]:
        return Lines, (self.points,)

    def __repr__(self) -> str:
        return f"Lines({len(self)} lines, {self.points.shape[1]} axes)"


def lines_with_length(points: Array) -> IntArray:
    """Numbers (m,) of the lines between neighbouring points (n + 1, axes) that are long enough to be one."""
    return np.flatnonzero(np.max(np.abs(np.diff(points, axis=0)), axis=1, initial=0.0) >= 1.0 / LARGEST)

"""Many curves in a row as one sequence: flat arrays of all of them, from which each is made on access."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import moved_points
from splinefeed.curves.flat import Flat as Flat
from splinefeed.curves.spline import LARGEST, numbers
from splinefeed.errors import CurveError
from splinefeed.records import Array, IntArray, frozen_array
from splinefeed.records.arrays import read_only

#: Knots of every line.
LINE_KNOTS: Array = frozen_array([0.0, 0.0, 1.0, 1.0], "knots", 1)


class Packed(Sequence[NurbsCurve]):
    """Many curves by the arrays of all of them.

    Parameters
    ----------
    flat : Flat
        The arrays, which must be right.
    made : mapping of int to NurbsCurve, optional
        Curves that are there already, by number.
    """

    def __init__(self, flat: Flat, made: Mapping[int, NurbsCurve] | None = None) -> None:
        self.flat, self._made = flat, made or {}

    @classmethod
    def of(cls, curves: Sequence[NurbsCurve]) -> Packed:
        """These curves, of the same number of axes."""
        return curves if isinstance(curves, Packed) else cls(Flat.of(curves), dict(enumerate(curves)))

    def __len__(self) -> int:
        return len(self.flat)

    @overload
    def __getitem__(self, index: int) -> NurbsCurve: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[NurbsCurve]: ...

    def __getitem__(self, index: int | slice) -> NurbsCurve | Sequence[NurbsCurve]:
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(self[i] for i in numbers)
        return self._made.get(numbers) or self._curve(numbers)

    def _curve(self, i: int) -> NurbsCurve:
        """Curve number i, of copies of its arrays."""
        flat, a, b = self.flat, int(self.flat.point_starts[i]), int(self.flat.point_starts[i + 1])
        knots = flat.knots[flat.knot_starts[i] : flat.knot_starts[i + 1]].copy()
        weights = flat.weights[a:b].copy() if flat.rational[i] else None
        clamped = bool(flat.clamped[i])
        return NurbsCurve.trusted(int(flat.degrees[i]), knots, flat.points[a:b].copy(), weights, clamped=clamped)

    @cached_property
    def ends(self) -> Array:
        """First and last point of each, (n, 2, axes): its control points, if it is clamped."""
        flat = self.flat
        ends = np.stack([flat.points[flat.point_starts[:-1]], flat.points[flat.point_starts[1:] - 1]], axis=1)
        for i in np.flatnonzero(~flat.clamped).tolist():
            ends[i] = self[i].ends
        return read_only(ends)

    def chosen(self, index: IntArray) -> Packed:
        """The curves of these numbers (m,), in their order."""
        made = {k: self._made[i] for k, i in enumerate(index.tolist()) if i in self._made} if self._made else {}
        return Packed(self.flat.chosen(index), made)

    def changed(self, others: Mapping[int, NurbsCurve]) -> Packed:
        """The same curves, but for others at some numbers."""
        if not others:
            return self
        flat = self.flat.changed({i: Flat.of([curve]) for i, curve in others.items()})
        return Packed(flat, {**self._made, **others})

    def transformed(self, matrix: ArrayLike, offset: ArrayLike | None = None) -> Packed:
        """Transform each curve; see `NurbsCurve.transformed`.

        Parameters
        ----------
        matrix : array_like
            (new axes, axes), or one number.
        offset : array_like, optional
            (new axes,), mm.

        Returns
        -------
        Packed
            The affine images.
        """
        points = numbers(moved_points(self.flat.points, matrix, offset), "control_points", 2)
        flat = self.flat.through(points)
        if (short := flat.sizes() < 1.0 / LARGEST).any():
            raise CurveError(f"curve {int(np.argmax(short))} has no length: all its control points are the same")
        return Packed(flat)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Packed):
            return tuple(self) == other if isinstance(other, tuple) else NotImplemented
        names = ("degrees", "rational", "knots", "points", "weights")
        return all(np.array_equal(getattr(self.flat, name), getattr(other.flat, name)) for name in names)

    def __repr__(self) -> str:
        return f"Packed({len(self)} curves)"


def lines_through(points: ArrayLike) -> Packed:
    """Make the straight lines between neighbouring points.

    Parameters
    ----------
    points : array_like
        (n + 1, axes), mm (rotary axes rad), n at least 1.

    Returns
    -------
    Packed
        n lines.

    Raises
    ------
    CurveError
        Names the point or the line: values that are not finite or too large, lines without length.
    """
    given = numbers(points, "points", 2)
    if (count := len(given)) < 2:
        raise CurveError(f"{count} point(s) for a polyline; expected at least 2")
    if len(kept := lines_with_length(given)) < count - 1:
        i = int(np.argmax(np.append(kept, -1) != np.arange(len(kept) + 1)))
        raise CurveError(f"line {i} from points[{i}] to points[{i + 1}] has no length; leave one of them out")
    return Packed(Flat.beziers(np.stack([given[:-1], given[1:]], axis=1)))


def lines_with_length(points: Array) -> IntArray:
    """Find the lines between neighbouring points that are long enough to be one.

    Parameters
    ----------
    points : (n + 1, axes) array
        mm (rotary axes rad).

    Returns
    -------
    (m,) array of int
        Their numbers.
    """
    return np.flatnonzero(np.max(np.abs(np.diff(points, axis=0)), axis=1, initial=0.0) >= 1.0 / LARGEST)

"""Many curves as flat arrays, one curve behind the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from splinefeed.curves.spline import AnySpline
from splinefeed.records import Array, IntArray


@dataclass(frozen=True, eq=False)
class Flat:
    """Degree, knots, control points and weights of all curves of a path, one curve behind the other.

    degrees, rational  (n,)    of each curve; rational is 0 or 1
    knots              (k,)    of all curves; those of curve i are knots[knot_starts[i]:knot_starts[i + 1]]
    points             (m, axes)  and likewise weights (m,), which count where a curve is rational only; point_starts
    """

    degrees: IntArray
    rational: IntArray
    knot_starts: IntArray
    knots: Array
    point_starts: IntArray
    points: Array
    weights: Array

    @classmethod
    def made(
        cls, degrees: IntArray, rational: IntArray, counts: IntArray, knots: Array, points: Array, weights: Array
    ) -> Flat:
        """Of curves with so many control points each, counts (n,)."""
        weights = weights if rational.any() else np.empty(0)
        return cls(degrees, rational, _starts(counts + degrees + 1), knots, _starts(counts), points, weights)

    @classmethod
    def of(cls, curves: Sequence[AnySpline]) -> Flat:
        """The arrays of curves that have the same number of axes."""
        return cls.made(
            np.array([curve.degree for curve in curves], dtype=np.int64),
            np.array([curve.rational for curve in curves], dtype=np.int64),
            np.array([len(curve.control_points) for curve in curves], dtype=np.int64),
            np.concatenate([curve.knots for curve in curves]),
            np.concatenate([curve.control_points for curve in curves]),
            np.concatenate([np.ones(len(c.control_points)) if c.weights is None else c.weights for c in curves]),
        )

    @classmethod
    def beziers(cls, points: Array) -> Flat:
        """The arrays of Bezier curves on [0, 1] with control points (n, degree + 1, axes); two points are a line."""
        count, order, axes = points.shape
        one = np.ones(count, dtype=np.int64)
        knots = np.tile(np.repeat([0.0, 1.0], order), count)
        return cls.made((order - 1) * one, 0 * one, order * one, knots, points.reshape(-1, axes), np.empty(0))

    @classmethod
    def joined(cls, flats: Sequence[Flat]) -> Flat:
        """The curves of all of them, one behind the other."""
        return cls.made(
            np.concatenate([flat.degrees for flat in flats]),
            np.concatenate([flat.rational for flat in flats]),
            np.concatenate([np.diff(flat.point_starts) for flat in flats]),
            np.concatenate([flat.knots for flat in flats]),
            np.concatenate([flat.points for flat in flats]),
            np.concatenate([flat.weights if len(flat.weights) else np.ones(len(flat.points)) for flat in flats]),
        )

    def chosen(self, index: IntArray) -> Flat:
        """The curves of these numbers (n,), in their order."""
        points, counts = _gathered(self.point_starts, index)
        knots, _ = _gathered(self.knot_starts, index)
        weights = self.weights[points] if len(self.weights) else self.weights
        return Flat.made(
            self.degrees[index], self.rational[index], counts, self.knots[knots], self.points[points], weights
        )

    def part(self, low: int, high: int) -> Flat:
        """The curves from `low` to the one before `high`."""
        return self.chosen(np.arange(low, high))

    def __len__(self) -> int:
        return len(self.degrees)

    @cached_property
    def domains(self) -> Array:
        """First and last parameter of each curve, (n, 2)."""
        first = self.knots[self.knot_starts[:-1] + self.degrees]
        return np.column_stack([first, self.knots[self.knot_starts[1:] - self.degrees - 1]])

    def sizes(self, columns: slice = slice(None)) -> Array:
        """Diagonal of the bounding box of each curve's control points over some of the axes, (n,), mm."""
        points, starts = self.points[:, columns], self.point_starts[:-1]
        spread = np.maximum.reduceat(points, starts) - np.minimum.reduceat(points, starts)
        return np.asarray(np.linalg.norm(spread, axis=1))

    def ends(self, curves: Sequence[AnySpline]) -> Array:
        """First and last point of each of these curves, (n, 2, axes): their control points, if they are clamped."""
        first, last = self.point_starts[:-1], self.point_starts[1:] - 1
        ends = np.stack([self.points[first], self.points[last]], axis=1)
        start, end = self.knot_starts[:-1], self.knot_starts[1:] - 1
        loose = self.knots[start + 1] != self.knots[start + self.degrees]
        loose |= self.knots[end - 1] != self.knots[end - self.degrees]
        for i in np.flatnonzero(loose).tolist():
            ends[i] = curves[i](self.domains[i])
        return ends

    def inner_knots(self) -> tuple[IntArray, Array, IntArray]:
        """Curve (k,), value (k,) and multiplicity (k,) of every distinct knot strictly inside a domain, in order."""
        owner = np.repeat(np.arange(len(self)), np.diff(self.knot_starts))
        new = np.ones(len(self.knots), dtype=bool)
        new[1:] = (np.diff(self.knots) > 0.0) | (np.diff(owner) > 0)
        first = np.flatnonzero(new)
        times = np.diff(np.append(first, len(self.knots)))
        owner, value = owner[first], self.knots[first]
        inside = (value > self.domains[owner, 0]) & (value < self.domains[owner, 1])
        return owner[inside], value[inside], times[inside]

    def scaled(self, units: Array) -> Flat:
        """The same curves with every axis times a unit, (axes,)."""
        return self if np.all(units == 1.0) else replace(self, points=self.points * units)


def _starts(counts: IntArray) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _gathered(starts: IntArray, index: IntArray) -> tuple[IntArray, IntArray]:
    counts = np.diff(starts)[index]
    out = _starts(counts)
    return np.arange(out[-1]) + np.repeat(starts[index] - out[:-1], counts), counts

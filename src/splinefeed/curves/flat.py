"""Many curves as flat arrays, one curve behind the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from splinefeed.curves.spline import Spline
from splinefeed.records import Array, BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Flat:
    """Degree, knots, control points and weights of all curves of a path, one curve behind the other.

    Parameters
    ----------
    degrees, rational : (n,) array of int
        Of each curve; rational is 0 or 1.
    knot_starts, point_starts : (n + 1,) array of int
        Where those of each curve begin: curve i has knots[knot_starts[i]:knot_starts[i + 1]].
    knots : (k,) array
        Of all curves.
    points : (m, axes) array
        mm (rotary axes rad).
    weights : (m,) array
        Count where a curve is rational only.
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
        """Join arrays of curves of given sizes.

        Parameters
        ----------
        degrees, rational, counts : (n,) array of int
            Of each curve: its degree, whether it is rational, and how many control points it has.
        knots : (k,) array
            Of all curves.
        points : (m, axes) array
            mm (rotary axes rad).
        weights : (m,) array
            Count where a curve is rational only.

        Returns
        -------
        Flat
            The curves.
        """
        weights = weights if rational.any() else np.empty(0)
        return cls(degrees, rational, _starts(counts + degrees + 1), knots, _starts(counts), points, weights)

    @classmethod
    def of(cls, curves: Sequence[Spline]) -> Flat:
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

    def changed(self, others: Mapping[int, Flat]) -> Flat:
        """The curves, but for those at some numbers, in place of each of which stand others."""
        counts, index = np.ones(len(self), dtype=np.int64), np.arange(len(self))
        index[list(others)] = len(self)
        counts[list(others)] = [len(each) for each in others.values()]
        index = np.repeat(index, counts)
        new = index == len(self)
        index[new] += np.arange(np.count_nonzero(new))
        return Flat.joined([self, *(others[i] for i in sorted(others))]).chosen(index)

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

    @cached_property
    def clamped(self) -> BoolArray:
        """Whether each curve begins and ends at its first and last control point by its knots, (n,)."""
        start, end, knots = self.knot_starts[:-1], self.knot_starts[1:] - 1, self.knots
        first, last = knots[start + self.degrees], knots[end - self.degrees]
        begins = (knots[start + 1] == first) & (first < knots[start + self.degrees + 1])
        return np.asarray(begins & (knots[end - 1] == last) & (knots[end - self.degrees - 1] < last))

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

    def through(self, points: Array) -> Flat:
        """The same curves through as many other control points, (m, axes)."""
        return replace(self, points=points)

    def scaled(self, units: Array) -> Flat:
        """The same curves with every axis times a unit, (axes,)."""
        return self if np.all(units == 1.0) else self.through(self.points * units)

    def reversed(self) -> Flat:
        """The curves from the last to the first, each traversed from its end to its start, on the same domain."""
        owner = np.repeat(np.arange(len(self)), np.diff(self.knot_starts))
        start, end = self.domains[owner].T
        # start + end - knots would move the ends by a rounding; measured from the nearer end they stay
        knots = np.where(self.knots < 0.5 * (start + end), end - (self.knots - start), start + (end - self.knots))
        each = (knots, self.points, self.weights)
        back = (np.ascontiguousarray(array[::-1]) for array in each)
        return Flat.made(self.degrees[::-1], self.rational[::-1], np.diff(self.point_starts)[::-1], *back)


def _starts(counts: IntArray) -> IntArray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _gathered(starts: IntArray, index: IntArray) -> tuple[IntArray, IntArray]:
    counts = np.diff(starts)[index]
    out = _starts(counts)
    return np.arange(out[-1]) + np.repeat(starts[index] - out[:-1], counts), counts

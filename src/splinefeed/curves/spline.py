"""Spline: what a B-spline is made of, checked once and never changed, and what its knots say."""

from __future__ import annotations

from functools import cached_property, partial
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.pieces import clipped
from splinefeed.errors import CurveError, InputError
from splinefeed.kernels.layout import Shape
from splinefeed.records import Array, BoolArray, Points, check_finite, frozen_array

MAX_DEGREE = 12
#: X Y Z A B C U V W of a control, and the seven joints of each of two arms.
MAX_AXES = 16
#: Greatest coordinate, knot and weight, and one over the least size, knot span and weight: beyond, powers overflow.
LARGEST = 1e30
#: Largest weight over smallest. Beyond it the point of the lightest control point drowns in rounding.
MAX_WEIGHT_RATIO = 1e6


class Spline:
    """Degree, knots, control points and weights of a rational B-spline; see `NurbsCurve`, which it is a part of."""

    degree: int
    knots: Array
    control_points: Array
    weights: Array | None

    def __init__(self, degree: int, knots: ArrayLike, control_points: Points, weights: ArrayLike | None = None) -> None:
        whole = isinstance(degree, (int, float, np.integer, np.floating)) and not isinstance(degree, bool)
        if not whole or not 1 <= degree <= MAX_DEGREE or int(degree) != degree:
            raise CurveError(f"degree is {degree!r}; expected a whole number from 1 to {MAX_DEGREE}")
        self._set(
            int(degree),
            numbers(knots, "knots", 1),
            numbers(control_points, "control_points", 2),
            None if weights is None else numbers(weights, "weights", 1),
        )
        self._check()
        if self.weights is not None and np.all(self.weights == self.weights[0]):
            self.__dict__["weights"] = None  # equal weights cancel: the same curve, evaluated faster

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a NurbsCurve cannot be changed: tried to set {name!r}; make a new one")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a NurbsCurve cannot be changed: tried to delete {name!r}")

    def _check(self) -> None:
        p, knots, points, weights = self.degree, self.knots, self.control_points, self.weights
        n = len(points)
        if n < p + 1:
            raise CurveError(f"{n} control point(s) for degree {p}; expected at least {p + 1}")
        if len(knots) != n + p + 1:
            wanted = f"exactly {n + p + 1} (points + degree + 1) expected"
            raise CurveError(f"{len(knots)} knots for {n} control points of degree {p}; {wanted}")
        steps, (start, end) = knots[1:] - knots[:-1], self.domain
        least = least_step(knots)
        if (i := _first(steps < 0.0)) is not None:
            raise CurveError(f"knots decrease from knots[{i}] = {knots[i]:g} to knots[{i + 1}] = {knots[i + 1]:g}")
        if not start < end:
            raise CurveError(f"the domain knots[{p}] to knots[{n}] is empty: both are {start:g}")
        inner = knots[p + 1 : n]
        again = inner[p:]
        if (i := _first((again == inner[: len(again)]) & (again > start) & (again < end))) is not None:
            often = f"appears {np.count_nonzero(inner == again[i])} times; at most {p} (the degree) are possible"
            raise CurveError(f"inner knot {again[i]:g} {often}")
        if (i := _first((steps > 0.0) & (steps < least))) is not None:
            apart = f"differ by {steps[i]:g} only; make them equal or move them apart"
            raise CurveError(f"knots[{i}] and knots[{i + 1}] {apart}")
        if weights is not None:
            if len(weights) != n:
                raise CurveError(f"{len(weights)} weights for {n} control points; expected one each")
            low, high = int(weights.argmin()), int(weights.argmax())
            if weights[low] <= 0.0:
                raise CurveError(f"weights[{low}] is {weights[low]:g}; weights must be greater than 0")
            if weights[high] > MAX_WEIGHT_RATIO * weights[low]:
                raise CurveError(
                    f"weights[{low}] = {weights[low]:g} and weights[{high}] = {weights[high]:g} differ by more than "
                    f"{MAX_WEIGHT_RATIO:g} times; the curve would lose the digits of its points"
                )
            if weights[low] < 1.0 / LARGEST:
                raise CurveError(f"weights[{low}] is {weights[low]:g}; at least {1.0 / LARGEST:g} is needed")
        spread = float((points.max(axis=0) - points.min(axis=0)).max())
        if spread < 1.0 / LARGEST:
            same = "are the same: the curve has no length"
            small = f"lie within {spread:g} mm: the curve is too small"
            raise CurveError(f"all {n} control points {small if spread else same}")

    @classmethod
    def trusted(
        cls, degree: int, knots: Array, control_points: Array, weights: Array | None = None, *, clamped: bool = True
    ) -> Self:
        """Make a curve of arrays that are right by construction: readers make thousands.

        Parameters
        ----------
        degree : int
            p.
        knots : (n + p + 1,) array
            float64, read-only from then on, as the others.
        control_points : (n, axes) array
            mm (rotary axes rad).
        weights : (n,) array, optional
            None for a polynomial curve.
        clamped : bool, optional
            Whether it begins and ends at its first and last control point.

        Returns
        -------
        NurbsCurve
            The curve.

        Notes
        -----
        Nothing is checked: what `NurbsCurve(...)` would refuse, and weights that are all equal, must not get here.
        """
        curve = object.__new__(cls)
        curve._set(degree, knots, control_points, weights)
        curve.__dict__["clamped"] = clamped
        return curve

    def _set(self, degree: int, knots: Array, control_points: Array, weights: Array | None) -> None:
        for array in (knots, control_points) if weights is None else (knots, control_points, weights):
            array.setflags(write=False)
        self.__dict__.update(degree=degree, knots=knots, control_points=control_points, weights=weights)

    @property
    def axes(self) -> int:
        """Number of axes."""
        return int(self.control_points.shape[1])

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return float(self.knots[self.degree]), float(self.knots[len(self.control_points)])

    @property
    def rational(self) -> bool:
        """Whether weights differ."""
        return self.weights is not None

    @property
    def _shape(self) -> Shape:
        return self.degree, self.axes, self.axes, int(self.rational)

    @cached_property
    def breaks(self) -> Array:
        """Distinct knots of the domain (spans + 1,): between two of them the curve is one rational polynomial."""
        start, end = self.domain
        inside = self.knots[(self.knots >= start) & (self.knots <= end)]
        values = np.unique(inside)
        values.setflags(write=False)
        return values

    @cached_property
    def clamped(self) -> bool:
        """Whether the curve begins and ends at its first and last control point by its knots."""
        p, n, knots = self.degree, len(self.control_points), self.knots
        start, end = knots[1] == knots[p] < knots[p + 1], knots[n - 1] < knots[n] == knots[n + p - 1]
        return bool(start and end)

    @cached_property
    def size(self) -> float:
        """Diagonal of the control points' bounding box, mm: the measure of what is small on this curve."""
        return float(np.linalg.norm(np.ptp(self.control_points, axis=0)))

    def check_parameters(self, u: ArrayLike) -> Array:
        """Check that parameters are in the domain; what is outside by rounding is clipped.

        Parameters
        ----------
        u : array_like
            Parameters (...).

        Returns
        -------
        (...) array
            The same as float64.

        Raises
        ------
        InputError
            For one that is outside by more than rounding.
        """
        start, end = self.domain
        slack = 4.0 * np.finfo(float).eps * max(abs(start), abs(end))
        return clipped(u, start, end, slack, "parameter", "the curve's domain")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Spline):
            return NotImplemented
        arrays = ((each.knots, each.control_points, each.weights) for each in (self, other))
        return self.degree == other.degree and all(map(np.array_equal, *arrays))

    def __hash__(self) -> int:
        # -0.0 equals 0.0, so it must hash like it
        return hash((self.degree, (self.knots + 0.0).tobytes(), (self.control_points + 0.0).tobytes()))

    def __reduce__(self) -> tuple[object, ...]:
        made = partial(type(self).trusted, clamped=self.clamped)
        return made, (self.degree, self.knots, self.control_points, self.weights)


def numbers(values: ArrayLike | Points, name: str, ndim: int) -> Array:
    """A read-only copy of `ndim` dimensions; CurveError for what is no number, too large, or of too many axes."""
    try:
        array = frozen_array(values, name, ndim)
        if (huge := ~(np.abs(array) <= LARGEST)).any():
            check_finite(array, name)
            place = [int(i) for i in np.argwhere(huge)[0]]
            raise CurveError(f"{name}{place} is {array[tuple(place)]:g}; values up to {LARGEST:g} are possible")
    except InputError as error:
        raise CurveError(str(error)) from None
    if ndim == 2 and not 1 <= array.shape[1] <= MAX_AXES:
        raise CurveError(f"{name} have {array.shape[1]} axes; 1 to {MAX_AXES} are possible")
    return array


def least_step(knots: Array) -> float:
    """Compute how far apart knots must be that are not equal.

    Parameters
    ----------
    knots : (k,) array
        Not decreasing.

    Returns
    -------
    float
        The least step.
    """
    return max(float(max(-knots[0], knots[-1])) * float(np.finfo(float).eps) * 16.0, 1.0 / LARGEST)


def _first(wrong: BoolArray) -> int | None:
    return int(np.argmax(wrong)) if wrong.any() else None

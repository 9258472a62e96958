"""NurbsCurve: an immutable rational B-spline of any number of axes."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves import differential, editing
from splinefeed.curves.flat import Flat
from splinefeed.curves.nearest import Nearest
from splinefeed.curves.pieces import Pieces, clipped, coefficients, columns, is_left, taylor
from splinefeed.curves.spline import MAX_AXES as MAX_AXES
from splinefeed.curves.spline import MAX_DEGREE as MAX_DEGREE
from splinefeed.curves.spline import Spline, numbers
from splinefeed.curves.tables import arc_pieces, span_pieces
from splinefeed.errors import CurveError
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE, Shape
from splinefeed.records import Array, Points, view
from splinefeed.records.arrays import chunks

#: A Taylor coefficient below this, relative to the greatest one of its piece, counts as none.
VANISHING = 1e-12
#: Where C' would take the curve less than this part of its size over a piece, it is decided whether C' counts as none.
SUSPECT = 1e-9
#: Ends closer than this, relative to the curve's size, are one point.
CLOSED_TOLERANCE = 1e-9


class NurbsCurve(Spline):
    """A NURBS curve C(u) on [knots[p], knots[n]].

    Parameters
    ----------
    degree : int
        p, 1 to 12.
    knots : (n + p + 1,) array_like
        Not decreasing; clamped, unclamped or periodic; inner multiplicity at most p.
    control_points : (n, axes) array_like
        P_i, 1 to 16 axes, mm (rotary axes rad).
    weights : (n,) array_like, optional
        w_i, positive; None for a polynomial curve.

    Raises
    ------
    CurveError
        Names the knot, point or weight that is wrong.

    Notes
    -----
    The curve is

        C(u) = sum_i N_i,p(u) w_i P_i / sum_i N_i,p(u) w_i

    All axes count as linear for its arc length; a `Path` knows which of its axes are rotary.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., eq. 4.1.

    Examples
    --------
    >>> import numpy as np
    >>> import splinefeed as sf
    >>> quarter = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[10, 0], [10, 10], [0, 10]], [1, np.sqrt(0.5), 1])
    >>> print(f"{quarter.length:.6f} mm")
    15.707963 mm
    """

    @classmethod
    def bezier(cls, control_points: Points, weights: ArrayLike | None = None) -> NurbsCurve:
        """Make one Bezier piece on [0, 1].

        Parameters
        ----------
        control_points : (degree + 1, axes) array_like
            mm (rotary axes rad).
        weights : (degree + 1,) array_like, optional
            Positive; None for a polynomial curve.

        Returns
        -------
        NurbsCurve
            The curve.

        Raises
        ------
        CurveError
            For fewer than two control points, and as the class has it.
        """
        points = numbers(control_points, "control_points", 2)
        degree = len(points) - 1
        if degree < 1:
            raise CurveError(f"{len(points)} control point(s) for a Bezier curve; expected at least 2")
        return cls(degree, [0.0] * (degree + 1) + [1.0] * (degree + 1), points, weights)

    # --- what it is -------------------------------------------------------------------------------------------------

    @cached_property
    def ends(self) -> Array:
        """First and last point (2, axes), mm."""
        if self.clamped:
            return self.control_points[[0, -1]]
        return self(np.array(self.domain))

    @cached_property
    def closed(self) -> bool:
        """Whether it ends where it begins, within 1e-9 of its size."""
        return bool(np.linalg.norm(self.ends[1] - self.ends[0]) <= CLOSED_TOLERANCE * self.size)

    def _repr_html_(self) -> str:
        kind = "rational" if self.rational else "polynomial"
        rows = {
            "NURBS curve": f"degree {self.degree}, {len(self.control_points)} control points, {kind}",
            "axes": f"{self.axes}",
            "length": f"{self.length:.6g}",
        }
        return view.table(rows, view.shape(self(np.linspace(*self.domain, view.DRAWN)), "curve"))

    def __repr__(self) -> str:
        kind = "rational" if self.rational else "polynomial"
        return (
            f"NurbsCurve(degree {self.degree}, {len(self.control_points)} control points, {self.axes} axes, {kind}, "
            f"u {self.domain[0]:g} to {self.domain[1]:g})"
        )

    # --- where it is ------------------------------------------------------------------------------------------------

    def __call__(self, u: ArrayLike) -> Array:
        """Compute points.

        Parameters
        ----------
        u : array_like
            Parameters (...).

        Returns
        -------
        (..., axes) array
            mm (rotary axes rad).

        Raises
        ------
        InputError
            For a parameter outside the domain.
        """
        return self.derivatives(u, 0)[..., 0, :]

    def derivatives(self, u: ArrayLike, order: int = 1, *, side: str = "right") -> Array:
        """Compute points and derivatives by u.

        Parameters
        ----------
        u : array_like
            Parameters (...).
        order : int, optional
            Of the highest derivative, 0 to 3.
        side : str, optional
            Which piece counts at a knot, that on its "right" or "left".

        Returns
        -------
        (..., order + 1, axes) array
            mm (rotary axes rad), by u.

        Raises
        ------
        InputError
            For an order outside 0 to 3, another side, and a parameter outside the domain.
        """
        left, values = is_left(side, order), self.check_parameters(u)
        out = self._pieces.evaluate(None, values.ravel(), order, left)
        return out.reshape(*values.shape, order + 1, self.axes)

    @property
    def table(self) -> tuple[Array, Shape]:
        """The knot spans, some in parts, as polynomial pieces (pieces, width) and their shape; see `kernels.layout`."""
        return self._pieces.table, self._shape

    @cached_property
    def _pieces(self) -> Pieces:
        return span_pieces(Flat.of([self]), self._shape)

    def tangent(self, u: ArrayLike, linear: int | None = None, side: str = "right") -> Array:
        """Compute unit tangents.

        Parameters
        ----------
        u : array_like
            Parameters (...).
        linear : int, optional
            How many of the first axes count; all by default.
        side : str, optional
            Which piece counts at a knot, that on its "right" or "left"; at the end of the domain it is the left one.

        Returns
        -------
        (..., linear) array
            Of length 1. Where C' = 0, the limit: by the first derivative that is not 0. Zero where no piece on that
            side moves.
        """
        given = self.check_parameters(u)
        values = given.ravel()
        out = self.derivatives(values, 1, side=side)[:, 1, :linear].copy()
        norm = np.linalg.norm(out, axis=1)
        table, _ = self.table
        row = self._pieces.row_at(None, values, side == "left")
        for k in np.flatnonzero(norm <= SUSPECT * self.size * table[row, SCALE]):
            out[k] = self._limit_direction(values[k], row[k], linear, side == "left" or values[k] == self.domain[1])
            norm[k] = np.linalg.norm(out[k])
        out /= np.where(norm > 0.0, norm, 1.0)[:, None]
        return out.reshape(*given.shape, out.shape[1])

    def _limit_direction(self, u: float, row: int, linear: int | None, backwards: bool) -> Array:
        """The direction (linear,) as the curve leaves u on a row, or arrives if `backwards`; zero if it does not move.

        Where C - C(u) = sum_k c_k x^k, x = t - t(u), the first c_k that is not 0 points along x^k, and with x < 0
        towards u along (-1)^(k - 1) c_k.
        """
        table, shape = self.table
        while 0 <= row < len(table):
            c = table[row, :, None]
            t = (np.clip(u, c[LOW], c[HIGH]) - c[MIDDLE]) * c[SCALE]
            steps = np.array(taylor(coefficients(c, shape), shape[3], t, self.degree))[1:, :linear, 0]
            lengths = np.linalg.norm(steps, axis=1)
            moving = np.flatnonzero(lengths > VANISHING * lengths.max())
            if len(moving):
                return np.asarray(steps[moving[0]] * (-1.0 if backwards and moving[0] % 2 else 1.0))
            row += -1 if backwards else 1  # a span that stands still
        return np.zeros(self.axes)[:linear]

    def extremes(self) -> Array:
        """Parameters (k,) at which a coordinate may be least or greatest: ends of spans and where its derivative is 0.

        x' = 0 where A' w - A w' = 0, a polynomial of degree 2p - 1 at most on every piece. Only pieces whose control
        points go beyond the ends of all spans are searched: no other goes further (The NURBS Book, 2nd ed., property
        P4.3).
        """
        table, shape = self.table
        ends, found = self(self.breaks), [self.breaks]
        first = np.searchsorted(self.knots, table[:, LOW], side="right") - 1 - self.degree
        hull = self.control_points[np.maximum(first, 0)[:, None] + np.arange(self.degree + 1)]
        beyond = (hull.max(axis=1) > ends.max(axis=0)) | (hull.min(axis=1) < ends.min(axis=0))
        rows = np.flatnonzero(beyond.any(axis=1))
        for some in chunks(len(rows)):
            c = columns(table, rows[some])
            found += [differential.zeros_on(c, slope, 1e-6)[1] for slope in differential.slopes(c, shape)]
        return np.concatenate(found)

    def bounding_box(self) -> tuple[Array, Array]:
        """Least and greatest coordinates (axes,), mm."""
        points = self(self.extremes())
        return points.min(axis=0), points.max(axis=0)

    def curvature(self, u: ArrayLike) -> Array:
        """Compute the curvature |C' x C''| / |C'|^3.

        Parameters
        ----------
        u : array_like
            Parameters (...).

        Returns
        -------
        (...) array
            1/mm; infinite where C' = 0.
        """
        return differential.curvatures(self.derivatives(u, 2))

    # --- how long it is ---------------------------------------------------------------------------------------------

    @cached_property
    def arc(self) -> Pieces:
        """The arc-length pieces of this curve, all axes linear, to 1e-13 of its length."""
        return arc_pieces(Flat.of([self]), self._shape, [self])

    @property
    def length(self) -> float:
        """Arc length, mm."""
        return self.arc.length

    def arc_length(self, u: ArrayLike) -> Array:
        """Compute the arc length S(u) from the start of the curve.

        Parameters
        ----------
        u : array_like
            Parameters (...).

        Returns
        -------
        (...) array
            mm.

        Raises
        ------
        InputError
            For a parameter outside the domain.
        """
        values = self.check_parameters(u)
        return self.arc.lengths_at(None, values.ravel()).reshape(values.shape)

    def parameter_at(self, s: ArrayLike) -> Array:
        """Find u with S(u) = s.

        Parameters
        ----------
        s : array_like
            Arc lengths (...), mm, in [0, length].

        Returns
        -------
        (...) array
            Parameters.

        Raises
        ------
        InputError
            For an arc length outside.
        """
        values = clipped(s, 0.0, self.length, 1e-12 * self.length, "arc length", "the curve's", " mm")
        return self.arc.parameters(values.ravel()).reshape(values.shape)

    def nearest(self, points: ArrayLike) -> tuple[Array, Array]:
        """Find the nearest points of the curve.

        Parameters
        ----------
        points : array_like
            Places (..., axes), mm.

        Returns
        -------
        u : (...) array
            Parameters.
        distance : (...) array
            mm.

        Raises
        ------
        InputError
            For a wrong shape or values that are not finite.
        """
        return self._nearest.find(points)[1:]

    @cached_property
    def _nearest(self) -> Nearest:
        return Nearest(self.arc.table, self.arc.shape)

    # --- the same curve in other forms ------------------------------------------------------------------------------

    reversed = editing.reversed_curve
    split = editing.split
    with_clamped_ends = editing.clamped
    with_knots = editing.with_knots
    elevated = editing.elevated
    transformed = editing.transformed

"""Joined curves as a Track: where they are at a length, with derivatives and travel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.differential import by_arc_length, curvatures
from splinefeed.curves.metric import slow_tips, tip_derivatives, tip_pieces
from splinefeed.curves.packed import Flat, Packed
from splinefeed.curves.pieces import Pieces, clipped, derivatives, is_left
from splinefeed.curves.tables import arc_pieces, span_pieces
from splinefeed.errors import InputError, LimitsError
from splinefeed.kernels.layout import HIGH, LOW
from splinefeed.paths.each_curve import Marker
from splinefeed.paths.gaps import widths
from splinefeed.paths.track import GOES, Track
from splinefeed.records import (
    ROTARY_AXES,
    Array,
    IntArray,
    Limits,
    Setpoints,
    refuse_orientation,
    unit_along,
    unit_of_axis,
)
from splinefeed.records.arrays import CHUNK, chunks

#: Travel is left by more than this share of it.
TRAVEL_KEPT = 5e-7
#: What rounding may come to, in units of a last place.
ROUNDINGS = 8.0
#: Places of every piece at which its curvature is sampled, in t.
CURVATURE_PLACES = np.linspace(-1.0, 1.0, 33)


class JoinedCurves(Track):
    """What a `Path` knows of the curves that it is made of, once they are joined: which these are is not its concern.

    Attributes
    ----------
    curves : sequence of NurbsCurve
        As they are given; `joined` are those of the motion, without gaps.
    tolerance : float
        The largest gap that is closed, mm.
    by_tip : bool
        Whether the linear axes alone make the length.
    metric : (axes,) array
        What each axis is taken times in `table`.
    units : (axes,) array
        What each axis counts in a tangent.
    markers : tuple of Marker
        Events that are not motion.
    lines : (curves,) array of int or None
        Line of a program that each curve stands on.
    """

    curves: Sequence[NurbsCurve]
    tolerance: float
    by_tip: bool
    metric: Array
    units: Array
    markers: tuple[Marker, ...]
    lines: IntArray | None
    _joined: Packed
    _weights: Array

    sided = True

    @property
    def flat(self) -> Flat:
        """All curves as arrays."""
        return self._joined.flat

    @property
    def joined(self) -> Packed:
        """The curves of the motion: `curves` without gaps and without what is smaller than the resolution."""
        return self._joined

    @property
    def ends(self) -> Array:
        """First and last point of each curve, (curves, 2, axes), mm, rotary axes rad."""
        return self._joined.ends

    @cached_property
    def gaps(self) -> tuple[float, ...]:
        """How far the end of each curve was given from the start of the next one, mm (rotary axes rad)."""
        return tuple(widths(Packed.of(self.curves).ends).tolist())

    # --- its length -------------------------------------------------------------------------------------------------

    @property
    def mixed(self) -> bool:
        """Whether linear and rotary axes both make the length, which then is not the arc length of the tip."""
        return 0 < self.linear < len(self.axes) and not self.by_tip

    @cached_property
    def shape(self) -> tuple[int, int, int, int]:
        """Highest degree, axes, axes that make the length, and whether any curve is rational: the shape of `table`."""
        measured = self.linear if self.by_tip else len(self.axes)
        return int(self.flat.degrees.max()), len(self.axes), measured, int(self.flat.rational.max())

    @cached_property
    def span_pieces(self) -> Pieces:
        """Knot spans, some in parts, as polynomial pieces, to be evaluated."""
        if self.shape[0] == 1 and not self.shape[3] and np.all(self.metric == 1.0):
            return self.arc_pieces  # a line is its own arc-length piece
        return span_pieces(self.flat, self.shape)

    @cached_property
    def arc_pieces(self) -> Pieces:
        """`table`, to be searched by length and parameter."""
        if len(self.flat) == 1 and np.all(self.weights == 1.0):
            return self._joined[0].arc
        return arc_pieces(self.flat.scaled(self.metric), self.shape, self._joined, "curve {} of the path: ")

    @property
    def table(self) -> Array:
        """All arc-length pieces of the path, every axis times its `metric`, (pieces, width); see `kernels.layout`."""
        return self.arc_pieces.table

    @property
    def curve_rows(self) -> IntArray:
        """First and last row of each curve in `table`, (curves, 2)."""
        return self.arc_pieces.rows

    @property
    def curve_starts(self) -> Array:
        """Length at which each curve starts, and the path's length at last, (curves + 1,), mm."""
        return self.arc_pieces.curve_starts

    @cached_property
    def length(self) -> float:
        """Length over all axes by the metric, mm (degrees where all axes are rotary)."""
        return float(self.curve_starts[-1])

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of all control points over the linear axes, mm."""
        return float(np.linalg.norm(np.ptp(self.flat.points[:, : self.linear], axis=0)))

    @cached_property
    def closed(self) -> bool:
        """Whether it ends where it begins, within its tolerance, over the linear axes, or over all if it has none."""
        columns = slice(self.linear or None)
        gap = self.ends[-1, 1, columns] - self.ends[0, 0, columns]
        return bool(np.linalg.norm(gap) <= max(self.tolerance, 1e-9 * self.size))

    # --- where it is ------------------------------------------------------------------------------------------------

    def locate(self, s: ArrayLike) -> tuple[IntArray, Array]:
        """Find the curve and the parameter at arc lengths.

        Parameters
        ----------
        s : array_like
            Arc lengths (...), mm.

        Returns
        -------
        curve : (...) array of int
            Index of the curve.
        u : (...) array
            Parameter on it.

        Raises
        ------
        InputError
            For an arc length outside [0, length].
        """
        values = clipped(s, 0.0, self.length, 1e-12 * self.length, "arc length", "the path's", " mm")
        flat = values.ravel()
        out = self.arc_pieces.parameters(flat)
        out[flat == self.length] = self.flat.domains[-1, 1]  # no rounding may keep a path from its end
        curve = np.clip(np.searchsorted(self.curve_starts, flat, side="right") - 1, 0, len(self.curves) - 1)
        return curve.reshape(values.shape).astype(np.int64), out.reshape(values.shape)

    def __call__(self, s: ArrayLike) -> Array:
        """Points (..., axes), mm, rotary axes rad, at arc lengths s (...), mm."""
        curve, u = self.locate(s)
        return self.evaluate(curve, u, 0)[..., 0, :]

    def evaluate(self, curve: ArrayLike, u: ArrayLike, order: int = 0, *, side: str = "right") -> Array:
        """Compute points and derivatives by u.

        Parameters
        ----------
        curve : array_like of int
            Indices (...) of curves.
        u : array_like
            Parameters (...) on them.
        order : int, optional
            Of the highest derivative, 0 to 3.
        side : str, optional
            Which piece counts at a knot, that on its "right" or "left".

        Returns
        -------
        (..., order + 1, axes) array
            mm, rotary axes rad, by u.
        """
        (index, values), left = self._places(curve, u), is_left(side, order)
        out = self.span_pieces.evaluate(index.ravel(), values.ravel(), order, left)
        return out.reshape(*values.shape, order + 1, len(self.axes))

    def derivatives(self, s: Array, row: IntArray | None = None) -> Array:
        """r and its first three derivatives by length, (n, 4, axes), at places s (n,), mm.

        On the arc-length piece on the right, or on these rows (n,) of `table`.
        """
        found = by_arc_length(self.arc_pieces.derivatives_at(s, 3, row), self.shape[2])
        return found if np.all(self.metric == 1.0) else found / self.metric

    def by_length(self, curve: IntArray, u: Array, *, side: str = "right") -> Array:
        """Compute r and its first three derivatives by length, as `derivatives`, at parameters.

        Parameters
        ----------
        curve : (n,) array of int
            Indices of curves.
        u : (n,) array
            Parameters on them.
        side : str, optional
            Which piece counts at a knot, that on its "right" or "left".

        Returns
        -------
        (n, 4, axes) array
            mm, rotary axes rad, by mm.
        """
        return by_arc_length(self.evaluate(curve, u, 3, side=side) * self.metric, self.shape[2]) / self.metric

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n) of the tip's arc length s by the path's, from `derivatives` d (n, 4, axes)."""
        return tip_derivatives(d, self.linear) if self.mixed else super().tip(d)

    def tip_length(self, s: ArrayLike) -> Array:
        """Arc length of the tip, mm (...), at places s (...), mm: over the linear axes; where none moves, degrees."""
        if not self.mixed:
            return super().tip_length(s)
        curve, u = self.locate(s)
        return self._tip_pieces.lengths_at(curve.ravel(), u.ravel()).reshape(u.shape)

    def lengths_of(self, setpoints: Setpoints) -> Array:
        """Compute the length along the path at setpoints.

        Parameters
        ----------
        setpoints : Setpoints
            On this path.

        Returns
        -------
        (n,) array
            mm: their s, or on mixed paths, where s is the tip's, by u.
        """
        if not self.mixed:
            return setpoints.s
        return self.arc_length(setpoints.curve, setpoints.u)

    def of_tip(self, s: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array, Array]:
        """Compute the motion of the tip from that along the path.

        Parameters
        ----------
        s, v, a, j : (n,) array
            Length, mm, feed, acceleration and jerk along the path, by s.

        Returns
        -------
        s, v, a, j : (n,) array
            Arc length, feed, acceleration and jerk of the tip.

        Notes
        -----
        By the chain rule

            ds/dt = s' v,  d2s/dt2 = s'' v^2 + s' a,  d3s/dt3 = s''' v^3 + 3 s'' v a + s' j
        """
        if not self.mixed:
            return s, v, a, j
        inside = np.clip(s, 0.0, self.length)
        one, two, three = self.tip(self.derivatives(inside))
        return (
            self.tip_length(inside),
            one * v,
            two * v * v + one * a,
            three * v**3 + 3.0 * two * v * a + one * j,
        )

    # --- what it is as a `Track` -------------------------------------------------------------------------------------

    @property
    def tip_path(self) -> Any:
        """The path of the tool tip: this one."""
        return self

    @property
    def weights(self) -> Array:
        """What a unit of each axis counts in the length, (axes,)."""
        return self._weights

    @property
    def tip_columns(self) -> slice:
        """The linear axes carry the tip."""
        return slice(0, self.linear)

    @property
    def alone(self) -> bool:
        """Whether a rotary axis may move while the tip stays."""
        return not self.by_tip

    @property
    def pieces(self) -> Array:
        """Where the rows of `table` begin, mm."""
        return self.arc_pieces.starts

    def positions(self, curve: IntArray, u: Array, s: Array, tip: Array) -> Array:
        """The tip's path is this one."""
        return tip

    @property
    def reach(self) -> tuple[Array, Array]:
        """Least and greatest coordinate of all control points, (axes,) each, mm or rad."""
        return self.flat.points.min(axis=0), self.flat.points.max(axis=0)

    def check_travel(self, travel: Mapping[str, tuple[float, float]]) -> None:
        """Raise LimitsError where an axis leaves its travel, mm or rad: which, how far, and at what place on the path.

        The box of a curve's control points may show that it stays inside; else its own extremes count.
        """
        if not travel:
            return
        columns = [self.axes.index(axis) for axis in travel]
        ends = np.array(list(travel.values()))
        middle, half = ends.mean(axis=1), 0.5 * np.ptp(ends, axis=1) * (1.0 + TRAVEL_KEPT)
        for index, curve in enumerate(self.curves):
            if np.all(np.abs(curve.control_points[:, columns] - middle) <= half):
                continue
            u = curve.extremes()
            points = curve(u)[:, columns]
            over = np.abs(points - middle) - half
            if not np.any(over > 0.0):
                continue
            k = int(np.argmax(np.any(over > 0.0, axis=0)))
            furthest = int(np.argmax(over[:, k]))
            position = float(points[furthest, k])
            upwards = position >= float(middle[k])
            s = float(self.tip_length(self.arc_length(index, u[furthest])))
            axis = self.axes[columns[k]]
            unit, factor = unit_of_axis(axis), np.degrees(1.0) if axis in ROTARY_AXES else 1.0
            side = "most" if upwards else "least"
            place, mend = f"at s = {s:.6g} {unit_along(self.axes)} (curve {index})", "move the path into it"
            if self.lines is not None:  # the coordinates are those of a program
                place, mend = (
                    f"in line {self.lines[index]}",
                    "say where the part lies on the machine: --offsets G54=X,Y,Z",
                )
            raise LimitsError(
                f"{GOES} {axis} = {factor * position:.6g} {unit} {place}; its travel allows at {side} "
                f"{factor * ends[k, int(upwards)]:.6g} {unit}; {mend}"
            )

    def check_limits(self, limits: Limits) -> None:
        """Raise LimitsError for a limit of a tool axis."""
        refuse_orientation(limits, self.name)

    def between_ticks(self, d: Array) -> tuple[None, None]:
        """Setpoints are joined by straight lines: the path's curvature counts."""
        return None, None

    def chords(self, s: Array, r: Array, places: Array) -> tuple[IntArray, Array, None]:
        """Chords (n,) between setpoints r (k, axes) at s (k,), and how far the path leaves them, mm.

        It is looked at in three places of every chord, where a parabola through these is highest, and at `places`
        (m,), mm.
        """
        steps, start, chord = np.arange(len(s) - 1), r[:, : self.linear], np.diff(r[:, : self.linear], axis=0)

        def away(at: Array, step: IntArray) -> Array:
            off, way = self(at)[:, : self.linear] - start[step], chord[step]
            along = np.sum(off * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-300)
            return np.asarray(np.linalg.norm(off - np.clip(along, 0.0, 1.0)[:, None] * way, axis=1))

        def inside(share: Array | float) -> Array:
            return np.asarray(s[:-1] + share * np.diff(s))

        low, middle, high = (away(inside(share), steps) for share in (0.25, 0.5, 0.75))
        with np.errstate(divide="ignore", invalid="ignore"):
            peak = 0.5 + 0.125 * (low - high) / (low - 2.0 * middle + high)
        highest = away(inside(np.clip(np.nan_to_num(peak, nan=0.5), 0.25, 0.75)), steps)
        of_steps = np.max([low, middle, high, highest], axis=0)
        places = places[(places > s[0]) & (places < s[-1])]
        step = np.clip(np.searchsorted(s, places, side="right") - 1, 0, len(s) - 2)
        return np.concatenate([steps, step]), np.concatenate([of_steps, away(places, step)]), None

    def rounding(self, s: Array, r: Array) -> Array:
        """Roundings of positions as large as r (n, axes), and of the path's length on the axes of the tip, (n, axes).

        Where much length lies between two knots, that of the parameter is more: eps |u| |dr/du|.
        """
        size = np.max(np.abs(r), axis=0)
        size[: self.linear] = np.maximum(size[: self.linear], self.length)
        table, row = self.arc_pieces.table, self.arc_pieces.row_by_length(s)
        low, high = table[row, LOW], table[row, HIGH]
        of_u = np.finfo(float).eps * np.maximum(np.abs(low), np.abs(high)) * self.arc_pieces.lengths[row] / (high - low)
        return np.asarray(np.maximum(ROUNDINGS * np.spacing(size), of_u[:, None] / self.metric))

    @cached_property
    def tip_end(self) -> float:
        """Arc length of the tip at the end, mm (degrees where all axes are rotary): what people call the length."""
        return float(self.tip_length(self.length))

    @cached_property
    def slow_tips(self) -> Array:
        """Places (k,), mm, at which the tip is slowest while other axes move: s'' all but jumps there."""
        return slow_tips(self.derivatives, self.arc_pieces, self.linear) if self.mixed else np.zeros(0)

    @cached_property
    def _tip_pieces(self) -> Pieces:
        return tip_pieces(self.flat, self.linear, self._joined)

    def arc_length(self, curve: ArrayLike, u: ArrayLike) -> Array:
        """Compute the length along the path at parameters.

        Parameters
        ----------
        curve : array_like of int
            Indices (...) of curves.
        u : array_like
            Parameters (...) on them.

        Returns
        -------
        (...) array
            mm.
        """
        index, values = self._places(curve, u)
        return self.arc_pieces.lengths_at(index.ravel(), values.ravel()).reshape(values.shape)

    def _places(self, curve: ArrayLike, u: ArrayLike) -> tuple[IntArray, Array]:
        """Curve indices and parameters in one shape; InputError for an unknown curve or a u outside of its domain."""
        index, values = np.broadcast_arrays(np.asarray(curve, dtype=np.int64), np.asarray(u, dtype=np.float64))
        missing = (index < 0) | (index >= len(self.curves))
        if np.any(missing):
            raise InputError(
                f"curve {index[missing].flat[0]} does not exist; the path has curves 0 to {len(self.curves) - 1}"
            )
        start, end = np.moveaxis(self.flat.domains[index], -1, 0)
        slack = 4.0 * np.finfo(float).eps * np.maximum(np.abs(start), np.abs(end))
        return index, clipped(values, start, end, slack, "parameter", "the curve's domain")

    def bounding_box(self) -> tuple[Array, Array]:
        """Least and greatest coordinates (axes,), mm, rotary axes rad."""
        flat = self.flat
        low, high = self.ends.min(axis=(0, 1)), self.ends.max(axis=(0, 1))
        lows = np.minimum.reduceat(flat.points, flat.point_starts[:-1])
        highs = np.maximum.reduceat(flat.points, flat.point_starts[:-1])
        for i in np.flatnonzero(np.any((lows < low) | (highs > high), axis=1)):
            if np.any((lows[i] < low) | (highs[i] > high)):  # most others lie within the box that is there already
                box = self._joined[int(i)].bounding_box()
                low, high = np.minimum(low, box[0]), np.maximum(high, box[1])
        return low, high

    @cached_property
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Where the tool waits and how long, (mm, s), in order; dwells at one place are summed."""
        waits: dict[float, float] = {}
        for marker in self.markers:
            if marker.dwell > 0.0:
                s = float(self.curve_starts[marker.before])
                waits[s] = waits.get(s, 0.0) + marker.dwell
        return tuple(sorted(waits.items()))

    def minimum_radius(self) -> float:
        """Least radius of curvature, mm, over a sampling of every arc-length piece; infinite for straight lines."""
        degree, _, _, rational = self.shape
        table, top = self.table, 0.0
        for part in chunks(len(table) if degree > 1 or rational else 0, CHUNK // len(CURVATURE_PLACES)):
            c = np.repeat(table[part].T, len(CURVATURE_PLACES), axis=1)
            d = np.empty((c.shape[1], 3, len(self.axes)))
            derivatives(c, self.shape, np.tile(CURVATURE_PLACES, len(table[part])), 2, d)
            bend = curvatures(d, self.linear)
            top = max(top, float(np.max(bend, initial=0.0, where=np.isfinite(bend))))
        return 1.0 / top if top > 0.0 else float("inf")

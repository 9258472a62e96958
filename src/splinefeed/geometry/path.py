"""Path: curves joined end to end, with axis names, its arc length over the linear axes, and its corners."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.arc_length import ArcLength
from splinefeed.geometry.curve import MAX_AXES, NurbsCurve
from splinefeed.geometry.differential import curvatures, cusps, unit_tangents
from splinefeed.kernels import arc_length as arc_kernels
from splinefeed.kernels import pieces
from splinefeed.records import ROTARY_AXES, Array, BoolArray, IntArray, frozen_array

DEFAULT_AXES = ("x", "y", "z", "a", "b", "c")
#: Ends of neighbouring curves further apart than this, mm, are a gap unless the caller allows more.
JOIN_TOLERANCE = 1e-6
#: A tangent that turns by more than this at one point, rad, is a corner. Below it is the rounding of CAD files.
CORNER_ANGLE = 1e-6
#: A corner that turns by more than this, rad, cannot be taken in motion: the tool rests there.
STOP_ANGLE = 1e-4
#: A speed below this, relative to size over width of the domain, counts as none: the curvature there is no number.
STILL = 1e-9
#: Corners less than this apart, relative to the length of the path, are one.
SAME_PLACE = 1e-14
#: A curvature jump below this, relative to the curvature itself and to 1 / size, is rounding.
CURVATURE_JUMP = 1e-6


@dataclass(frozen=True)
class Corner:
    """A point of the path where tangent or curvature jumps.

    s  mm; curve, u  where (the end of `curve` if between two); angle  of the tangents, rad;
    curvature_jump  length of the change of the curvature vector, 1/mm; infinite where C' = 0 on one side
    """

    s: float
    curve: int
    u: float
    angle: float
    curvature_jump: float

    @property
    def stop(self) -> bool:
        """Whether the tool must rest here."""
        return self.angle > STOP_ANGLE


@dataclass(frozen=True)
class Marker:
    """What a program says between two moves, such as M3 S12000 or a dwell.

    before  index of the curve that it stands before; the number of curves for what stands at the end
    text    the words as they are written again; dwell  time at rest, s; stop  whether the tool rests here at all
    """

    before: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.dwell < math.inf:
            raise InputError(f"a dwell of {self.dwell!r} s; it must be 0 or more and finite")
        if self.dwell > 0.0 and not self.stop:
            raise InputError(f"a dwell of {self.dwell:g} s without a stop; the tool can only wait at rest")


class Path:
    """Curves joined end to end.

    curves      one or more NurbsCurve of the same number of axes, each beginning where the last one ends
    axes        one name an axis, linear ones (any name) first, rotary ones (a, b, c, theta) behind them
    name        what files and figures call it; findings  what a reader had to say of it, one sentence each
    tolerance   the gap that is still no gap, mm (rotary axes rad)
    feeds       (curves,) wanted feed of each curve, mm/s, infinite for a rapid move; None if nothing is said
    tolerances  (curves,) how far smoothing may leave each curve, mm (G64 P), 0 for exact; None if nothing is said
    markers     what is no motion, at its place; kept in the order of the places

    Raises CurveError that names the curve, for a gap or for axes that do not fit; InputError for feeds, tolerances or
    markers that do not fit the curves.
    """

    def __init__(
        self,
        curves: Iterable[NurbsCurve],
        axes: Sequence[str] | None = None,
        *,
        name: str = "path",
        findings: Sequence[str] = (),
        tolerance: float = JOIN_TOLERANCE,
        feeds: ArrayLike | None = None,
        tolerances: ArrayLike | None = None,
        markers: Iterable[Marker] = (),
    ) -> None:
        try:
            self.curves = tuple(curves)
        except TypeError:
            raise CurveError(f"curves are a {type(curves).__name__}; a list of NurbsCurve is needed") from None
        self.name = name
        self.findings = tuple(findings)
        self.tolerance = float(tolerance)
        if not self.tolerance >= 0.0:
            raise InputError(f"tolerance is {self.tolerance:g} mm; it must be 0 or more")
        if not self.curves:
            raise CurveError("a path needs at least one curve")
        for i, curve in enumerate(self.curves):
            if not isinstance(curve, NurbsCurve):
                raise CurveError(f"curve {i} of the path is a {type(curve).__name__}; a NurbsCurve is needed")
            if curve.axes != self.curves[0].axes:
                raise CurveError(f"curve {i} has {curve.axes} axes, curve 0 has {self.curves[0].axes}; all must agree")
        count = self.curves[0].axes
        self.axes = tuple(DEFAULT_AXES[:count] if axes is None else axes)
        if len(self.axes) != count or len(set(self.axes)) != count or count > MAX_AXES:
            raise CurveError(f"axes {self.axes} for curves of {count} axes; one distinct name each is needed")
        rotary = [axis in ROTARY_AXES for axis in self.axes]
        self.linear = count - sum(rotary)
        if rotary != sorted(rotary):
            raise CurveError(
                f"axes {self.axes}: put the linear axes first and the rotary ones ({', '.join(ROTARY_AXES)}) last"
            )
        if self.linear == 0:
            raise CurveError(f"axes {self.axes}: at least one linear axis is needed")
        self._check_joints()
        self.feeds = self._of_curves(feeds, "feeds", "greater than 0", lambda values: values > 0.0)
        self.tolerances = self._of_curves(tolerances, "tolerances", "0 or more", lambda values: values >= 0.0)
        self.markers = tuple(sorted(markers, key=lambda marker: marker.before))
        for marker in self.markers:
            if not 0 <= marker.before <= len(self.curves):
                raise InputError(f"marker {marker.text!r} stands before curve {marker.before} of {len(self.curves)}")
        self._made = True

    def __setattr__(self, name: str, value: object) -> None:
        if "_made" in self.__dict__:
            raise AttributeError(f"a Path cannot be changed: tried to set {name!r}; make a new one")
        super().__setattr__(name, value)

    def __reduce__(self) -> tuple[object, ...]:
        return partial(Path, **self._said(), tolerance=self.tolerance), (self.curves, self.axes)

    def _said(self) -> dict[str, Any]:
        """What a path is made with besides its curves and axes."""
        return {
            "name": self.name,
            "findings": self.findings,
            "feeds": self.feeds,
            "tolerances": self.tolerances,
            "markers": self.markers,
        }

    def _of_curves(
        self, given: ArrayLike | None, name: str, wanted: str, fits: Callable[[Array], BoolArray]
    ) -> Array | None:
        """One number a curve, (curves,), read-only; InputError for a number that does not fit."""
        if given is None:
            return None
        values = frozen_array(given, name, 1)
        if len(values) != len(self.curves):
            raise InputError(f"{name} has {len(values)} numbers for {len(self.curves)} curves; give one each")
        wrong = ~fits(values)
        if np.any(wrong):
            i = int(np.argmax(wrong))
            raise InputError(f"{name}[{i}] is {values[i]:g}; it must be {wanted}")
        return values

    def _check_joints(self) -> None:
        ends = np.array([c.ends for c in self.curves])
        ends.setflags(write=False)
        gaps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
        if np.any(gaps > self.tolerance):
            i = int(np.argmax(gaps > self.tolerance))
            raise CurveError(
                f"gap of {gaps[i]:.6g} mm between the end of curve {i} and the start of curve {i + 1}; "
                f"join them, or allow it with tolerance="
            )
        self._ends = ends
        self.gaps = tuple(float(g) for g in gaps)

    # --- its length -------------------------------------------------------------------------------------------------

    @cached_property
    def shape(self) -> tuple[int, int, int, int]:
        """Highest degree, axes, linear axes, and whether any curve is rational: the shape of `table`."""
        degree = max(c.degree for c in self.curves)
        return degree, len(self.axes), self.linear, int(any(c.rational for c in self.curves))

    @cached_property
    def _tables(self) -> tuple[Array, IntArray, Array]:
        """All arc-length pieces (pieces, width), first and last row of each curve, and where each curve starts, mm."""
        axes = len(self.axes)
        tables = []
        rows = np.empty((len(self.curves), 2), dtype=np.int64)
        starts = np.empty(len(self.curves) + 1)
        row = 0
        start = lost = 0.0
        for i, curve in enumerate(self.curves):
            try:
                arc = curve.arc if self.linear == axes else ArcLength(curve, self.linear)
            except CurveError as error:
                raise CurveError(f"curve {i} of the path: {error}") from None
            table = _widened(arc.table, arc.shape, self.shape)
            table[:, pieces.START] += start
            starts[i] = start
            tables.append(table)
            rows[i] = row, row + len(table) - 1
            row += len(table)
            step = arc.length - lost  # Kahan, so that a long path keeps its last digit
            after = start + step
            lost = (after - start) - step
            start = after
        starts[-1] = start
        whole = np.ascontiguousarray(np.concatenate(tables))
        for array in (whole, rows, starts):
            array.setflags(write=False)
        return whole, rows, starts

    @property
    def table(self) -> Array:
        """All arc-length pieces of the path, (pieces, width), in the shape of the path; see `kernels.pieces`."""
        return self._tables[0]

    @property
    def curve_rows(self) -> IntArray:
        """First and last row of each curve in `table`, (curves, 2)."""
        return self._tables[1]

    @property
    def curve_starts(self) -> Array:
        """Arc length at which each curve starts, and the path's length at last, (curves + 1,), mm."""
        return self._tables[2]

    @cached_property
    def length(self) -> float:
        """Arc length over the linear axes, mm."""
        return float(self.curve_starts[-1])

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of all control points over the linear axes, mm."""
        points = np.concatenate([c.control_points[:, : self.linear] for c in self.curves])
        return float(np.linalg.norm(np.ptp(points, axis=0)))

    @cached_property
    def closed(self) -> bool:
        """Whether it ends where it begins, within its tolerance, over the linear axes."""
        gap = self._ends[-1, 1, : self.linear] - self._ends[0, 0, : self.linear]
        return bool(np.linalg.norm(gap) <= max(self.tolerance, 1e-9 * self.size))

    # --- where it is ------------------------------------------------------------------------------------------------

    def locate(self, s: ArrayLike) -> tuple[IntArray, Array]:
        """Curve index and parameter (...) at arc lengths s (...), mm; InputError outside [0, length]."""
        values = np.asarray(s, dtype=np.float64)
        slack = 1e-12 * self.length
        outside = ~((values >= -slack) & (values <= self.length + slack))
        if np.any(outside):
            raise InputError(f"arc length {values[outside].flat[0]:g} mm is outside the path's [0, {self.length:g}] mm")
        flat = np.clip(values, 0.0, self.length).ravel()
        table = self.table
        out = np.empty(flat.size)
        arc_kernels.parameters_at(table, 0, len(table) - 1, flat, out)
        out[flat == self.length] = self.curves[-1].domain[1]  # not a rounding may keep a path from its end
        curve = np.clip(np.searchsorted(self.curve_starts, flat, side="right") - 1, 0, len(self.curves) - 1)
        return curve.reshape(values.shape).astype(np.int64), out.reshape(values.shape)

    def __call__(self, s: ArrayLike) -> Array:
        """Points (..., axes), mm, rotary axes rad, at arc lengths s (...), mm."""
        curve, u = self.locate(s)
        return self.evaluate(curve, u, 0)[..., 0, :]

    def evaluate(self, curve: ArrayLike, u: ArrayLike, order: int = 0, *, side: str = "right") -> Array:
        """Points and derivatives by u, (..., order + 1, axes), at parameters u (...) of the curves `curve` (...).

        At a knot the piece on its right is taken, or with side="left" the one on its left.
        """
        index, values = self._places(curve, u)
        if len(self.curves) == 1:
            return self.curves[0].derivatives(values, order, side=side)
        out = np.empty((*values.shape, order + 1, len(self.axes)))
        flat = out.reshape(values.size, order + 1, len(self.axes))
        by_curve = np.argsort(index, axis=None, kind="stable")
        which, first = np.unique(index.ravel()[by_curve], return_index=True)
        for i, at in zip(which, np.split(by_curve, first)[1:], strict=True):
            flat[at] = self.curves[i].derivatives(values.ravel()[at], order, side=side)
        return out

    def arc_length(self, curve: ArrayLike, u: ArrayLike) -> Array:
        """Arc length along the path, mm, (...), at parameters u (...) of the curves `curve` (...)."""
        index, values = self._places(curve, u)
        out = np.empty(values.size)
        rows = self.curve_rows[index.ravel()]
        arc_kernels.lengths_on(self.table, rows, values.ravel(), out)
        return out.reshape(values.shape)

    def _places(self, curve: ArrayLike, u: ArrayLike) -> tuple[IntArray, Array]:
        """Curve indices and parameters in one shape; InputError for a curve that is not there or a u outside of it."""
        index, values = np.broadcast_arrays(np.asarray(curve, dtype=np.int64), np.asarray(u, dtype=np.float64))
        missing = (index < 0) | (index >= len(self.curves))
        if np.any(missing):
            raise InputError(
                f"curve {index[missing].flat[0]} is not there; the path has curves 0 to {len(self.curves) - 1}"
            )
        start, end = np.moveaxis(self._domains[index], -1, 0)
        slack = 4.0 * np.finfo(float).eps * np.maximum(np.abs(start), np.abs(end))
        outside = ~((values >= start - slack) & (values <= end + slack))
        if np.any(outside):
            k = int(np.flatnonzero(outside)[0])
            low, high = self.curves[int(index.flat[k])].domain
            raise InputError(f"parameter {values.flat[k]:g} is outside the curve's domain [{low:g}, {high:g}]")
        return index, np.clip(values, start, end)

    @cached_property
    def _domains(self) -> Array:
        """First and last parameter of each curve, (curves, 2)."""
        return np.array([c.domain for c in self.curves])

    def bounding_box(self) -> tuple[Array, Array]:
        """Least and greatest coordinates (axes,), mm, rotary axes rad."""
        boxes = [c.bounding_box() for c in self.curves]
        return np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)

    @cached_property
    def corners(self) -> tuple[Corner, ...]:
        """Points inside the path where tangent or curvature jumps, in order of s; a cusp is one of pi."""
        found: list[Corner] = []
        for i, curve in enumerate(self.curves):
            inner = curve.breaks[1:-1]
            if inner.size:
                left, right = (self._turn(curve, inner, side) for side in ("left", "right"))
                times = np.searchsorted(curve.knots, inner, "right") - np.searchsorted(curve.knots, inner, "left")
                rough = (times >= curve.degree - 1) | np.isnan(left[1][:, 0]) | np.isnan(right[1][:, 0])
                found += self._jumps(i, inner, left, right, rough)
            if curve.degree > 1:
                grid = self.table[self.curve_rows[i, 0] : self.curve_rows[i, 1] + 1]
                at = cusps(curve, np.append(grid[:, pieces.LOW], grid[-1, pieces.HIGH]), self.linear)
                found += [
                    Corner(float(s), i, float(u), float(np.pi), float("inf"))
                    for s, u in zip(self.arc_length(np.full(len(at), i), at), at, strict=True)
                ]
                found.sort(key=lambda corner: (corner.curve, corner.u))
            if i < len(self.curves) - 1:
                after = self.curves[i + 1]
                end, start = np.array([curve.domain[1]]), np.array([after.domain[0]])
                left, right = self._turn(curve, end, "left"), self._turn(after, start, "right")
                found += self._jumps(i, end, left, right, np.array([True]))
        # a point that is given twice, or a span that stands still, is one corner and not two
        apart = [k for k in range(len(found)) if k == 0 or found[k].s - found[k - 1].s > SAME_PLACE * self.length]
        return tuple(found[k] for k in apart)

    def _turn(self, curve: NurbsCurve, u: Array, side: str) -> tuple[Array, Array]:
        """Unit tangents and curvature vectors (n, linear) of a curve at u (n,); no numbers (NaN) where C' = 0."""
        first, second = np.moveaxis(curve.derivatives(u, 2, side=side)[:, 1:, : self.linear], 1, 0)
        square = np.sum(first * first, axis=1, keepdims=True)
        still = np.sqrt(square) <= STILL * curve.size / (curve.domain[1] - curve.domain[0])
        safe = np.where(still, 1.0, square)
        bends = (second - np.sum(first * second, axis=1, keepdims=True) / safe * first) / safe
        tangents = unit_tangents(curve, u, self.linear, side) if np.any(still) else first / np.sqrt(safe)
        return tangents, np.where(still, np.nan, bends)

    def _jumps(
        self, index: int, u: Array, left: tuple[Array, Array], right: tuple[Array, Array], rough: BoolArray
    ) -> list[Corner]:
        """Corners among the points u (n,) of curve `index`, where `rough`, with what `_turn` says of both sides."""
        (tangent, bend), (next_tangent, next_bend) = left, right
        # 2 atan2 of difference and sum keeps small and straight-back angles alike to rounding
        angle = 2.0 * np.arctan2(
            np.linalg.norm(next_tangent - tangent, axis=1), np.linalg.norm(next_tangent + tangent, axis=1)
        )
        jump = np.linalg.norm(next_bend - bend, axis=1)
        floor = CURVATURE_JUMP * (1.0 / self.size + np.linalg.norm(bend, axis=1) + np.linalg.norm(next_bend, axis=1))
        corner = rough & ((angle > CORNER_ANGLE) | (jump > floor))
        s = self.arc_length(np.full(len(u), index), u)
        jump = np.where(np.isnan(jump), np.inf, jump)
        return [
            Corner(float(s[k]), index, float(u[k]), float(angle[k]), float(jump[k])) for k in np.flatnonzero(corner)
        ]

    @cached_property
    def stops(self) -> tuple[float, ...]:
        """Arc lengths strictly inside the path, mm, increasing, at which the tool must rest.

        Corners of the tangent, and markers that ask for rest.
        """
        corners = {c.s for c in self.corners if c.stop}
        markers = {float(self.curve_starts[marker.before]) for marker in self.markers if marker.stop}
        return tuple(sorted(s for s in corners | markers if 0.0 < s < self.length))

    @cached_property
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Where the tool waits and how long, (mm, s), in order; all that is said of one place in one sum."""
        waits: dict[float, float] = {}
        for marker in self.markers:
            if marker.dwell > 0.0:
                s = float(self.curve_starts[marker.before])
                waits[s] = waits.get(s, 0.0) + marker.dwell
        return tuple(sorted(waits.items()))

    def minimum_radius(self) -> float:
        """Least radius of curvature, mm, over a sampling of every arc-length piece; infinite for straight lines."""
        degree, _, linear, rational = self.shape
        if degree == 1 and not rational:
            return float("inf")
        top = 0.0
        for i, curve in enumerate(self.curves):
            rows = self.table[self.curve_rows[i, 0] : self.curve_rows[i, 1] + 1]
            fractions = np.linspace(0.0, 1.0, 33)
            u = rows[:, pieces.LOW, None] + fractions * (rows[:, pieces.HIGH] - rows[:, pieces.LOW])[:, None]
            kappa = curvatures(curve.derivatives(u.ravel(), 2), linear)
            finite = kappa[np.isfinite(kappa)]
            top = max(top, float(finite.max())) if finite.size else top
        return 1.0 / top if top > 0.0 else float("inf")

    def transformed(self, matrix: ArrayLike, offset: ArrayLike | None = None) -> Path:
        """The affine image of every curve; see `NurbsCurve.transformed`."""
        return Path([c.transformed(matrix, offset) for c in self.curves], self.axes, **self._said())

    def reversed(self) -> Path:
        """The same path run through from its end to its start, feeds and markers turned with it."""
        count = len(self.curves)
        turned = {
            "feeds": None if self.feeds is None else self.feeds[::-1],
            "tolerances": None if self.tolerances is None else self.tolerances[::-1],
            "markers": [dataclasses.replace(m, before=count - m.before) for m in reversed(self.markers)],
        }
        curves = [c.reversed() for c in reversed(self.curves)]
        return Path(curves, self.axes, **{**self._said(), **turned}, tolerance=self.tolerance)

    def __repr__(self) -> str:
        return f"Path({self.name!r}, {len(self.curves)} curve(s), axes {' '.join(self.axes)}, {self.length:.6g} mm)"


def _widened(table: Array, shape: tuple[int, int, int, int], wanted: tuple[int, int, int, int]) -> Array:
    """A copy of `table` in a shape of the same axes, of a degree at least as high and at least as rational."""
    if shape == wanted:
        return table.copy()
    out = np.zeros((len(table), pieces.width(wanted)))
    axes = shape[1]
    first = pieces.ORIGIN + axes
    out[:, :first] = table[:, :first]
    given = table[:, first:].reshape(len(table), axes + shape[3], shape[0] + 1)
    room = out[:, first:].reshape(len(table), axes + wanted[3], wanted[0] + 1)
    room[:, : axes + shape[3], : shape[0] + 1] = given
    if wanted[3] and not shape[3]:
        room[:, axes, 0] = 1.0
    return out

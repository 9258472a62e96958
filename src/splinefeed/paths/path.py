"""Path: curves joined end to end, with axis names, its length over all axes, and its corners."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import MAX_AXES, NurbsCurve
from splinefeed.curves.differential import by_arc_length, curvatures, extremes
from splinefeed.curves.editing import moved_points
from splinefeed.curves.metric import metric_of, slow_tips, tip_derivatives, tip_pieces
from splinefeed.curves.packed import Flat, Lines, Packed, lines_with_length
from splinefeed.curves.pieces import Pieces, clipped, derivatives, is_left
from splinefeed.curves.tables import arc_pieces, span_pieces
from splinefeed.errors import CurveError, InputError, LimitsError
from splinefeed.paths.corners import CORNER_ANGLE as CORNER_ANGLE
from splinefeed.paths.corners import Corner as Corner
from splinefeed.paths.corners import Corners, find_corners, sharp_bends
from splinefeed.paths.gaps import begun_at, closed, open_joints, said_of
from splinefeed.paths.resolution import RESOLUTION, chosen, long_curves, resolved
from splinefeed.paths.track import GOES, Track
from splinefeed.records import (
    ROTARY_AXES,
    Array,
    BoolArray,
    IntArray,
    Limits,
    Points,
    Setpoints,
    frozen_array,
    refuse_orientation,
    unit_along,
    unit_of_axis,
    view,
)
from splinefeed.records.arrays import CHUNK, chunks, read_only

#: What differs by less than this share of the path's length is the same place.
SAME = 1e-12
#: Travel is left by more than this share of it.
TRAVEL_KEPT = 5e-7
#: What rounding may come to, in units of a last place.
ROUNDINGS = 8.0
#: What is said of each curve.
_OF_EACH = ("feeds", "tolerances", "lines", "times")
#: Places of every piece at which its curvature is sampled, in t.
CURVATURE_PLACES = np.linspace(-1.0, 1.0, 33)
DEFAULT_AXES = ("x", "y", "z", "a", "b", "c")
#: More axes than this without names are joints of an arm, q1 and so on: all alike.
MOST_UNNAMED = 3
#: Ends of neighbouring curves further apart than this, mm, are a gap by default.
JOIN_TOLERANCE = RESOLUTION


@dataclasses.dataclass(frozen=True)
class Marker:
    """A command of a program between two moves, such as M3 S12000 or a dwell.

    before  index of the curve that follows it; the number of curves at the end
    text    its words, as they are written; dwell  time at rest, s; stop  whether the tool stops here
    A Path raises InputError for a marker outside it. Source: docs/gcode.md. Example: `sf.paths.Marker(0, "M3 S12000")`
    """

    before: int
    text: str = ""
    dwell: float = 0.0
    stop: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.dwell < math.inf:
            raise InputError(f"a dwell of {self.dwell!r} s; it must be 0 or more and finite")
        if self.dwell > 0.0 and not self.stop:
            raise InputError(f"a dwell of {self.dwell:g} s without a stop; the tool can wait only at rest")


class Path(Track):
    """Curves joined end to end.

    curves      NurbsCurves of the same number of axes, each beginning where the last one ends; also Lines or Packed
    axes        one name an axis, linear ones (any name) first, rotary ones (a, b, c, theta) behind them; without names
                up to three are x, y, z, and more are joints q1, q2, ..., all in one unit and all under one rule
    name        its name in files and figures; findings  remarks of its reader, one sentence each
    tolerance   the largest gap that is closed, mm (rotary axes rad): the motion closes it, see
                `paths.gaps.closed`; `curves` stay as they are given
    feeds       (curves,) wanted feed of each curve, mm/s, infinite for a rapid move; None if nothing is said
    tolerances  (curves,) how far smoothing may leave each curve, mm (G64 P), 0 for exact; None if nothing is said
    markers     events that are not motion, with their places, in order
    lines       (curves,) line of a program that each curve stands on; None where it is of none
    times       (curves,) wanted time when each curve ends, s, NaN where any will do; None if nothing is wanted. `plan`
                slows the motion down to it; paths made from this one do not have it
    by_tip      whether the linear axes alone make the length, as rotary ones never move alone: see `tangential`

    Features below the resolution, 1 nm, are decided once, here (`paths.resolution`): a curve shorter than that
    beside a long one is left out with a finding, its feed and tolerance with it, and curves are numbered, markers and
    dwells placed, as if it did not exist. A curve with a cusp, or a bend as sharp as one, stays one curve
    on the same domain; next to the tip `joined`, what is moved along, leaves `curves` by 1 nm at most, and at the tip
    it has a corner, where motion stops.

    The length along it counts all axes: linear ones as they are, rotary ones beside them by 50 mm a rad. Where all
    axes are rotary, 1 mm is 1 degree: a feed of 60 mm/s is 60 degrees a second there. The tip's arc length, over the
    linear axes, is `tip_length`; setpoints, reports and the command line count that.

    Raises CurveError that names the curve, for a gap or for axes that do not fit; InputError for feeds, tolerances or
    markers that do not fit the curves.
    Called with arc lengths s (...), mm, it gives points (..., axes), mm, rotary axes rad.
    Source: The NURBS Book, 2nd ed., chapter 4, for its curves. Example: `sf.Path([curve], name="quarter")(0.0)`
    """

    #: Whether something else is given for each curve over the same parameters: then tips become corners, and no more.
    _tied = False

    sided = True

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
        lines: ArrayLike | None = None,
        times: ArrayLike | None = None,
        by_tip: bool = False,
    ) -> None:
        try:
            self.curves: Sequence[NurbsCurve] = curves if isinstance(curves, Packed) else tuple(curves)
        except TypeError:
            raise CurveError(f"curves are a {type(curves).__name__}; expected a list of NurbsCurve") from None
        self._joined: Sequence[NurbsCurve] = self.curves
        self.name = name
        self.findings = tuple(findings)
        self.tolerance = float(tolerance)
        if not self.tolerance >= 0.0:
            raise InputError(f"tolerance is {self.tolerance:g} mm; it must be 0 or more")
        if not self.curves:
            raise CurveError("a path needs at least one curve")
        for i, curve in enumerate(() if isinstance(curves, Packed) else self.curves):
            if not isinstance(curve, NurbsCurve):
                raise CurveError(f"curve {i} of the path is a {type(curve).__name__}; expected a NurbsCurve")
            if curve.axes != self.curves[0].axes:
                raise CurveError(f"curve {i} has {curve.axes} axes, curve 0 has {self.curves[0].axes}; all must agree")
        self.axes = tuple(default_axes(self.curves[0].axes) if axes is None else axes)
        self.linear = checked_axes(self.axes, self.curves[0].axes)
        self.by_tip = by_tip and 0 < self.linear < len(self.axes)
        #: What each axis counts in the length, see `weights`, and what it is taken times in `table`, (axes,).
        self._weights = read_only(metric_of(len(self.axes), self.linear, by_tip=self.by_tip))
        self.metric = read_only(np.where(self.weights > 0.0, self.weights, 1.0))
        #: What each axis counts in a tangent, (axes,).
        self.units = read_only(metric_of(len(self.axes), self.linear))
        count = len(self.curves)
        self.feeds = _of_curves(feeds, count, "feeds", "greater than 0", lambda values: values > 0.0)
        self.tolerances = _of_curves(tolerances, count, "tolerances", "0 or more", lambda values: values >= 0.0)
        of_each = _of_curves(lines, count, "lines", "0 or more", lambda values: values >= 0.0)
        self.lines = None if of_each is None else read_only(of_each.astype(np.int64))
        self.times = _of_times(times, count)
        self.markers = tuple(sorted(markers, key=lambda marker: marker.before))
        for marker in self.markers:
            if not 0 <= marker.before <= count:
                raise InputError(f"marker {marker.text!r} is before curve {marker.before} of {count}")
        if count > 1:
            _check_joints(self.ends, self.tolerance)
            if not self._tied:
                self._leave_out_points()
            self._close_gaps()
        self._move_along(resolved(self._joined, self.flat, self.weights, in_place=self._tied))
        self._made = True

    def _close_gaps(self) -> None:
        """Let each curve of the motion begin where the last one ends; `curves` stay as they were given."""
        if isinstance(self.curves, Lines) or not np.any(open_joints(self.ends)):
            return
        self.findings += tuple(each for each in said_of(self.gaps, JOIN_TOLERANCE) if each not in self.findings)
        self._move_along(closed(self.curves, self.ends, self.linear))

    def _leave_out_points(self) -> None:
        """Leave out the curves that are shorter than the resolution, with their feeds and tolerances."""
        kept = long_curves(self.curves, self.flat, self.weights, self.tolerance)
        if kept is None:
            return
        count = len(self.curves) - len(kept)
        first = int(np.argmax(np.append(kept, -1) != np.arange(len(kept) + 1)))
        self.findings += (f"{count} curve(s) shorter than {1e6 * RESOLUTION:g} nm left out, the first curve {first}",)
        self.curves = chosen(self.curves, kept)
        self._move_along(self.curves)
        for name, value in _kept(self._said(), kept).items():
            setattr(self, name, value)

    def _move_along(self, curves: Sequence[NurbsCurve]) -> None:
        if curves is not self._joined:
            self._joined = curves
            for name in ("flat", "ends"):
                self.__dict__.pop(name, None)

    def __setattr__(self, name: str, value: object) -> None:
        if "_made" in self.__dict__:
            raise AttributeError(f"a Path cannot be changed: tried to set {name!r}; make a new one")
        super().__setattr__(name, value)

    def __reduce__(self) -> tuple[object, ...]:
        return partial(Path, **self._said()), (self.curves, self.axes)

    def _said(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "findings": self.findings,
            "feeds": self.feeds,
            "tolerances": self.tolerances,
            "markers": self.markers,
            "lines": self.lines,
            "times": self.times,
            "tolerance": self.tolerance,
            "by_tip": self.by_tip,
        }

    @classmethod
    def polyline(cls, points: Points, axes: Sequence[str] | None = None, *, repair: bool = False, **said: Any) -> Path:
        """The straight lines between neighbouring points (n + 1, axes), mm, rotary axes rad; a million in a second.

        The same path, to the bit, as one of as many NurbsCurve of degree 1, but these are made only on access; name,
        feeds, markers, ... as for `Path`. With `repair`, lines without length are left out with a finding, their feeds
        and tolerances with them, and markers stay between the same neighbours. Otherwise they raise CurveError, as
        values that are not finite do; and all that `Path` raises.
        """
        given = frozen_array(points, "points", 2) if repair else np.zeros((0, 1))
        kept = lines_with_length(given)
        if len(kept) in (0, len(given) - 1):
            return cls(Lines(points), axes, **said)  # type: ignore[arg-type]
        first = int(np.setdiff1d(np.arange(len(given) - 1), kept)[0])
        dropped = f"{len(given) - 1 - len(kept)} line(s) without length left out, the first between points"
        said["findings"] = (*said.get("findings", ()), f"{dropped} {first} and {first + 1}")
        return cls(Lines(given[np.append(kept, kept[-1] + 1)]), axes, **_kept(said, kept))

    @classmethod
    def through(
        cls,
        waypoints: ArrayLike,
        axes: Sequence[str] | None = None,
        *,
        near: ArrayLike = 0.0,
        weights: ArrayLike | None = None,
        times: ArrayLike | None = None,
        duration: float | None = None,
        **said: Any,
    ) -> Path:
        """One smooth path through waypoints (n, axes), mm, rotary axes rad, that stops only at its ends.

        A spline of degree 5 (through fewer than 6 waypoints, of lower degree), a curve from each waypoint to the next:
        `path.curve_starts` are the lengths at which it passes them.

        near      how far each axis may pass beside a waypoint, mm or rad, one number or one an axis: the motion is
                  smoother. The first and the last waypoint are met
        weights   what a unit of each axis counts in the distance of two waypoints, (axes,); default as in the length
        times     wanted time at each waypoint, s, the first 0, NaN where any will do;  duration  of all, s
        said      name, findings, ... as for `Path`

        Where it turns back on itself it has to stop: `findings` say so. Raises CurveError for waypoints that are no
        numbers, or the same; InputError for near, times or duration that cannot be.
        Source: E. T. Y. Lee, Computer-Aided Design 21(6), 1989. Example: `sf.Path.through([[0, 0], [40, 9], [60, 0]])`
        """
        from splinefeed.paths.waypoints import checked_waypoints, through

        points = checked_waypoints(waypoints, axes)
        names = default_axes(points.shape[1]) if axes is None else tuple(axes)
        linear = checked_axes(names, len(names))
        counted = metric_of(len(names), linear) if weights is None else frozen_array(weights, "weights", 1)
        if counted.shape != (len(names),) or not np.all((counted > 0.0) & (counted < np.inf)):
            raise InputError(f"weights have shape {counted.shape}; expected {len(names)} numbers greater than 0")
        if times is not None and duration is not None:
            raise InputError("times and duration are given; the last of times is the duration: leave one out")
        if duration is not None:
            times = [0.0, *[math.nan] * (len(points) - 2), duration]
        if times is not None:
            times = _of_waypoints(times, len(points))
        made = cls(through(points, counted, near), names, times=times, **said)
        stops = np.searchsorted(made.curve_starts, np.array(made.stops) * (1.0 - 1e-9))
        more = [f"the motion stops near waypoint {k + 1}, where the path turns back on itself" for k in stops.tolist()]
        return made.with_findings(*made.findings, *more) if more else made

    @cached_property
    def flat(self) -> Flat:
        """All curves as arrays."""
        return self._joined.flat if isinstance(self._joined, Packed) else Flat.of(self._joined)

    @property
    def joined(self) -> Sequence[NurbsCurve]:
        """The curves of the motion: `curves` without gaps and without what is smaller than the resolution."""
        return self._joined

    @cached_property
    def ends(self) -> Array:
        """First and last point of each curve, (curves, 2, axes), mm, rotary axes rad."""
        return read_only(self.flat.ends(self._joined))

    @cached_property
    def gaps(self) -> tuple[float, ...]:
        """How far the end of each curve was given from the start of the next one, mm (rotary axes rad)."""
        return tuple(np.linalg.norm(self.ends[1:, 0] - self.ends[:-1, 1], axis=1).tolist())

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
        """Curve index and parameter (...) at arc lengths s (...), mm; InputError outside [0, length]."""
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
        """Points and derivatives by u, (..., order + 1, axes), at parameters u (...) of the curves `curve` (...).

        At a knot the piece on its right is taken, or with side="left" the one on its left.
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
        """The same at parameters u (n,) of the curves `curve` (n,); at a knot of the piece on that side."""
        return by_arc_length(self.evaluate(curve, u, 3, side=side) * self.metric, self.shape[2]) / self.metric

    def tip(self, d: Array) -> Array:
        """s', s'', s''' (3, n) of the tip's arc length s by the path's, from `derivatives` d (n, 4, axes)."""
        if self.mixed:
            return tip_derivatives(d, self.linear)
        return np.repeat([[1.0], [0.0], [0.0]], len(d), axis=1)

    def tip_length(self, s: ArrayLike) -> Array:
        """Arc length of the tip, mm (...), at places s (...), mm: over the linear axes; where none moves, degrees."""
        if not self.mixed:
            return np.asarray(s, dtype=np.float64)
        curve, u = self.locate(s)
        return self._tip_pieces.lengths_at(curve.ravel(), u.ravel()).reshape(u.shape)

    def lengths_of(self, setpoints: Setpoints) -> Array:
        """Length along the path at setpoints, (n,), mm: their s, or on mixed paths, where s is the tip's, by u."""
        if not self.mixed:
            return setpoints.s
        return self.arc_length(setpoints.curve, setpoints.u)

    def of_tip(self, s: Array, v: Array, a: Array, j: Array) -> tuple[Array, Array, Array, Array]:
        """Arc length, feed, acceleration and jerk of the tip, (n,) each, of a motion along the path, (n,) each.

        ds/dt = s' v,  d2s/dt2 = s'' v^2 + s' a,  d3s/dt3 = s''' v^3 + 3 s'' v a + s' j  (the chain rule)
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
    def tip_path(self) -> Path:
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

    @cached_property
    def breaks(self) -> Array:
        """Knots, joints and corners, sharp bends, and where the tip is slowest, (k,), mm."""
        owner, knots, _ = self.flat.inner_knots()
        places = [self.arc_length(owner, knots), self.curve_starts[1:-1], self.corners.s, self.sharp_bends[0]]
        s = np.unique(np.concatenate([*places, self.slow_tips]))
        inside = s[(s > SAME * self.length) & (s < (1.0 - SAME) * self.length)]
        return inside[np.diff(inside, prepend=0.0) > SAME * self.length]

    @property
    def jumps(self) -> Array:
        """Places (k,), mm, at which the curvature jumps while the tool moves on."""
        return self.corners.s[~self.corners.stop]

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
            u = extremes(curve)
            points = curve(u)[:, columns]
            low, high = points.min(axis=0), points.max(axis=0)
            outside = (low < middle - half) | (high > middle + half)
            if not np.any(outside):
                continue
            k = int(np.argmax(outside))
            upwards = bool(high[k] - middle[k] >= middle[k] - low[k])
            position = float(high[k] if upwards else low[k])
            furthest = u[np.argmax(points[:, k] if upwards else -points[:, k])]
            s = float(self.tip_length(self.arc_length(index, furthest)))
            axis = self.axes[columns[k]]
            unit, factor = unit_of_axis(axis), np.degrees(1.0) if axis in ROTARY_AXES else 1.0
            side = "most" if upwards else "least"
            raise LimitsError(
                f"{GOES} {axis} = {factor * position:.6g} {unit} at s = {s:.6g} {unit_along(self.axes)} (curve {index}"
                f"); its travel allows at {side} {factor * ends[k, int(upwards)]:.6g} {unit}; "
                "move the path or widen the travel"
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
        """Roundings of positions as large as r (n, axes), and of the path's length on the axes of the tip, (axes,)."""
        size = np.max(np.abs(r), axis=0)
        size[: self.linear] = np.maximum(size[: self.linear], self.length)
        return np.asarray(ROUNDINGS * np.spacing(size))

    def sticks(self, position: Array) -> Array | None:
        """The arm whose joints the axes are, as lines from its base to its tip, (n, points, 3), mm; None where none is.

        position  (n, axes)
        """
        return None

    @property
    def feed_range(self) -> tuple[float, bool] | None:
        """Highest finite feed of its curves, mm/s, and whether some have none (rapid moves); None without feeds."""
        if self.feeds is None:
            return None
        known = self.feeds[np.isfinite(self.feeds)]
        return float(np.max(known, initial=0.0)), len(known) < len(self.feeds)

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
        """Length along the path, mm, (...), at parameters u (...) of the curves `curve` (...)."""
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
    def corners(self) -> Corners:
        """Points inside the path where the tangent of all axes or the curvature jumps, in order of s; a cusp is one.

        The tangent is that of all axes by the metric: between a move of rotary axes alone and another one it turns.
        """
        return find_corners(self)

    @cached_property
    def sharp_bends(self) -> tuple[Array, Array]:
        """Arc lengths (k,) of sharp bends, mm, in order, and their curvature, 1/mm."""
        return sharp_bends(self)

    @cached_property
    def stops(self) -> tuple[float, ...]:
        """Arc lengths strictly inside the path, mm, increasing, at which the tool must stop.

        Corners of the tangent, and markers with a stop.
        """
        corners = set(self.corners.s[self.corners.stop].tolist())
        markers = {float(self.curve_starts[marker.before]) for marker in self.markers if marker.stop}
        return tuple(sorted(s for s in corners | markers if 0.0 < s < self.length))

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

    def transformed(self, matrix: ArrayLike, offset: ArrayLike | None = None) -> Path:
        """The affine image of every curve; see `NurbsCurve.transformed`."""
        self._refuse_tied("transformed")
        curves: Iterable[NurbsCurve] = [c.transformed(matrix, offset) for c in self._joined]
        if isinstance(self.curves, Lines):
            curves = Lines(moved_points(self.curves.points, matrix, offset))
        return Path(curves, self.axes, **{**self._said(), "tolerance": JOIN_TOLERANCE})

    def reversed(self) -> Path:
        """The same path traversed from its end to its start, feeds and markers turned with it."""
        count = len(self.curves)
        said = {**_kept(self._said(), np.arange(count)[::-1]), "times": None}
        said["markers"] = [dataclasses.replace(m, before=count - m.before) for m in reversed(self.markers)]
        curves: Iterable[NurbsCurve] = [c.reversed() for c in reversed(self.curves)]
        if isinstance(self.curves, Lines):
            curves = Lines(self.curves.points[::-1])
        return Path(curves, self.axes, **said)

    def beginning_at(self, point: ArrayLike) -> Path:
        """The same path with its start moved to a point (axes,) next to it, as gaps are; see `paths.gaps`."""
        self._refuse_tied("made to begin elsewhere")
        curves = begun_at(self._joined, np.asarray(point, dtype=np.float64), self.linear)
        return Path(curves, self.axes, **self._said())

    def _refuse_tied(self, what: str) -> None:
        if self._tied:
            raise InputError(f"{self.name}: a path with a tool axis cannot be {what}; do that to its curves and axis")

    def with_findings(self, *findings: str) -> Path:
        """The same path with other findings."""
        return Path(self.curves, self.axes, **{**self._said(), "findings": findings})

    def named(self, name: str) -> Path:
        """The same path under another name; what was computed of it is kept."""
        new: Path = object.__new__(type(self))
        new.__dict__.update(self.__dict__, name=name)
        return new

    def with_feeds(self, feeds: ArrayLike | None) -> Path:
        """The same path under other feeds (curves,), mm/s, infinite for rapid moves; what was computed of it is kept.

        Raises InputError for feeds that are not positive, or another number of them.
        """
        new: Path = object.__new__(type(self))
        given = _of_curves(feeds, len(self._joined), "feeds", "greater than 0", lambda f: f > 0.0)
        new.__dict__.update(self.__dict__, feeds=given)
        return new

    def with_lines(self, lines: ArrayLike | None) -> Path:
        """The same path with other lines of a program (curves,); what was computed of it is kept.

        Raises InputError for negative ones, or another number of them.
        """
        new: Path = object.__new__(type(self))
        given = _of_curves(lines, len(self._joined), "lines", "0 or more", lambda values: values >= 0.0)
        new.__dict__.update(self.__dict__, lines=None if given is None else read_only(given.astype(np.int64)))
        return new

    def smoothed(self, tolerance: float | str, **how: Any) -> Path:
        """Deprecated: use `sf.smooth(path, tolerance)`."""
        words = "path.smoothed() goes with the next release; use sf.smooth(path, tolerance)"
        warnings.warn(words, DeprecationWarning, stacklevel=2)
        made: Path = import_module("splinefeed.paths.smoothing_proven").smooth(self, tolerance, **how)
        return made

    def job(self, **linking: Any) -> Path:
        """Deprecated: use `sf.paths.job([path])`; a `Job` of several contours has a `job` of its own."""
        words = "path.job() goes with the next release; use sf.paths.job([path])"
        warnings.warn(words, DeprecationWarning, stacklevel=2)
        made: Path = import_module("splinefeed.paths.jobs").job([self], **linking)
        return made

    @property
    def _said_length(self) -> str:
        return f"{self.tip_end:.6g} {unit_along(self.axes)}"

    def _repr_html_(self) -> str:
        rows = {
            "path": self.name,
            "curves": f"{len(self.curves)}",
            "axes": ", ".join(self.axes),
            "length": self._said_length,
            "stops": f"{len(self.stops)}",
        }
        place = self(np.linspace(0.0, self.length, view.DRAWN)) if self.length > 0.0 else np.zeros((0, 0))
        return view.table(rows, view.shape(place[:, : self.linear], self.name))

    def __repr__(self) -> str:
        return f"Path({self.name!r}, {len(self.curves)} curve(s), axes {' '.join(self.axes)}, {self._said_length})"


def _kept(said: dict[str, Any], kept: IntArray) -> dict[str, Any]:
    """What is said of a path when only its curves of these numbers (m,) are kept."""
    each = {name: None if said.get(name) is None else read_only(np.array(said[name])[kept]) for name in _OF_EACH}
    markers = [dataclasses.replace(m, before=int(np.searchsorted(kept, m.before))) for m in said.get("markers", ())]
    return {**said, **each, "markers": tuple(markers)}


def default_axes(count: int) -> tuple[str, ...]:
    """Names of `count` axes that have none: x, y, z, or joints q1, q2, ... where there are more."""
    return DEFAULT_AXES[:count] if count <= MOST_UNNAMED else tuple(f"q{k}" for k in range(1, count + 1))


def checked_axes(axes: Sequence[str], count: int) -> int:
    """How many of `axes` are linear; CurveError unless they name `count` axes, the linear ones first."""
    if len(axes) != count or len(set(axes)) != count or count > MAX_AXES:
        raise CurveError(f"axes {axes} for curves of {count} axes; expected one distinct name each")
    rotary = [axis in ROTARY_AXES for axis in axes]
    if rotary != sorted(rotary):
        raise CurveError(f"axes {axes}: put the linear axes first and the rotary ones ({', '.join(ROTARY_AXES)}) last")
    return count - sum(rotary)


def _check_joints(ends: Array, tolerance: float) -> None:
    """Refuse a gap above `tolerance`, mm, between first and last points (curves, 2, axes) of neighbours."""
    gaps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    if np.any(gaps > tolerance):
        i = int(np.argmax(gaps > tolerance))
        raise CurveError(
            f"gap of {gaps[i]:.6g} mm between the end of curve {i} and the start of curve {i + 1}; "
            f"join them, or allow it with tolerance="
        )


def _of_times(given: ArrayLike | None, count: int) -> Array | None:
    """Wanted times (count,), read-only, NaN where there is none; InputError unless they grow from above 0."""
    if given is None:
        return None
    try:
        values = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (count,):
        raise InputError(f"times have shape {values.shape}; expected one number for each of {count} curve(s)")
    known = values[~np.isnan(values)]
    if not np.all(np.diff(known, prepend=0.0) > 0.0) or np.any(np.isinf(known)):
        raise InputError(f"times are {known.tolist()} s; they must be finite, greater than 0, and increase")
    return read_only(values) if len(known) else None


def _of_waypoints(times: ArrayLike, count: int) -> Array:
    """Times at waypoints (count,) as those at the ends of curves, (count - 1,)."""
    try:
        values = np.array(times, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (count,) or values[0] != 0.0:
        raise InputError(f"times have shape {values.shape}; expected one for each of {count} waypoints, the first 0 s")
    return values[1:]


def _of_curves(
    given: ArrayLike | None, count: int, name: str, wanted: str, fits: Callable[[Array], BoolArray]
) -> Array | None:
    """One number a curve, (count,), read-only; InputError for a number that does not fit."""
    if given is None:
        return None
    values = frozen_array(given, name, 1)
    if len(values) != count:
        raise InputError(f"{name} has {len(values)} numbers for {count} curves; give one each")
    wrong = ~fits(values)
    if np.any(wrong):
        i = int(np.argmax(wrong))
        raise InputError(f"{name}[{i}] is {values[i]:g}; it must be {wanted}")
    return values

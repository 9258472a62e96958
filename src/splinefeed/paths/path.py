"""Path: curves joined end to end, what is said of each, and the same path turned, renamed, or at other feeds."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.metric import metric_of
from splinefeed.curves.packed import Packed, lines_through, lines_with_length
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.corners import Corners, find_corners, sharp_bends
from splinefeed.paths.each_curve import (
    Marker,
    checked_axes,
    chosen_of_each,
    default_axes,
    floats,
    of_curves,
    of_lines,
    of_times,
)
from splinefeed.paths.gaps import begun_at, closed, open_joints, widths
from splinefeed.paths.joined_curves import JoinedCurves
from splinefeed.paths.resolution import RESOLUTION, long_curves, resolved
from splinefeed.records import Array, Points, frozen_array, unit_along, view
from splinefeed.records.arrays import read_only

#: What differs by less than this share of the path's length is the same place.
SAME = 1e-12
#: Ends of neighbouring curves further apart than this, mm, are a gap by default.
JOIN_TOLERANCE = RESOLUTION


class Path(JoinedCurves):
    """Curves joined end to end.

    Parameters
    ----------
    curves : iterable of NurbsCurve
        Of the same number of axes, each beginning where the last one ends; also Packed.
    axes : sequence of str, optional
        One name an axis, linear ones (any name) first, rotary ones (a, b, c, theta) behind them; without names up to
        three are x, y, z, and more are joints q1, q2, ..., all in one unit and all under one rule.
    name : str, optional
        Its name in files and figures.
    findings : sequence of str, optional
        Remarks of its reader, one sentence each.
    tolerance : float, optional
        The largest gap that is closed, mm (rotary axes rad): the motion closes it, see `paths.gaps.closed`; `curves`
        stay as they are given.
    feeds : (curves,) array_like, optional
        Wanted feed of each curve, mm/s, infinite for a rapid move; None if nothing is wanted.
    tolerances : (curves,) array_like, optional
        How far smoothing may leave each curve, mm (G64 P), 0 for exact; None if nothing is given.
    markers : iterable of Marker, optional
        Events that are not motion, with their places, in order.
    lines : (curves,) array_like, optional
        Line of a program that each curve stands on; None where it is of none.
    times : (curves,) array_like, optional
        Wanted time when each curve ends, s, NaN where any will do; None if nothing is wanted. `plan` slows the motion
        down to it; paths made from this one do not have it.
    by_tip : bool, optional
        Whether the linear axes alone make the length, as rotary ones never move alone: see `tangential`.

    Raises
    ------
    CurveError
        Names the curve, for a gap or for axes that do not fit.
    InputError
        For feeds, tolerances or markers that do not fit the curves.

    Notes
    -----
    Called with arc lengths s (...), mm, it gives points (..., axes), mm, rotary axes rad.

    Features below the resolution, 1 nm, are decided once, here (`paths.resolution`): a curve shorter than that
    beside a long one is left out with a finding, its feed and tolerance with it, and curves are numbered, markers and
    dwells placed, as if it did not exist. A curve with a cusp, or a bend as sharp as one, stays one curve
    on the same domain; next to the tip `joined`, what is moved along, leaves `curves` by 1 nm at most, and at the tip
    it has a corner, where motion stops.

    The length along it counts all axes: linear ones as they are, rotary ones beside them by 50 mm a rad. Where all
    axes are rotary, 1 mm is 1 degree: a feed of 60 mm/s is 60 degrees a second there. The tip's arc length, over the
    linear axes, is `tip_length`; setpoints, reports and the command line count that.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., chapter 4, for its curves.

    Examples
    --------
    >>> import splinefeed as sf
    >>> arc = sf.NurbsCurve.bezier([[10, 0], [10, 10], [0, 10]], weights=[1, 0.5**0.5, 1])
    >>> path = sf.Path([sf.NurbsCurve.bezier([[10, -5], [10, 0]]), arc], name="corner")
    >>> print(f"{path.length:.3f} mm, stops {path.stops}")
    20.708 mm, stops ()
    """

    #: Whether something else is given for each curve over the same parameters: then tips become corners, and no more.
    _tied = False

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
        self.feeds = of_curves(feeds, count, "feeds", "greater than 0", lambda values: values > 0.0)
        self.tolerances = of_curves(tolerances, count, "tolerances", "0 or more", lambda values: values >= 0.0)
        self.lines = of_lines(lines, count)
        self.times = of_times(times, count)
        self.markers = tuple(sorted(markers, key=lambda marker: marker.before))
        for marker in self.markers:
            if not 0 <= marker.before <= count:
                raise InputError(f"marker {marker.text!r} is before curve {marker.before} of {count}")
        self._joined = resolved(self._without_gaps(), self.weights, in_place=self._tied)
        self._made = True

    def _without_gaps(self) -> Packed:
        """The curves of the motion, without points, each of which begins where the last one ends."""
        packed = Packed.of(self.curves)
        outer = packed.ends[[0, -1], [0, 1]]
        if len(packed) == 1:
            return packed
        _check_joints(packed.ends, self.tolerance)
        kept = None if self._tied else long_curves(packed.flat, self.weights, self.tolerance)
        if kept is not None:
            first = int(np.argmax(np.append(kept, -1) != np.arange(len(kept) + 1)))
            out = f"{len(packed) - len(kept)} curve(s) shorter than {1e6 * RESOLUTION:g} nm left out"
            self.findings += (f"{out}, the first curve {first}",)
            packed = packed.chosen(kept)
            self.curves = packed if isinstance(self.curves, Packed) else tuple(packed)
            for name, value in chosen_of_each(self._said(), kept).items():
                setattr(self, name, value)
        if kept is None and not np.any(open_joints(packed.ends)):
            return packed
        gaps = widths(packed.ends)
        if wide := int(np.count_nonzero(gaps > JOIN_TOLERANCE)):
            said = f"{wide} gap(s) of up to {gaps.max():.3g} mm between curves closed, as the tolerance allows"
            self.findings += (said,) * (said not in self.findings)
        return closed(packed, self.linear, outer)

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
        """Join the straight lines between neighbouring points; a million in a second.

        Parameters
        ----------
        points : (n + 1, axes) array_like
            mm, rotary axes rad.
        axes : sequence of str, optional
            Names of the axes, as for `Path`.
        repair : bool, optional
            Whether lines without length are left out with a finding, their feeds and tolerances with them; markers stay
            between the same neighbours.
        **said : object
            name, feeds, markers, ... as for `Path`.

        Returns
        -------
        Path
            The same path, to the bit, as one of as many NurbsCurve of degree 1, but these are made only on access.

        Raises
        ------
        CurveError
            For values that are not finite, and for lines without length that are not left out.
        InputError
            As `Path` does.
        """
        given = frozen_array(points, "points", 2) if repair else np.zeros((0, 1))
        kept = lines_with_length(given)
        if len(kept) in (0, len(given) - 1):
            return cls(lines_through(points), axes, **said)  # type: ignore[arg-type]
        first = int(np.setdiff1d(np.arange(len(given) - 1), kept)[0])
        dropped = f"{len(given) - 1 - len(kept)} line(s) without length left out, the first between points"
        said["findings"] = (*said.get("findings", ()), f"{dropped} {first} and {first + 1}")
        return cls(lines_through(given[np.append(kept, kept[-1] + 1)]), axes, **chosen_of_each(said, kept))

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
        """Lay one smooth path through waypoints that stops only at its ends.

        Parameters
        ----------
        waypoints : (n, axes) array_like
            mm, rotary axes rad.
        axes : sequence of str, optional
            Names of the axes, as for `Path`.
        near : float or (axes,) array_like, optional
            How far each axis may pass beside a waypoint, mm or rad: the motion is smoother. The first and the last
            waypoint are met.
        weights : (axes,) array_like, optional
            What a unit of each axis counts in the distance of two waypoints; default as in the length.
        times : (n,) array_like, optional
            Wanted time at each waypoint, s, the first 0, NaN where any will do.
        duration : float, optional
            Wanted time of all, s.
        **said : object
            name, findings, ... as for `Path`.

        Returns
        -------
        Path
            The natural spline of degree 5, of least int |r'''|^2 du, a curve from each waypoint to the next:
            `path.curve_starts` are the lengths at which it passes them. Where it turns back on itself it has to stop:
            `findings` name the places.

        Raises
        ------
        CurveError
            For waypoints that are no numbers, or the same.
        InputError
            For near, times or duration that cannot be.

        References
        ----------
        .. [1] E. T. Y. Lee, Computer-Aided Design 21(6), 1989.

        Examples
        --------
        >>> import splinefeed as sf
        >>> path = sf.Path.through([[0, 0], [40, 9], [60, 0]])
        >>> len(path.curves), path.stops
        (2, ())
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

    def feeds_within(self, feed: float) -> Array:
        """Limit the feed on each curve.

        Parameters
        ----------
        feed : float
            The limit, mm/s.

        Returns
        -------
        (curves,) array
            mm/s: that, or the lower one that is wanted there.
        """
        feeds = np.full(len(self.curves), feed)
        return feeds if self.feeds is None else np.minimum(feeds, self.feeds)

    @property
    def feed_range(self) -> tuple[float, bool] | None:
        """Highest finite feed of its curves, mm/s, and whether some have none (rapid moves); None without feeds."""
        if self.feeds is None:
            return None
        known = self.feeds[np.isfinite(self.feeds)]
        return float(np.max(known, initial=0.0)), len(known) < len(self.feeds)

    def transformed(self, matrix: ArrayLike, offset: ArrayLike | None = None) -> Path:
        """Transform every curve; see `NurbsCurve.transformed`.

        Parameters
        ----------
        matrix : array_like
            (new axes, axes), or one number.
        offset : array_like, optional
            (new axes,), mm.

        Returns
        -------
        Path
            The affine image.
        """
        self._refuse_tied("transformed")
        said = {**self._said(), "tolerance": JOIN_TOLERANCE}
        return Path(self._joined.transformed(matrix, offset), self.axes, **said)

    def reversed(self) -> Path:
        """The same path traversed from its end to its start, feeds and markers turned with it."""
        count = len(self.curves)
        said = {**chosen_of_each(self._said(), np.arange(count)[::-1]), "times": None}
        said["markers"] = [dataclasses.replace(m, before=count - m.before) for m in reversed(self.markers)]
        return Path(Packed(Packed.of(self.curves).flat.reversed()), self.axes, **said)

    def beginning_at(self, point: ArrayLike) -> Path:
        """Move the start of the path to a point next to it, as gaps are closed; see `paths.gaps`.

        Parameters
        ----------
        point : (axes,) array_like
            mm, rotary axes rad.

        Returns
        -------
        Path
            Otherwise the same path.
        """
        self._refuse_tied("made to begin elsewhere")
        curves = begun_at(self._joined, np.asarray(point, dtype=np.float64), self.linear)
        return Path(curves, self.axes, **self._said())

    def _refuse_tied(self, what: str) -> None:
        if self._tied:
            raise InputError(f"{self.name}: a path with a tool axis cannot be {what}; do that to its curves and axis")

    def with_findings(self, *findings: str) -> Self:
        """Replace the findings; what was computed of the path is kept.

        Parameters
        ----------
        *findings : str
            One sentence each.

        Returns
        -------
        Path
            Otherwise the same path.
        """
        return self._with(findings=findings)

    def named(self, name: str) -> Self:
        """Replace the name; what was computed of the path is kept.

        Parameters
        ----------
        name : str
            The new one.

        Returns
        -------
        Path
            Otherwise the same path.
        """
        return self._with(name=name)

    def with_feeds(self, feeds: ArrayLike | None) -> Self:
        """Replace the feeds; what was computed of the path is kept.

        Parameters
        ----------
        feeds : (curves,) array_like or None
            mm/s, infinite for rapid moves.

        Returns
        -------
        Path
            Otherwise the same path.

        Raises
        ------
        InputError
            For feeds that are not positive, or another number of them.
        """
        return self._with(feeds=of_curves(feeds, len(self._joined), "feeds", "greater than 0", lambda f: f > 0.0))

    def with_lines(self, lines: ArrayLike | None) -> Self:
        """Replace the lines of a program; what was computed of the path is kept.

        Parameters
        ----------
        lines : (curves,) array_like or None
            Numbers of lines.

        Returns
        -------
        Path
            Otherwise the same path.

        Raises
        ------
        InputError
            For negative ones, or another number of them.
        """
        return self._with(lines=of_lines(lines, len(self._joined)))

    def _with(self, **said: Any) -> Self:
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__, **said)
        return new

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


def _check_joints(ends: Array, tolerance: float) -> None:
    """Refuse a gap above `tolerance`, mm, between first and last points (curves, 2, axes) of neighbours."""
    gaps = widths(ends)
    if np.any(gaps > tolerance):
        i = int(np.argmax(gaps > tolerance))
        raise CurveError(
            f"gap of {gaps[i]:.6g} mm between the end of curve {i} and the start of curve {i + 1}; "
            f"join them, or allow it with tolerance="
        )


def _of_waypoints(times: ArrayLike, count: int) -> Array:
    """Times at waypoints (count,) as those at the ends of curves, (count - 1,)."""
    values = floats(times)
    if values.shape != (count,) or values[0] != 0.0:
        raise InputError(f"times have shape {values.shape}; expected one for each of {count} waypoints, the first 0 s")
    return values[1:]

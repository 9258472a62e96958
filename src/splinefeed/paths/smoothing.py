"""Smoothing: lines, arcs and curves become a path of continuous curvature within a tolerance, also as they come."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.curves.packed import Flat, Packed
from splinefeed.errors import CurveError, InputError
from splinefeed.paths.each_curve import Marker, checked_axes
from splinefeed.paths.parts import cut_at_corners
from splinefeed.paths.path import Path
from splinefeed.paths.resolution import RESOLUTION, long_curves
from splinefeed.paths.smoothing_joints import Assembly, Done
from splinefeed.paths.smoothing_runs import LineBatch, Runs
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.limits import positive

#: Joints that turn by more than this are corners.
SMOOTHING_CORNER_ANGLE = math.radians(45.0)
#: How far rotary axes may leave the original, rad, unless it is said.
ANGULAR_TOLERANCE = math.radians(0.05)
#: The tolerance, mm, where a program smooths without one: G64 without P.
UNBOUNDED_TOLERANCE = 0.01
#: Tolerance of the path's own, as `tolerance` of `smoothed`.
PROGRAM = "program"
CORNERS = ("keep", "round")
#: Curves that are looked at in one go: less would cost more a curve.
WINDOW = 8192


def smoothed(
    path: Path,
    tolerance: float | str,
    *,
    corner_angle: float = SMOOTHING_CORNER_ANGLE,
    corners: str = "keep",
    angular_tolerance: float = ANGULAR_TOLERANCE,
    share: Array | None = None,
) -> Path:
    """Smooth a path without proof: continuous tangent and curvature, bounded third derivative.

    Parameters
    ----------
    path : Path
        Of any curves. Corners inside a curve are joints, too: it is cut there first.
    tolerance : float or str
        mm; or "program" for the tolerance of each curve (G64 P), where 0 or none leaves it exact.
    corner_angle : float, optional
        Joints that turn by more, rad, are corners.
    corners : str, optional
        "keep" them, the tool stops there, or "round" them within the tolerance; reversals are kept.
    angular_tolerance : float, optional
        Of rotary axes, rad.
    share : (curves,) array, optional
        Of the tolerance that each curve may use, all of it if not given, 0 for exact.

    Returns
    -------
    Path
        Within the tolerance everywhere.

    Raises
    ------
    InputError
        For arguments that cannot be used.

    Notes
    -----
    Runs of short lines become splines of degree 5 (least squares, knots where the error is); at the remaining joints,
    of any curves, quintics blend them. What they leave of long lines and of arcs stays as it is. Feeds, tolerances and
    markers stay at their places; rapid moves, stops and moves of rotary axes alone stay exact.

    References
    ----------
    .. [1] docs/smoothing.md
    """
    smoother = Smoother(
        tolerance, path.axes, corner_angle=corner_angle, corners=corners, angular_tolerance=angular_tolerance
    )
    value = smoother.tolerance
    if value != PROGRAM and float(value) > path.size > 0.0:
        raise InputError(f"tolerance is {value:g} mm, more than the whole path, {path.size:.4g} mm; give a smaller one")
    given = path
    path, counts = cut_at_corners(path)
    share = None if share is None else np.repeat(share, counts)
    if not _loose(path, value, share)[1].any():
        return given
    smooth = smoother._path(
        [*smoother._taken(path, share), *smoother._rest()],
        name=path.name,
        findings=(*path.findings, smoother.summary),
        tolerance=max(path.tolerance, 1e-9 * path.size),
    )
    return smooth.with_lines(lines_along(smooth, path))


def lines_along(smooth: Path, path: Path) -> IntArray | None:
    """Line of a program of each smooth curve: that of the curve of `path` as far along, but for what is cut off."""
    if path.lines is None:
        return None
    share = smooth.curve_starts[:-1] * (path.length / smooth.length)
    at = np.searchsorted(path.curve_starts, share, side="right") - 1
    lines: IntArray = path.lines[np.clip(at, 0, len(path.lines) - 1)]
    return lines


class Smoother:
    """Smooth a path that need not end, as `sf.smooth` does: `push` curves, get smooth ones; `finish` gives the rest.

    Parameters
    ----------
    tolerance : float or str
        mm, as for `sf.smooth`.
    axes : sequence of str
        Names of the axes of all that comes.
    corner_angle : float, optional
        rad, as for `sf.smooth`, as the next two.
    corners : str, optional
        "keep" or "round".
    angular_tolerance : float, optional
        rad.
    window : int, optional
        Curves that are looked at in one go; no more than these and some hundreds are held.

    Raises
    ------
    InputError
        For arguments that cannot be used.
    CurveError
        For pieces that do not follow each other.

    Notes
    -----
    However the path is cut into pieces, the result is the same to the bit, and that of `sf.smooth` where no curve has a
    corner inside.

    References
    ----------
    .. [1] docs/smoothing.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [5, 0], [9, 1]])
    >>> smoother = sf.paths.Smoother(0.01, path.axes, corners="round")
    >>> sum(len(piece.curves) for piece in [*smoother.push(path), *smoother.finish()])
    3
    """

    def __init__(
        self,
        tolerance: float | str,
        axes: Sequence[str],
        *,
        corner_angle: float = SMOOTHING_CORNER_ANGLE,
        corners: str = "keep",
        angular_tolerance: float = ANGULAR_TOLERANCE,
        window: int = WINDOW,
    ) -> None:
        self.tolerance = _checked(tolerance, corner_angle, corners, angular_tolerance)
        if int(window) < 1:
            raise InputError(f"a window of {window} curves; it must have at least 1")
        self.axes, self._window = tuple(axes), int(window)
        linear = checked_axes(self.axes, len(self.axes))
        self._runs = Runs(linear, float(angular_tolerance), corner_angle)
        self._assembly = Assembly(self.axes, float(angular_tolerance), corners == "round")
        self._waiting: list[LineBatch] = []  # not yet a window
        self._markers: list[Marker] = []
        self._came = self._out = 0
        self._said: tuple[bool, bool] | None = None  # whether feeds and tolerances are
        #: Of the paths that were given last, (curves,) each: number of the first curve that each curve stands for.
        self.origins: list[IntArray] = []
        #: Of the last curve that came: its end, whether it may change, its feed and tolerance.
        self._last: tuple[Array, bool, list[float]] | None = None

    @property
    def held(self) -> int:
        """Curves that are held in memory."""
        return sum(map(len, self._waiting)) + self._runs.waiting

    @property
    def summary(self) -> str:
        """What came of what came, in one sentence."""
        return (
            f"smoothed: {self._came} curve(s) became {self._out}, {self._runs.fits} of them splines over runs of short "
            f"lines and {self._assembly.made} transitions"
        )

    def push(self, path: Path) -> list[Path]:
        """Take more of the path, which goes on where the last one ended.

        Parameters
        ----------
        path : Path
            Of the same axes.

        Returns
        -------
        list of Path
            The smooth pieces that are final by now.

        Raises
        ------
        CurveError
            For a path that does not follow the last one.
        """
        return self._paths(self._taken(path))

    def finish(self) -> list[Path]:
        """The rest of the smooth path."""
        return self._paths(self._rest())

    def _paths(self, parts: Sequence[Done]) -> list[Path]:
        paths = [self._path([done], tolerance=self._assembly.gap) for done in parts]
        self.origins = [_origins(done, path) for done, path in zip(parts, paths, strict=True)]
        return paths

    def _path(self, parts: Sequence[Done], **said: Any) -> Path:
        assert self._said is not None
        starts = np.cumsum([0, *(len(part.flat) for part in parts)]).tolist()
        markers = [
            replace(marker, before=marker.before + start)
            for part, start in zip(parts, starts, strict=False)
            for marker in part.markers
        ]
        if self._said[0]:
            said["feeds"] = np.concatenate([part.feed for part in parts])
        if self._said[1]:
            said["tolerances"] = np.concatenate([part.said for part in parts])
        return Path(Packed(Flat.joined([part.flat for part in parts])), self.axes, markers=markers, **said)

    def _taken(self, path: Path, share: Array | None = None) -> list[Done]:
        if path.axes != self.axes:
            raise CurveError(f"the path has axes {path.axes}; the smoother has {self.axes}")
        said = path.feeds is not None, path.tolerances is not None
        if said != (self._said or said):
            raise InputError("feeds or tolerances are given for some pieces only; give them for all or for none")
        self._said = said
        self._assembly.gap = max(self._assembly.gap, path.tolerance)
        gap = 0.0 if self._last is None else float(np.linalg.norm(path.ends[0, 0] - self._last[0]))
        if gap > self._assembly.gap:
            raise CurveError(f"gap of {gap:.6g} mm between curve {self._came - 1} and curve {self._came}")
        self._markers += [replace(m, before=m.before + self._came) for m in path.markers]
        self._waiting.append(self._batch(path, share))
        self._came += len(path.flat)
        found: list[Done] = []
        if sum(map(len, self._waiting)) > self._window:
            batch = LineBatch.joined(self._waiting)
            lows = range(0, len(batch) - self._window, self._window)
            for low in lows:
                found += self._smoothed(batch.part(low, low + self._window), last=False)
            self._waiting = [batch.part(lows[-1] + self._window, len(batch))]
        return found

    def _rest(self) -> list[Done]:
        if self._last is None:
            return []
        batch, self._waiting = LineBatch.joined(self._waiting), []
        return self._smoothed(batch, last=True)

    def _smoothed(self, batch: LineBatch, last: bool) -> list[Done]:
        done = self._assembly.push(self._runs.push(batch, last), last, self._markers)
        if done is None:
            return []
        if last:
            done.markers.extend(replace(m, before=len(done.flat)) for m in self._markers)
        self._out += len(done.flat)
        return [done]

    def _batch(self, path: Path, share: Array | None) -> LineBatch:
        flat, count = path.flat, len(path.flat)
        within, loose = _loose(path, self.tolerance, share)
        said = [np.zeros(count) if each is None else each for each in (path.feeds, path.tolerances)]
        _, before, known = self._last or (None, False, [float(each[0]) for each in said])
        free = loose & np.append(before, loose[:-1])
        apart = np.zeros(count, dtype=bool)
        for values, one in zip(said, known, strict=True):
            apart |= values != np.append(one, values[:-1])
        self._last = path.ends[-1, 1].copy(), bool(loose[-1]), [float(each[-1]) for each in said]
        for marker in self._markers:
            i = marker.before - self._came
            if 0 <= i < count and marker.before > 0:
                apart[i] = True
                free[i] &= not marker.stop
        lines = (flat.degrees == 1) & (flat.rational == 0) & (np.diff(flat.point_starts) == 2)
        return LineBatch(
            flat, np.arange(self._came, self._came + count), np.where(loose, within, 1.0), np.zeros(count),
            lines & loose, free, apart, np.zeros(count, dtype=bool), *said,
        )  # fmt: skip


def _origins(done: Done, path: Path) -> IntArray:
    """Numbers (curves,) of the first curve that each curve of a path stands for; a path leaves out points."""
    if len(path.joined) == len(done.first):
        return done.first
    kept = long_curves(done.flat, path.weights, path.tolerance)
    assert kept is not None
    return done.first[kept]


def smooth_stream(pieces: Iterable[Path], tolerance: float | str, **how: Any) -> Iterator[Path]:
    """Smooth pieces of one path as they come: `Smoother` as a generator.

    Parameters
    ----------
    pieces : iterable of Path
        That follow each other.
    tolerance : float or str
        mm, as for `sf.smooth`.
    **how : object
        The other arguments of `Smoother`.

    Yields
    ------
    Path
        Smooth pieces.

    Raises
    ------
    InputError
        For arguments that cannot be used.
    CurveError
        For pieces that do not follow each other.

    References
    ----------
    .. [1] docs/smoothing.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> pieces = [sf.Path.polyline([[0, 0], [5, 0]]), sf.Path.polyline([[5, 0], [9, 1]])]
    >>> smooth = sf.paths.smooth_stream(pieces, 0.01, corners="round")
    >>> sum(len(piece.curves) for piece in smooth)
    3
    """
    smoother: Smoother | None = None
    for piece in pieces:
        if smoother is None:
            smoother = Smoother(tolerance, piece.axes, **how)
        yield from smoother.push(piece)
    if smoother is not None:
        yield from smoother.finish()


def _checked(tolerance: float | str, corner_angle: float, corners: str, angular_tolerance: float) -> float | str:
    if isinstance(tolerance, str):
        if tolerance != PROGRAM:
            raise InputError(f"tolerance is {tolerance!r}; give a number of mm or 'program'")
    else:
        tolerance = positive(float(tolerance), "tolerance", RESOLUTION)
    if not 0.0 < corner_angle <= math.pi:
        raise InputError(f"corner_angle is {corner_angle:g} rad; it must lie above 0 and at most at pi")
    if corners not in CORNERS:
        raise InputError(f"corners is {corners!r}; choose 'keep' or 'round'")
    positive(angular_tolerance, "angular_tolerance")
    return tolerance


def allowed(path: Path, tolerance: float | str) -> Array:
    """Tolerance of each curve (curves,), mm: that one, or what the program says, 0 where it says nothing."""
    if not isinstance(tolerance, str):
        return np.full(len(path.flat), tolerance)
    said = np.zeros(len(path.flat)) if path.tolerances is None else path.tolerances
    return np.where(np.isfinite(said), said, UNBOUNDED_TOLERANCE)


def _loose(path: Path, tolerance: float | str, share: Array | None) -> tuple[Array, BoolArray]:
    """Tolerance of each curve, mm, and whether it may be changed at all."""
    within = allowed(path, tolerance) * (1.0 if share is None else share)
    loose = (within > 0.0) & (path.flat.sizes(slice(path.linear)) > 0.0)
    return within, loose if path.feeds is None else loose & np.isfinite(path.feeds)

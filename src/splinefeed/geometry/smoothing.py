"""Smoothing: lines, arcs and curves become a path of continuous curvature within a tolerance, also as they come."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curves import Flat, Packed
from splinefeed.geometry.path import Marker, Path
from splinefeed.geometry.smoothing_joints import Assembly, Done
from splinefeed.geometry.smoothing_runs import Batch, Runs, Thinning
from splinefeed.records import Array

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
    """The path with continuous tangent and curvature and bounded third derivative, within `tolerance` everywhere.

    tolerance          mm; or "program" for the tolerance of each curve (G64 P), where 0 or none leaves it exact
    corner_angle       joints that turn by more, rad, are corners
    corners            "keep" them, the tool stops there, or "round" them within the tolerance; reversals are kept
    angular_tolerance  of rotary axes, rad
    share              (curves,) of the tolerance that each curve may use, all of it if not given, 0 for exact

    Runs of short lines become splines of degree 5 (least squares, knots where the error is); at the remaining joints,
    of any curves, quintics blend them. What they leave of long lines and of arcs stays as it is. Feeds, tolerances and
    markers stay at their places; rapid moves, stops and moves of rotary axes alone stay exact.
    Raises InputError for arguments that cannot be used. See docs/smoothing.md.
    """
    smoother = Smoother(
        tolerance, path.axes, corner_angle=corner_angle, corners=corners, angular_tolerance=angular_tolerance
    )
    value = smoother.tolerance
    if value != PROGRAM and float(value) > path.size > 0.0:
        raise InputError(f"tolerance is {value:g} mm, more than the whole path, {path.size:.4g} mm; give a smaller one")
    if not _raw(path, value, 0, share).free.any():
        return path
    return smoother.path(
        [*smoother.take(path, share), *smoother.rest()],
        name=path.name,
        findings=(*path.findings, smoother.summary),
        tolerance=max(path.tolerance, 1e-9 * path.size),
    )


class Smoother:
    """Smooths a path that need not end, as `smoothed` does: `push` curves, get smooth ones; `finish` gives the rest.

    axes  names of the axes of all that comes; all else as for `smoothed`
    window  curves that are looked at in one go; no more than these and some hundreds are held

    However the path is cut into pieces, the result is the same to the bit, and that of `smoothed`. Raises InputError
    for arguments that cannot be used, CurveError for pieces that do not follow each other.
    tolerance in mm. Source: docs/smoothing.md.
    Example: `smoother = sf.geometry.Smoother(0.01, path.axes); [*smoother.push(path), *smoother.finish()]`
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
        self._linear: int | None = None
        self._corner_angle, self._angular, self._rounded = corner_angle, float(angular_tolerance), corners == "round"
        self._waiting: list[Batch] = []  # not yet a window
        self._markers: list[Marker] = []
        self._came = 0
        self._out = 0
        self._before: Batch | None = None  # the last curve of the last window
        self._end: Array | None = None
        self._said: tuple[bool, bool] = (False, False)

    @property
    def held(self) -> int:
        """Curves that are held in memory."""
        return sum(map(len, self._waiting)) + (0 if self._linear is None else self._runs.waiting)

    @property
    def summary(self) -> str:
        """What came of what came, in one sentence."""
        return (
            f"smoothed: {self._came} curve(s) became {self._out}, {self._runs.fits} of them splines over runs of short "
            f"lines and {self._assembly.made} transitions"
        )

    def push(self, path: Path) -> list[Path]:
        """Take more of the path, which goes on where the last one ended; the smooth pieces that are final by now."""
        return [self.path([done], tolerance=self._assembly.gap) for done in self.take(path)]

    def finish(self) -> list[Path]:
        """The rest of the smooth path."""
        return [self.path([done], tolerance=self._assembly.gap) for done in self.rest()]

    def path(self, parts: Sequence[Done], **said: Any) -> Path:
        """What came of curves as one path."""
        starts = np.cumsum([0, *(len(part.flat) for part in parts)]).tolist()
        markers = [
            replace(marker, before=marker.before + start)
            for part, start in zip(parts, starts, strict=False)
            for marker in part.markers
        ]
        feeds, tolerances = (np.concatenate([getattr(part, name) for part in parts]) for name in ("feed", "said"))
        said |= {"feeds": feeds if self._said[0] else None, "tolerances": tolerances if self._said[1] else None}
        return Path(Packed(Flat.joined([part.flat for part in parts])), self.axes, markers=markers, **said)

    def take(self, path: Path, share: Array | None = None) -> list[Done]:
        """As `push`, as arrays; share (curves,) of the tolerance that each curve may use."""
        if path.axes != self.axes:
            raise CurveError(f"the path has axes {path.axes}; the smoother has {self.axes}")
        said = path.feeds is not None, path.tolerances is not None
        if self._linear is None:
            self._linear, self._said = path.linear, said
            self._thinning = Thinning(path.linear, self._angular)
            self._runs = Runs(path.linear, self._angular, self._corner_angle)
            self._assembly = Assembly(self.axes, self._angular, self._rounded, path.tolerance)
        elif said != self._said:
            raise InputError("feeds or tolerances are given for some pieces only; give them for all or for none")
        self._assembly.gap = max(self._assembly.gap, path.tolerance)
        ends = path.ends
        if self._end is not None and float(np.linalg.norm(ends[0, 0] - self._end)) > self._assembly.gap:
            gap = float(np.linalg.norm(ends[0, 0] - self._end))
            raise CurveError(f"gap of {gap:.6g} mm between curve {self._came - 1} and curve {self._came}")
        self._end = ends[-1, 1].copy()
        self._markers += [replace(m, before=m.before + self._came) for m in path.markers]
        self._waiting.append(_raw(path, self.tolerance, self._came, share))
        self._came += len(path.flat)
        found: list[Done] = []
        if sum(map(len, self._waiting)) > self._window:
            batch = Batch.joined(self._waiting)
            low = 0
            while len(batch) - low > self._window:
                found += self._smoothed(batch.part(low, low + self._window), last=False)
                low += self._window
            self._waiting = [batch.part(low, len(batch))]
        return found

    def rest(self) -> list[Done]:
        """As `finish`, as arrays."""
        if self._linear is None:
            return []
        batch = Batch.joined(self._waiting)
        self._waiting = []
        return self._smoothed(batch, last=True)

    def _smoothed(self, batch: Batch, last: bool) -> list[Done]:
        """What becomes final with the next window."""
        batch = self._joints(batch)
        done = self._assembly.push(self._runs.push(self._thinning.push(batch, last), last), last, self._markers)
        if done is None:
            return []
        if last:
            done.markers.extend(replace(m, before=len(done.flat)) for m in self._markers)
            self._markers = []
        self._out += len(done.flat)
        return [done]

    def _joints(self, batch: Batch) -> Batch:
        """What may be done at the joint before each curve, from what is said of the curves and of markers."""
        if not len(batch):
            return batch
        given = batch if self._before is None else Batch.joined([self._before, batch])
        self._before = batch.part(len(batch) - 1, len(batch))
        free = np.append(False, given.free[:-1] & given.free[1:])[-len(batch) :]
        apart = np.zeros(len(given), dtype=bool)
        for values, said in ((given.feed, self._said[0]), (given.said, self._said[1])):
            if said:
                apart[1:] |= values[1:] != values[:-1]
        apart = apart[-len(batch) :]
        low = int(batch.first[0])
        for marker in self._markers:
            i = marker.before - low
            if 0 <= i < len(batch) and marker.before > 0:
                apart[i] = True
                free[i] &= not marker.stop
        return replace(batch, free=free, apart=apart)


def smooth_stream(pieces: Iterable[Path], tolerance: float | str, **how: Any) -> Iterator[Path]:
    """Smooth pieces of one path, as they come, with the arguments of `Smoother`: that as a generator.

    tolerance in mm. Raises what `Smoother` raises. Source: docs/smoothing.md.
    Example: `list(sf.geometry.smooth_stream([sf.Path.polyline([[0, 0], [5, 0], [9, 1]])], 0.01))`
    """
    smoother: Smoother | None = None
    for piece in pieces:
        if smoother is None:
            smoother = Smoother(tolerance, piece.axes, **how)
        yield from smoother.push(piece)
    if smoother is not None:
        yield from smoother.finish()


def _checked(tolerance: float | str, corner_angle: float, corners: str, angular_tolerance: float) -> float | str:
    """The tolerance, mm or "program"; InputError for any of the arguments that cannot be used."""
    if isinstance(tolerance, str):
        if tolerance != PROGRAM:
            raise InputError(f"tolerance is {tolerance!r}; give a number of mm or 'program'")
    else:
        tolerance = float(tolerance)
        if not 0.0 < tolerance < math.inf:
            raise InputError(f"tolerance is {tolerance:g} mm; it must be greater than 0 and finite")
    if not 0.0 < corner_angle <= math.pi:
        raise InputError(f"corner_angle is {corner_angle:g} rad; it must lie above 0 and at most at pi")
    if corners not in CORNERS:
        raise InputError(f"corners is {corners!r}; choose 'keep' or 'round'")
    if not 0.0 < angular_tolerance < math.inf:
        raise InputError(f"angular_tolerance is {angular_tolerance!r} rad; it must be greater than 0 and finite")
    return tolerance


def _raw(path: Path, tolerance: float | str, first: int, share: Array | None = None) -> Batch:
    """The curves of a path as a Batch in which `free` says whether each may be changed at all."""
    flat, count = path.flat, len(path.flat)
    unsaid = np.full(count, np.nan)
    if not isinstance(tolerance, str):
        allowed = np.full(count, tolerance)
    elif path.tolerances is None:
        allowed = np.zeros(count)
    else:
        allowed = np.where(np.isfinite(path.tolerances), path.tolerances, UNBOUNDED_TOLERANCE)
    if share is not None:
        allowed = share * allowed
    loose = (allowed > 0.0) & (flat.sizes(slice(path.linear)) > 0.0) & ~flat.turning(path.linear)
    if path.feeds is not None:
        loose &= np.isfinite(path.feeds)
    lines = (flat.degrees == 1) & (flat.rational == 0) & (np.diff(flat.point_starts) == 2)
    no = np.zeros(count, dtype=bool)
    return Batch(
        flat, np.arange(first, first + count), np.where(loose, allowed, 1.0), np.zeros(count), lines & loose, loose,
        no, no, unsaid if path.feeds is None else path.feeds, unsaid if path.tolerances is None else path.tolerances,
    )  # fmt: skip

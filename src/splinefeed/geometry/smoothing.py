"""Smoothing: a path of lines, arcs and curves as one of continuous curvature, within a tolerance."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing_joints import NO_REST, Transitions, transitions
from splinefeed.geometry.smoothing_runs import Pieces, frozen, pieces
from splinefeed.records import Array, BoolArray, IntArray

#: Joints that turn by more than this are corners.
SMOOTHING_CORNER_ANGLE = math.radians(45.0)
#: How far rotary axes may leave the original, rad, unless it is said.
ANGULAR_TOLERANCE = math.radians(0.05)
#: The tolerance, mm, where a program smooths without one: G64 without P.
UNBOUNDED_TOLERANCE = 0.01
#: Tolerance of the path's own, as `tolerance` of `smoothed`.
PROGRAM = "program"
#: Share of what is left of the tolerance that transitions use: the rest covers rounding and what lies between samples.
JOINT = 0.95
#: A parameter this near a knot, relative to the largest one, is the knot.
SAME_KNOT = 1e-12
CORNERS = ("keep", "round")
_QUINTIC = frozen(np.repeat([0.0, 1.0], 6))


def smoothed(
    path: Path,
    tolerance: float | str,
    *,
    corner_angle: float = SMOOTHING_CORNER_ANGLE,
    corners: str = "keep",
    angular_tolerance: float = ANGULAR_TOLERANCE,
) -> Path:
    """The path with continuous tangent and curvature and bounded third derivative, within `tolerance` everywhere.

    tolerance          mm; or "program" for what each curve says itself (G64 P), where 0 or nothing leaves it exact
    corner_angle       joints that turn by more, rad, are corners
    corners            "keep" them, the tool rests there, or "round" them within the tolerance; reversals are kept
    angular_tolerance  of rotary axes, rad

    Runs of short lines become splines of degree 5 (least squares, knots where the error is); at the joints that are
    left, of whatever curves, quintics lead from one to the other. What they leave of long lines and of arcs stays as
    it is. Feeds, tolerances and markers stay at their places; rapid moves, stops and moves of rotary axes alone stay
    exact. Raises InputError for arguments that cannot be used. See docs/smoothing.md.
    """
    allowed = _allowed(path, tolerance)
    if not 0.0 < corner_angle <= math.pi:
        raise InputError(f"corner_angle is {corner_angle:g} rad; it must lie above 0 and at most at pi")
    if corners not in CORNERS:
        raise InputError(f"corners is {corners!r}; choose 'keep' or 'round'")
    if not 0.0 < angular_tolerance < math.inf:
        raise InputError(f"angular_tolerance is {angular_tolerance!r} rad; it must be greater than 0 and finite")
    loose = (allowed > 0.0) & (path.flat.sizes(slice(path.linear)) > 0.0) & ~path.flat.turning(path.linear)
    if path.feeds is not None:
        loose &= np.isfinite(path.feeds)
    if not loose.any():
        return path
    allowed = np.where(loose, allowed, 1.0)
    free = loose[:-1] & loose[1:]
    apart = _apart(path)
    for marker in path.markers:
        if 0 < marker.before < len(path.curves):
            apart[marker.before - 1] = True
            free[marker.before - 1] &= not marker.stop
    runs = pieces(path, allowed, angular_tolerance, free & ~apart, loose, corner_angle)
    joint = runs.first[1:-1] - 1
    budget = np.minimum(allowed[joint], allowed[joint + 1])
    share = JOINT * (1.0 - np.maximum(runs.spent[:-1], runs.spent[1:]))
    base = Path(runs.curves, path.axes, tolerance=path.tolerance) if len(runs.curves) < len(path.curves) else path
    may = free[joint] & ~runs.corner if corners == "keep" else free[joint]
    made = transitions(base, share * budget, share * angular_tolerance, may)
    return _assembled(path, base, runs, made, apart[joint])


def _allowed(path: Path, tolerance: float | str) -> Array:
    """Tolerance of each curve (curves,), mm; 0 where it must stay."""
    count = len(path.curves)
    if isinstance(tolerance, str):
        if tolerance != PROGRAM:
            raise InputError(f"tolerance is {tolerance!r}; give a number of mm or 'program'")
        if path.tolerances is None:
            return np.zeros(count)
        return np.where(np.isfinite(path.tolerances), path.tolerances, UNBOUNDED_TOLERANCE)
    value = float(tolerance)
    if not 0.0 < value < math.inf:
        raise InputError(f"tolerance is {value:g} mm; it must be greater than 0 and finite")
    if value > path.size > 0.0:
        raise InputError(f"tolerance is {value:g} mm, more than the whole path, {path.size:.4g} mm; give a smaller one")
    return np.full(count, value)


def _apart(path: Path) -> BoolArray:
    """Joints (curves - 1,) at which what is said of the curves changes."""
    apart = np.zeros(len(path.curves) - 1, dtype=bool)
    for said in (path.feeds, path.tolerances):
        if said is not None:
            apart |= said[1:] != said[:-1]
    return apart


@dataclass
class _Result:
    """Curves put together, and the curve of the path that each begins on."""

    curves: list[NurbsCurve]
    owner: list[int]

    def add(self, curve: NurbsCurve, owner: int) -> None:
        self.curves.append(curve)
        self.owner.append(owner)


def _assembled(path: Path, base: Path, runs: Pieces, made: Transitions, apart: BoolArray) -> Path:
    """Pieces shortened by the transitions between them, with all that is said of them."""
    out = _Result([], [])
    count = len(runs.curves)
    begins: dict[int, int] = {}
    lengths = np.diff(base.curve_starts)
    rest = lengths - np.append(0.0, made.reach) - np.append(made.reach, 0.0)
    left = (rest > NO_REST * lengths).tolist()
    reach, owner = made.reach.tolist(), runs.first.tolist()
    split = apart.tolist()
    straight = ((base.flat.degrees == 1) & (np.diff(base.flat.point_starts) == 2)).tolist()
    rests = base.ends.copy()  # of lines, what the transitions leave
    rests[1:, 0] = np.where(made.reach[:, None] > 0.0, made.points[:, 5], rests[1:, 0])
    rests[:-1, 1] = np.where(made.reach[:, None] > 0.0, made.points[:, 0], rests[:-1, 1])
    rests.setflags(write=False)
    for i, curve in enumerate(runs.curves):
        begins.setdefault(owner[i], len(out.curves))
        if left[i]:
            opens, closes = bool(i and reach[i - 1]), bool(i + 1 < count and reach[i])
            if not opens and not closes:
                out.add(curve, owner[i])
            elif straight[i]:
                out.add(NurbsCurve.trusted(1, LINE_KNOTS, rests[i]), owner[i])
            else:
                cuts = made.behind[i - 1 : i].tolist() * opens + made.before[i : i + 1].tolist() * closes
                out.add(curve.split(*(_at_knot(curve, u) for u in cuts))[opens], owner[i])
        if i + 1 == count or not reach[i]:
            continue
        points = made.points[i]
        if i and not left[i] and reach[i - 1]:
            points = frozen(np.vstack([made.points[i - 1, 5:], points[1:]]))
        if split[i]:
            halves = _halves(points)
            out.add(NurbsCurve.trusted(5, _QUINTIC, halves[0]), owner[i])
            begins[owner[i + 1]] = len(out.curves)
            out.add(NurbsCurve.trusted(5, _QUINTIC, halves[1]), owner[i + 1])
        else:
            out.add(NurbsCurve.trusted(5, _QUINTIC, points), owner[i])
    return _said_again(path, out, begins, runs, made)


def _at_knot(curve: NurbsCurve, u: float) -> float:
    """The knot that u is but for rounding, or u."""
    nearest = float(curve.breaks[np.argmin(np.abs(curve.breaks - u))])
    size = max(map(abs, curve.domain))
    return nearest if abs(nearest - u) <= SAME_KNOT * size and nearest not in curve.domain else u


def _halves(points: Array) -> tuple[Array, Array]:
    """Bezier points of both halves (de Casteljau's algorithm; The NURBS Book, 2nd ed., algorithm A1.5)."""
    front, back = [points[0]], [points[-1]]
    while len(points) > 1:
        points = 0.5 * (points[1:] + points[:-1])
        front.append(points[0])
        back.append(points[-1])
    return frozen(np.array(front)), frozen(np.array(back[::-1]))


def _said_again(path: Path, out: _Result, begins: dict[int, int], runs: Pieces, made: Transitions) -> Path:
    """The path of the result, with feeds, tolerances and markers at their places."""
    owner: IntArray = np.array(out.owner, dtype=np.int64)

    def place(before: int) -> int:
        return len(owner) if before == len(path.curves) else begins[before]

    markers = [dataclasses.replace(m, before=place(m.before)) for m in path.markers]
    tolerances = None if path.tolerances is None else path.tolerances[owner]
    feeds = None if path.feeds is None else path.feeds[owner]
    count = int(np.count_nonzero(made.reach))
    findings: Sequence[str] = (
        f"smoothed: {len(path.curves)} curve(s) became {len(owner)}, {runs.fits} of them splines over runs of short "
        f"lines and {count} transitions",
    )
    return Path(
        out.curves,
        path.axes,
        name=path.name,
        findings=(*path.findings, *findings),
        tolerance=max(path.tolerance, 1e-9 * path.size),
        feeds=feeds,
        tolerances=tolerances,
        markers=markers,
    )

"""Which corners of a path are passed in motion, and where its direction or curvature jumps without one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from splinefeed.errors import PlanError
from splinefeed.feed.bounds import AxisLimits, feed_squared_bound
from splinefeed.feed.cells import sample, speed_by_u
from splinefeed.feed.stretches import curve_feeds
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kernels.pieces import START, point, turns
from splinefeed.records import Array, IntArray, Limits

#: A corner that turns back by less than this, rad, is no corner to pass but a cusp.
SHARPEST = np.pi - 1e-3
#: A corner is passed where that allows at least this share of the feed that a ramp at rest soon reaches; else it is a
#: stop, as a feed next to nothing is.
WORTH_PASSING = 0.02
#: Golden section for the sharpest place of a bend; one is sharp where q is below this share of that at samples beside.
SECTIONS, GOLDEN, SHARP = 60, 0.5 * (5.0**0.5 - 1.0), 0.5
#: A bend between samples nearer to each other than this share of what they are on the average is hidden from a grid.
NARROW = 1e-2
#: A low point below both its neighbours by less than this share is rounding: on a circle, all places are alike.
FLAT = 1e-6
#: Rests nearer to each other than this share of the path are one.
NEXT_TO = 1e-9
#: The linear axes stand still at a speed below this share of the size of their curve; a rotary one turns above that.
STANDING, TURNING = 1e-6, 1e-6
#: Places on each arc-length piece of the path where bends are looked for.
SAMPLES = 9
#: Arc-length pieces of the path whose bends are looked at together, or all of a curve that has more.
ROWS_AT_ONCE = 16384
#: Stops nearer than this share of the path are one place: what lies between is rounding.
SAME = 1e-12


@dataclass(frozen=True, eq=False)
class Corners:
    """Where the tool rests, and where it passes a corner of the tangent.

    rests   how many of these marks are neither corners nor asked for, but bends so sharp that the tool may as well rest
    marks   (m,)  arc lengths of the ends of all stretches from rest to rest, mm, 0 and the length of the path included
    passed  (k,)  arc lengths of the corners that are passed in motion, mm
    sharp   (j,)  arc lengths of other sharp bends, mm, for a grid to see
    narrow  (i, 2)  and of some so narrow that it does not see them at all, with the bound of q there, mm^2/s^2
    feed    (k,)  largest feed there, mm/s: |feed (t_after - t_before)| <= axis_velocity_step for every axis
    """

    marks: Array
    passed: Array
    feed: Array
    rests: int = 0
    sharp: Array = field(default_factory=lambda: np.zeros(0))
    narrow: Array = field(default_factory=lambda: np.zeros((0, 2)))


def find_corners(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> Corners:
    """What to do at each corner of the path under limits; without axis_velocity_step the tool stops at all of them."""
    passed, feeds = passed_corners(path, limits, axes, period)
    in_motion = set(passed.tolist())
    asked_for = np.array([0.0, *(s for s in path.stops if s not in in_motion), path.length])
    standing, sharp, narrow = _bends(path, limits, axes, period)
    marks = apart(path.length, asked_for, standing)
    return Corners(marks, passed, feeds, max(len(marks) - len(asked_for), 0), sharp, narrow)


def passed_corners(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> tuple[Array, Array]:
    """Stops of the path that are corners passed in motion, (k,), mm, and the largest feed there, (k,), mm/s.

    There are none without axis_velocity_step; a corner next to which the feed would be next to nothing stays a stop.
    """
    passed: list[float] = []
    feeds: list[float] = []
    if limits.axis_velocity_step is None:
        return np.zeros(0), np.zeros(0)
    step = limits.of_axes("axis_velocity_step", path.axes)
    stops = set(path.stops)
    asked = {float(path.curve_starts[m.before]) for m in path.markers if m.stop}
    soon = worth(limits, axes)
    for corner in path.corners:
        if not corner.stop or corner.angle > SHARPEST or corner.s in asked or not np.isfinite(corner.curvature_jump):
            continue
        after = min(corner.curve + int(corner.u >= path.curves[corner.curve].domain[1]), len(path.curves) - 1)
        u_after = corner.u if after == corner.curve else path.curves[after].domain[0]
        left = by_arc_length(path.evaluate([corner.curve], [corner.u], 3, side="left"), path.linear)[0, 1]
        right = by_arc_length(path.evaluate([after], [u_after], 3), path.linear)[0, 1]
        with np.errstate(divide="ignore"):
            feed = float(np.min(step / np.abs(right - left)))
        if limits.chord_error is not None and period is not None:
            # a step d across the corner leaves it by at most d / 2 sin(angle / 2)
            feed = min(feed, 2.0 * limits.chord_error / (period * np.sin(0.5 * corner.angle)))
        if feed > soon and corner.s in stops:
            stops.remove(corner.s)
            passed.append(corner.s)
            feeds.append(feed)
    return np.array(passed), np.array(feeds)


def apart(length: float, marks: Array, more: Array) -> Array:
    """The marks without those that rounding puts beside another, and of what is added all that is not next to one.

    marks (m,) with both ends, more (k,): arc lengths on a path of this length, mm.
    """
    inner = marks[1:-1]
    clear = np.diff(marks[:-1]) > SAME * length
    clear &= marks[-1] - inner > SAME * length
    marks = np.concatenate([marks[:1], inner[clear], marks[-1:]])
    for s in more:
        if np.min(np.abs(marks - s)) > NEXT_TO * length:
            marks = np.sort(np.append(marks, s))
    return marks


def check_turns(path: Path, marks: Array, axes: AxisLimits) -> None:
    """Raise PlanError where the linear axes stand still while a limited rotary axis turns on: no law s(t) can do it.

    They stand at a mark (m,), mm, where C' = 0, and on a row of the path that is not told from a place on it.
    """
    rotary = np.isfinite(axes.velocity + 0.0) | np.isfinite(axes.acceleration) | np.isfinite(axes.jerk)
    rotary[: path.linear] = False
    if not np.any(rotary):
        return
    for s in marks:
        curve, u = path.locate(np.array([s]))
        here = path.curves[int(curve[0])]
        d = path.evaluate(curve, u, 1)[0, 1]
        moved = float(np.linalg.norm(np.ptp(here.control_points[:, : path.linear], axis=0)))
        size = moved / (here.domain[1] - here.domain[0])
        if moved > 0.0 and np.linalg.norm(d[: path.linear]) <= STANDING * size and np.linalg.norm(d[rotary]) > TURNING:
            axis = path.axes[int(np.argmax(np.where(rotary, np.abs(d), 0.0)))]
            raise PlanError(
                f"at s = {s:.6g} mm the linear axes stand still while {axis} turns on; its limits cannot be held by a "
                "motion along the path: smooth or split it there, or leave the limits of that axis out"
            )
    ends = np.empty((2, len(path.axes)))
    for row in np.flatnonzero(np.diff(np.append(path.table[:, START], path.length)) <= SAME * path.length).tolist():
        if turns(path.table, row, path.shape):
            continue
        point(path.table, row, path.shape, -1.0, ends[0])
        point(path.table, row, path.shape, 1.0, ends[1])
        turned = np.where(rotary, np.abs(ends[1] - ends[0]), 0.0)
        if np.max(turned) > TURNING:
            raise PlanError(
                f"at s = {path.table[row, START]:.6g} mm the linear axes stand still while "
                f"{path.axes[int(np.argmax(turned))]} turns on; its limits cannot be held by a motion along the path: "
                "split it there, let the linear axes stand exactly, or leave the limits of that axis out"
            )


def _bends(path: Path, limits: Limits, axes: AxisLimits, period: float | None) -> tuple[Array, Array, Array]:
    """Arc lengths (k,) of bends so sharp that the feed there is next to nothing, mm, and of others, (j,).

    At the first the tool may as well rest. Both are where the bound of q is least, or |C'|, which hides what is next to
    a cusp between samples. Besides, (i, 2), narrow ones and the bound of q there, which is hardly less than beside: as
    where a cusp is rounded off, and only there the tangent is along an axis, whose velocity is limited.
    """
    soon = worth(limits, axes) ** 2
    feeds = curve_feeds(path, limits)

    def top(curve: IntArray, u: Array) -> Array:
        d = by_arc_length(path.evaluate(curve, u, 3), path.linear)
        d = np.where(np.isfinite(d), d, 0.0)
        bound = feed_squared_bound(d[:, 1], d[:, 2], feeds[curve], limits, axes, period, path.linear)
        with np.errstate(divide="ignore"):
            bound = np.fmin(bound, np.fmin.reduce(axes.acceleration / np.abs(d[:, 2]), axis=1))
            found: Array = np.fmin(bound, np.fmin.reduce(axes.jerk / np.abs(d[:, 3]), axis=1) ** (2.0 / 3.0))
        return found

    def speed(curve: IntArray, u: Array) -> Array:
        return speed_by_u(path.evaluate(curve, u, 1)[:, 1], path.linear)

    rests, others, narrow = [np.zeros(0)], [np.zeros(0)], [np.zeros((0, 2))]
    near = NARROW * path.length / (SAMPLES * len(path.table))
    for curve, u in _samples(path):
        same = (curve[1:-1] == curve[:-2]) & (curve[1:-1] == curve[2:])
        for function in (top, speed):
            q = function(curve, u)
            low = same & (q[1:-1] <= q[:-2]) & (q[1:-1] <= q[2:]) & (q[1:-1] < (1.0 - FLAT) * np.maximum(q[:-2], q[2:]))
            at = 1 + np.flatnonzero(low)
            owner, left, right = curve[at], u[at - 1].copy(), u[at + 1].copy()
            for _ in range(SECTIONS if len(at) else 0):
                a, b = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
                lower = function(owner, a) <= function(owner, b)
                left, right = np.where(lower, left, a), np.where(lower, b, right)
            best = 0.5 * (left + right)
            s, slow = path.arc_length(owner, best), top(owner, best)
            rests.append(s[slow < soon])
            deep = slow < SHARP * np.minimum(top(owner, u[at - 1]), top(owner, u[at + 1]))
            others.append(s[(slow >= soon) & deep])
            wide = path.arc_length(owner, u[at + 1]) - path.arc_length(owner, u[at - 1])
            narrow.append(np.column_stack([s, slow])[(slow >= soon) & ~deep & (wide < near)])
    return np.concatenate(rests), np.unique(np.concatenate(others)), np.concatenate(narrow)


def _samples(path: Path) -> Iterator[tuple[IntArray, Array]]:
    """Curves and parameters of places along the whole path, so many whole curves at a time that memory stays small."""
    blocks = path.curve_rows[:, 1] // ROWS_AT_ONCE
    first = np.append(np.flatnonzero(np.diff(blocks, prepend=-1)), len(path.curves))
    for begin, end in pairwise(path.curve_starts[first]):
        curve, u, _ = sample(path, float(begin), float(end), SAMPLES)
        if len(curve):
            yield curve, u


def worth(limits: Limits, axes: AxisLimits) -> float:
    """Feed in mm/s below which passing a corner is no better than a stop."""
    push = min(limits.acceleration, float(np.min(axes.acceleration)))
    twist = min(limits.jerk, float(np.min(axes.jerk)))
    top = min(limits.feed, float(np.min(axes.velocity)))
    return WORTH_PASSING * (min(push * push / twist, top) if np.isfinite(push / twist) else top)

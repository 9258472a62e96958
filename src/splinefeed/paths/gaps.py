"""Gaps between curves of a path that its tolerance allows: closed, as a gap is a jump of the setpoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import greville
from splinefeed.curves.packed import Flat, Lines, Packed
from splinefeed.records import Array, BoolArray

#: A gap below this many roundings of the largest coordinate counts as 0.
ROUNDINGS = 8.0
#: A curve that is less than this many gaps long keeps its end: the neighbour comes to it.
SHORTEST = 16.0


def open_joints(ends: Array) -> BoolArray:
    """Whether each curve ends beside the start of the next one, (n - 1,), by more than rounding; ends (n, 2, axes)."""
    gaps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    found: BoolArray = gaps > ROUNDINGS * np.finfo(float).eps * float(np.max(np.abs(ends)))
    return found


def closed(curves: Sequence[NurbsCurve], ends: Array, linear: int) -> Sequence[NurbsCurve]:
    """The curves, (n,), without gaps between first and last points ends (n, 2, axes): joints lie in their middle.

    A curve is moved by shift_0 (1 - c) + shift_1 c, c being where in its domain each control point counts most
    (Greville), from 0 to 1: that is linear in u, so that a line stays a line, and no tangent turns by more than what
    the gap is of the length. Where one curve is hardly longer than the gap, over the linear axes for these and over
    all for the others, the other one moves; where both are, the gap stays.
    """
    if isinstance(curves, Lines):
        return curves
    flat = curves.flat if isinstance(curves, Packed) else Flat.of(curves)
    gap = ends[1:, 0] - ends[:-1, 1]
    wide = open_joints(ends)
    # parts of the gap that the end of the one before it and the start of the one behind it go
    before, behind = np.zeros(gap.shape, dtype=bool), np.zeros(gap.shape, dtype=bool)
    for columns, by in ((slice(linear), slice(linear)), (slice(linear, None), slice(None))):
        size, width = flat.sizes(by), np.linalg.norm(gap[:, columns], axis=1)
        before[:, columns] = (wide & (size[:-1] > SHORTEST * width))[:, None]
        behind[:, columns] = (wide & (size[1:] > SHORTEST * width))[:, None]
    joint = np.where(before & behind, 0.5 * (ends[:-1, 1] + ends[1:, 0]), np.where(before, ends[1:, 0], ends[:-1, 1]))
    wanted = ends.copy()
    wanted[:-1, 1] = np.where(before, joint, ends[:-1, 1])
    wanted[1:, 0] = np.where(behind, joint, ends[1:, 0])
    moved = np.flatnonzero(np.any(wanted != ends, axis=(1, 2)))
    if not len(moved):
        return curves
    each = list(curves)
    for i in moved.tolist():
        each[i] = moved_ends(each[i], wanted[i])
    return Packed(Flat.of(each)) if isinstance(curves, Packed) else tuple(each)


def said_of(gaps: Sequence[float], least: float) -> tuple[str, ...]:
    """A sentence on gaps, mm, above `least` that are closed, if there are any."""
    wide = [gap for gap in gaps if gap > least]
    if not wide:
        return ()
    return (f"{len(wide)} gap(s) of up to {max(wide):.3g} mm between curves closed, as the tolerance allows",)


def begun_at(curves: Sequence[NurbsCurve], point: Array, linear: int) -> Sequence[NurbsCurve]:
    """The curves with the start of the first one moved to a point (axes,) next to it, unless it must stay: `closed`."""
    first = curves[0]
    start = first.ends[0].copy()
    for columns, by in ((slice(linear), slice(linear)), (slice(linear, None), slice(None))):
        size = float(Flat.of([first]).sizes(by)[0])
        if size > SHORTEST * float(np.linalg.norm(start[columns] - point[columns])):
            start[columns] = point[columns]
    if np.array_equal(start, first.ends[0]):
        return curves
    ends = np.array([start, first.ends[1]])
    if isinstance(curves, Lines):
        return Lines(np.vstack([start, curves.points[1:]]))
    return (moved_ends(first, ends), *curves[1:])


def moved_ends(curve: NurbsCurve, ends: Array) -> NurbsCurve:
    """The curve with these first and last points, (2, axes): see `closed`."""
    whole = curve.with_clamped_ends()
    places = greville(whole.degree, whole.knots)
    share = ((places - places[0]) / (places[-1] - places[0]))[:, None]
    shift = ends - whole.control_points[[0, -1]]
    points = whole.control_points + (1.0 - share) * shift[0] + share * shift[1]
    points[0], points[-1] = ends
    return NurbsCurve(whole.degree, whole.knots, points, whole.weights)

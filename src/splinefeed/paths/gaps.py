"""Gaps between curves of a path that its tolerance allows: closed, as a gap is a jump of the setpoints."""

from __future__ import annotations

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import greville
from splinefeed.curves.packed import Flat, Packed
from splinefeed.records import Array, BoolArray

#: A gap below this many roundings of the largest coordinate counts as 0.
ROUNDINGS = 8.0
#: A curve that is less than this many gaps long keeps its end: the neighbour comes to it.
SHORTEST = 16.0


def widths(ends: Array) -> Array:
    """How far the end of each curve is from the start of the next one, (n - 1,); ends (n, 2, axes)."""
    return np.asarray(np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1))


def open_joints(ends: Array) -> BoolArray:
    """Find where curves end beside the start of the next one by more than rounding.

    Parameters
    ----------
    ends : (n, 2, axes) array
        First and last point of each.

    Returns
    -------
    (n - 1,) array of bool
        Whether each does.
    """
    found: BoolArray = widths(ends) > ROUNDINGS * np.finfo(float).eps * float(np.max(np.abs(ends)))
    return found


def closed(curves: Packed, linear: int, outer: Array) -> Packed:
    """Close gaps between the last point of one curve and the first of the next: joints lie in the middle.

    Parameters
    ----------
    curves : Packed
        The n curves.
    linear : int
        How many of the first axes are linear.
    outer : (2, axes) array
        Where they begin and end.

    Returns
    -------
    Packed
        Without gaps.

    Notes
    -----
    A curve is moved by shift_0 (1 - c) + shift_1 c, c being where in its domain each control point counts most
    (Greville), from 0 to 1: that is linear in u, so that a line stays a line, and no tangent turns by more than what
    the gap is of the length. Where one curve is hardly longer than the gap, over the linear axes for these and over
    all for the others, the other one moves; where both are, the gap stays.
    """
    flat, ends = curves.flat, curves.ends
    gap = ends[1:, 0] - ends[:-1, 1]
    wide = open_joints(ends)[:, None]
    # parts of the gap that the end of the one before it and the start of the one behind it go
    before = wide & _longer(flat, np.pad(gap, ((0, 1), (0, 0))), linear)[:-1]
    behind = wide & _longer(flat, np.pad(gap, ((1, 0), (0, 0))), linear)[1:]
    joint = np.where(before & behind, 0.5 * (ends[:-1, 1] + ends[1:, 0]), np.where(before, ends[1:, 0], ends[:-1, 1]))
    wanted = ends.copy()
    wanted[0, 0], wanted[-1, 1] = outer
    wanted[:-1, 1] = np.where(before, joint, ends[:-1, 1])
    wanted[1:, 0] = np.where(behind, joint, ends[1:, 0])
    moved = np.flatnonzero(np.any(wanted != ends, axis=(1, 2)))
    return curves.changed({i: moved_ends(curves[i], wanted[i]) for i in moved.tolist()})


def begun_at(curves: Packed, point: Array, linear: int) -> Packed:
    """The curves with the start of the first one moved to a point (axes,) next to it, unless it must stay: `closed`."""
    outer = curves.ends[[0, -1], [0, 1]]
    moves = _longer(curves.flat.part(0, 1), outer[:1] - point, linear)[0]
    outer[0, moves] = point[moves]
    return closed(curves, linear, outer)


def _longer(flat: Flat, gap: Array, linear: int) -> BoolArray:
    """Whether curves are so much longer than gaps (n, axes) that their ends may go along them, axis by axis."""
    out = np.empty(gap.shape, dtype=bool)
    for columns, by in ((slice(linear), slice(linear)), (slice(linear, None), slice(None))):
        out[:, columns] = (flat.sizes(by) > SHORTEST * np.linalg.norm(gap[:, columns], axis=1))[:, None]
    return out


def moved_ends(curve: NurbsCurve, ends: Array) -> NurbsCurve:
    """Move the ends of a curve: see `closed`.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    ends : (2, axes) array
        Its new first and last points.

    Returns
    -------
    NurbsCurve
        The curve between these.
    """
    whole = curve.with_clamped_ends()
    places = greville(whole.degree, whole.knots)
    share = ((places - places[0]) / (places[-1] - places[0]))[:, None]
    shift = ends - whole.control_points[[0, -1]]
    points = whole.control_points + (1.0 - share) * shift[0] + share * shift[1]
    points[0], points[-1] = ends
    return NurbsCurve(whole.degree, whole.knots, points, whole.weights)

"""How far points lie from curves: by foot points near a known parameter, and from the nearest points of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import Flat
from splinefeed.geometry.nearest import Nearest
from splinefeed.geometry.tables import arc_pieces
from splinefeed.records import Array


def foot_points(
    curve: NurbsCurve, u: Array, points: Array, periodic: bool = False, steps: int = 3
) -> tuple[Array, Array]:
    """Parameters (n,) of foot points near u (n,) on one curve, and distances (n,), mm, of points (n, axes) from these.

    Never more than at u.    u <- u - (C - Q).C' / (C'.C' + (C - Q).C'')     (The NURBS Book, 2nd ed., eq. 6.3)
    """
    low, high = curve.domain
    best, where = np.full(len(u), np.inf), u
    for step in range(steps + 1):
        there = curve.derivatives(u, 2)
        off = there[:, 0] - points
        distance = np.linalg.norm(off, axis=1)
        where = np.where(distance < best, u, where)
        best = np.minimum(best, distance)
        if step == steps:
            break
        slope = np.sum(off * there[:, 1], axis=1)
        speed = np.sum(there[:, 1] ** 2, axis=1)
        bend = speed + np.sum(off * there[:, 2], axis=1)
        bend = np.where(bend > 0.25 * speed, bend, speed)  # far off, a Gauss-Newton step still goes downhill
        u = u - np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0.0)
        u = u - np.floor(u) if periodic else np.clip(u, low, high)
    return where, best


def distances(curves: Sequence[NurbsCurve], points: Array) -> Array:
    """Distance (n,), mm, of every point (n, axes) from the nearest point of all curves, which need not be joined.

    Found by `geometry.nearest` alone, with nothing that a fitter knows.
    """
    flat, axes = Flat.of(curves), curves[0].axes
    shape = (int(flat.degrees.max()), axes, axes, int(flat.rational.max()))
    return Nearest(arc_pieces(flat, shape, curves).table, shape).find(points)[2]

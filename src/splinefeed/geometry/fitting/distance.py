"""How far points lie from curves: by foot points near a known parameter, and by search over everything."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array

#: Samples a span, and at least how many a curve, among which the search for nearest points begins.
SAMPLES_PER_SPAN = 8
LEAST_SAMPLES = 64
#: Samples that are tried for each point: a thin trailing edge or a crossing has more than one valley near by.
CANDIDATES = 4
#: Newton steps from each of them; from a sample this near, fewer reach rounding.
STEPS = 8
#: Points that are searched for at once, so that memory stays small.
CHUNK = 50_000


def foot_points(curve: NurbsCurve, u: Array, points: Array, periodic: bool = False, steps: int = 3) -> Array:
    """Distances (n,), mm, of points (n, axes) from their foot points near u (n,) on one curve; never more than at u.

    u <- u - (C - Q).C' / (C'.C' + (C - Q).C'')     (The NURBS Book, 2nd ed., eq. 6.3)
    """
    return _newton(curve, u, points, np.full(len(u), curve.domain[0]), np.full(len(u), curve.domain[1]), periodic, steps)[1]


def nearest_parameter(curve: NurbsCurve, point: Array) -> float:
    """Parameter of the curve's nearest point to `point` (axes,)."""
    return float(_search([curve], point[None, :])[1][0])


def distances(curves: Sequence[NurbsCurve], points: Array) -> Array:
    """Distance (n,), mm, of every point (n, axes) from the nearest point of all curves.

    Found from a sampling of the curves alone, with nothing that a fitter knows: candidates by a k-d tree, then Newton's
    method between the neighbouring samples.
    """
    return _search(curves, points)[0]


def _search(curves: Sequence[NurbsCurve], points: Array) -> tuple[Array, Array]:
    """Distances (n,) and parameters (n,) on whichever curve is nearest."""
    from scipy.spatial import cKDTree

    parameters, places, low, high, owner = [], [], [], [], []
    for i, curve in enumerate(curves):
        breaks = curve.breaks
        count = max(SAMPLES_PER_SPAN, -(-LEAST_SAMPLES // (len(breaks) - 1)))
        fractions = np.arange(count) / count
        u = np.append((breaks[:-1, None] + fractions * np.diff(breaks)[:, None]).ravel(), breaks[-1])
        parameters.append(u)
        places.append(curve(u))
        low.append(np.concatenate([u[:1], u[:-1]]))
        high.append(np.concatenate([u[1:], u[-1:]]))
        owner.append(np.full(len(u), i))
    u_all, low_all, high_all, owner_all = (np.concatenate(list_) for list_ in (parameters, low, high, owner))
    tree = cKDTree(np.concatenate(places))
    wanted = min(CANDIDATES, len(u_all))
    best, where = np.empty(len(points)), np.empty(len(points))
    for first in range(0, len(points), CHUNK):
        chunk = points[first : first + CHUNK]
        found = np.asarray(tree.query(chunk, wanted)[1]).reshape(len(chunk), wanted).ravel()
        query = np.repeat(chunk, wanted, axis=0)
        order = np.argsort(owner_all[found], kind="stable")
        bounds = np.searchsorted(owner_all[found][order], np.arange(len(curves) + 1))
        distance, parameter = np.empty(len(found)), np.empty(len(found))
        for i in np.flatnonzero(np.diff(bounds)):
            rows = order[bounds[i] : bounds[i + 1]]
            at = found[rows]
            parameter[rows], distance[rows] = _newton(
                curves[i], u_all[at], query[rows], low_all[at], high_all[at], False, STEPS
            )
        pick = np.argmin(distance.reshape(-1, wanted), axis=1)
        rows = np.arange(len(chunk)) * wanted + pick
        best[first : first + CHUNK], where[first : first + CHUNK] = distance[rows], parameter[rows]
    return best, where


def _newton(
    curve: NurbsCurve, u: Array, points: Array, low: Array, high: Array, periodic: bool, steps: int
) -> tuple[Array, Array]:
    """Best parameters (n,) and distances (n,) met on Newton's way from u within [low, high]."""
    best = where = None
    for step in range(steps + 1):
        there = curve.derivatives(u, 2)
        off = there[:, 0] - points
        distance = np.linalg.norm(off, axis=1)
        better = np.full(len(u), True) if best is None else distance < best
        best = distance if best is None else np.where(better, distance, best)
        where = u if where is None else np.where(better, u, where)
        if step == steps:
            break
        slope = np.sum(off * there[:, 1], axis=1)
        speed = np.sum(there[:, 1] ** 2, axis=1)
        bend = speed + np.sum(off * there[:, 2], axis=1)
        bend = np.where(bend > 0.25 * speed, bend, speed)  # far off, a Gauss-Newton step still goes downhill
        u = u - np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0.0)
        u = u - np.floor(u) if periodic else np.clip(u, low, high)
    assert best is not None and where is not None
    return where, best

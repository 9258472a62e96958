"""How far points lie from curves: by foot points near a known parameter, and by search over everything."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array, IntArray

#: Samples over the length of all curves, at least two a span, among which the search for nearest points begins.
SAMPLES = 10_000
#: Samples that are tried first for each point, and at most where curves lie close together.
CANDIDATES = 4
MOST_CANDIDATES = 256
#: A point no further from a sample than this, relative to the coordinates, lies on it: corners and ends do.
SAME_POINT = 1e-15
#: Newton steps from each of them; from a sample this near, fewer reach rounding.
STEPS = 8
#: Samples a span for points that seem too far off, and how many of these at most.
FINER, MOST_AGAIN = 16, 2000
#: Points among which the farthest is searched at once.
AT_ONCE = 20_000
#: Candidates that are refined at once, so that memory stays small.
CHUNK = 400_000


def foot_points(
    curve: NurbsCurve, u: Array, points: Array, periodic: bool = False, steps: int = 3
) -> tuple[Array, Array]:
    """Parameters (n,) of foot points near u (n,) on one curve, and distances (n,), mm, of points (n, axes) from these.

    Never more than at u.    u <- u - (C - Q).C' / (C'.C' + (C - Q).C'')     (The NURBS Book, 2nd ed., eq. 6.3)
    """
    return _newton(
        curve, u, points, np.full(len(u), curve.domain[0]), np.full(len(u), curve.domain[1]), periodic, steps
    )


def nearest_parameter(curve: NurbsCurve, point: Array) -> float:
    """Parameter of the curve's nearest point to `point` (axes,)."""
    return float(_search([curve], point[None, :])[1][0])


def distances(curves: Sequence[NurbsCurve], points: Array) -> Array:
    """Distance (n,), mm, of every point (n, axes) from the nearest point of all curves.

    Found from a sampling of the curves alone, without data of the fit: candidates by a k-d tree, then Newton's
    method between the neighbouring samples. A nearest point is at most half a spacing from a sample, so that samples
    further off than the best distance and that need not be tried.
    """
    return _search(curves, points)[0]


def largest_distance(curves: Sequence[NurbsCurve], points: Array, allowed: float) -> float:
    """The greatest of `distances`, mm, searched for in full only where it may be.

    Steps from the nearest sample bound every distance from above; points are searched the farthest first until none
    that is left can be farther. Where curves follow noise a span may hold more than one nearest place: points that
    seem farther off than `allowed`, mm, are searched again among FINER samples a span.
    """
    bound = np.full(len(points), np.inf) if len(points) <= AT_ONCE else _bounds(curves, points)
    order = np.argsort(-bound, kind="stable")
    largest = 0.0
    for first in range(0, len(order), AT_ONCE):
        rows = order[first : first + AT_ONCE]
        if bound[rows[0]] <= largest:
            break
        found = distances(curves, points[rows])
        far = np.flatnonzero(found > allowed)
        if 0 < len(far) <= MOST_AGAIN:
            found[far] = np.minimum(found[far], _search(curves, points[rows[far]], FINER)[0])
        largest = max(largest, float(np.max(found)))
    return largest


def _bounds(curves: Sequence[NurbsCurve], points: Array) -> Array:
    """Distances (n,) of points from some place of the curves near by: nothing is farther than this."""
    from scipy.spatial import cKDTree

    samples = _samples(curves)
    nearest = cKDTree(samples.places).query(points)[1]
    best = np.empty(len(points))
    for i, curve in enumerate(curves):
        rows = np.flatnonzero(samples.curve[nearest] == i)
        at = nearest[rows]
        best[rows] = _newton(curve, samples.u[at], points[rows], samples.low[at], samples.high[at], False, 2)[1]
    return best


def _search(curves: Sequence[NurbsCurve], points: Array, least: int = 2) -> tuple[Array, Array]:
    """Distances (n,) and parameters (n,) on whichever curve is nearest, from at least so many samples a span."""
    from scipy.spatial import cKDTree

    samples = _samples(curves, least)
    u, owner = samples.u, samples.curve
    tree = cKDTree(samples.places)
    best, nearest = tree.query(points)
    where = u[nearest]
    rest = np.flatnonzero(best > SAME_POINT * (np.max(np.abs(points)) if len(points) else 0.0))
    wanted = CANDIDATES
    while len(rest):
        wanted = min(wanted, len(u))
        open_ = []
        for chunk in np.array_split(rest, -(-len(rest) * wanted // CHUNK)):
            far, found = (np.asarray(a).reshape(len(chunk), wanted) for a in tree.query(points[chunk], wanted))
            at, query = found.ravel(), np.repeat(points[chunk], wanted, axis=0)
            distance, parameter = np.empty(len(at)), np.empty(len(at))
            order = np.argsort(owner[at], kind="stable")
            bounds = np.searchsorted(owner[at][order], np.arange(len(curves) + 1))
            for i in np.flatnonzero(np.diff(bounds)).tolist():
                rows = order[bounds[i] : bounds[i + 1]]
                there = at[rows]
                parameter[rows], distance[rows] = _newton(
                    curves[i], u[there], query[rows], samples.low[there], samples.high[there], False, STEPS
                )
            rows = np.arange(len(chunk)) * wanted + np.argmin(distance.reshape(-1, wanted), axis=1)
            best[chunk], where[chunk] = distance[rows], parameter[rows]
            open_.append(chunk[far[:, -1] < best[chunk] + 0.5 * samples.spacing])
        rest = np.concatenate(open_)
        if wanted == len(u) or wanted >= MOST_CANDIDATES:
            break
        wanted *= 4
    return best, where


class _Samples(NamedTuple):
    """Parameters (n,), their curves, the parameters beside them, the points (n, axes), and the widest spacing, mm."""

    u: Array
    curve: IntArray
    low: Array
    high: Array
    places: Array
    spacing: float


def _samples(curves: Sequence[NurbsCurve], least: int = 2) -> _Samples:
    """SAMPLES points spread over the length of all curves, at least so many on every span."""
    rough = np.linspace(0.0, 1.0, 9)
    lengths = []
    for curve in curves:
        there = curve(curve.breaks[:-1, None] + rough * np.diff(curve.breaks)[:, None])
        lengths.append(np.sum(np.linalg.norm(np.diff(there, axis=1), axis=-1), axis=1))
    spacing = float(sum(np.sum(length) for length in lengths)) / SAMPLES
    rows: list[tuple[Array, IntArray, Array, Array, Array]] = []
    for i, (curve, length) in enumerate(zip(curves, lengths, strict=True)):
        counts = np.maximum(least, np.ceil(length / spacing)).astype(np.int64)
        first = np.cumsum(counts) - counts
        fraction = (np.arange(np.sum(counts)) - np.repeat(first, counts)) / np.repeat(counts, counts)
        u = np.repeat(curve.breaks[:-1], counts) + fraction * np.repeat(np.diff(curve.breaks), counts)
        u = np.append(u, curve.breaks[-1])
        low, high = np.concatenate([u[:1], u[:-1]]), np.concatenate([u[1:], u[-1:]])
        rows.append((u, np.full(len(u), i), low, high, curve(u)))
    u, owner, low, high, places = (np.concatenate(column) for column in zip(*rows, strict=True))
    # along a span the speed varies: a factor covers what its mean does not tell
    return _Samples(u, owner, low, high, places, 2.0 * spacing)


def _newton(
    curve: NurbsCurve, u: Array, points: Array, low: Array, high: Array, periodic: bool, steps: int
) -> tuple[Array, Array]:
    """Best parameters (n,) and distances (n,) met on Newton's way from u within [low, high]."""
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

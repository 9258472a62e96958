"""Two-way distance of two paths, bounded from above: how far one that was smoothed is from the original."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.nearest import Nearest
from splinefeed.geometry.path import Path
from splinefeed.records import Array, IntArray

#: What chords cut off each path, which counts twice in a bound and twice in what it is compared with, and what bounds
#: may be too large by, as shares of the given precision.
SAG, SLACK = 0.1, 0.6
#: Halvings of a chord at most.
MOST_HALVINGS = 24
#: Steps no longer than this, relative to the coordinates, are rounding.
ROUNDING = 1e-14
#: The share of a short span that its chords may cut off.
FLAT = 1.0 / 64.0
#: Chords of one span at most.
MOST_CHORDS = 100_000
#: Places a span of a rational curve at which its second derivative is sampled, and the factor for values between them.
PLACES, BETWEEN = 17, 1.25


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far two paths are from each other over the linear axes, mm; bounds from above.

    result    (curves of the result,) largest distance of each of its curves from the original
    original  (curves of the original,) largest distance of each of these from the result
    """

    result: Array
    original: Array

    @property
    def largest(self) -> float:
        """The two-way (Hausdorff) distance."""
        return float(max(self.result.max(), self.original.max()))


def deviation(original: Path, result: Path, precision: float) -> Deviation:
    """Two-way distance of the paths, at most `precision`, mm, above the true one, and never below it.

    Both are taken as chords that cut off at most max|C''| h^2 / 8 (its B-spline coefficients bound C'', a rational
    curve is sampled). The distance of a chord's points from one fixed chord of the other path is convex, so that its
    greatest value lies at an end; chords are halved until that bound is near the distance that is found there.
    It shares nothing with the smoothing. Raises InputError for paths of other axes or a precision of 0 or less.
    """
    if original.axes != result.axes:
        raise InputError(f"the paths have axes {original.axes} and {result.axes}; they must be the same")
    if not 0.0 < precision < math.inf:
        raise InputError(f"precision is {precision!r} mm; it must be greater than 0 and finite")
    first, second = (chords(path, SAG * precision)[:2] for path in (original, result))
    sags = 2.0 * SAG * precision
    return Deviation(
        result=_farthest(second, first, len(result.curves), SLACK * precision) + sags,
        original=_farthest(first, second, len(original.curves), SLACK * precision) + sags,
    )


def chords(path: Path, sag: float, scale: Array | None = None) -> tuple[Array, IntArray, Array]:
    """Points (n + 1, axes) of chords, the curve of each chord (n,), and what it cuts off at most (n,).

    That is at most `sag`, and a small share of the span.
    scale  (axes,) what each axis is taken times; only the linear ones, in mm, if it is not given
    """
    scale = np.ones(path.linear) if scale is None else scale
    flat, axes = path.flat, len(scale)
    size = np.diff(flat.point_starts)
    straight = (flat.degrees == 1) & (flat.rational == 0)
    bezier = ~straight & (flat.rational == 0) & (size == flat.degrees + 1)
    low, high = flat.domains.T
    found: list[tuple[IntArray, Array, Array]] = []  # curve, parameter and what the chord up to there cuts off
    for p in np.unique(flat.degrees[bezier]).tolist():
        at = np.flatnonzero(bezier & (flat.degrees == p))
        q = flat.points[flat.point_starts[at][:, None] + np.arange(p + 1), :axes] * scale
        width = high[at] - low[at]
        top = p * (p - 1) * np.linalg.norm(np.diff(q, 2, axis=1), axis=2).max(axis=1) / width**2
        middle = np.einsum("j,njk->nk", [math.comb(p, j) / 2.0**p for j in range(p + 1)], q)
        long = np.linalg.norm(middle - q[:, 0], axis=1) + np.linalg.norm(q[:, -1] - middle, axis=1)
        found.append(_parted(at, low[at], width, top, long, sag))
    for i in np.flatnonzero(~straight & ~bezier).tolist():
        curve = path.curves[i]
        width = np.diff(curve.breaks)
        halves = curve(np.sort(np.append(curve.breaks, curve.breaks[:-1] + 0.5 * width)))[:, :axes] * scale
        long = np.linalg.norm(np.diff(halves, axis=0), axis=1).reshape(-1, 2).sum(axis=1)
        owner = np.full(len(width), i)
        found.append(_parted(owner, curve.breaks[:-1], width, _bends(curve, scale), long, sag))
    lines = np.repeat(straight, size)
    owners = [np.repeat(np.arange(len(flat)), size)[lines], *(each[0] for each in found)]
    points = [flat.points[lines, :axes] * scale]
    points += [path.evaluate(owner, u)[:, 0, :axes] * scale for owner, u, _ in found]
    cuts = [np.zeros(len(points[0])), *(each[2] for each in found)]
    order = np.argsort(np.concatenate(owners), kind="stable")
    line, owner, off = np.concatenate(points)[order], np.concatenate(owners)[order], np.concatenate(cuts)[order]
    # where two curves join there may be a step of a rounding, which is no chord
    least = ROUNDING * float(np.abs(line).max())
    moved = np.append(True, np.any(np.abs(line[1:] - line[:-1]) > least, axis=1))
    return line[moved], owner[moved][1:], off[moved][1:]


def _parted(
    curve: IntArray, low: Array, width: Array, top: Array, long: Array, sag: float
) -> tuple[IntArray, Array, Array]:
    """Curve, parameter and what the chord up to there cuts off, of the ends of the chords of spans (n,), in order.

    low, width  of each span in u; top  its largest |C''|; long  about its length
    """
    with np.errstate(divide="ignore"):
        chord = np.sqrt(8.0 * np.minimum(FLAT * long, sag) / top)
    counts = np.clip(np.ceil(width / np.maximum(chord, width / MOST_CHORDS)), 1, MOST_CHORDS).astype(np.int64)
    opens = np.append(True, curve[1:] != curve[:-1])
    rows = counts + opens
    share = np.arange(rows.sum()) - np.repeat(np.cumsum(rows) - rows - (1 - opens), rows)
    u = np.repeat(low, rows) + share / np.repeat(counts, rows) * np.repeat(width, rows)
    last = share == np.repeat(counts, rows)
    u[last] = np.where(np.append(~opens[1:], False), np.append(low[1:], 0.0), low + width)
    return np.repeat(curve, rows), u, np.where(share > 0, np.repeat(top * (width / counts) ** 2 / 8.0, rows), 0.0)


def _bends(curve: NurbsCurve, scale: Array) -> Array:
    """Largest |C''| of each span (spans,), of the axes taken times `scale`."""
    breaks, axes = curve.breaks, len(scale)
    if curve.rational:
        u = breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, PLACES)
        return np.asarray(BETWEEN * np.linalg.norm(curve.derivatives(u, 2)[..., 2, :axes] * scale, axis=-1).max(axis=1))
    p, knots, q = curve.degree, curve.knots, curve.control_points[:, :axes] * scale
    for _ in range(2):
        width = knots[p + 1 : p + len(q)] - knots[1 : len(q)]
        q = np.divide(p * np.diff(q, axis=0), width[:, None], out=np.zeros((len(q) - 1, axes)),
                      where=width[:, None] > 0.0)  # fmt: skip
        knots, p = knots[1:-1], p - 1
    sizes = np.linalg.norm(q, axis=1)
    spans = np.searchsorted(knots, breaks[:-1], side="right") - 1
    return np.asarray(np.max(sizes[np.clip(spans[:, None] - np.arange(p + 1), 0, len(sizes) - 1)], axis=1))


def _farthest(of: tuple[Array, IntArray], to: tuple[Array, IntArray], count: int, slack: float) -> Array:
    """Upper bounds (count,) of the distance of the chords of each curve from all chords of the other path."""
    target = to[0]
    line = Path.polyline(target)
    search = Nearest(line.table, line.shape)
    row, _, distance = search.find(of[0])
    out = np.zeros(count)
    np.maximum.at(out, of[1], np.maximum(distance[:-1], distance[1:]))
    p, q, owner = of[0][:-1], of[0][1:], of[1]
    at_p, at_q, to_p, to_q = distance[:-1], distance[1:], row[:-1], row[1:]
    for halving in range(MOST_HALVINGS + 1):
        upper = np.minimum(
            np.maximum(at_p, _to_segment(q, target[to_p], target[to_p + 1])),
            np.maximum(at_q, _to_segment(p, target[to_q], target[to_q + 1])),
        )
        # no point of a chord is further off than this, whatever lies between
        upper = np.minimum(upper, 0.5 * (at_p + at_q + np.linalg.norm(q - p, axis=1)))
        open_ = upper > out[owner] + slack
        if not open_.any() or halving == MOST_HALVINGS:
            np.maximum.at(out, owner, np.where(open_, upper, upper - slack))
            break
        p, q, owner, at_p, at_q, to_p, to_q = (
            each[open_] for each in (p, q, owner, at_p, at_q, to_p, to_q)
        )  # fmt: skip
        middle = 0.5 * (p + q)
        to_m, _, at_m = search.find(middle)
        np.maximum.at(out, owner, at_m)
        p, q = np.concatenate([p, middle]), np.concatenate([middle, q])
        at_p, at_q = np.concatenate([at_p, at_m]), np.concatenate([at_m, at_q])
        to_p, to_q = np.concatenate([to_p, to_m]), np.concatenate([to_m, to_q])
        owner = np.concatenate([owner, owner])
    return out + slack


def _to_segment(points: Array, start: Array, end: Array) -> Array:
    """Distances (n,) of points from segments (n, axes)."""
    along = end - start
    share = np.sum((points - start) * along, axis=1) / np.sum(along * along, axis=1)
    return np.asarray(np.linalg.norm(points - start - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1))

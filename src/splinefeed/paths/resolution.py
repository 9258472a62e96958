"""The resolution of geometry: features below it are decided once, where a path is built.

Where |C'| is almost 0, derivatives by arc length are 0/0: at cusps, double control points, spans without length,
and bends so sharp that they are cusps to any machine. A curve stays one curve on the same domain; next to such a tip

    N(t) = Q + n1 (t - 1) + n2 (t - 1)^2 / 2 + c (t - 1)^3,    c = P - at t = 0: N(0) = P

takes its place from the tip P (t = 0) to a regular point Q (t = 1), on both sides of it, as far as it stays within half
the resolution, at most REACH of them. n1 = b1 C', n2 = b1^2 C'' + b2 C' at Q (continuous tangent and curvature for any
b1, b2: Barsky, DeRose, "Geometric continuity of parametric curves", IEEE CG&A 9(6), 1989, doi 10.1109/38.41470) with
b1 such that c, and b2 such that n2 has no part along C': N is a cubic over the tangent at Q, its speed along that
constant. The tip becomes a knot between both, at which the tangent may turn: a corner, where motion stops.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.differential import product, slope_of, slopes, zeros_on
from splinefeed.curves.packed import Flat, Packed
from splinefeed.curves.pieces import coefficients, columns
from splinefeed.curves.spline import least_step
from splinefeed.curves.tables import Spans, span_pieces
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import chunks, expanded

#: The resolution, mm: 1 nm, a tenth of what the finest encoders of machine tools tell apart and far above the rounding
#: of coordinates (1e-11 mm at 100 m), so that a bend of this radius still has digits.
RESOLUTION = 1e-6
#: A path smaller than this, mm, has that much finer a resolution: it may be given in other units.
ONE = 1.0
#: A curve that is a point lies beside one that is longer than so many resolutions: that hardly turns when it moves.
MUCH = 1e3
#: Part of the resolution by which what is put next to a tip may leave the curve; the rest is for what is not sampled.
#: It reaches so many resolutions at most: what is farther away may bend between samples.
USED, REACH = 0.5, 1e4
#: Distances from a tip that are tried, as powers of SHRINK of the way to the next tip.
TRIALS, SHRINK = 64, 0.62
#: Places between two tips at which the curve is looked at.
BETWEEN = 16
#: Tips that are looked at together.
TOGETHER = 256
#: Roots with an imaginary part below this are real.
REAL = 1e-3
#: A tip nearer to a knot than this share of the shortest span is the knot's.
AT_KNOT = 1e-7
#: New knots keep this distance, as a share of the greatest knot: `NurbsCurve` asks for 16 roundings.
LEAST_KNOTS = 1e-14


def resolution_at(points: Array) -> float:
    """The resolution, mm, of a path whose control points (n, axes) these are."""
    return RESOLUTION * min(float(np.linalg.norm(np.ptp(points, axis=0))) / ONE, 1.0)


def long_curves(flat: Flat, metric: Array, tolerance: float) -> IntArray | None:
    """Numbers (m,) of the curves that stay; None for all. The others are points: shorter than the resolution.

    They also fill no gap above `tolerance`, mm, lie beside a curve that is longer by far, which then goes where they
    did, and not next to each other. Axes count by the metric, (axes,).
    """
    steps = np.append(np.abs(np.diff(flat.points, axis=0)) @ metric, 0.0)
    steps[flat.point_starts[1:] - 1] = 0.0  # from one curve to the next
    length = np.add.reduceat(steps, flat.point_starts[:-1])
    if not np.any(length < min(RESOLUTION, tolerance)):
        return None
    resolution = min(resolution_at(flat.points * metric), tolerance)
    short = length < resolution
    far = np.concatenate([[False], length > MUCH * resolution, [False]])
    short &= far[:-2] | far[2:]
    short[1:] &= ~short[:-1]
    return np.flatnonzero(~short) if short.any() else None


def resolved(curves: Packed, metric: Array, *, in_place: bool = False) -> Packed:
    """The curves, (n,), the same ones where none of them has a tip by the metric, (axes,); else with it replaced.

    With `in_place` tips become knots, where the tangent may jump, and nothing else changes.
    """
    if curves.flat.degrees.max() == 1:
        return curves
    scaled = curves.flat.scaled(metric)
    owner, low, high = _suspects(scaled)
    if not len(owner):
        return curves
    if np.any(metric == 0.0):  # axes that count nothing keep their course: only a knot is set
        in_place = True
    numbers, owner = np.unique(owner, return_inverse=True)
    seen = Seen(scaled.chosen(numbers), resolution_at(scaled.points))
    corners: dict[int, list[float]] = {}
    cuts: dict[int, list[tuple[float, float, Array]]] = {}
    with np.errstate(all="ignore"):
        tips = seen.tips(owner, low, high)
        for side in (-1, 1) if len(tips.at) else ():
            here, at, points = seen.beside(tips, side)
            for k, u, bezier in zip(here.tolist(), at.tolist(), points / metric, strict=True):
                i, tip = int(numbers[tips.curve[k]]), float(tips.at[k])
                corners.setdefault(i, []).append(tip)
                if u != tip and not in_place:
                    cuts.setdefault(i, []).append((u, tip, bezier[::-1]) if u < tip else (tip, u, bezier))
    return curves.changed({i: _put(curves[i], each, cuts.get(i, [])) for i, each in corners.items()})


def _suspects(flat: Flat) -> tuple[IntArray, Array, Array]:
    """Knot spans on which a radius may be below the resolution: their curves and intervals of u, (k,) each.

    The radius is |C'|^2 / |C''| at least, by control vectors D of C': its part along their sum is as large as the
    least of theirs, m, and with weights of ratio w m / w^2 (Saito, Wang, Sederberg, "Hodographs and normals of rational
    curves and surfaces", CAGD 12(4), 1995, doi 10.1016/0167-8396(94)00023-L); |C''| <= 8 p^2 w^4 max |D| / du, as
    differences of knots cover the span, du.
    """
    found = [(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))]
    for spans in Spans.of(flat):
        p = spans.degree
        if p == 1:
            continue
        knots = flat.knots[spans.knot + np.arange(2 * p + 2)[:, None]]
        points = flat.points[spans.point + np.arange(p + 1)[:, None]]
        first = p * np.diff(points, axis=0) / (knots[p + 1 : 2 * p + 1] - knots[1 : p + 1])[..., None]
        total = np.sum(first, axis=0)
        ratio = np.ones(len(spans))
        if spans.rational:
            weights = flat.weights[spans.point + np.arange(p + 1)[:, None]]
            ratio = np.max(weights, axis=0) / np.min(weights, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = total / np.linalg.norm(total, axis=1, keepdims=True)
            least = np.min(np.sum(first * ahead, axis=2), axis=0) / ratio**2
        most = np.max(np.linalg.norm(first, axis=2), axis=0)
        bend = 8.0 * p * p * ratio**4 * most / (knots[p + 1] - knots[p])
        odd = spans.chosen(~((least > 0.0) & (least * least > RESOLUTION * bend)))
        found.append((odd.curve, odd.low, odd.high))
    curve, low, high = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.lexsort((low, curve))
    return curve[order], low[order], high[order]


class Tips(NamedTuple):
    """Tips, (n,) each, in order: their curve, from which parameter, at which, and up to which |C'| is almost 0."""

    curve: IntArray
    low: Array
    at: Array
    high: Array


class Seen:
    """Curves that may have tips, as the metric has them, and the resolution, mm."""

    def __init__(self, flat: Flat, resolution: float) -> None:
        self.flat, self.resolution = flat, resolution
        self.pieces = span_pieces(flat, (int(flat.degrees.max()), *flat.points.shape[1:] * 2, int(flat.rational.max())))

    def is_tip(self, d: Array) -> BoolArray:
        """Whether the radius may be below the resolution, |C'|^2 <= resolution |C''|; d (n, 3, axes)."""
        square = np.sum(d[:, 1] ** 2, axis=1)
        return np.asarray(square <= self.resolution * np.linalg.norm(d[:, 2], axis=1))

    def slowest(self, owner: IntArray, low: Array, high: Array) -> tuple[IntArray, Array]:
        """Which of knot spans, from low to high (n,) of curves (n,), and parameters (k,) at which |C'| may be least.

        With C' = n / w^2, n = A' w - A w', they are roots of C' . C'': those of n . (n' w - 2 n w').
        """
        table, shape = self.pieces.table, self.pieces.shape
        first, last = self.pieces.row_at(owner, low, False), self.pieces.row_at(owner, high, True)
        span, number = expanded(last - first + 1)
        rows = first[span] + number
        found = [(np.zeros(0, dtype=np.int64), np.zeros(0))]
        for some in chunks(len(rows)):
            c = columns(table, rows[some])
            weight = coefficients(c, shape)[-1] if shape[3] else None
            slope = sum(product(n, slope_of(n, weight, 2.0)) for n in slopes(c, shape))
            piece, u = zeros_on(c, np.asarray(slope), REAL)
            found.append((span[some][piece], u))
        span, u = (np.concatenate(each) for each in zip(*found, strict=True))
        return span, u

    def tips(self, owner: IntArray, low: Array, high: Array) -> Tips:
        """Tips on knot spans, from low to high (n,) of curves (n,).

        Places between which the curve stays within the resolution of a point are one, at an end if one is there.
        """
        span, inner = self.slowest(owner, low, high)
        apart = np.minimum(inner - low[span], high[span] - inner) > AT_KNOT * (high - low)[span]
        tried = (owner[span[apart]], inner[apart], False), (owner, high, True), (owner, low, False)
        near = [self.is_tip(self.pieces.evaluate(curve, u, 2, left)) for curve, u, left in tried]
        u = np.concatenate([each[is_tip] for (_, each, _), is_tip in zip(tried, near, strict=True)])
        curve = np.concatenate([each[is_tip] for (each, _, _), is_tip in zip(tried, near, strict=True)])
        if not len(u):
            return Tips(curve, u, u, u)
        curve, u = np.unique(np.stack([curve.astype(np.float64), u]), axis=1)
        curve = curve.astype(np.int64)
        place, velocity = np.moveaxis(self.pieces.evaluate(curve, u, 1, False), 1, 0)
        at_end = (u == self.flat.domains[curve, 0]) | (u == self.flat.domains[curve, 1])
        speed = np.where(at_end, -1.0, np.linalg.norm(velocity, axis=1))
        begins = np.append(True, curve[1:] != curve[:-1])
        between, owner = np.linspace(u[:-1], u[1:], BETWEEN, axis=1), np.repeat(curve[1:], BETWEEN)
        way = self.pieces.evaluate(owner, between.ravel(), 0, False).reshape(*between.shape, place.shape[1])
        first = 0
        for k in range(1, len(u)):
            begins[k] |= np.max(np.linalg.norm(way[k - 1] - place[first], axis=1)) > self.resolution
            first = k if begins[k] else first
        group, starts = np.cumsum(begins) - 1, np.flatnonzero(begins)
        order = np.lexsort((speed, group))
        return Tips(curve[starts], u[starts], u[order[starts]], u[np.append(starts[1:], len(u)) - 1])

    def beside(self, tips: Tips, side: int) -> tuple[IntArray, Array, Array]:
        """Which tips (k,) are corners seen from a side, -1 or 1, up to where a cubic replaces the curve, and that.

        Parameters (k,), the tip's where nothing regular follows, and Bezier points (k, 4, axes) from the tip on.
        """
        left, edge = side < 0, tips.low if side < 0 else tips.high
        domains = self.flat.domains[tips.curve]
        first, last = domains[:, 0].copy(), domains[:, 1].copy()
        same = np.flatnonzero(tips.curve[1:] == tips.curve[:-1])
        first[same + 1] = last[same] = 0.5 * (tips.low[same + 1] + tips.high[same])
        limit = first if left else last
        seen = self.is_tip(self.pieces.evaluate(tips.curve, edge, 2, left))
        here = np.flatnonzero((limit != edge) & ((edge != tips.at) | seen))
        at, points = tips.at[here], np.zeros((len(here), 4, self.flat.points.shape[1]))
        for part in chunks(len(here), TOGETHER):
            some = here[part]
            place = tips.curve[some], tips.at[some], edge[some], limit[some]
            at[part], points[part] = self._cubics(place, left)
        return here, at, points

    def _cubics(self, place: tuple[IntArray, Array, Array, Array], left: bool) -> tuple[Array, Array]:
        """As `beside`, of curves, tips, edges of what is almost 0, and ends of what may be replaced, (n,) each."""
        curve, tip, edge, limit = place
        trials = edge[:, None] + (limit - edge)[:, None] * SHRINK ** np.arange(TRIALS - 1.0, -1.0, -1.0)
        owner, every = np.repeat(curve, TRIALS).reshape(trials.shape), np.arange(len(tip))
        start = self.pieces.evaluate(curve, tip, 0, False)[:, 0]
        ok, q, n1, n2 = self._regular(owner, trials, start, tip, edge, left)
        way = q - start[:, None]
        share = np.linspace(0.0, 1.0, BETWEEN + 1)[:-1, None, None] ** 2
        u = edge[:, None] + (trials - edge[:, None]) * share
        seen = self.pieces.evaluate(np.repeat(owner[None], BETWEEN, axis=0).ravel(), u.ravel(), 0, False)
        seen = seen.reshape(*u.shape, -1) - start[:, None]
        t = np.clip(np.sum(seen * n1, axis=-1) / np.sum(n1**2, axis=-1), 0.0, 1.0)[..., None] - 1.0  # N is linear in t
        cubic = way + n1 * t + 0.5 * n2 * t**2 + (way - n1 + 0.5 * n2) * t**3
        apart = np.max(np.linalg.norm(cubic - seen, axis=-1), axis=0)
        close = (apart <= USED * self.resolution) & (np.linalg.norm(way, axis=2) <= REACH * self.resolution)
        close |= np.arange(TRIALS) <= np.argmax(ok, axis=1)[:, None]
        good = ok & np.logical_and.accumulate(close, axis=1)
        k = TRIALS - 1 - np.argmax(good[:, ::-1], axis=1)
        q, n1, n2 = (each[every, k] for each in (q, n1, n2))
        points = np.stack([start, q - 2.0 * n1 / 3.0 + n2 / 6.0, q - n1 / 3.0, q], axis=1)
        return np.where(good.any(axis=1), trials[every, k], tip), points

    def _regular(
        self, owner: IntArray, trials: Array, start: Array, tip: Array, edge: Array, left: bool
    ) -> tuple[BoolArray, Array, Array, Array]:
        """Whether a cubic from tips `start` (n, axes) may end at trials (n, k), and its q, n1, n2 (n, k, axes)."""
        d = self.pieces.evaluate(owner.ravel(), trials.ravel(), 2, not left)
        q, q1, q2 = np.moveaxis(d.reshape(*trials.shape, 3, -1), 2, 0)
        way, square = q - start[:, None], np.sum(q1 * q1, axis=2)
        b1 = np.sum(way * q1, axis=2) / square
        b2 = -b1 * b1 * np.sum(q2 * q1, axis=2) / square
        n1, n2 = b1[..., None] * q1, (b1 * b1)[..., None] * q2 + b2[..., None] * q1
        ok = np.isfinite(n2).all(axis=2) & (b1 * (trials - tip[:, None]) > 0.0)
        ok &= ~self.is_tip(d).reshape(trials.shape) & (np.linalg.norm(way, axis=2) > self.resolution)
        largest = np.maximum.reduceat(np.abs(self.flat.knots), self.flat.knot_starts[:-1])
        ok &= np.abs(trials - edge[:, None]) > LEAST_KNOTS * largest[owner]
        return ok, q, n1, n2


def _together(curve: NurbsCurve) -> Callable[[float], float]:
    """What makes parameters that are as good as at a knot, or as one before, that one."""
    known, least = np.unique(curve.knots).tolist(), least_step(curve.knots)

    def at(u: float) -> float:
        k = bisect_left(known, u)
        nearest = float(min(known[max(k - 1, 0) : k + 1], key=lambda each: abs(each - u)))
        if abs(nearest - u) < least:
            return nearest
        known.insert(k, u)
        return u

    return at


def _put(curve: NurbsCurve, corners: list[float], cuts: list[tuple[float, float, Array]]) -> NurbsCurve:
    """Put knots and cubics into a curve of degree 3 at least.

    Parameters
    ----------
    curve : NurbsCurve
        The curve.
    corners : list of float
        Parameters that become full knots.
    cuts : list of (float, float, array)
        From, to, and Bezier points (4, axes) of what takes the place of the curve between these.

    Returns
    -------
    NurbsCurve
        The curve.
    """
    at = _together(curve)
    corners, cuts = [at(u) for u in corners], [(at(a), at(b), points) for a, b, points in cuts]
    whole = curve.elevated(max(3 - curve.degree, 0) if cuts else 0)
    p, (start, end) = whole.degree, whole.domain
    inner = sorted({u for u in (*corners, *(u for cut in cuts for u in cut[:2])) if start < u < end})
    pieces = whole.split(*inner) if inner else [whole]
    replaced = {low: NurbsCurve.bezier(points).elevated(p - 3).control_points for low, _, points in cuts}
    knots, points, weights = [np.full(p + 1, start)], [], []
    scale = 1.0
    for k, piece in enumerate(pieces):
        low, high = piece.domain
        new = replaced.get(low)
        here = piece.control_points if new is None else new
        heavy = np.ones(len(here)) if new is not None or piece.weights is None else piece.weights
        scale /= float(heavy[0])
        between = piece.knots[p + 1 : -p - 1] if new is None else np.zeros(0)
        points.append(here if k == 0 else here[1:])
        weights.append((heavy if k == 0 else heavy[1:]) * scale)
        knots += [between, np.full(p if k < len(pieces) - 1 else p + 1, high)]
        scale *= float(heavy[-1])
    joined = np.concatenate(points)
    joined[0], joined[-1] = curve.ends
    return NurbsCurve(p, np.concatenate(knots), joined, np.concatenate(weights) if curve.rational else None)

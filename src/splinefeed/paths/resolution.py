"""The resolution of geometry: features below it are decided once, where a path is built.

Where |C'| is almost 0, derivatives by arc length are 0/0: at cusps, double control points, spans without length,
and bends so sharp that they are cusps to any machine. A curve stays one curve on the same domain; next to such a tip

    N(t) = Q + n1 (t - 1) + n2 (t - 1)^2 / 2 + c (t - 1)^3,    c = P - at t = 0: N(0) = P

takes its place from the tip P (t = 0) to a regular point Q (t = 1), on both sides of it, as far as it stays within half
the resolution. n1 = b1 C', n2 = b1^2 C'' + b2 C' at Q (continuous tangent and curvature for any b1, b2: Barsky, DeRose,
"Geometric continuity of parametric curves", IEEE CG&A 9(6), 1989, doi 10.1109/38.41470) with b1 such that c, and b2
such that n2 has no part along C': N is a cubic over the tangent at Q, its speed along that constant. The tip becomes a
knot between both, at which the tangent may turn: a corner, where motion stops.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable

import numpy as np

from splinefeed.curves.curve import NurbsCurve, least_step
from splinefeed.curves.differential import product, slope_of, slopes, zeros_on
from splinefeed.curves.packed import Flat, Packed
from splinefeed.curves.pieces import coefficients, columns, taylor
from splinefeed.curves.tables import Spans
from splinefeed.kernels.layout import HIGH, LOW
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import chunks

#: The resolution, mm: 1 nm, a tenth of what the finest encoders of machine tools tell apart and far above the rounding
#: of coordinates (1e-11 mm at 100 m), so that a bend of this radius still has digits.
RESOLUTION = 1e-6
#: A path smaller than this, mm, has that much finer a resolution: it may be given in other units.
ONE = 1.0
#: A curve that is a point lies beside one that is longer than so many resolutions: that hardly turns when it moves.
MUCH = 1e3
#: Part of the resolution by which what is put next to a tip may leave the curve; the rest is for what is not sampled.
USED = 0.5
#: Places of a span, t in [-1, 1], at which C' and C'' are sampled.
SAMPLES = np.linspace(-1.0, 1.0, 25)
#: Distances from a tip that are tried, as powers of SHRINK of the way to the next tip, and places up to each compared.
TRIALS, SHRINK, COMPARED = 64, 0.62, 16
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
    resolution, plain = resolution_at(scaled.points), bool(np.all(metric == 1.0))
    if np.any(metric == 0.0):  # axes that count nothing keep their course: only a knot is set
        in_place = True
    changed: dict[int, NurbsCurve] = {}
    with np.errstate(all="ignore"):
        for i in np.unique(owner).tolist():
            curve, here = curves[i], owner == i
            seen = curve if plain else curve.transformed(np.diag(metric))
            corners, cuts = _replaced(seen, np.column_stack([low, high])[here], resolution, in_place)
            if corners:
                at = _together(curve)
                changed[i] = _put(
                    curve, [at(u) for u in corners], [(at(a), at(b), points / metric) for a, b, points in cuts]
                )
    return curves.changed(changed)


def _suspects(flat: Flat) -> tuple[IntArray, Array, Array]:
    """Knot spans on which a radius may be below the resolution: their curves and intervals of u, (k,) each.

    The radius is |C'|^2 / |C''| at least. First by control vectors D of C': its part along their sum is as large as the
    least of theirs, m, and with weights of ratio w m / w^2 (Saito, Wang, Sederberg, "Hodographs and normals of rational
    curves and surfaces", CAGD 12(4), 1995, doi 10.1016/0167-8396(94)00023-L); |C''| <= 8 p^2 w^4 max |D| / du, as
    differences of knots cover the span, du. Then by samples: between two |C'| >= (sum - max |C''| du) / 2.
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
        if len(odd):
            shape = (p, flat.points.shape[1], flat.points.shape[1], spans.rational)
            a, _ = odd.own(odd.columns(shape), shape)
            _, one, two = taylor(a[:, :, None], spans.rational, SAMPLES[:, None], 2)
            speed, bend = np.linalg.norm(one, axis=0), 2.0 * np.max(np.linalg.norm(2.0 * two, axis=0), axis=0)
            between = np.min(speed[1:] + speed[:-1] - np.diff(SAMPLES)[:, None] * bend, axis=0)
            odd = odd.chosen(~((between > 0.0) & (0.25 * between * between > RESOLUTION * bend)))
        found.append((odd.curve, odd.low, odd.high))
    curve, low, high = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.lexsort((low, curve))
    return curve[order], low[order], high[order]


def _replaced(
    curve: NurbsCurve, spans: Array, resolution: float, in_place: bool
) -> tuple[list[float], list[tuple[float, float, Array]]]:
    """Tips on some of its spans (k, 2), and cubics next to them: from, to, and Bezier points (4, axes)."""
    tips = _tips(curve, spans, resolution)
    start, end = curve.domain
    bounds = [start, *(0.5 * (tips[1:, 0] + tips[:-1, 2])).tolist(), end]
    corners, cuts = [], []
    for k, (low, tip, high) in enumerate(tips.tolist()):
        for edge, limit in ((low, bounds[k]), (high, bounds[k + 1])):
            side = "left" if limit < edge else "right"
            if limit == edge or (edge == tip and not len(_tips_at(curve, np.array([tip]), side, resolution))):
                continue
            corners.append(tip)
            put = None if in_place else _beside(curve, (tip, edge, limit), resolution)
            if put is not None:
                at, points = put
                cuts.append((at, tip, points[::-1]) if at < tip else (tip, at, points))
    return corners, cuts


def _tips_at(curve: NurbsCurve, u: Array, side: str, resolution: float) -> Array:
    """Those of the parameters u (n,) at which |C'| is almost 0, seen from one side."""
    return u[_is_tip(curve.derivatives(u, 2, side=side), resolution)]


def _is_tip(d: Array, resolution: float) -> BoolArray:
    """Whether the radius may be below the resolution, |C'|^2 <= resolution |C''|; d (n, 3, axes)."""
    square = np.sum(d[:, 1] ** 2, axis=1)
    return np.asarray(square <= resolution * np.linalg.norm(d[:, 2], axis=1))


def _slowest(curve: NurbsCurve, spans: Array) -> Array:
    """Parameters (k,) inside of knot spans (n, 2), in order, at which |C'| may be least: roots of C' . C''.

    With C' = n / w^2, n = A' w - A w', they are those of n . (n' w - 2 n w').
    """
    table, shape = curve.table
    behind = np.searchsorted(
        spans[:, 1], table[:, LOW], side="right"
    )  # the first span that ends behind the piece's low
    begins = np.append(spans[:, 0], np.inf)
    rows = np.flatnonzero(begins[behind] < table[:, HIGH])
    found = [np.zeros(0)]
    for some in chunks(len(rows)):
        c = columns(table, rows[some])
        weight = coefficients(c, shape)[-1] if curve.rational else None
        slope = sum(product(n, slope_of(n, weight, 2.0)) for n in slopes(c, shape))
        found.append(zeros_on(c, np.asarray(slope), REAL))
    return np.concatenate(found)


def _tips(curve: NurbsCurve, spans: Array, resolution: float) -> Array:
    """Tips on knot spans (n, 2), as (k, 3): from, at, and up to which parameter |C'| is almost 0, increasing.

    Places between which the curve stays within the resolution of a point are one, at an end if one is there.
    """
    breaks = curve.breaks
    inner = _slowest(curve, spans)
    behind = np.clip(np.searchsorted(breaks, inner), 1, len(breaks) - 1)
    apart = np.minimum(np.abs(inner - breaks[behind - 1]), np.abs(breaks[behind] - inner))
    inner = inner[apart > AT_KNOT * np.diff(breaks).min()]
    found = [np.zeros(0)]
    for at, side in ((inner, "right"), (spans[:, 1], "left"), (spans[:, 0], "right")):
        found.append(_tips_at(curve, at, side, resolution))
    tips = np.unique(np.concatenate(found))
    if not len(tips):
        return np.zeros((0, 3))
    d = curve.derivatives(tips, 1)
    groups = [[0]]
    for k in range(1, len(tips)):
        between = curve(np.linspace(tips[k - 1], tips[k], COMPARED))
        if np.max(np.linalg.norm(between - d[groups[-1][0], 0], axis=1)) <= resolution:
            groups[-1].append(k)
        else:
            groups.append([k])
    speed = np.where(np.isin(tips, curve.domain), -1.0, np.linalg.norm(d[:, 1], axis=1))
    return np.array([tips[[g[0], g[int(np.argmin(speed[g]))], g[-1]]] for g in groups])


def _beside(curve: NurbsCurve, span: tuple[float, float, float], resolution: float) -> tuple[float, Array] | None:
    """How far from a tip a cubic replaces the curve, and its Bezier points (4, axes) from the tip on.

    span  the tip, the edge of what is almost 0 there, and the furthest that may be replaced behind it
    None where nothing regular follows.
    """
    tip, edge, limit = span
    left = limit < edge
    knots = curve.breaks[(curve.breaks - edge) * (limit - edge) > 0.0]
    knots = knots[np.abs(knots - edge) <= abs(limit - edge)]
    tried = edge + (limit - edge) * SHRINK ** np.arange(TRIALS)
    tried = tried[np.abs(tried - edge) > LEAST_KNOTS * np.max(np.abs(curve.knots))]
    trials: Array = np.unique(np.concatenate([tried, knots]))
    trials = trials[::-1] if left else trials
    if not len(trials):
        return None
    d = curve.derivatives(trials, 2, side="right" if left else "left")
    start, (q, q1, q2) = curve(tip), np.moveaxis(d, 1, 0)
    along, way = q1, q - start
    square = np.sum(along * along, axis=1)
    b1 = np.sum(way * along, axis=1) / square
    b2 = -b1 * b1 * np.sum(q2 * along, axis=1) / square
    n1, n2 = b1[:, None] * q1, (b1 * b1)[:, None] * q2 + b2[:, None] * q1
    c = q - start - n1 + 0.5 * n2
    ok = np.isfinite(c).all(axis=1) & (b1 * (trials - tip) > 0.0) & ~_is_tip(d, resolution)
    ok &= np.linalg.norm(way, axis=1) > resolution
    if not ok.any():
        return None
    share = np.linspace(0.0, 1.0, COMPARED + 1)[:-1, None] ** 2
    seen = curve(edge + (trials - edge) * share)
    t = np.sum((seen - start) * n1, axis=2) / np.sum(n1**2, axis=1)
    t = np.clip(t, 0.0, 1.0)[..., None] - 1.0  # along the tangent N is linear in t
    apart = np.max(np.linalg.norm(q + n1 * t + 0.5 * n2 * t**2 + c * t**3 - seen, axis=2), axis=0)
    first = int(np.argmax(ok))
    behind = np.append(knots if not left else knots[::-1], limit)
    stop = behind[np.argmax(np.abs(behind - edge) >= abs(trials[first] - edge))]
    ok &= np.abs(trials - edge) <= abs(stop - edge)
    close = apart <= USED * resolution
    close[: first + 1] = True
    k = int(np.flatnonzero(ok & np.logical_and.accumulate(close))[-1])
    return float(trials[k]), np.array([start, q[k] - 2.0 * n1[k] / 3.0 + n2[k] / 6.0, q[k] - n1[k] / 3.0, q[k]])


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
    """The curve, of degree 3 at least, with full knots at corners and cubics between parameters.

    cuts  from, to, and Bezier points (4, axes) of what takes the place of the curve between these
    """
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

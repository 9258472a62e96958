"""A rotary axis theta that follows the tangent of a planar path, as on an X-Y-theta table."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from splinefeed.errors import CurveError, InputError
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.differential import unit_tangents
from splinefeed.geometry.editing import blossom
from splinefeed.geometry.path import CORNER_ANGLE, Path
from splinefeed.records import Array, IntArray

#: Theta needs a degree in which value, first and second derivative at both ends of a piece are free.
LEAST_DEGREE = 5
#: Least tolerance, rad: not far below it lies the rounding of tangents.
LEAST_TOLERANCE = 1e-9
#: Pieces are halved until the error at samples is this share of the tolerance; the rest is for the points between.
SHARE = 0.5
#: Most pieces of one curve, and how often one is halved at most.
MAX_PIECES = 100_000
ROUNDS = 40
#: Between neighbouring samples the tangent may turn by this much, rad: then no turn is overlooked.
MAX_STEP = 0.5
#: C' shorter than this, relative to its largest value on the piece, has no derivative of theta worth using.
STILL = 1e-4
#: Where neighbouring pieces differ by less than this share of the tolerance in a derivative, the knot is that smooth.
MATCH = 1e-3
#: Samples on a piece, off its ends: those that decide whether it is halved, and those of the proof.
_SAMPLES: Array = np.asarray((np.arange(15) + 0.5) / 15.0, dtype=np.float64)
_PROOF: Array = np.asarray((np.arange(24) + 0.3) / 24.0, dtype=np.float64)


class _Pieces(NamedTuple):
    """Pieces of a curve: ends (m,), its weight and Theta = theta w, from 0, as Bernstein coefficients (m, q + 1)."""

    low: Array
    high: Array
    weights: Array
    values: Array


def tangential(path: Path, tolerance: float = 1e-6) -> Path:
    """The path of axes (x, y, theta): x and y as they are, theta the direction of the tangent, rad, within `tolerance`.

    theta' = (x' y'' - y' x'') / (x'^2 + y'^2)

    theta is unwrapped, so that it runs on through full turns; it begins within (-pi, pi]. On pieces of each curve it is
    a quotient Theta / w with the weight w of the curve itself. Theta is linear in its coefficients: it takes over
    theta, theta' and theta'' at both ends of a piece and, for degrees above 5, theta between. Pieces are halved until
    the error is within the tolerance; this is proved on other points of the finished curve. So theta' is continuous
    wherever the curvature is. Curves of a degree below 5 are elevated to it.

    Raises CurveError for a path that is not planar, and for one with corners, where theta would have to turn while x
    and y rest; InputError for a tolerance that cannot be held.
    Called at s (...), mm, the path gives (..., 3): mm, mm, rad. Source: docs/paper.md, the table of three axes.
    Example: `sf.tangential(path).axes`
    """
    allowed = float(tolerance)
    if not (math.isfinite(allowed) and allowed >= LEAST_TOLERANCE):
        raise InputError(f"tolerance is {allowed:g} rad; it must be finite and at least {LEAST_TOLERANCE:g} rad")
    if len(path.axes) != 2 or path.linear != 2:
        raise CurveError(f"the path has axes {' '.join(path.axes)}; theta follows a path of two linear axes")
    for corner in path.corners:
        if corner.angle > CORNER_ANGLE:
            raise CurveError(
                f"the path turns by {math.degrees(corner.angle):.4g} deg on the spot at s = {corner.s:.6g} mm "
                f"(curve {corner.curve}, u = {corner.u:.6g}), where theta would jump; round the corner, or make two "
                f"paths that end and begin there"
            )
    curves: list[NurbsCurve] = []
    angle = 0.0
    worst = 0.0
    for i, curve in enumerate(path.joined):
        try:
            followed, error = _followed(curve, allowed, angle)
        except CurveError as problem:
            raise CurveError(f"curve {i} of the path: {problem}") from None
        angle = float(followed.control_points[-1, 2])
        worst = max(worst, error)
        curves.append(followed)
    finding = f"theta follows the tangent within {worst:.3g} rad"
    # ends meet as before; at a corner below CORNER_ANGLE theta may differ by as much
    room = path.tolerance + CORNER_ANGLE
    return Path(
        curves,
        (*path.axes, "theta"),
        name=f"{path.name}-tangential",
        findings=(*path.findings, finding),
        tolerance=room,
    )


def _followed(curve: NurbsCurve, tolerance: float, before: float) -> tuple[NurbsCurve, float]:
    """The curve with theta as third axis, beginning next to the angle `before`, and the largest error, rad."""
    if curve.degree == 1 and len(curve.breaks) == 2:
        angle = _next_to(_angles(curve, np.array([curve.domain[0]]), "right"), before)
        points = np.column_stack([curve.control_points, np.full(len(curve.control_points), angle)])
        return NurbsCurve(1, curve.knots, points, curve.weights), 0.0
    base = curve.with_clamped_ends()
    base = base.elevated(max(0, LEAST_DEGREE - base.degree))
    pieces = _refined(base, tolerance)
    followed = _assembled(base, pieces, tolerance, before)
    u = pieces.low[:, None] + (pieces.high - pieces.low)[:, None] * _PROOF
    off = followed(u.ravel())[:, 2] - _angles(followed, u.ravel(), "right")
    error = np.abs(_next_to(off, 0.0))
    if error.max() > tolerance:
        left = f"{error.max():.3g} rad is left at u = {u.flat[int(np.argmax(error))]:.6g}; allow more"
        raise CurveError(f"theta cannot follow within {tolerance:g} rad: {left}")
    return followed, float(error.max())


def _angles(curve: NurbsCurve, u: Array, side: str) -> Array:
    """Direction of the tangent in x and y, rad, (n,) at u (n,), within (-pi, pi]."""
    tangent = unit_tangents(curve, u, 2, side)
    return np.asarray(np.arctan2(tangent[:, 1], tangent[:, 0]))


def _next_to(angle: Array, before: Array | float) -> Array:
    return np.asarray(angle - 2.0 * np.pi * np.round((angle - before) / (2.0 * np.pi)))


def _weights(base: NurbsCurve, low: Array, high: Array) -> Array:
    """Bernstein coefficients (m, q + 1) of the weight on [low, high], each (m,) and within one knot span."""
    q = base.degree
    if base.weights is None:
        return np.ones((len(low), q + 1))
    span = np.searchsorted(base.knots, 0.5 * (low + high), side="right") - 1
    ends = np.concatenate([np.tile(low, (q, 1)), np.tile(high, (q, 1))])
    weights = base.weights[:, None]
    return np.column_stack([blossom(base.knots, weights, q, span, ends[i : i + q]) for i in range(q + 1)])


def _multiplicity(base: NurbsCurve, u: Array) -> IntArray:
    return np.searchsorted(base.knots, u, side="right") - np.searchsorted(base.knots, u, side="left")


def _refined(base: NurbsCurve, tolerance: float) -> _Pieces:
    """Pieces between the breaks, halved until theta is within the tolerance."""
    q = base.degree
    low, high = base.breaks[:-1], base.breaks[1:]
    done: list[tuple[Array, Array, Array, Array]] = []
    count = 0
    for _ in range(ROUNDS):
        weights = _weights(base, low, high)
        values, turned = _interpolated(base, weights, low, high)
        bernstein = _bernstein(q, _SAMPLES)
        error = np.abs((values @ bernstein) / (weights @ bernstein) - turned[:, 1:-1]).max(axis=1)
        fine = (error <= SHARE * tolerance) & (np.abs(np.diff(turned, axis=1)).max(axis=1) <= MAX_STEP)
        done.append((low[fine], high[fine], weights[fine], values[fine]))
        count += int(np.count_nonzero(fine))
        low, high = low[~fine], high[~fine]
        middle = 0.5 * (low + high)
        if not len(low) or count + 2 * len(low) > MAX_PIECES or np.any((middle <= low) | (middle >= high)):
            break
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    if len(low):
        raise CurveError(
            f"theta cannot follow within {tolerance:g} rad near u = {low.min():.6g}: the tangent turns on the "
            "spot, or the tolerance is below its rounding"
        )
    low, high, weights, values = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.argsort(low)
    return _Pieces(low[order], high[order], weights[order], values[order])


def _interpolated(base: NurbsCurve, weights: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Theta (m, q + 1) as Bernstein coefficients, and the true angles (m, 17) at both ends and _SAMPLES; both from 0.

    The angle at the start of each piece counts as 0: adding a w to Theta adds a to theta.
    """
    q, count = base.degree, len(low)
    width = high - low
    angles = _unwrapped(base, low, high, np.concatenate([[0.0], _SAMPLES, [1.0]]))
    # orders 0 to 2 at both ends, where C' says them
    ends = [_turning(base, low, "right"), _turning(base, high, "left")]
    between = base.derivatives(low[:, None] + width[:, None] * _SAMPLES, 1)[..., 1, :2]
    speed = np.linalg.norm(between, axis=-1).max(axis=1)
    regular = np.column_stack([end[2] > STILL * speed for end in ends])
    values = np.empty((count, q + 1))
    for kind in ((True, True), (True, False), (False, True), (False, False)):
        rows = np.flatnonzero(np.all(regular == kind, axis=1))
        if not len(rows):
            continue
        conditions = []
        right = []
        for end, known in enumerate(kind):
            theta = angles[rows, -end]
            first, second, _ = (x[rows] for x in ends[end])
            derivatives = (theta, first * width[rows], second * width[rows] ** 2)
            w = _end_derivatives(weights[rows], end)
            for k in range(3 if known else 1):
                conditions.append(_end_condition(q, end, k))
                right.append(sum(math.comb(k, j) * derivatives[j] * w[k - j] for j in range(k + 1)))
        inner = q + 1 - len(conditions)
        if inner:
            # zeros of a Chebyshev polynomial
            places = 0.5 - 0.5 * np.cos((np.arange(inner) + 0.5) * np.pi / inner)
            basis = _bernstein(q, places)
            turned = _unwrapped(base, low[rows], high[rows], np.concatenate([[0.0], places]))[:, 1:]
            conditions += list(basis.T)
            right += list((turned * (weights[rows] @ basis)).T)
        values[rows] = np.linalg.solve(np.array(conditions), np.array(right)).T
    return values, angles


def _unwrapped(base: NurbsCurve, low: Array, high: Array, fractions: Array) -> Array:
    """Angles (m, n) at `fractions` (n,) of every piece, from 0 at its start, without jumps by full turns."""
    u = low[:, None] + (high - low)[:, None] * fractions
    u[:, -1] = np.minimum(u[:, -1], high)
    raw = _angles(base, u.ravel(), "right").reshape(u.shape)
    if fractions[-1] == 1.0:
        raw[:, -1] = _angles(base, high, "left")
    return np.unwrap(raw, axis=1) - raw[:, :1]


def _turning(base: NurbsCurve, u: Array, side: str) -> tuple[Array, Array, Array]:
    """theta', theta'' by u, and |C'|, (m,) at u (m,)."""
    there = base.derivatives(u, 3, side=side)
    first, second, third = there[:, 1], there[:, 2], there[:, 3]
    square = np.sum(first * first, axis=1)
    safe = np.where(square > 0.0, square, 1.0)
    turn = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / safe
    change = (first[:, 0] * third[:, 1] - first[:, 1] * third[:, 0]) / safe
    return turn, change - 2.0 * turn * np.sum(first * second, axis=1) / safe, np.sqrt(square)


def _assembled(base: NurbsCurve, pieces: _Pieces, tolerance: float, before: float) -> NurbsCurve:
    """x, y and theta as one curve, whose knots are as smooth as theta is between its pieces."""
    q = base.degree
    starts = _angles(base, pieces.low, "right")
    turned = pieces.values[:, -1] / pieces.weights[:, -1]
    # each piece begins where the last one ended by full turns; the angle itself comes from the tangent, not from a sum
    starts = _next_to(
        starts, before + np.concatenate([[starts[0] - before], starts[0] - before + np.cumsum(turned[:-1])])
    )
    starts += _next_to(starts[0], before) - starts[0]
    values = pieces.values + starts[:, None] * pieces.weights
    # a tangent that jumps, below CORNER_ANGLE, is met half way
    jump = values[1:, 0] - values[:-1, -1]
    values[1:, 0] -= 0.5 * jump
    values[:-1, -1] = values[1:, 0]
    inner = pieces.low[1:]
    given = _multiplicity(base, inner)
    times = np.maximum(given, q - _smoothness(values, pieces, tolerance))
    knots = np.concatenate([np.full(q + 1, pieces.low[0]), np.repeat(inner, times), np.full(q + 1, pieces.high[-1])])
    missing = np.repeat(inner, times - given)
    plane = base.with_knots(*missing) if len(missing) else base
    weights = np.ones(len(plane.control_points)) if plane.weights is None else plane.weights
    theta = _coefficients(values, pieces, knots, q) / weights
    return NurbsCurve(q, plane.knots, np.column_stack([plane.control_points, theta]), plane.weights)


def _smoothness(values: Array, pieces: _Pieces, tolerance: float) -> IntArray:
    """Order (m - 1,) to which Theta is continuous between its pieces, at most 2."""
    width = pieces.high - pieces.low
    wider = np.maximum(width[1:], width[:-1])
    floor = MATCH * tolerance * pieces.weights[1:, 0]
    order = np.zeros(len(width) - 1, dtype=np.int64)
    left, right = _end_derivatives(values[:-1], 1), _end_derivatives(values[1:], 0)
    for k in (1, 2):
        jump = np.abs(right[k] / width[1:] ** k - left[k] / width[:-1] ** k) * wider**k
        order += (order == k - 1) & (jump <= floor)
    return order


def _coefficients(values: Array, pieces: _Pieces, knots: Array, q: int) -> Array:
    """B-spline coefficients (n,) over `knots` of the spline with Bernstein coefficients `values` (m, q + 1) on pieces.

    Each is the polar form F(tau_i+1, ..., tau_i+q) of any piece where its basis function lives; the widest is the
    steadiest. Source: as of `editing.blossom`.
    """
    count = len(knots) - q - 1
    last = len(pieces.low) - 1
    first = np.clip(np.searchsorted(pieces.low, knots[:count], side="right") - 1, 0, last)
    behind = np.clip(np.searchsorted(pieces.low, knots[q + 1 :], side="left") - 1, 0, last)
    width = pieces.high - pieces.low
    best = first.copy()
    for step in range(1, int(np.max(behind - first)) + 1):
        other = np.minimum(first + step, behind)
        best = np.where(width[other] > width[best], other, best)
    arguments = knots[np.arange(1, q + 1)[:, None] + np.arange(count)]
    full = np.concatenate([pieces.low[:1], np.repeat(np.append(pieces.low, pieces.high[-1]), q), pieces.high[-1:]])
    points = np.append(values[:, :-1].ravel(), values[-1, -1])
    return blossom(full, points[:, None], q, q * (1 + best), arguments)[:, 0]


def _bernstein(q: int, t: Array) -> Array:
    """Bernstein polynomials (q + 1, n) of degree q at t (n,)."""
    return np.array([math.comb(q, i) * t**i * (1.0 - t) ** (q - i) for i in range(q + 1)])


def _end_condition(q: int, end: int, order: int) -> Array:
    """Coefficients (q + 1,) of the k-th derivative at t = 0 (end 0) or t = 1 (end 1): q! / (q - k)! Delta^k b."""
    row = np.zeros(q + 1)
    for j in range(order + 1):
        row[q - order + j if end else j] = math.perm(q, order) * math.comb(order, j) * (-1.0) ** (order - j)
    return row


def _end_derivatives(values: Array, end: int) -> list[Array]:
    """Derivatives of order 0 to 2, each (m,), at t = 0 or 1 of polynomials with Bernstein coefficients (m, q + 1)."""
    q = values.shape[1] - 1
    return [values @ _end_condition(q, end, k) for k in range(3)]

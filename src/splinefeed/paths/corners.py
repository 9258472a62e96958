"""Corners, where the tangent or the curvature of a path jumps, and bends as sharp as one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from splinefeed.curves.differential import curvatures
from splinefeed.kernels.layout import HIGH, LOW
from splinefeed.paths.joined_curves import JoinedCurves
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import chunks

#: A tangent that turns by more than this at one point, rad, is a corner. Below it is the rounding of CAD files.
CORNER_ANGLE = 1e-6
#: A corner that turns by more than this, rad, cannot be taken in motion: the tool stops there.
STOP_ANGLE = 1e-4
#: A speed below this, relative to size over width of the domain, counts as 0: the curvature there is undefined.
STILL = 1e-9
#: Corners less than this apart, relative to the length of the path, are one.
SAME_PLACE = 1e-14
#: A curvature jump below this, relative to the curvature itself and to 1 / size, is rounding.
CURVATURE_JUMP = 1e-6
#: Points processed at once: what bounds the memory that a path of a million lines takes.
BLOCK = 1 << 16
#: Samples of an arc-length piece among which sharp bends are looked for, and curves looked at together.
SAMPLES, TOGETHER = 9, 4096
#: A bend is sharp if its radius, or the way over which its curvature rises and falls, is below this share of the
#: length of its curve.
SHARP = 1e-3
#: A sample of a bend that is sharp in between has no more than so many times that radius.
NEARLY = 8.0
#: Curvature that is lower by less than this share in the next sample has no narrow peak.
FALL = 1e-4
#: Newton steps from between two samples to where |C'| is least, at most: where C'' all but vanishes there, too, each
#: takes a third of the way. A step of this share of the parameter is rounding.
STEPS, ROUNDING = 90, 1e-15


@dataclass(frozen=True)
class Corner:
    """A point of the path where tangent or curvature jumps.

    Parameters
    ----------
    s : float
        mm.
    curve : int
        Which curve; the one before it if between two.
    u : float
        Parameter on it.
    angle : float
        Of the tangents, rad.
    curvature_jump : float
        Length of the change of the curvature vector, 1/mm; infinite where C' = 0 on one side.
    """

    s: float
    curve: int
    u: float
    angle: float
    curvature_jump: float

    @property
    def stop(self) -> bool:
        """Whether the tool must stop here."""
        return self.angle > STOP_ANGLE


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners in order of s, as arrays; each one a Corner on access.

    s, u, angle, curvature_jump (n,), curve (n,): see Corner
    """

    s: Array
    curve: IntArray
    u: Array
    angle: Array
    curvature_jump: Array

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)

    @property
    def stop(self) -> BoolArray:
        """Whether the tool must stop there, (n,)."""
        return np.asarray(self.angle > STOP_ANGLE)

    def __len__(self) -> int:
        return len(self.s)

    def __getitem__(self, index: int) -> Corner:
        return Corner(*(column[index].item() for column in vars(self).values()))

    def __iter__(self) -> Iterator[Corner]:
        return (self[i] for i in range(len(self)))


def find_corners(path: JoinedCurves) -> Corners:
    """Points inside the path where the tangent of all axes or the curvature jumps."""
    flat = path.flat
    sizes = flat.scaled(path.weights).sizes() / np.diff(flat.domains)[:, 0]
    # knots inside curves, then joints: where on the curve before and on that behind, and whether anything can jump
    owner, inner, times = flat.inner_knots()
    last = np.arange(len(flat) - 1)
    before, u = np.concatenate([owner, last]), np.concatenate([inner, flat.domains[:-1, 1]])
    behind, v = np.concatenate([owner, last + 1]), np.concatenate([inner, flat.domains[1:, 0]])
    rough = np.concatenate([times >= flat.degrees[owner] - 1, np.ones(len(last), dtype=bool)])
    found = (
        _jumps(path, sizes, (before[part], u[part]), (behind[part], v[part]), rough[part])
        for part in chunks(max(len(rough), 1), BLOCK)
    )
    angle, jump, corner = (np.concatenate(each) for each in zip(*found, strict=True))
    at = np.flatnonzero(corner)
    at = at[np.lexsort((u[at], before[at]))]
    curve, u = before[at], u[at]
    # a joint is where the next curve starts, to the bit, so that a marker there and the corner are one stop
    joint = u == flat.domains[curve, 1]
    s = np.where(joint, path.curve_starts[curve + 1], path.arc_length(curve, u))
    # a point that is given twice, or a span that stands still, is one corner and not two
    keep = np.diff(s, prepend=-np.inf) > SAME_PLACE * path.length
    return Corners(s[keep], curve[keep], u[keep], angle[at][keep], jump[at][keep])


def _jumps(
    path: JoinedCurves, sizes: Array, before: tuple[IntArray, Array], after: tuple[IntArray, Array], rough: BoolArray
) -> tuple[Array, Array, BoolArray]:
    """Compute the angle between the tangents and the jump of the curvature of points.

    Parameters
    ----------
    path : JoinedCurves
        The path.
    sizes : (curves,) array
        Of the curves over the widths of their domains.
    before, after : tuple of array
        Curve (n,) and parameter (n,) on either side.
    rough : (n,) array of bool
        Where something can jump at all.

    Returns
    -------
    angle, jump : (n,) array
        rad and 1/mm.
    corner : (n,) array of bool
        Whether each is one.
    """
    tangent, bend = _turn(path, sizes, *before, "left")
    next_tangent, next_bend = _turn(path, sizes, *after, "right")
    still = np.isnan(bend[:, 0]) | np.isnan(next_bend[:, 0])
    # 2 atan2 of difference and sum keeps small and straight-back angles alike to rounding
    apart = np.linalg.norm(next_tangent - tangent, axis=1)
    angle = 2.0 * np.arctan2(apart, np.linalg.norm(next_tangent + tangent, axis=1))
    jump = np.linalg.norm(next_bend - bend, axis=1)
    size = path.size if path.size > 0.0 else path.length
    floor = CURVATURE_JUMP * (1.0 / size + np.linalg.norm(bend, axis=1) + np.linalg.norm(next_bend, axis=1))
    corner = (rough | still) & ((angle > CORNER_ANGLE) | (jump > floor))
    return angle, np.where(still, np.inf, jump), corner


def _turn(path: JoinedCurves, sizes: Array, curve: IntArray, u: Array, side: str) -> tuple[Array, Array]:
    """Unit tangents of all axes and curvature vectors of those that make the length, (n, axes) each.

    The latter are no numbers (NaN) where C' = 0.
    """
    derivatives = path.evaluate(curve, u, 2, side=side)[:, 1:]
    first, second = np.moveaxis(derivatives * path.weights, 1, 0)
    square = np.sum(first * first, axis=1, keepdims=True)
    still = np.sqrt(square[:, 0]) <= STILL * sizes[curve]
    safe = np.where(still[:, None], 1.0, square)
    bends = (second - np.sum(first * second, axis=1, keepdims=True) / safe * first) / safe
    tangents = derivatives[:, 0] * path.units
    tangents /= np.where(still, 1.0, np.linalg.norm(tangents, axis=1))[:, None]
    for k in np.flatnonzero(still):
        limit = path.joined[int(curve[k])].tangent(u[k], side=side) * path.units
        tangents[k] = limit / max(float(np.linalg.norm(limit)), 1e-300)
    return tangents, np.where(still[:, None], np.nan, bends)


def sharp_bends(path: JoinedCurves) -> tuple[Array, Array]:
    """Arc lengths (k,) of sharp bends, mm, and their curvature, 1/mm.

    Arc-length pieces are short where |C'| bends, so that samples of each see where the curvature peaks; a parabola
    through three of its radius, which is one near the tip of a parabola, says where. Only where |C'| is a polynomial
    itself, and pieces are long, may a peak hide between samples: at a dip of |C'|, where C' . C'' = 0 (Newton's steps).
    """
    bent = np.flatnonzero((path.flat.degrees > 1) | (path.flat.rational > 0))
    found = [np.zeros((0, 2))]
    size = np.diff(path.curve_starts)

    def looked_at(curve: IntArray, u: Array) -> tuple[Array, Array]:
        """|C'|^2 and the radius of curvature, mm."""
        derivatives = path.evaluate(curve, u, 2) * path.weights
        with np.errstate(divide="ignore"):
            radius = 1.0 / curvatures(derivatives)
        return np.sum(derivatives[:, 1] ** 2, axis=1), radius

    for first in range(0, len(bent), TOGETHER):
        some = bent[first : first + TOGETHER]
        rows = path.curve_rows[some]
        counts = rows[:, 1] - rows[:, 0] + 1
        index = np.arange(counts.sum()) + np.repeat(rows[:, 0] - np.cumsum(counts) + counts, counts)
        curve = np.repeat(some, SAMPLES * counts)
        low, high = path.table[index, LOW], path.table[index, HIGH]
        u = (low[:, None] + (high - low)[:, None] * (np.arange(SAMPLES) + 0.5) / SAMPLES).ravel()
        same = (curve[1:-1] == curve[:-2]) & (curve[1:-1] == curve[2:])
        values = looked_at(curve, u)
        for value in values:
            before, here, after = value[:-2], value[1:-1], value[2:]
            dip = same & (here <= np.minimum(before, after)) & (here < np.maximum(before, after))
            dip = 1 + np.flatnonzero(dip & ((value is values[0]) | (here < NEARLY * SHARP * size[curve[1:-1]])))
            at, owner = u[dip], curve[dip]
            if not len(dip):
                continue
            places = _least(*(u[dip + k] for k in (-1, 0, 1)), *(value[dip + k] for k in (-1, 0, 1)))
            radius = looked_at(owner, places)[1]
            if value is values[0]:
                near = np.flatnonzero(radius < NEARLY * SHARP * size[owner])
                places[near] = _slowest(path, owner[near], places[near], u[dip[near] - 1], u[dip[near] + 1])
                radius[near] = looked_at(owner[near], places[near])[1]
            at, least = np.where(radius < values[1][dip], places, at), np.minimum(radius, values[1][dip])
            sharp = least < SHARP * size[owner]
            if value is values[1]:
                sharp |= _rise(path, owner, u, dip, at, value, least) < SHARP * size[owner]
            with np.errstate(divide="ignore"):
                found.append(np.column_stack([path.arc_length(owner, at), 1.0 / least])[sharp])
    tips = np.concatenate(found)
    tips = tips[np.argsort(tips[:, 0])]
    # nearer than their radius they are one, the sharpest
    gap = np.diff(tips[:, 0], prepend=-np.inf)
    together = np.cumsum((gap * tips[:, 1] > 1.0) | (gap > SHARP * path.length))
    tips = tips[np.lexsort((-tips[:, 1], together))]
    apart = np.diff(np.sort(together), prepend=0) > 0
    return tips[apart, 0], tips[apart, 1]


def _rise(
    path: JoinedCurves, curve: IntArray, u: Array, dip: IntArray, at: Array, radius: Array, least: Array
) -> Array:
    """The way w, mm, over which curvature k rises to its peak at `at` (n,) and falls: k (1 - d^2/w^2) at d beside."""
    s = path.arc_length(curve, at)
    ways = []
    for beside in (dip - 1, dip + 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = 1.0 - least / radius[beside]
            ways.append(np.where(fall > FALL, np.abs(path.arc_length(curve, u[beside]) - s) / fall**0.5, np.inf))
    return np.maximum(*ways)


def _slowest(path: JoinedCurves, curve: IntArray, u: Array, low: Array, high: Array) -> Array:
    """Parameters (n,) between `low` and `high` at which |C'| is least: Newton's steps on C' . C'' = 0 from u (n,)."""
    step = np.full(len(u), np.inf)
    for _ in range(STEPS):
        if not np.any(np.abs(step) > ROUNDING * np.abs(u)):
            break
        one, two, three = np.moveaxis(path.evaluate(curve, u, 3)[:, 1:] * path.weights, 1, 0)
        bend = np.abs(np.sum(two * two, axis=1) + np.sum(one * three, axis=1))
        step = np.sum(one * two, axis=1) / np.where(bend > 0.0, bend, np.inf)
        u = np.clip(u - step, low, high)
    return u


def _least(a: Array, b: Array, c: Array, at_a: Array, at_b: Array, at_c: Array) -> Array:
    """Where parabolas through three values each are least, (n,), between the outer places."""
    with np.errstate(divide="ignore", invalid="ignore"):
        left, right = (at_b - at_a) / (b - a), (at_c - at_b) / (c - b)
        at = 0.5 * (a + b) - 0.5 * left * (c - a) / (right - left)
    found: Array = np.clip(np.where(np.isfinite(at), at, b), a, c)
    return found

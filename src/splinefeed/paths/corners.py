"""Corners, where the tangent or the curvature of a path jumps, and bends as sharp as one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

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
#: A bend is sharp if its radius is below this share of the length of its curve.
SHARP = 1e-3


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
    """Arc lengths (k,) of sharp bends, mm, and their curvature, 1/mm: where no piece beside a piece bends more.

    Arc-length pieces are short where |C'| bends, so that samples of each see where the curvature peaks.
    """
    bend, u = path._most_bent(path.shape[2])
    curve = np.repeat(np.arange(len(path.flat)), np.diff(path.curve_rows)[:, 0] + 1)
    same = curve[1:] == curve[:-1]
    peak = bend * SHARP * np.diff(path.curve_starts)[curve] > 1.0
    peak[1:] &= ~same | (bend[1:] > bend[:-1])
    peak[:-1] &= ~same | (bend[:-1] >= bend[1:])
    return path.arc_length(curve[peak], u[peak]), bend[peak]

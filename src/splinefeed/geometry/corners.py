"""Corners: where the tangent or the curvature of a path jumps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from splinefeed.geometry.differential import unit_tangents
from splinefeed.geometry.pieces import chunks
from splinefeed.kernels import layout as pieces
from splinefeed.records import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from splinefeed.geometry.path import Path

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


@dataclass(frozen=True)
class Corner:
    """A point of the path where tangent or curvature jumps.

    s  mm; curve, u  where (the end of `curve` if between two); angle  of the tangents, rad;
    curvature_jump  length of the change of the curvature vector, 1/mm; infinite where C' = 0 on one side
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


def find_corners(path: Path) -> Corners:
    """Points inside the path where the tangent of all axes or the curvature jumps."""
    flat = path.flat
    sizes = flat.sizes() / np.diff(flat.domains)[:, 0]
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
    path: Path, sizes: Array, before: tuple[IntArray, Array], after: tuple[IntArray, Array], rough: BoolArray
) -> tuple[Array, Array, BoolArray]:
    """Angle between the tangents and jump of the curvature of points (n,), and whether each is a corner.

    sizes  (curves,) of the curves over the widths of their domains; rough  (n,) where something can jump at all
    """
    tangent, bend, rate = _turn(path, sizes, *before, "left")
    next_tangent, next_bend, next_rate = _turn(path, sizes, *after, "right")
    still = np.isnan(bend[:, 0]) | np.isnan(next_bend[:, 0])
    if rate.shape[1]:  # rotary axes that turn along with the linear ones; where C' = 0 their rate is not a number
        known = ~still[:, None]
        tangent = np.column_stack([tangent, np.where(known, rate, 0.0)])
        next_tangent = np.column_stack([next_tangent, np.where(known, next_rate, 0.0)])
        for each in (tangent, next_tangent):
            norm = np.linalg.norm(each, axis=1, keepdims=True)
            each /= np.where(norm > 0.0, norm, 1.0)
    # 2 atan2 of difference and sum keeps small and straight-back angles alike to rounding
    apart = np.linalg.norm(next_tangent - tangent, axis=1)
    angle = 2.0 * np.arctan2(apart, np.linalg.norm(next_tangent + tangent, axis=1))
    jump = np.linalg.norm(next_bend - bend, axis=1)
    size = path.size if path.size > 0.0 else path.length
    floor = CURVATURE_JUMP * (1.0 / size + np.linalg.norm(bend, axis=1) + np.linalg.norm(next_bend, axis=1))
    corner = (rough | still) & ((angle > CORNER_ANGLE) | (jump > floor))
    return angle, np.where(still, np.inf, jump), corner


def _turn(path: Path, sizes: Array, curve: IntArray, u: Array, side: str) -> tuple[Array, Array, Array]:
    """Unit tangents and curvature vectors (n, measured axes) and rates of rotary axes, deg/mm, (n, rotary or 0).

    On paths with moves of rotary axes alone the measured axes are all of them, in mm and degrees; those that do not
    make the arc length there are 0. Curvature vectors are no numbers (NaN) where C' = 0.
    """
    linear = path.linear
    derivatives = path.evaluate(curve, u, 2, side=side)[:, 1:]
    measured = derivatives[..., :linear]
    turning = np.zeros(len(u), dtype=bool)
    if path.shape[2] <= 0:
        turning = path.turning(curve, u, side=side)
        measured = derivatives.copy()
        measured[..., linear:] *= pieces.DEGREES
        measured[turning, :, :linear] = 0.0
        measured[~turning, :, linear:] = 0.0
    first, second = measured[:, 0], measured[:, 1]
    square = np.sum(first * first, axis=1, keepdims=True)
    still = np.sqrt(square[:, 0]) <= STILL * sizes[curve]
    safe = np.where(still[:, None], 1.0, square)
    bends = (second - np.sum(first * second, axis=1, keepdims=True) / safe * first) / safe
    tangents = first / np.sqrt(safe)
    for k in np.flatnonzero(still):
        columns = slice(linear, None) if turning[k] else slice(linear)
        limit = unit_tangents(path.joined[int(curve[k])], u[k], columns, side)
        tangents[k] = 0.0
        tangents[k, columns if measured.shape[2] > linear else slice(None)] = limit
    rates = pieces.DEGREES * derivatives[:, 0, linear:] / np.sqrt(safe)
    rates[turning] = 0.0
    return tangents, np.where(still[:, None], np.nan, bends), rates

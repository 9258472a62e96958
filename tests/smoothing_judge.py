"""Two-way distance of two paths, bounded from above, by means of its own: what `order` says is held against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from splinefeed.curves.nearest import Nearest
from splinefeed.errors import InputError
from splinefeed.paths.path import Path
from splinefeed.paths.smoothing_proven import chords
from splinefeed.records import Array, IntArray

#: What chords cut off each path, which counts twice in a bound and twice in what it is compared with, and what bounds
#: may be too large by, as shares of the given precision.
SAG, SLACK = 0.1, 0.6
#: Halvings of a chord at most.
MOST_HALVINGS = 24


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
    Nothing of it is shared with the smoothing. Raises InputError for paths of other axes or a precision of 0 or less.
    """
    if original.axes != result.axes:
        raise InputError(f"the paths have axes {original.axes} and {result.axes}; the same are needed")
    if not 0.0 < precision < math.inf:
        raise InputError(f"precision is {precision!r} mm; it must be greater than 0 and finite")
    first, second = (chords(path, SAG * precision)[:2] for path in (original, result))
    sags = 2.0 * SAG * precision
    return Deviation(
        result=_farthest(second, first, len(result.curves), SLACK * precision) + sags,
        original=_farthest(first, second, len(original.curves), SLACK * precision) + sags,
    )


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

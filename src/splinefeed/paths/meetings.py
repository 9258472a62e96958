"""Where a line of chords meets itself: pairs of boxes that overlap, then pairs of chords."""

from __future__ import annotations

import numpy as np

from splinefeed.records import Array, BoolArray, IntArray

#: Neighbouring chords whose directions have a cosine below this run back over each other.
BACK = -0.996
#: Two chords count as parallel if the square of the sine between them is below this.
PARALLEL = 1e-14
#: Pairs of boxes that are processed together.
MOST_PAIRS = 1 << 17


def meetings(points: Array, touch: float, most: int) -> Array | None:
    """Pairs of chords of points (n + 1, axes), neighbours only if one runs back over the other, within `touch`, mm.

    Their places (m, 2), chord and share in one number, the earlier chord first, in order; None for more than `most`.
    """
    boxes = _boxes(points)
    back = np.append(runs_back(points), False)
    # a level of the tree a number; both nodes of a pair are of one level
    waiting = [(len(boxes) - 1, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))]
    found, count = [np.empty((0, 2))], 0
    while waiting:
        level, k, m = waiting.pop()
        low, high = boxes[level]
        near = np.all((low[:, k] <= high[:, m] + touch) & (low[:, m] <= high[:, k] + touch), axis=0)
        k, m = k[near], m[near]
        if level:
            left, right = np.repeat(2 * k, 4), np.repeat(2 * m, 4)
            left += np.tile([0, 0, 1, 1], len(k))
            right += np.tile([0, 1, 0, 1], len(m))
            below = (left <= right) & (right < boxes[level - 1].shape[2])
            left, right = left[below], right[below]
            for start in range(0, len(left), MOST_PAIRS):
                part = slice(start, start + MOST_PAIRS)
                waiting.append((level - 1, left[part], right[part]))
            continue
        apart = (m > k + 1) | (m == k + 1) & back[k]
        k, m = k[apart], m[apart]
        square, shares = closest(points, k, m)
        touching = square <= touch * touch
        found.append(np.column_stack([k, m])[touching] + shares[touching])
        count += len(found[-1])
        if count > most:
            return None
    out = np.concatenate(found)
    return np.asarray(out[np.lexsort((out[:, 1], out[:, 0]))])


def _boxes(points: Array) -> list[Array]:
    """Least and greatest coordinates (2, axes, nodes): of each chord, then of every two of the level below, to one."""
    p = points.T
    levels = [np.stack([np.minimum(p[:, :-1], p[:, 1:]), np.maximum(p[:, :-1], p[:, 1:])])]
    while (count := levels[-1].shape[2]) > 1:
        even, odd = levels[-1][..., ::2], levels[-1][..., 1::2]
        if count % 2:
            odd = np.concatenate([odd, even[..., -1:]], axis=2)
        levels.append(np.stack([np.minimum(even[0], odd[0]), np.maximum(even[1], odd[1])]))
    return levels


def runs_back(points: Array) -> BoolArray:
    """Whether each chord but the first runs back over the one before it, (n - 1,)."""
    step = np.diff(points, axis=0)
    product, square = np.sum(step[:-1] * step[1:], axis=1), np.sum(step * step, axis=1)
    return np.asarray(product < BACK * np.sqrt(square[:-1] * square[1:]))


def closest(points: Array, i: IntArray, j: IntArray) -> tuple[Array, Array]:
    """Squares (n,) of the least distances of chords i and j (n,), and where on both they are, as shares (n, 2).

    From where the lines are nearest, or any place of parallel ones, to the nearest of the other chord and back:
    Ericson, "Real-Time Collision Detection", 2005, section 5.1.9.
    """
    u, v, w = points[i + 1] - points[i], points[j + 1] - points[j], points[i] - points[j]
    a, b, c, d, e = (np.sum(one * two, axis=1) for one, two in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = a * c - b * b
        s = np.where(determinant > PARALLEL * a * c, np.clip((b * e - c * d) / determinant, 0.0, 1.0), 0.0)
        t = np.where(c > 0.0, np.clip((e + s * b) / c, 0.0, 1.0), 0.0)
        s = np.where(a > 0.0, np.clip((t * b - d) / a, 0.0, 1.0), 0.0)
    step = w + s[:, None] * u - t[:, None] * v
    return np.sum(step * step, axis=1), np.column_stack([s, t])

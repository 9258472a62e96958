"""Runs of short lines: points that stand for their neighbours."""

from __future__ import annotations

from splinefeed.kernels.jit import kernel
from splinefeed.records import Array, BoolArray


@kernel
def thin(points: Array, held: BoolArray, linear: int, near: Array, turned: float, kept: BoolArray) -> int:
    """Mark the points (n, axes) that stay; the others stand within `near` (n,), mm, of the last one that stayed.

    And within `turned`, rad, over the axes behind the linear ones.
    held  (n,) points that stay whatever is near; the others make room for them. A way out and back to the same place
    keeps the first point that is elsewhere, so that no line loses its length. Returns how many stay.
    """
    count = 0
    last = 0
    elsewhere = -1  # the first point behind the last one that stayed and not at its place
    for i in range(points.shape[0]):
        square = 0.0
        angle = 0.0
        for a in range(points.shape[1]):
            step = points[i, a] - points[last, a]
            if a < linear:
                square += step * step
            else:
                angle += step * step
        close = i > 0 and square <= near[i] * near[i] and angle <= turned * turned
        kept[i] = held[i] or not close
        if held[i] and close:
            if not held[last]:
                kept[last] = False
                count -= 1
            elif square == 0.0 and elsewhere > 0:
                kept[elsewhere] = True
                count += 1
        if kept[i]:
            count += 1
            last = i
            elsewhere = -1
        elif square > 0.0 and elsewhere < 0:
            elsewhere = i
    return count

"""What the planner asks of a path: its length, where its derivatives jump, and the derivatives by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from splinefeed.feed.stretches import SAME_PLACE
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.kernels.pieces import HIGH, LOW, START
from splinefeed.records import Array

#: Samples of an arc-length piece among which dips of |C'| are looked for, Newton steps to them, and curves in one go.
SAMPLES, STEPS, TOGETHER = 9, 4, 4096


class Track(Protocol):
    """A path as the planner sees it, of any number of axes."""

    @property
    def length(self) -> float:
        """Arc length, mm."""

    @property
    def breaks(self) -> Array:
        """Arc lengths (k,) strictly inside where a derivative up to the third can jump, mm, increasing."""

    @property
    def marks(self) -> Array:
        """Arc lengths (m,), mm, increasing, dense where the path bends sharply: places to look at."""

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives by arc length, (n, 4, axes), at places s (n,) that are no breaks."""


@dataclass(frozen=True)
class PathTrack:
    """A `Path` as a track."""

    path: Path

    @property
    def length(self) -> float:
        """Arc length, mm."""
        return self.path.length

    @cached_property
    def breaks(self) -> Array:
        """Knots, joints and corners, mm."""
        path = self.path
        owner, knots, _ = path.flat.inner_knots()
        s = np.unique(np.concatenate([path.arc_length(owner, knots), path.curve_starts[1:-1], path.corners.s]))
        inside = s[(s > SAME_PLACE * path.length) & (s < (1.0 - SAME_PLACE) * path.length)]
        return inside[np.diff(inside, prepend=0.0) > SAME_PLACE * path.length]

    @cached_property
    def marks(self) -> Array:
        """Ends of arc-length pieces, which are short at sharp bends as |C'| is a polynomial on them, and dips of |C'|.

        Where |C'| is a polynomial anyway a bend may hide within a piece, but not the dip at its tip: C' . C'' = 0.
        """
        path, found = self.path, [self.path.table[:, START]]
        bent = np.flatnonzero((path.flat.degrees > 1) | (path.flat.rational > 0))
        for some in np.split(bent, np.arange(TOGETHER, len(bent), TOGETHER)):
            counts = path.curve_rows[some, 1] - path.curve_rows[some, 0] + 1
            index = np.arange(counts.sum()) + np.repeat(path.curve_rows[some, 0] - np.cumsum(counts) + counts, counts)
            low, high = path.table[index, LOW], path.table[index, HIGH]
            curve = np.repeat(some, SAMPLES * counts)
            u = (low[:, None] + (high - low)[:, None] * (np.arange(SAMPLES) + 0.5) / SAMPLES).ravel()
            speed = np.sum(path.evaluate(curve, u, 1)[:, 1, : path.linear] ** 2, axis=1)
            dip = (speed[1:-1] <= speed[:-2]) & (speed[1:-1] < speed[2:]) & (curve[:-2] == curve[2:])
            k = 1 + np.flatnonzero(dip)
            at = u[k]
            for _ in range(STEPS if len(k) else 0):
                one, two, three = np.moveaxis(path.evaluate(curve[k], at, 3)[:, 1:, : path.linear], 1, 0)
                bend = np.abs(np.sum(two * two, axis=1) + np.sum(one * three, axis=1))
                at = np.clip(at - np.sum(one * two, axis=1) / np.where(bend > 0.0, bend, np.inf), u[k - 1], u[k + 1])
            found.append(np.asarray(path.arc_length(curve[k], at)))
        return np.unique(np.concatenate(found))

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives by arc length, (n, 4, axes)."""
        return by_arc_length(self.path.arc_pieces.derivatives_at(s, 3), self.path.linear)

"""What the planner asks of a path: its length, where its derivatives jump, and the derivatives by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from splinefeed.feed.numbers import SAME
from splinefeed.geometry.differential import by_arc_length
from splinefeed.geometry.path import Path
from splinefeed.records import Array


class Track(Protocol):
    """A path as the planner sees it, of any number of axes."""

    @property
    def length(self) -> float:
        """Arc length, mm."""

    @property
    def breaks(self) -> Array:
        """Arc lengths (k,) strictly inside where a derivative up to the third can jump, mm, increasing."""

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
        """Knots, joints and corners, and the tips of sharp bends, where cells end, too, mm."""
        path = self.path
        owner, knots, _ = path.flat.inner_knots()
        places = (path.arc_length(owner, knots), path.curve_starts[1:-1], path.corners.s, path.sharp_bends[0])
        s = np.unique(np.concatenate(places))
        inside = s[(s > SAME * path.length) & (s < (1.0 - SAME) * path.length)]
        return inside[np.diff(inside, prepend=0.0) > SAME * path.length]

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives by arc length, (n, 4, axes)."""
        return by_arc_length(self.path.arc_pieces.derivatives_at(s, 3), self.path.linear)

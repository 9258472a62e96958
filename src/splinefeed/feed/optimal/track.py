"""What the planner asks of a path: its length, where its derivatives jump, and the derivatives by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from splinefeed.geometry.differential import by_arc_length, curvatures
from splinefeed.geometry.path import Path
from splinefeed.kernels.pieces import HIGH, LOW
from splinefeed.records import Array, IntArray

#: Samples of an arc-length piece among which sharp bends are looked for, and curves looked at together.
SAMPLES, TOGETHER = 9, 4096
#: Golden section, and the steps that bring it from one sample to rounding.
GOLDEN, SECTIONS = 0.5 * (5.0**0.5 - 1.0), 60
#: A bend is sharp if its radius is below this share of the length of its curve.
SHARP = 1e-3
#: Knots nearer to each other than this share of the path are one place: what lies between is rounding.
SAME = 1e-12


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
    def tips(self) -> tuple[Array, Array]:
        """Arc lengths (k,) of sharp bends, mm, and their curvature, 1/mm."""
        return sharp_bends(self.path)

    @cached_property
    def breaks(self) -> Array:
        """Knots, joints and corners, and the tips of sharp bends, where cells end, too, mm."""
        path = self.path
        owner, knots, _ = path.flat.inner_knots()
        places = (path.arc_length(owner, knots), path.curve_starts[1:-1], path.corners.s, self.tips[0])
        s = np.unique(np.concatenate(places))
        inside = s[(s > SAME * path.length) & (s < (1.0 - SAME) * path.length)]
        return inside[np.diff(inside, prepend=0.0) > SAME * path.length]

    def derivatives(self, s: Array) -> Array:
        """r and its first three derivatives by arc length, (n, 4, axes)."""
        curve, u = self.path.locate(s)
        return by_arc_length(self.path.evaluate(curve, u, 3), self.path.linear)


def sharp_bends(path: Path) -> tuple[Array, Array]:
    """Arc lengths (k,) of sharp bends, mm, and their curvature, 1/mm.

    Such a tip may lie between any two places at which a path is looked at. It is looked for by golden section where
    |C'| or the radius of curvature is least among samples of each arc-length piece.
    """
    linear = path.linear
    bent = np.flatnonzero((path.flat.degrees > 1) | (path.flat.rational > 0))
    found = [np.zeros((0, 2))]

    def speed(curve: IntArray, u: Array) -> Array:
        return np.asarray(np.linalg.norm(path.evaluate(curve, u, 1)[:, 1, :linear], axis=1))

    def radius(curve: IntArray, u: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            value = 1.0 / curvatures(path.evaluate(curve, u, 2), linear)
        return np.where(np.isfinite(value), value, np.inf)

    for first in range(0, len(bent), TOGETHER):
        some = bent[first : first + TOGETHER]
        rows = path.curve_rows[some]
        counts = rows[:, 1] - rows[:, 0] + 1
        index = np.arange(counts.sum()) + np.repeat(rows[:, 0] - np.cumsum(counts) + counts, counts)
        curve = np.repeat(some, SAMPLES * counts)
        low, high = path.table[index, LOW], path.table[index, HIGH]
        u = (low[:, None] + (high - low)[:, None] * (np.arange(SAMPLES) + 0.5) / SAMPLES).ravel()
        same = (curve[1:-1] == curve[:-2]) & (curve[1:-1] == curve[2:])
        for function in (speed, radius):
            value = function(curve, u)
            low_side, high_side = np.minimum(value[:-2], value[2:]), np.maximum(value[:-2], value[2:])
            dip = 1 + np.flatnonzero(same & (value[1:-1] <= low_side) & (value[1:-1] < high_side))
            owner, left, right = curve[dip], u[dip - 1], u[dip + 1]
            for _ in range(SECTIONS if len(dip) else 0):
                a, b = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
                lower = function(owner, a) <= function(owner, b)
                left, right = np.where(lower, left, a), np.where(lower, b, right)
            at = 0.5 * (left + right)
            least = radius(owner, at)
            sharp = least < SHARP * np.diff(path.curve_starts)[owner]
            if function is speed and path.linear < len(path.axes):  # rotary axes turn far within little of the path
                sharp |= speed(owner, at) < SHARP * (path.curve_starts[owner + 1] - path.curve_starts[owner])
            with np.errstate(divide="ignore"):
                found.append(np.column_stack([path.arc_length(owner, at), 1.0 / least])[sharp])
    tips = np.concatenate(found)
    tips = tips[np.argsort(tips[:, 0])]
    apart = np.diff(tips[:, 0], prepend=-np.inf) * tips[:, 1] > 1.0  # nearer than their radius they are one
    apart |= np.diff(tips[:, 0], prepend=-np.inf) > SHARP * path.length
    return tips[apart, 0], tips[apart, 1]

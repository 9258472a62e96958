"""Sharp bends: where the curvature of a path peaks within a thousandth of a curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from splinefeed.geometry.differential import curvatures
from splinefeed.kernels.layout import HIGH, LOW
from splinefeed.records import Array, IntArray

if TYPE_CHECKING:
    from splinefeed.geometry.path import Path

#: Samples of an arc-length piece among which sharp bends are looked for, and curves looked at together.
SAMPLES, TOGETHER = 9, 4096
#: A bend is sharp if its radius, or the way over which its curvature rises and falls, is below this share of the
#: length of its curve.
SHARP = 1e-3
#: A sample of a bend that is sharp in between has no more than so many times that radius.
NEARLY = 8.0
#: Curvature that is lower by less than this share in the next sample has no narrow peak.
FALL = 1e-4
#: Newton steps from between two samples to where |C'| is least.
STEPS = 4


def sharp_bends(path: Path) -> tuple[Array, Array]:
    """Arc lengths (k,) of sharp bends, mm, and their curvature, 1/mm.

    Arc-length pieces are short where |C'| bends, so that samples of each see where the curvature peaks; a parabola
    through three of its radius, which is one near the tip of a parabola, says where. Only where |C'| is a polynomial
    itself, and pieces are long, may a peak hide between samples: at a dip of |C'|, where C' . C'' = 0 (Newton's steps).
    """
    linear = path.linear
    bent = np.flatnonzero((path.flat.degrees > 1) | (path.flat.rational > 0))
    found = [np.zeros((0, 2))]
    size = np.diff(path.curve_starts)

    def looked_at(curve: IntArray, u: Array) -> tuple[Array, Array]:
        """|C'|^2 and the radius of curvature, mm."""
        derivatives = path.evaluate(curve, u, 2)
        with np.errstate(divide="ignore"):
            radius = 1.0 / curvatures(derivatives, linear)
        return np.sum(derivatives[:, 1, :linear] ** 2, axis=1), radius

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
            if value is values[0] and path.linear < len(path.axes):  # rotary axes turn far within little of the path
                sharp |= looked_at(owner, at)[0] < SHARP * size[owner]
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


def _rise(path: Path, curve: IntArray, u: Array, dip: IntArray, at: Array, radius: Array, least: Array) -> Array:
    """The way w, mm, over which curvature k rises to its peak at `at` (n,) and falls: k (1 - d^2/w^2) at d beside."""
    s = path.arc_length(curve, at)
    ways = []
    for beside in (dip - 1, dip + 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = 1.0 - least / radius[beside]
            ways.append(np.where(fall > FALL, np.abs(path.arc_length(curve, u[beside]) - s) / fall**0.5, np.inf))
    return np.maximum(*ways)


def _slowest(path: Path, curve: IntArray, u: Array, low: Array, high: Array) -> Array:
    """Parameters (n,) between `low` and `high` at which |C'| is least: Newton's steps on C' . C'' = 0 from u (n,)."""
    for _ in range(STEPS if len(u) else 0):
        one, two, three = np.moveaxis(path.evaluate(curve, u, 3)[:, 1:, : path.linear], 1, 0)
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

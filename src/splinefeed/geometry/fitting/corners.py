"""Corners of a polyline: where one smooth curve through its points would be wrong."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.records import Array, IntArray

#: Two neighbouring chords that turn by more than this, rad, may be a corner.
CORNER_ANGLE = math.radians(30.0)
#: A corner turns at least this many times as much as the points before and behind it.
SHARPER = 3.0
#: More than this, rad, is a corner whatever is beside it: fewer than five points a turn define no smooth curve.
SURE_CORNER = math.radians(75.0)


def corner_indices(points: Array, angle: float, arm: float, closed: bool = False) -> IntArray:
    """Indices (k,) of the corners among points (n, axes): inner points, or any of them if `closed`.

    A corner turns by more than `angle`, rad, both between its two chords and between arms of at least `arm`, mm, so
    that noise makes none; and SHARPER times as much as the points at the ends of these arms, or more than SURE_CORNER.
    """
    count = len(points)
    line = np.concatenate([points, points, points]) if closed else points
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.arange(1, len(line) - 1)
    back = np.minimum(np.maximum(np.searchsorted(s, s[at] - arm, side="right") - 1, 0), at - 1)
    ahead = np.maximum(np.minimum(np.searchsorted(s, s[at] + arm, side="left"), len(line) - 1), at + 1)
    turn = np.zeros(len(line))
    turn[at] = turns(line, back, at, ahead)
    sharp = (turn[at] > angle) & (turns(line, at - 1, at, at + 1) > angle)
    sharp &= (turn[at] >= SHARPER * np.maximum(turn[back], turn[ahead])) | (turn[at] > SURE_CORNER)
    corner = np.zeros(len(line), dtype=bool)
    candidates = np.flatnonzero(sharp)
    for i in candidates[np.argsort(-turn[at][candidates], kind="stable")]:
        if not np.any(corner[back[i] + 1 : ahead[i]]):  # the sharpest within its arms stands for its neighbours
            corner[at[i]] = True
    found = np.flatnonzero(corner)
    if closed:
        found = found[(found >= count) & (found < 2 * count)] - count
    return found.astype(np.int64)


def turns(points: Array, before: IntArray, at: IntArray, after: IntArray) -> Array:
    """Angles (n,), rad, between the chords before -> at and at -> after; 0 where a chord has no length."""
    first, second = points[at] - points[before], points[after] - points[at]
    with np.errstate(invalid="ignore", divide="ignore"):
        first = first / np.linalg.norm(first, axis=1)[:, None]
        second = second / np.linalg.norm(second, axis=1)[:, None]
    angle = 2.0 * np.arctan2(np.linalg.norm(first - second, axis=1), np.linalg.norm(first + second, axis=1))
    return np.asarray(np.nan_to_num(angle))

"""Runs of short lines: found among the curves of a path, freed of points that are noise, and fitted by splines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.curves import LINE_KNOTS
from splinefeed.geometry.path import Path
from splinefeed.kernels import smoothing as kernels
from splinefeed.records import Array, BoolArray, IntArray

#: Share of the tolerance within which points stand for one: duplicates, jitter and tiny steps back.
THIN = 0.1
#: Share of the tolerance that a fit may use. Between its samples it may be off by a little more.
FIT = 0.6
#: Two lines make a run if an arc over the shorter one that turns as they do rises by no more than this many tolerances.
RISE = 1.5
#: A line longer than this many tolerances, or so many times as long as the median of its run, stays a line.
LONG, LONGER = 500.0, 12.0
#: Lines that a run needs at least, and most lines of one fit.
LEAST, MOST = 4, 500
#: A corner turns between arms of at least this many tolerances, which noise does not reach, of at most so many lines.
ARM, ARM_LINES = 5.0, 8
#: Samples a line of mean length, the least and the most of any.
SAMPLES, MOST_SAMPLES = 3, 48


@dataclass(frozen=True, eq=False)
class Pieces:
    """Curves of a path, some of them in place of several.

    curves  what stands for the curves first[i] ... first[i + 1] - 1 of the path; first (pieces + 1,)
    spent   (pieces,) share of the tolerance that is used up
    corner  (pieces - 1,) joints that turn by more than the corner angle
    fits    how many are splines over runs
    """

    curves: Sequence[NurbsCurve]
    first: IntArray
    spent: Array
    corner: BoolArray
    fits: int


def pieces(
    path: Path, tolerance: Array, angular: float, free: BoolArray, loose: BoolArray, corner_angle: float
) -> Pieces:
    """Runs of short lines as splines of degree 5, everything else as it is.

    tolerance (curves,) mm; angular rad; free (curves - 1,) joints that a run may cross; loose (curves,) curves that may
    be changed at all; corner_angle rad
    """
    flat, linear = path.flat, path.linear
    lines = (flat.degrees == 1) & (np.diff(flat.point_starts) == 2) & loose
    ends = path.ends
    vertices = np.vstack([ends[:1, 0], ends[:, 1]])
    held = np.ones(len(vertices), dtype=bool)
    held[1:-1] = ~(free & lines[:-1] & lines[1:])
    kept = _kept(vertices, held, tolerance, linear)
    at = np.flatnonzero(kept)
    vertices, first = vertices[at], at
    allowed = np.minimum.reduceat(tolerance, at[:-1])
    lines = lines[at[:-1]]
    crossed = (~held[at])[1:-1]
    merged = np.diff(first) > 1
    steps = np.diff(vertices, axis=0)
    lengths = np.linalg.norm(steps[:, :linear], axis=1)
    angle = _angles(steps[:-1, :linear], steps[1:, :linear])
    angle[~(lines[:-1] & lines[1:])] = 0.0
    corner = _corners(vertices[:, :linear], lines, angle, allowed, corner_angle)
    smooth = crossed & ~corner
    rise = angle * np.minimum(lengths[:-1], lengths[1:]) / 8.0
    gentle = smooth & (rise < RISE * np.minimum(allowed[:-1], allowed[1:]))
    runs = _runs(lines & (lengths > 0.0) & (lengths < LONG * allowed), gentle, lengths)
    curves: list[NurbsCurve] = []
    starts: list[int] = []
    spent: list[float] = []
    fits = 0

    def plain(low: int, high: int) -> None:
        for i in range(low, high):
            starts.append(i)
            spent.append(THIN if merged[i] else 0.0)
            if lines[i]:
                curves.append(NurbsCurve.trusted(1, LINE_KNOTS, both[i]))
            else:
                curves.append(path.curves[int(first[i])])

    if not runs and kept.all():
        return Pieces(path.curves, np.arange(len(lines) + 1), np.zeros(len(lines)), corner, 0)
    both = np.stack([vertices[:-1], vertices[1:]], axis=1)
    both.setflags(write=False)
    last = 0
    for low, high in runs:
        plain(last, low)
        last = high
        for a, b, curve in _fitted(vertices, lengths, allowed, low, high, linear, angular):
            if curve is None:
                plain(a, b)
            else:
                starts.append(a)
                spent.append(FIT + THIN)
                curves.append(curve)
                fits += 1
    plain(last, len(lines))
    index = np.array(starts, dtype=np.int64)
    return Pieces(curves, np.append(first[index], first[-1]), np.array(spent), corner[index[1:] - 1], fits)


def frozen(values: Array) -> Array:
    """A contiguous copy that cannot be written to."""
    out = np.array(values, dtype=np.float64, order="C")
    out.setflags(write=False)
    return out


def _kept(vertices: Array, held: BoolArray, tolerance: Array, linear: int) -> BoolArray:
    """Vertices (n + 1,) that stay when those within THIN tolerances of the last one go; no line loses its length."""
    near = THIN * np.minimum(np.append(tolerance[:1], tolerance), np.append(tolerance, tolerance[-1:]))
    kept = np.ones(len(vertices), dtype=bool)
    kernels.thin(vertices, held, linear, near, kept)
    if not kept.all():
        at = np.flatnonzero(kept)
        for i in np.flatnonzero(np.all(vertices[at[1:], :linear] == vertices[at[:-1], :linear], axis=1)).tolist():
            kept[at[i] : at[i + 1]] = True
    return kept


def _angles(before: Array, behind: Array) -> Array:
    """Angles (n,), rad, between vectors (n, axes); 0 where one has no length."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a = before / np.linalg.norm(before, axis=1, keepdims=True)
        b = behind / np.linalg.norm(behind, axis=1, keepdims=True)
        angle = 2.0 * np.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))
    return np.asarray(np.nan_to_num(angle))


def _corners(vertices: Array, lines: BoolArray, angle: Array, allowed: Array, corner_angle: float) -> BoolArray:
    """Joints (n - 1,) between lines that turn by more than the angle, both between the lines and between arms."""
    sharp = np.flatnonzero(angle > corner_angle)
    corner = np.zeros(len(angle), dtype=bool)
    if not len(sharp):
        return corner
    arms = []
    for way in (-1, 1):
        at = sharp + 1
        tip = at + way
        for k in range(2, ARM_LINES + 1):
            further = at + way * k
            line = np.minimum(further, further - way)  # the line between the last tip and the next one
            inside = (line >= 0) & (line < len(lines))
            inside &= lines[np.clip(line, 0, len(lines) - 1)]
            reached = np.linalg.norm(vertices[tip] - vertices[at], axis=1) >= ARM * allowed[sharp]
            tip = np.where(inside & ~reached & (tip == further - way), further, tip)
        arms.append(way * (vertices[tip] - vertices[at]))
    corner[sharp] = _angles(arms[0], arms[1]) > corner_angle
    return corner


def _runs(short: BoolArray, gentle: BoolArray, lengths: Array) -> list[tuple[int, int]]:
    """First line and line behind the last of every run of at least LEAST and at most MOST lines."""
    runs = []
    for low, high in _stretches(short, gentle):
        for a in range(low, high, MOST):
            own = lengths[a : min(a + MOST, high)]
            even = own <= LONGER * np.median(own)
            runs += [(a + i, a + k) for i, k in _stretches(even, np.ones(len(own) - 1, dtype=bool)) if k - i >= LEAST]
    return runs


def _stretches(chosen: BoolArray, joined: BoolArray) -> list[tuple[int, int]]:
    """First and behind the last of every stretch of two or more `chosen` (n,) with `joined` (n - 1,) between them."""
    together = np.zeros(len(chosen) + 1, dtype=np.int8)
    together[1:-1] = chosen[:-1] & chosen[1:] & joined
    change = np.diff(together)
    return list(zip(np.flatnonzero(change == 1).tolist(), (np.flatnonzero(change == -1) + 1).tolist(), strict=True))


def _fitted(
    vertices: Array, lengths: Array, allowed: Array, low: int, high: int, linear: int, angular: float
) -> list[tuple[int, int, NurbsCurve | None]]:
    """The run low ... high - 1 as splines and, where none is near enough, None, in order."""
    waiting = [(low, high)]
    found: list[tuple[int, int, NurbsCurve | None]] = []
    while waiting:
        a, b = waiting.pop()
        curve, worst = _spline(vertices[a : b + 1], lengths[a:b], float(allowed[a:b].min()), linear, angular)
        if curve is not None or b - a < 2 * LEAST:
            found.append((a, b, curve))
            continue
        cut = min(max(a + worst, a + LEAST), b - LEAST)
        waiting += [(cut, b), (a, cut)]
    return found


def _spline(
    vertices: Array, lengths: Array, allowed: float, linear: int, angular: float
) -> tuple[NurbsCurve | None, int]:
    """The spline near lines between vertices (n + 1, axes), or None and the line at which it is furthest off."""
    counts = np.clip(np.ceil(SAMPLES * lengths / lengths.mean()), SAMPLES, MOST_SAMPLES).astype(np.int64)
    owner = np.repeat(np.arange(len(lengths)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[owner]
    start = np.concatenate([[0.0], np.cumsum(lengths)])
    points = np.vstack([vertices[owner] + share[:, None] * np.diff(vertices, axis=0)[owner], vertices[-1:]])
    s = np.append(start[owner] + share * lengths[owner], start[-1])
    weights = np.append(lengths[owner] / counts[owner], 0.0)
    middle = points[0].copy()
    spans, knots, coefficients, worst = kernels.fit_run(
        s, points - middle, weights, linear, FIT * allowed, FIT * angular
    )
    line = int(owner[min(worst, len(owner) - 1)])
    if not spans:
        return None, line
    slopes = np.diff(coefficients[:, :linear], axis=0)
    if np.any(np.sum(slopes[1:] * slopes[:-1], axis=1) <= 0.0):
        return None, line  # it may turn back, which the lines do not
    coefficients += middle
    coefficients[0], coefficients[-1] = vertices[0], vertices[-1]
    return NurbsCurve.trusted(kernels.DEGREE, frozen(knots), frozen(coefficients)), line

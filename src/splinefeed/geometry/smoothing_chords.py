"""Paths as chords that cut off no more than is said: what proves a smoothed path looks at nothing else."""

from __future__ import annotations

import math

import numpy as np

from splinefeed.geometry.curve import NurbsCurve
from splinefeed.geometry.path import Path
from splinefeed.records import Array, IntArray

#: Steps no longer than this, relative to the coordinates, are rounding.
ROUNDING = 1e-14
#: The share of a short span that its chords may cut off.
FLAT = 1.0 / 64.0
#: Chords of one span at most.
MOST_CHORDS = 100_000
#: Places a span of a rational curve at which its second derivative is sampled, and the factor for values between them.
PLACES, BETWEEN = 17, 1.25


def chords(path: Path, sag: float, scale: Array | None = None) -> tuple[Array, IntArray, Array]:
    """Points (n + 1, axes) of chords, the curve of each chord (n,), and what it cuts off at most (n,).

    That is at most `sag`, and a small share of the span.
    scale  (axes,) what each axis is taken times; only the linear ones, in mm, if it is not given
    """
    scale = np.ones(path.linear) if scale is None else scale
    flat, axes = path.flat, len(scale)
    size = np.diff(flat.point_starts)
    straight = (flat.degrees == 1) & (flat.rational == 0)
    bezier = ~straight & (flat.rational == 0) & (size == flat.degrees + 1)
    low, high = flat.domains.T
    found: list[tuple[IntArray, Array, Array]] = []  # curve, parameter and what the chord up to there cuts off
    for p in np.unique(flat.degrees[bezier]).tolist():
        at = np.flatnonzero(bezier & (flat.degrees == p))
        q = flat.points[flat.point_starts[at][:, None] + np.arange(p + 1), :axes] * scale
        width = high[at] - low[at]
        top = p * (p - 1) * np.linalg.norm(np.diff(q, 2, axis=1), axis=2).max(axis=1) / width**2
        middle = np.einsum("j,njk->nk", [math.comb(p, j) / 2.0**p for j in range(p + 1)], q)
        long = np.linalg.norm(middle - q[:, 0], axis=1) + np.linalg.norm(q[:, -1] - middle, axis=1)
        found.append(_parted(at, low[at], width, top, long, sag))
    for i in np.flatnonzero(~straight & ~bezier).tolist():
        curve = path.curves[i]
        width = np.diff(curve.breaks)
        halves = curve(np.sort(np.append(curve.breaks, curve.breaks[:-1] + 0.5 * width)))[:, :axes] * scale
        long = np.linalg.norm(np.diff(halves, axis=0), axis=1).reshape(-1, 2).sum(axis=1)
        owner = np.full(len(width), i)
        found.append(_parted(owner, curve.breaks[:-1], width, _bends(curve, scale), long, sag))
    lines = np.repeat(straight, size)
    owners = [np.repeat(np.arange(len(flat)), size)[lines], *(each[0] for each in found)]
    points = [flat.points[lines, :axes] * scale]
    points += [path.evaluate(owner, u)[:, 0, :axes] * scale for owner, u, _ in found]
    cuts = [np.zeros(len(points[0])), *(each[2] for each in found)]
    order = np.argsort(np.concatenate(owners), kind="stable")
    line, owner, off = np.concatenate(points)[order], np.concatenate(owners)[order], np.concatenate(cuts)[order]
    # where two curves join there may be a step of a rounding, which is no chord
    least = ROUNDING * float(np.abs(line).max())
    moved = np.append(True, np.any(np.abs(line[1:] - line[:-1]) > least, axis=1))
    return line[moved], owner[moved][1:], off[moved][1:]


def _parted(
    curve: IntArray, low: Array, width: Array, top: Array, long: Array, sag: float
) -> tuple[IntArray, Array, Array]:
    """Curve, parameter and what the chord up to there cuts off, of the ends of the chords of spans (n,), in order.

    low, width  of each span in u; top  its largest |C''|; long  about its length
    """
    with np.errstate(divide="ignore"):
        chord = np.sqrt(8.0 * np.minimum(FLAT * long, sag) / top)
    counts = np.clip(np.ceil(width / np.maximum(chord, width / MOST_CHORDS)), 1, MOST_CHORDS).astype(np.int64)
    opens = np.append(True, curve[1:] != curve[:-1])
    rows = counts + opens
    share = np.arange(rows.sum()) - np.repeat(np.cumsum(rows) - rows - (1 - opens), rows)
    u = np.repeat(low, rows) + share / np.repeat(counts, rows) * np.repeat(width, rows)
    last = share == np.repeat(counts, rows)
    u[last] = np.where(np.append(~opens[1:], False), np.append(low[1:], 0.0), low + width)
    return np.repeat(curve, rows), u, np.where(share > 0, np.repeat(top * (width / counts) ** 2 / 8.0, rows), 0.0)


def _bends(curve: NurbsCurve, scale: Array) -> Array:
    """Largest |C''| of each span (spans,), of the axes taken times `scale`."""
    breaks, axes = curve.breaks, len(scale)
    if curve.rational:
        u = breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, PLACES)
        return np.asarray(BETWEEN * np.linalg.norm(curve.derivatives(u, 2)[..., 2, :axes] * scale, axis=-1).max(axis=1))
    p, knots, q = curve.degree, curve.knots, curve.control_points[:, :axes] * scale
    for _ in range(2):
        width = knots[p + 1 : p + len(q)] - knots[1 : len(q)]
        q = np.divide(p * np.diff(q, axis=0), width[:, None], out=np.zeros((len(q) - 1, axes)),
                      where=width[:, None] > 0.0)  # fmt: skip
        knots, p = knots[1:-1], p - 1
    sizes = np.linalg.norm(q, axis=1)
    spans = np.searchsorted(knots, breaks[:-1], side="right") - 1
    return np.asarray(np.max(sizes[np.clip(spans[:, None] - np.arange(p + 1), 0, len(sizes) - 1)], axis=1))

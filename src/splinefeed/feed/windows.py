"""Long stretches by windows that overlap: each is solved with free ends, and neighbours are faded into each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.feed.audit import CHECKED, LAST_CHECKED, excess
from splinefeed.feed.bounds import deceleration, deceleration_jerk
from splinefeed.feed.cells import Cells, rows_between
from splinefeed.feed.law_pieces import Nodes, Pieces, to_pieces
from splinefeed.feed.square import End, Setting
from splinefeed.feed.window import lower_bound, solve
from splinefeed.geometry.path import Path
from splinefeed.kernels import pieces as rows
from splinefeed.records import Array

#: Arc-length pieces of the path in a window, and in what it shares with each neighbour at least.
WINDOW, OVERLAP = 480, 48
#: The overlap is at least so many times the way from the top feed to rest, and a window so many overlaps.
WAYS, OVERLAPS = 2.0, 6.0
#: Neighbours are faded into each other within this share of the overlap on both sides of its middle.
FADE = 0.25
#: A faded seam over a limit by more than this is none.
SEAM = 1e-3


@dataclass(frozen=True, eq=False)
class Long:
    """Motion over a long stretch, by how much it is over its limits at worst, and the lower bound of its time, s."""

    pieces: Pieces
    over: float
    lower_bound: float


def joints(path: Path, low: float, high: float, setting: Setting) -> tuple[Array, float]:
    """Middles of the overlaps of windows, mm, (k,), none for a short stretch, and half the length of an overlap, mm."""
    first, last, _ = rows_between(path, low, high)
    count = last + 1 - first
    windows = count // WINDOW
    limits, axes = setting.limits, setting.axes
    push = min(limits.acceleration, deceleration(limits), float(np.min(axes.acceleration)))
    twist = min(limits.jerk, deceleration_jerk(limits), float(np.min(axes.jerk)))
    top = min(limits.feed, float(np.min(axes.velocity)))
    if not math.isfinite(top):
        return np.zeros(0), 0.0
    push = min(push, math.sqrt(top * twist))
    way = top * top / push + (top * push / twist if math.isfinite(twist) else 0.0)
    half = max(WAYS * way, OVERLAP / count * (high - low))
    windows = min(windows, int((high - low) / (OVERLAPS * half)))
    if windows < 2:
        return np.zeros(0), half
    inner = first + np.round(np.arange(1, windows) * count / windows).astype(int)
    at: Array = path.table[inner, rows.START].copy()
    # pieces may be of very different length: no window shorter than its overlaps
    kept: list[float] = []
    for s in at:
        if s - (kept[-1] if kept else low) > 3.0 * half and high - s > 3.0 * half:
            kept.append(float(s))
    return np.array(kept), half


def solve_long(path: Path, low: float, high: float, setting: Setting, at: Array, half: float) -> Long | None:
    """Least time from rest to rest by windows whose overlaps have these middles, mm; None where a seam would show.

    Far from its ends a window's solution does not depend on what the feed is there: the limits, met again and again,
    forget it. Two neighbours therefore agree in the middle of what they share, and are mixed there, q and q'
    continuous. Time and memory (but for the law) grow with the number of windows.
    Raises PlanError as `solve`.
    """
    parts: list[Pieces] = []
    over, bound, begin = 1.0, 0.0, low
    for nodes, seam in _chunks(path, low, high, setting, at, half):
        pieces = to_pieces(nodes)
        if np.any(pieces.coarse):
            return None
        seen = excess(nodes, pieces, setting, LAST_CHECKED)
        s = nodes.cells.s
        if np.any(seen[(s[1:] > seam[0]) & (s[:-1] < seam[1])] > 1.0 + SEAM):
            return None
        over = max(over, float(np.max(seen)))
        end = high if nodes.ends[1].rest else float(s[-1])
        feeds = (0.0 if begin == low else None, 0.0 if end == high else None)
        bound += max(lower_bound(path, begin, end, feeds, setting), 0.0)
        begin = end
        parts.append(pieces)
    starts = np.concatenate([[0.0], np.cumsum([part.duration for part in parts])])
    times = [start + part.times[:-1] for start, part in zip(starts[:-1], parts, strict=True)]
    whole = Pieces(
        np.concatenate([*times, starts[-1:]]),
        np.concatenate([part.coefficients for part in parts]),
        np.zeros(0, dtype=bool),
        1,
    )
    return Long(whole, over, bound)


def _chunks(
    path: Path, low: float, high: float, setting: Setting, at: Array, half: float
) -> Iterator[tuple[Nodes, tuple[float, float]]]:
    """Nodes of the motion, one window after the other, and where in them two windows were mixed, mm."""
    kept: Nodes | None = None
    before: _Spline | None = None
    seam = (low, low)
    for k in range(len(at) + 1):
        first: Cells | None = None
        start, end = low, high if k == len(at) else float(at[k]) + half
        if kept is not None:
            cells = kept.cells
            begin = int(np.searchsorted(cells.s, float(at[k - 1]) - half))
            first = Cells(path, cells.curve[begin:], cells.u0[begin:], cells.u1[begin:], cells.s[begin:])
            start = float(first.s[0])
        feeds = (0.0 if k == 0 else None, 0.0 if k == len(at) else None)
        inside = (setting.corner_s > start) & (setting.corner_s < end)
        near = replace(setting, corner_s=setting.corner_s[inside], corner_feed=setting.corner_feed[inside])
        found = solve(path, start, end, feeds, near, first, CHECKED)
        nodes = found.nodes
        if kept is not None and before is not None:
            middle, reach = float(at[k - 1]), FADE * half
            done, nodes = _joined(kept, before, nodes, middle, reach)
            yield done, seam
            seam = (middle - reach, middle + reach)
        kept = nodes
        before = _Spline(found.nodes.cells.s, *found.problem.at(found.coefficients, 0.0))
    assert kept is not None
    yield kept, seam


@dataclass(frozen=True, eq=False)
class _Spline:
    """q of a solution: nodes (n + 1,), and q, q', q'' at the beginning of each cell, (n,)."""

    s: Array
    q: Array
    slope: Array
    second: Array

    def at(self, s: Array) -> tuple[Array, Array]:
        """q and q' at arc lengths s (m,), mm."""
        cell = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.q) - 1)
        x = s - self.s[cell]
        slope = self.slope[cell] + x * self.second[cell]
        return self.q[cell] + 0.5 * x * (self.slope[cell] + slope), slope


def _joined(left: Nodes, before: _Spline, right: Nodes, middle: float, reach: float) -> tuple[Nodes, Nodes]:
    """The left window up to where the fade begins, and the right one from there, into which the left one fades.

    The nodes of the left one are nodes of the right one too, so that both are quadratics between the latter.
    """
    path, a, b = left.cells.path, left.cells, right.cells
    i = int(np.searchsorted(a.s, middle - reach))
    j = int(np.argmin(np.abs(b.s - a.s[i])))
    s = b.s[j:].copy()
    s[0] = a.s[i]
    q, slope = right.q[j:].copy(), right.slope[j:].copy()
    mixed = s < middle + reach
    x = np.clip((s[mixed] - s[0]) / (middle + reach - s[0]), 0.0, 1.0)
    weight = (1.0 - x) ** 3 * (1.0 + 3.0 * x + 6.0 * x * x)
    change = -30.0 * (x * (1.0 - x)) ** 2 / (middle + reach - s[0])
    other, its_slope = before.at(s[mixed])
    slope[mixed] += weight * (its_slope - slope[mixed]) + change * (other - q[mixed])
    q[mixed] += weight * (other - q[mixed])
    q[0], slope[0] = left.q[i], left.slope[i]
    own = Cells(path, a.curve[:i], a.u0[:i], a.u1[:i], a.s[: i + 1])
    rest = Cells(path, b.curve[j:], b.u0[j:], b.u1[j:], s)
    free = End()
    return (
        Nodes(own, left.q[: i + 1], left.slope[: i + 1], (left.ends[0], free), left.low, float(s[0])),
        Nodes(rest, q, slope, (free, right.ends[1]), float(s[0]), right.high),
    )

"""Motion along smooth curves as what LinuxCNC's player takes: quintics of each axis.

A time law s(t) along curves r(s) becomes, between places near each other, the quintics that meet position, velocity
and acceleration of r(s(t)) at both ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import split
from splinefeed.curves.flat import Flat
from splinefeed.curves.packed import Packed
from splinefeed.kinematics.with_joints import Joints
from splinefeed.paths.parts import cut
from splinefeed.paths.path import Path
from splinefeed.records import LAW_COEFFICIENTS, Array, BoolArray, IntArray

#: A piece of a curve takes so long, s, or so much of the path, mm, but never longer than the third, s; one of a line.
LONGEST, LONGEST_WAY, NEVER_LONGER, OF_A_LINE = 0.010, 0.5, 0.020, 5.0
#: In a shorter piece rounding of positions is an acceleration, s; a shorter span of a law is rounding itself, s.
SHORTEST, TINY = 2e-5, 1e-9
#: A curve is cut at a knot that is nearer than this share of its domain.
SAME_KNOT = 1e-9
#: A place this far from the curve that it should lie on, mm, lies on another one.
OFF = 1e-9


@dataclass(frozen=True, eq=False)
class Quintics:
    """Pieces: times (n,), s; coefficients (n, axes, 6), mm and rad; s, feed and acceleration at their ends, (n, 3).

    middle  place on the track in the middle of each, mm
    law     (n, 6), of the motion in each: s from `begin`, t from `behind` (n,), s, before the piece
    straight  (n,) whether it is on a line, for joints too: it can be left where one likes
    """

    span: Array
    c: Array
    ends: Array
    middle: Array
    begin: float
    law: Array
    behind: Array
    straight: BoolArray

    def __len__(self) -> int:
        return len(self.span)

    def state(self, piece: int, t: float) -> tuple[float, float, float]:
        """Place, mm, feed and acceleration at a time in a piece."""
        s, v, a = (float(value(self.law[piece], np.array(self.behind[piece] + t), order)) for order in range(3))
        return self.begin + s, v, a


class PlannedTrack:
    """Smooth paths in a row since motion began at rest: places by length, and the move that each is on.

    first  number of the move that it begins with; joints  that are no axes, beside these in all derivatives
    """

    def __init__(self, first: int, joints: Joints | None = None) -> None:
        self.first = self.pushed = first
        self.joints = joints
        self.parts: list[Path] = []
        self.moves: list[IntArray] = []  # of each part the move that each of its curves begins on
        self.starts: list[float] = []
        self.curves: list[int] = []  # before each part
        self.count, self.length = 0, 0.0
        self._begins: list[float] = []  # of each curve, mm
        self._lines: list[bool] = []  # whether it is a straight line
        self._size: list[float] = []  # of each move that was pushed
        self._marks: list[tuple[float, int]] = []  # where moves begin, and their numbers

    def push(self, sizes: Array) -> None:
        """Note moves before they are smoothed: their lengths (n,), mm."""
        self._size += sizes.tolist()
        self.pushed += len(sizes)

    def add(self, path: Path, origins: IntArray) -> None:
        """Add a smooth path; origins (curves,) of the moves pushed, from 0, as `Smoother.origins` counts."""
        self.parts.append(path)
        self.starts.append(self.length)
        self.curves.append(self.count)
        self.moves.append(origins)
        self._begins += (self.length + path.curve_starts[:-1]).tolist()
        bend = self.joints is not None and self.joints.bend
        self._lines += ((path.flat.degrees == 1) & (np.diff(path.flat.point_starts) == 2) & (not bend)).tolist()
        lengths, begins = np.diff(path.curve_starts), self.length + path.curve_starts[:-1]
        following = np.append(origins[1:], origins[-1] + 1)
        for begin, length, one, other in zip(
            begins.tolist(), lengths.tolist(), origins.tolist(), following.tolist(), strict=True
        ):
            inner = self._size[one : max(other, one + 1)]
            if len(inner) < 2 and other <= one + 1 and one + 1 < len(self._size) and length > 1.5 * inner[0]:
                many = int(np.searchsorted(np.cumsum(self._size[one:]), length * (1.0 - 1e-6))) + 1
                inner = self._size[one : one + many]  # a spline over several, the last curve of a part
            share = length / sum(inner)
            for k, size in enumerate(inner):
                if not self._marks or one + k > self._marks[-1][1]:
                    self._marks.append((begin, one + k))
                begin += share * size
        self.count += len(path.curves)
        self.length += path.length

    def segments(self, s: Array) -> IntArray:
        """The number of the move at each place (n,), mm."""
        places, numbers = np.array(self._marks).T
        at = np.clip(np.searchsorted(places, s + 1e-9, side="right") - 1, 0, None)
        return self.first + np.asarray(numbers[at], dtype=np.int64)

    def straight(self, s: Array) -> BoolArray:
        """Whether each place (n,), mm, lies within a straight line."""
        at = np.clip(np.searchsorted(self._begins, s, side="right") - 1, 0, None)
        return np.array(self._lines)[at]

    def part_at(self, s: float) -> int:
        """Which part a place is on."""
        return max(int(np.searchsorted(self.starts, s, side="right")) - 1, 0)

    def place(self, curve: int, offset: float) -> float:
        """The place of an offset, mm, from the start of a curve, counted from the first of the track."""
        part = int(np.searchsorted(self.curves, curve, side="right")) - 1
        return self.starts[part] + float(self.parts[part].curve_starts[curve - self.curves[part]]) + offset

    def cuts(self, low: float, high: float) -> Array:
        """Starts of curves strictly between two places."""
        found = [
            start + path.curve_starts[:-1]
            for start, path in zip(self.starts, self.parts, strict=True)
            if start < high and start + path.length > low
        ]
        places = np.concatenate([*found, [-1.0]])
        return places[(places > low + 1e-9) & (places < high - 1e-9)]

    def derivatives(self, s: Array, middle: Array) -> Array:
        """r and its derivatives by length (n, 4, axes) at places s (n,), on the curves that `middle` (n,) lie on.

        Joints that are no axes are behind these.
        """
        out = np.empty((len(s), 4, len(self.parts[0].axes)))
        starts = np.array(self.starts)
        part = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, None)
        ends = np.append(starts[1:], self.length)
        outside = (s < starts[part] - OFF) | (s > ends[part] + OFF)  # behind a curve that is shorter than a piece
        middle = np.where(outside, s, middle)
        part = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, None)
        for k in np.unique(part).tolist():
            path, mine = self.parts[k], np.flatnonzero(part == k)
            curve, _ = path.locate(np.clip(middle[mine] - self.starts[k], 0.0, path.length))
            at, u = path.locate(np.clip(s[mine] - self.starts[k], 0.0, path.length))
            low, high = path.flat.domains[curve].T
            begin, end = path.curve_starts[curve], path.curve_starts[curve + 1]
            away = np.maximum(begin - s[mine] + self.starts[k], s[mine] - self.starts[k] - end)
            own = away > OFF
            u = np.where(at > curve, np.where(own, u, high), np.where(at < curve, np.where(own, u, low), u))
            curve = np.where(own, at, curve)
            for left in (False, True):
                some = (u == high) == left
                if some.any():
                    out[mine[some]] = path.by_length(curve[some], u[some], side="left" if left else "right")
        return out if self.joints is None else self.joints.beside(out)


def at_knots(curve: NurbsCurve, places: Array, near: float) -> Array:
    """Places (n,) of a curve, moved to the knot that is nearer than a share of its domain."""
    low, high = curve.domain
    knot = curve.knots[np.argmin(np.abs(curve.knots[:, None] - places), axis=0)]
    return np.where(np.abs(knot - places) < near * (high - low), knot, places)


def portions(path: Path, origins: IntArray, times: Array, most: float) -> list[tuple[Path, IntArray]]:
    """A path in parts that take about so long, s, its long curves in pieces; with the origins of each part's curves.

    origins, times  of each curve (curves,): the move that it begins on, and what it takes, s
    """
    counts = np.maximum(np.ceil(times / most - 1e-9), 1.0).astype(np.int64)
    if np.any(counts > 1):
        flat, done = path.flat, 0
        made: list[Flat] = []
        for i in np.flatnonzero(counts > 1).tolist():
            made += [flat.part(done, i)] if i > done else []
            curve = path.joined[i]
            low, high = curve.domain
            places = at_knots(curve, np.linspace(low, high, counts[i] + 1)[1:-1], SAME_KNOT)
            made.append(Flat.of(split(curve, *places.tolist())))
            done = i + 1
        made += [flat.part(done, len(flat))] if done < len(flat) else []
        starts = np.concatenate([[0], np.cumsum(counts)]).tolist()
        markers = [replace(marker, before=starts[marker.before]) for marker in path.markers]
        path = Path(Packed(Flat.joined(made)), path.axes, markers=markers, tolerance=path.tolerance)
        origins, times = np.repeat(origins, counts), np.repeat(times / counts, counts)
    number = np.floor((np.cumsum(times) - 0.5 * times) / most)
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(times)]
    if len(edges) == 2:
        return [(path, origins)]
    return [(cut(path, low, high), origins[low:high]) for low, high in pairwise(edges)]


def value(c: Array, t: Array, order: int) -> Array:
    """A derivative of polynomials (n, ..., 6) at t (n,) or as wide."""
    out = np.zeros(np.broadcast_shapes(c.shape[:-1], t.shape))
    for k in range(LAW_COEFFICIENTS - 1, order - 1, -1):
        out = out * t + c[..., k] * math.perm(k, order)
    return out


def _apart(edges: Array) -> Array:
    """Of times in order the first, the last, and those that are later than the one before by more than SHORTEST."""
    kept, last = [float(edges[0])], float(edges[-1])
    for edge in edges[1:-1].tolist():
        if edge - kept[-1] > SHORTEST and last - edge > SHORTEST:
            kept.append(edge)
    return np.array([*kept, last])


def quintics(track: PlannedTrack, begin: float, spans: Array, c: Array) -> Quintics:
    """Pieces of every axis for a motion s(t): spans (m,), s, coefficients (m, 6); s from `begin` on the track."""
    good = spans > TINY
    spans, c = spans[good], c[good]
    stop = begin + value(c, spans, 0)
    rows, wanted = [], []
    for k, (low, high) in enumerate(zip((begin + c[:, 0]).tolist(), stop.tolist(), strict=True)):
        places = track.cuts(low, high).tolist()
        rows += [k] * len(places)
        wanted += places
    a, b = np.zeros(len(rows)), spans[rows]
    for _ in range(48 if len(rows) else 0):  # when the motion passes from curve to curve
        middle = 0.5 * (a + b)
        before = begin + value(c[rows], middle, 0) < np.array(wanted)
        a, b = np.where(before, middle, a), np.where(before, b, middle)
    starts = np.concatenate([[0.0], np.cumsum(spans)])
    cuts = np.sort(starts[rows] + b)
    cuts = cuts[(cuts > SHORTEST) & (cuts < starts[-1] - SHORTEST)]
    cuts = cuts[np.append(True, np.diff(cuts) > SHORTEST)[: len(cuts)]]
    around = np.concatenate([[-1.0], cuts, [starts[-1] + 1.0]])
    next_one = np.searchsorted(around, starts)  # a break of the law next to one of the path is that one
    free = np.minimum(starts - around[next_one - 1], around[next_one] - starts) > SHORTEST
    free[[0, -1]] = True
    edges = np.sort(np.concatenate([starts[free], cuts]))
    edges = _apart(edges)
    low, high = edges[:-1], edges[1:]
    row = np.clip(np.searchsorted(starts, 0.5 * (low + high), side="right") - 1, 0, len(spans) - 1)
    way = np.abs(value(c[row], high - starts[row], 0) - value(c[row], low - starts[row], 0))
    parts = np.maximum(np.minimum((high - low) / LONGEST, way / LONGEST_WAY), (high - low) / NEVER_LONGER)
    centre = begin + value(c[row], 0.5 * (low + high) - starts[row], 0)
    parts = np.where(track.straight(centre), (high - low) / OF_A_LINE, parts)  # there a quintic is the law itself
    n = np.maximum(np.ceil(parts - 1e-9), 1.0).astype(int)
    at = np.repeat(np.arange(len(n)), n)
    share = np.arange(len(at)) - np.repeat(np.cumsum(n) - n, n)
    step = ((high - low) / n)[at]
    t0, t1 = low[at] + share * step, np.where(share + 1 == n[at], high[at], low[at] + (share + 1) * step)
    row = np.clip(np.searchsorted(starts, 0.5 * (t0 + t1), side="right") - 1, 0, len(spans) - 1)
    law, origin = c[row], starts[row]
    h = (t1 - t0)[:, None]
    t0, t1 = t0 - origin, t1 - origin
    middle = begin + value(law, 0.5 * (t0 + t1), 0)
    ends, states = [], []
    for t in (t0 + origin, t1 + origin):  # on spans of their own: a piece may cover some that are too short for one
        own = np.clip(np.searchsorted(starts, t, side="right") - 1, 0, len(spans) - 1)
        s, v, a = (value(c[own], t - starts[own], k) for k in range(3))
        d = track.derivatives(begin + s, middle)
        states.append(np.stack([begin + s, v, a], axis=1))
        v, a = v[:, None], a[:, None]
        ends.append((d[:, 0], d[:, 1] * v, d[:, 2] * v * v + d[:, 1] * a))
    (p0, v0, a0), (p1, v1, a1) = ends
    dp, dv, da = p1 - p0 - h * (v0 + 0.5 * h * a0), h * (v1 - v0 - h * a0), h * h * (a1 - a0)
    terms = [
        p0, v0, 0.5 * a0, (10.0 * dp - 4.0 * dv + 0.5 * da) / h**3, (-15.0 * dp + 7.0 * dv - da) / h**4,
        (6.0 * dp - 3.0 * dv + 0.5 * da) / h**5,
    ]  # fmt: skip
    return Quintics(
        h[:, 0], np.stack(terms, axis=2), states[1], middle, begin, law, t0, np.asarray(track.straight(middle))
    )

"""Motion along smooth curves as what LinuxCNC's player takes: quintics of each axis.

A time law s(t) along curves r(s) becomes, between places near each other, the quintics that meet position, velocity
and acceleration of r(s(t)) at both ends.
"""

from __future__ import annotations

import math
from bisect import bisect_right
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
from splinefeed.planner.timed import times_at
from splinefeed.records import Array, BoolArray, IntArray, TimeLaw

#: A piece of a curve takes so long, s, or so much of the path, mm, but never longer than the third, s; one of a line.
LONGEST, LONGEST_WAY, NEVER_LONGER, OF_A_LINE = 0.010, 0.5, 0.020, 5.0
#: In a shorter piece rounding of positions is an acceleration, s.
SHORTEST = 2e-5
#: A curve is cut at a knot that is nearer than this share of its domain.
SAME_KNOT = 1e-9
#: A piece lies on the curve that it has so far inside of its ends, mm.
INSIDE = 1e-9


@dataclass(frozen=True, eq=False)
class Quintics:
    """Pieces of a motion, a quintic of each axis.

    Parameters
    ----------
    span : array (n,)
        How long each takes, s.
    c : array (n, axes, 6)
        Coefficients, mm and rad.
    middle : array (n,)
        Place on the track in the middle of each, mm.
    begin : float
        Place where the law of the motion begins, mm.
    law : TimeLaw
        Of the motion.
    since : array (n,)
        When each begins, s.
    straight : array (n,)
        Whether it is on a line, for joints too: it can be left where one likes.
    """

    span: Array
    c: Array
    middle: Array
    begin: float
    law: TimeLaw
    since: Array
    straight: BoolArray

    def __len__(self) -> int:
        return len(self.span)

    def state(self, piece: int, t: float) -> tuple[float, float, float]:
        """Place, mm, feed and acceleration at a time in a piece."""
        law, time = self.law, self.since[piece] + t
        return self.begin + float(law(time)), float(law.feed(time)), float(law.acceleration(time))

    @property
    def end(self) -> tuple[float, float, float]:
        """The same at the end of the last one."""
        law, time = self.law, self.law.duration
        return self.begin + law.length, float(law.feed(time)), float(law.acceleration(time))


class PlannedTrack:
    """Smooth paths in a row since motion began at rest: places by length, and the move that each is on.

    Parameters
    ----------
    first : int
        Number of the move that it begins with.
    joints : Joints, optional
        That are no axes; they stand beside these in all derivatives.
    """

    def __init__(self, first: int, joints: Joints | None = None) -> None:
        self.first = first
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
        places = np.array(self._begins)
        return places[(places > low + INSIDE) & (places < high - INSIDE)]

    def derivatives(self, s: Array, middle: Array) -> Array:
        """Compute places on the track and their derivatives by length.

        Parameters
        ----------
        s : array (n,)
            Places, mm.
        middle : array (n,)
            Places on the side that counts where curves meet, mm.

        Returns
        -------
        array (n, 4, axes + joints)
            r, r', r'' and r'''; joints that are no axes are behind these.
        """
        out = np.empty((len(s), 4, len(self.parts[0].axes)))
        inside = s + np.clip(middle - s, -INSIDE, INSIDE)
        part = np.maximum(np.searchsorted(self.starts, inside, side="right") - 1, 0)
        for k in np.unique(part).tolist():
            path, start, mine = self.parts[k], self.starts[k], part == k
            row = np.maximum(np.searchsorted(path.pieces, inside[mine] - start, side="right") - 1, 0)
            out[mine] = path.derivatives(s[mine] - start, row)
        return out if self.joints is None else self.joints.beside(out)


def at_knots(curve: NurbsCurve, places: Array, near: float) -> Array:
    """Places (n,) of a curve, moved to the knot that is nearer than a share of its domain."""
    low, high = curve.domain
    knot = curve.knots[np.argmin(np.abs(curve.knots[:, None] - places), axis=0)]
    return np.where(np.abs(knot - places) < near * (high - low), knot, places)


def portions(path: Path, origins: IntArray, times: Array, most: float) -> list[tuple[Path, IntArray]]:
    """Cut a path into parts that take about so long, its long curves in pieces.

    Parameters
    ----------
    path : Path
        To be cut.
    origins : array (curves,)
        The move that each curve begins on.
    times : array (curves,)
        What each takes, s.
    most : float
        What a part takes, s.

    Returns
    -------
    list of tuple
        Each part, with the origins of its curves.
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


def _apart(end: float, cuts: Array, breaks: Array) -> Array:
    """0, `end`, and of times in between, s, the cuts and breaks that are SHORTEST from those that came before."""
    kept = [0.0, end, math.inf]
    for time in (*cuts.tolist(), *breaks.tolist()):
        at = bisect_right(kept, time)
        if min(time - kept[at - 1], kept[at] - time) > SHORTEST:
            kept.insert(at, time)
    return np.array(kept[:-1])


def quintics(track: PlannedTrack, begin: float, law: TimeLaw) -> Quintics:
    """Make pieces of every axis for a motion.

    Parameters
    ----------
    track : PlannedTrack
        The paths.
    begin : float
        Place on the track from which the law's s is counted, mm.
    law : TimeLaw
        Of the motion.

    Returns
    -------
    Quintics
        That meet position, velocity and acceleration at both ends of each piece.
    """
    cuts = times_at(law, track.cuts(begin, begin + law.length) - begin)
    edges = _apart(law.duration, cuts, law.breaks[1:-1])
    low, span = edges[:-1], np.diff(edges)
    parts = np.maximum(np.minimum(span / LONGEST, np.diff(law(edges)) / LONGEST_WAY), span / NEVER_LONGER)
    straight = track.straight(begin + law(low + 0.5 * span))
    parts = np.where(straight, span / OF_A_LINE, parts)  # there a quintic is the law itself
    n = np.maximum(np.ceil(parts - 1e-9), 1.0).astype(int)
    share = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)
    t = np.append(np.repeat(low, n) + share * np.repeat(span / n, n), law.duration)
    t0, h = t[:-1], np.diff(t)[:, None]
    middle = begin + law(t0 + 0.5 * h[:, 0])
    ends = []
    for at in (t0, t[1:]):
        d, v, a = track.derivatives(begin + law(at), middle), law.feed(at)[:, None], law.acceleration(at)[:, None]
        ends.append((d[:, 0], d[:, 1] * v, d[:, 2] * v * v + d[:, 1] * a))
    (p0, v0, a0), (p1, v1, a1) = ends
    dp, dv, da = p1 - p0 - h * (v0 + 0.5 * h * a0), h * (v1 - v0 - h * a0), h * h * (a1 - a0)
    terms = [
        p0, v0, 0.5 * a0, (10.0 * dp - 4.0 * dv + 0.5 * da) / h**3, (-15.0 * dp + 7.0 * dv - da) / h**4,
        (6.0 * dp - 3.0 * dv + 0.5 * da) / h**5,
    ]  # fmt: skip
    return Quintics(h[:, 0], np.stack(terms, axis=2), middle, begin, law, t0, np.repeat(straight, n))

"""The place along the path of setpoints, also where only their positions are known."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Self

import numpy as np

from splinefeed.checks.nearest import NearestOnPath
from splinefeed.checks.spans import EPSILON, PathSpans, SpanPlaces, spans_of
from splinefeed.curves.search import Found
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray, Setpoints

#: A closed path's end counts as its start for a first setpoint within this, relative to the length of the path.
AT_SEAM = 1e-6
#: A step along the path this many times as long as its chord may have taken a turn back over the path.
LONGER = 1.05
#: Places that are as near as each other but for so many roundings of arc length are alike.
ROUNDINGS = 64.0
#: Positions that are placed by their chords from one known place on, at first and at most, as long as none is further
#: from where that predicts it than so many steps.
FIRST_AHEAD, MOST_AHEAD, DRIFT = 32, 4096, 32.0
#: A position that is off the path near the place predicted is looked for within so many of the longest steps.
WIDE = 4.0


@dataclass(frozen=True, eq=False)
class Located:
    """Setpoints on their path, n of them, in this order of time; NaN where a position is not finite.

    Parameters
    ----------
    row : (n,) array of int
        Span of the path.
    u : (n,) array
        The parameter on it.
    s, ahead : (n,) array
        Arc length, and that from the start of the span, mm.
    apart : (n,) array
        Distance from the path's point there over the linear axes, mm.
    turned : (n,) array
        Largest deviation of a rotary axis there, rad.
    astray : (n,) array
        Distance from the point that curve and u name, mm; 0 if that is right, or if they name none.
    speed : (n,) array
        |C'(u)|, mm a unit of u.
    velocity : (axes, n) array
        C'(u).
    position : (axes, n) array
        As it was given.
    """

    row: IntArray
    u: Array
    s: Array
    ahead: Array
    apart: Array
    turned: Array
    astray: Array
    speed: Array
    velocity: Array
    position: Array

    def part(self, low: int, high: int) -> Self:
        """Those from `low` to the one before `high`."""
        return type(self)(*(getattr(self, each.name)[..., low:high] for each in fields(self)))

    def joined(self, other: Self) -> Self:
        """These, and the others behind them."""
        names = [each.name for each in fields(self)]
        return type(self)(*(np.concatenate([getattr(self, n), getattr(other, n)], axis=-1) for n in names))


class Placer:
    """Find setpoints on the path, one block after the other.

    Parameters
    ----------
    path : Path
        The path.
    rows : PathSpans, optional
        Its spans, if they are made.

    Notes
    -----
    A setpoint whose curve and u name the point where it is, is there. Others are placed by their positions alone, each
    near where the ones before it predict, for a path may cross itself or run straight back over itself.
    """

    def __init__(self, path: Path, rows: PathSpans | None = None) -> None:
        self.path, self.rows = path, rows or spans_of(path)
        #: Whether places are searched by all axes, mm and rad alike: the linear ones say little where they stand still.
        self._by_all = path.linear < len(path.axes)
        self._s: float | None = None  # arc length of the last setpoint, and its position: at first that of the path
        self._q = SpanPlaces(self.rows, np.zeros(1, dtype=np.int64)).derivatives(np.array([-1.0]), 0)[0][:, 0]
        self._ahead = FIRST_AHEAD
        #: Largest distance so far of a setpoint without arc length from the path, mm; see `place`.
        self.apart = 0.0

    @cached_property
    def search(self) -> NearestOnPath:
        """Nearest points of the path."""
        return NearestOnPath(self.rows, units=np.ones(len(self.path.axes)) if self._by_all else None)

    def locate(self, setpoints: Setpoints, allowed: float) -> Located:
        """Where each setpoint is: where its curve and u say, if it is within `allowed`, mm and rad, of that."""
        rows = self.rows
        position: Array = np.ascontiguousarray(setpoints.position.T)
        position = np.where(np.isfinite(position), position, np.nan)
        finite = np.all(np.isfinite(position), axis=0)
        named = finite & np.isfinite(setpoints.u) & (setpoints.curve >= 0) & (setpoints.curve < len(rows.curves))
        row, u = rows.find(np.where(named, setpoints.curve, 0), np.where(named, setpoints.u, 0.0))
        place = self._at(row, u, position)
        off = named & ~((place.apart <= allowed) & (place.turned <= allowed))
        astray, index = np.where(off, place.apart, 0.0), np.flatnonzero(finite & (off | ~named))
        if len(index):
            if named.any():
                hint = np.interp(index, np.flatnonzero(named), place.s[named])
                found = self.search.near(self.counted(position[:, index]), hint)
            else:
                found = self.follow(position[:, index], allowed)
            row[index], u[index] = found.row, self.parameter(found)
            place = self._at(row, u, position)
            wrong = index[
                ~((place.apart[index] <= allowed) & (place.turned[index] <= allowed) | rows.still[row[index]])
            ]
            if 0 < rows.linear < rows.axes and len(wrong):
                # the place of the linear ones says by how much rotary axes are off
                found = NearestOnPath(rows).near(position[: rows.linear, wrong], place.s[wrong])
                row[wrong], u[wrong] = found.row, self.parameter(found)
                place = self._at(row, u, position)
        known = np.flatnonzero(finite)
        if len(known):
            self._s, self._q = float(place.s[known[-1]]), position[:, known[-1]]
        for each in (place.u, place.s, place.ahead, place.apart, place.turned, place.speed, place.velocity):
            each[..., ~finite] = np.nan
        return replace(place, astray=astray)

    def _at(self, row: IntArray, u: Array, position: Array) -> Located:
        """Positions (axes, n) at u (n,) of rows (n,)."""
        linear = self.rows.linear
        places = SpanPlaces(self.rows, row)
        t = places.t(u)
        at, velocity = places.derivatives(t, 1)
        with np.errstate(invalid="ignore", over="ignore"):
            off = position - at
            apart = np.sqrt(np.sum(off[:linear] ** 2, axis=0))
            turned = np.max(np.abs(off[linear:]), axis=0, initial=0.0)
        speed = np.sqrt(places.product(velocity, velocity))
        ahead = self.rows.ahead(row, t)
        return Located(row, u, self.rows.start[row] + ahead, ahead, apart, turned, turned, speed, velocity, position)

    def counted(self, position: Array) -> Array:
        """Positions (axes, n) of the axes that `search` counts, (dims, n)."""
        return position[: self.search.dims]

    def parameter(self, found: Found) -> Array:
        """u (n,) of what was found."""
        rows, row = self.rows, found.row
        u = rows.middle[row] + found.t / rows.scale[row]
        return np.asarray(np.clip(u, rows.low[row], rows.high[row]))

    def go_on(self, other: Placer, gone: float) -> None:
        """Follow on where another one is, along a path that lacks the first `gone` mm of that one's."""
        self._s, self._q = None if other._s is None else other._s - gone, other._q

    def follow(self, position: Array, allowed: float) -> Found:
        """Places of positions (axes, n), none of them named, behind the last one."""
        q, count = self.counted(position), position.shape[1]
        out = Found(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count))
        last, apart = self._s or 0.0, 0.0
        every = np.column_stack([self._q, position]) * self.path.weights[:, None]
        ways = np.linalg.norm(np.diff(every[: len(q)], axis=1), axis=0)
        slack = max(allowed, ROUNDINGS * EPSILON * self.rows.length)
        begin = 0
        while begin < count:
            index = np.arange(begin, min(begin + self._ahead, count))
            here, way = q[:, index], ways[index]
            hint = np.minimum(last + np.cumsum(way), self.rows.length)
            found = self.search.near(here, hint)
            # around a bend sharper than a step, the place on the path may lie beyond the window
            stray = np.flatnonzero(np.sqrt(found.square) > slack)
            if allowed > 0.0 and len(stray):
                wide = self.search.near(here[:, stray], hint[stray], WIDE * float(np.max(way)))
                on = np.flatnonzero(np.sqrt(wide.square) <= slack)
                found.put(stray[on], wide.take(on))
            s = self.rows.arc_length(found.row, found.t)
            done = self._onward(here, way, slack, last, apart, found, s)
            drifted = np.abs(s - hint) > DRIFT * np.maximum.accumulate(way) + slack
            if drifted[:done].any():
                done = max(int(np.argmax(drifted)), 1)
            self._ahead = min(2 * self._ahead, MOST_AHEAD) if done == len(index) else FIRST_AHEAD
            out.put(index[:done], found.take(np.arange(done)))
            last = float(s[done - 1])
            apart = float(np.sqrt(found.square[done - 1]))
            begin += done
        self._s, self._q = last, position[:, -1]
        return out

    def place(self, setpoints: Setpoints) -> Array:
        """Commanded arc length (n,), mm: what setpoints say, or the nearest point next to where the last ones went.

        The first setpoint is placed on the whole path, each one after it near the place that the one before it
        predicts, so that a path that crosses itself or turns back is followed in order. They have the linear axes of
        the path; rotary axes that they lack are 0.
        """
        if np.isfinite(setpoints.s).all():
            return np.clip(self.path.lengths_of(setpoints), 0.0, self.rows.length)
        known = dict(zip(setpoints.axes, setpoints.position.T, strict=True))
        position = np.stack([known.get(axis, np.zeros(len(setpoints))) for axis in self.path.axes])
        if self._s is None:
            self._by_all = known.keys() >= set(self.path.axes) and self._by_all
            found = self.search.whole(self.counted(position[:, :1]))
            self._s, self._q = float(self.rows.arc_length(found.row, found.t)[0]), position[:, 0]
            if self.path.closed and self._s >= (1.0 - AT_SEAM) * self.rows.length:
                self._s = 0.0
        found = self.follow(position, 0.0)
        at = self._at(found.row, self.parameter(found), position)
        self.apart = max(self.apart, float(np.max(at.apart if self.path.linear else at.turned, initial=0.0)))
        return np.clip(at.s, 0.0, self.rows.length)

    def _onward(self, q: Array, way: Array, slack: float, last: float, apart: float, found: Found, s: Array) -> int:
        """How many of the places found are right, or made so: the first that had to be moved is the last of them.

        Where a path runs back over itself a position has two places. The tool goes on: from a place behind it to the
        one as far ahead, and not to one that is further along the path than the `way` (n,) from position to position
        lets expect, if there is one before it. Where there is only one place, that stays.
        """
        distance = np.sqrt(found.square)
        before = np.concatenate([[last], s[:-1]])
        step = s - before
        loose = slack + distance + np.concatenate([[apart], distance[:-1]])
        doubtful = np.flatnonzero((step < -loose) | (step > LONGER * way + loose))
        if not len(doubtful):
            return len(s)
        step, before, near = step[doubtful], before[doubtful], distance[doubtful] + slack
        side = np.array([[0.0], [1.0]])  # the first place ahead, and from a place behind the last one that as far ahead
        hint = np.minimum(before + side * np.abs(step), self.rows.length)
        other = self.search.near(np.tile(q[:, doubtful], 2), hint.ravel())
        at = self.rows.arc_length(other.row, other.t).reshape(hint.shape) - before
        moved = (np.sqrt(other.square).reshape(hint.shape) <= near) & (np.abs(at - step) > 2.0 * slack)
        moved &= (at >= 0.0) & (at <= LONGER * np.abs(step) + slack) & ((side == 0.0) | (step < 0.0))
        if not moved.any():
            return len(s)
        k = int(np.argmax(moved.any(axis=0)))
        first, which = int(doubtful[k]), int(np.argmax(moved[:, k]))
        found.put(np.array([first]), other.take(np.array([which * len(doubtful) + k])))
        s[first] = at[which, k] + before[k]
        return first + 1

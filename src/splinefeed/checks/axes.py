"""What the check adds where axes do not carry the tip: a track says by itself where they are along the tip's path.

The tip's path is evaluated by its control points and weights, as of any path. Positions of the axes are the track's,
those of joints held against the tip by the forward kinematics; their derivatives come from these positions alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.polynomial import chebyshev

from splinefeed.checks.place import Placer
from splinefeed.checks.spans import EPSILON, PathSpans
from splinefeed.errors import InputError, LimitsError
from splinefeed.paths.track import Track
from splinefeed.records import Array, IntArray, Limits, Setpoints

#: Roundings of a position: those of the formulas of kinematics; and by how many a setpoint may miss its place.
ROUNDINGS, OFF = 8.0, 64.0
#: An axis' dx/ds counts where a step is longer than this share of the longest one: below is rounding.
MOVING = 0.01
#: Stretches between breaks on which derivatives of a track are compared, at most, and the places of each.
COMPARED, PLACES = 256, np.array([0.1, 0.3, 0.5, 0.7, 0.9])
#: Terms of a series of axes on a cell, at its Chebyshev nodes; the last ones, that tell its rounding; most halvings.
TERMS, TAIL, HALVINGS = 16, 3, 30
NODES = chebyshev.chebpts1(TERMS)
TO_SERIES = np.linalg.inv(chebyshev.chebvander(NODES, TERMS - 1))
#: Largest |T_n^(k)|, that at 1, for k = 0 to 3.
STEEPEST = np.array([chebyshev.chebval(1.0, chebyshev.chebder(np.eye(TERMS), k)) for k in range(4)])
#: Terms behind the last one above the tail that may be hidden in it.
HIDDEN = 2
#: Halving goes on while it makes last terms smaller by this factor, or they are more than this share of positions; to
#: cells of this share of the track at least.
GAIN, PLATEAU, LEAST, TINY = 0.5, 1e-10, 1e-9, 1e-300
#: Of more cells, or two a stretch, none is halved further: what their last terms are is their floor.
MOST = 20_000
#: A derivative of a track that is further off than this share of the largest one there is wrong.
WRONG = 1e-5
#: A track and the path of its tip are as long as each other but for this share.
SAME_LENGTH = 1e-9
#: Stretches of a track that are no longer than a few times this share of it are not compared.
INSIDE = 1e-9


def check_whole(track: Track, limits: Limits) -> None:
    """Raise LimitsError for what is not checked of such axes, InputError where track and tip differ in length."""
    if limits.axis_velocity_step is not None:
        raise LimitsError(f"axis_velocity_step: {track.name} has axes that do not carry the tip; leave it out")
    tip = track.tip_path
    if abs(track.length - tip.length) > SAME_LENGTH * tip.length:
        raise InputError(
            f"{track.name} is {track.length:.9g} mm long and its tip_path {tip.length:.9g} mm; they must be the same"
        )


class AxesCheck:
    """Axes of a track on the path of its tip, and the largest errors so far: of the chord, mm, of a tool axis, rad."""

    #: The fault of a setpoint whose axes are elsewhere.
    fault = "off the track"

    def __init__(self, track: Track, rows: PathSpans, placer: Placer) -> None:
        self.track, self._rows, self._placer = track, rows, placer
        self.chord_error = self.off_axis = self.turned = 0.0
        self._size, self._steep = np.zeros((2, len(track.axes)))
        self._longest = 0.0

    def tip(self, setpoints: Setpoints) -> tuple[Setpoints, Array]:
        """Setpoints of the tip, where their u is on its path, and how far axes are off the track, mm or rad (n,)."""
        rows, tip = self._rows, self.track.tip_path
        known = np.all(np.isfinite(setpoints.position), axis=1) & np.isfinite(setpoints.u)
        where = np.clip(setpoints.curve, 0, len(rows.curves) - 1), np.nan_to_num(setpoints.u)
        row, ahead = rows.place(*where)
        s = np.clip(rows.start[row] + ahead, 0.0, self.track.length)
        position = np.where(known[:, None], rows.points(*where).T, np.nan)
        steep = np.abs(self.track.derivatives(s)[:, 1, : len(self.track.axes)])
        rounding = OFF * EPSILON * (np.abs(setpoints.position) + steep * rows.length)
        off = np.max(np.abs(setpoints.position - self.track(s)) - rounding, axis=1)
        return replace(setpoints, position=position, axes=tip.axes), np.where(known, np.maximum(off, 0.0), np.nan)

    def rounding(self, values: Array, travelled: Array) -> Array:
        """How far rounding alone can move axes (axes, n + 1), mm or rad; travelled (n,), mm, between them."""
        way = np.abs(travelled)
        self._longest = max(self._longest, float(np.fmax.reduce(way, initial=0.0)))
        moving = way > MOVING * self._longest
        slope = np.abs(np.diff(values, axis=1))[:, moving] / way[moving]
        self._steep = np.fmax(self._steep, np.fmax.reduce(slope, axis=1, initial=0.0))
        self._size = np.fmax(self._size, np.fmax.reduce(np.abs(values), axis=1, initial=0.0))
        each = ROUNDINGS * EPSILON * (self._size + self._steep * self._rows.length)
        return np.repeat(each[:, None], values.shape[1], axis=1)

    def chords(self, values: Array, s: Array) -> tuple[tuple[Array, float], tuple[Array, float]]:
        """How far tip, mm, and tool axis, rad, are off (n,) while axes (axes, n + 1) move straight; and roundings.

        s (n + 1,) is where the setpoints are, mm.
        """
        off = self._between(values, s)
        self.chord_error, self.turned = np.maximum(
            [self.chord_error, self.turned], np.max(off, axis=1, initial=0.0)
        ).tolist()
        size = max(float(np.max(self._size)), self._rows.length)
        return (off[0], ROUNDINGS * EPSILON * size), (off[1], ROUNDINGS * EPSILON)

    def _between(self, values: Array, s: Array) -> Array:
        """The errors of `chords`, (2, n): the track says them."""
        off = np.zeros((2, values.shape[1] - 1))
        known = np.flatnonzero(np.all(np.isfinite(values), axis=0) & np.isfinite(s))
        if len(known) > 1:
            step, *found = self.track.chords(s[known], values[:, known].T, self.track.breaks)
            for worst, each in zip(off, found, strict=True):
                if each is not None:
                    np.maximum.at(worst, known[step], each)
        return off


class AxesByPlace:
    """Axes of a track by length, from its positions alone: Chebyshev series on cells between places where it may jump.

    Parameters
    ----------
    track : Track
        Whose positions they are: smooth between its ends and breaks; nothing is looked at on the other side of one.

    Notes
    -----
    A cell is halved until the last terms of its series are rounding, or get no smaller. What is left of them, and at
    least 8 eps (X + |dx/ds| L), is the rounding of positions, and what differentiation makes of it the floor of each
    derivative,

        tail sum_n max|T_n^(k)| / h^k      T_n', T_n'', T_n''' <= n^2, n^2 (n^2 - 1) / 3, n^2 (n^2 - 1) (n^2 - 4) / 15

    over the terms above the tail, for half a cell's length h.
    """

    def __init__(self, track: Track) -> None:
        ends = np.concatenate([[0.0], track.breaks, [track.length]])
        low, high = ends[:-1], ends[1:]
        before, size = np.full(len(low), np.inf), np.zeros(len(track.axes))
        done: list[tuple[Array, ...]] = []
        most = max(MOST, 2 * len(low))
        for depth in range(HALVINGS + 1):
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            values = track((middle[:, None] + half[:, None] * NODES).ravel()).reshape(len(low), TERMS, -1)
            series = np.moveaxis(np.einsum("kn,cna->kca", TO_SERIES, values), 0, 1)
            size = np.maximum(size, np.max(np.abs(values), axis=(0, 1)))
            steep = np.max(np.abs(np.diff(values, axis=1)) / np.diff(NODES)[:, None], axis=1) / half[:, None]
            # of the numbers that a position is made of, and of its length along the track
            rounding = ROUNDINGS * EPSILON * (size + steep * track.length)
            tail = np.max(np.abs(series[:, -TAIL:]), axis=1)
            worst = np.max(tail / np.maximum(rounding, TINY), axis=1, initial=0.0)
            stays = (worst > GAIN * before) & np.all(tail <= PLATEAU * np.maximum(size, TINY), axis=1)
            ready = (worst <= 1.0) | stays | (depth == HALVINGS) | (half < LEAST * track.length) | (len(low) > most)
            done.append((low[ready], high[ready], series[ready], np.maximum(tail, rounding)[ready]))
            low, middle, high, worst = (each[~ready] for each in (low, middle, high, worst))
            if not len(low):
                break
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
            before = np.concatenate([worst, worst])
        low, high, series, tail = (np.concatenate(each) for each in zip(*done, strict=True))
        along = np.argsort(low, kind="stable")
        self.ends, self.low, half = ends, low[along], 0.5 * (high - low)[along]
        series, tail = series[along], tail[along]
        #: The first cell of each stretch between ends.
        self.first = np.searchsorted(self.low, ends[:-1])
        self.middle, self.half = self.low + half, half
        counts = np.cumsum((np.abs(series) > tail[:, None])[:, ::-1], axis=1)[:, ::-1] > 0
        #: Series of the axes and their derivatives, (terms, cells, axes) each, and the floor of each, (4, cells, axes).
        kept = np.moveaxis(np.where(counts, series, 0.0), 1, 0)[:-TAIL]
        self.series = [chebyshev.chebder(kept, k) / half[:, None] ** k for k in range(4)]
        counts |= np.arange(TERMS)[:, None] < HIDDEN + np.maximum(np.sum(counts, axis=1, keepdims=True), 2)
        self.floor = tail * np.einsum("kn,cna->kca", STEEPEST, counts) / half[:, None] ** np.arange(4)[:, None, None]

    def stretch(self, s: Array) -> IntArray:
        """The stretch between ends, (n,), that places s (n,), mm, lie on; at an end the one behind."""
        return np.asarray(np.clip(np.searchsorted(self.ends, s, side="right") - 1, 0, len(self.first) - 1))

    def at(self, s: Array, stretch: IntArray) -> tuple[Array, Array]:
        """Compute the axes and their derivatives by length.

        Parameters
        ----------
        s : (n,) array
            Places, mm.
        stretch : (n,) array of int
            Stretch k is that from `ends[k]` to the next; at an end it names the side.

        Returns
        -------
        values, floor : (4, n, axes) array
            The axes and three derivatives, and the floor of each.
        """
        last = np.append(self.first[1:], len(self.low)) - 1
        cell = np.clip(np.searchsorted(self.low, s, side="right") - 1, self.first[stretch], last[stretch])
        x = np.clip((s - self.middle[cell]) / self.half[cell], -1.0, 1.0)
        found = [chebyshev.chebval(x[:, None], each[:, cell], tensor=False) for each in self.series]
        return np.array(found), self.floor[:, cell]

    def apart(self, track: Track) -> tuple[float, list[str]]:
        """How far what a track says of its derivatives is from these, as a share, and a sentence for each fault."""
        stretch = np.flatnonzero(np.diff(self.ends) > 8.0 * INSIDE * track.length)
        stretch = np.unique(stretch[np.linspace(0, len(stretch) - 1, COMPARED).astype(np.int64)])
        low, width = self.ends[stretch], np.diff(self.ends)[stretch]
        s = low[:, None] + width[:, None] * PLACES
        own, floor = self.at(s.ravel(), np.repeat(stretch, len(PLACES)))
        said = np.moveaxis(track.derivatives(s.ravel())[:, :, : len(track.axes)], 1, 0)
        shape = 4, *s.shape, len(track.axes)
        # what roundings of the length make of each, by the next derivative
        moved = np.pad(np.abs(own[1:]), ((0, 1), (0, 0), (0, 0))) * OFF * EPSILON * track.length
        off = np.maximum(np.abs(said - own) - 2.0 * floor - moved, 0.0).reshape(shape)
        # an axis that hardly moves has nothing but rounding: it counts by a little of how the others go over a stretch
        scale = np.max((np.abs(said) + floor).reshape(shape), axis=(1, 2), keepdims=True)
        going = WRONG * np.max(np.abs(said[1])) / width ** (np.arange(4)[:, None] - 1.0)
        scale = np.maximum(scale, going[:, :, None, None])
        share = np.divide(off, scale, out=np.zeros_like(off), where=off > 0.0)
        problems = []
        for order in range(4):
            worst = np.unravel_index(int(np.argmax(np.nan_to_num(share[order], nan=np.inf))), share[order].shape)
            found = float(share[order][worst])
            if not found <= WRONG:
                what = "position in its derivatives" if not order else f"derivative {order}"
                problems.append(
                    f"track: its {what} of {track.axes[worst[2]]} by length is off by {found:.3g} of the largest "
                    f"there, at s = {s[worst[:2]]:.6g} mm: by what it says of its positions it is another"
                )
        return float(np.max(np.nan_to_num(share, nan=np.inf))), problems

"""What the check adds where axes do not carry the tip: a track says by itself where they are along the tip's path.

The tip's path is evaluated by its control points and weights, as of any path. Positions of the axes are the track's,
and so are their derivatives: these are compared with differences of the positions before a law is judged by them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.checks.place import Placer
from splinefeed.checks.spans import EPSILON, PathSpans, SpanPlaces
from splinefeed.errors import InputError, LimitsError
from splinefeed.paths.track import Track
from splinefeed.records import Array, Limits, Setpoints

#: Roundings of a position: those of the formulas of kinematics; and by how many a setpoint may miss its place.
ROUNDINGS, OFF = 8.0, 64.0
#: An axis' dx/ds counts where a step is longer than this share of the longest one: below is rounding.
MOVING = 0.01
#: Intervals between breaks at which derivatives are compared with differences, at most, and the places of each.
COMPARED, PLACES = 256, np.array([0.1, 0.3, 0.5, 0.7, 0.9])
#: Steps of these differences, as shares of the interval: what agrees at one of them is right.
STEPS = 0.05 * 0.25 ** np.arange(9)
#: Differences of order 4 over steps of -2, -1, 1 and 2.
STENCIL = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
#: A derivative that is further from the difference than this share of the largest one there is wrong.
WRONG = 1e-5
#: ... but for so much of a derivative: what moves an axis along the whole interval by that share of itself.
SMALL = 1e-6
#: A track and the path of its tip are as long as each other but for this share.
SAME_LENGTH = 1e-9
#: Where derivatives are of one side of a break alone, a place counts so far inside of it, as a share of the track.
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
    #: Whether a law is held to the limits of the axes by the track's own derivatives.
    by_law = True

    def __init__(self, track: Track, rows: PathSpans, placer: Placer) -> None:
        self.track, self._rows, self._placer = track, rows, placer
        self.chord_error = self.off_axis = self.turned = 0.0
        self._size, self._steep = np.zeros((2, len(track.axes)))
        self._longest = 0.0

    def tip(self, setpoints: Setpoints) -> tuple[Setpoints, Array]:
        """Setpoints of the tip, where their u is on its path, and how far axes are off the track, mm or rad (n,)."""
        rows, tip = self._rows, self.track.tip_path
        known = np.all(np.isfinite(setpoints.position), axis=1) & np.isfinite(setpoints.u)
        row, u = rows.find(np.clip(setpoints.curve, 0, len(rows.curves) - 1), np.nan_to_num(setpoints.u))
        places = SpanPlaces(rows, row)
        t = places.t(u)
        s = np.clip(rows.arc_length(row, t), 0.0, self.track.length)
        position = np.where(known[:, None], places.derivatives(t, 0)[0].T, np.nan)
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

        s (n + 1,) is where the setpoints are, mm. The track says it.
        """
        off = np.zeros((2, values.shape[1] - 1))
        known = np.flatnonzero(np.all(np.isfinite(values), axis=0) & np.isfinite(s))
        if len(known) > 1:
            places = self.track.breaks
            step, tip, axis = self.track.chords(s[known], values[:, known].T, places)
            for worst, each in zip(off, (tip, axis), strict=True):
                if each is not None:
                    np.maximum.at(worst, known[step], each)
        self.chord_error = max(self.chord_error, float(np.max(off[0], initial=0.0)))
        self.turned = max(self.turned, float(np.max(off[1], initial=0.0)))
        size = max(float(np.max(self._size)), self._rows.length)
        return (off[0], ROUNDINGS * EPSILON * size), (off[1], ROUNDINGS * EPSILON)


def derivatives_inside(track: Track, s: Array, low: Array, high: Array) -> Array:
    """Axes and their derivatives, (n, 4, axes), at places s (n,) from low to high (n,), mm, which may be breaks.

    Places next to an end count as inside of it, as a track without sides says there alone which it is on.
    """
    inside = np.minimum(INSIDE * track.length, 0.25 * (high - low))
    return np.asarray(track.derivatives(np.clip(s, low + inside, high - inside))[:, :, : len(track.axes)])


def derivatives_apart(track: Track) -> tuple[float, list[str]]:
    """How far derivatives of a track are from differences of its positions, as a share, and a sentence for each fault.

    Between breaks, r against the positions of the track, r' against differences of these, r'' against those of r', r'''
    against those of r''. Of steps that get smaller the one at which both agree best counts, but for its rounding.
    """
    ends = np.concatenate([[0.0], track.breaks, [track.length]])
    ends = ends[np.diff(ends, prepend=-1.0) > 8.0 * INSIDE * track.length]
    cell = np.unique(np.linspace(0, len(ends) - 2, COMPARED).astype(np.int64))
    low, width = ends[cell], np.diff(ends)[cell]
    s = low[:, None] + width[:, None] * PLACES
    count = len(track.axes)

    def at(places: Array) -> Array:
        """r and its derivatives, with the positions first, (5, ..., axes)."""
        d = track.derivatives(places.ravel())[:, :, :count]
        found = np.stack([track(places.ravel()), *np.moveaxis(d, 1, 0)])
        return found.reshape(5, *places.shape, count)

    here = at(s)
    apart = np.abs(here[1] - here[0])[None] - OFF * EPSILON * (np.abs(here[0]) + np.abs(here[2]) * track.length)
    best = np.concatenate([np.maximum(apart, 0.0), np.full((3, *s.shape, count), np.inf)])
    for share in STEPS:
        h = share * width[:, None]
        around = at(s[..., None] + h[..., None] * STENCIL[0])[[0, 2, 3]]
        difference = np.einsum("kcpia,i->kcpa", around, STENCIL[1]) / h[..., None]
        size = np.max(np.abs(around), axis=3) + np.max(np.abs(here[[2, 3, 4]]), axis=0) * EPSILON * track.length
        rounding = OFF * EPSILON * size / h[..., None]
        best[1:] = np.minimum(best[1:], np.maximum(np.abs(here[2:] - difference) - rounding, 0.0))
    # what moves an axis over the interval by a rounding of the numbers that it is made of is no derivative
    axis = np.arange(count)
    kind = [axis < track.linear, axis >= track.linear]
    size = np.sum([np.max(np.abs(here[0][..., each]), initial=0.0) * each for each in kind], axis=0)
    size[: track.linear] = np.maximum(size[: track.linear], track.length)
    least = SMALL * size / width[:, None, None] ** np.arange(4)[:, None, None, None]
    scale = np.maximum(np.max(np.abs(here[1:]), axis=2, keepdims=True), least)
    with np.errstate(divide="ignore", invalid="ignore"):
        share_of = np.where(best > 0.0, best / scale, 0.0)
    said = []
    for order in range(4):
        worst = np.unravel_index(int(np.argmax(np.nan_to_num(share_of[order], nan=np.inf))), share_of[order].shape)
        found = float(share_of[order][worst])
        if not found <= WRONG:
            what = "position in its derivatives" if not order else f"derivative {order}"
            said.append(
                f"track: its {what} of {track.axes[worst[2]]} by length is off by {found:.3g} of the largest there, at "
                f"s = {s[worst[:2]]:.6g} mm: by differences of what it says of its positions it is another"
            )
    return float(np.max(np.nan_to_num(share_of, nan=np.inf))), said

"""The motion between neighbouring setpoints: distance of the path from the chord, and what places make.

A step runs over a part of each piece of the path from one place to the next; all parts of many steps are processed
together, MOST of them at a time.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from splinefeed.checks.nearest import groups
from splinefeed.checks.path_limits import TipPlaces, value_of
from splinefeed.checks.spans import PathSpans, SpanPlaces
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import dot, expanded, taken

#: Parts of pieces that are processed together: they stay in the processor's cache.
MOST = 4096
#: Intervals in which a part is examined for its distance from the chord, and how often the two around the largest
#: are then divided into as many again.
INTERVALS, ZOOMS = 8, 2
#: What is sampled below this share of what is looked for is not examined more closely.
WORTH_A_LOOK = 0.9

Value = Callable[[IntArray, SpanPlaces, Array, Array], Array]
"""Of parts of pieces, p of them: the step of each (p,), the places on its piece, from which t and to which (p,)."""


def _over_steps(spans: PathSpans, row: IntArray, u: Array, value: Value, most: np.ufunc) -> Array:
    """The `most` of the values of all parts of steps between places (n + 1,), (n,), NaN without a place at one end.

    A step runs over a part of each piece from one place to the next, whichever way it goes.
    """
    out = np.full(max(len(u) - 1, 0), np.nan)
    known = np.flatnonzero(np.isfinite(u[:-1]) & np.isfinite(u[1:]))
    ends = np.stack([row[known], row[known + 1]]), np.stack([u[known], u[known + 1]])
    back = (ends[0][1] < ends[0][0]) | ((ends[0][1] == ends[0][0]) & (ends[1][1] < ends[1][0]))
    (begin, end), (low, high) = (np.where(back, each[::-1], each) for each in ends)
    count = end - begin + 1
    for run in groups(count, MOST):
        step, number = expanded(count[run])
        of, first = begin[run][step] + number, np.flatnonzero(number == 0)
        low_of, high_of = spans.low[of], spans.high[of]
        low_of[first], high_of[first + count[run] - 1] = low[run], high[run]
        places = SpanPlaces(spans, of)
        found = value(known[run][step], places, places.t(low_of), places.t(high_of))
        out[known[run]] = most.reduceat(found, first)
    return out


def chord_errors(spans: PathSpans, row: IntArray, u: Array, position: Array, worth: float | None = None) -> Array:
    """Measure how far a curve is from the line between neighbouring positions.

    Parameters
    ----------
    spans : PathSpans
        Of the path.
    row : (n + 1,) array of int
        Row of each place.
    u : (n + 1,) array
        Parameter on it.
    position : (axes, n + 1) array
        mm.
    worth : float, optional
        mm: only steps are examined closely that may be longer than that, or as long as the longest.

    Returns
    -------
    (n,) array
        Largest distance, mm, NaN without a place. Every part is examined by itself, ends included, so that a corner at
        a knot is never between two samples.
    """
    position, shares = position[: spans.linear], np.arange(INTERVALS + 1)[:, None] / INTERVALS

    def distance(step: IntArray, places: SpanPlaces, low: Array, high: Array) -> Array:
        out, near = np.zeros(len(step)), np.arange(len(step))

        def see(t: Array) -> Array:
            start = position[:, None, step[near]]
            at = places.derivatives(t, 0)[0][: spans.linear] - start
            found = _from_line(at, position[:, None, step[near] + 1] - start)
            out[near] = np.maximum(out[near], np.max(found, axis=0))
            return found

        for _ in range(1 + ZOOMS):
            t = low + (high - low) * shares
            found = see(t)
            middle, own = np.clip(np.argmax(found, axis=0), 1, INTERVALS - 1), np.arange(len(near))
            (low, at, high), (before, top, after) = ([each[middle + k, own] for k in (-1, 0, 1)] for each in (t, found))
            if worth is not None:
                worthy = out[near] >= WORTH_A_LOOK * min(worth, float(np.max(out, initial=0.0)))
                near, low, at, high, before, top, after = taken(worthy, near, low, at, high, before, top, after)
                places = SpanPlaces(spans, places.row[worthy])
        with np.errstate(divide="ignore", invalid="ignore"):  # the top of the parabola through the last three
            ahead = 0.25 * (before - after) / (before - 2.0 * top + after) * (high - low)
        see(np.clip(np.where(np.isfinite(ahead), at + ahead, at), low, high)[None])
        return out

    return _over_steps(spans, row, u, distance, np.maximum)


def _from_line(at: Array, line: Array) -> Array:
    """Distance (k, n), mm, of points (linear, k, n) from straight lines from zero on."""
    square = dot(line, line)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0.0, dot(at, line) / square, 0.0)
    apart = at - np.clip(share, 0.0, 1.0) * line
    return np.asarray(np.sqrt(dot(apart, apart)))


def least_values(name: str, spans: PathSpans, row: IntArray, u: Array, feed: Array) -> Array:
    """Find the least value of a limit of places from each place to the next.

    Parameters
    ----------
    name : str
        Of the limit.
    spans : PathSpans
        Of the path.
    row : (n + 1,) array of int
        Row of each place.
    u : (n + 1,) array
        Parameter on it.
    feed : (n,) array
        mm/s.

    Returns
    -------
    (n,) array
        It is evaluated at both ends and the middle of every part.
    """
    thirds = np.array([0.0, 0.5, 1.0])[:, None]

    def least(step: IntArray, places: SpanPlaces, low: Array, high: Array) -> Array:
        at = TipPlaces(places, places.derivatives(low + thirds * (high - low), 3))
        return np.asarray(np.min(value_of(name, at, feed[step]), axis=0))

    return _over_steps(spans, row, u, least, np.minimum)

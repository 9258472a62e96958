"""The motion between neighbouring setpoints: distance of the path from the chord, and what places make.

A step runs over a part of each piece of the path from one place to the next; all parts of many steps are processed
together, MOST of them at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from splinefeed.checks.path_limits import TipPlaces, value_of
from splinefeed.checks.spans import PathSpans, SpanPlaces
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import dot, expanded

#: Parts of pieces that are processed together: they stay in the processor's cache.
MOST = 4096
#: Intervals in which a part is examined for its distance from the chord, and Newton steps to the largest distance.
INTERVALS, NEWTON_STEPS = 8, 4
#: What is sampled below this share of what is looked for is not examined more closely.
WORTH_A_LOOK = 0.9


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of pieces, p of them, that steps run over, n of them.

    Parameters
    ----------
    step, row : (p,) array of int
        Whose part each is, and of which row.
    low, high : (p,) array
        From which u to which; low <= high.
    first : (n,) array of int
        The first part of each step.
    """

    step: IntArray
    row: IntArray
    low: Array
    high: Array
    first: IntArray


def parts(spans: PathSpans, row: IntArray, u: Array) -> Iterator[tuple[slice, Parts]]:
    """Divide steps between places into parts of pieces, whichever way they go, MOST or one step at a time.

    Parameters
    ----------
    spans : PathSpans
        Of the path.
    row : (n + 1,) array of int
        Row of each place.
    u : (n + 1,) array
        Parameter on it.

    Yields
    ------
    steps : slice
        Which of them.
    parts : Parts
        Of these; a step without a place at one of its ends has a part of no length.
    """
    lost, back = _ways(row, u)
    begin, low = (np.where(back, each[1:], each[:-1]) for each in (row, u))
    end, high = (np.where(back, each[:-1], each[1:]) for each in (row, u))
    end, low, high = np.where(lost, begin, end), *(np.where(lost, spans.low[begin], each) for each in (low, high))
    count = end - begin + 1
    until = np.cumsum(count)
    start = 0
    while start < len(count):
        before = int(until[start - 1]) if start else 0
        stop = max(int(np.searchsorted(until, before + MOST, side="right")), start + 1)
        piece = slice(start, stop)
        step, number = expanded(count[piece])
        of, last = begin[piece][step] + number, until[piece] - before - 1
        first = last - count[piece] + 1
        low_of, high_of = spans.low[of], spans.high[of]
        low_of[first], high_of[last] = low[piece], high[piece]
        yield piece, Parts(step, of, low_of, high_of, first)
        start = stop


def _ways(row: IntArray, u: Array) -> tuple[BoolArray, BoolArray]:
    """Whether steps between places (n + 1,) have no place at one end, and whether they go back, (n,)."""
    with np.errstate(invalid="ignore"):
        back = (row[1:] < row[:-1]) | ((row[1:] == row[:-1]) & (u[1:] < u[:-1]))
    return np.isnan(u[:-1]) | np.isnan(u[1:]), back


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
    linear = spans.linear
    out = np.empty(max(len(u) - 1, 0))
    shares = np.arange(INTERVALS + 1)[:, None] / INTERVALS
    for steps, part in parts(spans, row, u):
        ends = position[:linear, steps.start : steps.stop + 1]
        start = ends[:, part.step]
        chord = (ends[:, 1:] - ends[:, :-1])[:, part.step]
        width = part.high - part.low
        places = SpanPlaces(spans, part.row)
        distance = _from_chord(places.derivatives(places.t(part.low + shares * width), 0)[0][:linear], start, chord)[0]
        best = np.argmax(distance, axis=0)
        each = distance[best, np.arange(len(best))]
        near = np.arange(len(best))
        if worth is not None:
            near = np.flatnonzero(each >= WORTH_A_LOOK * min(worth, float(np.max(each, initial=0.0))))
        begin, wide = part.low[near], width[near]
        left, right = (
            begin + wide * shares[np.maximum(best[near] - 1, 0), 0],
            begin + wide * shares[np.minimum(best[near] + 1, INTERVALS), 0],
        )
        place = begin + wide * shares[best[near], 0]
        places, start, chord = SpanPlaces(spans, part.row[near]), start[:, near], chord[:, near]
        for _ in range(NEWTON_STEPS if len(near) else 0):
            c, first, second = (values[:linear] for values in places.derivatives(places.t(place), 2))
            far, apart, inside = _from_chord(c, start, chord)
            each[near] = np.maximum(each[near], far)
            # half the squared distance has the slope apart.C' and bends by C'.C' + apart.C'', less what runs along
            slope, bend = dot(apart, first), dot(first, first) + dot(apart, second)
            with np.errstate(divide="ignore", invalid="ignore"):
                bend -= np.where(inside, dot(first, chord) ** 2 / dot(chord, chord), 0.0)
                place = np.where(bend < 0.0, np.clip(place - slope / bend, left, right), place)
        if len(near):
            far = _from_chord(places.derivatives(places.t(place), 0)[0][:linear], start, chord)[0]
            each[near] = np.maximum(each[near], far)
        out[steps] = np.maximum.reduceat(each, part.first)
    out[np.isnan(u[:-1]) | np.isnan(u[1:])] = np.nan
    return out


def _from_chord(at: Array, start: Array, chord: Array) -> tuple[Array, Array, BoolArray]:
    """Distance (..., n) of points (linear, ..., n) from straight lines, mm, as vectors, and where it is across them."""
    start, chord = (each.reshape(len(at), *(1,) * (at.ndim - 2), each.shape[-1]) for each in (start, chord))
    square = dot(chord, chord)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0.0, dot(at - start, chord) / square, 0.0)
    inside = (share > 0.0) & (share < 1.0)
    apart = at - start - np.clip(share, 0.0, 1.0) * chord
    return np.sqrt(dot(apart, apart)), apart, inside


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
    out = np.empty(max(len(u) - 1, 0))
    thirds = np.array([0.0, 0.5, 1.0])[:, None]
    for steps, part in parts(spans, row, u):
        places = SpanPlaces(spans, part.row)
        at = TipPlaces(places, places.derivatives(places.t(part.low + thirds * (part.high - part.low)), 3))
        values = value_of(name, at, feed[steps][part.step])
        out[steps] = np.minimum.reduceat(np.min(values, axis=0), part.first)
    out[np.isnan(u[:-1]) | np.isnan(u[1:])] = np.nan
    return out

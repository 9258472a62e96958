"""The curves of a path as the check sees them: SciPy's B-splines over control points times weights, and arc length.

Nothing here reads a table that a planner or an interpolator reads. `scipy.interpolate.BSpline` expands every span
between two knots about its middle; a span is halved until its speed is a polynomial to rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.polynomial import legendre

from splinefeed.curves.packed import Flat
from splinefeed.paths.path import Path
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import chunks, dot, taken

EPSILON = float(np.finfo(np.float64).eps)
#: Arc length of the tip where only rotary axes move, for each rad: degrees.
DEGREES = 180.0 / np.pi
#: Places of a span at which its speed is sampled, as many as its polynomial has terms.
NODES = 10
#: A speed is that polynomial where its last two terms are below this share of its mean: those behind them are rounding.
LAST_TERMS = 2.0**-44
#: ... or below so many roundings of the path's length: a term adds less than a twentieth of itself to an arc length.
OF_ROUNDING = 4.0
#: A span is halved no more often.
HALVINGS = 60
#: PathSpans, and curves of one kind, that are processed together: what bounds the memory.
BLOCK, ALIKE = 4096, 65536
#: Newton steps in a bracket at most, and the share of it behind which the next step is rounding.
STEPS, SMALL_STEP = 100, 5e-10

#: At both ends, which lie outside of all places, a speed is that polynomial to so many times more: what turns there, as
#: the tip of a path whose other axes turn on, may turn between the last place and the end.
AT_ENDS = 64.0

_NODES, _WEIGHTS = legendre.leggauss(NODES)
#: Legendre's polynomials at both ends, (2, NODES).
_ENDS = legendre.legvander(np.array([-1.0, 1.0]), NODES - 1)
#: Speeds at the nodes to Legendre's coefficients of the speed, (NODES, NODES).
_SERIES = (np.arange(NODES)[:, None] + 0.5) * legendre.legvander(_NODES, NODES - 1).T * _WEIGHTS
#: These to the coefficients of t^k of the arc length from t = -1 on, (NODES + 1, NODES).
_ARC = np.zeros((NODES + 1, NODES))
for _k in range(NODES):
    _ARC[: _k + 2, _k] = legendre.leg2poly(legendre.legint(np.eye(NODES)[_k, : _k + 1], lbnd=-1))


class PathSpans:
    """Spans of curves, or parts of them, in the order of the motion, r of them, as columns.

    Attributes
    ----------
    curve, knot : (r,) array
        Whose part each is, and whether it begins at a knot.
    low, high, middle, scale : (r,) array
        Interval of u, and t = (u - middle) scale, in [-1, 1].
    start, end, lengths : (r,) array
        Arc length at both ends, and from one to the other, mm.
    origin : (axes, r) array
        A point near the span.
    terms : (axes + 1 if rational, degree + 1, r) array
        Coefficients of t^k of A, and of the weight.
    curves : (curves, 2) array
        First and last span of each curve.
    still : (r,) array of bool
        Whether none of the first `linear` axes moves, though others may.

    Notes
    -----
    The curve is origin + A(t) / w(t). All axes make the length, each times its unit, (axes,); or, without units, the
    first `linear` ones, and where none of them moves the others, in degrees: that is the arc length of the tip.
    """

    def __init__(self, flat: Flat, linear: int, units: Array | None = None) -> None:
        self.degree, self.axes, self.linear = int(flat.degrees.max()), flat.points.shape[1], linear
        self._flat, self._units = flat, units
        self.rational = bool(np.any(flat.rational))
        whole = _expansions(flat, self.degree, self.rational, linear)
        points = flat.points[:, : linear or None] if units is None else flat.points * units
        size = EPSILON * OF_ROUNDING * float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        if not self.rational and self.degree == 1:  # straight: all of one speed
            self._know(whole)
            speed = self._speed(np.zeros(len(self)))
            self._arc: Array = np.stack([speed, speed])
        else:
            parts = [self._halved(taken(part, *whole), size) for part in chunks(len(whole[0]), BLOCK)]
            *halved, self._arc = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
            self._know(tuple(halved))
        # where |C'| is large the rounding of the middle of u is far: the ends are not -1 and 1 to the bit
        first, last = (
            about(self._arc[None], (end - self.middle) * self.scale, 0)[0][0] for end in (self.low, self.high)
        )
        self._arc[0] -= first
        self.lengths = last - first
        self.end = sums(self.lengths)
        self.start = np.concatenate([[0.0], self.end[:-1]])
        last = np.cumsum(np.bincount(self.curve, minlength=len(flat)))
        self.curves: IntArray = np.column_stack([np.concatenate([[0], last[:-1]]), last - 1])

    def _know(self, spans: tuple[Any, ...]) -> None:
        self.curve, self.knot, self.low, self.high, self.origin, self.terms = spans
        self.middle: Array = 0.5 * (self.low + self.high)
        self.scale: Array = 2.0 / (self.high - self.low)
        self.still: BoolArray = np.zeros(len(self), dtype=bool)
        if self.linear < self.axes:
            self.still = ~np.any(self.terms[: self.linear], axis=(0, 1))

    def counts(self, row: IntArray | slice) -> Array:
        """What the square of a step of each axis counts in that of the length on spans (n,), (axes, n) or (axes, 1)."""
        return self.tip_counts(row) if self._units is None else (self._units**2)[:, None]

    def tip_counts(self, row: IntArray | slice) -> Array:
        """What it counts in that of the length of the tip, (axes, n)."""
        turns, still = np.arange(self.axes)[:, None] >= self.linear, self.still[row]
        return np.where(turns, DEGREES**2 * still, ~still)

    def _halved(self, spans: tuple[Any, ...], rounding: float) -> tuple[Any, ...]:
        """Spans, halved until the arc length of each is a polynomial, in order, and its coefficients."""
        done: list[tuple[Any, ...]] = []
        for halvings in range(HALVINGS + 1):
            self._know(spans)
            at = np.repeat(np.concatenate([_NODES, [-1.0, 1.0]])[:, None], len(spans[0]), axis=1)
            speed = self._speed(at)
            series = _SERIES @ speed[:NODES]
            missed = np.max(np.abs(speed[NODES:] - _ENDS @ series), axis=0)
            last = np.maximum(np.abs(series[-1]) + np.abs(series[-2]), missed / AT_ENDS)
            cut = (last > LAST_TERMS * series[0]) & (last > rounding) & (halvings < HALVINGS)
            cut &= self.high - self.low > 8.0 * EPSILON * np.abs(self.middle)
            done.append(taken(~cut, *spans, _ARC @ series))
            if not cut.any():
                break
            spans = self._halves(taken(cut, *spans))
        out = tuple(np.concatenate(each, axis=-1) for each in zip(*done, strict=True))
        return taken(np.lexsort((out[2], out[0])), *out)

    def _halves(self, spans: tuple[Any, ...]) -> tuple[Any, ...]:
        """Both halves of each, expanded about their own middles."""
        curve, knot, low, high, origin, terms = (np.repeat(each, 2, axis=-1) for each in spans)
        first, middle = np.arange(len(low)) % 2 == 0, 0.5 * (low + high)
        begin, end = np.where(first, low, middle), np.where(first, middle, high)
        # to the bit about what the middle of the half is rounded to: where |C'| is large, a bit of u is far
        share, scale = (end - begin) / (high - low), 2.0 / (high - low)
        terms = np.stack(about(terms, (0.5 * (begin + end) - middle) * scale, self.degree), axis=1)
        terms *= share ** np.arange(self.degree + 1.0)[:, None]
        return curve, knot & first, begin, end, *_moved(origin, terms, self.rational)

    def __len__(self) -> int:
        return len(self.low)

    @property
    def mixed(self) -> bool:
        """Whether the length is not that of the tip, as other axes make it, too."""
        return self._units is not None and 0 < self.linear < self.axes and bool(np.any(self._units[self.linear :]))

    @cached_property
    def tip(self) -> PathSpans:
        """The same curves by the arc length of the tip."""
        return PathSpans(self._flat, self.linear) if self.mixed else self

    def of_tip(self, s: Array) -> Array:
        """Arc length of the tip (n,), mm, at lengths s (n,), mm."""
        if not self.mixed:
            return s
        row = self.at(s)
        t = self.parameter(row, np.clip(s, self.start[row], self.end[row]) - self.start[row])
        where, ahead = self.tip.place(self.curve[row], self.middle[row] + t / self.scale[row])
        return np.asarray(self.tip.start[where] + ahead)

    def taylor(self, terms: Array, rational: bool, t: Array, order: int) -> list[Array]:
        """Columns of some terms, or A / w, and derivatives by t over k!, (columns, ..., n), at t (..., n)."""
        near = about(_beside(terms, t), t, order)
        return quotient(near) if rational else near

    def _speed(self, t: Array) -> Array:
        """|dC/dt|, mm, of all spans at t (..., r) of each."""
        slope = self.taylor(self.terms, self.rational, t, 1)[1]
        return np.asarray(np.sqrt(dot(slope * _beside(self.counts(slice(None)), t), slope)))

    @property
    def length(self) -> float:
        """Length of all, mm."""
        return float(self.end[-1])

    @cached_property
    def curve_starts(self) -> Array:
        """Arc length at which each curve starts, and the length of all at last, (curves + 1,), mm."""
        return np.append(self.start[self.curves[:, 0]], self.length)

    @cached_property
    def sizes(self) -> Array:
        """How large the numbers are that a point of each span is made of, (axes, r): eps times that is its rounding."""
        weight = self.terms[self.axes, 0] if self.rational else 1.0
        return np.asarray(np.abs(self.origin) + np.sum(np.abs(self.terms[: self.axes]), axis=1) / weight)

    @cached_property
    def parameters(self) -> Array:
        """Largest |u| of each span, (r,)."""
        return np.asarray(np.maximum(np.abs(self.low), np.abs(self.high)))

    def find(self, curve: IntArray, u: Array) -> tuple[IntArray, Array]:
        """Span (n,) that holds u (n,) of the curves (n,), and u moved into the curve's domain."""
        first, last = self.curves[curve, 0], self.curves[curve, 1]
        value = np.minimum(np.maximum(u, self.low[first]), self.high[last])
        while np.any(first < last):
            middle = (first + last + 1) >> 1
            ahead = self.low[middle] <= value
            first, last = np.where(ahead, middle, first), np.where(ahead, last, middle - 1)
        return first, value

    def points(self, curve: IntArray, u: Array) -> Array:
        """Points of the curves (n,) at u (n,), (axes, n)."""
        row, u = self.find(curve, u)
        places = SpanPlaces(self, row)
        return places.derivatives(places.t(u), 0)[0]

    def place(self, curve: IntArray, u: Array) -> tuple[IntArray, Array]:
        """Span (n,) that holds u (n,) of the curves (n,), and how far u is from its start, mm, (n,)."""
        row, u = self.find(curve, u)
        return row, self.ahead(row, (u - self.middle[row]) * self.scale[row])

    def at(self, s: Array) -> IntArray:
        """The last span that begins at or before arc lengths s (n,), mm."""
        row = np.searchsorted(self.start, s, side="right") - 1
        return np.asarray(np.maximum(row, 0))

    def ahead(self, row: IntArray, t: Array) -> Array:
        """Arc length (n,), mm, from the start of spans (n,) to t (n,)."""
        return np.asarray(about(np.take(self._arc, row, axis=1)[None], t, 0)[0][0])

    def arc_length(self, row: IntArray, t: Array) -> Array:
        """S (n,), mm, at t (n,) of spans (n,)."""
        return np.asarray(self.start[row] + self.ahead(row, t))

    def steps(self, row: IntArray, ahead: Array) -> Array:
        """Arc length from each place to the next, (n,), mm, of places `ahead` (n + 1,), mm, of the starts of spans."""
        return np.asarray(np.diff(ahead) + np.diff(self.start[row]))

    def parameter(self, row: IntArray, ahead: Array) -> Array:
        """t (n,) in [-1, 1] of spans (n,) at which S is `ahead` (n,), mm, behind their start: Newton in a bracket."""
        length, one = self.lengths[row], np.ones(len(row))
        with np.errstate(divide="ignore", invalid="ignore"):
            t = reached(self._arc[:, row], ahead, -one, one, np.clip(2.0 * ahead / length - 1.0, -1.0, 1.0))
        # where C' = 0 at an end, a rounding of the arc length is far
        return np.where(ahead >= length, 1.0, np.where(ahead <= 0.0, -1.0, t))


class SpanPlaces:
    """The expansions of the spans that places lie on, gathered once and evaluated often.

    Parameters
    ----------
    spans : PathSpans
        Of the path.
    row : (n,) array of int
        The span of each place.
    """

    def __init__(self, spans: PathSpans, row: IntArray) -> None:
        self.spans, self.row, self.linear = spans, row, spans.linear
        self.middle, self.scale, self.still = spans.middle[row], spans.scale[row], spans.still[row]
        self._terms, self.origin = np.take(spans.terms, row, axis=2), np.take(spans.origin, row, axis=1)
        self._counts = spans.counts(row)

    def t(self, u: Array) -> Array:
        """t (..., n) of parameters u (..., n)."""
        return (u - self.middle) * self.scale

    def derivatives(self, t: Array, order: int) -> list[Array]:
        """C and its derivatives by u to `order` <= 3 at t (..., n), each (axes, ..., n)."""
        c = self.spans.taylor(self._terms, self.spans.rational, t, order)
        c[0] = c[0] + _beside(self.origin, t)
        factor = self.scale
        for k in range(1, order + 1):
            c[k] = c[k] * factor
            factor = factor * self.scale * (k + 1)
        return c

    def along(self, t: Array) -> tuple[list[Array], list[Array]]:
        """C and its derivatives by u, r and those by arc length, to the third at t (..., n), (axes, ..., n) each.

        r_s = C' u_s,  r_ss = C'' u_s^2 + C' u_ss,  r_sss = C''' u_s^3 + 3 C'' u_s u_ss + C' u_sss   (the chain rule)
        u_s = 1/c,  u_ss = -(C'.C'')/c^4,  u_sss = 4 (C'.C'')^2/c^7 - (C''.C'' + C'.C''')/c^5,  c = |C'|
        """
        c = self.derivatives(t, 3)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            square, bent = self.product(c[1], c[1]), self.product(c[1], c[2])
            more = self.product(c[2], c[2]) + self.product(c[1], c[3])
            us = 1.0 / np.sqrt(square)
            uss = -bent / (square * square)
            usss = (4.0 * bent * bent / square - more) / (square * square) * us
            first, second = c[1] * us, c[2] / square + c[1] * uss
            return c, [c[0], first, second, c[3] * (us / square) + 3.0 * c[2] * (us * uss) + c[1] * usss]

    def curvature(self, c: list[Array]) -> Array:
        """Curvature (..., n) over the linear axes by u, 1/mm: infinite where C' = 0, 0 where only others move."""
        one, two = (each[: self.linear] for each in c[1:3])
        with np.errstate(divide="ignore", invalid="ignore"):
            square = dot(one, one)
            across = two - dot(one, two) / square * one
            bend = np.sqrt(dot(across, across)) / square
        return np.where(self.still, 0.0, np.where(square > 0.0, bend, np.inf))

    def tip(self, r: list[Array]) -> tuple[Array, Array, Array]:
        """s', s'', s''' (..., n) of the tip's arc length s by the length, from r and its derivatives by it."""
        if not self.spans.mixed:
            return np.ones(r[1].shape[1:]), np.zeros(r[1].shape[1:]), np.zeros(r[1].shape[1:])
        size = np.sqrt(_beside(self.spans.tip_counts(self.row), r[1][0]))
        one, two, three = (each * size for each in r[1:4])
        with np.errstate(divide="ignore", invalid="ignore"):
            first = np.sqrt(dot(one, one))
            second = np.where(first > 0.0, dot(one, two) / first, 0.0)
            third = np.where(first > 0.0, (dot(two, two) + dot(one, three) - second * second) / first, 0.0)
        return first, second, third

    def product(self, one: Array, other: Array) -> Array:
        """Scalar product (..., n) of derivatives (axes, ..., n) over the axes that make the length, mm."""
        return dot(one * _beside(self._counts, one[0]), other)


def _beside(columns: Array, t: Array) -> Array:
    """What spans have, (..., n), for many places t (..., n) on each."""
    return columns.reshape(*columns.shape[:-1], *(1,) * (t.ndim - 1), columns.shape[-1])


#: What is made of each path that is still there.
_MADE: WeakKeyDictionary[Path, PathSpans] = WeakKeyDictionary()


def spans_of(path: Path) -> PathSpans:
    """Make the spans of a path, once.

    Parameters
    ----------
    path : Path
        The path.

    Returns
    -------
    PathSpans
        Its spans.
    """
    if (made := _MADE.get(path)) is None:
        made = _MADE[path] = PathSpans(path.flat, path.linear, path.weights)
    return made


def _expansions(flat: Flat, degree: int, rational: bool, linear: int) -> tuple[Any, ...]:
    """Every span between two knots, in order: curve, knot, low, high, origin and terms; see `PathSpans`."""
    from scipy.interpolate import BSpline

    kinds = [(*kind, np.unique(kind[2][kind[1] : len(kind[2]) - kind[1]])) for kind in _kinds(flat)]
    counts = np.zeros(len(flat), dtype=np.int64)
    for members, _, _, breaks in kinds:
        counts[members] = len(breaks) - 1
    starts, total = np.cumsum(counts) - counts, int(counts.sum())
    axes = flat.points.shape[1]
    interval, origin, terms = (np.zeros((*each, total)) for each in ((2,), (axes,), (axes + rational, degree + 1)))
    if rational:
        terms[axes, 0] = 1.0
    for members, p, knots, breaks in kinds:
        n, middle, half = len(knots) - p - 1, 0.5 * (breaks[:-1] + breaks[1:]), 0.5 * np.diff(breaks)
        for part in chunks(len(members), max(ALIKE // n, 1)):
            some = members[part]
            point = flat.point_starts[some][:, None] + np.arange(n)
            points = flat.points[point]
            local = points - points[:, :1]
            if rational:
                weights = np.where(flat.rational[some][:, None] > 0, flat.weights[point], 1.0)[..., None]
                local = np.concatenate([local * weights, weights], axis=2)
            spline = BSpline(knots, local.transpose(1, 0, 2).reshape(n, -1), p)
            row, factor = starts[some][:, None] + np.arange(len(middle)), np.ones(len(middle))
            for k in range(p + 1):
                value = spline(middle, nu=k).reshape(len(middle), len(some), -1)
                terms[:, k, row] = value.transpose(2, 1, 0) * factor
                factor = factor * half / (k + 1)
            origin[:, row] = points[:, :1].transpose(2, 0, 1)
            ends = np.stack([breaks[:-1], breaks[1:]])[:, None]
            interval[:, row] = flat.domains[some].T[..., None] if len(knots) == 2 * p + 2 else ends
            if linear < axes:  # what stands still over the linear axes does so to the bit
                first = np.searchsorted(knots, middle) - 1 - p
                near = points[:, first[:, None] + np.arange(p + 1), :linear]
                still = np.all(near == near[:, :, :1], axis=(2, 3))
                terms[:linear, :, row[still]] = 0.0
                origin[:linear, row[still]] = near[still][:, 0].T
    return np.repeat(np.arange(len(flat)), counts), np.ones(total, bool), *interval, *_moved(origin, terms, rational)


def _kinds(flat: Flat) -> Iterator[tuple[IntArray, int, Array]]:
    """Numbers of curves that have the same degree and knots, and these; knots of Bezier curves are 0 and 1 instead."""
    p, first, last = flat.degrees, flat.knot_starts[:-1], flat.knot_starts[1:] - 1
    bezier = (last - first == 2 * p + 1) & (flat.knots[first] == flat.knots[first + p])
    bezier &= flat.knots[last] == flat.knots[last - p]
    for degree in np.unique(p[bezier]).tolist():
        yield np.flatnonzero(bezier & (p == degree)), degree, np.repeat([0.0, 1.0], degree + 1)
    alike: dict[tuple[int, bytes], list[int]] = {}
    for i in np.flatnonzero(~bezier).tolist():
        alike.setdefault((int(p[i]), flat.knots[first[i] : last[i] + 1].tobytes()), []).append(i)
    for (degree, knots), members in alike.items():
        yield np.array(members), degree, np.frombuffer(knots)


def _moved(origin: Array, terms: Array, rational: bool) -> tuple[Array, Array]:
    """The same expansions about the point of t = 0."""
    axes = len(origin)
    at = terms[:axes, 0] / terms[axes, 0] if rational else terms[:, 0].copy()
    if rational:
        terms[:axes] -= at[:, None] * terms[axes]
    terms[:axes, 0] = 0.0
    return origin + at, terms


def about(a: Array, t: Array, order: int) -> list[Array]:
    """Coefficients of x^k, k = 0 ... order, of sum_k a_k (t + x)^k, (columns, ...) each; a (columns, degree + 1, ...).

    Horner's rule on all of them at once: they are the derivatives at t over k!.
    """
    out = [a[:, -1]]
    for k in range(a.shape[1] - 2, -1, -1):
        longer = [out[-1]] if len(out) <= order else []
        for j in range(len(out) - 1, 0, -1):
            out[j] = out[j] * t
            out[j] += out[j - 1]
        out[0] = out[0] * t
        out[0] += a[:, k]
        out += longer
    return out + [np.zeros_like(out[0])] * (order + 1 - len(out))


def reached(terms: Array, value: Array, low: Array, high: Array, t: Array) -> Array:
    """Find where growing polynomials reach a value: Newton's method in a bracket.

    Parameters
    ----------
    terms : (degree + 1, n) array
        Coefficients of t^k.
    value : (n,) array
        To be reached.
    low, high, t : (n,) array
        The bracket, and where to begin; if that is NaN, in the middle.

    Returns
    -------
    (n,) array
        t, an end of the bracket where the value is beyond it.
    """
    t = np.where(np.isfinite(t), t, 0.5 * (low + high))
    out, index, near = t.copy(), np.arange(len(t)), SMALL_STEP * (high - low)
    for _ in range(STEPS if len(t) else 0):
        (over,), (slope,) = about(terms[None], t, 1)
        over = over - value
        low, high = np.where(over < 0.0, t, low), np.where(over > 0.0, t, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = t - over / slope
        new = np.where((new >= low) & (new <= high), new, np.where(over == 0.0, t, 0.5 * (low + high)))
        out[index] = new
        go = np.flatnonzero(~(np.abs(new - t) < near))
        if not len(go):
            break
        terms, value, low, high, t, index, near = taken(go, terms, value, low, high, new, index, near)
    return out


def quotient(a: list[Array]) -> list[Array]:
    """Compute coefficients of A / w.

    Parameters
    ----------
    a : list of (axes + 1, ...) array
        Coefficients of A and, in the last column, w.

    Returns
    -------
    list of (axes, ...) array
        C_k = (A_k - sum_i w_i C_(k-i)) / w_0.

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., eq. 4.8, over k!.
    """
    inverse = 1.0 / a[0][-1]
    out: list[Array] = []
    for k, each in enumerate(a):
        value = each[:-1]
        for i in range(1, k + 1):
            value = value - a[i][-1] * out[k - i]
        out.append(value * inverse)
    return out


def sums(steps: Array) -> Array:
    """Sum up steps, with what each rounding lost put back: 1e6 steps add to the rounding of their sum.

    Parameters
    ----------
    steps : (n,) array
        The steps.

    Returns
    -------
    (n,) array
        Their running sums.

    References
    ----------
    .. [1] Ogita, Rump & Oishi 2005, doi:10.1137/030601818, algorithm 4.4.
    """
    after = np.cumsum(steps)
    before = np.concatenate([[0.0], after[:-1]])
    added = after - before
    return np.asarray(after + np.cumsum((before - (after - added)) + (steps - added)))

"""Tables of pieces of many curves at once: their knot spans as polynomials, and the arc length fitted on each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from splinefeed.curves.flat import Flat as Flat
from splinefeed.curves.pieces import Pieces, arc, coefficients, speed, taylor
from splinefeed.curves.spline import Spline
from splinefeed.errors import CurveError
from splinefeed.kernels.layout import ARC, ARC_TERMS, HIGH, LOW, MIDDLE, ORIGIN, SCALE, START, Shape, width
from splinefeed.records import Array, BoolArray, IntArray
from splinefeed.records.arrays import chunks, read_only

#: Pieces made in one go: what is made of them stays in a core's cache.
BLOCK = 4096
#: A piece may give back the roundings of its control points this often ...
MOST_ROUNDINGS = 128.0
#: ... unless it covers no more than this share of its knot span: weights that differ by many decades.
LEAST_SHARE = 2.0**-20
#: More pieces than this and a curve is refused: it would take more memory than it is worth.
MAX_ROWS = 2_000_000
#: Chebyshev nodes a piece; the first ARC_TERMS - 1 coefficients are kept, the others must have died out.
NODES = 16
#: Largest Chebyshev coefficient that may be dropped, relative to the largest speed on the piece.
TAIL = 1e-14
#: ... or, as an arc length, relative to the size of the whole curve: below the rounding of s nothing is gained.
NEGLIGIBLE = 5e-16
#: Times what may be dropped that a Bernstein coefficient of a speed may be below 0: it carries more rounding.
BELOW = 10.0
#: Bisections of a knot span; a cusp inside a span is closed in on until it is NEGLIGIBLE, well before this.
MAX_DEPTH = 60


def _chebyshev_matrices() -> tuple[Array, Array, Array]:
    """Nodes (16,), values -> Chebyshev coefficients (16, 16), coefficients -> power form of the integral (11, 10)."""
    angles = (np.arange(NODES) + 0.5) * math.pi / NODES
    nodes = np.cos(angles)
    transform = 2.0 / NODES * np.cos(np.outer(np.arange(NODES), angles))
    transform[0] *= 0.5
    integral = np.zeros((ARC_TERMS, ARC_TERMS - 1))
    for k, each in enumerate(np.eye(ARC_TERMS - 1)):
        power = np.polynomial.chebyshev.cheb2poly(np.polynomial.chebyshev.chebint(each[: k + 1], lbnd=-1.0))
        integral[: k + 2, k] = power
    return nodes, transform, integral


def _bernstein_matrix() -> Array:
    """Chebyshev -> Bernstein coefficients on both halves, (20, 10): a polynomial is nowhere below the least of them."""
    order = np.arange(ARC_TERMS - 1)
    x, binomials = order[:, None] / order[-1], [math.comb(ARC_TERMS - 2, k) for k in order]
    halves = np.polynomial.chebyshev.chebvander(x.T - [[1.0], [0.0]], ARC_TERMS - 2)
    return np.concatenate(np.linalg.solve(binomials * x**order * (1.0 - x) ** order[::-1], halves))


CHEBYSHEV_NODES, CHEBYSHEV_TRANSFORM, CHEBYSHEV_INTEGRAL = _chebyshev_matrices()
CHEBYSHEV_BERNSTEIN = _bernstein_matrix()


@dataclass(frozen=True)
class Spans:
    """Knot spans that are not empty, or parts of them, of curves of one degree.

    Parameters
    ----------
    flat : Flat
        Arrays of the curves.
    degree, rational : int
        Of all of them; rational is 0 or 1.
    curve, knot, point : (n,) array of int
        Number of the curve, and where the span's 2 p + 2 knots and p + 1 control points begin in `flat`.
    low, high, share : (n,) array
        Interval of u, and which share of its knot span it is.
    """

    flat: Flat
    degree: int
    rational: int
    curve: IntArray
    knot: IntArray
    point: IntArray
    low: Array
    high: Array
    share: Array

    @classmethod
    def of(cls, flat: Flat) -> list[Spans]:
        """All knot spans, those of curves of one degree, rational or not, together."""
        owner = np.repeat(np.arange(len(flat)), np.diff(flat.point_starts))
        point = np.arange(len(flat.points)) - flat.degrees[owner]
        knot = flat.knot_starts[owner] + (point - flat.point_starts[owner])
        last = knot + flat.degrees[owner]  # the knot at which the span begins
        wide = (point >= flat.point_starts[owner]) & (flat.knots[last] < flat.knots[last + 1])
        kind = 2 * flat.degrees + flat.rational
        found = []
        for each in np.unique(kind).tolist():
            chosen = np.flatnonzero(wide & (kind[owner] == each))
            low, high = flat.knots[last[chosen]], flat.knots[last[chosen] + 1]
            share = np.ones(len(chosen))
            found.append(cls(flat, each // 2, each % 2, owner[chosen], knot[chosen], point[chosen], low, high, share))
        return found

    def __len__(self) -> int:
        return len(self.curve)

    @property
    def line(self) -> bool:
        """Whether they are straight: each its own arc-length piece."""
        return self.degree == 1 and not self.rational

    def chosen(self, index: slice | IntArray | BoolArray) -> Spans:
        """Some of them."""
        names = ("curve", "knot", "point", "low", "high", "share")
        return replace(self, **{name: getattr(self, name)[index] for name in names})

    def halves(self) -> Spans:
        """Both halves of each."""
        twice = self.chosen(np.repeat(np.arange(len(self)), 2))
        middle, first = 0.5 * (twice.low + twice.high), np.arange(len(twice)) % 2 == 0
        low, high = np.where(first, twice.low, middle), np.where(first, middle, twice.high)
        return replace(twice, low=low, high=high, share=0.5 * twice.share)

    def columns(self, shape: Shape) -> Array:
        """Interval, origin and coefficients as columns (width, n) of a table of `shape`; arc length columns are 0."""
        points, p, axes = self.flat.points, self.degree, self.flat.points.shape[1]
        out = np.zeros((width(shape), len(self)))
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        out[LOW], out[HIGH], out[MIDDLE], out[SCALE] = self.low, self.high, middle, 2.0 / (self.high - self.low)
        out[ORIGIN : ORIGIN + axes] = points[self.point + p // 2].T
        local = np.empty((p + 1, axes + self.rational, len(self)))
        for i in range(p + 1):
            local[i, :axes] = points[self.point + i].T
            local[i, :axes] -= out[ORIGIN : ORIGIN + axes]
            if self.rational:
                local[i, axes] = self.flat.weights[self.point + i]
                local[i, :axes] *= local[i, axes]
        knots = self.flat.knots[self.knot + np.arange(2 * p + 2)[:, None]]
        every = coefficients(out, shape)
        every[: axes + self.rational, : p + 1] = power_form(knots, local, middle, half).transpose(1, 0, 2)
        if shape[3] > self.rational:
            every[axes, 0] = 1.0
        return out

    def own(self, c: Array, shape: Shape) -> tuple[Array, Shape]:
        """Coefficients (axes + rational, degree + 1, n) of columns of `shape`, and the shape, of these curves alone."""
        axes = shape[1]
        narrow = coefficients(c, shape)[: axes + self.rational, : self.degree + 1]
        return narrow, (self.degree, axes, shape[2], self.rational)

    def keep_digits(self, c: Array, shape: Shape) -> BoolArray:
        """Whether columns of `shape` give points as good as the rounding of the control points, (n,).

        (1 + share)^p sum_k |w_k| / min w  is how often that comes back, at most; w is 1 in polynomials.
        """
        growth = (1.0 + self.share) ** self.degree
        held: BoolArray = growth <= MOST_ROUNDINGS
        if self.rational:
            weights = self.own(c, shape)[0][-1:]
            total = np.abs(weights[0]).sum(axis=0)
            least = taylor(weights[:, :, None], 0, np.linspace(-1.0, 1.0, 5)[:, None], 0)[0].min(axis=(0, 1))
            held &= growth * total <= MOST_ROUNDINGS * np.minimum(least, total)
        return held | (self.share <= LEAST_SHARE)


def power_form(knots: Array, points: Array, middle: Array, half: Array) -> Array:
    """Coefficients of t^k, t = (u - middle) / half, of spans' polynomials: out[k] = half^k C^(k)(middle) / k!.

    knots (2 p + 2, n) and points (p + 1, columns, n) are those of the spans; out (p + 1, columns, n).
    The derivatives come from differences of control points over their own knots (The NURBS Book, 2nd ed., eq. 3.8)
    and de Boor's recursion on them: a narrow span beside wide ones loses no digits, as a Bezier form of it would.
    """
    p = len(points) - 1
    out = np.empty_like(points)
    factor = np.ones_like(middle)
    for k in range(p + 1):
        # points are the control points k ... p of the k-th derivative, a spline of degree p - k
        work = points
        for r in range(1, p - k + 1):
            left, right = knots[k + r : p + 1], knots[p + 1 : 2 * p - k + 2 - r]
            across = right - left
            # both from their own end: weights of very different size keep their digits
            work = ((right - middle) / across)[:, None] * work[:-1] + ((middle - left) / across)[:, None] * work[1:]
        out[k] = factor * work[0]
        factor = factor * (half / (k + 1))
        across = knots[p + 1 : 2 * p - k + 1] - knots[k + 1 : p + 1]
        points = (p - k) * (points[1:] - points[:-1]) / across[:, None]
    return out


#: |dC/dt| (..., n) of coefficients (columns, degree + 1, ..., n), of a shape, at t.
Speed = Callable[[Array, Shape, Array], Array]


def fits(spans: Spans, c: Array, shape: Shape, sizes: Array, speed: Speed = speed) -> BoolArray:
    """Fit |dC/dt| on each piece by a polynomial of degree 9, and write its integral into the columns.

    Parameters
    ----------
    spans : Spans
        The pieces.
    c : (width, n) array
        Their columns.
    shape : Shape
        Of the table.
    sizes : (n,) array
        Of their curves, mm; lines need none.
    speed : callable, optional
        What the length is the integral of.

    Returns
    -------
    (n,) array of bool
        Whether it is good enough.
    """
    a, own = spans.own(c, shape)
    if spans.line:
        c[ARC] = c[ARC + 1] = speed(a, own, np.zeros(1))
        return np.ones(len(spans), dtype=bool)
    values = speed(a[:, :, None], own, CHEBYSHEV_NODES[:, None])
    series = _times(CHEBYSHEV_TRANSFORM, values)
    kept, tail = series[: ARC_TERMS - 1], np.abs(series[ARC_TERMS - 1 :]).max(axis=0)
    c[ARC : ARC + ARC_TERMS] = _times(CHEBYSHEV_INTEGRAL, kept)
    allowed = np.maximum(TAIL * values.max(axis=0), NEGLIGIBLE * sizes)
    # a cusp between an end and its node, or two cusps between two nodes, are not seen by the nodes: all lie on
    # one smooth line, which falls below zero where the speed turns back up
    lowest = _times(CHEBYSHEV_BERNSTEIN, kept).min(axis=0)
    return np.asarray((tail <= allowed) & (lowest >= -BELOW * allowed) & spans.keep_digits(c, shape))


def _times(matrix: Array, columns: Array) -> Array:
    """A product of matrices, term by term: the bits of a column hang on no other one and on no processor."""
    out = np.zeros((len(matrix), columns.shape[1]))
    for k, each in enumerate(columns):
        out += matrix[:, k, None] * each
    return out


def halved(spans: Spans, shape: Shape, holds: Callable[[Spans, Array], BoolArray]) -> Iterator[tuple[IntArray, Array]]:
    """Bisect pieces until each is good.

    Parameters
    ----------
    spans : Spans
        To begin with.
    shape : Shape
        Of the table.
    holds : callable
        Of spans and their columns (width, n), whether each is good, (n,).

    Yields
    ------
    curve : (n,) array of int
        Whose the pieces are.
    columns : (width, n) array
        Of the pieces.

    Raises
    ------
    CurveError
        For a curve that would need more of them than MAX_ROWS.
    """
    for some in chunks(len(spans), BLOCK):
        part, made = spans.chosen(some), 0
        for depth in range(MAX_DEPTH + 1):
            if made + len(part) > MAX_ROWS:
                worst = int(np.bincount(part.curve).argmax())
                raise CurveError(f"curve {worst} would need more than {MAX_ROWS} pieces; simplify it")
            c = part.columns(shape)
            good = holds(part, c) | (part.low >= c[MIDDLE]) | (part.high <= c[MIDDLE]) | (depth == MAX_DEPTH)
            if good.all():
                yield part.curve, c
                break
            yield part.curve[good], c[:, good]
            made += int(np.count_nonzero(good))
            part = part.chosen(~good).halves()


def compensated_sums(steps: Array) -> Array:
    """Sum up steps; the roundings of the running sum are summed and put back.

    Parameters
    ----------
    steps : (n,) array
        x.

    Returns
    -------
    (n + 1,) array
        0, x_1, x_1 + x_2, ...

    References
    ----------
    .. [1] Ogita, Rump, Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26(6), 2005, doi 10.1137/030601818,
       algorithm 4.4.
    """
    sums = np.concatenate([[0.0], np.cumsum(steps)])
    before, after = sums[:-1], sums[1:]
    added = after - before
    lost = (before - (after - added)) + (steps - added)
    sums[1:] += np.cumsum(lost)
    return sums


def _table(flat: Flat, shape: Shape, holds: Callable[[Spans, Array], BoolArray]) -> tuple[Array, IntArray]:
    """Pieces that hold, of all curves in order, (pieces, width), and first and last row of each curve (n, 2)."""
    groups = Spans.of(flat)
    table, curves, last = np.empty((sum(map(len, groups)), width(shape))), [], 0
    for curve, c in itertools.chain.from_iterable(halved(spans, shape, holds) for spans in groups):
        first, last = last, last + len(curve)
        if last > len(table):
            table = np.concatenate([table, np.empty((last, width(shape)))])
        table[first:last] = c.T
        curves.append(curve)
    curve = np.concatenate(curves)
    order = np.lexsort((table[:last, LOW], curve))
    # of a million lines, in order as they are, a second copy would be felt
    table = table[:last] if np.all(order[1:] > order[:-1]) else table[order]
    counts = np.bincount(curve, minlength=len(flat))
    return table, read_only(np.cumsum(counts)[:, None] - np.column_stack([counts, np.ones_like(counts)]))


def span_pieces(flat: Flat, shape: Shape) -> Pieces:
    """Make pieces of the knot spans of all curves, some in parts.

    Parameters
    ----------
    flat : Flat
        Arrays of the curves.
    shape : Shape
        Of the table, see `kernels.layout`.

    Returns
    -------
    Pieces
        Without arc lengths.
    """
    table, rows = _table(flat, shape, lambda part, c: part.keep_digits(c, shape))
    return Pieces(read_only(table), shape, rows)


def arc_pieces(flat: Flat, shape: Shape, curves: Sequence[Spline], where: str = "", speed: Speed = speed) -> Pieces:
    """Make arc-length pieces of all curves.

    Parameters
    ----------
    flat : Flat
        Arrays of the curves.
    shape : Shape
        Of the table, see `kernels.layout`.
    curves : sequence of NurbsCurve
        The same curves.
    where : str, optional
        How errors begin, filled in with the number of the curve.
    speed : callable, optional
        What the length is the integral of.

    Returns
    -------
    Pieces
        By arc length, mm.

    Raises
    ------
    CurveError
        For a curve without length, or one that would need too many pieces.
    """
    return _placed(*_fitted(flat, shape, curves, where, speed), shape)


def fit_together(curves: Sequence[Spline]) -> None:
    """Fit the arc lengths of many curves in one go; each keeps its own as `NurbsCurve.arc`, to the bit.

    Parameters
    ----------
    curves : sequence of NurbsCurve
        The CurveError of a curve without length comes when that curve is used.
    """
    kinds: dict[Shape, list[Spline]] = {}
    for curve in {id(each): each for each in curves if "arc" not in vars(each)}.values():
        kinds.setdefault(curve._shape, []).append(curve)
    for shape, some in kinds.items():
        if len(some) == 1:
            continue
        try:
            table, rows = _fitted(Flat.of(some), shape, some, "", speed)
        except CurveError:
            continue
        for curve, (first, last) in zip(some, rows.tolist(), strict=True):
            own = read_only(np.array([[0, last - first]]))
            vars(curve)["arc"] = _placed(table[first : last + 1].copy(), own, shape)


def _placed(table: Array, rows: IntArray, shape: Shape) -> Pieces:
    """Pieces of curves one behind the other, of a table whose column START holds their lengths."""
    lengths = table[:, START].copy()
    starts = compensated_sums(lengths)
    table[:, START] = starts[:-1]
    starts[-1] = starts[-2] + lengths[-1]  # the length is S at the end, to the bit
    return Pieces(read_only(table), shape, rows, read_only(starts[np.append(rows[:, 0], len(table))]))


def _fitted(flat: Flat, shape: Shape, curves: Sequence[Spline], where: str, speed: Speed) -> tuple[Array, IntArray]:
    """Pieces of all curves with their lengths in the column START, and first and last row of each; see `arc_pieces`."""
    straight = shape[0] == 1 and not shape[3]
    sizes = np.zeros(len(flat)) if straight else flat.sizes(slice(shape[2]))

    def holds(part: Spans, c: Array) -> BoolArray:
        good = fits(part, c, shape, sizes[part.curve], speed)
        low, high = ((c[k] - c[MIDDLE]) * c[SCALE] for k in (LOW, HIGH))
        c[ARC] -= arc(c, low)  # t at the ends is not quite -1 and 1 if the middle had to be rounded
        c[START] = arc(c, high)
        return np.asarray(good | ~np.isfinite(c[START]))

    table, rows = _table(flat, shape, holds)
    lengths = np.add.reduceat(table[:, START], rows[:, 0])
    for bad, why in (
        (~np.isfinite(lengths), "is too long: its length is not finite; its coordinates are too large"),
        (~(lengths > 0.0), "has no length"),
    ):
        if bad.any():
            i = int(np.argmax(bad))
            raise CurveError(f"{where.format(i)}{curves[i]!r} {why}")
    return table, rows

"""A table of pieces as arrays: which piece holds a place, points and derivatives, arc length and its inverse there.

The rows of a table are laid out as `kernels.layout` says. Places are taken in chunks that stay in the cache, each with
the columns of its rows, (width, n), or (width, 1) where all lie on one row. Every formula works element by element, so
that the bits of a place do not depend on its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.errors import InputError
from splinefeed.kernels.layout import ARC, ARC_TERMS, HIGH, LOW, MIDDLE, ORIGIN, SCALE, START, Shape
from splinefeed.records import Array, IntArray
from splinefeed.records.arrays import chunks, dot

#: From so many places a row on, those in order are gathered as runs.
LONG = 64
#: Newton steps of an inversion before it is left to bisections, and how many these are.
FREE_STEPS, BISECTIONS = 6, 54
#: A Newton step in t, which runs over [-1, 1], after which S is off by its square times S'' / 2: rounding of the piece.
SMALL_STEP = 1e-8


def columns(table: Array, row: IntArray) -> Array:
    """Gather rows of a table as contiguous columns.

    Parameters
    ----------
    table : (pieces, width) array
        The table.
    row : (n,) array of int
        The rows, at least 1.

    Returns
    -------
    (width, n) array
        Or (width, 1) if all are one.
    """
    first, last = int(row.min()), int(row.max()) + 1
    if last - first == 1:
        return np.ascontiguousarray(table[first:last].T)
    if LONG * (last - first) < len(row) and not np.any(row[1:] < row[:-1]):  # long runs: faster than one by one
        return np.ascontiguousarray(table[first:last].T).repeat(np.bincount(row - first), axis=1)
    return np.ascontiguousarray(table[row].T)


def coefficients(c: Array, shape: Shape) -> Array:
    """Take coefficients of t^k out of columns.

    Parameters
    ----------
    c : (width, n) array
        Columns of a table.
    shape : Shape
        Of the table.

    Returns
    -------
    (axes + rational, degree + 1, n) array
        Of the axes, and of the weight if rational.
    """
    degree, axes, _, rational = shape
    return c[ORIGIN + axes :].reshape(axes + rational, degree + 1, -1)


def taylor(a: Array, rational: int, t: Array, order: int) -> list[Array]:
    """Compute Taylor coefficients C^(k)(t) / k! of A / w, by Horner's rule on all of them at once.

    Parameters
    ----------
    a : (axes + rational, degree + 1, ...) array
        Coefficients of A, and of w behind them.
    rational : int
        Whether there is a w.
    t : (...) array
        Where.
    order : int
        The highest k.

    Returns
    -------
    list of (axes, ...) array
        For k = 0 ... order.

    Notes
    -----
    The recurrence is

        C_k = (A_k - sum_{i=1..k} w_i C_{k-i}) / w_0

    References
    ----------
    .. [1] The NURBS Book, 2nd ed., eq. 4.8, over k!.
    """
    out = [a[:, -1]]
    for k in range(a.shape[1] - 2, -1, -1):
        new = [out[-1]] if len(out) <= order else []
        for j in range(len(out) - 1, 0, -1):
            out[j] = out[j] * t
            out[j] += out[j - 1]
        out[0] = out[0] * t
        out[0] += a[:, k]
        out += new
    out += [np.zeros_like(out[0])] * (order + 1 - len(out))
    if not rational:
        return out
    weights = [each[-1] for each in out]
    inverse = 1.0 / weights[0]
    quotients: list[Array] = []
    for k, each in enumerate(out):
        value = each[:-1]
        for i in range(1, k + 1):
            value = value - weights[i] * quotients[k - i]
        quotients.append(value * inverse)
    return quotients


def speed(a: Array, shape: Shape, t: Array) -> Array:
    """|dC/dt|, mm, over the axes that make the length; a (axes + rational, degree + 1, ..., n), t that fits them."""
    _, axes, measured, rational = shape
    some = a if measured == axes else a[[*range(measured), *range(axes, axes + rational)]]
    first = taylor(some, rational, t, 1)[1]
    return np.sqrt(dot(first, first))


def derivatives(c: Array, shape: Shape, t: Array, order: int, out: Array) -> None:
    """Compute points and derivatives by u.

    Parameters
    ----------
    c : (width, n) array
        Columns of a table.
    shape : Shape
        Of the table.
    t : (n,) array
        Where, in [-1, 1].
    order : int
        Of the highest derivative.
    out : (n, order + 1, axes) array
        Out: what was computed.
    """
    found = taylor(coefficients(c, shape), shape[3], t, order)
    out[:, 0] = (found[0] + c[ORIGIN : ORIGIN + shape[1]]).T
    factor = 1.0
    for k in range(1, order + 1):
        factor = factor * (k * c[SCALE])
        out[:, k] = (found[k] * factor).T


def arc(c: Array, t: Array) -> Array:
    """Compute S - START: sum_k arc_k t^k, even and odd terms apart.

    Parameters
    ----------
    c : (width, n) array
        Columns of a table.
    t : (n,) array
        Where, in [-1, 1].

    Returns
    -------
    (n,) array
        mm.
    """
    a = c[ARC : ARC + ARC_TERMS]
    x = t * t
    even: Array = a[10] * x
    odd: Array = a[9] * x
    even += a[8]
    odd += a[7]
    for k in (6, 4, 2):
        even *= x
        even += a[k]
        odd *= x
        odd += a[k - 1]
    even *= x
    even += a[0]
    odd *= t
    even += odd
    return even


def place_on(c: Array, length: Array, s: Array) -> Array:
    """Find u on pieces at a length; the ends are met exactly.

    Parameters
    ----------
    c : (width, n) array
        Columns of the pieces.
    length : (n,) array
        How long they are, mm.
    s : (n,) array
        Lengths along the path, mm.

    Returns
    -------
    (n,) array
        u.
    """
    ahead = s - c[START]
    inside = ahead > 0.0
    inside &= ahead < length
    u = t_behind(c[ARC:ORIGIN], length, ahead)
    u /= c[SCALE]
    u += c[MIDDLE]
    np.maximum(u, c[LOW], out=u)
    np.minimum(u, c[HIGH], out=u)
    return u if inside.all() else np.where(inside, u, np.where((ahead <= 0.0) & (length > 0.0), c[LOW], c[HIGH]))


def t_behind(a: Array, length: Array, ahead: Array) -> Array:
    """t (n,) in [-1, 1] at which S is `ahead` (n,), mm, behind the start of pieces as long as `length`; see `inverted`.

    S is nearly straight over a piece: Newton's method begins where its first terms beyond that are taken off.
    """
    ahead = np.minimum(np.maximum(ahead, 0.0), length)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = ahead / length
        x += x - 1.0
        bent = a[3] * x
        bent += a[2]
        bent *= x * x - 1.0
        bent /= a[1] + 2.0 * a[2] * x
        x -= bent
        return inverted(a, ahead, np.minimum(np.maximum(x, -1.0, out=x), 1.0, out=x))


def inverted(a: Array, wanted: Array, t: Array) -> Array:
    """t (n,) in [-1, 1] with sum_k a_k t^k = wanted (n,), by Newton's method from t; a (terms, n) or (terms, 1).

    t <- t - (S(t) - wanted) / S'(t). What has not converged after FREE_STEPS, as where S' nearly vanishes, is found by
    bisection. A place that has converged is not changed again.
    """
    out, at = t, None  # numbers of those that have not settled, once some have
    for _ in range(FREE_STEPS):
        step, slope = _rest_and_slope(a, wanted, t)
        step /= slope
        t = t - step
        np.maximum(t, -1.0, out=t)
        np.minimum(t, 1.0, out=t)
        if at is None:
            out = t
        else:
            out[at] = t
        settled = np.abs(step, out=step) < SMALL_STEP
        if settled.all():
            return out
        if settled.any():
            go = ~settled
            at, wanted, t = np.flatnonzero(go) if at is None else at[go], wanted[go], t[go]
            a = a if a.shape[1] == 1 else a[:, go]
    low, high = np.full_like(t, -1.0), np.ones_like(t)
    for _ in range(BISECTIONS):
        t = 0.5 * (low + high)
        below = _rest_and_slope(a, wanted, t)[0] < 0.0
        low, high = np.where(below, t, low), np.where(below, high, t)
    if at is None:
        return high
    out[at] = high
    return out


def _rest_and_slope(a: Array, wanted: Array, t: Array) -> tuple[Array, Array]:
    """sum_k a_k t^k - wanted and its slope by t."""
    value = a[-1] * t
    slope = value.copy()
    value += a[-2]
    slope += value
    value *= t
    value += a[-3]
    for k in range(len(a) - 4, -1, -1):
        slope *= t
        slope += value
        value *= t
        value += a[k]
    value -= wanted
    return value, slope


def clipped(
    values: ArrayLike, low: ArrayLike, high: ArrayLike, slack: ArrayLike, what: str, of: str, unit: str = ""
) -> Array:
    """Check that values are inside an interval; what is outside by rounding is clipped.

    Parameters
    ----------
    values : array_like
        (...).
    low, high : array_like
        The ends, (...) or one each.
    slack : array_like
        What counts as rounding, (...) or one.
    what, of : str
        What the values are, and what the interval is, for the message.
    unit : str, optional
        For the message.

    Returns
    -------
    (...) array
        The values as floats.

    Raises
    ------
    InputError
        For one that is outside.
    """
    try:
        given = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: expected numbers, got {type(values).__name__} ({error})") from None
    outside = ~((given >= np.subtract(low, slack)) & (given <= np.add(high, slack)))
    if np.any(outside):
        value, first, last = (np.broadcast_to(each, given.shape)[outside].flat[0] for each in (given, low, high))
        raise InputError(f"{what} {value:g}{unit} is outside {of} [{first:g}, {last:g}]{unit}")
    return np.clip(given, low, high)


def is_left(side: str, order: int = 0) -> bool:
    """Tell whether the piece on the left of a knot is wanted.

    Parameters
    ----------
    side : str
        "left" or "right".
    order : int, optional
        Of derivatives, 0 to 3.

    Returns
    -------
    bool
        Whether it is.

    Raises
    ------
    InputError
        For another side, or an order of derivatives.
    """
    if order not in (0, 1, 2, 3):
        raise InputError(f"order is {order!r}; expected 0 to 3")
    if side not in ("right", "left"):
        raise InputError(f"side is {side!r}; choose 'right' or 'left'")
    return side == "left"


class Pieces:
    """A table of pieces.

    Parameters
    ----------
    table : (pieces, width) array
        See `kernels.layout`.
    shape : Shape
        Of the table.
    rows : (curves, 2) array of int
        First and last row of each curve.
    curve_starts : (curves + 1,) array, optional
        mm: where each curve starts, and the length of all at last, of arc-length pieces.
    """

    def __init__(self, table: Array, shape: Shape, rows: IntArray, curve_starts: Array | None = None) -> None:
        self.table, self.shape, self.rows = table, shape, rows
        self.curve_starts = np.zeros(len(rows) + 1) if curve_starts is None else curve_starts

    @property
    def length(self) -> float:
        """Length of all, mm."""
        return float(self.curve_starts[-1])

    @cached_property
    def starts(self) -> Array:
        """Arc length at which each piece starts, mm, (pieces,)."""
        return np.ascontiguousarray(self.table[:, START])

    @cached_property
    def lengths(self) -> Array:
        """Length of each piece, mm, (pieces,), rounded as s is at its ends."""
        out = np.empty(len(self.table))
        for part in chunks(len(out)):
            c = np.ascontiguousarray(self.table[part, : ARC + ARC_TERMS].T)
            out[part] = (c[START] + arc(c, (c[HIGH] - c[MIDDLE]) * c[SCALE])) - c[START]
        return out

    @cached_property
    def _keys(self) -> Array:
        """Number of the curve and first parameter of each piece as one complex number, (pieces,): they sort so."""
        return np.repeat(np.arange(len(self.rows)), self.rows[:, 1] - self.rows[:, 0] + 1) + 1j * self.table[:, LOW]

    def row_at(self, curve: IntArray | None, u: Array, left: bool) -> IntArray:
        """Row (n,) that holds u (n,) of curves `curve` (n,), or of the only one; at a break the right or left one."""
        index = 0 if curve is None else curve
        row = np.searchsorted(self._keys, index + 1j * u, side="left" if left else "right") - 1
        return np.asarray(np.maximum(row, self.rows[index, 0]))

    def _columns_at(self, curve: IntArray | None, u: Array, left: bool) -> Iterator[tuple[slice, Array]]:
        """The columns of the rows that hold u (n,), chunk by chunk."""
        for part in chunks(len(u)):
            row = self.row_at(None if curve is None else curve[part], u[part], left)
            yield part, columns(self.table, row)

    def evaluate(self, curve: IntArray | None, u: Array, order: int, left: bool) -> Array:
        """Points and derivatives by u, (n, order + 1, axes), at u (n,) of the curves `curve` (n,), or of the one."""
        out = np.empty((len(u), order + 1, self.shape[1]))
        for part, c in self._columns_at(curve, u, left):
            derivatives(c, self.shape, (u[part] - c[MIDDLE]) * c[SCALE], order, out[part])
        return out

    def lengths_at(self, curve: IntArray | None, u: Array) -> Array:
        """S, mm, (n,) at u (n,) of the curves `curve` (n,), or of the one."""
        out = np.empty(len(u))
        for part, c in self._columns_at(curve, u, False):
            out[part] = c[START] + arc(c, (u[part] - c[MIDDLE]) * c[SCALE])
        return out

    def parameters(self, s: Array) -> Array:
        """u (n,) with S(u) = s (n,), mm."""
        out, row = np.empty(len(s)), self.row_by_length(s)
        for part in chunks(len(s)):
            c = columns(self.table, row[part])
            out[part] = place_on(c, self.lengths.take(row[part]), s[part])
        return out

    def derivatives_at(self, s: Array, order: int, row: IntArray | None = None) -> Array:
        """Points and derivatives by u, (n, order + 1, axes), at arc lengths s (n,), mm.

        On the piece on the right, or on these rows (n,): beyond the ends of a row the end holds.
        """
        row = self.row_by_length(s) if row is None else row
        out = np.empty((len(s), order + 1, self.shape[1]))
        for part in chunks(len(s)):
            c = columns(self.table, row[part])
            u = place_on(c, self.lengths.take(row[part]), s[part])
            derivatives(c, self.shape, (u - c[MIDDLE]) * c[SCALE], order, out[part])
        return out

    def row_by_length(self, s: Array) -> IntArray:
        """Row (n,) that holds the arc length s (n,), mm: the last one that starts there or before."""
        row = np.searchsorted(self.starts, s, side="right")
        row -= 1
        return np.maximum(row, 0, out=row)

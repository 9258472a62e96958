"""Layout of a table of pieces, one contiguous row a piece, as arrays and compiled leaves alike read it.

Row of a table (pieces, width), with `shape = (degree, axes, linear, rational)`:

    LOW, HIGH        parameter interval of the piece
    MIDDLE, SCALE    t = (u - MIDDLE) * SCALE runs over [-1, 1]
    START            arc length at LOW, mm
    ARC + k          S(u) - START = sum_k arc_k t^k, k = 0 ... 10
    ORIGIN + a       a point near the piece, one per axis
    then per column  (axes, and the weight if rational) degree + 1 coefficients of t^k

The curve is origin + A(t) / w(t). Taken about a near point and a middle parameter, the power basis loses no digits
that matter up to degree 12, and Horner's rule on it is the fastest evaluation there is.

The first `linear` axes make the arc length; those behind them are rotary. On a row over which no linear axis moves the
rotary ones make it, 1 degree counting as 1 mm. A table that has such rows says so by `linear` <= 0: minus the number of
linear axes. So a table without them, as almost all are, pays nothing for it.
"""

from __future__ import annotations

import math

LOW, HIGH, MIDDLE, SCALE, START, ARC = 0, 1, 2, 3, 4, 5
ARC_TERMS = 11
ORIGIN = ARC + ARC_TERMS

#: Length of a row on which only rotary axes move, for each rad: degrees.
DEGREES = 180.0 / math.pi

#: (degree, axes, linear axes or minus their number, 1 if rational else 0)
Shape = tuple[int, int, int, int]


def width(shape: Shape) -> int:
    """Number of columns of a table."""
    degree, axes, _, rational = shape
    return ORIGIN + axes + (degree + 1) * (axes + rational)

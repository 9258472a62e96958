"""Layout of a table of pieces, one contiguous row a piece, as arrays and compiled leaves alike read it.

Row of a table (pieces, width), with `shape = (degree, axes, measured, rational)`:

    LOW, HIGH        parameter interval of the piece
    MIDDLE, SCALE    t = (u - MIDDLE) * SCALE runs over [-1, 1]
    START            arc length at LOW, mm
    ARC + k          S(u) - START = sum_k arc_k t^k, k = 0 ... 10
    ORIGIN + a       a point near the piece, one per axis
    then per column  (axes, and the weight if rational) degree + 1 coefficients of t^k

The curve is origin + A(t) / w(t). Taken about a near point and a middle parameter, the power basis loses no digits
that matter up to degree 12, and Horner's rule on it is the fastest evaluation there is.

The first `measured` axes make the arc length: all of them in a path's own table, whose rotary axes count in mm (see
`curves.metric`).
"""

from __future__ import annotations

LOW, HIGH, MIDDLE, SCALE, START, ARC = 0, 1, 2, 3, 4, 5
ARC_TERMS = 11
ORIGIN = ARC + ARC_TERMS

#: (degree, axes, those that make the arc length, 1 if rational else 0)
Shape = tuple[int, int, int, int]


def width(shape: Shape) -> int:
    """Number of columns of a table."""
    degree, axes, _, rational = shape
    return ORIGIN + axes + (degree + 1) * (axes + rational)

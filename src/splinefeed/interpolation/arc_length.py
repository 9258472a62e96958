"""Newton's method on S(u) = l(t): no tick needs another one, so arrays of them go through each formula at once."""

from __future__ import annotations

import numpy as np

from splinefeed.curves.pieces import arc, columns, derivatives, place_on
from splinefeed.kernels.layout import HIGH, MIDDLE, SCALE, START
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Array, IntArray, TimeLaw
from splinefeed.records.arrays import chunks
from splinefeed.records.motion import derivative

#: A law that ends nearer to the end of the path than this share of its length ends there: the rounding of its pieces.
AT_END = 64.0 * 2.0**-52


def fill(track: Track, law: TimeLaw, time: Array) -> tuple[IntArray, Array, Array, Array, Array]:
    """Solve S(u) = l(t) at any times of a law.

    Parameters
    ----------
    track : Track
        To move along.
    law : TimeLaw
        Planned for this path.
    time : (n,) array
        Times t, s, in any order.

    Returns
    -------
    curve : (n,) array of int
        Index of the curve.
    u : (n,) array
        Its parameter.
    s : (n,) array
        Arc length of the tip, mm.
    feed : (n,) array
        Of the tip, mm/s.
    position : (n, axes) array
        mm, rotary axes rad.

    Notes
    -----
    S is a piecewise polynomial of degree 10, see `kernels.layout`. Newton's method runs over all times at once; the
    bits of a tick do not depend on the others. The idea of an arc-length table is that of [1]_.

    References
    ----------
    .. [1] B. Guenter, R. Parent, "Computing the arc length of parametric curves", IEEE Computer Graphics and
       Applications 10(3), 1990, doi 10.1109/38.55155.
    """
    path: Path = track.tip_path
    pieces, length, ends = path.arc_pieces, path.length, path.curve_starts[1:-1]
    curve, (u, s, feed) = np.zeros(len(time), dtype=np.int64), np.empty((3, len(time)))
    position = np.empty((len(time), len(path.axes)))
    for part in chunks(len(time)):
        wanted, feed[part] = motion(law, time[part])
        np.minimum(np.maximum(wanted, 0.0, out=wanted), length, out=wanted)
        late = time[part] >= law.duration * (1.0 - AT_END)
        if late.any():  # where a law ends is the end, not a rounding before it: a rotary axis may turn far in that
            wanted[late & (length - wanted <= AT_END * length)] = length
        row = pieces.row_by_length(wanted)
        c = columns(pieces.table, row)
        place = place_on(c, pieces.lengths.take(row), wanted)
        if wanted.max() >= length:
            place[wanted >= length] = pieces.table[-1, HIGH]
        t = (place - c[MIDDLE]) * c[SCALE]
        derivatives(c, pieces.shape, t, 0, position[part, None])
        u[part], s[part] = place, c[START] + arc(c, t)
        if len(ends):
            curve[part] = np.searchsorted(ends, wanted, side="right")
    s, feed, position = of_tip(path, s, feed, position)
    return curve, u, s, feed, track.positions(curve, u, s, position)


def of_tip(path: Path, s: Array, feed: Array, position: Array) -> tuple[Array, Array, Array]:
    """Convert what is found along the path into arc lengths and feeds of the tip, and positions.

    Parameters
    ----------
    path : Path
        With its metric.
    s : (n,) array
        Lengths along the path, mm.
    feed : (n,) array
        Rates of them, mm/s.
    position : (n, axes) array
        Positions times the metric.

    Returns
    -------
    s : (n,) array
        Arc lengths of the tip, mm.
    feed : (n,) array
        Feeds of the tip, mm/s.
    position : (n, axes) array
        mm, rotary axes rad.
    """
    none = np.zeros(len(s))
    s, feed, _, _ = path.of_tip(s, feed, none, none)
    return s, feed, position if np.all(path.metric == 1.0) else position / path.metric


def motion(law: TimeLaw, time: Array) -> tuple[Array, Array]:
    """Evaluate a law: s = sum_k c_k tau^k, tau = t - breaks[piece], and ds/dt.

    Parameters
    ----------
    law : TimeLaw
        Beyond its ends the end holds.
    time : (n,) array
        Times t, s.

    Returns
    -------
    s : (n,) array
        mm.
    feed : (n,) array
        mm/s, not below 0.
    """
    time = np.minimum(np.maximum(time, 0.0), law.duration)
    piece = np.minimum(np.searchsorted(law.breaks, time, side="right") - 1, len(law.coefficients) - 1)
    c, tau = columns(law.coefficients, piece).T, time - law.breaks[piece]
    return derivative(c, tau, 0), np.maximum(derivative(c, tau, 1), 0.0)

"""Straight stretches between rests: rows that stay the same are limits along the path, and seven phases the answer."""

from __future__ import annotations

import numpy as np

from splinefeed.feed.limits.rows import FREE
from splinefeed.feed.numbers import SAME
from splinefeed.feed.setting import INSIDE, Setting
from splinefeed.kernels.profile import UNSEEN
from splinefeed.records import LAW_COEFFICIENTS, Array, BoolArray

#: A tangent that turns by less than this, rad, over a whole stretch is that of a straight line; so with shares of rows.
STRAIGHT = 1e-12
#: Spans that are looked at together, so that memory stays small; phases of a profile.
TOGETHER, PHASES = 1 << 15, 7
#: Newton steps to the feed of a short stretch: from the right power of it one halves what is too much at least.
NEWTON = 60
#: Places of each span of a stretch that are looked at.
LOOKED = np.clip(np.linspace(0.0, 1.0, 4), INSIDE, 1.0 - INSIDE)


def straights(setting: Setting, marks: Array) -> tuple[BoolArray, Array, Array]:
    """Which stretches (m,) between rests at marks (m + 1,), mm, are straight, and their exact motions.

    Times of their seven phases (m, 7), s, and coefficients (m, 7, 6) of s in t; 0 where a stretch is not straight.
    """
    inner = setting.inside(float(marks[0]), float(marks[-1]))
    apart = np.minimum(*(np.abs(inner - marks[np.clip(np.searchsorted(marks, inner) + k, 0, None)]) for k in (-1, 0)))
    edges = np.sort(np.concatenate([marks, inner[apart > SAME * setting.track.length]]))
    found = np.concatenate(
        [_along(setting, edges[k : k + TOGETHER + 1]) for k in range(0, len(edges) - 1, TOGETHER)], 1
    )
    first = np.searchsorted(edges, marks[:-1])
    along, most = np.minimum.reduceat(found, first, axis=1), np.maximum.reduceat(found, first, axis=1)
    straight = np.all(np.isfinite(along), axis=0)
    with np.errstate(invalid="ignore"):
        straight &= np.all(most[5:] - along[5:] <= STRAIGHT, axis=0)  # the tangent
        straight &= np.all(most[:5] - along[:5] <= STRAIGHT * most[:5], axis=0) & (along[0] < FREE)
    spans, coefficients = np.zeros((len(straight), PHASES)), np.zeros((len(straight), PHASES, LAW_COEFFICIENTS))
    if np.any(straight):
        spans[straight], coefficients[straight] = seven_phases(np.diff(marks)[straight], *along[:5, straight])
        coefficients[straight, :, 0] += marks[:-1][straight, None]
    return straight, spans, coefficients


def _along(setting: Setting, edges: Array) -> Array:
    """Limits along the spans between edges (m + 1,), and their tangents: (5 + axes, m), NaN where one is not straight.

    Feed, acceleration, deceleration, jerk, deceleration jerk, by rows on q' and q'' alone: those along the path, and
    those of each axis by its share of the tangent.
    """
    length = np.diff(edges)
    s = edges[:-1, None] + length[:, None] * LOOKED
    limits, found = setting.limits, []
    d = setting.track.derivatives(s.ravel())
    for rising in (1.0, -1.0)[: 1 + (limits.jerk != limits.deceleration_jerk)]:
        rows = setting.rows(setting.places(s.ravel(), rising=np.full(s.size, rising), d=d, alone=True))
        linear, high, low = rows.linear[:, 1], rows.high, rows.low
        with np.errstate(divide="ignore"):
            up, down = (
                0.5 / np.max(np.abs(linear) / np.where(sign * linear > 0.0, high, -low), axis=0, initial=0.0)
                for sign in (1.0, -1.0)
            )
            found.append((np.sqrt(rows.top), up, down, 0.5 / np.max(np.abs(rows.jerk[:, 2]), axis=0, initial=0.0)))
    bent = np.max(np.abs(d[:, 2]), axis=1) * np.repeat(length, len(LOOKED))
    bent += rows.top * np.max(np.abs(rows.linear[:, 0]), axis=0, initial=0.0)
    values = np.stack([*found[0], found[-1][3], *d[:, 1].T]).reshape(-1, *s.shape)
    size = np.abs(values[:, :, 0])
    size[5:] = 1.0
    with np.errstate(invalid="ignore"):
        same = np.all(np.ptp(values, axis=2) <= STRAIGHT * size, axis=0)
    return np.where(same & (np.max(bent.reshape(s.shape), axis=1) <= STRAIGHT), values[:, :, 0], np.nan)


def seven_phases(
    length: Array, feed: Array, acceleration: Array, deceleration: Array, jerk: Array, deceleration_jerk: Array
) -> tuple[Array, Array]:
    """Profiles from rest to rest, as `SevenPhase` makes one: times (n, 7), s, and coefficients of s in t (n, 7, 6)."""
    rounding = 0.0
    for _ in range(2):  # the second time with the rounding of instants known
        up, down = (_lasting(a, j, rounding) for a, j in ((acceleration, jerk), (deceleration, deceleration_jerk)))
        peak = _peaks(length, feed, (acceleration, up), (deceleration, down))
        rise, fall = _ramp(peak, acceleration, up), _ramp(peak, deceleration, down)
        ways = 0.5 * peak * (2.0 * (rise[0] + fall[0]) + rise[1] + fall[1])
        cruise = np.where(peak == feed, np.maximum(length - ways, 0.0) / peak, 0.0)
        spans = np.stack([rise[0], rise[1], rise[0], cruise, fall[0], fall[1], fall[0]], axis=1)
        rounding = float(np.spacing(np.sum(spans)))
    c = np.zeros((len(length), PHASES, LAW_COEFFICIENTS))
    for (edge, middle, reached), j, way in ((rise, up, 1.0), (fall, down, -1.0)):
        # feeds and ways from rest, at the ends of the first two phases
        v1 = 0.5 * reached * edge
        v2 = v1 + reached * middle
        s1 = v1 * edge / 3.0
        s2 = s1 + middle * (v1 + 0.5 * reached * middle)
        s3 = s2 + edge * (v2 + reached * edge / 3.0)
        if way > 0.0:
            places, feeds, rows = (0.0 * s1, s1, s2), (0.0 * v1, v1, v2), (0, 1, 2)
            accelerations, jerks = (0.0 * v1, reached, reached), (j, 0.0 * j, -j)
            c[:, 3, 0], c[:, 3, 1] = s3, peak
        else:
            places, feeds, rows = (length - s3, length - s2, length - s1), (peak, v2, v1), (4, 5, 6)
            accelerations, jerks = (0.0 * v1, -reached, -reached), (-j, 0.0 * j, j)
        for k, *values in zip(rows, places, feeds, accelerations, jerks, strict=True):
            for order, (value, factorial) in enumerate(zip(values, (1.0, 1.0, 2.0, 6.0), strict=True)):
                c[:, k, order] = value / factorial
    return spans, c


def _ramp(rise: Array, acceleration: Array, jerk: Array) -> tuple[Array, Array, Array]:
    """Time of each jerk phase, time between them, and acceleration reached; see `kernels.profile.ramp`."""
    full = acceleration / jerk
    flat = rise >= acceleration * full
    reached = np.where(flat, acceleration, np.minimum(np.sqrt(jerk * rise), acceleration))
    return np.where(flat, full, reached / jerk), np.where(flat, rise / acceleration - full, 0.0), reached


def _peaks(length: Array, feed: Array, up: tuple[Array, Array], down: tuple[Array, Array]) -> Array:
    """The highest feed at which both ramps, of an acceleration and a jerk each, leave room: v/2 (Tu + Td) <= length.

    The way grows with v and is convex. A ramp takes 2 sqrt(v / J) at least, so that this bounds v from above, and
    Newton's steps come down to it.
    """
    highest = (length / (up[1] ** -0.5 + down[1] ** -0.5)) ** (2.0 / 3.0)
    peak = np.minimum(highest, feed)
    for _ in range(NEWTON):
        times = slopes = np.zeros(len(length))
        for a, j in (up, down):
            edge, middle, reached = _ramp(peak, a, j)
            times = times + 2.0 * edge + middle
            slopes = slopes + 1.0 / reached
        over = 0.5 * peak * times - length
        peak = np.where(over > 0.0, peak - over / (0.5 * (times + peak * slopes)), peak)
    return np.asarray(peak)


def _lasting(acceleration: Array, jerk: Array, rounding: float) -> Array:
    """`kernels.profile.lasting_jerk` for many: jerk with which the acceleration does not build up within a rounding."""
    share = rounding * jerk / acceleration
    calm = np.minimum(2.0 * jerk / (1.0 + np.sqrt(1.0 + 4.0 * share)), 0.25 * acceleration / max(rounding, 1e-300))
    return np.asarray(np.where(share > UNSEEN, calm, jerk))

"""Straight stretches between rests: rows that stay the same are limits along the path, and seven phases the answer."""

from __future__ import annotations

import numpy as np

from splinefeed.planner.conditions import INSIDE, Conditions
from splinefeed.planner.constants import SAME
from splinefeed.planner.profiles import TOGETHER, Profile, solve_in_row
from splinefeed.planner.rows import FREE
from splinefeed.records import Array, BoolArray

#: Places of each span of a stretch that are looked at.
LOOKED = np.clip(np.linspace(0.0, 1.0, 4), INSIDE, 1.0 - INSIDE)

#: What stands for an infinite limit where values are compared.
NO_LIMIT = 1e100


def straights(conditions: Conditions, marks: Array) -> tuple[BoolArray, Profile]:
    """Which stretches (m,) between rests at marks (m + 1,), mm, are straight, and the profiles of these."""
    inner = conditions.inside(float(marks[0]), float(marks[-1]))
    apart = np.minimum(*(np.abs(inner - marks[np.clip(np.searchsorted(marks, inner) + k, 0, None)]) for k in (-1, 0)))
    edges = np.sort(np.concatenate([marks, inner[apart > SAME * conditions.track.length]]))
    found = np.concatenate(
        [_along(conditions, edges[k : k + TOGETHER + 1]) for k in range(0, len(edges) - 1, TOGETHER)], 1
    )
    first = np.searchsorted(edges, marks[:-1])
    along, most = np.minimum.reduceat(found, first, axis=1), np.maximum.reduceat(found, first, axis=1)
    with np.errstate(invalid="ignore"):
        straight = np.all(most[5:] - along[5:] <= SAME, axis=0)  # the tangent
        straight &= np.all(most[:5] - along[:5] <= SAME * most[:5], axis=0) & (along[0] < FREE)
        straight &= np.all(np.minimum(along[1:3], along[3:5]) < NO_LIMIT, axis=0)
    limits = np.where(along[:5] < NO_LIMIT, along[:5], np.inf)[:, straight]
    return straight, solve_in_row(np.diff(marks)[straight], *limits, 0.0, 0.0)


def straight_ahead(conditions: Conditions, low: float, high: float) -> tuple[float, Array]:
    """Where the straight line from `low` ends, mm, at most at `high`, and its limits (5,), see `_along`.

    The line ends at `low` where the path is not straight there.
    """
    edges = np.concatenate([[low], conditions.inside(low, high), [high]])
    found = _along(conditions, edges)
    with np.errstate(invalid="ignore"):
        same = np.all(np.abs(found - found[:, :1]) <= SAME * np.maximum(np.abs(found[:, :1]), 1.0), axis=0)
    count = int(np.argmin(np.append(same, False)))
    return float(edges[count]), np.where(found[:5, 0] < NO_LIMIT, found[:5, 0], np.inf)


def _along(conditions: Conditions, edges: Array) -> Array:
    """Limits along the spans between edges (m + 1,), and their tangents: (5 + axes, m), NaN where one is not straight.

    Feed, acceleration, deceleration, jerk, deceleration jerk, by rows on q' and q'' alone: those along the path, and
    those of each axis by its share of the tangent; NO_LIMIT where there is none.
    """
    length = np.diff(edges)
    s = edges[:-1, None] + length[:, None] * LOOKED
    limits, found = conditions.limits, []
    d, x = conditions.along(s.ravel())
    for rising in (1.0, -1.0)[: 1 + (limits.jerk != limits.deceleration_jerk)]:
        rows = conditions.rows(s.ravel(), (d, x), rising=rising, alone=True)
        linear, high, low = rows.linear[:, 1], rows.high, rows.low
        with np.errstate(divide="ignore"):
            up, down = (
                0.5 / np.max(np.abs(linear) / np.where(sign * linear > 0.0, high, -low), axis=0, initial=0.0)
                for sign in (1.0, -1.0)
            )
            found.append((np.sqrt(rows.top), up, down, 0.5 / np.max(np.abs(rows.jerk[:, 2]), axis=0, initial=0.0)))
    bent = np.max(np.abs(d[:, 2]), axis=1) * np.repeat(length, len(LOOKED))
    bent += rows.top * np.max(np.abs(rows.linear[:, 0]), axis=0, initial=0.0)
    if rows.root is not None:
        bent += np.sqrt(rows.top) * np.max(np.abs(rows.root), axis=(0, 1), initial=0.0)
    own = slice(rows.jerks, None)  # limits of jerk of models have more than q''
    bent += np.max(np.abs(rows.jerk[own, :2]), axis=(0, 1), initial=0.0) * rows.top
    bent += np.max(np.abs(rows.jump[:, 0, own]), axis=(0, 1), initial=0.0)
    values = np.minimum(np.stack([*found[0], found[-1][3], *d[:, 1].T]), NO_LIMIT).reshape(-1, *s.shape)
    size = np.abs(values[:, :, 0])
    size[5:] = 1.0
    with np.errstate(invalid="ignore"):
        same = np.all(np.ptp(values, axis=2) <= SAME * size, axis=0)
    return np.where(same & (np.max(bent.reshape(s.shape), axis=1) <= SAME), values[:, :, 0], np.nan)

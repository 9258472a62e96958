"""Coordinates of a path, all that has limits of velocity, acceleration and jerk: one function makes their rows.

Each axis, each linear combination of axes, and the arc length s of the tip, whose velocity is the feed, is a coordinate
x(sigma) of the path's parameter. With q = sigma_dot^2, so that sigma_ddot = q'/2 and sigma_dddot = sqrt(q) q''/2:

    velocity      x' sqrt(q)
    acceleration  x' q'/2 + x'' q
    jerk          sqrt(q) (x' q''/2 + 3/2 x'' q' + x''' q)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from splinefeed.planner.rows import FREE, Rows
from splinefeed.records import Array, Limits

#: By how much jerk gives way beside a jump of the acceleration, in units of the jump over the period.
PEAK = 0.75 * 24.0 / 23.0


@dataclass(frozen=True, eq=False)
class Coordinates:
    """M coordinates: axes, coordinates of a tip that are none, combinations of axes; last the tip's arc length.

    Parameters
    ----------
    names : tuple of str
        Theirs.
    mix : (columns, k) array
        What of each column of derivatives makes each combination.
    v, a, d, j, dj : (m,) array
        Limits: velocity, acceleration, deceleration, jerk while speeding up and while slowing down.
    assumed : tuple of str, optional
        Names of axes that nothing given bounds, which have the least limits of the others.
    """

    names: tuple[str, ...]
    mix: Array
    v: Array
    a: Array
    d: Array
    j: Array
    dj: Array
    assumed: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, limits: Limits, axes: tuple[str, ...], counted: int, *, beside: tuple[str, ...] = (), alone: bool = True
    ) -> Coordinates:
        """Those of axes the first `counted` of which make the arc length of the tip; nothing limits those `beside`.

        Where axes may move `alone`, an axis beside others that no limit of acceleration or jerk bounds, neither its own
        nor one along the path, has the least one of the others, 1 rad for 1 mm: something must bound a motion in which
        it is the only one that moves.
        """
        sums = limits.combinations or {}
        v, a, j = (limits.of_axes(f"axis_{name}", axes) for name in ("velocity", "acceleration", "jerk"))
        slowing = limits.acceleration if limits.deceleration is None else limits.deceleration
        slowing_jerk = limits.jerk if limits.deceleration_jerk is None else limits.deceleration_jerk
        least = min(limits.acceleration, slowing), min(limits.jerk, slowing_jerk)
        own, whole = np.isfinite(a) | np.isfinite(j), bool(np.isfinite(min(least)))
        free = ~own & ~(whole & (np.arange(len(axes)) < counted))
        assumed = alone and bool(np.any(free)) and (whole or bool(np.any(own)))
        if assumed:
            a[free], j[free] = (min(float(np.min(each)), along) for each, along in zip((a, j), least, strict=True))
        none = np.full(len(beside), np.inf)
        mix = np.zeros((len(axes) + len(beside), len(sums)))
        for k, each in enumerate(sums.values()):
            mix[: len(axes), k] = each.on(axes)
        along = (limits.feed, limits.acceleration, slowing, limits.jerk, slowing_jerk)
        kinds = ("velocity", "acceleration", "acceleration", "jerk", "jerk")
        v, a, d, j, dj = (
            np.concatenate([axis, none, [getattr(one, kind) for one in sums.values()], [bound]])
            for axis, kind, bound in zip((v, a, a, j, j), kinds, along, strict=True)
        )
        named = tuple(axis for axis, is_free in zip(axes, free, strict=True) if is_free) if assumed else ()
        return cls((*axes, *beside, *sums, "path"), mix, v, a, d, j, dj, named)

    def along(self, d: Array, tip: Array) -> Array:
        """x', x'', x''' (3, m, n) of all of them from those of the track, d (n, 4, columns), and of the tip (3, n)."""
        own = d[:, 1:].transpose(1, 2, 0)
        sums = [np.sum(own * each[:, None], axis=1, keepdims=True) for each in self.mix.T]
        return np.concatenate([own, *sums, tip[:, None]], axis=1)


def rows_of(
    at: Coordinates, x: Array, feed: Array, jumps: tuple[Array, Array], period: float | None, rising: Array
) -> Rows:
    """Make rows of coordinates.

    Parameters
    ----------
    at : Coordinates
        The m coordinates.
    x : (3, m, n) array
        x', x'', x''' along the path.
    feed : (n,) array
        The programmed one, mm/s.
    jumps : two (2, m, n) arrays
        Of x' and of x'', each up and down, within a period of the place.
    period : float or None
        Servo period T, s.
    rising : (n,) array
        1 where the tip surely speeds up, -1 where it slows down, 0 where it may do either.

    Returns
    -------
    Rows
        At the n places.

    Notes
    -----
    A jump D of x'' makes the acceleration jump by D q, which the third difference of setpoints spreads over three
    periods T by the quadratic B-spline K, as D q K(t), of peak 3/4 / T. Jerk that gives way by PEAK D q / T for one
    period before and behind the jump makes room for it: PEAK times the integral of K over these two periods is at least
    T K at any instant, and equal to it in the middle, 23/24 PEAK = 3/4. A jump D of x' shows in the third difference
    with peaks of D sqrt(q) / T^2 of either sign, one after the other, and in the second one of D sqrt(q) / T.
    """
    x1, x2, x3 = x
    v = np.broadcast_to(at.v[:, None], x1.shape).copy()
    v[-1] = np.minimum(v[-1], feed)
    top = np.minimum(np.min((v / np.maximum(np.abs(x1), 1e-150)) ** 2, axis=0), FREE**2)
    some = np.isfinite(np.minimum(at.a, at.d))
    a, d = (np.minimum(each[some][:, None], FREE * FREE) for each in (at.a, at.d))
    unit = np.minimum(a, d)
    linear = np.stack([x2[some] / unit, 0.5 * x1[some] / unit], axis=1)
    low, high = (np.broadcast_to(np.minimum(each / unit, FREE), linear[:, 0].shape).copy() for each in (d, a))
    root = None
    if period is not None and np.any(jumps[0][:, some]):
        root = jumps[0][:, some] / period / unit
    some = np.isfinite(np.minimum(at.j, at.dj))
    up, down = at.j[some][:, None], at.dj[some][:, None]
    limit = np.where(rising > 0.0, up, np.where(rising < 0.0, down, np.minimum(up, down)))
    jerk = np.stack([x3[some], 1.5 * x2[some], 0.5 * x1[some]], axis=1) / limit[:, None]
    jump = np.zeros((2, 2, len(limit), len(feed)))
    if period is not None:
        turn = np.broadcast_to(np.sum(jumps[0][:, some], axis=0), (2, *limit.shape))
        jump = np.stack([turn / period**2, PEAK * jumps[1][:, some] / period], axis=1) / limit
    return Rows(
        top, top, np.full(len(feed), FREE**2), linear, -low, high, jerk, jump, len(linear), len(linear), len(jerk), root
    )

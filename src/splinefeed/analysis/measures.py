"""What setpoints are, beside their law: motion of the axes, limits that bind, feed ripple, drift and chord error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from splinefeed.checks import between
from splinefeed.checks.spans import EPSILON, SpanPlaces, spans_of
from splinefeed.limit_table import KINDS
from splinefeed.paths.path import Path
from splinefeed.records import Array, IntArray, Limits, Setpoints, TimeLaw

#: A limit binds where at least this share of it is used.
BINDS = 0.99
#: Ripple is measured where the feed is above this share of its top; near rest a step is smaller than the rounding of s.
FEED_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """What each axis does at each tick.

    Attributes
    ----------
    t : (n,) array
        s.
    velocity, acceleration, jerk : (n, axes) array
        mm/s, mm/s^2, mm/s^3; of rotary axes rad/s, rad/s^2, rad/s^3.

    Notes
    -----
    Differences of the setpoints, which are what a drive sees and `check` counts: velocity and jerk lie half a period
    behind their tick, `late`. Where there are none, at ends in motion and corners passed in motion, exact derivatives.

    References
    ----------
    .. [1] docs/check.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.Path.polyline([[0, 0], [10, 0]]), sf.Limits(feed=10, acceleration=100, jerk=1000))
    >>> run.motion.acceleration.shape
    (1201, 2)
    >>> round(float(run.motion.velocity[:, 0].max()), 6)
    10.0
    """

    t: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    def late(self, period: float) -> Array:
        """Return where velocity and jerk lie: half a period behind their tick.

        Parameters
        ----------
        period : float
            Of the servo, s.

        Returns
        -------
        (n,) array
            s.
        """
        return np.minimum(self.t + 0.5 * period, self.t[-1:])


@dataclass(frozen=True, eq=False)
class TipMotion:
    """What the law does at ticks, along the path of the tool tip.

    Attributes
    ----------
    t : (n,) array
        s.
    acceleration, jerk : (n,) array
        mm/s^2 and mm/s^3.
    """

    t: Array
    acceleration: Array
    jerk: Array


@dataclass(frozen=True, eq=False)
class LimitUse:
    """How much of each limit is used at each tick.

    Attributes
    ----------
    names : tuple of str
        The k limits as `check` names them, along the path first.
    t, s : (n,) array
        Time of the tick, s, and length, mm.
    share : (n, k) array
        value / limit, absolute where it has a sign.
    top : (n,) array
        Maximum-velocity curve at the place of the tick, mm/s, infinite where nothing limits: the highest feed that
        feed, centripetal, chord, velocity and acceleration limits leave there for any acceleration.
    counts : (k + 1,) array of int
        Ticks at which nothing binds, and at which each limit does; of a long motion those left out too.

    Notes
    -----
    A step of velocity at a corner counts at the tick next to it. The check measures all of it: see `checks.by_tick`.

    References
    ----------
    .. [1] docs/check.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> run = sf.run(sf.Path.polyline([[0, 0], [30, 0]]), sf.Limits(feed=10, acceleration=100, jerk=1000))
    >>> sorted(run.use.time_bound_by())
    ['acceleration', 'deceleration', 'feed', 'jerk', 'none']
    """

    names: tuple[str, ...]
    t: Array
    s: Array
    share: Array
    top: Array
    counts: IntArray

    @property
    def binding(self) -> IntArray:
        """Index into `names` of the limit that binds at each tick, (n,); -1 where none uses BINDS of its own."""
        share = self.share
        if not share.shape[1]:
            return np.full(len(share), -1, dtype=np.int64)
        most = np.argmax(share, axis=1)
        binds = share[np.arange(len(most)), most] >= BINDS
        return np.where(binds, most, -1).astype(np.int64)

    def time_bound_by(self) -> dict[str, float]:
        """Return the part of the time in which each limit binds, 0 to 1.

        Returns
        -------
        dict of str to float
            By name of the limit, those that never do left out; "none" for the rest.
        """
        none, *parts = (self.counts / max(int(self.counts.sum()), 1)).tolist()
        return {**{name: part for name, part in zip(self.names, parts, strict=True) if part > 0.0}, "none": none}


def maximum_velocity(
    first: Array,
    second: Array,
    slow: Mapping[str, Array],
    chord: Array,
    axes: tuple[str, ...],
    limits: Limits,
    feed: Array,
    period: float,
    tip: tuple[Array | float, Array | float] = (1.0, 0.0),
) -> Array:
    """Compute the maximum-velocity curve of the tip at n places.

    Parameters
    ----------
    first, second : (n, axes) array
        Derivatives of the axes by length, mm or rad per mm^k.
    slow : mapping of str to (n,) array
        What limits of PLACES bound, at 1 mm/s, by name.
    chord : (n,) array
        The curvature which chords see, 1/mm.
    axes : tuple of str
        Their names.
    limits : Limits
        Of the motion.
    feed : (n,) array
        Highest feed, mm/s.
    period : float
        Of the servo, s.
    tip : ((n,) array, (n,) array), optional
        The first two derivatives of the tip's arc length.

    Returns
    -------
    (n,) array
        mm/s.

    Notes
    -----
    An axis, or a combination of axes, has acceleration r' a + r'' q with q = v^2. Some a keeps all of them within A_i
    exactly where, for every two i, k taken with r' > 0,  q (r''_k / r'_k - r''_i / r'_i) <= A_k / r'_k + A_i / r'_i:
    the method of [1]_, by eliminating a. Torques are left out.

    References
    ----------
    .. [1] Bobrow, Dubowsky & Gibson 1985, doi:10.1177/027836498500400301.
    """
    bounded = limits.axis_bounds(axes)
    velocity, acceleration, _ = bounded.bounds
    first, second = bounded.of(first), bounded.of(second)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s1, s2 = (np.broadcast_to(each, len(first)) for each in tip)
        top = np.minimum(feed / s1, np.nanmin(velocity / np.abs(first), axis=1, initial=np.inf))
        square = top * top
        for name, value in slow.items():
            share = value / getattr(limits, name)
            square = np.minimum(square, share ** (-2.0 / KINDS[name].power) / s1**2)
        if limits.chord_error is not None:
            # the sagitta e of a chord v T on a circle: (v T / 2)^2 = e (2 / kappa - e)
            room = np.maximum(2.0 / chord - limits.chord_error, limits.chord_error)
            square = np.minimum(square, 4.0 * limits.chord_error * room / (period * s1) ** 2)
        sign = np.where(first < 0.0, -1.0, 1.0)
        r1, r2 = (np.column_stack([sign * r, own]).T for r, own in ((first, s1), (second, s2)))
        along = np.append(acceleration, max(limits.acceleration, limits.deceleration or 0.0))
        held = np.flatnonzero(np.isfinite(along))
        for i in held:
            square = np.where(r1[i] == 0.0, np.fmin(square, along[i] / np.abs(r2[i])), square)
        for i, k in combinations(held, 2):
            room = along[k] * r1[i] + along[i] * r1[k]
            square = np.fmin(square, room / np.abs(r1[i] * r2[k] - r1[k] * r2[i]))
        return np.asarray(s1 * np.sqrt(square))


@dataclass(frozen=True, eq=False)
class Ripple:
    """The actual feed of setpoints against the planned one.

    Attributes
    ----------
    t : (m,) array
        Start of each step that counts, s.
    relative : (m,) array
        (arc length of the step) / (planned step) - 1.
    floor : float
        The rounding of s over the smallest of these steps: the lowest possible ripple.
    rms : float
        Root mean square of `relative`, 0 if no step counts; of a long motion over all steps, those left out too.

    References
    ----------
    .. [1] docs/math/interpolators.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.Path.polyline([[0, 0], [10, 0]])
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> ripple = sf.analysis.feed_ripple(sf.interpolate(path, law), path, law)
    >>> ripple.max < 1e-9
    True
    """

    t: Array
    relative: Array
    floor: float
    rms: float

    @property
    def max(self) -> float:
        """Largest |relative|, 0 if no step counts."""
        return float(np.max(np.abs(self.relative), initial=0.0))


def steps(setpoints: Setpoints, path: Path) -> Array:
    """Measure the arc length along the path from each setpoint to the next.

    Parameters
    ----------
    setpoints : Setpoints
        n of them.
    path : Path
        On which they lie.

    Returns
    -------
    (n - 1,) array
        mm, negative where one goes back.

    Notes
    -----
    By quadrature of |C'(u)|, independent of the arc-length table that the interpolators use; see `spans`.
    """
    rows = spans_of(path)
    return rows.steps(*rows.place(setpoints.curve, setpoints.u))


def feed_ripple(setpoints: Setpoints, path: Path, law: TimeLaw, *, top: float | None = None) -> Ripple:
    """Compare each step's arc length with the law's, where the feed is above a tenth of its top.

    Parameters
    ----------
    setpoints : Setpoints
        Of the motion, or a part of it.
    path : Path
        On which they lie.
    law : TimeLaw
        That they follow.
    top : float, optional
        Highest feed of the motion, mm/s, where `setpoints` are a part of it.

    Returns
    -------
    Ripple
        Of m steps, (m,).

    Raises
    ------
    InputError
        Where setpoints and path do not go together.

    Notes
    -----
    relative_k = (S(u_{k+1}) - S(u_k)) / (l(t_{k+1}) - l(t_k)) - 1, by `steps`. The chord would be shorter by
    kappa^2 (V T)^2 / 24, which is not an error of the interpolator.

    References
    ----------
    .. [1] docs/math/interpolators.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> path = sf.shapes.circle(5)
    >>> law = sf.plan(path, sf.Limits(feed=10, acceleration=100, jerk=1000), period=1e-3)
    >>> setpoints = sf.interpolate(path, law, method="taylor-1")
    >>> round(sf.analysis.feed_ripple(setpoints, path, law).max, 3)
    0.022
    """
    top = float(np.max(setpoints.feed, initial=0.0)) if top is None else top
    planned = np.diff(law(setpoints.t))
    feed = np.minimum(law.feed(setpoints.t)[:-1], law.feed(setpoints.t)[1:])
    counts = feed > FEED_SHARE * top
    counts &= planned > 0.0
    actual = steps(setpoints, path)[counts]
    wanted = planned[counts]
    floor = EPSILON * path.length / float(wanted.min()) if wanted.size else 0.0
    relative = actual / wanted - 1.0
    rms = float(np.sqrt(np.mean(relative**2))) if relative.size else 0.0
    return Ripple(setpoints.t[:-1][counts], relative, floor, rms)


def drift(setpoints: Setpoints, law: TimeLaw, path: Path | None = None) -> Array:
    """Measure how far each setpoint is ahead of the law along the path, S(u_k) - l(t_k).

    Parameters
    ----------
    setpoints : Setpoints
        n of them.
    law : TimeLaw
        That they follow.
    path : Path, optional
        Needed where linear and rotary axes make the length, which is not the setpoints' arc length of the tip then.

    Returns
    -------
    (n,) array
        mm.
    """
    return (setpoints.s if path is None else path.lengths_of(setpoints)) - law(setpoints.t)


def chord_errors(setpoints: Setpoints, path: Path, worth: float | None = None) -> Array:
    """Measure the largest distance of the curve from the straight line between neighbouring setpoints.

    Parameters
    ----------
    setpoints : Setpoints
        n of them.
    path : Path
        On which they lie.
    worth : float, optional
        What is not about as long, mm, nor as the longest, is not examined closely; see `between.chord_errors`.

    Returns
    -------
    (n - 1,) array
        mm.
    """
    rows = spans_of(path)
    row, u = rows.find(setpoints.curve, setpoints.u)
    places = SpanPlaces(rows, row)
    return between.chord_errors(rows, row, u, places.derivatives(places.t(u), 0)[0], worth)

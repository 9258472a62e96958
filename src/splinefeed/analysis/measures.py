"""What setpoints are, beside their law: motion of the axes, limits that bind, feed ripple, drift and chord error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from splinefeed.checks import between
from splinefeed.checks.bounds import contain
from splinefeed.checks.differences import ON_TIME, divided
from splinefeed.checks.law import by_time, times_at
from splinefeed.checks.path_limits import EVALUATORS, TipPlaces, value_of
from splinefeed.checks.spans import EPSILON, SpanPlaces, spans_of
from splinefeed.limit_table import KINDS, PLACES
from splinefeed.paths.corners import STOP_ANGLE
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Array, IntArray, Limits, Setpoints, TimeLaw

#: A limit binds where at least this share of it is used.
BINDS = 0.99
#: What limits bound at each tick: name of the limit, values (n,), and bound, (n,) or one; None without a limit.
Measure = tuple[str, Array, Array | float | None]
#: Of the first, second and third difference at a tick: its place among those of ticks with two more at both ends, and
#: how many ticks before and behind it are in it.
STENCILS = ((2, 0, 1), (1, 1, 1), (1, 1, 2))
#: Roundings of a position, and of the arc length that it is found by, that are no motion.
ROUNDINGS = 16.0
#: A feed below this share of the highest one is rest.
REST = 1e-9
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


def differences(setpoints: Setpoints, corners: Array, moving: tuple[bool, bool]) -> list[tuple[Array, Array]]:
    """Compute what a drive sees at the ticks: first to third divided difference.

    Parameters
    ----------
    setpoints : Setpoints
        n ticks.
    corners : (k,) array
        Lengths, mm, at which the velocity may jump: no second or third difference is made over them.
    moving : (bool, bool)
        At the first and at the last tick: where not, the axes stand before and behind.

    Returns
    -------
    list of (array, array)
        Differences (n, axes), mm or rad by s^k, and their rounding, (n, 1). What is not known is NaN. The first and the
        third difference lie half a period behind their tick.
    """
    n, period, at = len(setpoints), setpoints.period, setpoints.position
    dt = np.pad(np.diff(setpoints.t), 2, constant_values=period)
    dt = np.where(np.abs(dt - period) < ON_TIME * period, period, dt)
    each = ROUNDINGS * EPSILON * (np.max(np.abs(at), initial=0.0) + np.max(np.abs(setpoints.s), initial=0.0))
    steps = np.diff(np.pad(at, ((2, 2), (0, 0)), mode="edge"), axis=0).T
    s, found = np.pad(setpoints.s, 2, mode="edge"), []
    both = divided(steps, dt), divided(np.full((1, n + 3), each), dt, np.add)
    for (first, before, behind), values, floors in zip(STENCILS, *both, strict=True):
        own = slice(first, first + n)
        value = values.T[own].copy()
        if len(corners) and before:
            value[contain(corners, s[2 - before :][:n], s[2 + behind :][:n])] = np.nan
        if moving[0]:
            value[:before] = np.nan
        elif behind == 2:  # the difference that ends at the tick behind the first one is of the first one, too
            value[0] = np.where(np.abs(values.T[0]) > np.abs(value[0]), values.T[0], value[0])
        if moving[1]:
            value[max(n - behind, 0) :] = np.nan
        found.append((value, floors.T[own]))
    return found


def drives_see(exact: Array, seen: Array, floor: Array) -> Array:
    """Take exact derivatives, but differences where these exceed them by more than their rounding.

    Parameters
    ----------
    exact : (n, k) array
        Derivatives by time.
    seen : (n, k) array
        Differences of the setpoints.
    floor : (n, 1) array
        Rounding of these.

    Returns
    -------
    (n, k) array
        In the unit of both.

    Notes
    -----
    A difference that is larger than the derivative at all ticks that it is made of is no mean of it: curvature jumps
    there, or the acceleration of the law, and the drive sees the difference. Where C' = 0 exact ones are not finite.
    """
    known = np.isfinite(exact)
    size = np.pad(np.abs(np.where(known, exact, 0.0)), ((1, 2), (0, 0)), mode="edge")
    near = np.max([size[k : k + len(exact)] for k in range(4)], axis=0)
    with np.errstate(invalid="ignore"):
        return np.where((np.abs(seen) > near + floor) | ~known, seen, exact)


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
    A step of velocity at a corner counts at the tick next to it.

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


def limit_use(setpoints: Setpoints, path: Track, law: TimeLaw, limits: Limits) -> tuple[AxisMotion, LimitUse]:
    """Compute what each axis or joint does at the ticks, and how much of all limits that and the law use.

    Parameters
    ----------
    setpoints : Setpoints
        n of them.
    path : Track
        On which they lie. On a JointPath the axes are joints, and feed and curvature those of the tip.
    law : TimeLaw
        That they follow.
    limits : Limits
        Of the motion.

    Returns
    -------
    motion : AxisMotion
        (n, axes), mm and s, rotary axes rad.
    use : LimitUse
        (n, k), of k limits.

    Notes
    -----
    With q(t) = r(s(t)):

        q' = r_s s',  q'' = r_ss s'^2 + r_s s'',  q''' = r_sss s'^3 + 3 r_ss s' s'' + r_s s'''

    By these forms, or where they take more by the differences of the setpoints, which the motion is; see `drives_see`.
    """
    t = setpoints.t
    v, a, j = law.feed(t), law.acceleration(t), law.jerk(t)
    own: Path = path.tip_path
    rows = spans_of(own)
    row, u = rows.find(setpoints.curve, setpoints.u)
    places = SpanPlaces(rows, row)
    exact_at = places.along(places.t(u), 3)
    at, feed = TipPlaces(places, exact_at[0]), feed_limit(setpoints, own, limits)
    chord, tip = at.curvature, places.tip(exact_at[1])
    d = np.stack(exact_at[1], axis=1).T if path.carries_tip else path.derivatives(own.lengths_of(setpoints))
    if limits.chord_error is not None and (left := path.between_ticks(d)[0]) is not None:
        chord = left
    d = d[:, :, : len(path.axes)]
    with np.errstate(invalid="ignore", over="ignore"):
        exact = [each.T for each in by_time([d[:, k].T for k in (1, 2, 3)], v, a, j)]
        along_v, along_a, along_j = by_time(tip, v, a, j)
        of_places = {name: value_of(name, at, along_v) for name in limits.given(PLACES)}
    rest = REST * float(np.max(v, initial=0.0))
    passed = np.zeros(0)
    if limits.axis_velocity_step is not None:
        passed = own.tip_length(own.corners.s[own.corners.angle > STOP_ANGLE])
    seen = differences(setpoints, passed, (bool(v[0] > rest), bool(v[-1] > rest)))
    motion = AxisMotion(t, *(np.where(np.isnan(each), one, each) for one, (each, _) in zip(exact, seen, strict=True)))
    slowing = limits.jerk if limits.deceleration_jerk is None else limits.deceleration_jerk
    measures: list[Measure] = [
        ("feed", along_v, feed),
        ("acceleration", np.maximum(along_a, 0.0), limits.acceleration),
        ("deceleration", np.minimum(along_a, 0.0), limits.deceleration),
        ("jerk", along_j, np.where(along_a < 0.0, slowing, limits.jerk)),
        *((name, values, getattr(limits, name)) for name, values in of_places.items()),
        *_between(setpoints, path, limits),
    ]
    # whether a limit is there is said by the limits, not by the ticks: a chunk may be rapid moves alone
    limited = {"feed"} if own.feeds is not None else set()
    limited |= {"jerk"} if min(limits.jerk, slowing or np.inf) < np.inf else set()
    bounded = limits.axis_bounds(path.axes)
    for names, one, (other, floor), bounds in zip(bounded.names, exact, seen, bounded.bounds.tolist(), strict=True):
        measures += zip(names, drives_see(bounded.of(one), bounded.of(other), floor).T, bounds, strict=True)
    both = [drives_see(one, *each) for one, each in zip(exact, seen, strict=True)]
    measures += _models(setpoints, both, path.axes, limits)
    if path.carries_tip:
        measures += _steps(setpoints, own, law, limits)
    given = [each for each in measures if each[2] is not None and (each[0] in limited or np.any(np.isfinite(each[2])))]
    with np.errstate(invalid="ignore", over="ignore"):
        share = np.array([np.abs(values) / limit for _, values, limit in given]).reshape(len(given), len(t)).T
    share = np.ascontiguousarray(np.where(np.isfinite(share), share, 0.0))
    called = tuple(name for name, _, _ in given)
    slow = {name: EVALUATORS[name](at) for name in of_places}
    top = maximum_velocity(d, slow, chord, path.axes, limits, feed, setpoints.period, (tip[0], tip[1]))
    use = LimitUse(called, t, setpoints.s, share, top, np.zeros(0, dtype=np.int64))
    use = replace(use, counts=np.bincount(use.binding + 1, minlength=len(called) + 1))
    return motion, use


def _between(setpoints: Setpoints, path: Track, limits: Limits) -> list[Measure]:
    """Errors of the tip, mm, and of a tool axis, rad, from each tick to the next; of the last one as before it."""
    if (limits.chord_error is None and limits.orientation_error is None) or len(setpoints) < 2:
        return []
    tip, axis = np.zeros((2, len(setpoints)))
    if path.carries_tip:
        tip[:-1] = chord_errors(setpoints, path.tip_path)
    else:
        s = path.tip_path.lengths_of(setpoints)
        step, *found = path.chords(s, setpoints.position, path.breaks)
        for worst, each in zip((tip, axis), found, strict=True):
            if each is not None:
                np.maximum.at(worst, step, each)
    tip[-1], axis[-1] = tip[-2], axis[-2]
    return [("chord_error", tip, limits.chord_error), ("orientation_error", axis, limits.orientation_error)]


def _models(setpoints: Setpoints, motion: list[Array], axes: tuple[str, ...], limits: Limits) -> list[Measure]:
    """What models give at position, velocity, acceleration and jerk of the ticks, with the limit there."""
    found: list[Measure] = []
    for model in limits.models:
        columns = model.columns(axes)
        values, most = model.along(setpoints.position[:, columns], *(each[:, columns] for each in motion))
        found += [(name, values[:, k], most[:, k]) for k, name in enumerate(model.names())]
    return found


def _steps(setpoints: Setpoints, path: Path, law: TimeLaw, limits: Limits) -> list[Measure]:
    """The step of each axis' velocity at corners passed in motion, at the tick next to each; 0 at all others.

    feed |r' behind - r' before|. Where the tool stops at a corner there is none.
    """
    if limits.axis_velocity_step is None:
        return []
    values, s = np.zeros((len(setpoints), len(path.axes))), path.lengths_of(setpoints)
    corners = path.corners
    first = np.searchsorted(corners.s, max(float(s[0]), 0.0), side="right")
    within = slice(first, np.searchsorted(corners.s, min(float(s[-1]), path.length)))
    stops = corners.angle[within] > STOP_ANGLE
    if stops.any():
        at, u, curve = corners.s[within][stops], corners.u[within][stops], corners.curve[within][stops]
        domains = path.flat.domains
        joint = (u >= domains[curve, 1]) & (curve + 1 < len(path.curves))
        sides = (
            (curve, u, "left"),
            (curve + joint, np.where(joint, domains[np.minimum(curve + 1, len(domains) - 1), 0], u), "right"),
        )
        before, behind = (path.by_length(on, place, side=side)[:, 1] for on, place, side in sides)
        t = times_at(law, at)
        jump = law.feed(t)[:, None] * np.abs(behind - before)
        tick = np.clip(np.rint((t - setpoints.t[0]) / setpoints.period).astype(np.int64), 0, len(values) - 1)
        np.maximum.at(values, tick, np.where(np.isfinite(jump), jump, 0.0))
    steps = limits.of_axes("axis_velocity_step", path.axes).tolist()
    return [(f"axis_velocity_step.{axis}", values[:, k], steps[k]) for k, axis in enumerate(path.axes)]


def feed_limit(setpoints: Setpoints, path: Path, limits: Limits) -> Array:
    """Return the least of the feed limit and of the feed of the program, at each tick (n,), mm/s.

    At the first tick of a curve the faster one of both sides counts: the step to it lies on the curve before.
    """
    if path.feeds is None:
        return np.full(len(setpoints), limits.feed)
    before = setpoints.curve[np.maximum(np.arange(len(setpoints)) - 1, 0)]
    return np.minimum(limits.feed, np.maximum(path.feeds[setpoints.curve], path.feeds[before]))


def maximum_velocity(
    d: Array,
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
    d : (n, 4, axes) array
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
    first, second = bounded.of(d[:, 1]), bounded.of(d[:, 2])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s1, s2 = (np.broadcast_to(each, len(d)) for each in tip)
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
    row, u = rows.find(setpoints.curve, setpoints.u)
    return rows.steps(row, rows.ahead(row, (u - rows.middle[row]) * rows.scale[row]))


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


def chord_errors(setpoints: Setpoints, path: Path) -> Array:
    """Measure the largest distance of the curve from the straight line between neighbouring setpoints.

    Parameters
    ----------
    setpoints : Setpoints
        n of them.
    path : Path
        On which they lie.

    Returns
    -------
    (n - 1,) array
        mm.
    """
    rows = spans_of(path)
    row, u = rows.find(setpoints.curve, setpoints.u)
    places = SpanPlaces(rows, row)
    return between.chord_errors(rows, row, u, places.derivatives(places.t(u), 0)[0])

"""Profiles of seven phases of constant jerk, of many stretches at once: the fastest, whole periods, cubic pieces.

Source of every equation number here: S. Alimohammadi, B. Motakef Imani, Modares Mechanical Engineering 15(13),
158-162, 2015. Where its print is wrong, the mended form is used: (7) phase 5 has a minus; (9) phase 1 has 1/6, not
0.5; (10) L_k = l_k - l_k-1; (14) its last term is added; (15) phases 5 and 7 stand in their own places; (19) has fe.
Lengths in mm, times in s; arrays (n,) hold one number a stretch, and `Numbers` are such an array or one for all.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TypeAlias

import numpy as np

from splinefeed.planner.constants import ALMOST, SAME
from splinefeed.records import LAW_COEFFICIENTS, Array

Numbers: TypeAlias = float | Array

#: Rounding that sums of a few products leave, relative: 2^-52 sixteen times.
ROUNDING = 16.0 * 2.0**-52
#: Acceleration builds up in no less time, s: what the rounding of an instant adds to it would show.
SHORTEST = 1e-6
#: Newton's steps at most (13 are the most for limits 50 decades apart), and the share of the unknown below which a
#: step is the last: what it leaves is its square.
STEPS, LAST = 40, 2.0**-28
#: Stretches that are looked at together, so that their numbers stay in the processor's cache.
TOGETHER = 1 << 13
PHASES = 7


@dataclass(frozen=True, eq=False)
class Profile:
    """Seven phases of constant jerk, from start_feed to end_feed over length (eq. 4-22), of n stretches.

    Parameters
    ----------
    durations : (7, n) array
        T1..T7, s; a phase that does not exist has 0.
    duration : (n,) array
        s; NaN where the length does not even reach from the start feed to the end feed.
    length : (n,) array
        mm.
    peak_feed : (n,) array
        Feed of phase 4, mm/s: the limit, or the highest that there is room for.
    acceleration, deceleration : (n,) array
        Magnitudes reached, mm/s^2.
    jerk, deceleration_jerk : (n,) array
        Magnitudes used, mm/s^3.
    start_feed, end_feed : (n,) array
        mm/s.
    """

    durations: Array
    duration: Array
    length: Array
    peak_feed: Array
    acceleration: Array
    deceleration: Array
    jerk: Array
    deceleration_jerk: Array
    start_feed: Array
    end_feed: Array

    def part(self, some: slice) -> Profile:
        """Those of some of the stretches."""
        return Profile(*(getattr(self, each.name)[..., some] for each in fields(self)))


def ramp(rise: Numbers, acceleration: Numbers, jerk: Numbers) -> tuple[Array, Array, Array, Array]:
    """Time of a change of feed by `rise`, mm/s, times of its jerk phases and of the one between, s, A reached, mm/s^2.

    T1 = T3 = A/J and T2 = rise/A - A/J (eq. 17, 19); where that is negative A = sqrt(J rise), T2 = 0 (eq. 18, 20).
    """
    with np.errstate(invalid="ignore"):  # where nothing limits the jerk
        reached = np.fmin(np.sqrt(jerk * rise), acceleration)  # eq. (18), (20)
    edge = reached / jerk  # eq. (11), (12)
    middle = np.maximum(rise / acceleration - edge, 0.0)  # eq. (17), (19)
    return 2.0 * edge + middle, edge, middle, reached


def solve_in_row(
    length: Array, feed: Numbers, a: Numbers, d: Numbers, j: Numbers, jd: Numbers, *ends: Numbers
) -> Profile:
    """`solve` for stretches of one motion, with jerks that last SHORTEST at least where they are limited."""
    up, down = (
        np.where(np.isfinite(each), np.minimum(each, most / SHORTEST), each) for each, most in ((j, a), (jd, d))
    )
    return solve(length, feed, a, d, up, down, *ends)


def solve(length: Array, feed: Numbers, *limits: Numbers) -> Profile:
    """Find the fastest profiles over lengths, preparation included (eq. 4-22, fig. 2).

    Parameters
    ----------
    length : (n,) array
        L of each stretch, mm.
    feed : float or (n,) array
        The limit of the feed, mm/s.
    *limits : float or (n,) array
        Acceleration, deceleration, mm/s^2, their jerks, mm/s^3, start and end feed, mm/s.

    Returns
    -------
    Profile
        Of the n stretches.

    Notes
    -----
    The highest f <= feed with

        L >= (fs + f)/2 Tu(f - fs) + (f + fe)/2 Td(f - fe)   (eq. 21)

    where Tu and Td follow (17)-(20) at that very f: so (18), (20) and (22) hold together. T4 covers what is left
    (eq. 22).

    With f = fast + w^2, fast being the faster end, the length of the ramps is convex in w: (fast + w^2/2) times
    2 w/sqrt(J), or times w^2/A + A/J, and so is the slower ramp. So Newton's steps come down to the answer: from the
    limit on the feed, or where w^2/2 times the least times of the ramps, 2 w/sqrt(J) and w^2/A, would be all of L.
    Between logarithms, what the length has over that at w = 0 has a slope between 1 and 4 in w: so the share by which
    it is too much bounds the step, whatever the decade.

    References
    ----------
    .. [1] docs/math/seven-phase.md
    """
    length, feed, *given = np.broadcast_arrays(length, feed, *limits)
    given_profile = Profile(np.empty((PHASES, 0)), length, length, feed, *given)
    a, d, j, jd, start, end = given
    with np.errstate(all="ignore"):  # of those that have their answer
        base = _ramps(given_profile, 0.0)[3]
        room = base < (1.0 - ROUNDING) * length
        top = np.where(room, feed - np.maximum(start, end), 0.0)
        most, left = np.sqrt(top), (1.0 + ROUNDING) * (length - base)
        w = np.minimum(
            np.cbrt(left / (1.0 / np.sqrt(j) + 1.0 / np.sqrt(jd))), np.sqrt(np.sqrt(2.0 * left / (1.0 / a + 1.0 / d)))
        )
        w = np.where(room, np.minimum(most, w), 0.0)
        for _ in range(STEPS):
            (time_up, *_, up), (time_down, *_, down), peak, way = _ramps(given_profile, w * w)
            slope = w * (time_up + time_down + (start + peak) / up + (peak + end) / down)
            over = way - length
            share = 1.0 + over / (length - base)
            lower = np.clip(w - over / slope, w / share, w / np.sqrt(np.sqrt(share)))
            before, w = w, np.where(room & (over > 0.0), lower, w)
            if np.all(before - w <= LAST * w):
                break
        found = _with_peak(given_profile, np.where(w == most, top, w * w))
    peak = np.where(room & (w == most), feed, found.peak_feed)  # to the bit
    return replace(found, peak_feed=peak, duration=np.where(base > (1.0 + ROUNDING) * length, np.nan, found.duration))


def _ramps(profile: Profile, excess: Numbers) -> tuple[tuple[Array, ...], tuple[Array, ...], Array, Array]:
    """Ramps up and down at a peak of `excess`, mm/s, over the faster end; the peak; the length of both (eq. 21).

    The unknown is the excess and not f: a ramp goes with the root of its rise, which f - fs would lose to rounding.
    """
    start, end = profile.start_feed, profile.end_feed
    up = ramp(excess + np.maximum(end - start, 0.0), profile.acceleration, profile.jerk)
    down = ramp(excess + np.maximum(start - end, 0.0), profile.deceleration, profile.deceleration_jerk)
    peak = np.maximum(start, end) + excess
    return up, down, peak, 0.5 * ((start + peak) * up[0] + (peak + end) * down[0])


def _with_peak(profile: Profile, excess: Array) -> Profile:
    """The profile with its peak `excess`, mm/s, over the faster end, and what follows from that."""
    (_, t1, t2, up), (_, t7, t6, down), peak, way = _ramps(profile, excess)
    rest = profile.length - way
    t4 = np.where(rest > 2.0 * ROUNDING * profile.length, rest / peak, 0.0)  # eq. (22)
    times = np.stack([t1, t2, t1, t4, t7, t6, t7])
    reached = {"peak_feed": peak, "acceleration": up, "deceleration": down}
    return replace(profile, durations=times, duration=np.sum(times, axis=0), **reached)


def pieces(profile: Profile, begin: Array, end: Array) -> Array:
    """The phases of each profile from `begin` to `end` (n,), mm, as cubic pieces (n, 7, 6) of s in t (eq. 7-9).

    s(t) = l + f t + a t^2/2 + j t^3/6 in local time. Phases 1-4 are laid from the start and 5-7 from the end, so
    rounding meets in the middle.
    """
    times, found = profile.durations, np.zeros((len(begin), PHASES, LAW_COEFFICIENTS))
    up, down = np.where(times[[0, -1]] > 0.0, [profile.jerk, profile.deceleration_jerk], 0.0)  # no limit, no phase
    none, most, least = np.zeros(len(begin)), profile.acceleration, -profile.deceleration
    s, v = begin, profile.start_feed
    for phase, a, j in ((0, none, up), (1, most, none), (2, most, -up), (3, none, none)):
        t = times[phase]
        found[:, phase, :4] = np.stack([s, v, 0.5 * a, j / 6.0], axis=1)
        s, v = s + (v + (0.5 * a + j * t / 6.0) * t) * t, v + (a + 0.5 * j * t) * t
    s, v = end, profile.end_feed
    for phase, a, j in ((6, least, down), (5, least, none), (4, none, -down)):
        t = times[phase]
        v = v - (a + 0.5 * j * t) * t
        s = s - (v + (0.5 * a + j * t / 6.0) * t) * t
        found[:, phase, :4] = np.stack([s, v, 0.5 * a, j / 6.0], axis=1)
    return found


def lay_out(profile: Profile, marks: Array, period: float | None, begin: float = 0.0) -> tuple[Array, Array]:
    """Breaks (m + 1,), s, and pieces (m, 6) of the profiles, one after the other between marks (n + 1,), mm.

    From `begin`, s. With a period, s, that is a tick, and each ends on one: from rest to rest it is slower as a whole,
    with one end in motion it waits at the other one, with both it may end between ticks. A phase of no length, or too
    short for its time, makes no piece.
    """
    seconds, many = profile.duration, len(profile.duration)
    ends, wait, slower = begin + np.cumsum(seconds), np.zeros(many), np.ones(many)
    starting, ending = profile.start_feed > 0.0, profile.end_feed > 0.0
    if period is not None:
        ticks = whole_periods(seconds, period)
        ends, wait = (round(begin / period) + np.cumsum(ticks)) * period, ticks * period - seconds
        wait[~(starting | ending) | (wait <= ALMOST * period)] = 0.0
        slower[wait == 0.0] = (ticks * period / seconds)[wait == 0.0]
        ends -= np.where(starting & ending, wait, 0.0)  # the only stretch
    begins = np.append(begin, ends[:-1]) + np.where(starting, 0.0, wait)
    stops = ends - np.where(ending, 0.0, wait)
    edges = np.minimum(begins + np.cumsum(profile.durations * slower, axis=0), stops)
    instants = np.vstack([begins, edges[:-1], stops])
    rows = np.zeros((1 + (PHASES + 1) * many, LAW_COEFFICIENTS))  # before the first and behind each a wait
    each = rows[1:].reshape(many, PHASES + 1, LAW_COEFFICIENTS)
    each[:, :-1] = pieces(profile, marks[:-1], marks[1:]) / slower[:, None, None] ** np.arange(LAW_COEFFICIENTS)
    rows[0, 0], each[:, -1, 0] = marks[0], marks[1:]
    times = np.concatenate([[begin], instants.T.ravel(), ends[-1:]])
    lasts = np.diff(times) > 0.0
    return times[np.append(lasts, True)], rows[lasts]


def whole_periods(seconds: Array, period: float) -> Array:
    """How many periods, s, as a number, motions of so many seconds take, at least 1; rounding makes no more."""
    return np.asarray(np.maximum(np.ceil(seconds / period * (1.0 - SAME) - SAME), 1.0))

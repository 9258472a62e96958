"""Profiles of seven phases of constant jerk, of many stretches at once: the fastest, whole periods, cubic pieces.

Source of every equation number here: S. Alimohammadi, B. Motakef Imani, Modares Mechanical Engineering 15(13),
158-162, 2015. Where its print is wrong, the mended form is used: (7) phase 5 has a minus; (9) phase 1 has 1/6, not
0.5; (10) L_k = l_k - l_k-1; (14) its last term is added; (15) phases 5 and 7 stand in their own places; (19) has fe.
Lengths in mm, times in s; arrays (n,) hold one number a stretch, and `Numbers` are such an array or one for all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import accumulate, pairwise
from typing import Any, TypeAlias

import numpy as np

from splinefeed.records import LAW_COEFFICIENTS, Array, BoolArray

Numbers: TypeAlias = float | Array

#: A duration that differs by this share from a whole number of periods is whole: three times it is what a uniform
#: stretch may add to a jerk, and it stays far below the 1e-9 that no limit may be exceeded by.
SAME = 5e-11
#: Rounding that sums of a few products leave, relative: 2^-52 sixteen times.
ROUNDING = 16.0 * 2.0**-52
#: A share of a phase below this is not seen, as limits hold to 1e-9.
UNSEEN = 5e-10
#: Newton's steps at most (13 are the most for limits 50 decades apart), and the share of the unknown below which a
#: step is the last: what it leaves is its square.
STEPS, LAST = 40, 2.0**-28
#: Stretches that are worked on together, so that their numbers stay in the processor's cache.
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


def each_field(function: Callable[..., Any], *profiles: Profile) -> list[Any]:
    """The function of each field of the profiles, in the order in which `Profile` takes them."""
    return [function(*(getattr(profile, each.name) for profile in profiles)) for each in fields(Profile)]


def ramp(rise: Numbers, acceleration: Numbers, jerk: Numbers) -> tuple[Array, Array, Array, Array]:
    """Time of a change of feed by `rise`, mm/s, times of its jerk phases and of the one between, s, A reached, mm/s^2.

    T1 = T3 = A/J and T2 = rise/A - A/J (eq. 17, 19); where that is negative A = sqrt(J rise), T2 = 0 (eq. 18, 20).
    """
    with np.errstate(invalid="ignore"):  # where nothing limits the jerk
        reached = np.fmin(np.sqrt(jerk * rise), acceleration)  # eq. (18), (20)
    edge = reached / jerk  # eq. (11), (12)
    middle = np.maximum(rise / acceleration - edge, 0.0)  # eq. (17), (19)
    return 2.0 * edge + middle, edge, middle, reached


def solve_in_row(length: Array, feed: Numbers, *limits: Numbers) -> Profile:
    """`solve` for stretches of one motion, with jerks that last where the rounding of its instants, s, shows.

    Where acceleration A builds up that fast, the jerk is J' with J' + J' (J' rounding / A) = J: what a phase of A/J' s,
    rounding shorter, takes to reach A. It lasts 4 roundings at least.
    """
    found = solve(length, feed, *limits)
    rounding = float(np.spacing(np.sum(found.duration)))
    calm = []
    for a, j in ((limits[0], limits[2]), (limits[1], limits[3])):
        share = rounding * j / a
        slow = np.minimum(2.0 * j / (1.0 + np.sqrt(1.0 + 4.0 * share)), 0.25 * a / rounding)
        calm.append(np.where((share > UNSEEN) & np.isfinite(share), slow, j))
    same = np.all(calm[0] == limits[2]) and np.all(calm[1] == limits[3])
    return found if same else solve(length, feed, *limits[:2], *calm, *limits[4:])


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
    if len(length) > TOGETHER:
        cuts = [slice(k, k + TOGETHER) for k in range(0, len(length), TOGETHER)]
        parts = [solve(length[some], feed[some], *(each[some] for each in given)) for some in cuts]
        return Profile(*each_field(lambda *each: np.concatenate(each, axis=-1), *parts))
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


def to_periods(profile: Profile, period: float, offset: Numbers) -> tuple[Profile, Array, Array]:
    """Profiles made longer so that they end on a tick; the ticks (n,) that they pass, and how late after one they end.

    Each begins `offset` s after tick 0. From rest to rest it is stretched; with end feeds its peak is lowered, at most
    to the faster end, and where that ends too soon it stays and ends late; a duration already whole to within SAME is
    stretched onto it. Period and lateness in s.
    """
    ticks = (profile.duration + offset) / period
    nearest = np.floor(ticks + 0.5)
    whole = (nearest >= 1.0) & (np.abs(ticks - nearest) <= (SAME + ROUNDING) * profile.duration / period)
    passed = np.where(whole, nearest, np.ceil(ticks))
    duration = passed * period - offset
    k = duration / profile.duration
    v, a, j = 1.0 / k, 1.0 / (k * k), 1.0 / (k * k * k)
    factors = Profile(k, k, np.ones(len(k)), v, a, a, j, j, v, v)
    slower = replace(Profile(*each_field(np.multiply, profile, factors)), duration=duration)
    late = np.zeros(len(k))
    moving = ~whole & (np.maximum(profile.start_feed, profile.end_feed) > 0.0)
    if np.any(moving):
        lowered, can = _lowered(profile, duration)
        which = np.where(moving, np.where(can, 0, 1), 2)
        slower = Profile(*each_field(lambda *each: np.choose(which, each), lowered, profile, slower))
        passed = np.where(which == 1, np.floor(ticks), passed)
        late = np.where(which == 1, profile.duration + offset - passed * period, 0.0)
    return slower, passed, late


def _lowered(profile: Profile, duration: Array) -> tuple[Profile, BoolArray]:
    """Profiles whose peak is lowered until they last `duration`, s, and which of them can, (n,).

    f T = f (Tu + Td) + L - l is convex in the peak f, with the derivative (3 T1 + 2 T2 + 2 T6 + 3 T7)/2: so from the
    faster end up Newton's steps to f T = f `duration` stay below the answer.
    """
    t1, t2, _, _, _, t6, t7 = profile.durations
    # Each change of feed counts A (T1 + T2): the difference of two feeds would have lost its digits.
    most = np.minimum(profile.acceleration * (t1 + t2), profile.deceleration * (t6 + t7))
    excess = np.zeros(len(duration))
    with np.errstate(all="ignore"):  # of those that cannot, or have their answer
        for _ in range(STEPS):
            (time_up, t1, t2, _), (time_down, t7, t6, _), peak, way = _ramps(profile, excess)
            over = peak * (time_up + time_down - duration) + (profile.length - way)
            slope = duration - 1.5 * (t1 + t7) - (t2 + t6)
            before, excess = excess, np.where(over > 0.0, np.clip(excess + over / slope, excess, most), excess)
            if np.all(excess - before <= LAST * excess):
                break
        return replace(_with_peak(profile, excess), duration=duration), (excess > 0.0) | (over >= 0.0)


def pieces(profile: Profile, begin: Array, end: Array) -> Array:
    """The phases of each profile from `begin` to `end` (n,), mm, as cubic pieces (n, 7, 6) of s in t (eq. 7-9).

    s(t) = l + f t + a t^2/2 + j t^3/6 in local time. Phases 1-3 are laid from the start and 5-7 from the end, so
    rounding meets in the middle.
    """
    t1, t2, _, _, _, t6, t7 = profile.durations
    start, peak, stop = profile.start_feed, profile.peak_feed, profile.end_feed
    a, d = profile.acceleration, profile.deceleration
    j, jd = (
        np.where(t1 > 0.0, profile.jerk, 0.0),
        np.where(t7 > 0.0, profile.deceleration_jerk, 0.0),
    )  # no limit, no phase
    f1, f2, l1, l2, l3 = _from_end(start, peak, a, j, t1, t2)
    f6, f5, l6, l5, l4 = _from_end(stop, peak, d, jd, t7, t6)
    places: tuple[Any, ...] = (begin, begin + l1, begin + l2, begin + l3, end - l4, end - l5, end - l6)
    accelerations = (0.0, 0.5 * a, 0.5 * a, 0.0, 0.0, -0.5 * d, -0.5 * d)  # eq. (7), halved
    jerks = (j / 6.0, 0.0, -j / 6.0, 0.0, -jd / 6.0, 0.0, jd / 6.0)
    coefficients = np.zeros((len(t1), PHASES, LAW_COEFFICIENTS))
    for order, values in enumerate((places, (start, f1, f2, peak, peak, f5, f6), accelerations, jerks)):
        for phase, value in enumerate(values):
            coefficients[:, phase, order] = value
    return coefficients


def _from_end(feed: Array, peak: Array, a: Array, j: Array, edge: Array, middle: Array) -> tuple[Array, ...]:
    """Feeds after the first two phases of a ramp from `feed` to `peak`, or before the last two, and ways from there."""
    f1 = feed + 0.5 * a * edge  # eq. (8), (14)
    l1 = (feed + j * edge * edge / 6.0) * edge  # eq. (9)
    l2 = l1 + (f1 + 0.5 * a * middle) * middle
    return f1, f1 + a * middle, l1, l2, 0.5 * (feed + peak) * (2.0 * edge + middle)


def lay_out(profile: Profile, marks: Array, period: float | None) -> tuple[Array, Array, Array]:
    """Breaks (m + 1,), s, and pieces (m, 6) of the profiles, brought to ticks, one after the other between marks.

    marks (n + 1,) mm; period s. Also (n,): the time in s past the last tick at which a stretch ends that could not end
    on one, else 0; none but the first and the last has end feeds. A tick is its number times the period, never a sum;
    without ticks the sum is compensated (Neumaier). A phase of no length, or too short for its time, makes no piece.
    """
    many = len(profile.duration)
    late, ends = np.zeros(many), _sums(profile.duration)
    breaks, coefficients = np.zeros(PHASES * many + 1), np.empty((PHASES * many, LAW_COEFFICIENTS))
    count, tick = 0, 0.0
    for low, high in pairwise([0, *range(1, many, TOGETHER), many]):  # the first alone: after it the offset is known
        part = Profile(*each_field(lambda each, some=slice(low, high): each[..., some], profile))
        end, marked = ends[low:high], marks[low + 1 : high + 1]
        if period is not None:
            offset = np.zeros(high - low)
            offset[0] = late[low - 1]  # 0 before the first
            part, passed, late[low:high] = to_periods(part, period, offset)
            end = (tick + np.cumsum(passed)) * period + late[low:high]
            tick += float(np.sum(passed))
        edges = _edges(part.durations, np.append(breaks[count], end[:-1]), end)
        kept = (np.diff(edges, axis=0) > 0.0).T
        number = np.sum(kept, axis=1)
        more = count + int(np.sum(number))
        made = pieces(part, marks[low:high], marked).reshape(-1, LAW_COEFFICIENTS)
        np.compress(kept.ravel(), edges[:-1].T, out=breaks[count:more])
        np.compress(kept.ravel(), made, axis=0, out=coefficients[count:more])
        # the last of several pieces ends at its mark and its feed to the bit, as Horner's rule will evaluate them
        several = number > 1
        last = (count + np.cumsum(number) - 1)[several]
        tau, (_, _, c2, c3, _, _) = end[several] - breaks[last], coefficients[last].T
        coefficients[last, 1] = c1 = part.end_feed[several] - (3.0 * c3 * tau + 2.0 * c2) * tau
        coefficients[last, 0] = marked[several] - ((c3 * tau + c2) * tau + c1) * tau
        count, breaks[more] = more, end[-1]
    return breaks[: count + 1], coefficients[:count], late


def _edges(durations: Array, begin: Array, end: Array) -> Array:
    """Instants (8, n), s, between the phases of profiles from `begin` to `end` (n,), not decreasing."""
    *ahead, t3 = accumulate([begin, *durations[:3]])
    *back, t4 = accumulate([end, *durations[:3:-1]], np.subtract)
    without = (durations[3] == 0.0) | (t3 >= t4)  # no room for phase 4: its two ends are one instant
    t4 = np.where(without & (durations[0] == 0.0), begin, t4)
    t3 = np.where(without, t4, t3)
    return np.asarray(np.minimum(np.stack(list(accumulate([*ahead, t3, t4, *back[::-1]], np.maximum))), end))


def _sums(values: Array) -> Array:
    """Sums of the first values, (n,), with what each addition lost added up beside them (Neumaier)."""
    sums = np.cumsum(values)
    before = np.append(0.0, sums[:-1])
    added = sums - before
    return np.asarray(sums + np.cumsum((before - (sums - added)) + (values - added)))

"""Profiles over 10^5 random cases and eighteen decades, against sums in extended precision that share no code."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import NamedTuple

import mpmath
import numpy as np
import pytest

from splinefeed.planner import profiles
from splinefeed.planner.profiles import Profile

CASES = 100_000
COLUMNS = ("length", "feed", "acceleration", "deceleration", "jerk", "deceleration_jerk", "start_feed", "end_feed")
LENGTH, FEED, ACCELERATION, DECELERATION, JERK, DECELERATION_JERK, START, END = range(8)


class Motion(NamedTuple):
    """Where and how fast each case is at the end of its phases, and the extremes on the way."""

    length: np.ndarray
    end_feed: np.ndarray
    end_acceleration: np.ndarray
    feed_max: np.ndarray
    feed_min: np.ndarray
    acceleration_max: np.ndarray
    deceleration_max: np.ndarray


def integrated(found: Profile) -> Motion:
    """Sum up seven phases of constant jerk from the start; feed and acceleration are extreme where a phase ends."""
    up, down = found.jerk.astype(np.longdouble), found.deceleration_jerk.astype(np.longdouble)
    s, v, a = np.zeros_like(up), found.start_feed.astype(np.longdouble), np.zeros_like(up)
    feeds, accelerations = [v], [a]
    for t, j in zip(found.durations.astype(np.longdouble), (up, 0, -up, 0, -down, 0, down), strict=True):
        s, v, a = s + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
        feeds.append(v)
        accelerations.append(a)
    return Motion(s, v, a, np.max(feeds, 0), np.min(feeds, 0), np.max(accelerations, 0), -np.min(accelerations, 0))


def ramps_length(case: np.ndarray, peak: np.ndarray) -> np.ndarray:
    """Equation (21) without T4, by which limit holds, in extended precision."""
    c, f = case.astype(np.longdouble), peak.astype(np.longdouble)
    total = np.zeros_like(f)
    for end, a, j in ((START, ACCELERATION, JERK), (END, DECELERATION, DECELERATION_JERK)):
        rise = np.maximum(f - c[:, end], 0)
        time = np.where(rise >= c[:, a] ** 2 / c[:, j], rise / c[:, a] + c[:, a] / c[:, j], 2 * np.sqrt(rise / c[:, j]))
        total += (f + c[:, end]) / 2 * time
    return total


def all_hold(case: np.ndarray, what: str, holds: np.ndarray) -> None:
    if not holds.all():
        index = int(np.argmin(holds))
        values = ", ".join(f"{name}={value!r}" for name, value in zip(COLUMNS, case[index].tolist(), strict=True))
        pytest.fail(f"{what} fails for {np.count_nonzero(~holds)} of {len(holds)}; case {index}: {values}")


def solve(case: np.ndarray) -> Profile:
    return profiles.solve(*case.T)


def least_length(case: np.ndarray) -> np.ndarray:
    """Of the change from the start feed to the end feed alone, as `ramps_length`, in floats."""
    return ramps_length(case, np.maximum(case[:, START], case[:, END])).astype(float)


def drawn(seed: int, decades: int, count: int) -> tuple[np.ndarray, Profile]:
    """Cases (n, 8) and their profiles: log-uniform, ends from rest to the limit, and a third barely long enough."""
    random = np.random.default_rng(seed)
    case = 10.0 ** random.uniform(-decades, decades, (count, 8))
    for end in (START, END):
        share = np.where(random.random(count) < 0.5, random.random(count), 10.0 ** random.uniform(-12, 0, count))
        case[:, end] = case[:, FEED] * share
        case[random.random(count) < 0.3, end] = 0.0
        top = random.random(count) < 0.1
        case[top, end] = case[top, FEED]
    alike = random.random(count) < 0.1
    case[alike, END] = case[alike, START] * (1 - random.choice([0.0, 1e-15, 1e-9, 1e-4], np.count_nonzero(alike)))
    short = np.isnan(solve(case).duration)
    extra = np.where(random.random(count) < 0.3, 0.0, 10.0 ** random.uniform(-16, 1, count))
    case[short, LENGTH] = (least_length(case) * (1 + extra))[short]
    found = solve(case)
    all_hold(case, "has room", ~np.isnan(found.duration))
    return case, found


@pytest.fixture(scope="module", params=[2, 9], ids=["two decades", "nine decades"])
def solved(request: pytest.FixtureRequest) -> tuple[np.ndarray, Profile]:
    return drawn(request.param, request.param, CASES)


def check_motion(case: np.ndarray, found: Profile, end_tolerance: float = 1e-10) -> None:
    motion = integrated(found)
    all_hold(
        case,
        "finite",
        np.isfinite(np.vstack([np.atleast_2d(getattr(found, each.name)) for each in fields(Profile)])).all(axis=0),
    )
    all_hold(case, "durations >= 0", (found.durations >= 0).all(axis=0))
    all_hold(case, "ends at L", abs(motion.length - case[:, LENGTH]) <= 1e-10 * case[:, LENGTH])
    peak = found.peak_feed
    all_hold(case, "ends at f_e", abs(motion.end_feed - case[:, END]) <= end_tolerance * peak)
    all_hold(case, "ends unaccelerated", abs(motion.end_acceleration) <= 1e-10 * case[:, DECELERATION])
    all_hold(case, "feed", motion.feed_max <= case[:, FEED] * (1 + 1e-9))
    all_hold(case, "no way back", motion.feed_min >= -1e-12 * peak)
    all_hold(case, "acceleration", motion.acceleration_max <= case[:, ACCELERATION] * (1 + 1e-9))
    all_hold(case, "deceleration", motion.deceleration_max <= case[:, DECELERATION] * (1 + 1e-9))
    all_hold(case, "jerk", found.jerk <= case[:, JERK] * (1 + 1e-9))
    all_hold(case, "jerk down", found.deceleration_jerk <= case[:, DECELERATION_JERK] * (1 + 1e-9))


@pytest.mark.slow
def test_every_case_ends_where_it_must_within_its_limits(solved: tuple[np.ndarray, Profile]) -> None:
    check_motion(*solved)


def test_the_least_length_is_the_least() -> None:
    random = np.random.default_rng(8)
    case = 10.0 ** random.uniform(-3, 3, (1000, 8))
    case[:, START], case[:, END] = case[:, FEED] * random.random((2, 1000))
    least = least_length(case)
    for length, room in ((np.full(1000, 1e-12), False), (least * (1 - 1e-12), False), (least, True)):
        case[:, LENGTH] = length
        all_hold(case, "room" if room else "no room", np.isnan(solve(case).duration) != room)


def test_no_higher_peak_has_room(solved: tuple[np.ndarray, Profile]) -> None:
    case, found = solved
    peak = found.peak_feed
    longer = ramps_length(case, peak * (1 + 1e-9)) > case[:, LENGTH]
    all_hold(case, "highest peak", longer | (peak == case[:, FEED]))
    assert 0.05 < np.mean(longer) < 0.95  # both kinds are among the cases


def test_phases_that_must_be_absent_are_exactly_zero(solved: tuple[np.ndarray, Profile]) -> None:
    case, found = solved
    lowered = found.peak_feed < case[:, FEED] * (1 - 1e-12)
    all_hold(case, "T4 = 0 below the feed limit, eq. (22)", ~lowered | (found.durations[3] == 0))
    weak = found.acceleration < case[:, ACCELERATION] * (1 - 1e-12)
    all_hold(case, "T2 = 0 below the full A, eq. (18)", ~weak | (found.durations[1] == 0))
    weak = found.deceleration < case[:, DECELERATION] * (1 - 1e-12)
    all_hold(case, "T6 = 0 below the full D, eq. (20)", ~weak | (found.durations[5] == 0))


@pytest.mark.parametrize(("rise", "expected"), [(0.0, (0, 0, 0, 0)), (4.0, (3, 1, 1, 2)), (0.5, (1, 0.5, 0, 1))])
def test_ramp(rise: float, expected: tuple[float, ...]) -> None:
    """A = J = 2: 4 mm/s take 1, 1, 1 s; 0.5 mm/s peak at A = sqrt(2 * 0.5) = 1."""
    assert profiles.ramp(rise, 2.0, 2.0) == expected


def test_a_change_of_feed_takes_its_mean_feed_times_its_time() -> None:
    """From 1 to 5 mm/s at A = J = 2: 3 s at 3 mm/s on average."""
    found = profiles.solve(np.array([9.0, 9.0 * (1 - 1e-12)]), 5.0, 2.0, 2.0, 2.0, 2.0, 1.0, 5.0)
    assert found.duration[0] == 3.0
    assert math.isnan(found.duration[1])


def test_peaks_against_fifty_digits() -> None:
    """The peak solves (21) of the ramps by (17)-(20) with mpmath."""
    case, fast = drawn(4, 3, 200)

    def ramps(k: int, peak: mpmath.mpf) -> mpmath.mpf:
        length = mpmath.mpf(0)
        for end, a, j in ((START, ACCELERATION, JERK), (END, DECELERATION, DECELERATION_JERK)):
            feed, a, j = (mpmath.mpf(case[k, place]) for place in (end, a, j))
            rise = peak - feed
            each = rise / a + a / j if rise >= a * a / j else 2 * mpmath.sqrt(rise / j)
            length += (feed + peak) / 2 * each
        return length

    peaks = 0
    with mpmath.workdps(50):
        for k in range(len(case)):
            length, peak = mpmath.mpf(case[k, LENGTH]), mpmath.mpf(fast.peak_feed[k])
            fastest = max(case[k, START], case[k, END]) * (1 + mpmath.mpf(1e-6))
            if fastest < peak < case[k, FEED]:
                assert ramps(k, peak * (1 - 1e-14)) < length < ramps(k, peak * (1 + 1e-14))
                peaks += 1
    assert peaks > 50


def test_many_stretches_in_a_row_begin_on_ticks() -> None:
    """The first, which keeps its start feed, waits at its end for one."""
    count = 20_000
    marks = np.cumsum(np.append(0.0, np.random.default_rng(5).uniform(2.0, 3.0, count)))
    start = np.where(np.arange(count) == 0, 60.0, 0.0)
    found = profiles.solve(np.diff(marks), 60.0, 5000.0, 4000.0, 1e6, 2e6, start, 0.0)
    breaks, coefficients = profiles.lay_out(found, marks, None)
    begins = np.append(breaks[:-1][np.isin(coefficients[:, 0], marks)], breaks[-1])
    assert len(begins) == count + 1
    for k in (0, 1, 2, 10_000, count):
        assert begins[k] == pytest.approx(math.fsum(found.duration[:k]), rel=1e-13, abs=0)
    breaks, coefficients = profiles.lay_out(found, marks, 1e-3)
    begins = np.append(breaks[:-1][np.isin(coefficients[:, 0], marks)], breaks[-1])
    np.testing.assert_array_equal(begins[2:], np.round(begins[2:] / 1e-3) * 1e-3)  # begins[1] is that of the wait
    assert begins[1] == found.duration[0]
    assert len(begins) == count + 2
    assert np.all(np.diff(breaks) > 0)
    ends = np.polynomial.polynomial.polyval(np.diff(breaks), coefficients.T, tensor=False)
    assert np.max(np.abs(ends - np.append(coefficients[1:, 0], marks[-1]))) < 1e-10

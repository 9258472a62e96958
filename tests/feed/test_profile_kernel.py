"""The kernel over 10^5 random cases and eighteen decades, against sums in extended precision that share no code."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import pytest

from splinefeed.kernels import profile as kernels

pytestmark = pytest.mark.nojit

CASES = 2_000 if numba.config.DISABLE_JIT else 100_000
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


def integrated(rows: np.ndarray) -> Motion:
    """Sum up seven phases of constant jerk from the start; feed and acceleration are extreme where a phase ends."""
    row = rows.astype(np.longdouble)
    up, down = row[:, kernels.JERK], row[:, kernels.DECELERATION_JERK]
    s, v, a = np.zeros_like(up), row[:, kernels.START_FEED].copy(), np.zeros_like(up)
    feeds, accelerations = [v], [a]
    for phase, j in enumerate((up, 0 * up, -up, 0 * up, -down, 0 * up, down)):
        t = row[:, phase]
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


def drawn(seed: int, decades: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Cases (n, 8) and rows (n, ROW): log-uniform, ends from rest to the limit, and a third barely long enough."""
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
    rows = np.zeros((count, kernels.ROW))
    for values, row in zip(case.tolist(), rows, strict=True):
        if kernels.seven_phase(*values, row) == kernels.NO_ROOM:
            extra = 0.0 if random.random() < 0.3 else 10.0 ** random.uniform(-16, 1)
            values[LENGTH] = row[kernels.LENGTH] * (1 + extra)
            assert kernels.seven_phase(*values, row) == kernels.SOLVED, values
    case[:, LENGTH] = rows[:, kernels.LENGTH]
    return case, rows


@pytest.fixture(scope="module", params=[2, 9], ids=["two decades", "nine decades"])
def solved(request: pytest.FixtureRequest) -> tuple[np.ndarray, np.ndarray]:
    return drawn(request.param, request.param, CASES)


def check_motion(case: np.ndarray, rows: np.ndarray, end_tolerance: float = 1e-10) -> None:
    motion = integrated(rows)
    all_hold(case, "finite", np.isfinite(rows).all(axis=1))
    all_hold(case, "durations >= 0", (rows[:, :7] >= 0).all(axis=1))
    all_hold(case, "ends at L", abs(motion.length - case[:, LENGTH]) <= 1e-10 * case[:, LENGTH])
    peak = rows[:, kernels.PEAK]
    all_hold(case, "ends at f_e", abs(motion.end_feed - case[:, END]) <= end_tolerance * peak)
    all_hold(case, "ends unaccelerated", abs(motion.end_acceleration) <= 1e-10 * case[:, DECELERATION])
    all_hold(case, "feed", motion.feed_max <= case[:, FEED] * (1 + 1e-9))
    all_hold(case, "no way back", motion.feed_min >= -1e-12 * peak)
    all_hold(case, "acceleration", motion.acceleration_max <= case[:, ACCELERATION] * (1 + 1e-9))
    all_hold(case, "deceleration", motion.deceleration_max <= case[:, DECELERATION] * (1 + 1e-9))
    all_hold(case, "jerk", rows[:, kernels.JERK] <= case[:, JERK] * (1 + 1e-9))
    all_hold(case, "jerk down", rows[:, kernels.DECELERATION_JERK] <= case[:, DECELERATION_JERK] * (1 + 1e-9))


@pytest.mark.slow
def test_every_case_ends_where_it_must_within_its_limits(solved: tuple[np.ndarray, np.ndarray]) -> None:
    check_motion(*solved)


def test_the_least_length_is_the_least() -> None:
    random = np.random.default_rng(8)
    row = np.zeros(kernels.ROW)
    for values in (10.0 ** random.uniform(-3, 3, (1000, 8))).tolist():
        values[START], values[END] = values[FEED] * random.random(2)
        values[LENGTH] = 1e-12
        assert kernels.seven_phase(*values, row) == kernels.NO_ROOM, values
        least = float(row[kernels.LENGTH])
        assert kernels.seven_phase(least * (1 - 1e-12), *values[1:], row) == kernels.NO_ROOM, values
        assert kernels.seven_phase(least, *values[1:], row) == kernels.SOLVED, values


def test_no_higher_peak_has_room(solved: tuple[np.ndarray, np.ndarray]) -> None:
    case, rows = solved
    peak = rows[:, kernels.PEAK]
    longer = ramps_length(case, peak * (1 + 1e-9)) > case[:, LENGTH]
    all_hold(case, "highest peak", longer | (peak == case[:, FEED]))
    assert 0.05 < np.mean(longer) < 0.95  # both kinds are among the cases


def test_phases_that_must_be_absent_are_exactly_zero(solved: tuple[np.ndarray, np.ndarray]) -> None:
    case, rows = solved
    lowered = rows[:, kernels.PEAK] < case[:, FEED] * (1 - 1e-12)
    all_hold(case, "T4 = 0 below the feed limit, eq. (22)", ~lowered | (rows[:, 3] == 0))
    weak = rows[:, kernels.ACCELERATION] < case[:, ACCELERATION] * (1 - 1e-12)
    all_hold(case, "T2 = 0 below the full A, eq. (18)", ~weak | (rows[:, 1] == 0))
    weak = rows[:, kernels.DECELERATION] < case[:, DECELERATION] * (1 - 1e-12)
    all_hold(case, "T6 = 0 below the full D, eq. (20)", ~weak | (rows[:, 5] == 0))


def test_whole_periods_keep_ends_and_limits(solved: tuple[np.ndarray, np.ndarray]) -> None:
    case, fast = solved
    random = np.random.default_rng(1)
    period = fast[:, kernels.DURATION] / 10.0 ** random.uniform(0, 6, CASES)
    nearly = random.random(CASES) < 0.2  # around the edge of what counts as whole, from both sides
    off = random.choice([-1.0, 1.0], CASES) * 10.0 ** random.uniform(-16, -7, CASES)
    few = np.ceil(10.0 ** random.uniform(0, 2, CASES))
    period = np.where(nearly, fast[:, kernels.DURATION] * (1 + off) / few, period)
    offset = np.where(~nearly & (random.random(CASES) < 0.2), random.random(CASES), 0.0) * period
    rows = fast.copy()
    ticks = np.array([kernels.to_periods(*each) for each in zip(rows, period, offset, strict=True)])
    done = ticks > 0
    check_motion(case, rows)
    all_hold(case, "left alone where it cannot", done | (rows == fast).all(axis=1))
    whole = abs(rows[:, kernels.DURATION] + offset - ticks * period) <= 1e-15 * ticks * period
    all_hold(case, "on a tick", ~done | whole)
    summed = abs(rows[:, :7].sum(axis=1) - rows[:, kernels.DURATION]) <= 1e-14 * rows[:, kernels.DURATION]
    all_hold(case, "durations add up", summed)
    needed = np.ceil((fast[:, kernels.DURATION] + offset) / period * (1 - 1e-14))
    all_hold(case, "not a tick too many", ~done | (ticks <= needed))
    resting = (case[:, START] == 0) & (case[:, END] == 0)
    all_hold(case, "rest to rest always can", ~resting | done)
    slowest = np.maximum(case[:, START], case[:, END])
    lowest = (case[:, LENGTH] - ramps_length(case, slowest)) / np.where(slowest > 0, slowest, np.inf)
    ramps = np.zeros(CASES)
    for end, a, j in ((START, ACCELERATION, JERK), (END, DECELERATION, DECELERATION_JERK)):
        rise = slowest - case[:, end]
        full = case[:, a] / case[:, j]
        ramps += np.where(rise >= case[:, a] * full, rise / case[:, a] + full, 2 * np.sqrt(rise / case[:, j]))
    cannot = lowest + ramps < (needed * period - offset) * (1 + 1e-9)
    all_hold(case, "gives up only where the slowest is over too soon", done | cannot)
    assert 0.1 < np.mean(~done) < 0.6


@pytest.mark.parametrize(
    ("rise", "expected"), [(0.0, (0, 0, 0)), (-1.0, (0, 0, 0)), (4.0, (1, 1, 2)), (0.5, (0.5, 0, 1))]
)
def test_ramp(rise: float, expected: tuple[float, float, float]) -> None:
    """A = J = 2: 4 mm/s take 1, 1, 1 s; 0.5 mm/s peak at A = sqrt(2 * 0.5) = 1."""
    assert kernels.ramp(rise, 2.0, 2.0) == expected


def test_ramp_distance() -> None:
    """From 1 to 5 mm/s at A = J = 2: 3 s at 3 mm/s on average."""
    assert kernels.ramp_distance(1.0, 4.0, 2.0, 2.0) == 9.0

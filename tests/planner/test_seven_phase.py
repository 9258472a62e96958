"""One profile: textbook cases by hand, the paper's case, symmetry, units, periods, and refusals."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from one_stretch import SevenPhase, law_of
from splinefeed.errors import LimitsError, PlanError
from splinefeed.records import Limits

PAPER = Limits(feed=60, acceleration=50, jerk=2000)


def solve(length: float, feed: float, acceleration: float, jerk: float, **others: float) -> SevenPhase:
    return SevenPhase.solve(length, Limits(feed=feed, acceleration=acceleration, jerk=jerk, **others))


# Each case by hand: a ramp takes dv/A + A/J if dv >= A^2/J, else 2 sqrt(dv/J), and covers its mean feed times that.
BY_HAND = {
    # Up 0 -> 10 at A=10, J=10: dv = A^2/J, so 1, 0, 1 s and 10 mm. Down the same; 30 mm leave 10 mm: 1 s.
    "ramps just reach A": (
        (30, 10, 10, 10, {}),
        dict(durations=[1, 0, 1, 1, 1, 0, 1], peak_feed=10, acceleration=10, deceleration=10),
    ),
    # Up 0 -> 20, A=10, J=10: 1, 1, 1 s, 30 mm. Down 20 -> 0, D=20, Jd=40: 0.5, 0.5, 0.5 s, 15 mm. 60 mm leave 15 mm.
    "all seven phases, A and D and their jerks different": (
        (60, 20, 10, 10, dict(deceleration=20, deceleration_jerk=40)),
        dict(durations=[1, 1, 1, 0.75, 0.5, 0.5, 0.5], peak_feed=20, acceleration=10, deceleration=20),
    ),
    # The same with exactly 45 mm: the peak is the limit and T4 is zero.
    "no phase 4, the peak is the limit": (
        (45, 20, 10, 10, dict(deceleration=20, deceleration_jerk=40)),
        dict(durations=[1, 1, 1, 0, 0.5, 0.5, 0.5], peak_feed=20, acceleration=10, deceleration=20),
    ),
    # Room for 45 mm, limit far away: the same peak is found.
    "no phase 4, the peak is below the limit": (
        (45, 1000, 10, 10, dict(deceleration=20, deceleration_jerk=40)),
        dict(durations=[1, 1, 1, 0, 0.5, 0.5, 0.5], peak_feed=20, acceleration=10, deceleration=20),
    ),
    # Rest to rest, never at full A: L = 2 J T^3 with four phases of T, f = J T^2, A = J T. T = 0.5, J = 8: 2 mm.
    "no phases 2, 4, 6": (
        (2, 1000, 1000, 8, {}),
        dict(durations=[0.5, 0, 0.5, 0, 0.5, 0, 0.5], peak_feed=2, acceleration=4, deceleration=4),
    ),
    # Up 4 -> 13 in 2 sqrt(9/4) = 3 s, 8.5 mm/s on average: 25.5 mm, A = 6. Down 13 -> 3: 2.5 + 4/8 = 3 s, 24 mm; D = 4.
    "end feeds, phase 6 without phase 2": (
        (49.5, 100, 50, 4, dict(deceleration=4, deceleration_jerk=8, start_feed=4, end_feed=3)),
        dict(durations=[1.5, 0, 1.5, 0, 0.5, 2, 0.5], peak_feed=13, acceleration=6, deceleration=4),
    ),
    # The same limit of 13 with 13 mm more: one second of phase 4.
    "end feeds, phase 4": (
        (62.5, 13, 50, 4, dict(deceleration=4, deceleration_jerk=8, start_feed=4, end_feed=3)),
        dict(durations=[1.5, 0, 1.5, 1, 0.5, 2, 0.5], peak_feed=13, acceleration=6, deceleration=4),
    ),
    # Only braking: 60 -> 0 at 50, 2000 takes 1.225 s and 36.75 mm.
    "no phases 1 to 4": (
        (36.75, 60, 50, 2000, dict(start_feed=60)),
        dict(durations=[0, 0, 0, 0, 0.025, 1.175, 0.025], peak_feed=60, acceleration=0, deceleration=50),
    ),
    # Only speeding up.
    "no phases 4 to 7": (
        (36.75, 60, 50, 2000, dict(end_feed=60)),
        dict(durations=[0.025, 1.175, 0.025, 0, 0, 0, 0], peak_feed=60, acceleration=50, deceleration=0),
    ),
    "phase 4 alone": (
        (33, 60, 50, 2000, dict(start_feed=60, end_feed=60)),
        dict(durations=[0, 0, 0, 0.55, 0, 0, 0], peak_feed=60, acceleration=0, deceleration=0),
    ),
    # The paper: 33 mm, 40 mm/s at the peak, 1.65 s; 60 mm/s is never reached.
    "Alimohammadi and Motakef Imani 2015": (
        (33, 60, 50, 2000, {}),
        dict(durations=[0.025, 0.775, 0.025, 0, 0.025, 0.775, 0.025], peak_feed=40, acceleration=50, deceleration=50),
    ),
}


@pytest.mark.parametrize("name", BY_HAND)
def test_values_by_hand(name: str) -> None:
    (length, feed, acceleration, jerk, others), expected = BY_HAND[name]
    profile = solve(length, feed, acceleration, jerk, **others)
    for field, value in expected.items():
        np.testing.assert_allclose(getattr(profile, field), value, rtol=1e-13, atol=1e-13, err_msg=field)
    assert profile.duration == pytest.approx(sum(expected["durations"]), rel=1e-14, abs=0)
    absent = np.array(expected["durations"]) == 0
    assert (profile.durations[absent] == 0.0).all()
    law = law_of(length, Limits(feed=feed, acceleration=acceleration, jerk=jerk, **others))
    assert len(law.coefficients) == np.count_nonzero(profile.durations)


def test_equation_21_holds_for_the_profile() -> None:
    a, d, j, jd, fs, fe, length = 40.0, 70.0, 900.0, 1500.0, 12.0, 7.0, 55.0
    profile = solve(length, 60, a, j, deceleration=d, deceleration_jerk=jd, start_feed=fs, end_feed=fe)
    f, t4 = profile.peak_feed, profile.durations[3]
    total = (1 / (2 * a) + 1 / (2 * d)) * f**2 + (a / (2 * j) + d / (2 * jd) + t4) * f
    total += a * fs / (2 * j) + d * fe / (2 * jd) - fs**2 / (2 * a) - fe**2 / (2 * d)
    assert profile.durations[1] > 0
    assert profile.durations[5] > 0
    assert total == pytest.approx(length, rel=1e-13, abs=0)


LAWS = {
    "paper": (33, PAPER),
    "seven": (60, Limits(feed=20, acceleration=10, jerk=10, deceleration=20, deceleration_jerk=40)),
    "feeds": (80, Limits(feed=60, acceleration=50, jerk=300, deceleration=90, start_feed=31, end_feed=17)),
    "barely": (36.75 * (1 + 1e-9), Limits(feed=99, acceleration=50, jerk=2000, start_feed=60)),
    "short": (1e-6, Limits(feed=60, acceleration=50, jerk=2000, deceleration_jerk=10)),
}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("period", [None, 1e-4])
def test_law_against_integration_of_its_jerk(name: str, period: float | None) -> None:
    """Jerk alone is taken from the law; feed, acceleration and place are summed up again in extended precision."""
    length, limits = LAWS[name]
    law = law_of(length, limits, period)
    grid = np.unique(np.concatenate([np.linspace(b, e, 301) for b, e in zip(law.breaks, law.breaks[1:], strict=False)]))
    step = np.diff(grid.astype(np.longdouble))
    j = law.jerk(0.5 * (grid[1:] + grid[:-1]))

    def summed(first: float, increments: np.ndarray) -> np.ndarray:
        return first + np.concatenate([[0], np.cumsum(increments)])

    a = summed(0.0, j * step)
    v = summed(limits.start_feed, a[:-1] * step + j * step**2 / 2)
    s = summed(0.0, v[:-1] * step + a[:-1] * step**2 / 2 + j * step**3 / 6)
    scale = dict(rtol=0, atol=1e-11)
    np.testing.assert_allclose(law.acceleration(grid) / 100, a / 100, **scale)
    np.testing.assert_allclose(law.feed(grid) / 60, v / 60, **scale)
    np.testing.assert_allclose(law(grid) / length, s / length, **scale)
    assert s[-1] == pytest.approx(length, rel=1e-11, abs=0)
    assert law.length == pytest.approx(length, rel=4e-16, abs=0)
    assert v[-1] == pytest.approx(limits.end_feed, abs=1e-10)
    assert a[-1] == pytest.approx(0, abs=1e-8)
    assert v.max() <= limits.feed * (1 + 1e-9)
    assert v.min() >= -1e-12
    assert a.max() <= limits.acceleration * (1 + 1e-9)
    assert a.min() >= -limits.deceleration * (1 + 1e-9)
    up = grid[1:] <= law.breaks[np.searchsorted(law.breaks, grid[np.argmax(v)] - 1e-9)]
    assert np.abs(j[up]).max(initial=0) <= limits.jerk * (1 + 1e-9)
    assert np.abs(j[~up]).max(initial=0) <= max(limits.deceleration_jerk, limits.jerk * (not up.any())) * (1 + 1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_law_is_continuous_at_every_break(name: str) -> None:
    law = law_of(*LAWS[name])
    for order, unit in enumerate((law.length, 60.0, 50.0)):
        for piece in range(len(law.coefficients) - 1):
            polynomial = np.polynomial.Polynomial(law.coefficients[piece]).deriv(order)
            before = polynomial(law.breaks[piece + 1] - law.breaks[piece])
            after = law.coefficients[piece + 1, order] * math.factorial(order)
            assert before == pytest.approx(after, abs=1e-11 * unit), (order, piece)


def test_paper_takes_1650_periods_exactly() -> None:
    law = law_of(33.000, PAPER, 1e-3)
    assert law.duration == 1650 * 1e-3 == pytest.approx(1.65, rel=3e-16, abs=0)
    assert law.feed(0.5 * law.duration) == pytest.approx(40, rel=1e-14, abs=0)
    assert law.length == pytest.approx(33.0, rel=4e-16, abs=0)
    assert law_of(33.01, PAPER, 1e-3).duration == pytest.approx(1.651, rel=1e-15, abs=0)


def test_rest_to_rest_is_stretched() -> None:
    fast, slow = law_of(10, PAPER), law_of(10, PAPER, 0.01)
    k = slow.duration / fast.duration
    assert 1 < k < 1.02
    assert slow.duration / 0.01 == pytest.approx(math.ceil(fast.duration / 0.01), rel=1e-15, abs=0)
    np.testing.assert_allclose(np.diff(slow.breaks), np.diff(fast.breaks) * k, rtol=1e-14)
    np.testing.assert_allclose(slow.coefficients, fast.coefficients / k ** np.arange(6), rtol=1e-14)
    assert slow.length == pytest.approx(10, rel=4e-16, abs=0)
    assert slow.period == 0.01


@pytest.mark.parametrize("feeds", [(31, 17), (17, 31), (0, 31), (31, 0), (20, 20)])
def test_end_feeds_lower_the_peak(feeds: tuple[float, float]) -> None:
    limits = Limits(feed=60, acceleration=50, jerk=2000, deceleration=80, start_feed=feeds[0], end_feed=feeds[1])
    fast, law = law_of(60, limits), law_of(60, limits, 0.01)
    assert law.duration / 0.01 == pytest.approx(math.ceil(fast.duration / 0.01), rel=1e-15, abs=0)
    assert law.notes == ()
    peak, before = (float(np.max(each.feed(each.breaks))) for each in (law, fast))
    assert max(feeds) < peak < before
    assert np.max(np.abs(law.coefficients[:, 3])) * 6 == pytest.approx(2000, rel=1e-13, abs=0)
    assert law.length == pytest.approx(60, rel=4e-16, abs=0)
    assert law.feed(0.0) == feeds[0]
    assert law.feed(law.duration) == pytest.approx(feeds[1], abs=1e-11)
    assert law.acceleration(np.linspace(0, law.duration, 999)).max() <= 50 * (1 + 1e-12)


@pytest.mark.parametrize(("start", "end", "length"), [(60, 60, 33.03), (60, 59.99, 33.03)])
def test_what_cannot_be_lowered_ends_between_ticks(start: float, end: float, length: float) -> None:
    limits = Limits(feed=60, acceleration=50, jerk=2000, start_feed=start, end_feed=end)
    law = law_of(length, limits, 1e-3)
    assert law.duration == law_of(length, limits).duration
    assert law.notes[0].startswith("the last period is short")


@pytest.mark.parametrize(("start", "end"), [(60.0, 0.0), (0.0, 60.0)])
def test_what_cannot_be_lowered_waits_where_it_rests(start: float, end: float) -> None:
    limits = Limits(feed=60, acceleration=50, jerk=2000, start_feed=start, end_feed=end)
    fast, law = law_of(36.75, limits), law_of(36.75, limits, 0.01)
    assert law.notes == ()
    assert law.duration == pytest.approx(1.23, rel=1e-14, abs=0)
    still = law.coefficients[0 if end else -1]
    assert still.tolist() == [0.0 if end else 36.75, *[0.0] * 5]
    moving = slice(1, None) if end else slice(None, -1)
    np.testing.assert_allclose(law.coefficients[moving], fast.coefficients, rtol=1e-14)
    assert law.feed(law.duration) == pytest.approx(end, abs=1e-11)


@pytest.mark.parametrize("off", [0.0, 1e-13, -1e-13, 1e-12, -1e-12])
@pytest.mark.parametrize("feed", [0.0, 60.0])
def test_nearly_whole_counts_as_whole(off: float, feed: float) -> None:
    """An arc length that is right to 1e-12 must not cost a tick, nor a short last period."""
    limits = Limits(feed=60, acceleration=50, jerk=2000, start_feed=feed, end_feed=feed)
    law = law_of(33 * (1 + off), limits, 1e-3)
    assert law.notes == ()
    assert law.duration == (550 if feed else 1650) * 1e-3
    assert np.max(np.abs(law.coefficients[:, 3])) * 6 <= 2000 * (1 + 1e-9)
    assert law.length == pytest.approx(33 * (1 + off), rel=4e-16, abs=0)


REFUSED = {
    "a path of 1 mm is too short to slow down from 60 to 0 mm/s: that takes at least 36.75 mm; "
    "choose a start_feed of at most 9.39451 mm/s or an end_feed of at least 59.8608 mm/s": (1, 60, 0),
    "a path of 1 mm is too short to speed up from 10 to 20 mm/s: that takes at least 3.375 mm; "
    "choose a start_feed of at least 18.6636 mm/s or an end_feed of at most 13.0823 mm/s": (1, 10, 20),
}


@pytest.mark.parametrize("message", REFUSED)
def test_no_room_says_what_would_do(message: str) -> None:
    length, start, end = REFUSED[message]
    with pytest.raises(PlanError) as caught:
        solve(length, 60, 50, 2000, start_feed=start, end_feed=end)
    assert str(caught.value) == message


magnitude = st.floats(-3, 3).map(lambda x: 10.0**x)
share = st.one_of(st.just(0.0), st.just(1.0), st.floats(0.0, 1.0))


@st.composite
def problems(draw: st.DrawFn) -> tuple[float, Limits]:
    feed = draw(magnitude)
    limits = Limits(
        feed=feed,
        acceleration=draw(magnitude),
        jerk=draw(magnitude),
        deceleration=draw(magnitude),
        deceleration_jerk=draw(magnitude),
        start_feed=feed * draw(share),
        end_feed=feed * draw(share),
    )
    return draw(magnitude), limits


def test_a_length_that_just_does_makes_no_slivers() -> None:
    """Only braking, or only speeding up: three pieces or two, whatever the rounding of the sums of times."""
    random = np.random.default_rng(4)
    for a, d, j, fast in 10.0 ** random.uniform(-1, 2, (300, 4)):
        rise = max(fast / a + a / j, 0) * fast / 2 if fast >= a * a / j else fast * math.sqrt(fast / j)
        for feeds in (dict(start_feed=fast), dict(end_feed=fast)):
            profile = solve(rise, fast + d, a, j, **feeds)
            exists = np.count_nonzero(profile.durations)
            assert exists in (2, 3), (rise, fast, a, j, feeds)
            law = law_of(rise, Limits(feed=fast + d, acceleration=a, jerk=j, **feeds))
            assert len(law.coefficients) == exists, (rise, fast, a, j, feeds)


def changed(limits: Limits, **new: float) -> Limits:
    return Limits(**{**limits.as_dict(), **new})


@given(problems())
@settings(max_examples=300, deadline=None)
def test_each_mend_of_a_refusal_does(problem: tuple[float, Limits]) -> None:
    length, limits = problem
    try:
        SevenPhase.solve(length, limits)
    except PlanError as error:
        least, *feeds = re.findall(r"at (?:least|most) ([-+.e\d]+) mm", str(error))
        names = re.findall(r"a[n]? (\w+_feed)", str(error))
        assert names == ["start_feed", "end_feed"]
        assert len(feeds) == 2
        SevenPhase.solve(float(least), limits)
        with pytest.raises(PlanError):
            SevenPhase.solve(float(least) * (1 - 2e-5), limits)
        for name, feed in zip(names, map(float, feeds), strict=True):
            SevenPhase.solve(length, changed(limits, feed=max(limits.feed, feed), **{name: feed}))


def solved(length: float, limits: Limits) -> SevenPhase | None:
    try:
        return SevenPhase.solve(length, limits)
    except PlanError:
        return None


@given(problems(), st.floats(-2, 2), st.floats(-2, 2))
@settings(max_examples=300, deadline=None)
def test_units_do_not_matter(problem: tuple[float, Limits], far: float, long: float) -> None:
    """Inches and minutes: lengths times x, times times y, feeds x/y, accelerations x/y^2, jerks x/y^3."""
    (length, limits), x, y = problem, 2.0 ** round(3 * far), 2.0 ** round(3 * long)
    powers = dict(feed=1, start_feed=1, end_feed=1, acceleration=2, deceleration=2, jerk=3, deceleration_jerk=3)
    other = Limits(**{name: value * x / y ** powers[name] for name, value in limits.as_dict().items()})
    here, there = solved(length, limits), solved(length * x, other)
    assert (here is None) == (there is None)
    if here is not None and there is not None:
        np.testing.assert_allclose(there.durations, here.durations * y, rtol=1e-9, atol=1e-13 * there.duration)
        assert there.peak_feed == pytest.approx(here.peak_feed * x / y, rel=1e-13, abs=0)


@given(problems())
@settings(max_examples=300, deadline=None)
def test_backwards_is_the_same_profile_reversed(problem: tuple[float, Limits]) -> None:
    length, limits = problem
    back = Limits(
        feed=limits.feed,
        acceleration=limits.deceleration,
        deceleration=limits.acceleration,
        jerk=limits.deceleration_jerk,
        deceleration_jerk=limits.jerk,
        start_feed=limits.end_feed,
        end_feed=limits.start_feed,
    )
    here, there = solved(length, limits), solved(length, back)
    assert (here is None) == (there is None)
    if here is not None and there is not None:
        np.testing.assert_allclose(there.durations[::-1], here.durations, rtol=1e-9, atol=1e-13 * here.duration)
        assert there.peak_feed == pytest.approx(here.peak_feed, rel=1e-14, abs=0)


@given(problems())
@settings(max_examples=300, deadline=None)
def test_law_has_one_piece_a_phase(problem: tuple[float, Limits]) -> None:
    profile = solved(*problem)
    if profile is not None:
        law, exists = law_of(*problem), profile.durations > 0
        assert law.duration == pytest.approx(profile.duration, rel=1e-14, abs=4e-6)  # phases last SHORTEST
        assert law.length == pytest.approx(profile.length, rel=1e-15, abs=0)
        told = profile.durations > 1e-14 * profile.duration
        assert np.count_nonzero(told) <= len(law.coefficients) <= np.count_nonzero(exists)


@given(problems())
@settings(max_examples=200, deadline=None)
def test_a_longer_path_never_takes_less_time(problem: tuple[float, Limits]) -> None:
    length, limits = problem
    here = solved(length, limits)
    if here is not None:
        there = SevenPhase.solve(length * 1.01, limits)
        assert there.duration > here.duration
        assert there.peak_feed >= here.peak_feed


@pytest.mark.parametrize("length", [0, -1, math.nan, math.inf])
def test_length_must_be_positive(length: float) -> None:
    with pytest.raises(LimitsError, match=r"^length is "):
        SevenPhase.solve(length, PAPER)


def test_record_is_frozen() -> None:
    profile = SevenPhase.solve(33, PAPER)
    with pytest.raises(AttributeError):
        profile.length = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        profile.durations[0] = 1.0

"""`plan`: stops, ticks, notes, the registry, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from one_stretch import SevenPhase
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError, LimitsError, PlanError
from splinefeed.paths.path import Path
from splinefeed.planner import planning
from splinefeed.planner.planning import plan
from splinefeed.records import Limits, TimeLaw

pytestmark = pytest.mark.nojit

PAPER = Limits(feed=60, acceleration=50, jerk=2000)


class Line(Path):
    """A straight line that says another length of itself, and where it stops."""

    def __init__(self, length: float, stops: tuple[float, ...] = ()) -> None:
        super().__init__([NurbsCurve(1, [0, 0, 1, 1], [[0.0], [length if 0.0 < length < math.inf else 1.0]])])
        self.__dict__.update(length=length, stops=stops)


def limits(start: float = 0.0, end: float = 0.0) -> Limits:
    return Limits(feed=60, acceleration=50, jerk=2000, start_feed=start, end_feed=end)


def arrivals(law: TimeLaw, marks: list[float]) -> np.ndarray:
    """Times of the breaks at which the law is at `marks`, to the bit but at its end."""
    places = np.append(law.coefficients[:, 0], law.length)
    if len(marks) and law.length == pytest.approx(marks[-1], rel=4e-16, abs=0):
        places[-1] = marks[-1]
    index = np.searchsorted(places, marks)
    np.testing.assert_array_equal(places[index], marks)
    return law.breaks[index]


def test_the_paper() -> None:
    law = plan(Line(33.0), PAPER, strategy="seven-phase", period=1e-3)
    assert law.breaks[-1] == pytest.approx(1.65, rel=3e-16, abs=0)
    assert law.breaks[-1] == 1650 * 1e-3
    assert law.length == 33.0
    assert law.feed(law.duration / 2) == pytest.approx(40, rel=1e-14, abs=0)
    assert law.notes == ()
    assert law.strategy == "seven-phase"
    assert law.period == 1e-3
    assert law.settings == {"limits": PAPER.as_dict(), "strategy": "seven-phase", "period": 1e-3}


def test_without_a_period_nothing_is_rounded() -> None:
    fast, ticked = plan(Line(10.0), PAPER), plan(Line(10.0), PAPER, period=0.01)
    assert fast.period is None
    assert fast.notes == ()
    assert fast.duration < ticked.duration < fast.duration + 0.01
    assert fast.duration / 0.01 != pytest.approx(round(fast.duration / 0.01), rel=1e-6, abs=0)


def test_it_rests_at_stops_on_ticks() -> None:
    line = Line(100.0, (0.004, 33.0, 33.7, 90.0))
    law = plan(line, PAPER, period=1e-3)
    times = arrivals(law, [*line.stops, line.length])
    ticks = np.round(times / 1e-3)
    np.testing.assert_array_equal(times, ticks * 1e-3)
    np.testing.assert_array_equal(law(times), [*line.stops, line.length])
    np.testing.assert_allclose(law.feed(times), 0, atol=1e-12)
    np.testing.assert_allclose(law.acceleration(times[:-1]), 0, atol=1e-12)
    t = np.linspace(0, law.duration, 20_001)
    assert np.all(np.diff(law(t)) >= -1e-14)
    assert law.feed(t).max() <= 60 * (1 + 1e-9)
    assert np.abs(law.acceleration(t)).max() <= 50 * (1 + 1e-9)
    assert np.abs(law.jerk(t)).max() <= 2000 * (1 + 1e-9)


def test_end_feeds_hold_at_the_ends_of_a_path_with_stops() -> None:
    line = Line(100.0, (40.0, 60.0))
    law = plan(line, limits(20.0, 10.0), period=1e-3)
    assert law.feed(0.0) == 20.0
    assert law.feed(law.duration) == pytest.approx(10.0, rel=1e-12, abs=0)
    times = arrivals(law, [*line.stops, line.length])
    np.testing.assert_array_equal(times, np.round(times / 1e-3) * 1e-3)
    np.testing.assert_allclose(law.feed(times[:-1]), 0, atol=1e-11)
    assert law.notes == ()
    assert law.length == pytest.approx(100.0, rel=4e-16, abs=0)


def test_a_short_last_period_is_noted() -> None:
    law = plan(Line(33.03), limits(60, 60), period=1e-3)
    assert law.duration == pytest.approx(0.5505, rel=1e-14, abs=0)
    assert law.length == pytest.approx(33.03, rel=3e-16, abs=0)
    assert law.notes == ("the last period is short, 0.0005 s of 0.001 s: its end feeds leave no top feed to lower",)


def test_constant_feed_over_whole_periods_has_no_note() -> None:
    law = plan(Line(33.0), limits(60, 60), period=1e-3)
    assert law.duration == 0.55
    assert law.notes == ()
    assert len(law.coefficients) == 1


def test_where_a_stop_cannot_be_on_a_tick_the_tool_waits_there_for_one() -> None:
    line = Line(150.0, (75.0, 80.0, 120.0))
    law = plan(line, limits(60, 0), period=1e-3)
    assert law.notes == ()
    starts = law.coefficients[:, 0]
    wait = int(np.searchsorted(starts, 75.0))
    assert starts[wait] == starts[wait + 1] == 75.0
    assert law.breaks[wait] / 1e-3 == pytest.approx(1862.5, rel=1e-12, abs=0)
    ticks = np.append(law.breaks[wait + 1], arrivals(law, [80.0, 120.0])) / 1e-3
    np.testing.assert_allclose(ticks, np.round(ticks), rtol=1e-15)


def test_many_stretches() -> None:
    random = np.random.default_rng(3)
    count = 1_000 if not planning_is_compiled() else 100_000
    marks = np.cumsum(10.0 ** random.uniform(-3, 1, count)).tolist()
    line = Line(marks[-1], tuple(marks[:-1]))
    law = plan(line, PAPER, period=1e-3)
    times = arrivals(law, marks)
    np.testing.assert_array_equal(times, np.round(times / 1e-3) * 1e-3)
    tau, c = np.diff(law.breaks), law.coefficients
    ends = ((c[:, 3] * tau + c[:, 2]) * tau + c[:, 1]) * tau + c[:, 0]
    np.testing.assert_allclose(ends[:-1], c[1:, 0], rtol=1e-14)
    feeds = (3 * c[:, 3] * tau + 2 * c[:, 2]) * tau + c[:, 1]
    np.testing.assert_allclose(feeds[:-1], c[1:, 1], atol=60 * 1e-11)
    free = plan(line, PAPER)
    assert law.duration - count * 1e-3 < free.duration < law.duration
    lengths = np.diff([0.0, *marks])[:1000]
    durations = [SevenPhase.solve(length, PAPER).duration for length in lengths]
    exact = math.fsum(durations)  # the sum over the stretches does not drift
    assert arrivals(free, marks[:1000])[-1] == pytest.approx(exact, rel=1e-13, abs=0)


def planning_is_compiled() -> bool:
    import numba

    return not numba.config.DISABLE_JIT


@given(
    st.lists(st.floats(-4, 3).map(lambda x: 10.0**x), min_size=1, max_size=8),
    st.floats(0, 60),
    st.floats(0, 60),
    st.sampled_from([None, 1e-4, 1e-3, 0.02]),
)
@settings(max_examples=150, deadline=None)
def test_any_path(stretches: list[float], start: float, end: float, period: float | None) -> None:
    marks = np.cumsum(stretches).tolist()
    line = Line(marks[-1], tuple(marks[:-1]))
    try:
        law = plan(line, limits(start, end), period=period)
    except (PlanError, LimitsError) as error:
        refusal = str(error)
    else:
        refusal = ""
    if refusal:
        assert "; choose a" in refusal
        return
    assert law.length == pytest.approx(line.length, rel=3e-16, abs=0)
    times = arrivals(law, marks[:-1])
    np.testing.assert_allclose(law.feed(times), 0, atol=1e-9)
    t = np.linspace(0, law.duration, 2_001)
    assert law.feed(t).max() <= 60 * (1 + 1e-9)
    assert np.abs(law.acceleration(t)).max() <= 50 * (1 + 1e-9)
    assert np.all(np.diff(law(t)) >= -1e-13 * line.length)
    assert law.feed(law.duration) == pytest.approx(end, abs=1e-8)
    if period is not None and not any("last period" in note for note in law.notes):
        assert law.duration == round(law.duration / period) * period


def test_the_stretch_without_room_is_named() -> None:
    with pytest.raises(PlanError) as caught:
        plan(Line(1.0, (0.5,)), limits(10, 20))
    assert str(caught.value) == (
        "the stretch from 0 to 0.5 mm is too short to slow down from 10 to 0 mm/s: that takes at least 1.125 mm; "
        "choose a start_feed of at most 6.47363 mm/s"
    )
    with pytest.raises(PlanError) as caught:
        plan(Line(10.0, (9.5,)), limits(10, 20))
    assert str(caught.value) == (
        "the stretch from 9.5 to 10 mm is too short to speed up from 0 to 20 mm/s: that takes at least 4.25 mm; "
        "choose an end_feed of at most 6.47363 mm/s"
    )


@pytest.mark.parametrize(
    ("period", "message"),
    [
        (0.0, "period is 0; it must be greater than 0"),
        (-1e-3, "period is -0.001; it must be greater than 0"),
        (float("nan"), "period is nan; it must be finite"),
        (float("inf"), "period is inf; it must be finite"),
        ("1ms", "period is '1ms'; expected a number"),
        (2.0, "period is 2 s, longer than the whole motion of 1.65 s; choose a period of at most 1.65 s"),
    ],
)
def test_periods_that_cannot_be(period: float, message: str) -> None:
    with pytest.raises(LimitsError) as caught:
        plan(Line(33.0), PAPER, period=period)
    assert str(caught.value) == message


def test_the_longest_period_that_would_do_does() -> None:
    assert plan(Line(33.0), PAPER, period=1.65).duration == 1.65


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf")])
def test_a_path_needs_a_length(length: float) -> None:
    with pytest.raises(CurveError, match="only a path with a positive length can be planned"):
        plan(Line(length), PAPER)


@pytest.mark.parametrize("stops", [(0.0,), (33.0,), (40.0,), (5.0, 5.0), (6.0, 5.0), (float("nan"),)])
def test_stops_lie_inside_and_increase(stops: tuple[float, ...]) -> None:
    with pytest.raises(CurveError, match="stops of the path must increase and lie between 0 and its length of 33 mm"):
        plan(Line(33.0, stops), PAPER)


def test_unknown_strategies_name_the_known_ones() -> None:
    with pytest.raises(InputError) as caught:
        plan(Line(33.0), PAPER, strategy="seven phase")
    assert str(caught.value).startswith(
        "strategy 'seven phase' is not known; did you mean 'seven-phase'? The known ones"
    )
    with pytest.raises(InputError) as caught:
        plan(Line(33.0), PAPER, strategy="xyz")
    assert str(caught.value).startswith("strategy 'xyz' is not known; the known ones are: ")
    assert "seven-phase" in str(caught.value)


def test_a_new_strategy_is_one_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def constant(path: Path, limits: Limits, period: float | None) -> TimeLaw:
        seen.append((path.length, period))
        return TimeLaw(breaks=[0, 1], coefficients=[[0, path.length, 0, 0, 0, 0]], strategy="constant")

    monkeypatch.setitem(
        planning.STRATEGIES, "constant", planning.Strategy(constant, holds=planning.SHAPELESS | planning.ENDS)
    )
    law = plan(Line(7.0), PAPER, strategy="constant", period=0.5)
    assert seen == [(7.0, 0.5)]
    assert law.length == 7.0
    assert law.settings["strategy"] == "constant"

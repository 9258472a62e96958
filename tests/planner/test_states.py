"""From any state to any state: plans that begin in motion, and streams that change without a stop."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from benchmarks import cases

import splinefeed as sf
from splinefeed.planner.stream import LookAhead, MotionBlock

PERIOD = 1e-3


def state_of(law: sf.TimeLaw, t: float) -> sf.planner.State:
    return sf.planner.State(float(law.feed(t)), float(law.acceleration(t)), float(law(t)))


def over(points: np.ndarray, limits: sf.Limits) -> float:
    """Largest share of the limits of the axes among differences of setpoints (n, axes)."""
    given = (limits.axis_velocity, limits.axis_acceleration, limits.axis_jerk)
    shares = [
        np.max(np.abs(np.diff(points, n=k, axis=0))) / PERIOD**k / limit
        for k, limit in enumerate(given, start=1)
        if isinstance(limit, float)
    ]
    return float(max(shares))


@pytest.mark.parametrize("strategy", ["time-optimal", "look-ahead"])
@pytest.mark.parametrize("setting", ["A", "B", "C"])
def test_from_the_interior_of_a_plan_the_motion_goes_on(strategy: str, setting: str) -> None:
    """The old motion up to a tick and the new one from there: within every limit over the seam, and as fast."""
    path, limits = cases.butterfly(), cases.axis_limits(setting)
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    rng = np.random.default_rng(ord(setting))
    for k in rng.integers(5, round(law.duration / PERIOD) - 5, 4).tolist():
        start = state_of(law, k * PERIOD)
        again = sf.plan(path, limits, strategy=strategy, period=PERIOD, start=start)
        assert state_of(again, 0.0).feed == pytest.approx(start.feed, rel=1e-9)
        assert state_of(again, 0.0).acceleration == pytest.approx(start.acceleration, rel=1e-6, abs=1e-6)
        assert float(again(0.0)) == pytest.approx(start.s, abs=1e-12)
        assert k * PERIOD + again.duration <= 1.005 * law.duration
        ticks = np.arange(1, math.ceil(again.duration / PERIOD - 1e-9) + 1) * PERIOD
        s = np.concatenate([law(np.arange(k + 1) * PERIOD), again(ticks)])
        assert over(path(np.clip(s, 0.0, path.length)), limits) <= 1.0 + 1e-6


def test_a_start_at_rest_on_the_way() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    law = sf.plan(path, limits, period=PERIOD, start=sf.planner.State(s=100.0))
    assert (float(law(0.0)), float(law.feed(0.0))) == (100.0, 0.0)
    assert law.length == pytest.approx(path.length, rel=1e-12)


@pytest.mark.parametrize("place", [20.0, 30.0, 70.0, 90.0])
@pytest.mark.parametrize("feed", [0.0, 10.0])
def test_a_path_that_waits_is_planned_with_the_way_back(place: float, feed: float) -> None:
    """Each wait is once in the law, on its side of the start; one where the motion begins, behind it."""
    lines = sf.Path.polyline([[0, 0], [40, 0], [40, 30], [80, 30]])
    path = sf.Path(lines.curves, markers=[sf.paths.Marker(before=2, dwell=0.5)])
    limits = sf.Limits(feed=50, acceleration=500, jerk=5000)
    start = sf.planner.State(feed=0.0 if place == 70.0 else feed, s=place)
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD, start=start, back=True)
    begin = law.settings["start_s"]
    ahead = sf.plan(path, limits, strategy="time-optimal", period=PERIOD, start=start)
    assert law.duration == pytest.approx(begin + ahead.duration, abs=1e-9)
    assert (float(law(begin)), float(law.feed(begin))) == pytest.approx((start.s, start.feed), abs=1e-9)
    waits = np.diff(law.breaks)[(law.coefficients[:, 1:] == 0.0).all(axis=1)]
    assert waits[waits > PERIOD].tolist() == [pytest.approx(0.5, abs=1e-9)]


@pytest.mark.parametrize("start", [(0.5, 0.0, 0.0), (0.5, 1.0, 0.3), (0.0, 0.0, 0.3)])
def test_a_run_and_its_files_know_the_state_that_they_begin_in(tmp_path: Path, start: tuple[float, ...]) -> None:
    """Judged as they begin, said in a note, and not at rest, as they would be without a word of it."""
    axes = tuple(sf.records.Joint(f"q{k}", "rad") for k in range(1, 5))
    path = sf.Path.through([[0, 0, 0, 0], [0.3, 0.5, -0.2, 0.1], [1, -0.5, 0.3, -1.2]], axes)
    limits = sf.Limits(axis_velocity=2, axis_acceleration=8, axis_jerk=100)
    state = sf.planner.State(*start)
    law = sf.plan(path, limits, period=PERIOD, start=state)
    run = sf.run(path, limits, law=law)
    assert run.ok, run.verdict.problems
    assert f"the motion begins at s = {start[2]:g} rad, with {start[0]:g} rad/s" in run.verdict.notes[-1]
    again = sf.run(path, limits, period=PERIOD, start=state)
    assert np.array_equal(again.points.position, run.points.position)
    assert not sf.check(run.points, path, limits, start=sf.planner.State()).ok
    for suffix in ("h5", "csv", "mat", "npz"):
        sf.save(run.points, tmp_path / f"moving.{suffix}")
        read = sf.load(tmp_path / f"moving.{suffix}", sf.Setpoints)
        assert read.axes == axes
        assert sf.check(read, path, limits).ok
    sf.save(law, tmp_path / "law.h5")
    assert sf.run(path, limits, law=sf.load(tmp_path / "law.h5", sf.TimeLaw)).ok


def test_a_start_beside_a_law_is_refused_and_one_that_is_no_state() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    law = sf.plan(path, limits, period=PERIOD, start=sf.planner.State(s=100.0))
    with pytest.raises(sf.errors.InputError, match="start: the law that is given begins as it was planned"):
        sf.run(path, limits, law=law, start=sf.planner.State())
    points = sf.interpolate(path, law)
    for said, message in ((3, "start is 3"), ({"feed": "x"}, "start: feed"), ({"v": 1}, "start is {'v': 1}")):
        wrong = dataclasses.replace(points, settings={**points.settings, "start": said})
        with pytest.raises(sf.errors.InputError, match=re.escape(message)):
            sf.check(wrong, path, limits)


def test_what_cannot_be_reached_is_refused_with_the_nearest_that_can() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    with pytest.raises(sf.errors.PlanError, match=r"start_feed is 59 mm/s; .* allow at most ([\d.]+) mm/s") as caught:
        sf.plan(path, limits, period=PERIOD, start=sf.planner.State(59.0, 0.0, 96.0))
    nearest = float(str(caught.value).split("at most ")[1].split()[0])
    assert 0.0 < nearest < 59.0
    sf.plan(path, limits, period=PERIOD, start=sf.planner.State(nearest, 0.0, 96.0))
    with pytest.raises(sf.errors.PlanError, match=r"do not allow a state of 10 mm/s and 5000 .*the nearest"):
        sf.plan(path, limits, period=PERIOD, start=sf.planner.State(10.0, 5000.0, 50.0))


def test_the_nearest_state_is_the_same_however_far_beyond_it_one_is_asked_for() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    found = []
    for feed in (50.0, 59.0, 90.0):
        with pytest.raises(sf.errors.PlanError, match=r"allow at most ([\d.]+) mm/s") as caught:
            sf.plan(path, limits, period=PERIOD, start=sf.planner.State(feed, 0.0, 96.0))
        found.append(float(str(caught.value).split("at most ")[1].split()[0]))
    assert np.ptp(found) < 2e-3 * max(found)
    with pytest.raises(sf.errors.PlanError, match="allow at most"):
        sf.plan(path, limits, period=PERIOD, start=sf.planner.State(1.005 * max(found), 0.0, 96.0))


def line(length: float) -> sf.Path:
    return sf.Path([sf.NurbsCurve.bezier([[0.0], [length]])], axes=("q",))


@pytest.mark.parametrize(
    ("length", "v", "limits", "start"),
    [
        (1.0, 1.0, (10.0, 100.0), (0.68, 8.0)),  # v + a^2 / 2J is the limit of the feed: ruckig's issue 100
        (10.0, 1.0, (2.0, 20.0), (0.5, -2.0)),
        (4.0, 1.0, (2.0, 20.0), (0.016, -0.8)),  # v - a^2 / 2J = 0: at rest on the way, and on from there
        (
            2.0711821649735174,
            3.2849171823711645,
            (26.044371453418133, 52.914980930100384),
            (0.43058362088598806, -6.68),
        ),
    ],
)
def test_a_state_at_its_limits_is_one_to_go_on_from(length, v, limits, start) -> None:
    most = sf.Limits(axis_velocity=v, axis_acceleration=limits[0], axis_jerk=limits[1])
    law = sf.plan(line(length), most, start=sf.planner.State(*start))
    t = np.linspace(0.0, law.duration, 5001)
    assert float(law.length) == pytest.approx(length, rel=1e-12)
    assert np.max(law.feed(t)) <= v * (1.0 + 1e-6)
    assert np.min(law.feed(t)) >= -1e-9 * v
    assert np.max(np.abs(law.acceleration(t))) <= limits[0] * (1.0 + 1e-6)
    assert np.max(np.abs(law.jerk(t))) <= limits[1] * (1.0 + 1e-6)


STATES = json.loads((Path(__file__).parents[1] / "data/states/ruckig.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("k", range(len(STATES)))
def test_states_on_a_line_are_planned_or_refused_as_ruckig_does(k: int) -> None:
    """Ruckig's own time from the state to rest at the end, and whether it neither turns back nor is over a limit."""
    case = STATES[k]
    path = line(case["L"])
    limits = sf.Limits(axis_velocity=case["V"], axis_acceleration=case["A"], axis_jerk=case["J"])
    start = sf.planner.State(case["v0"], case["a0"])
    if case["mono"]:
        law = sf.plan(path, limits, start=start)
        assert case["T"] * (1.0 - 1e-6) <= law.duration <= 1.01 * case["T"]
        return
    with pytest.raises(sf.errors.PlanError) as caught:
        sf.plan(path, limits, start=start)
    sf.plan(path, limits, start=nearest(caught.value))


def nearest(error: Exception) -> sf.planner.State:
    """The state that a refusal names."""
    said = re.search(r"they allow is a state of (\S+) mm/s and (\S+) mm/s\^2 at s = (\S+) mm", str(error))
    assert said is not None, error
    feed, acceleration, s = map(float, said.groups())
    assert feed > 0.0
    return sf.planner.State(feed, acceleration, s)


@pytest.mark.parametrize("start", [(0.5, -3.0, 0.0), (0.9, 5.0, 2.0), (0.05, -1.9, 1.0)])
def test_the_nearest_state_that_a_refusal_names_is_accepted(start: tuple[float, float, float]) -> None:
    limits = sf.Limits(axis_velocity=1.0, axis_acceleration=2.0, axis_jerk=20.0)
    with pytest.raises(sf.errors.PlanError) as caught:
        sf.plan(line(4.0), limits, start=sf.planner.State(*start))
    sf.plan(line(4.0), limits, start=nearest(caught.value))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"feed": -1.0}, "feed and s must be finite and not negative"),
        ({"feed": math.nan}, "feed and s must be finite"),
        ({"feed": 1.0, "acceleration": math.inf}, "the acceleration finite"),
        ({"s": -1.0}, "not negative"),
        ({"acceleration": 5.0}, "at rest the acceleration is 0"),
    ],
)
def test_no_such_state(given: dict[str, float], message: str) -> None:
    with pytest.raises(sf.errors.InputError, match=message):
        sf.planner.State(**given)


def test_a_start_that_is_not_on_the_path() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    with pytest.raises(sf.errors.InputError, match="the path ends at"):
        sf.plan(path, limits, period=PERIOD, start=sf.planner.State(s=1e4))
    with pytest.raises(sf.errors.InputError, match="begins at the start of a path"):
        sf.plan(path, sf.Limits(feed=5, acceleration=50, jerk=500), strategy="seven-phase", start=sf.planner.State(1.0))


# --- streams ---------------------------------------------------------------------------------------------------------


LIMITS = sf.Limits(feed=60.0, axis_velocity=60.0, axis_acceleration=500.0, axis_jerk=20000.0)


def waves(count: int, first: int = 0) -> list[sf.NurbsCurve]:
    """Waves of 10 mm, each tangent to the one before."""
    ends = [(10.0 * k, 2.0 * (-1) ** k) for k in range(first, first + count)]
    return [sf.NurbsCurve.bezier([[x, 0], [x + 3, y], [x + 7, y], [x + 10, 0]]) for x, y in ends]


def setpoints(blocks: list[MotionBlock], path: sf.Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, arc length and position at every tick of blocks that follow each other."""
    end = blocks[-1].time + blocks[-1].law.duration
    t = np.arange(math.floor(end / PERIOD + 1e-9) + 1) * PERIOD
    begins = np.array([block.time for block in blocks])
    of = np.clip(np.searchsorted(begins, t + 1e-12, side="right") - 1, 0, len(blocks) - 1)
    s = np.array(
        [
            path.curve_starts[blocks[k].curve] + blocks[k].offset + float(blocks[k].law(at - blocks[k].time))
            for k, at in zip(of, t, strict=True)
        ]
    )
    return t, s, path(np.clip(s, 0.0, path.length))


def test_a_feed_hold_stops_soon_and_the_motion_goes_on_from_there() -> None:
    path = sf.Path(waves(20))
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 40)
    blocks = planner.push(path)
    assert blocks
    moving = blocks[-1].law
    feed, began = float(moving.feed(moving.duration)), planner.time
    assert feed > 10.0
    held = planner.hold()
    assert len(held) == 1
    law = held[0].law
    assert float(law.feed(law.duration)) == 0.0
    assert planner.time - began <= 2.0 * (feed / 500.0 + 500.0 / 20000.0) + 2 * PERIOD
    assert planner.hold() == []
    blocks += held + planner.finish()
    _, s, points = setpoints(blocks, path)
    assert over(points, LIMITS) <= 1.0 + 1e-6
    assert s[-1] == pytest.approx(path.length, abs=1e-9)


def test_other_limits_hold_from_where_they_can() -> None:
    path = sf.Path(waves(30))
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 40)
    blocks = planner.push(path)
    slow = sf.Limits(feed=15.0, axis_velocity=15.0, axis_acceleration=300.0, axis_jerk=8000.0)
    blocks += planner.change_limits(slow)
    blocks += planner.push(sf.Path(waves(10, 30)))
    blocks += planner.finish()
    whole = sf.Path(waves(40))
    _, s, points = setpoints(blocks, whole)
    assert over(points, LIMITS) <= 1.0 + 1e-6
    assert s[-1] == pytest.approx(whole.length, abs=1e-9)
    slower = [block for block in blocks if block.limits is slow]
    assert slower
    assert all(float(np.max(b.law.feed(np.linspace(0, b.law.duration, 999)))) <= 15.0 * (1 + 1e-9) for b in slower)
    first = next(k for k, block in enumerate(blocks) if block.limits is slow)
    assert float(blocks[first].law.feed(0.0)) > 0.0, "it did not stop for that"


def test_another_path_behind_the_window_without_a_stop() -> None:
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 40)
    blocks = planner.push(sf.Path(waves(30)))
    kept = planner.reroute()
    assert 1 < kept < 30
    other = [sf.NurbsCurve.bezier([[10.0 * kept, 0], [10.0 * kept + 3, 2.0 * (-1) ** kept], [10.0 * kept + 9, 8]])]
    blocks += planner.push(sf.Path(other))
    blocks += planner.finish()
    path = sf.Path([*waves(kept), *other])
    _, s, points = setpoints(blocks, path)
    assert over(points, LIMITS) <= 1.0 + 1e-6
    assert s[-1] == pytest.approx(path.length, abs=1e-9)
    inside = (s > 5.0) & (s < path.length - 5.0)
    assert np.min(np.diff(s[inside])) > 0.0


def test_a_stream_begins_in_a_state() -> None:
    path = sf.Path(waves(20))
    law = sf.plan(path, LIMITS, strategy="look-ahead", period=PERIOD)
    start = state_of(law, 700 * PERIOD)
    planner = LookAhead(LIMITS, PERIOD, ("x", "y"), 60, start=start)
    blocks = planner.push(path) + planner.finish()
    _, s, points = setpoints(blocks, path)
    assert s[0] == pytest.approx(start.s, abs=1e-9)
    assert over(np.concatenate([path(law(np.arange(700) * PERIOD)), points]), LIMITS) <= 1.0 + 1e-6
    assert 0.7 + planner.time <= 1.02 * law.duration

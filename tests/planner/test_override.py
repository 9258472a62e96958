"""Override, hold and reverse: whatever is asked for, the limits hold in what is sent, and the motion stays whole."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from benchmarks import curves

import splinefeed as sf
from splinefeed.errors import LimitsError
from splinefeed.interpolation.arc_length import fill
from splinefeed.planner.override.override import Override
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.planner.override.source import LawSource
from splinefeed.records import Array, Limits, Setpoints, TimeLaw

PERIOD = 1e-3
#: What scripts are tried on: source, limits, strategy, rate that is left room for everywhere.
CASES = {
    "butterfly": ("butterfly", Limits(feed=60, axis_acceleration=500, axis_jerk=20000), "time-optimal", 1.0),
    "butterfly, look-ahead": ("butterfly", Limits(feed=100, axis_acceleration=1000, axis_jerk=5e4), "look-ahead", 1.0),
    "airfoil": ("naca:0025?chord=15.5", Limits(feed=60, axis_acceleration=500, axis_jerk=20000), "time-optimal", 1.0),
    "airfoil along the path": ("naca:0025?chord=15.5", Limits(feed=40, acceleration=200, jerk=5e3), "seven-phase", 1.0),
    "circle, up to 150 %": (
        "circle?radius=10",
        Limits(feed=40, axis_acceleration=300, axis_jerk=9e3),
        "look-ahead",
        1.5,
    ),
    "corners": ("corners", Limits(feed=50, axis_acceleration=400, axis_jerk=2e4), "time-optimal", 1.0),
    "space": ("space", Limits(feed=80, axis_velocity=60, axis_acceleration=600, axis_jerk=3e4), "time-optimal", 1.2),
    "feed to spare": ("oblong", Limits(feed=80, axis_acceleration=900, axis_jerk=6e4), "time-optimal", 1.0),
    "feed to spare, look-ahead": ("oblong", Limits(feed=50, axis_acceleration=900, axis_jerk=6e4), "look-ahead", 1.0),
}
#: Curvature jumps 28 times in the star, where the motion is slowest, and four times between the slot's lines and arcs.
CASES |= {
    f"{name}, {strategy}": (name, Limits(feed=feed, axis_acceleration=3000, axis_jerk=5e4), strategy, top)
    for name, feed, top in (("quadratic", 200, 1.0), ("slot", 60, 1.0), ("small bend", 40, 1.3))
    for strategy in ("time-optimal", "look-ahead")
}
#: The motors of a machine whose belts run across both axes: x + y and x - y.
BELTS = {
    name: sf.records.Combination(weights={"x": 1.0, "y": sign}, velocity=55.0, acceleration=400.0, jerk=15000.0)
    for name, sign in (("a", 1.0), ("b", -1.0))
}
CASES |= {
    f"belts, {strategy}": ("butterfly", Limits(feed=60, axis_jerk=3e4, combinations=BELTS), strategy, 1.0)
    for strategy in ("time-optimal", "look-ahead")
}
#: The programmed feed of the cases with a feed to spare is this share of the limit.
PROGRAMMED = 0.5


@cache
def case(name: str) -> tuple[sf.Path, Limits, TimeLaw]:
    source, limits, strategy, top = CASES[name]
    if source == "corners":
        points = [(0, 0), (12, 0), (12, 9), (3, 11)]
        lines = [sf.NurbsCurve(1, [0, 0, 1, 1], [a, b]) for a, b in pairwise(points)]
        path = sf.Path(lines, markers=[sf.paths.Marker(2, dwell=0.05)])
    elif source == "space":
        rng = np.random.default_rng(7)
        knots = [0.0] * 4 + list(range(1, 9)) + [9.0] * 4
        path = sf.Path([sf.NurbsCurve(3, knots, np.cumsum(rng.uniform(-4, 8, (12, 3)), axis=0))])
    elif source == "oblong":
        side = sf.NurbsCurve(1, [0, 0, 1, 1], [(0, 0), (45, 0)])
        bend = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [(45, 0), (60, 0), (60, 15)], [1, 0.5**0.5, 1])
        path = sf.Path([side, bend, sf.NurbsCurve(1, [0, 0, 1, 1], [(60, 15), (60, 45)])])
    elif source == "small bend":
        bend = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [(3, 0), (3.2, 0), (3.2, 0.2)], [1, 0.5**0.5, 1])
        lines = [sf.NurbsCurve(1, [0, 0, 1, 1], points) for points in ([(0, 0), (3, 0)], [(3.2, 0.2), (3.2, 2)])]
        path = sf.Path([lines[0], bend, lines[1]])
    elif source in ("quadratic", "slot"):
        path = getattr(curves, source)()
    else:
        path = sf.shapes.from_text(source)
    programmed = replace(limits, feed=PROGRAMMED * limits.feed) if source == "oblong" else limits
    return path, limits, sf.plan(path, with_reserve(programmed, top), strategy=strategy, period=PERIOD)


def script(rng: np.random.Generator, ticks: int) -> Array:
    """What an operator may do, or a mad one: steps, ramps, taps, holds, noise; then full rate until the end."""
    kind = rng.integers(9)
    time = np.arange(ticks)
    if kind == 0:  # steps
        wanted = np.repeat(rng.uniform(0, 2, ticks // 40 + 1), 40)[:ticks]
    elif kind == 1:  # ramps
        places = np.sort(rng.integers(0, ticks, 9))
        wanted = np.interp(time, places, rng.uniform(0, 2, 9))
    elif kind == 2:  # steps of the override
        wanted = np.clip(1 + 0.1 * np.cumsum(rng.choice([-1, 0, 0, 0, 0, 0, 1], ticks)), 0, 2)
    elif kind == 3:  # hold and resume, each at once
        wanted = (np.cumsum(rng.random(ticks) < rng.uniform(0.002, 0.02)) % 2 == 0).astype(float)
    elif kind == 4:  # from 0 to 200 % on every tick
        wanted = rng.uniform(0, 2, ticks)
    elif kind == 5:  # from anywhere to anywhere, backwards too
        wanted = np.repeat(rng.uniform(-2, 2, ticks // 90 + 1), 90)[:ticks]
    elif kind == 6:  # back off, as after a tool break, and go on
        wanted = np.ones(ticks)
        for at in rng.integers(ticks, size=3):
            wanted[at : at + rng.integers(1, 900)] = -rng.uniform(0.1, 2)
    elif kind == 7:  # faster than planned
        wanted = np.repeat(rng.uniform(0.9, 2, ticks // 150 + 1), 150)[:ticks]
    else:  # one hold of some length
        at = rng.integers(ticks)
        wanted = np.where((time >= at) & (time < at + rng.integers(1, 600)), 0.0, 1.0)
    return np.concatenate([wanted, np.full(4 * ticks, 1.0)])


def sent(name: str, wanted: Array) -> tuple[Override, Setpoints]:
    path, limits, law = case(name)
    override = Override(LawSource(path, law), limits, rate=wanted[0])
    begin = override.rate
    ticks = override.run(wanted)
    curve, u, s, feed, position = fill(path, law, np.append(0.0, ticks.tau))
    motion = {"t": PERIOD * np.arange(len(s)), "feed": feed * np.append(begin, ticks.rate), "position": position}
    how = {"axes": path.axes, "period": PERIOD, "method": "arc-length", "settings": law.settings}
    return override, Setpoints(curve=curve, u=u, s=s, **motion, **how)


def assert_kept(name: str, seed: int) -> float:
    """The largest share of a limit in what is sent."""
    path, limits, law = case(name)
    wanted = script(np.random.default_rng(seed), round(law.duration / PERIOD))
    override, points = sent(name, wanted)
    assert override.done
    assert points.s[-1] == pytest.approx(path.length, rel=1e-13)
    verdict = sf.check(points, path, limits)
    problems = [each for each in verdict.problems if "goes back by" not in each or np.all(wanted >= 0.0)]
    assert not problems, (name, seed, problems)
    share = max(result.share for result in verdict.limits.values())
    assert share < 1.0 + 1e-9
    return share


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_no_script_takes_what_is_sent_over_a_limit(name: str, seed: int) -> None:
    assert_kept(name, seed)


@pytest.mark.parametrize(("name", "seed"), [("corners", 5750), ("feed to spare", 7400)])
def test_a_way_out_that_ends_at_rest_is_at_rest_though_motion_is_wanted_again(name: str, seed: int) -> None:
    # by a rounding it was not, so that the rest lasted one tick: the same setpoint twice
    assert_kept(name, seed)


def test_left_alone_the_law_runs_as_planned() -> None:
    path, _, law = case("butterfly")
    _, points = sent("butterfly", np.ones(20000))
    planned = sf.interpolate(path, law, method="arc-length")
    assert len(points) == len(planned)
    np.testing.assert_allclose(points.position, planned.position, atol=1e-11)


@pytest.mark.parametrize("at", [900, 1500, 3021])  # between corners and in one
def test_a_hold_comes_to_rest_on_the_path_and_goes_on_from_there(at: int) -> None:
    path, limits, law = case("butterfly")
    wanted = np.ones(30000)
    wanted[at : at + 1000] = 0.0
    override = Override(LawSource(path, law), limits)
    ticks = override.run(wanted)
    rest = np.flatnonzero(ticks.rate == 0.0)
    assert rest[0] < at + 300  # the slack of the reserve stops it in a fraction of a second
    np.testing.assert_array_equal(rest, np.arange(rest[0], rest[0] + len(rest)))
    assert len(set(ticks.tau[rest].tolist())) == 1  # it stands
    after = np.flatnonzero(ticks.rate[at + 1000 :] >= 1.0)
    assert after[0] < 300
    assert override.done


def test_a_wanted_rate_is_reached_exactly_and_not_passed() -> None:
    path, limits, law = case("butterfly")
    override = Override(LawSource(path, law), limits)
    ticks = override.run(np.full(3000, 0.37))
    assert ticks.rate[-1] == 0.37
    assert np.all(np.diff(ticks.rate) <= 0.0)


def test_at_the_highest_rate_a_law_with_room_takes_less_time() -> None:
    _, _, law = case("circle, up to 150 %")
    override, points = sent("circle, up to 150 %", np.full(20000, 2.0))
    assert override.top == pytest.approx(1.5, rel=5e-3)
    assert points.t[-1] < 0.75 * law.duration


def test_the_same_script_in_pieces_gives_the_same_bits() -> None:
    path, limits, law = case("butterfly")
    wanted = script(np.random.default_rng(4), 8000)
    whole = Override(LawSource(path, law), limits).run(wanted)
    parts = Override(LawSource(path, law), limits)
    pieces = [parts.run(wanted[start : start + 333]) for start in range(0, len(wanted), 333)]
    np.testing.assert_array_equal(np.concatenate([piece.tau for piece in pieces]), whole.tau)


@pytest.mark.parametrize("turns", [(1.0,), (1.9, 0.3), (1.0, 1.0, -1.0, -2.0, 1.5)])
def test_how_much_of_the_law_is_in_memory_changes_nothing(turns: tuple[float, ...], monkeypatch) -> None:
    path, limits, law = case("butterfly, look-ahead")
    wanted = np.concatenate([np.repeat(turns, 900), np.ones(9000)])
    whole = Override(LawSource(path, law), limits).run(wanted)
    monkeypatch.setattr("splinefeed.planner.override.override.BLOCK", 70)
    parts = Override(LawSource(path, law), limits).run(wanted)
    np.testing.assert_allclose(parts.tau, whole.tau, atol=1e-9)


def test_a_law_without_reserve_is_refused() -> None:
    path, limits, _ = case("butterfly")
    with pytest.raises(LimitsError, match=r"leaves no reserve to slow down; plan it under with_reserve"):
        Override(LawSource(path, sf.plan(path, limits, strategy="time-optimal", period=PERIOD)), limits)


def test_a_share_that_leaves_nothing_is_refused() -> None:
    with pytest.raises(LimitsError, match="share of jerk"):
        with_reserve(Limits(feed=1), jerk=1.0)

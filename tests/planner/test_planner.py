"""The planner on arrays: as fast as the best known, every limit kept by differences of setpoints, with a bound."""

from __future__ import annotations

import dataclasses
from itertools import islice

import numpy as np
import pytest
from benchmarks import cases
from scipy.interpolate import BSpline
from scipy.optimize import linprog

import motions
import sample_curves
import splinefeed as sf
from one_stretch import SevenPhase
from splinefeed import workers
from splinefeed.paths.path import Path
from splinefeed.planner import strategies as planner
from splinefeed.planner.conditions import Conditions, least_jump
from splinefeed.planner.horizon import SolverSettings, plan_window
from splinefeed.planner.law import pieces_of, quintics
from splinefeed.planner.path_rows import within_reach
from splinefeed.planner.profiles import pieces, solve_in_row
from splinefeed.planner.solve import End, Problem, solve
from splinefeed.planner.spline import Spline
from splinefeed.planner.ticks import held_at_ticks
from splinefeed.records import REST, State

PERIOD = 1e-3
SHAPES = {"butterfly": cases.butterfly, "airfoil12": cases.airfoil12}


def conditions_of(path: Path, limits: sf.Limits, period: float | None = PERIOD) -> Conditions:
    return planner.conditions_of(path, limits, period)


@pytest.mark.parametrize(("name", "setting"), cases.BEST)
@pytest.mark.parametrize(("strategy", "most"), [("time-optimal", 1.0025), ("look-ahead", 1.01)])
def test_as_fast_as_the_best_known_within_every_limit(name: str, setting: str, strategy: str, most: float) -> None:
    path, limits, best = SHAPES[name](), cases.axis_limits(setting), cases.BEST[name, setting]
    law = planner.plan_in_mode(path, limits, PERIOD, strategy=strategy)
    assert law is not None
    assert law.duration <= most * best + PERIOD
    assert law.duration >= 0.999 * best
    assert law.length == pytest.approx(path.length, rel=1e-13)
    ticks = np.arange(round(law.duration / PERIOD) + 1) * PERIOD
    points = path(np.clip(law(ticks), 0.0, path.length))
    for order, given in enumerate((limits.axis_velocity, limits.axis_acceleration, limits.axis_jerk), start=1):
        assert isinstance(given, float)
        seen = np.max(np.abs(np.diff(points, n=order, axis=0))) / PERIOD**order
        assert seen <= given * (1.0 + 1e-6)
        assert order == 1 or seen > 0.9 * given


def test_the_bound_knows_the_jerk() -> None:
    for setting, least in (("A", 0.997), ("B", 0.99), ("C", 0.997)):
        law = planner.plan_in_mode(
            cases.butterfly(), cases.axis_limits(setting), None, strategy="time-optimal", bound=True
        )
        assert law is not None
        assert least * law.duration <= law.settings["lower_bound_s"] <= law.duration
    without = sf.Limits(feed=60, axis_velocity=60, axis_acceleration=500)
    law = planner.plan_in_mode(cases.butterfly(), without, None, strategy="time-optimal", bound=True)
    assert law is not None
    assert 7.63 < law.settings["lower_bound_s"] < 7.67  # 7.709 s with the jerk


def test_splines_are_those_of_scipy() -> None:
    nodes = np.cumsum([0.0, 0.3, 0.5, 0.2, 1.0, 0.7])
    spline = Spline.on(nodes, np.array([False, False, True, False, False, False]))
    assert spline.size == 9
    c = np.random.default_rng(1).uniform(1.0, 2.0, spline.size)
    x = np.linspace(nodes[0], nodes[-1], 101)[:-1]
    given = BSpline(spline.t, c, 3)
    for order, found in enumerate(spline.at(c, x)):
        assert found == pytest.approx(given(x, nu=order), rel=1e-12, abs=1e-10)
    assert spline.greville() == pytest.approx([np.mean(spline.t[k + 1 : k + 4]) for k in range(9)])


def test_splines_whose_slope_jumps_have_their_derivatives_and_that_jump() -> None:
    nodes, share = np.cumsum([0.0, 0.3, 0.5, 0.2, 1.0, 0.7]), 1.7
    jumps = np.array([False, False, True, False, False, False])
    spline = Spline.on(nodes, jumps, np.where(jumps, share, 0.0))
    c, h = np.random.default_rng(1).uniform(1.0, 2.0, spline.size), 1e-5
    x = np.linspace(nodes[0], nodes[-1], 102)[1:-1]
    x = x[np.min(np.abs(x[:, None] - nodes), axis=1) > 2.0 * h]
    _, slope, bend = spline.at(c, x)
    before, behind = spline.at(c, x - h), spline.at(c, x + h)
    assert slope == pytest.approx((behind[0] - before[0]) / (2.0 * h), rel=1e-7, abs=1e-7)
    assert bend == pytest.approx((behind[1] - before[1]) / (2.0 * h), rel=1e-7, abs=1e-7)
    for place, jump in zip(nodes[1:-1], jumps[1:-1], strict=True):
        below, above = spline.at(c, np.array([place - 1e-9, place + 1e-9])).T
        assert above[:2] - below[:2] == pytest.approx([0.0, jump * share * below[0]], abs=1e-6)


def test_the_largest_jump_is_made_as_small_as_a_linear_program_makes_it() -> None:
    rng = np.random.default_rng(5)
    jump, half = rng.normal(size=(2, 4, 50))
    most = rng.uniform(0.1, 3.0, 50)
    factor = least_jump(jump, half, most)
    for k in range(50):
        sides = np.vstack([np.column_stack([way * half[:, k], -np.ones(4)]) for way in (1.0, -1.0)])
        at_most = np.concatenate([-jump[:, k], jump[:, k]])
        best = linprog([0.0, 1.0], A_ub=sides, b_ub=at_most, bounds=[(-most[k], most[k]), (0.0, None)]).x[1]
        reached = np.max(np.abs(jump[:, k] + factor[k] * half[:, k]))
        assert reached == pytest.approx(best, rel=1e-9) or best > 0.98 * np.max(np.abs(jump[:, k]))


def test_a_tip_keeps_its_feed_where_rotary_axes_begin_to_turn_faster() -> None:
    """Where r'' jumps so does s'' of the tip along sigma: at a constant feed q' must jump, or the tip slows down."""
    net = [[[0, 0], [25, 0.5], [50, 1]], [[50, 1], [65, 1.3], [80, 2.05]], [[80, 2.05], [105, 3.3], [130, 4.55]]]
    path = sf.Path([sf.NurbsCurve.bezier(each) for each in net], ("x", "a"))
    limits = sf.Limits(feed=50, acceleration=1000, jerk=10000)
    law = sf.plan(path, limits, strategy="time-optimal", period=1e-3)
    t = np.linspace(0.3, law.duration - 0.3, 2001)
    feed = path.of_tip(law(t), law.feed(t), law.acceleration(t), law.jerk(t))[1]
    assert np.min(feed) > 49.8
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems
    for begin in (0.9, 1.0, 1.1, 1.7):  # and any state of it can be gone on from
        start = State(float(law.feed(begin)), float(law.acceleration(begin)), float(law(begin)))
        again = sf.plan(path, limits, strategy="time-optimal", period=1e-3, start=start)
        assert begin + again.duration < law.duration + 0.01


def test_a_quintic_has_both_states_and_its_time() -> None:
    nodes, v, a, spans = np.array([1.0, 3.0]), np.array([2.0, 5.0]), np.array([1.0, -3.0]), np.array([0.6])
    c = quintics(nodes, v, a[:1], a[1:], spans)[0]
    p = np.polynomial.Polynomial(c)
    for t, k in ((0.0, 0), (0.6, 1)):
        assert [p(t), p.deriv(1)(t), p.deriv(2)(t)] == pytest.approx([nodes[k], v[k], a[k]], rel=1e-12)


def straight_problem(limit: float, h: int = 200) -> Problem:
    """A line of 10 mm under an acceleration limit alone, between two states."""
    line = Path([sf.NurbsCurve.bezier([[0.0, 0.0], [10.0, 0.0]])])
    setting = conditions_of(line, sf.Limits(feed=1e3, acceleration=limit))
    nodes = np.linspace(0.0, 10.0, h + 1)
    spline = Spline.on(nodes, np.zeros(h + 1, dtype=bool))
    cell = np.append(np.repeat(np.arange(h), 2), h - 1)
    part = np.append(np.tile([0.0, 0.5], h), 1.0)
    weight = np.append(np.tile([1.0 / 3.0, 2.0 / 3.0], h), 1.0 / 6.0) * 10.0 / h
    weight[0] = 10.0 / h / 6.0
    x = nodes[cell] + part * 10.0 / h
    return Problem(spline, cell, x, weight, setting.rows(x), (End(q=100.0), End(q=400.0)))


def test_between_two_feeds_the_optimum_is_up_and_down_at_the_limit() -> None:
    """q = 100 + 2 A s up to where 400 + 2 A (10 - s) is met: T = (v - 10) / A + (v - 20) / A with v^2 = 250 + 10 A."""
    problem = straight_problem(500.0)
    found = solve(problem, np.full(problem.spline.size, 200.0), 1e-6)
    v = np.sqrt(250.0 + 10.0 * 500.0)
    assert found.kept
    assert found.time == pytest.approx((v - 10.0) / 500.0 + (v - 20.0) / 500.0, rel=1e-2)


def test_a_motion_of_nanometres_is_as_exact_far_along_a_path_as_at_its_start() -> None:
    cell = 48.0 * np.spacing(300.0)  # rounding of arc length there is 2 % of it
    nodes, jumps = cell * np.arange(9.0), np.zeros(9, dtype=bool)
    c = np.linspace(1.0, 2.0, 11) ** 3
    ends = End(q=c[0]), End(q=c[-1])
    near, far = (pieces_of(Spline.on(nodes + s, jumps), c, ends) for s in (0.0, 300.0))
    np.testing.assert_allclose(far.spans, near.spans, rtol=1e-12)
    np.testing.assert_allclose(far.coefficients[:, 1:], near.coefficients[:, 1:], rtol=1e-6)


def test_a_window_goes_from_state_to_state() -> None:
    setting = conditions_of(cases.butterfly(), cases.axis_limits("A"))
    mode = SolverSettings(cell=0.4, tolerance=2e-3, cells=400, open=0.25)
    whole = plan_window(setting, 0.0, 200.0, REST, REST, mode, exact=True)
    k = len(whole.pieces) // 2
    row = whole.pieces.coefficients[k]
    state = State(float(row[1]), float(2.0 * row[2]))
    rest = plan_window(setting, float(row[0]), 200.0, state, REST, mode, exact=True)
    assert rest.over <= 1.0 + 5e-7
    assert rest.pieces.coefficients[0, :3] == pytest.approx(row[:3], rel=1e-9)
    left = float(np.sum(whole.pieces.spans[k:]))
    assert rest.pieces.duration == pytest.approx(left, rel=1e-2)


@pytest.mark.parametrize("radius", [2e-6, 1e-5, 1e-3])
def test_tips_of_sharp_bends_are_found(radius: float) -> None:
    path = Path([sample_curves.bent(radius)])
    s, curvature = path.sharp_bends
    assert curvature == pytest.approx([1.0 / radius], rel=1e-6)
    assert s == pytest.approx(path.arc_length([0], [0.5]), rel=1e-12)
    assert np.any(np.isclose(path.breaks[:, None], s[None, :], rtol=1e-13))


@pytest.mark.parametrize("width", [1e-2, 3e-2])
def test_a_loop_that_hides_between_samples_is_found(width: float) -> None:
    """x' + i y' = (u + i w)^2: |C'| = w^2 and |C''| = 2 w across it at the tip."""
    path = Path([sample_curves.with_loop(0.4, width)])
    assert np.max(path.sharp_bends[1]) == pytest.approx(2.0 / width**3, rel=1e-3)


BENT = {f"radius {radius:g} mm": sample_curves.bent(radius) for radius in (1.1e-6, 1e-5, 1e-4, 1e-3)}
PLANNED = {**sample_curves.TIPS, **BENT}


@pytest.mark.parametrize("strategy", ["time-optimal", "look-ahead"])
@pytest.mark.parametrize("name", PLANNED)
def test_cusps_and_sharp_bends_are_planned_within_every_limit(name: str, strategy: str) -> None:
    path, limits = Path([PLANNED[name]]), cases.axis_limits("A")
    law = planner.plan_in_mode(path, limits, PERIOD, strategy=strategy)
    assert law is not None
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
    ticks = np.arange(round(law.duration / PERIOD) + 1) * PERIOD
    points = np.pad(path(np.clip(law(ticks), 0.0, path.length)), ((3, 3), (0, 0)), mode="edge")
    for order, given in enumerate((limits.axis_velocity, limits.axis_acceleration, limits.axis_jerk), start=1):
        assert isinstance(given, float)
        seen = np.max(np.abs(np.diff(points, n=order, axis=0))) / PERIOD**order
        assert seen <= given * (1.0 + 1e-6)
        assert order == 1 or seen > 0.9 * given


def test_a_rest_at_a_cusp_costs_what_a_bend_does() -> None:
    """What is put next to the tip asks nothing of the axes: the same time as the bends of 0.01 to 10 um next to it."""
    limits = cases.axis_limits("A")
    times = [
        planner.plan_in_mode(Path([sample_curves.bent(r)]), limits, PERIOD, strategy="time-optimal")
        for r in (0.0, 1e-8, 1e-7)
    ]
    bend = planner.plan_in_mode(Path([sample_curves.bent(1e-4)]), limits, PERIOD, strategy="time-optimal")
    assert bend is not None
    for law in times:
        assert law is not None
        assert law.duration <= 1.04 * bend.duration


@pytest.mark.parametrize(("strategy", "most"), [("time-optimal", 1.0), ("look-ahead", 1.01)])
@pytest.mark.parametrize("kink", [1e-7, 3e-7])
def test_a_kink_between_lines_costs_no_more_than_a_stop_there(kink: float, strategy: str, most: float) -> None:
    points = np.array([[0.0, 0.0], [60.0, 0.012], [66.0, 0.0132 + 6.0 * kink]])
    limits = sf.Limits(feed=100, axis_acceleration={"x": 370, "y": 0.07}, axis_jerk={"x": 1900, "y": 0.18})
    path = Path.polyline(points)
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    parts = [sf.plan(Path.polyline(part), limits, period=PERIOD).duration for part in (points[:2], points[1:])]
    assert not len(path.stops) and law.duration <= most * sum(parts)
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok


@pytest.mark.parametrize("strategy", ["time-optimal", "look-ahead"])
@pytest.mark.parametrize("kink", [1e-4, -1e-4])
def test_a_law_is_within_acceleration_beside_a_kink_between_lines(kink: float, strategy: str) -> None:
    path = Path.polyline([[0, 0], [10, 3], [13, 3.9 + 3.0 * kink]])
    limits = sf.Limits(feed=200, axis_acceleration={"x": 5000, "y": 100}, axis_jerk={"x": 500_000, "y": 20_000})
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert not len(path.stops) and verdict.ok, verdict.problems
    assert law.duration < 0.403


def test_setpoints_over_a_limit_are_seen_at_ticks() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD)
    breaks = conditions_of(path, limits).breaks

    def slower(given: sf.Limits) -> float:
        return held_at_ticks(law, path, given, np.zeros(1, dtype=int), np.zeros(0), breaks).duration / law.duration

    assert slower(limits) == slower(sf.Limits(feed=60, chord_error=1e-3)) == 1.0
    assert slower(sf.Limits(feed=60, axis_jerk=19_000)) == pytest.approx((20 / 19) ** (1 / 3), rel=1e-3)
    assert slower(sf.Limits(feed=60, axis_acceleration=450)) == pytest.approx((500 / 450) ** 0.5, rel=1e-3)
    assert slower(sf.Limits(feed=60, chord_error=1e-6)) == pytest.approx((8.24e-5 / 1e-6) ** 0.5, rel=0.02)
    with pytest.raises(sf.errors.PlanError, match="chords are over their limit"):
        slower(sf.Limits(feed=60, chord_error=1e-8))


def test_chords_look_as_far_as_they_reach() -> None:
    s, step = np.array([0.0, 1.0, 2.0, 3.0]), np.array([9.0, 9.0, 0.5, 9.0])
    assert within_reach(s, step).tolist() == [2.0, 1.0, 0.5, 1.0]


def test_a_path_in_parts_is_planned_as_it_comes() -> None:
    """Blocks of motion over butterflies one after the other: together one law, within every limit."""
    curve = cases.butterfly().curves[0]
    curves = [curve, curve.reversed(), curve]
    path, limits = Path(curves), cases.axis_limits("A")
    blocks = list(motions.look_ahead((Path([each]) for each in curves), limits, PERIOD, window=200))
    assert len(blocks) >= 3
    starts = np.repeat(
        [path.curve_starts[b.curve] + b.offset for b in blocks], [len(b.law.coefficients) for b in blocks]
    )
    coefficients = np.concatenate([block.law.coefficients for block in blocks])
    coefficients[:, 0] += starts
    breaks = np.concatenate([[0.0], *(block.time + block.law.breaks[1:] for block in blocks)])
    law = sf.TimeLaw(breaks=breaks, coefficients=coefficients, strategy="look-ahead", period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
    assert law.duration <= 1.02 * sf.plan(path, limits, strategy="look-ahead", period=PERIOD).duration
    again = list(motions.look_ahead([path], limits, PERIOD, window=200))
    assert sum(b.law.duration for b in again) == pytest.approx(sum(b.law.duration for b in blocks), rel=5e-3)
    assert list(islice(motions.look_ahead([], limits, PERIOD), 1)) == []


def arc(length: float) -> Path:
    """An arc so flat that it costs nothing, and yet no straight line."""
    half = 0.5 * length / 1e5
    ends = 1e5 * np.sin(half)
    top = 1e5 * (1.0 / np.cos(half) - np.cos(half))
    return Path([sf.NurbsCurve.bezier([[-ends, 0.0], [0.0, top], [ends, 0.0]], [1.0, float(np.cos(half)), 1.0])])


@pytest.mark.parametrize(("length", "most"), [(2.0, 1.025), (20.0, 1.007), (200.0, 1.002)])
@pytest.mark.parametrize(("jerk", "falling"), [(2e4, 5e3), (5e3, 2e4), (2e4, 2e5)])
def test_two_limits_of_jerk_cost_what_the_exact_profile_says(
    length: float, most: float, jerk: float, falling: float
) -> None:
    path, limits = arc(length), sf.Limits(feed=60, acceleration=500, jerk=jerk, deceleration_jerk=falling)
    law = planner.plan_in_mode(path, limits, None, strategy="time-optimal")
    assert law is not None
    exact = SevenPhase.solve(path.length, limits).duration
    assert exact * (1.0 - 1e-6) <= law.duration <= most * exact


def test_many_profiles_at_once_are_those_of_one_by_one() -> None:
    rng = np.random.default_rng(1)
    ranges = ((-3, 3), (-1, 3), (1, 5), (1, 5), (2, 7), (2, 7))
    given = [10.0 ** rng.uniform(*each, 300) for each in ranges]
    found = solve_in_row(*given, 0.0, 0.0)
    spans, c = found.durations.T, pieces(found, np.zeros(300), given[0])
    names = ("feed", "acceleration", "deceleration", "jerk", "deceleration_jerk")
    for k, (length, *values) in enumerate(zip(*given, strict=True)):
        one = SevenPhase.solve(length, sf.Limits(**dict(zip(names, values, strict=True))))
        assert np.sum(spans[k]) == pytest.approx(one.duration, rel=1e-8)
    t = spans[:, :, None] ** np.arange(4)
    assert np.sum(c[:, 6, :4] * t[:, 6], axis=1) == pytest.approx(given[0], rel=1e-14)
    ends = np.sum(c[:, :6, :4] * t[:, :6], axis=2)
    assert np.max(np.abs(ends - c[:, 1:, 0]) / given[0][:, None]) < 1e-14
    feeds = np.sum(c[:, :6, 1:4] * np.arange(1, 4) * t[:, :6, :3], axis=2)
    assert np.max(np.abs(feeds - c[:, 1:, 1]) / given[1][:, None]) < 1e-14


def test_rotary_axes_beside_linear_ones_are_planned_and_those_that_turn_on_the_spot() -> None:
    limits = sf.Limits(feed=50, axis_acceleration={"x": 500, "a": 20}, axis_jerk={"x": 2e4, "a": 1e3})
    path = Path([sf.NurbsCurve.bezier([[0, 0], [5, 0.5], [10, -1.0], [15, 0.2]])], ("x", "a"))
    law = planner.plan_in_mode(path, limits, PERIOD, strategy="time-optimal")
    assert law is not None
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
    on_the_spot = Path([sf.NurbsCurve.bezier([[0, 0], [0, 0.5], [10, 1.0]])], ("x", "a"))
    law = planner.plan_in_mode(on_the_spot, limits, PERIOD, strategy="time-optimal")
    assert sf.check(sf.interpolate(on_the_spot, law), on_the_spot, limits, law=law).ok
    alone = Path([sf.NurbsCurve.bezier([[0, 0], [0, 1.0]]), sf.NurbsCurve.bezier([[0, 1], [5, 1.0]])], ("x", "a"))
    law = planner.plan_in_mode(alone, limits, PERIOD, strategy="time-optimal")
    assert law is not None
    assert sf.check(sf.interpolate(alone, law), alone, limits, law=law).ok


def test_stretches_planned_by_all_cores_are_the_same_to_the_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    curve = sf.shapes.naca("0012", chord=15.5).curves[0]
    stops = [sf.paths.Marker(k, "M0", 0.0, True) for k in range(1, 12)]
    path = sf.Path([curve] * 12, markers=stops, tolerance=0.1)
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    monkeypatch.setattr(workers, "cores", lambda: 1)
    alone = sf.plan(path, limits, strategy="time-optimal", period=1e-3)
    monkeypatch.setattr(workers, "cores", lambda: 2)
    monkeypatch.setattr(workers, "WORTH_SPREADING", 0.0)
    spread = sf.plan(path, limits, strategy="time-optimal", period=1e-3)
    assert np.array_equal(alone.breaks, spread.breaks) and np.array_equal(alone.coefficients, spread.coefficients)


@pytest.mark.parametrize("strategy", ["look-ahead", "time-optimal"])
def test_a_line_without_a_limit_of_jerk_takes_constant_accelerations(strategy):
    """One limit more is never slower: without a limit of jerk T = 2 sqrt(L / A), with one a little more."""
    line = sf.Path([sf.NurbsCurve.bezier([[0.0], [40.0]])], axes=("x",))
    rough = sf.Limits(feed=1000.0, axis_acceleration=10.0)
    law = sf.plan(line, rough, strategy=strategy)
    assert law.duration == pytest.approx(4.0, rel=1e-12)
    assert law.acceleration(np.array([1.0, 3.0])) == pytest.approx([10.0, -10.0], rel=1e-12)
    assert (
        law.duration
        < sf.plan(line, dataclasses.replace(rough, axis_jerk=1e12), strategy=strategy).duration
        < 4.0 + 1e-5
    )
    with_feed = sf.plan(line, dataclasses.replace(rough, feed=5.0), strategy=strategy)
    assert with_feed.duration == pytest.approx(8.5, rel=1e-12)


@pytest.mark.parametrize("strategy", ["look-ahead", "time-optimal"])
def test_a_wait_at_the_end_is_in_the_law(strategy: str) -> None:
    """A last feed of a rounding is rest."""
    corners = [[0, 0], [5, 0], [5, 5], [0, 5], [0, 0], [5, 0]]
    path = sf.Path.polyline(corners, feeds=[10, 20, 30, 10, 20], markers=[sf.paths.Marker(5, "M5", 0.5)])
    limits = sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    waits = sf.plan(path, limits, strategy=strategy, period=1e-3).duration
    without = sf.plan(sf.Path(path.curves, feeds=path.feeds), limits, strategy=strategy, period=1e-3).duration
    assert waits == pytest.approx(without + 0.5, abs=1e-9)

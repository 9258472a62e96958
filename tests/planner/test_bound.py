"""The lower bound: held to closed forms, to best known times, and to duality itself for any multipliers."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import cases, curves
from scipy.interpolate import BSpline
from scipy.optimize import linprog

import splinefeed as sf
from splinefeed.planner import profiles
from splinefeed.planner.bound import Dual, feasible, rows_of
from splinefeed.planner.strategies import conditions_of

PERIOD = 1e-3
#: Motion that begins and ends at rest.
REST = ((0.0, 0.0), (0.0, 0.0))


def line(length: float) -> sf.Path:
    return sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [(0.0, 0.0), (0.6 * length, 0.8 * length)])], name="line")


def bound_of(path: sf.Path, limits: sf.Limits, **more) -> tuple[float, float]:
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD, bound=True, **more)
    return law.settings["lower_bound_s"], law.duration


@pytest.mark.parametrize("length", [0.5, 3.0, 20.0, 100.0])
@pytest.mark.parametrize("limits", [{}, {"deceleration": 200.0}, {"feed": 30.0}])
def test_the_best_motion_along_a_line_is_bounded_closely(length: float, limits: dict[str, float]) -> None:
    """Of a gently bent line, as straight ones have a closed form: the plan's own would be compared with itself."""
    own = sf.Limits(**{"feed": 60.0, "acceleration": 500.0, "jerk": 20000.0, **limits})
    exact = sf.plan(line(length), own, strategy="seven-phase").duration
    bent = sf.Path([sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [(0, 0), (0.5 * length, 1e-5 * length), (length, 0)])])
    lower, _ = bound_of(bent, own)
    assert 0.998 * exact < lower <= exact * (1.0 + 1e-6)


@pytest.mark.parametrize("name", ["star", "heart", "trident"])
@pytest.mark.parametrize("setting", ["A", "B", "C"])
def test_no_motion_that_is_known_is_faster_and_the_gap_is_within_1_percent(name: str, setting: str) -> None:
    lower, duration = bound_of(getattr(curves, name)(), cases.axis_limits(setting))
    assert lower <= min(duration, 1.001 * curves.REFERENCE[name, setting])
    assert lower >= 0.99 * (duration - PERIOD)


def test_motion_from_a_feed_is_bounded_too() -> None:
    path, limits = cases.butterfly(), cases.axis_limits("A")
    lower, duration = bound_of(path, limits, start=sf.planner.State(feed=20.0, acceleration=100.0))
    rest, _ = bound_of(path, limits)
    assert 0.99 * duration < lower < duration
    assert lower < rest - 0.02


def test_whatever_the_multipliers_no_motion_within_the_limits_is_faster() -> None:
    """Weak duality, of any splines that are not negative: their bound is below the time of a motion far from the best.

    What is left out of Z <= 1 or of the rows tells at once: the best multipliers times 1.5 would be beyond the time.
    """
    path, limits = cases.airfoil12(), cases.axis_limits("A")
    setting = conditions_of(path, limits, PERIOD)
    dual = Dual(setting, np.linspace(0.0, path.length, 41), REST, 1.0 / limits.feed, 8)
    random = np.random.default_rng(5)
    for _ in range(20):
        x = random.exponential(random.choice([1e-3, 1e-2, 0.1]), dual.fixed.shape) * random.integers(
            2, size=(1, dual.fields)
        )
        jerk = np.sum(x[:, : dual.jerks], axis=1, keepdims=True)
        x[:, : dual.jerks] /= np.maximum(jerk, 1.0)
        assert dual.bound(x) < 1.2691  # the best known time


@pytest.mark.parametrize("seed", range(3))
def test_the_largest_q_of_a_place_is_that_of_linear_programs(seed: int) -> None:
    """Against states (q, q', q'') within the limits: above it there are none, and mostly some hardly below it."""
    random = np.random.default_rng(seed)
    path, limits = cases.butterfly(), sf.Limits(feed=400.0, axis_acceleration=2000.0, axis_jerk=2e4)
    places = np.sort(random.uniform(1.0, path.length - 1.0, 60))
    rows = rows_of(conditions_of(path, limits, PERIOD), places)
    jerk = random.random(60) < 0.8
    found, scale = feasible(rows, jerk), np.array([1e4, 1e6])
    assert np.all(found[~jerk] == rows.top[~jerk])
    lower, below = np.flatnonzero(found < 0.9 * rows.top), 0
    assert len(lower) > 5
    for k in lower:
        (c0, c1, c2), (l0, l1) = rows.jerk[:, :, k].T, rows.linear[:, :, k].T
        sides = np.concatenate([np.column_stack([c1, c2]), np.column_stack([l1, 0 * l1])])
        for share in (0.99, 1.01):
            q = share * found[k]
            high = np.concatenate([q**-0.5 - c0 * q, rows.high[:, k] - l0 * q])
            low = np.concatenate([q**-0.5 + c0 * q, l0 * q - rows.low[:, k]])
            sided = np.concatenate([sides, -sides]) * scale
            given = np.concatenate([high, low])
            state = linprog([0.0, 0.0], sided, given, bounds=[(None, None)] * 2, method="highs")
            assert share < 1.0 or state.status == 2, (places[k], q)
            below += state.status == 0
    assert below > 0.6 * len(lower)  # accelerations alone may leave less, which multipliers see anyway


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.0), (400.0, 0.0), (0.0, 900.0), (400.0, 900.0)])
def test_rows_with_multipliers_add_up_as_they_do_before_they_are_integrated_by_parts(start: float, end: float) -> None:
    """int x (row) ds of any q(s) and any spline x, by the rows' own c0, c1, c2: what `pull` and `fixed` make of it."""
    path = cases.smooth()
    limits = sf.Limits(feed=60.0, acceleration=500.0, jerk=2e4, axis_acceleration=400.0, axis_jerk=1e4)
    setting, length = conditions_of(path, limits, PERIOD), path.length
    nodes = np.unique(np.concatenate([np.linspace(0.0, length, 60), setting.breaks, [0.0, length]]))
    # q with q = q' = 0 at rest, else a slope of its own
    shape = np.array([start, start + 3.0 * (start > 0.0), 500.0, 2000.0, 900.0, end - 5.0 * (end > 0.0), end])
    q = BSpline(np.concatenate([[0.0] * 3, np.linspace(0.0, length, 5), [length] * 3]), shape, 3)
    ends = tuple((float(q(s)), float(q(s, 1))) for s in (0.0, length))
    dual = Dual(setting, nodes, ends, 1.0 / limits.feed, 8)
    x = np.random.default_rng(1).uniform(0.0, 0.1, dual.fixed.shape)
    values = BSpline(dual.spline.t, x, 3)(dual.x)
    rows = setting.rows(dual.x)
    y = np.stack([q(dual.x), q(dual.x, 1), q(dual.x, 2)])
    jerk, linear = np.einsum("kdn,dn->kn", rows.jerk, y), np.einsum("kdn,dn->kn", rows.linear, y[:2])
    sides = [jerk, -jerk, (linear - rows.high) / limits.feed, (rows.low - linear) / limits.feed]
    wanted = np.sum(dual.weight.ravel() * np.concatenate(sides) * values.T)
    _, P = dual.at(x)
    found = np.vdot(dual.weight.ravel() * y[0], P.ravel()) - np.vdot(dual.fixed, x)
    assert found == pytest.approx(wanted, rel=1e-8)


def test_limits_without_jerk_or_with_a_top_far_away_are_bounded_too() -> None:
    path = cases.butterfly()
    for limits in (
        sf.Limits(feed=60.0, axis_acceleration=500.0),
        sf.Limits(axis_velocity=1e7, axis_acceleration=500.0, axis_jerk=2e4),
        sf.Limits(axis_velocity=50.0, axis_jerk=2e4),
        sf.Limits(feed=400.0, axis_acceleration=900.0, axis_jerk=2e5),
    ):
        lower, duration = bound_of(path, limits)
        assert 0.96 * duration < lower < duration


def test_between_setpoints_the_largest_q_within_a_step_counts() -> None:
    path, limits = cases.butterfly(), sf.Limits(feed=60.0, axis_acceleration=500.0, chord_error=1e-5)
    setting = conditions_of(path, limits, PERIOD)
    s = np.linspace(1.0, 20.0, 4001)
    rows = setting.rows(s, alone=True, smooth=True)
    step = PERIOD * np.sqrt(np.max(rows.own))
    wanted = [min(own, np.max(rows.between[np.abs(s - at) <= step])) for at, own in zip(s, rows.own, strict=True)]
    assert rows_of(setting, s).top == pytest.approx(wanted, rel=1e-12)
    assert np.mean(np.array(wanted) < rows.own) > 0.1


@pytest.mark.parametrize("length", [30.0, 1e-9])
def test_on_a_line_it_is_no_more_than_the_profile_of_any_jerk_takes(length: float) -> None:
    """Jerk beyond a million times the acceleration is planned as that, which costs up to a microsecond a ramp."""
    path = sf.Path.polyline([[0.0, 0.0], [length, 0.0]])
    limits = sf.Limits(feed=60, axis_acceleration=1000, axis_jerk=1e12)
    law = sf.plan(path, limits, strategy="time-optimal", bound=True)
    exact = float(profiles.solve(np.array([length]), 60.0, 1e3, 1e3, 1e12, 1e12, 0.0, 0.0).duration[0])
    assert law.duration > exact * (1.0 + 1e-9)
    assert exact - 5e-6 < law.settings.get("lower_bound_s", 0.0) <= exact

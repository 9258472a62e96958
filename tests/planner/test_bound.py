"""The lower bound: held to closed forms, to best known times, and to duality itself for any multipliers."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import cases, curves
from scipy.interpolate import BSpline
from scipy.optimize import linprog

import splinefeed as sf
from splinefeed.planner.dual import Dual, _least, longest, rows_of
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
        assert dual.bound(x, *dual.at(x)) < 1.2691  # the best known time


@pytest.mark.parametrize("most", [0.9, 1.5, 4.0])
def test_whatever_differs_from_one_q_to_another_no_motion_is_faster(most: float) -> None:
    """As above of sums Z of any size, under chords too: what is below the integrand at each q bounds the time."""
    path, limits = cases.airfoil12(), cases.axis_limits("A")
    setting = conditions_of(path, limits, PERIOD)
    dual = Dual(setting, np.linspace(0.0, path.length, 41), REST, 1.0 / limits.feed, 8, lambda s: 100.0 + 0.0 * s)
    plain = Dual(setting, np.linspace(0.0, path.length, 41), REST, 1.0 / limits.feed, 8)
    random, found = np.random.default_rng(6), []
    for _ in range(30):
        x = random.exponential(random.choice([1e-3, 1e-2, 0.1]), dual.fixed.shape) * random.integers(
            2, size=(1, dual.fields)
        )
        linear = (np.arange(dual.fields) >= dual.jerks) & (np.arange(dual.fields) < dual.jerks + dual.linears)
        total = np.sum(x[:, ~linear], axis=1, keepdims=True)
        x[:, ~linear] *= np.minimum(1.0, most / np.maximum(total, 1e-9))
        found.append(dual.by_place(x)[0])
        assert found[-1] < 1.2691  # the best known time
        own = x[:, : plain.fields]
        if most < 1.0:  # the multipliers themselves are among what each interval may take
            assert plain.by_place(own)[0] >= plain.bound(own, *plain.at(own)) - 1e-9
    assert np.max(found) > -1e3


@pytest.mark.parametrize("seed", range(3))
def test_what_is_below_the_integrand_is_so_at_every_state_within_the_limits_and_nearly_reached(seed: int) -> None:
    """Against states (q, q', q'') within the limits, the best of them by a linear program at each q."""
    random = np.random.default_rng(seed)
    path, limits = cases.butterfly(), sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=2e4, jerk=3e4)
    rows = rows_of(conditions_of(path, limits, PERIOD), np.sort(random.uniform(1.0, path.length - 1.0, 12)))
    n = len(rows.top)
    y, z = random.normal(0.0, 0.3, rows.jerk[:, 2].shape), random.normal(0.0, 3e-3, rows.linear[:, 1].shape)
    g, a = np.sum(y * rows.jerk[:, 2], 0), np.sum(y * rows.jerk[:, 1], 0) + np.sum(z * rows.linear[:, 1], 0)
    b = random.normal(0.0, 1e-6, n)
    cost = np.sum(np.maximum(z * rows.high, z * rows.low), axis=0)
    P = b + np.sum(y * rows.jerk[:, 0], 0) + np.sum(z * rows.linear[:, 0], 0)
    own = np.stack([1.0 - np.sum(np.abs(y), 0), P, cost])
    edges = np.sqrt(rows.top) * np.linspace(0.0, 1.0, 60)[:, None]
    found = _least(rows, np.stack([g, a, b]), own, np.ones(n, dtype=bool), edges)
    close = []
    for k in range(n):
        best = np.inf
        for q in rows.top[k] * np.linspace(0.03, 1.0, 40) ** 2:
            (c0, c1, c2), (l0, l1) = rows.jerk[:, :, k].T, rows.linear[:, :, k].T
            sides = np.concatenate([np.column_stack([c1, c2]), np.column_stack([-c1, -c2])])
            room = np.concatenate([q**-0.5 - c0 * q, q**-0.5 + c0 * q])
            sides = np.concatenate([sides, np.column_stack([l1, 0 * l1]), np.column_stack([-l1, 0 * l1])])
            room = np.concatenate([room, rows.high[:, k] - l0 * q, l0 * q - rows.low[:, k]])
            scale = np.array([1e4, 1e6])
            free = [(None, None)] * 2
            state = linprog(-np.array([a[k], g[k]]) * scale, sides * scale, room, bounds=free, method="highs")
            if state.status == 0:
                best = min(best, q**-0.5 + b[k] * q + state.fun)
        assert found[k] <= best + 1e-9 * abs(best)
        if np.isfinite(found[k]):  # else the integrand falls without end as q does
            close.append((best - found[k]) / (abs(best) + q**-0.5))
    assert len(close) > 3
    assert np.median(close) < 0.02


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
    # what the multipliers have in common adds nothing but the ends, whatever the motion
    chords = Dual(setting, nodes, ends, 1.0 / limits.feed, 8, lambda s: 100.0 + 0.0 * s)
    x = np.random.default_rng(2).uniform(0.0, 0.1, chords.fixed.shape)
    (g, a, b), _ = chords.common(x)
    parts = chords.weight.ravel() * np.stack([b * y[0], -a * y[1], -g * y[2]])
    assert np.sum(parts) == pytest.approx(np.vdot(chords.at_ends, x), abs=1e-8 * np.sum(np.abs(parts)))


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


def test_steps_are_as_long_as_any_place_within_them_allows() -> None:
    s = np.arange(10.0)
    allowed = np.array([5.0, 5.0, 5.0, 1.2, 0.9, 1.1, 0.5, 0.5, 0.5, 0.5])
    found = longest(s, allowed, 3.0)
    assert found.tolist() == [3.0, 3.0, 3.0, 3.0, 0.9, 1.1, 0.5, 0.5, 0.5, 0.5]

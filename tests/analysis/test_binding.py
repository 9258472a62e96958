"""Which limit binds: shares against the definitions, and the maximum-velocity curve against a linear program."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

import splinefeed as sf
from sample_curves import random_curve
from splinefeed.analysis.measures import maximum_velocity
from splinefeed.curves.differential import by_arc_length, curvatures
from splinefeed.records import Array
from splinefeed.runs.run import run


def top_of(derivatives: Array, path: sf.Path, limits: sf.Limits, feed: Array, period: float) -> Array:
    kappa = curvatures(derivatives)
    slow = {"centripetal": kappa} if limits.centripetal else {}
    d = by_arc_length(derivatives)
    return maximum_velocity(d[:, 1], d[:, 2], slow, kappa, path.axes, limits, feed, period)


def used(path: sf.Path, limits: sf.Limits, strategy: str = "time-optimal"):
    result = run(path, limits, strategy=strategy)
    return result, result.use


@pytest.mark.slow
def test_a_time_optimal_plan_is_bound_nearly_everywhere_and_never_above_its_curve():
    limits = sf.Limits(feed=60, axis_velocity=60, axis_acceleration=500, axis_jerk=20000)
    result, use = used(sf.shapes.butterfly(), limits)
    assert use.names == ("feed", *(f"axis_{of}.{axis}" for of in ("velocity", "acceleration", "jerk") for axis in "xy"))
    assert np.max(use.share) <= 1.0 + 1e-9
    assert np.all(result.points.feed <= use.top * (1.0 + 1e-9))
    parts = use.time_bound_by()
    assert sum(parts.values()) == pytest.approx(1.0, abs=1e-12)
    assert parts["none"] < 0.1
    assert parts["feed"] > 0.4
    for name in use.names:
        assert np.max(use.share[:, use.names.index(name)]) == pytest.approx(result.verdict.limits[name].share, rel=1e-3)


def test_a_line_is_bound_by_jerk_acceleration_and_feed_in_turn():
    path = sf.Path([sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0, 0.0], [30.0, 40.0]])])
    limits = sf.Limits(feed=20, acceleration=50, jerk=1000)
    result, use = used(path, limits, "seven-phase")
    names = ["" if k < 0 else use.names[k] for k in use.binding]
    order = [name for i, name in enumerate(names) if i == 0 or name != names[i - 1]]
    assert [name for name in order if name] == [
        "jerk", "acceleration", "jerk", "feed", "jerk", "deceleration", "jerk",
    ]  # fmt: skip
    assert np.all(use.top == 20.0)
    assert use.share[:, 0] == pytest.approx(result.law.feed(result.points.t) / 20.0, abs=1e-4)


def test_on_a_circle_the_curve_is_what_acceleration_leaves():
    """All axes together never turn slower than the worst direction allows: v^2 / r <= A at the four sides."""
    path = sf.shapes.circle(radius=10.0)
    limits = sf.Limits(feed=1e3, axis_acceleration=400.0)
    places = np.linspace(0.0, path.length, 9)
    curve, u = path.locate(places)
    derivatives = path.evaluate(curve, u, 3)
    top = top_of(derivatives, path, limits, np.full(9, 1e3), 1e-3)
    assert top[::2] == pytest.approx(np.sqrt(400.0 * 10.0), rel=1e-9)
    assert top[1::2] == pytest.approx(np.sqrt(400.0 * 10.0 * np.sqrt(2.0)), rel=1e-9)


def test_the_curve_is_the_top_of_a_linear_program():
    """Highest q for which some a exists with |r' a + r'' q| <= A for every axis and |a| <= the path's own."""
    rng = np.random.default_rng(20261121)
    for seed in range(2, 36, 3):
        path = sf.Path([random_curve(seed, axes=3)])
        own = float(rng.uniform(5.0, 500.0)) if rng.random() < 0.5 else np.inf
        limits = sf.Limits(
            feed=1e4, acceleration=own, axis_acceleration={a: float(rng.uniform(10.0, 1e3)) for a in "xyz"}
        )
        curve, u = path.locate(rng.uniform(0.0, path.length, 6))
        derivatives = path.evaluate(curve, u, 3)
        top = top_of(derivatives, path, limits, np.full(6, 1e4), 1e-3)
        d = by_arc_length(derivatives)
        for k in range(6):
            rows = np.column_stack([d[k, 1], d[k, 2]])
            bounds = limits.of_axes("axis_acceleration", path.axes)
            found = linprog(
                [0.0, -1.0],
                A_ub=np.concatenate([rows, -rows]),
                b_ub=np.concatenate([bounds, bounds]),
                bounds=[(-own if np.isfinite(own) else None, own if np.isfinite(own) else None), (0.0, 1e8)],
            )
            assert found.status == 0
            assert top[k] == pytest.approx(np.sqrt(found.x[1]), rel=1e-6)


def test_chord_error_and_centripetal_limit_the_curve():
    path = sf.shapes.butterfly()
    limits = sf.Limits(feed=200, acceleration=2000, jerk=1e5, chord_error=1e-4, centripetal=300)
    result, use = used(path, limits)
    assert {"chord_error", "centripetal"} <= set(use.names)
    assert np.max(use.share) <= 1.0 + 1e-6
    assert np.all(result.points.feed <= use.top * (1.0 + 1e-9))


def test_the_feed_of_a_program_counts():
    lines = [sf.NurbsCurve(1, [0, 0, 1, 1], [[x, 0.0], [x + 10.0, 0.0]]) for x in (0.0, 10.0)]
    path = sf.Path(lines, feeds=[5.0, np.inf])
    result, use = used(path, sf.Limits(feed=20, acceleration=100, jerk=1000))
    curve = result.points.curve
    assert np.all(use.top[curve == 0] == 5.0)
    assert np.all(use.top[curve == 1] == 20.0)
    assert use.share[:, 0] == pytest.approx(result.points.feed / np.where(curve, 20.0, 5.0), abs=2e-3)

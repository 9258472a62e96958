"""A path through waypoints of any axes: where it passes, how smooth it is, what it says and refuses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import splinefeed as sf

POINTS = np.array([[0, 0, 0], [30, 40, 5], [80, 35, 0], [90, -20, 10], [40, -30, 4], [10, -60, 0], [0, -90, 3]], float)


def test_it_passes_all_of_them_without_a_stop_and_begins_a_curve_at_each():
    path = sf.Path.through(POINTS, name="seven")
    assert (path.axes, path.name, path.stops, path.findings) == (("x", "y", "z"), "seven", (), ())
    assert len(path.curves) == len(POINTS) - 1
    np.testing.assert_allclose(path(path.curve_starts), POINTS, atol=1e-9)
    for one, other in zip(path.curves, path.curves[1:], strict=False):
        before, behind = (c.derivatives(u, 3) for c, u in ((one, one.domain[1]), (other, other.domain[0])))
        np.testing.assert_allclose(before, behind, rtol=1e-7, atol=1e-6 * np.abs(before).max())


@pytest.mark.parametrize("count", [2, 3, 5, 6, 40])
def test_any_axes_rotary_ones_too(count):
    rng = np.random.default_rng(count)
    points = np.column_stack([rng.uniform(-50, 50, (count, 3)), rng.uniform(-1, 1, (count, 2))])
    path = sf.Path.through(points, ("x", "y", "z", "a", "c"))
    np.testing.assert_allclose(path(path.curve_starts), points, atol=1e-8)
    limits = sf.Limits(axis_velocity=[300, 300, 300, 3, 3], axis_acceleration=[3000] * 3 + [30] * 2,
                       axis_jerk=[60000] * 3 + [600] * 2)  # fmt: skip
    assert sf.run(path, limits, period=1e-3).ok


def test_near_them_it_bends_less_and_keeps_the_tolerance_of_each_axis():
    near = np.array([2.0, 0.5, 0.0])
    path, exact = sf.Path.through(POINTS, near=near), sf.Path.through(POINTS)
    off = np.abs(path(path.curve_starts) - POINTS)
    assert np.all(off <= near + 1e-9)
    assert np.max(off, axis=0) == pytest.approx(near, abs=1e-9)
    assert not np.any(off[[0, -1]] > 1e-12)
    limits = sf.Limits(axis_velocity=300, axis_acceleration=3000, axis_jerk=60000)
    assert sf.plan(path, limits).duration < sf.plan(exact, limits).duration


def test_a_tolerance_below_the_rounding_of_the_waypoints_is_refused():
    with pytest.raises(sf.errors.InputError, match="near: 1e-308 is below the rounding of the waypoints; give more"):
        sf.Path.through(POINTS, near=1e-308)


def test_the_points_near_by_are_the_best_ones():
    """Against a general optimiser on the same integral, by trapezoids over the joined curves."""
    points, near = POINTS[:, :1], 3.0
    x = np.linspace(0, 1, 4001)[1:-1]

    def bend(inner):
        from scipy.interpolate import make_interp_spline

        u = np.append(0, np.cumsum(np.sqrt(np.abs(np.diff(points[:, 0])))))
        values = np.concatenate([points[:1, 0], inner, points[-1:, 0]])
        free = [(3, 0.0), (4, 0.0)]
        spline = make_interp_spline(u / u[-1], values, 5, bc_type=(free, free))
        return float(np.mean(spline.derivative(3)(x) ** 2))

    bounds = [(p - near, p + near) for p in points[1:-1, 0]]
    best = minimize(
        bend, points[1:-1, 0], bounds=bounds, method="L-BFGS-B", options={"maxiter": 5000, "maxfun": 100000}
    )
    path = sf.Path.through(points, ("x",), near=near)
    own = np.array([c(c.domain[0])[0] for c in path.curves[1:]])
    assert bend(own) <= best.fun * 1.001


def test_a_path_that_turns_back_says_where_it_stops():
    path = sf.Path.through([[0, 0], [50, 20], [0, 0]])
    assert len(path.stops) == 1
    assert path.findings == ("the motion stops near waypoint 2, where the path turns back on itself",)


@pytest.mark.parametrize(
    ("waypoints", "how", "message"),
    [
        ([[0, 0]], {}, "waypoints have shape (1, 2); expected 2 or more rows of as many numbers"),
        ([[0, 0], [1]], {}, "waypoints have shape (0,); expected 2 or more rows"),
        ("abc", {}, "waypoints have shape (0,); expected 2 or more rows"),
        ([[0, 0], [np.nan, 1]], {}, "waypoint 2 has nan for column 1; give finite numbers"),
        ([[0, 0], [1, 1], [1, 1]], {}, "waypoints 2 and 3 are the same; leave one out, or plan two paths for a stop"),
        ([[0, 0], [1, 1]], {"near": -1}, "near is -1; expected a number, or 2 numbers, of 0 or more"),
        ([[0, 0], [1, 1]], {"weights": [1, 0]}, "weights have shape (2,); expected 2 numbers greater than 0"),
        ([[0, 0], [1, 1]], {"times": [0, 1], "duration": 2}, "times and duration are given"),
        (
            [[0, 0], [1, 1]],
            {"times": [1, 2]},
            "times have shape (2,); expected one for each of 2 waypoints, the first 0",
        ),
        ([[0, 0], [1, 1]], {"duration": -2}, "times are [-2.0] s; they must be above 0, at most 1e+100, and increase"),
        (np.random.default_rng(0).uniform(size=(1001, 2)), {"near": 1}, "near: 1001 waypoints are too many; 1000 are"),
    ],
)
def test_what_cannot_be_is_refused(waypoints, how, message):
    with pytest.raises(sf.SplinefeedError) as error:
        sf.Path.through(waypoints, **how)
    assert str(error.value).startswith(message)

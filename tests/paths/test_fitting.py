"""Fits of points and of functions: within the tolerance by brute force, fair, and clear about what cannot be fitted."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sections import airfoil
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.paths import shapes
from splinefeed.paths.fitting import distances, fit, fit_function
from splinefeed.paths.fitting import points as fitting_points
from splinefeed.paths.fitting.points import corner_indices


def brute_force(curves, points, samples=20_000):
    """Distances (n,) of points from polylines of many samples; never less than the true ones by more than the sag."""
    best = np.full(len(points), np.inf)
    for curve in curves:
        line = curve(np.linspace(*curve.domain, samples))
        start, along = line[:-1], np.diff(line, axis=0)
        square = np.maximum(np.sum(along * along, axis=1), 1e-300)
        for i, point in enumerate(points):
            t = np.clip(np.sum((point - start) * along, axis=1) / square, 0.0, 1.0)
            best[i] = min(best[i], np.min(np.linalg.norm(start + t[:, None] * along - point, axis=1)))
    return best


def signed_curvature(path, count=4001):
    curve, u = path.locate(np.linspace(0.0, path.length, count))
    first, second = np.moveaxis(path.evaluate(curve, u, 2)[:, 1:], 1, 0)
    return (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.linalg.norm(first, axis=1) ** 3


def turning_points(values, least):
    """How often a sequence turns back by more than `least`."""
    count, rising, extreme = 0, None, values[0]
    for value in values:
        if rising is None:
            rising = None if abs(value - extreme) <= least else bool(value > extreme)
            extreme = extreme if rising is None else value
        elif (value > extreme) == rising:
            extreme = value
        elif abs(value - extreme) > least:
            count, rising, extreme = count + 1, not rising, value
    return count


def lissajous(count):
    t = np.linspace(0.0, 1.0, count)
    return np.column_stack([50.0 * np.cos(7.0 * t), 30.0 * np.sin(11.0 * t), 5.0 * t])


# --- the tolerance ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 12])
def test_every_point_is_within_the_tolerance(degree):
    points = lissajous(300)
    result = fit(points, 1e-3, degree)
    assert result.error <= 1e-3
    assert [curve.degree for curve in result.curves] == [degree]
    some = points[::4]
    np.testing.assert_allclose(distances(result.curves, some), brute_force(result.curves, some), atol=1e-4)
    np.testing.assert_allclose(result.curves[0](np.array([0.0, 1.0])), points[[0, -1]], atol=1e-13)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-5, 1e-7, 1e-9])
def test_smaller_tolerances_take_more_knots(tolerance):
    result = fit(lissajous(2000), tolerance)
    assert result.error <= tolerance
    assert result.knots <= 30.0 * tolerance**-0.27


def test_true_distance_is_measured_and_not_that_at_equal_parameters():
    curve = shapes.butterfly().curves[0]
    u = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 400))
    normal = np.flip(curve.tangent(u), axis=1) * [-1.0, 1.0]
    offset = np.random.default_rng(2).uniform(0.0, 1e-3, 400)
    found = distances([curve], curve(u) + offset[:, None] * normal)
    np.testing.assert_array_less(found, offset + 1e-12)
    some = slice(None, None, 10)
    expected = brute_force([curve], (curve(u) + offset[:, None] * normal)[some], 200_000)
    np.testing.assert_allclose(found[some], expected, atol=5e-7)


def test_distance_where_curves_cross_and_lie_close():
    comb = [NurbsCurve.bezier([[0.0, 0.01 * k], [100.0, 0.3 * k]]) for k in range(30)]
    points = np.random.default_rng(3).uniform([0.0, 0.0], [100.0, 8.0], (300, 2))
    np.testing.assert_allclose(distances(comb, points), brute_force(comb, points, 2), atol=1e-12)


@settings(max_examples=30)
@given(
    st.integers(0, 10_000),
    st.integers(2, 80),
    st.integers(1, 6),
    st.sampled_from([1, 2, 3, 5]),
    st.sampled_from([1e-4, 1e-2, 1.0]),
)
def test_random_walks_of_any_shape_are_passed(seed, count, axes, degree, tolerance):
    random = np.random.default_rng(seed)
    steps = random.normal(size=(count, axes)) * 10.0 ** random.uniform(-1.0, 1.0, (count, 1))
    points = np.cumsum(steps, axis=0)
    if tolerance >= np.linalg.norm(np.ptp(points, axis=0)):
        return
    result = fit(points, tolerance, degree)
    assert result.error <= tolerance
    assert np.max(distances(result.curves, points)) == pytest.approx(result.error, abs=1e-12)
    for before, after in zip(result.curves[:-1], result.curves[1:], strict=True):
        np.testing.assert_array_equal(before.control_points[-1], after.control_points[0])
    result.path()


def test_noise_within_the_tolerance_takes_no_more_knots_than_the_shape():
    exact = lissajous(5_000)
    noisy = exact + np.random.default_rng(4).uniform(-2e-4, 2e-4, exact.shape)
    smooth, rough = fit(exact, 1e-3), fit(noisy, 1e-3)
    assert len(rough.curves) == 1
    assert rough.knots <= 1.5 * smooth.knots
    assert rough.path().length == pytest.approx(smooth.path().length, rel=1e-5)


@pytest.mark.slow
def test_many_points():
    points = lissajous(50_000)
    result = fit(points, 1e-3)
    assert result.error <= 1e-3
    assert result.knots < 200


def test_far_from_zero_the_digits_stay():
    near, far = fit(lissajous(300), 1e-4), fit(lissajous(300) + 1e6, 1e-4)
    assert far.knots == near.knots
    assert far.error == pytest.approx(near.error, abs=1e-8)


# --- fairness ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "turns"),
    [("naca0024", 1), ("pygeo_naca0012_zeroLE", 1), ("s1223", 6)],  # S1223 has these: two humps below, a cusped tail
)
@pytest.mark.parametrize("degree", [3, 5])
def test_curvature_of_measured_airfoils_does_not_oscillate(data_dir, name, turns, degree):
    points = airfoil(data_dir, name)
    result = fit(points, 1e-3, degree)
    path = result.path(("x", "y"), name)
    assert len(result.curves) == 1
    kappa = signed_curvature(path)
    assert turning_points(kappa, 0.01 * np.ptp(kappa)) <= turns
    chords = float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    assert chords < path.length < 1.001 * chords


def test_few_points_of_a_section_lead_to_the_section(data_dir):
    points = airfoil(data_dir, "naca0024")
    path = fit(points, 1e-3).path()
    assert len(points) == 35
    x = np.linspace(0.0, 1.0, 20_001) ** 2
    # as tabulated, with the open edge
    half = 1.2 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    section = 100.0 * np.concatenate([np.column_stack([x, half])[::-1], np.column_stack([x, -half])[1:]])
    from scipy.spatial import cKDTree

    off = cKDTree(section).query(path(np.linspace(0.0, path.length, 2001)))[0]
    assert np.max(off) < 0.01  # the points themselves are off by 0.001, and 5 mm apart


def test_circle_from_a_dozen_points_is_round():
    angle = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    points = 10.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    path = fit(points, 1e-3, closed=True).path()
    assert path.closed
    assert not len(path.corners)
    np.testing.assert_allclose(np.linalg.norm(path(np.linspace(0.0, path.length, 500)), axis=1), 10.0, atol=5e-3)
    np.testing.assert_allclose(signed_curvature(path), 0.1, rtol=0.05)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_closed_fit_is_smooth_over_its_seam(degree):
    angle = np.linspace(0.0, 2.0 * math.pi, 101)
    points = np.column_stack([50.0 * np.cos(angle), 20.0 * np.sin(angle)])
    result = fit(points, 1e-4, degree, closed=True)  # the last point repeats the first
    (curve,) = result.curves
    assert curve.clamped
    start, end = curve.derivatives(np.array([0.0, 1.0]), min(3, degree - 1))
    for k in range(degree if degree < 4 else 4):
        np.testing.assert_allclose(start[k], end[k], atol=1e-7 * 100.0**k)


# --- corners ----------------------------------------------------------------------------------------------------------


def test_corners_part_the_curves_and_are_met_exactly():
    t = np.linspace(0.0, 1.0, 50)
    arc = np.column_stack([10.0 * np.cos(math.pi * t), 10.0 * np.sin(math.pi * t)])
    points = np.concatenate([arc, np.column_stack([-10.0 + 20.0 * t, 0.0 * t])])
    result = fit(points, 1e-3, closed=True)
    assert len(result.curves) == 2
    for curve in result.curves:
        assert min(np.linalg.norm(curve.control_points[0] - [r, 0.0]) for r in (10.0, -10.0)) < 1e-14
    path = result.path()
    assert path.closed
    assert len(path.stops) == 1  # the other corner is where the path begins and ends
    assert path.length == pytest.approx(10.0 * math.pi + 20.0, rel=2e-5)


def test_closed_contour_begins_at_its_first_point_even_between_corners():
    square = np.array([[5.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]])
    path = fit(square, 1e-3, closed=True).path()
    assert len(path.curves) == 5
    assert len(path.stops) == 4
    np.testing.assert_allclose(path(np.array([0.0, 5.0, 40.0])), [[5.0, 0.0], [10.0, 0.0], [5.0, 0.0]], atol=1e-5)


def test_corner_angle_can_be_chosen():
    bend = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 3.0], [30.0, 6.0]])  # 17 degrees
    assert len(fit(bend, 1e-3).curves) == 1
    assert len(fit(bend, 1e-3, corner_angle=math.radians(10.0)).curves) == 2
    right = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert len(fit(right, 1e-3).curves) == 2
    assert len(fit(right, 1e-3, corner_angle=math.pi).curves) == 1


def test_noise_makes_no_corner_but_a_corner_in_noise_is_one():
    t = np.arange(1.0, 2001.0)
    line = np.concatenate([np.column_stack([-t[::-1], 0.0 * t]), [[0.0, 0.0]], np.column_stack([0.0 * t, t])]) * 5e-3
    line += np.random.default_rng(5).uniform(-5e-4, 5e-4, line.shape)
    line[1999:2002] = [[-5e-3, 0.0], [0.0, 0.0], [0.0, 5e-3]]
    np.testing.assert_array_equal(corner_indices(line, math.radians(30.0), 1e-2), [2000])


def test_blunt_nose_of_few_points_is_no_corner():
    angle = np.radians([90.0, 60.0, 25.0, -25.0, -60.0, -90.0])
    nose = np.column_stack([-np.cos(angle), np.sin(angle)])
    line = np.concatenate([[[5.0, 1.0]], nose, [[5.0, -1.0]]])
    assert len(corner_indices(line, math.radians(30.0), 1e-2)) == 0


# --- functions --------------------------------------------------------------------------------------------------------


def wave(u):
    return np.column_stack([u, np.sin(3.0 * u), np.exp(-u)])


@pytest.mark.parametrize("degree", range(1, 13))
def test_function_is_followed_within_the_tolerance(degree):
    tolerance = 1e-4 if degree < 3 else 1e-8
    curve, error = fit_function(wave, tolerance, degree, (-1.0, 4.0))
    assert curve.degree == degree
    assert curve.domain == (-1.0, 4.0)
    u = np.random.default_rng(6).uniform(-1.0, 4.0, 20_000)
    worst = np.max(np.linalg.norm(curve(u) - wave(u), axis=1))
    assert worst <= tolerance
    assert worst <= 1.02 * error <= 1.02 * tolerance
    np.testing.assert_allclose(curve(np.array([-1.0, 4.0])), wave(np.array([-1.0, 4.0])), rtol=1e-14)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_error_falls_with_the_order_of_the_degree(degree):
    coarse, fine = (len(fit_function(wave, tolerance, degree, (0.0, 1.0))[0].breaks) for tolerance in (1e-6, 1e-10))
    assert math.log(1e4) / math.log(fine / coarse) == pytest.approx(degree + 1, rel=0.35)


def test_breaks_of_a_function_are_kept():
    def bent(u):
        return np.column_stack([u, np.abs(u - 0.3), np.abs(u - 0.6) ** 3])

    curve, error = fit_function(bent, 1e-9, 3, (0.0, 1.0), breaks=(0.3, 0.6))
    assert error <= 1e-9
    assert len(curve.breaks) == 4
    assert curve(0.3)[1] == pytest.approx(0.0, abs=1e-15)
    smooth, _ = fit_function(lambda u: np.column_stack([u, np.abs(u - 0.6) ** 3]), 1e-9, 3, (0.0, 1.0), (0.6,),
                             smoothness=2)  # fmt: skip
    assert np.count_nonzero(smooth.knots == 0.6) == 1


REFUSED_FUNCTIONS = {
    "domain": (wave, 1e-3, 3, (1.0, 1.0), (), "domain is (1, 1); it must be finite and increase"),
    "breaks": (wave, 1e-3, 3, (0.0, 1.0), (1.0,), "breaks must lie inside the domain (0, 1)"),
    "degree": (wave, 1e-3, 0, (0.0, 1.0), (), "degree is 0; expected a whole number from 1 to 12"),
    "tolerance": (wave, -1.0, 3, (0.0, 1.0), (), "tolerance is -1 mm; it must be finite and greater than 0"),
    "shape": (np.sin, 1e-3, 3, (0.0, 1.0), (), "the function gave shape (257,) for 257 parameters; "
              "(257, axes) expected"),
    "infinite": (lambda u: np.column_stack([u, np.where(u < 0.5, u, np.inf)]), 1e-3, 3, (0.0, 1.0), (),
                 "the function is not finite at u = 0.5"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED_FUNCTIONS)
def test_refused_functions(case):
    function, tolerance, degree, domain, breaks, message = REFUSED_FUNCTIONS[case]
    with pytest.raises(InputError) as refusal:
        fit_function(function, tolerance, degree, domain, breaks)
    assert str(refusal.value) == message


def test_function_that_jumps_is_refused_in_bounded_time():
    with pytest.raises(CurveError, match=r"^0\.\d+ mm of error is left with \d+ spans of degree 3; allow more than"):
        fit_function(lambda u: np.column_stack([u, np.where(u < 1.0 / 3.0, 0.0, 1.0)]), 1e-6, 3, (0.0, 1.0))


# --- what is handed in ------------------------------------------------------------------------------------------------


def test_repeated_points_do_no_harm():
    points = lissajous(100)
    once, twice = fit(points, 1e-3), fit(np.repeat(points, 3, axis=0), 1e-3)
    assert once.curves == twice.curves


@pytest.mark.parametrize("degree", [1, 3, 5])
def test_two_points_make_a_line_and_three_a_curve(degree):
    (line,) = fit([[0.0, 0.0], [4.0, 2.0]], 1e-3, degree).curves
    assert line.degree == degree
    np.testing.assert_allclose(line(0.25), [1.0, 0.5], rtol=1e-14)
    assert fit([[0.0, 0.0], [4.0, 0.2], [8.0, 0.0]], 1e-6, degree).error <= 1e-6


def test_path_of_a_fit_tells_its_error():
    result = fit(lissajous(100), 1e-2)
    path = result.path(("x", "y", "z"), "scan")
    assert path.name == "scan"
    assert path.findings == (
        f"fitted by 1 curve(s) of degree 3 with {result.knots} knots; largest distance {result.error:.3g} mm "
        f"(tolerance 0.01 mm)",
    )


GOOD = [[0.0, 0.0], [1.0, 0.2], [2.0, 0.0], [3.0, 1.0]]
REFUSED = {
    "no points": (([], 1e-3), {}, "points: expected 2 dimension(s), got shape (0,)"),
    "empty": ((np.empty((0, 2)), 1e-3), {}, "0 distinct point(s) among 0; expected at least 2"),
    "one point": (([[1.0, 2.0]], 1e-3), {}, "1 distinct point(s) among 1; expected at least 2"),
    "one point again": (([[1.0, 2.0]] * 5, 1e-3), {}, "1 distinct point(s) among 5; expected at least 2"),
    "two of a circle": (([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], 1e-3), {"closed": True},
                        "2 distinct point(s) among 3; expected at least 3"),
    "not a number": (([[0.0, 0.0], [1.0, math.nan]], 1e-3), {}, "points[1, 1] is nan; every value must be finite"),
    "infinite": (([[0.0, 0.0], [math.inf, 1.0]], 1e-3), {}, "points[1, 0] is inf; every value must be finite"),
    "too many axes": ((np.eye(17), 1e-3), {}, "points have 17 axes; 1 to 16 are possible"),
    "no axes": ((np.empty((5, 0)), 1e-3), {}, "points have 0 axes; 1 to 16 are possible"),
    "zero tolerance": ((GOOD, 0.0), {}, "tolerance is 0 mm; it must be finite and greater than 0"),
    "text": ((GOOD, "fine"), {}, "tolerance is 'fine'; expected a length in mm"),
    "large tolerance": ((GOOD, 10.0), {}, "tolerance is 10 mm, but the whole part measures 3.16228 mm; "
                        "is the unit right?"),
    "tiny tolerance": ((GOOD, 1e-14), {}, "tolerance is 1e-14 mm; below 3.16e-12 mm lies the rounding of these "
                       "coordinates"),
    "degree": ((GOOD, 1e-3, 13), {}, "degree is 13; expected a whole number from 1 to 12"),
    "half a degree": ((GOOD, 1e-3, 2.5), {}, "degree is 2.5; expected a whole number from 1 to 12"),
    "corner angle": ((GOOD, 1e-3), {"corner_angle": 4.0}, "corner_angle is 4 rad; it must lie above 0 and at most at "
                     "pi"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_points(case):
    arguments, options, message = REFUSED[case]
    with pytest.raises(InputError) as refusal:
        fit(*arguments, **options)
    assert str(refusal.value) == message


def test_too_many_points_are_refused_at_once(monkeypatch):
    monkeypatch.setattr(fitting_points, "MAX_POINTS", 99)
    with pytest.raises(InputError, match=r"^100 points; at most 99 can be fitted at once$"):
        fit(lissajous(100), 1e-3)


def test_points_that_jump_about_are_passed_or_refused_in_bounded_time():
    scribble = np.random.default_rng(7).uniform(0.0, 10.0, (300, 2))
    assert fit(scribble, 1e-3).error <= 1e-3

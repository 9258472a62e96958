"""Smoothing: within the tolerance by a proof of its own, of continuous curvature, and nothing lost on the way."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest

import splinefeed as sf
from smoothing_judge import deviation
from smoothing_paths import NOISE_TOLERANCE, RADIUS, arc, noises, random_path
from splinefeed.curves.differential import curvatures
from splinefeed.curves.nearest import Nearest
from splinefeed.errors import InputError
from splinefeed.paths.smoothing import smoothed
from splinefeed.paths.smoothing_joints import BEND, RATE, TANGENT, at_knot, transitions
from splinefeed.paths.smoothing_proven import proven

PROGRAMS = ("cncjs_tball.gcode",)
#: Share of the tolerance to which deviations are told.
PRECISION = 0.02
#: A jump of curvature, 1/mm, that is the rounding of coordinates: transitions of a micrometre do not tell it better.
ROUNDING = 1e-6


def check_one(seed):
    path, tolerance = random_path(seed)
    if tolerance > path.size:
        return
    for corners in ("keep", "round"):
        proof = proven(path, tolerance, corners=corners)
        assert proof.holds, f"seed {seed}, {corners}: {proof.sentence}"
        assert proof.order.unclear == 0, f"seed {seed}, {corners}: {proof.sentence}"
        assert deviation(path, proof.path, PRECISION * tolerance).largest <= (1.0 + PRECISION) * tolerance
        result = proof.path
        np.testing.assert_array_equal(result.ends[[0, -1], [0, 1]], path.ends[[0, -1], [0, 1]])
        jumps = result.corners.curvature_jump[~result.corners.stop]
        assert np.all(jumps < ROUNDING), f"seed {seed}: the curvature jumps in the result"


# the last ones turn by nearly 180 degrees; as plain Python each takes some 10 s
@pytest.mark.parametrize("seed", [*range(6 if numba.config.DISABLE_JIT else 54), 333, 465, 1050])
def test_random_paths_stay_within_the_tolerance(seed):
    check_one(seed)


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("tolerance", [0.005, 0.05])
def test_real_programs_stay_within_the_tolerance(program, tolerance, request):
    path = sf.read(request.config.rootpath / "tests" / "data" / "gcode" / program)
    result = smoothed(path, tolerance)
    assert deviation(path, result, PRECISION * tolerance).largest <= tolerance
    assert len(result.stops) < 0.05 * len(path.stops)


def test_the_proof_is_above_a_dense_sampling_and_near_it():
    path, tolerance = random_path(2)
    result = smoothed(path, tolerance)
    found = deviation(path, result, PRECISION * tolerance)
    there = Nearest(path.table, path.shape).find(result(np.linspace(0.0, result.length, 100_001)))[2].max()
    back = Nearest(result.table, result.shape).find(path(np.linspace(0.0, path.length, 100_001)))[2].max()
    assert there <= found.result.max() <= there + PRECISION * tolerance
    assert back <= found.original.max() <= back + PRECISION * tolerance


@pytest.mark.parametrize("degrees", [5.0, 40.0, 90.0, 150.0])
def test_a_transition_of_two_lines_is_as_far_off_as_the_formula_says(degrees):
    turn = math.radians(degrees)
    path = sf.Path.polyline([[-20.0, 0.0], [0.0, 0.0], [20.0 * math.cos(turn), 20.0 * math.sin(turn)]])
    made = transitions(path, np.array([0.01]), np.array([1.0]), np.array([True]))
    d = float(made.reach[0])
    result = smoothed(path, 0.01, corners="round")
    away = float(Nearest(result.table, result.shape).find(np.zeros(2))[2])
    bound = 0.375 * d * math.sin(0.5 * turn)
    assert away == pytest.approx(0.95 * bound, rel=1e-9)
    assert bound == pytest.approx(0.01, rel=1e-9) or d == pytest.approx(500 * 0.01)


def test_noise_of_the_last_digit_makes_no_ripples_of_curvature():
    rng = np.random.default_rng(5)
    radius = 25.0
    phi = np.sort(rng.uniform(0.0, 2.0, 700))
    points = np.round(radius * np.c_[np.cos(phi), np.sin(phi)], 3)
    points = np.insert(points, [50, 300], points[[50, 300]], axis=0)  # duplicates
    points = np.insert(points, [200], points[[199]] - [0.0004, -0.0003], axis=0)  # a tiny step back
    path = sf.Path.polyline(points, repair=True)
    result = smoothed(path, 0.01)
    s = np.linspace(0.0, result.length, 20_001)
    curve, u = result.locate(s)
    derivatives = result.evaluate(curve, u, 2)
    first, second = derivatives[:, 1], derivatives[:, 2]
    curvature = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.linalg.norm(first, axis=1) ** 3
    assert len(result.curves) <= 5
    assert not len(result.corners)
    assert curvature.max() < 1.5 / radius
    assert curvature.min() > 0.5 / radius
    # the lines themselves turn at single points as if the radius were well below a millimetre
    steps = np.diff(path.ends[:, 0], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    cross = np.abs(steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]) / (lengths[:-1] * lengths[1:])
    assert np.max(cross / np.maximum(lengths[:-1], lengths[1:])) > 20.0 / radius


#: Curvature of what is smoothed, times the radius that is behind it, differs from 1 by at most this.
CALM = 0.05


@pytest.mark.parametrize("noise", noises(0))
@pytest.mark.parametrize("seed", range(3))
def test_curvature_does_not_ripple_whatever_noise_the_lines_have(noise, seed):
    path = sf.Path.polyline(noises(seed)[noise], repair=True)
    result = smoothed(path, NOISE_TOLERANCE)
    curve, u = result.locate(np.linspace(0.0, result.length, 10_001))
    bend = curvatures(result.evaluate(curve, u, 2)) * (5000.0 if noise == "near-collinear" else RADIUS)
    assert not len(result.corners)
    assert np.abs(bend - 1.0).max() <= CALM


def test_coarse_lines_beside_fine_ones_become_curves_too():
    # hundreds of them were left as lines, each longer than 12 times the median of a run that was mostly fine ones
    angles = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 1.01, 500)[1:], np.linspace(1.01, 6, 1000)[1:]])
    points = np.round(50.0 * np.column_stack([np.cos(angles), np.sin(angles)]), 6)
    smooth = smoothed(sf.Path.polyline(points), 0.01)
    assert len(smooth.curves) < 12
    assert smooth.minimum_radius() > 45.0
    assert proven(sf.Path.polyline(points), 0.01).holds


def test_long_lines_and_arcs_keep_what_is_left_of_them():
    line = sf.NurbsCurve(1, [0, 0, 1, 1], [[-100.0, 0.0], [0.0, 0.0]])
    bend = arc([0.0, 0.0], np.array([0.0, 30.0]), math.pi)
    back = sf.NurbsCurve(1, [0, 0, 1, 1], [[0.0, 60.0], [-100.0, 60.0]])
    path = sf.Path([line, *bend, back], tolerance=1e-9)
    result = smoothed(path, 0.01)
    assert len(path.corners) == 2 and not len(result.corners)
    assert [curve.degree for curve in result.curves] == [1, 5, 2, 2, 5, 1]
    for curve in (result.curves[0], result.curves[-1]):
        np.testing.assert_array_equal(curve.control_points[:, 1], [curve.ends[0, 1]] * 2)
    for curve in result.curves[2:4]:
        radii = np.linalg.norm(curve(np.linspace(*curve.domain, 101)) - [0.0, 30.0], axis=1)
        np.testing.assert_allclose(radii, 30.0, rtol=1e-13)


def test_a_curve_is_cut_at_its_knot_and_not_a_rounding_beside_it():
    points = [[0, 0], [1, 0.1], [2, 0.4], [3, 0.4], [4, 0.4], [5, 0.1], [6, 0]]
    curve = sf.NurbsCurve(5, [0] * 6 + [0.5] + [1] * 6, points)
    beside = float(np.nextafter(0.5, 1.0))
    with pytest.raises(sf.SplinefeedError, match="differ by"):
        curve.split(beside)
    assert [part.domain for part in curve.split(at_knot(curve, beside))] == [(0.0, 0.5), (0.5, 1.0)]
    assert at_knot(curve, 0.25) == 0.25


def test_a_reversal_stays_a_stop_and_no_loop():
    path = sf.Path.polyline([[0, 0], [10, 0], [0, 0], [0, 10]])
    result = smoothed(path, 0.05, corners="round")
    assert result.stops == (10.0,)
    assert result.bounding_box()[1][0] == 10.0
    # that small, it is noise
    noisy = smoothed(sf.Path.polyline([[0, 0], [5, 0], [4.999, 0], [10, 0]]), 0.05)
    assert noisy.stops == ()
    assert noisy.length == pytest.approx(10.0)


def test_corners_are_kept_or_rounded():
    path = sf.Path.polyline([[0, 0], [10, 0], [10, 10], [12, 20]])
    kept, rounded = smoothed(path, 0.02), smoothed(path, 0.02, corners="round")
    assert kept.stops == (10.0,)
    assert rounded.stops == ()
    assert smoothed(path, 0.02, corner_angle=math.radians(95)).stops == ()


def test_feeds_tolerances_and_markers_stay_at_their_places():
    points = [[0, 0], [10, 0], [20, 1], [30, 1], [40, 2], [50, 2], [60, 3]]
    feeds = [10.0, 10.0, 20.0, 20.0, 20.0, math.inf]
    markers = [sf.paths.Marker(1, "S100", stop=False), sf.paths.Marker(3, "M3", stop=True), sf.paths.Marker(6, "M2")]
    path = sf.Path.polyline(points, feeds=feeds, tolerances=[0.01] * 6, markers=markers)
    result = smoothed(path, 0.01)
    assert [m.text for m in result.markers] == ["S100", "M3", "M2"]
    assert result.markers[-1].before == len(result.curves)
    where = [result.curve_starts[m.before] for m in result.markers[:2]]
    np.testing.assert_allclose(where, [path.curve_starts[1], path.curve_starts[3]], atol=0.02)
    np.testing.assert_array_equal(result(where[1]), [30.0, 1.0])
    assert where[1] in result.stops
    change = result.curve_starts[int(np.argmax(result.feeds > 10.0))]
    np.testing.assert_allclose(result(change), [20.0, 1.0], atol=0.01)
    assert np.isinf(result.feeds[-1]) and np.isfinite(result.feeds[:-1]).all()
    np.testing.assert_array_equal(result.curves[-1].control_points, points[-2:])
    np.testing.assert_array_equal(result.tolerances, 0.01)


def test_the_program_s_own_tolerance():
    points = [[0, 0], [10, 0], [20, 4], [30, 4], [40, 8]]
    path = sf.Path.polyline(points, tolerances=[0.02, 0.02, 0.0, math.inf])
    result = smoothed(path, "program")
    assert len(result.corners) == 2  # both ends of the exact line
    np.testing.assert_array_equal(result.curves[-2].control_points, points[2:4])
    plain = sf.Path.polyline(points)
    assert smoothed(plain, "program") is plain


def test_rotary_axes_turn_in_step():
    x = np.linspace(0.0, 20.0, 6)
    points = np.c_[x, 0 * x, np.radians([0, 10, 30, 35, 60, 60])]
    path = sf.Path.polyline(points, axes=("x", "y", "a"))
    allowed = math.radians(0.1)
    result = smoothed(path, 0.05, angular_tolerance=allowed)
    assert not len(result.corners)
    found = result(np.linspace(0.0, result.length, 8001))
    given = path(np.linspace(0.0, path.length, 20001))
    shares = np.abs(found[::20, None] - given)[:, :, [0, 2]] / [0.05, allowed]
    off = np.max(np.min(np.max(shares, axis=2), axis=1))  # some place is as near in both
    assert 0.3 < off <= 1.0
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-12)


def test_moves_of_rotary_axes_alone_stay_exact():
    points = [[0, 0, 0], [10, 0, 0], [10, 0, 1], [20, 3, 1], [30, 3, 1]]
    result = smoothed(sf.Path.polyline(points, axes=("x", "y", "a")), 0.01)
    np.testing.assert_array_equal(result.curves[1].control_points, points[1:3])


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, math.inf, 1000.0, "any"])
def test_tolerances_that_cannot_be(tolerance):
    with pytest.raises(InputError, match="tolerance is"):
        smoothed(sf.Path.polyline([[0, 0], [1, 0], [1, 1]]), tolerance)


@pytest.mark.parametrize("wrong", [{"corners": "cut"}, {"corner_angle": 0.0}, {"angular_tolerance": -1.0}])
def test_other_arguments_that_cannot_be(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        smoothed(sf.Path.polyline([[0, 0], [1, 0], [1, 1]]), 0.01, **wrong)


def test_a_turn_over_a_tiny_way_is_no_noise():
    # the way is within a tenth of the tolerance, but a rotary axis turns by 11 degrees on it
    points = [[0, 0, 0], [5, 0, 0], [5.0004, 0, 0.2], [10, 0, 0.2]]
    path = sf.Path.polyline(points, axes=("x", "y", "a"))
    proof = proven(path, 0.01)
    assert proof.holds
    assert proof.order.largest_angle <= 1.02 * math.radians(0.05)
    still = sf.Path.polyline([[0, 0, 0], [5, 0, 0], [5.0004, 0, 0], [10, 0, 0.2]], axes=("x", "y", "a"))
    assert len(smoothed(still, 0.01).curves) < len(proof.path.curves)


def test_points_that_are_no_path_are_refused_in_one_line():
    for points in ([[1.0, 1.0]] * 5, [[0.0, 0.0], [math.nan, 1.0], [2.0, 2.0]], [[0.0, 0.0], [math.inf, 0.0]]):
        with pytest.raises(sf.SplinefeedError) as refusal:
            smoothed(sf.Path.polyline(points, repair=True), 0.01)
        assert "\n" not in str(refusal.value)
        with pytest.raises(sf.SplinefeedError):
            list(sf.paths.smooth_stream((sf.Path.polyline(each) for each in [points]), 0.01))


def test_two_points_spikes_and_very_many_points_on_a_spot():
    two = sf.Path.polyline([[0, 0], [1, 0]])
    assert smoothed(two, 0.01).curves[0] == two.curves[0]
    spike = sf.Path.polyline([[0, 0], [5, 0], [5, 8], [5, 0.001], [10, 0]])
    assert deviation(spike, smoothed(spike, 0.01, corners="round"), 1e-4).largest <= 0.01
    rng = np.random.default_rng(0)
    spot = np.vstack([[[-5.0, 0.0]], 1e-5 * rng.standard_normal((1_000_000, 2)), [[5.0, 0.0]]])
    result = smoothed(sf.Path.polyline(spot), 0.01)
    assert len(result.curves) <= 4
    assert result.stops == ()


def quintic_errors(at, power: int):
    """Errors over [-1, 1], (s, t), of quintics that meet max(s - t, 0)^power / power twice at both ends, t in `at`."""
    s, up, nothing = np.linspace(-1.0, 1.0, 2001), 1.0 - at, np.zeros(len(at))
    ends, k = np.array([[-1.0], [1.0]]), np.arange(6)
    rows = [ends**k, k * ends ** np.maximum(k - 1, 0), k * (k - 1) * ends ** np.maximum(k - 2, 0)]
    bends = (power - 1.0) * np.ones(len(at))
    wanted = [nothing, up**power / power, nothing, up ** (power - 1), nothing, bends]
    quintics = np.vander(s, 6, increasing=True) @ np.linalg.solve(np.vstack(rows), wanted)
    return np.abs(quintics - np.maximum(s[:, None] - at, 0.0) ** power / power)


def test_the_constants_of_a_transition_are_the_largest_errors_rounded_up():
    """docs/math/smoothing.md: of a jump of slope, of one of curvature, and of a third derivative of 1 all over."""
    middle, width = np.zeros(1), 2.0 / 2000
    throughout = np.linspace(-1.0 + width / 2, 1.0 - width / 2, 2000)
    found = [
        quintic_errors(middle, 1).max(),
        quintic_errors(middle, 2).max(),
        quintic_errors(throughout, 2).sum(axis=1).max() * width,
    ]
    for constant, each in zip((TANGENT, BEND, RATE), found, strict=True):
        assert each * (1.0 - 1e-12) <= constant <= 1.001 * each

"""The proof of order: paths side by side, rotary axes in step, and crossings that were not there."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf
from smoothing_judge import deviation
from smoothing_paths import random_path
from splinefeed.paths.smoothing import smoothed
from splinefeed.paths.smoothing_proven import PRECISION, order, proven

LINE = sf.Path.polyline([[0, 0], [10, 0]])


def circle(radius, count, laps=1.0, offset=0.0):
    phi = np.linspace(0.0, 2.0 * math.pi * laps, count)
    return np.c_[(radius + offset) * np.cos(phi), (radius + offset) * np.sin(phi)]


def frechet(p, q):
    """Discrete Frechet distance of points, by its definition (Eiter, Mannila, 1994)."""
    d = np.linalg.norm(p[:, None] - q[None], axis=2)
    for i in range(len(p)):
        for j in range(len(q)):
            before = [d[a, b] for a, b in ((i - 1, j), (i, j - 1), (i - 1, j - 1)) if a >= 0 and b >= 0]
            d[i, j] = max(d[i, j], min(before)) if before else d[i, j]
    return d[-1, -1]


@pytest.mark.parametrize("seed", range(8))
def test_the_distance_side_by_side_is_that_of_dense_samples(seed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 8.0, 30)
    shape = np.c_[t, 2.0 * np.sin(t), 0.3 * t * np.cos(t)]
    lines = [sf.Path.polyline(shape + 0.15 * rng.standard_normal(shape.shape)) for _ in range(2)]
    found = order(*lines, 0.5, 1.0, precision=1e-3).largest
    p, q = (line(np.linspace(0.0, line.length, 250)) for line in lines)
    dense = frechet(p, q)
    spacing = max(line.length for line in lines) / 249
    assert found >= dense - spacing
    assert found <= 1.1 * dense + 1e-3


@pytest.mark.parametrize("offset", [0.0, 2e-3, 9e-3])
def test_circles_side_by_side_are_as_far_apart_as_their_radii(offset):
    one, other = sf.Path.polyline(circle(5, 400, 3)), sf.Path.polyline(circle(5, 700, 3, offset))
    sag = 5.0 * (math.pi * 6 / 399) ** 2 / 8
    found = order(one, other, 0.01, 1.0, precision=0.001)
    assert offset - 1e-12 <= found.largest <= offset + sag + 1e-5
    assert not len(found.crossings)


def test_a_lap_too_few_a_way_back_and_another_direction_are_far_off():
    lap, laps = sf.Path.polyline(circle(5, 200)), sf.Path.polyline(circle(5, 400, 2))
    assert order(laps, lap, 0.01, 1.0).largest == math.inf  # each lies on the other
    assert order(LINE, sf.Path.polyline([[0, 0], [6, 0], [4, 0], [10, 0]]), 0.01, 1.0).largest == math.inf
    assert order(lap, lap.reversed(), 0.01, 1.0).largest == math.inf
    assert order(lap, lap, 0.01, 1.0).largest <= 1.1e-4


def test_rotary_axes_are_compared_at_the_same_place():
    axes = ("x", "y", "a")
    one = sf.Path.polyline([[0, 0, 0], [10, 0, 1]], axes)
    late = sf.Path.polyline([[0, 0, 0], [5, 0, 0.5 - 7e-4], [10, 0, 1]], axes)
    # at most 1 um ahead along the line brings 1e-4 rad back
    found = order(one, late, 1e-3, 1e-3, 1e-3)
    assert 5.5e-4 <= found.largest_angle <= 7.1e-4
    tight = order(one, late, 1e-9, 1e-3, 1e-3)
    assert tight.largest_angle == pytest.approx(7e-4, rel=2e-3)
    far = sf.Path.polyline([[0, 0, 0], [5, 0, 0.6], [10, 0, 1]], axes)
    assert order(one, far, 1e-3, 1e-3).largest_angle == math.inf


def test_a_small_loop_is_found_though_it_is_within_the_tolerance():
    loop = np.vstack([[[0, 0], [4.999, 0]], 0.003 * circle(1, 40) + [5, 0.003], [[10, 0]]])
    found = order(LINE, sf.Path.polyline(loop, repair=True), 0.01, 1.0)
    assert found.largest <= 0.01
    assert len(found.crossings)
    np.testing.assert_allclose(found.crossings[0], 5.0, atol=0.03)
    assert found.concerned.tolist()[0] == [0, 0]
    there = sf.Path.polyline(np.vstack([[[0, 0], [4.999, 0]], 0.0031 * circle(1, 30) + [5, 0.0031], [[10, 0]]]))
    assert not len(order(there, sf.Path.polyline(loop, repair=True), 0.01, 1.0).crossings)


def test_a_way_back_over_itself_is_no_new_crossing_if_it_was_there():
    back = sf.Path.polyline([[0, 0], [10, 0], [3, 0], [3, 8]])
    proof = proven(back, 0.02, corners="round")
    assert proof.holds
    assert len(proof.order.crossings) == 0


@pytest.mark.parametrize("seed", [130, 136, 148, 304, 370])  # found by `make torture`: tangles that nearly touch
def test_where_the_result_would_cross_itself_anew_it_is_smoothed_with_less(seed):
    path, tolerance = random_path(seed)
    crossed = 0
    for corners in ("keep", "round"):
        crossed += len(order(path, smoothed(path, tolerance, corners=corners), tolerance, 1.0).crossings)
        proof = proven(path, tolerance, corners=corners)
        assert proof.holds
        assert not proof.closer or "smoothed with less" in proof.sentence
    assert crossed


@pytest.mark.parametrize("program", ["cncjs_tball.gcode", "gcodetoolpath_helical-thread-milling.nc"])
@pytest.mark.parametrize("corners", ["keep", "round"])
def test_real_programs_keep_their_order_and_cross_nothing_anew(program, corners, request):
    path = sf.read(request.config.rootpath / "tests" / "data" / "gcode" / program, repair=True)
    proof = proven(path, 0.01, corners=corners)
    assert proof.holds
    assert proof.order.unclear == 0
    assert proof.closer == 0


@pytest.mark.parametrize("seed", range(6))
def test_rotary_axes_are_smoothed_in_step_with_the_linear_ones(seed):
    rng = np.random.default_rng(seed)
    t = np.arange(300) * (0.3 if seed % 2 else 4.0)
    points = np.c_[t, 20 * np.sin(t / 17), 0.3 * np.sin(t / 9), np.cumsum(rng.uniform(-0.02, 0.02, 300))]
    path = sf.Path.polyline(points, ("x", "y", "a", "c"))
    allowed = math.radians(0.1)
    proof = proven(path, 0.02, angular_tolerance=allowed, corners="round")
    assert proof.holds
    assert 0.0 < proof.order.largest_angle <= 1.02 * allowed
    assert f"{math.degrees(proof.order.largest_angle):.4g} deg" in proof.path.findings[-1]


def test_the_distance_side_by_side_bounds_the_two_way_one():
    path, tolerance = random_path(2)
    proof = proven(path, tolerance)
    assert proof.holds
    assert deviation(path, proof.path, PRECISION * tolerance).largest <= (1.0 + PRECISION) * proof.order.largest

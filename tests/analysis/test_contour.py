"""Contour error against brute force, on corners, cusps, crossings, seams and ends, and what it refuses."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import motions
import splinefeed as sf
from splinefeed.analysis.following import ContourMeter
from splinefeed.errors import InputError


def contour_error(position, path, s_hint=None):
    return ContourMeter(path).measure(position, s_hint=s_hint).error


FRACTIONS = np.linspace(0.0, 1.0, 33)


# --- brute force: dense samples, then ever finer grids about every sample that is lower than its neighbours ---


def zoomed(distance, low, high):
    """Least distances between low (m,) and high (m,), each interval on its own: finer and finer grids."""
    each = np.arange(len(low))
    for _ in range(11):
        grid = low[:, None] + (high - low)[:, None] * FRACTIONS
        at = np.argmin(distance(grid.ravel()).reshape(grid.shape), axis=1)
        low, high = grid[each, np.maximum(at - 1, 0)], grid[each, np.minimum(at + 1, len(FRACTIONS) - 1)]
    return distance(0.5 * (low + high))


def least(distance, grid):
    """Least distance over the interval of `grid`, and its place to the fineness of the grid."""
    values = distance(grid)
    lower = np.r_[True, values[1:] <= values[:-1]] & np.r_[values[:-1] <= values[1:], True]
    at = np.flatnonzero(lower & (values <= values.min() + 3.0 * np.abs(np.diff(values)).max()))
    # each side on its own, for at a corner both may have a least distance
    found = zoomed(distance, grid[np.r_[np.maximum(at - 1, 0), at]], grid[np.r_[at, np.minimum(at + 1, len(grid) - 1)]])
    k = int(np.argmin(found))
    return min(float(found[k]), float(values.min())), float(grid[at[k % len(at)]])


def brute_whole(path, q, samples=1500):
    best = np.inf
    for curve in path.curves:
        grid = np.linspace(*curve.domain, samples)
        best = min(best, least(lambda u, c=curve: np.linalg.norm(c(u)[:, : path.linear] - q, axis=1), grid)[0])
    return best


def brute_window(path, q, hint, window=0.0, samples=1500):
    """The rule of `ContourMeter.measure`, said once more with a grid over the window."""
    length = path.length

    def place(s):
        return np.mod(s, length) if path.closed else np.clip(s, 0.0, length)

    def distance(s):
        return np.linalg.norm(path(place(s))[:, : path.linear] - q, axis=1)

    half = max(window, 4.0 * float(distance(np.array([hint]))[0]), 1e-9 * length)
    while True:
        if 2.0 * half >= length and path.closed:
            return brute_whole(path, q)
        low, high = (hint - half, hint + half) if path.closed else (max(hint - half, 0.0), min(hint + half, length))
        joints = np.r_[path.curve_starts - length, path.curve_starts, path.curve_starts + length]
        cuts = np.unique(np.r_[low, joints[(joints > low) & (joints < high)], high])
        # each curve on its own: a corner may lie between two least distances that no common grid tells apart
        found, at = min(least(distance, np.linspace(a, b, samples)) for a, b in pairwise(cuts))
        if not (at == low and (path.closed or low > 0.0)) and not (at == high and (path.closed or high < length)):
            return found
        half *= 2.0


# --- paths ---


def random_path(rng, axes=2):
    """One to four curves: lines, Beziers of degree 2 to 6 (they cross themselves), splines, cusps, rational or not."""
    at = rng.uniform(-10, 10, axes)
    start = at
    curves = []
    count = int(rng.integers(1, 5))
    closed = rng.random() < 0.4
    for i in range(count):
        kind = rng.integers(0, 4)
        degree = 1 if kind == 0 else int(rng.integers(2, 7))
        points = rng.uniform(-10, 10, (degree + 1, axes))
        if kind == 1:  # a cusp: x = t^2, y = t^3 under a random linear map, t from -1 to 1
            matrix = rng.normal(size=(axes, 2)) * 4.0
            points = np.array([[1, -1], [-1 / 3, 1], [-1 / 3, -1], [1, 1]]) @ matrix.T
        points = points - points[0] + at
        if closed and i == count - 1 and (kind != 1 or count == 1):
            points[-1] = start
        if kind == 3:
            extra = rng.uniform(-10, 10, (4, axes))
            points = np.vstack([points[:-1], extra, points[-1:]])
            knots = np.r_[np.zeros(degree), np.linspace(0, 1, 6), np.ones(degree)]
            weights = rng.uniform(0.2, 3.0, len(points)) if rng.random() < 0.5 else None
            curves.append(sf.NurbsCurve(degree, knots, points, weights))
        elif np.ptp(points, axis=0).max() > 1e-3:
            weights = rng.uniform(0.2, 3.0, len(points)) if rng.random() < 0.3 and degree > 1 else None
            curves.append(sf.NurbsCurve.bezier(points, weights))
        else:
            continue
        at = points[-1]
    return sf.Path(curves) if curves else random_path(rng, axes)


def positions(rng, path, count):
    """Some near the path, some far, one on it, and the commanded arc length of each."""
    s = rng.uniform(0, path.length, count)
    s[rng.random(count) < 0.15] = 0.0
    s[rng.random(count) < 0.15] = path.length
    inner = path.curve_starts[1:-1]
    if inner.size:
        s[rng.random(count) < 0.3] = rng.choice(inner)
    away = rng.normal(size=(count, path.linear)) * 10.0 ** rng.uniform(-4, 0.7, (count, 1))
    away[-1] = 0.0
    return path(s)[:, : path.linear] + away, np.clip(s + rng.normal(size=count) * 0.05, 0.0, path.length)


def polygon(*corners):
    corners = np.array(corners, dtype=float)
    return sf.Path([sf.NurbsCurve.bezier([a, b]) for a, b in pairwise(corners)])


def circle(radius=10.0):
    half = np.sqrt(0.5)
    points = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    return sf.Path(
        [sf.NurbsCurve(2, knots, radius * np.array(points, dtype=float), [1, half] * 4 + [1])], name="circle"
    )


# --- against brute force ---


def check_against_brute_force(seed, paths):
    rng = np.random.default_rng(seed)
    for case in range(paths):
        path = random_path(rng, axes=3 if case % 10 == 0 else 2)
        q, hint = positions(rng, path, 2)
        meter = ContourMeter(path)
        whole = meter.measure(q)
        expected = [brute_whole(path, each) for each in q]
        assert whole.error == pytest.approx(expected, rel=1e-11, abs=1e-11), (seed, case)
        near = meter.measure(q, s_hint=hint)
        expected = [brute_window(path, each, s) for each, s in zip(q, hint, strict=True)]
        assert near.error == pytest.approx(expected, rel=1e-11, abs=1e-11), (seed, case)
        for found in (whole, near):
            reached = np.linalg.norm(path(np.clip(found.s, 0.0, path.length))[:, : path.linear] - q, axis=1)
            assert reached == pytest.approx(found.error, rel=1e-9, abs=1e-9), (seed, case)


@pytest.mark.parametrize("seed", range(2))
def test_agrees_with_brute_force(seed):
    """50 random paths and 100 positions each, by both notions: 400 cases in all."""
    check_against_brute_force([1, seed], 50)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_agrees_with_brute_force_many_times(seed):
    check_against_brute_force([2, seed], 250)


# --- corners, crossings, seams, ends: worked out by hand ---


def test_a_crossing_is_not_credited_to_the_other_branch():
    """Commanded at the crossing along x, pushed 1 mm up along the other branch: 1 mm off, though the path is there."""
    path = polygon((-20, 0), (20, 0), (20, 20), (0, 20), (0, -20))
    q, hint = [[0.0, 1.0]], [20.0]
    assert contour_error(q, path) == pytest.approx([0.0], abs=1e-14)
    assert contour_error(q, path, s_hint=hint) == pytest.approx([1.0], rel=1e-14)
    assert contour_error(q, path, s_hint=[path.length - 20.0]) == pytest.approx([0.0], abs=1e-14)


@pytest.mark.nojit
@pytest.mark.parametrize("hint", [None, 10.0])
def test_a_corner_inside_and_outside(hint):
    """A left turn of 90 degrees at (10, 0): inside the nearer leg counts, outside the corner itself."""
    path = polygon((0, 0), (10, 0), (10, 10))
    q = [[9.7, 0.1], [9.9, 0.3], [10.3, -0.4], [10.2, 0.5], [9.5, -0.2]]
    expected = [0.1, 0.1, 0.5, 0.2, 0.2]
    s_hint = None if hint is None else np.full(5, hint)
    assert contour_error(q, path, s_hint=s_hint) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("turn", [-170, -135, -90, -20, 20, 90, 135, 170])
def test_outside_a_corner_the_corner_itself_is_nearest(turn):
    """Positions in its outer wedge are as far off as the corner is, however sharp it is."""
    angle = np.radians(turn)
    path = polygon((-10, 0), (0, 0), (10 * np.cos(angle), 10 * np.sin(angle)))
    outer = np.array([np.sin(angle), -1 - np.cos(angle)]) * np.sign(angle)
    middle = np.arctan2(outer[1], outer[0])
    for share in (-0.49, -0.3, 0.0, 0.3, 0.49):
        direction = middle + share * abs(angle)
        q = 0.5 * np.array([[np.cos(direction), np.sin(direction)]])
        for hint in (None, [10.0]):
            assert contour_error(q, path, s_hint=hint) == pytest.approx([0.5], rel=1e-12)


def test_a_lag_around_a_sharp_corner_stays_on_its_leg():
    """Commanded 1 mm behind a turn of 140 degrees, still 1 mm before it and exactly on the path: no contour error."""
    angle = np.radians(140)
    path = polygon((-20, 0), (0, 0), (20 * np.cos(angle), 20 * np.sin(angle)))
    assert contour_error([[-1.0, 0.0]], path, s_hint=[21.0]) == pytest.approx([0.0], abs=1e-14)
    # at 170 degrees the other leg is a tenth as far as the lag is long, and counts
    angle = np.radians(170)
    path = polygon((-20, 0), (0, 0), (20 * np.cos(angle), 20 * np.sin(angle)))
    assert contour_error([[-1.0, 0.0]], path, s_hint=[21.0]) == pytest.approx([np.sin(np.radians(10))], rel=1e-12)


@pytest.mark.nojit
def test_inside_and_outside_a_circle_and_over_its_seam():
    """The window runs over the seam at (10, 0)."""
    path = circle()
    assert path.closed
    angle = np.radians([-3.0, -1e-9, 0.0, 1e-9, 3.0])
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    for hint in (None, np.zeros(5), np.full(5, path.length), np.full(5, 1.0), np.full(5, path.length - 1.0)):
        assert contour_error(9.8 * ring, path, s_hint=hint) == pytest.approx(np.full(5, 0.2), rel=1e-12)
        assert contour_error(10.3 * ring, path, s_hint=hint) == pytest.approx(np.full(5, 0.3), rel=1e-12)


@pytest.mark.parametrize("hint", [None, [0.0], [30.0]])
def test_the_middle_of_a_circle_is_as_far_from_everywhere(hint):
    found = ContourMeter(circle()).measure([[0.0, 0.0]], s_hint=hint)
    assert found.error == pytest.approx([10.0], rel=1e-14)


def test_beyond_the_ends():
    path = polygon((0, 0), (10, 0))
    q = [[-3.0, 4.0], [13.0, -4.0]]
    assert contour_error(q, path) == pytest.approx([5.0, 5.0])
    found = ContourMeter(path).measure(q, s_hint=[0.0, 10.0])
    assert found.error == pytest.approx([5.0, 5.0])
    assert found.s == pytest.approx([0.0, 10.0])


def test_a_cusp():
    """x = t^2, y = t^3: positions with x < 0 have the cusp for nearest point."""
    path = sf.Path([sf.NurbsCurve.bezier([[1, -1], [-1 / 3, 1], [-1 / 3, -1], [1, 1]])])
    q = [[-0.3, 0.4], [-0.5, 0.0], [0.0, 0.0]]
    for hint in (None, np.full(3, 0.5 * path.length)):
        assert contour_error(q, path, s_hint=hint) == pytest.approx([0.5, 0.5, 0.0], abs=1e-12)


def test_rotary_axes_do_not_count():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0, 0], [10, 0, 3]])], axes=("x", "y", "theta"))
    expected = [2.0, 1.0]
    assert contour_error([[5, 2, 99], [6, -1, -99]], path) == pytest.approx(expected)
    assert contour_error([[5, 2], [6, -1]], path, s_hint=[5, 6]) == pytest.approx(expected)


def test_far_away_in_coordinates():
    """The same figure a kilometre away from zero: only the rounding of the coordinates is lost."""
    near = motions.butterfly()
    far = near.transformed(np.eye(2), [1e6, -1e6])
    s = np.linspace(0, near.length, 50)
    away = np.random.default_rng(4).normal(size=(50, 2)) * 0.1
    here = contour_error(near(s) + away, near, s_hint=s)
    assert contour_error(near(s) + away + [1e6, -1e6], far, s_hint=s) == pytest.approx(here, abs=1e-9)


def test_order_changes_nothing():
    path = motions.butterfly()
    rng = np.random.default_rng(8)
    s = np.sort(rng.uniform(0, path.length, 400))
    q = path(s) + rng.normal(size=(400, 2)) * 0.3
    mixed = rng.permutation(400)
    assert contour_error(q[mixed], path) == pytest.approx(contour_error(q, path)[mixed], rel=1e-12)
    assert np.array_equal(contour_error(q[mixed], path, s_hint=s[mixed]), contour_error(q, path, s_hint=s)[mixed])


@settings(max_examples=60)
@given(
    s=st.floats(0, 1),
    away=st.floats(-0.2, 0.2),
    angle=st.floats(-3.2, 3.2),
    shift=st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_moves_with_the_path_and_never_exceeds_the_tracking_error(s, away, angle, shift):
    path = motions.smooth()
    place = s * path.length
    q = path([place]) + np.array([[away, 0.5 * away]])
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = contour_error(q, path, s_hint=[place])
    assert abs(found[0]) <= np.hypot(away, 0.5 * away) * (1 + 1e-12) + 1e-13
    moved = contour_error(q @ rotation.T + shift, path.transformed(rotation, shift), s_hint=[place])
    assert moved == pytest.approx(found, abs=1e-11)
    back = path.reversed()
    turned = contour_error(q, back, s_hint=[back.length - place])
    assert turned == pytest.approx(found, abs=1e-11)


# --- records ---


def test_of_positions_with_a_tail_behind_the_setpoints():
    path = polygon((0, 0), (10, 0))
    points = sf.interpolate(path, motions.constant(path, 100.0), period=1e-2)
    n = len(points) + 3
    position = np.vstack([points.position + [0, 0.25], np.tile([10.0, 0.0], (3, 1))])
    found = ContourMeter(path).measure(position, s_hint=np.append(points.s, [points.s[-1]] * 3))
    assert found.error == pytest.approx([0.25] * len(points) + [0.0] * 3, abs=1e-13)
    assert found.max == pytest.approx(0.25)
    assert found.rms == pytest.approx(0.25 * np.sqrt(len(points) / n))


def test_no_samples():
    found = ContourMeter(circle()).measure(np.empty((0, 2)), s_hint=[])
    assert found.error.shape == found.s.shape == (0,)
    assert (found.max, found.rms) == (0.0, 0.0)


# --- refused ---


@pytest.mark.parametrize(
    ("position", "hint"),
    [(np.zeros(2), None), (np.zeros((1, 3)), None), ([[0, np.nan]], None), ([[0, 1e200]], None),
     (np.zeros((1, 2)), [1, 2]), (np.zeros((1, 2)), [np.inf])],
)  # fmt: skip
def test_refused(position, hint):
    with pytest.raises(InputError, match=r"position|s_hint"):
        contour_error(position, polygon((0, 0), (10, 0)), s_hint=hint)


# --- memory ---


def test_many_places_that_are_as_near_are_looked_at_in_blocks():
    """10 times around a polygon of 200 sides, and 500 positions about its middle: every side may be the nearest."""
    angle = 2.0 * np.pi * np.arange(2001) / 200
    path = sf.Path.polyline(10.0 * np.column_stack([np.cos(angle), np.sin(angle)]))
    q = np.random.default_rng(3).normal(0.0, 1e-6, (500, 2))
    meter = ContourMeter(path)
    meter.measure(q[:1])
    tracemalloc.start()
    found = meter.measure(q), meter.measure(q, s_hint=np.full(500, 0.5 * path.length))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    for each in found:
        assert np.all(np.abs(each.error - 10.0 * np.cos(np.pi / 200)) < 1e-5)
    assert peak < 100e6  # in one block: half a gigabyte

"""The nearest point is the global one: against dense sampling with refinement, formulas, and points made to be hard."""

from __future__ import annotations

import itertools
import tracemalloc

import numpy as np
import pytest

from sample_curves import KNOWN, STILL, butterfly, ellipse, random_curve, with_cusp, with_loop
from splinefeed.curves import search
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.nearest import Nearest
from splinefeed.errors import InputError
from splinefeed.paths.path import Path

#: Of a distance, relative to the distance and the curve's size.
PROMISE = 1e-13
EPSILON = np.finfo(float).eps
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
CURVES = {"butterfly": butterfly(), **KNOWN, **STILL}


def brute_force(curve: NurbsCurve, queries: np.ndarray, samples: int = 1500, tried: int = 6) -> np.ndarray:
    """Distances (n,) by samples even in u and in s, and golden section about the best valleys of each query."""
    start, end = curve.domain
    even = curve.parameter_at(np.linspace(0.0, curve.length, samples))
    u = np.unique(np.concatenate([np.linspace(start, end, samples), curve.breaks, even]).clip(start, end))
    distances = np.linalg.norm(curve(u)[:, None] - queries, axis=2)
    edge = np.full((1, len(queries)), np.inf)
    valley = (distances <= np.vstack([edge, distances[:-1]])) & (distances <= np.vstack([distances[1:], edge]))
    order = np.argsort(np.where(valley, distances, np.inf), axis=0)[:tried]
    best = distances.min(axis=0)
    for k in order:
        low, high = u[np.maximum(k - 1, 0)], u[np.minimum(k + 1, len(u) - 1)]
        for _ in range(60):
            left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            at_left, at_right = (np.linalg.norm(curve(v) - queries, axis=1) for v in (left, right))
            low, high = np.where(at_left < at_right, low, left), np.where(at_left < at_right, right, high)
            best = np.minimum(best, np.minimum(at_left, at_right))
    return best


def hard_points(curve: NurbsCurve, seed: int, count: int = 32) -> np.ndarray:
    """Points on and near the curve, about it and far from it; between two of its points; centres of curvature; ends."""
    random = np.random.default_rng(seed)
    derivatives = curve.derivatives(random.uniform(*curve.domain, count), 2)
    on, first, second = np.moveaxis(derivatives, 1, 0)
    low, high = curve.bounding_box()
    quarter = count // 4
    square = np.maximum(np.sum(first * first, axis=1, keepdims=True), 1e-20 * curve.size**2)
    bend = (second - np.sum(first * second, axis=1, keepdims=True) / square * first) / square
    strength = np.sum(bend * bend, axis=1, keepdims=True)
    off = 1.0 + random.choice([0.0, 1e-9, -1e-9, 1e-5, -1e-5, 1e-2, -1e-2], count)[:, None]
    curved = strength[:, 0] * curve.size**2 > 1e-8
    centres = (on + bend / np.where(strength > 0.0, strength, 1.0) * off)[curved]
    return np.concatenate(
        [
            on[:quarter],
            on[:quarter] + 1e-4 * curve.size * random.normal(size=(quarter, curve.axes)),
            random.uniform(low, high, (quarter, curve.axes)),
            on[:quarter] + 100.0 * curve.size * random.normal(size=(quarter, curve.axes)),
            0.5 * (on[:quarter] + on[-quarter:]),
            centres,
            curve(np.array(curve.domain)),
        ]
    )


def worst_error(curve: NurbsCurve, queries: np.ndarray) -> float:
    """How much further than by brute force at most, relative to distance + size; u must be where it says."""
    u, distance = curve.nearest(queries)
    at, first = np.moveaxis(curve.derivatives(u, 1), 1, 0)
    wanted = brute_force(curve, queries)
    rounding = 4.0 * EPSILON * np.abs(u) * np.linalg.norm(first, axis=1)
    assert np.all(
        np.abs(np.linalg.norm(at - queries, axis=1) - distance) <= PROMISE * (curve.size + distance) + rounding
    )
    return float(np.max((distance - wanted) / (wanted + curve.size + rounding / PROMISE)))


@pytest.mark.parametrize("name", CURVES)
def test_known_curves_match_brute_force(name):
    assert worst_error(CURVES[name], hard_points(CURVES[name], 1)) <= PROMISE


@pytest.mark.parametrize("seed", range(36))
def test_random_curves_match_brute_force(seed):
    curve = random_curve(seed)
    assert worst_error(curve, hard_points(curve, seed)) <= PROMISE


@pytest.mark.slow
def test_a_hundred_curves_match_brute_force():
    for seed in range(1000, 1100):
        random = np.random.default_rng(seed)
        sharp = with_cusp(random.uniform(), degree=2 + seed % 6, axes=1 + seed % 3, seed=seed)
        for curve in (random_curve(seed), random_curve(seed, axes=2), sharp):
            assert worst_error(curve, hard_points(curve, seed)) <= PROMISE, f"seed {seed}"


@pytest.mark.nojit
@pytest.mark.parametrize("radius", [0.0, 1e-12, 1e-6, 1e-2, 0.9, 4.0, 5.0, 5.0 + 1e-9, 6.0, 1e3, 1e9])
def test_circle_even_at_its_centre(radius):
    circle = ellipse(5.0, 5.0)
    angle = np.linspace(0.1, 6.1, 5)
    u, distance = circle.nearest(radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    assert np.abs(distance - abs(radius - 5.0)).max() <= 1e-14 * (5.0 + radius)
    if radius >= 1e-2:
        # an angle off by x is further by 5 r x^2 in the square of the distance: below its rounding x cannot be told
        found = np.arctan2(*circle(u).T[::-1]) % (2.0 * np.pi)
        assert np.abs(found - angle).max() <= 1e-14 + abs(radius - 5.0) * np.sqrt(8.0 * EPSILON / (5.0 * radius))


@pytest.mark.nojit
def test_line_and_its_ends():
    line = KNOWN["line"]  # (1, 2) to (4, 6)
    u, distance = line.nearest([[2.5, 4.0], [1.7, 4.9], [0, 0], [1, 2], [4, 6], [1e6, 1e6]])
    assert np.allclose(u, [0.5, 0.548, 0.0, 0.0, 1.0, 1.0], rtol=0, atol=1e-15)
    far = np.hypot(1e6 - 4, 1e6 - 6)
    assert np.allclose(distance[[0, 2, 3, 4, 5]], [0.0, np.hypot(1, 2), 0.0, 0.0, far], rtol=1e-15, atol=1e-15)


@pytest.mark.nojit
def test_evolute_of_the_ellipse():
    # on the long axis inside (a^2 - b^2) / a of the centre there are two nearest points, outside it the vertex alone
    a, b = 5.0, 3.0
    curve = ellipse(a, b)
    last = (a * a - b * b) / a
    x = np.concatenate([np.linspace(0.0, last, 9), last + np.array([1e-6, 0.1, 1.0])])
    _, distance = curve.nearest(np.column_stack([x, np.zeros(len(x))]))
    wanted = np.where(x <= last, b * np.sqrt(np.maximum(1.0 - x * x / (a * a - b * b), 0.0)), a - x)
    assert np.abs(distance - wanted).max() <= 1e-14


@pytest.mark.nojit
@pytest.mark.parametrize("above", [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1])
def test_two_valleys_close_together(above):
    # y = x^2 from (aside, 1/2 + above): 2 x^3 - 2 above x - aside = 0, two minima while aside is small enough
    parabola = NurbsCurve.bezier([[-0.7, 0.49], [0.05, -0.56], [0.8, 0.64]])
    most = (2.0 * above / 3.0) ** 1.5 * np.sqrt(0.5)
    aside = most * np.array([0.5, -0.5, 0.05, -0.05, 1e-3, -1e-3, 0.9, -0.9, 1.1, -1.1])
    queries = np.column_stack([aside, np.full(len(aside), 0.5 + above)])
    _, distance = parabola.nearest(queries)
    valleys = [np.roots([2.0, 0.0, -2.0 * above, -x]).real for x in aside]
    wanted = [np.hypot(v - x, v * v - y).min() for v, (x, y) in zip(valleys, queries, strict=True)]
    assert np.abs(distance - wanted).max() <= 4.0 * EPSILON


def test_self_crossing_is_near_whichever_branch_is_nearer():
    eight = KNOWN["figure eight"]
    u = np.linspace(0.0, 1.0, 2001)
    random = np.random.default_rng(0)
    queries = eight(u) + 1e-3 * random.normal(size=(len(u), 2))
    _, distance = eight.nearest(queries)
    assert np.max(distance - brute_force(eight, queries)) <= PROMISE * eight.size
    # samples in order do not hold on to the branch that they were on
    _, backwards = eight.nearest(queries[::-1])
    assert np.abs(backwards[::-1] - distance).max() <= PROMISE * eight.size


@pytest.mark.parametrize("at", [0.37, 0.4396119650664308])
@pytest.mark.parametrize("width", [0.3, 0.1, 3e-2, 1e-2, 1e-3, 1e-4, 3.290305403958895e-05])
def test_a_loop_that_samples_do_not_see(at, width):
    curve = with_loop(at, width)
    random = np.random.default_rng(1)
    fine = (at + width * np.linspace(-20.0, 20.0, 8001)).clip(0.0, 1.0)
    loop = curve(fine)
    within = loop[random.integers(3500, 4500, 60)] + width**3 * random.normal(size=(60, 2))
    queries = np.concatenate([within, at + within[::-1], hard_points(curve, 2)])
    assert worst_error(curve, queries) <= PROMISE
    _, distance = curve.nearest(within)
    sampled = np.linalg.norm(loop[:, None] - within, axis=2).min(axis=0)
    assert np.all(distance <= sampled + 1e-16)
    assert np.all(distance >= sampled - 1e-3 * width**3)  # which a local search would miss by more


@pytest.mark.parametrize("name", ["butterfly", "figure eight", "near cusp, 1e-4", "polyline"])
def test_order_does_not_matter(name):
    curve = CURVES[name]
    random = np.random.default_rng(5)
    low, high = curve.bounding_box()
    queries = random.uniform(low - 1.0, high + 1.0, (600, curve.axes))
    _, distance = curve.nearest(queries)
    shuffled = random.permutation(len(queries))
    assert np.abs(curve.nearest(queries[shuffled])[1] - distance[shuffled]).max() <= PROMISE * curve.size
    alone = np.array([curve.nearest(query)[1] for query in queries[:50]])
    assert np.abs(alone - distance[:50]).max() <= PROMISE * curve.size


@pytest.mark.nojit
def test_points_of_the_curve_are_found_again():
    curve = butterfly()
    s = np.linspace(0.0, curve.length, 400)[1:-1]
    u, distance = curve.nearest(curve(curve.parameter_at(s)))
    assert distance.max() <= 1e-13 * curve.size
    assert np.abs(curve.arc_length(u) - s).max() <= 1e-12 * curve.length
    ends = NurbsCurve.bezier([[0, 0], [1, 2], [3, 0]])
    assert np.array_equal(ends.nearest([[-1, -2], [5, -2]])[0], [0.0, 1.0])


def test_far_from_the_origin_the_last_digits_count():
    curve = butterfly()
    place = np.array([3e6, -7e6])
    moved = curve.transformed(1.0, place)
    queries = hard_points(curve, 3)
    rounding = 8.0 * np.spacing(7e6)
    assert np.abs(moved.nearest(queries + place)[1] - curve.nearest(queries)[1]).max() <= rounding


@pytest.mark.nojit
def test_shapes_and_refusals():
    curve = KNOWN["ellipse"]
    u, distance = curve.nearest(np.zeros((2, 3, 2)))
    assert u.shape == distance.shape == (2, 3)
    assert curve.nearest([60.0, 0.0])[1] == pytest.approx(10.0, rel=1e-15) and curve.nearest([60.0, 0.0])[0].shape == ()
    assert curve.nearest(np.zeros((0, 2)))[0].shape == (0,)
    reading = np.zeros((3, 2))
    reading.setflags(write=False)
    assert np.allclose(curve.nearest(reading)[1], 1.0)
    for points, said in (
        ([1.0, 2.0, 3.0], "points: expected shape (..., 2), got (3,)"),
        (1.0, "points: expected shape (..., 2), got ()"),
        ([], "points: expected shape (..., 2), got (0,)"),
        ([[0, 0], [np.nan, 0]], "points[1, 0] is nan; every value must be finite"),
        ([[0, -np.inf]], "points[0, 1] is -inf; every value must be finite"),
        ([0, 1e200], "points: a coordinate is beyond 1e+150 mm; distances to it would be rounding"),
    ):
        with pytest.raises(InputError) as caught:
            curve.nearest(points)
        assert str(caught.value) == said
    with pytest.raises(InputError, match="points: expected numbers, got str"):
        curve.nearest("there")


def test_path_of_many_curves_over_its_linear_axes():
    random = np.random.default_rng(2)
    corners = np.cumsum(random.normal(size=(301, 3)), axis=0)
    lines = [NurbsCurve.bezier(pair) for pair in itertools.pairwise(corners)]
    path = Path(lines, axes=("x", "y", "a"), by_tip=True)
    search = Nearest(path.table, path.shape)
    queries = corners[random.integers(301, size=200), :2] + random.normal(size=(200, 2))
    rows, u, distance = search.find(queries)
    start, side = corners[:-1, :2], np.diff(corners[:, :2], axis=0)
    share = np.sum((queries[:, None] - start) * side, axis=2) / np.sum(side * side, axis=1)
    apart = np.linalg.norm(queries[:, None] - start - share.clip(0.0, 1.0)[..., None] * side, axis=2)
    assert np.abs(distance - apart.min(axis=1)).max() <= 1e-13 * path.size
    curve = np.searchsorted(path.curve_rows[:, 1], rows)
    at = path.evaluate(curve, u)[:, 0, :2]
    assert np.abs(np.linalg.norm(at - queries, axis=1) - distance).max() <= 1e-13 * path.size


def scribble(count: int = 400, axes: int = 2, seed: int = 3) -> Path:
    """Lines that cross a plate in all ways."""
    return Path.polyline(np.random.default_rng(seed).uniform(0.0, 100.0, (count, axes)), "xyz"[:axes])


@pytest.mark.parametrize("name", ["butterfly", "polyline", "near cusp, 1e-4", "scribble"])
def test_cells_hold_their_curve(name):
    if name == "scribble":
        path = scribble()
        nearest, curve = Nearest(path.table, path.shape), np.repeat(np.arange(399), 7)
        u = np.tile(np.linspace(0.0, 1.0, 7), 399)
        points = path.evaluate(curve, u)[:, 0].T
        assert len(nearest.search.cells.row) == 4 * len(path.table)
    else:
        nearest, u = CURVES[name]._nearest, np.linspace(*CURVES[name].domain, 997)
        points, curve = CURVES[name](u).T, np.zeros(len(u), dtype=np.int64)
    rows, cells, (order, least, greatest) = nearest.rows, nearest.search.cells, nearest.search._boxes
    if name == "scribble":
        row = np.array([path.curve_rows[c, 0] for c in curve])
    else:
        row = np.clip(np.searchsorted(rows.low, u, side="right") - 1, 0, len(rows) - 1)
    t = (u - rows.middle[row]) * rows.scale[row]
    holding = [
        np.flatnonzero((cells.row == r) & (cells.low <= at + 1e-12) & (at - 1e-12 <= cells.high))[0]
        for r, at in zip(row, t, strict=True)
    ]
    assert np.all(nearest.search._bound(points, cells, np.array(holding)) <= 1e-26 * np.max(np.abs(points)) ** 2)
    node = np.argsort(order)[holding] + least.shape[1] // 2
    slack = 1e-12 * np.max(np.abs(points))  # of the t above
    while np.all(node >= 1):
        assert np.all((least[:, node] - slack <= points) & (points <= greatest[:, node] + slack))
        node //= 2


@pytest.mark.parametrize(("axes", "seed"), [(2, 1), (3, 2)])
def test_lines_that_cross_a_plate_in_all_ways(axes, seed):
    path = scribble(600, axes, seed)
    random = np.random.default_rng(seed)
    on = path.evaluate(random.integers(0, 599, 300), random.uniform(0.0, 1.0, 300))[:, 0]
    queries = np.concatenate([on, on + random.normal(0.0, 1e-2, on.shape), random.uniform(-50.0, 150.0, on.shape)])
    rows, u, distance = Nearest(path.table, path.shape).find(queries)
    corners = np.concatenate([path.evaluate(np.arange(599), np.zeros(599))[:, 0],
                              path.evaluate(np.array([598]), np.ones(1))[:, 0]])  # fmt: skip
    start, side = corners[:-1], np.diff(corners, axis=0)
    share = np.sum((queries[:, None] - start) * side, axis=2) / np.sum(side * side, axis=1)
    apart = np.linalg.norm(queries[:, None] - start - share.clip(0.0, 1.0)[..., None] * side, axis=2)
    assert np.abs(distance - apart.min(axis=1)).max() <= 1e-13 * path.size
    at = path.evaluate(np.searchsorted(path.curve_rows[:, 1], rows), u)[:, 0]
    assert np.abs(np.linalg.norm(at - queries, axis=1) - distance).max() <= 1e-13 * path.size


def test_the_work_for_many_lines_that_cross_grows_slower_than_by_their_square(monkeypatch):
    """Pairs of a place and a line that are looked at: for all boxes that a place lies in they grew by the square."""
    looked, bound = [], search.Search._bound
    monkeypatch.setattr(
        search.Search, "_bound", lambda self, q, parts, leaf: looked.append(len(leaf)) or bound(self, q, parts, leaf)
    )
    found = []
    for count in (500, 4000):
        path = scribble(count)
        looked.clear()
        Nearest(path.table, path.shape).find(path.evaluate(np.arange(count - 1), np.full(count - 1, 0.3))[:, 0])
        found.append(sum(looked))
    assert found[1] < 40 * found[0]  # 64 by the square: 29 are


@pytest.mark.parametrize("aside", [-0.3, -1e-3, 1e-3, 0.3])
def test_the_nearer_of_two_valleys_is_found(aside):
    """From (aside, 2) the parabola y = x^2 has a valley on each side, where 2 x^3 - 3 x - aside = 0."""
    parabola = NurbsCurve.bezier([[-2, 4], [0, -4], [2, 4]])
    u, distance = parabola.nearest([aside, 2.0])
    valleys = np.roots([2.0, 0.0, -3.0, -aside]).real
    wanted = np.sqrt(min((x - aside) ** 2 + (x * x - 2.0) ** 2 for x in valleys))
    x = 4.0 * float(u) - 2.0
    assert distance == pytest.approx(wanted, rel=1e-13)
    assert np.hypot(x - aside, x * x - 2.0) == pytest.approx(wanted, rel=1e-12)


def test_one_minimum_by_arc_length_is_found_where_the_distance_is_not_convex_by_the_parameter():
    """A line run through as x = u + 3 u^2: from far beyond its end Newton's step by u goes the wrong way."""
    line = NurbsCurve.bezier([[0.0, 0.0], [0.5, 0.0], [4.0, 0.0]])
    queries = np.column_stack([np.linspace(-3.0, 12.0, 61), np.full(61, 0.5)])
    _, distance = line.nearest(queries)
    beyond = np.maximum(np.maximum(-queries[:, 0], queries[:, 0] - 4.0), 0.0)
    assert distance == pytest.approx(np.hypot(beyond, 0.5), rel=1e-14)


def test_a_path_that_passes_the_same_places_again_and_again_is_searched_in_little_memory_or_refused(monkeypatch):
    random = np.random.default_rng(7)
    places = random.uniform(0.0, 20.0, (20, 3))
    path = Path.polyline(np.concatenate([random.permutation(places[:10]), places[10:]] * 100), "xyz")
    queries = places[random.integers(0, 20, 2000)] + random.normal(0.0, 1e-3, (2000, 3))
    nearest = Nearest(path.table, path.shape)
    tracemalloc.start()
    distance = nearest.find(queries)[2]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.all(distance <= 1e-2) and peak < 300e6  # in one block it would be a gigabyte
    monkeypatch.setattr(search, "MOST_COMPARED", 1000)
    monkeypatch.setattr(search, "EACH_COMPARED", 1)
    with pytest.raises(InputError, match="passes the same places again and again"):
        nearest.find(queries)

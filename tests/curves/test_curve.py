"""NurbsCurve: points and derivatives against 40 digits, SciPy and analytic curves; what it is, and that it stays so."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from numpy.polynomial import polynomial as poly
from scipy.interpolate import BSpline, PPoly, make_interp_spline

import reference
from sample_curves import KINDS, KNOWN, STILL, butterfly, ellipse, random_curve
from splinefeed.curves import differential
from splinefeed.curves.curve import MAX_DEGREE, NurbsCurve
from splinefeed.curves.pieces import coefficients
from splinefeed.errors import InputError
from splinefeed.kernels.layout import HIGH, LOW, MIDDLE, SCALE

SEEDS = range(36)
#: The promise: points relative to the curve's size, derivatives relative to their greatest value on the curve.
POINT = 1e-13
DERIVATIVE = 1e-11
EPSILON = np.finfo(float).eps


def largest(curve: NurbsCurve) -> np.ndarray:
    """Greatest coordinate of C, C', C'', C''' on the curve, (4,), by samples and both limits at every knot."""
    breaks = curve.breaks
    inside = (breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, 40, endpoint=False)).ravel()
    right = np.abs(curve.derivatives(inside, 3)).max(axis=(0, 2))
    left = np.abs(curve.derivatives(breaks[1:], 3, side="left")).max(axis=(0, 2))
    return np.maximum(right, left)


def worst_errors(curve: NurbsCurve, parameters, side: str = "right") -> np.ndarray:
    """Errors of C, C', C'', C''' against the reference, (4,), as shares of what is promised."""
    allowed = np.concatenate([[POINT * curve.size], DERIVATIVE * largest(curve)[1:]])
    allowed[0] += 2.0 * EPSILON * np.abs(curve.control_points).max()  # the coordinate itself is rounded
    given, sign = curve, np.ones(4)
    if side == "left":  # the mirrored curve from its right, each number negated exactly
        weights = None if curve.weights is None else curve.weights[::-1]
        given = NurbsCurve(curve.degree, -curve.knots[::-1], curve.control_points[::-1], weights)
        sign[1::2] = -1.0
    mirror = -1.0 if side == "left" else 1.0
    worst = np.zeros(4)
    for u in parameters:
        wanted = sign[:, None] * reference.derivatives(given, mirror * u, 3)
        error = np.abs(curve.derivatives(u, 3, side=side) - wanted).max(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            worst = np.maximum(worst, np.where(error > 0.0, error / allowed, 0.0))
    return worst


def some_parameters(curve: NurbsCurve, seed: int, count: int) -> np.ndarray:
    """Inner parameters (count,), a knot among them, and the start of the domain."""
    random = np.random.default_rng(seed)
    start, end = curve.domain
    return np.concatenate(
        [[start, curve.breaks[random.integers(len(curve.breaks) - 1)]], random.uniform(start, end, count)]
    )


# --- where it is ------------------------------------------------------------------------------------------------------


def test_sample_has_every_kind():
    curves = [random_curve(seed) for seed in SEEDS]
    assert {curve.degree for curve in curves} == set(range(1, MAX_DEGREE + 1))
    assert {curve.axes for curve in curves} == set(range(1, 7))
    assert {curve.rational for curve in curves} == {False, True}
    assert {curve.clamped for curve in curves} == {False, True}
    inner = [np.unique(c.knots[c.degree + 1 : -c.degree - 1], return_counts=True)[1] for c in curves]
    assert any(len(counts) and counts.max() == c.degree > 3 for counts, c in zip(inner, curves, strict=True))
    assert any(c.closed for c in curves) and len(KINDS) == 3


@pytest.mark.parametrize("seed", SEEDS)
def test_points_and_derivatives_match_40_digits(seed):
    curve = random_curve(seed)
    assert worst_errors(curve, some_parameters(curve, seed, 1)).max() <= 1.0


@pytest.mark.parametrize("seed", SEEDS)
def test_far_from_the_origin_only_the_coordinate_is_rounded(seed):
    curve = random_curve(seed, far=True, axes=2)
    assert np.abs(curve.control_points).max() > 1e5
    assert worst_errors(curve, some_parameters(curve, seed, 1)).max() <= 1.0


@pytest.mark.parametrize("seed", SEEDS)
def test_left_side_of_knots_matches_40_digits(seed):
    curve = random_curve(seed, axes=2)
    knots = curve.breaks[[1, -1]]
    assert worst_errors(curve, knots, side="left").max() <= 1.0


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("degree", [2, 3, 8, 12])
def test_weights_of_many_decades_keep_their_digits(ratio, degree):
    random = np.random.default_rng(degree)
    knots = np.concatenate([np.zeros(degree + 1), [1.0], np.full(degree + 1, 2.0)])
    weights = np.ones(degree + 2)
    weights[[0, degree // 2]] = 1.0 / ratio
    curve = NurbsCurve(degree, knots, random.normal(size=(degree + 2, 2)), weights)
    assert worst_errors(curve, [0.0, 1e-7, 1e-3, 0.3, 1.0]).max() <= 1.0


@pytest.mark.parametrize("curve", [*KNOWN.values(), *STILL.values(), butterfly()], ids=[*KNOWN, *STILL, "butterfly"])
def test_known_curves_match_40_digits(curve):
    assert worst_errors(curve, some_parameters(curve, 7, 3)).max() <= 1.0


@pytest.mark.slow
def test_hundreds_of_curves_match_40_digits():
    for seed in range(1000, 1300):
        curve = random_curve(seed, far=seed % 7 == 0)
        parameters = np.unique(np.concatenate([curve.breaks[:-1], some_parameters(curve, seed, 3)]))
        assert worst_errors(curve, parameters).max() <= 1.0, f"seed {seed}"


@pytest.mark.parametrize("seed", range(20))
def test_polynomial_curves_match_scipy(seed):
    curve = random_curve(seed)
    u = np.random.default_rng(seed).uniform(*curve.domain, 50)
    spline = BSpline(curve.knots, curve.control_points, curve.degree)
    plain = NurbsCurve(curve.degree, curve.knots, curve.control_points)
    allowed = np.concatenate([[POINT * plain.size], DERIVATIVE * largest(plain)[1:]])
    for order in range(4):
        wanted = spline(u, nu=order) if order <= curve.degree else 0.0
        assert np.abs(plain.derivatives(u, 3)[:, order] - wanted).max() <= allowed[order]


@pytest.mark.nojit
def test_circle_is_a_circle():
    circle = ellipse(5.0, 5.0)
    u = np.linspace(0.0, 4.0, 801)
    points, first, second = np.moveaxis(circle.derivatives(u, 2), 1, 0)
    assert np.abs(np.hypot(*points.T) - 5.0).max() <= 5e-15
    assert np.abs(np.sum(points * first, axis=1)).max() <= 1e-13
    assert np.abs(circle.curvature(u) - 0.2).max() <= 1e-13
    across = np.column_stack([-points[:, 1], points[:, 0]]) / 5.0
    assert np.abs(circle.tangent(u) - across).max() <= 1e-14
    # |C'|^2 + C.C'' = 0 by differentiating |C|^2 twice
    assert np.abs(np.sum(first**2 + points * second, axis=1)).max() <= 1e-12
    assert circle.closed and circle.clamped and circle.rational


@pytest.mark.nojit
@pytest.mark.parametrize("seed", range(12))
def test_each_derivative_is_the_slope_of_the_one_before(seed):
    curve = random_curve(seed + 24)
    breaks = curve.breaks
    span = int(np.argmax(np.diff(breaks)))
    width = breaks[span + 1] - breaks[span]
    u = breaks[span] + width * np.linspace(0.2, 0.8, 5)
    step = 1e-3 * width
    stencil = curve.derivatives(u[:, None] + step * np.array([-2.0, -1.0, 1.0, 2.0]), 3)
    slope = np.tensordot(stencil, [1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12], axes=(1, 0)) / step
    exact = curve.derivatives(u, 3)
    scale = np.abs(stencil).max(axis=(0, 1, 3))
    for order in range(3):
        allowed = 1e-6 * max(scale[order + 1], scale[order] / width)
        assert np.abs(slope[:, order] - exact[:, order + 1]).max() <= allowed


@pytest.mark.nojit
def test_side_matters_at_knots_and_nowhere_else():
    corner = NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 2], [[0, 0], [1, 0], [1, 1], [1, 3], [0, 3]])
    assert np.allclose(corner.derivatives(1.0, 1, side="left")[1], [0.0, 2.0])
    assert np.allclose(corner.derivatives(1.0, 1)[1], [0.0, 4.0])
    u = [0.0, 0.3, 1.7, 2.0]
    assert np.array_equal(corner.derivatives(u, 3, side="left"), corner.derivatives(u, 3))


@pytest.mark.nojit
def test_shapes_of_what_comes_back():
    curve = random_curve(3, axes=3)
    u = np.linspace(*curve.domain, 6).reshape(2, 3)
    assert curve(u).shape == (2, 3, 3)
    assert curve(u[0, 0]).shape == (3,)
    assert curve([]).shape == (0, 3)
    assert curve.derivatives(u, 2).shape == (2, 3, 3, 3)
    assert curve.tangent(u).shape == (2, 3, 3)
    assert curve.curvature(u).shape == (2, 3)
    assert np.array_equal(curve.derivatives(u, 3)[..., 0, :], curve(u))


@pytest.mark.nojit
def test_parameters_outside_are_refused_and_rounding_is_not():
    curve = NurbsCurve(1, [0, 0.1, 0.7, 1.0], [[0.0], [1.0]])
    assert np.array_equal(curve(0.7 + 1e-16), curve(0.7))
    for u, said in ((0.8, "0.8"), (0.09, "0.09"), (np.nan, "nan"), ([0.2, np.inf], "inf")):
        with pytest.raises(InputError) as caught:
            curve(u)
        assert str(caught.value) == f"parameter {said} is outside the curve's domain [0.1, 0.7]"
    with pytest.raises(InputError, match="parameter: expected numbers, got str"):
        curve("somewhere")
    with pytest.raises(InputError, match="order is 4; expected 0 to 3"):
        curve.derivatives(0.2, 4)
    with pytest.raises(InputError, match="side is 'middle'; choose 'right' or 'left'"):
        curve.derivatives(0.2, 1, side="middle")


@pytest.mark.nojit
def test_tangent_where_the_curve_stands_still_is_the_limit():
    cube = NurbsCurve.bezier([[0, 0], [0, 0], [0, 0], [3, 4]])  # u^3 (3, 4)
    assert np.allclose(cube.tangent([0.0, 0.5, 1.0]), [0.6, 0.8], atol=1e-15)
    arriving = NurbsCurve.bezier([[0, 0], [1, 0], [3, 4], [3, 4]])
    assert np.allclose(arriving.tangent(1.0), [2 / np.hypot(2, 4), 4 / np.hypot(2, 4)], atol=1e-15)
    ninth = NurbsCurve.bezier([[1, 1]] * 9 + [[1, 2]])
    assert np.allclose(ninth.tangent(0.0), [0.0, 1.0], atol=1e-15)
    narrow = NurbsCurve(3, [7.0] * 4 + [7.0 + 1e-6] * 4, [[0, 0], [0, 0], [1, 1], [3, 0]])
    assert np.allclose(narrow.tangent(7.0), [np.sqrt(0.5)] * 2, atol=1e-9)
    resting = KNOWN["polyline"]  # stands at (1, 0) from u = 1 to u = 2
    assert np.array_equal(resting.tangent([1.0, 1.5]), [[0.0, 1.0], [0.0, 1.0]])


@pytest.mark.nojit
def test_curvature_where_the_curve_stands_still_is_infinite():
    assert np.isinf(NurbsCurve.bezier([[0, 0], [0, 0], [1, 1], [3, 0]]).curvature(0.0))
    assert np.array_equal(KNOWN["line"].curvature([0.0, 0.4]), [0.0, 0.0])


# --- what it is -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_bounding_box_holds_the_curve_and_touches_it(seed):
    curve = random_curve(seed)
    low, high = curve.bounding_box()
    breaks = curve.breaks
    u = np.unique(
        (breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, 300)).ravel().clip(*curve.domain)
    )
    points = curve(u)
    assert np.all(points >= low - 1e-12 * curve.size) and np.all(points <= high + 1e-12 * curve.size)
    for axis in range(curve.axes):
        for best, bound in ((int(points[:, axis].argmin()), low), (int(points[:, axis].argmax()), high)):
            around = np.linspace(u[max(best - 1, 0)], u[min(best + 1, len(u) - 1)], 2000)
            closer = curve(np.append(around, u[best]))[:, axis]
            assert np.abs(closer - bound[axis]).min() <= 1e-9 * curve.size


def roots_of_each(values: np.ndarray, real: float) -> list[np.ndarray]:
    """Real roots in [-1, 1] of polynomials with coefficients (terms, n), one after another: that of NumPy."""
    found = []
    for each in values.T:
        kept = np.trim_zeros(np.where(np.abs(each) > 1e-15 * np.abs(each).max(), each, 0.0), "b")
        roots = poly.polyroots(kept) if len(kept) > 1 else np.zeros(0)
        found.append(roots.real[(np.abs(roots.imag) < real) & (np.abs(roots.real) <= 1.0)])
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_roots_of_all_pieces_at_once_are_those_of_each(seed):
    curve = random_curve(seed)
    table, shape = curve.table
    c = np.ascontiguousarray(table.T)
    terms = coefficients(c, shape)
    weights = terms[curve.axes].T if curve.rational else np.ones((len(table), 1))
    for axis, slope in enumerate(differential.slopes(c, shape)):
        wanted = np.zeros_like(slope)
        for k, (a, w) in enumerate(zip(terms[axis].T, weights, strict=True)):
            each = poly.polysub(poly.polymul(poly.polyder(a), w), poly.polymul(a, poly.polyder(w)))
            wanted[: len(each), k] = each
        assert slope == pytest.approx(wanted, rel=1e-12, abs=1e-14 * np.abs(wanted).max(initial=0.0))
        each = roots_of_each(slope, 1e-6)
        u = [np.clip(row[MIDDLE] + t / row[SCALE], row[LOW], row[HIGH]) for row, t in zip(table, each, strict=True)]
        width = curve.domain[1] - curve.domain[0]
        found = np.sort(differential.zeros_on(c, slope, 1e-6)[1])
        assert found == pytest.approx(np.sort(np.concatenate(u)), rel=0.0, abs=1e-9 * width)


def test_a_polynomial_that_is_0_or_a_number_has_no_roots():
    table, _ = random_curve(2).table
    c = np.repeat(table.T[:, :1], 4, axis=1)
    values = np.array([[0.0, 3.0, 0.5, -0.25], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    t = (differential.zeros_on(c, values, 1e-6)[1] - c[MIDDLE, 0]) * c[SCALE, 0]
    assert np.sort(t) == pytest.approx([-0.5, -0.5, 0.5], abs=1e-12)
    assert len(differential.zeros_on(c, values[:, :0], 1e-6)[1]) == 0


def test_the_work_of_a_box_is_by_arrays(monkeypatch):
    """A cubic through 4,000 places in no order: roots come from a few calls, not one a piece and axis."""
    places = np.random.default_rng(3).uniform(size=(4000, 2))
    spline = make_interp_spline(np.arange(4000.0), places)
    curve, calls, eigvals = NurbsCurve(3, spline.t, spline.c), [], np.linalg.eigvals
    monkeypatch.setattr(np.linalg, "eigvals", lambda matrix: calls.append(len(matrix)) or eigvals(matrix))
    low, high = curve.bounding_box()
    assert 0 < len(calls) <= 8
    exact = spline.derivative()
    for axis in range(2):
        turns = PPoly.from_spline((exact.t, exact.c[:, axis], exact.k)).roots(extrapolate=False)
        values = np.append(spline(turns[np.isfinite(turns)])[:, axis], places[[0, -1], axis])
        assert [low[axis], high[axis]] == pytest.approx([values.min(), values.max()], abs=1e-12)


@pytest.mark.nojit
def test_bounding_boxes_known():
    low, high = ellipse(50.0, 1.0).bounding_box()
    assert np.allclose(low, [-50.0, -1.0], rtol=1e-15, atol=0) and np.allclose(high, [50.0, 1.0], rtol=1e-15, atol=0)
    low, high = NurbsCurve.bezier([[0, 0], [0, 3], [1, 0]]).bounding_box()  # y = 6 u (1 - u)
    assert np.allclose([low, high], [[0.0, 0.0], [1.0, 1.5]], rtol=1e-15, atol=1e-15)
    low, high = KNOWN["line"].bounding_box()
    assert np.array_equal([low, high], [[1.0, 2.0], [4.0, 6.0]])


@pytest.mark.nojit
def test_a_curve_cannot_be_changed():
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    curve = NurbsCurve(2, [0, 0, 0, 1, 1, 1], points, [1.0, 2.0, 1.0])
    points[1] = 99.0
    assert curve.control_points[1, 0] == 1.0
    for array in (curve.knots, curve.control_points, curve.weights, curve.breaks, curve.table[0], curve.arc.table):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    for name in ("degree", "knots", "weights", "colour"):
        with pytest.raises(AttributeError, match=f"a NurbsCurve cannot be changed: tried to set '{name}'"):
            setattr(curve, name, 1)
    with pytest.raises(AttributeError, match="a NurbsCurve cannot be changed: tried to delete 'knots'"):
        del curve.knots


@pytest.mark.nojit
@pytest.mark.parametrize("seed", [0, 15, 31])
def test_copies_and_pickles_are_equal_and_hash_alike(seed):
    curve = random_curve(seed)
    curve.arc  # noqa: B018  a table that a pickle need not carry
    for other in (pickle.loads(pickle.dumps(curve)), copy.copy(curve), copy.deepcopy(curve)):
        assert other == curve and hash(other) == hash(curve)
        assert not other.control_points.flags.writeable
        assert np.array_equal(other(curve.breaks), curve(curve.breaks))
    assert len(pickle.dumps(curve)) < 1000 + 10 * (curve.knots.nbytes + curve.control_points.nbytes)


@pytest.mark.nojit
def test_equality_tells_curves_apart():
    curve = NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [1, 1], [2, 0]], [1, 2, 1])
    others = [
        NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [1, 1], [2, 0]]),
        NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [1, 1], [2, 0]], [1, 3, 1]),
        NurbsCurve(2, [0, 0, 0, 2, 2, 2], [[0, 0], [1, 1], [2, 0]], [1, 2, 1]),
        NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0], [1, 2], [2, 0]], [1, 2, 1]),
        NurbsCurve.bezier([[0, 0], [2, 0]]),
        "a curve",
    ]
    assert all(curve != other for other in others)
    zero = NurbsCurve(1, [0.0, 0.0, 1.0, 1.0], [[0.0], [1.0]])
    minus = NurbsCurve(1, [-0.0, -0.0, 1.0, 1.0], [[-0.0], [1.0]])
    assert zero == minus and hash(zero) == hash(minus)


@pytest.mark.nojit
def test_equal_weights_are_no_weights():
    curve = NurbsCurve.bezier([[0, 0], [1, 2], [2, 0]], [3.0, 3.0, 3.0])
    assert curve.weights is None and not curve.rational
    assert curve == NurbsCurve.bezier([[0, 0], [1, 2], [2, 0]])


@pytest.mark.nojit
def test_control_points_without_influence_do_no_harm():
    # the first point lives on [-1, 0] only, although 0 stands four times
    curve = NurbsCurve(3, [-1, 0, 0, 0, 0, 1, 1, 1, 1], [[99, 99], [0, 0], [1, 2], [2, 2], [3, 0]])
    plain = NurbsCurve.bezier([[0, 0], [1, 2], [2, 2], [3, 0]])
    u = np.linspace(0.0, 1.0, 11)
    assert np.abs(curve(u) - plain(u)).max() <= 1e-14
    assert not curve.clamped and plain.clamped
    assert np.abs(curve.with_clamped_ends().control_points - plain.control_points).max() <= 1e-13
    assert np.abs(curve.elevated()(u) - plain(u)).max() <= 1e-13
    assert np.abs(curve.reversed().with_knots(0.5, 0.5)(u[::-1]) - plain(u)).max() <= 1e-13
    assert str(curve) == "NurbsCurve(degree 3, 5 control points, 2 axes, polynomial, u 0 to 1)"

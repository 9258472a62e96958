"""Kernels of curves one by one: polar forms, power forms, tables of pieces, and the search in them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import reference
from sample_curves import KINDS, KNOWN, STILL, along_a_wave, butterfly, random_curve, with_cusp
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.kernels import arc_fitting, arc_length, nearest, nurbs, pieces, span_rows
from splinefeed.kernels import cells as cells_of

EPSILON = np.finfo(float).eps
pytestmark = pytest.mark.nojit


def polar(curve: NurbsCurve, span: int, *arguments: float) -> np.ndarray:
    work = np.empty((curve.degree + 1, curve.axes))
    nurbs.blossom(curve.knots, curve.control_points, curve.degree, span, np.array(arguments), work)
    return work[-1]


def place(table: np.ndarray, u: float) -> tuple[int, float]:
    """Row and t of a parameter."""
    row = pieces.find_row(table, 0, len(table) - 1, pieces.LOW, u)
    return row, (u - table[row, pieces.MIDDLE]) * table[row, pieces.SCALE]


# --- polar and power forms --------------------------------------------------------------------------------------------


def test_polar_form_is_symmetric_affine_and_the_curve_on_its_diagonal():
    curve = along_a_wave(3, [0, 0, 0, 0, 1, 2, 2, 3, 3, 3, 3.0])
    span = 4
    values = [polar(curve, span, *order) for order in itertools.permutations([1.1, 1.7, 2.4])]
    assert np.ptp(values, axis=0).max() <= 1e-14
    ends = polar(curve, span, 1.2, 1.9, 0.4), polar(curve, span, 1.2, 1.9, 2.4)
    assert np.allclose(polar(curve, span, 1.2, 1.9, 1.15), 0.625 * ends[0] + 0.375 * ends[1], rtol=0, atol=1e-14)
    assert np.allclose(polar(curve, span, 1.3, 1.3, 1.3), curve(1.3), rtol=0, atol=1e-15)
    # control points are polar values at knots in a row
    for i in range(span - 3, span + 1):
        assert np.allclose(polar(curve, span, *curve.knots[i + 1 : i + 4]), curve.control_points[i], rtol=0, atol=1e-14)


@pytest.mark.parametrize("degree", [1, 3, 7, 12])
def test_power_form_is_the_taylor_series(degree):
    curve = along_a_wave(degree, np.concatenate([np.zeros(degree), [0, 0.5, 3, 4], np.full(degree, 4.0)]))
    span = degree + 1
    knots = curve.knots[span - degree : span + degree + 2].copy()
    out = np.empty((degree + 1, 2))
    nurbs.power_form(knots, curve.control_points[span - degree : span + 1].copy(), degree, 1.75, 1.25, out)
    wanted = reference.derivatives(curve, 1.75, 3)
    for k in range(min(4, degree + 1)):
        factor = 1.25**k / [1, 1, 2, 6][k]
        assert np.allclose(out[k], factor * wanted[k], rtol=1e-13, atol=1e-14)
    for t in (-1.0, 0.3, 1.0):
        assert np.allclose(np.polynomial.polynomial.polyval(t, out), curve(1.75 + 1.25 * t), rtol=0, atol=1e-12)


def test_refined_weights_stay_means_of_weights():
    # weights of 1e-6 beside 1e6: a mean with a negative share would lose them
    weights = np.array([[1.0], [1e-6], [1e6], [1e-6], [1.0], [1.0]])
    knots = np.array([0, 0, 0, 0, 1, 1 + 1e-6, 2, 2, 2, 2.0])
    new = np.sort(np.concatenate([knots, [0.3, 0.3, 1 + 5e-7, 1.5]]))
    out = np.empty((len(new) - 4, 1))
    nurbs.refine(knots, weights, 3, new, out)
    assert np.all(out > 0.0) and out.min() >= 1e-6 * (1 - 1e-14) and out.max() <= 1e6
    assert out[0, 0] == weights[0, 0] and out[-1, 0] == weights[-1, 0]
    higher = np.empty((len(knots) + 4 - 5, 1))
    nurbs.elevate(knots, weights, 3, np.sort(np.concatenate([knots, np.unique(knots)])), higher)
    assert np.all(higher > 0.0) and higher.max() <= 1e6 * (1 + 1e-15)


def test_descending_leaves_one_out():
    knots = np.arange(10.0)
    out = np.empty(3)
    for without, wanted in ((-1, [4, 3, 2]), (2, [5, 4, 3]), (3, [5, 4, 2]), (5, [4, 3, 2])):
        nurbs.descending(knots, 2, without, out)
        assert out.tolist() == wanted


# --- tables -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", range(3))
def test_rows_cover_the_domain_in_order(kind):
    for degree in (1, 4, 12):
        curve = random_curve(12 * kind + degree - 1)
        for table in (curve.table[0], curve.arc.table):
            assert table[0, pieces.LOW] == curve.domain[0] and table[-1, pieces.HIGH] == curve.domain[1]
            assert np.array_equal(table[1:, pieces.LOW], table[:-1, pieces.HIGH])
            assert np.all(table[:, pieces.HIGH] > table[:, pieces.LOW])
            assert set(curve.breaks) <= set(table[:, pieces.LOW]) | {curve.domain[1]}
    assert len(KINDS) == 3


def test_tables_of_a_cubic_have_one_row_a_span_and_wild_curves_more():
    assert len(butterfly().table[0]) == 48
    assert len(along_a_wave(6, [0.0] * 7 + [1.0] + [2.0] * 7).table[0]) == 2
    twelfth = along_a_wave(12, [0.0] * 13 + [1.0] * 13)
    assert 2 <= len(twelfth.table[0]) <= 4
    wild = NurbsCurve.bezier([[0, 0], [1, 2], [2, 0], [3, 1]], [1.0, 1e-6, 1.0, 1e-6])
    assert 2 <= len(wild.table[0]) <= 40
    weights = wild.table[0][:, -4:]
    least = [np.polynomial.polynomial.polyval(np.linspace(-1, 1, 9), w).min() for w in weights]
    assert np.all(np.abs(weights).sum(axis=1) <= span_rows.MOST_ROUNDINGS * np.array(least) * (1 + 1e-9))


@pytest.mark.parametrize("seed", [2, 17, 35])
def test_both_tables_are_one_curve(seed):
    curve = random_curve(seed)
    u = np.random.default_rng(seed).uniform(*curve.domain, 20)
    out = np.empty((len(u), 4, curve.axes))
    pieces.evaluate(curve.arc.table, 0, len(curve.arc.table) - 1, curve.arc.shape, u, 3, False, out)
    other = curve.derivatives(u, 3)
    scale = np.abs(other).max(axis=(0, 2))
    scale[0] = curve.size
    assert np.all(np.abs(out - other).max(axis=(0, 2)) <= 1e-11 * scale)


def test_short_forms_agree_with_derivatives():
    for seed in (3, 16, 28):
        curve = random_curve(seed)
        table, (degree, axes, _, rational) = curve.arc.table, curve.arc.shape
        for linear in {1, axes}:
            shape = (degree, axes, linear, rational)
            for u in np.random.default_rng(seed).uniform(*curve.domain, 5):
                row, t = place(table, u)
                full = np.empty((4, axes))
                pieces.derivatives(table, row, shape, t, 3, full)
                at = np.empty(axes)
                pieces.point(table, row, shape, t, at)
                assert np.array_equal(at, full[0])
                first, second = full[1, :linear], full[2, :linear]
                assert pieces.speed(table, row, shape, t) == pytest.approx(np.linalg.norm(first), rel=1e-13)
                square, product = pieces.first_two(table, row, shape, t)
                assert square == pytest.approx(first @ first, rel=1e-13)
                allowed = 1e-12 * np.linalg.norm(first) * np.linalg.norm(second)
                assert product == pytest.approx(first @ second, abs=allowed)
                query = full[0] + np.arange(1.0, axes + 1.0) * curve.size
                apart, scale = (full[0] - query)[:linear], table[row, pieces.SCALE]
                got = nearest.squared_distance(table, row, shape, t, query)
                slope, bend = apart @ first / scale, (first @ first + apart @ second) / scale**2
                assert got[0] == pytest.approx(apart @ apart, rel=1e-13)
                assert got[1] == pytest.approx(slope, rel=1e-11, abs=1e-12 * curve.size**2)
                assert got[2] == pytest.approx(bend, rel=1e-11, abs=1e-11 * curve.size**2)
                assert got[3] == pytest.approx(first @ first / scale**2, rel=1e-13)


def test_find_row_is_the_last_one_not_above():
    table = np.zeros((5, 1))
    table[:, 0] = [0.0, 1.0, 1.0, 2.0, 4.0]
    wanted = {-1.0: 0, 0.0: 0, 0.5: 0, 1.0: 2, 1.9: 2, 2.0: 3, 4.0: 4, 9.0: 4}
    assert {value: pieces.find_row(table, 0, 4, 0, value) for value in wanted} == wanted
    assert pieces.find_row(table, 1, 2, 0, 9.0) == 2 and pieces.find_row(table, 1, 2, 0, -9.0) == 1


def test_walking_goes_where_bisection_goes():
    table = butterfly().arc.table
    last = len(table) - 1
    cursor = np.array([0, 0, last])
    for u in [*np.linspace(0.0, 1.0, 301), *np.linspace(1.0, 0.0, 77), *table[::7, pieces.LOW]]:
        assert pieces.walk_to(table, cursor, u) == pieces.find_row(table, 0, last, pieces.LOW, u) == cursor[0]
    cursor[:] = 3, 2, 5
    assert pieces.walk_to(table, cursor, 1.0) == 5 and pieces.walk_to(table, cursor, 0.0) == 2


# --- arc length -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*KNOWN, *STILL])
def test_pieces_join_and_their_slope_is_the_speed(name):
    curve = {**KNOWN, **STILL}[name]
    table, shape = curve.arc.table, curve.arc.shape
    last_place = np.spacing(np.abs(curve.domain).max())
    for row in range(len(table)):
        end = (table[row, pieces.HIGH] - table[row, pieces.MIDDLE]) * table[row, pieces.SCALE]
        next_start = table[row + 1, pieces.START] if row + 1 < len(table) else curve.length
        assert arc_length.arc_length(table, row, end) == pytest.approx(next_start, abs=4 * EPSILON * curve.length)
        slopes = table[row, pieces.ARC + 1 : pieces.ARC + pieces.ARC_TERMS] * np.arange(1, pieces.ARC_TERMS)
        t = np.linspace(-1.0, 1.0, 7)
        exact = np.array([pieces.speed(table, row, shape, x) for x in t]) / table[row, pieces.SCALE]
        negligible = arc_fitting.NEGLIGIBLE / arc_fitting.END_SHARE * curve.length
        allowed = 1e-12 * exact.max() + negligible + last_place * exact.max() * table[row, pieces.SCALE]
        assert np.abs(np.polynomial.polynomial.polyval(t, slopes) - exact).max() <= allowed


@pytest.mark.parametrize("guess", [-1.0, -0.3, 0.0, 0.9999, 1.0, 7.0, -7.0])
def test_inversion_in_a_row_from_any_guess(guess):
    for curve in (butterfly(), with_cusp(0.3), STILL["three equal points at the start"]):
        table = curve.arc.table
        for row in (0, len(table) // 2, len(table) - 1):
            for t in (-1.0, -0.999, -0.2, 0.5, 1.0):
                s = arc_length.arc_length(table, row, t)
                found = arc_length.parameter_in_row(table, row, s, guess)
                assert -1.0 <= found <= 1.0
                assert abs(arc_length.arc_length(table, row, found) - s) <= 4 * EPSILON * curve.length


def test_a_table_with_too_few_rows_says_how_many_would_do():
    curve = butterfly()
    wanted = len(curve.arc.table)
    rough = arc_fitting.rough_length(curve.table[0], 0, 47, curve.table[1])
    assert rough == pytest.approx(curve.length, rel=1e-2)
    small = np.full((7, curve.arc.table.shape[1]), np.nan)
    shape = curve.arc.shape
    needed = arc_fitting.arc_pieces(
        curve.knots, curve.control_points, curve.kernel_weights, shape, rough, small, 0, shape, arc_fitting.arc_room(99)
    )
    assert needed == wanted
    assert np.array_equal(small, curve.arc.table[:7])
    cells = np.empty((2, cells_of.ENDS + 4))
    assert cells_of.make_cells(curve.arc.table, curve.arc.shape, cells) == len(curve.arc.nearest.cells)
    rows = np.zeros((1, curve.table[0].shape[1]))
    assert span_rows.fill_rows(rows, 0, curve.knots, curve.control_points, curve.weights, shape, shape) == 48

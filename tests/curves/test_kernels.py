"""Formulas of curves one by one: polar forms, power forms, tables of pieces, and the search in them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import reference
from sample_curves import KINDS, KNOWN, STILL, along_a_wave, butterfly, random_curve, with_cusp
from splinefeed.curves import editing, tables
from splinefeed.curves import pieces as places
from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError
from splinefeed.kernels import layout, pieces

EPSILON = np.finfo(float).eps
pytestmark = pytest.mark.nojit


def polar(curve: NurbsCurve, span: int, *arguments: float) -> np.ndarray:
    at = np.array(arguments)[:, None]
    return editing.blossom(curve.knots, curve.control_points, curve.degree, np.array([span]), at)[0]


def place(table: np.ndarray, u: float) -> tuple[int, float]:
    """Row and t of a parameter."""
    row = max(int(np.searchsorted(table[:, layout.LOW], u, side="right")) - 1, 0)
    return row, (u - table[row, layout.MIDDLE]) * table[row, layout.SCALE]


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
    knots, points = curve.knots[span - degree : span + degree + 2], curve.control_points[span - degree : span + 1]
    out = tables.power_form(knots[:, None], points[..., None], np.array([1.75]), np.array([1.25]))[..., 0]
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
    out = editing._over(knots, weights, 3, new)
    assert np.all(out > 0.0) and out.min() >= 1e-6 * (1 - 1e-14) and out.max() <= 1e6
    assert out[0, 0] == weights[0, 0] and out[-1, 0] == weights[-1, 0]
    higher = editing._over(knots, weights, 3, np.sort(np.concatenate([knots, np.unique(knots)])), higher=True)
    assert np.all(higher > 0.0) and higher.max() <= 1e6 * (1 + 1e-15)


# --- tables -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", range(3))
def test_rows_cover_the_domain_in_order(kind):
    for degree in (1, 4, 12):
        curve = random_curve(12 * kind + degree - 1)
        for table in (curve.table[0], curve.arc.table):
            assert table[0, layout.LOW] == curve.domain[0] and table[-1, layout.HIGH] == curve.domain[1]
            assert np.array_equal(table[1:, layout.LOW], table[:-1, layout.HIGH])
            assert np.all(table[:, layout.HIGH] > table[:, layout.LOW])
            assert set(curve.breaks) <= set(table[:, layout.LOW]) | {curve.domain[1]}
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
    assert np.all(np.abs(weights).sum(axis=1) <= tables.MOST_ROUNDINGS * np.array(least) * (1 + 1e-9))


@pytest.mark.parametrize("seed", [2, 17, 35])
def test_both_tables_are_one_curve(seed):
    curve = random_curve(seed)
    u = np.random.default_rng(seed).uniform(*curve.domain, 20)
    rows = np.array([[0, len(curve.arc.table) - 1]])
    out = places.Pieces(curve.arc.table, curve.arc.shape, rows).evaluate(None, u, 3, False)
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
                full = np.empty((1, 2, axes))
                places.derivatives(table[row, :, None], shape, np.array([t]), 1, full)
                at = np.empty(axes)
                pieces.point(table, row, shape, t, at)
                assert np.array_equal(at, full[0, 0])
                first = full[0, 1, :linear]
                assert pieces.speed(table, row, shape, t) == pytest.approx(np.linalg.norm(first), rel=1e-13)


def test_walking_goes_where_bisection_goes():
    table = butterfly().arc.table
    last = len(table) - 1
    cursor = np.array([0, 0, last])
    for u in [*np.linspace(0.0, 1.0, 301), *np.linspace(1.0, 0.0, 77), *table[::7, layout.LOW]]:
        assert pieces.walk_to(table, cursor, layout.LOW, u) == place(table, u)[0] == cursor[0]
    cursor[:] = 3, 2, 5
    assert pieces.walk_to(table, cursor, layout.LOW, 1.0) == 5 and pieces.walk_to(table, cursor, layout.LOW, 0.0) == 2


# --- arc length -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*KNOWN, *STILL])
def test_pieces_join_and_their_slope_is_the_speed(name):
    curve = {**KNOWN, **STILL}[name]
    table, shape = curve.arc.table, curve.arc.shape
    last_place = np.spacing(np.abs(curve.domain).max())
    for row in range(len(table)):
        end = (table[row, layout.HIGH] - table[row, layout.MIDDLE]) * table[row, layout.SCALE]
        next_start = table[row + 1, layout.START] if row + 1 < len(table) else curve.length
        assert pieces.arc_length(table, row, end) == pytest.approx(next_start, abs=4 * EPSILON * curve.length)
        slopes = table[row, layout.ARC + 1 : layout.ARC + layout.ARC_TERMS] * np.arange(1, layout.ARC_TERMS)
        t = np.linspace(-1.0, 1.0, 7)
        exact = np.array([pieces.speed(table, row, shape, x) for x in t]) / table[row, layout.SCALE]
        # a speed that falls to 1e-9 between two places looks like one that falls to 0: as a length 1e-18 is nothing
        sharp = 1e-8 * exact.max() if name == "near cusp, 1e-9" else 0.0
        negligible = tables.NEGLIGIBLE * tables.BELOW * curve.size + sharp
        allowed = 1e-12 * exact.max() + negligible + last_place * exact.max() * table[row, layout.SCALE]
        assert np.abs(np.polynomial.polynomial.polyval(t, slopes) - exact).max() <= allowed


@pytest.mark.parametrize("guess", [-1.0, -0.3, 0.0, 0.9999, 1.0, 7.0, -7.0])
def test_inversion_in_a_row_from_any_guess(guess):
    for curve in (butterfly(), with_cusp(0.3), STILL["three equal points at the start"]):
        table = curve.arc.table
        for row in (0, len(table) // 2, len(table) - 1):
            for t in (-1.0, -0.999, -0.2, 0.5, 1.0):
                s = pieces.arc_length(table, row, t)
                found = pieces.parameter_in_row(table, row, s, guess)
                assert -1.0 <= found <= 1.0
                assert abs(pieces.arc_length(table, row, found) - s) <= 4 * EPSILON * curve.length


@pytest.mark.parametrize("guess", [-1.0, -0.3, 0.0, 0.9999, 1.0, 7.0, -7.0])
def test_inversion_of_many_from_any_guess(guess):
    for curve in (butterfly(), with_cusp(0.3), *STILL.values()):
        table = curve.arc.table
        row = np.repeat(np.arange(len(table)), 5)
        c = places.columns(table, row)
        t = np.tile([-1.0, -0.999, -0.2, 0.5, 1.0], len(table))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = places.inverted(c[layout.ARC : layout.ORIGIN], places.arc(c, t), np.full(len(t), guess))
        assert np.all((found >= -1.0) & (found <= 1.0))
        assert np.max(np.abs(places.arc(c, found) - places.arc(c, t))) <= 4 * EPSILON * curve.length


def test_a_place_does_not_depend_on_those_beside_it(monkeypatch):
    """Points, lengths and their inverse, to the bit: one by one, in chunks of seven, on one row and on many."""
    for curve in (butterfly(), with_cusp(0.3), random_curve(17)):
        s = np.random.default_rng(3).permutation(np.linspace(0.0, curve.length, 301))
        u = curve.parameter_at(s)
        whole = curve.derivatives(u, 3), curve.arc_length(u)
        monkeypatch.setattr(places.chunks, "__defaults__", (7,))
        assert np.array_equal(curve.parameter_at(s), u) and np.array_equal(curve.arc_length(u), whole[1])
        monkeypatch.undo()
        for k in range(0, len(u), 10):
            assert curve.parameter_at(s[k]) == u[k] and curve.arc_length(u[k]) == whole[1][k]
            assert np.array_equal(curve.derivatives(u[k], 3), whole[0][k])


def test_arrays_and_leaves_are_one_arithmetic():
    """S, the point, and the rows turned about: the bits of the leaves that recursive methods call."""
    for curve in (butterfly(), random_curve(16), random_curve(28)):
        table, shape = curve.arc.table, curve.arc.shape
        row = np.arange(len(table))
        c, t = places.columns(table, row), np.linspace(-1.0, 1.0, len(table))
        out = np.empty((len(table), 1, curve.axes))
        places.derivatives(c, shape, t, 0, out)
        lengths, at = c[layout.START] + places.arc(c, t), np.empty(curve.axes)
        for k in row:
            assert pieces.arc_length(table, k, t[k]) == lengths[k]
            pieces.point(table, k, shape, t[k], at)
            assert np.array_equal(at, out[k, 0])


def test_the_sum_of_many_steps_is_that_of_long_numbers():
    steps = np.random.default_rng(5).uniform(0.0, 1.0, 100_000) ** 4
    found, wanted = tables.compensated_sums(steps), math.fsum(steps)
    assert found[0] == 0.0 and found[-1] == wanted and found[500] == math.fsum(steps[:500])
    assert np.all(np.diff(found) >= 0.0)


def test_too_many_pieces_are_refused(monkeypatch):
    curve = butterfly()
    monkeypatch.setattr(tables, "MAX_ROWS", 200)
    with pytest.raises(CurveError) as caught:
        curve.length  # noqa: B018
    assert str(caught.value) == "curve 0 would need more than 200 pieces; simplify it"

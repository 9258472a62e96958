"""L. Piegl, W. Tiller, The NURBS Book, 2nd ed., Springer 1997, doi 10.1007/978-3-642-59223-2: its worked examples."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import splinefeed as sf

pytestmark = pytest.mark.nojit

#: Knots of examples 2.1 to 2.4 (degree 2), and of chapter 4's rational curve.
KNOTS = [0, 0, 0, 1, 2, 3, 4, 4, 5, 5, 5]
RATIONAL_KNOTS = [0, 0, 0, 1, 2, 3, 3, 3]


def basis(degree: int, knots: list[float], u: float, order: int = 0, side: str = "right") -> np.ndarray:
    """The values (order + 1, n) of all basis functions: curves of one axis with one control point at 1, others at 0."""
    units = np.eye(len(knots) - degree - 1)
    columns = [sf.NurbsCurve(degree, knots, unit[:, None]).derivatives(u, order, side=side) for unit in units]
    return np.concatenate(columns, axis=1)


def test_example_2_3_basis_functions_at_five_halves():
    """N_{2,2}, N_{3,2}, N_{4,2} at u = 5/2 are 1/8, 6/8 and 1/8, and all others vanish."""
    values = basis(2, KNOTS, 2.5)[0]
    assert values == pytest.approx([0, 0, 1 / 8, 6 / 8, 1 / 8, 0, 0, 0], abs=1e-16)


def test_example_2_4_their_derivatives():
    """N' is -1/2, 0, 1/2 and N'' is 1, -2, 1 at u = 5/2."""
    _, first, second = basis(2, KNOTS, 2.5, 2)
    assert first[2:5] == pytest.approx([-0.5, 0.0, 0.5], abs=1e-15)
    assert second[2:5] == pytest.approx([1.0, -2.0, 1.0], abs=1e-15)


def test_property_2_4_basis_functions_sum_to_one():
    for u in np.linspace(0.0, 5.0, 37):
        values = basis(2, KNOTS, float(u))[0]
        assert np.all(values >= -1e-16)
        assert values.sum() == pytest.approx(1.0, abs=4e-16)


def test_the_double_knot_of_its_basis_breaks_the_slope_there_and_nowhere_else():
    for knot in (1.0, 2.0, 3.0):
        left, right = (basis(2, KNOTS, knot, 1, side)[1] for side in ("left", "right"))
        assert left == pytest.approx(right, abs=1e-14)
    left, right = (basis(2, KNOTS, 4.0, 1, side)[1] for side in ("left", "right"))
    assert (left[5], right[5]) == pytest.approx((2.0, -2.0))


def test_example_4_1_a_point_of_a_rational_curve():
    """C(1) = (7/5, 6/5)."""
    curve = sf.NurbsCurve(2, RATIONAL_KNOTS, [[0, 0], [1, 1], [3, 2], [4, 1], [5, -1]], [1, 4, 1, 1, 1])
    assert curve(1.0) == pytest.approx([1.4, 1.2], abs=4e-16)


def test_equations_4_9_and_4_10_the_slopes_at_the_ends():
    """C'(0) = (p / u_{p+1}) (w_1 / w_0) (P_1 - P_0), and the same at the other end."""
    curve = sf.NurbsCurve(2, RATIONAL_KNOTS, [[0, 0], [1, 1], [3, 2], [4, 1], [5, -1]], [1, 4, 1, 1, 1])
    assert curve.derivatives(0.0)[1] == pytest.approx([8.0, 8.0])
    assert curve.derivatives(3.0)[1] == pytest.approx([2.0, -4.0])


def test_example_4_2_the_quarter_circle_and_its_derivatives():
    """x = (1 - u^2) / (1 + u^2), y = 2 u / (1 + u^2): C' is (0, 2) and (-1, 0), C'' is (-4, 0) and (1, -1)."""
    curve = sf.NurbsCurve.bezier([[1, 0], [1, 1], [0, 1]], [1, 1, 2])
    start, end = curve.derivatives(0.0, 2), curve.derivatives(1.0, 2)
    assert start[1:] == pytest.approx(np.array([[0, 2], [-4, 0]]), abs=1e-15)
    assert end[1:] == pytest.approx(np.array([[-1, 0], [1, -1]]), abs=1e-15)
    for u in (0.1, 0.5, 0.9):
        square = float(Fraction(u) ** 2)
        assert curve(u) == pytest.approx([(1 - square) / (1 + square), 2 * u / (1 + square)], abs=2e-16)
    assert curve.length == pytest.approx(np.pi / 2, rel=1e-14)


def test_example_5_1_knot_insertion_keeps_the_curve():
    """Cubic, u = 5/2 into the third span: Q_i = a_i P_i + (1 - a_i) P_{i-1} with a_3 = 5/6, a_4 = 1/2, a_5 = 1/6."""
    points = np.array([[0, 0], [1, 2], [2, -1], [4, 3], [5, 0], [7, 1], [8, -2], [9, 0]], dtype=float)
    curve = sf.NurbsCurve(3, [0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5, 5], points)
    refined = curve.with_knots(2.5)
    assert list(refined.knots) == [0, 0, 0, 0, 1, 2, 2.5, 3, 4, 5, 5, 5, 5]
    expected = [share * points[i] + (1 - share) * points[i - 1] for i, share in ((3, 5 / 6), (4, 1 / 2), (5, 1 / 6))]
    assert refined.control_points[3:6] == pytest.approx(np.array(expected), abs=1e-15)
    assert refined.control_points[:3] == pytest.approx(points[:3], abs=0)
    assert refined.control_points[6:] == pytest.approx(points[5:], abs=0)
    u = np.linspace(0.0, 5.0, 101)
    assert refined(u) == pytest.approx(curve(u), abs=2e-15)


def test_section_7_5_the_circle_of_nine_points_is_round():
    """Four rational quadratic arcs, weights 1 and sqrt(1/2), double knots at the quarters."""
    half = np.sqrt(0.5)
    square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    knots = [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1]
    circle = sf.NurbsCurve(2, knots, square, [1, half, 1, half, 1, half, 1, half, 1])
    u = np.linspace(0.0, 1.0, 401)
    assert np.hypot(*circle(u).T) == pytest.approx(np.ones(401), abs=4e-16)
    assert circle.curvature(u) == pytest.approx(np.ones(401), abs=1e-13)
    assert circle.length == pytest.approx(2 * np.pi, rel=1e-14)

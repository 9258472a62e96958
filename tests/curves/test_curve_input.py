"""What NurbsCurve refuses, with the exact words, and numbers at the edge of what a float can hold."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError, SplinefeedError
from splinefeed.paths.path import Path

pytestmark = pytest.mark.nojit

KNOTS = [0, 0, 0, 1, 1, 1]
POINTS = [[0, 0], [1, 2], [2, 0]]
HUGE = "values up to 1e+30 are possible"

REFUSED = {
    "too few knots": (2, [0, 0, 0, 1, 1], POINTS, None)
    + ("5 knots for 3 control points of degree 2; exactly 6 (points + degree + 1) expected",),
    "too many knots": (2, [0, 0, 0, 0.5, 1, 1, 1], POINTS, None)
    + ("7 knots for 3 control points of degree 2; exactly 6 (points + degree + 1) expected",),
    "no knots": (2, [], POINTS, None)
    + ("0 knots for 3 control points of degree 2; exactly 6 (points + degree + 1) expected",),
    "decreasing knots": (1, [0, 0, 0.6, 0.5, 1, 1], [[0], [1], [2], [3]], None)
    + ("knots decrease from knots[2] = 0.6 to knots[3] = 0.5",),
    "empty domain": (2, [0, 1, 1, 1, 1, 2], POINTS, None) + ("the domain knots[2] to knots[3] is empty: both are 1",),
    "torn apart": (2, [0, 0, 0, 1, 1, 1, 2, 2, 2], [[k, k] for k in range(6)], None)
    + ("inner knot 1 appears 3 times; at most 2 (the degree) are possible",),
    "knots too close": (1, [0, 0, 1, 1 + 1e-15, 2, 2], [[0], [1], [2], [3]], None)
    + ("knots[2] and knots[3] differ by 1.11022e-15 only; make them equal or move them apart",),
    "knot not a number": (2, [0, 0, np.nan, 1, 1, 1], POINTS, None) + ("knots[2] is nan; every value must be finite",),
    "knot infinite": (2, [0, 0, 0, 1, 1, np.inf], POINTS, None) + ("knots[5] is inf; every value must be finite",),
    "knot huge": (2, [0, 0, 0, 1, 1, 1e200], POINTS, None) + (f"knots[5] is 1e+200; {HUGE}",),
    "knots of two dimensions": (2, [[0, 0, 0, 1, 1, 1]], POINTS, None)
    + ("knots: expected 1 dimension(s), got shape (1, 6)",),
    "zero weight": (2, KNOTS, POINTS, [1, 0, 1]) + ("weights[1] is 0; weights must be greater than 0",),
    "negative weight": (2, KNOTS, POINTS, [1, 1, -2]) + ("weights[2] is -2; weights must be greater than 0",),
    "weight not a number": (2, KNOTS, POINTS, [1, np.nan, 1]) + ("weights[1] is nan; every value must be finite",),
    "weight huge": (2, KNOTS, POINTS, [1, 1e200, 1]) + (f"weights[1] is 1e+200; {HUGE}",),
    "weights tiny": (2, KNOTS, POINTS, [1e-200, 2e-200, 1e-200]) + ("weights[0] is 1e-200; at least 1e-30 is needed",),
    "weights too far apart": (2, KNOTS, POINTS, [1e-4, 1e3, 1])
    + ("weights[0] = 0.0001 and weights[1] = 1000 differ by more than 1e+06 times; ",)
    + ("the curve would lose the digits of its points",),
    "too few weights": (2, KNOTS, POINTS, [1, 1]) + ("2 weights for 3 control points; expected one each",),
    "point not a number": (2, KNOTS, [[0, 0], [1, np.nan], [2, 0]], None)
    + ("control_points[1, 1] is nan; every value must be finite",),
    "point infinite": (2, KNOTS, [[0, 0], [1, 2], [-np.inf, 0]], None)
    + ("control_points[2, 0] is -inf; every value must be finite",),
    "point huge": (2, KNOTS, [[0, 0], [1e200, 2], [2, 0]], None) + (f"control_points[1, 0] is 1e+200; {HUGE}",),
    "tiny curve": (2, KNOTS, [[0, 0], [1e-200, 2e-200], [2e-200, 0]], None)
    + ("all 3 control points lie within 2e-200 mm: the curve is too small",),
    "single point": (2, KNOTS, [[0, 0]], None) + ("1 control point(s) for degree 2; expected at least 3",),
    "too few points": (2, [0, 0, 0, 1, 1], [[0, 0], [1, 1]], None)
    + ("2 control point(s) for degree 2; expected at least 3",),
    "no length": (2, KNOTS, [[3, 4]] * 3, None) + ("all 3 control points are the same: the curve has no length",),
    "no points": (2, KNOTS, [], None) + ("control_points: expected 2 dimension(s), got shape (0,)",),
    "points of no axes": (2, KNOTS, [[], [], []], None) + ("control_points have 0 axes; 1 to 16 are possible",),
    "too many axes": (2, KNOTS, np.ones((3, 17)), None) + ("control_points have 17 axes; 1 to 16 are possible",),
    "points of one dimension": (2, KNOTS, [0, 1, 2], None)
    + ("control_points: expected 2 dimension(s), got shape (3,)",),
}


@pytest.mark.parametrize("case", REFUSED.values(), ids=REFUSED)
def test_refused_with_these_words(case):
    degree, knots, points, weights, *words = case
    with pytest.raises(CurveError) as caught:
        NurbsCurve(degree, knots, points, weights)
    assert str(caught.value) == "".join(words)


@pytest.mark.parametrize("degree", [0, -1, 13, 2.5, True, np.True_, "2", None, np.nan, np.inf, [2], 2 + 0j])
def test_degrees_that_are_none(degree):
    with pytest.raises(CurveError) as caught:
        NurbsCurve(degree, KNOTS, POINTS)
    assert str(caught.value) == f"degree is {degree!r}; expected a whole number from 1 to 12"


@pytest.mark.parametrize("degree", [2, 2.0, np.int32(2), np.float64(2.0)])
def test_degrees_that_are_two(degree):
    curve = NurbsCurve(degree, KNOTS, POINTS)
    assert curve.degree == 2 and type(curve.degree) is int


@pytest.mark.parametrize(
    ("knots", "points", "weights", "begins"),
    [
        ("knots", POINTS, None, "knots: expected numbers in 1 dimension(s), got str ("),
        (KNOTS, "points", None, "control_points: expected numbers in 2 dimension(s), got str ("),
        (KNOTS, POINTS, "weights", "weights: expected numbers in 1 dimension(s), got str ("),
        (KNOTS, [[0, 0], [1], [2, 0]], None, "control_points: expected numbers in 2 dimension(s), got list ("),
        ([0, 0, [0], 1, 1, 1], POINTS, None, "knots: expected numbers in 1 dimension(s), got list ("),
        (KNOTS, [[0, "a"], [1, 1], [2, 0]], None, "control_points: expected numbers in 2 dimension(s), got list ("),
        (None, POINTS, None, "knots: expected 1 dimension(s), got shape ()"),
        (KNOTS, {}, None, "control_points: expected numbers in 2 dimension(s), got dict ("),
        (KNOTS, [[0, 0], [1j, 1], [2, 0]], None, "control_points: expected numbers in 2 dimension(s), got list ("),
    ],
)
def test_things_that_are_no_numbers(knots, points, weights, begins):
    with pytest.raises(CurveError) as caught:
        NurbsCurve(2, knots, points, weights)
    assert str(caught.value).startswith(begins)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([], "control_points: expected 2 dimension(s), got shape (0,)"),
        ([[1, 2]], "1 control point(s) for a Bezier curve; expected at least 2"),
        (5, "control_points: expected 2 dimension(s), got shape ()"),
        ([[1, 2]] * 14, "degree is 13; expected a whole number from 1 to 12"),
    ],
)
def test_bezier_refuses(points, said):
    with pytest.raises(CurveError) as caught:
        NurbsCurve.bezier(points)
    assert str(caught.value) == said


def test_bezier_refuses_ragged_points():
    with pytest.raises(CurveError, match=r"control_points: expected numbers in 2 dimension\(s\), got list"):
        NurbsCurve.bezier([[0, 0], [1]])


def test_every_refusal_is_ours():
    assert issubclass(CurveError, InputError) and issubclass(InputError, (SplinefeedError, ValueError))


@pytest.mark.parametrize("coordinate", [1e29, 1e200, 1e308, -1e200])
@pytest.mark.parametrize("other", [0.0, 1.0, 1e-200, 1e29])
def test_huge_coordinates_give_a_result_or_our_error(coordinate, other):
    _use_everything([[0, 0], [coordinate, other], [other, 1]], [0, 0, 0, 1, 1, 1])


@pytest.mark.parametrize("size", [1e-29, 1e-100, 1e-200, 5e-324])
@pytest.mark.parametrize("place", [0.0, 1.0, 1e6])
def test_tiny_curves_give_a_result_or_our_error(size, place):
    _use_everything(place + size * np.array([[0, 0], [1, 2], [2, 0]]), [0, 0, 0, 1, 1, 1])


@pytest.mark.parametrize("width", [1e-310, 1e-200, 1e-29, 1e-12, 1e12, 1e29, 1e200, 1.7e308])
@pytest.mark.parametrize("start", [0.0, -1.0, 1e6])
def test_huge_and_tiny_domains_give_a_result_or_our_error(width, start):
    _use_everything(POINTS, [start] * 3 + [start + width] * 3)
    _use_everything([*POINTS, [3, 1]], [start] * 3 + [start + 0.5 * width] + [start + width] * 3)


def _use_everything(points, knots):
    """Call all that a curve can do: only finite results, or an error of ours; no warning, no hang."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            curve = NurbsCurve(2, knots, points)
            u = np.linspace(*curve.domain, 5)
            results = [
                curve(u),
                curve.tangent(u),
                curve.size,
                curve.length,
                curve.parameter_at(curve.arc_length(u)),
                *curve.bounding_box(),
                *curve.nearest(curve(u)),
                curve.elevated()(u),
                curve.reversed()(u),
                curve.split(u[2])[1](u[3]),
                curve.transformed(0.5)(u),
                Path([curve, *curve.reversed().split(u[2])]).length,
            ]
            repr(curve), curve.closed, curve.curvature(u), curve.derivatives(u, 3)
            path = Path([curve])
            repr(path), path.corners, path.minimum_radius()
        except InputError:
            return
    assert all(np.all(np.isfinite(result)) for result in results)

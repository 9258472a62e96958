"""The built-in shapes against the formulas they come from, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad
from scipy.special import ellipe

from splinefeed.errors import CurveError, InputError
from splinefeed.paths import shapes

U = np.linspace(0.0, 1.0, 2001)
#: Abbott and von Doenhoff's thickness polynomial in tau, with the coefficient that closes the edge.
TAU = Polynomial([0.0, 0.2969, -0.1260, 0.0, -0.3516, 0.0, 0.2843, 0.0, -0.1036])


def radius_of(points):
    return np.linalg.norm(points, axis=-1)


# --- lines and conics -------------------------------------------------------------------------------------------------


def test_circle_is_exact_closed_and_runs_counterclockwise():
    path = shapes.circle(7.0, center=(3.0, -2.0))
    curve = path.curves[0]
    np.testing.assert_allclose(radius_of(curve(U) - [3.0, -2.0]), 7.0, rtol=1e-14)
    assert path.length == pytest.approx(14.0 * math.pi, rel=1e-13)
    np.testing.assert_allclose(curve.curvature(U), 1.0 / 7.0, rtol=1e-12)
    np.testing.assert_allclose(curve(0.125), [3.0 + 7.0 * math.sqrt(0.5), -2.0 + 7.0 * math.sqrt(0.5)], rtol=1e-14)
    np.testing.assert_array_equal(curve.control_points[0], curve.control_points[-1])
    assert path.closed
    assert not len(path.corners)
    assert path.name == "circle"


def test_ellipse_is_exact_and_has_the_length_of_the_elliptic_integral():
    a, b, angle = 20.0, 6.0, 0.4
    path = shapes.ellipse(a, b, angle, center=(5.0, 1.0))
    points = path.curves[0](U) - [5.0, 1.0]
    along = points @ [math.cos(angle), math.sin(angle)]
    across = points @ [-math.sin(angle), math.cos(angle)]
    np.testing.assert_allclose((along / a) ** 2 + (across / b) ** 2, 1.0, rtol=1e-14)
    assert path.length == pytest.approx(4.0 * a * ellipe(1.0 - (b / a) ** 2), rel=1e-12)
    assert path.minimum_radius() == pytest.approx(b * b / a, rel=1e-12)
    assert not len(path.corners)


@pytest.mark.parametrize("axes", range(1, 7))
def test_line_in_any_number_of_axes(axes):
    start, end = np.arange(axes) + 1.0, np.arange(axes) ** 2 + 3.0
    path = shapes.line(start, end)
    np.testing.assert_allclose(path.curves[0](0.25), 0.75 * start + 0.25 * end, rtol=1e-14)
    assert path.axes == ("x", "y", "z", "a", "b", "c")[:axes]
    assert float(path.tip_length(path.length)) == pytest.approx(np.linalg.norm((end - start)[:3]))


def test_figure_eight_is_the_lemniscate_of_gerono():
    path = shapes.figure_eight(40.0, 10.0)
    x, y = path.curves[0](U).T
    # with x = 20 cos t and y = 10 sin t cos t: (y/10)^2 = (x/20)^2 (1 - (x/20)^2)
    np.testing.assert_allclose((y / 10.0) ** 2, (x / 20.0) ** 2 * (1.0 - (x / 20.0) ** 2), atol=1e-15)
    low, high = path.bounding_box()
    np.testing.assert_allclose([low, high], [[-20.0, -5.0], [20.0, 5.0]], rtol=1e-12)
    length = 4.0 * quad(lambda t: math.hypot(20.0 * math.sin(t), 10.0 * math.cos(2.0 * t)), 0.0, math.pi / 2.0,
                        epsabs=1e-12, epsrel=1e-13)[0]  # fmt: skip
    assert path.length == pytest.approx(length, rel=1e-12)


def test_figure_eight_crosses_itself_in_the_middle_and_is_smooth():
    path = shapes.figure_eight(40.0, center=(1.0, 2.0))
    curve = path.curves[0]
    np.testing.assert_allclose(curve(np.array([0.25, 0.75])), [[1.0, 2.0], [1.0, 2.0]], atol=1e-14)
    angle = np.degrees(np.arctan2(*np.flip(curve.derivatives(np.array([0.25, 0.75]), 1)[:, 1], axis=1).T))
    np.testing.assert_allclose(angle, [-135.0, -45.0], atol=1e-10)
    assert path.closed
    assert not len(path.corners)
    # C1 by its parameter at the joints, and over the seam, where it ends as it begins
    joints = np.array([0.25, 0.5, 0.75])
    np.testing.assert_allclose(
        curve.derivatives(joints, 1, side="left")[:, 1], curve.derivatives(joints, 1)[:, 1], rtol=1e-13, atol=1e-12
    )
    np.testing.assert_allclose(curve.derivatives(0.0, 1)[1], curve.derivatives(1.0, 1)[1], rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(curve.curvature(0.0), curve.curvature(1.0), rtol=1e-11)


# --- airfoils ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("code", "thickness"), [("0025", 0.25), ("0012", 0.12), ("0001", 0.01), ("0099", 0.99)])
def test_symmetric_section_is_the_polynomial_exactly(code, thickness):
    chord = 250.0
    path = shapes.naca(code, chord=chord)
    curve = path.curves[0]
    assert (curve.degree, len(curve.breaks) - 1, curve.rational) == (8, 2, False)
    assert np.count_nonzero(curve.knots == 0.5) == 7
    x, y = curve(U).T
    tau = np.abs(2.0 * U - 1.0)
    np.testing.assert_allclose(x, chord * tau**2, atol=1e-13 * chord)
    np.testing.assert_allclose(y, np.sign(0.5 - U) * 5.0 * thickness * chord * TAU(tau), atol=1e-13 * chord)
    np.testing.assert_array_equal(curve.control_points[[0, -1]], [[chord, 0.0], [chord, 0.0]])
    assert path.name == f"naca{code}"
    assert path.findings == ()


@pytest.mark.parametrize("thickness", [9, 12, 25])
def test_nose_is_continuous_in_curvature_with_the_radius_of_the_book(thickness):
    path = shapes.naca(f"00{thickness:02d}", chord=80.0)
    curve = path.curves[0]
    assert not len(path.corners)
    expected = 1.0 / (0.5 * (5.0 * 0.2969) ** 2 * (thickness / 100.0) ** 2 * 80.0)
    assert 1.0 / expected == pytest.approx(1.1019 * (thickness / 100.0) ** 2 * 80.0, rel=5e-4)  # NACA TR 460
    for side in ("left", "right"):
        there = curve.derivatives(0.5, 3, side=side)
        kappa = (there[1, 0] * there[2, 1] - there[1, 1] * there[2, 0]) / np.linalg.norm(there[1]) ** 3
        assert kappa == pytest.approx(expected, rel=1e-11)
        np.testing.assert_allclose(there[1] / np.linalg.norm(there[1]), [0.0, -1.0], atol=1e-13)


def test_perimeter_is_met_to_the_last_digits():
    path = shapes.naca("0025", perimeter=33.0)
    assert path.length == pytest.approx(33.0, rel=1e-13)
    curve = path.curves[0]
    chord = curve(0.0)[0]
    # independently of the arc-length table: with x = tau^2 the speed is smooth
    slope = TAU.deriv()
    half = quad(lambda tau: math.hypot(2.0 * tau, 1.25 * slope(tau)), 0.0, 1.0, epsabs=1e-13, epsrel=1e-12)[0]
    assert chord == pytest.approx(33.0 / (2.0 * half), rel=1e-12)
    assert 33.0 / chord == pytest.approx(2.1295, abs=5e-5)  # the figures of the paper's digest
    assert chord == pytest.approx(15.4966, abs=5e-5)


def test_chord_is_100_unless_said():
    assert shapes.naca("0025").curves[0](0.0)[0] == 100.0
    np.testing.assert_allclose(shapes.naca().curves[0](0.3), shapes.naca("0025", chord=100.0).curves[0](0.3))


@pytest.mark.parametrize(("degree", "tolerance"), [(1, 1e-2), (2, 1e-4), (3, 1e-6), (5, 1e-6), (7, 1e-8)])
def test_fitted_section_stays_within_the_tolerance(degree, tolerance):
    path = shapes.naca("0025", chord=100.0, degree=degree, tolerance=tolerance)
    curve = path.curves[0]
    assert curve.degree == degree
    assert np.max(distance_to_section(curve(np.linspace(0.0, 1.0, 20001)), 0.25, 100.0)) <= tolerance
    if degree >= 3:
        assert not len(path.corners)
        assert path.minimum_radius() == pytest.approx(6.6344, rel=2e-4)


def distance_to_section(points, thickness, chord):
    """Distances from the true section along its normal, by Newton's method on tau from the point's own x."""
    tau = np.sqrt(np.clip(points[:, 0] / chord, 1e-12, None))
    half = 5.0 * thickness * chord * TAU
    side = np.where(points[:, 1] >= 0.0, 1.0, -1.0)
    y = points[:, 1] * side
    for _ in range(8):
        off = np.stack([chord * tau**2 - points[:, 0], half(tau) - y])
        slope = np.stack([2.0 * chord * tau, half.deriv()(tau)])
        bend = np.stack([np.full(len(tau), 2.0 * chord), half.deriv(2)(tau)])
        tau = np.clip(
            tau - np.sum(off * slope, axis=0) / (np.sum(slope**2, axis=0) + np.sum(off * bend, axis=0)), 0.0, 1.0
        )
    return np.hypot(chord * tau**2 - points[:, 0], half(tau) - y)


def test_fit_of_degree_8_or_more_is_the_exact_section():
    exact = shapes.naca("0012").curves[0]
    for degree in (8, 10, 12):
        path = shapes.naca("0012", degree=degree)
        assert path.curves[0].degree == degree
        assert path.findings == ()
        np.testing.assert_allclose(path.curves[0](U), exact(U), atol=1e-12)


def test_fitted_section_meets_the_perimeter_too():
    path = shapes.naca("2412", perimeter=33.0, degree=3, tolerance=1e-4)
    assert path.length == pytest.approx(33.0, rel=1e-13)
    scale = path.curves[0](0.0)[0]
    whole = shapes.naca("2412", chord=scale, tolerance=1e-6).curves[0]
    distances = whole.nearest(path.curves[0](U))[1]
    assert np.max(distances) <= 1e-4


def cambered(code, x):
    """Upper and lower points (n, 2) at stations x of the mean line: Abbott and von Doenhoff, eq. 6.1 to 6.4."""
    m, p, t = int(code[0]) / 100.0, int(code[1]) / 10.0, int(code[2:]) / 100.0
    front = x < p
    mean = np.where(front, m / p**2 * (2 * p * x - x**2), m / (1 - p) ** 2 * (1 - 2 * p + 2 * p * x - x**2))
    slope = np.where(front, 2 * m / p**2 * (p - x), 2 * m / (1 - p) ** 2 * (p - x))
    theta, half = np.arctan(slope), 5.0 * t * TAU(np.sqrt(x))
    upper = np.stack([x - half * np.sin(theta), mean + half * np.cos(theta)], axis=1)
    lower = np.stack([x + half * np.sin(theta), mean - half * np.cos(theta)], axis=1)
    return upper, lower


@pytest.mark.parametrize("code", ["2412", "4415", "6409"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_cambered_section_passes_the_points_of_the_book(code, tolerance):
    path = shapes.naca(code, chord=100.0, tolerance=tolerance)
    x = np.concatenate([np.linspace(0.0, 0.01, 50), np.linspace(0.01, 1.0, 200), [int(code[1]) / 10.0]])
    for side in cambered(code, x):
        assert np.max(path.curves[0].nearest(100.0 * side)[1]) <= tolerance
    assert path.closed
    assert not len(path.corners)
    assert path.findings[0].startswith("fitted by degree 5 with ")
    assert path.findings[1].startswith("by its definition the section has a kink of ")


# --- butterfly and helix ----------------------------------------------------------------------------------------------


def test_butterfly_has_the_length_and_radius_of_its_source():
    path = shapes.butterfly()
    assert path.length == pytest.approx(382.8595583013, abs=1e-9)
    assert path.minimum_radius() == pytest.approx(0.0231207, abs=1e-7)
    curve = path.curves[0]
    assert (curve.degree, len(curve.control_points), curve.rational) == (3, 51, True)
    speed = np.linalg.norm(curve.derivatives(np.linspace(0.0, 1.0, 100001), 1)[:, 1], axis=1)
    assert (speed.min(), speed.max()) == (pytest.approx(40.05, abs=0.01), pytest.approx(802.45, abs=0.01))
    assert not path.closed
    assert path.name == "butterfly"


def test_butterfly_scales():
    assert shapes.butterfly(2.0).length == pytest.approx(2.0 * 382.8595583013, abs=2e-9)


@pytest.mark.parametrize("degree", [3, 5, 8])
def test_helix_stays_within_the_tolerance_and_rises_in_step(degree):
    path = shapes.helix(10.0, -4.0, 2.25, tolerance=1e-7, degree=degree)
    x, y, z = path.curves[0](np.linspace(0.0, 1.0, 20001)).T
    angle = -2.0 * math.pi * z / 4.0
    assert np.max(np.hypot(x - 10.0 * np.cos(angle), y - 10.0 * np.sin(angle))) <= 1e-7
    np.testing.assert_allclose(z, np.linspace(0.0, -9.0, 20001), atol=1e-12)
    assert path.length == pytest.approx(2.25 * math.hypot(20.0 * math.pi, 4.0), rel=1e-8)
    assert path.axes == ("x", "y", "z")
    # kappa of a helix: r / (r^2 + (pitch / 2 pi)^2)
    expected = 10.0 / (100.0 + (4.0 / (2.0 * math.pi)) ** 2)
    np.testing.assert_allclose(path.curves[0].curvature(U), expected, rtol=1e-2 if degree == 3 else 1e-3)


# --- as text ----------------------------------------------------------------------------------------------------------

SAME = {
    "naca:0025?perimeter=33": lambda: shapes.naca("0025", perimeter=33.0),
    "naca:2412?chord=2in&degree=3&tolerance=10um": lambda: shapes.naca("2412", chord=50.8, degree=3, tolerance=0.01),
    "  NACA:0012 ": lambda: shapes.naca("0012"),
    "butterfly": shapes.butterfly,
    "butterfly?scale=2": lambda: shapes.butterfly(2.0),
    "circle?radius=10": lambda: shapes.circle(10.0),
    "circle?radius=1in&center=1in,2mm": lambda: shapes.circle(25.4, (25.4, 2.0)),
    "ellipse?a=20&b=10&angle=30deg": lambda: shapes.ellipse(20.0, 10.0, math.radians(30.0)),
    "figure-eight": shapes.figure_eight,
    "figure_eight?width=40&height=30": lambda: shapes.figure_eight(40.0, 30.0),
    "helix?radius=10&pitch=5&turns=3": lambda: shapes.helix(10.0, 5.0, 3.0),
    "line": shapes.line,
    "line?start=1,2,3,90deg&end=4,5,6,0": lambda: shapes.line((1.0, 2.0, 3.0, math.pi / 2.0), (4.0, 5.0, 6.0, 0.0)),
    "line?length=5&angle=90deg": lambda: shapes.line((0.0, 0.0), (5.0 * math.cos(math.pi / 2.0), 5.0)),
    "circle?tangential=false": shapes.circle,
}


@pytest.mark.parametrize("text", SAME)
def test_text_makes_the_same_path_as_the_call(text):
    path, expected = shapes.from_text(text), SAME[text]()
    assert path.curves == expected.curves
    assert (path.axes, path.name) == (expected.axes, expected.name)
    assert shapes.is_shape(text)


def test_text_can_ask_for_the_tangential_axis():
    path = shapes.from_text("circle?radius=5&tangential=true")
    assert path.axes == ("x", "y", "theta")
    np.testing.assert_allclose(path.curves[0](1.0)[2] - path.curves[0](0.0)[2], 2.0 * math.pi, rtol=1e-12)


def test_every_shape_is_described_by_an_example_that_works():
    assert shapes.names() == ("naca", "butterfly", "circle", "ellipse", "figure-eight", "helix", "line")
    for name, what, example in shapes.describe():
        assert what
        assert example.startswith(name)
        assert shapes.from_text(example).length > 0.0


@pytest.mark.parametrize("text", ["part.dxf", "naca0024.dat", "", "cirlce", "folder/circle", "circle.json", "naca2412"])
def test_other_texts_name_no_shape(text):
    assert not shapes.is_shape(text)


KNOWN = "known are naca, butterfly, circle, ellipse, figure-eight, helix, line"
REFUSED_TEXTS = {
    "": "shape is ''; expected a text such as 'naca:0025?perimeter=33'",
    "x" * 501: "a shape's text has 501 characters; at most 500 are read",
    "cirlce": f"cirlce: there is no shape 'cirlce'; {KNOWN}",
    "spline": f"spline: there is no shape 'spline'; {KNOWN}",
    "qqq?a=1": f"qqq?a=1: there is no shape 'qqq'; {KNOWN}",
    "naca": "naca: naca needs its code after a colon, as in 'naca:0025?perimeter=33'",
    "naca:?chord=1": "naca:?chord=1: naca needs its code after a colon, as in 'naca:0025?perimeter=33'",
    "circle:3": "circle:3: circle takes nothing after a colon, as in 'circle?radius=10'",
    "circle?radis=3": "circle?radis=3: circle has no option 'radis'; known are radius, center, tangential",
    "circle?": "circle?: circle has no option ''; known are radius, center, tangential",
    "circle?radius": "circle?radius: radius has no value; write radius=...",
    "circle?radius=": "circle?radius=: radius has no value; write radius=...",
    "circle?radius=1&radius=2": "circle?radius=1&radius=2: radius appears twice; leave one of them out",
    "circle?radius=3kg": "circle?radius=3kg: radius: '3kg' is of another kind; "
    "expected a length such as 12.5mm or 0.5in",
    "circle?center=1": "center has 1 coordinates; 2 are needed",
    "circle?tangential=maybe": "circle?tangential=maybe: tangential: 'maybe' is neither true nor false",
    "butterfly?scale=x": "butterfly?scale=x: scale: 'x' is not a number",
    "helix?degree=2.5": "helix?degree=2.5: degree: '2.5' is not a whole number",
    "line?end=1,2,3,4,5,6,7": "line?end=1,2,3,4,5,6,7: end: 7 coordinates; at most 6 are possible",
    "line?end=1,2&length=3": "line: end is given, so that length and angle follow; leave them out",
    "line?start=1,2,3": "line: a line by length and angle lies in the plane; give end= for other axes",
    "helix?tangential=true": "the path has axes x y z; theta follows a path of two linear axes",
}


@pytest.mark.parametrize("text", REFUSED_TEXTS)
def test_refused_texts(text):
    with pytest.raises(InputError) as refusal:
        shapes.from_text(text)
    assert str(refusal.value) == REFUSED_TEXTS[text]


REFUSED = {
    "negative radius": (lambda: shapes.circle(-1.0), "radius is -1 mm; it must be greater than 0"),
    "no number": (lambda: shapes.circle("ten"), "radius is 'ten'; expected a number"),
    "not a number": (lambda: shapes.circle(math.nan), "radius is nan; it must be finite"),
    "huge": (lambda: shapes.circle(1e12), "radius is 1e+12 mm; at most 1e+09 mm is possible"),
    "center of three": (lambda: shapes.circle(1.0, (0, 0, 0)), "center has 3 coordinates; 2 are needed"),
    "center not finite": (lambda: shapes.ellipse(center=(0, math.inf)), "center[1] is inf; every value must be finite"),
    "flat ellipse": (lambda: shapes.ellipse(3.0, 0.0), "b is 0 mm; it must be greater than 0"),
    "angle": (lambda: shapes.ellipse(angle=math.inf), "angle is inf; it must be finite"),
    "point for a line": (lambda: shapes.line((1, 2), (1, 2)), "start and end of the line are the same point: "
                         "it has no length"),
    "line of two kinds": (lambda: shapes.line((1, 2), (1, 2, 3)), "end has 3 coordinates; 2 are needed"),
    "line of no axes": (lambda: shapes.line((), ()), "start has 0 coordinates; 1 to 16 are possible"),
    "line of 17 axes": (lambda: shapes.line([0] * 17, [1] * 17), "start has 17 coordinates; 1 to 16 are possible"),
    "no eight": (lambda: shapes.figure_eight(0.0), "width is 0 mm; it must be greater than 0"),
    "no height": (lambda: shapes.figure_eight(1.0, -1.0), "height is -1 mm; it must be greater than 0"),
    "scale": (lambda: shapes.butterfly(0), "scale is 0; it must be greater than 0"),
    "flat helix": (lambda: shapes.helix(pitch=0), "pitch is 0 mm: that is one circle, repeated; use circle"),
    "turns": (lambda: shapes.helix(turns=2000), "turns is 2000; at most 1000 are possible"),
    "no turns": (lambda: shapes.helix(turns=0), "turns is 0; it must be greater than 0"),
    "helix too coarse": (lambda: shapes.helix(1.0, 1.0, 1.0, tolerance=9.0), "tolerance is 9 mm, but the whole part "
                         "measures 3 mm; is the unit right?"),
    "three digits": (lambda: shapes.naca("025"), "NACA code is '025'; expected four digits such as '0025' or '2412'"),
    "number": (lambda: shapes.naca(2412), "NACA code is 2412; expected four digits such as '0025' or '2412'"),
    "other digits": (lambda: shapes.naca("٠٠٢٥"), "NACA code is '٠٠٢٥'; expected four digits such as '0025' or '2412'"),
    "no thickness": (lambda: shapes.naca("2400"), "NACA code '2400' has no thickness; its last two digits must be "
                     "01 or more"),
    "no place": (lambda: shapes.naca("2012"), "NACA code '2012' has camber but no position of it; its second digit "
                 "must be 1 or more"),
    "both sizes": (lambda: shapes.naca("0025", chord=1, perimeter=2), "chord and perimeter are both given; each "
                   "follows from the other"),
    "chord": (lambda: shapes.naca("0025", chord=0), "chord is 0 mm; it must be greater than 0"),
    "perimeter": (lambda: shapes.naca("0025", perimeter=-1), "perimeter is -1 mm; it must be greater than 0"),
    "tolerance": (lambda: shapes.naca("0025", tolerance=0), "tolerance is 0 mm; it must be greater than 0"),
    "degree": (lambda: shapes.naca("0025", degree=13), "degree is 13; expected a whole number from 1 to 12"),
    "degree zero": (lambda: shapes.naca("2412", degree=0), "degree is 0; expected a whole number from 1 to 12"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_sizes(case):
    make, message = REFUSED[case]
    with pytest.raises(InputError) as refusal:
        make()
    assert str(refusal.value) == message
    if case == "point for a line":
        assert isinstance(refusal.value, CurveError)


@given(st.text(max_size=60))
def test_any_text_makes_a_path_or_a_clear_error(text):
    for spec in (text, f"circle?{text}", f"naca:{text}"):
        try:
            shapes.from_text(spec)
        except InputError as error:
            assert str(error)
            assert "\n" not in str(error).replace(text, "")


@given(st.floats(1e-3, 1e6), st.floats(1e-3, 1e6), st.floats(-7.0, 7.0))
def test_ellipses_of_any_size_are_exact(a, b, angle):
    curve = shapes.ellipse(a, b, angle).curves[0]
    points = curve(U[::50])
    along = points @ [math.cos(angle), math.sin(angle)]
    across = points @ [-math.sin(angle), math.cos(angle)]
    slack = 1e-14 * (1.0 + max(a, b) / min(a, b))
    np.testing.assert_allclose((along / a) ** 2 + (across / b) ** 2, 1.0, atol=10.0 * slack)

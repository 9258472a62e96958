"""The tangential axis against the direction of the curve, and where it is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import CurveError, InputError
from splinefeed.paths import shapes
from splinefeed.paths.path import Path
from splinefeed.paths.tangent_axis import LEAST_DEGREE, tangential

PATHS = {
    "circle": shapes.circle,
    "thin ellipse": lambda: shapes.ellipse(50.0, 1.0, 0.3),
    "paper's airfoil": lambda: shapes.naca("0025", perimeter=33.0),
    "fitted airfoil": lambda: shapes.naca("2412", degree=3, tolerance=1e-3),
    "butterfly": shapes.butterfly,
    "butterfly backwards": lambda: shapes.butterfly().reversed(),
    "figure-eight": shapes.figure_eight,
    "degree 12": lambda: Path([NurbsCurve.bezier(np.random.default_rng(1).normal(0.0, 10.0, (13, 2)))]),
    "unclamped": lambda: Path([NurbsCurve(3, np.arange(12.0), np.random.default_rng(2).normal(0.0, 10.0, (8, 2)))]),
    "two curves": lambda: Path(shapes.ellipse(20.0, 10.0).curves[0].split(0.3)),
    "C' = 0 at the start": lambda: Path([NurbsCurve.bezier([[0, 0], [0, 0], [1, 1], [3, 0]])]),
    "C' = 0 at the end": lambda: Path([NurbsCurve.bezier([[0, 0], [2, 2], [3, 0], [3, 0]])]),
    "C' = C'' = 0 at the start": lambda: Path([NurbsCurve.bezier([[0, 0], [0, 0], [0, 0], [1, 1], [3, 0]])]),
    "far away": lambda: shapes.figure_eight(20.0, center=(1e6, -1e6)),
}


def true_angles(path, s):
    """Direction of the path (n,) at arc lengths s (n,), by central differences of points, of order 6."""
    h = 2e-4 * path.length
    differences = [(path(s + k * h) - path(s - k * h))[:, :2] for k in (1, 2, 3)]
    chord = 45.0 * differences[0] - 9.0 * differences[1] + differences[2]
    return np.arctan2(chord[:, 1], chord[:, 0])


def wrapped(angle):
    return angle - 2.0 * math.pi * np.round(angle / (2.0 * math.pi))


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_theta_is_the_direction_of_the_tangent(name, tolerance):
    path = PATHS[name]()
    turned = tangential(path, tolerance)
    assert turned.axes == ("x", "y", "theta")
    s = np.random.default_rng(3).uniform(0.0, path.length, 20_000)
    curve, u = path.locate(s)
    there, given_ = turned.evaluate(curve, u, 1), path.evaluate(curve, u, 1)
    angle = np.arctan2(given_[:, 1, 1], given_[:, 1, 0])
    slow = np.linalg.norm(given_[:, 1], axis=1) < 1e-9 * path.size  # there the quotient is rounding
    assert np.max(np.abs(wrapped(there[:, 0, 2] - angle))[~slow]) <= tolerance * 1.01 + 1e-9
    assert turned.findings[-1].startswith("theta follows the tangent within ")


@pytest.mark.parametrize("name", ["circle", "paper's airfoil", "figure-eight"])
def test_theta_against_differences_of_points(name):
    path = PATHS[name]()
    s = np.linspace(0.01, 0.99, 997) * path.length
    theta = tangential(path)(s)[:, 2]
    np.testing.assert_allclose(wrapped(theta - true_angles(path, s)), 0.0, atol=2e-6)


@pytest.mark.parametrize("name", PATHS)
def test_x_and_y_are_the_same_curve(name):
    path = PATHS[name]()
    turned = tangential(path)
    far = float(np.abs(path.curves[0].control_points).max()) / path.size
    assert turned.length == pytest.approx(path.length, rel=1e-12 + 1e-15 * far)
    for before, after in zip(path.joined, turned.curves, strict=True):
        assert before.domain == after.domain
        assert after.degree == max(LEAST_DEGREE, before.degree)
        u = np.linspace(*before.domain, 5001)
        size = max(1.0, float(np.abs(before.control_points).max()))
        np.testing.assert_allclose(after(u)[:, :2], before(u), atol=2e-15 * size * before.degree)
        scale = np.abs(before.derivatives(u, 2)).max(axis=(0, 2))
        for k in (1, 2):
            error = np.abs(after.derivatives(u, 2)[:, k, :2] - before.derivatives(u, 2)[:, k])
            assert np.max(error) <= 1e-9 * scale[k] * (size / before.size)
    assert [round(c.s, 6) for c in turned.corners] == [round(c.s, 6) for c in path.corners]


@pytest.mark.parametrize("name", [n for n in PATHS if "C' =" not in n])
def test_theta_and_its_rate_are_continuous(name):
    path = PATHS[name]()
    turned = tangential(path)
    for curve in turned.curves:
        inner = curve.breaks[1:-1]
        left, right = (curve.derivatives(inner, 1, side=side)[:, :, 2] for side in ("left", "right"))
        np.testing.assert_allclose(left[:, 0], right[:, 0], atol=1e-11)
        # these paths are continuous in curvature, which is theta' by arc length
        np.testing.assert_allclose(left[:, 1], right[:, 1], atol=1e-6 * np.abs(right[:, 1]).max())


TURNS = {"circle": 1.0, "figure-eight": 0.0, "butterfly": -1.0, "butterfly backwards": 1.0, "thin ellipse": 1.0}


@pytest.mark.parametrize("name", TURNS)
def test_theta_runs_on_through_full_turns(name):
    path = PATHS[name]()
    theta = tangential(path)(np.array([0.0, path.length]))[:, 2]
    assert -math.pi - 1e-12 <= theta[0] <= math.pi + 1e-12
    slack = 0.01 if name.startswith("butterfly") else 1e-9  # which is open at the head
    assert theta[1] - theta[0] == pytest.approx(2.0 * math.pi * TURNS[name], abs=slack)


def test_many_turns_are_counted():
    angle = np.linspace(0.0, 40.0 * math.pi, 2001)
    from splinefeed.paths.fitting import fit

    spiral = fit(np.column_stack([(5.0 + angle) * np.cos(angle), (5.0 + angle) * np.sin(angle)]), 1e-3).path()
    theta = tangential(spiral)(np.linspace(0.0, spiral.length, 2001))[:, 2]
    assert np.all(np.diff(theta) > 0.0)
    assert theta[-1] - theta[0] == pytest.approx(40.0 * math.pi, abs=0.5)


def test_straight_line_keeps_its_degree():
    path = tangential(shapes.line((0.0, 0.0), (3.0, -3.0)))
    assert path.curves[0].degree == 1
    np.testing.assert_allclose(path.curves[0].control_points[:, 2], -math.pi / 4.0)
    assert path.length == pytest.approx(math.hypot(3.0, 3.0))


def test_name_and_findings_go_along():
    path = tangential(shapes.naca("0012", degree=3))
    assert path.name == "naca0012-tangential"
    assert path.findings[0].startswith("fitted by degree 3")


def test_tangent_that_jumps_below_rounding_is_no_corner():
    path = Path([NurbsCurve.bezier([[0, 0], [1, 0]]), NurbsCurve.bezier([[1, 0], [2, 5e-7]])])
    theta = tangential(path)(np.array([0.5, 1.5]))[:, 2]
    # both curves come half of the jump towards each other, as gaps do
    np.testing.assert_allclose(theta, [1.25e-7, 3.75e-7], atol=1e-12)
    bent = NurbsCurve(2, [0, 0, 0, 1, 1, 2, 2, 2], [[0, 0], [1, 0], [2, 0], [3, 5e-7], [4, 3]])
    assert tangential(Path([bent])).curves[0].degree == LEAST_DEGREE


CORNER = "round the corner, or make two paths that end and begin there"
REFUSED = {
    "three axes": (
        shapes.helix,
        1e-6,
        CurveError,
        "the path has axes x y z; theta follows a path of two linear axes",
    ),
    "twice": (
        lambda: tangential(shapes.circle()),
        1e-6,
        CurveError,
        "the path has axes x y theta; theta follows a path of two linear axes",
    ),
    "corner between curves": (
        lambda: Path([NurbsCurve.bezier([[0, 0], [2, 0]]), NurbsCurve.bezier([[2, 0], [2, 1]])]),
        1e-6,
        CurveError,
        f"the path turns by 90 deg on the spot at s = 2 mm (curve 0, u = 1), where theta would jump; {CORNER}",
    ),
    "corner within a curve": (
        lambda: Path([NurbsCurve(1, [0, 0, 1, 2, 2], [[0, 0], [1, 0], [2, 1]])]),
        1e-6,
        CurveError,
        f"the path turns by 45 deg on the spot at s = 1 mm (curve 0, u = 1), where theta would jump; {CORNER}",
    ),
    "cusp": (
        lambda: Path([NurbsCurve.bezier([[0, 0], [1, 1], [0, 1], [1, 0]])]),
        1e-6,
        CurveError,
        "the path turns by 179 deg on the spot at s = 0.914214 mm (curve 0, u = 0.5), where theta would jump; "
        + CORNER,
    ),
    "no tolerance": (
        shapes.circle,
        0.0,
        InputError,
        "tolerance is 0 rad; it must be finite and at least 1e-09 rad",
    ),
    "not a number": (
        shapes.circle,
        math.nan,
        InputError,
        "tolerance is nan rad; it must be finite and at least 1e-09 rad",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case):
    make, tolerance, kind, message = REFUSED[case]
    path = make()
    with pytest.raises(kind) as refusal:
        tangential(path, tolerance)
    assert str(refusal.value) == message


@given(st.integers(2, 8), st.integers(0, 10_000))
def test_random_smooth_curves(degree, seed):
    random = np.random.default_rng(seed)
    count = degree + 1 + int(random.integers(0, 6))
    knots = np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, count - degree + 1), np.ones(degree)])
    points = np.column_stack([np.arange(count) * 3.0, random.uniform(-5.0, 5.0, count)])  # x grows: no cusps
    path = Path([NurbsCurve(degree, knots, points, random.uniform(0.5, 2.0, count))])
    turned = tangential(path)
    u = random.uniform(0.0, 1.0, 500)
    first = path.curves[0].derivatives(u, 1)
    there = turned.curves[0](u)
    np.testing.assert_allclose(there[:, :2], first[:, 0], atol=1e-12)
    assert np.max(np.abs(wrapped(there[:, 2] - np.arctan2(first[:, 1, 1], first[:, 1, 0])))) <= 1.01e-6

"""Arc length against 20 digits, quadrature and formulas; its inverse; and curves at which a table may break."""

from __future__ import annotations

import warnings

import mpmath
import numpy as np
import pytest
from scipy.integrate import IntegrationWarning, quad

from sample_curves import KNOWN, STILL, bernstein, butterfly, ellipse, random_curve, with_cusp
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.packed import Flat
from splinefeed.curves.tables import arc_pieces
from splinefeed.errors import CurveError, InputError
from splinefeed.kernels import layout
from splinefeed.kernels.layout import ARC
from splinefeed.kernels.pieces import arc_length, parameter_in_row
from splinefeed.paths.path import Path

#: Relative to the length.
PROMISE = 1e-13
EPSILON = np.finfo(float).eps
GAUSS = np.polynomial.legendre.leggauss(24)
CURVES = {"butterfly": butterfly(), **KNOWN, **STILL}


def speed_at(curve: NurbsCurve, u) -> np.ndarray:
    return np.linalg.norm(curve.derivatives(u, 1)[..., 1, :], axis=-1)


def places_of_cusps(curve: NurbsCurve) -> np.ndarray:
    """Parameters of the curve's cusps."""
    return np.array([corner.u for corner in Path([curve]).corners if corner.stop])


def graded_lengths(curve: NurbsCurve) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (m,) and arc lengths there (m,) by Gauss' rule on a grid that closes in on knots and slow places."""
    breaks = curve.breaks
    fine = np.unique((breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, 2001)).ravel())
    speed = speed_at(curve, fine.clip(*curve.domain))
    slow = 1 + np.flatnonzero(
        (speed[1:-1] < speed[:-2]) & (speed[1:-1] <= speed[2:]) & (speed[1:-1] < 0.5 * speed.max())
    )
    centres = np.concatenate([breaks, fine[slow], places_of_cusps(curve)])
    steps = (curve.domain[1] - curve.domain[0]) * 0.5 ** np.arange(0.0, 48.0, 0.5)
    grid = np.concatenate([centres, (centres[:, None] + steps).ravel(), (centres[:, None] - steps).ravel()])
    grid = np.unique(grid.clip(*curve.domain))
    half = 0.5 * np.diff(grid)
    inside = (0.5 * (grid[1:] + grid[:-1]))[:, None] + half[:, None] * GAUSS[0]
    return grid, np.concatenate([[0.0], np.cumsum(half * (speed_at(curve, inside.clip(*curve.domain)) @ GAUSS[1]))])


def inversion_error(curve: NurbsCurve) -> float:
    """Greatest |S(u(s)) - s| / L, at even places, close to both ends, and on both sides of every break of the table."""
    length = curve.length
    starts = curve.arc.table[:, layout.START]
    even = np.linspace(0.0, length, 2001)
    edge = length * 10.0 ** np.linspace(-16.0, -1.0, 61)
    s = np.concatenate([even, edge, length - edge, starts, np.nextafter(starts, 0.0), np.nextafter(starts, length)])
    s = s.clip(0.0, length)
    return float(np.abs(curve.arc_length(curve.parameter_at(s)) - s).max() / length)


def rounding_of_parameters(curve: NurbsCurve) -> float:
    """What one unit in the last place of u is worth as an arc length, relative to L, where the curve is fastest."""
    low, high = curve.arc.table[:, layout.LOW], curve.arc.table[:, layout.HIGH]
    u = np.linspace(low, high, 33).clip(low, high)
    return float(np.spacing(np.abs(u).max()) * speed_at(curve, u).max() / curve.length)


@pytest.mark.parametrize("name", ["butterfly", "unequal spans", "ellipse", "far parameters"])
def test_spans_match_20_digits(name):
    curve = CURVES[name]
    breaks = curve.breaks
    for k in np.unique(np.linspace(0, len(breaks) - 2, 3).astype(int)):
        wanted = mpmath_length(curve, k)
        got = curve.arc_length(breaks[k + 1]) - curve.arc_length(breaks[k])
        assert abs(got - wanted) <= PROMISE * wanted + 4.0 * EPSILON * curve.length


def mpmath_length(curve: NurbsCurve, span: int) -> float:
    """Length of one knot span with 20 digits: its Bezier points as polar values, then Gauss' rule."""
    low, high = (mpmath.mpf(float(u)) for u in curve.breaks[span : span + 2])
    p = curve.degree
    first = int(np.searchsorted(curve.knots, curve.breaks[span], side="right")) - 1
    knots = [mpmath.mpf(float(u)) for u in curve.knots]
    weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights
    homogeneous = [
        [mpmath.mpf(float(w)) * mpmath.mpf(float(x)) for x in point] + [mpmath.mpf(float(w))]
        for point, w in zip(curve.control_points, weights, strict=True)
    ]

    def polar(arguments):
        d = [homogeneous[first - p + i] for i in range(p + 1)]
        for r, a in enumerate(arguments, start=1):
            for i in range(p, r - 1, -1):
                left, right = knots[first - p + i], knots[first + i + 1 - r]
                share = (a - left) / (right - left)
                d[i] = [(1 - share) * x + share * y for x, y in zip(d[i - 1], d[i], strict=True)]
        return d[p]

    bezier = [polar([low] * (p - k) + [high] * k) for k in range(p + 1)]

    def speed(x):
        terms = [mpmath.binomial(p, k) * x**k * (1 - x) ** (p - k) for k in range(p + 1)]
        slopes = [mpmath.binomial(p - 1, k) * x**k * (1 - x) ** (p - 1 - k) for k in range(p)]
        value = [mpmath.fsum(t * b[c] for t, b in zip(terms, bezier, strict=True)) for c in range(curve.axes + 1)]
        slope = [
            p * mpmath.fsum(t * (bezier[k + 1][c] - bezier[k][c]) for k, t in enumerate(slopes))
            for c in range(curve.axes + 1)
        ]
        w = value[-1]
        return mpmath.sqrt(sum(((slope[c] - slope[-1] * value[c] / w) / w) ** 2 for c in range(curve.axes)))

    with mpmath.workdps(20):
        whole, error = mpmath.quad(speed, mpmath.linspace(0, 1, 9), method="gauss-legendre", maxdegree=4, error=True)
    assert error <= 1e-13 * whole
    return float(whole)


@pytest.mark.parametrize("name", CURVES)
def test_whole_length_and_every_place_match_graded_quadrature(name):
    curve = CURVES[name]
    u, wanted = graded_lengths(curve)
    got = curve.arc_length(u)
    allowed = PROMISE + (4.0 * rounding_of_parameters(curve) if name == "unequal spans and speeds" else 0.0)
    assert abs(curve.length - wanted[-1]) <= allowed * wanted[-1]
    assert np.abs(got - wanted).max() <= allowed * wanted[-1]


@pytest.mark.parametrize("seed", range(36))
def test_random_curves_match_quad(seed):
    curve = random_curve(seed, axes=3)
    total = 0.0
    for low, high in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", IntegrationWarning
            )  # it may say that rounding stops it: that is near enough
            total += quad(lambda u: float(speed_at(curve, u)), low, high, epsabs=0.0, epsrel=1e-13, limit=500)[0]
    assert abs(curve.length - total) <= (PROMISE + 4.0 * rounding_of_parameters(curve)) * total


@pytest.mark.parametrize("name", CURVES)
def test_inverse_everywhere(name):
    curve = CURVES[name]
    fast = rounding_of_parameters(curve) if name in ("unequal spans and speeds", "far parameters") else 0.0
    assert inversion_error(curve) <= PROMISE + fast


@pytest.mark.parametrize("seed", range(36))
def test_inverse_of_random_curves(seed):
    curve = random_curve(seed)
    assert inversion_error(curve) <= PROMISE + rounding_of_parameters(curve)


@pytest.mark.slow
def test_hundreds_of_curves_and_their_inverse():
    for seed in range(1000, 1200):
        curve = random_curve(seed)
        assert inversion_error(curve) <= PROMISE + rounding_of_parameters(curve), f"seed {seed}"
        sharp = with_cusp(np.random.default_rng(seed).uniform(), degree=2 + seed % 6, axes=1 + seed % 3, seed=seed)
        u, wanted = graded_lengths(sharp)
        assert np.abs(sharp.arc_length(u) - wanted).max() <= 2.0 * PROMISE * wanted[-1], f"cusp {seed}"
        assert inversion_error(sharp) <= PROMISE, f"cusp {seed}"


@pytest.mark.parametrize("gap", [0.3, 1e-2, 4e-3, 2.4e-3, 1e-3, 1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("axes", [1, 2])
def test_a_cusp_between_an_end_and_the_first_node_is_seen(gap, axes):
    # the speed is a straight line through 0 at `gap`: without a look at the very end, nodes behind it see only that
    curve = with_cusp(gap, degree=2, axes=axes)
    slope = np.linalg.norm(curve.derivatives(0.5, 2)[2])
    wanted = 0.5 * slope * (gap**2 + (1.0 - gap) ** 2)
    assert abs(curve.length - wanted) <= PROMISE * wanted
    assert abs(curve.arc_length(gap) - 0.5 * slope * gap**2) <= PROMISE * wanted
    assert abs(curve.reversed().length - wanted) <= PROMISE * wanted


@pytest.mark.parametrize("seed", range(20))
def test_two_cusps_between_two_nodes_are_seen(seed):
    # there, back and on again along a line: all nodes may lie on one side, on one smooth polynomial
    random = np.random.default_rng(seed)
    first, others = random.uniform(0.0, 1.0), random.normal(size=3)
    gap = 10.0 ** random.uniform(-4.0, -1.5)
    speed = np.polynomial.Polynomial.fromroots([first, first + gap]) * np.polynomial.Polynomial(others)
    place = speed.integ()
    curve = NurbsCurve.bezier(np.outer(bernstein(place.coef, 5), [3.0, 4.0]))
    roots = speed.roots()
    turns = np.sort([0.0, 1.0, *(r.real for r in roots if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0)])
    wanted = 5.0 * np.abs(np.diff(place(turns))).sum()
    assert abs(curve.length - wanted) <= PROMISE * wanted


def test_three_turns_in_a_row_are_seen():
    # the dip of the speed lies between the last sample of its search and a third turn beyond the end
    speed = np.polynomial.Polynomial.fromroots([-1.39535051, 0.48230946, 0.48616594, 0.52201984])
    place = speed.integ()
    curve = NurbsCurve.bezier(bernstein(place.coef, 5)[:, None])
    wanted = np.abs(np.diff(place(np.array([0.0, 0.48230946, 0.48616594, 0.52201984, 1.0])))).sum()
    assert abs(curve.length - wanted) <= PROMISE * wanted


@pytest.mark.nojit
def test_lengths_known():
    assert ellipse(5.0, 5.0).length == pytest.approx(10.0 * np.pi, rel=1e-15)
    assert KNOWN["line"].length == pytest.approx(5.0, rel=1e-15)
    assert KNOWN["line of many points"].length == pytest.approx(np.hypot(3.0, 3.0), rel=1e-15)
    assert KNOWN["polyline"].length == pytest.approx(4.0, rel=1e-15)
    # y = x^2 from 0 to 1
    parabola = NurbsCurve.bezier([[0, 0], [0.5, 0], [1, 1]])
    assert parabola.length == pytest.approx(np.sqrt(5.0) / 2.0 + np.arcsinh(2.0) / 4.0, rel=1e-15)
    # 4 a E(1 - b^2 / a^2), the complete elliptic integral
    wanted = 4.0 * 50.0 * float(mpmath.ellipe(1 - mpmath.mpf(1) / 2500))
    assert ellipse(50.0, 1.0).length == pytest.approx(wanted, rel=1e-14)
    back = NurbsCurve.bezier([[0.0], [1.0], [0.0]])  # 2 u (1 - u): to 1/2 and back
    assert back.length == pytest.approx(1.0, rel=1e-15)


@pytest.mark.nojit
def test_the_butterflys_length_is_the_published_one():
    assert butterfly().length == pytest.approx(382.8595583013, abs=5e-11)


@pytest.mark.nojit
def test_known_places():
    circle = ellipse(2.0, 2.0)
    assert np.allclose(circle.arc_length([0, 1, 2, 3, 4]), np.pi * np.arange(5), rtol=1e-15, atol=1e-15)
    assert np.allclose(circle.parameter_at(np.pi * np.arange(5)), np.arange(5), rtol=1e-15, atol=1e-15)
    s = np.linspace(0.0, circle.length, 101)
    on = circle(circle.parameter_at(s))
    assert np.allclose(on, 2.0 * np.column_stack([np.cos(s / 2.0), np.sin(s / 2.0)]), rtol=0, atol=1e-14)
    cubed = STILL["three equal points at the start"]  # S = u^3 |(3, 1)|
    s = cubed.length * np.array([0.0, 1e-9, 0.125, 1.0])
    assert np.allclose(cubed.parameter_at(s), np.cbrt(s / cubed.length), rtol=1e-6, atol=0)
    assert np.allclose(cubed.arc_length([0.5, 1e-3]), cubed.length * np.array([0.125, 1e-9]), rtol=1e-12, atol=1e-15)


@pytest.mark.nojit
@pytest.mark.parametrize("name", ["butterfly", "cusp at a third", "unequal spans", "two equal points at both ends"])
def test_lengths_grow_and_ends_are_exact(name):
    curve = CURVES[name]
    start, end = curve.domain
    assert curve.arc_length(start) == 0.0 and curve.arc_length(end) == curve.length
    assert np.array_equal(curve.parameter_at([0.0, curve.length]), [start, end])
    u = np.linspace(start, end, 3001)
    assert np.diff(curve.arc_length(u)).min() >= -4.0 * EPSILON * curve.length
    assert np.diff(curve.parameter_at(np.linspace(0.0, curve.length, 3001))).min() >= 0.0
    assert curve.arc_length(u[:3000].reshape(3, -1)).shape == (3, 1000)


@pytest.mark.nojit
def test_newton_from_an_end_where_the_speed_is_next_to_nothing_does_not_go_to_and_fro():
    row = np.zeros((1, 28))
    row[0, ARC : ARC + 5] = [
        4.039221197070e-01, 6.109158599969e-01, 3.008815418041e-02, -1.590803178002e-01, 1.782526830929e-02,
    ]  # fmt: skip
    row[0, ARC] -= arc_length(row, 0, -1.0)
    for guess in (-1.0, -0.999, 0.0, 0.6, 1.0):
        t = parameter_in_row(row, 0, 0.07927374507, guess)
        assert arc_length(row, 0, t) == pytest.approx(0.07927374507, abs=1e-15)


def of_axes(curve, linear):
    """The arc-length pieces of a curve, the first `linear` of its axes being linear."""
    return arc_pieces(Flat.of([curve]), (curve.degree, curve.axes, linear, int(curve.rational)), [curve])


def test_only_linear_axes_make_length():
    spiral = NurbsCurve.bezier([[0, 0, 0], [1, 0, 5], [2, 0, -9], [3, 4, 2]])
    flat = NurbsCurve.bezier([[0, 0], [1, 0], [2, 0], [3, 4]])
    assert of_axes(spiral, 2).length == flat.length
    assert spiral.length > flat.length
    with pytest.raises(CurveError) as caught:
        _ = of_axes(NurbsCurve.bezier([[1, 0], [1, 5]]), 1)
    kind = "NurbsCurve(degree 1, 2 control points, 2 axes, polynomial, u 0 to 1)"
    assert str(caught.value) == f"{kind} has no length"


@pytest.mark.nojit
def test_arc_lengths_outside_are_refused_and_rounding_is_not():
    line = KNOWN["line"]
    assert np.array_equal(line.parameter_at([-1e-13, 5.0 + 1e-13]), [0.0, 1.0])
    for s, said in ((5.1, "5.1"), (-0.1, "-0.1"), (np.nan, "nan"), ([1.0, np.inf], "inf")):
        with pytest.raises(InputError) as caught:
            line.parameter_at(s)
        assert str(caught.value) == f"arc length {said} mm is outside the curve's [0, 5] mm"
    assert line.parameter_at([]).shape == (0,) and line.parameter_at([[1.0], [2.0]]).shape == (2, 1)


@pytest.mark.nojit
def test_tables_stay_small():
    sizes = {name: len(curve.arc.table) for name, curve in CURVES.items()}
    assert sizes["line"] == 1 and sizes["line of many points"] == 1
    assert sizes["polyline"] == 5
    assert max(sizes.values()) < 600

"""The kernels behind the compensated and the fitted methods, each against its formula in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from sample_curves import KINDS, random_curve
from splinefeed.interpolation.stepping import TERMS, fit_feed_correction
from splinefeed.kernels import layout
from splinefeed.kernels.pieces import secant

pytestmark = pytest.mark.nojit


def place(path: sf.Path, u: float) -> tuple[int, float]:
    row = max(int(np.searchsorted(path.table[:, layout.LOW], u, side="right")) - 1, 0)
    return row, (u - path.table[row, layout.MIDDLE]) * path.table[row, layout.SCALE]


@pytest.mark.parametrize("seed", range(4 * len(KINDS)))
def test_the_secant_is_that_of_the_points(seed):
    curve = random_curve(seed, axes=2 + seed % 2)
    path = sf.Path([curve])
    low, high = curve.domain
    u, ahead = low + 0.31 * (high - low), low + 0.36 * (high - low)
    first, second = curve(u), curve.derivatives(ahead, 1)
    across, slope = second[0] - first, second[1]
    chord, product, square = secant(path.table, *place(path, u), *place(path, ahead), path.shape)
    size = np.linalg.norm(across) * np.linalg.norm(slope)
    assert chord == pytest.approx(across @ across, rel=1e-11)
    assert product == pytest.approx(across @ slope, abs=1e-11 * size)
    assert square == pytest.approx(slope @ slope, rel=1e-10)


def test_the_secant_counts_all_axes_by_the_metric():
    curve = sf.NurbsCurve.bezier([[0, 0, 0], [10, 0, 1], [20, 5, 2], [30, 5, 9]])
    path = sf.Path([curve], axes=("x", "y", "theta"))
    flat = sf.Path([sf.NurbsCurve.bezier(curve.control_points * path.metric)])
    found = secant(path.table, *place(path, 0.2), *place(path, 0.3), path.shape)
    assert found == pytest.approx(secant(flat.table, *place(flat, 0.2), *place(flat, 0.3), flat.shape), rel=1e-13)


@pytest.mark.parametrize("path", [sf.shapes.butterfly(), sf.shapes.ellipse(a=30, b=8)], ids=["butterfly", "ellipse"])
def test_the_feed_correction_polynomial_meets_both_ends_twice_differentiable(path):
    """Eq. (9) of docs/math/interpolators.md: value, dt/ds = 1 / S' and its derivative at both ends; u(s) is C2."""
    out = np.empty(TERMS)
    table = path.table
    for row in range(0, len(table), 7):
        length = fit_feed_correction(table, row, out)
        start = table[row, layout.START]
        polynomial = np.polynomial.Polynomial(out)
        for x, end, side in ((0.0, layout.LOW, "right"), (1.0, layout.HIGH, "left")):
            u = table[row, end]
            t = (u - table[row, layout.MIDDLE]) * table[row, layout.SCALE]  # -1 and 1, but for rounding
            d = path.curves[0].derivatives(u, 2, side=side)
            speed = np.linalg.norm(d[1])
            slope, bend = 1.0 / speed, -(d[1] @ d[2]) / speed**4
            scale = table[row, layout.SCALE]
            assert polynomial(x) == pytest.approx(t, abs=2e-15)
            assert polynomial.deriv()(x) == pytest.approx(slope * scale * length, rel=1e-9)
            assert polynomial.deriv(2)(x) == pytest.approx(bend * scale * length**2, abs=1e-7)
        ahead = path.length if row + 1 == len(table) else table[row + 1, layout.START]
        assert length == pytest.approx(ahead - start, abs=1e-13 * path.length)


def test_least_squares_do_better_than_the_six_end_conditions_alone():
    """Of a quintic through the ends alone the error is some ten times larger."""
    path = sf.shapes.ellipse(a=30, b=8)
    out = np.empty(TERMS)
    s = np.linspace(0.0, 1.0, 41)
    fitted, quintic = 0.0, 0.0
    for row in range(len(path.table)):
        length = fit_feed_correction(path.table, row, out)
        _, u = path.locate(path.table[row, layout.START] + s[1:-1] * length)
        t = (u - path.table[row, layout.MIDDLE]) * path.table[row, layout.SCALE]
        fitted = max(fitted, np.max(np.abs(np.polynomial.Polynomial(out)(s[1:-1]) - t)))
        # taking x^3 (1 - x)^3 (a + b x) away again leaves the quintic
        b = -out[7]
        a = 3.0 * b - out[6]
        bump = (s * (1.0 - s)) ** 3 * (a + b * s)
        quintic = max(quintic, np.max(np.abs((np.polynomial.Polynomial(out)(s) - bump)[1:-1] - t)))
    assert fitted < 0.2 * quintic


@pytest.mark.slow
def test_rest_and_back_to_motion():
    """Tsai and Cheng's differences would stand still for ever behind a rest inside a curve; it goes on."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [10, 8], [20, -8], [30, 0]])])
    half = path.length / 2
    # up and down by s = half (3 x^2 - 2 x^3), then a rest of 20 ms, then the same again
    ramp = [0.0, 0.0, 3 * half / 0.25, -2 * half / 0.125, 0.0, 0.0]
    law = sf.TimeLaw(
        breaks=[0.0, 0.5, 0.52, 1.02],
        coefficients=[ramp, [half, 0, 0, 0, 0, 0], [half, *ramp[1:]]],
        strategy="rest",
    )
    for method in ("tsai-cheng", "runge-kutta-2-compensated", "feed-correction", "taylor-3"):
        source = sf.interpolation.Interpolator(path, law, period=1e-3, method=method)
        points = source.block()
        assert points.s[-1] == pytest.approx(path.length, abs=2e-3), method
        assert source.replaced == 0

"""Each method against its own formula: order of convergence, and the equations written out in plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import splinefeed as sf
from motions import constant
from splinefeed.analysis.measures import drift, feed_ripple
from splinefeed.interpolation import registry

ORDERS = {
    "taylor-1": 1,
    "taylor-2": 2,
    "runge-kutta-4": 4,
    "adams-bashforth-moulton": 4,
    "hamming": 4,
    "milne-simpson": 4,
    "taylor-3": 3,
    "tsai-cheng": 2,
    "runge-kutta-2-compensated": 2,
}
EXACT = ("milne-simpson-anchored", "arc-length")
FITTED = ("feed-correction",)

pytestmark = pytest.mark.nojit


def test_names_are_the_published_ones():
    assert set(sf.interpolation.methods()) == {*ORDERS, *EXACT, *FITTED}


@pytest.mark.parametrize(("name", "order"), ORDERS.items())
def test_observed_order(name, order, smooth, smooth_law):
    errors = []
    for ticks in (200, 400, 800):
        points = sf.interpolate(smooth, smooth_law, period=1.0 / ticks, method=name)
        errors.append(np.max(np.abs(drift(points, smooth_law))))
    observed = np.log2(np.array(errors[:-1]) / errors[1:])
    assert observed == pytest.approx(order, abs=0.15)
    assert registry.method(name).order == order


@pytest.mark.parametrize("name", EXACT)
def test_anchored_methods_are_exact_to_rounding(name, smooth, smooth_law):
    points = sf.interpolate(smooth, smooth_law, period=1e-3, method=name)
    assert np.max(np.abs(drift(points, smooth_law))) <= 4e-16 * smooth.length
    assert registry.method(name).order is None


def test_the_error_of_the_fitted_method_does_not_depend_on_the_period(smooth, smooth_law):
    errors = [
        np.max(np.abs(drift(sf.interpolate(smooth, smooth_law, period=period, method="feed-correction"), smooth_law)))
        for period in (1e-2, 1e-3)
    ]
    assert errors == pytest.approx([4.5e-9, 4.5e-9], rel=0.15)
    assert registry.method("feed-correction").order is None
    assert not registry.method("feed-correction").anchor


def rate(curve, u, feed):
    """f = V / |C'(u)|."""
    return feed / np.linalg.norm(curve.derivatives(u, 1)[1])


def runge_kutta(curve, law, u, t, period):
    k1 = rate(curve, u, law.feed(t))
    k2 = rate(curve, u + period / 2 * k1, law.feed(t + period / 2))
    k3 = rate(curve, u + period / 2 * k2, law.feed(t + period / 2))
    k4 = rate(curve, u + period * k3, law.feed(t + period))
    return u + period / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def multistep(curve, law, period, ticks, predict, correct, corrections):
    """Any predictor-corrector of three past values, by its formulas, started by Runge-Kutta."""
    u, f = [0.0], [rate(curve, 0.0, law.feed(0.0))]
    for k in range(ticks):
        t = k * period
        if k < 3:
            after = runge_kutta(curve, law, u[-1], t, period)
        else:
            after = predict(u, f, period)
            for _ in range(corrections):
                after = correct(u, f, rate(curve, after, law.feed(t + period)), period)
        u.append(after)
        f.append(rate(curve, after, law.feed(t + period)))
    return np.array(u)


def milne(u, f, T):
    return u[-4] + 4 * T / 3 * (2 * f[-1] - f[-2] + 2 * f[-3])  # eq. (23)


def simpson(u, f, ahead, T):
    return u[-2] + T / 3 * (ahead + 4 * f[-1] + f[-2])  # eq. (24)


FORMULAS = {
    "milne-simpson": (milne, simpson),
    "hamming": (milne, lambda u, f, ahead, T: (9 * u[-1] - u[-3] + 3 * T * (ahead + 2 * f[-1] - f[-2])) / 8),
    "adams-bashforth-moulton": (
        lambda u, f, T: u[-1] + T / 24 * (55 * f[-1] - 59 * f[-2] + 37 * f[-3] - 9 * f[-4]),
        lambda u, f, ahead, T: u[-1] + T / 24 * (9 * ahead + 19 * f[-1] - 5 * f[-2] + f[-3]),
    ),
}


@pytest.mark.parametrize("corrections", [0, 1, 3])
@pytest.mark.parametrize("name", FORMULAS)
def test_predictor_correctors_follow_their_equations(name, corrections, smooth, smooth_law):
    ticks = 60
    points = sf.interpolate(smooth, smooth_law, period=1.0 / ticks, method=name, corrections=corrections)
    expected = multistep(smooth.curves[0], smooth_law, 1.0 / ticks, ticks - 1, *FORMULAS[name], corrections)
    assert points.u[:-1] == pytest.approx(expected, abs=1e-13)


def test_taylor_2_has_the_acceleration_term(smooth, smooth_law):
    """Eq. (3): without A_k the error at a changing feed is of order 1 (Farouki & Tsai 2001)."""
    period = 0.01
    u = 0.3
    curve = smooth.curves[0]
    points = sf.interpolate(smooth, smooth_law, period=period, method="taylor-2")
    k = int(np.argmin(np.abs(points.u - u)))
    t = points.t[k]
    feed, acceleration = smooth_law.feed(t), smooth_law.acceleration(t)
    d = curve.derivatives(points.u[k], 2)
    size = np.linalg.norm(d[1])
    bend = acceleration / size - feed**2 * (d[1] @ d[2]) / size**4
    assert points.u[k + 1] == pytest.approx(points.u[k] + feed * period / size + period**2 / 2 * bend, abs=1e-15)


def test_taylor_3_is_the_third_derivative_of_u(smooth, smooth_law):
    """Derivatives of u by Farouki and Tsai's recursion against the method's own step, at a feed that changes."""
    period, k = 0.01, 40
    curve = smooth.curves[0]
    points = sf.interpolate(smooth, smooth_law, period=period, method="taylor-3")
    u, t = points.u[k], points.t[k]
    d = curve.derivatives(u, 3)
    size = np.linalg.norm(d[1])
    slope = d[1] @ d[2] / size
    bend = (d[2] @ d[2] + d[1] @ d[3] - slope**2) / size
    feed, acceleration = smooth_law.feed(t), smooth_law.acceleration(t)
    jerk = 2.0 * (smooth_law.feed(t + period) - feed - acceleration * period) / period**2
    first = feed / size
    second = (acceleration - slope * first**2) / size
    third = (jerk - 3.0 * slope * first * second - bend * first**3) / size
    expected = u + period * first + period**2 / 2 * second + period**3 / 6 * third
    assert points.u[k + 1] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("name", ["tsai-cheng", "runge-kutta-2-compensated"])
def test_compensated_methods_make_the_chord_of_a_step_what_the_feed_asks_for(name, smooth, smooth_law):
    points = sf.interpolate(smooth, smooth_law, period=1e-3, method=name, corrections=4)
    chords = np.linalg.norm(np.diff(points.position, axis=0), axis=1)
    wanted = np.diff(smooth_law(points.t))
    first = 3 if name == "tsai-cheng" else 0  # its first three steps are Runge-Kutta's
    assert chords[first:-1] == pytest.approx(wanted[first:-1], rel=1e-11)
    # an arc is longer than its chord by kappa^2 (V T)^3 / 24: that is how far the tool runs ahead
    ahead = np.sum(curvature(smooth, points) ** 2 * wanted**3) / 24
    assert drift(points, smooth_law)[-2] == pytest.approx(ahead, rel=0.02)


def curvature(path, points):
    d = path.curves[0].derivatives(points.u[:-1], 2)
    across = d[:, 1, 0] * d[:, 2, 1] - d[:, 1, 1] * d[:, 2, 0]
    return np.abs(across) / np.linalg.norm(d[:, 1], axis=1) ** 3


def test_tsai_cheng_follows_its_equations(smooth, smooth_law):
    period = 0.02
    curve = smooth.curves[0]
    points = sf.interpolate(smooth, smooth_law, period=period, method="tsai-cheng", corrections=2)
    u = points.u
    for k in range(3, 30):
        ahead = 3 * u[k] - 3 * u[k - 1] + u[k - 2]
        t = points.t[k]
        wanted = period / 6 * (smooth_law.feed(t) + 4 * smooth_law.feed(t + period / 2) + smooth_law.feed(t + period))
        for _ in range(2):
            ratio = np.linalg.norm(curve(ahead) - curve(u[k])) / wanted
            ahead += (1 - ratio) * (ahead - u[k])
        assert u[k + 1] == pytest.approx(ahead, abs=1e-14)


def test_corrector_stops_at_its_tolerance(smooth, smooth_law):
    once = sf.interpolate(smooth, smooth_law, period=0.02, method="milne-simpson", corrections=1)
    loose = sf.interpolate(smooth, smooth_law, period=0.02, method="milne-simpson", corrections=50, tolerance=1.0)
    tight = sf.interpolate(smooth, smooth_law, period=0.02, method="milne-simpson", corrections=50, tolerance=1e-15)
    many = sf.interpolate(smooth, smooth_law, period=0.02, method="milne-simpson", corrections=50)
    assert np.array_equal(loose.u, once.u)
    assert tight.u == pytest.approx(many.u, abs=1e-14)
    assert not np.allclose(once.u, many.u, rtol=0, atol=1e-12)


def test_runge_kutta_agrees_with_scipy(smooth, smooth_law):
    curve = smooth.curves[0]
    points = sf.interpolate(smooth, smooth_law, period=1e-3, method="runge-kutta-4")
    solution = solve_ivp(
        lambda t, u: [rate(curve, min(u[0], 1.0), smooth_law.feed(t))],
        (0.0, 1.0),
        [0.0],
        t_eval=points.t[:-1],
        rtol=1e-12,
        atol=1e-14,
        method="DOP853",
    )
    assert points.u[:-1] == pytest.approx(solution.y[0], abs=1e-11)


def test_milne_simpson_ripples_and_the_anchored_one_does_not(butterfly):
    """The figures of the paper's digest: butterfly, 60 mm/s throughout, 1 ms, one correction."""
    law = constant(butterfly, 60.0)
    largest = {}
    for name in ("taylor-2", "runge-kutta-4", "milne-simpson", "milne-simpson-anchored", "arc-length"):
        ripple = feed_ripple(sf.interpolate(butterfly, law, period=1e-3, method=name), butterfly, law)
        # the last, short period takes up a method's drift: that is no ripple
        largest[name] = np.max(np.abs(ripple.relative[:-1]))
    assert largest["taylor-2"] == pytest.approx(0.51, abs=0.005)
    assert largest["runge-kutta-4"] == pytest.approx(0.027, abs=0.0005)
    assert largest["milne-simpson"] == pytest.approx(2.55, abs=0.01)
    assert largest["milne-simpson-anchored"] < 1e-10
    assert largest["arc-length"] < 1e-10


def test_ripple_and_drift_of_the_later_methods(butterfly):
    """As above: butterfly, 60 mm/s throughout, 1 ms, one correction. A third Taylor term does worse than two."""
    law = constant(butterfly, 60.0)
    expected = {
        "taylor-3": (1.164, -0.111),
        "feed-correction": (1.8e-6, 0.0),
        "tsai-cheng": (0.918, -0.225),
        "runge-kutta-2-compensated": (0.221, 0.0297),
    }
    for name, (ripple, ahead) in expected.items():
        points = sf.interpolate(butterfly, law, period=1e-3, method=name)
        assert np.max(np.abs(feed_ripple(points, butterfly, law).relative[:-1])) == pytest.approx(ripple, rel=0.01)
        assert drift(points, law)[-2] == pytest.approx(ahead, rel=0.01, abs=1e-9)


def test_the_ripple_of_milne_simpson_changes_sign_at_every_tick(butterfly):
    law = constant(butterfly, 60.0)
    ripple = feed_ripple(sf.interpolate(butterfly, law, period=1e-3, method="milne-simpson"), butterfly, law)
    late = ripple.relative[-2000:-10]
    turns = np.mean(np.sign(late[1:]) != np.sign(late[:-1]))
    assert turns > 0.95


def damped_euler(u, rate, law, period, curve, corrections, tolerance, memory):
    """First-order Taylor, its last error carried over: what a user might write."""
    after = u[0] + period * rate[0] + memory[0]
    memory[0] = 0.0
    return after


def test_a_method_of_ones_own(smooth, smooth_law):
    name = "my-euler"
    try:
        added = sf.interpolation.register(name, damped_euler, title="mine", order=1)
        assert name in sf.interpolation.methods()
        assert added.title == "mine"
        mine = sf.interpolate(smooth, smooth_law, period=1e-2, method=name)
        assert np.array_equal(mine.u, sf.interpolate(smooth, smooth_law, period=1e-2, method="taylor-1").u)
        with pytest.raises(sf.errors.MethodError, match="method 'my-euler' is registered already; choose another name"):
            sf.interpolation.register(name, damped_euler)
    finally:
        registry._methods.pop(name, None)


def test_refused_registrations():
    with pytest.raises(
        sf.errors.MethodError, match=r"method name 'My Method': use lower-case letters, digits and hyphens"
    ):
        sf.interpolation.register("My Method", damped_euler)
    with pytest.raises(sf.errors.MethodError, match=r"method 'short': step takes \(u, rate\); it must take"):
        sf.interpolation.register("short", lambda u, rate: u[0])
    with pytest.raises(
        sf.errors.MethodError, match=r"method 'long-memory': history is 7; 0 to 3 earlier steps are kept"
    ):
        sf.interpolation.register("long-memory", damped_euler, history=7)
    with pytest.raises(
        sf.errors.MethodError, match=r"unknown interpolation method 'milne-simson'; did you mean 'milne-simpson'\?"
    ):
        registry.method("milne-simson")
    with pytest.raises(sf.errors.MethodError, match=r"unknown interpolation method 'zzz'; choose one of taylor-1, "):
        registry.method("zzz")

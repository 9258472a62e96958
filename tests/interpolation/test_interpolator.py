"""Setpoints of whole motions: ends, joints, stops, chunks, odd periods and odd curves."""

from __future__ import annotations

import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.analysis.measures import drift, feed_ripple

LIMITS = sf.Limits(feed=60, acceleration=500, jerk=20000)
ANCHORED = ("milne-simpson-anchored", "arc-length")


def corner_path() -> sf.Path:
    """A line, a corner, and an arc that begins along the second line's tangent."""
    half = np.sqrt(0.5)
    return sf.Path(
        [
            sf.NurbsCurve.bezier([[0, 0], [20, 0]]),
            sf.NurbsCurve.bezier([[20, 0], [20, 10]]),
            sf.NurbsCurve.bezier([[20, 10], [20, 15], [15, 15]], [1, half, 1]),
        ],
        name="corner",
    )


def cusp_end() -> sf.Path:
    """C' = 0 at both ends: P0 = P1 and P2 = P3."""
    return sf.Path([sf.NurbsCurve.bezier([[0, 0], [0, 0], [30, 20], [30, 20]])], name="vanishing ends")


def nose() -> sf.Path:
    """A blunt nose between two straight runs, of degree 6."""
    return sf.Path([sf.NurbsCurve.bezier([[15, 0], [9, 3], [3, 3], [0, 0], [3, -3], [9, -3], [15, 0]])], name="nose")


def in_space() -> sf.Path:
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.normal(size=(12, 3)) * 10, axis=0)
    knots = np.r_[np.zeros(5), np.linspace(0, 1, 9)[1:-1], np.ones(5)]
    return sf.Path([sf.NurbsCurve(4, knots, points, rng.uniform(0.3, 3, 12))], axes=("x", "y", "z"), name="space")


PATHS = {p.name: p for p in (motions.butterfly(), motions.smooth(), corner_path(), cusp_end(), nose(), in_space())}


@pytest.mark.parametrize("method", ANCHORED)
@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS.keys())
def test_default_methods_keep_feed_and_end_to_rounding(path, method):
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law, method=method)
    ripple = feed_ripple(points, path, law)
    assert ripple.max <= max(1e-10, 4 * ripple.floor)
    assert points.u[-1] == path.curves[-1].domain[1]
    assert points.curve[-1] == len(path.curves) - 1
    assert points.position[-1] == pytest.approx(path.curves[-1].control_points[-1], abs=2e-16 * max(path.size, 20))
    assert points.position[0] == pytest.approx(path.curves[0].control_points[0], abs=2e-16 * max(path.size, 20))
    assert np.max(np.abs(drift(points, law))) <= 1e-12 * path.length
    assert points.t[-1] == law.duration
    assert len(points) == round(law.duration / 1e-3) + 1


@pytest.mark.slow
@pytest.mark.parametrize("method", sf.interpolation.methods())
def test_no_method_leaves_the_path_or_fails_on_a_hard_one(method):
    for path in PATHS.values():
        law = sf.plan(path, LIMITS, period=1e-3)
        source = sf.interpolation.Interpolator(path, law, method=method)
        points = source.block()
        assert np.all(np.isfinite(points.position))
        for i, curve in enumerate(path.curves):
            u = points.u[points.curve == i]
            assert u.size
            assert curve.domain[0] <= u.min() <= u.max() <= curve.domain[1]
        assert np.all(np.diff(points.curve) >= 0)
        on_curve = path.evaluate(points.curve, points.u)[:, 0]
        assert np.max(np.abs(points.position - on_curve)) <= 1e-13 * path.size
        if method in ANCHORED:
            assert np.all(np.diff(points.s) >= 0.0)


def test_a_tick_rests_on_every_stop():
    path = corner_path()
    assert path.stops == pytest.approx((20.0,))
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law)
    at = int(np.argmin(np.abs(points.s - 20.0)))
    assert points.position[at] == pytest.approx([20, 0], abs=1e-12)
    assert points.feed[at] == pytest.approx(0.0, abs=1e-9)
    # the corner is rounded by nobody: all points before lie on y = 0, all after on x = 20
    assert np.all(np.abs(points.position[: at + 1, 1]) < 1e-12)
    second = points.curve == 1
    assert np.all(np.abs(points.position[second, 0] - 20) < 1e-12)


@pytest.mark.parametrize("method", sf.interpolation.methods())
def test_chunks_are_the_same_points(method):
    for path in (PATHS["corner"], PATHS["smooth"]):
        law = sf.plan(path, LIMITS, period=1e-3)
        whole = sf.interpolate(path, law, method=method)
        parts = list(sf.interpolate(path, law, method=method, chunk=37))
        assert [len(part) for part in parts[:-1]] == [37] * (len(parts) - 1)
        for name in ("t", "curve", "u", "s", "feed", "position"):
            assert np.array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
        one_by_one = sf.interpolation.Interpolator(path, law, method=method)
        for k in range(len(whole)):
            assert np.array_equal(one_by_one.step(), whole.position[k])
        with pytest.raises(StopIteration):
            one_by_one.step()
        assert len(one_by_one.block()) == 0


def test_a_short_last_period():
    path = motions.smooth()
    law = motions.constant(path, 60.0)
    for method in sf.interpolation.methods():
        points = sf.interpolate(path, law, period=1e-2, method=method)
        assert points.t[-1] == law.duration
        assert 0 < points.t[-1] - points.t[-2] < 1e-2
        assert points.s[-1] == pytest.approx(path.length, rel=2e-2)


def test_mixed_degrees_and_weights_in_one_path():
    """Curves of one path share one table; each must come out as it does alone."""
    path = corner_path()
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law)
    arc = points.position[points.curve == 2] - [15, 10]
    assert np.hypot(*arc.T) == pytest.approx(np.full(len(arc), 5.0), abs=1e-13)


def test_rotary_axes_move_in_step_but_do_not_count_in_the_feed():
    curve = sf.NurbsCurve.bezier([[0, 0, 0], [10, 0, 1], [20, 5, 2], [30, 5, 9]])
    path = sf.Path([curve], axes=("x", "y", "theta"), by_tip=True)
    plane = sf.Path([sf.NurbsCurve.bezier(curve.control_points[:, :2])])
    assert path.length == pytest.approx(plane.length, rel=1e-14)
    law = sf.plan(path, LIMITS, period=1e-3)
    points = sf.interpolate(path, law)
    flat = sf.interpolate(plane, sf.plan(plane, LIMITS, period=1e-3))
    assert points.position[:, :2] == pytest.approx(flat.position, abs=1e-12)
    assert points.position[:, 2] == pytest.approx(curve(points.u)[:, 2])


def test_settings_are_enough_to_make_the_points_again():
    path = motions.smooth()
    points = sf.interpolate(path, sf.plan(path, LIMITS, period=1e-3), method="milne-simpson", corrections=2)
    settings = points.settings
    limits = sf.Limits(**settings["limits"])
    law = sf.plan(path, limits, strategy=settings["strategy"], period=settings["period"])
    again = sf.interpolate(path, law, method=settings["method"], corrections=settings["corrections"])
    assert np.array_equal(again.position, points.position)


def test_bad_input():
    path = motions.smooth()
    law = sf.plan(path, LIMITS, period=1e-3)
    with pytest.raises(sf.errors.LimitsError, match="period is 0; it must be greater than 0"):
        sf.interpolate(path, law, period=0)
    with pytest.raises(sf.errors.LimitsError, match="period is nan; it must be finite"):
        sf.interpolate(path, law, period=float("nan"))
    with pytest.raises(
        sf.errors.LimitsError, match=r"the period of 100 s is longer than the whole motion of 1\.3\d+ s"
    ):
        sf.interpolate(path, law, period=100)
    with pytest.raises(sf.errors.LimitsError, match="no period: the law was planned without one; give period= in s"):
        sf.interpolate(path, motions.smooth_law(path))
    with pytest.raises(sf.errors.MethodError, match="did you mean 'taylor-2'"):
        sf.interpolate(path, law, method="taylor2")
    with pytest.raises(sf.errors.InputError, match="corrections is -1; expected a whole number from 0 to 100"):
        sf.interpolate(path, law, corrections=-1)
    with pytest.raises(sf.errors.InputError, match="tolerance is nan; expected 0 or more"):
        sf.interpolate(path, law, tolerance=float("nan"))
    with pytest.raises(sf.errors.InputError, match="chunk is 0; expected a whole number of ticks from 1 up"):
        sf.interpolate(path, law, chunk=0)
    with pytest.raises(sf.errors.InputError, match=r"the law runs over 74\.77\S+ mm but the path is 382\.8\S+ mm long"):
        sf.interpolate(motions.butterfly(), law)


def _bits(points):
    return [getattr(points, name).tobytes() for name in ("curve", "u", "s", "feed", "position")]


WITH_ZEROS = ("taylor-2", "taylor-3", "runge-kutta-4", "milne-simpson", "tsai-cheng")


@pytest.mark.parametrize(
    ("name", "method"),
    [
        *(("butterfly", method) for method in sf.interpolation.methods() if method != "arc-length"),
        *((cusp_end().name, method) for method in WITH_ZEROS),
    ],
)
def test_plain_python_and_compiled_loops_give_the_same_bits(monkeypatch, name, method):
    path = PATHS[name]
    law = sf.plan(path, LIMITS, period=1e-3)
    compiled = sf.interpolation.Interpolator(path, law, method=method, compiled=True)
    plain = sf.interpolation.Interpolator(path, law, method=method)
    monkeypatch.setattr(plain, "_loop", plain._method.loop(path.shape).plainly)
    one, first, rest = compiled.block(), plain.block(7), plain.block()
    assert _bits(one.part(0, 7)) == _bits(first)
    assert _bits(one.part(7, len(one))) == _bits(rest)
    assert (compiled.replaced, compiled.overrun) == (plain.replaced, plain.overrun)

"""Ripple, drift, chord error and axis motion against values known beforehand, and with faults put in on purpose."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import motions
import splinefeed as sf
from splinefeed.analysis import measures
from splinefeed.checks.bounds import Bounds
from splinefeed.checks.law import LawMotion, limits_along
from splinefeed.checks.spans import PathSpans


def circle(radius: float = 10.0) -> sf.Path:
    half = np.sqrt(0.5)
    points = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    return sf.Path(
        [sf.NurbsCurve(2, knots, radius * np.array(points, dtype=float), [1, half] * 4 + [1])], name="circle"
    )


def travelled(path: sf.Path, *u: float) -> float:
    """Arc length of the only curve from one parameter to another, mm."""
    spans = PathSpans(path.flat, path.linear)
    row, at = spans.find(np.zeros(2, dtype=np.int64), np.array(u))
    return float(spans.steps(row, spans.ahead(row, (at - spans.middle[row]) * spans.scale[row]))[0])


@pytest.mark.parametrize("path", [motions.smooth(), motions.butterfly(), circle()], ids=lambda p: p.name)
def test_travelled_agrees_with_scipy(path):
    curve = path.curves[0]
    rng = np.random.default_rng(5)
    start, end = curve.domain
    for _ in range(20):
        a, b = np.sort(rng.uniform(start, end, 2))
        inner = curve.breaks[(curve.breaks > a) & (curve.breaks < b)]
        cuts = [a, *inner, b]
        expected = sum(
            quad(lambda u: np.linalg.norm(curve.derivatives(u, 1)[1]), low, high, epsabs=0, epsrel=1e-13, limit=200)[0]
            for low, high in pairwise(cuts)
        )
        assert travelled(path, a, b) == pytest.approx(expected, rel=1e-12)
        assert travelled(path, b, a) == -travelled(path, a, b)


def test_travelled_through_a_cusp():
    """x = t^2, y = t^3 about t = 0: C' = 0 inside; each side is (13^1.5 - 8) / 27 long, but for the resolution."""
    curve = sf.NurbsCurve.bezier([[1, -1], [-1 / 3, 1], [-1 / 3, -1], [1, 1]])
    assert travelled(sf.Path([curve]), 0.0, 1.0) == pytest.approx(2 * (13**1.5 - 8) / 27, abs=1e-8)
    assert travelled(sf.Path([curve]), 0.5, 1.0) == pytest.approx((13**1.5 - 8) / 27, abs=1e-8)


def test_travelled_where_the_curve_all_but_stands_still():
    """Degree 12, the first point five times, weights over five decades: near the start C' is rounding and no more."""
    weights = [0.36, 233.0, 0.0987, 283.0, 0.0094, 0.0287, 0.0033, 500.0, 273.0, 0.127, 0.275, 0.0365, 0.0136]
    points = np.random.default_rng(2).normal(size=(13, 2))
    points[:5] = points[0]
    path = sf.Path([sf.NurbsCurve.bezier(points, weights)])
    (curve,) = path.joined  # within the resolution of the one given
    assert travelled(path, 0.0, 1.0) == pytest.approx(curve.length, rel=1e-13)
    ends = np.array([0.0, 1e-3, 1e-2])
    lengths = [travelled(path, 0.0, u) for u in ends]
    assert lengths == pytest.approx(curve.arc_length(ends), abs=1e-15 * curve.length)


@pytest.mark.parametrize("at", [0.003, 0.3, 0.9985])
def test_steps_about_a_place_where_one_axis_turns_back(at):
    """x' = 2 (u - at): |x'| has a kink where quadrature over the whole span, ends left out, would not see it."""
    curve = sf.NurbsCurve.bezier([[0.0], [-at], [1.0 - 2.0 * at]])
    path = sf.Path([curve], axes=("x",))
    assert path.length == pytest.approx(at**2 + (1.0 - at) ** 2, rel=1e-14)
    u = np.array([0.0, 1.0])
    points = sf.interpolate(path, motions.constant(path, 1.0), period=1e-3)
    ends = dataclasses.replace(
        points, **{name: getattr(points, name)[[0, -1]] for name in ("t", "curve", "s", "feed", "position")}, u=u
    )
    assert measures.steps(ends, path) == pytest.approx([path.length], rel=1e-14)
    assert np.sum(measures.steps(points, path)) == pytest.approx(path.length, rel=1e-14)


def test_ripple_sees_a_planted_fault():
    path = circle()
    law = motions.constant(path, 50.0)
    points = sf.interpolate(path, law, period=1e-3)
    good = measures.feed_ripple(points, path, law)
    assert good.max < 1e-11
    u = points.u.copy()
    moved = path.curves[0].parameter_at(points.s[100] + 0.01)
    u[100] = moved
    bad = measures.feed_ripple(dataclasses.replace(points, u=u), path, law)
    step = 50.0 * 1e-3
    assert int(np.argmax(np.abs(bad.relative))) in (99, 100)
    assert bad.relative[99] == pytest.approx(0.01 / step, rel=1e-9)
    assert bad.relative[100] == pytest.approx(-0.01 / step, rel=1e-9)
    assert bad.rms == pytest.approx(np.sqrt(2 * (0.01 / step) ** 2 / len(bad.relative)), rel=1e-6)


def test_ripple_leaves_out_what_is_near_rest():
    path = motions.smooth()
    law = sf.plan(path, sf.Limits(feed=60, acceleration=50, jerk=2000), period=1e-3)
    points = sf.interpolate(path, law)
    counted = measures.feed_ripple(points, path, law).t
    assert law.feed(counted).min() > 0.1 * points.feed.max()
    assert counted.min() > 0.05


def test_ripple_across_joints():
    """Steps that end on the next curve are measured over the joint, and curves that hold no setpoint are not lost."""
    lines = [
        sf.NurbsCurve.bezier([[x, 0], [x + w, 0]]) for x, w in ((0, 10), (10, 0.001), (10.001, 0.002), (10.003, 5))
    ]
    path = sf.Path(lines)
    law = motions.constant(path, 30.0)
    points = sf.interpolate(path, law, period=1e-3)
    assert set(np.diff(points.curve)) >= {0, 3} or len(set(points.curve)) == 4
    assert measures.feed_ripple(points, path, law).max < 1e-10
    assert np.sum(measures.steps(points, path)) == pytest.approx(path.length, rel=1e-13)


def test_drift_is_the_distance_ahead_of_the_law():
    path = circle()
    law = motions.constant(path, 50.0)
    points = sf.interpolate(path, law, period=1e-3)
    late = dataclasses.replace(points, s=points.s - 0.25)
    assert measures.drift(late, law) == pytest.approx(np.full(len(points), -0.25), abs=1e-12)


def test_chord_error_of_a_circle():
    """r (1 - cos(V T / 2r)) between every two setpoints."""
    path = circle(10.0)
    law = motions.constant(path, 200.0)
    points = sf.interpolate(path, law, period=5e-3)
    errors = measures.chord_errors(points, path)[:-1]  # the last step is shorter
    assert errors == pytest.approx(np.full(len(errors), 10 * (1 - np.cos(200 * 5e-3 / 20))), rel=1e-9)


def test_chord_error_over_a_corner_is_the_corner():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0]]), sf.NurbsCurve.bezier([[1, 0], [1, 1]])])
    points = sf.interpolate(path, motions.constant(path, 1.0), period=0.3)
    across = int(np.flatnonzero(np.diff(points.curve))[0])
    start, end = points.position[across], points.position[across + 1]
    chord = end - start
    to_corner = np.array([1, 0]) - start
    away = abs(chord[0] * to_corner[1] - chord[1] * to_corner[0]) / np.linalg.norm(chord)
    assert measures.chord_errors(points, path)[across] == pytest.approx(away, rel=1e-12)


def test_axis_motion_is_differences_of_setpoints_and_agrees_with_the_law():
    path, limits = motions.smooth(), sf.Limits(feed=60, acceleration=500, jerk=20000)
    run = sf.run(path, limits, law=sf.plan(path, limits, period=1e-4), period=1e-4)
    points, law = run.points, LawMotion(run.law, Bounds(path, limits, 0.0, 0.0))
    exact = law.at_ticks(points, law.places_of(points)).motion
    motion, inside, at = (run.motion.velocity, run.motion.acceleration, run.motion.jerk), slice(5, -5), points.position
    for order, found in enumerate(motion, start=1):
        seen, first = np.diff(at, n=order, axis=0) / 1e-4**order, order // 2
        assert found[first : first + len(seen)][:-3] == pytest.approx(seen[:-3], abs=1e-9 * np.max(np.abs(seen)))
    for found, each in zip(motion[:2], exact, strict=False):
        assert found[inside] == pytest.approx(each[inside], abs=3e-3 * np.max(np.abs(each)))
    smooth_jerk = np.abs(np.diff(run.law.jerk(points.t), prepend=0)) < 1
    both = np.convolve(smooth_jerk, np.ones(9), "same")[inside] > 8.5
    assert motion[2][inside][both] == pytest.approx(exact[2][inside][both], abs=2e-2 * np.max(np.abs(exact[2])))


@pytest.mark.parametrize("jerk", [15000, np.inf])
def test_axis_peaks_are_what_the_setpoints_do_where_curvature_jumps(jerk):
    """A line, an arc, a line: the exact jerk of the axes is finite on all sides, that of the setpoints v^2 / (r T).

    Without a limit of jerk the acceleration of the law jumps, too. The table has what NumPy makes of the setpoints.
    """
    arc = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[20.0, 0], [30, 0], [30, 10]], [1, np.sqrt(0.5), 1])
    lines = [sf.NurbsCurve.bezier([[0.0, 0], [20, 0]]), sf.NurbsCurve.bezier([[30.0, 10], [30, 30]])]
    path = sf.Path([lines[0], arc, lines[1]])
    run = sf.run(path, sf.Limits(feed=100, acceleration=800, jerk=jerk), period=1e-3)
    rest = np.pad(run.points.position, ((3, 3), (0, 0)), mode="edge")
    third = np.max(np.abs(np.diff(rest[:-1], n=3, axis=0)), axis=0) / 1e-9  # the last step may be shorter
    found = [run.axis_peaks()[axis]["jerk"] for axis in "xy"]
    assert found[:2] == pytest.approx(third[:2], rel=0.01)
    assert min(found[:2]) > 0.9 * 0.5 * 100**2 / 10 / 1e-3
    assert any("curvature jumps in motion" in note for note in run.numbers()["notes"])
    checked = sf.check(run.points, path, sf.Limits(feed=101, axis_jerk=1.0)).limits
    assert [checked[f"axis_jerk.{axis}"].worst for axis in "xy"] == pytest.approx(found[:2], rel=1e-6)


def test_axis_motion_where_the_derivative_vanishes():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [0, 0], [30, 20], [30, 20]])])
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    law = sf.plan(path, limits, period=1e-3)
    run = sf.run(path, dataclasses.replace(limits, axis_jerk=1e6), law=law)
    for each in (run.motion.velocity, run.motion.acceleration, run.motion.jerk, run.use.share):
        assert np.all(np.isfinite(each))


def test_the_nose_of_the_papers_airfoil_asks_thirty_times_the_papers_acceleration():
    """The digest: 1540 mm/s^2 and 6.3e4 mm/s^3 at 40 mm/s on a radius of 1.07 mm."""
    result = sf.run(sf.shapes.naca("0025", perimeter=33))
    assert result.law.duration == pytest.approx(1.65, abs=1e-12)
    assert result.points.feed.max() == pytest.approx(40.0, rel=1e-9)
    nose = result.path.curves[0].curvature(0.5)
    assert 1 / nose == pytest.approx(1.07, abs=0.005)
    peaks = result.numbers()["axes"]
    assert max(peaks["x"]["acceleration"], peaks["y"]["acceleration"]) == pytest.approx(1540, rel=0.05)
    assert max(peaks["x"]["jerk"], peaks["y"]["jerk"]) == pytest.approx(6.3e4, rel=0.05)
    assert result.ok


def test_shares_find_a_law_over_its_limits():
    path = motions.smooth()
    limits = sf.Limits(feed=60, acceleration=500, deceleration=250, jerk=20000, deceleration_jerk=5000)
    law = sf.plan(path, limits)
    shares = limits_along(law, path, limits)
    assert all(share.holds for share in shares.values())
    assert shares["jerk"].share == pytest.approx(1.0, rel=1e-9)
    for name, less in (("feed", 0.9), ("acceleration", 0.9), ("deceleration", 0.9)):
        tight = dataclasses.replace(limits, **{name: shares[name].worst * less})
        found = limits_along(law, path, tight)
        assert not found[name].holds
        assert found[name].share == pytest.approx(1 / less, rel=1e-9)
        assert [n for n, s in found.items() if not s.holds] == [name]
    for name in ("jerk", "deceleration_jerk"):
        tight = dataclasses.replace(limits, **{name: 0.5 * getattr(limits, name)})
        assert limits_along(law, path, tight)["jerk"].share == pytest.approx(2.0, rel=1e-9)


def test_measures_of_two_points():
    path = motions.smooth()
    law = motions.constant(path, path.length)
    points = sf.interpolate(path, law, period=1.0)
    assert len(points) == 2
    limits = sf.Limits(feed=path.length, start_feed=path.length, end_feed=path.length)
    run = sf.run(path, limits, law=law, period=1.0)
    assert run.motion.velocity[0] == pytest.approx(np.diff(points.position, axis=0)[0])
    assert run.motion.jerk.shape == (2, 2)
    assert run.use.share[:, run.use.names.index("feed")] == pytest.approx([1.0, 1.0])
    assert measures.chord_errors(points, path).shape == (1,)

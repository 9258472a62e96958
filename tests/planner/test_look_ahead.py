"""Look-ahead plans: near the best known times, and never over a limit by the independent check."""

from __future__ import annotations

import re

import numpy as np
import pytest
from benchmarks import cases

import motions
import splinefeed as sf
from splinefeed.paths.path import Path

PERIOD = 1e-3


PATHS = {"butterfly": cases.butterfly(), "airfoil12": cases.airfoil12()}


def checked(path: Path, limits: sf.Limits, period: float = PERIOD) -> sf.TimeLaw:
    """The law, once the independent check has found nothing."""
    law = sf.plan(path, limits, strategy="look-ahead", period=period)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems
    return law


@pytest.mark.parametrize(("name", "setting"), cases.BEST)
def test_within_twelve_percent_of_the_best_known_times(name, setting):
    law = checked(PATHS[name], cases.axis_limits(setting))
    assert 0.999 * cases.BEST[name, setting] <= law.duration <= 1.12 * cases.BEST[name, setting]
    assert law.length == pytest.approx(PATHS[name].length, rel=1e-14)


def line(*points: tuple[float, ...]) -> sf.NurbsCurve:
    return sf.NurbsCurve.bezier(np.array(points, dtype=float))


def arc(center: tuple[float, float], radius: float, start: float, turn: float) -> sf.NurbsCurve:
    """A circular arc of less than half a turn."""
    half = 0.5 * turn
    angles = start + np.array([0.0, half, turn])
    points = np.array(center) + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    points[1] = np.array(center) + (points[1] - center) / np.cos(half)
    return sf.NurbsCurve.bezier(points, [1.0, np.cos(half), 1.0])


def test_a_straight_line_is_the_seven_phase_profile():
    path = Path([line((0, 0), (60, 80))])
    limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    assert sf.plan(path, limits, strategy="look-ahead").duration == pytest.approx(
        sf.plan(path, limits).duration, rel=1e-12
    )
    axes = sf.Limits(feed=60, axis_acceleration=400, axis_jerk=16000)  # y takes 0.8 of what the path does
    assert sf.plan(path, axes, strategy="look-ahead").duration == pytest.approx(
        sf.plan(path, limits).duration, rel=1e-12
    )


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_lines_and_arcs_of_any_size(scale):
    path = Path(
        [
            line((0, 0), (20 * scale, 0)),
            arc((20 * scale, 5 * scale), 5 * scale, -np.pi / 2, np.pi / 2),
            line((25 * scale, 5 * scale), (25 * scale, 20 * scale)),
            line((25 * scale, 20 * scale), (0, 20 * scale)),
            arc((0, 10 * scale), 10 * scale, np.pi / 2, np.pi / 2),
        ],
        tolerance=1e-6 * max(scale, 1.0),
    )
    assert len(path.stops) == 1
    feed = 60 * max(scale, 1e-3)
    law = checked(path, sf.Limits(feed=feed, axis_acceleration=10 * feed, axis_jerk=300 * feed))
    assert float(law.feed(law.breaks[np.argmin(np.abs(law(law.breaks) - path.stops[0]))])) <= 1e-6 * feed


def test_tangential_limits_alone_and_all_at_once():
    path = motions.smooth()
    limits = sf.Limits(feed=60, acceleration=500, deceleration=300, jerk=20000)
    best = sf.plan(path, limits).duration
    assert best * (1 - 1e-9) <= checked(path, limits).duration <= 1.03 * best
    checked(PATHS["butterfly"], sf.Limits(feed=60, acceleration=500, jerk=20000, chord_error=1e-4, centripetal=200))
    everything = sf.Limits(
        feed=50, acceleration=400, deceleration=300, jerk=9000, chord_error=2e-4, centripetal=250,
        axis_velocity={"x": 45, "y": 40}, axis_acceleration={"x": 300, "y": 450}, axis_jerk={"x": 15000, "y": 8000},
    )  # fmt: skip
    checked(PATHS["butterfly"], everything)


def test_a_rotary_axis_keeps_its_own_limits():
    path = sf.paths.tangential(sf.shapes.naca("0025", chord=15.5))
    turns = {"axis_velocity": {"theta": 3.0}, "axis_acceleration": {"theta": 40.0}, "axis_jerk": {"theta": 2000.0}}
    law = checked(path, sf.Limits(feed=20, acceleration=300, jerk=9000, **turns))
    free = checked(path, sf.Limits(feed=20, acceleration=300, jerk=9000))
    assert free.duration < law.duration < 10 * free.duration


def test_the_feed_of_each_curve():
    curves = [line((0, 0), (30, 0)), line((30, 0), (60, 0)), arc((60, 9), 9, -np.pi / 2, np.pi / 2)]
    path = Path(curves, feeds=[40.0, 10.0, np.inf])
    law = checked(path, sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000))
    t = np.linspace(0, law.duration, 20_001)
    slow = (law(t) > 30) & (law(t) < 60)
    assert np.max(law.feed(t[slow])) <= 10 * (1 + 1e-9)
    assert np.max(law.feed(t[law(t) < 30])) > 39


def random_path(rng: np.random.Generator) -> Path:
    degree = int(rng.integers(1, 6))
    count = degree + 1 + int(rng.integers(0, 15))
    axes = int(rng.integers(2, 4))
    points = np.cumsum(rng.normal(size=(count, axes)), axis=0) * 10 ** rng.uniform(-1, 2)
    knots = np.r_[np.zeros(degree + 1), np.sort(rng.random(count - degree - 1)), np.ones(degree + 1)]
    weights = rng.uniform(0.3, 3, count) if rng.random() < 0.5 else None
    return Path([sf.NurbsCurve(degree, knots, points, weights)])


def random_limits(rng: np.random.Generator, path: Path) -> sf.Limits:
    """Limits of axes, along the path, or of both, with or without chord error, centripetal and feed of an axis."""
    size = path.length
    feed = size * 10 ** rng.uniform(-1.5, 0.5)
    acceleration = feed * 10 ** rng.uniform(0, 1.5)
    jerk = acceleration * 10 ** rng.uniform(0.5, 2)
    kind = rng.integers(0, 4)
    values: dict[str, object] = {"feed": feed}
    if kind != 1:
        values |= {"axis_acceleration": acceleration, "axis_jerk": jerk}
    if kind == 1 or kind == 2:
        values |= {"acceleration": acceleration, "jerk": jerk, "deceleration": acceleration * rng.uniform(0.3, 3.0)}
    if kind == 3:
        values |= {
            "axis_velocity": feed * rng.uniform(0.3, 1.0),
            "centripetal": acceleration * rng.uniform(0.1, 1.0),
            "chord_error": 1e-6 * size * 10 ** rng.uniform(-1, 1),
        }
    return sf.Limits(**values)


def check_random(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = random_path(rng)
    limits = random_limits(rng, path)
    law = sf.plan(path, limits, strategy="look-ahead", period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, (seed, verdict.problems)


@pytest.mark.parametrize("block", [0, *(pytest.param(block, marks=pytest.mark.slow) for block in range(1, 10))])
def test_random_curves_and_limits(block):
    for seed in range(10 * block, 10 * block + 10):
        check_random(seed)


def test_bad_input():
    path = motions.smooth()
    with pytest.raises(sf.errors.LimitsError, match="the look-ahead strategy needs a limit on acceleration or jerk"):
        sf.plan(path, sf.Limits(feed=60), strategy="look-ahead")
    with pytest.raises(
        sf.errors.PlanError, match=r"start_feed is 60 mm/s; .* allow at most 1\d\.\d+ mm/s there; lower it"
    ):
        sf.plan(path, sf.Limits(feed=60, acceleration=1, jerk=1, start_feed=60), strategy="look-ahead")
    both = {"start_feed": 60, "end_feed": 50}
    with pytest.raises(sf.errors.PlanError, match=r"start_feed is 60 .*; and end_feed is 50 mm/s;") as refused:
        sf.plan(path, sf.Limits(feed=60, acceleration=1, jerk=1, **both), strategy="look-ahead")
    most = [float(each) for each in re.findall(r"allow at most (\S+) mm/s", str(refused.value))]
    both = dict(zip(both, most, strict=True))
    assert min(most) > 10.0
    sf.plan(path, sf.Limits(feed=60, acceleration=1, jerk=1, start_feed=both["start_feed"]), strategy="look-ahead")
    sf.plan(path, sf.Limits(feed=60, acceleration=1, jerk=1, end_feed=both["end_feed"]), strategy="look-ahead")
    jumping = Path([line((0, 0), (30, 0)), arc((30, 5), 5, -np.pi / 2, np.pi / 2)])
    with pytest.raises(sf.errors.LimitsError, match=r"the curvature jumps at s = 30 mm, where axis jerk is infinite"):
        sf.plan(jumping, sf.Limits(feed=60, axis_jerk=20000), strategy="look-ahead")

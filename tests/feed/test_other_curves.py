"""Time-optimal plans of curves that were hard to plan well: as fast as references, or as exact solutions, say."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import cases

import random_motions
import splinefeed as sf
from splinefeed.feed import corners
from splinefeed.feed.bounds import AxisLimits, feed_squared_bound
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.feed.square import Setting
from splinefeed.feed.window import nearby, solve
from splinefeed.geometry.path import Path

PERIOD = 1e-3
#: Seconds by IPOPT (third order, no convexity, 1500 nodes) or COPP (1000 nodes), whichever is faster, slowed as a whole
#: until their setpoints hold the limits: `benchmarks/peer_casadi.py`, `benchmarks/peer_copp.py`.
REFERENCE = {
    ("trident", "A"): 4.3464,
    ("trident", "B"): 2.4828,
    ("trident", "C"): 11.6763,
    ("star", "A"): 2.7918,
    ("star", "B"): 1.6592,
    ("star", "C"): 6.8354,
    ("heart", "A"): 2.5989,
    ("heart", "B"): 1.5496,
    ("heart", "C"): 6.0684,
    ("figure eight", "A"): 4.2153,
    ("figure eight", "B"): 2.5305,
    ("figure eight", "C"): 7.9349,
    ("airfoil 0025", "A"): 0.7851,
    ("airfoil 0025", "B"): 0.4563,
    ("airfoil 0025", "C"): 2.2587,
}


def clamped(points: np.ndarray, size: float, weights: np.ndarray) -> Path:
    """A cubic with even knots, its control points scaled to `size` mm."""
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, len(points) - 2), np.ones(3)])
    return sf.Path([sf.NurbsCurve(3, knots, points * (size / np.max(np.ptp(points, axis=0))), weights)])


def trident() -> Path:
    half = [(0, 0), (1, 4), (0.2, 7), (-2, 6), (-4, 5), (-3.5, 10), (-3, 12), (-2.6, 9), (-1, 7.5), (-0.4, 9)]
    points = np.array([*half, (0, 14), *((-x, y) for x, y in reversed(half))], dtype=float)
    weights = np.ones(len(points))
    weights[[5, 6, 10, 14, 15]] = 3.0
    return clamped(points, 60.0, weights)


def star() -> Path:
    k = np.arange(11)
    radius, angle = np.where(k % 2 == 0, 25.0, 9.0), 0.5 * np.pi + 0.2 * np.pi * k
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return clamped(points, float(np.max(np.ptp(points, axis=0))), np.where(k % 2 == 0, 4.0, 1.0))


def heart() -> Path:
    half = [(0, 0), (-3, 4), (-7, 7), (-6, 11), (-2, 12), (0, 8.5)]
    points = np.array([*half, *((-x, y) for x, y in reversed(half))], dtype=float)
    return clamped(points, 50.0, np.ones(len(points)))


SHAPES = {
    "trident": trident,
    "star": star,
    "heart": heart,
    "figure eight": lambda: sf.shapes.figure_eight(80.0),
    "airfoil 0025": lambda: sf.shapes.naca("0025", chord=15.5),
}


@pytest.mark.parametrize(("name", "setting"), REFERENCE)
def test_as_fast_as_other_planners_within_a_half_percent(name: str, setting: str) -> None:
    path, limits = SHAPES[name](), cases.axis_limits(setting)
    law = sf.plan(path, limits, "time-optimal", PERIOD)
    assert law.duration <= 1.005 * REFERENCE[name, setting]
    assert law.duration >= 0.99 * REFERENCE[name, setting]
    assert sf.check(sf.interpolate(path, law), path, limits, law).ok
    assert not law.notes


#: Seconds of random motions; before, each was much slower, or had a stretch at one slow feed.
RANDOM = {500394: 0.178, 500251: 1.457, 30266: 0.516, 70243: 0.292, 70297: 1.940}


@pytest.mark.parametrize("seed", RANDOM)
def test_cusps_tight_loops_and_uneven_jerk_do_not_force_a_crawl(seed: int) -> None:
    made = random_motions.motion(seed)
    law = sf.plan(made.path, made.limits, "time-optimal", made.period)
    assert law.duration <= 1.005 * RANDOM[seed] + made.period
    assert not law.notes
    assert sf.check(sf.interpolate(made.path, law), made.path, made.limits, law).ok


@pytest.mark.parametrize("bend", [0.0, 1e-3, 1.0, 99.0, 100.0, 101.0, 1e9, np.inf])
def test_a_step_of_twice_the_chord_error_is_allowed_however_the_path_bends(bend: float) -> None:
    limits = sf.Limits(feed=1e6, acceleration=1.0, jerk=1.0, chord_error=0.01)
    axes = AxisLimits.of(limits, ("x", "y"))
    first, second = np.array([[1.0, 0.0]]), np.array([[0.0, bend]])
    step = np.sqrt(feed_squared_bound(first, second, np.array([1e6]), limits, axes, PERIOD, 2)[0]) * PERIOD
    assert step >= 2.0 * 0.01 * (1 - 1e-12)
    if 0.0 < bend <= 100.0 and step < 1e3:
        radius = 1.0 / bend  # a chord of that length on the circle strays by just the chord error
        assert radius - np.sqrt(radius**2 - 0.25 * step**2) == pytest.approx(0.01, rel=1e-6)


def test_under_uneven_jerk_the_optimiser_comes_near_the_exact_profile() -> None:
    """One axis from a reversal to the next: the exact motion is known."""
    made = random_motions.motion(70297)
    path, limits, none = made.path, made.limits, np.zeros(0)
    setting = Setting(limits, AxisLimits.of(limits, path.axes), made.period, none, none, none)
    low, high = path.stops[:2]
    exact = SevenPhase.solve(high - low, limits).law().duration
    found = solve(path, low, high, (0.0, 0.0), setting)
    assert np.max(found.over) < 1 + 1e-4
    assert exact < found.pieces.duration < 1.016 * exact


def test_cells_nearby() -> None:
    marked = np.array([0, 0, 0, 1, 0, 0, 0, 0, 1], dtype=bool)
    assert nearby(marked, 0).tolist() == marked.tolist()
    assert nearby(marked, 2).tolist() == [False, True, True, True, True, True, True, True, True]
    assert not np.any(nearby(np.zeros(5, dtype=bool), 3))


def test_bends_are_found_the_same_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    curves, at = [], np.zeros(2)
    for off in (0.0, 1e-4, 1e-3, 1e-2, 3e-2):  # how far a cubic is from one with a cusp
        points = at + 10.0 * np.array([[0.0, 0.0], [1.0 + off, 1.0], [0.0, 1.0], [1.0, 0.0]])
        curves.append(sf.NurbsCurve.bezier(points))
        at = points[-1]
    path, limits = sf.Path(curves), sf.Limits(feed=60, axis_acceleration=500, axis_jerk=20000)
    axes = AxisLimits.of(limits, path.axes)
    whole = corners.find_corners(path, limits, axes, PERIOD)
    monkeypatch.setattr(corners, "ROWS_AT_ONCE", 1)
    parts = corners.find_corners(path, limits, axes, PERIOD)
    assert whole.rests >= 4
    np.testing.assert_array_equal(parts.sharp, whole.sharp)
    np.testing.assert_array_equal(parts.marks, whole.marks)

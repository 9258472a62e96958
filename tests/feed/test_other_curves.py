"""Time-optimal plans of curves that were hard to plan well: as fast as references, or as exact solutions, say."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import cases
from benchmarks.curves import ALLOWED, CURVES, REFERENCE
from scipy.optimize import brentq

import random_motions
import splinefeed as sf
from splinefeed.feed import corners
from splinefeed.feed.bounds import AxisLimits, feed_squared_bound
from splinefeed.feed.cells import Cells
from splinefeed.feed.seven_phase import SevenPhase
from splinefeed.feed.square import Setting
from splinefeed.feed.window import nearby, solve

PERIOD = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("name", "setting"), REFERENCE)
def test_as_fast_as_other_planners_within_a_half_percent(name: str, setting: str) -> None:
    path, limits = CURVES[name](), cases.axis_limits(setting)
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD)
    assert law.duration <= ALLOWED * REFERENCE[name, setting]
    assert law.duration >= 0.99 * REFERENCE[name, setting]
    assert sf.check(sf.interpolate(path, law), path, limits, law).ok
    assert not law.notes


#: Seconds of random motions; before, each was much slower, or had a stretch at one slow feed.
RANDOM = {500394: 0.178, 500251: 1.457, 30266: 0.516, 70243: 0.292, 70297: 1.940, 7009220: 14.131}


@pytest.mark.slow
@pytest.mark.parametrize("seed", RANDOM)
def test_cusps_tight_loops_and_uneven_jerk_do_not_force_a_crawl(seed: int) -> None:
    made = random_motions.motion(seed)
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period)
    assert law.duration <= 1.005 * RANDOM[seed] + made.period
    assert not law.notes
    assert sf.check(sf.interpolate(made.path, law), made.path, made.limits, law).ok


@pytest.mark.slow
def test_where_the_optimiser_finds_nothing_look_ahead_plans() -> None:
    """A rotary axis turns on next to where x stands: one slow feed would take 5e11 s, look-ahead 4 % over the bound."""
    made = random_motions.motion(30000, ("time-optimal",))
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period)
    assert law.strategy == "time-optimal" and "look-ahead" in law.notes[0]
    assert law.settings["lower_bound_s"] < law.duration < 1.05 * law.settings["lower_bound_s"]
    assert sf.check(sf.interpolate(made.path, law), made.path, made.limits, law).ok


def test_an_axis_that_turns_back_where_it_is_looked_at_is_not_still() -> None:
    made = random_motions.motion(5006840, ("time-optimal",))
    law = sf.plan(made.path, made.limits, strategy="time-optimal", period=made.period)
    verdict = sf.check(sf.interpolate(made.path, law), made.path, made.limits, law)
    assert verdict.ok, verdict.problems


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


@pytest.mark.parametrize("off", [1e-2, 3e-3, 1.3e-3])
def test_a_bend_between_all_places_of_a_cell_has_its_bound_of_the_feed(off: float) -> None:
    """A radius of 1.6 to 94 nm: only there the tangent is along x, whose velocity is limited."""
    path = sf.Path([sf.NurbsCurve.bezier(10.0 * np.array([[0.0, 0.0], [1.0 + off, 1.0], [0.0, 1.0], [1.0, 0.0]]))])
    limits = sf.Limits(feed=60.0, acceleration=500.0, jerk=20000.0, axis_velocity={"x": 15.0})
    found = corners.find_corners(path, limits, AxisLimits.of(limits, path.axes), PERIOD)
    assert found.rests == len(found.sharp) == 0
    tip, q = found.narrow[np.argmin(found.narrow[:, 1])]
    assert q == pytest.approx(15.0**2, rel=1e-6)
    u = brentq(lambda u: float(path.evaluate([0], [u], 1)[0, 1, 1]), 0.1, 0.9, xtol=1e-15)  # y' = 0
    assert tip == pytest.approx(float(path.arc_length([0], [u])[0]), abs=1e-9)
    law = sf.plan(path, limits, strategy="time-optimal", period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, limits, law=law).ok
    assert law.feed(float(brentq(lambda t: float(law(t)) - tip, 0.0, law.duration))) <= 15.0 * (1.0 + 1e-9)


def test_narrow_bends_count_in_the_cells_that_they_lie_in() -> None:
    limits, none = sf.Limits(feed=60.0, acceleration=500.0), np.zeros(0)
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0]])])
    narrow = np.array([[0.25, 9.0], [0.3, 4.0], [1.0, 7.0], [1.5, 1.0]])
    setting = Setting(limits, AxisLimits.of(limits, path.axes), PERIOD, none, none, none, narrow)
    edges = np.linspace(0.0, 1.0, 5)
    cells = Cells(path, np.zeros(4, dtype=np.int64), edges[:-1], edges[1:], edges)
    assert setting.narrow_tops(cells).tolist() == [np.inf, 4.0, np.inf, 7.0]

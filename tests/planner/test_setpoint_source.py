"""Setpoints without their path: played as they are, and overridden within the limits of the axes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import LimitsError
from splinefeed.planner.override.override import Override
from splinefeed.planner.override.reserve import with_reserve
from splinefeed.planner.override.setpoint_source import SetpointSource
from splinefeed.records import Array, Limits, Setpoints

LIMITS = Limits(feed=60, axis_acceleration=500, axis_jerk=20000)


@cache
def rows(reserve: bool) -> Setpoints:
    path = sf.shapes.from_text("naca:0025?perimeter=33")
    law = sf.plan(path, with_reserve(LIMITS) if reserve else LIMITS, strategy="time-optimal", period=1e-3)
    return sf.interpolate(path, law, method="arc-length")


def differences(position: Array) -> list[float]:
    """Largest velocity, acceleration and jerk of an axis, from rest to rest."""
    still = np.concatenate([position[:1]] * 3 + [position] + [position[-1:]] * 3)
    return [float(np.max(np.abs(np.diff(still, order, axis=0)))) / 1e-3**order for order in (1, 2, 3)]


def test_at_100_percent_the_rows_come_out_as_they_are_but_for_a_sixth_of_their_second_difference() -> None:
    course = SetpointSource(rows(True), 2)
    override = Override(course, LIMITS)
    ticks = override.run(np.ones(5000))
    played = course.positions(np.append(0.0, ticks.tau))
    given = rows(True).position
    assert len(played) == len(given) + 2  # a period earlier and a period later
    np.testing.assert_allclose(played[[0, -1]], given[[0, -1]], atol=1e-12)
    away = float(np.max(np.abs(played[1:-1] - given)))
    assert away <= course.beside * (1 + 1e-9)
    assert course.beside < 500 * 1e-6 / 6
    assert differences(played)[2] <= differences(given)[2] * (1 + 1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_no_script_takes_rows_over_a_limit_of_the_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    limits = replace(LIMITS, feed=120.0)
    course = SetpointSource(rows(True), 2)
    override = Override(course, limits, rate=0.5)
    wanted = np.repeat(rng.uniform(-1 if seed % 2 else 0, 2, 60), rng.integers(10, 90))
    ticks = override.run(np.concatenate([wanted, np.ones(20000)]))
    assert override.done
    played = course.positions(np.append(0.0, ticks.tau))
    _, acceleration, jerk = differences(played)
    assert acceleration <= 500 * (1 + 1e-9)
    assert jerk <= 20000 * (1 + 1e-5)  # the rounding of positions of 16 mm is 1e-5 of this jerk
    np.testing.assert_allclose(played[-1], rows(True).position[-1], atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_no_script_takes_rows_over_a_limit_of_a_combination(seed: int) -> None:
    rng = np.random.default_rng(seed)
    belt = sf.records.Combination(weights={"x": 1.0, "y": 1.0}, velocity=75.0, acceleration=760.0, jerk=26000.0)
    limits = replace(LIMITS, feed=120.0, combinations={"belt": belt})
    course = SetpointSource(rows(True), 2)
    override = Override(course, limits, rate=0.5)
    wanted = np.repeat(rng.uniform(0, 2, 60), rng.integers(10, 90))
    ticks = override.run(np.concatenate([wanted, np.ones(20000)]))
    assert override.done
    played = course.positions(np.append(0.0, ticks.tau))
    velocity, acceleration, jerk = differences(played @ [[1.0], [1.0]])
    assert velocity <= 75.0 * (1 + 1e-9)
    assert acceleration <= 760.0 * (1 + 1e-9)
    assert jerk <= 26000.0 * (1 + 1e-5)
    free = Override(SetpointSource(rows(True), 2), replace(LIMITS, feed=120.0), rate=0.5)
    free_ticks = free.run(np.concatenate([wanted, np.ones(20000)]))
    assert len(free_ticks) < len(ticks)  # the belt is what holds it back


def test_rows_that_use_all_of_a_limit_are_refused_and_the_override_is_told_that_can_be_held() -> None:
    course = SetpointSource(rows(False), 2)
    with pytest.raises(LimitsError, match=r"leaves no reserve to slow down; .* or run it at 8\d % at most"):
        Override(course, LIMITS)
    override = Override(course, LIMITS, highest=0.8)
    ticks = override.run(np.r_[np.ones(500), np.zeros(500), np.ones(9000)])
    assert override.done
    played = course.positions(ticks.tau)
    assert differences(played)[1] <= 500 * (1 + 1e-9)
    assert np.max(ticks.rate) == 0.8
    assert np.min(ticks.rate) == 0.0


def test_limits_that_only_a_path_can_hold_are_refused() -> None:
    with pytest.raises(LimitsError, match="jerk cannot be held for setpoints without their path"):
        Override(SetpointSource(rows(True), 2), replace(LIMITS, jerk=100.0))


def test_rows_that_begin_in_motion_are_refused() -> None:
    with pytest.raises(LimitsError, match="begin or end in motion"):
        SetpointSource(rows(True).part(300, 600), 2)

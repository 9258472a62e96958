"""Limits that are out of all proportion to each other: the plan keeps them, as the independent check says."""

from __future__ import annotations

import math

import numpy as np
import pytest

import splinefeed as sf

PERIOD = 1e-3
LINE = [(0, 0), (10, 0)]
CURVE = [(0, 0), (3, 1), (7, -2), (10, 4)]


def held(path: sf.Path, limits: sf.Limits, strategy: str) -> float:
    """The duration, s, of a plan in which the check finds nothing."""
    law = sf.plan(path, limits, strategy=strategy, period=PERIOD)
    verdict = sf.check(sf.interpolate(path, law), path, limits, law=law)
    assert verdict.ok, verdict.problems
    return law.duration


@pytest.mark.parametrize("strategy", ["seven-phase", "look-ahead"])
@pytest.mark.parametrize("ratio", [1e-8, 1e-10])
@pytest.mark.parametrize("push", [1.0, 100.0])
def test_jerk_that_builds_up_acceleration_within_the_rounding_of_instants(strategy, ratio, push):
    limits = sf.Limits(feed=50, acceleration=push, jerk=push / ratio)
    straight = sf.Path([sf.NurbsCurve.bezier(LINE)])
    assert held(straight, limits, strategy) <= 1.001 * 2.0 * math.sqrt(10.0 / push) + PERIOD
    held(sf.Path([sf.NurbsCurve.bezier(CURVE)]), limits, strategy)
    corner = sf.Path([sf.NurbsCurve.bezier(LINE), sf.NurbsCurve.bezier([(10, 0), (10, 7)])])
    held(corner, limits, strategy)


@pytest.mark.parametrize("chord", [1e-5, 1e-6, 1e-7, 1e-9])
@pytest.mark.parametrize("angle", [1e-7, 1e-6, 1e-5, 9e-5])
def test_a_chord_error_across_turns_that_are_no_stops(chord, angle):
    """A step d across a turn leaves it by up to d angle/4."""
    course = np.array([math.cos(angle), math.sin(angle)])
    curves = [sf.NurbsCurve.bezier(LINE), sf.NurbsCurve.bezier([(10, 0), np.array([10, 0]) + 10.0 * course])]
    path = sf.Path(curves)
    limits = sf.Limits(feed=50, acceleration=500, jerk=10000, chord_error=chord)
    free = sf.plan(
        path, sf.Limits(feed=50, acceleration=500, jerk=10000), strategy="look-ahead", period=PERIOD
    ).duration
    assert held(path, limits, "look-ahead") <= 1.5 * free  # no slower than a stop there


def test_a_chord_error_across_many_slight_turns():
    """Facets of 9e-5 rad, two of them to a step: together they leave the chord by more than each alone."""
    angles = np.cumsum(np.full(80, 9e-5))
    points = np.vstack([[0, 0], np.cumsum(0.02 * np.column_stack([np.cos(angles), np.sin(angles)]), axis=0)])
    limits = sf.Limits(feed=40, acceleration=2000, jerk=200000, chord_error=3e-7)
    held(sf.Path.polyline(points), limits, "look-ahead")

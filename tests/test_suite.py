"""The suite of problems: its judge on motions that are known, and one of its problems from file to table."""

from __future__ import annotations

import json

import numpy as np
import pytest
from benchmarks.suite import __main__ as suite
from benchmarks.suite.judge import judge
from benchmarks.suite.make import PROBLEMS

import splinefeed as sf


def problem(name):
    return json.loads((PROBLEMS / f"{name}.json").read_text(encoding="utf-8"))


def test_there_are_as_many_problems_as_the_page_says():
    names = [file.stem for file in PROBLEMS.glob("*.json")]
    assert len(names) == 126
    assert sum(name.startswith("random7") for name in names) == 100


def test_the_judge_measures_as_the_check_does():
    given = problem("star-A")
    path, limits = suite.path_of(given), sf.Limits(**given["limits"])
    points = sf.interpolate(path, sf.plan(path, limits, period=1e-3))
    found = judge(given, points.position)
    verdict = sf.check(points, path, limits)
    assert found["time_s"] == pytest.approx(points.t[-1], rel=1e-12)
    assert found["off_curve"] < 1e-9
    for name in ("axis_acceleration", "axis_jerk"):
        share = max(each.share for key, each in verdict.limits.items() if key.startswith(name))
        assert found[name] == pytest.approx(share, rel=1e-6)


def test_the_judge_sees_a_limit_exceeded_and_a_place_off_the_curve():
    given = problem("program-mach3")
    path = suite.path_of(given)
    s = np.linspace(0.0, path.length, 101)
    r = path(s)
    r[50] += np.array([0.0, 0.0, 0.01])
    found = judge(given, r)
    assert found["off_curve"] == pytest.approx(0.01, rel=1e-6)
    assert found["feed"] > path.length / 0.1 / given["limits"]["feed"] * 0.999
    assert found["axis_jerk"] > 1.0  # it starts at full feed


def test_a_problem_of_seven_axes_is_planned_and_judged():
    given = problem("random7-00")
    path = suite.path_of(given)
    profile = suite.planners(given, path, 100)["splinefeed `time-optimal`"]()
    found = judge(given, suite.setpoints(path, profile, given["period"]))
    assert max(found[name] for name in suite.SHARES) <= 1.0 + 1e-6
    assert found["off_curve"] < 1e-9

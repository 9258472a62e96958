"""JointTrajectory: what a controller's quintics make of its points, re-implemented from its documentation."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT
from six_joints import LIMITS, START, urdf

FILE = ROOT / "tests/data/two-link.urdf"
WAYPOINTS = np.array([[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0.4, 1.6], [-0.6, 0.7], [0, 0.5]])
PERIOD = 1e-3


def interpolated(message, t):
    """Joints (n, joints) at times (n,) as ros2_controllers' quintic has them: solved for, not by its formulas."""
    points = message["points"]
    times = np.array([p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points])
    states = [np.array([p[key] for p in points]) for key in ("positions", "velocities", "accelerations")]
    i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    found = np.empty((len(t), len(message["joint_names"])))
    for k in np.unique(i):
        h = times[k + 1] - times[k]
        matrix = np.zeros((6, 6))
        matrix[[0, 1, 2], [0, 1, 2]] = 1, 1, 2
        matrix[3] = 1
        matrix[4, 1:] = np.arange(1, 6)
        matrix[5, 2:] = [2, 6, 12, 20]
        ends = [state[k + end] * h**order for end in (0, 1) for order, state in enumerate(states)]
        c = np.linalg.solve(matrix, np.array(ends))
        inside = i == k
        x = (t[inside] - times[k]) / h
        found[inside] = (x[:, None] ** np.arange(6)) @ c
    return found


def moved(path, limits, **how):
    law = sf.plan(path, limits, period=PERIOD)
    return law, sf.robots.joint_trajectory(path, law, limits, **how)


@pytest.mark.parametrize("along", [False, True], ids=["waypoints", "tip"])
def test_the_controllers_quintics_keep_path_and_limits(along):
    arm = sf.robot(urdf(), limits=LIMITS, torque=False) if along else sf.robot(FILE, torque=False)
    place = arm.forward(START)[0] if along else None
    net = None if place is None else place + np.array([[0, 0, 0], [0, 60, 0], [80, 60, 30], [80, -60, 0], [0, 0, 0]])
    knots = [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]
    path = arm.along(sf.NurbsCurve(4, knots, net), start=START) if along else arm.through(WAYPOINTS)
    law, points = moved(path, arm.limits)
    message = points.as_dict()
    assert message["joint_names"] == list(arm.joints)
    assert message["points"][-1]["time_from_start"]["sec"] == int(law.duration)
    ticks = np.arange(round(law.duration / PERIOD) + 1) * PERIOD
    q = interpolated(message, ticks)
    wanted = sf.interpolate(path, law).position
    assert np.abs(q - wanted).max() <= 2e-6
    assert len(points) < 0.25 * len(ticks)
    q = np.concatenate([np.ones((3, 1)) * q[0], q, np.ones((3, 1)) * q[-1]])
    for order, limit in enumerate((arm.velocity, arm.acceleration, arm.jerk), 1):
        assert np.max(np.abs(np.diff(q, order, axis=0)) / PERIOD**order / limit) <= 1.001


def between_points(points, limits, count=401):
    """Largest share of velocity, acceleration and jerk of the controller's quintics, at many times between points."""
    worst = np.zeros(3)
    for k, h in enumerate(np.diff(points.t)):
        states = points.position, points.velocity, points.acceleration
        ends = [state[k + end] * h**order for end in (0, 1) for order, state in enumerate(states)]
        matrix = np.empty((6, 6))
        for row, (end, order) in enumerate([(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]):
            matrix[row] = [np.polyval(np.polyder([1.0] + [0.0] * power, order), end) for power in range(6)]
        c = np.linalg.solve(matrix, np.array(ends))
        x = np.linspace(0, 1, count)
        for order in (1, 2, 3):
            found = np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyder(c, order)).T / h**order
            worst[order - 1] = max(worst[order - 1], np.max(np.abs(found) / limits[order - 1]))
    return worst


@pytest.mark.parametrize("jerk", [500.0, 5000.0], ids=["slow", "steep"])
@pytest.mark.parametrize("period", [1e-3, 4e-3])
def test_the_limits_hold_between_points_too(jerk, period):
    """Jerk that jumps within a period made quintics swing 36 % beyond the limit, whose points were a period apart."""
    arm = sf.robot(FILE, torque=False, limits={"acceleration": 15, "jerk": jerk})
    run = sf.run(arm.through(WAYPOINTS), arm.limits, period=period)
    points = sf.robots.joint_trajectory(run)
    worst = between_points(points, (arm.velocity, arm.acceleration, arm.jerk))
    assert np.all(worst <= 1.001)
    assert not points.notes
    assert points.off <= 1e-6
    said = [points.shares[f"axis_{kind}"] for kind in ("velocity", "acceleration", "jerk")]
    np.testing.assert_allclose(said, worst, rtol=1e-3)
    assert len(points) < 60 * run.duration


def test_a_receiver_that_needs_time_between_points_is_told_what_it_costs():
    arm = sf.robot(FILE, limits={"acceleration": 15, "jerk": 5000, "torque": 60})
    run = sf.run(arm.through(WAYPOINTS), arm.limits, period=PERIOD)
    points = sf.robots.joint_trajectory(run, shortest=4e-3)
    assert np.min(np.diff(points.t)) >= 3.999e-3
    worst = between_points(points, (arm.velocity, arm.acceleration, arm.jerk))
    assert worst[2] > 1.01
    said = [re.match(r"axis_jerk: up to ([0-9.e+]+) % over", note) for note in points.notes]
    assert [float(each[1]) for each in said if each] == [pytest.approx(100 * (worst[2] - 1), rel=0.06)]
    assert "closer than 0.004 s they are not put" in points.notes[0]
    assert 0.0 < points.shares["torque"] <= 1.0
    with pytest.raises(sf.errors.InputError, match="shortest is 1e-06; expected a time between points of at least"):
        sf.robots.joint_trajectory(run, shortest=1e-6)


def test_json_and_yaml_say_the_same_in_rad_and_metres(tmp_path):
    yaml = pytest.importorskip("yaml", reason='pip install "splinefeed[robots]"')
    rail = """<robot name="rail"><link name="a"/><link name="b"/><link name="c"/>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="turn" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint></robot>"""
    limits = {"velocity": [500, 2], "acceleration": [2000, 10], "jerk": [40000, 200]}
    arm = sf.robot(rail, limits=limits, torque=False)
    _, points = moved(arm.through([[0, 0], [250, 1], [500, 0.5]]), arm.limits)
    points.save(tmp_path / "move.json")
    points.save(tmp_path / "move.yaml")
    one = json.loads((tmp_path / "move.json").read_text())
    assert one == yaml.safe_load((tmp_path / "move.yaml").read_text()) == points.as_dict()
    assert one["points"][-1]["positions"] == pytest.approx([0.5, 0.5])
    with pytest.raises(sf.errors.FormatError, match=r"move\.xml: a JointTrajectory is written as \.json or \.yaml"):
        points.save("move.xml")


def test_a_run_has_all_that_it_needs():
    arm = sf.robot(FILE, torque=False)
    run = sf.run(arm.through(WAYPOINTS), arm.limits, period=PERIOD)
    assert len(sf.robots.joint_trajectory(run)) > 10
    with pytest.raises(sf.errors.InputError, match="give path, law and limits, or a Run"):
        sf.robots.joint_trajectory(run.path)
    with pytest.raises(sf.errors.InputError, match="tolerance is 0"):
        sf.robots.joint_trajectory(run, tolerance=0)


def test_states_at_any_times_are_those_of_differences():
    arm = sf.robot(FILE, torque=False)
    path = arm.through(WAYPOINTS)
    law = sf.plan(path, arm.limits, period=PERIOD)
    t, h = np.linspace(0.1, law.duration - 0.1, 41), 1e-6
    q, v, a, j = sf.robots.motion_at(path, law, t)
    low, high = sf.robots.motion_at(path, law, t - h), sf.robots.motion_at(path, law, t + h)
    np.testing.assert_allclose(q, path(law(t)), atol=1e-12)
    for k, known in enumerate((v, a)):
        np.testing.assert_allclose((high[k] - low[k]) / (2 * h), known, rtol=1e-5, atol=1e-5)
    with pytest.raises(sf.errors.InputError, match="t: expected times from 0 to"):
        sf.robots.motion_at(path, law, [law.duration + 1])
    assert j.shape == q.shape

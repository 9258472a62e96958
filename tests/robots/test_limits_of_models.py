"""Friction, rate of torque and velocity by position: kept by differences written anew, and binding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT

FILE = ROOT / "tests/data/two-link.urdf"
WAYPOINTS = np.array([[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0.4, 1.6], [-0.6, 0.7], [0, 0.5]])
PERIOD = 1e-3


def planned(arm, limits=None):
    path = arm.through(WAYPOINTS)
    limits = arm.limits if limits is None else limits
    law = sf.plan(path, limits, period=PERIOD)
    points = sf.interpolate(path, law)
    verdict = sf.check(points, path, limits, law=law)
    assert verdict.ok, verdict.problems
    q = points.position
    q = np.concatenate([np.ones((3, 1)) * q[0], q, np.ones((3, 1)) * q[-1]])
    v, a = (q[2:] - q[:-2]) / (2 * PERIOD), np.diff(q, 2, axis=0) / PERIOD**2
    return law, q, v, a


def test_friction_counts_in_the_direction_of_motion():
    friction = {"coulomb": [6.0, 2.0], "viscous": {"shoulder": 3.0, "elbow": 1.0}}
    tight = {"torque": [52, 20]}
    free, rough = (
        sf.robot(FILE, payload=2.0, limits=tight),
        sf.robot(FILE, payload=2.0, limits=tight, friction=friction),
    )
    law, q, v, a = planned(rough)
    moving = np.abs(v) > 1e-6
    whole = rough.torque(q[1:-1], v, a) + moving * np.sign(v) * [6.0, 2.0] + v * [3.0, 1.0]
    share = np.abs(whole) / [52, 20]
    assert share.max() <= 1 + 1e-6
    assert share.max() > 0.995
    without, q, v, a = planned(free)
    assert law.duration > 1.02 * without.duration
    beyond = np.abs(free.torque(q[1:-1], v, a) + np.sign(v) * (np.abs(v) > 1e-6) * [6.0, 2.0] + v * [3.0, 1.0])
    assert np.max(beyond / [52, 20]) > 1.05  # the plan that counts no friction


def test_torques_change_no_faster_than_their_rate():
    arm = sf.robot(FILE, payload=2.0, limits={"torque_rate": 400.0, "jerk": 5000.0})
    law, q, v, a = planned(arm)
    rate = np.diff(arm.torque(q[1:-1], v, a), axis=0) / PERIOD
    assert np.abs(rate).max() <= 400 * (1 + 1e-6)
    assert np.abs(rate).max() > 0.99 * 400
    without, q, v, a = planned(sf.robot(FILE, payload=2.0, limits={"jerk": 5000.0}))
    assert np.abs(np.diff(arm.torque(q[1:-1], v, a), axis=0) / PERIOD).max() > 2 * 400
    assert without.duration < law.duration


def most(q):
    return np.minimum(2.5, -0.2 + np.sqrt(np.maximum(6.0 * (1.65 - q), 0.0)))


def test_a_joint_slows_down_near_the_end_of_its_travel():
    arm = sf.robot(FILE)
    law_of = sf.records.VelocityByPosition(
        {"shoulder": lambda q: (-most(-q), most(q)), "elbow": lambda q: (-most(-q), most(q))}
    )
    limits = replace(arm.limits, modelled=[law_of, sf.records.Approach(law_of, {"shoulder": 40.0, "elbow": 40.0})])
    law, q, _, _ = planned(arm, limits)
    step = np.diff(q, axis=0) / PERIOD
    middle = 0.5 * (q[1:] + q[:-1])
    share = np.where(step > 0, step / most(middle), -step / most(-middle))
    assert share.max() <= 1 + 2e-4  # the law in the middle of a step is not its mean
    assert share.max() > 0.98
    a = np.maximum(np.sign(step[:-1]) * np.diff(step, axis=0) / PERIOD, 0)
    room = 40 * (np.where(step[:-1] > 0, most(q[:-2]), most(-q[:-2])) - np.abs(step[:-1]))
    near = a > 1e-3
    assert np.max((a / room)[near]) <= 1 + 1e-6
    free, q, _, _ = planned(arm)
    step, middle = np.diff(q, axis=0) / PERIOD, 0.5 * (q[1:] + q[:-1])
    assert np.max(np.where(step > 0, step / most(middle), -step / most(-middle))) > 1.1
    assert free.duration < law.duration


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"friction": {"coulomb": -1}}, "friction: coulomb of shoulder is -1; expected a finite number greater than 0"),
        ({"friction": {"dry": 1}}, "friction: 'dry' is not known; "),
        ({"friction": 3}, "friction is 3; give a mapping such as {'coulomb': 2.0, 'viscous': 1.0}"),
        (
            {"limits": {"torque_rate": 0}},
            "limits: torque_rate of shoulder is 0; expected a finite number greater than 0",
        ),
    ],
)
def test_friction_and_rates_that_cannot_be_are_refused(given, message):
    with pytest.raises(sf.errors.LimitsError) as error:
        sf.robot(FILE, **given)
    assert str(error.value).startswith(message)


def test_what_stands_still_must_carry_its_friction_and_its_weight():
    with pytest.raises(sf.errors.PlanError, match="standing still takes"):
        planned(sf.robot(FILE, payload=4.5, limits={"torque": [60, 25]}, friction={"coulomb": [40.0, 1.0]}))


def test_a_straight_move_counts_what_models_add():
    """One joint from end to end, without gravity: its torque is inertia and friction, and no closed form has it."""
    text = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""
    limits = {"velocity": 10.0, "acceleration": 10.0, "jerk": 1000.0, "torque": 12.0, "torque_rate": 200.0}
    arm = sf.robot(text, limits=limits, friction={"viscous": 2.0})
    path = arm.through([[0.0], [3.0]])
    law = sf.plan(path, arm.limits, period=PERIOD)
    points = sf.interpolate(path, law)
    assert sf.check(points, path, arm.limits, law=law).ok
    q = np.concatenate([np.ones(3) * points.position[0], points.position[:, 0], np.ones(3) * points.position[-1]])
    v, a = (q[2:] - q[:-2]) / (2 * PERIOD), np.diff(q, 2) / PERIOD**2
    assert 0.98 * 12 < np.max(np.abs(a + 2 * v)) <= 12 * (1 + 1e-6)
    assert np.max(np.abs(np.diff(a))) / PERIOD <= 200 * (1 + 1e-6)

"""An arm that is planned again in motion: other limits, feeds and payloads, paused again, with torque at every tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import splinefeed as sf
from docs_pages import ROOT
from six_joints import LIMITS, START, urdf

FILE = ROOT / "tests/data/two-link.urdf"
WAYPOINTS = np.array([[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0.4, 1.6], [-0.6, 0.7], [0, 0.5]])
PERIOD = 1e-3
ARM = sf.robot(urdf(), limits=LIMITS)
LOOP = [
    [0, 0, 0],
    [5, 15, 2],
    [20, 40, 8],
    [60, 50, 15],
    [80, 0, 20],
    [60, -50, 0],
    [20, -60, -10],
    [0, -30, 0],
    [0] * 3,
]
CURVE = sf.NurbsCurve(4, np.r_[[0.0] * 5, [0.2, 0.45, 0.5, 0.8], [1.0] * 5], ARM.forward(START)[0] + np.array(LOOP))
#: 0.2 rad about x and back.
SWING = Rotation.from_rotvec([[0.2 * np.sin(np.pi * k / 6) ** 2, 0, 0] for k in range(7)])
TURNS = (SWING * Rotation.from_matrix(ARM.forward(START)[1])).as_quat()


def worst(q, arm, torque=None):
    bounds = (arm.velocity, arm.acceleration, arm.jerk)
    found = [np.max(np.abs(np.diff(q, k, axis=0)) / PERIOD**k / most) for k, most in enumerate(bounds, 1)]
    if torque is not None:
        v, a = (q[2:] - q[:-2]) / (2 * PERIOD), np.diff(q, 2, axis=0) / PERIOD**2
        found.append(np.max(np.abs(arm.torque(q[1:-1], v, a)) / torque))
    return max(found)


def wanted(rng):
    rates = np.repeat(rng.choice([0, 1, 0.4, 1.5, -1], 8), rng.integers(50, 300, 8))
    return np.concatenate([rates, np.zeros(500), np.ones(6000)])


@pytest.mark.parametrize("share", [0.15, 0.4, 0.75])
@pytest.mark.parametrize("slowing", [0, 20], ids=["steady", "slowing"])
def test_along_a_curve_of_the_tip(share, slowing):
    rng = np.random.default_rng(int(100 * share) + slowing)
    path = ARM.along(CURVE, start=START, orientation=TURNS, feed=200.0)
    reserve = sf.planner.with_reserve(ARM.limits, acceleration=0.75)
    law = sf.plan(path, reserve, period=PERIOD)
    override = sf.planner.Override(sf.planner.LawSource(path, law), ARM.limits)
    ran = override.run([1.0] * int(share * law.duration / PERIOD) + [0.9] * slowing)
    state = override.state
    assert state.s == pytest.approx(law(ran.tau[-1]))
    rest = sf.plan(path, sf.planner.with_reserve(ARM.limits), period=PERIOD, start=state)
    again = sf.planner.Override(sf.planner.LawSource(path, rest), ARM.limits)
    more = again.run(wanted(rng))
    assert again.done
    s = np.concatenate([law(ran.tau), rest(more.tau)])
    assert np.all(np.diff(s) >= 0.0)  # it is not run backwards
    q = path(s)
    assert worst(q, ARM) <= 1 + 1e-6
    place, _ = ARM.forward(q)
    np.testing.assert_allclose(place, path.tool(s), atol=1e-9)


def test_waypoints_with_another_payload_keep_its_torques():
    heavy, light = (sf.robot(FILE, payload=mass, limits={"torque": [58, 25]}) for mass in (2.0, 0.0))
    path = heavy.through(WAYPOINTS)
    law = sf.plan(path, sf.planner.with_reserve(heavy.limits), period=PERIOD)
    for share in (0.2, 0.5, 0.8):
        override = sf.planner.Override(sf.planner.LawSource(path, law), heavy.limits)
        ran = override.run([1.0] * int(share * law.duration / PERIOD))
        rest = sf.plan(path, sf.planner.with_reserve(light.limits), period=PERIOD, start=override.state)
        assert rest.duration < law.duration - ran.tau[-1] + PERIOD
        again = sf.planner.Override(sf.planner.LawSource(path, rest), light.limits)
        more = again.run(wanted(np.random.default_rng(5)))
        q = path(np.concatenate([law(ran.tau), rest(more.tau)]))
        assert worst(q[len(ran) :], light, np.array([58.0, 25.0])) <= 1 + 1e-6
        assert worst(q, light) <= 1 + 1e-6


def test_a_lower_feed_is_reached_by_slowing_down_first():
    fast, slow = (ARM.along(CURVE, start=START, orientation=TURNS, feed=feed) for feed in (200.0, 80.0))
    law = sf.plan(fast, sf.planner.with_reserve(ARM.limits), period=PERIOD)
    override = sf.planner.Override(sf.planner.LawSource(fast, law), ARM.limits)
    override.run([1.0] * int(0.4 * law.duration / PERIOD))
    with pytest.raises(sf.errors.PlanError, match=r"do not allow a state of .* the nearest state they allow is"):
        sf.plan(slow, ARM.limits, period=PERIOD, start=override.state)
    override.run([0.3] * 300)
    rest = sf.plan(slow, ARM.limits, period=PERIOD, start=override.state)
    assert np.max(rest.feed(np.linspace(0, rest.duration, 2000))) <= 80 * (1 + 1e-6)


def test_what_cannot_be_is_refused():
    path = ARM.along(CURVE, start=START, feed=100.0)
    law = sf.plan(path, sf.planner.with_reserve(ARM.limits), period=PERIOD)
    override = sf.planner.Override(sf.planner.LawSource(path, law), ARM.limits)
    override.run([1.0] * 400 + [0.0] * 400)
    assert override.state == sf.planner.State(s=float(law(override.tau)))
    override.run([-1.0] * 100)
    with pytest.raises(sf.errors.LimitsError, match="state: the motion runs backwards; hold it first"):
        assert override.state
    moving = sf.plan(path, sf.planner.with_reserve(ARM.limits), period=PERIOD, start=sf.planner.State(20.0, 0.0, 30.0))
    with pytest.raises(sf.errors.LimitsError, match="a law that begins in motion is run from its start at the rate 1"):
        sf.planner.Override(sf.planner.LawSource(path, moving), ARM.limits, tau=0.1)
    with pytest.raises(sf.errors.InputError, match="the path ends at"):
        sf.plan(path, ARM.limits, period=PERIOD, start=replace(sf.planner.State(), s=1e6))


@pytest.mark.parametrize("share", [0.2, 0.45, 0.8])
@pytest.mark.parametrize("slowing", [0, 20], ids=["steady", "slowing"])
def test_a_law_planned_with_the_way_back_is_retraced_to_the_start_of_its_path(share, slowing):
    heavy, light = (sf.robot(FILE, payload=mass, limits={"torque": [58, 25]}) for mass in (2.0, 0.0))
    path = heavy.through(WAYPOINTS)
    law = sf.plan(path, sf.planner.with_reserve(heavy.limits, acceleration=0.7), period=PERIOD)
    override = sf.planner.Override(sf.planner.LawSource(path, law), heavy.limits)
    ran = override.run([1.0] * int(share * law.duration / PERIOD) + [0.8] * slowing)
    state = override.state
    rest = sf.plan(path, sf.planner.with_reserve(light.limits), period=PERIOD, start=state, back=True)
    begin = rest.settings["start_s"]
    passed = rest(begin), rest.feed(begin), rest.acceleration(begin)
    np.testing.assert_allclose(passed, (state.s, state.feed, state.acceleration), rtol=1e-9, atol=1e-7)
    again = sf.planner.Override(sf.planner.LawSource(path, rest), light.limits)
    assert again.tau == begin
    more = again.run([1.0] * 50 + [-1.0] * 6000 + [0.3] * 300 + [1.0] * 8000)
    s = rest(more.tau)
    turned = int(np.argmin(s))
    assert s[turned] == 0.0  # back at the start of the path, from where it goes on to its end
    assert again.done and s[-1] == pytest.approx(path.length)
    q = path(np.concatenate([law(ran.tau), s]))
    assert worst(q[len(ran) :], light, np.array([58.0, 25.0])) <= 1 + 1e-6
    assert worst(q, light) <= 1 + 1e-6


def test_the_tip_of_an_arm_is_retraced_on_its_curve():
    path = ARM.along(CURVE, start=START, orientation=TURNS, feed=200.0)
    law = sf.plan(path, sf.planner.with_reserve(ARM.limits, acceleration=0.75), period=PERIOD)
    override = sf.planner.Override(sf.planner.LawSource(path, law), ARM.limits)
    ran = override.run([1.0] * int(0.4 * law.duration / PERIOD))
    rest = sf.plan(path, sf.planner.with_reserve(ARM.limits), period=PERIOD, start=override.state, back=True)
    again = sf.planner.Override(sf.planner.LawSource(path, rest), ARM.limits)
    more = again.run(np.concatenate([[-1.0] * 4000, wanted(np.random.default_rng(3))]))
    s = np.concatenate([law(ran.tau), rest(more.tau)])
    assert again.done and np.min(s[len(ran) :]) == 0.0
    assert worst(path(s), ARM) <= 1 + 1e-6
    np.testing.assert_allclose(ARM.forward(path(s))[0], path.tool(s), atol=1e-9)


def test_a_way_back_has_a_start_and_a_state_that_limits_allow():
    path = ARM.along(CURVE, start=START, feed=100.0)
    with pytest.raises(sf.errors.LimitsError, match="back: leads from rest at the start of the path"):
        sf.plan(path, ARM.limits, period=PERIOD, back=True)
    at_start = sf.plan(path, ARM.limits, period=PERIOD, start=sf.planner.State(), back=True)
    assert "start_s" not in at_start.settings  # nothing lies behind it

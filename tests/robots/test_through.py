"""An arm through joint waypoints: where it passes, what it keeps, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT
from six_joints import LIMITS, urdf

FILE = ROOT / "tests/data/two-link.urdf"
WAYPOINTS = np.array([[0, 0.5], [0.8, -0.4], [1.5, 0.9], [0.4, 1.6], [-0.6, 0.7], [0, 0.5]])
PERIOD = 1e-3


def test_a_plan_through_waypoints_keeps_velocity_acceleration_jerk_and_torque_by_differences():
    arm = sf.robot(FILE, payload=2.0)
    path = arm.through(WAYPOINTS)
    law = sf.plan(path, arm.limits, period=PERIOD, bound=True)
    points = sf.interpolate(path, law)
    assert sf.check(points, path, arm.limits, law=law).ok
    q = points.position
    apart = np.linalg.norm(q[:, None] - WAYPOINTS, axis=2).min(axis=0)
    assert np.all(apart < 0.5 * np.linalg.norm(arm.velocity) * PERIOD)
    np.testing.assert_allclose(q[[0, -1]], WAYPOINTS[[0, -1]], atol=1e-12)
    steps = np.linalg.norm(np.diff(q, axis=0), axis=1)
    assert steps[100:-100].min() > 1e-4  # it rests at no waypoint between the ends
    still = np.ones((3, 1))
    whole = np.concatenate([still * q[0], q, still * q[-1]])
    v, a = (whole[2:] - whole[:-2]) / (2 * PERIOD), np.diff(whole, 2, axis=0) / PERIOD**2
    found = [np.diff(whole, k, axis=0) / PERIOD**k / most for k, most in enumerate((arm.velocity, arm.acceleration), 1)]
    found += [np.diff(whole, 3, axis=0) / PERIOD**3 / arm.jerk, arm.torque(whole[1:-1], v, a) / arm.most_torque]
    shares = [np.abs(each).max() for each in found]
    assert max(shares) <= 1 + 1e-6
    assert max(shares) > 0.99
    assert law.duration <= 1.01 * law.settings["lower_bound_s"]


def test_torque_slows_an_arm_that_lifts_as_much_as_it_can():
    """The shoulder's limit of 60 N m carries 17 N m of rods; 4.5 kg more at 700 mm take 31 N m."""
    free, loaded = (sf.robot(FILE, payload=mass, limits={"torque": [60, 25]}) for mass in (0.0, 4.5))
    laws = [sf.plan(arm.through(WAYPOINTS), arm.limits, period=PERIOD) for arm in (free, loaded)]
    assert laws[1].duration > 1.05 * laws[0].duration
    path = loaded.through(WAYPOINTS)
    verdict = sf.check(sf.interpolate(path, laws[1]), path, loaded.limits, law=laws[1])
    assert verdict.ok
    assert max(verdict.limits[f"torque.{name}"].share for name in loaded.joints) > 0.95


def test_an_arm_passes_waypoints_when_it_is_wanted_and_keeps_its_torques():
    from splinefeed.planner.timed import times_at

    arm = sf.robot(FILE, payload=2.0)
    wanted = [0, 0.9, np.nan, 2.4, 3.6, 5.0]
    path = arm.through(WAYPOINTS, times=wanted)
    law = sf.plan(path, arm.limits, period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, arm.limits, law=law).ok
    at = times_at(law, path.curve_starts)
    assert np.nanmax(np.abs(at - wanted)) <= 1.5 * PERIOD
    assert law.duration == 5.0
    with pytest.raises(sf.errors.PlanError, match=r"the motion takes at least \d\.\d+ s within its limits; 0\.5 s"):
        sf.plan(arm.through(WAYPOINTS, duration=0.5), arm.limits, period=PERIOD)


def test_an_arm_near_its_waypoints_is_faster():
    arm = sf.robot(FILE, payload=2.0)
    exact, near = arm.through(WAYPOINTS), arm.through(WAYPOINTS, near=[0.05, 0.02])
    assert np.max(np.abs(near(near.curve_starts) - WAYPOINTS), axis=0) == pytest.approx([0.05, 0.02])
    laws = [sf.plan(path, arm.limits, period=PERIOD) for path in (exact, near)]
    assert laws[1].duration < laws[0].duration
    assert repr(laws[0]).endswith(f"rad in {laws[0].duration:.6g} s)")


@pytest.mark.parametrize("count", [6, 12])
@pytest.mark.parametrize("seed", range(6))
def test_joints_stay_in_their_travel_between_waypoints_well_inside_it(count, seed):
    """A spline without natural ends swung up to 1.2 rad beyond the travel, and motions took 15 to 25 % longer."""
    arm = sf.robot(urdf(), limits=LIMITS, torque=False)
    waypoints = np.random.default_rng(seed).uniform(-0.6, 0.6, (count, 6)) * arm.maximum
    path = arm.through(waypoints)
    q = path(np.linspace(0, path.length, 4001))
    assert np.all(np.abs(q) <= arm.maximum)
    ends = np.array([path.curves[0].knots[0], path.curves[-1].knots[-1]])
    d = path.evaluate(np.array([0, count - 2]), ends, 3)
    starts = np.array([curve.knots[0] for curve in path.curves])
    size = np.max(np.abs(path.evaluate(np.arange(count - 1), starts, 3)), axis=(0, 2))
    assert np.all(np.abs(d[:, 3]) <= 1e-8 * size[3])  # natural: the third derivative is 0 at both ends


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([[0, 0]], "waypoints have shape (1, 2); expected 2 or more rows of 2 numbers: shoulder, elbow"),
        ([[0, 0], [0, np.nan]], "waypoint 2 has nan for elbow; give finite numbers"),
        ([[0, 0], [1, 1], [1, 1]], "waypoints 2 and 3 are the same; leave one out, or plan two paths for a stop"),
        ([[0, 0], [1, 2.7]], "waypoint 2 has elbow at 2.7 rad; its limits are -2.6 to 2.6"),
    ],
)
def test_waypoints_that_cannot_be_are_refused(waypoints, message):
    with pytest.raises(sf.errors.CurveError) as error:
        sf.robot(FILE).through(waypoints)
    assert str(error.value).startswith(message)

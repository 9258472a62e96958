"""An arm along a curve of its tip: exact, within its limits by differences, checked in full, refused with the place."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import splinefeed as sf
from six_joints import LIMITS, START, urdf
from splinefeed.robots.orientation import Orientation

PERIOD = 1e-3
ARM = sf.robot(urdf(), limits=LIMITS)
PLACE, TURN = ARM.forward(START)
NET = PLACE + np.array(
    [
        [0, 0, 0],
        [5, 15, 2],
        [20, 40, 8],
        [60, 50, 15],
        [80, 0, 20],
        [60, -50, 0],
        [20, -60, -10],
        [0, -30, 0],
        [0, 0, 0],
    ]
)
CURVE = sf.NurbsCurve(4, np.r_[[0.0] * 5, [0.2, 0.45, 0.5, 0.8], [1.0] * 5], NET)
#: 0.3 rad about a slanted axis and back.
SWING = [0.3 * np.sin(np.pi * k / 8) ** 2 * np.array([0.6, 0.8, 0]) for k in range(9)]
TURNS = np.array([(Rotation.from_rotvec(each) * Rotation.from_matrix(TURN)).as_quat() for each in SWING])


def angle_between(one, other):
    return np.max(np.linalg.norm(Rotation.from_matrix(one @ np.swapaxes(other, 1, 2)).as_rotvec(), axis=1))


@pytest.mark.parametrize("orientation", [None, TURNS], ids=["held", "turning"])
def test_setpoints_lie_on_the_curve_and_keep_every_limit_by_differences(orientation):
    path = ARM.along(CURVE, start=START, orientation=orientation, feed=300.0)
    law = sf.plan(path, ARM.limits, period=PERIOD, bound=True)
    points = sf.interpolate(path, law)
    verdict = sf.check(points, path, ARM.limits, law=law)
    assert verdict.ok, verdict.problems
    place, turned = ARM.forward(points.position)
    assert np.max(np.linalg.norm(place - CURVE(points.u), axis=1)) <= 1e-9  # mm: 1e-6 um
    wanted = np.tile(TURN, (len(points), 1, 1))
    if orientation is not None:
        share = points.s / path.length
        spline = Orientation.of(TURNS, 1.0).quaternions(share)
        wanted = Rotation.from_quat(spline).as_matrix()
    assert angle_between(turned, wanted) < 1e-12
    q = np.concatenate([np.ones((3, 1)) * points.position[0], points.position, np.ones((3, 1)) * points.position[-1]])
    shares = [np.abs(np.diff(q, k, axis=0)).max() / PERIOD**k / LIMITS[name] for k, name in enumerate(LIMITS, 1)]
    assert max(shares) <= 1 + 1e-6
    feed = np.linalg.norm(np.diff(place, axis=0), axis=1) / PERIOD
    assert feed.max() <= 300.0 * (1 + 1e-6)
    assert max(*shares, feed.max() / 300.0) > 0.99
    assert law.duration <= 1.005 * law.settings["lower_bound_s"] + PERIOD


def test_derivatives_are_those_of_differences():
    path = ARM.along(CURVE, start=START, orientation=TURNS)
    inside = np.linspace(0.03, 0.97, 29) * path.length
    away = np.min(np.abs(inside[:, None] - path.breaks), axis=1) > 0.5
    s, h = inside[away], 1e-2
    d = path.derivatives(s)
    low, high = path.derivatives(s - h), path.derivatives(s + h)
    for order in (1, 2, 3):
        own = (high[:, order - 1] - low[:, order - 1]) / (2 * h)
        np.testing.assert_allclose(d[:, order], own, rtol=1e-5, atol=1e-5 * np.abs(d[:, order]).max())


def test_the_check_sees_a_wrist_that_turns_about_the_tool():
    path = ARM.along(CURVE, start=START)
    law = sf.plan(path, ARM.limits, period=PERIOD)
    points = sf.interpolate(path, law)
    position = points.position.copy()
    position[:, 5] += 1e-6  # the tip and the axis of the tool stay where they are
    verdict = sf.check(replace(points, position=position), path, ARM.limits, law=law)
    assert not verdict.ok
    assert verdict.numbers["off_axis_max_rad"] == pytest.approx(1e-6, rel=1e-3)


def test_a_joint_that_is_held_stays_and_the_other_six_follow():
    """A rail under the arm, as a seventh joint."""
    rail = urdf().replace(
        '<link name="base"/>',
        '<link name="floor"/><link name="base"/><joint name="rail" type="prismatic"><parent link="floor"/>'
        '<child link="base"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="900"/></joint>',
    )
    arm = sf.robot(rail, limits=LIMITS, torque=False)
    start = np.array([100.0, *START])
    curve = CURVE.transformed(np.eye(3), [0, 100, 0])
    path = arm.along(curve, start=start, hold="rail")
    joints = path(np.linspace(0, path.length, 101))
    np.testing.assert_array_equal(joints[:, 0], 100.0)
    np.testing.assert_allclose(
        joints[:, 1:], ARM.along(CURVE, start=START)(np.linspace(0, path.length, 101)), atol=1e-12
    )
    with pytest.raises(sf.errors.InputError) as error:
        arm.along(curve, start=start)
    assert str(error.value) == (
        "hold: 7 joints are free, and a place with its orientation takes 6; hold 1 of rail, waist, shoulder, elbow, "
        "roll, pitch, flange"
    )


def test_inverse_finds_the_joints_of_a_place():
    found = ARM.inverse(PLACE + [40, 30, 20], None, START)
    place, turned = ARM.forward(found)
    np.testing.assert_allclose(place, PLACE + [40, 30, 20], atol=1e-9)
    np.testing.assert_allclose(turned, TURN, atol=1e-12)


def line(*ends):
    return sf.NurbsCurve(1, [0, 0, 1, 1], np.array(ends))


LINE = line(PLACE, PLACE + [500, 0, 0])


@pytest.mark.parametrize(
    ("how", "error", "parts"),
    [
        ({"curve": LINE}, "CurveError", ("at s = ", "of 500 mm", "the curve is out of reach by", "mm within")),
        (
            {"curve": CURVE.transformed(np.eye(3), [0, 0, 3])},
            "InputError",
            ("start: there the tip is 3.000 mm and 0.00000 rad",),
        ),
        ({"orientation": [0, 0, 0, 0]}, "InputError", ("orientation: quaternion 1 has length 0; give x, y, z, w",)),
        ({"orientation": np.diag([1, 1, -1])}, "InputError", ("orientation: the matrix is no rotation",)),
        ({"orientation": [1, 2]}, "InputError", ("orientation has shape (2,); expected",)),
        ({"hold": "wrist"}, "InputError", ("hold: the arm has no joint 'wrist'",)),
        ({"hold": "roll"}, "InputError", ("hold: 5 joints are free",)),
        ({"feed": -1}, "InputError", ("feed is -1; expected mm/s, greater than 0",)),
        ({"start": [0, 0, 0]}, "InputError", ("joints have shape (3,)",)),
        ({"start": [9, *START[1:]]}, "InputError", ("start has waist at 9 rad; its limits are -3.1 to 3.1",)),
    ],
)
def test_what_cannot_be_followed_is_refused_with_the_place(how, error, parts):
    given = {"curve": CURVE, "start": START, **how}
    with pytest.raises(getattr(sf.errors, error)) as found:
        ARM.along(given.pop("curve"), **given)
    for part in parts:
        assert part in str(found.value)


def test_a_start_beside_the_curve_is_refused_with_the_joints_to_begin_at():
    moved = CURVE.transformed(np.eye(3), [0, 0, 3])
    with pytest.raises(sf.errors.InputError, match=r"begin at \[") as found:
        ARM.along(moved, start=START)
    joints = json.loads(str(found.value).split("begin at ")[1])
    path = ARM.along(moved, start=joints, orientation=ARM.forward(START)[1])
    np.testing.assert_allclose(ARM.forward(path(0.0))[0], moved(0.0), atol=1e-3)
    far = CURVE.transformed(np.eye(3), [0, 0, 3000])
    with pytest.raises(sf.errors.InputError, match="from the start of the curve; begin with joints nearer to it"):
        ARM.along(far, start=START)


def test_a_straight_line_within_reach_is_followed():
    path = ARM.along(line(PLACE, PLACE + [60, 30, 0]), start=START)
    law = sf.plan(path, ARM.limits, period=PERIOD)
    assert sf.check(sf.interpolate(path, law), path, ARM.limits, law=law).ok


def test_a_wrist_that_would_be_stretched_is_singular_there():
    """The pitch joint goes through 0 where the tool points along the forearm: roll and flange are one axis then."""
    bent = np.array([0.0, 0.3, 0.2, 0.3, 0.3, 0.0])
    place, turn = ARM.forward(bent)
    straight = bent.copy()
    straight[4] = 0.0
    end, there = ARM.forward(straight)
    turns = Rotation.from_matrix([turn, there]).as_quat()
    with pytest.raises(sf.errors.CurveError, match="singular there"):
        ARM.along(line(place, end), start=bent, orientation=turns)


def test_the_arm_is_drawn_as_lines_from_its_base_to_its_tip():
    path = ARM.along(CURVE, start=START)
    assert path.drawn(41) is None  # beside the tip's path there is nothing but the arm
    run = sf.run(path, ARM.limits, period=PERIOD)
    t, lines = run.poses(7)
    joints = run.kept.position[np.searchsorted(run.kept.t, t)]
    np.testing.assert_array_equal(lines[:, 0], 0.0)
    np.testing.assert_allclose(lines[:, -1], ARM.forward(joints)[0], atol=1e-9)
    np.testing.assert_allclose(lines[:, 1], np.tile([0, 0, 300], (len(lines), 1)))
    assert not np.isnan(run.thread).any()


def test_one_number_for_limits_of_axes_reaches_every_joint():
    path = ARM.along(sf.NurbsCurve(1, [0, 0, 1, 1], PLACE + [[0, 0, 0], [60, 50, 15]]), start=START, feed=300.0)
    limits = sf.Limits(feed=300.0, axis_velocity=1.0, axis_acceleration=5.0, axis_jerk=50.0)
    verdict = sf.check(sf.interpolate(path, sf.plan(path, limits, period=PERIOD)), path, limits)
    assert verdict.ok, verdict.problems
    assert max(verdict.limits[f"axis_jerk.{name}"].share for name in path.axes) > 0.95
